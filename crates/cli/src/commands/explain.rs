//! `explain`: which effects of a scene a render would simulate, which the scene has none of, and which are left out; and on
//! which rungs of which ladders it would stand.

use raywright_core::Settings;
use raywright_core::effects::{EffectReport, Finding, Status, detect};
use raywright_core::ladder::{Standing, standings};
use raywright_io::{Limits, Loaded, SourceInfo};
use serde::Serialize;

use crate::args::ExplainArgs;
use crate::console::{self, Verbosity};
use crate::failure::Failure;
use crate::table::lay_out;
use crate::{plan, scene_input};

/// Prints the report as a table or as JSON.
pub fn run(args: &ExplainArgs) -> Result<(), Failure> {
    let mut loaded = scene_input::read(&args.scene, &args.changes, Limits::default(), Verbosity::Normal)?;
    scene_input::complete(&mut loaded, &args.changes, Verbosity::Normal);
    let mut settings = Settings::of(&loaded.scene);
    plan::choose(&args.choices, &mut loaded.scene, &mut settings)?;
    let report = detect(&loaded.scene, &settings);
    let ladders = standings(&loaded.scene, &settings, &report);
    console::print(if args.json { json(&loaded, &report, &ladders) } else { text(&loaded.source, &report) + &rungs(&ladders) })
}

#[derive(Serialize)]
struct Explanation<'a> {
    scene: &'a str,
    scene_hash: &'a str,
    #[serde(flatten)]
    report: &'a EffectReport,
    ladders: &'a [Standing],
}

fn json(loaded: &Loaded, report: &EffectReport, ladders: &[Standing]) -> String {
    console::json(&Explanation { scene: &loaded.source.name, scene_hash: &loaded.hash, report, ladders })
}

/// What is simulated first, then what is left out, then what there is none of.
pub fn text(source: &SourceInfo, report: &EffectReport) -> String {
    let mut text = format!("{}\nintegrator {} ({})\n", source.name, report.integrator, report.because);
    for (status, title) in
        [(Status::Simulated, "simulated"), (Status::LeftOut, "left out"), (Status::Absent, "absent, and nothing is spent on it")]
    {
        let effects: Vec<&Finding> = report.effects.iter().filter(|finding| finding.status == status).collect();
        if !effects.is_empty() {
            let width = effects.iter().map(|finding| finding.effect.name().chars().count()).max().unwrap_or(0);
            text += &format!("\n{title}\n");
            effects.iter().for_each(|effect| text += &lines(effect, source, width));
        }
    }
    text
}

/// The ladders that the scene reaches: the rung in use with what it is, and the others.
fn rungs(ladders: &[Standing]) -> String {
    let row = |standing: &Standing| {
        let own = standing.rungs.iter().find(|rung| rung.name == standing.rung);
        let others: Vec<&str> = standing.rungs.iter().map(|rung| rung.name).filter(|name| *name != standing.rung).collect();
        let about = own.map_or_else(String::new, |rung| format!("{} ", rung.about));
        [format!("  {}", standing.ladder), standing.rung.clone(), format!("{about}(others: {})", others.join(", "))]
    };
    let (pictures, time): (Vec<&Standing>, Vec<&Standing>) = ladders.iter().partition(|standing| standing.changes_pictures);
    let mut text = String::new();
    for (title, list) in [("rungs in use", pictures), ("rungs in use that change no picture", time)] {
        let rows: Vec<[String; 3]> = list.into_iter().map(row).collect();
        text += &format!("\n{title}\n{}", lay_out(&rows));
    }
    text
}

/// One effect: its reason, and below it where in the file that comes from and what to do about it.
fn lines(finding: &Finding, source: &SourceInfo, width: usize) -> String {
    let from = finding.source.as_ref().map(|path| match source.text {
        Some(_) => format!("from {path}, {}", source.locate(path)),
        None => format!("from {path}"),
    });
    let hint = finding.hint.as_ref().map(|hint| format!("hint: {hint}"));
    let mut text = format!("  {:width$}  {}\n", finding.effect.name(), finding.because);
    for line in [from, hint].into_iter().flatten() {
        text += &format!("  {:width$}  {line}\n", "");
    }
    text
}
