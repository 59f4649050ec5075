//! The clock of the measurements: CPU time where the system has it, so that a busy machine disturbs
//! less, and wall-clock time elsewhere.

/// What [`thread_seconds`] counts, in words for a report.
pub const CLOCK: &str = if cfg!(unix) {
    "thread CPU time"
} else {
    "wall-clock time"
};

/// Seconds that the calling thread has worked; only differences mean something, and only on one
/// thread.
pub fn thread_seconds() -> f64 {
    seconds(Scope::Thread)
}

/// Seconds that all threads of the process have worked together; only differences mean something.
pub fn process_seconds() -> f64 {
    seconds(Scope::Process)
}

/// What tells how long some work takes, which returns how much it was. A test brings one that goes
/// by the amount, so that what it decides does not depend on the machine's load.
pub(crate) type Stopwatch = fn(work: &mut dyn FnMut() -> u64) -> f64;

/// Runs the work and returns the seconds that the thread worked.
pub(super) fn of_thread(work: &mut dyn FnMut() -> u64) -> f64 {
    timed(Scope::Thread, work)
}

/// Runs the work and returns the seconds that all threads worked, which waiting for other programs
/// does not lengthen.
pub(crate) fn of_process(work: &mut dyn FnMut() -> u64) -> f64 {
    timed(Scope::Process, work)
}

fn timed(scope: Scope, work: &mut dyn FnMut() -> u64) -> f64 {
    let start = seconds(scope);
    work();
    seconds(scope) - start
}

/// Runs the work and says that each unit of it took ten nanoseconds.
#[cfg(test)]
pub(super) fn steady(work: &mut dyn FnMut() -> u64) -> f64 {
    work() as f64 * 1e-8
}

#[derive(Clone, Copy)]
enum Scope {
    Thread,
    Process,
}

#[cfg(unix)]
fn seconds(scope: Scope) -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(match scope {
        Scope::Thread => ClockId::ThreadCPUTime,
        Scope::Process => ClockId::ProcessCPUTime,
    });
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(not(unix))]
fn seconds(_: Scope) -> f64 {
    use std::sync::LazyLock;
    use std::time::Instant;
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: time goes forward while there is work and stands still while the thread sleeps,
    /// and another thread's work is counted by the process alone.
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
