//! S06: shadow rays to a light in the plane of its holder, and to one a tiny distance away.

use core::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};
use raywright_bvh::shapes::{AnyShape, Quad};
use raywright_bvh::{AcceleratorKind, Geometry, Interval, PrimitiveSet, Ray, Surface, Visibility};

use super::support::{
    CaseRng, Expect, Verdict, create_ray_towards, format_ray_bits, judge, require, round_to_f32,
};

/// A light, the ceiling around it in the same plane, and a wall that crosses neither.
struct LitRoom {
    geometry: Geometry<f32>,
    light: Quad<f32>,
    /// Centre of the light, its half edges, and the downward direction.
    middle: DVec3,
    half: [DVec3; 2],
    down: DVec3,
}

const LIGHT: u32 = 0;

fn room(seed: u64) -> LitRoom {
    let rng = &mut CaseRng::new(seed, 0);
    let turn = if seed == 0 {
        DQuat::IDENTITY
    } else {
        DQuat::from_axis_angle(rng.sample_direction(), rng.next_uniform(0.0, 6.0))
    };
    let middle = round_to_f32(rng.sample_point_in_cube() * if seed == 0 { 0.0 } else { 5.0 });
    let (x, z, down) = (turn * DVec3::X, turn * DVec3::Z, turn * DVec3::NEG_Y);
    let quad = |reach: f64| {
        Quad::new(
            middle - x * reach - z * reach,
            x * (2.0 * reach),
            z * (2.0 * reach),
        )
    };
    let light = quad(0.5);
    let mut group = PrimitiveSet::<f32>::default();
    for shape in [AnyShape::from(light), AnyShape::from(quad(3.0))] {
        group
            .add_shape(shape, Visibility::default())
            .expect("finite");
    }
    LitRoom {
        geometry: Geometry::new(group, AcceleratorKind::default()),
        light,
        middle,
        half: [x * 0.5, z * 0.5],
        down,
    }
}

/// The surface at a sampled point of the light.
fn drawn(room: &LitRoom, u: f64, v: f64) -> Surface<f32> {
    use raywright_bvh::shapes::SampleArea;
    room.light
        .sample_area(u as f32, v as f32)
        .0
        .to_scalar::<f32>()
}

/// The surface of a receiver at a point, facing the light, from a hit on a small quad.
fn receiver(position: DVec3, facing: DVec3) -> Option<Surface<f32>> {
    let (a, b) = facing.any_orthonormal_pair();
    let mut group = PrimitiveSet::<f32>::default();
    // `facing` is a × b, the outward normal.
    group
        .add_shape(
            Quad::new(position - (a + b) * 0.05, a * 0.1, b * 0.1).into(),
            Visibility::default(),
        )
        .expect("finite");
    let geometry = Geometry::new(group, AcceleratorKind::default());
    let ray = create_ray_towards::<f32>(position + facing, position);
    let hit = geometry.closest(&ray, Interval::positive(), &mut ())?;
    Some(geometry.surface(&ray, &hit))
}

const DISTANCES: [f64; 6] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0];

/// Protects: nothing in the light's own plane occludes a sampled point of it from a receiver, at
/// any distance.
#[test]
fn s06_no_shadow_by_the_light_or_its_holder() {
    for seed in 0..3 {
        let room = room(seed);
        judge(&format!("S06 {seed}"), 160 + seed, 400_000, |rng| {
            let point = room.half[0] * rng.next_uniform(-1.5, 1.5)
                + room.half[1] * rng.next_uniform(-1.5, 1.5);
            let position = room.middle + point + room.down * rng.choose(&DISTANCES);
            let Some(receiver) = receiver(position, -room.down) else {
                return Verdict::Skipped;
            };
            let target = drawn(
                &room,
                rng.next_in_unit_interval(),
                rng.next_in_unit_interval(),
            );
            let Some((ray, range)) = receiver.spawn_ray_to_surface(&target) else {
                return Verdict::Wrong(format!(
                    "no shadow ray from {:?} to {:?}",
                    receiver.point, target.point
                ));
            };
            let blocked = room.geometry.occluded(&ray, range, &mut |_| true, &mut ());
            require(!blocked, || {
                format!(
                    "shadowed at {position:?}, {:?}{}",
                    target.point,
                    format_ray_bits(&ray)
                )
            })
        })
        .expect_right(390_000);
    }
}

/// The form factor from a small patch to a polygon, in f64 ("Photometria", Lambert 1760): the sum
/// over edges of the subtended angle times the patch's cosine with the plane through the edge.
fn form_factor(position: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let sum: f64 = edges
        .map(|(a, b)| {
            let (a, b) = ((*a - position).normalize(), (*b - position).normalize());
            let across = a.cross(b);
            across.length().atan2(a.dot(b)) * across.normalize().dot(normal)
        })
        .sum();
    (sum / TAU).abs()
}

/// Protects: irradiance by sampling the light's area with shadow rays, compared with the closed
/// form. Below a distance of a tenth, cosine-distributed directions replace area samples, which
/// would nearly all be too far aside.
#[test]
fn s06_irradiance_is_the_form_factor() {
    let room = room(1);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[a, b]| room.middle + room.half[0] * a + room.half[1] * b);
    let [x, z] = room.half.map(DVec3::normalize);
    for distance in DISTANCES {
        for beside in [0.0, 0.3, 0.49, 0.8] {
            let position = room.middle + room.half[0] * (2.0 * beside) + room.down * distance;
            let facing = -room.down;
            let receiver = receiver(position, facing).expect("aimed at it");
            let (p, normal) = (receiver.point.as_dvec3(), receiver.normal.as_dvec3());
            let rng = &mut CaseRng::new(170, (distance * 1e6) as u64);
            let term = |rng: &mut CaseRng| {
                if distance >= 0.1 {
                    let target = drawn(
                        &room,
                        rng.next_in_unit_interval(),
                        rng.next_in_unit_interval(),
                    );
                    let Some((ray, range)) = receiver.spawn_ray_to_surface(&target) else {
                        return f64::NAN;
                    };
                    let seen = !room.geometry.occluded(&ray, range, &mut |_| true, &mut ());
                    let across = target.point.as_dvec3() - p;
                    let cosines = normal.dot(across) * -target.normal.as_dvec3().dot(across).abs()
                        / across.length().powi(4);
                    return if seen { cosines.abs() / PI } else { 0.0 };
                }
                // Malley's method.
                let (r, angle) = (
                    rng.next_in_unit_interval().sqrt(),
                    rng.next_in_unit_interval() * TAU,
                );
                let d = x * (r * angle.cos())
                    + z * (r * angle.sin())
                    + facing * (1.0 - r * r).max(0.0).sqrt();
                let start = receiver.spawn_ray_origin(d.as_vec3());
                let hit = room.geometry.closest(
                    &Ray::new(start, d.as_vec3()),
                    Interval::positive(),
                    &mut (),
                );
                f64::from(u8::from(hit.is_some_and(|hit| hit.object == LIGHT)))
            };
            const SAMPLES: u32 = 100_000;
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..SAMPLES {
                let value = term(rng);
                (sum, squares) = (sum + value, squares + value * value);
            }
            let count = f64::from(SAMPLES);
            let mean = sum / count;
            let error = ((squares / count - mean * mean).max(0.0) / count).sqrt();
            let expected = form_factor(p, normal, &corners);
            assert!(
                (mean - expected).abs() <= 3.0 * error + 1e-4,
                "{distance} below, {beside} beside: {mean} ± {error}, not {expected}"
            );
        }
    }
}

/// Protects: a receiver on the light itself gives no shadow ray or one without NaN, and never
/// panics.
#[test]
fn s06_at_no_distance() {
    let room = room(1);
    judge("S06 touching", 175, 100_000, |rng| {
        let target = drawn(
            &room,
            rng.next_in_unit_interval(),
            rng.next_in_unit_interval(),
        );
        let Some(receiver) = receiver(target.point.as_dvec3(), -room.down) else {
            return Verdict::Skipped;
        };
        for (a, b) in [(&target, &target), (&receiver, &target)] {
            let Some((ray, range)) = a.spawn_ray_to_surface(b) else {
                continue;
            };
            if !(ray.is_finite() && range.max.is_finite()) {
                return Verdict::Wrong(format!("{range:?}{}", format_ray_bits(&ray)));
            }
        }
        let to_itself = target.spawn_ray_to_point(target.point);
        require(
            to_itself.is_none_or(|(ray, range)| ray.is_finite() && range.max.is_finite()),
            || "not finite",
        )
    })
    .expect_right(99_000);
}

/// Protects: a tilted lamp near the origin is not occluded by itself from a million of its sizes
/// away: the unit direction is rounded to f32 there and misses the sampled point, so the range must
/// end before the lamp by more than the errors of both points.
#[test]
fn s06_a_distant_lamp_is_not_in_its_own_light() {
    use raywright_bvh::shapes::SampleArea;
    judge("S06 distant lamp", 176, 200_000, |rng| {
        let (out, distance) = (
            rng.sample_direction(),
            10_f64.powf(rng.next_uniform(1.0, 6.0)),
        );
        // Tilted, but facing the ray and large enough to be crossed by a ray that is off.
        let (eu, ev) = (
            rng.sample_point_in_cube() * distance * 1e-4,
            rng.sample_point_in_cube() * distance * 1e-4,
        );
        let lamp = Quad::<f32>::new((eu + ev) * -0.5, eu, ev);
        let normal = eu.cross(ev).normalize();
        if eu.cross(ev).length() < 0.3 * eu.length() * ev.length() || normal.dot(out).abs() < 0.1 {
            return Verdict::Skipped;
        }
        let mut group = PrimitiveSet::<f32>::default();
        group
            .add_shape(lamp.into(), Visibility::default())
            .expect("finite");
        let geometry = Geometry::new(group, AcceleratorKind::default());
        let point = (out * distance).as_vec3();
        let receiver = Surface {
            point,
            above: point,
            below: point,
            error: 0.0,
            normal: (-out).as_vec3(),
        };
        let target = lamp
            .sample_area(
                rng.next_in_unit_interval() as f32,
                rng.next_in_unit_interval() as f32,
            )
            .0
            .to_scalar::<f32>();
        let Some((ray, range)) = receiver.spawn_ray_to_surface(&target) else {
            return Verdict::Wrong("no ray".into());
        };
        let dark = geometry.occluded(&ray, range, &mut |_| true, &mut ());
        require(!dark, || {
            format!("its own shadow from {distance:e}{}", format_ray_bits(&ray))
        })
    })
    .expect_right(50_000);
}
