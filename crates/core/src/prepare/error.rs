//! Why a scene can't be prepared, and the question whether to go on.

use raywright_bvh::GeometryError;

use crate::expr::ExprError;
use crate::memory::Memory;
use crate::observer::Observer;
use crate::settings::SettingsError;
use crate::validate::Problem;

/// Why a scene could not be prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// No picture can be made with these settings.
    #[error(transparent)]
    Settings(SettingsError),
    /// A primitive was refused.
    #[error("objects[{object}]: {source}")]
    Geometry {
        /// Index of the object.
        object: usize,
        /// Why.
        source: GeometryError,
    },
    /// Nothing is left of shapes once their coordinates are stored in this precision's numbers.
    #[error("{}", problems.iter().map(|p| format!("{}: {}", p.path, p.message)).collect::<Vec<_>>().join("; "))]
    Collapsed {
        /// What [`collapsed`](crate::dispatch::collapsed) says of the scene: at least one.
        problems: Vec<Problem>,
    },
    /// A name that nothing has; validation reports it with its place.
    #[error("{path}: there is no {kind} named `{name}`")]
    Missing {
        /// Where it is used.
        path: String,
        /// What was looked for.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// What varies over a surface where there is none; validation reports it with its place.
    #[error("{path}: a sky has no surface for a texture or checkerboard to lie on")]
    NoSurface {
        /// Where it stands.
        path: String,
    },
    /// An expression of the hit that does not compile.
    #[error("{path}: {source}")]
    Expression {
        /// Where it stands.
        path: String,
        /// Why.
        source: ExprError,
    },
    /// The observer stopped it.
    #[error("preparation was stopped")]
    Cancelled,
    /// The picture, geometry and textures would take more than the memory allowed; nothing was
    /// built.
    #[error("rendering needs about {} bytes, but at most {allowed} are allowed", needed.total())]
    Memory {
        /// Estimate.
        needed: Memory,
        /// Limit in bytes.
        allowed: u64,
    },
    /// The system does not give the memory that the picture, geometry and textures take; nothing
    /// was built.
    #[error("rendering needs about {} bytes, and the system does not give as much", needed.total())]
    OutOfMemory {
        /// Estimate.
        needed: Memory,
    },
}

/// Asks the observer whether preparation should end here.
pub(crate) fn go_on(observer: &dyn Observer) -> Result<(), PrepareError> {
    if observer.cancelled() {
        Err(PrepareError::Cancelled)
    } else {
        Ok(())
    }
}
