//! What no output replaces: the files that a run reads or its scene names, and, where the user named nothing, anybody's files
//! but our own pictures.

use std::fs;

use crate::support::Desk;

/// A pixel by another program, as every texture here.
fn pixel() -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(1, 1).write_to(&mut file, image::ImageFormat::Png).expect("a picture");
    file.into_inner()
}

const SMALL: [&str; 5] = ["--size", "4x4", "--spp", "1", "-q"];

/// A scene with a texture that is there and one that is not, and an OBJ model with two libraries.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.write("wood.png", pixel());
    desk.write(
        "room.scene.toml",
        "format = 1\nsky.constant = 1\n[[images]]\nname = \"wood\"\npath = \"wood.png\"\n\
        [[images]]\nname = \"gone\"\npath = \"gone.png\"\n",
    );
    desk.write("leaf.obj", "mtllib a.mtl b.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    desk.write("a.mtl", "newmtl a\nmap_Kd leaf.png\n");
    desk.write("b.mtl", "newmtl unused\nmap_Kd spare.png\n");
    for name in ["leaf.png", "spare.png"] {
        desk.write(name, pixel());
    }
    desk
}

fn everything(desk: &Desk) -> Vec<(String, Vec<u8>)> {
    let files = desk.names().into_iter().filter(|name| desk.path(name).is_file());
    files.map(|name| (name.clone(), fs::read(desk.path(&name)).expect("a file"))).collect()
}

/// Protects: an output that is an input of the run, or that the scene names, is refused before the render, under every
/// name of that file and by every flag, and nothing is touched.
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
        ("room.scene.toml", "-o", "sub/../wood.png", "this run reads it"),
        ("room.scene.toml", "-o", "link.png", "this run reads it"),
        ("./sub/../room.scene.toml", "-o", "hard.png", "wood.png, which this run reads"),
        ("room.scene.toml", "-o", "gone.png", "the scene names it as a file of its own"),
        ("room.scene.toml", "-o", "ahead.png", "the scene names it as a file of its own"),
        ("room.scene.toml", "--stats", "room.json", "this run reads it"),
        ("leaf.obj", "--stats", "mtl.json", "this run reads it"),
        ("leaf.obj", "--stats", "b.json", "this run reads it"),
        ("leaf.obj", "-o", "spare.png", "the scene names it as a file of its own"),
        ("leaf.obj", "-o", "leaf.png", "this run reads it"),
    ];
    for (scene, flag, output, cause) in cases {
        let run = desk.run(&[&["render", scene, flag, output], &SMALL[..]].concat());
        run.exits_with(2);
        assert!(run.stderr.contains(&format!("cannot write {output}: ")), "{}", run.stderr);
        assert!(run.stderr.contains(cause), "{}", run.stderr);
        assert!(run.stderr.contains(&format!("help: name another file with {flag}")), "{}", run.stderr);
    }
    // Named by nobody: the model's own texture.
    desk.run(&[&["render", "leaf.obj"], &SMALL[..]].concat())
        .exits_with(2)
        .says("error: cannot write leaf.png: this run reads it\nhelp: name another file with -o");
    assert!(everything(&desk) == before, "something was written: {:?}", desk.names());
}

/// Protects: neither side of a comparison is replaced by the picture of their difference.
#[test]
fn compared_pictures_are_never_replaced() {
    let desk = desk();
    fs::hard_link(desk.path("spare.png"), desk.path("hard.png")).expect("a link");
    let before = everything(&desk);
    for output in ["wood.png", "./spare.png", "hard.png"] {
        let run = desk.run(&["compare", "wood.png", "spare.png", "--diff", output]);
        run.exits_with(2);
        assert!(run.stderr.contains("help: name another file with --diff"), "{}", run.stderr);
        assert!(everything(&desk) == before);
    }
    desk.run(&["compare", "wood.png", "spare.png", "--diff", "leaf.png"]).exits_with(0);
    assert!(fs::read(desk.path("leaf.png")).expect("a file") != pixel(), "the user named that file");
}

/// Protects: where the user names nothing, a picture of ours is replaced and any other file is kept, whatever it holds.
#[test]
fn unnamed_pictures_replace_only_our_own() {
    let desk = desk();
    let render = [&["render", "room.scene.toml"], &SMALL[..]].concat();
    desk.run(&render).exits_with(0);
    desk.run(&render).exits_with(0);
    let whole = fs::read(desk.path("room.png")).expect("a picture");
    for foreign in [pixel(), whole[..whole.len() - 5].to_vec(), b"notes".to_vec(), Vec::new()] {
        desk.write("room.png", &foreign);
        desk.run(&render).exits_with(4).says(
            "error: cannot write room.png: a file of that name is there, and it is not a picture by this program\n\
            help: name the picture with -o; -o room.png replaces that file",
        );
        assert!(fs::read(desk.path("room.png")).expect("a file") == foreign);
    }
    desk.run(&[&render[..], &["-o", "room.png"]].concat()).exits_with(0);
    assert_eq!(desk.picture("room.png").width, 4);
}

/// Protects: two outputs of one run are two files, however they are named.
#[cfg(unix)]
#[test]
fn outputs_do_not_replace_each_other() {
    let desk = desk();
    std::os::unix::fs::symlink("s.png", desk.path("s.json")).expect("a link");
    let run = desk.run(&[&["render", "room.scene.toml", "-o", "s.png", "--stats", "s.json"], &SMALL[..]].concat());
    run.exits_with(2).says("error: s.png and s.json are one file, named twice as output\nhelp: name another file with --stats");
    assert!(!desk.path("s.png").exists());
}
