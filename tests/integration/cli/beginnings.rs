//! The early stage of a run: memory beyond the limit, refused threads, and interruptions while a
//! scene is loaded.

use std::io::Read;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::json;

use crate::support::Sandbox;

/// Concatenates `count` numbered texts.
fn many(count: usize, one: impl Fn(usize) -> String) -> String {
    (0..count).map(one).collect()
}

/// Runs the program with an address space of this many kibibytes; `None` where the system cannot
/// limit it.
#[cfg(unix)]
fn within(sandbox: &Sandbox, kibibytes: usize, words: &str) -> Option<Output> {
    let script = format!("ulimit -v {kibibytes} || exit 77; exec \"$0\" {words}");
    let run = Command::new("sh")
        .args(["-c", &script, env!("CARGO_BIN_EXE_raywright")])
        .current_dir(sandbox.path(""))
        .output();
    let run = run.expect("a shell");
    if run.status.code() == Some(77) {
        eprintln!("skipped: the system limits no memory");
        return None;
    }
    Some(run)
}

/// Protects: large numbers of any item, used or not, count against `--max-memory`: materials,
/// objects, generators, lights, cameras, parameters, images, textures and names, in each notation
/// and format; the run ends with one message and the exit code of limits.
#[test]
fn lists_of_every_kind_are_counted() {
    const COUNT: usize = 40_000;
    let ball = "shape.sphere = { centre = [0, 0, 0], radius = 1 }";
    let paint = "[[materials]]\nname = \"m\"\nmodel.physical = {}\n";
    let camera = "pose.look_at = { eye = [0, 0, 5], target = [0, 0, 0] }\nprojection.pinhole = { vertical_fov = 40 }\n";
    let scenes = [
        (
            "materials",
            many(COUNT, |i| {
                format!("[[materials]]\nname = \"m{i}\"\nmodel.physical = {{}}\n")
            }),
        ),
        (
            "objects",
            paint.to_owned()
                + &many(COUNT, |i| {
                    format!("[[objects]]\nname = \"o{i}\"\nmaterial = \"m\"\n{ball}\n")
                }),
        ),
        (
            "generators",
            paint.to_owned()
                + &many(COUNT, |_| {
                    format!(
                        "[[generators]]\nkind.scatter = {{ count = 1, min = [0, 0, 0], max = [1, 1, 1] }}\nobject = {{ material = \"m\", {ball} }}\n"
                    )
                }),
        ),
        (
            "lights",
            many(COUNT, |_| {
                "[[lights]]\nkind.point.position = [0, 9, 0]\ncolour = 1\n".to_owned()
            }),
        ),
        (
            "cameras",
            many(COUNT, |i| format!("[[cameras]]\nname = \"c{i}\"\n{camera}")),
        ),
        (
            "parameters",
            "[parameters]\n".to_owned() + &many(4 * COUNT, |i| format!("p{i} = {i}\n")),
        ),
        (
            "textures",
            many(COUNT, |i| {
                format!("[[textures]]\nname = \"t{i}\"\nimage = \"a\"\n")
            }),
        ),
        ("title", format!("title = \"{}\"\n", "x".repeat(20 << 20))),
    ];
    let sandbox = Sandbox::new();
    for (kind, text) in scenes {
        sandbox.write(format!("{kind}.scene.toml"), format!("format = 1\n{text}"));
    }
    let materials: Vec<_> = (0..COUNT)
        .map(|i| json!({ "name": format!("m{i}"), "model": { "physical": {} } }))
        .collect();
    sandbox.write(
        "json.scene.json",
        json!({ "format": 1, "materials": materials }).to_string(),
    );
    let nodes = vec![json!({ "name": "n" }); COUNT];
    let document = json!({ "asset": { "version": "2.0" }, "nodes": nodes, "materials": vec![json!({}); COUNT] });
    sandbox.write("model.gltf", document.to_string());
    sandbox.write("paint.mtl", many(3 * COUNT, |i| format!("newmtl m{i}\n")));
    sandbox.write(
        "model.obj",
        "mtllib paint.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m1\nf 1 2 3\n",
    );
    for name in sandbox
        .names()
        .iter()
        .filter(|name| !name.ends_with(".mtl"))
    {
        let run = sandbox.run(&[
            "render",
            name,
            "--max-memory",
            "1M",
            "-s",
            "8x8",
            "--spp",
            "1",
            "-o",
            "a.png",
        ]);
        assert_eq!(run.code, Some(5), "{name}: {}", run.stderr);
        assert!(
            run.stderr.starts_with(&format!("error: {name}")),
            "{name}: {}",
            run.stderr
        );
        assert_eq!(
            run.stderr.matches("error").count(),
            1,
            "{name}: {}",
            run.stderr
        );
        assert!(run.stderr.lines().count() <= 2, "{name}: {}", run.stderr);
    }
    assert!(!sandbox.path("a.png").exists());
}

/// Protects: framing a whole scene takes little memory, however many objects the scene has.
#[cfg(unix)]
#[test]
fn framing_takes_little_memory() {
    let sandbox = Sandbox::new();
    let scatter = "kind.scatter = { count = 60000, min = [-4, -4, -4], max = [4, 4, 4] }";
    sandbox.write(
        "many.scene.toml",
        format!(
            "format = 1\nsky.constant = 1\nmaterials = [{{ name = \"m\", model.classic = {{}} }}]\n[[generators]]\n{scatter}\n\
             object = {{ shape.sphere = {{ centre = [0, 0, 0], radius = 0.01 }}, material = \"m\" }}\n"
        ),
    );
    let run = within(
        &sandbox,
        200_000,
        "render many.scene.toml --threads 1 --max-memory 60M -s 8x8 --spp 1 -o a.png",
    );
    let Some(run) = run else { return };
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
}

/// Protects: memory exhausted anywhere during a load gives one message and the exit code of limits,
/// and no abort.
#[cfg(unix)]
#[test]
fn what_the_system_refuses_is_told() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "a.scene.toml",
        format!(
            "format = 1\n{}",
            many(60_000, |i| format!(
                "[[materials]]\nname = \"m{i}\"\nmodel.physical = {{}}\n"
            ))
        ),
    );
    for (kibibytes, words, message) in [
        (
            200_000,
            "render a.scene.toml --threads 1 --max-memory 99G -s 8x8 -o a.png",
            "a.scene.toml: loading and preparing the scene takes more memory than the system provides\n",
        ),
        (
            200_000,
            "info a.scene.toml",
            "a.scene.toml: loading and preparing the scene takes more memory than the system provides\n",
        ),
    ] {
        let Some(run) = within(&sandbox, kibibytes, words) else {
            return;
        };
        let text = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(5), "{words}: {text}");
        assert!(
            text.starts_with(&format!("error: {message}")) && text.lines().count() == 2,
            "{words}: {text}"
        );
    }
    assert_eq!(sandbox.names(), ["a.scene.toml"]);
}

/// Starts a run that waits for a scene whose text never ends.
fn waiting(sandbox: &Sandbox, words: &[&str]) -> Child {
    let words = [&["render", "-", "-s", "8x8"], words].concat();
    sandbox
        .command(&words)
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts")
}

/// Waits until a run handles Ctrl-C; before that the signal kills the process.
#[cfg(unix)]
fn wait_for_handler(child: &Child) {
    wait_for_handler_until(child, Instant::now() + PATIENCE);
}

/// Time after which a run is not waited for.
#[cfg(unix)]
const PATIENCE: Duration = Duration::from_secs(20);

/// Waits until a run handles Ctrl-C, at most until a time.
#[cfg(unix)]
fn wait_for_handler_until(child: &Child, deadline: Instant) {
    const INTERRUPT: u64 = 1 << 1;
    let handles = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
        let mask = status
            .lines()
            .find_map(|line| line.strip_prefix("SigCgt:"))?;
        Some(u64::from_str_radix(mask.trim(), 16).expect("a mask of signals") & INTERRUPT != 0)
    };
    let pause = |milliseconds| std::thread::sleep(Duration::from_millis(milliseconds));
    // Without that information from the system, a fixed pause is used.
    while Instant::now() < deadline
        && !handles().unwrap_or_else(|| {
            pause(3000);
            true
        })
    {
        pause(20);
    }
}

/// Protects: the first Ctrl-C ends a run during the load, with its exit code and message, whatever
/// blocks its cancellation checks.
#[cfg(unix)]
#[test]
fn reading_is_interrupted() {
    let sandbox = Sandbox::new();
    for words in [
        &[][..],
        &["--threads", "2"],
        &["--views", "front,top", "--sheet", "a.png"],
    ] {
        let mut child = waiting(&sandbox, words);
        let standard_input = child.stdin.take();
        wait_for_handler(&child);
        let kill = Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status()
            .expect("kill runs");
        assert!(kill.success());
        let run = child.wait_with_output().expect("ends");
        drop(standard_input);
        let text = String::from_utf8_lossy(&run.stderr);
        assert_eq!(
            (run.status.code(), text.as_ref()),
            (Some(130), "error: interrupted; nothing was written\n"),
            "{words:?}"
        );
        assert!(sandbox.names().is_empty());
    }
}

/// Protects: a run waits for its scene until the end of its budget, not only for the least budget.
#[test]
fn reading_has_all_of_the_budget() {
    use std::io::Write as _;
    let sandbox = Sandbox::new();
    let mut child = waiting(&sandbox, &["--budget", "1h", "--spp", "1", "-o", "a.png"]);
    std::thread::sleep(Duration::from_millis(1500));
    let written = child
        .stdin
        .take()
        .expect("piped")
        .write_all(b"format = 1\nsky.constant = 0.5\n");
    let run = child.wait_with_output().expect("ends");
    assert_eq!(
        (run.status.code(), written.is_ok()),
        (Some(0), true),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
}

/// Protects: the budget ends a run that has no picture yet, with one message and the exit code of
/// limits.
#[test]
fn reading_ends_with_the_budget() {
    let sandbox = Sandbox::new();
    let mut child = waiting(&sandbox, &["--budget", "1s"]);
    let standard_input = child.stdin.take();
    let run = child.wait_with_output().expect("ends");
    drop(standard_input);
    let text = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(5), "{text}");
    assert!(
        text.starts_with("error: standard input: the time limit of 1.00 s ended the run before the scene was loaded and prepared; nothing was written\n"),
        "{text}"
    );
    assert!(sandbox.names().is_empty());
}

/// Message of a run that ends before it has a result.
const NOTHING: &str = "error: interrupted; nothing was written\n";

/// Commands that load, search or measure, each with work that lasts: standard input and named pipes
/// that never end, a large model, and measurements.
#[cfg(target_os = "linux")]
const LASTING: [(&str, &str); 16] = [
    ("render - -o a.png", NOTHING),
    ("render big.obj --frames all:25 -o %04d.png", NOTHING),
    ("view big.obj --no-open", NOTHING),
    ("merge a.film -o a.png --checkpoint b.film", NOTHING),
    ("denoise a.film -o a.png", NOTHING),
    ("explain -", NOTHING),
    ("compare a.film b.film --diff a.png", NOTHING),
    ("info -", NOTHING),
    ("info a.film", NOTHING),
    ("check -", NOTHING),
    ("accuracy - -o a.json", NOTHING),
    ("bench -", NOTHING),
    ("bench --seconds 9000 -o a.svg", NOTHING),
    ("stability --rays all -o a.md", NOTHING),
    ("stress - -o a.png", NOTHING),
    (
        "thumbs models -o out",
        "error: interrupted; finished pictures are kept, and the next run renders the others\n",
    ),
];

/// Protects: in every command, the first Ctrl-C and the first request to terminate are heard while a
/// file is read, a folder is searched or a measurement runs. The run ends with the exit code of an
/// interrupted run, and writes no file.
#[cfg(target_os = "linux")]
#[test]
fn every_command_is_interrupted() {
    for (signal, sandbox) in [("-INT", Sandbox::new()), ("-TERM", Sandbox::new())] {
        std::fs::create_dir(sandbox.path("models")).expect("a folder");
        let made = Command::new("mkfifo").arg(sandbox.path("a.film")).status();
        if !made.is_ok_and(|status| status.success()) {
            eprintln!("skipped: no pipes with names");
            return;
        }
        let model = "v 0.1 0.2 0.3\n".repeat(4_000_000) + "f 1 2 3\n";
        sandbox.write("models/a.obj", &model);
        sandbox.write("big.obj", &model);
        let names = sandbox.names();
        let start = |(words, message): (&'static str, &'static str)| {
            let child = sandbox
                .command(&words.split(' ').collect::<Vec<_>>())
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn();
            (words, message, child.expect("starts"))
        };
        let mut runs = LASTING.map(start);
        let deadline = Instant::now() + PATIENCE;
        runs.iter()
            .for_each(|(.., child)| wait_for_handler_until(child, deadline));
        // The runs have begun to wait, to read or to measure.
        std::thread::sleep(Duration::from_millis(300));
        let send = |signal: &str, child: &Child| {
            let id = child.id().to_string();
            let sent = Command::new("kill").args([signal, &id]).status();
            sent.expect("kill runs");
        };
        runs.iter().for_each(|(.., child)| send(signal, child));
        // A run that does not hear the signal is ended, and has no exit code.
        let deadline = Instant::now() + PATIENCE;
        for (words, message, child) in &mut runs {
            while child.try_wait().expect("a child").is_none() && Instant::now() < deadline {
                std::thread::sleep(Duration::from_millis(20));
            }
            child.kill().expect("it runs, or has ended");
            let code = child.wait().expect("ends").code();
            let mut text = String::new();
            let mut stderr = child.stderr.take().expect("piped");
            stderr.read_to_string(&mut text).expect("text");
            // `view` has told its address before it reads the scene.
            let address = text.find("error: ").filter(|_| words.starts_with("view"));
            let told = &text[address.unwrap_or(0)..];
            assert_eq!((code, told), (Some(130), *message), "{signal} {words}");
        }
        assert_eq!(sandbox.names(), names, "{signal}");
    }
}

/// Protects: a small stack of the first thread is no reason to abort.
#[cfg(target_os = "linux")]
#[test]
fn small_stacks_are_enough() {
    let sandbox = Sandbox::new();
    for words in [
        "render preset:whitted -s 8x8 -o a.png -q",
        "schema",
        "info preset:whitted",
    ] {
        for kibibytes in [64, 1024] {
            let script = format!("ulimit -s {kibibytes} || exit 77; exec \"$0\" {words}");
            let run = Command::new("sh")
                .args(["-c", &script, env!("CARGO_BIN_EXE_raywright")])
                .current_dir(sandbox.path(""))
                .output()
                .expect("a shell");
            let text = String::from_utf8_lossy(&run.stderr);
            if run.status.code() != Some(77) {
                assert_eq!(run.status.code(), Some(0), "{words}, {kibibytes}: {text}");
            }
        }
    }
}

/// Protects: a result for a closed standard output is not lost silently; `/dev/null` is open.
#[cfg(target_os = "linux")]
#[test]
fn a_closed_output_is_told() {
    let sandbox = Sandbox::new();
    for words in ["render preset:whitted -s 8x8 -q -o -", "schema"] {
        for (redirection, code) in [(">&-", 4), (">/dev/null", 0), ("1<>/dev/null", 0)] {
            let script = format!("exec \"$0\" {words} {redirection}");
            let run = Command::new("sh")
                .args(["-c", &script, env!("CARGO_BIN_EXE_raywright")])
                .current_dir(sandbox.path(""))
                .output()
                .expect("a shell");
            let text = String::from_utf8_lossy(&run.stderr);
            assert_eq!(
                run.status.code(),
                Some(code),
                "{words} {redirection}: {text}"
            );
            let message = "error: cannot write to standard output: standard output is closed";
            assert_eq!(text.starts_with(message), code == 4, "{text}");
        }
    }
}

/// Protects: an image beyond the memory limit is refused with the limit and the flag that raises it.
#[test]
fn images_over_the_limit_name_the_limit() {
    let sandbox = Sandbox::new();
    let image = image::RgbImage::new(4000, 4000);
    image.save(sandbox.path("sky.png")).expect("a picture");
    sandbox.write(
        "sky.scene.toml",
        "format = 1\nsky.map.image = \"a\"\nimages = [{ name = \"a\", path = \"sky.png\" }]\n",
    );
    let run = sandbox.run(&[
        "render",
        "sky.scene.toml",
        "-s",
        "8x8",
        "--max-memory",
        "64M",
        "-o",
        "a.png",
    ]);
    run.exits_with(5)
        .prints_like("the limit of 64 MiB")
        .prints_like("raise the limit with --max-memory");
    assert!(
        !run.stderr.contains("close other programs"),
        "{}",
        run.stderr
    );
}
