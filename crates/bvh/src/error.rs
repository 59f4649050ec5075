//! Errors of adding primitives.

use crate::aabb::Aabb;
use crate::slot::MAX_PRIMITIVES;

/// Reason why a primitive was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GeometryError {
    /// A coordinate is NaN, infinite, or too large for an f32 box.
    #[error("a coordinate is not a finite number within ±3e38")]
    NotFinite,
    /// A transform has no inverse.
    #[error("the transform can't be inverted")]
    Singular,
    /// A moving transform has no inverse at some time between its ends.
    #[error("the transform can't be inverted at some time between its two ends")]
    SingularOnTheWay,
    /// An instance of a geometry that itself holds instances: only two levels are supported.
    #[error("an instance of something that holds instances itself")]
    Nested,
    /// An instance of a part that was never added.
    #[error("an instance of a part that the group does not have")]
    NoPart,
    /// More primitives than a tree can address.
    #[error("more than {MAX_PRIMITIVES} primitives in one set")]
    TooMany,
}

/// Refuses a box that no tree can hold. No box and an empty box are both accepted.
pub(crate) fn check_bounds(bounds: Option<Aabb>) -> Result<Option<Aabb>, GeometryError> {
    let refused = bounds.is_some_and(|b| b != Aabb::EMPTY && b.padded().is_none());
    if refused {
        Err(GeometryError::NotFinite)
    } else {
        Ok(bounds)
    }
}
