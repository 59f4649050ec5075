//! Errors of preparation, and the check for cancellation.

use raywright_bvh::GeometryError;

use crate::expr::ExprError;
use crate::memory::Memory;
use crate::observer::Observer;
use crate::settings::SettingsError;
use crate::validate::Problem;

/// Reason why a scene could not be prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// Invalid settings.
    #[error(transparent)]
    Settings(SettingsError),
    /// A primitive was rejected.
    #[error("objects[{object}]: {source}")]
    Geometry {
        /// Index of the object.
        object: usize,
        /// Why.
        source: GeometryError,
    },
    /// Shapes vanish when their coordinates are stored in this precision.
    #[error("{}", problems.iter().map(|p| format!("{}: {}", p.path, p.message)).collect::<Vec<_>>().join("; "))]
    Collapsed {
        /// Problems found by [`collapsed`](crate::dispatch::collapsed): at least one.
        problems: Vec<Problem>,
    },
    /// An unknown name; validation reports it with its location.
    #[error("{path}: there is no {kind} named `{name}`")]
    Missing {
        /// Path of the use.
        path: String,
        /// Kind of the missing item.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// A surface-dependent input without a surface; validation reports it with its location.
    #[error("{path}: a sky has no surface for a texture or checkerboard to lie on")]
    NoSurface {
        /// Path of the input.
        path: String,
    },
    /// An expression of the hit that does not compile.
    #[error("{path}: {source}")]
    Expression {
        /// Path of the input.
        path: String,
        /// Why.
        source: ExprError,
    },
    /// The observer cancelled preparation.
    #[error("preparation was stopped")]
    Cancelled,
    /// The film, geometry and textures would exceed the memory limit; nothing was built.
    #[error("rendering needs about {} bytes, but at most {allowed} are allowed", needed.total())]
    Memory {
        /// Estimate.
        needed: Memory,
        /// Limit in bytes.
        allowed: u64,
    },
    /// The system cannot provide the memory for the film, geometry and textures; nothing was built.
    #[error("rendering needs about {} bytes, and the system does not give as much", needed.total())]
    OutOfMemory {
        /// Estimate.
        needed: Memory,
    },
}

/// Returns an error if the observer has cancelled preparation.
pub(crate) fn check_cancelled(observer: &dyn Observer) -> Result<(), PrepareError> {
    if observer.is_cancelled() {
        Err(PrepareError::Cancelled)
    } else {
        Ok(())
    }
}
