//! Kinds of failure, which let callers distinguish failures without parsing the message.

/// Kind of a failure; the command line maps each kind to an exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The content of a file is wrong.
    Input,
    /// A file cannot be read or written.
    File,
    /// A file needs more than the limits allow.
    Limit,
    /// The caller names something that does not exist (a preset, a camera, a parameter), or
    /// requests something that the input does not support.
    Usage,
}
