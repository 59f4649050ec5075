//! Pools of so many threads, for the benches that say how many.

use rayon::{ThreadPool, ThreadPoolBuilder};

/// A pool to work on.
pub fn threads(count: usize) -> ThreadPool {
    ThreadPoolBuilder::new()
        .num_threads(count)
        .build()
        .unwrap_or_else(|e| panic!("{e}"))
}
