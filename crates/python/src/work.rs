//! Work on separate threads, without the interpreter's lock. The Python thread waits until the work
//! ends or the user presses Ctrl-C.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use pyo3::prelude::*;
use raywright_cli::embedded::thread_start_failure;
use raywright_cli::failure::Failure;
use raywright_core::Observer;

use crate::failure::to_exception;

/// Time between two checks for Ctrl-C and for progress.
const CHECK_INTERVAL: Duration = Duration::from_millis(20);
/// Longest time to wait for work after a request to stop. Some work, such as parsing, cannot stop
/// soon; it continues after that time, and its result is dropped.
const GRACE: Duration = Duration::from_millis(100);
/// Stack size of each thread in bytes, as usual for the main thread of a program.
const STACK_BYTES: usize = 8 << 20;

/// Progress of the work, and whether it shall stop.
#[derive(Default)]
pub struct WorkMonitor {
    stop: AtomicBool,
    /// Largest finished fraction so far, as the bits of a float. Non-negative floats are ordered as
    /// their bits are.
    share: AtomicU64,
}

impl WorkMonitor {
    fn finished_fraction(&self) -> f64 {
        f64::from_bits(self.share.load(Ordering::Relaxed))
    }
}

impl Observer for WorkMonitor {
    fn progress(&self, done: u64, total: u64) {
        let share = (done as f64 / total.max(1) as f64).min(1.0);
        self.share.fetch_max(share.to_bits(), Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Runs work on `threads` threads, or on a thread for each processor. Calls `progress` with the
/// finished fraction, from 0 to 1.
///
/// # Errors
/// Errors of the work, and exceptions of a signal handler or of `progress`.
pub fn run_work<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<u32>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&WorkMonitor) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let count = threads.map_or(0, |count| count as usize);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .stack_size(STACK_BYTES)
        .build();
    let pool = pool.map_err(|cause| to_exception(py, thread_start_failure(&cause)))?;
    let (watch, (sender, mut receiver)) = (Arc::new(WorkMonitor::default()), mpsc::channel());
    let own = Arc::clone(&watch);
    pool.spawn(move || {
        // Sending fails if the receiver is gone, and the result is then not needed.
        let _ = sender.send(catch_unwind(AssertUnwindSafe(|| work(&own))));
    });
    let mut reported = -1.0;
    loop {
        let (done, same) = py.detach(move || (receiver.recv_timeout(CHECK_INTERVAL), receiver));
        receiver = same;
        match done {
            Ok(Ok(Ok(result))) => return Ok(result),
            Ok(Ok(Err(failure))) => return Err(to_exception(py, failure)),
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
        }
        if let Err(interrupt) = py
            .check_signals()
            .and_then(|()| report_progress(progress, watch.finished_fraction(), &mut reported))
        {
            watch.stop.store(true, Ordering::Relaxed);
            // The result is dropped; only the end of the work matters.
            let _ = py.detach(move || receiver.recv_timeout(GRACE).is_ok());
            return Err(interrupt);
        }
    }
}

/// Calls `progress` if `share` exceeds the last reported share.
fn report_progress(
    progress: Option<&Bound<'_, PyAny>>,
    share: f64,
    reported: &mut f64,
) -> PyResult<()> {
    if let Some(progress) = progress.filter(|_| share > *reported) {
        *reported = share;
        progress.call1((share,))?;
    }
    Ok(())
}
