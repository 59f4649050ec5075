//! Early stage of a run: loading and preparation, before a result exists that could be kept. The
//! first Ctrl-C, the end of the time budget and the memory limit end the program in this stage at
//! once, because parsers, decoders and builders check for no cancellation and hold no file open for
//! writing.

use std::ffi::OsStr;
use std::io::{self, IsTerminal, Write};
use std::process::exit;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use raywright_core::memory::{Refusal, limit_heap, on_heap_refusal};
use raywright_io::human_bytes;

use crate::clock::format_duration;
use crate::console;
use crate::failure::{Exit, Failure};
use crate::preparation::NOTHING_KEPT;
use crate::threads;

/// Whether a run is in its early stage. The thread that clears the flag ends the stage or the
/// program, so that two threads never do both.
static IS_UNDER_WAY: AtomicBool = AtomicBool::new(false);

/// Whether a request to stop has arrived. Such a request may arrive before the early stage begins,
/// and then ends the program when the stage begins.
static IS_INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Name of the input and its memory limit as text, for the message about a refused allocation.
static SUBJECT: Mutex<Option<[String; 2]>> = Mutex::new(None);

/// Memory of the program itself without any scene, in bytes: threads, tables and texts.
const OWN_BYTES: u64 = 16 << 20;

/// Advice in messages about too little memory or time.
const RAISE: &str = "raise the limit with --max-memory, or ";
const LESS: &str = "show fewer objects, coarser meshes and smaller images";

/// Least time for loading and preparation, whatever the budget. A busy machine needs a part of this
/// second to start the program.
const LEAST_TIME: Duration = Duration::from_secs(1);

/// Guard of a run's early stage; the stage ends when the guard is dropped.
#[must_use]
pub struct Beginning(());

impl Beginning {
    /// Starts the early stage of a run that loads `name`, with a memory limit in bytes and, where
    /// given, the start of the run and its time budget.
    pub fn of(
        name: &OsStr,
        memory: u64,
        time: Option<(Instant, Duration)>,
    ) -> Result<Self, Failure> {
        let name = if name == "-" {
            "standard input".to_owned()
        } else {
            console::on_one_line(&name.to_string_lossy())
        };
        set_subject(Some([name.clone(), human_bytes(memory)]));
        limit_heap(Some(memory.saturating_add(OWN_BYTES)));
        IS_UNDER_WAY.store(true, Ordering::SeqCst);
        if IS_INTERRUPTED.load(Ordering::SeqCst) {
            interrupt();
        }
        let beginning = Self(());
        if let Some((start, budget)) = time {
            let deadline = start + budget.max(LEAST_TIME);
            let wait = move || {
                thread::sleep(deadline.saturating_duration_since(Instant::now()));
                end(Exit::Limit, || late(&name, budget));
            };
            thread::Builder::new()
                .spawn(wait)
                .map_err(|cause| threads::refused(&cause))?;
        }
        Ok(beginning)
    }
}

impl Drop for Beginning {
    fn drop(&mut self) {
        if !IS_UNDER_WAY.swap(false, Ordering::SeqCst) {
            park();
        }
        limit_heap(None);
        set_subject(None);
    }
}

/// Ends the program if the run is in its early stage. The handler of Ctrl-C calls this function
/// first.
pub fn interrupt() {
    IS_INTERRUPTED.store(true, Ordering::SeqCst);
    end(Exit::Interrupted, || {
        Failure::new(Exit::Interrupted, NOTHING_KEPT)
    });
}

/// Installs the handler of refused allocations. The handler prints a message and ends the program
/// with the exit code of limits, where no check of a limit foresaw the allocation.
pub fn watch_memory() {
    on_heap_refusal(refuse);
}

fn end(exit_code: Exit, failure: impl FnOnce() -> Failure) {
    if IS_UNDER_WAY.swap(false, Ordering::SeqCst) {
        clear_line();
        console::print_message(failure().message);
        exit(exit_code as i32);
    }
}

fn late(name: &str, budget: Duration) -> Failure {
    let time = format_duration(budget.max(LEAST_TIME).as_secs_f64());
    Failure::new(
        Exit::Limit,
        format_args!(
            "{name}: {time} are over before it is loaded and prepared; nothing was written"
        ),
    )
    .with_hint(format_args!("give it a larger --budget, or {LESS}"))
}

/// Reports on standard error that memory has run out, and ends the program. The report allocates no
/// memory.
fn refuse(refusal: Refusal) -> ! {
    static ONCE: AtomicBool = AtomicBool::new(false);
    if ONCE.swap(true, Ordering::SeqCst) {
        park();
    }
    // After this store, another thread that swaps the flag finds the early stage over and does not
    // end the program too.
    IS_UNDER_WAY.store(false, Ordering::SeqCst);
    clear_line();
    let mut out = io::stderr().lock();
    let subject = SUBJECT.try_lock().ok();
    let subject = subject.as_deref().and_then(Option::as_ref);
    // A failed write to standard error can be reported nowhere.
    let _ = match (refusal, subject) {
        (Refusal::Limit, Some([name, limit])) => {
            writeln!(
                out,
                "error: {name}: loading and preparing it takes more memory than the limit of {limit}\nhelp: {RAISE}{LESS}"
            )
        }
        (_, Some([name, _])) => {
            writeln!(
                out,
                "error: {name}: loading and preparing it takes more memory than the system gives\nhelp: {LESS}"
            )
        }
        (_, None) => writeln!(
            out,
            "error: more memory is needed than the system gives\nhelp: render less with --size or --crop"
        ),
    };
    exit(Exit::Limit as i32)
}

/// Erases the line of a progress bar, if standard error is a terminal.
fn clear_line() {
    let mut out = io::stderr().lock();
    if out.is_terminal() {
        let _ = out.write_all(b"\r\x1b[K");
    }
}

/// Blocks the calling thread until another thread ends the program.
fn park() -> ! {
    loop {
        thread::park();
    }
}

fn set_subject(subject: Option<[String; 2]>) {
    // The drop of the old value frees memory, so that it comes after the release of the lock.
    let _before = SUBJECT
        .lock()
        .map(|mut current| core::mem::replace(&mut *current, subject));
}
