//! Ctrl-C: the first one asks the work to stop where it can, and ends the program where there is
//! nothing to keep yet; the second one ends it at once.

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

/// Makes a file that outgrows what it may (`ulimit -f`) a write that fails, as on a full disk. The
/// system would end the program at once, and the unfinished file would stay.
pub fn outlive_file_limits() {
    // Where that cannot be had, everything is as it would be without.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// Watches for requests to stop, once for the whole program, and returns the flag that the first
/// Ctrl-C (or request to terminate) sets.
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

/// What a request to stop does: it is made on a thread of its own, where anything may be written
/// and locked.
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

/// Elsewhere a signal can set a flag and no more, which is looked at so often that nobody waits.
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
