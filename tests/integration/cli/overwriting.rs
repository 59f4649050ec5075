//! Files that no output replaces: inputs of the run, files named by its scene, and, under default
//! names, all files except pictures of this program.

use std::fs;

use crate::support::Sandbox;

/// A pixel written by another program, as for every texture here.
fn pixel() -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(1, 1)
        .write_to(&mut file, image::ImageFormat::Png)
        .expect("a picture");
    file.into_inner()
}

const SMALL: [&str; 5] = ["--size", "4x4", "--spp", "1", "-q"];

/// A scene with an existing and a missing texture, and an OBJ model with two libraries.
fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("wood.png", pixel());
    sandbox.write(
        "room.scene.toml",
        "format = 1\nsky.constant = 1\n[[images]]\nname = \"wood\"\npath = \"wood.png\"\n\
        [[images]]\nname = \"gone\"\npath = \"gone.png\"\n",
    );
    sandbox.write(
        "leaf.obj",
        "mtllib a.mtl b.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    );
    sandbox.write("a.mtl", "newmtl a\nmap_Kd leaf.png\n");
    sandbox.write("b.mtl", "newmtl unused\nmap_Kd spare.png\n");
    for name in ["leaf.png", "spare.png"] {
        sandbox.write(name, pixel());
    }
    sandbox
}

fn everything(sandbox: &Sandbox) -> Vec<(String, Vec<u8>)> {
    let files = sandbox
        .names()
        .into_iter()
        .filter(|name| sandbox.path(name).is_file());
    files
        .map(|name| (name.clone(), fs::read(sandbox.path(&name)).expect("a file")))
        .collect()
}

/// Protects: an output that is an input of the run, or is named by the scene, is refused before the
/// render, under every name of that file and for every flag, and no file changes.
#[cfg(unix)]
#[test]
fn inputs_are_never_replaced() {
    use std::os::unix::fs::symlink;
    let sandbox = sandbox();
    fs::create_dir(sandbox.path("sub")).expect("a folder");
    symlink("wood.png", sandbox.path("link.png")).expect("a link");
    symlink("gone.png", sandbox.path("ahead.png")).expect("a link");
    symlink("a.mtl", sandbox.path("mtl.json")).expect("a link");
    symlink("b.mtl", sandbox.path("b.json")).expect("a link");
    symlink("room.scene.toml", sandbox.path("room.json")).expect("a link");
    fs::hard_link(sandbox.path("wood.png"), sandbox.path("hard.png")).expect("a link");
    let before = everything(&sandbox);
    let cases: &[(&str, &str, &str, &str)] = &[
        ("room.scene.toml", "-o", "wood.png", "this run reads it"),
        ("room.scene.toml", "-o", "./wood.png", "this run reads it"),
        (
            "room.scene.toml",
            "-o",
            "sub/../wood.png",
            "this run reads it",
        ),
        ("room.scene.toml", "-o", "link.png", "this run reads it"),
        (
            "./sub/../room.scene.toml",
            "-o",
            "hard.png",
            "wood.png, which this run reads",
        ),
        (
            "room.scene.toml",
            "-o",
            "gone.png",
            "the scene names this file as an input",
        ),
        (
            "room.scene.toml",
            "-o",
            "ahead.png",
            "the scene names this file as an input",
        ),
        (
            "room.scene.toml",
            "--stats",
            "room.json",
            "this run reads it",
        ),
        ("leaf.obj", "--stats", "mtl.json", "this run reads it"),
        ("leaf.obj", "--stats", "b.json", "this run reads it"),
        (
            "leaf.obj",
            "-o",
            "spare.png",
            "the scene names this file as an input",
        ),
        ("leaf.obj", "-o", "leaf.png", "this run reads it"),
    ];
    for (scene, flag, output, cause) in cases {
        let run = sandbox.run(&[&["render", scene, flag, output], &SMALL[..]].concat());
        run.exits_with(2);
        assert!(
            run.stderr.contains(&format!("cannot write {output}: ")),
            "{}",
            run.stderr
        );
        assert!(run.stderr.contains(cause), "{}", run.stderr);
        assert!(
            run.stderr
                .contains(&format!("help: name another file with {flag}")),
            "{}",
            run.stderr
        );
    }
    // The default name is that of the model's own texture.
    sandbox
        .run(&[&["render", "leaf.obj"], &SMALL[..]].concat())
        .exits_with(2)
        .prints("error: cannot write leaf.png: this run reads it\nhelp: name another file with -o");
    assert!(
        everything(&sandbox) == before,
        "something was written: {:?}",
        sandbox.names()
    );
}

/// Protects: a checkpoint replaces films alone, in `render` and `merge`.
#[test]
fn checkpoints_replace_films_alone() {
    let sandbox = sandbox();
    let render = [&["render", "leaf.obj", "-o", "own.png"], &SMALL[..]].concat();
    for name in ["spare.png", "b.mtl"] {
        let before = everything(&sandbox);
        sandbox
            .run(&[&render[..], &["--checkpoint", name]].concat())
            .exits_with(2)
            .prints_like("this file exists and is no film");
        assert!(everything(&sandbox) == before, "{name}");
    }
    for _ in 0..2 {
        sandbox
            .run(&[&render[..], &["--checkpoint", "a.film"]].concat())
            .exits_with(0);
    }
    sandbox
        .run(&["merge", "a.film", "--checkpoint", "spare.png"])
        .exits_with(2)
        .prints_like("this file exists and is no film");
}

/// Protects: the difference picture replaces neither input of a comparison.
#[test]
fn compared_pictures_are_never_replaced() {
    let sandbox = sandbox();
    fs::hard_link(sandbox.path("spare.png"), sandbox.path("hard.png")).expect("a link");
    let before = everything(&sandbox);
    for output in ["wood.png", "./spare.png", "hard.png"] {
        let run = sandbox.run(&["compare", "wood.png", "spare.png", "--diff", output]);
        run.exits_with(2);
        assert!(
            run.stderr.contains("help: name another file with --diff"),
            "{}",
            run.stderr
        );
        assert!(everything(&sandbox) == before);
    }
    sandbox
        .run(&["compare", "wood.png", "spare.png", "--diff", "leaf.png"])
        .exits_with(0);
    assert!(
        fs::read(sandbox.path("leaf.png")).expect("a file") != pixel(),
        "the user named that file"
    );
}

/// Protects: under a default name, a picture of this program is replaced and any other file is
/// kept, whatever its content.
#[test]
fn unnamed_pictures_replace_only_our_own() {
    let sandbox = sandbox();
    let render = [&["render", "room.scene.toml"], &SMALL[..]].concat();
    sandbox.run(&render).exits_with(0);
    sandbox.run(&render).exits_with(0);
    let whole = fs::read(sandbox.path("room.png")).expect("a picture");
    for foreign in [
        pixel(),
        whole[..whole.len() - 5].to_vec(),
        b"notes".to_vec(),
        Vec::new(),
    ] {
        sandbox.write("room.png", &foreign);
        sandbox.run(&render).exits_with(4).prints(
            "error: cannot write room.png: a file of this name exists and is no picture made by this program\n\
            help: name the picture with -o; -o room.png replaces that file",
        );
        assert!(fs::read(sandbox.path("room.png")).expect("a file") == foreign);
    }
    sandbox
        .run(&[&render[..], &["-o", "room.png"]].concat())
        .exits_with(0);
    assert_eq!(sandbox.picture("room.png").width, 4);
}

/// Protects: two outputs of a run are two files, however they are named.
#[cfg(unix)]
#[test]
fn outputs_do_not_replace_each_other() {
    let sandbox = sandbox();
    std::os::unix::fs::symlink("s.png", sandbox.path("s.json")).expect("a link");
    let run = sandbox.run(
        &[
            &[
                "render",
                "room.scene.toml",
                "-o",
                "s.png",
                "--stats",
                "s.json",
            ],
            &SMALL[..],
        ]
        .concat(),
    );
    run.exits_with(2).prints("error: s.png and s.json are the same file, named twice as output\nhelp: name another file with --stats");
    assert!(!sandbox.path("s.png").exists());
}

/// Protects: a file keeps its permissions when written again, for every kind of output: those of a
/// file for a group or for all others, which neither a new file has nor a temporary one.
#[cfg(unix)]
#[test]
fn modes_are_kept() {
    use std::os::unix::fs::PermissionsExt;
    let sandbox = Sandbox::new();
    sandbox.write("sky.scene.toml", "format = 1\nsky.constant = 0.5\n");
    let files = [
        "a.png",
        "a.exr",
        "a.film",
        "a.json",
        "sheet.png",
        "a.gif",
        "a.apng",
        "diff.png",
        "merged.png",
    ];
    let modes = || [0o640, 0o604, 0o660].into_iter().cycle();
    for (name, mode) in files.into_iter().zip(modes()) {
        sandbox.write(name, "");
        fs::set_permissions(sandbox.path(name), fs::Permissions::from_mode(mode))
            .expect("an own file");
    }
    let render = [
        "render",
        "sky.scene.toml",
        "-q",
        "--size",
        "4x4",
        "--spp",
        "2",
    ];
    sandbox
        .run(
            &[
                &render[..],
                &[
                    "-o",
                    "a.png",
                    "-o",
                    "a.exr",
                    "--checkpoint",
                    "a.film",
                    "--stats",
                    "a.json",
                ],
            ]
            .concat(),
        )
        .exits_with(0);
    sandbox
        .run(
            &[
                &render[..],
                &[
                    "--turntable",
                    "2",
                    "-o",
                    "a.gif",
                    "-o",
                    "a.apng",
                    "--sheet",
                    "sheet.png",
                ],
            ]
            .concat(),
        )
        .exits_with(0);
    sandbox
        .run(&["compare", "a.png", "a.exr", "--diff", "diff.png"])
        .exits_with(0);
    sandbox
        .run(&["merge", "a.film", "-o", "merged.png"])
        .exits_with(0);
    for (name, mode) in files.into_iter().zip(modes()) {
        let metadata = fs::metadata(sandbox.path(name)).expect("a file");
        assert!(
            metadata.len() > 0 && metadata.permissions().mode() & 0o777 == mode,
            "{name}: {:o}",
            metadata.permissions().mode()
        );
    }
}

/// Protects: an unwritable output is reported before the first ray: no scene is rendered for hours
/// in vain, and no file is left.
#[cfg(unix)]
#[test]
fn outputs_are_tried_before_the_first_ray() {
    let sandbox = Sandbox::new();
    sandbox.write("sky.scene.toml", "format = 1\nsky.constant = 0.5\n");
    let endless = [
        "render",
        "sky.scene.toml",
        "-s",
        "4000x4000",
        "--spp",
        "65536",
    ];
    let long = |ending: &str| "n".repeat(260) + ending;
    for arguments in [
        ["-o".to_owned(), long(".png")],
        ["-o".to_owned(), long(".exr")],
        ["--checkpoint".to_owned(), long(".film")],
        ["--stats".to_owned(), long(".json")],
        ["--sheet".to_owned(), long(".png")],
        ["-o".to_owned(), long("/a.png")],
        ["-o".to_owned(), long(".gif")],
    ] {
        let words = arguments.iter().map(String::as_str).collect::<Vec<_>>();
        sandbox
            .run(&[&endless[..], &words].concat())
            .exits_with(4)
            .prints_like("the file name is too long");
    }
    assert_eq!(sandbox.names(), ["sky.scene.toml"]);
    let longest = "n".repeat(251) + ".png";
    sandbox
        .run(&[
            "render",
            "sky.scene.toml",
            "-q",
            "-s",
            "4x4",
            "--spp",
            "1",
            "-o",
            &longest,
        ])
        .exits_with(0);
    assert!(sandbox.path(&longest).exists());
}

/// Protects: a limit on file size ends a run with exit code 4, keeps the old file and leaves no
/// other.
#[cfg(target_os = "linux")]
#[test]
fn file_limits_leave_nothing_behind() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "sky.scene.toml",
        "format = 1\nsky.map.image = \"a\"\nimages = [{ name = \"a\", path = \"noise.png\" }]\n",
    );
    let noise = image::RgbImage::from_fn(64, 64, |x, y| {
        let hash = (x * 64 + y).wrapping_mul(2_654_435_761);
        image::Rgb([(hash >> 8) as u8, (hash >> 16) as u8, (hash >> 24) as u8])
    });
    noise.save(sandbox.path("noise.png")).expect("a picture");
    for name in ["a.png", "a.exr", "a.film"] {
        sandbox.write(name, "old");
    }
    let program = sandbox.command::<&str>(&[]).get_program().to_owned();
    for arguments in ["-o a.exr", "-o a.png", "-o b.png --checkpoint a.film"] {
        let before = everything(&sandbox);
        let script = format!(
            "ulimit -f 4; exec \"$0\" render sky.scene.toml -q -s 96x96 --spp 4 {arguments}"
        );
        let mut shell = std::process::Command::new("sh");
        let run = shell
            .args(["-c", &script])
            .arg(&program)
            .current_dir(sandbox.path(""))
            .output()
            .expect("a shell");
        let said = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(4), "{arguments}: {said}");
        assert!(
            said.contains(
                "the file would be larger than the file system allows; write it to another disk"
            ),
            "{said}"
        );
        assert_eq!(everything(&sandbox), before, "{arguments}");
    }
}

/// Protects: sheets and animations that do not fit on a full disk are kept beside the scene; a run
/// that fails between two pictures keeps its unfinished sheet and animation.
#[cfg(target_os = "linux")]
#[test]
fn full_disks_keep_sheets_and_animations() {
    let sandbox = Sandbox::new();
    sandbox.write("sky.scene.toml", "format = 1\nsky.constant = 0.5\n");
    for name in ["full.png", "full.gif", "full-2.gif"] {
        std::os::unix::fs::symlink("/dev/full", sandbox.path(name)).expect("a link");
    }
    let series = "sky.scene.toml -q -s 4x4 --spp 1 --allow-empty --frames 0..1:3".split(' ');
    let series: Vec<_> = series.collect();
    let sheet = ["--sheet", "full.png"];
    sandbox
        .run(&[&series[..], &sheet].concat())
        .exits_with(4)
        .prints_like("the disk is full")
        .prints_like("the sheet is kept in full-2.png");
    assert!(sandbox.picture("full-2.png").width > 12);
    sandbox
        .run(&[&series[..], &["-o", "full.gif"]].concat())
        .exits_with(4)
        .prints_like("the animation is kept in full-3.gif");
    let kept = fs::read(sandbox.path("full-3.gif")).expect("the animation");
    assert!(kept.starts_with(b"GIF89a"));

    std::os::unix::fs::symlink("/dev/full", sandbox.path("full-1.exr")).expect("a link");
    let both = ["--sheet", "s.png", "-o", "full-%d.exr"];
    sandbox
        .run(&[&series[..], &both].concat())
        .exits_with(4)
        .prints_like("the picture is kept in full-1-2.exr")
        .prints_like("the finished pictures are in")
        .prints_like("s.partial.png");
    assert!(sandbox.path("full-0.exr").exists() && sandbox.path("s.partial.png").exists());
}

/// Protects: a full disk ends a run with exit code 4, for every output; a picture for a file is
/// kept beside the scene under a new name, or in the temporary folder.
#[cfg(target_os = "linux")]
#[test]
fn full_disks_are_told() {
    let sandbox = Sandbox::new();
    sandbox.write("sky.scene.toml", "format = 1\nsky.constant = 0.5\n");
    std::os::unix::fs::symlink("/dev/full", sandbox.path("full.png")).expect("a link");
    let render = [
        "render",
        "sky.scene.toml",
        "-q",
        "-s",
        "4x4",
        "--spp",
        "1",
        "-o",
    ];
    let full = [&render[..], &["full.png"]].concat();
    sandbox
        .run(&full)
        .exits_with(4)
        .prints_like("the disk is full")
        .prints_like("the picture is kept in")
        .prints_like("full-2.png");
    assert!(sandbox.picture("full-2.png").rgb.len() == 16 && sandbox.path("full.png").is_symlink());
    sandbox.run(&full).exits_with(4).prints_like("full-3.png");
    let temporary = sandbox.path("temporary");
    fs::create_dir(&temporary).expect("a folder");
    let preset = [
        "render",
        "preset:whitted",
        "-q",
        "-s",
        "4x4",
        "-o",
        "full.png",
    ];
    let run = sandbox
        .command(&preset)
        .env("TMPDIR", &temporary)
        .output()
        .expect("the program starts");
    assert_eq!(
        run.status.code(),
        Some(4),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    assert_eq!(sandbox.picture("temporary/full.png").rgb.len(), 16);
    let full = fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .expect("Linux has it");
    let run = sandbox
        .command(&[&render[..], &["-"]].concat())
        .stdout(full)
        .output()
        .expect("the program starts");
    assert_eq!(
        run.status.code(),
        Some(4),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
}
