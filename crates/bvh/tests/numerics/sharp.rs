//! Ray origins near edges lie on the side of all adjacent surfaces to which the ray leaves, under
//! any flattening map.

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::{AnyShape, Cone, Sphere, Torus, TransformedShape};
use raywright_bvh::{Interval, PreparedRay, Ray, Real, Side, Vector};

use super::edged::{EdgedShape, edged, round};
use super::mapped::solved;
use super::support::{
    CaseOutcome, CaseRng, Expect, Verdict, create_ray_towards, format_ray_bits, judge, require,
    round_to_f32, to_scalar,
};

/// A map that flattens by a factor in a random direction, with rotation and translation.
pub fn flattening(rng: &mut CaseRng, by: f64) -> DAffine3 {
    let n = rng.sample_direction();
    let squeeze = DMat3::IDENTITY + DMat3::from_cols(n * n.x, n * n.y, n * n.z) * (by - 1.0);
    let turn = DMat3::from_axis_angle(rng.sample_direction(), rng.next_uniform(0.0, 6.0));
    DAffine3 {
        matrix3: turn * squeeze,
        translation: round_to_f32(
            rng.sample_point_in_cube() * rng.choose(&[0.0, 0.5, 10.0, 1000.0]),
        ),
    }
}

/// A ray origin in the shape's space, at full precision, so that the last digit decides.
pub fn back(map: DAffine3, start: DVec3) -> DVec3 {
    solved(map.matrix3, start - map.translation)
}

/// Whether a solid is too thin for its points' precision under a map that flattens by `by`: its
/// inner ball is less than [`STORED`] roundings of a point's coordinates thick, plus [`MAPPED`]
/// roundings of f64, magnified by the inverse map and measured from the ray's origin.
pub fn is_thin<R: Real>(ball: f64, by: f64, point: DVec3, distance: f64) -> bool {
    let (stored, core) = (R::ROUNDOFF.to_f64(), f64::ROUNDOFF.to_f64());
    by * ball < STORED * stored * point.abs().max_element() + MAPPED * core * (1.0 + distance) / by
}

/// An origin is offset and rounded by up to five and a half roundings in each of three axes, about
/// ten in total, and an apex has two walls at once. Around a smaller ball some solids contain no
/// safe origin.
const STORED: f64 = 16.0;

/// The number of f64 roundings: a bound counts sixteen of each of nine products in the map and its
/// inverse, and an origin moves by several bounds.
const MAPPED: f64 = 2048.0;

/// Rays to both sides from hits near edges, under maps that flatten by a factor; without a map for
/// the factor one.
fn starts<R: Real>(edged: &EdgedShape<R>, by: f64) -> CaseOutcome {
    let EdgedShape {
        name,
        shape,
        height,
        edge,
        ..
    } = edged;
    judge(
        &format!(
            "starts on the {name}, flattened by {by:e}, in {}",
            std::any::type_name::<R>()
        ),
        420,
        50_000,
        |rng| {
            let map = if by == 1.0 {
                DAffine3::from_translation(rng.sample_point_in_cube().round())
            } else {
                flattening(rng, by)
            };
            let transformed_shape =
                TransformedShape::<R>::new(*shape, map).expect("an invertible map");
            let off = 10_f64.powf(rng.next_uniform(-9.0, -0.5));
            let target = map.transform_point3(edge(rng) + rng.sample_point_in_cube() * off);
            let ray = create_ray_towards::<R>(
                target + rng.sample_direction() * rng.choose(&[0.5, 3.0, 30.0]),
                target,
            );
            let prepared_ray = PreparedRay::new(ray);
            let Some(hit) =
                transformed_shape.intersect(&prepared_ray, Interval::positive(), Side::Both)
            else {
                return Verdict::Skipped;
            };
            let surface = transformed_shape
                .locate_surface_point(&prepared_ray, hit)
                .to_scalar::<R>();
            if is_thin::<R>(edged.ball, by, surface.point.to_f64(), hit.t.to_f64()) {
                return Verdict::Skipped;
            }
            let normal = surface.normal.to_f64();
            for direction in [normal, -normal] {
                let start = surface.spawn_ray_origin(to_scalar::<R>(direction)).to_f64();
                let inward = direction == -normal;
                let above = height(back(map, start));
                if (above < 0.0) != inward {
                    return Verdict::Wrong(format!(
                        "{above:e} above, inward {inward}, {surface:?} {map:?}{}",
                        format_ray_bits::<R>(&ray)
                    ));
                }
            }
            Verdict::Right(0.0)
        },
    )
}

fn all_sides<R: Real>() {
    for edged in edged::<R>().iter().chain(&round()) {
        for by in [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
            // With flatter maps, f32 holds no safe origin in most solids.
            starts(edged, by).expect_right(if by >= 1e-4 { 400 } else { 0 });
        }
    }
}

/// Protects: a ray origin near an edge lies on the side to which the ray leaves, however sharp a
/// map makes the edge.
#[test]
fn s05_starts_beside_edges_are_on_the_right_side() {
    all_sides::<f32>();
    all_sides::<f64>();
}

/// Protects: ray origins near seams of a cylinder and of complete and truncated cones, without any
/// map.
#[test]
fn s05_starts_beside_seams_are_on_the_right_side() {
    fn check<R: Real>() {
        for EdgedShape {
            name,
            shape,
            height,
            edge,
            ..
        } in &edged::<R>()
        {
            judge(
                &format!("starts on the {name} in {}", std::any::type_name::<R>()),
                421,
                100_000,
                |rng| {
                    let target = edge(rng)
                        + rng.sample_point_in_cube() * 10_f64.powf(rng.next_uniform(-9.0, -0.5));
                    let ray = create_ray_towards::<R>(
                        target + rng.sample_direction() * rng.choose(&[0.5, 3.0, 30.0]),
                        target,
                    );
                    let prepared_ray = PreparedRay::new(ray);
                    let hit = raywright_bvh::Shape::intersect(
                        shape,
                        &prepared_ray,
                        Interval::positive(),
                        Side::Both,
                    );
                    let Some(hit) = hit else {
                        return Verdict::Skipped;
                    };
                    let surface = raywright_bvh::Shape::surface(shape, &prepared_ray, hit);
                    let normal = surface.normal.to_f64();
                    let above = [normal, -normal].map(|direction| {
                        height(surface.spawn_ray_origin(to_scalar::<R>(direction)).to_f64())
                    });
                    require(above[0] > 0.0 && above[1] < 0.0, || {
                        format!("{above:?} {surface:?}{}", format_ray_bits::<R>(&ray))
                    })
                },
            )
            .expect_right(20_000);
        }
    }
    check::<f32>();
    check::<f64>();
}

/// Protects: an outward ray's origin on a sphere or torus far from the world origin is outside, in
/// f64 too. That the error bound includes the centre is judged before storage, whose rounding is as
/// large, by `stated_bounds_hold_far_from_the_origin`.
#[test]
fn far_starts_are_outside() {
    fn check<R: Real>() {
        let real = R::from_f64;
        for far in [1.0, 1e4, 1e8] {
            judge(
                &format!(
                    "starts on far round shapes in {}",
                    std::any::type_name::<R>()
                ),
                422,
                40_000,
                |rng| {
                    let centre = round_to_f32(rng.sample_direction() * far);
                    // Large enough to be resolved at that distance.
                    let size = if R::ROUNDOFF == real(super::support::UNIT_ROUNDOFF) {
                        f64::from((far * 1e-3).max(1.0) as f32)
                    } else {
                        1.0
                    };
                    let (c, axis) = (to_scalar::<R>(centre), to_scalar::<R>(DVec3::Y));
                    let ring = rng.next_sign() > 0.0;
                    let shape: AnyShape<R> = if ring {
                        Torus {
                            centre: c,
                            axis,
                            major_radius: real(size),
                            minor_radius: real(size * 0.25),
                        }
                        .into()
                    } else {
                        Sphere {
                            centre: c,
                            radius: real(size),
                        }
                        .into()
                    };
                    let ray = create_ray_towards::<R>(
                        centre + rng.sample_direction() * size * 4.0,
                        centre + rng.sample_point_in_cube() * size,
                    );
                    let prepared_ray = PreparedRay::new(ray);
                    let hit = raywright_bvh::Shape::intersect(
                        &shape,
                        &prepared_ray,
                        Interval::positive(),
                        Side::Both,
                    );
                    let Some(hit) = hit else {
                        return Verdict::Skipped;
                    };
                    let surface = raywright_bvh::Shape::surface(&shape, &prepared_ray, hit);
                    let above = |p: DVec3| {
                        let q = p - centre;
                        let out = DVec3::new(q.x, 0.0, q.z).length() - size;
                        if ring {
                            (out * out + q.y * q.y).sqrt() - size * 0.25
                        } else {
                            q.length() - size
                        }
                    };
                    let normal = surface.normal.to_f64();
                    let above = [normal, -normal].map(|direction| {
                        above(surface.spawn_ray_origin(to_scalar::<R>(direction)).to_f64())
                    });
                    require(above[0] > 0.0 && above[1] < 0.0, || {
                        format!("{above:?} {surface:?}{}", format_ray_bits::<R>(&ray))
                    })
                },
            )
            .expect_right(8_000);
        }
    }
    check::<f32>();
    check::<f64>();
}

/// Protects: outward rays from a mapped shape do not hit it again, for any condition number of the
/// map. That the bound includes the inverse map is judged by `bounds_include_the_inverse_map`:
/// under most maps the normal hides it.
#[test]
fn starts_under_ill_conditioned_maps_are_clear() {
    fn check<R: Real>() {
        // A straight line may leave a hyperboloid and hit it again.
        for edged in edged::<R>().into_iter().filter(|e| e.name != "hyperboloid") {
            judge(
                &format!(
                    "rays that leave the {} in {}",
                    edged.name,
                    std::any::type_name::<R>()
                ),
                423,
                20_000,
                |rng| {
                    let by = 10_f64.powf(rng.next_uniform(-6.0, -3.0));
                    let map = flattening(rng, by);
                    let transformed_shape =
                        TransformedShape::<R>::new(edged.shape, map).expect("an invertible map");
                    let target = map.transform_point3(rng.sample_point_in_cube() * 0.5);
                    let ray = create_ray_towards::<R>(
                        target + rng.sample_direction() * rng.choose(&[1.0, 30.0]),
                        target,
                    );
                    let prepared_ray = PreparedRay::new(ray);
                    let Some(hit) = transformed_shape.intersect(
                        &prepared_ray,
                        Interval::positive(),
                        Side::Outside,
                    ) else {
                        return Verdict::Skipped;
                    };
                    let surface = transformed_shape
                        .locate_surface_point(&prepared_ray, hit)
                        .to_scalar::<R>();
                    if is_thin::<R>(edged.ball, by, surface.point.to_f64(), hit.t.to_f64()) {
                        return Verdict::Skipped;
                    }
                    for _ in 0..20 {
                        let d = round_to_f32(rng.sample_direction());
                        let d = if surface.normal.to_f64().dot(d) < 0.0 {
                            -d
                        } else {
                            d
                        };
                        let leaving = Ray::new(
                            surface.spawn_ray_origin(to_scalar::<R>(d)),
                            to_scalar::<R>(d),
                        );
                        if let Some(again) = transformed_shape.intersect(
                            &PreparedRay::new(leaving),
                            Interval::positive(),
                            Side::Both,
                        ) {
                            return Verdict::Wrong(format!(
                                "{again:?} {surface:?} {map:?}{}",
                                format_ray_bits::<R>(&leaving)
                            ));
                        }
                    }
                    Verdict::Right(0.0)
                },
            )
            .expect_right(1);
        }
    }
    check::<f32>();
    check::<f64>();
}

/// Protects: the normal at a cone's apex, hit exactly, points out of the cone, at whichever end the
/// apex is.
#[test]
fn tips_point_outwards() {
    fn check<R: Real>() {
        let real = R::from_f64;
        for up in [1.0, -1.0] {
            for tip_first in [false, true] {
                // The apex at height `up`, the base at zero.
                let (base, axis) = if tip_first {
                    (DVec3::Y * up, DVec3::Y * -up)
                } else {
                    (DVec3::ZERO, DVec3::Y * up)
                };
                let (low, high) = if tip_first { (0.0, 0.5) } else { (0.5, 0.0) };
                let (base, axis) = (to_scalar::<R>(base), to_scalar::<R>(axis));
                let cone = Cone {
                    base,
                    axis,
                    radius: real(low),
                    top_radius: real(high),
                };
                let ray = Ray::<R>::new(
                    to_scalar::<R>(DVec3::Y * (3.0 * up)),
                    to_scalar::<R>(DVec3::Y * -up),
                );
                let prepared_ray = PreparedRay::new(ray);
                let hit = raywright_bvh::Shape::intersect(
                    &cone,
                    &prepared_ray,
                    Interval::positive(),
                    Side::Both,
                )
                .expect("the tip");
                assert_eq!(hit.t.to_f64(), 2.0);
                let surface = raywright_bvh::Shape::surface(&cone, &prepared_ray, hit);
                let (normal, point) = (surface.normal.to_f64(), surface.point.to_f64());
                assert!(normal.y * up > 0.4, "{normal} at the tip of {cone:?}");
                // Origins beside the apex, above and below the wall.
                let inside =
                    |p: DVec3| 1.0 - p.y * up - 2.0 * DVec3::new(p.x, 0.0, p.z).length() > 0.0;
                let inward = [normal, -normal].map(|direction| {
                    inside(surface.spawn_ray_origin(to_scalar::<R>(direction)).to_f64())
                });
                assert!(
                    inward == [false, true],
                    "{inward:?} beside the tip of {cone:?}"
                );
                assert!(
                    (point - DVec3::Y * up).length() < 1e-5,
                    "{point} for the tip of {cone:?}"
                );
            }
        }
    }
    check::<f32>();
    check::<f32>();
    check::<f64>();
}
