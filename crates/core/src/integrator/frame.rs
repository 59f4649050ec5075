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
mod tests {
    use super::*;
    use crate::effects::EffectSet;
    use crate::scene::Scene;
    use crate::settings::Settings;
    use raywright_bvh::{Interval, Ray};
    use serde_json::{Value, json};

    /// Tangent, bitangent and normal where a ray hits an object.
    fn frame<R: Real>(object: &Value, data: &Value, [origin, direction]: [DVec3; 2]) -> [DVec3; 3] {
        let scene: Scene = serde_json::from_value(json!({
            "format": 1, "materials": [{ "name": "paint", "model": { "physical": {} } }], "objects": [object],
            "meshes": [{ "name": "leaf", "source": { "inline": data } }],
        }))
        .expect("a scene");
        let settings = Settings {
            size: [1, 1],
            ..Settings::from_scene(&scene)
        };
        let prepared = PreparedScene::<R>::new(&scene, &settings, EffectSet::ALL, &())
            .expect("it can be prepared");
        let [origin, direction] = [origin, direction.normalize()].map(R::Vec3::from_f64);
        let segment = PathSegment::from_ray(Ray::new(origin, direction));
        let hit = prepared
            .geometry
            .closest(&segment.ray, Interval::positive(), &mut ())
            .expect("a hit");
        let interaction = Interaction::from_hit(&prepared, &segment, &hit);
        let frame = interaction.shading_frame(&prepared, &segment, &hit);
        [frame.tangent, frame.bitangent, frame.normal].map(Vector::to_f64)
    }

    /// Asserts the frame in every precision, and that its directions are orthonormal.
    #[track_caller]
    fn expect_frame(
        object: Value,
        data: &Value,
        ray: [DVec3; 2],
        tangent: DVec3,
        bitangent: DVec3,
    ) {
        let found = [frame::<f32>, frame::<f64>].map(|frame| frame(&object, data, ray));
        for (found, tolerance) in found.into_iter().zip([1e-5, 1e-9]) {
            let [t, b, n] = found;
            assert!(
                t.distance(tangent.normalize()) < tolerance,
                "{object}: tangent {t:?}, not {:?}",
                tangent.normalize()
            );
            assert!(
                b.distance(bitangent.normalize()) < tolerance,
                "{object}: bitangent {b:?}, not {:?}",
                bitangent.normalize()
            );
            for (one, other) in [(t, b), (b, n), (n, t)] {
                assert!(
                    (one.length() - 1.0).abs() < tolerance && one.dot(other).abs() < tolerance,
                    "{object}: {found:?}"
                );
            }
        }
    }

    /// A triangle in the plane z = 0, facing +z, with optional texture coordinates.
    fn leaf(uvs: Option<Value>) -> Value {
        let mut data =
            json!({ "positions": [[0, 0, 0], [3, 0, 0], [0, 3, 0]], "indices": [[0, 1, 2]] });
        if let Some(uvs) = uvs {
            data["uvs"] = json!([uvs]);
        }
        data
    }

    const ONTO: [DVec3; 2] = [DVec3::new(0.5, 0.5, 4.0), DVec3::NEG_Z];
    const MIRRORED: [f64; 3] = [-1.0, 1.0, 1.0];

    /// Protects: on a sphere the tangent is east and the bitangent north, from inside mirrored; on
    /// a floor x and −z; stretched, rotated and mirrored by transforms.
    #[test]
    fn frames_of_shapes() {
        let shape = |shape: Value, steps: Value| json!({ "shape": shape, "material": "paint", "transform": steps });
        let ball = |steps| {
            shape(
                json!({ "sphere": { "centre": [0, 0, 0], "radius": 1 } }),
                steps,
            )
        };
        let none = leaf(None);
        let n = DVec3::new(0.48, 0.6, 0.64);
        let (east, north) = (
            DVec3::new(n.z, 0.0, -n.x),
            DVec3::new(-n.x * n.y, n.x * n.x + n.z * n.z, -n.z * n.y),
        );
        expect_frame(ball(json!([])), &none, [n * 3.0, -n], east, north);
        expect_frame(ball(json!([])), &none, [DVec3::ZERO, n], east, north);
        expect_frame(
            ball(json!([{ "rotate": { "axis": [0, 1, 0], "degrees": 90 } }])),
            &none,
            [n * 3.0, -n],
            east,
            north,
        );
        expect_frame(
            ball(json!([{ "scale": MIRRORED }])),
            &none,
            [n * 3.0, -n],
            -east,
            north,
        );
        // Stretched along x by 2: the point is scaled, and the normal is n/(2, 1, 1), which leans.
        let stretched = ball(json!([{ "scale": [2, 1, 1] }]));
        let (point, normal) = (n * DVec3::new(2.0, 1.0, 1.0), n * DVec3::new(0.5, 1.0, 1.0));
        let along = east * DVec3::new(2.0, 1.0, 1.0);
        expect_frame(
            stretched,
            &none,
            [point + normal, -normal],
            along,
            normal.cross(along),
        );
        let floor = |steps| {
            shape(
                json!({ "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }),
                steps,
            )
        };
        let down = [DVec3::new(0.5, 2.0, 0.25), DVec3::NEG_Y];
        expect_frame(floor(json!([])), &none, down, DVec3::X, DVec3::NEG_Z);
        expect_frame(
            floor(json!([{ "scale": MIRRORED }])),
            &none,
            down,
            DVec3::NEG_X,
            DVec3::NEG_Z,
        );
        expect_frame(
            floor(json!([])),
            &none,
            [-down[0], DVec3::Y],
            DVec3::X,
            DVec3::NEG_Z,
        );
    }

    /// Protects: on a mesh the tangent follows u of its own coordinates and the bitangent −v, for
    /// any order of corners, transform and side; without coordinates they follow the barycentric
    /// coordinates.
    #[test]
    fn frames_of_meshes() {
        let shown = |steps: Value| json!({ "shape": { "mesh": "leaf" }, "material": "paint", "transform": steps });
        let plain = || shown(json!([]));
        // u = x/3, v = 1 − y/3: an image upright and unmirrored.
        let upright = || leaf(Some(json!([[0, 1], [1, 1], [0, 0]])));
        expect_frame(plain(), &upright(), ONTO, DVec3::X, DVec3::Y);
        expect_frame(
            plain(),
            &upright(),
            [-ONTO[0] + DVec3::new(1.0, 1.0, 0.0), DVec3::Z],
            DVec3::X,
            DVec3::Y,
        );
        // u = 1 − x/3: mirrored.
        expect_frame(
            plain(),
            &leaf(Some(json!([[1, 1], [0, 1], [1, 0]]))),
            ONTO,
            DVec3::NEG_X,
            DVec3::Y,
        );
        // u = (x + y)/3, v = y/3: dp/dv, along (−1, 1), is not perpendicular to dp/du, but the
        // bitangent is perpendicular to the tangent.
        expect_frame(
            plain(),
            &leaf(Some(json!([[0, 0], [1, 0], [1, 1]]))),
            ONTO,
            DVec3::X,
            DVec3::NEG_Y,
        );
        expect_frame(plain(), &leaf(None), ONTO, DVec3::X, DVec3::NEG_Y);
        // Mirrored in x: the triangle is reversed, so that it still faces +z.
        let over = [ONTO[0] * DVec3::new(-1.0, 1.0, 1.0), ONTO[1]];
        expect_frame(
            shown(json!([{ "scale": MIRRORED }])),
            &upright(),
            over,
            DVec3::NEG_X,
            DVec3::Y,
        );
        expect_frame(
            shown(json!([{ "scale": MIRRORED }])),
            &leaf(None),
            over,
            DVec3::NEG_X,
            DVec3::NEG_Y,
        );
        // Sheared along y by x: x goes to (1, 1, 0); normals stay.
        let sheared = json!([{ "matrix": [[1, 0, 0, 0], [1, 1, 0, 0], [0, 0, 1, 0]] }]);
        let [t, b] = [DVec3::new(1.0, 1.0, 0.0), DVec3::new(-1.0, 1.0, 0.0)];
        expect_frame(
            shown(sheared),
            &upright(),
            [ONTO[0] + DVec3::Y * 0.5, ONTO[1]],
            t,
            b,
        );
        // Coordinates without an area define no tangent: any frame is right.
        let [t, b, n] = frame::<f32>(&plain(), &leaf(Some(json!([[0, 0], [1, 1], [2, 2]]))), ONTO);
        assert!(
            t.cross(b).distance(n) < 1e-6 && t.dot(n).abs() < 1e-6,
            "{t:?} {b:?} {n:?}"
        );
    }

    /// Protects: the tangent is perpendicular to the shading normal, which may lean from the
    /// geometric one: here by 37° along x.
    #[test]
    fn frames_follow_the_shading_normal() {
        let mut data = leaf(Some(json!([[0, 1], [1, 1], [0, 0]])));
        data["normals"] = json!([[3, 0, 4], [3, 0, 4], [3, 0, 4]]);
        let object = json!({ "shape": { "mesh": "leaf" }, "material": "paint" });
        expect_frame(object, &data, ONTO, DVec3::new(4.0, 0.0, -3.0), DVec3::Y);
    }

    /// Protects: the tangent of an instance that changes during the exposure belongs to the ray's
    /// time.
    #[test]
    fn frames_of_what_moves() {
        let matrix =
            |lean: f64| json!([{ "matrix": [[1, 0, 0, 0], [lean, 1, 0, 0], [0, 0, 1, 0]] }]);
        let scene: Scene = serde_json::from_value(json!({
            "format": 1, "materials": [{ "name": "paint", "model": { "physical": {} } }],
            "objects": [{ "shape": { "mesh": "leaf" }, "material": "paint", "transform": matrix(0.0), "transform_end": matrix(2.0) }],
            "meshes": [{ "name": "leaf", "source": { "inline": leaf(Some(json!([[0, 1], [1, 1], [0, 0]]))) } }],
        }))
        .expect("a scene");
        let settings = Settings {
            size: [1, 1],
            ..Settings::from_scene(&scene)
        };
        let prepared = PreparedScene::<f32>::new(&scene, &settings, EffectSet::ALL, &())
            .expect("it can be prepared");
        for (time, tangent) in [
            (0.0, DVec3::X),
            (0.5, DVec3::new(1.0, 1.0, 0.0)),
            (1.0, DVec3::new(1.0, 2.0, 0.0)),
        ] {
            let segment = PathSegment::from_ray(
                Ray::new(glam::Vec3::new(0.5, 0.5 + time, 4.0), glam::Vec3::NEG_Z).with_time(time),
            );
            let hit = prepared
                .geometry
                .closest(&segment.ray, Interval::positive(), &mut ())
                .expect("a hit");
            let frame = Interaction::from_hit(&prepared, &segment, &hit)
                .shading_frame(&prepared, &segment, &hit);
            let [t, b] = [frame.tangent, frame.bitangent].map(|v| v.as_dvec3());
            let (tangent, across) = (tangent.normalize(), DVec3::Z.cross(tangent).normalize());
            assert!(
                t.distance(tangent) < 1e-6 && b.distance(across) < 1e-6,
                "at {time}: {t:?} {b:?}"
            );
        }
    }

    /// Protects: the tangent of a mirrored instance of a shared mesh.
    #[test]
    fn frames_of_mirrored_instances() {
        let shown = |steps: Value| json!({ "shape": { "mesh": "leaf" }, "material": "paint", "transform": steps });
        let upright = leaf(Some(json!([[0, 1], [1, 1], [0, 0]])));
        let scene: Scene = serde_json::from_value(json!({
            "format": 1, "materials": [{ "name": "paint", "model": { "physical": {} } }],
            "objects": [shown(json!([])), shown(json!([{ "scale": MIRRORED }, { "translate": [-1, 0, 0] }]))],
            "meshes": [{ "name": "leaf", "source": { "inline": upright } }],
        }))
        .expect("a scene");
        let settings = Settings {
            size: [1, 1],
            ..Settings::from_scene(&scene)
        };
        let prepared = PreparedScene::<f32>::new(&scene, &settings, EffectSet::ALL, &())
            .expect("it can be prepared");
        assert_eq!(prepared.geometry.instance_count(), 2);
        for (x, tangent) in [(0.5, DVec3::X), (-1.5, DVec3::NEG_X)] {
            let segment =
                PathSegment::from_ray(Ray::new(glam::Vec3::new(x, 0.5, 4.0), glam::Vec3::NEG_Z));
            let hit = prepared
                .geometry
                .closest(&segment.ray, Interval::positive(), &mut ())
                .expect("a hit");
            let frame = Interaction::from_hit(&prepared, &segment, &hit)
                .shading_frame(&prepared, &segment, &hit);
            let [t, b] = [frame.tangent, frame.bitangent].map(|v| v.as_dvec3());
            assert!(
                t.distance(tangent) < 1e-6 && b.distance(DVec3::Y) < 1e-6,
                "at {x}: {t:?} {b:?}"
            );
        }
    }
}
