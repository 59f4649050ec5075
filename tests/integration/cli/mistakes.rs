//! Typical mistakes and the program's messages about them, tested in full because the message is
//! the product.

use std::process::Command;

use crate::support::{Sandbox, carried};

/// Protects: messages for command lines that name something nonexistent.
#[test]
fn wrong_use_is_explained() {
    let sandbox = Sandbox::new();
    let cases: &[(&[&str], &str)] = &[
        (
            &["render", "preset:whitted", "--set", "t=1"],
            "error: the scene has no parameter `t`\nhelp: the time `t` is set with --at",
        ),
        (
            &["rendr"],
            "error: unrecognized subcommand 'rendr'\n\n  tip: a similar subcommand exists: 'render'\n\nUsage: raywright [OPTIONS] [COMMAND]\n       raywright [OPTIONS] FILE...\n\nFor more information, try '--help'.",
        ),
        (
            &["serve"],
            "error: there is no command `serve`\nhelp: use `raywright view FILE` to look at a scene in the browser",
        ),
        (
            &["render", "--orbit"],
            "error: there is no flag `--orbit`\nhelp: use --turntable N for N pictures from a full circle around the model",
        ),
        (
            &["render", "--xyzzy"],
            "error: unexpected argument '--xyzzy' found\n\nUsage: raywright render [OPTIONS] [SCENE]...\n\nFor more information, try '--help'.",
        ),
        (
            &["preview"],
            "error: there is no command `preview`\nhelp: use `raywright view FILE` to look at a scene in the browser",
        ),
        (
            &["resize"],
            "error: there is no command `resize`\nhelp: `raywright --help` lists the commands",
        ),
        (
            &["render", "--turntable", "0"],
            "error: invalid value '0' for '--turntable <N>': expected a whole number from 1 to 3600\n\nFor more information, try '--help'.",
        ),
        (
            &["view", "--port", "-1"],
            "error: invalid value '-1' for '--port <N>': expected a whole number from 0 to 65535\n\nFor more information, try '--help'.",
        ),
        (
            &["render", "--seed", "-1"],
            "error: invalid value '-1' for '--seed <N>': expected a whole number of at least 0, such as 7\n\nFor more information, try '--help'.",
        ),
        (
            &["render", "--size", "1080p"],
            "error: invalid value '1080p' for '--size <WxH>': expected WIDTHxHEIGHT in pixels: 1080p is 1920x1080\n\nFor more information, try '--help'.",
        ),
        (
            &["render", "--siez", "1x1"],
            "error: unexpected argument '--siez' found\n\n  tip: a similar argument exists: '--size'\n\nUsage: raywright render --size <WxH> [SCENE]...\n\nFor more information, try '--help'.",
        ),
        (
            &["render", "--size", "640"],
            "error: invalid value '640' for '--size <WxH>': expected WIDTHxHEIGHT in pixels, such as 1280x720\n\nFor more information, try '--help'.",
        ),
        (
            &["render", "--size", "640x0"],
            "error: invalid value '640x0' for '--size <WxH>': width and height must be between 1 and 65536 pixels\n\nFor more information, try '--help'.",
        ),
        (
            &["render", "--tonemap", "acse"],
            "error: invalid value 'acse' for '--tonemap <NAME>'\n  [possible values: none, aces, aces-hill, agx, khronos-neutral]\n\n  tip: a similar value exists: 'aces'\n\nFor more information, try '--help'.",
        ),
        (
            &["render", "--max-depth", "0"],
            "error: invalid value '0' for '--max-depth <N>': 0 is not from 1 to 64; for no limit, write `unlimited`\n\nFor more information, try '--help'.",
        ),
        (
            &["render", "--eye", "1,2"],
            "error: invalid value '1,2' for '--eye <X,Y,Z>': expected three numbers x,y,z without spaces, such as 0,1.5,-2\n\nFor more information, try '--help'.",
        ),
        (
            &["render", "--set", "speed"],
            "error: invalid value 'speed' for '--set <NAME=VALUE>': expected NAME=VALUE with a number, such as roughness=0.3\n\nFor more information, try '--help'.",
        ),
        (
            &["render", "preset:whited"],
            "error: there is no preset `whited`\nhelp: did you mean `preset:whitted`?",
        ),
        (
            &["render", "preset:whitted", "--camera", "oribt"],
            "error: there is no camera `oribt`\nhelp: did you mean `orbit`?",
        ),
        (
            &["render", "preset:whitted", "--camera", "1"],
            "error: there is no camera `1`\nhelp: known: orbit",
        ),
        (
            &["render", "preset:whitted", "--eye", "0,0.6,0"],
            "error: the camera's eye and target are the same point, 0,0.6,0\nhelp: give --eye and --target different points",
        ),
        (
            &[
                "render",
                "preset:whitted",
                "--eye",
                "0,5,0",
                "--target",
                "0,0,0",
            ],
            "error: the view from 0,5,0 to 0,0,0 is parallel to the up direction 0,1,0\nhelp: give another up direction, such as --up 0,0,1",
        ),
        (
            &["render", "preset:whitted", "--crop", "600,0,50,50"],
            "error: --crop 600,0,50,50 reaches outside the picture of 640x360 pixels\nhelp: --crop is x,y,width,height in pixels; x and y are distances from the top left corner",
        ),
        (
            &["render", "preset:whitted", "-o", "picture.tif"],
            "error: cannot write picture.tif: unknown picture format `.tif`\nhelp: names end in `.png`, `.jpg`, `.webp` (display values) or `.exr` (linear numbers)",
        ),
        (
            &["render", "preset:whitted", "-o", "a.png", "-o", "./a.png"],
            "error: ./a.png is named twice as output\nhelp: name another file with -o",
        ),
        (
            &["render", "preset:whitted", "--aov", "depth"],
            "error: --aov adds layers to .exr pictures, and no .exr picture is written\nhelp: add an .exr picture: -o picture.exr",
        ),
        (
            &["man", "rendre"],
            "error: there is no command `rendre`\nhelp: did you mean `render`?",
        ),
    ];
    let carried = carried("whitted");
    for (arguments, message) in cases
        .iter()
        .filter(|(words, _)| carried || !words.iter().any(|word| word.contains(":whit")))
    {
        sandbox.run(arguments).exits_with(2).prints(message);
    }
    assert!(sandbox.names().is_empty(), "nothing is written");
}

/// Protects: messages for unreadable and unwritable files.
#[test]
fn files_out_of_reach_are_explained() {
    let sandbox = Sandbox::new();
    sandbox
        .run(&["duck.glb"])
        .exits_with(4)
        .prints("error: cannot read duck.glb: no such file or folder");
    sandbox
        .run(&["render", "room.scene.toml"])
        .exits_with(4)
        .prints("error: cannot read room.scene.toml: no such file or folder");
    if carried("whitted") {
        sandbox.run(&["render", "whitted"]).exits_with(4).prints(
            "error: cannot read whitted: no such file or folder\nhelp: the built-in scene of that name is `preset:whitted`",
        );
    }
    sandbox.run(&["render", "-o", "renders/a.png"])
        .exits_with(4)
        .prints("error: cannot write renders/a.png: no such file or folder\nhelp: create the folder first: mkdir -p renders");
}

/// Protects: formats of other programs are named, with a converter to a supported one; URLs and
/// unmatched patterns are distinguished from misspelled names; flags of other programs lead to the
/// equivalent ones.
#[test]
fn habits_from_elsewhere_are_understood() {
    let sandbox = Sandbox::new();
    let files = [
        (
            "a.usdz",
            "error: a.usdz: USD is not supported\nhelp: import the file into Blender and export glTF",
        ),
        (
            "a.fbx",
            "error: a.fbx: FBX is not supported\nhelp: convert the file to .glb with Blender or FBX2glTF",
        ),
        (
            "a.STEP",
            "error: a.STEP: a CAD model is not supported\nhelp: open the file in FreeCAD and export .glb or .stl",
        ),
        ("a.blend", "error: a.blend: a Blender file is not supported"),
        (
            "a.glb.gz",
            "error: a.glb.gz: an archive is not supported\nhelp: unpack the archive first",
        ),
    ];
    for (name, message) in files {
        sandbox.write(name, "some bytes");
        sandbox.run(&[name]).exits_with(3).prints_like(message);
    }
    sandbox
        .run(&["https://example.org/a.glb"])
        .exits_with(4)
        .prints_like("addresses are not fetched");
    sandbox
        .run(&["models/*.obj"])
        .exits_with(4)
        .prints_like("no file matches this pattern of names");
    sandbox
        .run(&["a.glb", "--samples", "4"])
        .exits_with(2)
        .prints("error: there is no flag `--samples`\nhelp: use --spp N for the samples per pixel");
}

/// Protects: messages for work beyond the limits.
#[test]
fn limits_are_explained() {
    if !carried("whitted") {
        return;
    }
    let sandbox = Sandbox::new();
    let run = sandbox.run(&["render", "preset:whitted", "--size", "65536x65536"]);
    run.exits_with(5);
    assert!(
        run.stderr
            .starts_with("error: preset:whitted: rendering needs about "),
        "{}",
        run.stderr
    );
    assert!(
        run.stderr
            .contains("and the limit is 8 GiB\nhelp: raise the limit with --max-memory"),
        "{}",
        run.stderr
    );
}

/// Protects: `--max-memory` bounds the load too: 4 bytes for each of 4096 pixels are more than 10
/// KiB, and the message names the texture.
#[test]
fn the_limit_holds_for_loading() {
    let sandbox = Sandbox::new();
    image::GrayImage::new(64, 64)
        .save(sandbox.path("wood.png"))
        .expect("a picture");
    sandbox.write(
        "room.scene.toml",
        "format = 1\n[[images]]\nname = \"wood\"\npath = \"wood.png\"\n",
    );
    let run = sandbox.run(&["render", "room.scene.toml", "--max-memory", "10K"]);
    run.exits_with(5);
    assert!(
        run.stderr.contains(
            "`wood.png` needs more memory than the limit of 10 KiB: a further 16 KiB do not fit"
        ),
        "{}",
        run.stderr
    );
}

/// Protects: memory refused by the system gives a message and the exit code of limits, for the
/// film, for geometry, and for pictures. The limit is on the program's address space, as in
/// containers and on shared machines.
#[cfg(unix)]
#[test]
fn memory_that_the_system_refuses_is_told() {
    let sandbox = Sandbox::new();
    let scene = |rest: &str| {
        let camera = "pose.look_at = { eye = [0, 0, 5], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 40 }";
        format!(
            "format = 1\ncameras = [{{ {camera} }}]\nmaterials = [{{ name = \"m\", model.physical = {{}} }}]\n{rest}"
        )
    };
    let ball = "object = { shape.sphere = { centre = [0, 0, 0], radius = 0.1 }, material = \"m\" }";
    sandbox.write("film.scene.toml", scene("sky.constant = 1\n"));
    sandbox.write(
        "many.scene.toml",
        scene(&format!(
            "generators = [{{ kind.grid = {{ counts = [200, 200, 200], origin = [0, 0, 0], step = [1, 1, 1] }}, {ball} }}]\n"
        )),
    );
    sandbox.write(
        "sky.scene.toml",
        scene("images = [{ name = \"a\", path = \"a.hdr\" }]\nsky.map.image = \"a\"\n"),
    );
    sandbox.write(
        "a.hdr",
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 14000 +X 14000\n",
    );
    let refused = "which the system does not provide";
    for (words, message, cause) in [
        ("film.scene.toml --size 30000x30000", "picture", refused),
        ("many.scene.toml --size 8x8", "geometry", refused),
        (
            "sky.scene.toml --size 8x8",
            "a.hdr",
            "more than the system has available",
        ),
    ] {
        let script = format!(
            "ulimit -v 2000000 || exit 77; exec \"$0\" render {words} --threads 1 --max-memory 999G -o a.png"
        );
        let run = Command::new("sh")
            .args(["-c", &script, env!("CARGO_BIN_EXE_raywright")])
            .current_dir(sandbox.path(""))
            .output();
        let run = run.expect("a shell");
        if run.status.code() == Some(77) {
            eprintln!("skipped: the system limits no memory");
            return;
        }
        let said = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(5), "{words}: {said}");
        assert!(
            said.contains(message) && said.contains(cause),
            "{words}: {said}"
        );
    }
    assert!(!sandbox.path("a.png").exists());
}
