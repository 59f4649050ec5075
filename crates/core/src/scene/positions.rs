//! Vertex positions with the digits that files have: single precision about an origin of their own.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Triple;
use crate::nearby::{FAR_FROM_OWN, near};
use crate::validate::FARTHEST;
use raywright_bvh::Aabb;

/// The positions of a mesh's vertices in the mesh's own space. Those of a mesh far from zero are
/// stored about an origin near it, so that they have their digits at the cost of three numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(from = "Vec<Triple>", into = "Vec<Triple>")]
pub struct Positions {
    origin: Triple,
    offsets: Vec<[f32; 3]>,
}

impl Positions {
    /// How many.
    pub fn len(&self) -> usize {
        self.offsets.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.offsets.is_empty()
    }

    /// The position of a vertex.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn at(&self, vertex: usize) -> DVec3 {
        self.origin() + DVec3::from(self.offsets[vertex].map(f64::from))
    }

    /// Each position, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = DVec3> + '_ {
        (0..self.len()).map(|vertex| self.at(vertex))
    }

    /// What the offsets are counted from; zero for a mesh that is not far from zero.
    pub fn origin(&self) -> DVec3 {
        self.origin.into()
    }

    /// The positions less their origin.
    pub fn offsets(&self) -> &[[f32; 3]] {
        &self.offsets
    }

    /// The same, to be changed.
    pub fn offsets_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.offsets
    }

    /// Those of some vertices, about the same origin; of a vertex that does not exist none.
    pub fn select(&self, vertices: impl Iterator<Item = usize>) -> Self {
        Self {
            origin: self.origin,
            offsets: vertices
                .filter_map(|i| self.offsets.get(i).copied())
                .collect(),
        }
    }

    /// None yet, to be counted from an origin.
    pub fn about(origin: DVec3) -> Self {
        Self {
            origin: origin.into(),
            offsets: Vec::new(),
        }
    }

    /// Adds positions less their origin.
    pub fn extend(&mut self, offsets: impl IntoIterator<Item = [f32; 3]>) {
        self.offsets.extend(offsets);
    }

    /// Points as they are stored about an origin near them.
    fn of<P: Iterator<Item = DVec3>>(points: impl Fn() -> P) -> Self {
        let origin = origin_near(points());
        Self {
            origin: origin.into(),
            offsets: points()
                .map(|p| (p - origin).as_vec3().to_array())
                .collect(),
        }
    }
}

/// An origin near the points that are usable: zero where they are not far from it.
pub fn origin_near(points: impl IntoIterator<Item = DVec3>) -> DVec3 {
    let usable = points
        .into_iter()
        .filter(|p| p.to_array().iter().all(|x| x.abs() <= FARTHEST));
    near(&Aabb::from_points(usable), FAR_FROM_OWN)
}

impl From<Vec<Triple>> for Positions {
    fn from(points: Vec<Triple>) -> Self {
        Self::of(|| points.iter().copied().map(DVec3::from))
    }
}

impl From<Vec<DVec3>> for Positions {
    fn from(points: Vec<DVec3>) -> Self {
        Self::of(|| points.iter().copied())
    }
}

impl From<Vec<[f32; 3]>> for Positions {
    /// As they are: single precision has no digits to lose.
    fn from(offsets: Vec<[f32; 3]>) -> Self {
        Self {
            origin: [0.0; 3],
            offsets,
        }
    }
}

impl From<Positions> for Vec<Triple> {
    fn from(positions: Positions) -> Self {
        positions.iter().map(|p| p.to_array()).collect()
    }
}
