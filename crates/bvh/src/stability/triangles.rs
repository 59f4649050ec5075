//! Cases P20, P21 and P22: rays nearly in the plane of a thin triangle, and closed meshes that must
//! not leak at edges and corners.

use std::collections::BTreeMap;

use super::prelude::*;
use super::textbook;

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
        let mut middles = BTreeMap::new();
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
    pub fn triangles<R: Real>(&self) -> Vec<AnyShape<R>> {
        let corner = |i: usize| to_scalar::<R>(self.corners[i].as_dvec3());
        let faces = self.faces.iter();
        faces
            .map(|face| Triangle::new(face.map(corner)).into())
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

    /// Draws a ray from a ball inside the mesh, of which centre and radius are given, towards a
    /// target of a random face. Returns the index of the face, and the ray.
    pub fn draw_inner_ray<R: Real>(
        &self,
        rng: &mut CaseRng,
        (centre, radius): (DVec3, f64),
        target: RayTarget,
    ) -> (usize, Ray<R>) {
        let face = (rng.next_bits() % self.faces.len() as u64) as usize;
        let [a, b, c] = self.faces[face].map(|i| self.corners[i].as_dvec3());
        let [u, v, depth] = [(); 3].map(|()| rng.next_in_unit_interval());
        let edge = a + (b - a) * u;
        let point = match target {
            RayTarget::Corner => a,
            RayTarget::Edge => edge,
            RayTarget::FromCentre => rng.choose(&[a, edge]),
            RayTarget::Anywhere => edge + (c - a) * (v * (1.0 - u)),
        };
        // From the centre the unnormalised direction *is* the target, so the ray passes exactly
        // through a corner.
        let ray = if target == RayTarget::FromCentre {
            create_unnormalised_ray(centre, point - centre)
        } else {
            create_ray_towards(centre + rng.sample_direction() * (radius * depth), point)
        };
        (face, ray)
    }

    /// Returns the triangles at each corner, by the bits of its position.
    fn fans<R: Real>(&self) -> BTreeMap<[u32; 3], Vec<AnyShape<R>>> {
        let mut fans = BTreeMap::<_, Vec<_>>::new();
        for (face, triangle) in self.faces.iter().zip(self.triangles()) {
            for bits in self.corner_bits(face) {
                fans.entry(bits).or_default().push(triangle);
            }
        }
        fans
    }

    fn corner_bits(&self, face: &[usize; 3]) -> [[u32; 3]; 3] {
        face.map(|i| self.corners[i].to_array().map(f32::to_bits))
    }
}

/// Point of a random face of a mesh at which a ray is aimed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayTarget {
    /// A corner.
    Corner,
    /// A point on an edge.
    Edge,
    /// A corner or a point on an edge, by rays from the exact centre of the mesh.
    FromCentre,
    /// Any point.
    Anywhere,
}

impl RayTarget {
    /// All targets.
    pub const ALL: [Self; 4] = [Self::Corner, Self::Edge, Self::FromCentre, Self::Anywhere];
}

/// Judges rays from inside closed meshes, traversed by the fastest kernel. Each ray must hit.
fn judge_leaks<R: Real>(trial: &mut Trial<R>, meshes: &[ClosedMesh], has_textbook: bool) {
    let scenes: Vec<_> = meshes.iter().map(ClosedMesh::triangles).collect();
    let kernels = Kernel::available();
    let fastest = &kernels[kernels.len() - 1..];
    trial.build_scenes_for(&scenes, &[BuildQuality::default()], fastest);
    let count = if R::IS_SINGLE { 1_000_000 } else { 100_000 };
    for ((scene, mesh), target) in meshes
        .iter()
        .enumerate()
        .flat_map(|mesh| RayTarget::ALL.map(|target| (mesh, target)))
    {
        let (part, seed) = (format!("{target:?} of mesh {scene}"), 60 + target as u64);
        let draw = |rng: &mut CaseRng| mesh.draw_inner_ray::<R>(rng, (DVec3::ZERO, 0.9), target);
        trial.judge_rays(&part, (seed, count), |rng, _| {
            Ok([TestRay::with_any_hit(scene, draw(rng).1)])
        });
        if has_textbook {
            // A ray leaves a convex mesh once, beside its target.
            let fans = mesh.fans();
            trial.judge_textbook(&part, (seed, 100_000), |rng| {
                let (face, ray) = draw(rng);
                let mut near = mesh
                    .corner_bits(&mesh.faces[face])
                    .into_iter()
                    .flat_map(|bits| &fans[&bits]);
                let is_hit = near.any(|triangle| textbook::intersect(triangle, &ray).is_some());
                Verdict::from_condition(is_hit, || "the textbook finds no hit")
            });
        }
    }
}

fn closed_meshes() -> [ClosedMesh; 2] {
    [create_icosphere(5), create_cube_mesh(16)]
}

/// Judges case P21: rays at common edges and corners of closed meshes.
pub(super) fn shared_edges<R: Real>(trial: &mut Trial<R>) {
    judge_leaks(trial, &closed_meshes(), true);
}

/// Judges case P22: the closed meshes of P21, with every face or every second face flipped.
pub(super) fn flipped_faces<R: Real>(trial: &mut Trial<R>) {
    let flip = |every| closed_meshes().map(|mesh| mesh.flip_every_nth_face(every));
    judge_leaks(trial, &[1, 2].map(flip).concat(), false);
}

/// Draws the corners of a thin triangle about 600 units from the origin: a needle with a bounding
/// box of 11.2 × 9.7 × 1.4, or a needle of about that length and height in a random orientation.
fn draw_needle(rng: &mut CaseRng) -> [DVec3; 3] {
    let x = rng.sample_direction();
    let y = rng.sample_offset_in_disc(x, 1.0).normalize();
    let point = rng.sample_direction() * 600.0;
    let diagonal = DVec3::new(11.2, 9.7, 1.4);
    let corners = if rng.next_sign() > 0.0 {
        let beside = rng.sample_point_in_cube() * DVec3::new(0.0, 0.5, 0.1);
        let middle = diagonal * rng.next_uniform(0.6, 0.9) + beside;
        [point, point + diagonal, point + middle]
    } else {
        [point, point + x * 11.2, point + x * 9.65 + y * 0.98]
    };
    corners.map(round_to_f32)
}

/// Judges case P20: rays nearly in the plane of a thin distant triangle. If such a ray hits, the
/// hit point must lie in the triangle's box.
pub(super) fn nearly_parallel_rays<R: Real>(trial: &mut Trial<R>) {
    trial.judge_shapes("", (52, 600_000), false, |rng| {
        let corners = draw_needle(rng);
        let [a, b, c] = corners;
        let x = (b - a).normalize();
        let normal = x.cross(c - a).normalize();
        let angle = rng.choose(&[0.5_f64, 0.01, 1e-4]).to_radians();
        let [u, v] = [(); 2].map(|()| rng.next_in_unit_interval());
        let target = a + (b - a) * u + (c - a) * (v * (1.0 - u));
        let away = x * rng.next_uniform(-1.0, 1.0) + normal.cross(x) * rng.next_uniform(-1.0, 1.0);
        let origin = target + (away.normalize() + normal * angle) * 600.0;
        let ray = create_ray_towards::<R>(origin, target + rng.sample_point_in_cube() * 1e-3);
        let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let judge = move |hit: Option<FormulaHit>| {
            let Some(FormulaHit { t, point, .. }) = hit else {
                return Verdict::Skipped;
            };
            let scale = low.abs().max(high.abs()).max(o.abs()).max_element();
            let over = |p: DVec3| (low - p).max(p - high).max_element();
            let judge = |p, label| Verdict::from_error(over(p), 16.0 * ulp(scale), || label);
            judge(
                o + d * t,
                "distance of the ray's point at the hit from the triangle's box",
            )
            .and_then(|| {
                judge(
                    point,
                    "distance of the surface point from the triangle's box",
                )
            })
        };
        Ok((
            Triangle::new(corners.map(to_scalar::<R>)).into(),
            ray,
            judge,
        ))
    });
}
