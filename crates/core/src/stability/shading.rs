//! Numerically hard cases S09, S10, S11: shading frames about normals, normalisation of vectors,
//! and long paths between mirrors.

use raywright_bvh::stability::prelude::*;
use raywright_bvh::stability::sphere::build_sphere;

use crate::material::{Bsdf, Lobe, NormalMap, ShadingFrame, SmoothInterface};

/// Draws a unit normal in the precision `R`. It is uniform, close to an axis, or along an axis with
/// positive and negative zeros.
fn draw_normal<R: Real>(rng: &mut CaseRng) -> R::Vec3 {
    let axis = rng.next_bits() as usize % 3;
    let mut n = match rng.next_bits() % 5 {
        0 => {
            let zero = |rng: &mut CaseRng| rng.choose(&[0.0, -0.0]);
            DVec3::new(zero(rng), zero(rng), zero(rng))
        }
        1 | 2 => rng.sample_point_in_cube() * rng.choose(&[1e-2, 1e-3, 1e-4]),
        _ => return to_scalar::<R>(rng.sample_direction()),
    };
    n[axis] = rng.next_sign();
    to_scalar::<R>(n / n.length())
}

/// Judges three vectors by their largest deviation from an orthonormal frame, measured by their
/// lengths and dot products.
fn judge_frame<const N: usize>(frame: [DVec3; 3], bits: [u32; N]) -> Verdict {
    let [t, b, n] = frame;
    let errors = [t.dot(b), b.dot(n), n.dot(t)].into_iter();
    let errors = errors.chain(frame.map(|v| v.length() - 1.0));
    errors.fold(Verdict::Right(0.0), |verdict, error| {
        verdict.and_then(|| {
            Verdict::from_error(error.abs(), 4e-7, || format!("frame about {bits:08x?}"))
        })
    })
}

/// Returns the shading frame about a normal by the textbook formula. The formula always divides by
/// 1 + z, also for negative z, and fails near z = −1.
pub(super) fn textbook_shading_frame(n: Vec3) -> [Vec3; 3] {
    let a = 1.0 / (1.0 + n.z);
    let b = -n.x * n.y * a;
    [
        Vec3::new(1.0 - n.x * n.x * a, b, -n.x),
        Vec3::new(b, 1.0 - n.y * n.y * a, -n.y),
        n,
    ]
}

/// Judges case S09: shading frames about any normal must be orthonormal.
pub(super) fn shading_frames<R: Real>(trial: &mut Trial<R>) {
    trial.judge("", (401, 1_000_000), |rng| {
        let n = draw_normal::<R>(rng);
        let bits = n.to_f32().to_array().map(f32::to_bits);
        let frame = ShadingFrame::<R>::from_normal(n);
        let frame = [frame.tangent, frame.bitangent, frame.normal].map(Vector::to_f64);
        let textbook = textbook_shading_frame(n.to_f32()).map(|v| v.as_dvec3());
        [frame, textbook].map(|frame| judge_frame(frame, bits))
    });
}

/// Judges case S10: normalisation of vectors of any length. These are the normal from a normal map,
/// the tangent of its frame, and the reflected direction at a boundary.
pub(super) fn normalisation<R: Real>(trial: &mut Trial<R>) {
    trial.judge("", (402, 200_000), |rng| {
        let n = to_scalar::<R>(rng.sample_direction());
        let length = rng.choose(&[0.0, 1e-30, 1e-22, 1e-10, 1.0, 1e10, 1e19]);
        let v = to_scalar::<R>(rng.sample_direction() * length);
        let unit = |w: DVec3, bound: f64| {
            Verdict::from_error((w.length() - 1.0).abs(), bound, || {
                let bits = v.to_f32().to_array().map(f32::to_bits);
                format!("deviation from length 1 of a normalised vector, of length {length:e} and bits {bits:08x?} before")
            })
        };
        let roundoff = R::ROUNDOFF.to_f64();
        // The stored normal has unit length within one rounding of each component.
        let within = 2.0 * roundoff + (n.to_f64().length() - 1.0).abs();
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
        let mapped = unit(map.perturbed_normal().to_f64(), 4.0 * roundoff + within)
            .and_then(|| unit(frame.tangent.to_f64(), 4e-7_f64.max(within)));
        [if length == 0.0 {
            mapped
        } else {
            mapped.and_then(|| unit(reflected, 2.0 * roundoff.max(1e-15)))
        }]
    });
}

/// Number of bounces of a ray between mirrors; below, the number of rays for each arrangement of
/// mirrors.
const BOUNCES: u32 = 10_000;
const MIRRORED: u32 = 60;

/// Traces a ray between mirrors by the same operations as a path: closest hit, surface, mirror lobe,
/// and start of the next ray. Judges two errors: the deviation of the direction's length from 1, and
/// the change of `invariant`, a function that is constant along an exact path.
fn judge_mirror_bounces<R: Real>(
    mirrors: impl IntoIterator<Item = AnyShape<R>>,
    mut ray: Ray<R>,
    invariant: impl Fn(&Ray<R>) -> f64,
) -> Verdict {
    let geometry = build_geometry(mirrors, AcceleratorKind::Linear);
    let before = invariant(&ray);
    let (mut length, mut drift) = (0.0_f64, 0.0_f64);
    for bounce in 0..BOUNCES {
        let Some(hit) = geometry.closest(&ray, Interval::positive(), &mut ()) else {
            return Verdict::Wrong(format!("the ray escapes at bounce {bounce}"));
        };
        let surface = geometry.surface(&ray, &hit);
        let normal = if surface.normal.dot(ray.direction) < R::ZERO {
            surface.normal
        } else {
            -surface.normal
        };
        let mirror = Bsdf::<R>::new(normal).with_lobe(Lobe::Mirror {
            f0: Vector::ONE,
            f90: Vector::ONE,
        });
        let frame = ShadingFrame::from_normal(normal);
        let direction = mirror
            .sample(&frame, -ray.direction, [R::ZERO; 3])
            .direction;
        ray = Ray::new(surface.spawn_ray_origin(direction), direction);
        length = length.max((direction.to_f64().length() - 1.0).abs());
        drift = drift.max((invariant(&ray) - before).abs());
    }
    Verdict::from_error(
        length,
        1e-5,
        || "deviation of the direction's length from 1",
    )
    .and_then(|| Verdict::from_error(drift, 1e-3, || "change of the ray's constant"))
}

/// Judges case S11. Rays between two parallel mirrors must keep their angle. Rays in a mirrored ball
/// must keep their distance from the centre.
pub(super) fn mirror_bounces<R: Real>(trial: &mut Trial<R>) {
    trial.judge("between walls", (403, MIRRORED), |rng| {
        let n = rng.sample_direction();
        let (x, y) = n.any_orthonormal_pair();
        let half = 1e5;
        let wall =
            |at: f64| Quad::new(n * at - (x + y) * half, x * (2.0 * half), y * (2.0 * half)).into();
        let d = n + x * rng.next_uniform(-2.0, 2.0) + y * rng.next_uniform(-2.0, 2.0);
        let ray = create_unnormalised_ray(DVec3::ZERO, round_to_f32(d.normalize()));
        let angle = |ray: &Ray<R>| ray.direction.to_f64().normalize().dot(n).abs();
        [judge_mirror_bounces([wall(-1.0), wall(1.0)], ray, angle)]
    });
    trial.judge("in a ball", (404, MIRRORED), |rng| {
        let d = round_to_f32(rng.sample_direction());
        let origin = round_to_f32(rng.sample_direction() * rng.next_uniform(0.1, 0.9));
        let distance = |ray: &Ray<R>| {
            let d = ray.direction.to_f64();
            ray.origin.to_f64().cross(d / d.length()).length()
        };
        let ball = build_sphere(DVec3::ZERO, 1.0).into();
        [judge_mirror_bounces(
            [ball],
            create_unnormalised_ray(origin, d),
            distance,
        )]
    });
}
