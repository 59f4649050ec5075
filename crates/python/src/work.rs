//! Work that Python waits for: on threads of its own and without the interpreter's lock, until it
//! is done or Ctrl-C says that nobody wants it.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use pyo3::prelude::*;
use raywright_cli::embedded::refused;
use raywright_cli::failure::Failure;
use raywright_core::Observer;

use crate::failure::raised;

/// Between looks at Ctrl-C and at how far the work has come.
const PAUSE: Duration = Duration::from_millis(20);
/// How long work that is stopped is waited for. What goes on for longer, as a parser may, ends by
/// itself, and nobody hears of it.
const GRACE: Duration = Duration::from_millis(100);
/// Of each thread: as much as a program's first one has.
const STACK: usize = 8 << 20;

/// What the work tells, and what it is told.
#[derive(Default)]
pub struct Watch {
    stop: AtomicBool,
    /// Greatest share of it that was done, as bits: those of numbers that are not negative have
    /// their order.
    share: AtomicU64,
}

impl Watch {
    fn share(&self) -> f64 {
        f64::from_bits(self.share.load(Ordering::Relaxed))
    }
}

impl Observer for Watch {
    fn progress(&self, done: u64, total: u64) {
        let share = (done as f64 / total.max(1) as f64).min(1.0);
        self.share.fetch_max(share.to_bits(), Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Does some work on so many threads, or one for each processor, and calls `progress` with the
/// share of it that is done.
///
/// # Errors
/// The work's own, and whatever a signal's handler or `progress` raise.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<u32>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let count = threads.map_or(0, |count| count as usize);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .stack_size(STACK)
        .build();
    let pool = pool.map_err(|cause| raised(py, refused(&cause)))?;
    let (watch, (sender, mut receiver)) = (Arc::new(Watch::default()), mpsc::channel());
    let own = Arc::clone(&watch);
    pool.spawn(move || {
        // Whoever gave it up does not listen.
        let _ = sender.send(catch_unwind(AssertUnwindSafe(|| work(&own))));
    });
    let mut told = -1.0;
    loop {
        let (done, same) = py.detach(move || (receiver.recv_timeout(PAUSE), receiver));
        receiver = same;
        match done {
            Ok(Ok(Ok(result))) => return Ok(result),
            Ok(Ok(Err(failure))) => return Err(raised(py, failure)),
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
        }
        if let Err(interrupt) = py
            .check_signals()
            .and_then(|()| tell(progress, watch.share(), &mut told))
        {
            watch.stop.store(true, Ordering::Relaxed);
            // Its result is of no use any more; that it ended is.
            let _ = py.detach(move || receiver.recv_timeout(GRACE).is_ok());
            return Err(interrupt);
        }
    }
}

/// Tells a share that was not told before.
fn tell(progress: Option<&Bound<'_, PyAny>>, share: f64, told: &mut f64) -> PyResult<()> {
    if let Some(progress) = progress.filter(|_| share > *told) {
        *told = share;
        progress.call1((share,))?;
    }
    Ok(())
}
