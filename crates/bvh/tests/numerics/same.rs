//! Scan, box tests and tree give the same bits in every precision, in cases where textbook formulas
//! find hits beside or before their shapes.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{AnyShape, Ellipsoid, Sphere, Torus};
use raywright_bvh::{
    AcceleratorKind, BuildQuality, Geometry, Interval, Occlusion, PrimitiveSet, Ray, Real, Side,
    Visibility,
};

use super::stated::shapes;
use super::support::{
    CaseRng, Expect, Verdict, create_ray_towards, format_ray_bits, judge, round_to_f32, to_scalar,
};

/// Visibility that passes every hit to the filter.
const ASKED: Visibility = Visibility {
    side: Side::Both,
    occlusion: Occlusion::Filtered,
};

/// All hits passed to an any-hit filter, sorted.
fn offered<R: Real>(
    geometry: &Geometry<R>,
    ray: &Ray<R>,
    range: Interval<R>,
) -> Vec<([u32; 3], u64)> {
    let mut all = vec![];
    let mut refuse = |h: &raywright_bvh::Hit<R>| {
        all.push((h.tie_order(), h.t.to_f64().to_bits()));
        false
    };
    assert!(!geometry.occluded(ray, range, &mut refuse, &mut ()));
    all.sort_unstable();
    all
}

/// The same set under every accelerator, the scan first.
fn every<R: Real>(group: &PrimitiveSet<R>) -> Vec<Geometry<R>> {
    let trees = BuildQuality::ALL.into_iter().map(AcceleratorKind::Tree);
    let kinds = [AcceleratorKind::Linear].into_iter().chain(trees);
    kinds
        .map(|kind| Geometry::new(group.clone(), kind))
        .collect()
}

/// Compares every accelerator of a set by random rays: closest and any hits, with and without a far
/// end.
fn agree<R: Real>(
    case: &str,
    group: &PrimitiveSet<R>,
    count: u32,
    ray: impl Fn(&mut CaseRng) -> Ray<R> + Sync,
) {
    let all = every(group);
    let (scan, others) = all.split_first().expect("a scan at least");
    judge(
        &format!("{case} in {}", std::any::type_name::<R>()),
        400,
        count,
        |rng| {
            let ray = ray(rng);
            let far = scan
                .closest(&ray, Interval::positive(), &mut ())
                .map_or(R::ONE, |h| h.t);
            let far = far * R::from_f64(rng.choose(&[1.0, 1.5, 0.9]));
            for max in [R::INFINITY, far] {
                let range = Interval { min: R::ZERO, max };
                let (nearest, hits) = (
                    scan.closest(&ray, range, &mut ()),
                    offered(scan, &ray, range),
                );
                for (i, other) in others.iter().enumerate() {
                    let (hit, among) = (
                        other.closest(&ray, range, &mut ()),
                        offered(other, &ray, range),
                    );
                    if hit != nearest || among != hits {
                        return Verdict::Wrong(format!(
                            "{i}: {hit:?} for {nearest:?}, {among:?} for {hits:?}{}",
                            format_ray_bits::<R>(&ray)
                        ));
                    }
                }
            }
            Verdict::Right(0.0)
        },
    )
    .expect_right(u64::from(count));
}

fn agree_everywhere<R: Real>() {
    let real = R::from_f64;
    // False hits beside the shape: the quartic of a torus in f32 from far away.
    for away in [9.0, 40.0] {
        let mut group = PrimitiveSet::<R>::default();
        for i in 0..4 {
            let centre = DVec3::new(f64::from(i) * 0.7, 0.0, f64::from(i) * 1.5);
            let torus = Torus::new(centre, DVec3::new(0.2, 1.0, 0.3), 0.8, 0.25);
            group.add_shape(torus.into(), ASKED).expect("finite");
        }
        agree(&format!("tori from {away}"), &group, 40_000, |rng| {
            let origin = round_to_f32(rng.sample_direction() * away);
            create_ray_towards::<R>(origin, rng.sample_point_in_cube() * 2.0)
        });
    }
    // False hits before the shape: spheres too far away for a textbook formula.
    let mut group = PrimitiveSet::<R>::default();
    let rng = &mut CaseRng::new(401, 0);
    let balls: Vec<DVec3> = (0..40)
        .map(|_| {
            round_to_f32(
                rng.sample_direction() * (300.0 * 1000_f64.powf(rng.next_in_unit_interval())),
            )
        })
        .collect();
    for &centre in &balls {
        let ball = Sphere {
            centre: to_scalar::<R>(centre),
            radius: real(1.0),
        };
        group.add_sphere(ball, ASKED).expect("finite");
    }
    agree("far spheres", &group, 80_000, |rng| {
        let target = rng.choose(&balls) + rng.sample_point_in_cube() * 1.2;
        create_ray_towards::<R>(rng.sample_point_in_cube(), target)
    });
}

/// Protects: every accelerator finds the same hits, also for rays that graze corners, edges and
/// silhouettes, and from far away.
#[test]
fn hits_are_the_same_for_every_accelerator() {
    agree_everywhere::<f32>();
    agree_everywhere::<f64>();
}

/// Three copies of every shape side by side: unmapped, mapped, and instanced.
fn family<R: Real>() -> PrimitiveSet<R> {
    let mut group = PrimitiveSet::<R>::default();
    let mut inner = PrimitiveSet::<R>::default();
    for (i, (_, shape)) in shapes::<R>().into_iter().enumerate() {
        let point = DVec3::new(i as f64 % 4.0, (i / 4) as f64, 0.0) * 3.0;
        // An unbounded shape lies outside every accelerator and hides the shapes behind it.
        if matches!(shape, AnyShape::Plane(_)) || raywright_bvh::Shape::bounds(&shape).is_none() {
            continue;
        }
        inner.add_shape(shape, ASKED).expect("finite");
        let turned = DAffine3::from_translation(point)
            * DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0 + i as f64);
        group
            .add_transformed_shape(
                shape,
                turned * DAffine3::from_scale(DVec3::new(1.0, 0.6, -1.2)),
                ASKED,
            )
            .expect("finite");
    }
    for kind in [AcceleratorKind::Linear, AcceleratorKind::default()] {
        let inner = group
            .add_part(Geometry::new(inner.clone(), kind))
            .expect("no instances in it");
        let map =
            DAffine3::from_translation(DVec3::new(4.0, 4.0, -4.0)) * DAffine3::from_rotation_x(0.4);
        group
            .add_instance(inner, map, ASKED)
            .expect("an invertible map");
        group
            .add_instance(
                inner,
                map * DAffine3::from_scale(DVec3::new(0.3, 2.0, -1.0)),
                ASKED,
            )
            .expect("the same");
    }
    group
}

/// Rays at the family from nearby to ten thousand sizes away, and axis-aligned rays that graze box
/// sides where shapes touch them: these have no rounded direction that would hide a difference.
fn passing<R: Real>(rng: &mut CaseRng, bounds: &[raywright_bvh::Aabb]) -> Ray<R> {
    let away = rng.choose(&[3.0, 30.0, 300.0, 3000.0, 1e4]);
    let b = rng.choose(bounds);
    if rng.next_in_unit_interval() < 0.5 {
        return create_ray_towards::<R>(
            b.centre() + rng.sample_direction() * away,
            b.centre() + rng.sample_point_in_cube() * b.extent() * 0.55,
        );
    }
    let (axis, side) = (
        (rng.next_bits() % 3) as usize,
        (rng.next_bits() % 2) as usize,
    );
    let (along, across) = ((axis + 1 + side) % 3, (axis + 2 - side) % 3);
    let mut start = b.centre();
    let edge = if rng.next_sign() > 0.0 {
        b.max[axis]
    } else {
        b.min[axis]
    };
    start[axis] = edge * (1.0 + rng.next_uniform(-4.0, 4.0) * f64::from(f32::EPSILON));
    start[across] += b.extent()[across] * 1e-3 * rng.next_uniform(-1.0, 1.0);
    let mut direction = DVec3::ZERO;
    direction[along] = rng.next_sign();
    Ray::new(
        to_scalar::<R>(start - direction * away),
        to_scalar::<R>(direction),
    )
}

fn family_agrees<R: Real>() {
    let group = family::<R>();
    let mut bounds = vec![];
    for (_, shape) in shapes::<R>() {
        bounds.extend(raywright_bvh::Shape::bounds(&shape));
    }
    let whole_bounds = Geometry::new(group.clone(), AcceleratorKind::Linear)
        .bounds()
        .expect("bounded");
    bounds.push(whole_bounds);
    agree("every shape", &group, 100_000, |rng| {
        passing::<R>(rng, &bounds)
    });
    // Four copies of each shape alone, so that a tree is built and the rays graze the shape's own
    // box.
    for (name, shape) in shapes::<R>() {
        let Some(own_bounds) = raywright_bvh::Shape::bounds(&shape) else {
            continue;
        };
        let mut group = PrimitiveSet::<R>::default();
        for i in 0..4 {
            let map = DAffine3::from_translation(DVec3::splat(f64::from(i) * 1.5));
            group
                .add_transformed_shape(shape, map, ASKED)
                .expect("finite");
        }
        agree(name, &group, 20_000, |rng| passing::<R>(rng, &[own_bounds]));
    }
}

/// Protects: every accelerator gives the same hits for every shape: alone, mapped, and instanced,
/// and for rays that graze its box.
#[test]
fn every_shape_is_the_same_for_every_accelerator() {
    family_agrees::<f32>();
    family_agrees::<f64>();
}

fn grazing_agrees<R: Real>() {
    let real = R::from_f64;
    for exponent in 4..=8 {
        let far = 10_f64.powi(exponent);
        // Four of a kind, so that a tree is built; two kinds, since spheres have a separate test.
        let mut group = PrimitiveSet::<R>::default();
        let centres = [DVec3::ZERO, DVec3::X * 8.0, DVec3::Y * 8.0, DVec3::Z * 8.0];
        for &centre in &centres {
            let ball = Sphere {
                centre: to_scalar::<R>(centre),
                radius: real(1.0),
            };
            group.add_sphere(ball, ASKED).expect("finite");
            let egg = Ellipsoid {
                centre: to_scalar::<R>(centre + DVec3::splat(4.0)),
                semi_axes: to_scalar::<R>(DVec3::ONE),
            };
            group.add_shape(egg.into(), ASKED).expect("finite");
        }
        agree::<R>(
            &format!("balls grazed from {far:e}"),
            &group,
            40_000,
            |rng| {
                let axis = (rng.next_bits() % 3) as usize;
                let (side, across) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut start = rng.choose(&centres)
                    + DVec3::splat(4.0) * f64::from(rng.next_bits() as u32 % 2);
                start[side] += rng.next_sign()
                    * (1.0 + 10_f64.powf(rng.next_uniform(-9.0, -2.0)) * rng.next_sign());
                start[across] += 10_f64.powf(rng.next_uniform(-9.0, -1.0)) * rng.next_sign();
                let mut direction = DVec3::ZERO;
                direction[axis] = rng.next_sign();
                Ray::new(
                    to_scalar::<R>(start - direction * far),
                    to_scalar::<R>(direction),
                )
            },
        );
    }
}

/// Protects: hits decided in f64 lie within the boxes of the tree, also for axis-aligned rays that
/// graze a sphere from up to 10⁸ radii away, which are as exact there as nearby.
#[test]
fn grazed_balls_are_the_same_for_every_accelerator() {
    grazing_agrees::<f32>();
    grazing_agrees::<f64>();
}
