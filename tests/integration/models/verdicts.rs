//! A verdict for every file of the shared assets, by the program itself, within ten seconds and two
//! gigabytes.
//!
//! `cargo test --test integration verdicts -- --nocapture` prints the table: file, exit code,
//! seconds, and messages.
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Map, Value};

use super::expected_images::files_below;
use crate::support::{Sandbox, shared};

/// End of a run.
struct Verdict {
    name: String,
    /// Exit code; `None`: a signal, or killed after the time limit.
    code: Option<i32>,
    seconds: f64,
    message: String,
}

/// Runs the program on a file with an address space of two gigabytes and ten seconds.
fn verdict(sandbox: &Sandbox, name: String, file: &Path) -> Verdict {
    let args = [
        "render",
        "--size",
        "64x48",
        "--spp",
        "2",
        "--threads",
        "2",
        "--allow-empty",
        "-o",
        "seen.exr",
    ];
    let program = sandbox.command::<&str>(&[]);
    let mut limited = Command::new("sh");
    limited
        .args(["-c", "ulimit -v 2097152; exec timeout 10 \"$0\" \"$@\""])
        .arg(program.get_program())
        .args(args)
        .arg(file);
    limited.current_dir(sandbox.path("."));
    let start = Instant::now();
    let output = limited.output().expect("a shell");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    Verdict {
        name,
        code: output.status.code(),
        seconds: start.elapsed().as_secs_f64(),
        message,
    }
}

impl Verdict {
    /// Whether the picture of a successful run is finite.
    fn is_finite(&self, sandbox: &Sandbox) -> bool {
        sandbox
            .picture("seen.exr")
            .rgb
            .as_flattened()
            .iter()
            .all(|x| x.is_finite())
    }

    /// Row of the table.
    fn row(&self, folder: &Path) -> String {
        let first = self
            .message
            .lines()
            .find(|line| line.starts_with("error") || line.starts_with("warning"));
        let first = first
            .unwrap_or("")
            .replace(&format!("{}/", folder.display()), "");
        let short: String = first.chars().take(140).collect();
        format!(
            "| {} | {} | {:.2} s | {short} |",
            self.name,
            self.code.map_or("-".to_owned(), |c| c.to_string()),
            self.seconds
        )
    }
}

fn expectations(folder: &Path) -> Map<String, Value> {
    let text = std::fs::read(folder.join("EXPECT.json")).expect("EXPECT.json");
    serde_json::from_slice(&text).expect("JSON")
}

/// Describes the rule that a verdict violates; `None`: no violation.
fn complaint(verdict: &Verdict, expected: Option<&Value>, whole: bool) -> Option<String> {
    let refused = matches!(verdict.code, Some(3..=5));
    let label = match (verdict.code, expected.and_then(|e| e["expect"].as_str())) {
        (code, _) if code != Some(0) && !refused => "ended in no way that is allowed",
        _ if verdict.message.contains("panicked") => "panicked",
        // The list is older than the rule that a broken texture refuses no model.
        (Some(0), Some("error")) if verdict.name.ends_with("images/png_truncated.glb") => {
            return None;
        }
        (Some(0), Some("error")) => "must be refused",
        (Some(_), Some("ok")) if refused => "must render",
        (Some(_), None) if refused && whole => "must render",
        _ if refused
            && !verdict
                .message
                .lines()
                .any(|line| line.starts_with("error: ")) =>
        {
            "refused without a message"
        }
        _ => return None,
    };
    Some(format!("{}: {label}\n{}", verdict.name, verdict.message))
}

/// Protects: every model of the assets renders, every malformed file gets its listed verdict, and
/// none panics, has a NaN pixel, or takes more than ten seconds or two gigabytes.
#[test]
fn every_file_gets_its_verdict() {
    let Some(root) = shared("assets") else { return };
    let expected = expectations(&root.join("malformed"));
    let validator = expectations(&root.join("malformed/khronos-validator"));
    let (sandbox, mut wrong, mut count) = (Sandbox::new(), Vec::new(), 0);
    for folder in ["gltf", "obj", "malformed"] {
        let models = |path: &Path| {
            let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
            ending.is_some_and(|ending| ["gltf", "glb", "obj"].contains(&ending.as_str()))
        };
        let mut files: Vec<_> = files_below(root.join(folder))
            .into_iter()
            .filter(|path| models(path))
            .collect();
        if folder == "malformed" {
            files.push(root.join("malformed/directory_named.glb"));
        }
        for file in files {
            let name = file
                .strip_prefix(&root)
                .expect("below")
                .to_string_lossy()
                .into_owned();
            let verdict = verdict(&sandbox, name.clone(), &file);
            eprintln!("{}", verdict.row(&root));
            let short = name.trim_start_matches("malformed/");
            // Files that are not deliberately broken render.
            let whole = folder != "malformed" && !name.contains("AssetGenerator-Negative");
            wrong.extend(complaint(&verdict, expected.get(short), whole));
            let own = validator.get(short.trim_start_matches("khronos-validator/"));
            // The file's buffer is a placeholder that is used nevertheless.
            let valid = own.is_some_and(|own| own["errors"] == 0)
                && !short.ends_with("unused_objects.gltf");
            if valid && verdict.code != Some(0) && !verdict.message.contains("no such file") {
                wrong.push(format!("{name} is valid\n{}", verdict.message));
            }
            if verdict.code == Some(0) && !verdict.is_finite(&sandbox) {
                wrong.push(format!("{name}: a pixel is no number"));
            }
            assert!(
                Duration::from_secs_f64(verdict.seconds) < Duration::from_secs(11),
                "{name}"
            );
            count += 1;
        }
    }
    eprintln!("{count} files, {} wrong", wrong.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
