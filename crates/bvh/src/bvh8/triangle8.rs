//! Triangles eight at a time, as the filter and the exact test read them: the only copy that a tree
//! keeps.

use glam::Vec3;

use super::WIDTH;
use crate::ray::{Occlusion, Side, Visibility};
use crate::shapes::Triangle;

/// From here on products of three lengths might leave the range of f32: lanes of such corners are
/// always tested exactly.
pub(super) const LARGE: f32 = (1_u64 << 38) as f32;

/// Up to eight triangles, one array a coordinate: `corners[axis][corner][lane]`, as they were
/// given.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(crate) struct Triangle8 {
    pub corners: [[[f32; WIDTH]; 3]; 3],
    /// No less than the longer one of the two edges at the first corner; −∞ in a lane that nothing
    /// can hit, which the filter then misses whatever else is in it, and ∞ where the filter must
    /// not decide.
    pub longest: [f32; WIDTH],
}

impl Triangle8 {
    pub const EMPTY: Self = Self {
        corners: [[[0.0; WIDTH]; 3]; 3],
        longest: [f32::NEG_INFINITY; WIDTH],
    };

    /// Puts a triangle into a lane.
    pub fn set(&mut self, lane: usize, vertices: [Vec3; 3]) {
        for (corner, place) in vertices.into_iter().enumerate() {
            for axis in 0..3 {
                self.corners[axis][corner][lane] = place[axis];
            }
        }
        let [a, b, c] = vertices.map(|p| p.as_dvec3());
        let longest = (b - a)
            .length_squared()
            .max((c - a).length_squared())
            .sqrt();
        let large = vertices.iter().any(|p| p.abs().max_element() >= LARGE);
        self.longest[lane] = match () {
            () if vertices[0] == vertices[1] && vertices[0] == vertices[2] => f32::NEG_INFINITY,
            () if large => f32::INFINITY,
            () => ((longest * 1.000_001) as f32).next_up(),
        };
    }

    /// The triangle in a lane.
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

/// What is known of a block's triangles besides where they are: read only where the filter leaves
/// something. Masks have a bit a lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LeafHeader {
    /// The slot of the first lane; the others follow.
    pub first: u32,
    /// How many lanes are in use.
    pub count: u8,
    /// Those that end an any-hit query.
    pub opaque: u8,
    /// Those about which it asks.
    pub asks: u8,
    /// Those hit from outside alone.
    pub outside: u8,
    /// Those hit from inside alone.
    pub inside: u8,
    /// Those hit from outside alone by rays that cull.
    pub culled: u8,
}

impl LeafHeader {
    /// Of so many slots from the first on.
    pub fn new(first: usize, count: usize) -> Self {
        Self {
            first: first as u32,
            count: count as u8,
            ..Self::default()
        }
    }

    /// Takes down how a lane takes part.
    pub fn set(&mut self, lane: usize, visibility: Visibility) {
        let bit = 1 << lane;
        match visibility.occlusion {
            Occlusion::None => {}
            Occlusion::Opaque => self.opaque |= bit,
            Occlusion::Ask => self.asks |= bit,
        }
        match visibility.side {
            Side::Both => {}
            Side::Outside => self.outside |= bit,
            Side::Inside => self.inside |= bit,
            Side::Culled => self.culled |= bit,
        }
    }

    /// Lanes that a ray which culls, or not, hits from outside alone.
    #[inline(always)]
    pub fn outside_alone(&self, culls: bool) -> u8 {
        if culls {
            self.outside | self.culled
        } else {
            self.outside
        }
    }

    /// Whether a lane's hit counts, from outside or not.
    #[inline(always)]
    pub fn accepts(&self, lane: usize, from_outside: bool, culls: bool) -> bool {
        (if from_outside {
            self.inside
        } else {
            self.outside_alone(culls)
        }) >> lane
            & 1
            == 0
    }
}
