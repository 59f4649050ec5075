//! Vertex positions that keep the digits of their file. They are stored as `f32`, relative to an
//! origin near the mesh.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Triple;
use crate::origin_grid::{MESH_DISTANCE_LIMIT, storage_origin_near};
use crate::validate::MAX_COORDINATE;
use raywright_bvh::Aabb;

/// Vertex positions of a mesh in its own space. Positions far from zero are stored relative to an
/// origin near the mesh. So they keep their digits in `f32`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(from = "Vec<Triple>", into = "Vec<Triple>")]
pub struct VertexPositions {
    origin: Triple,
    offsets: Vec<[f32; 3]>,
}

impl VertexPositions {
    /// Returns the number of vertices.
    pub fn len(&self) -> usize {
        self.offsets.len()
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.offsets.is_empty()
    }

    /// Returns the position of a vertex.
    ///
    /// # Panics
    /// If the vertex does not exist.
    pub fn position(&self, vertex: usize) -> DVec3 {
        self.origin() + DVec3::from(self.offsets[vertex].map(f64::from))
    }

    /// Iterates over the positions in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = DVec3> + '_ {
        (0..self.len()).map(|vertex| self.position(vertex))
    }

    /// Returns the origin to which offsets are relative; zero for a mesh near zero.
    pub fn origin(&self) -> DVec3 {
        self.origin.into()
    }

    /// Returns the offsets, which are the positions relative to the origin.
    pub fn offsets(&self) -> &[[f32; 3]] {
        &self.offsets
    }

    /// Returns the offsets for modification.
    pub fn offsets_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.offsets
    }

    /// Returns the positions of the given vertices, in their order and with the same origin.
    /// Vertices that do not exist are skipped.
    pub fn subset(&self, vertices: impl Iterator<Item = usize>) -> Self {
        Self {
            origin: self.origin,
            offsets: vertices
                .filter_map(|i| self.offsets.get(i).copied())
                .collect(),
        }
    }

    /// Creates an empty list with a given origin.
    pub fn with_origin(origin: DVec3) -> Self {
        Self {
            origin: origin.into(),
            offsets: Vec::new(),
        }
    }

    /// Appends offsets, which are positions relative to the origin.
    pub fn extend_offsets(&mut self, offsets: impl IntoIterator<Item = [f32; 3]>) {
        self.offsets.extend(offsets);
    }

    /// Stores points as offsets from an origin near them.
    fn from_points<P: Iterator<Item = DVec3>>(points: impl Fn() -> P) -> Self {
        let origin = choose_storage_origin(points());
        Self {
            origin: origin.into(),
            offsets: points()
                .map(|p| (p - origin).as_vec3().to_array())
                .collect(),
        }
    }
}

/// Returns an origin near the points. Relative to it, the points keep their digits in `f32`. The
/// origin is zero for points near zero. Points that are not finite or out of range are ignored.
pub fn choose_storage_origin(points: impl IntoIterator<Item = DVec3>) -> DVec3 {
    let usable = points
        .into_iter()
        .filter(|p| p.to_array().iter().all(|x| x.abs() <= MAX_COORDINATE));
    storage_origin_near(&Aabb::from_points(usable), MESH_DISTANCE_LIMIT)
}

impl From<Vec<Triple>> for VertexPositions {
    fn from(points: Vec<Triple>) -> Self {
        Self::from_points(|| points.iter().copied().map(DVec3::from))
    }
}

impl From<Vec<DVec3>> for VertexPositions {
    fn from(points: Vec<DVec3>) -> Self {
        Self::from_points(|| points.iter().copied())
    }
}

impl From<Vec<[f32; 3]>> for VertexPositions {
    /// Stores the numbers unchanged, with an origin of zero. `f32` input has no further digits to
    /// keep.
    fn from(offsets: Vec<[f32; 3]>) -> Self {
        Self {
            origin: [0.0; 3],
            offsets,
        }
    }
}

impl From<VertexPositions> for Vec<Triple> {
    fn from(positions: VertexPositions) -> Self {
        positions.iter().map(|p| p.to_array()).collect()
    }
}
