//! Handling of Ctrl-C. The first Ctrl-C stops the work at its next check. While a scene is loaded
//! or prepared, no result exists, and the first Ctrl-C ends the program. The second Ctrl-C always
//! ends the program at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
#[cfg(not(unix))]
use std::time::Duration;
use std::{io, thread};

#[cfg(unix)]
use signal_hook::consts::SIGHUP;
use signal_hook::consts::{SIGINT, SIGTERM};
#[cfg(unix)]
use signal_hook::iterator::Signals;

use crate::early_stage;
use crate::failure::{Exit, Failure};

static STOP_FLAG: AtomicBool = AtomicBool::new(false);

/// Makes a write beyond the limit on file sizes (`ulimit -f`) fail, as on a full disk. By default
/// the system would end the program at such a write and leave the unfinished file behind.
pub fn ignore_file_size_signal() {
    // If the handler cannot be registered, the system's default stays: the signal ends the program.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// Installs the signal handlers, once for the whole program. Returns the flag that the first Ctrl-C
/// or request to terminate sets.
pub fn install_stop_flag() -> Result<&'static AtomicBool, Failure> {
    static WATCH: OnceLock<Result<(), String>> = OnceLock::new();
    match WATCH.get_or_init(|| spawn_signal_thread().map_err(|error| error.to_string())) {
        Ok(()) => Ok(&STOP_FLAG),
        Err(cause) => Err(Failure::new(
            Exit::Failed,
            format!("cannot watch for Ctrl-C: {cause}"),
        )),
    }
}

/// Handles Ctrl-C and requests to terminate. The handler runs on a thread of its own, where writes
/// and locks are allowed.
fn handle_stop_request() {
    early_stage::exit_on_interrupt();
    if STOP_FLAG.swap(true, Ordering::Relaxed) {
        std::process::exit(Exit::Interrupted as i32);
    }
}

#[cfg(unix)]
fn spawn_signal_thread() -> io::Result<()> {
    let mut signals = Signals::new([SIGHUP, SIGINT, SIGTERM])?;
    thread::Builder::new().spawn(move || signals.forever().for_each(|_| handle_stop_request()))?;
    Ok(())
}

/// Starts a thread that handles signals. On systems other than Unix, a signal sets a flag, which
/// the thread polls at short intervals.
#[cfg(not(unix))]
fn spawn_signal_thread() -> io::Result<()> {
    let request = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, request.clone())?;
    }
    thread::Builder::new().spawn(move || {
        loop {
            thread::sleep(Duration::from_millis(50));
            if request.swap(false, Ordering::Relaxed) {
                handle_stop_request();
            }
        }
    })?;
    Ok(())
}
