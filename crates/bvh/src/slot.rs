//! Slots: the records of a set's primitives, one for each primitive of any kind.

use crate::ray::Visibility;

/// Greatest number of primitives that one tree can address.
pub(crate) const MAX_PRIMITIVES: usize = (1 << 27) - 1;

/// Kind of a primitive, which selects the array that stores it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PrimitiveKind {
    Sphere,
    Triangle,
    Plane,
    Shape,
    TransformedShape,
    Instance,
}

/// Record of one primitive: its ids, kind and visibility, and its index in the array of that kind.
/// Objects, and the primitives of an object, are numbered in the order of insertion, so the two ids
/// also decide ties.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrimitiveSlot {
    pub object: u32,
    pub primitive: u32,
    pub index: u32,
    pub kind: PrimitiveKind,
    pub visibility: Visibility,
}

impl PrimitiveSlot {
    /// Sort key among hits at equal distance: the lowest key wins.
    #[inline(always)]
    pub fn tie_order(&self) -> (u32, u32) {
        (self.object, self.primitive)
    }
}
