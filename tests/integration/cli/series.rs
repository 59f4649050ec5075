//! Several pictures in a run: of scenes, views and times, on a sheet, in an animation.

use std::fs::{self, File};
use std::io::BufReader;
use std::time::{Duration, Instant};

use image::codecs::png::PngDecoder;
use image::{AnimationDecoder, RgbaImage};

use crate::support::Sandbox;

const TETRAHEDRON: &str =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.3 0.2 1\nf 1 2 3\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const TRIANGLE: &str = "v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n";

/// A folder with two models.
fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("a.obj", TETRAHEDRON);
    sandbox.write("b.obj", TRIANGLE);
    sandbox
}

/// Protects: each of several pictures has the bits of a run of its own, for views, turntables and
/// times, and its requested name; flags for a single picture are refused with several.
#[test]
fn several_pictures_are_those_of_single_runs() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "a.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.3 0.2 1\nf 1 2 3\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
    );
    sandbox.write(
        "b.scene.toml",
        "format = 1\nsky.constant = 1\n[[materials]]\nname = \"m\"\nmodel.physical.base_colour = [\"0.2 + 0.5*t\", 0.5, 0.1]\n\
        [[objects]]\nmaterial = \"m\"\nshape.box = { min = [0, 0, 0], max = [\"1 + t\", 1, 1] }\n",
    );
    let run = |words: &[&str]| {
        sandbox
            .run(&[&["render", "--size", "24x16", "--spp", "8", "-q"], words].concat())
            .exits_with(0);
    };
    let same = |several: &str, words: &[&str]| {
        run(&[words, &["-o", "single.exr"]].concat());
        assert_eq!(
            sandbox.picture(several).rgb,
            sandbox.picture("single.exr").rgb,
            "{several}"
        );
    };
    run(&[
        "a.obj",
        "--views",
        "front,70,-20,top",
        "--fov",
        "20",
        "-o",
        "v%02d.exr",
    ]);
    for (several, view) in [
        ("v00.exr", "front"),
        ("v01.exr", "70,-20"),
        ("v02.exr", "top"),
    ] {
        same(several, &["a.obj", "--view", view, "--fov", "20"]);
    }
    run(&[
        "a.obj",
        "--turntable",
        "3",
        "--view",
        "0,30",
        "-o",
        "t%d.exr",
    ]);
    for (several, view) in [
        ("t0.exr", "0,30"),
        ("t1.exr", "120,30"),
        ("t2.exr", "240,30"),
    ] {
        same(several, &["a.obj", "--view", view]);
    }
    run(&["b.scene.toml", "--frames", "0..1:2", "-o", "f%04d.exr"]);
    same("f0000.exr", &["b.scene.toml", "--at", "0"]);
    same("f0001.exr", &["b.scene.toml", "--at", "0.5"]);
    run(&["a.obj", "--views", "left,iso"]);
    assert!(sandbox.path("a-left.png").exists() && sandbox.path("a-iso.png").exists());
    for words in [
        &["-o", "one.png"][..],
        &["--budget", "5s"],
        &["-o", "-"],
        &["--view", "top"],
    ] {
        sandbox
            .run(&[&["render", "a.obj", "--views", "left,iso"], words].concat())
            .exits_with(2);
    }
}

/// Protects: the summary of several pictures has the largest of their errors, in any order: from
/// below a tetrahedron has a third of that from one side.
#[test]
fn several_pictures_tell_their_largest_error() {
    let sandbox = sandbox();
    for views in ["bottom,iso", "iso,bottom"] {
        let words = [
            "render",
            "a.obj",
            "--size",
            "24x16",
            "--no-denoise",
            "--views",
            views,
            "-o",
            "v%d.png",
        ];
        sandbox
            .run(&words)
            .exits_with(0)
            .prints_like("(2 pictures, 24x16, 64 samples, errors up to 0.033, ");
    }
}

/// Protects: each of several files becomes a picture with the bits of a run of its own, under its
/// own name, even if two names are equal; `render` may be omitted, and one line covers all of them.
#[test]
fn several_files_are_rendered() {
    let sandbox = sandbox();
    fs::create_dir(sandbox.path("more")).expect("a folder");
    sandbox.write("more/a.obj", TRIANGLE);
    let run = sandbox.run(&["-s", "24x16", "a.obj", "b.obj", "more/a.obj", "--spp", "8"]);
    run.exits_with(0)
        .prints_like("wrote a.png to a-2.png (3 pictures, 24x16, 8 samples, errors up to ");
    assert_eq!(
        run.stderr
            .lines()
            .filter(|line| !line.starts_with("note: "))
            .count(),
        1,
        "{}",
        run.stderr
    );
    sandbox
        .run(&[
            "b.obj",
            "-s",
            "24x16",
            "--spp",
            "8",
            "-o",
            "single.png",
            "-q",
        ])
        .exits_with(0)
        .prints("");
    for name in ["b.png", "a-2.png"] {
        assert!(
            sandbox.picture(name).rgb == sandbox.picture("single.png").rgb,
            "{name}"
        );
    }
    assert!(sandbox.picture("a.png").rgb != sandbox.picture("single.png").rgb);
    sandbox
        .run(&[
            "-q", "render", "a.obj", "b.obj", "-s", "9x9", "-s", "24x16", "--spp", "8", "-o",
            "n%d.png",
        ])
        .exits_with(0)
        .prints("");
    assert!(sandbox.picture("n1.png").rgb == sandbox.picture("single.png").rgb);
    sandbox.run(&["a.obj", "b.obj", "-o", "n.png"])
        .exits_with(2)
        .prints("error: 2 pictures cannot all be written to the single file n.png\nhelp: number the files: -o n-%04d.png; or put all pictures on one sheet: --sheet n.png");
}

/// Protects: a requested view applies to each of several files.
#[test]
fn several_files_are_seen_from_one_view() {
    let sandbox = sandbox();
    let run = |words: &[&str]| {
        // One of them is flat and viewed edge-on.
        sandbox
            .run(&[&["-s", "24x16", "--spp", "8", "-q", "--allow-empty"], words].concat())
            .exits_with(0);
    };
    run(&["a.obj", "b.obj", "--view", "left", "-o", "v%d.exr"]);
    for (several, file) in [("v0.exr", "a.obj"), ("v1.exr", "b.obj")] {
        run(&[file, "--view", "left", "-o", "single.exr"]);
        assert_eq!(
            sandbox.picture(several).rgb,
            sandbox.picture("single.exr").rgb,
            "{several}"
        );
    }
}

/// Protects: a file that fails is reported and does not stop the others; the run ends with its exit
/// code.
#[test]
fn a_bad_file_among_others_is_told() {
    let sandbox = sandbox();
    sandbox.write("bad.scene.toml", "format = 1\nobjcts = []\n");
    let run = sandbox.run(&[
        "a.obj",
        "bad.scene.toml",
        "gone.glb",
        "b.obj",
        "-s",
        "8x8",
        "--spp",
        "1",
    ]);
    run.exits_with(3)
        .prints_like("unknown key `objcts`")
        .prints_like("error: cannot read gone.glb: no such file or folder");
    assert!(
        run.stderr
            .trim_end()
            .ends_with("error: 2 of 4 scenes were not rendered (see the errors above)"),
        "{}",
        run.stderr
    );
    assert_eq!(
        sandbox.names(),
        ["a.obj", "a.png", "b.obj", "b.png", "bad.scene.toml"]
    );
}

/// Protects: no picture replaces a file named by a later scene of the run.
#[test]
fn later_scenes_keep_their_files() {
    let sandbox = sandbox();
    image::GrayImage::new(4, 4)
        .save(sandbox.path("0.png"))
        .expect("a picture");
    let before = fs::read(sandbox.path("0.png")).expect("just written");
    sandbox.write(
        "sky.scene.toml",
        "format = 1\nimages = [{ name = \"a\", path = \"0.png\" }]\nsky.map.image = \"a\"\n",
    );
    let run = sandbox.run(&["a.obj", "sky.scene.toml", "-s", "8x8", "-o", "%d.png"]);
    run.exits_with(2)
        .prints("error: cannot write 0.png: this run reads it\nhelp: name another file with -o");
    assert_eq!(
        fs::read(sandbox.path("0.png")).expect("still there"),
        before
    );
}

/// Protects: a sheet holds all pictures of all files and is the only output unless others are
/// requested; its pictures are those of single runs.
#[test]
fn a_sheet_holds_all_pictures() {
    let sandbox = sandbox();
    let run = sandbox.run(&[
        "a.obj",
        "b.obj",
        "--views",
        "front,iso",
        "-s",
        "200x100",
        "--spp",
        "2",
        "--sheet",
        "s.png",
    ]);
    run.exits_with(0)
        .prints_like("wrote s.png (4 pictures, 200x100, 2 samples");
    assert_eq!(sandbox.names(), ["a.obj", "b.obj", "s.png"]);
    let sheet = sandbox.picture("s.png");
    // Two columns of two rows, each with a line of 24 pixels below it, and 12 pixels between all of
    // them.
    assert_eq!(
        [sheet.width, sheet.height],
        [3 * 12 + 2 * 200, 3 * 12 + 2 * (100 + 24)]
    );
    sandbox
        .run(&[
            "b.obj",
            "--view",
            "front",
            "-s",
            "200x100",
            "--spp",
            "2",
            "-o",
            "single.png",
        ])
        .exits_with(0);
    let single = sandbox.picture("single.png");
    for (x, y) in [(0, 0), (100, 50), (199, 99), (80, 60)] {
        assert_eq!(
            sheet.pixel(12 + x, 2 * 12 + 100 + 24 + y),
            single.pixel(x, y),
            "{x}, {y}"
        );
    }
    let ink = (0..200).flat_map(|x| (0..24).map(move |y| (x, y)));
    let ink = ink
        .filter(|&(x, y)| {
            sheet
                .pixel(12 + x, 12 + 100 + y)
                .is_some_and(|pixel| pixel[0] > 0.5)
        })
        .count();
    assert!(ink > 50, "{ink} pixels of `a front`");
    sandbox
        .run(&["a.obj", "--sheet", "s.exr"])
        .exits_with(2)
        .prints("error: s.exr: --sheet writes a PNG file; use a name that ends in .png\nhelp: --sheet s.png");
    sandbox
        .run(&[
            "a.obj", "b.obj", "-s", "8x8", "--spp", "1", "--sheet", "s.png", "-o", "p%d.png",
        ])
        .exits_with(0);
    assert!(sandbox.path("p1.png").exists());
}

/// Protects: an animation holds the pictures of single runs, in order and at the requested rate: an
/// APNG to the bit.
#[test]
fn animations_hold_each_picture() {
    let sandbox = sandbox();
    sandbox.write(
        "c.scene.toml",
        "format = 1\nsky.constant = 1\n[[materials]]\nname = \"m\"\nmodel.physical.base_colour = [\"0.2 + 0.5*t\", 0.5, 0.1]\n\
        [[objects]]\nmaterial = \"m\"\nshape.box = { min = [0, 0, 0], max = [\"1 + t\", 1, 1] }\n",
    );
    let all = ["c.scene.toml", "-s", "24x16", "--spp", "8"];
    let run = sandbox.run(
        &[
            &all[..],
            &["--frames", "0..1:3", "-o", "f.apng", "-o", "f.gif"],
        ]
        .concat(),
    );
    run.exits_with(0)
        .prints_like("wrote f.apng, f.gif (3 pictures, 24x16, 8 samples");
    let open = |name: &str| BufReader::new(File::open(sandbox.path(name)).expect("a file"));
    let decoder = PngDecoder::new(open("f.apng"))
        .expect("a PNG")
        .apng()
        .expect("animated");
    let frames = decoder.into_frames().collect_frames().expect("whole");
    assert_eq!(frames.len(), 3);
    for (frame, time) in frames
        .iter()
        .zip(["0", "0.3333333333333333", "0.6666666666666666"])
    {
        sandbox
            .run(&[&all[..], &["--at", time, "-o", "single.png"]].concat())
            .exits_with(0);
        let single: RgbaImage = image::open(sandbox.path("single.png"))
            .expect("a picture")
            .into_rgba8();
        assert_eq!(*frame.buffer(), single, "{time}");
        assert_eq!(
            Duration::from(frame.delay()),
            Duration::from_millis(333),
            "{time}"
        );
    }
    let mut gif = gif::DecodeOptions::new()
        .read_info(open("f.gif"))
        .expect("a GIF");
    let mut delays = Vec::new();
    while let Some(frame) = gif.read_next_frame().expect("whole") {
        assert_eq!([frame.width, frame.height], [24, 16]);
        delays.push(frame.delay);
    }
    assert_eq!(
        delays,
        [33, 34, 33],
        "hundredths of a second that add up to one"
    );
    sandbox
        .run(&["a.obj", "c.scene.toml", "-o", "f.gif", "--stats", "s.json"])
        .exits_with(2);
}

/// Protects: an interrupted run keeps the finished pictures under their names, the current one and
/// the partial sheet and animation under names that mark them, and no other file.
#[cfg(unix)]
#[test]
fn an_interrupted_run_keeps_what_is_finished() {
    let sandbox = sandbox();
    let words = [
        "a.obj",
        "b.obj",
        "--turntable",
        "200",
        "-s",
        "320x240",
        "--spp",
        "64",
        "--progress=none",
        "-o",
        "t%03d.png",
    ];
    let mut child = sandbox
        .command(&[&words[..], &["--sheet", "s.png", "-o", "t.gif"]].concat())
        .spawn()
        .expect("starts");
    let start = Instant::now();
    while !sandbox.path("t001.png").exists() {
        assert!(
            start.elapsed() < Duration::from_secs(120),
            "no picture is finished"
        );
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(
        std::process::Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status()
            .expect("kill runs")
            .success()
    );
    assert_eq!(child.wait().expect("ends").code(), Some(130));
    let names = sandbox.names();
    let finished = names
        .iter()
        .filter(|name| name.starts_with('t') && name.ends_with("png") && !name.contains("partial"))
        .count();
    assert!((2..200).contains(&finished), "{names:?}");
    for name in ["s.partial.png", "t.partial.gif"] {
        assert!(names.contains(&name.to_owned()), "{name} of {names:?}");
    }
    assert!(
        !names
            .iter()
            .any(|name| name == "s.png" || name == "t.gif" || name.starts_with('.')),
        "{names:?}"
    );
    let mut gif = gif::DecodeOptions::new();
    gif.set_color_output(gif::ColorOutput::Indexed);
    let mut gif = gif
        .read_info(File::open(sandbox.path("t.partial.gif")).expect("a file"))
        .expect("a GIF");
    let mut frames = 0;
    while gif.read_next_frame().expect("whole").is_some() {
        frames += 1;
    }
    assert_eq!(frames, finished);
}

/// Protects: an exposure chosen for a scene is not that of the next scene of the run.
#[test]
fn each_scene_has_its_own_exposure() {
    let sandbox = Sandbox::new();
    for (name, light) in [("bright", 40.0), ("dim", 0.5)] {
        let text = format!(
            "format = 1\nsky.constant = {light}\n[render]\nsize = [8, 8]\nsamples = 1\ntone_map = \"none\"\n"
        );
        sandbox.write(format!("{name}.scene.toml"), text);
    }
    let render = |words: &str| {
        let line = format!("render {words} --exposure auto -q");
        sandbox
            .run(&line.split(' ').collect::<Vec<_>>())
            .exits_with(0);
    };
    render("bright.scene.toml dim.scene.toml -o %d.png");
    render("dim.scene.toml -o single.png");
    assert_eq!(
        sandbox.picture("1.png").rgb,
        sandbox.picture("single.png").rgb
    );
}

/// Protects: a run that is interrupted while it reads a further scene keeps the sheet of its
/// finished pictures.
#[cfg(unix)]
#[test]
fn reading_keeps_the_sheet_when_interrupted() {
    let sandbox = sandbox();
    let corners = "v 0 0 0\nv 2 0 0\nv 0 1 0\n".repeat(1_000_000);
    sandbox.write("b.obj", corners + "f 1 2 3\n");
    let words = [
        "a.obj",
        "b.obj",
        "-s",
        "24x16",
        "--spp",
        "4",
        "--progress=none",
        "--sheet",
        "s.png",
        "-o",
        "p%d.png",
    ];
    let child = sandbox.command(&words).spawn().expect("starts");
    let start = Instant::now();
    while !sandbox.path("p0.png").exists() {
        assert!(start.elapsed() < Duration::from_secs(120), "no picture");
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(Duration::from_millis(50));
    let id = child.id().to_string();
    let sent = std::process::Command::new("kill")
        .args(["-INT", &id])
        .status();
    assert!(sent.expect("kill runs").success());
    let run = child.wait_with_output().expect("ends");
    assert_eq!(run.status.code(), Some(130));
    assert_eq!(
        sandbox.names(),
        ["a.obj", "b.obj", "p0.png", "s.partial.png"]
    );
}
