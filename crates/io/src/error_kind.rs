//! Kinds of failure: what callers decide by, whatever the failure says.

/// What a failure means for the caller; the command line gives each its exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The content of a file is wrong.
    Input,
    /// A file cannot be read or written.
    File,
    /// A file asks for more than the limits allow.
    Limit,
    /// What was asked for does not exist: a preset, a camera, a parameter.
    Usage,
}
