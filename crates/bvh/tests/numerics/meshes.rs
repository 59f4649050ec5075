//! Ray origins near edges of closed meshes under flattening maps lie on the side of all faces to
//! which the ray leaves.

use glam::DVec3;
use raywright_bvh::shapes::{Quad, Triangle};
use raywright_bvh::{AcceleratorKind, Geometry, Interval, PrimitiveSet, Real, Vector, Visibility};

use super::sharp::{back, flattening, is_thin};
use super::support::{
    CaseOutcome, CaseRng, Expect, Verdict, create_ray_towards, format_ray_bits, judge, require,
    to_scalar,
};

/// A convex body around the origin. Each face has three corners, or four for a parallelogram,
/// counter-clockwise from outside.
struct Body {
    name: &'static str,
    faces: Vec<Vec<DVec3>>,
}

/// Bodies with corners that f32 holds exactly in few digits, so that parallelograms are exact.
fn bodies() -> Vec<Body> {
    let v = DVec3::new;
    // Rotated off the axes by a map that keeps it a box.
    let corner = |i: usize| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
        v(1.0, 0.25, 0.5) * sign(0) + v(-0.5, 1.0, 0.5) * sign(1) + v(-0.25, -0.5, 0.75) * sign(2)
    };
    let squares = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let quads: Vec<Vec<DVec3>> = squares
        .iter()
        .map(|square| square.iter().map(|&i| corner(i)).collect())
        .collect();
    let halves = quads
        .iter()
        .flat_map(|q| [vec![q[0], q[1], q[2]], vec![q[0], q[2], q[3]]])
        .collect();
    let tips = [
        v(1.0, 1.0, 1.0),
        v(1.0, -1.0, -1.0),
        v(-1.0, 1.0, -1.0),
        v(-1.0, -1.0, 1.0),
    ];
    let tetrahedron = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
        .map(|face| face.map(|i| tips[i] * 0.5).to_vec())
        .to_vec();
    vec![
        Body {
            name: "box of quads",
            faces: quads,
        },
        Body {
            name: "box of triangles",
            faces: halves,
        },
        Body {
            name: "tetrahedron",
            faces: tetrahedron,
        },
        Body {
            name: "globe",
            faces: globe(),
        },
    ]
}

/// An octahedron with its faces subdivided into four, twice, and projected onto a sphere.
fn globe() -> Vec<Vec<DVec3>> {
    let mut faces = Vec::new();
    for octant in 0..8_usize {
        let sign = |bit: usize| if octant >> bit & 1 == 1 { -1.0 } else { 1.0 };
        let [x, y, z] = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
        faces.push(if octant.count_ones() % 2 == 0 {
            vec![x, y, z]
        } else {
            vec![x, z, y]
        });
    }
    for _ in 0..2 {
        let divided = faces.iter().flat_map(|f| {
            let [a, b, c] = [f[0], f[1], f[2]];
            let [p, q, r] = [a + b, b + c, c + a].map(|m| m.normalize().as_vec3().as_dvec3());
            [vec![a, p, r], vec![p, b, q], vec![r, q, c], vec![p, q, r]]
        });
        faces = divided.collect();
    }
    faces
}

/// Signed height of a point above the highest face, in the body's space.
fn height(faces: &[Vec<DVec3>], p: DVec3) -> f64 {
    let over = |f: &Vec<DVec3>| (f[1] - f[0]).cross(f[2] - f[0]).normalize().dot(p - f[0]);
    faces.iter().map(over).fold(f64::NEG_INFINITY, f64::max)
}

/// The body as a mesh, optionally inside out.
fn mesh<R: Real>(faces: &[Vec<DVec3>], inside_out: bool) -> Geometry<R> {
    let mut group = PrimitiveSet::<R>::default();
    for face in faces {
        let mut corners: Vec<_> = face.iter().map(|&p| to_scalar::<R>(p)).collect();
        if inside_out {
            corners.reverse();
        }
        match *corners {
            [a, b, c] => group.add_shape(
                Triangle {
                    vertices: [a, b, c],
                }
                .into(),
                Visibility::default(),
            ),
            [a, b, c, d] => group.add_shape(
                Quad {
                    corners: [a, b, c, d],
                }
                .into(),
                Visibility::default(),
            ),
            _ => unreachable!("faces have three corners or four"),
        }
        .expect("finite");
    }
    Geometry::new(group, AcceleratorKind::default())
}

/// Radius of a circle inside the smallest face: a face that under a map is smaller than the error
/// of its points has no point away from its edges.
fn least_circle(faces: &[Vec<DVec3>]) -> f64 {
    let circle = |f: &Vec<DVec3>| {
        let [p, q, r] = [f[1] - f[0], f[2] - f[1], f[0] - f[2]];
        // A parallelogram counts two of its sides, and half its least height.
        let around = if f.len() == 3 {
            p.length() + q.length() + r.length()
        } else {
            2.0 * p.length().max(q.length())
        };
        p.cross(q).length() / around
    };
    faces.iter().map(circle).fold(f64::INFINITY, f64::min)
}

/// Rays to both sides from hits near edges of a body, under maps that flatten by the factor `by`.
fn starts<R: Real>(Body { name, faces }: &Body, by: f64, inside_out: bool) -> CaseOutcome {
    let label = if inside_out {
        "the inside of the"
    } else {
        "the"
    };
    let ball = least_circle(faces).min(-height(faces, DVec3::ZERO));
    let mesh = mesh::<R>(faces, inside_out);
    judge(
        &format!(
            "starts on {label} {name}, flattened by {by:e}, in {}",
            std::any::type_name::<R>()
        ),
        424,
        20_000,
        |rng: &mut CaseRng| {
            let map = flattening(rng, by);
            let mut group = PrimitiveSet::<R>::default();
            let part = group.add_part(mesh.clone()).expect("no instances in it");
            group
                .add_instance(part, map, Visibility::default())
                .expect("an invertible map");
            let geometry = Geometry::new(group, AcceleratorKind::default());
            let face = &faces[(rng.next_bits() % faces.len() as u64) as usize];
            let i = (rng.next_bits() % face.len() as u64) as usize;
            let along = if rng.next_in_unit_interval() < 0.3 {
                0.0
            } else {
                rng.next_in_unit_interval()
            };
            let edge = face[i] + (face[(i + 1) % face.len()] - face[i]) * along;
            let target = map.transform_point3(
                edge + rng.sample_point_in_cube() * 10_f64.powf(rng.next_uniform(-9.0, -0.5)),
            );
            let ray = create_ray_towards::<R>(
                target + rng.sample_direction() * rng.choose(&[0.5, 3.0, 30.0]),
                target,
            );
            let Some(hit) = geometry.closest(&ray, Interval::positive(), &mut ()) else {
                return Verdict::Skipped;
            };
            let surface = geometry.surface(&ray, &hit);
            if is_thin::<R>(ball, by, surface.point.to_f64(), hit.t.to_f64()) {
                return Verdict::Skipped;
            }
            let normal = surface.normal.to_f64();
            let above = [normal, -normal].map(|direction| {
                height(
                    faces,
                    back(
                        map,
                        surface.spawn_ray_origin(to_scalar::<R>(direction)).to_f64(),
                    ),
                )
            });
            let [out, into] = if inside_out {
                [above[1], above[0]]
            } else {
                above
            };
            require(out > 0.0 && into < 0.0, || {
                format!(
                    "{out:e} {into:e} {surface:?} {map:?}{}",
                    format_ray_bits::<R>(&ray)
                )
            })
        },
    )
}

/// Protects: a ray origin near an edge of a closed mesh lies on the side of all faces to which the
/// ray leaves, for any flatness of the map, from inside and outside.
#[test]
fn starts_beside_edges_of_meshes_are_on_the_right_side() {
    fn check<R: Real>() {
        for body in &bodies() {
            for by in [1.0, 1e-1, 1e-2, 1e-3, 1e-4] {
                for inside_out in [false, true] {
                    starts::<R>(body, by, inside_out).expect_right(1000);
                }
            }
        }
    }
    check::<f32>();
    check::<f64>();
}
