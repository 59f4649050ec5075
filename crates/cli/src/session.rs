//! Session of a command: threads, signals, messages and files. Every command that reads a file opens
//! one, so that a request to stop ends each of them in the same way.

use std::ffi::OsStr;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use raywright_core::bench::clock::process_seconds;
use raywright_io::{LoadOptions, LoadedScene, output};
use serde::Serialize;

use crate::console::Verbosity;
use crate::early_stage::EarlyStageGuard;
use crate::failure::Failure;
use crate::notes::Notes;
use crate::preparation::NOTHING_KEPT;
use crate::progress::RunObserver;
use crate::targets::OutputFiles;
use crate::threads::Threads;
use crate::{interrupt, scene_input};

/// Threads, signals, messages and files of a running command.
pub struct Session {
    /// Stopwatch of the run.
    pub clock: StageClock,
    /// Amount of messages.
    pub verbosity: Verbosity,
    /// Messages in addition to the result.
    pub notes: Notes,
    /// Output files, which are compared with each other and with the inputs.
    pub outputs: OutputFiles,
    /// Flag that the first request to stop sets.
    pub stop: &'static AtomicBool,
    threads: Threads,
    /// Guard of the early stage, in which a request to stop ends the program; `None` while an
    /// observer checks for requests, and while files are written.
    stage: Option<EarlyStageGuard>,
}

impl Session {
    /// Installs the signal handlers, starts the threads (by default one for each processor), and
    /// begins the early stage.
    pub fn open(threads: Option<u32>, verbosity: Verbosity) -> Result<Self, Failure> {
        let stop = interrupt::install_stop_flag()?;
        Ok(Self {
            clock: StageClock::start(),
            verbosity,
            notes: Notes::new(verbosity),
            outputs: OutputFiles::default(),
            stop,
            threads: Threads::within_machine(threads, verbosity)?,
            stage: Some(EarlyStageGuard::start_unlimited(NOTHING_KEPT)),
        })
    }

    /// Runs a closure on the threads of the session, and returns its result.
    pub fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.threads.run(work)
    }

    /// Begins an early stage whose message for a request to stop is `stop_message`.
    pub fn start_early_stage(&mut self, stop_message: &'static str) {
        // A stage ends before the next begins.
        self.stage = None;
        self.stage = Some(EarlyStageGuard::start_unlimited(stop_message));
    }

    /// Begins an early stage that limits of memory, in bytes, and of time end too. `time` holds the
    /// time budget of the run.
    pub fn start_limited_stage(
        &mut self,
        name: &OsStr,
        memory: u64,
        time: Option<Duration>,
    ) -> Result<(), Failure> {
        self.stage = None;
        let time = time.map(|budget| (self.start_time(), budget));
        self.stage = Some(EarlyStageGuard::start(name, memory, time)?);
        Ok(())
    }

    /// Ends the early stage. Returns false if it was over.
    pub fn end_early_stage(&mut self) -> bool {
        self.stage.take().is_some()
    }

    /// Whether the early stage lasts.
    pub fn is_early_stage(&self) -> bool {
        self.stage.is_some()
    }

    /// Whether a request to stop has arrived.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Returns the time at which the run started.
    pub fn start_time(&self) -> Instant {
        self.clock.start_time()
    }

    /// Ends the early stage, and returns an observer that stops the following work at a request to
    /// stop.
    pub fn start_work(&mut self) -> RunObserver<'static> {
        self.end_early_stage();
        self.observer()
    }

    /// Returns an observer that stops its work at a request to stop.
    pub fn observer(&self) -> RunObserver<'static> {
        RunObserver::with_stop_flag(self.stop)
    }

    /// Loads a scene by its name on the command line, and records its warnings. Refuses outputs that
    /// would overwrite a file of the scene.
    pub fn load(&mut self, name: &OsStr, options: &LoadOptions) -> Result<LoadedScene, Failure> {
        self.end_early_stage();
        let Self { threads, notes, .. } = self;
        let loaded = threads.run(|| scene_input::load_with_notes(name, options, notes))?;
        self.start_early_stage(NOTHING_KEPT);
        self.outputs.check_against_inputs(&loaded.inputs)?;
        Ok(loaded)
    }

    /// Loads a scene to render, as [`Session::load`] does, and prints its warnings and a note on what
    /// the program adds to it.
    pub fn load_to_render(
        &mut self,
        name: &OsStr,
        options: &LoadOptions,
    ) -> Result<LoadedScene, Failure> {
        let loaded = self.load(name, options)?;
        scene_input::note_added_parts(&loaded, &mut self.notes);
        self.notes.print_kept_messages();
        Ok(loaded)
    }

    /// Writes a report to a file, and prints the name of the file.
    pub fn write_report(&mut self, path: &Path, text: &str) -> Result<(), Failure> {
        self.end_early_stage();
        output::write_atomically(path, text.as_bytes())?;
        self.verbosity.print_result_message(path.display());
        Ok(())
    }
}

/// Wall-clock seconds of each stage of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StageSeconds {
    /// Load and validation of the scene.
    pub load: f64,
    /// Build of accelerators and tables.
    pub prepare: f64,
    /// Ray tracing, and denoising where requested.
    pub render: f64,
    /// Writing of pictures.
    pub write: f64,
    /// Seconds from the start of the program to the end of the last finished stage.
    pub total: f64,
    /// CPU seconds of all threads during ray tracing, independent of other programs; wall-clock
    /// seconds where the system reports no CPU time.
    pub render_cpu: f64,
}

/// Stopwatch of the successive stages of a run.
#[derive(Clone, Copy, Debug)]
pub struct StageClock {
    /// Start of the first stage.
    start: Instant,
    /// End of the last finished stage, which is the start of the current stage.
    last: Instant,
    /// CPU seconds of all threads at the end of the last finished stage.
    last_cpu: f64,
}

impl StageClock {
    /// Starts the stopwatch at the start of the first stage.
    pub fn start() -> Self {
        let now = Instant::now();
        Self {
            start: now,
            last: now,
            last_cpu: process_seconds(),
        }
    }

    /// Ends a stage: returns its wall-clock seconds, and starts the next stage.
    pub fn lap(&mut self) -> f64 {
        self.lap_with_cpu()[0]
    }

    /// Ends a stage: returns its wall-clock seconds and the CPU seconds of all threads, and starts
    /// the next stage.
    pub fn lap_with_cpu(&mut self) -> [f64; 2] {
        let (now, cpu) = (Instant::now(), process_seconds());
        let seconds = now
            .duration_since(std::mem::replace(&mut self.last, now))
            .as_secs_f64();
        [seconds, cpu - std::mem::replace(&mut self.last_cpu, cpu)]
    }

    /// Returns the time at which the first stage started.
    pub fn start_time(&self) -> Instant {
        self.start
    }

    /// Returns the wall-clock seconds since the first stage started.
    pub fn total_seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: stages do not overlap: the sum of their times is at most the total.
    #[test]
    fn laps_add_up() {
        let mut clock = StageClock::start();
        let laps = clock.lap() + clock.lap();
        assert!(laps <= clock.total_seconds());
    }
}
