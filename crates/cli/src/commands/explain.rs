//! `explain`: the simulated, absent and left-out effects of a scene, and the current rung (quality
//! level) of each ladder.

use std::time::Instant;

use raywright_core::effect_costs::{EffectCost, EffectCosts, measure_effects};
use raywright_core::effects::{
    Effect, EffectAssessment, EffectReport, EffectStatus, assess_effects,
};
use raywright_core::ladder::{CurrentRung, current_rungs};
use raywright_core::scene::{Shape, Sky};
use raywright_core::settings::SkyChoice;
use raywright_core::{Observer, Scene, Settings, prepare_for_previews};
use raywright_io::report::{
    ReportSection, format_change, format_duration, format_precise_duration,
    format_significant_digits,
};
use raywright_io::{Limits, LoadedScene};
use serde::Serialize;

use crate::args::ExplainArgs;
use crate::console::{self, Verbosity, mask_to_one_line};
use crate::failure::Failure;
use crate::plan::{self, RungChoices};
use crate::preparation::prepare_failure;
use crate::progress::StepProgress;
use crate::session::Session;
use crate::table::{ColumnAlignment, Table, format_columns, wrap_paragraph, wrap_text};

/// Runs `explain`: prints the report as a table or as JSON.
pub fn run(mut session: Session, args: &ExplainArgs) -> Result<(), Failure> {
    let options = plan::build_load_options(&args.changes, None);
    let mut loaded = session.load_to_render(&args.scene, &options)?;
    let found = EffectSummary::detect_effects(args, &mut loaded)?;
    let verbosity = session.verbosity;
    let measure = || {
        let (watch, quiet) = (session.start_work(), Verbosity::Quiet);
        let mut steps = StepProgress::start(if args.json { quiet } else { verbosity });
        session.run(|| measure_costs(args, &loaded, &found.settings, (&watch, &mut steps)))
    };
    let costs = args.measure.then(measure).transpose()?;
    let EffectSummary {
        report, ladders, ..
    } = &found;
    console::print(match args.json {
        true => format_json(&loaded, &found, costs.as_ref()),
        false => {
            format_effects(&loaded, report, verbosity == Verbosity::Verbose)
                + &format_rungs(ladders)
                + &found
                    .openings
                    .as_ref()
                    .map(OpeningSearch::format)
                    .unwrap_or_default()
                + &costs
                    .map(|costs| effect_section(&costs))
                    .map(|section| section.to_text(console::line_width()))
                    .unwrap_or_default()
        }
    })
}

/// Returns the section of the costs of a scene's effects, the most expensive first.
pub fn effect_section(costs: &EffectCosts) -> ReportSection {
    let row = |cost: &EffectCost| {
        let name = cost.effect.to_owned();
        [name].into_iter().chain(effect_cells(cost)).collect()
    };
    let mut columns = [ColumnAlignment::Right; 4];
    columns[0] = ColumnAlignment::Left;
    let names = [
        "effect",
        "added time",
        "added rays",
        "change of picture, RMSE",
    ];
    ReportSection {
        title: "Effects of the scene".to_owned(),
        explanation: describe_effect_costs(costs),
        table: Table::new(columns, names, costs.effects.iter().map(row)),
        notes: Vec::new(),
    }
}

/// Formats the cost of an effect: the change in time as median, least and greatest value of several
/// rounds, the change in the number of rays, and the difference of the picture.
fn effect_cells(cost: &EffectCost) -> [String; 3] {
    let ratio = &cost.ratio;
    let [median, min, max, rays] =
        [ratio.median, ratio.min, ratio.max, cost.rays].map(format_change);
    [
        format!("{median} ({min} to {max})"),
        rays,
        format_significant_digits(cost.rmse, 3),
    ]
}

/// Describes how the costs of effects were measured, in a sentence.
fn describe_effect_costs(costs: &EffectCosts) -> String {
    let [width, height] = costs.size;
    let late = if costs.late.is_empty() {
        String::new()
    } else {
        format!(
            "; not measured for lack of time (give a larger --budget): {}",
            costs.late.join(", ")
        )
    };
    let how = "The scene was rendered with and without each effect that can be switched off, in turns and with the same random numbers, at";
    format!(
        "{how} {width}x{height} pixels, in {} of CPU time with all effects: the differences are the cost of the effect{late}.",
        format_precise_duration(costs.seconds.median)
    )
}

/// Returns the JSON of `explain` for a loaded scene. The work runs on the caller's thread pool.
pub fn run_embedded(
    args: &ExplainArgs,
    mut loaded: LoadedScene,
    observer: &dyn Observer,
) -> Result<String, Failure> {
    let found = EffectSummary::detect_effects(args, &mut loaded)?;
    let mut steps = StepProgress::start(Verbosity::Quiet);
    let costs = args
        .measure
        .then(|| measure_costs(args, &loaded, &found.settings, (observer, &mut steps)))
        .transpose()?;
    Ok(format_json(&loaded, &found, costs.as_ref()))
}

/// Settings, effects and current rungs (quality levels) of a scene.
#[derive(Serialize)]
struct EffectSummary {
    #[serde(skip)]
    settings: Settings,
    #[serde(flatten)]
    report: EffectReport,
    ladders: Vec<CurrentRung>,
    /// Search for openings, where the sky lights the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    openings: Option<OpeningSearch>,
}

/// Search for the openings through which the sky lights a path-traced scene.
#[derive(Serialize)]
struct OpeningSearch {
    /// Cells in which the sky is sampled through openings; 0 if this is not called for.
    cells: usize,
    /// Seconds of the search.
    #[serde(skip)]
    seconds: f64,
}

impl OpeningSearch {
    /// Searches a scene; `None` if its settings choose no sky by openings, or if it cannot be
    /// prepared, which a render reports.
    fn run(scene: &Scene, settings: &Settings, report: &EffectReport) -> Option<Self> {
        let is_called_for = report.simulated().has(Effect::SkyLight)
            && report.integrator == "path"
            && settings.sky_choice == SkyChoice::Openings
            && !matches!(scene.sky, Some(Sky::Studio(_)));
        let settings = Settings {
            max_memory: Some(Limits::default().memory_bytes),
            ..settings.clone()
        };
        let mut ready = is_called_for
            .then(|| prepare_for_previews(scene, &settings, &()).ok())
            .flatten()?;
        let began = Instant::now();
        ready.complete(scene, &()).ok()?;
        Some(Self {
            cells: ready.table_sizes().openings,
            seconds: began.elapsed().as_secs_f64(),
        })
    }

    fn format(&self) -> String {
        let took = format_duration(self.seconds);
        let found = match self.cells {
            0 => "not called for".to_owned(),
            cells => format!("the sky is sampled through them in {cells} cells"),
        };
        format!("\nopenings: {found}; the search took {took}\n")
    }
}

impl EffectSummary {
    fn detect_effects(args: &ExplainArgs, loaded: &mut LoadedScene) -> Result<Self, Failure> {
        let mut settings = Settings::from_scene(&loaded.scene);
        let choices = RungChoices::from(&args.choices);
        choices.apply(&mut loaded.scene, &mut settings)?;
        choices.denoise_by_default(loaded, false, &mut settings);
        let report = assess_effects(&loaded.scene, &settings);
        let ladders = current_rungs(&loaded.scene, &settings, &report);
        let openings = OpeningSearch::run(&loaded.scene, &settings, &report);
        Ok(Self {
            settings,
            report,
            ladders,
            openings,
        })
    }
}

/// Measures the cost of each effect by renders with and without the effect.
fn measure_costs(
    args: &ExplainArgs,
    loaded: &LoadedScene,
    settings: &Settings,
    (observer, steps): (&dyn Observer, &mut StepProgress),
) -> Result<EffectCosts, Failure> {
    let settings = Settings {
        denoise: false,
        max_memory: Some(Limits::default().memory_bytes),
        ..settings.clone()
    };
    let mut tell = |label: &str, share: f64| steps.show_step(label, share);
    let costs = measure_effects(&loaded.scene, &settings, args.budget, observer, &mut tell);
    costs.map_err(|error| prepare_failure(&loaded.source, error))
}

/// Version of the layout of [`ExplainReport`].
const FORMAT: u32 = 2;

#[derive(Serialize)]
struct ExplainReport<'a> {
    format: u32,
    scene: &'a str,
    scene_hash: String,
    #[serde(flatten)]
    found: &'a EffectSummary,
    /// Costs of the effects, where `--measure` requests them.
    #[serde(skip_serializing_if = "Option::is_none")]
    costs: Option<&'a EffectCosts>,
}

fn format_json(loaded: &LoadedScene, found: &EffectSummary, costs: Option<&EffectCosts>) -> String {
    console::format_json(&ExplainReport {
        format: FORMAT,
        scene: &loaded.source.name,
        scene_hash: loaded.hash.to_string(),
        found,
        costs,
    })
}

/// Formats the effects of a scene: first the simulated, then the left out, then the absent effects.
/// Absent effects are listed by name, or with their reasons if `in_full`.
pub fn format_effects(loaded: &LoadedScene, report: &EffectReport, in_full: bool) -> String {
    let mut text = format!(
        "{}\n{}\n",
        loaded.source.name,
        wrap_paragraph(&format!(
            "integrator {} ({})",
            report.integrator, report.because
        ))
    );
    for (status, title) in [
        (EffectStatus::Simulated, "simulated"),
        (EffectStatus::LeftOut, "left out"),
        (EffectStatus::Absent, ABSENT_LABEL),
    ] {
        let effects: Vec<&EffectAssessment> = report
            .effects
            .iter()
            .filter(|finding| finding.status == status)
            .collect();
        if status == EffectStatus::Absent && !in_full {
            let names: Vec<&str> = effects
                .iter()
                .map(|finding| finding.effect.name())
                .collect();
            let names = if names.is_empty() {
                "none".to_owned()
            } else {
                names.join(", ")
            };
            text += &format!(
                "\n{}\n",
                wrap_paragraph(&format!("{ABSENT_LABEL}: {names}"))
            );
        } else if !effects.is_empty() {
            let width = effects
                .iter()
                .map(|finding| finding.effect.name().chars().count())
                .max()
                .unwrap_or(0);
            text += &format!("\n{title}\n");
            effects
                .iter()
                .for_each(|effect| text += &format_effect_finding(effect, loaded, width));
        }
    }
    text
}

/// Label of absent effects, which take neither time nor memory.
const ABSENT_LABEL: &str = "absent, at no cost";

/// Formats the ladders that affect the scene: the current rung (quality level) with its
/// description, and the names of the other rungs.
fn format_rungs(ladders: &[CurrentRung]) -> String {
    let row = |current_rung: &CurrentRung| {
        let own = current_rung
            .rungs
            .iter()
            .find(|rung| rung.name == current_rung.rung);
        let others: Vec<&str> = current_rung
            .rungs
            .iter()
            .map(|rung| rung.name)
            .filter(|name| *name != current_rung.rung)
            .collect();
        let about = own.map_or_else(String::new, |rung| format!("{} ", rung.about));
        [
            format!("  {}", current_rung.ladder),
            current_rung.rung.clone(),
            format!("{about}(others: {})", others.join(", ")),
        ]
    };
    let (pictures, time): (Vec<&CurrentRung>, Vec<&CurrentRung>) = ladders
        .iter()
        .partition(|current_rung| current_rung.changes_pictures);
    let mut text = String::new();
    for (title, list) in [
        ("rungs in use", pictures),
        ("rungs in use that change no picture", time),
    ] {
        let rows: Vec<[String; 3]> = list.into_iter().map(row).collect();
        text += &format!("\n{title}\n{}", format_columns(&rows));
    }
    text
}

/// Formats an effect with its reason and, in lines below, its location in the scene file and
/// advice. Names are padded to `width` characters.
fn format_effect_finding(finding: &EffectAssessment, loaded: &LoadedScene, width: usize) -> String {
    let source = &loaded.source;
    let from = finding.source.as_ref().map(|path| match source.text {
        Some(_) => format!("from {path}, {}", source.format_value_position(path)),
        None => format!("from {}", name_model_part(&loaded.scene, path)),
    });
    let hint = finding.hint.as_ref().map(|hint| format!("hint: {hint}"));
    let (name, because) = (finding.effect.name(), mask_to_one_line(&finding.because));
    let (indent, room) = (width + 4, console::line_width().unwrap_or(usize::MAX));
    let mut text = format!("  {name:width$}  {}\n", wrap_text(&because, indent, room));
    for line in [from, hint].into_iter().flatten() {
        text += &format!(
            "{:indent$}{}\n",
            "",
            wrap_text(&mask_to_one_line(&line), indent, room)
        );
    }
    text
}

/// Names a part of a model's scene in the words of the model's file: node, mesh and material. A
/// part without a name keeps its path in the scene.
fn name_model_part(scene: &Scene, path: &str) -> String {
    let (list, rest) = path.split_once('[').unwrap_or((path, ""));
    let (index, key) = rest.split_once(']').unwrap_or_default();
    let index = index.parse().unwrap_or(usize::MAX);
    let material = |name| ("material", name);
    let parts: Vec<(&str, &String)> = match list {
        "objects" => (scene.objects.get(index).into_iter())
            .flat_map(|object| {
                let mesh = match &object.shape {
                    Shape::Mesh(mesh) => Some(("mesh", mesh)),
                    _ => None,
                };
                let node = [("node", &object.name)].into_iter().chain(mesh);
                node.chain([material(&object.material)])
            })
            .collect(),
        "materials" => (scene.materials.get(index).into_iter())
            .map(|item| material(&item.name))
            .collect(),
        "lights" => (scene.lights.get(index).into_iter())
            .map(|light| ("light", &light.name))
            .collect(),
        _ => Vec::new(),
    };
    let named = parts.iter().filter(|(_, name)| !name.is_empty());
    let named: Vec<String> = named
        .map(|(kind, name)| format!("{kind} `{name}`"))
        .collect();
    if named.is_empty() {
        return path.to_owned();
    }
    let key = match (list, key.rsplit('.').next()) {
        ("materials", Some(key)) if !key.is_empty() => format!(", {key}"),
        _ => String::new(),
    };
    named.join(", ") + &key
}
