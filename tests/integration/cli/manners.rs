//! Conventions of the command line: flags in any position, the last of repeated flags in force,
//! optional colours, one line per render, tables that fit, and helpful messages.

use crate::support::{ProgramRun, Sandbox};

const BALL: &str = "format = 1\nsky.constant = 1\n[[materials]]\nname = \"m\"\nmodel.physical.base_colour = COLOUR\n\
    [[objects]]\nmaterial = \"m\"\nshape.sphere = { centre = [0, 0, 0], radius = 1 }\n";
const TRIANGLE: &str = "v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n";

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("ball.scene.toml", BALL.replace("COLOUR", "[0.5, 0.2, 0.1]"));
    sandbox.write("truck.obj", TRIANGLE);
    sandbox
}

fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// Protects: the last of repeated flags is in force, `-q` and `-v` may precede or follow a command,
/// and the later of them is in force.
#[test]
fn the_last_flag_counts() {
    let sandbox = sandbox();
    let run = |line: &str| -> ProgramRun { sandbox.run(&words(line)) };
    run("render ball.scene.toml -s 9x9 --spp 4 --seed 1 -s 8x4 --spp 2 --progress plain --progress none")
        .exits_with(0)
        .prints_like("wrote ball.png (8x4, 2 samples, ");
    run("-q render ball.scene.toml -s 8x4 --spp 1")
        .exits_with(0)
        .prints("");
    run("-v -q ball.scene.toml -s 8x4 --spp 1")
        .exits_with(0)
        .prints("");
    run("-q ball.scene.toml -s 8x4 --spp 1 -v")
        .exits_with(0)
        .prints_like("\nmethod  1 primitives, bvh, robust precision");
    run("-q info ball.scene.toml").exits_with(0).prints("");
}

/// Protects: messages are coloured on request or by CLICOLOR_FORCE, otherwise never without a
/// terminal, and NO_COLOR takes precedence; their text is the same.
#[test]
fn colours_are_for_those_who_want_them() {
    let sandbox = sandbox();
    let message_of = |arguments: &[&str], variables: &[(&str, &str)]| {
        let mut command = sandbox.command(arguments);
        command
            .env_remove("NO_COLOR")
            .env_remove("CLICOLOR")
            .env_remove("CLICOLOR_FORCE")
            .envs(variables.iter().copied());
        String::from_utf8(command.output().expect("the program starts").stderr).expect("text")
    };
    let plain = "error: cannot read gone.glb: no such file or folder\n";
    let red = format!(
        "\u{1b}[1;31merror:\u{1b}[0m{}",
        plain.strip_prefix("error:").expect("a label")
    );
    assert_eq!(message_of(&["gone.glb"], &[]), plain);
    assert_eq!(
        message_of(&["gone.glb", "--color", "always"], &[("NO_COLOR", "1")]),
        red
    );
    assert_eq!(
        message_of(&["--color=always", "gone.glb", "--color=never"], &[]),
        plain
    );
    assert_eq!(message_of(&["gone.glb"], &[("CLICOLOR_FORCE", "1")]), red);
    assert_eq!(
        message_of(&["gone.glb"], &[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]),
        plain
    );
    let usage = message_of(&["--color", "always", "render", "--spp", "x"], &[]);
    assert!(
        usage.starts_with("\u{1b}[1;31merror:\u{1b}[0m invalid value"),
        "{usage}"
    );
}

/// Protects: a render prints one line about its picture and at most one line of warnings, in which
/// the file is named once; `-v` prints each.
#[test]
fn a_render_says_two_lines() {
    let sandbox = sandbox();
    let run = sandbox.run(&words("render truck.obj -s 32x18 --spp 64 --progress none"));
    run.exits_with(0);
    let lines: Vec<&str> = run.stderr.lines().collect();
    assert_eq!(lines.len(), 2, "{}", run.stderr);
    assert!(lines[0].starts_with("note: the file has no camera: the whole scene is shown"));
    assert!(
        lines[1].starts_with("wrote truck.png (32x18, 64 samples, denoised (biased), error 0."),
        "{}",
        lines[1]
    );
    assert!(
        lines[1].contains(" to ") && lines[1].ends_with("s)"),
        "an interval and a time: {}",
        lines[1]
    );
    assert!(!run.stderr.contains("truck.obj"), "{}", run.stderr);
    // Two warnings and a note.
    sandbox.write(
        "two.obj",
        format!("mtllib gone.mtl\nusemtl x\n{TRIANGLE}l 1 2\n"),
    );
    let short = sandbox.run(&words("render two.obj -s 8x8 --spp 1 --progress none"));
    short.exits_with(0);
    let (first, rest) = short.stderr.split_once('\n').expect("two lines");
    assert!(
        first.starts_with("warning: two.obj: ")
            && first.contains(" (further messages: ")
            && first.ends_with("; -v lists them)"),
        "{first}"
    );
    assert_eq!(rest.lines().count(), 1, "{rest}");
    let long = sandbox.run(&words("render two.obj -s 8x8 --spp 1 --progress none -v"));
    let count = |label: &str| {
        long.stderr
            .lines()
            .filter(|line| line.starts_with(label))
            .count()
    };
    let more = first
        .rsplit_once("(further messages: ")
        .and_then(|(_, rest)| rest.split(';').next()?.parse::<usize>().ok())
        .expect("a number");
    assert_eq!(
        count("warning: ") + count("note: "),
        1 + more,
        "{}",
        long.stderr
    );
}

/// Protects: every line of `explain` and `bench` fits a terminal of 60, 80 and 120 columns without
/// omissions, and none is wrapped in a pipe. Absent effects take one line unless more is requested.
#[test]
fn tables_fit_the_terminal() {
    let sandbox = sandbox();
    let bench = "bench ball.scene.toml --repeats 1 --seconds 0.01";
    let scaling = "bench --max-n 4 --repeats 1 --seconds 0.01 --shape spheres";
    for line in [
        "explain ball.scene.toml",
        "explain -v ball.scene.toml",
        bench,
        scaling,
    ] {
        let text = |columns: Option<&str>| {
            let mut command = sandbox.command(&words(line));
            command
                .env_remove("COLUMNS")
                .envs(columns.map(|columns| ("COLUMNS", columns)));
            String::from_utf8(command.output().expect("the program starts").stdout).expect("text")
        };
        let letters = |text: &str| text.chars().filter(|c| !c.is_whitespace()).count();
        let whole = text(None);
        assert!(
            whole.lines().any(|line| line.chars().count() > 80),
            "{whole}"
        );
        for width in ["60", "80", "120"] {
            let fitted = text(Some(width));
            let widest = fitted
                .lines()
                .max_by_key(|line| line.chars().count())
                .expect("lines");
            assert!(
                widest.chars().count() <= width.parse().expect("a number"),
                "{line} in {width}: {widest}\n{fitted}"
            );
            // Times differ from run to run, and a first column may be repeated.
            assert!(letters(&fitted) * 10 > letters(&whole) * 9, "{fitted}");
        }
    }
    let explained = sandbox.run(&["explain", "ball.scene.toml"]);
    let absent: Vec<&str> = explained
        .text()
        .lines()
        .filter(|line| line.contains("absent"))
        .collect();
    assert!(
        absent.len() == 1 && absent[0].contains(": ") && absent[0].contains("depth of field, "),
        "{absent:?}"
    );
    assert!(
        sandbox
            .run(&["explain", "-v", "ball.scene.toml"])
            .text()
            .contains("\nabsent, at no cost\n")
    );
}

/// Protects: a misspelled file is answered with the closest name, a folder with its contents, and a
/// value with the allowed ones.
#[test]
fn messages_are_in_the_readers_words() {
    let sandbox = sandbox();
    let says = |line: &str, code: i32, message: &str| {
        sandbox.run(&words(line)).exits_with(code).prints(message);
    };
    says(
        "truk.obj",
        4,
        "error: cannot read truk.obj: no such file or folder\nhelp: did you mean `truck.obj`?",
    );
    says(
        "./truk.obj",
        4,
        "error: cannot read ./truk.obj: no such file or folder\nhelp: did you mean `./truck.obj`?",
    );
    std::fs::create_dir(sandbox.path("models")).expect("a folder");
    says(
        "models/",
        4,
        "error: cannot read models/: the path is a folder\nhelp: the folder contains no scene or model; name another folder or a file",
    );
    sandbox.write("models/b.glb", "");
    sandbox.write("models/a.scene.toml", "");
    sandbox.write("models/notes.txt", "");
    says(
        "models",
        4,
        "error: cannot read models: the path is a folder\nhelp: the folder contains models/a.scene.toml, models/b.glb",
    );
    let samples = |value: &str| {
        format!(
            "error: invalid value '{value}' for '--spp <N>': expected a whole number of samples from 1 to 65536, such as 64\n\n\
             For more information, try '--help'."
        )
    };
    says("render --spp lots", 2, &samples("lots"));
    says("render --spp -3", 2, &samples("-3"));
    let environment = |value: &str, cause: &str| {
        let label = format!(
            "error: invalid value '{value}' for '--env <none|default|studio|outdoor|FILE>': {cause}"
        );
        says(
            &format!("render --env {value}"),
            2,
            &format!("{label}\n\nFor more information, try '--help'."),
        );
    };
    environment(
        "noen",
        "expected `none`, `default`, `studio`, `outdoor` or the file of an equirectangular picture (.hdr, .exr, .png, .jpg)",
    );
}

/// Protects: CSS colour notations give the same linear colour in scenes and on the command line; an
/// array of codes gives a warning with the right notation.
#[test]
fn colours_have_their_usual_names() {
    let sandbox = sandbox();
    let render = |name: &str, more: &str| {
        let line = format!("render {name}.scene.toml -s 16x9 --spp 4 -q -o {name}.exr {more}");
        sandbox.run(&words(&line)).exits_with(0);
        sandbox.picture(&format!("{name}.exr")).rgb
    };
    // Codes 188 and 0: linear 0.5029 and 0.
    let scene = |colour: &str| sandbox.write("c.scene.toml", BALL.replace("COLOUR", colour));
    scene("[0.5028864580325687, 0, 1]");
    let numbers = render("c", "");
    for colour in ["\"#bc00ff\"", "\"rgb(188, 0, 255)\"", "\"#BC00FF\""] {
        scene(colour);
        assert!(render("c", "") == numbers, "{colour}");
    }
    let backgrounds = ["0.5028864580325687,0,1", "#bc00ff", "rgb(188,0,255)"]
        .map(|of| render("ball", &format!("--background {of}")));
    assert!(backgrounds[0] == backgrounds[1] && backgrounds[0] == backgrounds[2]);
    scene("[230, 178, 25]");
    let run = sandbox.run(&["check", "c.scene.toml"]);
    run.exits_with(0).prints(
        "warning: c.scene.toml: `base_colour` of material `m` is [230, 178, 25], more than a surface can reflect (1 is white); codes from 0 to 255 are \
         written \"rgb(230, 178, 25)\" [colour-codes]",
    );
    scene("\"rebeccapurpel\"");
    sandbox.run(&["check", "c.scene.toml"]).exits_with(3);
}

/// Protects: a negative number is reported as such, not as an unknown flag, and is accepted where
/// allowed.
#[test]
fn numbers_below_zero_are_no_flags() {
    let sandbox = sandbox();
    let flags = [
        "--zoom -1",
        "--fov -10",
        "--max-error -1",
        "--budget -1s",
        "--clamp -1",
        "--seed -1",
        "--turntable -4",
    ];
    for flag in flags.into_iter().chain([
        "--crop -1,0,5,5",
        "--size -3x4",
        "--threads -1",
        "--max-memory -5",
    ]) {
        let (name, value) = flag.split_once(' ').expect("a flag and its value");
        sandbox
            .run(&words(&format!("render ball.scene.toml {flag}")))
            .exits_with(2)
            .prints_like(&format!("invalid value '{value}' for '{name} "));
    }
    sandbox
        .run(&words(
            "render ball.scene.toml -s 4x4 --spp 1 -o a.exr -o a.png",
        ))
        .exits_with(0);
    sandbox
        .run(&words("compare a.exr a.exr --min-psnr -3"))
        .exits_with(0);
}

/// Protects: the help lists every effect that can be switched off, and a flag for films without a
/// file name is refused before the render.
#[test]
fn help_names_every_effect() {
    let sandbox = sandbox();
    let help = sandbox.run(&words("render --help"));
    let unknown = sandbox.run(&words("render --without none-such"));
    let known = unknown
        .exits_with(2)
        .stderr
        .split_once("effects that can be switched off: ")
        .expect("a list")
        .1
        .lines()
        .next()
        .expect("a line")
        .to_owned();
    let names: Vec<_> = known.split(", ").collect();
    let text = help
        .exits_with(0)
        .text()
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ");
    let list = text
        .split_once("Switch effects off, separated by commas: ")
        .expect("a list")
        .1;
    for name in &names {
        assert!(list.contains(name), "{name}");
    }
    assert!(names.len() > 30, "{names:?}");
    sandbox
        .run(&words(
            "render ball.scene.toml -s 4x4 --spp 1 --checkpoint nofolder/",
        ))
        .exits_with(4)
        .prints_like("cannot write nofolder/");
    assert!(!sandbox.path("ball.png").exists());
}
