//! `--material clay`, `--wireframe`, `--edges`, `--ortho` and `--section`: pictures for judging shapes.

use raywright::core::picture::Picture;

use super::backgrounds::{BLOCK, block};
use crate::support::Sandbox;

/// Renders the block from its front corner, in linear values, with these flags.
#[track_caller]
fn render(sandbox: &Sandbox, more: &str) -> Picture {
    let line =
        format!("render b.obj --view 30,30 -s 64x48 --spp 32 --ground none -q -o a.exr {more}");
    sandbox
        .run(&line.split_whitespace().collect::<Vec<_>>())
        .exits_with(0);
    sandbox.picture("a.exr")
}

/// Protects: clay is neutral whatever the file's materials are, in `explain` and in `render`, and
/// no other material name is known.
#[test]
fn clay_is_neutral() {
    let sandbox = block();
    let [red, clay] =
        ["", "--material clay"].map(|more| render(&sandbox, &format!("--backdrop dark {more}")));
    let middle = |picture: &Picture| picture.pixel(32, 24).expect("a pixel");
    let ([r, g, b], [cr, cg, cb]) = (middle(&red), middle(&clay));
    assert!(r > 3.0 * g && r > 3.0 * b, "{r} {g} {b}");
    assert!(
        (cr - cg).abs() < 1e-3 * cr && (cg - cb).abs() < 1e-3 * cr && cr > 0.05,
        "{cr} {cg} {cb}"
    );
    sandbox
        .run(&["explain", "b.obj", "--material", "clay"])
        .exits_with(0);
    sandbox
        .run(&["render", "b.obj", "--material", "wood"])
        .exits_with(2)
        .prints_like("expected `clay`");
}

/// Protects: edges are dark only on the first surface, also with clay and denoised; a film with
/// them is another picture; shapes without edges give a note.
#[test]
fn edges_are_drawn() {
    let sandbox = block();
    for more in [
        "",
        "--material clay",
        "--denoise",
        "--background transparent",
    ] {
        let [plain, lines] = ["", "--wireframe"]
            .map(|edges| render(&sandbox, &format!("--backdrop light {more} {edges}")));
        let darker = |i: usize| lines.rgb[i][0] < 0.8 * plain.rgb[i][0];
        let count = (0..plain.rgb.len()).filter(|&i| darker(i)).count();
        assert!((60..600).contains(&count), "{more}: {count}");
        assert_eq!(lines.rgb[0], plain.rgb[0]);
        assert_eq!(lines.alpha, plain.alpha, "{more}");
    }
    render(&sandbox, "--checkpoint plain.film");
    let gone_on = "render b.obj --view 30,30 -s 64x48 --spp 32 --ground none --wireframe --resume plain.film -q -o b.png";
    sandbox
        .run(&gone_on.split(' ').collect::<Vec<_>>())
        .exits_with(3)
        .prints_like("the wireframe differs");
    let ball = "format = 1\nmaterials = [{ name = \"m\", model.physical = {} }]\n[[objects]]\nshape.sphere = { centre = [0, 0, 0], radius = 1 }\n\
                material = \"m\"\n";
    sandbox.write("ball.scene.toml", ball);
    let triangle = ball.replace(
        "shape.sphere = { centre = [0, 0, 0], radius = 1 }",
        "shape.triangle = { vertices = [[-1, 0, 1], [1, 0, 1], [0, 1, -1]] }",
    );
    sandbox.write("triangle.scene.toml", triangle);
    let note = "--wireframe draws the edges of triangles";
    for (scene, is_noted) in [("ball.scene.toml", true), ("triangle.scene.toml", false)] {
        let words = format!("render {scene} --wireframe -s 8x8 --spp 1 -o c.png");
        let run = sandbox.run(&words.split(' ').collect::<Vec<_>>());
        run.exits_with(0);
        assert_eq!(
            run.stderr.contains(note),
            is_noted,
            "{scene}: {}",
            run.stderr
        );
    }
}

/// Protects: feature edges are lines over the picture, also denoised, transparent and in a file of
/// 8-bit codes; an .exr file has them as a layer; a section's cap has an outline; a film without them
/// is another picture.
#[test]
fn feature_edges_are_drawn() {
    let sandbox = block();
    let share = |picture: &Picture, i: usize| picture.layer("edges.V").expect("a layer").samples[i];
    for more in [
        "",
        "--denoise",
        "--background transparent",
        "--section x=0.5",
    ] {
        let [plain, lines] = ["", "--edges"]
            .map(|edges| render(&sandbox, &format!("--backdrop light {more} {edges}")));
        let pixels = 0..plain.rgb.len();
        // Nine edges of a block are visible, each some 20 pixels long; of half a block, shorter ones.
        let length: f32 = pixels.clone().map(|i| share(&lines, i).abs()).sum();
        assert!((110.0..260.0).contains(&length), "{more}: {length}");
        for i in pixels {
            let share = share(&lines, i);
            // Lines on the dark strokes of a hatched cap are bright.
            let radiance = if share < 0.0 { 0.6 } else { 0.01 };
            let share = share.abs();
            let [before, after] = [&plain, &lines].map(|picture| picture.rgb[i][0]);
            let expected = before + share * (radiance - before);
            assert!(
                (after - expected).abs() < 1e-4,
                "{more} {i}: {after} {expected}"
            );
            if let (Some(before), Some(after)) = (&plain.alpha, &lines.alpha) {
                let expected = before[i] + share * (1.0 - before[i]);
                assert!((after[i] - expected).abs() < 1e-4, "{more} {i}");
            }
        }
    }
    let png = "render b.obj --ortho --view front -s 60x60 --edges --material clay --ground none -q -o a.png";
    sandbox
        .run(&png.split(' ').collect::<Vec<_>>())
        .exits_with(0);
    let shown = sandbox.picture("a.png");
    // The square fills 0.78 of the picture: its left edge is 6.6 pixels from the picture's.
    let row: Vec<f32> = (0..14)
        .map(|x| shown.pixel(x, 30).expect("a pixel")[0])
        .collect();
    assert!(row[6] < 0.5 * row[2] && row[6] < 0.5 * row[12], "{row:?}");
    assert!((row[12] - row[10]).abs() < 0.1, "{row:?}");
    render(&sandbox, "--checkpoint plain.film");
    let gone_on = "render b.obj --view 30,30 -s 64x48 --spp 32 --ground none --edges --resume plain.film -q -o b.png";
    sandbox
        .run(&gone_on.split(' ').collect::<Vec<_>>())
        .exits_with(3)
        .prints_like("differs");
}

/// Protects: parallel views are to scale. A block's front covers a square of 0.78 of the picture and
/// hides its sides; the camera's distance changes nothing, the zoom enlarges; views and a scene's own
/// camera, which is not used, combine with it; a field of view contradicts it.
#[test]
fn parallel_views_are_to_scale() {
    let sandbox = block();
    sandbox.write(
        "own.scene.toml",
        "format = 1\nmodels = [{ file = \"b.obj\" }]\n[[cameras]]\nname = \"own\"\npose.look_at = { eye = [9, 9, 9], target = [0, 0, 0] }\nprojection.pinhole = { vertical_fov = 10 }\n",
    );
    let covered = |words: &str| {
        let line = format!("render {words} --ortho -s 100x80 --spp 1 -q -o a.exr --aov object");
        sandbox
            .run(&line.split_whitespace().collect::<Vec<_>>())
            .exits_with(0);
        let objects = &sandbox.picture("a.exr");
        let samples = &objects.layer("object.id").expect("a layer").samples;
        samples.iter().filter(|id| **id >= 0.0).count()
    };
    // 62.4 pixels, of which centres count.
    let edge = 62;
    assert_eq!(covered("b.obj --view front"), edge * edge);
    assert_eq!(covered("b.obj --view left"), edge * edge);
    assert_eq!(covered("own.scene.toml --view front"), edge * edge);
    for distance in ["2", "3", "1000"] {
        let words = format!("b.obj --eye 0.5,0.5,{distance} --target 0.5,0.5,0.5");
        assert_eq!(covered(&words), edge * edge, "{distance}");
    }
    assert_eq!(covered("b.obj --view front --zoom 0.5"), 32 * 32);
    let iso = covered("b.obj --view iso") as f64;
    // A hexagon, whose area is sqrt(3) of the face's, and its height sqrt(8/3) of the edge's.
    let expected = 3_f64.sqrt() * (0.78 * 80.0 / (8_f64 / 3.0).sqrt()).powi(2);
    assert!((iso / expected - 1.0).abs() < 0.02, "{iso} {expected}");
    assert_eq!(covered("own.scene.toml"), covered("b.obj"));
    let words = "render b.obj --ortho --views front,top,left --edges --material clay -s 24x16 --spp 2 --sheet s.png -q";
    sandbox
        .run(&words.split(' ').collect::<Vec<_>>())
        .exits_with(0);
    sandbox
        .run(&["render", "b.obj", "--ortho", "--fov", "30"])
        .exits_with(2)
        .prints_like("--fov");
}

/// Protects: a section keeps its side, with a hatched cap, in views, on sheets and with clay and
/// edges; an empty result ends with exit code 3, and open meshes are named.
#[test]
fn sections_are_capped() {
    let sandbox = block();
    // From +x, straight at the cap: as large as the original face, red or orange, and deeper by
    // the length of the cut.
    let depth = |more: &str| {
        let words = format!(
            "render b.obj --eye 5,0.5,0.5 --target 0,0.5,0.5 --fov 20 -s 32x32 --spp 16 -q -o a.exr --aov depth {more}"
        );
        sandbox
            .run(&words.split_whitespace().collect::<Vec<_>>())
            .exits_with(0);
        let picture = sandbox.picture("a.exr");
        let [r, g, b] = picture.pixel(16, 16).expect("a pixel");
        assert!(r > 2.5 * g && r > 3.0 * b, "{more}: {r} {g} {b}");
        f64::from(picture.layer("depth.Z").expect("a layer").samples[16 * 32 + 16])
    };
    for (section, expected) in [
        ("", 4.0),
        ("--section x=0.25", 4.75),
        ("--section x=25%", 4.75),
        ("--section -z=0.25", 4.0),
    ] {
        assert!(
            (depth(section) - expected).abs() < 0.01,
            "{section}: {}",
            depth(section)
        );
    }
    // The triangles of a cap are the program's, so that --wireframe does not draw their edges.
    let cap = |edges: &str| {
        let line = format!(
            "render b.obj --eye 5,0.5,0.5 --target 0,0.5,0.5 --fov 20 -s 32x32 --spp 16 -q -o a.exr --section x=0.25{edges}"
        );
        sandbox
            .run(&line.split(' ').collect::<Vec<_>>())
            .exits_with(0);
        sandbox.picture("a.exr")
    };
    let [plain, lines] = ["", " --wireframe"].map(cap);
    for (x, y) in (10..22).flat_map(|y| (10..22).map(move |x| (x, y))) {
        assert_eq!(plain.pixel(x, y), lines.pixel(x, y), "{x}, {y}");
    }
    let sheet = "render b.obj --section -y=0.5 --material clay --wireframe --views iso,front -s 24x16 --spp 2 --sheet s.png -q";
    sandbox
        .run(&sheet.split(' ').collect::<Vec<_>>())
        .exits_with(0);
    let nothing = sandbox.run(&["render", "b.obj", "--section", "x=-1", "-o", "n.png"]);
    nothing
        .exits_with(3)
        .prints_like("--section cuts away the whole model; choose another position");
    sandbox.write("open.obj", BLOCK.replace("f 1 4 3 2\n", ""));
    sandbox
        .run(&[
            "render",
            "open.obj",
            "--section",
            "x=0.5",
            "-s",
            "8x8",
            "--spp",
            "1",
        ])
        .exits_with(0)
        .prints_like("not closed");
    // With its cap, what is left is closed, also of a block far from the origin.
    for (at, place) in [(0.0, "y=0.25"), (5e6, "y=5000000.25"), (5e6, "y=25%")] {
        let moved = BLOCK.lines().map(|line| match line.strip_prefix("v ") {
            Some(place) => {
                let place: Vec<f64> = place.split(' ').filter_map(|x| x.parse().ok()).collect();
                format!("v {} {} {}\n", place[0] + at, place[1] + at, place[2] + at)
            }
            None => format!("{line}\n"),
        });
        sandbox.write("moved.obj", moved.collect::<String>());
        let info = sandbox.run(&["info", "moved.obj", "--section", place]);
        info.exits_with(0);
        assert!(
            info.text().contains("yes; size 1 x 0.25 x 1, volume 0.25"),
            "{}",
            info.text()
        );
        let far =
            "5000000.000, 5000000.0000, 5000000.000  to  5000001.000, 5000000.2500, 5000001.000";
        assert!(at == 0.0 || info.text().contains(far), "{}", info.text());
    }
    sandbox
        .run(&["render", "b.obj", "--section", "w=1"])
        .exits_with(2)
        .prints_like("x=30%");
    sandbox
        .run(&["info", "b.obj", "--section", "y=0.5", "--up", "z"])
        .exits_with(0);
}
