//! P09, P11, P14: borders of flat shapes, seams of solids, clipped quadrics.

use glam::DVec3;
use raywright_bvh::shapes::{
    AnyShape, Cone, Cylinder, CylinderEnds, Disk, Hyperboloid, Paraboloid, Quad,
};
use raywright_bvh::{Interval, PreparedRay, Real, Shape, Side};

use super::support::{
    CaseRng, Expect, Verdict, create_ray_towards, create_unnormalised_ray, format_ray_bits, judge,
    nearest_hit, require, round_to_f32, to_scalar, ulp, within,
};

const STEPS: [f64; 7] = [0.0, 1.0, -1.0, 4.0, -4.0, 64.0, -64.0];

/// Rounds to multiples of 2⁻¹², so that the corner sums of a parallelogram are exact in f32.
pub fn grid(v: DVec3) -> DVec3 {
    (v * 4096.0).round() / 4096.0
}

/// Intersection of an exact ray with a plane, in f64.
fn meet(o: DVec3, d: DVec3, through: DVec3, normal: DVec3) -> DVec3 {
    o + d * (normal.dot(through - o) / normal.dot(d))
}

/// Protects: hits near a quad's border agree with f64 from four units in the last place on.
#[test]
fn p09_quad_border() {
    judge("P09 quad", 9, 1_000_000, |rng| {
        let corner = grid(rng.sample_point_in_cube() * 10.0);
        let (eu, ev) = (
            grid(rng.sample_point_in_cube() * 2.0),
            grid(rng.sample_point_in_cube() * 2.0),
        );
        let normal = eu.cross(ev);
        if normal.length() < 0.3 * eu.length() * ev.length() {
            return Verdict::Skipped;
        }
        let quad = Quad::<f32>::new(corner, eu, ev);
        let along = rng.next_uniform(0.01, 0.99);
        let edge = rng.choose(&[(along, 0.0), (along, 1.0), (0.0, along), (1.0, along)]);
        let border = corner + eu * edge.0 + ev * edge.1;
        let scale = corner.abs().max((corner + eu + ev).abs()).max_element();
        let out = (border - (corner + (eu + ev) * 0.5)).normalize();
        let origin = border + rng.sample_direction() * rng.next_uniform(1.0, 10.0);
        let ray =
            create_ray_towards::<f32>(origin, border + out * (rng.choose(&STEPS) * ulp(scale)));
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let scale = scale.max(o.abs().max_element());
        if normal.dot(d).abs() < 0.05 * normal.length()
            || normal.dot(d) * normal.dot(border - o) < 0.0
        {
            return Verdict::Skipped;
        }
        let q = meet(o, d, corner, normal) - corner;
        let w = normal / normal.length_squared();
        let (u, v) = (q.cross(ev).dot(w), eu.cross(q).dot(w));
        // Spatial distance inside the border.
        let heights = [normal.length() / ev.length(), normal.length() / eu.length()];
        let margin = (u.min(1.0 - u) * heights[0]).min(v.min(1.0 - v) * heights[1]);
        if margin.abs() < 4.0 * ulp(scale) {
            return Verdict::Skipped;
        }
        let got = nearest_hit::<f32>(&quad, &ray).is_some();
        require(got == (margin > 0.0), || {
            format!(
                "hit {got} at {margin:e} from the border{}",
                format_ray_bits(&ray)
            )
        })
    })
    .expect_right(200_000);
}

/// Protects: hits near a disk's rim, likewise.
#[test]
fn p09_disk_border() {
    judge("P09 disk", 10, 400_000, |rng| {
        let (centre, normal) = (
            round_to_f32(rng.sample_point_in_cube() * 10.0),
            round_to_f32(rng.sample_direction()),
        );
        let radius = f64::from(rng.next_uniform(0.1, 3.0) as f32);
        let disk = Disk::<f32> {
            centre: to_scalar::<f32>(centre),
            normal: to_scalar::<f32>(normal),
            radius: radius as f32,
        };
        let rim = rng
            .sample_offset_in_disc(normal.normalize(), 1.0)
            .normalize();
        let scale = centre.abs().max_element() + radius;
        let origin = centre + rim * radius + rng.sample_direction() * rng.next_uniform(1.0, 10.0);
        let ray = create_ray_towards::<f32>(
            origin,
            centre + rim * (radius + rng.choose(&STEPS) * ulp(scale)),
        );
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let scale = scale.max(o.abs().max_element());
        if normal.dot(d).abs() < 0.05 || normal.dot(d) * normal.dot(centre - o) < 0.0 {
            return Verdict::Skipped;
        }
        let margin = radius - (meet(o, d, centre, normal) - centre).length();
        if margin.abs() < 4.0 * ulp(scale) {
            return Verdict::Skipped;
        }
        let got = nearest_hit::<f32>(&disk, &ray).is_some();
        require(got == (margin > 0.0), || {
            format!(
                "hit {got} at {margin:e} from the rim{}",
                format_ray_bits(&ray)
            )
        })
    })
    .expect_right(100_000);
}

/// Protects: no ray passes between two quads with a bitwise common edge.
#[test]
fn p09_no_leak_between_quads() {
    judge("P09 seam", 11, 3_000_000, |rng| {
        let point = rng.sample_point_in_cube() * 10_f64.powf(rng.next_uniform(-2.0, 4.0));
        let (corner, edge) = (round_to_f32(point), rng.sample_point_in_cube());
        let [left, right] = [rng.sample_point_in_cube(), rng.sample_point_in_cube()];
        let end = round_to_f32(corner + edge);
        // Both quads list the shared corners with the same bits, in opposite order.
        let a = Quad::<f32>::new(corner, end - corner, left);
        let b = Quad::<f32>::new(end, corner - end, right);
        let target = corner + (end - corner) * rng.next_uniform(0.05, 0.95);
        let away =
            -(left.normalize() + right.normalize()).normalize() + rng.sample_direction() * 0.5;
        let ray = create_ray_towards::<f32>(target + away * rng.next_uniform(0.5, 20.0), target);
        // The ray must pass between the two far edges, as seen from its origin.
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let seam = end - corner;
        let side = |direction: DVec3| d.cross(seam).dot(direction);
        let (l, r) = (side(left), side(right));
        let steep = |direction: DVec3, s: f64| s.abs() > 0.1 * direction.length() * seam.length();
        let behind = o.distance(target) < 0.4;
        let far_off = ulp(corner.abs().max_element().max(o.abs().max_element())) * 64.0
            > 0.05 * seam.length();
        if l * r >= 0.0 || !steep(left, l) || !steep(right, r) || behind || far_off {
            return Verdict::Skipped;
        }
        let is_hit =
            nearest_hit::<f32>(&a, &ray).is_some() || nearest_hit::<f32>(&b, &ray).is_some();
        require(is_hit, || {
            format!("leak{} {a:?} {b:?}", format_ray_bits(&ray))
        })
    })
    .expect_right(1_000_000);
}

/// Depth of a point inside a capped cylinder or cone, in f64, from normalised axes and distances.
pub fn depth(p: DVec3, base: DVec3, axis: DVec3, radii: [f64; 2]) -> f64 {
    let (q, height) = (p - base, axis.length());
    let along = q.dot(axis) / height;
    let out = (q - axis * (along / height)).length();
    let slant = (radii[1] - radii[0]) / height;
    let wall = (radii[0] + slant * along - out) / (1.0 + slant * slant).sqrt();
    wall.min(along).min(height - along)
}

/// A solid of revolution with a rim as a target.
fn solid(rng: &mut CaseRng) -> (AnyShape<f32>, DVec3, DVec3, [f64; 2]) {
    let (base, axis) = (
        round_to_f32(rng.sample_point_in_cube() * 3.0),
        round_to_f32(rng.sample_point_in_cube() * 2.0),
    );
    let axis = if axis.length() < 0.3 { DVec3::Y } else { axis };
    let radii = rng.choose(&[[1.0, 1.0], [1.0, 0.0], [1.25, 0.5], [0.25, 0.75]]);
    let (b, a) = (to_scalar::<f32>(base), to_scalar::<f32>(axis));
    let shape = if radii[0] == radii[1] {
        Cylinder {
            base: b,
            axis: a,
            radius: radii[0] as f32,
            ends: CylinderEnds::Capped,
        }
        .into()
    } else {
        Cone {
            base: b,
            axis: a,
            radius: radii[0] as f32,
            top_radius: radii[1] as f32,
        }
        .into()
    };
    (shape, base, axis, radii)
}

/// Protects: the seam between wall and cap is closed: a ray through the solid hits it, and every
/// ray that enters also leaves.
#[test]
fn p11_cap_seam() {
    judge("P11", 12, 1_300_000, |rng| {
        let (shape, base, axis, radii) = solid(rng);
        let top = rng.next_sign() > 0.0;
        let (end, radius) = if top {
            (base + axis, radii[1])
        } else {
            (base, radii[0])
        };
        let out = rng.sample_offset_in_disc(axis.normalize(), 1.0).normalize();
        let scale = base.abs().max_element() + axis.abs().max_element() + 1.25;
        let jitter = rng.sample_point_in_cube() * (4.0 * ulp(scale));
        let rim = end + out * radius + jitter;
        let ray = create_ray_towards::<f32>(
            rim + rng.sample_direction() * rng.next_uniform(3.0, 10.0),
            rim,
        );
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().normalize());
        if depth(o, base, axis, radii) > -1e-3 {
            return Verdict::Skipped;
        }
        let prepared_ray = PreparedRay::new(ray);
        let all = Interval::positive();
        let enters = shape.intersect(&prepared_ray, all, Side::Outside);
        let leaves = shape.intersect(&prepared_ray, all, Side::Inside);
        if enters.is_some() != leaves.is_some() {
            return Verdict::Wrong(format!(
                "enters {enters:?}, leaves {leaves:?}{} {shape:?}",
                format_ray_bits(&ray)
            ));
        }
        // One by one, as a chain of queries finds them.
        let (mut count, mut from) = (0, 0.0);
        while let Some(h) = shape.intersect(
            &prepared_ray,
            Interval {
                min: from,
                max: f32::INFINITY,
            },
            Side::Both,
        ) {
            (count, from) = (count + 1, h.t);
        }
        // The deepest point near the rim, by a search along the ray: a clearly inside point
        // requires a hit.
        let (mut low, mut high) = ((rim - o).dot(d) - 4.0, (rim - o).dot(d) + 4.0);
        for _ in 0..80 {
            let (a, b) = (low + (high - low) * 0.4, low + (high - low) * 0.6);
            let deeper = depth(o + d * a, base, axis, radii) > depth(o + d * b, base, axis, radii);
            if deeper { high = b } else { low = a }
        }
        let deepest = depth(o + d * low, base, axis, radii);
        require(count % 2 == 0 && count <= 2, || {
            format!("{count} hits{} {shape:?}", format_ray_bits(&ray))
        }) & (require(deepest < 4.0 * ulp(scale) || count == 2, || {
            format!(
                "leak at depth {deepest:e}{} {shape:?}",
                format_ray_bits(&ray)
            )
        })) & (require(deepest > -4.0 * ulp(scale) || count == 0, || {
            format!(
                "false hit at {deepest:e}{} {shape:?}",
                format_ray_bits(&ray)
            )
        }))
    })
    .expect_right(1_000_000);
}

/// Protects: a quadric clipped to zero height is never hit, and one clipped to a single unit in the
/// last place is hit only there.
#[test]
fn p14_empty_and_thin_clips() {
    let thin = f64::from(f32::EPSILON);
    judge("P14", 14, 300_000, |rng| {
        let height = rng.choose(&[0.0, thin, 2.0 * thin, 64.0 * thin, 0.5]);
        let origin = round_to_f32(rng.sample_direction() * rng.next_uniform(2.0, 5.0));
        let angle = rng.next_in_unit_interval() * core::f64::consts::TAU;
        let jitter = rng.choose(&STEPS) * thin;
        let waist = DVec3::new(angle.cos(), height + jitter, angle.sin());
        let level = rng.next_in_unit_interval() < 0.2;
        let origin = if level {
            round_to_f32(DVec3::new(origin.x, 0.0, origin.z))
        } else {
            origin
        };
        let target = if level {
            DVec3::new(waist.x, 0.0, waist.z)
        } else {
            waist
        };
        let ray =
            create_unnormalised_ray::<f32>(origin, round_to_f32((target - origin).normalize()));
        let (one, zero, up) = (
            1.0_f32,
            <f32 as Real>::Vec3::ZERO,
            to_scalar::<f32>(DVec3::Y * height),
        );
        let h = height as f32;
        let shapes: [AnyShape<f32>; 5] = [
            Hyperboloid {
                centre: zero,
                waist: one,
                slope: one,
                half_height: h,
            }
            .into(),
            Paraboloid {
                apex: zero,
                radius: one,
                height: h,
            }
            .into(),
            Cylinder {
                base: zero,
                axis: up,
                radius: one,
                ends: CylinderEnds::Open,
            }
            .into(),
            Cylinder {
                base: zero,
                axis: up,
                radius: one,
                ends: CylinderEnds::Capped,
            }
            .into(),
            Cone {
                base: zero,
                axis: up,
                radius: one,
                top_radius: 0.5,
            }
            .into(),
        ];
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let scale = o.abs().max_element().max(1.0);
        shapes.iter().fold(Verdict::Right(0.0), |verdict, shape| {
            verdict
                & (match nearest_hit::<f32>(shape, &ray) {
                    None => Verdict::Right(0.0),
                    Some(_) if height == 0.0 => Verdict::Wrong(format!(
                        "hit nothing at all{} {shape:?}",
                        format_ray_bits(&ray)
                    )),
                    Some(h) => {
                        let y = o.y + d.y * f64::from(h.t);
                        let low = if matches!(shape, AnyShape::Hyperboloid(_)) {
                            -height
                        } else {
                            0.0
                        };
                        let over = (y - height).max(low - y);
                        within(over, 4.0 * ulp(scale), || {
                            format!("beyond the clip{} {shape:?}", format_ray_bits(&ray))
                        })
                    }
                })
        })
    })
    .expect_right(300_000);
}

/// An open quadric of revolution around y: the shape, the implicit form that is negative inside,
/// and its height limits.
struct OpenQuadric {
    shape: AnyShape<f32>,
    /// Coefficients of x² + z², y², y and 1.
    form: [f64; 4],
    low: f64,
    high: f64,
}

impl OpenQuadric {
    /// One of three quadrics, with its centre, base or apex at a point.
    fn any(rng: &mut CaseRng, point: DVec3) -> Self {
        let (centre, height) = (
            to_scalar::<f32>(point),
            f64::from(rng.next_uniform(0.2, 2.0) as f32),
        );
        let (half, up) = (height as f32, to_scalar::<f32>(DVec3::Y * height));
        match rng.next_bits() % 3 {
            0 => Self {
                shape: Hyperboloid {
                    centre,
                    waist: 0.5,
                    slope: 0.75,
                    half_height: half,
                }
                .into(),
                form: [4.0, -1.0 / 0.5625, 0.0, -1.0],
                low: -height,
                high: height,
            },
            1 => Self {
                shape: Paraboloid {
                    apex: centre,
                    radius: 0.5,
                    height: half,
                }
                .into(),
                form: [4.0 * height, 0.0, -1.0, 0.0],
                low: f64::NEG_INFINITY,
                high: height,
            },
            _ => Self {
                shape: Cylinder {
                    base: centre,
                    axis: up,
                    radius: 0.5,
                    ends: CylinderEnds::Open,
                }
                .into(),
                form: [4.0, 0.0, 0.0, -1.0],
                low: 0.0,
                high: height,
            },
        }
    }

    /// The radius at a height.
    fn radius(&self, y: f64) -> f64 {
        let [out, yy, y1, one] = self.form;
        (-(yy * y * y + y1 * y + one) / out).sqrt()
    }

    /// Signed distance of a height inside the clip.
    fn inside(&self, y: f64) -> f64 {
        (self.high - y).min(y - self.low)
    }
}

/// Protects: hits near the clip planes of open quadrics agree with f64.
#[test]
fn p14_clips_are_exact() {
    judge("P14 border", 15, 600_000, |rng| {
        let point = round_to_f32(rng.sample_point_in_cube() * 3.0);
        let open = OpenQuadric::any(rng, point);
        let y = if open.low.is_finite() && rng.next_sign() > 0.0 {
            open.low
        } else {
            open.high
        };
        let (radius, angle) = (
            open.radius(y),
            rng.next_in_unit_interval() * core::f64::consts::TAU,
        );
        let scale = point.abs().max_element() + radius + y.abs();
        let jitter = rng.choose(&STEPS) * ulp(scale);
        let rim = point + DVec3::new(radius * angle.cos(), y + jitter, radius * angle.sin());
        let ray = create_ray_towards::<f32>(
            rim + rng.sample_direction() * rng.next_uniform(1.0, 8.0),
            rim,
        );
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let scale = scale.max(o.abs().max_element());
        // All roots of the unclipped surface, in f64 relative to the ray's point nearest to the
        // centre.
        let f = o - point;
        let ahead = -f.dot(d) / d.length_squared();
        let f = f + d * ahead;
        let [out, yy, y1, one] = open.form;
        let form = |a: DVec3, b: DVec3| (a.x * b.x + a.z * b.z) * out + a.y * b.y * yy;
        let (a, b, c) = (
            form(d, d),
            form(d, f) + 0.5 * y1 * d.y,
            form(f, f) + y1 * f.y + one,
        );
        let discriminant = b * b - a * c;
        if discriminant < 1e-3 || a.abs() < 1e-3 {
            return Verdict::Skipped;
        }
        let roots = [
            (-b - discriminant.sqrt()) / a + ahead,
            (discriminant.sqrt() - b) / a + ahead,
        ];
        let margins = roots.map(|t| open.inside(f.y + d.y * (t - ahead)));
        if roots
            .iter()
            .zip(margins)
            .any(|(t, m)| m.abs() < 4.0 * ulp(scale) || t.abs() < 1e-3)
        {
            return Verdict::Skipped;
        }
        let expected = roots
            .iter()
            .zip(margins)
            .filter(|(t, m)| **t > 0.0 && *m > 0.0)
            .map(|r| *r.0)
            .fold(f64::INFINITY, f64::min);
        let got = nearest_hit::<f32>(&open.shape, &ray).map_or(f64::INFINITY, |h| f64::from(h.t));
        let same = got == expected || (got - expected).abs() < 1e-4;
        require(same, || {
            format!(
                "{got} instead of {expected}, margins {margins:?}{} {:?}",
                format_ray_bits(&ray),
                open.shape
            )
        })
    })
    .expect_right(200_000);
}
