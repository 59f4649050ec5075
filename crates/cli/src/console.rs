//! What the user reads: results on standard output, everything else on standard error.

use std::fmt;
use std::io::{self, Write};

use crate::failure::Failure;

/// Writes a result to standard output and flushes it.
pub fn print(text: impl AsRef<[u8]>) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_ref()).and_then(|()| out.flush()).map_err(|error| Failure::stdout(&error))
}

/// Writes one message to standard error. Nothing can be done, or said, where that fails.
pub fn tell(message: impl fmt::Display) {
    let _ = writeln!(io::stderr().lock(), "{message}");
}
