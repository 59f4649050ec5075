//! P01–P05: distant, huge and tiny spheres, and rays that leave a sphere.

use glam::DVec3;
use raywright_bvh::{Interval, PreparedRay, Ray, Shape, Side, Vector};

use super::support::{
    Expect, Verdict, create_ray_towards, expect_all, expect_hard, format_ray_bits, judge,
    nearest_hit, require, round_to_f32, ulp, within,
};
use raywright_bvh::stability::shapes::{build_sphere, find_closest_approach};

/// Protects: hits, misses and distances of a distant sphere. Tests compute in f64, so the bound of
/// the f64 tier applies.
#[test]
fn p01_far_sphere() {
    expect_hard(&expect_all("P01", 0.995), "P01 1e4", 0.1);
}

/// Protects: a hit point stays on the sphere, however far the ray came.
#[test]
fn p02_hit_point_stays_on_the_sphere() {
    expect_hard(&expect_all("P02", 0.98), "P02 at 0e0, 1e4 away", 0.5);
}

/// Protects: from inside a huge sphere a ray has one positive root, to four units in the last
/// place.
#[test]
fn p03_inside_a_huge_sphere() {
    let sphere = build_sphere::<f32>(DVec3::ZERO, 1e6);
    judge("P03", 3, 400_000, |rng| {
        let origin = rng.sample_direction() * (0.5e6 * rng.next_in_unit_interval().cbrt());
        let ray = create_ray_towards::<f32>(origin, origin + rng.sample_direction());
        let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
        let (_, roots) = find_closest_approach(&Ray::new(o, d), DVec3::ZERO, 1e6);
        let Some([near, far]) = roots else {
            return Verdict::Wrong("oracle".into());
        };
        let prepared_ray = PreparedRay::new(ray);
        let outside = sphere.intersect(&prepared_ray, Interval::positive(), Side::Outside);
        let Some(hit) = sphere.intersect(&prepared_ray, Interval::positive(), Side::Both) else {
            return Verdict::Wrong(format!("no root{}", format_ray_bits(&ray)));
        };
        let t = f64::from(hit.t) * d.length();
        require(near < 0.0 && outside.is_none(), || {
            format!("a second root{}", format_ray_bits(&ray))
        }) & (within((t - far).abs(), 4.0 * ulp(far), || {
            format!("root{}", format_ray_bits(&ray))
        }))
    })
    .expect_right(400_000);
}

/// Protects: of rays that leave a sphere at a hit point, outward and tangential ones hit nothing,
/// and inward ones hit the far side.
#[test]
fn p04_origin_on_the_surface() {
    let tilts = [0.0, 1e-3, -1e-3, 1e-6, -1e-6, 1.0, -1.0];
    judge("P04", 4, 500_000, |rng| {
        let radius = round_to_f32(DVec3::splat(10_f64.powf(rng.next_uniform(-4.0, 4.0)))).x;
        let centre =
            round_to_f32(rng.sample_point_in_cube() * 10_f64.powf(rng.next_uniform(-4.0, 4.0)));
        let sphere = build_sphere::<f32>(centre, radius);
        let out = rng.sample_direction();
        let first = create_ray_towards::<f32>(
            centre + out * (radius * 4.0),
            centre + rng.sample_offset_in_disc(out, 0.95 * radius),
        );
        let Some(shape_hit) = nearest_hit::<f32>(&sphere, &first) else {
            return Verdict::Skipped;
        };
        let surface = sphere.surface(&PreparedRay::new(first), shape_hit);
        let n = surface.normal.as_dvec3();
        let tangent = rng.sample_offset_in_disc(n, 1.0).normalize();
        let tilt = rng.choose(&tilts);
        let mut d = round_to_f32((tangent + n * tilt).normalize());
        if tilt == 0.0 && n.dot(d) < 0.0 {
            // Rounded inward: the opposite tangent serves as well.
            d = -d;
        }
        let ray = Ray::new(surface.spawn_ray_origin(d.as_vec3()), d.as_vec3());
        let again = nearest_hit::<f32>(&sphere, &ray);
        if tilt >= 0.0 {
            return require(again.is_none(), || {
                format!("acne at tilt {tilt}, {again:?}{}", format_ray_bits(&ray))
            });
        }
        let o = ray.origin.as_dvec3();
        let (_, roots) = find_closest_approach(&Ray::new(o, d), centre, radius);
        let Some([near, far]) = roots else {
            // The sphere is too small for its position: f32 has no number inside.
            return Verdict::Skipped;
        };
        if near >= 0.0 || far <= 0.0 {
            return require(radius < 16.0 * ulp(centre.abs().max_element()), || {
                format!("not inside: {near:e} {far:e}{}", format_ray_bits(&ray))
            });
        }
        let Some(again) = again else {
            return Verdict::Wrong(format!("nothing inward{}", format_ray_bits(&ray)));
        };
        let t = f64::from(again.t) * d.length();
        within((t - far).abs(), 4.0 * ulp(far), || {
            format!("far side at {far:e}{}", format_ray_bits(&ray))
        })
    })
    .expect_right(400_000);
}

/// The visible sphere: 0 none, 1 the tiny one, 2 the giant. In f64 with the giant's terms expanded,
/// so that no numbers of size 1e12 are subtracted.
fn seen(o: DVec3, d: DVec3, tiny: f64, giant: f64) -> u8 {
    let (_, roots) = find_closest_approach(&Ray::new(o, d), DVec3::Y * tiny, tiny);
    let first = roots.map_or(f64::INFINITY, |r| r[0]);
    // The giant is centred at (0, −giant, 0): f = o + (0, giant, 0).
    let b = o.dot(d) + giant * d.y;
    let c = o.length_squared() + 2.0 * giant * o.y;
    let discriminant = b * b - d.length_squared() * c;
    let second = if discriminant >= 0.0 && b < 0.0 {
        c / (discriminant.sqrt() - b)
    } else {
        f64::INFINITY
    };
    if first < second {
        1
    } else {
        u8::from(second < f64::INFINITY) * 2
    }
}

/// Protects: a sphere of radius 1e-6 resting on a sphere of radius 1e6: both are visible in exactly
/// the right pixels.
#[test]
fn p05_tiny_and_giant_together() {
    let (tiny, giant) = (f64::from(1e-6_f32), 1e6);
    let spheres = [
        build_sphere::<f32>(DVec3::new(0.0, tiny, 0.0), tiny),
        build_sphere::<f32>(DVec3::new(0.0, -giant, 0.0), giant),
    ];
    const SIZE: u32 = 1000;
    let eye = round_to_f32(DVec3::new(0.0, 2e-6, 5e-6));
    let at = |i: i64, j: i64| {
        let (x, y) = (
            (i as f64 + 0.5) / f64::from(SIZE) * 2.0 - 1.0,
            (j as f64 + 0.5) / f64::from(SIZE) * 2.0 - 1.0,
        );
        round_to_f32(DVec3::new(x, y, -1.0).normalize())
    };
    let outcome = judge("P05", 5, SIZE * SIZE, |rng| {
        // Every pixel once, so the count of rays is the image.
        let index = rng.ray_index();
        let (i, j) = (
            (index % u64::from(SIZE)) as i64,
            (index / u64::from(SIZE)) as i64,
        );
        let ray = Ray::<f32>::new(eye.as_vec3(), at(i, j).as_vec3());
        let hits = spheres
            .each_ref()
            .map(|s| nearest_hit::<f32>(s, &ray).map_or(f32::INFINITY, |h| h.t));
        let got = if hits[0] < hits[1] {
            1
        } else {
            u8::from(hits[1] < f32::INFINITY) * 2
        };
        let around = (-1..=1).flat_map(|a| (-1..=1).map(move |b| (a, b)));
        let near = around
            .map(|(a, b)| seen(eye, at(i + a, j + b), tiny, giant))
            .any(|expected| expected == got);
        require(near, || format!("pixel {i} {j} shows {got}"))
    });
    outcome.expect_right(1_000_000);
    let middle = |j: i64| seen(eye, at(500, j), tiny, giant);
    assert_eq!(
        [100, 450, 900].map(middle),
        [2, 1, 0],
        "ground, ball and sky"
    );
}
