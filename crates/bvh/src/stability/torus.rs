//! Case P17: a torus that is far away.

use super::prelude::*;

/// Computes the signed distance of a point from the torus with major radius 1 around the y axis and
/// tube radius `tube`, negative inside.
fn distance_to_tube(p: DVec3, tube: f64) -> f64 {
    let out = (p.x * p.x + p.z * p.z).sqrt() - 1.0;
    (out * out + p.y * p.y).sqrt() - tube
}

/// Finds the first crossing of a ray with the torus by sphere tracing, starting at the bounding
/// sphere. No step can jump over the tube. Returns the distance of the crossing, and the least
/// distance from the torus along the ray.
fn trace_distance_field(o: DVec3, d: DVec3, tube: f64) -> (Option<f64>, f64) {
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
            break;
        }
        s += free;
        if s > end {
            return (None, minimum);
        }
    }
    (Some(middle + s), minimum)
}

/// Judges case P17: tori with three tube radii, by rays from 3 to 1000 major radii away, spread over
/// the bounding sphere. A miss of the torus is wrong, and so is a false hit. A hit point is wrong if
/// its distance from the surface exceeds a thousandth of the tube radius, for a tube radius below
/// 0.05 a hundredth, or if it is not at the first crossing.
pub(super) fn far_tori<R: Real>(trial: &mut Trial<R>) {
    for (tube, far) in [0.3_f32, 0.1, 0.01]
        .into_iter()
        .flat_map(|tube| [3.0, 10.0, 100.0, 1000.0].map(|far| (f64::from(tube), far)))
    {
        let part = format!("tube {} at {far:e}", tube as f32);
        trial.judge_shapes(&part, (30 + far as u64, 40_000), true, |rng| {
            let out = rng.sample_direction();
            // Half of the rays are aimed at the tube itself.
            let target = if rng.next_sign() > 0.0 {
                let ring = rng.sample_offset_in_disc(DVec3::Y, 1.0).normalize();
                ring + rng.sample_offset_in_disc(out, 1.2 * tube)
            } else {
                rng.sample_offset_in_disc(out, 1.0 + tube)
            };
            let ray = create_ray_towards::<R>(out * far, target);
            let torus = Torus::new(DVec3::ZERO, DVec3::Y, 1.0, tube);
            let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
            Ok((torus.into(), ray, judge_hit(o, d, tube)))
        });
    }
}

/// Returns the judge of hits of a torus by the ray from `o` in the direction `d`.
fn judge_hit(o: DVec3, d: DVec3, tube: f64) -> impl Fn(Option<FormulaHit>) -> Verdict {
    let length = d.length();
    let (expected, minimum) = trace_distance_field(o, d / length, tube);
    move |hit| match (hit, expected) {
        (None, None) => Verdict::Right(0.0),
        // A ray that grazes the tube within the precision of f64 is undecidable.
        (None, Some(t)) if distance_to_tube(o + d * ((t + 1e-7) / length), tube) > -1e-11 => {
            Verdict::Undecidable
        }
        (Some(_), None) if minimum < 1e-11 => Verdict::Undecidable,
        (None, Some(t)) => Verdict::Wrong(format!("miss of a torus at the distance {t}")),
        (Some(hit), None) => Verdict::Wrong(format!(
            "{hit:?} of a torus that the ray passes at the distance {minimum:e}"
        )),
        (Some(hit), Some(t)) => {
            let off = distance_to_tube(o + d * hit.t, tube).abs() / tube;
            // The hit must lie on the tube, and at the first crossing: the distance between two
            // crossings far exceeds rounding.
            let late = (hit.t * length - t).abs() / tube;
            let bound = if tube < 0.05 { 1e-2 } else { 1e-3 };
            Verdict::from_error(off, bound, || "distance of the hit point from the torus")
                .and_then(|| Verdict::from_condition(late < 0.3, || "hit after the first crossing"))
        }
    }
}
