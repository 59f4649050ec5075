//! `explain`: which effects of a scene a render would simulate, which the scene has none of, and which are left out.

use raywright_core::Settings;
use raywright_core::effects::{Effect, EffectReport, Status, detect};
use raywright_io::{Limits, Loaded, SourceInfo};
use serde::Serialize;

use crate::args::ExplainArgs;
use crate::console::{self, Verbosity};
use crate::failure::Failure;
use crate::scene_input;

/// Prints the report as a table or as JSON.
pub fn run(args: &ExplainArgs) -> Result<(), Failure> {
    let mut loaded = scene_input::read(&args.scene, &args.changes, Limits::default(), Verbosity::Normal)?;
    scene_input::complete(&mut loaded, Verbosity::Normal);
    let report = detect(&loaded.scene, &Settings::of(&loaded.scene));
    console::print(if args.json { json(&loaded, &report) } else { text(&loaded.source, &report) })
}

#[derive(Serialize)]
struct Explanation<'a> {
    scene: &'a str,
    scene_hash: &'a str,
    #[serde(flatten)]
    report: &'a EffectReport,
}

fn json(loaded: &Loaded, report: &EffectReport) -> String {
    console::json(&Explanation { scene: &loaded.source.name, scene_hash: &loaded.hash, report })
}

/// What is simulated first, then what is left out, then what there is none of.
pub fn text(source: &SourceInfo, report: &EffectReport) -> String {
    let mut text = format!("{}\nintegrator {} ({})\n", source.name, report.integrator, report.because);
    for (status, title) in
        [(Status::Simulated, "simulated"), (Status::LeftOut, "left out"), (Status::Absent, "absent, and nothing is spent on it")]
    {
        let effects: Vec<&Effect> = report.effects.iter().filter(|effect| effect.status == status).collect();
        if !effects.is_empty() {
            let width = effects.iter().map(|effect| effect.name.chars().count()).max().unwrap_or(0);
            text += &format!("\n{title}\n");
            effects.iter().for_each(|effect| text += &lines(effect, source, width));
        }
    }
    text
}

/// One effect: its reason, and below it where in the file that comes from and what to do about it.
fn lines(effect: &Effect, source: &SourceInfo, width: usize) -> String {
    let from = effect.source.as_ref().map(|path| match source.text {
        Some(_) => format!("from {path}, {}", source.locate(path)),
        None => format!("from {path}"),
    });
    let hint = effect.hint.as_ref().map(|hint| format!("hint: {hint}"));
    let mut text = format!("  {:width$}  {}\n", effect.name, effect.because);
    for line in [from, hint].into_iter().flatten() {
        text += &format!("  {:width$}  {line}\n", "");
    }
    text
}
