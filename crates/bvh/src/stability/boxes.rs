//! Cases T01, T02, T04, T05, T08 and T16: rays that hit boxes at faces, edges and extreme scales.
//! No traversal may lose such a hit. The primitives are the boxes themselves, as solids. The oracles
//! are a slab test in f64 and the linear scan.

use super::prelude::*;
use super::textbook;

/// Least and greatest corner, both exact in f32.
type BoxCorners = [DVec3; 2];

/// Builds scenes of solid boxes.
fn build_boxes<R: Real>(trial: &mut Trial<R>, scenes: &[&Vec<BoxCorners>]) {
    let cuboid = |&[min, max]: &BoxCorners| Cuboid::new(min, max).into();
    let scenes = scenes
        .iter()
        .map(|boxes| boxes.iter().map(cuboid).collect());
    trial.build_scenes(scenes.collect());
}

/// Computes the distances at which a ray enters and leaves a box, in f64 and in units of the
/// direction's length; `None` for a miss. A ray parallel to two faces hits only if its origin is
/// between them.
fn intersect_slabs(ray: &Ray<f64>, [min, max]: BoxCorners) -> Option<[f64; 2]> {
    let (o, d) = (ray.origin, ray.direction);
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

/// Draws a point inside a box. One in four lies next to a corner, where rays cross little of it.
fn draw_inner_point(rng: &mut CaseRng, [min, max]: BoxCorners) -> DVec3 {
    let place = rng.sample_point_in_cube();
    let is_corner = rng.next_bits().is_multiple_of(4);
    let place = if is_corner { place.signum() } else { place };
    min + (max - min) * (place * 0.4999 + 0.5)
}

/// Returns the rays if the linear scan finds what the oracle requires, or else a wrong verdict.
fn require_hit<R: Real, const N: usize>(
    is_found: bool,
    rays: [TestRay<R>; N],
) -> Result<[TestRay<R>; N], Verdict> {
    let label = || format!("the linear scan misses the box that the ray enters: {rays:?}");
    match require(is_found, label) {
        Verdict::Right(_) => Ok(rays),
        verdict => Err(verdict),
    }
}

/// Judges rays that are aimed at boxes. Each must hit a box before it leaves the box at which it is
/// aimed. A ray that misses that box is skipped.
fn judge_aimed_rays<R: Real>(
    trial: &mut Trial<R>,
    rays: (u64, u32),
    boxes: Vec<BoxCorners>,
    draw: impl Fn(&mut CaseRng, BoxCorners) -> [DVec3; 2] + Sync,
) {
    build_boxes(trial, &[&boxes]);
    trial.judge_rays("", rays, |rng, scans| {
        let target = rng.choose(&boxes);
        let [origin, direction] = draw(rng, target).map(round_to_f32);
        let ray = create_unnormalised_ray(origin, direction);
        let [_, leaves] = intersect_slabs(&ray, target).ok_or(Verdict::Skipped)?;
        let ray = scans.test_ray(0, ray, Interval::positive());
        let is_early = |hit: Hit<R>| hit.t.to_f64() <= leaves * (1.0 + 1e-6);
        require_hit(ray.hit().is_some_and(is_early), [ray])
    });
}

/// Cases of boxes.
pub(super) fn cases<R: Real>() -> Vec<Case<R>> {
    vec![
        // Rays along an axis whose other direction components are close to zero.
        ("T04", |trial| {
            judge_aimed_rays(
                trial,
                (204, 80_000),
                scatter_boxes(214, 300),
                |rng, corners| {
                    let (target, axis) =
                        (draw_inner_point(rng, corners), rng.next_bits() as usize % 3);
                    let mut d = rng.sample_point_in_cube() * rng.choose(&[1e-7, 1e-20, 1e-40]);
                    d[axis] = rng.next_sign();
                    [target - d * 30.0, d]
                },
            );
        }),
        // Rays with directions of any length, from 1e-20 to 1e20, and from any distance.
        ("T05", |trial| {
            judge_aimed_rays(
                trial,
                (205, 80_000),
                scatter_boxes(215, 300),
                |rng, corners| {
                    let (target, d) = (draw_inner_point(rng, corners), rng.sample_direction());
                    [
                        target - d * rng.choose(&[30.0, 1e3, 1e5]),
                        d * 10_f64.powf(rng.next_uniform(-20.0, 20.0)),
                    ]
                },
            );
        }),
        // Boxes of size 1e-6 beside boxes of size 1e6, by rays from three diameters away.
        ("T08", |trial| {
            let draw = |index: u64| {
                let size = if index.is_multiple_of(2) { 1e-6 } else { 1e6 };
                draw_box(
                    &mut CaseRng::new(212, index),
                    1000.0 * size,
                    2.0,
                    0.25 * size,
                )
            };
            let boxes = (0..2000).map(draw).collect();
            judge_aimed_rays(trial, (208, 40_000), boxes, |rng, [min, max]| {
                let (d, away) = (rng.sample_direction(), 3.0 * (max - min).max_element());
                [(min + max) * 0.5 + d * away, -d]
            });
        }),
        // Rays along an axis towards a distant box, parallel to one of its faces. The ray is inside
        // the box's cross-section, at a distance from 0.5 to 1e-6 from the face. The box is 1 to 10⁸
        // units away.
        ("T01", |trial| {
            let boxes = |length: f64| -> Vec<BoxCorners> {
                let along = |axis: usize| {
                    // Far away, where neighbouring f32 numbers differ by more than one, the box is
                    // several such spacings thick.
                    let (min, depth) = (DVec3::AXES[axis] * length, (length * 1e-6).max(1.0));
                    let mut max = min + 1.0;
                    max[axis] = length + depth;
                    [min, max].map(round_to_f32)
                };
                // Further boxes behind the rays' origins, so that a tree is built.
                let behind = scatter_boxes(210, 60).into_iter();
                let behind = behind.map(|corners| corners.map(|p| p - 20.0));
                (0..3).map(along).chain(behind).collect()
            };
            let scenes = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|k| boxes(10_f64.powi(k)));
            let draw = |rng: &mut CaseRng| {
                let [axis, scene] = [3, scenes.len()].map(|many| rng.next_bits() as usize % many);
                let mut o = DVec3::ZERO;
                o[(axis + 1) % 3] = 1.0 - rng.choose(&[0.5, 1e-2, 1e-3, 1e-4, 1e-6]);
                o[(axis + 2) % 3] = rng.next_uniform(0.01, 0.99);
                let ray = create_unnormalised_ray(round_to_f32(o), DVec3::AXES[axis]);
                (scene, axis, ray)
            };
            let rays = (201, 400_000);
            build_boxes(trial, &scenes.each_ref());
            trial.judge_rays("", rays, |rng, scans| {
                let (scene, axis, ray) = draw(rng);
                let ray = scans.test_ray(scene, ray, Interval::positive());
                let distance = scenes[scene][axis][0][axis];
                let is_face =
                    |hit: Hit<R>| hit.object as usize == axis && hit.t.to_f64() == distance;
                require_hit(ray.hit().is_some_and(is_face), [ray])
            });
            trial.judge("", rays, BESIDE_TREES, |rng, _| {
                let (scene, axis, ray) = draw(rng);
                let is_hit = textbook::enters_box(scenes[scene][axis], &ray);
                require(is_hit, || "a box is culled")
            });
        }),
        // Rays in the planes of box faces. The zero components of their directions have either sign,
        // which changes no hit.
        ("T02", |trial| {
            let whole = |index| {
                let rng = &mut CaseRng::new(211, index);
                let min = (rng.sample_point_in_cube() * 8.0).round();
                [
                    min,
                    min + ((rng.sample_point_in_cube() + 1.0) * 1.5).floor() + 1.0,
                ]
            };
            build_boxes(trial, &[&(0..1000).map(whole).collect()]);
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
                    create_unnormalised_ray(origin, DVec3::from_array([0, 1, 2].map(component)))
                };
                let first = scans.test_ray(0, ray(0), Interval::positive());
                let rays = [0, 1, 2, 3, 4, 5, 6, 7].map(|signs| to_precision(ray(signs)));
                Ok(rays.map(|ray| TestRay { ray, ..first }))
            });
        }),
        // Rays that start on a face of a box, or an ulp inside or outside it. They go inwards,
        // outwards or along the face.
        ("T16", |trial| {
            let boxes = scatter_boxes(216, 100);
            build_boxes(trial, &[&boxes]);
            trial.judge_rays("", (216, 80_000), |rng, scans| {
                let corners = rng.choose(&boxes);
                let axis = rng.next_bits() as usize % 3;
                let mut origin = round_to_f32(draw_inner_point(rng, corners));
                let face = R::from_f64(rng.choose(&corners)[axis]);
                let inner = R::from_f64(origin[axis]);
                let starts = [face, face.next_up(), -(-face).next_up(), inner];
                origin[axis] = rng.choose(&starts).to_f64();
                let mut d = round_to_f32(rng.sample_direction());
                d[axis] = rng.choose(&[d[axis], 0.0, -0.0]);
                let ray = create_unnormalised_ray(origin, d);
                let everything = Interval {
                    min: -R::INFINITY,
                    max: R::INFINITY,
                };
                let [ahead, either_way] =
                    [Interval::positive(), everything].map(|range| scans.test_ray(0, ray, range));
                // Distance that the ray has left inside the box. A hit is required if this distance
                // exceeds rounding.
                let distance = intersect_slabs(&ray, corners)
                    .map_or(0.0, |[enters, leaves]| leaves - enters.max(0.0));
                require_hit(
                    distance < 1e-3 || ahead.hit().is_some(),
                    [ahead, either_way],
                )
            });
        }),
    ]
}
