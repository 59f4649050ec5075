//! Times of the stages of a run.

use std::time::Instant;

use raywright_core::bench::clock::process_seconds;
use serde::Serialize;

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
