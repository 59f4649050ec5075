//! State of standard output when the process starts. The standard library opens `/dev/null` in place
//! of a closed standard output before `main`, and a result written there would be lost silently.
#![expect(
    unsafe_code,
    reason = "only a function in the section `.init_array` runs before the standard library"
)]

use core::sync::atomic::{AtomicBool, Ordering};

static WAS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Whether standard output was closed when the process started. Always false on systems other than
/// Linux.
pub fn stdout_was_closed() -> bool {
    WAS_CLOSED.load(Ordering::Relaxed)
}

#[cfg(target_os = "linux")]
mod before_main {
    use rustix::fd::BorrowedFd;

    use super::*;

    // SAFETY: the system calls the functions of this section once, before `main`. The function
    // needs nothing of the standard library that `main` initialises.
    #[used]
    #[unsafe(link_section = ".init_array")]
    static RECORD_STDOUT: extern "C" fn() = record_stdout;

    extern "C" fn record_stdout() {
        // SAFETY: the number is passed to the system only, which reports whether it is open.
        let stdout = unsafe { BorrowedFd::borrow_raw(1) };
        WAS_CLOSED.store(rustix::io::fcntl_getfd(stdout).is_err(), Ordering::Relaxed);
    }
}
