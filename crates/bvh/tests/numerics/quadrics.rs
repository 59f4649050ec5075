//! P10, P12, P13, P15, P16: cylinders, cones, hyperboloids and ellipsoids with a vanishing
//! coefficient or of extreme shape.

use glam::DVec3;
use raywright_bvh::shapes::{Cone, Cylinder, CylinderEnds, Ellipsoid};
use raywright_bvh::{Interval, PreparedRay, Shape, Side};

use super::support::{
    Expect, UNIT_ROUNDOFF, Verdict, create_ray_towards, create_unnormalised_ray, expect_all,
    expect_hard, format_ray_bits, judge, nearest_hit, require, round_to_f32, to_precision,
    to_scalar, within,
};
use raywright_bvh::stability::quadrics::{EXTREME_SEMI_AXES, draw_ray_to_ellipsoid};

/// Protects: rays nearly along a cylinder, from inside and outside, hit the wall; rays exactly
/// along it hit the cap.
#[test]
fn p10_cylinder_along_its_axis() {
    judge("P10", 20, 400_000, |rng| {
        let angle = rng.choose(&[1e-1, 1e-3, 1e-5, 1e-8, 0.0]);
        let radius = f64::from(rng.next_uniform(0.1, 10.0) as f32);
        let height = f64::from(rng.next_uniform(0.5, 100.0) as f32);
        let base = round_to_f32(DVec3::new(
            rng.next_uniform(-5.0, 5.0),
            rng.next_uniform(-5.0, 5.0),
            rng.next_uniform(-5.0, 5.0),
        ));
        let inside = rng.next_sign() > 0.0;
        let reach = if inside {
            rng.next_uniform(0.0, 0.99)
        } else {
            rng.next_uniform(1.01, 3.0)
        };
        let out = rng.sample_offset_in_disc(DVec3::Y, 1.0).normalize();
        let origin = round_to_f32(
            base + out * (reach * radius) + DVec3::Y * (height * rng.next_uniform(0.01, 0.99)),
        );
        let toward = if inside {
            rng.sample_offset_in_disc(DVec3::Y, 1.0).normalize()
        } else {
            -out
        };
        let d = round_to_f32((toward * angle + DVec3::Y * rng.next_sign()).normalize());
        let ray = create_unnormalised_ray::<f32>(origin, d);
        let ends = rng.choose(&[CylinderEnds::None, CylinderEnds::Capped]);
        let shape = Cylinder::<f32> {
            base: to_scalar::<f32>(base),
            axis: to_scalar::<f32>(DVec3::Y * height),
            radius: radius as f32,
            ends,
        };
        let off = |p: DVec3| DVec3::new(p.x - base.x, 0.0, p.z - base.z).length() - radius;
        let got = nearest_hit::<f32>(&shape, &ray);
        let along = d.x == 0.0 && d.z == 0.0;
        let Some(h) = got else {
            let hits = if ends == CylinderEnds::None {
                inside && !along
            } else {
                off(origin) < 0.0
            };
            return require(!hits, || {
                format!("missed at angle {angle}{} {shape:?}", format_ray_bits(&ray))
            });
        };
        if along && ends == CylinderEnds::None {
            return Verdict::Wrong(format!("wall hit along the axis{}", format_ray_bits(&ray)));
        }
        let t = f64::from(h.t);
        let p = origin + d * t;
        let surface = shape.surface(&PreparedRay::new(ray), h);
        if !(surface.point.is_finite() && surface.normal.is_finite()) {
            return Verdict::Wrong(format!("not finite{}", format_ray_bits(&ray)));
        }
        let bound = 8.0 * UNIT_ROUNDOFF * (t + radius);
        // On the wall between the ends, or on an end within the wall.
        let (wall, low, high) = (off(p), base.y - p.y, p.y - base.y - height);
        let caps = low.abs().min(high.abs()).max(wall);
        let error = if ends == CylinderEnds::None {
            wall.abs()
        } else {
            wall.abs().max(low).max(high).min(caps)
        };
        within(error, bound, || {
            format!("off at angle {angle}{} {shape:?}", format_ray_bits(&ray))
        }) & (require(!along || surface.normal.y.abs() == 1.0, || {
            format!("not the cap{}", format_ray_bits(&ray))
        }))
    })
    .expect_right(400_000);
}

/// Protects: rays through or near a cone's apex, and towards the opposite nappe, hit nothing beyond
/// the apex, and every hit has a normal.
#[test]
fn p12_cone_tip_and_other_nappe() {
    judge("P12", 22, 600_000, |rng| {
        let (base, axis) = (
            round_to_f32(rng.sample_point_in_cube() * 3.0),
            round_to_f32(rng.sample_direction() * rng.next_uniform(0.3, 4.0)),
        );
        let radius = f64::from(rng.next_uniform(0.05, 3.0) as f32);
        let cone = Cone::<f32> {
            base: to_scalar::<f32>(base),
            axis: to_scalar::<f32>(axis),
            radius: radius as f32,
            top_radius: 0.0,
        };
        let tip = base + axis;
        let target = match rng.next_bits() % 3 {
            0 => tip,
            1 => tip + rng.sample_point_in_cube() * 1e-6,
            // The opposite nappe: the cone mirrored at its apex.
            _ => {
                tip + axis * rng.next_in_unit_interval()
                    + rng.sample_offset_in_disc(axis.normalize(), radius)
            }
        };
        let ray = create_ray_towards::<f32>(
            target + rng.sample_direction() * rng.next_uniform(1.0, 8.0),
            target,
        );
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let prepared_ray = PreparedRay::new(ray);
        for side in [Side::Both, Side::Outside, Side::Inside] {
            let Some(h) = cone.intersect(&prepared_ray, Interval::positive(), side) else {
                continue;
            };
            let p = o + d * f64::from(h.t);
            let scale = o.abs().max_element() + p.abs().max_element() + f64::from(h.t);
            let beyond = (p - tip).dot(axis) / axis.length();
            let normal = cone.surface(&prepared_ray, h).normal.as_dvec3();
            if beyond > 4.0 * UNIT_ROUNDOFF * scale {
                return Verdict::Wrong(format!(
                    "hit {beyond:e} beyond the tip{} {cone:?}",
                    format_ray_bits(&ray)
                ));
            }
            let unit = (normal.length() - 1.0).abs() <= 2.0 * UNIT_ROUNDOFF;
            if !unit {
                return Verdict::Wrong(format!(
                    "normal {normal:?}{} {cone:?}",
                    format_ray_bits(&ray)
                ));
            }
        }
        Verdict::Right(0.0)
    })
    .expect_right(600_000);
}

/// Protects: rays parallel or nearly parallel to a generator or an asymptote keep their near root.
#[test]
fn p13_vanishing_leading_coefficient() {
    let textbook = expect_all("P13", 0.025);
    expect_hard(&textbook, "1e-7", 0.2);
}

/// Protects: flat and needle-like ellipsoids are never missed, and distances are right to a
/// thousandth of the least axis.
#[test]
fn p15_extreme_ellipsoids() {
    expect_hard(&expect_all("P15", 0.95), "k = 1e-3", 0.1);
}

/// Protects: the normals of these ellipsoids, everywhere and at the flat pole and the sharp rim.
#[test]
fn p16_extreme_normals() {
    for k in EXTREME_SEMI_AXES {
        let semi = round_to_f32(DVec3::new(1.0, 1.0, k));
        let shape = &Ellipsoid::<f32>::new(DVec3::ZERO, semi);
        let outcome = judge(
            &format!("P16 k = {k:e}"),
            25 + k.to_bits() % 97,
            200_000,
            |rng| {
                let Some((ray, t)) = draw_ray_to_ellipsoid(rng, semi) else {
                    return Verdict::Skipped;
                };
                let (p, ray) = (ray.at(t), to_precision::<f32>(ray));
                let gradient = (p / (semi * semi)).normalize();
                let Some(h) = nearest_hit::<f32>(shape, &ray) else {
                    return Verdict::Wrong(format!("missed{}", format_ray_bits(&ray)));
                };
                let n = shape.surface(&PreparedRay::new(ray), h).normal.as_dvec3();
                let angle = n.cross(gradient).length().atan2(n.dot(gradient));
                within(angle, 1e-4, || {
                    format!(
                        "normal {n:?} instead of {gradient:?}{}",
                        format_ray_bits(&ray)
                    )
                }) & (within((n.length() - 1.0).abs(), 2.0 * UNIT_ROUNDOFF, || {
                    format!("length{}", format_ray_bits(&ray))
                }))
            },
        );
        outcome.expect_right(190_000);
        // Straight at the pole and at the rim.
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            for sign in [-1.0, 1.0] {
                let ray = create_unnormalised_ray::<f32>(
                    axis * (sign * 10.0 * semi.max_element()),
                    axis * -sign,
                );
                let h = nearest_hit::<f32>(shape, &ray).expect("aimed at the centre");
                let n = shape.surface(&PreparedRay::new(ray), h).normal.as_dvec3();
                assert!(
                    n.distance(axis * sign) <= 2.0 * UNIT_ROUNDOFF,
                    "k = {k}: normal {n:?} at {:?}",
                    axis * sign
                );
            }
        }
    }
}
