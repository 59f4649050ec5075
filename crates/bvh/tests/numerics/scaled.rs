//! Scale invariance: multiplying all lengths by a power of two changes no bit of a hit, since no
//! test contains an absolute length.

use glam::DVec3;
use raywright_bvh::shapes::{AnyShape, Sphere};
use raywright_bvh::{
    AcceleratorKind, Geometry, Interval, PreparedRay, PrimitiveSet, Ray, Real, Shape, Side, Vector,
    Visibility,
};

use super::stated::sized;
use super::support::{CaseRng, Expect, format_ray_bits, judge, require, round_to_f32, to_scalar};

/// Exponents of two from about 1e-9 to 1e9.
const EXPONENTS: [i32; 8] = [-30, -20, -7, -1, 1, 7, 20, 30];

/// All numbers of a hit, with lengths divided by `size`: distance, shape-specific numbers, point,
/// normal, error bound, texture coordinates.
fn said<R: Real>(shape: &AnyShape<R>, ray: &Ray<R>, size: f64) -> Option<[f64; 12]> {
    let prepared_ray = PreparedRay::new(*ray);
    let hit = shape.intersect(&prepared_ray, Interval::positive(), Side::Both)?;
    let (surface, parameters) = (
        shape.surface(&prepared_ray, hit),
        shape.texture_coordinates(&prepared_ray, hit),
    );
    let (p, n) = (surface.point.to_f64() / size, surface.normal.to_f64());
    let [t, u, v] = [hit.t, hit.u, hit.v].map(Real::to_f64);
    let error = surface.error.to_f64() / size;
    // A plane's texture coordinates are in metres, those of every other shape relative.
    let unit = if matches!(shape, AnyShape::Plane(_)) {
        size
    } else {
        1.0
    };
    let coordinates = [parameters.u, parameters.v].map(|x| x.to_f64() / unit);
    Some([
        t / size,
        u,
        v,
        p.x,
        p.y,
        p.z,
        n.x,
        n.y,
        n.z,
        error,
        coordinates[0],
        coordinates[1],
    ])
}

/// A ray at the shapes from one to a thousand sizes away, some along an axis.
fn aimed(rng: &mut CaseRng) -> (DVec3, DVec3) {
    let target = rng.sample_point_in_cube() * 1.5;
    let direction = if rng.next_bits().is_multiple_of(4) {
        DVec3::AXES[rng.ray_index() as usize % 3] * rng.next_sign()
    } else {
        rng.sample_direction()
    };
    let origin = round_to_f32(target - direction * 10_f64.powf(rng.next_uniform(0.3, 3.0)));
    (origin, round_to_f32(direction))
}

fn each_shape<R: Real>() {
    let shapes = sized::<R>(1.0);
    for exponent in EXPONENTS {
        let size = 2_f64.powi(exponent);
        for ((name, shape), (_, scaled)) in shapes.iter().zip(sized::<R>(size)) {
            let case = format!(
                "2^{exponent} times the {name} in {}",
                std::any::type_name::<R>()
            );
            judge(&case, 210, 3000, |rng| {
                let (o, d) = aimed(rng);
                let (ray, other) = (
                    Ray::new(to_scalar::<R>(o), to_scalar::<R>(d)),
                    Ray::new(to_scalar::<R>(o * size), to_scalar::<R>(d)),
                );
                let (expected, got) = (
                    said::<R>(shape, &ray, 1.0),
                    said::<R>(&scaled, &other, size),
                );
                let bits = |s: Option<[f64; 12]>| s.map(|s| s.map(f64::to_bits));
                require(bits(expected) == bits(got), || {
                    format!(
                        "{got:?} instead of {expected:?}{}",
                        format_ray_bits::<R>(&ray)
                    )
                })
            })
            .expect_right(3000);
        }
    }
}

/// Protects: no test, surface point, error bound or texture coordinate of a shape contains an
/// absolute length.
#[test]
fn powers_of_two_change_no_bit() {
    each_shape::<f32>();
    each_shape::<f64>();
}

/// Many bounded shapes in a tree.
fn crowd<R: Real>(size: f64) -> Geometry<R> {
    let mut group = PrimitiveSet::<R>::default();
    for (name, shape) in sized::<R>(size) {
        if let AnyShape::Sphere(s) = shape {
            for i in 0..40_u32 {
                let position = round_to_f32(
                    DVec3::new(f64::from(i % 4), f64::from(i / 4 % 4), f64::from(i / 16)) * 0.7,
                ) * size;
                let ball = Sphere {
                    centre: to_scalar::<R>(position),
                    radius: s.radius * R::from_f64(0.25),
                };
                group
                    .add_sphere(ball, Visibility::default())
                    .expect("finite");
            }
        } else if name != "plane" && name != "tube" {
            group
                .add_shape(shape, Visibility::default())
                .expect("finite");
        }
    }
    Geometry::new(group, AcceleratorKind::default())
}

/// Protects: boxes, their padding and the traversal contain no absolute length either.
#[test]
fn powers_of_two_change_no_bit_of_a_tree() {
    fn judged<R: Real>() {
        let plain = crowd::<R>(1.0);
        for exponent in EXPONENTS {
            let size = 2_f64.powi(exponent);
            let scaled = crowd::<R>(size);
            judge(
                &format!(
                    "2^{exponent} times a crowd in {}",
                    std::any::type_name::<R>()
                ),
                211,
                20_000,
                |rng| {
                    let (o, d) = aimed(rng);
                    let found = |geometry: &Geometry<R>, size: f64| {
                        let ray = Ray::new(to_scalar::<R>(o * size), to_scalar::<R>(d));
                        let hit = geometry.closest(&ray, Interval::positive(), &mut ())?;
                        Some((
                            hit.object,
                            [hit.t.to_f64() / size, hit.u.to_f64(), hit.v.to_f64()]
                                .map(f64::to_bits),
                        ))
                    };
                    let (expected, got) = (found(&plain, 1.0), found(&scaled, size));
                    require(expected == got, || {
                        format!("{got:?} instead of {expected:?}")
                    })
                },
            )
            .expect_right(20_000);
        }
    }
    judged::<f32>();
    judged::<f64>();
}
