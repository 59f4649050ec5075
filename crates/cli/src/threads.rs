//! The one place that decides how many threads work: libraries use whichever pool they are called
//! from.

use std::error::Error;
use std::fmt::Display;

use rayon::{ThreadPool, ThreadPoolBuilder};
use raywright_core::memory::is_available;

use crate::failure::{Exit, Failure};

/// Addresses that a thread takes: its stack, another one for its overflow, and their guards.
const BYTES: u64 = (2 << 20) + (128 << 10);

/// What computes.
pub struct Threads(Option<ThreadPool>);

impl Threads {
    /// So many threads; where no number is given, the pool that rayon keeps for the whole program,
    /// with one for each processor, of which this thread is one: handing work over to another one
    /// and waiting for it takes a twentieth of a millisecond each time, and preparing a small model
    /// is many pieces of work.
    pub fn new(count: Option<u32>) -> Result<Self, Failure> {
        let whole = ThreadPoolBuilder::new().use_current_thread();
        // Where a number is given, what runs beside those has this thread alone.
        let built = if count.is_some() {
            whole.num_threads(1)
        } else {
            whole
        }
        .build_global();
        // An error without a source says that there is such a pool already, which will do.
        if let Some(cause) = built.err().as_ref().and_then(Error::source) {
            return Err(refused(&cause));
        }
        // Where addresses end while a thread begins, the standard library ends the program in place
        // of the call that made it.
        if count.is_some_and(|count| !is_available(u64::from(count) * BYTES)) {
            return Err(refused(&"there are no addresses for their stacks"));
        }
        let pool = |count: u32| ThreadPoolBuilder::new().num_threads(count as usize).build();
        Ok(Self(
            count
                .map(pool)
                .transpose()
                .map_err(|cause| refused(&cause))?,
        ))
    }

    /// Runs something on them.
    pub fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.0 {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

/// The system does not give a thread.
pub fn refused(cause: &dyn Display) -> Failure {
    Failure::new(Exit::Limit, format_args!("cannot start the threads: {cause}"))
        .with_hint("ask for fewer with --threads, or raise the limit on processes or addresses (ulimit -u, ulimit -v)")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: `--threads` says how many work, in whatever is called, and nothing else does.
    #[test]
    fn as_many_as_are_asked_for() {
        let at_work = |count| {
            Threads::new(count)
                .expect("a few threads")
                .run(rayon::current_num_threads)
        };
        assert_eq!(
            [Some(1), Some(3), None].map(at_work),
            [1, 3, rayon::current_num_threads()]
        );
    }
}
