//! Help, manual pages and completion scripts: all descriptions of the program.

use std::io::Read;
use std::process::Stdio;

use crate::support::Sandbox;

/// Protects: `--help` and `--version` print to standard output and succeed.
#[test]
fn help_and_version_are_results() {
    let sandbox = Sandbox::new();
    let help = sandbox.run(&["--help"]);
    help.exits_with(0).prints("");
    assert!(help.text().contains("Usage: raywright"), "{}", help.text());
    let version = sandbox.run(&["--version"]);
    version.exits_with(0).prints("");
    assert_eq!(
        version.text(),
        format!("raywright {}\n", env!("CARGO_PKG_VERSION"))
    );
}

/// Protects: every command has a help text, by `--help` and by `help`, and its summary fits one
/// line of the list.
#[test]
fn every_command_has_help() {
    let sandbox = Sandbox::new();
    let list = sandbox.run(&["help"]);
    list.exits_with(0).prints("");
    for command in COMMANDS {
        let summary = list
            .text()
            .lines()
            .find(|line| line.trim_start().starts_with(command))
            .expect(command);
        assert!(summary.chars().count() <= 100, "{summary}");
        let help = sandbox.run(&[command, "--help"]);
        help.exits_with(0).prints("");
        assert!(
            help.text().contains(&format!("Usage: raywright {command}")),
            "{}",
            help.text()
        );
        assert_eq!(
            sandbox.run(&["help", command]).exits_with(0).text(),
            help.text()
        );
    }
}

/// Protects: help texts fit the terminal, and are wrapped only at its width. Indented lines are
/// tables and examples.
#[test]
fn help_is_wrapped_by_the_width_of_the_terminal() {
    let sandbox = Sandbox::new();
    for width in [80, 100] {
        for command in COMMANDS {
            let output = sandbox
                .command(&[command, "--help"])
                .env("COLUMNS", width.to_string())
                .output()
                .expect("the program starts");
            let text = String::from_utf8(output.stdout).expect("text");
            let lines: Vec<&str> = text.lines().collect();
            assert!(
                lines.iter().all(|line| line.chars().count() <= width),
                "{command} in {width} columns:\n{text}"
            );
            for pair in lines.windows(2).filter(|pair| {
                pair.iter()
                    .all(|line| line.starts_with(|c: char| !c.is_whitespace()))
            }) {
                let word = pair[1].split(' ').next().unwrap_or_default();
                let whole = pair[0].chars().count() + 1 + word.chars().count();
                assert!(
                    whole > width,
                    "{command} in {width} columns: a break before `{word}`\n{text}"
                );
            }
        }
    }
}

/// Protects: the help of a command lists only the flags that it takes, and every other flag of a
/// group that commands share is refused by name before the scene is read.
#[test]
fn help_lists_only_flags_that_are_taken() {
    let sandbox = Sandbox::new();
    for (command, refused, taken) in [
        (
            "view",
            &[
                "--sheet=a.png",
                "--frames=0..1:2",
                "--budget=1s",
                "--stats=a.json",
            ][..],
            &["--size", "--denoise", "--watch", "--section"][..],
        ),
        (
            "bench",
            &["--studio", "--env=none", "--material=clay"],
            &["--section", "--set", "--max-n"],
        ),
        ("accuracy", &[], &["--studio", "--env", "--material"]),
    ] {
        let help = sandbox.run(&[command, "--help"]);
        // Flags are named at the start of a line, before their description.
        let names = help.text().lines().filter_map(|line| {
            let words = line.split_whitespace().take(2);
            line.trim_start().starts_with('-').then_some(words)
        });
        let names: Vec<&str> = names.flatten().collect();
        let lists = |flag: &str| names.contains(&flag);
        for flag in taken {
            assert!(lists(flag), "{command} {flag}: {}", help.text());
        }
        for flag in refused {
            let name = flag.split('=').next().unwrap_or_default();
            assert!(!lists(name), "{command} {name}");
            sandbox
                .run(&[command, "gone.glb", flag])
                .exits_with(2)
                .prints_like(&format!("error: `{command}` takes no {name}"));
        }
    }
}

const COMMANDS: [&str; 15] = [
    "render",
    "merge",
    "explain",
    "compare",
    "info",
    "check",
    "accuracy",
    "bench",
    "stability",
    "stress",
    "thumbs",
    "presets",
    "schema",
    "completions",
    "man",
];

/// Protects: each shell gets a script that knows the commands.
#[test]
fn completions_are_written_for_each_shell() {
    let sandbox = Sandbox::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let run = sandbox.run(&["completions", shell]);
        run.exits_with(0).prints("");
        for command in COMMANDS {
            assert!(run.text().contains(command), "{command} for {shell}");
        }
    }
}

/// Protects: the manual has a page for the program and for each command, under the name that `man`
/// expects.
#[test]
fn manual_pages_carry_their_names() {
    let sandbox = Sandbox::new();
    let program = sandbox.run(&["man"]);
    program.exits_with(0).prints("");
    assert!(
        program.text().contains(".TH raywright 1"),
        "{}",
        program.text()
    );
    for command in COMMANDS {
        let page = sandbox.run(&["man", command]);
        page.exits_with(0).prints("");
        assert!(
            page.text().contains(&format!(".TH raywright-{command} 1")),
            "{}",
            page.text()
        );
    }
}

/// Protects: a pipe that closes early is no failure for a text (`raywright schema | head -0`), and
/// is one for a picture.
#[test]
fn closed_pipes_lose_pictures_and_no_texts() {
    let sandbox = Sandbox::new();
    let picture = [
        "render",
        "sky.scene.toml",
        "-q",
        "-s",
        "300x300",
        "--spp",
        "1",
        "-o",
        "-",
        "-o",
        "a.png",
    ];
    sandbox.write("sky.scene.toml", "format = 1\nsky.constant = 0.5\n");
    for (arguments, code) in [
        (&["completions", "zsh"][..], 0),
        (&["schema"], 0),
        (&picture, 4),
    ] {
        let mut child = sandbox
            .command(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("starts");
        drop(child.stdout.take());
        let mut stderr = String::new();
        child
            .stderr
            .take()
            .expect("piped")
            .read_to_string(&mut stderr)
            .expect("text");
        let status = child.wait().expect("ends");
        assert_eq!(status.code(), Some(code), "{arguments:?}: {stderr}");
        assert_eq!(
            stderr.starts_with("error: cannot write to standard output"),
            code == 4,
            "{stderr}"
        );
    }
    assert_eq!(
        sandbox.names(),
        ["a.png", "sky.scene.toml"],
        "what can be written is written"
    );
}

/// Protects: the help of `--without` lists exactly the effects that can be switched off, in the
/// notation of the command line.
#[test]
fn help_names_the_effects() {
    let sandbox = Sandbox::new();
    let help = sandbox.run(&["render", "--help"]);
    let text = help.text().split_whitespace().collect::<Vec<_>>().join(" ");
    let (_, list) = text
        .split_once("Switch effects off, separated by commas: ")
        .expect("the flag's help");
    let known = sandbox.run(&["render", "--without", "magic"]);
    let (_, known) = known
        .stderr
        .split_once("effects that can be switched off: ")
        .expect("a list of those known");
    let known = known.lines().next().expect("a line").trim();
    assert!(
        known.split(", ").count() > 30 && list.starts_with(&format!("{known} ")),
        "{list}\n{known}"
    );
    sandbox.write("sky.scene.toml", "format = 1\nsky.constant = 0.5\n");
    let without =
        |names: &str| sandbox.run(&["explain", "sky.scene.toml", "--json", "--without", names]);
    let all = without(&known.replace(", ", ","));
    let all: serde_json::Value = serde_json::from_str(all.exits_with(0).text()).expect("JSON");
    for effect in all["effects"].as_array().expect("a list") {
        let name = effect["name"].as_str().expect("a name").replace(' ', "-");
        if !known.split(", ").any(|known| known == name) {
            without(&name).exits_with(2);
        }
    }
}
