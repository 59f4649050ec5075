//! Early exits, before a run has any result to keep: the first Ctrl-C, the end of the time budget,
//! and the memory limit. Loading and preparation run in parsers, decoders and builders that need no
//! cancellation checks and hold no file open for writing.

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

/// Whether a run is still in its early stage. The thread that clears the flag ends that stage, and
/// perhaps the program.
static IS_UNDER_WAY: AtomicBool = AtomicBool::new(false);

/// Whether the program was asked to stop. A request may arrive before the early stage begins, when
/// the flag of that stage is still clear.
static IS_INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Name of the input and its memory limit, in words, for the message of a refused allocation.
static SUBJECT: Mutex<Option<[String; 2]>> = Mutex::new(None);

/// Memory of the program itself without any scene: threads, tables and texts.
const OWN_BYTES: u64 = 16 << 20;

/// Advice for too little memory or time.
const RAISE: &str = "raise the limit with --max-memory, or ";
const LESS: &str = "show fewer objects, coarser meshes and smaller images";

/// Least time for loading and preparation, whatever the budget: a busy machine needs a part of this
/// second to start.
const LEAST_TIME: Duration = Duration::from_secs(1);

/// Guard of a run's early stage, which ends when the guard is dropped.
#[must_use]
pub struct Beginning(());

impl Beginning {
    /// Begins a run over the input `name` with a limit in bytes and, where given, a start and a
    /// time budget.
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

/// Ends the program if the run is in its early stage: for the first Ctrl-C.
pub fn interrupt() {
    IS_INTERRUPTED.store(true, Ordering::SeqCst);
    end(Exit::Interrupted, || {
        Failure::new(Exit::Interrupted, NOTHING_KEPT)
    });
}

/// Sets the handler of refused allocations: a message and the exit code of limits, for memory that
/// no limit check covered beforehand.
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

/// Reports on standard error, without allocating, that memory has run out, and ends the program.
fn refuse(refusal: Refusal) -> ! {
    static ONCE: AtomicBool = AtomicBool::new(false);
    if ONCE.swap(true, Ordering::SeqCst) {
        park();
    }
    // A thread that swaps the flag after this store finds the early stage over.
    IS_UNDER_WAY.store(false, Ordering::SeqCst);
    clear_line();
    let mut out = io::stderr().lock();
    let subject = SUBJECT.try_lock().ok();
    let subject = subject.as_deref().and_then(Option::as_ref);
    // A failed write to standard error cannot be reported anywhere.
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

/// Erases a progress bar from the terminal.
fn clear_line() {
    let mut out = io::stderr().lock();
    if out.is_terminal() {
        let _ = out.write_all(b"\r\x1b[K");
    }
}

/// Waits for another thread to end the program.
fn park() -> ! {
    loop {
        thread::park();
    }
}

fn set_subject(subject: Option<[String; 2]>) {
    // The old value is dropped after the lock is released, because the drop frees memory.
    let _before = SUBJECT
        .lock()
        .map(|mut current| core::mem::replace(&mut *current, subject));
}
