//! The clock of the measurements: CPU time of the measuring thread where the system has it, so that a busy machine disturbs
//! less, and wall-clock time elsewhere.

/// What the clock counts, in words for a report.
pub const CLOCK: &str = if cfg!(unix) { "thread CPU time" } else { "wall-clock time" };

/// Seconds since some fixed moment; only differences mean something, and only on one thread.
#[cfg(unix)]
pub fn now() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Seconds since some fixed moment; only differences mean something, and only on one thread.
#[cfg(not(unix))]
pub fn now() -> f64 {
    use std::sync::LazyLock;
    use std::time::Instant;
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the unit is the second and time goes forward, but not while the thread sleeps.
    #[test]
    #[cfg(unix)]
    fn counts_work_and_not_waiting() {
        let start = now();
        std::thread::sleep(std::time::Duration::from_millis(50));
        let slept = now() - start;
        assert!((0.0..0.04).contains(&slept), "{slept} s");
        let started = now();
        let mut x = 0_u64;
        while now() - started < 0.001 {
            x = std::hint::black_box(x + 1);
        }
        assert!(now() > started && x > 0);
    }
}
