//! What ends a run at once until there is something to keep: the first Ctrl-C, the end of its time,
//! and more memory than it may take. Loading and preparing go through parsers, decoders and
//! builders, which need not ask whether to go on, and hold no file open for writing.

use std::ffi::OsStr;
use std::io::{self, IsTerminal, Write};
use std::process::exit;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use raywright_core::memory::{Refusal, limit_heap, on_heap_refusal};
use raywright_io::human_bytes;

use crate::clock::spoken;
use crate::console;
use crate::failure::{Exit, Failure};
use crate::ready::NOTHING_KEPT;
use crate::threads;

/// Whether a run is at its beginning, which whoever takes this flag away ends.
static IS_UNDER_WAY: AtomicBool = AtomicBool::new(false);

/// Whether the program was asked to stop. That may come before the beginning does, when nobody
/// takes its flag away.
static IS_INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// What is loaded, and how much memory it may take, in words: for the message of an allocation that
/// is refused.
static SUBJECT: Mutex<Option<[String; 2]>> = Mutex::new(None);

/// What the program itself takes besides any scene: its threads, tables of its own, texts.
const OWN_BYTES: u64 = 16 << 20;

/// What helps where there is too little memory or time.
const RAISE: &str = "raise the limit with --max-memory, or ";
const LESS: &str = "show fewer objects, coarser meshes and smaller images";

/// Loading and preparing are given this long whatever the budget is: a machine that is busy needs a
/// part of it to start.
const LEAST_TIME: Duration = Duration::from_secs(1);

/// The beginning of a run, until it is dropped.
#[must_use]
pub struct Beginning(());

impl Beginning {
    /// Begins a run over what has that name, with at most so many bytes and so much time since a
    /// moment.
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

/// Ends the program if the run is at its beginning: for the first Ctrl-C.
pub fn interrupt() {
    IS_INTERRUPTED.store(true, Ordering::SeqCst);
    end(Exit::Interrupted, || {
        Failure::new(Exit::Interrupted, NOTHING_KEPT)
    });
}

/// Memory that nobody asked about beforehand is refused with a message and the exit code of limits.
pub fn watch_memory() {
    on_heap_refusal(refuse);
}

fn end(exit_code: Exit, failure: impl FnOnce() -> Failure) {
    if IS_UNDER_WAY.swap(false, Ordering::SeqCst) {
        clear_line();
        console::tell(failure().message);
        exit(exit_code as i32);
    }
}

fn late(name: &str, budget: Duration) -> Failure {
    let time = spoken(budget.max(LEAST_TIME).as_secs_f64());
    Failure::new(
        Exit::Limit,
        format_args!(
            "{name}: {time} are over before it is loaded and prepared; nothing was written"
        ),
    )
    .with_hint(format_args!("give it a larger --budget, or {LESS}"))
}

/// Says on standard error, without any memory, that there is none, and ends the program.
fn refuse(refusal: Refusal) -> ! {
    static ONCE: AtomicBool = AtomicBool::new(false);
    if ONCE.swap(true, Ordering::SeqCst) {
        park();
    }
    // Whoever would take the flag now finds that the run is over.
    IS_UNDER_WAY.store(false, Ordering::SeqCst);
    clear_line();
    let mut out = io::stderr().lock();
    let subject = SUBJECT.try_lock().ok();
    let subject = subject.as_deref().and_then(Option::as_ref);
    // Nobody is left who could be told that nobody hears this.
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

/// Takes a progress bar off the terminal.
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
    // What was there is dropped once nothing is locked: it gives back memory.
    let _before = SUBJECT
        .lock()
        .map(|mut current| core::mem::replace(&mut *current, subject));
}
