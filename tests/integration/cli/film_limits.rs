//! Refusals of a film file: each reason by its message and exit code, without any file left behind.

use std::fs;

use raywright::io::output::read_film;
use raywright::io::{ErrorKind, Limits};

use crate::support::{ProgramRun, Sandbox};

const SCENE: &str = r#"
format = 1
render = { size = [40, 24], samples = 4 }
sky.constant = 0.5
[[cameras]]
pose.look_at = { eye = [0, 1, 4], target = [0, 0, 0] }
projection.pinhole = { vertical_fov = 50 }
[[materials]]
name = "white"
model.physical = {}
[[objects]]
shape.sphere = { centre = [0, 0, 0], radius = 1 }
material = "white"
"#;

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("ball.scene.toml", SCENE);
    render(&sandbox, "-o a.png --checkpoint a.film").exits_with(0);
    sandbox
}

fn render(sandbox: &Sandbox, words: &str) -> ProgramRun {
    let first = [
        "render",
        "ball.scene.toml",
        "--integrator",
        "path",
        "--progress=none",
    ];
    sandbox.run(
        &first
            .into_iter()
            .chain(words.split_whitespace())
            .collect::<Vec<&str>>(),
    )
}

fn merge(sandbox: &Sandbox, words: &str) -> ProgramRun {
    sandbox.run(
        &["merge"]
            .into_iter()
            .chain(words.split_whitespace())
            .collect::<Vec<&str>>(),
    )
}

/// Protects: a film is read under a limit equal to the memory of the film and its picture, and
/// refused one byte below with name and amount, by every command that reads films.
#[test]
fn a_film_over_the_limit_is_refused() {
    let sandbox = sandbox();
    let path = sandbox.path("a.film");
    let kept_film = read_film(&path, &Limits::default()).expect("a film");
    let needed = kept_film
        .film
        .header()
        .bytes()
        .expect("a header that makes sense");
    let within = |memory_bytes: u64| {
        read_film(
            &path,
            &Limits {
                memory_bytes,
                ..Limits::default()
            },
        )
    };
    assert!(within(needed).is_ok());
    let refused = within(needed - 1).expect_err("one byte too few");
    assert_eq!(refused.kind(), ErrorKind::Limit, "{refused}");
    let before = sandbox.names();
    for run in [
        merge(&sandbox, "a.film -o b.png --max-memory 1K"),
        render(
            &sandbox,
            "--spp 8 --resume a.film -o b.png --max-memory 10K",
        ),
        render(&sandbox, "--replay a.film -o b.png --max-memory 10K"),
    ] {
        run.exits_with(5);
    }
    merge(&sandbox, "a.film -o b.png --max-memory 1K")
        .prints_like("a.film: the film needs ")
        .prints_like(", more than the limit of 1 KiB")
        .prints_like("--max-memory");
    assert_eq!(sandbox.names(), before);
}

/// Protects: every kind of invalid film has its own message, with the exit code of wrong input and
/// no output: other files, other versions, headers and films that are truncated, changed, or too
/// long.
#[test]
fn what_is_no_film_says_why() {
    let sandbox = sandbox();
    let whole = fs::read(sandbox.path("a.film")).expect("a film");
    let changed = |place: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[place] = byte;
        bytes
    };
    let header_end = 28
        + usize::try_from(u64::from_le_bytes(whole[20..28].try_into().expect("eight")))
            .expect("short");
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (
            b"P6 1 1 255 abc".to_vec(),
            "the file is not a film file; films are written by --checkpoint",
        ),
        (
            Vec::new(),
            "the file is not a film file; films are written by --checkpoint",
        ),
        (
            changed(16, 200),
            "the film file has version 200, but this program reads only version ",
        ),
        (
            changed(27, 1),
            "the header of the film file is longer than any valid header: the file is damaged; copy it again, or render again",
        ),
        (
            changed(28, b'!'),
            "the header of the film file is invalid: ",
        ),
        (whole[..18].to_vec(), "the film file is truncated"),
        (
            whole[..header_end - 1].to_vec(),
            "the film file is truncated",
        ),
        (
            whole[..header_end + 5].to_vec(),
            "the film file is truncated",
        ),
        (
            whole[..whole.len() - 1].to_vec(),
            "the film file is truncated",
        ),
        (
            changed(header_end + 3, whole[header_end + 3] ^ 1),
            "the checksum is wrong: the file was damaged or changed; copy it again, or render again",
        ),
        (
            [&whole[..], b"x"].concat(),
            "the file continues after the end of the film; copy it again, or render again",
        ),
    ];
    for (bytes, reason) in cases {
        sandbox.write("b.film", bytes);
        let before = sandbox.names();
        for run in [
            merge(&sandbox, "b.film -o b.png"),
            render(&sandbox, "--spp 8 --resume b.film -o b.png"),
        ] {
            run.exits_with(3).prints_like(&format!("b.film: {reason}"));
        }
        assert_eq!(sandbox.names(), before, "{reason}");
    }
    fs::create_dir(sandbox.path("c.film")).expect("a folder");
    for run in [
        merge(&sandbox, "c.film -o b.png"),
        render(&sandbox, "--spp 8 --resume c.film -o b.png"),
        merge(&sandbox, "d.film -o b.png"),
    ] {
        run.exits_with(4).prints_like("cannot read ");
    }
}

/// Protects: a film of another program version is not resumed, merged or replayed, because its
/// samples may differ: a later or earlier one, one whose number begins alike, another program. A
/// part of another version is refused at any position, although it fits the other parts.
#[test]
fn a_film_of_another_version_is_refused() {
    let sandbox = sandbox();
    let mut kept_film = read_film(&sandbox.path("a.film"), &Limits::default()).expect("a film");
    kept_film.metadata.software = "Raywright 0.0.1".to_owned();
    raywright::io::output::write_film(&sandbox.path("b.film"), &mut kept_film)
        .expect("it can be written");
    for part in [1, 2] {
        render(
            &sandbox,
            &format!("--part {part}/2 --checkpoint {part}.film"),
        )
        .exits_with(0);
    }
    merge(&sandbox, "1.film 2.film -o c.png").exits_with(0);
    let other_part = |number: u32, software: &str| {
        let path = sandbox.path(format!("{number}.film"));
        let mut part = read_film(&path, &Limits::default()).expect("a film");
        part.metadata.software = software.to_owned();
        raywright::io::output::write_film(&sandbox.path("other.film"), &mut part)
            .expect("it can be written");
    };
    let own = kept_film_software(&sandbox);
    let shorter = own[..own.len() - 1].to_owned();
    for other in [
        &format!("{own}0"),
        &shorter,
        "Raywright 99.0.0",
        "Tracer 1",
        "",
    ] {
        other_part(2, other);
        for words in ["1.film other.film -o d.png", "other.film 1.film -o d.png"] {
            merge(&sandbox, words).exits_with(3).prints_like(&format!(
                "other.film: the file was made by {other}, and this program is {own}"
            ));
        }
    }
    assert!(!sandbox.path("d.png").exists());
    for run in [
        merge(&sandbox, "b.film -o b.png"),
        merge(&sandbox, "a.film b.film -o b.png"),
        render(&sandbox, "--spp 8 --resume b.film -o b.png"),
        render(&sandbox, "--replay b.film -o b.png"),
    ] {
        run.exits_with(3)
            .prints_like("b.film: the file was made by Raywright 0.0.1, and this program is ");
    }
}

/// Program and version in the films of this program.
fn kept_film_software(sandbox: &Sandbox) -> String {
    let kept_film = read_film(&sandbox.path("a.film"), &Limits::default()).expect("a film");
    kept_film.metadata.software
}
