//! Case P17: a torus that is far away.

use crate::shapes::Torus;
use crate::{Ray, Real, Vector};
use glam::DVec3;

use super::IntersectFunction;
use super::verdicts::{
    CaseOutcome, RayCount, Verdict, create_ray_towards, format_ray_bits, judge_rays, to_scalar,
};

/// Creates a torus around the y axis with major radius 1 and the minor radius `tube`.
pub fn build_torus<R: Real>(tube: f64) -> Torus<R> {
    Torus {
        centre: to_scalar::<R>(DVec3::ZERO),
        axis: to_scalar::<R>(DVec3::Y),
        major_radius: R::ONE,
        minor_radius: R::from_f64(tube),
    }
}

/// Computes the signed distance of a point from the torus with tube radius `tube`, negative inside.
fn distance_to_tube(p: DVec3, tube: f64) -> f64 {
    let out = (p.x * p.x + p.z * p.z).sqrt() - 1.0;
    (out * out + p.y * p.y).sqrt() - tube
}

/// Finds the first crossing of a ray with the torus by sphere tracing, starting at the bounding
/// sphere. No step can jump over the tube. Returns the distance of the crossing, and the least
/// distance from the torus along the ray.
fn trace_distance_field(o: DVec3, d: DVec3, tube: f64) -> (Option<f64>, f64) {
    let d = d / d.length();
    let middle = -o.dot(d);
    let near = o + d * middle;
    let room = (1.0 + tube) * (1.0 + tube) - near.length_squared();
    if room < 0.0 {
        return (None, f64::INFINITY);
    }
    let (mut s, end, mut minimum) = (-room.sqrt(), room.sqrt(), f64::INFINITY);
    for _ in 0..5000 {
        let free = distance_to_tube(near + d * s, tube);
        minimum = minimum.min(free);
        if free < 1e-12 {
            return (Some(middle + s), free);
        }
        s += free;
        if s > end {
            return (None, minimum);
        }
    }
    (Some(middle + s), minimum)
}

/// Judges rays from the distance `far` towards a torus, spread over its bounding sphere. A miss of
/// the torus is wrong, and so is a false hit. A hit point is wrong if its distance from the surface
/// exceeds a thousandth of the tube radius `tube`. For a tube radius below 0.05 the bound is a
/// hundredth.
pub fn judge_far_torus<R: Real>(
    tube: f64,
    far: f64,
    count: u32,
    rays: RayCount,
    intersect: IntersectFunction<R>,
) -> CaseOutcome {
    let tube = f64::from(tube as f32);
    let bound = if tube < 0.05 { 1e-2 } else { 1e-3 };
    judge_rays(
        &format!("P17 tube {tube:e} at {far:e}"),
        30 + far as u64,
        count,
        rays,
        |rng| {
            let out = rng.sample_direction();
            // Half of the rays are aimed at the tube itself.
            let target = if rng.next_sign() > 0.0 {
                let ring = rng.sample_offset_in_disc(DVec3::Y, 1.0).normalize();
                ring + rng.sample_offset_in_disc(out, 1.2 * tube)
            } else {
                rng.sample_offset_in_disc(out, 1.0 + tube)
            };
            let ray = create_ray_towards::<R>(out * far, target);
            let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
            let expected = trace_distance_field(o, d, tube);
            match intersect(&build_torus::<R>(tube).into(), &ray) {
                None => judge_torus_miss(&ray, expected.0, tube),
                Some(found) => judge_torus_hit(&ray, found.to_f64(), expected, (tube, bound)),
            }
        },
    )
}

/// Judges a miss. `expected` is the distance of the first crossing; `None` if the ray misses the
/// torus.
fn judge_torus_miss<R: Real>(ray: &Ray<R>, expected: Option<f64>, tube: f64) -> Verdict {
    let Some(t) = expected else {
        return Verdict::Right(0.0);
    };
    let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
    // A ray that grazes the tube within the precision of f64 is undecidable.
    let inside = distance_to_tube(o + d * ((t + 1e-7) / d.length()), tube);
    if inside > -1e-11 {
        Verdict::Undecidable
    } else {
        Verdict::Wrong(format!(
            "no hit is found, although the ray hits the torus{}",
            format_ray_bits::<R>(ray)
        ))
    }
}

/// Judges a hit at the distance `found`, in lengths of the direction. `expected` is the result of
/// [`trace_distance_field`], `bound` the greatest distance of the hit from the surface as a fraction
/// of the tube radius.
fn judge_torus_hit<R: Real>(
    ray: &Ray<R>,
    found: f64,
    (expected, minimum): (Option<f64>, f64),
    (tube, bound): (f64, f64),
) -> Verdict {
    let Some(t) = expected else {
        if minimum < 1e-11 {
            return Verdict::Undecidable;
        }
        return Verdict::Wrong(format!(
            "a hit is found, although the ray passes the surface of the torus at distance {minimum:e}{}",
            format_ray_bits::<R>(ray)
        ));
    };
    let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
    let off = distance_to_tube(o + d * found, tube).abs() / tube;
    // The hit must lie on the tube, and at the first crossing: the distance between two crossings
    // far exceeds rounding.
    let late = (found * d.length() - t).abs() / tube;
    Verdict::from_error(off, bound, || {
        format!(
            "distance of the hit point from the surface of the torus{}",
            format_ray_bits::<R>(ray)
        )
    })
    .and_then(|| {
        Verdict::from_condition(late < 0.3, || {
            format!(
                "the hit is not at the first crossing of the torus{}",
                format_ray_bits::<R>(ray)
            )
        })
    })
}
