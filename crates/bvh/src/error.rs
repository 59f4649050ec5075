//! Errors from adding primitives to a set.

use crate::aabb::Aabb;
use crate::slot::MAX_PRIMITIVES;

/// Reason why a primitive set refuses a primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GeometryError {
    /// A coordinate is NaN, infinite, or too large for an f32 box.
    #[error(
        "the primitive has a coordinate that is NaN, infinite or beyond ±3e38; use finite coordinates within this range"
    )]
    NotFinite,
    /// A transform has no inverse.
    #[error(
        "the transform has no inverse: its scale is zero along a direction, or one of its numbers is not finite; use finite numbers and a scale other than zero"
    )]
    Singular,
    /// The transform of a moving instance has no inverse at some time of the motion.
    #[error(
        "at some time between its start and its end the moving transform has no inverse, or is too close to having none (half a turn, for example, flattens the object halfway); use a smaller change from start to end"
    )]
    SingularDuringMotion,
    /// A geometry with instances, added as a part: only two levels are supported.
    #[error(
        "a geometry that contains instances can't be placed by a further instance: only two levels are supported; place its contents directly"
    )]
    NestedInstance,
    /// An instance whose part is not in the set.
    #[error(
        "the instance refers to a part that was never added to the set; add the part with `add_part` first"
    )]
    UnknownPart,
    /// More primitives than a tree can address.
    #[error(
        "the set would hold more than {MAX_PRIMITIVES} primitives; divide them into several parts, each placed by an instance"
    )]
    TooManyPrimitives,
}

/// Checks that a tree can hold the box of a primitive. Returns the box unchanged, or
/// [`GeometryError::NotFinite`] for a box with a bound that no finite f32 represents. An unbounded
/// primitive (`None`) and an empty box are accepted.
pub(crate) fn check_bounds(bounds: Option<Aabb>) -> Result<Option<Aabb>, GeometryError> {
    let refused = bounds.is_some_and(|b| b != Aabb::EMPTY && b.to_padded().is_none());
    if refused {
        Err(GeometryError::NotFinite)
    } else {
        Ok(bounds)
    }
}
