//! P17, P18: the torus from far away, and where it is touched and not cut.

use glam::DVec3;
use raywright_bvh::shapes::Torus;
use raywright_bvh::{Fast, Interval, Precision, Probe, Ray, Real, Reference, Robust, Shape, Side, Vector};

use super::support::{Outcome, U, Verdict, hex, hit, judge, stored, textbook_share, towards};

fn torus<P: Precision>(tube: f64) -> Torus<P::Real> {
    Torus {
        centre: stored::<P>(DVec3::ZERO),
        axis: stored::<P>(DVec3::Y),
        major_radius: P::Real::ONE,
        minor_radius: P::Real::from_f64(tube),
    }
}

/// Signed distance from the tube.
fn distance(p: DVec3, tube: f64) -> f64 {
    let out = (p.x * p.x + p.z * p.z).sqrt() - 1.0;
    (out * out + p.y * p.y).sqrt() - tube
}

/// The first crossing by walking along the ray by the distance to the surface, from the sphere around it on: no step can
/// jump over the tube. The second number is the least distance that was seen on the way.
fn walk(o: DVec3, d: DVec3, tube: f64) -> (Option<f64>, f64) {
    let d = d / d.length();
    let middle = -o.dot(d);
    let near = o + d * middle;
    let room = (1.0 + tube) * (1.0 + tube) - near.length_squared();
    if room < 0.0 {
        return (None, f64::INFINITY);
    }
    let (mut s, end, mut least) = (-room.sqrt(), room.sqrt(), f64::INFINITY);
    for _ in 0..5000 {
        let free = distance(near + d * s, tube);
        least = least.min(free);
        if free < 1e-12 {
            return (Some(middle + s), free);
        }
        s += free;
        if s > end {
            return (None, least);
        }
    }
    (Some(middle + s), least)
}

/// Rays over the sphere around the torus from `far` away; wrong are misses, false hits, and points off the tube by more
/// than `bound` of its radius.
pub fn far_torus<P: Precision>(tube: f64, far: f64, count: u32) -> Outcome {
    let tube = f64::from(tube as f32);
    let bound = if tube < 0.05 { 1e-2 } else { 1e-3 };
    judge(&format!("P17 tube {tube:e} at {far:e}"), 30 + far as u64, count, |random| {
        let out = random.direction();
        // Every other one at the tube itself.
        let target = if random.sign() > 0.0 {
            let ring = random.disc(DVec3::Y, 1.0).normalize();
            ring + random.disc(out, 1.2 * tube)
        } else {
            random.disc(out, 1.0 + tube)
        };
        let ray = towards::<P>(out * far, target);
        let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
        let (wanted, least) = walk(o, d, tube);
        match hit::<P>(&torus::<P>(tube), &ray) {
            None if wanted.is_none() => Verdict::Right(0.0),
            None => {
                // Grazing by less than f64 tells.
                let inside = wanted.map_or(0.0, |t| distance(o + d * ((t + 1e-7) / d.length()), tube));
                if inside > -1e-11 { Verdict::Band } else { Verdict::Wrong(format!("missed{}", hex::<P>(&ray))) }
            }
            Some(_) if wanted.is_none() && least < 1e-11 => Verdict::Band,
            Some(_) if wanted.is_none() => Verdict::Wrong(format!("false hit, {least:e} off{}", hex::<P>(&ray))),
            Some(h) => {
                let off = distance(o + d * h.t.to_f64(), tube).abs() / tube;
                let t = wanted.unwrap_or(f64::INFINITY);
                // On the tube, and on its first side: the way between two crossings is no rounding.
                let late = (h.t.to_f64() * d.length() - t).abs() / tube;
                Verdict::bounded(off, bound, || format!("off the tube{}", hex::<P>(&ray)))
                    .and(|| Verdict::holds(late < 0.3, || format!("not the first crossing{}", hex::<P>(&ray))))
            }
        }
    })
}

/// The torus from 3 to 1000 radii away, thick and thin.
#[test]
fn p17_far_torus() {
    for tube in [0.3, 0.1, 0.01] {
        for far in [3.0, 10.0, 100.0, 1000.0] {
            far_torus::<Robust>(tube, far, 40_000).expect_right(39_900);
        }
    }
}

/// How often a ray goes in and comes out, by chains of queries.
fn passages(torus: &Torus<f32>, ray: &Ray<f32>) -> (u32, u32) {
    let probe = Probe::<Robust>::new(*ray);
    let count = |side: Side| {
        let (mut count, mut from) = (0, 0.0);
        while let Some(h) = torus.intersect(&probe, Interval { min: from, max: f32::INFINITY }, side) {
            (count, from) = (count + 1, h.t);
        }
        count
    };
    (count(Side::Outside), count(Side::Inside))
}

/// Lines that touch the top circle or an equator, moved in and out by eight roundings of the distance: crossings as the
/// circles in that plane tell, in pairs.
#[test]
fn p18_tangents() {
    judge("P18", 40, 300_000, |random| {
        let tube = f64::from(random.pick(&[0.3_f32, 0.1, 0.01]));
        let torus = torus::<Robust>(tube);
        let far = f64::from(random.between(3.0, 1000.0) as f32);
        let step = random.pick(&[-8.0, 8.0, -64.0, 64.0]) * U * far;
        // The line is parallel to x, at a height y and a distance z from the axis.
        let (y, z) = match random.bits() % 3 {
            0 => (tube + step, random.between(0.0, 0.9)),
            1 => (0.0, 1.0 - tube + step),
            _ => (0.0, 1.0 + tube + step),
        };
        let (y, z) = (f64::from(y as f32), f64::from(z as f32));
        let half = tube * tube - y * y;
        let circles = if half > 0.0 { [1.0 - half.sqrt(), 1.0 + half.sqrt()] } else { [0.0, 0.0] };
        if circles.iter().any(|r| (r - z).abs() < 1e-12) {
            return Verdict::Band;
        }
        let wanted = circles.iter().filter(|r| z < **r).count() as u32;
        let wanted = if half > 0.0 { wanted } else { 0 };
        let ray = Ray::<f32>::new(stored::<Robust>(DVec3::new(-far, y, z)), stored::<Robust>(DVec3::X));
        let (enters, leaves) = passages(&torus, &ray);
        Verdict::holds((enters, leaves) == (wanted, wanted), || {
            format!("in {enters}, out {leaves}, wanted {wanted}; tube {tube} y {y} z {z}{}", hex::<Robust>(&ray))
        })
    })
    .expect_right(299_000);
}

/// From outside every ray comes out as often as it goes in; along the axis it meets nothing.
#[test]
fn p18_even_from_outside() {
    judge("P18 parity", 41, 300_000, |random| {
        let torus = torus::<Robust>(random.pick(&[0.3, 0.1, 0.01, 0.9]));
        let ray = towards::<Robust>(random.direction() * random.between(3.0, 1000.0), random.cube());
        let (enters, leaves) = passages(&torus, &ray);
        Verdict::holds(enters == leaves && enters <= 2, || format!("in {enters}, out {leaves}{}", hex::<Robust>(&ray)))
    })
    .expect_right(300_000);
    for tube in [0.3, 0.1, 0.01, 0.99] {
        for far in [2.0, 10.0, 1e3, 1e6] {
            for sign in [-1.0, 1.0] {
                let ray = Ray::<f32>::new(stored::<Robust>(DVec3::Y * (far * sign)), stored::<Robust>(DVec3::Y * -sign));
                assert_eq!(passages(&torus::<Robust>(tube), &ray), (0, 0), "along the axis from {far}");
            }
        }
    }
    let inside = Interval { min: 0.0, max: f32::INFINITY };
    let ray = Ray::<f32>::new(stored::<Robust>(DVec3::X), stored::<Robust>(DVec3::X));
    assert!(torus::<Robust>(0.3).intersect(&Probe::<Robust>::new(ray), inside, Side::Inside).is_some(), "from within the tube");
}

/// The textbook form must fail where the specification says that it does: half the rays at a hundred radii.
#[test]
fn textbook_loses_far_tori() {
    let wrong = textbook_share([
        far_torus::<Fast>(0.1, 100.0, 20_000),
        far_torus::<Robust>(0.1, 100.0, 20_000),
        far_torus::<Reference>(0.1, 100.0, 20_000),
    ]);
    assert!(wrong > 0.25, "P17 at 100: only {wrong} wrong");
}
