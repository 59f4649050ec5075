//! Why a primitive is refused.

use crate::aabb::Aabb;
use crate::slot::MAX_PRIMITIVES;

/// Why a primitive was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GeometryError {
    /// A coordinate is NaN, infinite, or too large for a box in f32.
    #[error("a coordinate is not a finite number within ±3e38")]
    NotFinite,
    /// A transform can't be inverted.
    #[error("the transform can't be inverted")]
    Singular,
    /// A transform that runs from one end to another can't be inverted at some time between them.
    #[error("the transform can't be inverted at some time between its two ends")]
    SingularOnTheWay,
    /// An instance of a geometry that holds instances itself: there are two levels.
    #[error("an instance of something that holds instances itself")]
    Nested,
    /// An instance of a part that was not taken in.
    #[error("an instance of a part that the group does not have")]
    NoPart,
    /// More primitives than a tree can address.
    #[error("more than {MAX_PRIMITIVES} primitives in one set")]
    TooMany,
}

/// Refuses a box that no tree can hold. None, and one of nothing, is fine.
pub(crate) fn check_bounds(bounds: Option<Aabb>) -> Result<Option<Aabb>, GeometryError> {
    let refused = bounds.is_some_and(|b| b != Aabb::EMPTY && b.padded().is_none());
    if refused {
        Err(GeometryError::NotFinite)
    } else {
        Ok(bounds)
    }
}
