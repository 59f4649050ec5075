//! Shading frame of an interaction, for anisotropy and normal maps: its tangent follows the texture
//! coordinates. Frames are computed on demand, so that pictures without anisotropy and normal maps
//! do not pay for them.

use glam::DVec3;
use raywright_bvh::{Hit, Real, Vector};

use super::PathSegment;
use crate::interaction::Interaction;
use crate::material::ShadingFrame;
use crate::prepare::{ObjectMesh, PreparedScene};
use crate::scene::MeshData;

impl<R: Real> Interaction<R> {
    /// Returns the shading frame. Its normal is the shading normal. Its tangent is the mesh's
    /// tangent, or the direction of growing u for objects without tangents. The bitangent points to
    /// the top of the texture image, so the frame is left-handed where the image appears mirrored:
    /// from behind, or under a mirroring transform.
    pub fn shading_frame(
        &self,
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) -> ShadingFrame<R> {
        let (along, mirrored) = self.tangent_direction(scene, segment, hit);
        ShadingFrame::from_tangent(self.normal, along, mirrored)
    }

    /// Returns the unit tangent in world space, not yet perpendicular to the shading normal, and
    /// whether the frame is left-handed.
    #[inline(always)]
    pub fn tangent_direction(
        &self,
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) -> (R::Vec3, bool) {
        let (along, mirrored) = match &scene.objects[self.object as usize].mesh {
            Some(mesh) => {
                let (own, area) = scene.mesh_tangent(mesh, hit);
                tangent_to_world(mesh.normal_transform_at(scene, segment, hit), own, area)
            }
            None => {
                let parameters = scene.geometry.texture_coordinates(&segment.ray, hit);
                (parameters.dpdu.to_f64(), parameters.mirrored)
            }
        };
        let from_behind = self.normal.dot(self.surface.normal) < R::ZERO;
        (
            R::Vec3::from_f64(along.normalize_or_zero()),
            mirrored != from_behind,
        )
    }
}

impl<R: Real> ObjectMesh<R> {
    /// Returns the columns of the 3 × 3 matrix that maps the mesh's normals to world space, at a
    /// hit.
    pub(super) fn normal_transform_at(
        &self,
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) -> [DVec3; 3] {
        let turned = |axis: DVec3| {
            scene
                .geometry
                .normal_to_world(&segment.ray, hit, R::Vec3::from_f64(axis))
                .to_f64()
        };
        if self.rotates {
            [DVec3::X, DVec3::Y, DVec3::Z].map(turned)
        } else {
            self.normals.map(Vector::to_f64)
        }
    }
}

impl<R: Real> PreparedScene<R> {
    /// Returns the tangent at a hit in the mesh's own space, not normalised, and whether a texture
    /// image appears mirrored at the hit when seen from outside.
    fn mesh_tangent(&self, mesh: &ObjectMesh<R>, hit: &Hit<R>) -> (DVec3, bool) {
        let data = &self.meshes[mesh.mesh as usize];
        let corners = data.indices[hit.primitive as usize].map(|i| i as usize);
        let tangents = match mesh.tangents {
            Some(table) => self.tangents[table as usize][hit.primitive as usize],
            None if !data.tangents.is_empty() => corners.map(|i| data.tangents[i]),
            None => return tangent_along_u(data, corners),
        };
        let (u, v) = if mesh.flipped {
            (hit.v, hit.u)
        } else {
            (hit.u, hit.v)
        };
        let weights = [R::ONE - u - v, u, v].map(Real::to_f64);
        let at = |k: usize| {
            (0..3)
                .map(|i| weights[i] * f64::from(tangents[i][k]))
                .sum::<f64>()
        };
        (DVec3::new(at(0), at(1), at(2)), at(3) < 0.0)
    }
}

/// Returns the direction of growing u on a triangle of a mesh, not normalised, and whether a
/// texture image appears mirrored on the triangle. In a mesh without texture coordinates, u is the
/// barycentric coordinate of the second corner, as in [`Interaction`].
fn tangent_along_u(data: &MeshData, corners: [usize; 3]) -> (DVec3, bool) {
    let [a, b, c] = corners.map(|i| data.positions.position(i));
    let set = data.uvs.first().filter(|set| !set.is_empty());
    let [p, q, r] = set.map_or([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], |set| {
        corners.map(|i| set[i].map(f64::from))
    });
    let ([u1, v1], [u2, v2]) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
    let area = u1 * v2 - u2 * v1;
    if area == 0.0 {
        return (DVec3::ZERO, false);
    }
    // dp/du, up to a positive factor.
    (((b - a) * v2 - (c - a) * v1) * area.signum(), area > 0.0)
}

/// Transforms a tangent and its mirroring flag from a mesh's own space to world space. The first
/// argument holds the columns of the matrix that maps the mesh's normals to world space.
fn tangent_to_world([x, y, z]: [DVec3; 3], own: DVec3, mirrored: bool) -> (DVec3, bool) {
    // The linear part of the mesh's map is the inverse transpose of the map of normals, so its
    // columns are the cofactors of that map, up to the determinant.
    let mapped = y.cross(z) * own.x + z.cross(x) * own.y + x.cross(y) * own.z;
    let mirrors = x.dot(y.cross(z)) < 0.0;
    (if mirrors { -mapped } else { mapped }, mirrored != mirrors)
}

#[cfg(test)]
mod tests;
