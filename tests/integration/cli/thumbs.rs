//! `thumbs`: a picture of every model below a folder, rendered only after changes.

use std::time::{Duration, SystemTime};

use crate::support::Sandbox;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

/// Lines of standard output, in order.
fn lines(sandbox: &Sandbox, args: &[&str]) -> Vec<String> {
    let run = sandbox.run(&[&["thumbs", "models", "-o", "out"], args].concat());
    run.exits_with(0)
        .text()
        .lines()
        .map(str::to_owned)
        .collect()
}

/// Protects: every model of every folder has its own picture, newest first; a second run renders
/// none; a changed input file, a changed size and a missing picture each cause exactly one render.
#[test]
fn pictures_are_made_where_something_changed() {
    let sandbox = Sandbox::new();
    let folder = sandbox.path("models");
    std::fs::create_dir_all(folder.join("deep/.hidden")).expect("folders");
    let put = |name: &str, text: &str, age: u64| {
        std::fs::write(folder.join(name), text).expect("a file");
        let file = std::fs::File::options()
            .write(true)
            .open(folder.join(name))
            .expect("the file");
        file.set_modified(SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000 - age))
            .expect("its time");
    };
    let with_library = "mtllib a.mtl\nusemtl m\n".to_owned() + SQUARE;
    put("a.obj", &with_library, 30);
    put("a.mtl", "newmtl m\nKd 0.8 0.1 0.1\n", 0);
    put("deep/a.obj", SQUARE, 10);
    put(
        "deep/a.stl",
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\nendsolid\n",
        20,
    );
    put("deep/.hidden/b.obj", SQUARE, 0);
    put("notes.txt", "no model", 0);
    let all = |states: [&str; 3]| {
        let names = ["deep/a.obj", "deep/a.stl", "a.obj"];
        states
            .iter()
            .zip(names)
            .map(|(state, name)| format!("{state} out/{name}.png"))
            .collect::<Vec<_>>()
    };
    assert_eq!(
        lines(&sandbox, &["--size", "32"]),
        all(["new ", "new ", "new "])
    );
    let picture = sandbox.picture("out/a.obj.png");
    assert_eq!((picture.width, picture.height), (32, 32));
    assert!(
        picture.rgb.iter().any(|[r, g, _]| *r > 2.0 * g),
        "the material's red"
    );
    assert_eq!(
        lines(&sandbox, &["--size", "32"]),
        all(["same", "same", "same"])
    );
    put("a.mtl", "newmtl m\nKd 0.1 0.1 0.8\n", 0);
    assert_eq!(
        lines(&sandbox, &["--size", "32"]),
        all(["same", "same", "new "])
    );
    std::fs::remove_file(sandbox.path("out/deep/a.obj.png")).expect("a picture");
    assert_eq!(
        lines(&sandbox, &["--size", "32"]),
        all(["new ", "same", "same"])
    );
    assert_eq!(
        lines(&sandbox, &["--size", "48"]),
        all(["new ", "new ", "new "])
    );
}

/// Protects: a failed model is named and does not stop the others, and the worst exit code is
/// returned; a foreign file is not replaced; pictures below the folder are no models of the next
/// run; a foreign index is refused.
#[test]
fn what_fails_keeps_nothing_away() {
    let sandbox = Sandbox::new();
    std::fs::create_dir_all(sandbox.path("models")).expect("a folder");
    sandbox.write("models/good.obj", SQUARE);
    sandbox.write("models/broken.glb", "glTF");
    let run = sandbox.run(&["thumbs", "models", "-o", "models/out", "--size", "16"]);
    run.exits_with(3).prints_like("broken.glb");
    run.prints_like("the pictures of 1 of 2 models could not be made; see the errors above");
    assert_eq!(run.text(), "new  models/out/good.obj.png\n");
    std::fs::remove_file(sandbox.path("models/broken.glb")).expect("the file");
    std::fs::write(sandbox.path("models/out/good.obj.png"), "mine").expect("a file");
    sandbox
        .run(&["thumbs", "models", "-o", "models/out", "--size", "16"])
        .exits_with(4)
        .prints_like("no picture made by this program");
    assert_eq!(
        std::fs::read(sandbox.path("models/out/good.obj.png")).expect("the file"),
        b"mine"
    );
    std::fs::write(sandbox.path("models/out/thumbs.json"), "[]").expect("a file");
    sandbox
        .run(&["thumbs", "models", "-o", "models/out"])
        .exits_with(3)
        .prints_like("the file is no index of `raywright thumbs`");
    sandbox.run(&["thumbs", "none", "-o", "out"]).exits_with(4);
}

/// Protects: a missing texture that appears, and one that disappears, renew the picture of their
/// model.
#[test]
fn missing_files_that_come_are_noticed() {
    let sandbox = Sandbox::new();
    std::fs::create_dir_all(sandbox.path("models")).expect("a folder");
    sandbox.write(
        "models/a.obj",
        "mtllib a.mtl\nusemtl m\nvt 0 0\n".to_owned()
            + &SQUARE.replace("f 1 2 3 4", "f 1/1 2/1 3/1 4/1"),
    );
    sandbox.write("models/a.mtl", "newmtl m\nKd 1 1 1\nmap_Kd red.png\n");
    assert_eq!(lines(&sandbox, &["--size", "16"]), ["new  out/a.obj.png"]);
    assert_eq!(lines(&sandbox, &["--size", "16"]), ["same out/a.obj.png"]);
    let red = image::RgbImage::from_pixel(1, 1, image::Rgb([255, 0, 0]));
    red.save(sandbox.path("models/red.png")).expect("a picture");
    assert_eq!(lines(&sandbox, &["--size", "16"]), ["new  out/a.obj.png"]);
    assert!(
        sandbox
            .picture("out/a.obj.png")
            .rgb
            .iter()
            .any(|[r, g, _]| *r > 2.0 * g),
        "the texture's red"
    );
    assert_eq!(lines(&sandbox, &["--size", "16"]), ["same out/a.obj.png"]);
    std::fs::remove_file(sandbox.path("models/red.png")).expect("a file");
    assert_eq!(lines(&sandbox, &["--size", "16"]), ["new  out/a.obj.png"]);
}

/// Protects: an all-white picture gets a lower exposure, and an empty one is a failure.
#[test]
fn thumbnails_show_something() {
    let sandbox = Sandbox::new();
    std::fs::create_dir_all(sandbox.path("models")).expect("a folder");
    sandbox.write(
        "models/bright.obj",
        "mtllib a.mtl\nusemtl m\n".to_owned() + SQUARE,
    );
    sandbox.write("models/a.mtl", "newmtl m\nKd 0.5 0.5 0.5\nKe 40 30 20\n");
    lines(&sandbox, &["--size", "16"]);
    let codes = |[r, _, b]: [f32; 3]| r > b && r < 1.0;
    assert!(
        sandbox
            .picture("out/bright.obj.png")
            .rgb
            .into_iter()
            .any(codes),
        "the lamp's colour"
    );
    sandbox.write("models/point.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n");
    sandbox
        .run(&["thumbs", "models", "-o", "out", "--size", "16"])
        .exits_with(3)
        .prints_like("there is nothing to see");
    assert!(!sandbox.path("out/point.obj.png").exists());
}

/// Protects: each folder is searched once, however many links lead to it: to a folder above, to the
/// same folder, to one another, to a folder beside. A folder has its path without links; a linked
/// folder outside has the link's; pictures of an earlier run are no models.
#[cfg(unix)]
#[test]
fn linked_folders_are_searched_once() {
    use std::os::unix::fs::symlink;
    let sandbox = Sandbox::new();
    for folder in ["models/a/b", "models/c", "outside"] {
        std::fs::create_dir_all(sandbox.path(folder)).expect("folders");
    }
    for model in ["models/a/b/t.obj", "models/c/u.obj", "outside/v.obj"] {
        sandbox.write(model, SQUARE);
    }
    for (target, link) in [
        ("..", "models/a/up"),
        (".", "models/a/same"),
        ("../../c", "models/a/b/beside"),
        ("../a", "models/c/a"),
        ("a", "models/0"),
        ("../outside", "models/far"),
        ("../../outside", "models/a/farther"),
        ("missing", "models/lost"),
        ("round", "models/round"),
    ] {
        symlink(target, sandbox.path(link)).expect("a link");
    }
    let found = lines(&sandbox, &["--size", "16"]);
    let has = |line: &str| found.iter().any(|found| found.ends_with(line));
    let all = ["out/a/b/t.obj.png", "out/c/u.obj.png", "/v.obj.png"];
    assert!(found.len() == 3 && all.into_iter().all(has), "{found:?}");
    // The folder of the pictures may be the searched folder.
    let run = sandbox.run(&["thumbs", "models", "-o", "models", "--size", "16"]);
    assert_eq!(run.exits_with(0).text().lines().count(), 3);
}
