//! Threads of the program. Their number is set only here; the libraries use the thread pool of
//! their caller.

use std::error::Error;
use std::fmt::Display;
use std::thread::available_parallelism;

use rayon::{ThreadPool, ThreadPoolBuilder};
use raywright_core::memory::can_allocate;

use crate::console::Verbosity;
use crate::failure::{Exit, Failure};

/// Address space of a thread in bytes: its stack, the stack of its signal handlers, and their guard
/// pages.
const THREAD_BYTES: u64 = (2 << 20) + (128 << 10);

/// Thread pool of the program; `None` is rayon's global pool.
pub struct Threads(Option<ThreadPool>);

impl Threads {
    /// Creates a pool as [`Threads::new`] does, with at most a thread for each processor: further
    /// threads only wait for one another. A smaller number than requested is noted.
    pub fn within_machine(count: Option<u32>, verbosity: Verbosity) -> Result<Self, Failure> {
        let processors = available_parallelism().map_or(u32::MAX, |count| count.get() as u32);
        if let Some(count) = count.filter(|&count| count > processors) {
            verbosity.print_note(format_args!(
                "--threads {count}: the number of threads is {processors}, one for each processor of this machine"
            ));
        }
        Self::new(count.map(|count| count.min(processors)))
    }

    /// Creates a pool of `count` threads. Without a count, the pool is rayon's global pool with a
    /// thread for each processor. The calling thread belongs to the global pool, because a transfer
    /// of work to another thread takes 0.05 ms, and the preparation of a small model consists of
    /// many small tasks.
    pub fn new(count: Option<u32>) -> Result<Self, Failure> {
        let global_pool = ThreadPoolBuilder::new().use_current_thread();
        // With a count, the global pool consists of the calling thread alone.
        let built = if count.is_some() {
            global_pool.num_threads(1)
        } else {
            global_pool
        }
        .build_global();
        // An error without a source means that the global pool exists already, which is no failure.
        if let Some(cause) = built.err().as_ref().and_then(Error::source) {
            return Err(thread_start_failure(&cause));
        }
        // The standard library aborts the program if address space runs out while a thread starts;
        // this check comes first.
        if count.is_some_and(|count| !can_allocate(u64::from(count) * THREAD_BYTES)) {
            return Err(thread_start_failure(
                &"the address space has no room for the stacks of the threads",
            ));
        }
        let pool = |count: u32| ThreadPoolBuilder::new().num_threads(count as usize).build();
        Ok(Self(
            count
                .map(pool)
                .transpose()
                .map_err(|cause| thread_start_failure(&cause))?,
        ))
    }

    /// Runs a closure on the threads of the pool, and returns its result.
    pub fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.0 {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

/// Creates the failure for threads that the system refuses to start.
pub fn thread_start_failure(cause: &dyn Display) -> Failure {
    Failure::new(Exit::Limit, format_args!("cannot start the threads: {cause}"))
        .with_hint("choose fewer threads with --threads, or raise the limit on processes or addresses (ulimit -u, ulimit -v)")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: `--threads` alone sets the number of threads, in every library.
    #[test]
    fn threads_are_set_by_the_flag() {
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

    /// Protects: a number of threads beyond the machine's processors costs no time.
    #[test]
    fn threads_are_at_most_the_processors() {
        let processors = available_parallelism().expect("a number").get();
        let at_work = |count| {
            Threads::within_machine(count, Verbosity::Quiet)
                .expect("a few threads")
                .run(rayon::current_num_threads)
        };
        assert_eq!(
            [1, 1000].map(|count| at_work(Some(count))),
            [1, processors.min(1000)]
        );
    }

    /// Protects: stacks without room in the address space are a failure of kind limit, no abort.
    #[test]
    fn threads_without_room_are_refused() {
        let failure = Threads::new(Some(u32::MAX))
            .err()
            .expect("no system has the room");
        assert_eq!(failure.exit, Exit::Limit);
        assert!(failure.message.contains("cannot start the threads: "));
    }
}
