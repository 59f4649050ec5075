//! Cases T01, T02, T04, T05, T08 and T16: rays that hit boxes at faces, edges and extreme scales.
//! No traversal may lose such a hit. The primitives are the boxes themselves, as solids. The oracle
//! is a slab test in f64.

use glam::DVec3;

use super::verdicts::{
    CaseRng, RayCount, Verdict, create_ray_towards, create_unnormalised_ray, format_ray_bits,
    judge_rays, round_to_f32, to_scalar,
};
use super::{Measurement, measure_by_each_kernel, textbook};
use crate::shapes::{AnyShape, Cuboid};
use crate::{
    AcceleratorKind, Geometry, Hit, Interval, PrimitiveSet, Ray, Real, Vector, Visibility,
};

/// Least and greatest corner, both exact in f32.
type BoxCorners = [DVec3; 2];

/// Builds a geometry of solid boxes.
fn build_box_geometry<R: Real>(boxes: &[BoxCorners], kind: AcceleratorKind) -> Geometry<R> {
    let mut group = PrimitiveSet::<R>::default();
    for &[min, max] in boxes {
        group
            .add_shape(
                AnyShape::Cuboid(Cuboid::new(min, max)),
                Visibility::default(),
            )
            .expect("finite corners");
    }
    Geometry::new(group, kind)
}

/// Returns the closest hit of a ray with solid boxes, at any positive distance.
fn closest_box_hit<R: Real>(geometry: &Geometry<R>, ray: &Ray<R>) -> Option<Hit<R>> {
    geometry.closest(ray, Interval::positive(), &mut ())
}

/// Computes the distances at which a ray enters and leaves a box, in f64 and in units of the
/// direction's length; `None` for a miss. A ray parallel to two faces hits only if its origin is
/// between them.
fn intersect_slabs(ray: &Ray<impl Real>, [min, max]: BoxCorners) -> Option<[f64; 2]> {
    let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
    let mut range = [f64::NEG_INFINITY, f64::INFINITY];
    for axis in 0..3 {
        let (low, high) = (min[axis] - o[axis], max[axis] - o[axis]);
        if d[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
            continue;
        }
        let (a, b) = (low / d[axis], high / d[axis]);
        range = [range[0].max(a.min(b)), range[1].min(a.max(b))];
    }
    (range[0] < range[1]).then_some(range)
}

/// Creates `count` random boxes, with edges from 0.1 to 1.1 and centres in a cube with edges of 20.
fn scatter_boxes(seed: u64, count: u64) -> Vec<BoxCorners> {
    let one = |index| {
        let rng = &mut CaseRng::new(seed, index);
        let (centre, half) = (
            rng.sample_point_in_cube() * 10.0,
            (rng.sample_point_in_cube() + 1.2) * 0.25,
        );
        [round_to_f32(centre - half), round_to_f32(centre + half)]
    };
    (0..count).map(one).collect()
}

/// Judges a ray that is aimed at the box `aimed_at`. The ray is right if it hits a box before it
/// leaves `aimed_at`, and if the tree finds the same hit as the linear scan. A ray that misses
/// `aimed_at` is skipped.
fn judge_target_hit<R: Real>(
    tree: &Geometry<R>,
    scan: &Geometry<R>,
    ray: &Ray<R>,
    aimed_at: BoxCorners,
) -> Verdict {
    let (hit, expected) = (closest_box_hit(tree, ray), closest_box_hit(scan, ray));
    let Some([_, leaves]) = intersect_slabs(ray, aimed_at) else {
        return Verdict::Skipped;
    };
    let is_early = hit.is_some_and(|hit| hit.t.to_f64() <= leaves * (1.0 + 1e-6));
    Verdict::from_condition(is_early && hit == expected, || {
        format!(
            "the tree finds {hit:?}, the linear scan {expected:?}; both must find the same hit, before the ray leaves the box at which it is aimed{}",
            format_ray_bits(ray)
        )
    })
}

/// Measures case T01: rays along an axis towards a distant box, parallel to one of its faces. The
/// ray is inside the box's cross-section, at a distance from 0.5 to 1e-6 from the face. The box is
/// 1 to 10⁸ units away.
pub fn measure_rays_along_faces<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let lengths: Vec<f64> = (0..=8).map(|k| 10_f64.powi(k)).collect();
    let boxes = |&length: &f64| -> Vec<BoxCorners> {
        let along = |axis: usize| {
            let (mut min, mut max) = (DVec3::ZERO, DVec3::ONE);
            // Far away, where neighbouring f32 numbers differ by more than one, the box is several
            // such spacings thick.
            (min[axis], max[axis]) = (length, length + (length * 1e-6).max(1.0));
            [round_to_f32(min), round_to_f32(max)]
        };
        // Further boxes behind the rays' origins, so that a tree is built.
        let behind = scatter_boxes(210, 60)
            .into_iter()
            .map(|corners| corners.map(|p| p - DVec3::splat(20.0)));
        (0..3).map(along).chain(behind).collect()
    };
    let drawn = |rng: &mut CaseRng| {
        let (axis, index) = (
            rng.next_bits() as usize % 3,
            rng.next_bits() as usize % lengths.len(),
        );
        let (mut o, mut d) = (DVec3::ZERO, DVec3::ZERO);
        d[axis] = 1.0;
        o[(axis + 1) % 3] = 1.0 - rng.choose(&[0.5, 1e-2, 1e-3, 1e-4, 1e-6]);
        o[(axis + 2) % 3] = rng.next_uniform(0.01, 0.99);
        (
            index,
            axis,
            create_unnormalised_ray::<R>(round_to_f32(o), d),
        )
    };
    let trees: Vec<_> = lengths
        .iter()
        .map(|length| build_box_geometry::<R>(&boxes(length), AcceleratorKind::default()))
        .collect();
    let mut measured = measure_by_each_kernel(trees, |trees| {
        judge_rays("T01", 201, 400_000, rays, |rng| {
            let (index, axis, ray) = drawn(rng);
            let hit = closest_box_hit(&trees[index], &ray);
            let is_found = hit
                .is_some_and(|hit| hit.object as usize == axis && hit.t.to_f64() == lengths[index]);
            Verdict::from_condition(is_found, || {
                format!(
                    "hit {hit:?} instead of a hit at distance {:e}{}",
                    lengths[index],
                    format_ray_bits(&ray)
                )
            })
        })
    });
    let clamped = judge_rays("T01", 201, 400_000, rays, |rng| {
        let (index, axis, ray) = drawn(rng);
        let [min, max] = boxes(&lengths[index])[axis].map(DVec3::as_vec3);
        let ray = Ray::new(ray.origin.to_f32(), ray.direction.to_f32());
        Verdict::from_condition(
            textbook::enters_box_by_clamped_reciprocals([min, max], &ray),
            || {
                format!(
                    "the slab test with clamped reciprocals reports a miss, although the ray enters the box{}",
                    format_ray_bits(&ray)
                )
            },
        )
    });
    measured
        .iter_mut()
        .for_each(|measurement| measurement.textbook = Some(clamped.clone()));
    measured
}

/// Measures case T02: rays in the planes of box faces. The zero components of their directions have
/// either sign.
pub fn measure_rays_with_signed_zeros<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let whole = |index| {
        let rng = &mut CaseRng::new(211, index);
        let min = (rng.sample_point_in_cube() * 8.0).round();
        [
            min,
            min + ((rng.sample_point_in_cube() + 1.0) * 1.5).floor() + 1.0,
        ]
    };
    let boxes: Vec<BoxCorners> = (0..1000).map(whole).collect();
    let scan = build_box_geometry::<R>(&boxes, AcceleratorKind::Linear);
    measure_by_each_kernel(
        vec![build_box_geometry(&boxes, AcceleratorKind::default())],
        |trees| {
            judge_rays("T02", 202, 40_000, rays, |rng| {
                let (origin, zeros) = (
                    (rng.sample_point_in_cube() * 24.0).round() * 0.5,
                    1 + rng.next_bits() % 6,
                );
                let is_zero = |axis: usize| zeros >> axis & 1 == 1;
                let slope = round_to_f32(rng.sample_point_in_cube());
                let with = |signs: usize| {
                    let component = |axis: usize| match (is_zero(axis), signs >> axis & 1) {
                        (true, 0) => 0.0,
                        (true, _) => -0.0,
                        _ => slope[axis],
                    };
                    create_unnormalised_ray::<R>(
                        origin,
                        DVec3::new(component(0), component(1), component(2)),
                    )
                };
                let expected = closest_box_hit(&scan, &with(0));
                let wrong = (0..8)
                    .map(with)
                    .find(|ray| closest_box_hit(&trees[0], ray) != expected);
                wrong.map_or(Verdict::Right(0.0), |ray| {
                    Verdict::Wrong(format!(
                        "the hit must be {expected:?} for either sign of a direction component that is zero, but changes with the sign{}",
                        format_ray_bits(&ray)
                    ))
                })
            })
        },
    )
}

/// Measures case T04: rays along an axis whose other direction components are close to zero.
pub fn measure_rays_with_tiny_components<R: Real>(rays: RayCount) -> Vec<Measurement> {
    measure_rays_at_boxes::<R>("T04", 204, rays, |rng, target| {
        let (axis, size) = (
            rng.next_bits() as usize % 3,
            rng.choose(&[1e-7, 1e-20, 1e-40]),
        );
        let mut d = rng.sample_point_in_cube() * size;
        d[axis] = rng.next_sign();
        create_unnormalised_ray::<R>(round_to_f32(target - d * 30.0), round_to_f32(d))
    })
}

/// Measures case T05: rays with directions of any length, from 1e-20 to 1e20.
pub fn measure_unnormalised_rays<R: Real>(rays: RayCount) -> Vec<Measurement> {
    measure_rays_at_boxes::<R>("T05", 205, rays, |rng, target| {
        let d = rng.sample_direction();
        create_unnormalised_ray::<R>(
            round_to_f32(target - d * 30.0),
            round_to_f32(d * 10_f64.powf(rng.next_uniform(-20.0, 20.0))),
        )
    })
}

/// Measures rays towards random points well inside random boxes. `drawn` returns a ray to the given
/// point.
fn measure_rays_at_boxes<R: Real>(
    case: &str,
    seed: u64,
    rays: RayCount,
    drawn: impl Fn(&mut CaseRng, DVec3) -> Ray<R> + Sync,
) -> Vec<Measurement> {
    let boxes = scatter_boxes(seed + 10, 300);
    let scan = build_box_geometry::<R>(&boxes, AcceleratorKind::Linear);
    measure_by_each_kernel(
        vec![build_box_geometry(&boxes, AcceleratorKind::default())],
        |trees| {
            judge_rays(case, seed, 80_000, rays, |rng| {
                let [min, max] = rng.choose(&boxes);
                let target = min + (max - min) * (rng.sample_point_in_cube() * 0.45 + 0.5);
                judge_target_hit(&trees[0], &scan, &drawn(rng, target), [min, max])
            })
        },
    )
}

/// Measures case T08: boxes of size 1e-6 beside boxes of size 1e6, by rays from three diameters
/// away.
pub fn measure_boxes_of_mixed_sizes<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let one = |index: u64| {
        let rng = &mut CaseRng::new(212, index);
        let size = if index.is_multiple_of(2) { 1e-6 } else { 1e6 };
        let (centre, half) = (
            rng.sample_point_in_cube() * (1000.0 * size),
            (rng.sample_point_in_cube() + 2.0) * (0.25 * size),
        );
        [round_to_f32(centre - half), round_to_f32(centre + half)]
    };
    let boxes: Vec<BoxCorners> = (0..2000).map(one).collect();
    let scan = build_box_geometry::<R>(&boxes, AcceleratorKind::Linear);
    measure_by_each_kernel(
        vec![build_box_geometry(&boxes, AcceleratorKind::default())],
        |trees| {
            judge_rays("T08", 208, 40_000, rays, |rng| {
                let [min, max] = rng.choose(&boxes);
                let centre = (min + max) * 0.5;
                let ray = create_ray_towards::<R>(
                    centre + rng.sample_direction() * (3.0 * (max - min).max_element()),
                    centre,
                );
                judge_target_hit(&trees[0], &scan, &ray, [min, max])
            })
        },
    )
}

/// Measures case T16: rays that start on a face of a box, or an ulp inside or outside it. They go
/// inwards, outwards or along the face.
pub fn measure_rays_from_faces<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let boxes = scatter_boxes(216, 300);
    let scan = build_box_geometry::<R>(&boxes, AcceleratorKind::Linear);
    measure_by_each_kernel(
        vec![build_box_geometry(&boxes, AcceleratorKind::default())],
        |trees| {
            judge_rays("T16", 216, 200_000, rays, |rng| {
                let corners = rng.choose(&boxes);
                let [min, max] = corners;
                let axis = rng.next_bits() as usize % 3;
                let mut origin =
                    round_to_f32(min + (max - min) * (rng.sample_point_in_cube() * 0.45 + 0.5));
                let face = rng.choose(&corners)[axis];
                origin[axis] = match rng.next_bits() % 4 {
                    0 => face,
                    1 => R::from_f64(face).next_up().to_f64(),
                    2 => -R::from_f64(-face).next_up().to_f64(),
                    _ => origin[axis],
                };
                let mut d = rng.sample_direction();
                d[axis] = rng.choose(&[d[axis], 0.0, -0.0]);
                let ray = Ray::new(to_scalar::<R>(origin), to_scalar::<R>(round_to_f32(d)));
                let everything = Interval {
                    min: -R::INFINITY,
                    max: R::INFINITY,
                };
                let either_way =
                    |geometry: &Geometry<R>| geometry.closest(&ray, everything, &mut ());
                let (hit, expected) = (
                    closest_box_hit(&trees[0], &ray),
                    closest_box_hit(&scan, &ray),
                );
                // Distance that the ray has left inside the box. A hit is required if this distance
                // exceeds rounding.
                let distance = intersect_slabs(&ray, corners)
                    .map_or(0.0, |[enters, leaves]| leaves - enters.max(0.0));
                let is_right = hit == expected
                    && either_way(&trees[0]) == either_way(&scan)
                    && (distance < 1e-3 || hit.is_some());
                Verdict::from_condition(is_right, || {
                    format!(
                        "the tree finds {hit:?} and the linear scan {expected:?}; the two must find equal hits, also at negative distances, and miss no box that the ray enters{}",
                        format_ray_bits(&ray)
                    )
                })
            })
        },
    )
}
