//! Thread pools of a given size.

use rayon::{ThreadPool, ThreadPoolBuilder};

/// A pool of `count` threads.
pub fn threads(count: usize) -> ThreadPool {
    ThreadPoolBuilder::new()
        .num_threads(count)
        .build()
        .unwrap_or_else(|e| panic!("{e}"))
}
