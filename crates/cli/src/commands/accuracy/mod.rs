//! `accuracy`: what each rung of each ladder costs and gets wrong on one scene, and which combinations are worth their time.

mod file;
mod text;

use raywright_core::accuracy::{Effort, Listener, measure};
use raywright_core::{Settings, prepare::PrepareError};
use raywright_io::{Error, Limits};

use crate::args::AccuracyArgs;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::progress::Steps;
use crate::ready::NOTHING_KEPT;
use crate::targets::Outputs;
use crate::threads::Threads;
use crate::watch::Watch;
use crate::{interrupt, plan, scene_input};
use file::{Document, Kind};

/// Measures, writes what was asked for, and prints a table or JSON.
pub fn run(args: &AccuracyArgs) -> Result<(), Failure> {
    let verbosity = if args.quiet { Verbosity::Quiet } else { Verbosity::Normal };
    let mut outputs = Outputs::default();
    let mut files = Vec::new();
    for path in &args.output {
        files.push((path, Kind::of(path)?));
        outputs.add(path, "-o")?;
    }
    let name = args.scene.clone().map_or_else(scene_input::unnamed, Ok)?;
    let mut loaded = scene_input::read(&name, &args.changes, Limits::default(), verbosity)?;
    outputs.keep_clear_of(&loaded.inputs)?;
    scene_input::complete(&mut loaded, verbosity);
    let mut settings = Settings::of(&loaded.scene);
    plan::choose(&args.choices, &mut loaded.scene, &mut settings)?;
    settings.max_memory = Some(Limits::default().memory_bytes);
    let effort = Effort { budget: args.budget, size: args.size, rounds: args.rounds };
    let watch = Watch { progress: None, stop: interrupt::flag()? };
    let mut steps = Steps::start(verbosity);
    let threads = Threads::new(args.threads)?;
    let report = threads.run(|| measure(&loaded.scene, &settings, &effort, &watch, &mut steps)).map_err(|error| match error {
        PrepareError::Cancelled => Failure::new(Exit::Interrupted, NOTHING_KEPT),
        other => Error::input(&loaded.source.name, other).into(),
    })?;
    drop(steps);
    let document = Document::new(&loaded, threads.run(rayon::current_num_threads), &report);
    for (path, kind) in files {
        document.write(path, kind)?;
        verbosity.say(path.display());
    }
    console::print(if args.json { console::json(&document) } else { text::table(&document) })
}

impl Listener for Steps {
    fn step(&mut self, what: &str, share: f64) {
        self.show(what, share);
    }
}
