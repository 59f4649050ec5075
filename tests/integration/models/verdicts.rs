//! A verdict for every file of the shared assets, by the program itself, within ten seconds and two
//! gigabytes.
//!
//! `cargo test --test integration verdicts -- --nocapture` prints the table: file, exit code,
//! seconds, and what was said.
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Map, Value};

use super::answers::files_below;
use crate::support::{Desk, shared};

/// How a run ended.
struct Verdict {
    name: String,
    /// Exit code; none: a signal, or killed for its time.
    code: Option<i32>,
    seconds: f64,
    said: String,
}

/// Runs the program over one file with an address space of two gigabytes and ten seconds.
fn verdict(desk: &Desk, name: String, file: &Path) -> Verdict {
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
    let program = desk.command::<&str>(&[]);
    let mut limited = Command::new("sh");
    limited
        .args(["-c", "ulimit -v 2097152; exec timeout 10 \"$0\" \"$@\""])
        .arg(program.get_program())
        .args(args)
        .arg(file);
    limited.current_dir(desk.path("."));
    let start = Instant::now();
    let output = limited.output().expect("a shell");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    Verdict {
        name,
        code: output.status.code(),
        seconds: start.elapsed().as_secs_f64(),
        said,
    }
}

impl Verdict {
    /// Whether the picture of a run that ended well has numbers alone.
    fn is_finite(&self, desk: &Desk) -> bool {
        desk.picture("seen.exr")
            .rgb
            .as_flattened()
            .iter()
            .all(|x| x.is_finite())
    }

    /// The table's row.
    fn row(&self, folder: &Path) -> String {
        let first = self
            .said
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

/// What a verdict breaks; none: nothing.
fn complaint(verdict: &Verdict, expected: Option<&Value>, whole: bool) -> Option<String> {
    let refused = matches!(verdict.code, Some(3..=5));
    let what = match (verdict.code, expected.and_then(|e| e["expect"].as_str())) {
        (code, _) if code != Some(0) && !refused => "ended in no way that is allowed",
        _ if verdict.said.contains("panicked") => "panicked",
        // The list is older than the rule that one bad texture refuses no model.
        (Some(0), Some("error")) if verdict.name.ends_with("images/png_truncated.glb") => {
            return None;
        }
        (Some(0), Some("error")) => "must be refused",
        (Some(_), Some("ok")) if refused => "must render",
        (Some(_), None) if refused && whole => "must render",
        _ if refused && !verdict.said.lines().any(|line| line.starts_with("error: ")) => {
            "refused without a message"
        }
        _ => return None,
    };
    Some(format!("{}: {what}\n{}", verdict.name, verdict.said))
}

/// Protects: every model of the assets renders, every malformed file gets the verdict that is
/// written for it, and none panics, shows a pixel that is no number, or takes more than ten seconds
/// or two gigabytes.
#[test]
fn every_file_gets_its_verdict() {
    let Some(root) = shared("assets") else { return };
    let expected = expectations(&root.join("malformed"));
    let validator = expectations(&root.join("malformed/khronos-validator"));
    let (desk, mut wrong, mut count) = (Desk::new(), Vec::new(), 0);
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
            let verdict = verdict(&desk, name.clone(), &file);
            eprintln!("{}", verdict.row(&root));
            let short = name.trim_start_matches("malformed/");
            // What is not meant to be broken renders.
            let whole = folder != "malformed" && !name.contains("AssetGenerator-Negative");
            wrong.extend(complaint(&verdict, expected.get(short), whole));
            let own = validator.get(short.trim_start_matches("khronos-validator/"));
            // Its buffer is a placeholder that it uses all the same.
            let valid = own.is_some_and(|own| own["errors"] == 0)
                && !short.ends_with("unused_objects.gltf");
            if valid && verdict.code != Some(0) && !verdict.said.contains("no such file") {
                wrong.push(format!("{name} is valid\n{}", verdict.said));
            }
            if verdict.code == Some(0) && !verdict.is_finite(&desk) {
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
