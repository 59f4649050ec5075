//! Slots: one for each primitive of a set, whatever its kind.

use crate::ray::Visibility;

/// The most primitives that one tree can address.
pub(crate) const MAX_PRIMITIVES: usize = (1 << 27) - 1;

/// Which array a primitive is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Sphere,
    Triangle,
    Plane,
    Shape,
    TransformedShape,
    Instance,
}

/// One primitive: whose it is, its kind, how it takes part, and its place in the array of that
/// kind. Objects and their primitives are counted in the order in which they were added, so these
/// two are the order of ties too.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot {
    pub object: u32,
    pub primitive: u32,
    pub index: u32,
    pub kind: Kind,
    pub visibility: Visibility,
}

impl Slot {
    /// What decides between hits at one distance: the lowest wins.
    #[inline(always)]
    pub fn order(&self) -> (u32, u32) {
        (self.object, self.primitive)
    }
}
