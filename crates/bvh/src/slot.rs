//! Slots: one per primitive of a set, of any kind.

use crate::ray::Visibility;

/// The most primitives that one tree can address.
pub(crate) const MAX_PRIMITIVES: usize = (1 << 27) - 1;

/// The array that stores a primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PrimitiveKind {
    Sphere,
    Triangle,
    Plane,
    Shape,
    TransformedShape,
    Instance,
}

/// One primitive: its ids, its kind, its visibility, and its index in the array of that kind.
/// Objects and their primitives are numbered in the order of insertion, so both ids also decide
/// ties.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot {
    pub object: u32,
    pub primitive: u32,
    pub index: u32,
    pub kind: PrimitiveKind,
    pub visibility: Visibility,
}

impl Slot {
    /// Order among hits at equal distance: the lowest wins.
    #[inline(always)]
    pub fn order(&self) -> (u32, u32) {
        (self.object, self.primitive)
    }
}
