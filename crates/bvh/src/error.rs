//! Errors from adding primitives to a set.

use crate::aabb::Aabb;
use crate::slot::MAX_PRIMITIVES;

/// Reason why a primitive set refuses a primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GeometryError {
    /// A coordinate is NaN, infinite, or too large for an f32 box.
    #[error("a coordinate is not a finite number within ±3e38")]
    NotFinite,
    /// A transform has no inverse.
    #[error("the transform can't be inverted")]
    Singular,
    /// The transform of a moving instance has no inverse at some time of the motion.
    #[error("the transform can't be inverted at some time between its two ends")]
    SingularDuringMotion,
    /// A part that itself holds instances: only two levels are supported.
    #[error("an instance of something that holds instances itself")]
    NestedInstance,
    /// An instance of a part that is not in the set.
    #[error("an instance of a part that the group does not have")]
    UnknownPart,
    /// More primitives than a tree can address.
    #[error("more than {MAX_PRIMITIVES} primitives in one set")]
    TooManyPrimitives,
}

/// Returns an error for a box that no tree can hold. An unbounded primitive (`None`) and an empty
/// box are accepted.
pub(crate) fn check_bounds(bounds: Option<Aabb>) -> Result<Option<Aabb>, GeometryError> {
    let refused = bounds.is_some_and(|b| b != Aabb::EMPTY && b.to_padded().is_none());
    if refused {
        Err(GeometryError::NotFinite)
    } else {
        Ok(bounds)
    }
}
