//! Numerically hard cases S09, S10, S11: shading frames about normals, normalisation of vectors,
//! and long paths between mirrors.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use raywright_bvh::shapes::{AnyShape, Quad, Sphere};
use raywright_bvh::stability::verdicts::{
    CaseOutcome, CaseRng, RayCount, Verdict, create_unnormalised_ray, judge_rays, round_to_f32,
    to_scalar,
};
use raywright_bvh::stability::{Measurement, create_treeless_measurement};
use raywright_bvh::{
    AcceleratorKind, Geometry, Interval, PrimitiveSet, Ray, Real, Vector, Visibility,
};

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

/// Returns the largest deviation of three vectors from an orthonormal frame, measured by their
/// lengths and dot products.
fn orthonormality_error(frame: [DVec3; 3]) -> f64 {
    let [t, b, n] = frame;
    let lengths = frame.map(|v| (v.length() - 1.0).abs());
    [t.dot(b), b.dot(n), n.dot(t)]
        .into_iter()
        .chain(lengths)
        .fold(0.0, |maximum, x| {
            if x.abs() > maximum || x.is_nan() {
                x.abs()
            } else {
                maximum
            }
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

/// Measures case S09: shading frames about any normal must be orthonormal.
pub fn measure_shading_frames<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let describe = |n: R::Vec3| format!("{:08x?}", n.to_f32().to_array().map(f32::to_bits));
    let outcome = judge_rays("S09", 401, 1_000_000, rays, |rng| {
        let n = draw_normal::<R>(rng);
        let ShadingFrame {
            tangent,
            bitangent,
            normal,
        } = ShadingFrame::<R>::from_normal(n);
        Verdict::from_error(
            orthonormality_error([tangent, bitangent, normal].map(|v| v.to_f64())),
            4e-7,
            || describe(n),
        )
    });
    let textbook = judge_rays("S09", 401, 1_000_000, rays, |rng| {
        let n = draw_normal::<R>(rng);
        Verdict::from_error(
            orthonormality_error(textbook_shading_frame(n.to_f32()).map(|v| v.as_dvec3())),
            4e-7,
            || describe(n),
        )
    });
    vec![Measurement {
        textbook: Some(textbook),
        ..create_treeless_measurement::<R>(outcome)
    }]
}

/// Measures case S10: normalisation of vectors of any length. These are the normal from a normal
/// map, the tangent of its frame, and the reflected direction at a boundary.
pub fn measure_normalisation<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let outcome = judge_rays("S10", 402, 200_000, rays, |rng| {
        let n = to_scalar::<R>(rng.sample_direction());
        let length = rng.choose(&[0.0, 1e-30, 1e-22, 1e-10, 1.0, 1e10, 1e19]);
        let v = to_scalar::<R>(rng.sample_direction() * length);
        let describe = || {
            format!(
                "deviation from length 1 of a normalised vector, of length {length:e} and bits {:08x?} before",
                v.to_f32().to_array().map(f32::to_bits)
            )
        };
        let unit =
            |w: DVec3, bound: f64| Verdict::from_error((w.length() - 1.0).abs(), bound, describe);
        let roundoff = R::ROUNDOFF.to_f64();
        // The stored normal has unit length within one rounding of each component.
        let within = 2.0 * roundoff + (n.to_f64().length() - 1.0).abs();
        let frame = ShadingFrame::<R>::from_tangent(n, v, false);
        let direction = round_to_f32(rng.sample_direction());
        let facing = if n.to_f64().dot(direction) < 0.0 {
            direction
        } else {
            -direction
        };
        let map = NormalMap::<R> {
            normal: n,
            along: frame.tangent,
            mirrored: false,
            code: v,
            geometric: n,
            outside: true,
            direction: to_scalar::<R>(facing),
        };
        let interface = SmoothInterface::new(v.to_f64(), n.to_f64(), 1.0);
        unit(map.perturbed_normal().to_f64(), 4.0 * roundoff + within)
            .and_then(|| unit(frame.tangent.to_f64(), 4e-7_f64.max(within)))
            .and_then(|| {
                if length == 0.0 {
                    Verdict::Right(0.0)
                } else {
                    unit(interface.reflected, 2.0 * roundoff.max(1e-15))
                }
            })
    });
    vec![create_treeless_measurement::<R>(outcome)]
}

/// Number of bounces of a ray between mirrors; below, the number of rays for each arrangement of
/// mirrors.
const BOUNCES: u32 = 10_000;
const MIRRORED: u32 = 60;

/// Traces a ray between mirrors by the same operations as a path: closest hit, surface, mirror
/// lobe, and start of the next ray. Returns two errors; `None` if the ray escapes.
///
/// - The first is the largest deviation of the direction's length from 1.
/// - The second is the largest change of `invariant`, a function that is constant along an exact
///   path.
fn trace_mirror_bounces<R: Real>(
    geometry: &Geometry<R>,
    mut ray: Ray<R>,
    invariant: impl Fn(&Ray<R>) -> f64,
) -> Option<[f64; 2]> {
    let before = invariant(&ray);
    let (mut length, mut drift) = (0.0_f64, 0.0_f64);
    for _ in 0..BOUNCES {
        let hit = geometry.closest(&ray, Interval::positive(), &mut ())?;
        let surface = geometry.surface(&ray, &hit);
        let faces = surface.normal.dot(ray.direction) < R::ZERO;
        let normal = if faces {
            surface.normal
        } else {
            -surface.normal
        };
        let mirror = Bsdf::<R>::new(normal).with_lobe(Lobe::Mirror {
            f0: Vector::ONE,
            f90: Vector::ONE,
        });
        let bsdf_sample = mirror.sample(
            &ShadingFrame::from_normal(normal),
            -ray.direction,
            [R::ZERO; 3],
        );
        ray = Ray::new(
            surface.spawn_ray_origin(bsdf_sample.direction),
            bsdf_sample.direction,
        );
        length = length.max((ray.direction.to_f64().length() - 1.0).abs());
        drift = drift.max((invariant(&ray) - before).abs());
    }
    Some([length, drift])
}

/// Traces rays between mirrors in parallel and returns their errors. `made` traces one ray with its
/// own random numbers. See [`trace_mirror_bounces`] for the two errors.
fn trace_mirror_rays(
    seed: u64,
    made: impl Fn(&mut CaseRng) -> Option<[f64; 2]> + Sync,
) -> Vec<Option<[f64; 2]>> {
    (0..MIRRORED)
        .into_par_iter()
        .map(|index| made(&mut CaseRng::new(seed, index.into())))
        .collect()
}

/// Measures case S11. Rays between two parallel mirrors must keep their angle. Rays in a mirrored
/// ball must keep their distance from the centre. The errors are the change of this angle or
/// distance, and the deviation of the direction's length from 1.
pub fn measure_mirror_bounces<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let geometry = |shapes: &[AnyShape<R>]| {
        let mut group = PrimitiveSet::<R>::default();
        for &shape in shapes {
            group
                .add_shape(shape, Visibility::default())
                .expect("finite shapes");
        }
        Geometry::new(group, AcceleratorKind::Linear)
    };
    let walls = trace_mirror_rays(403, |rng| {
        let n = rng.sample_direction();
        let (x, y) = n.any_orthonormal_pair();
        let half = 1e5;
        let wall = |at: f64| {
            AnyShape::Quad(Quad::new(
                n * at - (x + y) * half,
                x * (2.0 * half),
                y * (2.0 * half),
            ))
        };
        let d = round_to_f32(
            (n + x * rng.next_uniform(-2.0, 2.0) + y * rng.next_uniform(-2.0, 2.0)).normalize(),
        );
        trace_mirror_bounces(
            &geometry(&[wall(-1.0), wall(1.0)]),
            create_unnormalised_ray::<R>(DVec3::ZERO, d),
            |ray| ray.direction.to_f64().normalize().dot(n).abs(),
        )
    });
    let ball = trace_mirror_rays(404, |rng| {
        let sphere = AnyShape::Sphere(Sphere {
            centre: R::Vec3::from_f64(DVec3::ZERO),
            radius: R::ONE,
        });
        let d = round_to_f32(rng.sample_direction());
        let start = create_unnormalised_ray::<R>(
            round_to_f32(rng.sample_direction() * rng.next_uniform(0.1, 0.9)),
            d,
        );
        trace_mirror_bounces(&geometry(&[sphere]), start, |ray| {
            let d = ray.direction.to_f64();
            ray.origin.to_f64().cross(d / d.length()).length()
        })
    });
    let judged =
        |part: &str, found: &[Option<[f64; 2]>], selected: usize, bound: f64| -> CaseOutcome {
            judge_rays(&format!("S11 {part}"), 0, MIRRORED, rays, |rng| {
                let index = rng.ray_index();
                let Some(errors) = found[index as usize] else {
                    return Verdict::Wrong(format!("ray {index} escapes"));
                };
                Verdict::from_error(errors[selected], bound, || format!("ray {index}"))
            })
        };
    let lengths = judged("lengths", &walls, 0, 1e-5).merge(judged("lengths", &ball, 0, 1e-5));
    [
        ("lengths", lengths),
        ("between walls", judged("between walls", &walls, 1, 1e-3)),
        ("in a ball", judged("in a ball", &ball, 1, 1e-3)),
    ]
    .map(|(part, outcome)| create_treeless_measurement::<R>(outcome).with_part_name(part))
    .to_vec()
}
