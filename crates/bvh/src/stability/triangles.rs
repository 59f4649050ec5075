//! Cases P20, P21 and P22: rays nearly in the plane of a thin triangle, and closed meshes that must
//! not leak at edges and corners.

use crate::shapes::Triangle;
use crate::{
    AcceleratorKind, Geometry, Interval, PreparedRay, PrimitiveSet, Ray, Real, Shape, Vector,
    Visibility,
};
use glam::{DVec3, Vec3};

use super::verdicts::{
    CaseOutcome, RayCount, Verdict, create_ray_towards, create_unnormalised_ray, format_ray_bits,
    judge_rays, nearest_hit, round_to_f32, to_scalar, ulp,
};
use super::{Measurement, create_treeless_measurement};

/// A closed mesh of corners and triangles.
#[derive(Clone, Debug)]
pub struct ClosedMesh {
    /// Positions of corners.
    pub corners: Vec<Vec3>,
    /// Indices of the three corners of each triangle, counter-clockwise as seen from outside.
    pub faces: Vec<[usize; 3]>,
}

/// Creates an icosahedron on the unit sphere, with each face subdivided into four, `levels` times.
pub fn create_icosphere(levels: u32) -> ClosedMesh {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut corners: Vec<DVec3> = vec![];
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        corners.extend([
            DVec3::new(a, b, 0.0),
            DVec3::new(0.0, a, b),
            DVec3::new(b, 0.0, a),
        ]);
    }
    let mut faces = vec![];
    for i in 0..12 {
        for j in 0..12 {
            for k in 0..12 {
                let edge =
                    |a: usize, b: usize| (corners[a].distance(corners[b]) - 2.0).abs() < 1e-9;
                let out = (corners[j] - corners[i])
                    .cross(corners[k] - corners[i])
                    .dot(corners[i])
                    > 0.0;
                if i < j && i < k && edge(i, j) && edge(j, k) && edge(k, i) && out {
                    faces.push([i, j, k]);
                }
            }
        }
    }
    let mut corners: Vec<DVec3> = corners.into_iter().map(DVec3::normalize).collect();
    for _ in 0..levels {
        let mut middles = std::collections::BTreeMap::new();
        let mut finer = vec![];
        for [a, b, c] in faces {
            let mut middle = |i: usize, j: usize| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    corners.push((corners[i] + corners[j]).normalize());
                    corners.len() - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        faces = finer;
    }
    ClosedMesh {
        corners: corners.into_iter().map(DVec3::as_vec3).collect(),
        faces,
    }
}

/// Creates the cube [−1, 1]³ with `n` × `n` cells per face, each of two triangles. At a common edge
/// of two faces, the corners of both have the same bits.
pub fn create_cube_mesh(n: usize) -> ClosedMesh {
    let mut mesh = ClosedMesh {
        corners: vec![],
        faces: vec![],
    };
    for axis in 0..3 {
        for side in [-1.0_f32, 1.0] {
            let first = mesh.corners.len();
            for i in 0..=n {
                for j in 0..=n {
                    let at = |k: usize| k as f32 / n as f32 * 2.0 - 1.0;
                    let mut p = Vec3::ZERO;
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, at(i), at(j));
                    mesh.corners.push(p);
                }
            }
            for i in 0..n {
                for j in 0..n {
                    let at = |a: usize, b: usize| first + (i + a) * (n + 1) + j + b;
                    let (p, q, r, s) = (at(0, 0), at(1, 0), at(1, 1), at(0, 1));
                    let two = if side > 0.0 {
                        [[p, q, r], [p, r, s]]
                    } else {
                        [[p, r, q], [p, s, r]]
                    };
                    mesh.faces.extend(two);
                }
            }
        }
    }
    mesh
}

impl ClosedMesh {
    /// Returns the triangles of the mesh.
    pub fn triangles<R: Real>(&self) -> Vec<Triangle<R>> {
        let corners = |face: &[usize; 3]| face.map(|i| to_scalar::<R>(self.corners[i].as_dvec3()));
        self.faces
            .iter()
            .map(|face| Triangle::new(corners(face)))
            .collect()
    }

    /// Flips the orientation of each face whose index is a multiple of `every`.
    #[must_use]
    pub fn flip_every_nth_face(mut self, every: usize) -> Self {
        for face in self.faces.iter_mut().step_by(every) {
            face.swap(1, 2);
        }
        self
    }

    /// Builds a geometry with a tree over the triangles of the mesh.
    pub fn build_tree<R: Real>(&self) -> Geometry<R> {
        let mut group = PrimitiveSet::<R>::default();
        for triangle in self.triangles() {
            group
                .add_shape(triangle.into(), Visibility::default())
                .expect("finite corners");
        }
        Geometry::new(group, AcceleratorKind::default())
    }
}

/// Points of a closed mesh at which the rays of a test case are aimed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayTarget {
    /// A corner of the mesh.
    Corner,
    /// A point on an edge of the mesh.
    Edge,
    /// A corner or an edge, by rays from the exact centre of the mesh.
    FromCentre,
    /// A random direction.
    Anywhere,
}

/// Judges rays from inside a closed mesh. Each ray must hit the mesh. `hits` is the tested
/// function: it returns whether a ray hits the mesh.
pub fn judge_mesh_leaks<R: Real>(
    name: &str,
    mesh: &ClosedMesh,
    ray_target: RayTarget,
    count: u32,
    rays: RayCount,
    hits: impl Fn(&Ray<R>) -> bool + Sync,
) -> CaseOutcome {
    judge_rays(
        &format!("P21 {name} {ray_target:?}"),
        60 + ray_target as u64,
        count,
        rays,
        |rng| {
            let face = mesh.faces[(rng.next_bits() % mesh.faces.len() as u64) as usize];
            let corner = |i: usize| mesh.corners[face[i]].as_dvec3();
            let along = rng.next_in_unit_interval();
            let target = match ray_target {
                RayTarget::Corner => corner(0),
                RayTarget::Edge => corner(0) + (corner(1) - corner(0)) * along,
                RayTarget::FromCentre if rng.next_sign() > 0.0 => corner(0),
                RayTarget::FromCentre => corner(0) + (corner(1) - corner(0)) * along,
                RayTarget::Anywhere => rng.sample_direction() * 2.0,
            };
            let origin = if ray_target == RayTarget::FromCentre {
                DVec3::ZERO
            } else {
                round_to_f32(rng.sample_direction() * (0.9 * rng.next_in_unit_interval()))
            };
            // From the centre the unnormalised direction *is* the corner, so the ray passes exactly
            // through it.
            let ray = if ray_target == RayTarget::FromCentre {
                create_unnormalised_ray::<R>(origin, target)
            } else {
                create_ray_towards::<R>(origin, target)
            };
            Verdict::from_condition(hits(&ray), || {
                format!(
                    "the ray leaves the closed mesh without a hit{}",
                    format_ray_bits::<R>(&ray)
                )
            })
        },
    )
}

/// Judges rays from inside a closed mesh, with the library's tree over the mesh. Each ray must hit
/// the mesh.
pub fn judge_mesh_leaks_of_tree<R: Real>(
    name: &str,
    mesh: &ClosedMesh,
    ray_target: RayTarget,
    count: u32,
    rays: RayCount,
) -> CaseOutcome {
    let geometry = mesh.build_tree::<R>();
    judge_mesh_leaks(name, mesh, ray_target, count, rays, |ray| {
        geometry
            .closest(ray, Interval::positive(), &mut ())
            .is_some()
    })
}

/// Measures case P20: rays nearly in the plane of a thin distant triangle. If such a ray hits, the
/// hit point must lie in the triangle's box.
pub(crate) fn measure_nearly_parallel_rays<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let outcome = judge_rays("P20", 52, 600_000, rays, |rng| {
        let x = rng.sample_direction();
        let y = rng.sample_offset_in_disc(x, 1.0).normalize();
        let point = rng.sample_direction() * 600.0;
        // A needle with a bounding box of 11.2 × 9.7 × 1.4, or a needle of about that length and
        // height in a random orientation.
        let diagonal = DVec3::new(11.2, 9.7, 1.4);
        let corners = if rng.next_sign() > 0.0 {
            [
                point,
                point + diagonal,
                point
                    + diagonal * rng.next_uniform(0.6, 0.9)
                    + rng.sample_point_in_cube() * DVec3::new(0.0, 0.5, 0.1),
            ]
            .map(round_to_f32)
        } else {
            [point, point + x * 11.2, point + x * 9.65 + y * 0.98].map(round_to_f32)
        };
        let (x, y) = {
            let x = (corners[1] - corners[0]).normalize();
            let normal = x.cross(corners[2] - corners[0]).normalize();
            (x, normal.cross(x))
        };
        let angle = rng.choose(&[0.5_f64, 0.01, 1e-4]).to_radians();
        let normal = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .normalize();
        let weights = (rng.next_in_unit_interval(), rng.next_in_unit_interval());
        let target = corners[0]
            + (corners[1] - corners[0]) * weights.0
            + (corners[2] - corners[0]) * (weights.1 * (1.0 - weights.0));
        let away = x * rng.next_uniform(-1.0, 1.0) + y * rng.next_uniform(-1.0, 1.0);
        let origin = target + (away.normalize() + normal * angle) * 600.0;
        let ray = create_ray_towards::<R>(origin, target + rng.sample_point_in_cube() * 1e-3);
        let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
        let shape = Triangle::new(corners.map(to_scalar::<R>));
        let Some(h) = nearest_hit::<R>(&shape, &ray) else {
            return Verdict::Skipped;
        };
        let (low, high) = (
            corners[0].min(corners[1]).min(corners[2]),
            corners[0].max(corners[1]).max(corners[2]),
        );
        let on_ray = o + d * h.t.to_f64();
        let on_plane = shape.surface(&PreparedRay::new(ray), h).point.to_f64();
        let scale = low.abs().max(high.abs()).max(o.abs()).max_element();
        let over = |p: DVec3| (low - p).max(p - high).max_element();
        Verdict::from_error(over(on_ray), 16.0 * ulp(scale), || {
            format!("distance of the ray's point at the hit from the bounding box of the triangle{} {shape:?}", format_ray_bits(&ray))
        })
        .and_then(|| {
            Verdict::from_error(over(on_plane), 16.0 * ulp(scale), || {
                format!("distance of the surface point from the bounding box of the triangle{} {shape:?}", format_ray_bits(&ray))
            })
        })
    });
    vec![create_treeless_measurement::<R>(outcome)]
}
