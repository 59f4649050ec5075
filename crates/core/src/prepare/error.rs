//! Errors of preparation, and the check for cancellation.

use raywright_bvh::GeometryError;

use crate::expr::ExprError;
use crate::fault::Fault;
use crate::memory::MemoryUse;
use crate::observer::Observer;
use crate::settings::SettingsError;

/// Reason why a scene cannot be prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// Invalid settings.
    #[error(transparent)]
    Settings(SettingsError),
    /// The geometry rejects a primitive.
    #[error("objects[{object}]: {source}")]
    Geometry {
        /// Index of the object in the scene.
        object: usize,
        /// Reason.
        source: GeometryError,
    },
    /// Shapes collapse when their coordinates are stored in the chosen precision.
    #[error("{}", problems.iter().map(|p| format!("{}: {}", p.path, p.message)).collect::<Vec<_>>().join("; "))]
    Collapsed {
        /// Problems found by [`find_collapsed_objects`](crate::find_collapsed_objects): at least
        /// one.
        problems: Vec<Fault>,
    },
    /// The scene uses a name that it does not define. Validation reports the same problem with its
    /// place in the file.
    #[error("{path}: the scene defines no {kind} named `{name}`")]
    Missing {
        /// Path of the field that uses the name.
        path: String,
        /// Kind of the undefined item, such as "material".
        kind: &'static str,
        /// The undefined name.
        name: String,
    },
    /// An input of the sky can only be evaluated on a surface. Validation reports the same problem
    /// with its place in the file.
    #[error("{path}: a sky has no surface, so it cannot have a texture or a checkerboard")]
    NoSurface {
        /// Path of the input.
        path: String,
    },
    /// An expression that is evaluated at hits does not compile.
    #[error("{path}: {source}")]
    Expression {
        /// Path of the input.
        path: String,
        /// Reason.
        source: ExprError,
    },
    /// The observer cancelled preparation.
    #[error("preparation was cancelled")]
    Cancelled,
    /// The estimated memory exceeds the limit that the settings set. Nothing was built.
    #[error("rendering needs about {} bytes of memory, but only {allowed} bytes are allowed; reduce the picture's size or increase the limit", needed.total())]
    Memory {
        /// Estimated memory by purpose.
        needed: MemoryUse,
        /// Limit in bytes.
        allowed: u64,
    },
    /// The system cannot provide the estimated memory. Nothing was built.
    #[error("rendering needs about {} bytes of memory, which the system cannot provide; reduce the picture's size or the scene", needed.total())]
    OutOfMemory {
        /// Estimated memory by purpose.
        needed: MemoryUse,
    },
}

/// Checks for cancellation.
///
/// # Errors
/// [`PrepareError::Cancelled`] if the observer has cancelled preparation.
pub(crate) fn check_cancelled(observer: &dyn Observer) -> Result<(), PrepareError> {
    if observer.is_cancelled() {
        Err(PrepareError::Cancelled)
    } else {
        Ok(())
    }
}
