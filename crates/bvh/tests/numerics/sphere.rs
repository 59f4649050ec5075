//! P01–P05: spheres far away, huge, tiny, and left by a ray.

use glam::DVec3;
use raywright_bvh::shapes::Sphere;
use raywright_bvh::{Fast, Interval, Precision, Probe, Real, Reference, Robust, Shape, Side, Vector};

use super::support::{Outcome, Verdict, exact, hex, hit, judge, stored, textbook_share, towards, ulp};

/// How the line of an exact ray passes a sphere: distance from the centre, and distances along the ray (true lengths) of
/// the two crossings if it does. In f64 from the perpendicular.
struct Pass {
    distance: f64,
    roots: Option<[f64; 2]>,
}

fn pass(o: DVec3, d: DVec3, centre: DVec3, radius: f64) -> Pass {
    let f = o - centre;
    let length = d.length();
    let middle = -f.dot(d) / d.length_squared();
    let distance = (f + d * middle).length();
    let half = ((radius - distance) * (radius + distance)).sqrt();
    Pass { distance, roots: (distance <= radius).then_some([middle * length - half, middle * length + half]) }
}

fn sphere<P: Precision>(centre: DVec3, radius: f64) -> Sphere<P::Real> {
    Sphere { centre: stored::<P>(centre), radius: P::Real::from_f64(radius) }
}

const RATIOS: [f64; 6] = [2.0, 1e2, 1e3, 1e4, 1e5, 1e6];

/// Rays over a disc of 1.05 radii from `ratio` radii away; a point off the surface by more than `bound` of u·(D + C), with u
/// that of the stored scalar, is wrong, and so is a hit or miss that the oracle's margin contradicts.
pub fn far_sphere<P: Precision>(ratio: f64, bound: f64) -> Outcome {
    judge(&format!("P01 {ratio:e}"), 1 + ratio as u64, 200_000, |random| {
        let out = random.direction();
        let ray = towards::<P>(out * ratio, random.disc(out, 1.05));
        let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
        let expected = pass(o, d, DVec3::ZERO, 1.0);
        // The specification grants 8·u·(D + C), which far away is all there is: judged more closely, by what b² − c costs in
        // an f64 core, and in f64 storage by some roundings of the oracle's own.
        let roundoff = P::Real::ROUNDOFF.to_f64();
        let margin = if roundoff < 1e-10 { 16.0 * roundoff * ratio } else { (ratio * ratio * f64::EPSILON).max(1e-12) };
        if (expected.distance - 1.0).abs() <= margin {
            return Verdict::Band;
        }
        match hit::<P>(&sphere::<P>(DVec3::ZERO, 1.0), &ray) {
            None => Verdict::holds(expected.roots.is_none(), || format!("missed at {}{}", expected.distance, hex::<P>(&ray))),
            Some(_) if expected.roots.is_none() => {
                Verdict::Wrong(format!("false hit at {}{}", expected.distance, hex::<P>(&ray)))
            }
            Some(hit) => {
                let p = o + d * hit.t.to_f64();
                let scale = o.length() + o.abs().max_element().max(p.abs().max_element());
                Verdict::bounded((p.length() - 1.0).abs(), bound * roundoff * scale, || {
                    format!("off the surface{}", hex::<P>(&ray))
                })
            }
        }
    })
}

/// Hit, miss and distance of a far sphere. The core is f64, so the bound of the f64 tier holds.
#[test]
fn p01_far_sphere() {
    for ratio in RATIOS {
        far_sphere::<Robust>(ratio, 2.0).expect_right(199_000);
        far_sphere::<Reference>(ratio, 16.0).expect_right(199_000);
    }
}

/// Points of the surface from 2 to 1e6 radii away, around the origin and far from it.
pub fn drift<P: Precision>(offset: f64, ratio: f64) -> Outcome {
    judge(&format!("P02 at {offset:e}, {ratio:e} away"), 2 + ratio as u64, 50_000, |random| {
        let centre = exact(random.direction() * offset);
        let out = random.direction();
        let ray = towards::<P>(centre + out * ratio, centre + random.disc(out, 0.98));
        let sphere = sphere::<P>(centre, 1.0);
        let Some(hit) = hit::<P>(&sphere, &ray) else { return Verdict::Skip };
        let surface = sphere.surface(&Probe::<P>::new(ray), hit);
        let p = surface.point.to_f64();
        let from = p - centre;
        let nearest = centre + from / from.length();
        let scale = p.abs().max_element().max(centre.abs().max_element());
        let error = (p - nearest).abs().max_element();
        Verdict::bounded(error, 4.0 * ulp(scale), || format!("off the surface{}", hex::<P>(&ray)))
            // The bound that a surface states is true: off along the normal by no more than what a box of it reaches.
            .and(|| {
                let off = (from.length() - 1.0).abs();
                let reach = surface.error.to_f64() * surface.normal.to_f64().abs().element_sum();
                Verdict::bounded(off, reach, || format!("beyond the stated bound{}", hex::<P>(&ray)))
            })
    })
}

/// A hit point does not drift off the sphere, however far the ray came.
#[test]
fn p02_hit_point_stays_on_the_sphere() {
    for offset in [0.0, 1e3, 1e5] {
        for ratio in RATIOS {
            drift::<Robust>(offset, ratio).expect_right(49_000);
        }
    }
}

/// A camera in a huge sphere: one positive root, to four units in the last place.
#[test]
fn p03_inside_a_huge_sphere() {
    let sphere = sphere::<Robust>(DVec3::ZERO, 1e6);
    judge("P03", 3, 400_000, |random| {
        let origin = random.direction() * (0.5e6 * random.unit().cbrt());
        let ray = towards::<Robust>(origin, origin + random.direction());
        let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
        let Some([near, far]) = pass(o, d, DVec3::ZERO, 1e6).roots else { return Verdict::Wrong("oracle".into()) };
        let probe = Probe::<Robust>::new(ray);
        let outside = sphere.intersect(&probe, Interval::positive(), Side::Outside);
        let Some(hit) = sphere.intersect(&probe, Interval::positive(), Side::Both) else {
            return Verdict::Wrong(format!("no root{}", hex::<Robust>(&ray)));
        };
        let t = f64::from(hit.t) * d.length();
        Verdict::holds(near < 0.0 && outside.is_none(), || format!("a second root{}", hex::<Robust>(&ray)))
            .and(|| Verdict::bounded((t - far).abs(), 4.0 * ulp(far), || format!("root{}", hex::<Robust>(&ray))))
    })
    .expect_right(400_000);
}

/// Rays that leave a sphere where one arrived: outward and along it they are gone, inward they meet the far side.
#[test]
fn p04_origin_on_the_surface() {
    let tilts = [0.0, 1e-3, -1e-3, 1e-6, -1e-6, 1.0, -1.0];
    judge("P04", 4, 500_000, |random| {
        let radius = exact(DVec3::splat(10_f64.powf(random.between(-4.0, 4.0)))).x;
        let centre = exact(random.cube() * 10_f64.powf(random.between(-4.0, 4.0)));
        let sphere = sphere::<Robust>(centre, radius);
        let out = random.direction();
        let first = towards::<Robust>(centre + out * (radius * 4.0), centre + random.disc(out, 0.95 * radius));
        let Some(at) = hit::<Robust>(&sphere, &first) else { return Verdict::Skip };
        let surface = sphere.surface(&Probe::<Robust>::new(first), at);
        let n = surface.normal.as_dvec3();
        let tangent = random.disc(n, 1.0).normalize();
        let tilt = random.pick(&tilts);
        let mut d = exact((tangent + n * tilt).normalize());
        if tilt == 0.0 && n.dot(d) < 0.0 {
            // Rounded inward: its opposite is as good a tangent.
            d = -d;
        }
        let ray = raywright_bvh::Ray::new(surface.spawn(d.as_vec3()), d.as_vec3());
        let again = hit::<Robust>(&sphere, &ray);
        if tilt >= 0.0 {
            return Verdict::holds(again.is_none(), || format!("acne at tilt {tilt}, {again:?}{}", hex::<Robust>(&ray)));
        }
        let o = ray.origin.as_dvec3();
        let Some([near, far]) = pass(o, d, centre, radius).roots else {
            // Too small for its place: f32 has no number inside.
            return Verdict::Skip;
        };
        if near >= 0.0 || far <= 0.0 {
            return Verdict::holds(radius < 16.0 * ulp(centre.abs().max_element()), || {
                format!("not inside: {near:e} {far:e}{}", hex::<Robust>(&ray))
            });
        }
        let Some(again) = again else { return Verdict::Wrong(format!("nothing inward{}", hex::<Robust>(&ray))) };
        let t = f64::from(again.t) * d.length();
        Verdict::bounded((t - far).abs(), 4.0 * ulp(far), || format!("far side at {far:e}{}", hex::<Robust>(&ray)))
    })
    .expect_right(400_000);
}

/// What the camera sees of the two spheres: 0 nothing, 1 the tiny one, 2 the giant. In f64 with the giant's terms taken
/// apart, so that nothing of size 1e12 is subtracted.
fn seen(o: DVec3, d: DVec3, tiny: f64, giant: f64) -> u8 {
    let first = pass(o, d, DVec3::new(0.0, tiny, 0.0), tiny).roots.map_or(f64::INFINITY, |r| r[0]);
    // The giant is centred at (0, −giant, 0): f = o + (0, giant, 0).
    let b = o.dot(d) + giant * d.y;
    let c = o.length_squared() + 2.0 * giant * o.y;
    let discriminant = b * b - d.length_squared() * c;
    let second = if discriminant >= 0.0 && b < 0.0 { c / (discriminant.sqrt() - b) } else { f64::INFINITY };
    if first < second { 1 } else { u8::from(second < f64::INFINITY) * 2 }
}

/// A sphere of a millionth resting on one of a million: both are seen, to the pixel.
#[test]
fn p05_tiny_and_giant_together() {
    let (tiny, giant) = (f64::from(1e-6_f32), 1e6);
    let spheres = [sphere::<Robust>(DVec3::new(0.0, tiny, 0.0), tiny), sphere::<Robust>(DVec3::new(0.0, -giant, 0.0), giant)];
    const SIZE: u32 = 1000;
    let eye = exact(DVec3::new(0.0, 2e-6, 5e-6));
    let at = |i: i64, j: i64| {
        let (x, y) = ((i as f64 + 0.5) / f64::from(SIZE) * 2.0 - 1.0, (j as f64 + 0.5) / f64::from(SIZE) * 2.0 - 1.0);
        exact(DVec3::new(x, y, -1.0).normalize())
    };
    let outcome = judge("P05", 5, SIZE * SIZE, |random| {
        // Every pixel once: the count is the image.
        let index = random.index();
        let (i, j) = ((index % u64::from(SIZE)) as i64, (index / u64::from(SIZE)) as i64);
        let ray = raywright_bvh::Ray::<f32>::new(eye.as_vec3(), at(i, j).as_vec3());
        let hits = spheres.each_ref().map(|s| hit::<Robust>(s, &ray).map_or(f32::INFINITY, |h| h.t));
        let got = if hits[0] < hits[1] { 1 } else { u8::from(hits[1] < f32::INFINITY) * 2 };
        let around = (-1..=1).flat_map(|a| (-1..=1).map(move |b| (a, b)));
        let near = around.map(|(a, b)| seen(eye, at(i + a, j + b), tiny, giant)).any(|wanted| wanted == got);
        Verdict::holds(near, || format!("pixel {i} {j} shows {got}"))
    });
    outcome.expect_right(1_000_000);
    let middle = |j: i64| seen(eye, at(500, j), tiny, giant);
    assert_eq!([100, 450, 900].map(middle), [2, 1, 0], "ground, ball and sky");
}

/// The textbook form must fail where the specification says that it does.
#[test]
fn textbook_misses_far_spheres() {
    let missed =
        textbook_share([far_sphere::<Fast>(1e4, 8.0), far_sphere::<Robust>(1e4, 8.0), far_sphere::<Reference>(1e4, 8.0)]);
    assert!(missed > 0.1, "P01 at 1e4: only {missed} wrong");
    let drifted = textbook_share([drift::<Fast>(0.0, 1e4), drift::<Robust>(0.0, 1e4), drift::<Reference>(0.0, 1e4)]);
    assert!(drifted > 0.5, "P02 at 1e4: only {drifted} wrong");
}
