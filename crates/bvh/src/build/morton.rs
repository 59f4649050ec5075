//! The order in which `obvhs` clusters boxes, made beforehand: so that it is known what it will do with them, and that its
//! Morton codes are of use.
//!
//! Its codes take the centres as shares of the whole box, in 2²¹ or 2⁴² steps a axis. Two things go wrong there. A share of
//! exactly 1 wraps to 0, so that a wall in the greatest face of the room is sorted to the least one; and where a scene is
//! large, everything small in it falls into one step and stays in the order of the file.

use glam::{DVec3, Vec3A};
use obvhs::ploc::SortPrecision;
use obvhs::ploc::morton::{morton_encode_u64_unorm, morton_encode_u128_unorm};
use rayon::prelude::*;

use crate::aabb::PaddedBox;

/// Boxes in Morton order, as they are handed to the builder.
pub(super) struct Sorted {
    pub boxes: Vec<PaddedBox>,
    /// The place of each in the input.
    pub places: Vec<u32>,
    pub precision: SortPrecision,
    /// Whether a box is larger than in the input.
    pub grown: bool,
}

/// Sorts with as many steps as set boxes apart; none where even 2⁴² do not.
pub(super) fn sorted(boxes: &[PaddedBox], least: SortPrecision) -> Option<Sorted> {
    let mut boxes = boxes.to_vec();
    let grown = grow(&mut boxes);
    let shares = MortonFrame::new(&boxes)?;
    let (places, precision) = match least {
        SortPrecision::U64 => order(&boxes, |b| morton_encode_u64_unorm(shares.of(b))).map(|places| (places, least)),
        SortPrecision::U128 => None,
    }
    .or_else(|| order(&boxes, |b| morton_encode_u128_unorm(shares.of(b))).map(|places| (places, SortPrecision::U128)))?;
    Some(Sorted { boxes: places.iter().map(|&i| boxes[i as usize]).collect(), places, precision, grown })
}

/// Places by code, those of one code by place; none where more than a few boxes share a code that should not.
fn order<C: Ord + Copy + Send>(boxes: &[PaddedBox], code: impl Fn(&PaddedBox) -> C + Sync) -> Option<Vec<u32>> {
    const FEW: usize = 64;
    let mut keys: Vec<(C, u32)> = (0..).zip(boxes).map(|(i, b)| (code(b), i)).collect();
    keys.par_sort_unstable();
    let centre = |place: u32| centre(&boxes[place as usize]);
    let mixed = keys.windows(2).filter(|w| w[0].0 == w[1].0 && centre(w[0].1) != centre(w[1].1)).count();
    (mixed <= boxes.len() / FEW).then(|| keys.into_iter().map(|(_, place)| place).collect())
}

fn centre(b: &PaddedBox) -> Vec3A {
    (Vec3A::from(b.max) + Vec3A::from(b.min)) * 0.5
}

/// Centres as shares of the whole box, by the operations of `obvhs` in their order.
struct MortonFrame {
    scale: DVec3,
    offset: DVec3,
}

impl MortonFrame {
    /// None where the whole box is too large for f32.
    fn new(boxes: &[PaddedBox]) -> Option<Self> {
        let (min, max) = whole(boxes);
        let extent = max - min;
        let scale = 1.0 / extent.as_dvec3();
        extent.is_finite().then(|| Self { scale, offset: -min.as_dvec3() * scale })
    }

    fn of(&self, b: &PaddedBox) -> DVec3 {
        centre(b).as_dvec3() * self.scale + self.offset
    }
}

fn whole(boxes: &[PaddedBox]) -> (Vec3A, Vec3A) {
    boxes.iter().fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(min, max), b| (min.min(b.min.into()), max.max(b.max.into())))
}

/// Where a centre's share would be 1, lets one box reach beyond the greatest face, by 2⁻¹⁸ of the whole extent. That is less
/// than any share of 1 − 2⁻²¹ needs, and far more than the pads, or there would be no such share.
fn grow(boxes: &mut [PaddedBox]) -> bool {
    const BEYOND: f32 = 1.0 / (1 << 18) as f32;
    let Some(shares) = MortonFrame::new(boxes) else { return false };
    let most = boxes.iter().fold(DVec3::ZERO, |most, b| most.max(shares.of(b)));
    let (min, max) = whole(boxes);
    let mut grown = false;
    for axis in (0..3).filter(|&axis| most[axis] >= 1.0) {
        if let Some(last) = boxes.iter_mut().find(|b| b.max[axis] >= max[axis]) {
            last.max[axis] += (max[axis] - min[axis]) * BEYOND;
            grown = true;
        }
    }
    grown
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::aabb::Aabb;

    /// Protects: the boxes of a closed room's greatest faces are not sorted to its least ones, wherever the room is and
    /// however large: no share of a centre is 1 as `obvhs` reckons it.
    #[test]
    fn no_share_is_one() {
        for scale in [1e-6, 1e-3, 1.0, 10.0, 1e5, 1e9] {
            for least in [DVec3::ZERO, DVec3::NEG_ONE, DVec3::splat(-0.5), DVec3::new(-1.0, 3.0, -1e3), DVec3::splat(-1.0 - 1e-7)]
            {
                let walls = [0.0, 0.5, 1.0].into_iter().flat_map(|at| {
                    [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
                        let min = (least + axis * at) * scale;
                        // Tiles of a wall: the smaller they are, the smaller their pads.
                        Aabb { min, max: min + (DVec3::ONE - axis) * (scale / 128.0) }.padded().unwrap()
                    })
                });
                let sorted = sorted(&walls.collect::<Vec<_>>(), SortPrecision::U64).unwrap();
                let shares = MortonFrame::new(&sorted.boxes).unwrap();
                for b in &sorted.boxes {
                    let share = shares.of(b);
                    assert!(share.max_element() < 1.0, "{scale} {least} {share}");
                }
            }
        }
    }

    /// Protects: boxes are not grown where no share is 1, so that trees of ordinary scenes stay what they were.
    #[test]
    fn grown_only_for_need() {
        let boxes = [0.0, 0.3, 0.9].map(|x| PaddedBox { min: Vec3::splat(x), max: Vec3::splat(x + 0.1) });
        let sorted = sorted(&boxes, SortPrecision::U64).unwrap();
        assert_eq!((sorted.grown, sorted.boxes.as_slice(), sorted.places), (false, boxes.as_slice(), vec![0, 1, 2]));
    }

    /// Protects: where everything but one box falls into one step of 2²¹, finer steps sort it; where they don't, nothing is
    /// clustered in the order of the file.
    #[test]
    fn crowds_are_set_apart() {
        let with_far = |far: f32| {
            let near = (0..200).map(|i| Vec3::splat((i * 89 % 200) as f32)).chain([Vec3::splat(far)]);
            near.map(|p| PaddedBox { min: p - 0.5, max: p + 0.5 }).collect::<Vec<_>>()
        };
        let precision = |far| sorted(&with_far(far), SortPrecision::U64).map(|s| matches!(s.precision, SortPrecision::U128));
        assert_eq!([1e3, 1e9, 1e20].map(precision), [Some(false), Some(true), None]);
    }
}
