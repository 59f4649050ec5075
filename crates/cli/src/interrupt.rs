//! Ctrl-C: the first one asks the work to stop where it can, and ends the program where there is nothing to keep yet; the second one ends it
//! at once.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::beginning;
use crate::failure::{Exit, Failure};

static STOP: AtomicBool = AtomicBool::new(false);

/// Makes a file that outgrows what it may (`ulimit -f`) a write that fails, as on a full disk. The system would end the program at once, and
/// the unfinished file would stay.
pub fn outlive_file_limits() {
    // Where that cannot be had, everything is as it would be without.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default());
}

/// Installs the handler, once for the whole program, and returns the flag that the first Ctrl-C (or request to
/// terminate) sets.
pub fn flag() -> Result<&'static AtomicBool, Failure> {
    static INSTALLED: OnceLock<Result<(), String>> = OnceLock::new();
    let handler = || {
        beginning::interrupt();
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(Exit::Interrupted as i32);
        }
    };
    match INSTALLED.get_or_init(|| ctrlc::set_handler(handler).map_err(|error| error.to_string())) {
        Ok(()) => Ok(&STOP),
        Err(cause) => Err(Failure::new(Exit::Failed, format!("cannot watch for Ctrl-C: {cause}"))),
    }
}
