//! The scan with boxes in front: four at a time, one after the other, without a hierarchy.

use core::ops::{ControlFlow, Range};

use crate::aabb::PaddedBox;
use crate::ray::{Interval, Ray};
use crate::scalar::Real;
use crate::slabs::{FourBoxes, Slabs, WIDTH};
use crate::tally::Tally;

/// The boxes of all primitives, in their order.
#[derive(Clone, Debug)]
pub(crate) struct BoxList {
    fours: Vec<FourBoxes>,
    /// How many boxes there are; what is left of the last four is empty.
    count: usize,
}

impl BoxList {
    pub fn new(boxes: &[PaddedBox]) -> Self {
        let four = |chunk: &[PaddedBox]| {
            let mut four = FourBoxes::EMPTY;
            chunk.iter().enumerate().for_each(|(lane, bounds)| four.set(lane, bounds));
            four
        };
        Self { fours: boxes.chunks(WIDTH).map(four).collect(), count: boxes.len() }
    }

    /// Bytes of boxes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.fours.as_slice())
    }

    /// Bytes of so many.
    pub fn bytes_of(count: u64) -> u64 {
        count.div_ceil(WIDTH as u64).saturating_mul(size_of::<FourBoxes>() as u64)
    }

    /// Calls `visit` with the place of each primitive whose box the ray may enter below the current far end, in their order.
    /// The closure returns the new far end, or breaks.
    #[inline(always)]
    pub fn walk<R: Real, T: Tally>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        tally: &mut T,
        mut visit: impl FnMut(Range<usize>, R, &mut T) -> ControlFlow<(), R>,
    ) {
        let slabs = Slabs::new(ray, range.min);
        let mut far = range.max;
        for (i, four) in self.fours.iter().enumerate() {
            tally.node();
            let (mut entered, _) = slabs.enter(four, far);
            while entered != 0 {
                let place = i * WIDTH + entered.trailing_zeros() as usize;
                entered &= entered - 1;
                // A ray that is not a number enters empty boxes too.
                if place >= self.count {
                    return;
                }
                match visit(place..place + 1, far, tally) {
                    ControlFlow::Continue(nearer) => far = nearer,
                    ControlFlow::Break(()) => return,
                }
            }
        }
    }
}
