//! Cases P01, P02, P07, P08 and P20: distant spheres and planes, and rays nearly in the plane of a
//! thin triangle.

use super::prelude::*;

/// Distances of the spheres from the rays' origins, in radii.
const RATIOS: [f64; 6] = [2.0, 1e2, 1e3, 1e4, 1e5, 1e6];

/// Computes the distance of a ray's line from the centre of a sphere, and the distances along the
/// line at which it enters and leaves the sphere; `None` for a miss. Both are computed in f64.
pub fn find_closest_approach(
    ray: &Ray<f64>,
    centre: DVec3,
    radius: f64,
) -> (f64, Option<[f64; 2]>) {
    let (f, d) = (ray.origin - centre, ray.direction);
    let middle = -f.dot(d) / d.length_squared();
    let distance = (f + d * middle).length();
    let half = ((radius - distance) * (radius + distance)).sqrt();
    let roots = [-half, half].map(|half| middle * d.length() + half);
    (distance, (distance <= radius).then_some(roots))
}

/// Creates a sphere whose centre and radius are rounded to the stored scalar.
pub fn build_sphere<R: Real>(centre: DVec3, radius: f64) -> Sphere<R> {
    Sphere {
        centre: to_scalar::<R>(centre),
        radius: R::from_f64(radius),
    }
}

/// Draws a ray from the distance `away` of a centre towards a disc around the centre.
fn draw_ray_from_afar(rng: &mut CaseRng, centre: DVec3, away: f64, radius: f64) -> Ray<f64> {
    let out = rng.sample_direction();
    let target = centre + rng.sample_offset_in_disc(out, radius);
    create_ray_towards(centre + out * away, target)
}

/// Creates a plane through a point with a normal.
fn build_plane<R: Real>(point: DVec3, normal: DVec3) -> Plane<R> {
    Plane::new(to_scalar::<R>(point), to_scalar::<R>(normal))
}

/// Draws the corners of a thin triangle about 600 units from the origin: a needle with a bounding
/// box of 11.2 × 9.7 × 1.4, or a needle of about that length and height in a random orientation.
fn draw_needle(rng: &mut CaseRng) -> [DVec3; 3] {
    let x = rng.sample_direction();
    let y = rng.sample_offset_in_disc(x, 1.0).normalize();
    let point = rng.sample_direction() * 600.0;
    let diagonal = DVec3::new(11.2, 9.7, 1.4);
    let sides = if rng.next_sign() > 0.0 {
        let beside = rng.sample_point_in_cube() * DVec3::new(0.0, 0.5, 0.1);
        [diagonal, diagonal * rng.next_uniform(0.6, 0.9) + beside]
    } else {
        [x * 11.2, x * 9.65 + y * 0.98]
    };
    [point, point + sides[0], point + sides[1]].map(round_to_f32)
}

/// Cases of single shapes.
pub(super) fn cases<R: Real>() -> Vec<Case<R>> {
    vec![
        // Hits and misses of a unit sphere 2 to 10⁶ radii away, by rays that aim at a disc of 1.05
        // radii around the centre. A result is wrong in two cases:
        //
        // - It contradicts the oracle by more than the oracle's margin.
        // - The hit point is off the surface by more than 2u(D + C) in f32, 16u(D + C) in f64, and
        //   8u(D + C) for the textbook.
        //
        // Here u is the roundoff of the stored scalar, D the distance of the ray's origin from the
        // centre, and C the greatest coordinate.
        ("P01", |trial| {
            let roundoff = R::ROUNDOFF.to_f64();
            for ratio in RATIOS {
                // The specification of the case allows 8·u·(D + C), which far away is the whole
                // sphere. The margin here is stricter: some roundings of the oracle itself, and for
                // near spheres stored in f32 the error of b² − c in f64 arithmetic.
                let margin = if R::IS_SINGLE && ratio <= 1e3 {
                    (ratio * ratio * f64::EPSILON).max(1e-12)
                } else {
                    16.0 * f64::ROUNDOFF * ratio
                };
                let rays = (1 + ratio as u64, 200_000);
                trial.judge(&format!("{ratio:e}"), rays, BOTH, |rng, formula| {
                    let ray = draw_ray_from_afar(rng, DVec3::ZERO, ratio, 1.05);
                    let (distance, roots) = find_closest_approach(&ray, DVec3::ZERO, 1.0);
                    if (distance - 1.0).abs() <= margin {
                        return Verdict::Undecidable;
                    }
                    let hit = formula.intersect(build_sphere(DVec3::ZERO, 1.0), ray);
                    let is_right = hit.is_some() == roots.is_some();
                    let Some(hit) = hit.filter(|_| is_right) else {
                        return require(is_right, || {
                            format!("the ray passes at distance {distance}, but finds {hit:?}")
                        });
                    };
                    let (o, p) = (ray.origin, hit.on_ray);
                    let scale = o.length() + o.abs().max(p.abs()).max_element();
                    let bound = match () {
                        () if formula.is_textbook => 8.0,
                        () if R::IS_SINGLE => 2.0,
                        () => 16.0,
                    };
                    within(
                        (p.length() - 1.0).abs(),
                        bound * roundoff * scale,
                        || "distance of the hit point from the sphere's surface",
                    )
                });
            }
        }),
        // The surface points of unit spheres up to 10⁵ from the origin, by rays from 2 to 10⁶ radii
        // away. A point is right if it is off the sphere by at most four ulps of the coordinates,
        // and within the error bound that the surface states.
        ("P02", |trial| {
            for offset in [0.0, 1e3, 1e5] {
                for ratio in RATIOS {
                    let part = format!("at {offset:e}, {ratio:e} away");
                    trial.judge(&part, (2 + ratio as u64, 50_000), BOTH, |rng, formula| {
                    let centre = round_to_f32(rng.sample_direction() * offset);
                    let ray = draw_ray_from_afar(rng, centre, ratio, 0.98);
                    let Some(hit) = formula.intersect(build_sphere(centre, 1.0), ray) else {
                        return Verdict::Skipped;
                    };
                    let from = hit.point - centre;
                    let off = (from - from / from.length()).abs().max_element();
                    let scale = hit.point.abs().max(centre.abs()).max_element();
                    // The stated error bound must hold: the point is off the sphere, along the
                    // normal, by at most the extent of the error box.
                    let reach = hit.error * hit.normal.abs().element_sum();
                    within(off, 4.0 * ulp(scale), || "distance from the sphere along an axis")
                        & within((from.length() - 1.0).abs(), reach, || {
                            "distance from the sphere, compared with the point's own error bound"
                        })
                });
                }
            }
        }),
        // The hit distance of a plane, for rays whose slopes against the plane are from 1e-2 down to
        // 1e-7.
        ("P07", |trial| {
            trial.judge("", (7, 400_000), LIBRARY, |rng, formula| {
                let [n, point] = if rng.next_sign() > 0.0 {
                    [DVec3::Y, DVec3::ZERO]
                } else {
                    [rng.sample_direction(), rng.sample_point_in_cube()].map(round_to_f32)
                };
                let slope = rng.choose(&[1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7]);
                let slope = slope * rng.next_uniform(0.5, 2.0);
                let along = rng.sample_offset_in_disc(n, 1.0).normalize();
                let o = round_to_f32(point + n);
                let d = round_to_f32((along - n * slope).normalize());
                let (height, fall) = (n.dot(o - point), -n.dot(d));
                let ray = create_unnormalised_ray(o, d);
                let hit = formula.intersect(build_plane(point, n), ray);
                let is_right = hit.is_some() == (fall > 0.0);
                let Some(hit) = hit.filter(|_| is_right) else {
                    return require(
                        is_right,
                        || "a plane is hit behind the ray's origin or missed",
                    );
                };
                let error = (hit.t * fall / height - 1.0).abs();
                within(
                    error,
                    4.0 * R::ROUNDOFF.to_f64() / fall,
                    || "relative error of the hit distance",
                ) & require(hit.point.is_finite(), || "surface point that is not finite")
            });
        }),
        // The cell of a checkerboard plane in which a hit point lies, at distances from 10³ to 10⁷
        // metres.
        ("P08", |trial| {
            for far in [1e3, 1e4, 1e5, 1e6, 1e7] {
                // The cell size, for which about one ray in a thousand hits close to the border of a
                // cell.
                let cell = 2_f64.powf((far / 128.0_f64).log2().ceil());
                let rays = (8 + far as u64, 100_000);
                trial.judge(&format!("{far:e}"), rays, LIBRARY, |rng, formula| {
                    let [x, z] = [(); 2].map(|()| rng.next_uniform(-far, far));
                    let target = DVec3::new(x, 0.0, z);
                    let from = rng.sample_point_in_cube() * (0.3 * far) + DVec3::Y * (0.31 * far);
                    let ray = create_ray_towards::<f64>(target + from, target);
                    let expected = ray.at(-ray.origin.y / ray.direction.y);
                    let hit = formula.intersect(build_plane(DVec3::ZERO, DVec3::Y), ray);
                    let Some(FormulaHit { point, .. }) = hit else {
                        return require(false, || "miss of a plane that the ray reaches");
                    };
                    let greatest = point.abs().max(expected.abs()).max(ray.origin.abs());
                    let margin = 4.0 * ulp(greatest.max_element());
                    let [a, b] = [expected, point].map(|p| p / cell);
                    let border = ((a - a.round()) * cell).abs();
                    if border.x.min(border.z) <= margin {
                        return Verdict::Undecidable;
                    }
                    let parity = |p: DVec3| (p.x.floor() + p.z.floor()).rem_euclid(2.0);
                    require(parity(a) == parity(b), || {
                        format!("hit point {point:?} in a wrong cell of the checkerboard")
                    })
                });
            }
        }),
        // Rays nearly in the plane of a thin distant triangle. If such a ray hits, the hit point must
        // lie in the triangle's box.
        ("P20", |trial| {
            trial.judge("", (52, 600_000), LIBRARY, |rng, formula| {
                let corners @ [a, b, c] = draw_needle(rng);
                let x = (b - a).normalize();
                let normal = x.cross(c - a).normalize();
                let angle = rng.choose(&[0.5_f64, 0.01, 1e-4]).to_radians();
                let [u, v] = rng.next_numbers();
                let target = a + (b - a) * u + (c - a) * (v * (1.0 - u));
                let [along, across] = [x, normal.cross(x)].map(|v| v * rng.next_uniform(-1.0, 1.0));
                let origin = target + ((along + across).normalize() + normal * angle) * 600.0;
                let ray = create_ray_towards(origin, target + rng.sample_point_in_cube() * 1e-3);
                let triangle = Triangle::new(corners.map(to_scalar::<R>));
                let Some(hit) = formula.intersect(triangle, ray) else {
                    return Verdict::Skipped;
                };
                let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                let scale = low
                    .abs()
                    .max(high.abs())
                    .max(ray.origin.abs())
                    .max_element();
                let over = |p: DVec3| (low - p).max(p - high).max_element();
                let farther = over(hit.on_ray).max(over(hit.point));
                within(
                    farther,
                    16.0 * ulp(scale),
                    || "distance of the hit from the triangle's box",
                )
            });
            // Rays along the z axis, tilted by next to nothing against the plane of a triangle that
            // contains this axis. A hit must lie where the axis crosses the triangle. Corners are
            // whole numbers: steps along `side` and along z.
            trial.judge("edge-on", (53, 40_000), LIBRARY, |rng, formula| {
                let mut whole = |most: f64| rng.next_uniform(-most, most).round();
                let side = DVec3::new(whole(8.0), 1.0, 0.0);
                let corners = [(); 3].map(|()| [whole(9.0), whole(20.0)]);
                let crossing = whole(15.0);
                let tilt = DVec3::Z.cross(side) * rng.choose(&[1e-9, 1e-12, 1e-15, 1e-17]);
                let origin = DVec3::Z * -600.0 - tilt * (600.0 + crossing);
                let ray =
                    create_unnormalised_ray(round_to_f32(origin), DVec3::Z + round_to_f32(tilt));
                let triangle =
                    corners.map(|[across, z]| to_scalar::<R>(side * across + DVec3::Z * z));
                let Some(hit) = formula.intersect(Triangle::new(triangle), ray) else {
                    return Verdict::Skipped;
                };
                let mut range = [f64::INFINITY, f64::NEG_INFINITY];
                for k in 0..3 {
                    let ([p, z], [q, end]) = (corners[k], corners[(k + 1) % 3]);
                    if p * q <= 0.0 && p != q {
                        let z = z + (end - z) * (p / (p - q));
                        range = [range[0].min(z), range[1].max(z)];
                    }
                }
                let off = (range[0] - hit.on_ray.z).max(hit.on_ray.z - range[1]);
                within(
                    off,
                    16.0 * ulp(600.0),
                    || "distance of the hit from the crossing of the triangle",
                )
            });
        }),
    ]
}
