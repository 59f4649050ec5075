//! Cases T01, T02, T04, T05, T08 and T16: rays that hit boxes at faces, edges and extreme scales.
//! No traversal may lose such a hit. The primitives are the boxes themselves, as solids. The oracles
//! are a slab test in f64 and the linear scan.

use super::prelude::*;
use super::textbook;

/// Least and greatest corner, both exact in f32.
type BoxCorners = [DVec3; 2];

/// Returns solid boxes.
fn cuboids<R: Real>(boxes: &[BoxCorners]) -> Vec<AnyShape<R>> {
    boxes
        .iter()
        .map(|&[min, max]| Cuboid::new(min, max).into())
        .collect()
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

/// Creates a random box around a centre in a cube. `spread` is half the edge of the cube, and half
/// the edge of the box is (x + `least`)·`size` with x uniform in [−1, 1).
fn draw_box(rng: &mut CaseRng, spread: f64, least: f64, size: f64) -> BoxCorners {
    let centre = rng.sample_point_in_cube() * spread;
    let half = (rng.sample_point_in_cube() + least) * size;
    [centre - half, centre + half].map(round_to_f32)
}

/// Creates `count` random boxes, with edges from 0.1 to 1.1 and centres in a cube with edges of 20.
fn scatter_boxes(seed: u64, count: u64) -> Vec<BoxCorners> {
    let draw = |index| draw_box(&mut CaseRng::new(seed, index), 10.0, 1.2, 0.25);
    (0..count).map(draw).collect()
}

/// Judges rays that are aimed at boxes. Each must hit a box before it leaves the box at which it is
/// aimed. A ray that misses that box is skipped.
fn judge_aimed_rays<R: Real>(
    trial: &mut Trial<R>,
    rays: (u64, u32),
    boxes: &[BoxCorners],
    draw: impl Fn(&mut CaseRng, BoxCorners) -> Ray<R> + Sync,
) {
    trial.build_scenes(&[cuboids(boxes)]);
    trial.judge_rays("", rays, |rng, scans| {
        let target = rng.choose(boxes);
        let ray = draw(rng, target);
        let [_, leaves] = intersect_slabs(&ray, target).ok_or(Verdict::Skipped)?;
        let test_ray = TestRay::with_hit_of_scan(scans, 0, ray, Interval::positive());
        let is_early = |hit: Hit<R>| hit.t.to_f64() <= leaves * (1.0 + 1e-6);
        require_hit(test_ray.expected.is_some_and(is_early), test_ray)
    });
}

/// Returns the ray if the linear scan finds what the oracle requires, or else a wrong verdict.
fn require_hit<R: Real>(is_found: bool, test_ray: TestRay<R>) -> Result<[TestRay<R>; 1], Verdict> {
    if is_found {
        return Ok([test_ray]);
    }
    Err(Verdict::Wrong(format!(
        "the linear scan misses the box that the ray enters: {test_ray:?}"
    )))
}

/// Draws a point well inside a box.
fn draw_inner_point(rng: &mut CaseRng, [min, max]: BoxCorners) -> DVec3 {
    min + (max - min) * (rng.sample_point_in_cube() * 0.45 + 0.5)
}

/// Judges case T01: rays along an axis towards a distant box, parallel to one of its faces. The ray
/// is inside the box's cross-section, at a distance from 0.5 to 1e-6 from the face. The box is 1 to
/// 10⁸ units away.
pub(super) fn rays_along_faces<R: Real>(trial: &mut Trial<R>) {
    let boxes = |length: f64| -> Vec<BoxCorners> {
        let along = |axis: usize| {
            let (mut min, mut max) = (DVec3::ZERO, DVec3::ONE);
            // Far away, where neighbouring f32 numbers differ by more than one, the box is several
            // such spacings thick.
            (min[axis], max[axis]) = (length, length + (length * 1e-6).max(1.0));
            [min, max].map(round_to_f32)
        };
        // Further boxes behind the rays' origins, so that a tree is built.
        let behind = scatter_boxes(210, 60).into_iter();
        let behind = behind.map(|corners| corners.map(|p| p - DVec3::splat(20.0)));
        (0..3).map(along).chain(behind).collect()
    };
    let scenes = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|k| boxes(10_f64.powi(k)));
    let draw = |rng: &mut CaseRng| {
        let [axis, scene] = [3, scenes.len()].map(|many| rng.next_bits() as usize % many);
        let (mut o, mut d) = (DVec3::ZERO, DVec3::ZERO);
        d[axis] = 1.0;
        o[(axis + 1) % 3] = 1.0 - rng.choose(&[0.5, 1e-2, 1e-3, 1e-4, 1e-6]);
        o[(axis + 2) % 3] = rng.next_uniform(0.01, 0.99);
        (
            scene,
            axis,
            create_unnormalised_ray::<R>(round_to_f32(o), d),
        )
    };
    let rays = (201, 400_000);
    trial.build_scenes(&scenes.each_ref().map(|boxes| cuboids(boxes)));
    trial.judge_rays("", rays, |rng, scans| {
        let (scene, axis, ray) = draw(rng);
        let test_ray = TestRay::with_hit_of_scan(scans, scene, ray, Interval::positive());
        let distance = scenes[scene][axis][0][axis];
        let is_face = |hit: Hit<R>| hit.object as usize == axis && hit.t.to_f64() == distance;
        require_hit(test_ray.expected.is_some_and(is_face), test_ray)
    });
    trial.judge_textbook("", rays, |rng| {
        let (scene, axis, ray) = draw(rng);
        let corners = scenes[scene][axis].map(|p| p.as_vec3());
        let ray = Ray::new(ray.origin.to_f32(), ray.direction.to_f32());
        Verdict::from_condition(textbook::enters_box(corners, &ray), || "a box is culled")
    });
}

/// Judges case T02: rays in the planes of box faces. The zero components of their directions have
/// either sign, which changes no hit.
pub(super) fn rays_with_signed_zeros<R: Real>(trial: &mut Trial<R>) {
    let whole = |index| {
        let rng = &mut CaseRng::new(211, index);
        let min = (rng.sample_point_in_cube() * 8.0).round();
        let extent = ((rng.sample_point_in_cube() + 1.0) * 1.5).floor() + 1.0;
        [min, min + extent]
    };
    trial.build_scenes(&[cuboids(&(0..1000).map(whole).collect::<Vec<_>>())]);
    trial.judge_rays("", (202, 40_000), |rng, scans| {
        let origin = (rng.sample_point_in_cube() * 24.0).round() * 0.5;
        let zeros = 1 + rng.next_bits() % 6;
        let slope = round_to_f32(rng.sample_point_in_cube());
        let ray = |signs: usize| {
            let component = |axis: usize| match (zeros >> axis & 1, signs >> axis & 1) {
                (1, 0) => 0.0,
                (1, _) => -0.0,
                _ => slope[axis],
            };
            create_unnormalised_ray::<R>(origin, DVec3::from_array([0, 1, 2].map(component)))
        };
        let first = TestRay::with_hit_of_scan(scans, 0, ray(0), Interval::positive());
        Ok([0, 1, 2, 3, 4, 5, 6, 7].map(|signs| TestRay {
            ray: ray(signs),
            ..first
        }))
    });
}

/// Judges case T04: rays along an axis whose other direction components are close to zero.
pub(super) fn rays_with_tiny_components<R: Real>(trial: &mut Trial<R>) {
    judge_aimed_rays(
        trial,
        (204, 80_000),
        &scatter_boxes(214, 300),
        |rng, corners| {
            let target = draw_inner_point(rng, corners);
            let axis = rng.next_bits() as usize % 3;
            let size = rng.choose(&[1e-7, 1e-20, 1e-40]);
            let mut d = rng.sample_point_in_cube() * size;
            d[axis] = rng.next_sign();
            create_unnormalised_ray(round_to_f32(target - d * 30.0), round_to_f32(d))
        },
    );
}

/// Judges case T05: rays with directions of any length, from 1e-20 to 1e20.
pub(super) fn unnormalised_rays<R: Real>(trial: &mut Trial<R>) {
    judge_aimed_rays(
        trial,
        (205, 80_000),
        &scatter_boxes(215, 300),
        |rng, corners| {
            let (target, d) = (draw_inner_point(rng, corners), rng.sample_direction());
            let length = 10_f64.powf(rng.next_uniform(-20.0, 20.0));
            create_unnormalised_ray(round_to_f32(target - d * 30.0), round_to_f32(d * length))
        },
    );
}

/// Judges case T08: boxes of size 1e-6 beside boxes of size 1e6, by rays from three diameters away.
pub(super) fn boxes_of_mixed_sizes<R: Real>(trial: &mut Trial<R>) {
    let draw = |index: u64| {
        let size = if index.is_multiple_of(2) { 1e-6 } else { 1e6 };
        draw_box(
            &mut CaseRng::new(212, index),
            1000.0 * size,
            2.0,
            0.25 * size,
        )
    };
    let boxes: Vec<_> = (0..2000).map(draw).collect();
    judge_aimed_rays(trial, (208, 40_000), &boxes, |rng, [min, max]| {
        let (centre, away) = ((min + max) * 0.5, 3.0 * (max - min).max_element());
        create_ray_towards(centre + rng.sample_direction() * away, centre)
    });
}

/// Judges case T16: rays that start on a face of a box, or an ulp inside or outside it. They go
/// inwards, outwards or along the face.
pub(super) fn rays_from_faces<R: Real>(trial: &mut Trial<R>) {
    let boxes = scatter_boxes(216, 300);
    trial.build_scenes(&[cuboids(&boxes)]);
    trial.judge_rays("", (216, 200_000), |rng, scans: &[Geometry<R>]| {
        let corners = rng.choose(&boxes);
        let axis = rng.next_bits() as usize % 3;
        let mut origin = round_to_f32(draw_inner_point(rng, corners));
        let face = R::from_f64(rng.choose(&corners)[axis]);
        let places = [
            face,
            face.next_up(),
            -(-face).next_up(),
            R::from_f64(origin[axis]),
        ];
        origin[axis] = rng.choose(&places).to_f64();
        let mut d = rng.sample_direction();
        d[axis] = rng.choose(&[d[axis], 0.0, -0.0]);
        let ray = Ray::new(to_scalar::<R>(origin), to_scalar::<R>(round_to_f32(d)));
        let everything = Interval {
            min: -R::INFINITY,
            max: R::INFINITY,
        };
        let ahead = TestRay::with_hit_of_scan(scans, 0, ray, Interval::positive());
        let either_way = TestRay::with_hit_of_scan(scans, 0, ray, everything);
        // Distance that the ray has left inside the box. A hit is required if this distance exceeds
        // rounding.
        let distance =
            intersect_slabs(&ray, corners).map_or(0.0, |[enters, leaves]| leaves - enters.max(0.0));
        let [ahead] = require_hit(distance < 1e-3 || ahead.expected.is_some(), ahead)?;
        Ok([ahead, either_way])
    });
}
