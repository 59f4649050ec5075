//! Help, manual pages and completion scripts: everything that describes the program.

use std::io::Read;
use std::process::Stdio;

use crate::support::{Desk, carried};

/// Protects: `--help` and `--version` go to standard output and are no failure.
#[test]
fn help_and_version_are_results() {
    let desk = Desk::new();
    let help = desk.run(&["--help"]);
    help.exits_with(0).says("");
    assert!(help.text().contains("Usage: raywright"), "{}", help.text());
    let version = desk.run(&["--version"]);
    version.exits_with(0).says("");
    assert_eq!(version.text(), format!("raywright {}\n", env!("CARGO_PKG_VERSION")));
}

/// Protects: every command explains itself, by `--help` and by `help`, and its summary fits into one line of the list.
#[test]
fn every_command_has_help() {
    let desk = Desk::new();
    let list = desk.run(&["help"]);
    list.exits_with(0).says("");
    for command in COMMANDS {
        let summary = list.text().lines().find(|line| line.trim_start().starts_with(command)).expect(command);
        assert!(summary.chars().count() <= 100, "{summary}");
        let help = desk.run(&[command, "--help"]);
        help.exits_with(0).says("");
        assert!(help.text().contains(&format!("Usage: raywright {command}")), "{}", help.text());
        assert_eq!(desk.run(&["help", command]).exits_with(0).text(), help.text());
    }
}

/// Protects: texts fit the terminal, and are broken where it ends and nowhere else. Lines that are indented are tables and
/// examples.
#[test]
fn help_is_wrapped_by_the_width_of_the_terminal() {
    let desk = Desk::new();
    for width in [80, 100] {
        for command in COMMANDS {
            let output =
                desk.command(&[command, "--help"]).env("COLUMNS", width.to_string()).output().expect("the program starts");
            let text = String::from_utf8(output.stdout).expect("text");
            let lines: Vec<&str> = text.lines().collect();
            assert!(lines.iter().all(|line| line.chars().count() <= width), "{command} in {width} columns:\n{text}");
            for pair in lines.windows(2).filter(|pair| pair.iter().all(|line| line.starts_with(|c: char| !c.is_whitespace()))) {
                let word = pair[1].split(' ').next().unwrap_or_default();
                let whole = pair[0].chars().count() + 1 + word.chars().count();
                assert!(whole > width, "{command} in {width} columns: a break before `{word}`\n{text}");
            }
        }
    }
}

const COMMANDS: [&str; 12] =
    ["render", "merge", "explain", "compare", "info", "check", "accuracy", "bench", "presets", "schema", "completions", "man"];

/// Protects: each shell gets a script that knows the commands.
#[test]
fn completions_are_written_for_each_shell() {
    let desk = Desk::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let run = desk.run(&["completions", shell]);
        run.exits_with(0).says("");
        for command in COMMANDS {
            assert!(run.text().contains(command), "{command} for {shell}");
        }
    }
}

/// Protects: the manual has a page for the program and for each command, under the name that `man` looks for.
#[test]
fn manual_pages_carry_their_names() {
    let desk = Desk::new();
    let program = desk.run(&["man"]);
    program.exits_with(0).says("");
    assert!(program.text().contains(".TH raywright 1"), "{}", program.text());
    for command in COMMANDS {
        let page = desk.run(&["man", command]);
        page.exits_with(0).says("");
        assert!(page.text().contains(&format!(".TH raywright-{command} 1")), "{}", page.text());
    }
}

/// Protects: a reader that has seen enough is no failure: `raywright schema | head -0`.
#[test]
fn closed_pipe_is_success() {
    if !carried("whitted") {
        return;
    }
    let desk = Desk::new();
    for arguments in [&["completions", "zsh"][..], &["schema"], &["render", "preset:whitted", "-q", "-o", "-", "-o", "a.png"]] {
        let mut child = desk.command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
        drop(child.stdout.take());
        let mut stderr = String::new();
        child.stderr.take().expect("piped").read_to_string(&mut stderr).expect("text");
        let status = child.wait().expect("ends");
        assert_eq!((status.code(), stderr.as_str()), (Some(0), ""), "{arguments:?}");
    }
    assert_eq!(desk.names(), ["a.png"], "what can be written is written");
}
