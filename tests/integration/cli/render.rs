//! `render`: destinations of pictures, dependence of their bits, and files left behind after
//! failures.

use std::io::Read;
use std::process::Stdio;
use std::time::{Duration, Instant};

use raywright::io::presets;

use crate::support::{Sandbox, carried};

/// Small and quick, with every part of the canonical scene.
const SMALL: [&str; 4] = ["render", "preset:whitted", "--size", "48x27"];

fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    SMALL.iter().chain(more).copied().collect()
}

/// Protects: without arguments, the canonical preset is rendered at its own size, under its own
/// name.
#[test]
fn alone_it_renders_the_preset() {
    let sandbox = Sandbox::new();
    let run = sandbox.run::<&str>(&[]);
    if !carried("whitted") {
        run.exits_with(2);
        assert!(
            run.stderr
                .starts_with("error: no scene is named, and the program was built without"),
            "{}",
            run.stderr
        );
        assert!(
            presets::names().all(|name| run.stderr.contains(name)),
            "{}",
            run.stderr
        );
        return;
    }
    run.exits_with(0);
    // On a busy machine, lines of progress come first.
    let message = run.stderr.lines().last().unwrap_or_default();
    assert!(
        message.starts_with("wrote whitted.png (640x360, 4 samples, "),
        "{}",
        run.stderr
    );
    let picture = sandbox.picture("whitted.png");
    assert_eq!((picture.width, picture.height), (640, 360));
    assert_eq!(sandbox.names(), ["whitted.png"]);
}

/// Protects: several outputs named by the user are written in one run; quiet prints nothing.
#[test]
fn several_outputs_are_written() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    sandbox
        .run(&small(&["-o", "a.png", "-o", "b.exr", "-q"]))
        .exits_with(0)
        .prints("");
    assert_eq!(sandbox.names(), ["a.png", "b.exr"]);
}

/// Protects: a WebP has the codes of the PNG, a JPEG nearly so, at the requested quality; both
/// record their origin; a transparent JPEG is refused before the render.
#[test]
fn pages_have_their_formats() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    sandbox
        .run(&small(&[
            "-o", "a.png", "-o", "a.webp", "-o", "a.jpg", "-q",
        ]))
        .exits_with(0)
        .prints("");
    sandbox
        .run(&small(&["-o", "small.JPEG", "--quality", "20", "-q"]))
        .exits_with(0)
        .prints("");
    assert_eq!(sandbox.picture("a.png").rgb, sandbox.picture("a.webp").rgb);
    let far = |name: &str| {
        let (picture, truth) = (sandbox.picture(name), sandbox.picture("a.png"));
        let pairs = picture.rgb.iter().flatten().zip(truth.rgb.iter().flatten());
        pairs.map(|(a, b)| (a - b).abs()).sum::<f32>() / (3 * picture.rgb.len()) as f32
    };
    let (fine, coarse) = (far("a.jpg"), far("small.JPEG"));
    assert!(fine < 0.02 && coarse > 1.5 * fine, "{fine}, {coarse}");
    for (name, notation) in [("a.webp", "WebP"), ("a.jpg", "JPEG")] {
        let run = sandbox.run(&["info", name]);
        assert!(
            run.exits_with(0).text().contains(notation)
                && run.text().contains("raywright render preset:whitted"),
            "{}",
            run.text()
        );
    }
    sandbox.run(&["compare", "a.webp", "a.png"]).exits_with(0);
    let refused = sandbox.run(&small(&["-o", "b.jpg", "--background", "transparent"]));
    refused.exits_with(2).prints_like(
        "error: --background transparent: a JPEG has no transparency\nhelp: name a picture that ends in .png or .webp, or choose a colour",
    );
    sandbox
        .run(&small(&["-o", "b.jpg", "--quality", "0"]))
        .exits_with(2);
    assert!(!sandbox.names().contains(&"b.jpg".to_owned()));
}

/// Protects: `-o -` writes the same PNG to standard output and nothing else.
#[test]
fn standard_output_takes_the_picture() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    let run = sandbox.run(&small(&["-o", "-", "-o", "a.png"]));
    run.exits_with(0);
    sandbox.write("b.png", &run.stdout);
    assert_eq!(sandbox.picture("a.png").rgb, sandbox.picture("b.png").rgb);
}

/// Protects: a crop has the bits of the whole picture, in every format.
#[test]
fn crops_are_parts_of_the_whole() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    sandbox.run(&small(&["-o", "whole.exr"])).exits_with(0);
    sandbox
        .run(&small(&["-o", "part.exr", "--crop", "13,5,20,11"]))
        .exits_with(0);
    let (whole, part) = (sandbox.picture("whole.exr"), sandbox.picture("part.exr"));
    assert_eq!((part.width, part.height), (20, 11));
    for y in 0..11 {
        for x in 0..20 {
            assert_eq!(part.pixel(x, y), whole.pixel(x + 13, y + 5), "at {x}, {y}");
        }
    }
}

/// Protects: the picture is the same, bit for bit, for any threads and for scan and tree.
#[test]
fn bits_do_not_depend_on_threads_or_accelerator() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    sandbox
        .run(&small(&["-o", "one.exr", "--threads", "1", "--spp", "3"]))
        .exits_with(0);
    sandbox
        .run(&small(&["-o", "two.exr", "--threads", "2", "--spp", "3"]))
        .exits_with(0);
    sandbox
        .run(&small(&[
            "-o", "scan.exr", "--accel", "linear", "--spp", "3",
        ]))
        .exits_with(0);
    let one = sandbox.picture("one.exr");
    assert!(one.rgb == sandbox.picture("two.exr").rgb, "threads");
    assert!(one.rgb == sandbox.picture("scan.exr").rgb, "accelerator");
}

/// Protects: each flag that should change the picture changes it as documented.
#[test]
fn flags_reach_the_picture() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    sandbox.run(&small(&["-o", "plain.png"])).exits_with(0);
    let plain = sandbox.picture("plain.png").rgb;
    for flags in [
        ["--at", "2.5"],
        ["--spp", "1"],
        ["--max-depth", "1"],
        ["--eye", "0,3,9"],
        ["--target", "-1,1,0"],
        ["--up", "1,1,0"],
        ["--fov", "70"],
        ["--background", "0.5,0,0.5"],
        ["--exposure", "-1"],
        ["--tonemap", "agx"],
        ["--gamma", "none"],
    ] {
        sandbox
            .run(&small(&["-o", "other.png", flags[0], flags[1]]))
            .exits_with(0);
        assert!(
            sandbox.picture("other.png").rgb != plain,
            "{} {}",
            flags[0],
            flags[1]
        );
    }
}

/// Protects: only the seed decides the general sampler's numbers.
#[test]
fn seeds_decide_random_samples() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    for (name, seed) in [("a.exr", "1"), ("b.exr", "1"), ("c.exr", "2")] {
        sandbox
            .run(&small(&["-o", name, "--spp", "2", "--seed", seed]))
            .exits_with(0);
    }
    let first = sandbox.picture("a.exr").rgb;
    assert!(first == sandbox.picture("b.exr").rgb);
    assert!(first != sandbox.picture("c.exr").rgb);
}

/// Protects: a transparent background gives an alpha channel that is 0 in the sky and 1 on the
/// ground.
#[test]
fn transparency_is_an_alpha_channel() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    sandbox
        .run(&small(&["-o", "a.png", "--background", "transparent"]))
        .exits_with(0);
    let alpha = sandbox.picture("a.png").alpha.expect("a channel");
    assert_eq!((alpha.first(), alpha.last()), (Some(&0.0), Some(&1.0)));
}

/// Protects: layers have their documented names.
#[test]
fn layers_have_their_names() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    let list = "albedo,normal,position,depth,object,material,samples,stderr";
    sandbox
        .run(&small(&["-o", "a.exr", "--aov", list]))
        .exits_with(0);
    let names: Vec<String> = sandbox
        .picture("a.exr")
        .layers
        .into_iter()
        .map(|layer| layer.name)
        .collect();
    let expected = [
        "albedo.B",
        "albedo.G",
        "albedo.R",
        "depth.Z",
        "material.id",
        "normal.X",
        "normal.Y",
        "normal.Z",
        "object.id",
        "position.X",
        "position.Y",
        "position.Z",
        "samples.N",
        "stderr.B",
        "stderr.G",
        "stderr.R",
    ];
    assert_eq!(names, expected);
}

/// Protects: a picture records its origin.
#[test]
fn pictures_carry_their_origin() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    sandbox
        .run(&small(&["-o", "a.png", "-o", "b.exr"]))
        .exits_with(0);
    for (file, prefix, separator) in [("a.png", "Raywright ", " "), ("b.exr", "raywright_", "_")] {
        let texts = sandbox.stored(file).texts;
        let entry = |name: &str| {
            texts
                .get(&format!("{prefix}{}", name.replace(' ', separator)))
                .cloned()
                .unwrap_or_default()
        };
        assert_eq!(entry("scene hash").len(), 64, "{file}: {texts:?}");
        assert_eq!(entry("seed"), "0");
        assert_eq!(
            entry("command"),
            "raywright render preset:whitted --size 48x27 -o a.png -o b.exr"
        );
        let settings = "size=48x27 samples=corners max_depth=4 integrator=whitted precision=robust exposure=0 tone_map=aces gamma=2.2";
        assert_eq!(entry("settings"), settings);
    }
}

/// Protects: a failure leaves neither the final file nor a temporary one.
#[test]
fn failures_leave_nothing_behind() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    sandbox
        .run(&["render", "preset:whitted", "--max-memory", "1K"])
        .exits_with(5);
    sandbox
        .run(&["render", "missing.glb", "-o", "a.png"])
        .exits_with(4);
    sandbox.write("bad.scene.toml", "format = 1\nobjcts = []\n");
    sandbox.run(&["render", "bad.scene.toml"]).exits_with(3);
    assert_eq!(sandbox.names(), ["bad.scene.toml"]);
}

/// Protects: unwritable outputs are reported before the scene is read.
#[test]
fn unwritable_places_are_found_at_once() {
    let sandbox = Sandbox::new();
    sandbox.write("file", "");
    std::fs::create_dir(sandbox.path("folder.png")).expect("a folder");
    for output in ["no/such/folder/a.png", "file/a.png", "folder.png"] {
        let run = sandbox.run(&["render", "preset:no-such-preset", "-o", output]);
        run.exits_with(4);
        assert!(run.stderr.contains(output), "{}", run.stderr);
    }
}

/// Protects: a folder without write permission is refused; the check is void for a user whom
/// permissions do not bind.
#[cfg(unix)]
#[test]
fn folders_without_permission_are_found_at_once() {
    if !carried("whitted") {
        return;
    }
    use std::os::unix::fs::PermissionsExt;
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("locked")).expect("a folder");
    std::fs::set_permissions(
        sandbox.path("locked"),
        std::fs::Permissions::from_mode(0o555),
    )
    .expect("permissions");
    if std::fs::write(sandbox.path("locked/probe"), "").is_ok() {
        eprintln!("skipped: this user may write anywhere");
        return;
    }
    sandbox
        .run(&small(&["-o", "locked/a.png"]))
        .exits_with(4)
        .prints("error: cannot write locked/a.png: permission denied");
}

/// Protects: plain progress prints occasional lines with the share and the time left.
#[test]
fn progress_is_told_in_lines() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    let mut child = sandbox
        .command(&LONG)
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    let mut stderr = child.stderr.take().expect("piped");
    let mut text = String::new();
    let mut byte = [0];
    while !text.ends_with('\n') && stderr.read(&mut byte).expect("readable") == 1 {
        text.push(char::from(byte[0]));
    }
    child.kill().expect("still running");
    child.wait().expect("ends");
    let share = text
        .strip_prefix("rendering: ")
        .and_then(|rest| rest.split_once(" %"))
        .expect(&text);
    assert!(
        share.0.parse::<u32>().is_ok_and(|percent| percent < 100),
        "{text}"
    );
}

/// A render of several minutes, so that a test can interrupt it.
const LONG: [&str; 9] = [
    "render",
    "preset:whitted",
    "-o",
    "a.exr",
    "--spp",
    "4096",
    "--size",
    "1920x1080",
    "--progress=plain",
];

/// Protects: Ctrl-C keeps the finished part under a name that marks it as partial, and the final
/// name stays free.
#[cfg(unix)]
#[test]
fn interrupted_renders_keep_what_is_finished() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    let mut child = sandbox
        .command(&LONG)
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    // The first line of progress means that some tiles are finished.
    let mut stderr = child.stderr.take().expect("piped");
    stderr.read_exact(&mut [0]).expect("a first line");
    let start = Instant::now();
    let kill = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .expect("kill runs");
    assert!(kill.success());
    let status = child.wait().expect("ends");
    let mut text = String::new();
    stderr.read_to_string(&mut text).expect("text");
    assert_eq!(status.code(), Some(130), "{text}");
    assert!(
        text.ends_with("error: interrupted; the unfinished picture is in a.partial.exr\n"),
        "{text}"
    );
    assert!(
        start.elapsed() < Duration::from_secs(30),
        "it stops at the next tile"
    );
    assert_eq!(sandbox.names(), ["a.partial.exr"]);
    let picture = sandbox.picture("a.partial.exr");
    assert_eq!((picture.width, picture.height), (1920, 1080));
    assert!(
        picture.rgb.iter().any(|&pixel| pixel != [0.0; 3]),
        "something was finished"
    );
}

/// Protects: a second Ctrl-C does not wait until all finished parts are written.
#[cfg(unix)]
#[test]
fn a_second_interrupt_ends_at_once() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    // Writing all these files takes seconds.
    let outputs: Vec<String> = (0..40).map(|i| format!("-o={i}.png")).collect();
    let mut words = vec![
        "render",
        "preset:whitted",
        "-v",
        "--spp",
        "65536",
        "--size",
        "1920x1080",
    ];
    words.extend(outputs.iter().map(String::as_str));
    let mut child = sandbox
        .command(&words)
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    // The effects are printed immediately before the render.
    child
        .stderr
        .take()
        .expect("piped")
        .read_exact(&mut [0])
        .expect("a first line");
    let start = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        assert!(start.elapsed() < Duration::from_secs(30), "it still runs");
        std::process::Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status()
            .expect("kill runs");
        std::thread::sleep(Duration::from_millis(100));
    }
    assert_eq!(child.wait().expect("ended").code(), Some(130));
    assert!(sandbox.names().len() < 40, "{:?}", sandbox.names());
}

/// Protects: lamps that light nothing are named in a note, with the number of their shadow rays,
/// one by one or as a range; effective lamps are not named.
#[test]
fn lamps_in_cupboards_are_named() {
    let sandbox = Sandbox::new();
    let ball = |name: &str, x: f64, radius: f64, material: &str| {
        format!(
            "{{ name = \"{name}\", shape.sphere = {{ centre = [{x}, 1, 0], radius = {radius} }}, material = \"{material}\" }},\n"
        )
    };
    let scene = |closed: &[f64]| {
        let boxes: String = closed
            .iter()
            .map(|&x| ball("cupboard", x, 0.6, "wall"))
            .collect();
        let lamps: String = [("a", -2.0), ("b", 0.0), ("c", 2.0)]
            .iter()
            .map(|&(name, x)| ball(name, x, 0.3, "lamp"))
            .collect();
        format!(
            "format = 1\nsky.constant = 0.3\n\
             cameras = [{{ pose.look_at = {{ eye = [0, 3, 8], target = [0, 1, 0] }}, projection.pinhole = {{ vertical_fov = 40 }} }}]\n\
             materials = [{{ name = \"wall\", model.physical = {{}} }}, {{ name = \"lamp\", model.physical = {{ emission = 9 }} }}]\n\
             objects = [\n{{ shape.plane = {{ point = [0, 0, 0], normal = [0, 1, 0] }}, material = \"wall\" }},\n{lamps}{boxes}]\n"
        )
    };
    let messages = |name: &str, closed: &[f64]| {
        sandbox.write(name, scene(closed));
        let run = sandbox.run(&[
            "render",
            name,
            "--size",
            "24x16",
            "--spp",
            "64",
            "--integrator",
            "path",
            "-v",
            "-o",
            "a.png",
        ]);
        run.exits_with(0);
        run.stderr
            .lines()
            .filter(|line| line.contains("reaches no visible surface"))
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    assert_eq!(messages("open.scene.toml", &[]), [""; 0]);
    let one = messages("one.scene.toml", &[0.0]);
    assert!(
        one.len() == 1
            && one[0].starts_with("note: object `b`: this light reaches no visible surface"),
        "{one:?}"
    );
    assert!(
        one[0].contains(
            " rays towards it were blocked); open or remove the object that blocks the light"
        ),
        "{one:?}"
    );
    let all = messages("all.scene.toml", &[-2.0, 0.0, 2.0]);
    assert!(
        all.len() == 1
            && all[0].starts_with(
                "note: object `a`, object `b`, object `c`: this light reaches no visible surface"
            ),
        "{all:?}"
    );
}

/// Protects: the picture of a dark model with `--exposure auto` is that with the number that it
/// chooses, the studio's backdrop included.
#[test]
fn a_chosen_exposure_is_that_of_its_number() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "a.obj",
        "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n",
    );
    sandbox.write("a.mtl", "newmtl m\nKd 0.0005 0.0005 0.0005\nillum 1\n");
    let picture = |stops: &str| {
        let line = format!("render a.obj -s 24x16 --spp 4 --exposure {stops} -o a.png -q");
        sandbox
            .run(&line.split(' ').collect::<Vec<_>>())
            .exits_with(0);
        sandbox.stored("a.png")
    };
    let auto = picture("auto");
    let settings = auto.metadata().settings.clone();
    let stops = settings
        .split("exposure=")
        .nth(1)
        .and_then(|rest| rest.split(' ').next())
        .unwrap_or_else(|| panic!("{settings}"));
    assert_ne!(stops, "0");
    assert!(auto.picture.rgb == picture(stops).picture.rgb, "{stops}");
}

/// Protects: a picture of surfaces in view that no light reaches is a warning.
#[test]
fn a_nearly_black_picture_is_a_warning() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "dark.scene.toml",
        "format = 1\n[[cameras]]\npose.look_at = { eye = [0, 0, 2], target = [0, 0, 0] }\nprojection.pinhole = { vertical_fov = 40 }\n\
        [[materials]]\nname = \"m\"\nmodel.physical = {}\n[[objects]]\nshape.sphere = { centre = [0, 0, 0], radius = 1 }\nmaterial = \"m\"\n",
    );
    let line = "render dark.scene.toml --env none -s 8x8 --spp 1 -o a.png";
    sandbox
        .run(&line.split(' ').collect::<Vec<_>>())
        .exits_with(0)
        .prints_like("warning: the picture is nearly black, because hardly any light reaches the surfaces in view");
}

/// Protects: a picture with more than a fifth clipped gives a warning in any case; `--exposure
/// auto` uses the recommended exposure, in the picture, in its metadata, for a film, and once for
/// all pictures of a scene.
#[test]
fn exposure_is_found() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "sky.scene.toml",
        "format = 1\nsky.expression = \"5*(1 + t)\"\n[render]\nsize = [8, 8]\nsamples = 1\ntone_map = \"none\"\n",
    );
    let plain = sandbox.run(&["render", "sky.scene.toml", "-o", "a.png"]);
    plain.exits_with(0).prints_like(
        "warning: 100 % of the pixels are clipped; try --exposure -3, or --exposure auto",
    );
    sandbox
        .run(&[
            "render",
            "sky.scene.toml",
            "--exposure",
            "-3",
            "-o",
            "b.png",
        ])
        .exits_with(0);
    let auto = sandbox.run(&[
        "render",
        "sky.scene.toml",
        "--exposure",
        "auto",
        "-o",
        "c.png",
        "--checkpoint",
        "c.film",
    ]);
    assert!(
        !auto.exits_with(0).stderr.contains("clipped"),
        "{}",
        auto.stderr
    );
    assert!(
        sandbox.picture("c.png").rgb == sandbox.picture("b.png").rgb
            && sandbox.picture("a.png").rgb != sandbox.picture("b.png").rgb
    );
    assert!(
        sandbox
            .run(&["info", "c.png"])
            .exits_with(0)
            .text()
            .contains("exposure=-3")
    );
    sandbox
        .run(&["merge", "c.film", "--exposure", "auto", "-o", "d.png"])
        .exits_with(0);
    assert!(sandbox.picture("d.png").rgb == sandbox.picture("b.png").rgb);
    sandbox
        .run(&[
            "render",
            "sky.scene.toml",
            "--frames",
            "0..2:1",
            "--exposure",
            "auto",
            "-o",
            "f%d.png",
        ])
        .exits_with(0);
    sandbox
        .run(&[
            "render",
            "sky.scene.toml",
            "--at",
            "1",
            "--exposure",
            "-3",
            "-o",
            "g.png",
        ])
        .exits_with(0);
    assert!(
        sandbox.picture("f0.png").rgb == sandbox.picture("b.png").rgb
            && sandbox.picture("f1.png").rgb == sandbox.picture("g.png").rgb
    );
    sandbox
        .run(&["render", "sky.scene.toml", "--exposure", "bright"])
        .exits_with(2)
        .prints_like("expected a number of stops, such as -1.5, or `auto`");
}
