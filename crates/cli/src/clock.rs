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

/// Formats seconds in the unit that fits, with about three digits: `35 ms`, `1.24 s`, `12 min 5 s`.
pub fn format_duration(seconds: f64) -> String {
    match seconds {
        s if s < 0.9995 => format!("{:.0} ms", s * 1e3),
        s if s < 9.995 => format!("{s:.2} s"),
        s if s < 99.95 => format!("{s:.1} s"),
        s => format_whole_seconds(s as u64),
    }
}

/// Formats whole seconds: `8 s`, `3 min 20 s`, `2 h 5 min`.
pub fn format_whole_seconds(seconds: u64) -> String {
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: durations have at most three digits, in the unit that fits.
    #[test]
    fn durations_are_short() {
        let cases = [
            (0.0354, "35 ms"),
            (0.9996, "1.00 s"),
            (1.239, "1.24 s"),
            (75.04, "75.0 s"),
            (725.0, "12 min 5 s"),
        ];
        for (seconds, text) in cases {
            assert_eq!(format_duration(seconds), text);
        }
        assert_eq!(format_duration(7500.0), "2 h 5 min");
    }

    /// Protects: stages do not overlap: the sum of their times is at most the total.
    #[test]
    fn laps_add_up() {
        let mut clock = StageClock::start();
        let laps = clock.lap() + clock.lap();
        assert!(laps <= clock.total_seconds());
    }
}
