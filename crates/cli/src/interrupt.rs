//! Ctrl-C: the first stops the work at its next check, or ends the program where no result exists
//! yet; the second ends the program at once.

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

use crate::beginning;
use crate::failure::{Exit, Failure};

static STOP: AtomicBool = AtomicBool::new(false);

/// Turns a file beyond the size limit (`ulimit -f`) into a failed write, as on a full disk.
/// Otherwise the system would end the program at once and leave the unfinished file behind.
pub fn outlive_file_limits() {
    // If the handler cannot be registered, the system's default applies.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// Installs the signal handlers once for the whole program, and returns the flag set by the first
/// Ctrl-C or termination request.
pub fn flag() -> Result<&'static AtomicBool, Failure> {
    static WATCH: OnceLock<Result<(), String>> = OnceLock::new();
    match WATCH.get_or_init(|| watch().map_err(|error| error.to_string())) {
        Ok(()) => Ok(&STOP),
        Err(cause) => Err(Failure::new(
            Exit::Failed,
            format!("cannot watch for Ctrl-C: {cause}"),
        )),
    }
}

/// Handler of a stop request. It runs on a thread of its own, where writes and locks are allowed.
fn stop() {
    beginning::interrupt();
    if STOP.swap(true, Ordering::Relaxed) {
        std::process::exit(Exit::Interrupted as i32);
    }
}

#[cfg(unix)]
fn watch() -> io::Result<()> {
    let mut signals = Signals::new([SIGHUP, SIGINT, SIGTERM])?;
    thread::Builder::new().spawn(move || signals.forever().for_each(|_| stop()))?;
    Ok(())
}

/// On other systems a signal only sets a flag; a thread polls the flag at short intervals.
#[cfg(not(unix))]
fn watch() -> io::Result<()> {
    let request = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, request.clone())?;
    }
    thread::Builder::new().spawn(move || {
        loop {
            thread::sleep(Duration::from_millis(50));
            if request.swap(false, Ordering::Relaxed) {
                stop();
            }
        }
    })?;
    Ok(())
}
