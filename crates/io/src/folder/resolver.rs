//! Source of the files that a scene names, for a scene loaded from bytes: an archive, memory or a
//! network. The caller provides this source.

use std::fmt;
use std::io;
use std::sync::Arc;

type ReadFunction = dyn Fn(&str) -> io::Result<Vec<u8>> + Send + Sync;

/// Function that provides the files that a scene names, for a scene that is not on disk
/// ([`Input::Bytes`](crate::Input::Bytes)). It gets the path of each file relative to the scene,
/// with `/` as separator.
///
/// Paths outside the scene's own folder are refused before the call. Content larger than
/// [`Limits::file_bytes`](crate::Limits) is refused after the call. Clones of a resolver compare as
/// equal; two resolvers that were created separately do not.
#[derive(Clone)]
pub struct Resolver(Arc<ReadFunction>);

impl Resolver {
    /// Creates a resolver from a function.
    pub fn new(read: impl Fn(&str) -> io::Result<Vec<u8>> + Send + Sync + 'static) -> Self {
        Self(Arc::new(read))
    }

    /// Reads a file by its path relative to the scene.
    ///
    /// # Errors
    /// Errors of the function; [`io::ErrorKind::NotFound`] for a missing file.
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
