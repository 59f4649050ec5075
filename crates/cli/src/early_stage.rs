//! Early stage of a run: loading and preparation, when no result exists yet. In this stage the
//! first Ctrl-C, the end of the time budget and the memory limit end the program at once. Parsers,
//! decoders and builders do not check for cancellation, but hold no file open for writing.

use std::ffi::OsStr;
use std::io::{self, IsTerminal, Write};
use std::process::exit;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use raywright_core::memory::{AllocationRefusal, limit_heap, set_heap_refusal_handler};
use raywright_io::format_bytes;
use raywright_io::report::format_duration;

use crate::failure::{Exit, Failure};
use crate::preparation::NOTHING_KEPT;
use crate::{console, threads};

/// Whether a run is in its early stage, loading and preparation. A thread must clear this flag
/// before it ends the stage or the program, so that only one thread does either.
static IS_EARLY_STAGE: AtomicBool = AtomicBool::new(false);

/// Whether a request to stop has arrived. Such a request may arrive before the early stage begins,
/// and then ends the program when the stage begins.
static IS_INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Message of a run that a request to stop ends in its early stage.
static STOP_MESSAGE: Mutex<&str> = Mutex::new(NOTHING_KEPT);

/// Name of the input and its memory limit as text, for the message about a refused allocation.
static MESSAGE_SUBJECT: Mutex<Option<[String; 2]>> = Mutex::new(None);

/// Memory of the program itself without any scene, in bytes: threads, tables and texts.
const PROGRAM_BYTES: u64 = 16 << 20;

/// Advice in messages about too little memory or time.
const RAISE_LIMIT_ADVICE: &str = "raise the limit with --max-memory, or ";
const SMALLER_SCENE_ADVICE: &str =
    "reduce the scene: fewer objects, coarser meshes, smaller images";

/// Least time for loading and preparation, however small the budget. On a busy machine the start of
/// the program takes a part of this second.
const LEAST_TIME: Duration = Duration::from_secs(1);

/// Guard of a run's early stage, loading and preparation; the stage ends when the guard is dropped.
#[must_use]
pub struct EarlyStageGuard(());

impl EarlyStageGuard {
    /// Starts the early stage of a run (loading and preparation). `name` is the input, and `memory`
    /// the memory limit in bytes. `time`, if given, holds the start of the run and its time budget.
    pub fn start(
        name: &OsStr,
        memory: u64,
        time: Option<(Instant, Duration)>,
    ) -> Result<Self, Failure> {
        let name = if name == "-" {
            "standard input".to_owned()
        } else {
            console::mask_to_one_line(&name.to_string_lossy())
        };
        set_message_subject(Some([name.clone(), format_bytes(memory)]));
        limit_heap(Some(memory.saturating_add(PROGRAM_BYTES)));
        let beginning = Self::start_unlimited(NOTHING_KEPT);
        if let Some((start, budget)) = time {
            let deadline = start + budget.max(LEAST_TIME);
            let wait = move || {
                thread::sleep(deadline.saturating_duration_since(Instant::now()));
                exit_if_early(Exit::Limit, || deadline_failure(&name, budget));
            };
            thread::Builder::new()
                .spawn(wait)
                .map_err(|cause| threads::thread_start_failure(&cause))?;
        }
        Ok(beginning)
    }

    /// Starts a stage without limits, which a request to stop ends with this message. Such a stage
    /// searches folders or reads files, and has no unsaved result.
    pub fn start_unlimited(stop_message: &'static str) -> Self {
        if let Ok(mut message) = STOP_MESSAGE.lock() {
            *message = stop_message;
        }
        IS_EARLY_STAGE.store(true, Ordering::SeqCst);
        if IS_INTERRUPTED.load(Ordering::SeqCst) {
            exit_on_interrupt();
        }
        Self(())
    }
}

impl Drop for EarlyStageGuard {
    fn drop(&mut self) {
        if !IS_EARLY_STAGE.swap(false, Ordering::SeqCst) {
            park_forever();
        }
        limit_heap(None);
        set_message_subject(None);
    }
}

/// Ends the program if the run is still loading or preparing a scene (early stage). The handler of
/// Ctrl-C calls this function first.
pub fn exit_on_interrupt() {
    IS_INTERRUPTED.store(true, Ordering::SeqCst);
    exit_if_early(Exit::Interrupted, || {
        let message = STOP_MESSAGE.lock().map_or(NOTHING_KEPT, |message| *message);
        Failure::new(Exit::Interrupted, message)
    });
}

/// Installs the handler of refused allocations. The handler prints a message and ends the program
/// with the exit code of limits. It acts only on allocations that no earlier check of a limit has
/// refused.
pub fn install_heap_handler() {
    set_heap_refusal_handler(exit_out_of_memory);
}

fn exit_if_early(exit_code: Exit, failure: impl FnOnce() -> Failure) {
    if IS_EARLY_STAGE.swap(false, Ordering::SeqCst) {
        clear_progress_line();
        console::print_message(failure().message);
        exit(exit_code as i32);
    }
}

fn deadline_failure(name: &str, budget: Duration) -> Failure {
    let time = format_duration(budget.max(LEAST_TIME).as_secs_f64());
    Failure::new(
        Exit::Limit,
        format_args!(
            "{name}: the time limit of {time} ended the run before the scene was loaded and prepared; nothing was written"
        ),
    )
    .with_hint(format_args!(
        "give a larger --budget, or {SMALLER_SCENE_ADVICE}"
    ))
}

/// Reports on standard error that memory has run out, and ends the program. The report allocates no
/// memory.
fn exit_out_of_memory(refusal: AllocationRefusal) -> ! {
    static ONCE: AtomicBool = AtomicBool::new(false);
    if ONCE.swap(true, Ordering::SeqCst) {
        park_forever();
    }
    // After this store, another thread that reads the flag finds the early stage over, and does not
    // end the program a second time.
    IS_EARLY_STAGE.store(false, Ordering::SeqCst);
    clear_progress_line();
    let mut out = io::stderr().lock();
    let subject = MESSAGE_SUBJECT.try_lock().ok();
    let subject = subject.as_deref().and_then(Option::as_ref);
    // A failed write to standard error can be reported nowhere.
    let _ = match (refusal, subject) {
        (AllocationRefusal::Limit, Some([name, limit])) => {
            writeln!(
                out,
                "error: {name}: loading and preparing the scene takes more memory than the limit of {limit}\nhelp: {RAISE_LIMIT_ADVICE}{SMALLER_SCENE_ADVICE}"
            )
        }
        (_, Some([name, _])) => {
            writeln!(
                out,
                "error: {name}: loading and preparing the scene takes more memory than the system provides\nhelp: {SMALLER_SCENE_ADVICE}"
            )
        }
        (_, None) => writeln!(
            out,
            "error: the program needs more memory than the system provides\nhelp: render fewer pixels with --size or --crop"
        ),
    };
    exit(Exit::Limit as i32)
}

/// Erases the line of a progress bar, if standard error is a terminal.
fn clear_progress_line() {
    let mut out = io::stderr().lock();
    if out.is_terminal() {
        let _ = out.write_all(b"\r\x1b[K");
    }
}

/// Blocks the calling thread until another thread ends the program.
fn park_forever() -> ! {
    loop {
        thread::park();
    }
}

fn set_message_subject(subject: Option<[String; 2]>) {
    // The old value is dropped after the release of the lock, because the drop frees memory.
    let _previous = MESSAGE_SUBJECT
        .lock()
        .map(|mut current| core::mem::replace(&mut *current, subject));
}
