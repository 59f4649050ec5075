//! A net of pairs: features are tested one by one elsewhere; here each two of them meet in a small
//! scene, which is held by what must be equal. A new feature is a row of [`axes`], a new equality a
//! row of [`checks`].

mod axes;
mod checks;
mod cover;
mod sketch;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use rayon::{ThreadPool, ThreadPoolBuilder};

use self::checks::{CHECKS, Case, Check, Finding};
use self::cover::{Choice, cover, name};

/// Number of findings that are shown with their smallest scene, which takes a few seconds each.
const SHOWN: usize = 12;

fn pool(threads: usize) -> ThreadPool {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a few threads")
}

/// Finding of a check that panics.
const PANIC: &str = "a panic";

/// Finding of a check for a row of values; `None` where the values make no scene.
fn find(row: &Choice, check: &Check, pools: [&ThreadPool; 2]) -> Finding {
    let found = || Case::new(row, pools).ok().and_then(|case| check.1(&case));
    catch_unwind(AssertUnwindSafe(found)).unwrap_or_else(|_| Some(PANIC.to_owned()))
}

/// The row with as many plain values as leave the finding. Values that do not go together panic,
/// which is another finding.
fn smallest(row: &Choice, check: &Check, pools: [&ThreadPool; 2], finding: &str) -> Choice {
    let is_alike = |found: String| (found == PANIC) == (finding == PANIC);
    let mut small = row.clone();
    for axis in 0..row.len() {
        let mut plain = small.clone();
        plain[axis] = 0;
        if plain != small && find(&plain, check, pools).is_some_and(is_alike) {
            small = plain;
        }
    }
    small
}

/// Findings of all checks for a row, each with the smallest scene that has it.
fn findings(row: &Choice, pools: [&ThreadPool; 2], shown: &AtomicUsize) -> Vec<String> {
    let case = catch_unwind(AssertUnwindSafe(|| Case::new(row, pools)));
    let case = match case {
        Ok(Ok(case)) => case,
        Ok(Err(error)) => return vec![format!("no picture: {error}\n    {}\n", name(row))],
        Err(_) => return vec![format!("{PANIC}\n    {}\n", name(row))],
    };
    let found = |check: &Check| {
        let caught = catch_unwind(AssertUnwindSafe(|| check.1(&case)));
        let finding = caught.unwrap_or_else(|_| Some(PANIC.to_owned()))?;
        let small = match shown.fetch_add(1, Ordering::Relaxed) {
            0..SHOWN => smallest(row, check, pools, &finding),
            _ => row.clone(),
        };
        Some(format!("{}: {finding}\n    {}\n", check.0, name(&small)))
    };
    CHECKS.iter().filter_map(found).collect()
}

/// Protects: in a cover of all pairs of features every scene keeps its picture: by tree and scan,
/// with one thread and seven, whole and in parts, stopped and continued, in a crop and in a file,
/// to the bit; and up to rounding in the other precision, and described in another way.
#[test]
fn pairs_of_features_keep_their_pictures() {
    let (rows, next, shown) = (cover(), AtomicUsize::new(0), AtomicUsize::new(0));
    let all = Mutex::new(Vec::new());
    let work = || {
        let (one, seven) = (pool(1), pool(7));
        while let Some(row) = rows.get(next.fetch_add(1, Ordering::Relaxed)) {
            let found = findings(row, [&one, &seven], &shown);
            all.lock().expect("no thread panicked").extend(found);
        }
    };
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let all = all.into_inner().expect("no thread panicked");
    assert!(
        all.is_empty(),
        "{} findings in {} scenes:\n{}",
        all.len(),
        rows.len(),
        all.concat()
    );
}
