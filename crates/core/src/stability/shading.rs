//! Numerically hard cases S09, S10, S11: shading frames about normals, normalisation of vectors,
//! and long paths between mirrors.

use raywright_bvh::stability::prelude::*;
use raywright_bvh::stability::shapes::build_sphere;

use crate::material::{Bsdf, Lobe, NormalMap, ShadingFrame, SmoothInterface};

/// Draws a unit normal in the precision `R`. It is uniform, close to an axis, or along an axis with
/// positive and negative zeros.
fn draw_normal<R: Real>(rng: &mut CaseRng) -> R::Vec3 {
    let axis = rng.next_bits() as usize % 3;
    let mut n = match rng.next_bits() % 5 {
        0 => DVec3::from_array([(); 3].map(|()| rng.choose(&[0.0, -0.0]))),
        1 | 2 => rng.sample_point_in_cube() * rng.choose(&[1e-2, 1e-3, 1e-4]),
        _ => return to_scalar::<R>(rng.sample_direction()),
    };
    n[axis] = rng.next_sign();
    to_scalar::<R>(n / n.length())
}

/// Returns the shading frame about a normal by the textbook formula: tangent and bitangent. The
/// formula always divides by 1 + z, also for negative z, and fails near z = −1.
pub(super) fn textbook_shading_frame(n: Vec3) -> [Vec3; 2] {
    let a = 1.0 / (1.0 + n.z);
    let b = -n.x * n.y * a;
    [
        Vec3::new(1.0 - n.x * n.x * a, b, -n.x),
        Vec3::new(b, 1.0 - n.y * n.y * a, -n.y),
    ]
}

/// Traces a ray between mirrors by the same operations as a path: closest hit, surface, mirror lobe,
/// and start of the next ray. Judges two errors after ten thousand bounces: the deviation of the
/// direction's length from 1, and the change of `invariant`, a function that is constant along an
/// exact path.
fn judge_mirror_bounces<R: Real>(
    mirrors: &[AnyShape<R>],
    mut ray: Ray<R>,
    invariant: impl Fn(&Ray<R>) -> f64,
) -> Verdict {
    let geometry = build_geometry(mirrors, AcceleratorKind::Linear);
    let before = invariant(&ray);
    let (mut length, mut drift) = (0.0_f64, 0.0_f64);
    for bounce in 0..10_000 {
        let Some(hit) = geometry.closest(&ray, Interval::positive(), &mut ()) else {
            return require(false, || format!("the ray escapes at bounce {bounce}"));
        };
        let surface = geometry.surface(&ray, &hit);
        let is_front = surface.normal.dot(ray.direction) < R::ZERO;
        let normal = if is_front {
            surface.normal
        } else {
            -surface.normal
        };
        let [f0, f90] = [R::Vec3::ONE; 2];
        let mirror = Bsdf::<R>::new(normal).with_lobe(Lobe::Mirror { f0, f90 });
        let frame = ShadingFrame::from_normal(normal);
        let direction = mirror
            .sample(&frame, -ray.direction, [R::ZERO; 3])
            .direction;
        ray = Ray::new(surface.spawn_ray_origin(direction), direction);
        length = length.max((direction.to_f64().length() - 1.0).abs());
        drift = drift.max((invariant(&ray) - before).abs());
    }
    within(
        length,
        1e-5,
        || "deviation of the direction's length from 1",
    ) & within(drift, 1e-3, || "change of the ray's constant")
}

/// Cases of shading.
pub(super) fn cases<R: Real>() -> Vec<Case<R>> {
    vec![
        // Shading frames about any normal must be orthonormal, measured by lengths and dot products.
        ("S09", |trial| {
            trial.judge("", (401, 1_000_000), BOTH, |rng, formula| {
                let normal = draw_normal::<R>(rng);
                let [t, b] = if formula.is_textbook {
                    textbook_shading_frame(normal.to_f32()).map(|v| v.as_dvec3())
                } else {
                    let frame = ShadingFrame::<R>::from_normal(normal);
                    [frame.tangent, frame.bitangent].map(Vector::to_f64)
                };
                let n = normal.to_f64();
                let lengths = [t, b, n].map(|v| v.length() - 1.0);
                let errors = [lengths, [t.dot(b), b.dot(n), n.dot(t)]];
                let judge = |error: &f64| {
                    within(
                        error.abs(),
                        bound_in::<R>(4e-7).max(8.0 * f64::ROUNDOFF),
                        || format!("frame about {normal:?}"),
                    )
                };
                errors
                    .as_flattened()
                    .iter()
                    .map(judge)
                    .fold(Verdict::Right(0.0), |a, b| a & b)
            });
        }),
        // Normalisation of vectors of any length. These are the normal from a normal map, the
        // tangent of its frame, and the reflected direction at a boundary.
        ("S10", |trial| {
            trial.judge("", (402, 200_000), LIBRARY, |rng, _| {
                let n = to_scalar::<R>(rng.sample_direction());
                let length = rng.choose(&[0.0, 1e-30, 1e-22, 1e-10, 1.0, 1e10, 1e19]);
                let v = to_scalar::<R>(rng.sample_direction() * length);
                let unit = |w: DVec3, bound: f64| {
                    within((w.length() - 1.0).abs(), bound, || {
                        format!("deviation from length 1 of {w:?}, normalised of {v:?}")
                    })
                };
                let roundoff = R::ROUNDOFF.to_f64();
                // The stored normal has unit length within one rounding of each component.
                let stored = 2.0 * roundoff + (n.to_f64().length() - 1.0).abs();
                let frame = ShadingFrame::<R>::from_tangent(n, v, false);
                let direction = round_to_f32(rng.sample_direction());
                let map = NormalMap::<R> {
                    normal: n,
                    along: frame.tangent,
                    mirrored: false,
                    code: v,
                    geometric: n,
                    outside: true,
                    direction: to_scalar::<R>(direction * -n.to_f64().dot(direction).signum()),
                };
                let reflected = SmoothInterface::new(v.to_f64(), n.to_f64(), 1.0).reflected;
                let mapped = unit(map.perturbed_normal().to_f64(), 4.0 * roundoff + stored)
                    & unit(frame.tangent.to_f64(), 4e-7_f64.max(stored));
                if length == 0.0 {
                    return mapped;
                }
                mapped & unit(reflected, 2.0 * roundoff.max(1e-15))
            });
        }),
        // Rays between two parallel mirrors must keep their angle. Rays in a mirrored ball must keep
        // their distance from the centre.
        ("S11", |trial| {
            trial.judge("between walls", (403, 60), LIBRARY, |rng, _| {
                let n = rng.sample_direction();
                let (x, y) = n.any_orthonormal_pair();
                let [a, b] = [x, y].map(|side| side * 1e5);
                let wall = |at: f64| Quad::new(n * at - (a + b), a * 2.0, b * 2.0).into();
                let [u, v] = [x, y].map(|side| side * rng.next_uniform(-2.0, 2.0));
                let d = round_to_f32((n + u + v).normalize());
                let ray = create_unnormalised_ray(DVec3::ZERO, d);
                let angle = |ray: &Ray<R>| ray.direction.to_f64().normalize().dot(n).abs();
                judge_mirror_bounces(&[wall(-1.0), wall(1.0)], ray, angle)
            });
            trial.judge("in a ball", (404, 60), LIBRARY, |rng, _| {
                let d = round_to_f32(rng.sample_direction());
                let origin = round_to_f32(rng.sample_direction() * rng.next_uniform(0.1, 0.9));
                let distance = |ray: &Ray<R>| {
                    ray.origin
                        .to_f64()
                        .cross(ray.direction.to_f64().normalize())
                        .length()
                };
                let ball = build_sphere(DVec3::ZERO, 1.0).into();
                judge_mirror_bounces(&[ball], create_unnormalised_ray(origin, d), distance)
            });
        }),
    ]
}
