//! S04, S05: gaps and shells of width 1e-4, and paths that bounce in a closed box and must stay
//! inside.

use glam::{DQuat, DVec3, Vec3};
use raywright_bvh::shapes::{AnyShape, Cuboid, Quad, Sphere, Triangle};
use raywright_bvh::{AcceleratorKind, Geometry, Interval, PrimitiveSet, Ray, Surface, Visibility};

use super::support::{
    CaseRng, Expect, Verdict, create_ray_towards, format_ray_bits, judge, require, round_to_f32,
    to_scalar, ulp,
};

const GAP: f64 = 1e-4;

fn geometry(shapes: impl IntoIterator<Item = AnyShape<f32>>) -> Geometry<f32> {
    let mut group = PrimitiveSet::<f32>::default();
    for shape in shapes {
        group
            .add_shape(shape, Visibility::default())
            .expect("finite");
    }
    Geometry::new(group, AcceleratorKind::default())
}

/// Protects: between two rotated parallel sheets with a narrow gap, a light beyond the other sheet
/// is never visible, and a light in the gap always is.
#[test]
fn s04_thin_gap() {
    judge("S04 gap", 130, 400_000, |rng| {
        let turn = DQuat::from_axis_angle(rng.sample_direction(), rng.next_uniform(0.0, 6.0));
        let turn = if rng.next_in_unit_interval() < 0.25 {
            DQuat::IDENTITY
        } else {
            turn
        };
        let point = rng.sample_point_in_cube();
        let sheet = |height: f64| -> AnyShape<f32> {
            Quad::new(
                point + turn * DVec3::new(-1.0, height, -1.0),
                turn * (DVec3::X * 2.0),
                turn * (DVec3::Z * 2.0),
            )
            .into()
        };
        let geometry = geometry([sheet(0.0), sheet(GAP)]);
        let inner = |rng: &mut CaseRng| {
            DVec3::new(
                rng.next_uniform(-0.9, 0.9),
                0.0,
                rng.next_uniform(-0.9, 0.9),
            )
        };
        // A point on the upper side of the lower or of the upper sheet.
        let lower = rng.next_sign() > 0.0;
        let position = inner(rng);
        let (target, from) = if lower {
            // Seen from within the gap.
            (
                position,
                position + rng.sample_offset_in_disc(DVec3::Y, 0.05) + DVec3::Y * (0.7 * GAP),
            )
        } else {
            (
                position + DVec3::Y * GAP,
                position
                    + rng.sample_offset_in_disc(DVec3::Y, 1.0)
                    + DVec3::Y * rng.next_uniform(0.1, 2.0),
            )
        };
        let ray = create_ray_towards::<f32>(point + turn * from, point + turn * target);
        let Some(hit) = geometry.closest(&ray, Interval::positive(), &mut ()) else {
            return Verdict::Skipped;
        };
        if (hit.object == 0) != lower {
            return Verdict::Skipped;
        }
        let surface = geometry.surface(&ray, &hit);
        let beside = inner(rng);
        let (light, dark) = match (lower, rng.next_sign() > 0.0) {
            // In the gap, near enough for f32 to resolve the height.
            (true, true) => (
                position + rng.sample_offset_in_disc(DVec3::Y, 0.05) + DVec3::Y * (0.5 * GAP),
                false,
            ),
            (true, false) => (beside * 0.5 + DVec3::Y * (2.0 * GAP), true),
            (false, true) => (beside + DVec3::Y * rng.next_uniform(2.0 * GAP, 1.0), false),
            (false, false) => (beside * 0.5 - DVec3::Y * GAP, true),
        };
        let light = point + turn * light;
        let Some((shadow, range)) = surface.spawn_ray_to_point(light.as_vec3()) else {
            return Verdict::Wrong("no shadow ray".into());
        };
        let got = geometry.occluded(&shadow, range, &mut |_| true, &mut ());
        require(got == dark, || {
            format!(
                "shadow {got} on sheet {}{}",
                hit.object,
                format_ray_bits(&shadow)
            )
        })
    })
    .expect_right(300_000);
}

/// The surfaces of a shell that a refracted ray crosses in order, in f64, from the impact parameter
/// alone. That parameter is constant within a medium and is multiplied by the ratio of refractive
/// indices at each surface.
fn interfaces(impact: f64, inner: f64) -> Vec<u32> {
    // In the glass the impact parameter is impact / η < inner; in the hollow it is the outer value
    // again.
    if impact < inner {
        vec![0, 1, 1, 0]
    } else {
        vec![0, 1, 0]
    }
}

/// Protects: straight and refracted rays cross each surface of a glass sphere with a wall of 1e-4
/// once.
#[test]
fn s04_thin_shell() {
    const ETA: f64 = 1.5;
    judge("S04 shell", 131, 400_000, |rng| {
        let centre = round_to_f32(rng.sample_point_in_cube() * rng.choose(&[0.0, 1.0, 10.0]));
        let inner = f64::from((1.0 - GAP) as f32);
        let ball = |radius: f64| -> AnyShape<f32> {
            Sphere {
                centre: to_scalar::<f32>(centre),
                radius: radius as f32,
            }
            .into()
        };
        let geometry = geometry([ball(1.0), ball(inner)]);
        let out = rng.sample_direction();
        let ray = create_ray_towards::<f32>(
            centre + out * rng.next_uniform(1.5, 10.0),
            centre + rng.sample_offset_in_disc(out, 1.0),
        );
        let (o, d) = (
            ray.origin.as_dvec3() - centre,
            ray.direction.as_dvec3().normalize(),
        );
        let impact = (o - d * o.dot(d)).length();
        let bends = rng.next_sign() > 0.0;
        // Without refraction, a grazing ray crosses the outer surface only.
        let straight = if impact < inner {
            vec![0, 1, 1, 0]
        } else {
            vec![0, 0]
        };
        let expected = if bends {
            interfaces(impact, inner)
        } else {
            straight
        };
        // Near the rim of the hollow either outcome is right, within the rounding of the spheres'
        // position.
        let room = 64.0 * ulp(centre.abs().max_element() + 10.0);
        if (impact - inner).abs() < room || impact > 1.0 - room {
            return Verdict::Undecidable;
        }
        let (mut ray, mut hit_primitives) = (ray, vec![]);
        while let Some(hit) = geometry.closest(&ray, Interval::positive(), &mut ()) {
            hit_primitives.push(hit.object);
            if hit_primitives.len() > expected.len() {
                break;
            }
            let surface = geometry.surface(&ray, &hit);
            let d = ray.direction.as_dvec3().normalize();
            let onward = if bends {
                bend(d, surface.normal.as_dvec3(), hit.object, ETA)
            } else {
                d
            };
            ray = Ray::new(surface.spawn_ray_origin(onward.as_vec3()), onward.as_vec3());
        }
        require(hit_primitives == expected, || {
            format!(
                "met {hit_primitives:?}, not {expected:?}, impact {impact}{}",
                format_ray_bits(&ray)
            )
        })
    })
    .expect_right(390_000);
}

/// The refracted direction at a surface of the shell: glass between the outer (0) and the inner
/// surface (1), air elsewhere. Reflected under total internal reflection.
fn bend(d: DVec3, normal: DVec3, surface: u32, eta: f64) -> DVec3 {
    let entering = normal.dot(d) < 0.0;
    let to_glass = entering == (surface == 0);
    let ratio = if to_glass { 1.0 / eta } else { eta };
    let n = if entering { normal } else { -normal };
    let cos = -n.dot(d);
    let rest = 1.0 - ratio * ratio * (1.0 - cos * cos);
    if rest < 0.0 {
        d + n * (2.0 * cos)
    } else {
        d * ratio + n * (ratio * cos - rest.sqrt())
    }
    .normalize()
}

/// The faces of a box, each with outward winding: the box is spanned by three edges at a corner.
fn faces(point: DVec3, edges: [DVec3; 3]) -> Vec<[Vec3; 4]> {
    let corner = |i: usize| {
        let part = |k: usize| {
            if i >> k & 1 == 1 {
                edges[k]
            } else {
                DVec3::ZERO
            }
        };
        (point + part(0) + part(1) + part(2)).as_vec3()
    };
    [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ]
    .map(|face| face.map(corner))
    .to_vec()
}

/// A closed room as one box, six quads or twelve triangles; rotated unless it is a box.
fn room(kind: usize, seed: u64) -> (Geometry<f32>, DVec3, [DVec3; 3]) {
    let rng = &mut CaseRng::new(seed, 0);
    let (point, size) = (
        round_to_f32(rng.sample_point_in_cube() * 10.0),
        DVec3::new(1.3, 0.7, 2.1) * rng.next_uniform(0.5, 2.0),
    );
    let turn = DQuat::from_axis_angle(
        rng.sample_direction(),
        if kind == 0 {
            0.0
        } else {
            rng.next_uniform(0.0, 6.0)
        },
    );
    let edges = [DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z].map(|e| turn * e);
    let walls = faces(point, edges);
    let shapes: Vec<AnyShape<f32>> = match kind {
        0 => vec![
            Cuboid {
                min: point.as_vec3(),
                max: (point + size).as_vec3(),
            }
            .into(),
        ],
        1 => walls
            .into_iter()
            .map(|corners| Quad { corners }.into())
            .collect(),
        _ => walls
            .into_iter()
            .flat_map(|[a, b, c, d]| {
                [
                    Triangle::new([a, b, c]).into(),
                    Triangle::new([a, c, d]).into(),
                ]
            })
            .collect(),
    };
    (geometry(shapes), point, edges)
}

const ROOMS: [&str; 3] = ["box", "quads", "triangles"];

/// A direction from a wall into the room: any, nearly along the wall, or towards an edge again.
fn onward(
    rng: &mut CaseRng,
    surface: &Surface<f32>,
    inward: DVec3,
    point: DVec3,
    edges: [DVec3; 3],
) -> DVec3 {
    loop {
        let d = match rng.next_bits() % 3 {
            0 => rng.sample_direction(),
            1 => {
                rng.sample_direction() * DVec3::splat(1e-3)
                    + rng.sample_offset_in_disc(inward, 1.0).normalize()
            }
            _ => near_edge(rng, point, edges) - surface.point.as_dvec3(),
        };
        let d = round_to_f32(d.normalize());
        let rise = inward.dot(d);
        if rise != 0.0 {
            return d * rise.signum();
        }
    }
}

/// A point of a wall at a distance of one unit in the last place to a thousandth from an edge.
fn near_edge(rng: &mut CaseRng, point: DVec3, edges: [DVec3; 3]) -> DVec3 {
    let along = (rng.next_bits() % 3) as usize;
    let (b, c) = (edges[(along + 1) % 3], edges[(along + 2) % 3]);
    let end = |rng: &mut CaseRng, off: f64, edge: DVec3| {
        let share = off / edge.length();
        edge * if rng.next_sign() > 0.0 {
            share
        } else {
            1.0 - share
        }
    };
    let minimum = ulp(point.abs().max_element());
    let off = minimum * (1e-3 / minimum).powf(rng.next_in_unit_interval());
    // Sometimes in a corner of three walls.
    let position = if rng.next_in_unit_interval() < 0.2 {
        end(rng, off, edges[along])
    } else {
        edges[along] * rng.next_in_unit_interval()
    };
    point + position + end(rng, off, b) + end(rng, 0.0, c)
}

/// Protects: a million paths of eight bounces in closed rooms, starting and bouncing at edges and
/// corners, stay inside.
#[test]
fn s05_nothing_escapes() {
    for (kind, name) in ROOMS.iter().enumerate() {
        for seed in 0..4 {
            let (geometry, point, edges) = room(kind, 140 + seed);
            let middle = point + (edges[0] + edges[1] + edges[2]) * 0.5;
            judge(&format!("S05 {name} {seed}"), 141 + seed, 250_000, |rng| {
                let start = round_to_f32(
                    middle
                        + edges
                            .into_iter()
                            .map(|edge| edge * rng.next_uniform(-0.3, 0.3))
                            .sum::<DVec3>(),
                );
                let mut ray = create_ray_towards::<f32>(start, near_edge(rng, point, edges));
                for bounce in 0..=8 {
                    let Some(hit) = geometry.closest(&ray, Interval::positive(), &mut ()) else {
                        return Verdict::Wrong(format!(
                            "escaped after {bounce} bounces{}",
                            format_ray_bits(&ray)
                        ));
                    };
                    let surface = geometry.surface(&ray, &hit);
                    let inward = -surface.normal.as_dvec3();
                    if inward.dot(middle - surface.point.as_dvec3()) <= 0.0 {
                        return Verdict::Wrong(format!(
                            "a wall from behind after {bounce} bounces{}",
                            format_ray_bits(&ray)
                        ));
                    }
                    let d = onward(rng, &surface, inward, point, edges);
                    ray = Ray::new(surface.spawn_ray_origin(d.as_vec3()), d.as_vec3());
                }
                Verdict::Right(0.0)
            })
            .expect_right(250_000);
        }
    }
}
