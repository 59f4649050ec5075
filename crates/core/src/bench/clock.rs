//! Clock of the benchmarks. On Unix it measures CPU time, which depends less on other programs than
//! wall-clock time. Elsewhere it measures wall-clock time.

/// Name of the clock that measures the time of a thread, as reports show it.
pub const CLOCK_NAME: &str = if cfg!(unix) {
    "thread CPU time"
} else {
    "wall-clock time"
};

/// Returns the CPU time of the calling thread in seconds. Only differences on one thread are
/// meaningful. Except on Unix, it is wall-clock time.
pub(crate) fn thread_seconds() -> f64 {
    cpu_seconds(TimerScope::Thread)
}

/// Returns the CPU time of all threads of the process in seconds. Only differences are meaningful.
/// Except on Unix, it is wall-clock time.
pub fn process_seconds() -> f64 {
    cpu_seconds(TimerScope::Process)
}

/// Function that runs `work` and returns the duration in seconds. `work` returns its amount, such
/// as a number of rays. Tests use a stopwatch that computes the duration from the amount,
/// independently of the machine's load.
pub(crate) type Stopwatch = fn(work: &mut dyn FnMut() -> u64) -> f64;

/// Runs the work and returns the CPU seconds of the calling thread. In tests it is ten nanoseconds per
/// unit of the work's amount.
pub(super) fn time_sample(work: &mut dyn FnMut() -> u64) -> f64 {
    match cfg!(test) {
        true => work() as f64 * 1e-8,
        false => time_work(TimerScope::Thread, work),
    }
}

/// Runs the work and returns the CPU seconds of all threads of the process.
pub(crate) fn time_on_process(work: &mut dyn FnMut() -> u64) -> f64 {
    time_work(TimerScope::Process, work)
}

/// Runs the work and returns the CPU seconds of the thread or of the process.
fn time_work(scope: TimerScope, work: &mut dyn FnMut() -> u64) -> f64 {
    let start = cpu_seconds(scope);
    work();
    cpu_seconds(scope) - start
}

#[derive(Clone, Copy)]
enum TimerScope {
    Thread,
    Process,
}

#[cfg(unix)]
fn cpu_seconds(scope: TimerScope) -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(match scope {
        TimerScope::Thread => ClockId::ThreadCPUTime,
        TimerScope::Process => ClockId::ProcessCPUTime,
    });
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(not(unix))]
fn cpu_seconds(_: TimerScope) -> f64 {
    use std::sync::LazyLock;
    use std::time::Instant;
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the clock advances during work and stands still while the thread sleeps; another
    /// thread's work counts for the process alone.
    #[test]
    #[cfg(unix)]
    fn counts_work_and_not_waiting() {
        let start = thread_seconds();
        std::thread::sleep(std::time::Duration::from_millis(50));
        let slept = thread_seconds() - start;
        assert!((0.0..0.04).contains(&slept), "{slept} s");
        let starts = [thread_seconds(), process_seconds()];
        let work = || {
            let start = thread_seconds();
            while thread_seconds() - start < 0.05 {}
        };
        std::thread::spawn(work).join().unwrap();
        let [own, all] = [thread_seconds() - starts[0], process_seconds() - starts[1]];
        assert!(own < 0.04 && all >= 0.05, "{own} s, {all} s");
    }
}
