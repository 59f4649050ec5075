//! Help, manual pages and completion scripts: everything that describes the program.

use std::io::Read;
use std::process::Stdio;

use crate::support::Desk;

/// `--help` and `--version` go to standard output and are no failure.
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

/// Each shell gets a script that knows the commands.
#[test]
fn completions_are_written_for_each_shell() {
    let desk = Desk::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let run = desk.run(&["completions", shell]);
        run.exits_with(0).says("");
        assert!(run.text().contains("completions"), "{shell}");
    }
}

/// The manual has a page for the program and for each command, under the name that `man` looks for.
#[test]
fn manual_pages_carry_their_names() {
    let desk = Desk::new();
    let program = desk.run(&["man"]);
    program.exits_with(0).says("");
    assert!(program.text().contains(".TH raywright 1"), "{}", program.text());
    let command = desk.run(&["man", "completions"]);
    command.exits_with(0).says("");
    assert!(command.text().contains(".TH raywright-completions 1"), "{}", command.text());
}

/// A reader that has seen enough is no failure: `raywright completions bash | head -0`.
#[test]
fn closed_pipe_is_success() {
    let desk = Desk::new();
    let mut child = desk.command(&["completions", "zsh"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    drop(child.stdout.take());
    let mut stderr = String::new();
    child.stderr.take().expect("piped").read_to_string(&mut stderr).expect("text");
    let status = child.wait().expect("ends");
    assert_eq!((status.code(), stderr.as_str()), (Some(0), ""));
}
