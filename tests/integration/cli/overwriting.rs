//! Files that no output replaces: inputs of the run, files named by its scene, and, under default
//! names, all files except pictures of this program.

use std::fs;

use crate::support::Desk;

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
fn desk() -> Desk {
    let desk = Desk::new();
    desk.write("wood.png", pixel());
    desk.write(
        "room.scene.toml",
        "format = 1\nsky.constant = 1\n[[images]]\nname = \"wood\"\npath = \"wood.png\"\n\
        [[images]]\nname = \"gone\"\npath = \"gone.png\"\n",
    );
    desk.write(
        "leaf.obj",
        "mtllib a.mtl b.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    );
    desk.write("a.mtl", "newmtl a\nmap_Kd leaf.png\n");
    desk.write("b.mtl", "newmtl unused\nmap_Kd spare.png\n");
    for name in ["leaf.png", "spare.png"] {
        desk.write(name, pixel());
    }
    desk
}

fn everything(desk: &Desk) -> Vec<(String, Vec<u8>)> {
    let files = desk
        .names()
        .into_iter()
        .filter(|name| desk.path(name).is_file());
    files
        .map(|name| (name.clone(), fs::read(desk.path(&name)).expect("a file")))
        .collect()
}

/// Protects: an output that is an input of the run, or is named by the scene, is refused before the
/// render, under every name of that file and for every flag, and no file changes.
#[cfg(unix)]
#[test]
fn inputs_are_never_replaced() {
    use std::os::unix::fs::symlink;
    let desk = desk();
    fs::create_dir(desk.path("sub")).expect("a folder");
    symlink("wood.png", desk.path("link.png")).expect("a link");
    symlink("gone.png", desk.path("ahead.png")).expect("a link");
    symlink("a.mtl", desk.path("mtl.json")).expect("a link");
    symlink("b.mtl", desk.path("b.json")).expect("a link");
    symlink("room.scene.toml", desk.path("room.json")).expect("a link");
    fs::hard_link(desk.path("wood.png"), desk.path("hard.png")).expect("a link");
    let before = everything(&desk);
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
            "the scene names it as a file of its own",
        ),
        (
            "room.scene.toml",
            "-o",
            "ahead.png",
            "the scene names it as a file of its own",
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
            "the scene names it as a file of its own",
        ),
        ("leaf.obj", "-o", "leaf.png", "this run reads it"),
    ];
    for (scene, flag, output, cause) in cases {
        let run = desk.run(&[&["render", scene, flag, output], &SMALL[..]].concat());
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
    desk.run(&[&["render", "leaf.obj"], &SMALL[..]].concat())
        .exits_with(2)
        .says("error: cannot write leaf.png: this run reads it\nhelp: name another file with -o");
    assert!(
        everything(&desk) == before,
        "something was written: {:?}",
        desk.names()
    );
}

/// Protects: the difference picture replaces neither input of a comparison.
#[test]
fn compared_pictures_are_never_replaced() {
    let desk = desk();
    fs::hard_link(desk.path("spare.png"), desk.path("hard.png")).expect("a link");
    let before = everything(&desk);
    for output in ["wood.png", "./spare.png", "hard.png"] {
        let run = desk.run(&["compare", "wood.png", "spare.png", "--diff", output]);
        run.exits_with(2);
        assert!(
            run.stderr.contains("help: name another file with --diff"),
            "{}",
            run.stderr
        );
        assert!(everything(&desk) == before);
    }
    desk.run(&["compare", "wood.png", "spare.png", "--diff", "leaf.png"])
        .exits_with(0);
    assert!(
        fs::read(desk.path("leaf.png")).expect("a file") != pixel(),
        "the user named that file"
    );
}

/// Protects: under a default name, a picture of this program is replaced and any other file is
/// kept, whatever its content.
#[test]
fn unnamed_pictures_replace_only_our_own() {
    let desk = desk();
    let render = [&["render", "room.scene.toml"], &SMALL[..]].concat();
    desk.run(&render).exits_with(0);
    desk.run(&render).exits_with(0);
    let whole = fs::read(desk.path("room.png")).expect("a picture");
    for foreign in [
        pixel(),
        whole[..whole.len() - 5].to_vec(),
        b"notes".to_vec(),
        Vec::new(),
    ] {
        desk.write("room.png", &foreign);
        desk.run(&render).exits_with(4).says(
            "error: cannot write room.png: a file of that name is there, and it is not a picture by this program\n\
            help: name the picture with -o; -o room.png replaces that file",
        );
        assert!(fs::read(desk.path("room.png")).expect("a file") == foreign);
    }
    desk.run(&[&render[..], &["-o", "room.png"]].concat())
        .exits_with(0);
    assert_eq!(desk.picture("room.png").width, 4);
}

/// Protects: two outputs of a run are two files, however they are named.
#[cfg(unix)]
#[test]
fn outputs_do_not_replace_each_other() {
    let desk = desk();
    std::os::unix::fs::symlink("s.png", desk.path("s.json")).expect("a link");
    let run = desk.run(
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
    run.exits_with(2).says("error: s.png and s.json are one file, named twice as output\nhelp: name another file with --stats");
    assert!(!desk.path("s.png").exists());
}

/// Protects: a file that only its owner may read keeps its permissions when written again, for
/// every kind of output.
#[cfg(unix)]
#[test]
fn modes_are_kept() {
    use std::os::unix::fs::PermissionsExt;
    let desk = Desk::new();
    desk.write("sky.scene.toml", "format = 1\nsky.constant = 0.5\n");
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
    let start = || {
        for name in files {
            desk.write(name, "");
            fs::set_permissions(desk.path(name), fs::Permissions::from_mode(0o600))
                .expect("an own file");
        }
    };
    start();
    let render = [
        "render",
        "sky.scene.toml",
        "-q",
        "--size",
        "4x4",
        "--spp",
        "2",
    ];
    desk.run(
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
    desk.run(
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
    desk.run(&["compare", "a.png", "a.exr", "--diff", "diff.png"])
        .exits_with(0);
    desk.run(&["merge", "a.film", "-o", "merged.png"])
        .exits_with(0);
    for name in files {
        let there = fs::metadata(desk.path(name)).expect("a file");
        assert!(
            there.len() > 0 && there.permissions().mode() & 0o777 == 0o600,
            "{name}: {:o}",
            there.permissions().mode()
        );
    }
}

/// Protects: an unwritable output is reported before the first ray: no scene is rendered for hours
/// in vain, and no file is left.
#[cfg(unix)]
#[test]
fn outputs_are_tried_before_the_first_ray() {
    let desk = Desk::new();
    desk.write("sky.scene.toml", "format = 1\nsky.constant = 0.5\n");
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
        desk.run(&[&endless[..], &words].concat())
            .exits_with(4)
            .says_like("the name is too long");
    }
    assert_eq!(desk.names(), ["sky.scene.toml"]);
    let longest = "n".repeat(251) + ".png";
    desk.run(&[
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
    assert!(desk.path(&longest).exists());
}

/// Protects: a limit on file size ends a run with exit code 4, keeps the old file and leaves no
/// other.
#[cfg(target_os = "linux")]
#[test]
fn file_limits_leave_nothing_behind() {
    let desk = Desk::new();
    desk.write(
        "sky.scene.toml",
        "format = 1\nsky.map.image = \"a\"\nimages = [{ name = \"a\", path = \"noise.png\" }]\n",
    );
    let noise = image::RgbImage::from_fn(64, 64, |x, y| {
        let hash = (x * 64 + y).wrapping_mul(2_654_435_761);
        image::Rgb([(hash >> 8) as u8, (hash >> 16) as u8, (hash >> 24) as u8])
    });
    noise.save(desk.path("noise.png")).expect("a picture");
    for name in ["a.png", "a.exr", "a.film"] {
        desk.write(name, "old");
    }
    let program = desk.command::<&str>(&[]).get_program().to_owned();
    for arguments in ["-o a.exr", "-o a.png", "-o b.png --checkpoint a.film"] {
        let before = everything(&desk);
        let script = format!(
            "ulimit -f 4; exec \"$0\" render sky.scene.toml -q -s 96x96 --spp 4 {arguments}"
        );
        let mut shell = std::process::Command::new("sh");
        let run = shell
            .args(["-c", &script])
            .arg(&program)
            .current_dir(desk.path(""))
            .output()
            .expect("a shell");
        let said = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(4), "{arguments}: {said}");
        assert!(
            said.contains("larger than a file may become here"),
            "{said}"
        );
        assert_eq!(everything(&desk), before, "{arguments}");
    }
}

/// Protects: sheets and animations that do not fit on a full disk are kept beside the scene; a run
/// that fails between two pictures keeps its unfinished sheet and animation.
#[cfg(target_os = "linux")]
#[test]
fn full_disks_keep_sheets_and_animations() {
    let desk = Desk::new();
    desk.write("sky.scene.toml", "format = 1\nsky.constant = 0.5\n");
    for name in ["full.png", "full.gif", "full-2.gif"] {
        std::os::unix::fs::symlink("/dev/full", desk.path(name)).expect("a link");
    }
    let series = "sky.scene.toml -q -s 4x4 --spp 1 --allow-empty --frames 0..1:3".split(' ');
    let series: Vec<_> = series.collect();
    let sheet = ["--sheet", "full.png"];
    desk.run(&[&series[..], &sheet].concat())
        .exits_with(4)
        .says_like("the disk is full")
        .says_like("the sheet is kept in full-2.png");
    assert!(desk.picture("full-2.png").width > 12);
    desk.run(&[&series[..], &["-o", "full.gif"]].concat())
        .exits_with(4)
        .says_like("the animation is kept in full-3.gif");
    let kept = fs::read(desk.path("full-3.gif")).expect("the animation");
    assert!(kept.starts_with(b"GIF89a"));

    std::os::unix::fs::symlink("/dev/full", desk.path("full-1.exr")).expect("a link");
    let both = ["--sheet", "s.png", "-o", "full-%d.exr"];
    desk.run(&[&series[..], &both].concat())
        .exits_with(4)
        .says_like("the picture is kept in full-1-2.exr")
        .says_like("the pictures before it are in")
        .says_like("s.partial.png");
    assert!(desk.path("full-0.exr").exists() && desk.path("s.partial.png").exists());
}

/// Protects: a full disk ends a run with exit code 4, for every output; a picture for a file is
/// kept beside the scene under a new name, or in the temporary folder.
#[cfg(target_os = "linux")]
#[test]
fn full_disks_are_told() {
    let desk = Desk::new();
    desk.write("sky.scene.toml", "format = 1\nsky.constant = 0.5\n");
    std::os::unix::fs::symlink("/dev/full", desk.path("full.png")).expect("a link");
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
    desk.run(&full)
        .exits_with(4)
        .says_like("the disk is full")
        .says_like("the picture is kept in")
        .says_like("full-2.png");
    assert!(desk.picture("full-2.png").rgb.len() == 16 && desk.path("full.png").is_symlink());
    desk.run(&full).exits_with(4).says_like("full-3.png");
    let temporary = desk.path("temporary");
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
    let run = desk
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
    assert_eq!(desk.picture("temporary/full.png").rgb.len(), 16);
    let full = fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .expect("Linux has it");
    let run = desk
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
