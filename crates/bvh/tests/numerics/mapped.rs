//! P23: shapes under affine maps, intersected in their own space and shaded in the world.

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::{
    AnyShape, Cuboid, Cylinder, CylinderEnds, Quad, Sphere, Torus, TransformedShape, Triangle,
};
use raywright_bvh::{
    AcceleratorKind, Geometry, Interval, PreparedRay, PrimitiveSet, Ray, Real, Side, Surface,
    Visibility,
};

use super::support::{
    CaseRng, Expect, UNIT_ROUNDOFF, Verdict, create_ray_towards, format_ray_bits, judge,
    round_to_f32, to_scalar, within,
};

/// Scales from 1e-3 to 1e3 in each axis, sheared, rotated and, every other time, reflected.
fn map(rng: &mut CaseRng) -> DAffine3 {
    let scale = DVec3::from_array(core::array::from_fn(|_| {
        10_f64.powf(rng.next_uniform(-3.0, 3.0)) * rng.next_sign()
    }));
    let mut shear = DMat3::IDENTITY;
    (shear.y_axis.x, shear.z_axis.x, shear.z_axis.y) = (
        rng.next_uniform(-1.0, 1.0),
        rng.next_uniform(-1.0, 1.0),
        rng.next_uniform(-1.0, 1.0),
    );
    let turn = |rng: &mut CaseRng| {
        DMat3::from_axis_angle(rng.sample_direction(), rng.next_uniform(0.0, 6.0))
    };
    let matrix = turn(rng) * shear * DMat3::from_diagonal(scale) * turn(rng);
    DAffine3 {
        matrix3: matrix,
        translation: rng.sample_direction() * 10_f64.powf(rng.next_uniform(-3.0, 3.0)),
    }
}

/// A shape and one of its points, away from its edges.
fn shape<R: Real>(rng: &mut CaseRng, kind: usize) -> (AnyShape<R>, DVec3) {
    let v = |p: DVec3| to_scalar::<R>(round_to_f32(p));
    let r = |x: f64| R::from_f64(f64::from(x as f32));
    let (centre, radius) = (
        round_to_f32(rng.sample_point_in_cube() * 2.0),
        f64::from(rng.next_uniform(0.2, 2.0) as f32),
    );
    let (a, b) = (rng.next_uniform(0.1, 0.45), rng.next_uniform(0.1, 0.45));
    let angle = rng.next_in_unit_interval() * core::f64::consts::TAU;
    let round = DVec3::new(angle.cos(), 0.0, angle.sin());
    match kind {
        0 => (
            Sphere {
                centre: v(centre),
                radius: r(radius),
            }
            .into(),
            centre + rng.sample_direction() * radius,
        ),
        1 => {
            let corners = [
                rng.sample_point_in_cube(),
                rng.sample_point_in_cube(),
                rng.sample_point_in_cube(),
            ]
            .map(round_to_f32);
            let target = corners[0] + (corners[1] - corners[0]) * a + (corners[2] - corners[0]) * b;
            (
                Triangle {
                    vertices: corners.map(to_scalar::<R>),
                }
                .into(),
                target,
            )
        }
        2 => {
            let size = DVec3::new(radius, 0.5 * radius, 2.0 * radius);
            let (min, max) = (round_to_f32(centre - size), round_to_f32(centre + size));
            let target =
                min + (max - min) * DVec3::new(a, if rng.next_sign() > 0.0 { 0.0 } else { 1.0 }, b);
            (
                Cuboid {
                    min: v(min),
                    max: v(max),
                }
                .into(),
                target,
            )
        }
        3 => {
            let (eu, ev) = (
                round_to_f32(rng.sample_point_in_cube()),
                round_to_f32(rng.sample_point_in_cube()),
            );
            let corners = [centre, centre + eu, centre + eu + ev, centre + ev].map(v);
            (Quad { corners }.into(), centre + eu * a + ev * b)
        }
        4 => {
            let axis = DVec3::Y * 2.0;
            let target = centre + axis * (0.2 + a) + round * radius;
            (
                Cylinder {
                    base: v(centre),
                    axis: v(axis),
                    radius: r(radius),
                    ends: CylinderEnds::Capped,
                }
                .into(),
                target,
            )
        }
        _ => {
            let tube = 0.3 * radius;
            let out = DVec3::Y * (6.0 * b).sin() + round * (6.0 * b).cos();
            let (major_radius, minor_radius) = (r(radius), r(tube));
            (
                Torus {
                    centre: v(centre),
                    axis: v(DVec3::Y),
                    major_radius,
                    minor_radius,
                }
                .into(),
                centre + round * radius + out * tube,
            )
        }
    }
}

const KINDS: [&str; 6] = ["sphere", "triangle", "box", "quad", "cylinder", "torus"];

/// The expected hit in f64: distance, point in object space, and point and unit normal in the
/// world.
struct Expected {
    t: f64,
    own: DVec3,
    point: DVec3,
    normal: DVec3,
}

/// A double-double number: the second is the rounding error of the first.
type Double = (f64, f64);

fn sum(a: Double, b: Double) -> Double {
    let total = a.0 + b.0;
    let part = total - a.0;
    let rest = (a.0 - (total - part)) + (b.0 - part) + a.1 + b.1;
    (total + rest, rest - ((total + rest) - total))
}

fn product(a: Double, b: Double) -> Double {
    let total = a.0 * b.0;
    let rest = a.0.mul_add(b.0, -total) + (a.0 * b.1 + a.1 * b.0);
    (total + rest, rest - ((total + rest) - total))
}

/// a·(b × c) in double-double arithmetic, rounded.
fn determinant(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let term = |k: usize| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let minor = sum(
            product((b[i], 0.0), (c[j], 0.0)),
            product((-b[j], 0.0), (c[i], 0.0)),
        );
        product((a[k], 0.0), minor)
    };
    sum(sum(term(0), term(1)), term(2)).0
}

/// M⁻¹·b by Cramer's rule, accurate to the last digits for any condition number of M.
pub fn solved(m: DMat3, b: DVec3) -> DVec3 {
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    DVec3::new(
        determinant(b, y, z),
        determinant(x, b, z),
        determinant(x, y, b),
    ) / determinant(x, y, z)
}

fn expected(shape: &AnyShape<f64>, map: DAffine3, o: DVec3, d: DVec3) -> Option<Expected> {
    use raywright_bvh::Shape;
    let m = map.matrix3;
    let prepared_ray = PreparedRay::new(Ray::<f64>::new(
        solved(m, o - map.translation),
        solved(m, d),
    ));
    let hit = shape.intersect(&prepared_ray, Interval::positive(), Side::Both)?;
    let surface_point = shape.locate_surface_point(&prepared_ray, hit);
    let normal = solved(m.transpose(), surface_point.normal).normalize();
    Some(Expected {
        t: hit.t,
        own: surface_point.point,
        point: o + d * hit.t,
        normal,
    })
}

/// Compares a hit with the expected one. `turn` bounds the angle error of the normal. A flat face
/// has a constant normal; the normal of a curved face has the error of the point in object space,
/// magnified by the map, for which P16's bound is used.
fn compare(
    turn: f64,
    expected: &Expected,
    map: DAffine3,
    t: f32,
    surface: &Surface<f32>,
    d: DVec3,
    ray: &Ray<f32>,
) -> Verdict {
    let m = map.matrix3;
    let sum = m.x_axis.abs() * expected.own.x.abs()
        + m.y_axis.abs() * expected.own.y.abs()
        + m.z_axis.abs() * expected.own.z.abs();
    let gamma = 3.0 * UNIT_ROUNDOFF / (1.0 - 3.0 * UNIT_ROUNDOFF);
    let bound = (sum + map.translation.abs()) * (16.0 * gamma);
    let off = (surface.point.as_dvec3() - expected.point).abs() / bound;
    let normal = surface.normal.as_dvec3();
    let angle = normal
        .cross(expected.normal)
        .length()
        .atan2(normal.dot(expected.normal));
    within(off.max_element(), 1.0, || {
        format!(
            "point {:?} for {:?}{}",
            surface.point,
            expected.point,
            format_ray_bits(ray)
        )
    }) & (within(angle, turn, || {
        format!(
            "normal {normal:?} for {:?}{}",
            expected.normal,
            format_ray_bits(ray)
        )
    })) & {
        let late = (f64::from(t) - expected.t).abs() * d.length();
        within(late, 4.0 * UNIT_ROUNDOFF * expected.t * d.length(), || {
            format!("t {t} for {}{}", expected.t, format_ray_bits(ray))
        })
    }
}

/// Protects: points, normals and distances of mapped shapes, single and instanced, compared with
/// f64 in the world; outward normals stay outward under reflection.
#[test]
fn p23_mapped_shapes() {
    for (kind, name) in KINDS.iter().enumerate() {
        let turn = if matches!(*name, "triangle" | "box" | "quad") {
            4.0 * UNIT_ROUNDOFF
        } else {
            1e-4
        };
        judge(&format!("P23 {name}"), 70 + kind as u64, 60_000, |rng| {
            let map = map(rng);
            let seed = rng.next_bits();
            let (own, target) = shape::<f32>(&mut CaseRng::new(seed, 0), kind);
            let (best, _) = shape::<f64>(&mut CaseRng::new(seed, 0), kind);
            let target = map.transform_point3(target);
            let away = rng.sample_direction() * 10_f64.powf(rng.next_uniform(-1.0, 3.0));
            let ray = create_ray_towards::<f32>(target + away, target);
            let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let Some(wanted_value) = expected(&best, map, o, d) else {
                return Verdict::Skipped;
            };
            // A ray whose hit changes when moved by the f64 error of a map of condition 1e6 is not
            // judged.
            let (a, b) = d.any_orthonormal_pair();
            let step = 1e-9 * (wanted_value.t + wanted_value.point.length());
            let moved = [a, -a, b, -b].map(|direction| {
                expected(&best, map, o + direction * step, d).map_or(f64::INFINITY, |e| e.t)
            });
            let steep = wanted_value.normal.dot(d).abs();
            if moved
                .iter()
                .any(|t| (t - wanted_value.t).abs() > 1e2 * step / steep)
            {
                return Verdict::Skipped;
            }
            let transformed_shape =
                TransformedShape::<f32>::new(own, map).expect("an invertible map");
            let prepared_ray = PreparedRay::new(ray);
            let outward = if wanted_value.normal.dot(d) < 0.0 {
                Side::Outside
            } else {
                Side::Inside
            };
            let Some(hit) =
                transformed_shape.intersect(&prepared_ray, Interval::positive(), outward)
            else {
                return Verdict::Wrong(format!("missed from {outward:?}{}", format_ray_bits(&ray)));
            };
            let surface = transformed_shape
                .locate_surface_point(&prepared_ray, hit)
                .to_scalar::<f32>();
            compare(turn, &wanted_value, map, hit.t, &surface, d, &ray) & {
                let geometry = instance(own, map);
                let Some(hit) = geometry.closest(&ray, Interval::positive(), &mut ()) else {
                    return Verdict::Wrong(format!("instance missed{}", format_ray_bits(&ray)));
                };
                compare(
                    turn,
                    &wanted_value,
                    map,
                    hit.t,
                    &geometry.surface(&ray, &hit),
                    d,
                    &ray,
                )
            }
        })
        .expect_right(50_000);
    }
}

/// One instance of a geometry with a single shape.
fn instance(shape: AnyShape<f32>, map: DAffine3) -> Geometry<f32> {
    let mut inner = PrimitiveSet::<f32>::default();
    inner
        .add_shape(shape, Visibility::default())
        .expect("finite");
    let mut group = PrimitiveSet::<f32>::default();
    let inner = group
        .add_part(Geometry::new(inner, AcceleratorKind::default()))
        .expect("no instances in it");
    group
        .add_instance(inner, map, Visibility::default())
        .expect("an invertible map");
    Geometry::new(group, AcceleratorKind::default())
}
