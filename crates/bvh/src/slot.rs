//! Slots: the records of a set's primitives. Each primitive of any kind has one slot.

use crate::ray::Visibility;

/// Greatest number of primitives that one tree can address.
pub(crate) const MAX_PRIMITIVES: usize = (1 << 27) - 1;

/// Kind of a primitive. It selects the array in which the primitive is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PrimitiveKind {
    Sphere,
    Triangle,
    Plane,
    Shape,
    TransformedShape,
    Instance,
}

/// Record of one primitive: its ids, its kind and visibility, and its index in the array of that
/// kind. Ids count objects, and primitives within an object, in the order of insertion. Of hits at
/// equal distance, the one with the lower ids wins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrimitiveSlot {
    pub object: u32,
    pub primitive: u32,
    pub index: u32,
    pub kind: PrimitiveKind,
    pub visibility: Visibility,
}

impl PrimitiveSlot {
    /// Returns the sort key among hits at equal distance: the hit with the lowest key wins.
    #[inline(always)]
    pub fn tie_order(&self) -> (u32, u32) {
        (self.object, self.primitive)
    }
}
