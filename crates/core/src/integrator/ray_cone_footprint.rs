//! Texture footprint of a ray: the width of the ray cone on a surface, in texture coordinates. Used
//! only for textures with mip maps.
//!
//! The width of a ray cone depends on the length of its path alone. The spread by rough and curved
//! surfaces is ignored: samples average it. Too coarse a mip level would mix neighbouring parts of
//! an atlas, while too fine a level only costs noise.

use raywright_bvh::{Hit, Real, Vector};

use super::PathSegment;
use crate::camera::RayCone;
use crate::interaction::Interaction;
use crate::prepare::PreparedScene;

impl<R: Real> Interaction<R> {
    /// Computes the footprint for each set of texture coordinates that the material reads
    /// (Akenine-Möller et al., "Texture Level of Detail Strategies for Real-Time Ray Tracing",
    /// 2019).
    ///
    /// The ratio of texture coordinates to world lengths is, for a mesh, the square root of the
    /// ratio of the triangle's areas in both spaces; for other shapes it is 1 / |dp/du|. On a
    /// slanted surface the footprint is a square with the longer side of the cone's ellipse.
    #[inline(never)]
    pub(super) fn compute_footprints(
        &mut self,
        scene: &PreparedScene<R>,
        cone: &RayCone<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) {
        let record = &scene.objects[self.object as usize];
        if !record.needs_uv && record.mesh.as_ref().is_none_or(|mesh| mesh.uv_sets == 0) {
            return;
        }
        let width = (cone.width + cone.spread * (segment.length_before + self.distance)).to_f64();
        let spot = width / self.direction.dot(self.surface.normal).to_f64().abs();
        let Some(mesh) = &record.mesh else {
            let along = scene
                .geometry
                .texture_coordinates(&segment.ray, hit)
                .dpdu
                .to_f64()
                .length();
            self.footprint.fill(R::from_f64(spot / along));
            return;
        };
        let data = &scene.meshes[mesh.mesh as usize];
        let corners = data.indices[hit.primitive as usize].map(|i| i as usize);
        let [a, b, c] = corners.map(|i| data.positions.position(i));
        let (own, [x, y, z]) = (
            (b - a).cross(c - a),
            mesh.normal_transform_at(scene, segment, hit),
        );
        // The area vector in the world: it transforms by the cofactors of the mesh's map, which are
        // the columns of the normals' map times the determinant of the mesh's map.
        let area = ((x * own.x + y * own.y + z * own.z) / x.dot(y.cross(z))).length();
        for set in (0..self.footprint.len()).filter(|set| mesh.uv_sets >> set & 1 != 0) {
            let own = match data.uvs.get(set).filter(|uvs| !uvs.is_empty()) {
                Some(uvs) => {
                    let [p, q, r] = corners.map(|i| uvs[i].map(f64::from));
                    ((q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1])).abs()
                }
                // A missing first set is replaced by barycentric coordinates.
                None => 1.0,
            };
            self.footprint[set] = R::from_f64(spot * (own / area).sqrt());
        }
    }
}
