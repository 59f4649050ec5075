//! Blocks of eight triangles, for the filter and the exact test. They hold the tree's only copy of
//! its triangles.

use glam::Vec3;

use super::WIDTH;
use crate::ray::{Occlusion, Side, Visibility};
use crate::shapes::Triangle;

/// Coordinate from which products of three lengths might leave the range of f32. Triangles with
/// such corners always get the exact test.
pub(super) const LARGE_COORDINATE: f32 = (1_u64 << 38) as f32;

/// A block of up to eight triangles, with one array per coordinate: `corners[axis][corner][lane]`,
/// unchanged from the input.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(crate) struct Triangle8 {
    pub corners: [[[f32; WIDTH]; 3]; 3],
    /// Upper bound of the longer of the two edges at the first corner, in each lane. It is −∞ in a
    /// lane that can't be hit, which the filter then always rejects, and ∞ if the filter must not
    /// decide.
    pub longest: [f32; WIDTH],
}

impl Triangle8 {
    pub const EMPTY: Self = Self {
        corners: [[[0.0; WIDTH]; 3]; 3],
        longest: [f32::NEG_INFINITY; WIDTH],
    };

    /// Stores a triangle in a lane. A triangle without extent can't be hit.
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

/// Properties of the primitives of a block or a row besides their coordinates, read only if a lane
/// may be hit. Masks have one bit per lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LeafHeader {
    /// Index of the slot (the record in the primitive set) of the first lane's primitive; the slots
    /// of the other lanes follow.
    pub first: u32,
    /// Number of lanes in use.
    pub count: u8,
    /// Mask of the lanes whose hits end an any-hit query.
    pub opaque: u8,
    /// Mask of the lanes for whose hits an any-hit query calls the filter.
    pub filtered: u8,
    /// Mask of the lanes that rays can hit from outside only.
    pub outside: u8,
    /// Mask of the lanes that rays can hit from inside only.
    pub inside: u8,
    /// Mask of the lanes that camera rays can hit from outside only, other rays from both sides.
    pub culled: u8,
}

impl LeafHeader {
    /// Creates a header for `count` slots from `first` on, without visibilities.
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

    /// Mask of the lanes that a camera ray (`culls`) or any other ray can hit from outside only.
    #[inline(always)]
    pub fn outside_only_lanes(&self, culls: bool) -> u8 {
        if culls {
            self.outside | self.culled
        } else {
            self.outside
        }
    }

    /// Whether a hit of a lane counts, given the side from which the ray comes.
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
