//! Files that lie in no folder: in an archive, in memory, behind a network. Whoever loads a scene
//! from bytes finds them.

use std::fmt;
use std::io;
use std::sync::Arc;

type Read = dyn Fn(&str) -> io::Result<Vec<u8>> + Send + Sync;

/// Finds the files that a scene names, by their paths relative to it with `/` between their parts.
///
/// Paths never lead out of the scene's own folder: those that would are refused before. What is
/// larger than [`Limits::file_bytes`](crate::Limits) is refused after. Two are equal if they are
/// clones of one.
#[derive(Clone)]
pub struct Resolver(Arc<Read>);

impl Resolver {
    /// One that reads by this function.
    pub fn new(read: impl Fn(&str) -> io::Result<Vec<u8>> + Send + Sync + 'static) -> Self {
        Self(Arc::new(read))
    }

    /// The content of a file.
    ///
    /// # Errors
    /// As the function says; [`io::ErrorKind::NotFound`] where there is none.
    pub fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        (self.0)(path)
    }
}

impl fmt::Debug for Resolver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Resolver").finish_non_exhaustive()
    }
}

impl PartialEq for Resolver {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Eq for Resolver {}
