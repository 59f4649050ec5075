//! P19–P22: slivers, rays in a triangle's plane, and closed meshes that must not leak.

use glam::{DVec3, Vec3};
use raywright_bvh::shapes::{AnyShape, Triangle};
use raywright_bvh::{AcceleratorKind, Fast, Geometry, Group, Interval, Precision, Probe, Reference, Robust, Shape, Visibility};

use super::support::{Outcome, Random, Verdict, exact, hex, hit, judge, ray, stored, textbook_share, towards, ulp};

fn triangle<P: Precision>(corners: [DVec3; 3]) -> Triangle<P::Real> {
    Triangle::new(corners.map(stored::<P>))
}

/// Triangles without area are never hit, not even on their line; slivers only at a distance between their corners'.
#[test]
fn p19_slivers() {
    judge("P19 no area", 50, 400_000, |random| {
        // Whole numbers: exactly collinear, whatever the scale.
        let whole = |random: &mut Random| (random.cube() * 64.0).round();
        let (a, step) = (whole(random), whole(random));
        let corners = match random.bits() % 3 {
            0 => [a, a + step, a + step * 2.0],
            1 => [a, a, a + step],
            _ => [a, a + step, a],
        };
        let scale = 2_f64.powi((random.bits() % 40) as i32 - 20);
        let corners = corners.map(|c| c * scale);
        let target = corners[0] + (corners[2] - corners[0]) * random.unit();
        let target = if random.sign() > 0.0 { target } else { corners[1] };
        let ray = towards::<Robust>(whole(random) * (2.0 * scale) + DVec3::splat(200.0 * scale), target);
        let got = hit::<Robust>(&triangle::<Robust>(corners), &ray);
        Verdict::holds(got.is_none(), || format!("{got:?}{} {corners:?}", hex::<Robust>(&ray)))
    })
    .expect_right(400_000);
    judge("P19 sliver", 51, 400_000, |random| {
        let (a, along) = (random.cube(), random.direction());
        let side = random.disc(along, 1.0).normalize() * 1e-6;
        // Edges 1, 1 and 1e-6, or 1, 1 and a thousandth with the same height over the longest.
        let corners = [a, a + along, a + along * random.pick(&[0.0, 1e-3]) + side].map(exact);
        let target = corners[0] + (corners[1] - corners[0]) * random.unit();
        let ray = towards::<Robust>(target + random.direction() * random.between(0.5, 5.0), target);
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let Some(h) = hit::<Robust>(&triangle::<Robust>(corners), &ray) else { return Verdict::Skip };
        let ts = corners.map(|c| (c - o).dot(d) / d.length_squared());
        let (low, high) = (ts.iter().copied().fold(f64::INFINITY, f64::min), ts.iter().copied().fold(0.0, f64::max));
        let (t, room) = (f64::from(h.t), ulp(high));
        Verdict::holds(low - room <= t && t <= high + room, || format!("t {t} not in {low}..{high}{}", hex::<Robust>(&ray)))
    })
    .expect_right(50_000);
}

/// Rays nearly in the plane of a skinny triangle far away: whatever is hit lies in the triangle's box.
#[test]
fn p20_nearly_parallel_rays() {
    judge("P20", 52, 600_000, |random| {
        let x = random.direction();
        let y = random.disc(x, 1.0).normalize();
        let at = random.direction() * 600.0;
        // A needle by its box, 11.2 × 9.7 × 1.4, as it lies; or one of that length and height anyhow turned.
        let diagonal = DVec3::new(11.2, 9.7, 1.4);
        let corners = if random.sign() > 0.0 {
            [at, at + diagonal, at + diagonal * random.between(0.6, 0.9) + random.cube() * DVec3::new(0.0, 0.5, 0.1)].map(exact)
        } else {
            [at, at + x * 11.2, at + x * 9.65 + y * 0.98].map(exact)
        };
        let (x, y) = {
            let x = (corners[1] - corners[0]).normalize();
            let normal = x.cross(corners[2] - corners[0]).normalize();
            (x, normal.cross(x))
        };
        let angle = random.pick(&[0.5_f64, 0.01, 1e-4]).to_radians();
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let weights = (random.unit(), random.unit());
        let target =
            corners[0] + (corners[1] - corners[0]) * weights.0 + (corners[2] - corners[0]) * (weights.1 * (1.0 - weights.0));
        let away = x * random.between(-1.0, 1.0) + y * random.between(-1.0, 1.0);
        let origin = target + (away.normalize() + normal * angle) * 600.0;
        let ray = towards::<Robust>(origin, target + random.cube() * 1e-3);
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let shape = triangle::<Robust>(corners);
        let Some(h) = hit::<Robust>(&shape, &ray) else { return Verdict::Skip };
        let (low, high) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
        let on_ray = o + d * f64::from(h.t);
        let on_plane = shape.surface(&Probe::<Robust>::new(ray), h).point.as_dvec3();
        let scale = low.abs().max(high.abs()).max(o.abs()).max_element();
        let over = |p: DVec3| (low - p).max(p - high).max_element();
        Verdict::bounded(over(on_ray), 16.0 * ulp(scale), || format!("point of the ray{} {shape:?}", hex::<Robust>(&ray))).and(
            || {
                Verdict::bounded(over(on_plane), 16.0 * ulp(scale), || {
                    format!("point of the surface{} {shape:?}", hex::<Robust>(&ray))
                })
            },
        )
    })
    .expect_right(50_000);
}

/// A closed mesh of corners and triangles.
pub struct Mesh {
    pub corners: Vec<Vec3>,
    pub faces: Vec<[usize; 3]>,
}

/// An icosahedron, each face divided into four `levels` times, on the unit sphere.
pub fn icosphere(levels: u32) -> Mesh {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut corners: Vec<DVec3> = vec![];
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        corners.extend([DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)]);
    }
    let mut faces = vec![];
    for i in 0..12 {
        for j in 0..12 {
            for k in 0..12 {
                let edge = |a: usize, b: usize| (corners[a].distance(corners[b]) - 2.0).abs() < 1e-9;
                let out = (corners[j] - corners[i]).cross(corners[k] - corners[i]).dot(corners[i]) > 0.0;
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
    Mesh { corners: corners.into_iter().map(DVec3::as_vec3).collect(), faces }
}

/// The cube [−1, 1]³ with `n` × `n` cells a face, two triangles each; faces share the corners at edges by their bits.
fn cube(n: usize) -> Mesh {
    let mut mesh = Mesh { corners: vec![], faces: vec![] };
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
                    let two = if side > 0.0 { [[p, q, r], [p, r, s]] } else { [[p, r, q], [p, s, r]] };
                    mesh.faces.extend(two);
                }
            }
        }
    }
    mesh
}

impl Mesh {
    /// With every face turned over, or every second.
    fn turned(mut self, every: usize) -> Self {
        for face in self.faces.iter_mut().step_by(every) {
            face.swap(1, 2);
        }
        self
    }
    fn geometry<P: Precision>(&self) -> Geometry<P> {
        let mut group = Group::<P>::default();
        for face in &self.faces {
            let vertices = face.map(|i| stored::<P>(self.corners[i].as_dvec3()));
            let shape: AnyShape<P::Real> = Triangle::new(vertices).into();
            group.shape(shape, Visibility::default()).expect("finite corners");
        }
        Geometry::new(group, AcceleratorKind::default())
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Aim {
    Corner,
    Edge,
    FromCentre,
    Anywhere,
}

/// Rays from inside a closed mesh; each must hit.
fn leaks<P: Precision>(name: &str, mesh: &Mesh, aim: Aim, count: u32) -> Outcome {
    let geometry = mesh.geometry::<P>();
    judge(&format!("P21 {name} {aim:?}"), 60 + aim as u64, count, |random| {
        let face = mesh.faces[(random.bits() % mesh.faces.len() as u64) as usize];
        let corner = |i: usize| mesh.corners[face[i]].as_dvec3();
        let along = random.unit();
        let target = match aim {
            Aim::Corner => corner(0),
            Aim::Edge => corner(0) + (corner(1) - corner(0)) * along,
            Aim::FromCentre if random.sign() > 0.0 => corner(0),
            Aim::FromCentre => corner(0) + (corner(1) - corner(0)) * along,
            Aim::Anywhere => random.direction() * 2.0,
        };
        let origin = if aim == Aim::FromCentre { DVec3::ZERO } else { exact(random.direction() * (0.9 * random.unit())) };
        // From the centre the direction *is* the corner, so that the ray passes through it exactly.
        let ray = if aim == Aim::FromCentre { ray::<P>(origin, target) } else { towards::<P>(origin, target) };
        let got = geometry.closest(&ray, Interval::positive(), &mut ());
        Verdict::holds(got.is_some(), || format!("leak{}", hex::<P>(&ray)))
    })
}

const AIMS: [Aim; 4] = [Aim::Corner, Aim::Edge, Aim::FromCentre, Aim::Anywhere];

/// No ray gets out of a closed mesh through an edge or a corner.
#[test]
fn p21_no_leaks() {
    for (name, mesh) in [("icosphere", icosphere(5)), ("cube", cube(16))] {
        for aim in AIMS {
            leaks::<Robust>(name, &mesh, aim, 1_000_000).expect_right(1_000_000);
        }
    }
}

/// Nor in f64, where products are not exact any more.
#[test]
fn p21_no_leaks_in_reference() {
    for (name, mesh) in [("icosphere", icosphere(5)), ("cube", cube(16))] {
        for aim in AIMS {
            leaks::<Reference>(name, &mesh, aim, 100_000).expect_right(100_000);
        }
    }
}

/// Nor through triangles that are turned over, all or every second.
#[test]
fn p22_no_leaks_in_either_winding() {
    for every in [1, 2] {
        for (name, mesh) in [("icosphere", icosphere(5)), ("cube", cube(16))] {
            let mesh = mesh.turned(every);
            for aim in AIMS {
                leaks::<Robust>(name, &mesh, aim, 1_000_000).expect_right(1_000_000);
            }
        }
    }
}

/// The textbook test must leak where the specification says that it does.
#[test]
fn textbook_triangles_leak() {
    fn both<P: Precision>() -> Outcome {
        let aimed = |name, mesh| leaks::<P>(name, mesh, Aim::Corner, 100_000);
        aimed("cube", &cube(16)).plus(aimed("icosphere", &icosphere(5)))
    }
    let leaking = textbook_share([both::<Fast>(), both::<Robust>(), both::<Reference>()]);
    assert!(leaking > 0.01, "P21: only {leaking} leak");
}
