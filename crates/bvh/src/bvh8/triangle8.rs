//! Blocks of eight triangles, for the filter and the exact test. A tree stores its triangles only
//! in these blocks.

use glam::Vec3;

use super::WIDTH;
use crate::ray::{Occlusion, Side, Visibility};
use crate::shapes::Triangle;

/// Absolute coordinate from which on products of three lengths might leave the range of f32. A
/// triangle with such a corner always gets the exact test.
pub(super) const LARGE_COORDINATE: f32 = (1_u64 << 38) as f32;

/// A block of up to eight triangles, with one array per coordinate: `corners[axis][corner][lane]`,
/// unchanged from the input.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(crate) struct Triangle8 {
    pub corners: [[[f32; WIDTH]; 3]; 3],
    /// Upper bound, in each lane, of the longer of the two edges at the first corner. Two values
    /// are special: −∞ makes the filter always reject the lane, since it can't be hit; ∞ makes the
    /// filter always pass the lane to the exact test.
    pub longest: [f32; WIDTH],
}

impl Triangle8 {
    pub const EMPTY: Self = Self {
        corners: [[[0.0; WIDTH]; 3]; 3],
        longest: [f32::NEG_INFINITY; WIDTH],
    };

    /// Stores a triangle in a lane. A triangle with three equal corners can't be hit.
    pub fn set_triangle(&mut self, lane: usize, vertices: [Vec3; 3]) {
        for (corner, position) in vertices.into_iter().enumerate() {
            for axis in 0..3 {
                self.corners[axis][corner][lane] = position[axis];
            }
        }
        let [a, b, c] = vertices.map(|p| p.as_dvec3());
        let longest = (b - a)
            .length_squared()
            .max((c - a).length_squared())
            .sqrt();
        let large = vertices
            .iter()
            .any(|p| p.abs().max_element() >= LARGE_COORDINATE);
        self.longest[lane] = match () {
            () if vertices[0] == vertices[1] && vertices[0] == vertices[2] => f32::NEG_INFINITY,
            () if large => f32::INFINITY,
            () => ((longest * 1.000_001) as f32).next_up(),
        };
    }

    /// Returns the triangle in a lane.
    #[inline]
    pub fn triangle(&self, lane: usize) -> Triangle<f32> {
        let corner = |c: usize| {
            Vec3::new(
                self.corners[0][c][lane],
                self.corners[1][c][lane],
                self.corners[2][c][lane],
            )
        };
        Triangle {
            vertices: [corner(0), corner(1), corner(2)],
        }
    }
}

/// Properties of the primitives in a triangle block or a row, besides their coordinates. They are
/// read only if a lane may be hit. Masks have one bit per lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LeafHeader {
    /// Index of the slot (the record in the primitive set) of the first lane's primitive. The slots
    /// of the other lanes follow it.
    pub first: u32,
    /// Number of lanes in use.
    pub count: u8,
    /// Mask of the lanes whose primitives are opaque: their hits end an any-hit query.
    pub opaque: u8,
    /// Mask of the lanes whose hits an any-hit query passes to the caller's filter.
    pub filtered: u8,
    /// Mask of the lanes that rays can hit from outside only.
    pub outside: u8,
    /// Mask of the lanes that rays can hit from inside only.
    pub inside: u8,
    /// Mask of the lanes that camera rays can hit from outside only, other rays from both sides.
    pub culled: u8,
}

impl LeafHeader {
    /// Creates a header for `count` slots from `first` on. No visibilities are set yet.
    pub fn new(first: usize, count: usize) -> Self {
        Self {
            first: first as u32,
            count: count as u8,
            ..Self::default()
        }
    }

    /// Records the visibility of a lane.
    pub fn set_visibility(&mut self, lane: usize, visibility: Visibility) {
        let bit = 1 << lane;
        match visibility.occlusion {
            Occlusion::None => {}
            Occlusion::Opaque => self.opaque |= bit,
            Occlusion::Filtered => self.filtered |= bit,
        }
        match visibility.side {
            Side::Both => {}
            Side::Outside => self.outside |= bit,
            Side::Inside => self.inside |= bit,
            Side::Culled => self.culled |= bit,
        }
    }

    /// Returns the mask of the lanes that a ray can hit from outside only. `culls` is whether it is
    /// a camera ray.
    #[inline(always)]
    pub fn outside_only_lanes(&self, culls: bool) -> u8 {
        if culls {
            self.outside | self.culled
        } else {
            self.outside
        }
    }

    /// Whether a hit of a lane's primitive is accepted. `from_outside` is the side from which the
    /// ray comes, and `culls` whether it is a camera ray.
    #[inline(always)]
    pub fn accepts_hit(&self, lane: usize, from_outside: bool, culls: bool) -> bool {
        (if from_outside {
            self.inside
        } else {
            self.outside_only_lanes(culls)
        }) >> lane
            & 1
            == 0
    }
}
