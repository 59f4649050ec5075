//! Cases T12, T14, T15, T17, T19 and T20: trees compared with linear scans, for any primitives and
//! any query.

use super::prelude::*;
use super::shapes::build_sphere;

/// Creates a random bounded shape of about unit size in a cube of size 10.
pub fn draw_shape<R: Real>(rng: &mut CaseRng) -> AnyShape<R> {
    let (c, axis) = (rng.sample_point_in_cube() * 5.0, rng.sample_direction());
    let [a, b, h] = [(); 3].map(|()| rng.next_uniform(0.2, 1.2));
    let (x, y) = axis.any_orthonormal_pair();
    match rng.next_bits() % 11 {
        0 => build_sphere(c, a).into(),
        1 => Triangle::new([c, c + x * a, c + y * b].map(to_scalar::<R>)).into(),
        2 => Cuboid::new(c, c + DVec3::new(a, b, h)).into(),
        3 => Cylinder::new(c, axis, a, Some(h), true).into(),
        4 => Cone::new(c, axis, a, 0.0, h).into(),
        5 => Disk::new(c, axis, a).into(),
        6 => Ellipsoid::new(c, DVec3::new(a, b, h)).into(),
        7 => Hyperboloid::new(c, a * 0.5, b, h).into(),
        8 => Paraboloid::new(c, a, h).into(),
        9 => Quad::new(c, x * a, y * b).into(),
        _ => Torus::new(c, axis, a, a * 0.3).into(),
    }
}

/// Creates the random shapes of a scene. Every fifth shape is added twice, so that some hits are at
/// equal distances.
fn draw_scene<R: Real>(seed: u64, scene: u64, count: u64) -> Vec<AnyShape<R>> {
    let draw = |i: u64| {
        let shape = draw_shape(&mut CaseRng::new(seed, scene * 1000 + i));
        core::iter::repeat_n(shape, 1 + usize::from(i.is_multiple_of(5)))
    };
    (0..count).flat_map(draw).collect()
}

/// Creates a ray from a random point of a cube towards a random point of a concentric cube with 0.8
/// times the edge. `size` is half the edge of the greater cube.
fn draw_ray(rng: &mut CaseRng, size: f64) -> Ray<f64> {
    let origin = rng.sample_point_in_cube() * size;
    create_ray_towards(origin, rng.sample_point_in_cube() * (0.8 * size))
}

/// Judges random rays through the scenes in turns. The function `size` draws the size of the cube
/// from which they come, and the far end of the range.
fn judge_random_rays<R: Real>(
    trial: &mut Trial<R>,
    rays: (u64, u32),
    size: impl Fn(&mut CaseRng, usize) -> (f64, R) + Sync,
) {
    trial.judge_rays("", rays, |rng, scans| {
        let scene = rng.ray_index() as usize % scans.count();
        let (size, max) = size(rng, scene);
        Ok([scans.test_ray(scene, draw_ray(rng, size), Interval { min: R::ZERO, max })])
    });
}

/// Judges ranges of distances that start or end at the distance of a hit, or an ulp beside it. Tree
/// and scan must exclude both ends, and NaN is no distance.
fn judge_ends<R: Real>(
    trial: &mut Trial<R>,
    rays: (u64, u32),
    draw: impl Fn(&mut CaseRng, usize) -> Ray<f64> + Sync,
) {
    trial.judge_rays("", rays, |rng, scans| {
        let scene = rng.ray_index() as usize % scans.count();
        let ray = draw(rng, scene);
        let test = |min, max| scans.test_ray(scene, ray, Interval { min, max });
        let first = test(R::ZERO, R::INFINITY).hit().ok_or(Verdict::Skipped)?;
        let min = rng.choose(&[R::ZERO, -R::ZERO, R::from_f64(1e-30)]);
        let [above, below] = [first.t.next_up(), -(-first.t).next_up()];
        let until = [first.t, below, above].map(|max| test(min, max));
        if until.map(|ray| ray.hit()) != [None, None, Some(first)] {
            return Err(Verdict::Wrong(format!(
                "the scan must exclude ends: {until:?}"
            )));
        }
        let from = [first.t, below, above, -R::ONE].map(|min| test(min, R::INFINITY));
        Ok([until.as_slice(), &from].concat())
    });
}

/// Cases of trees and scans.
pub(super) fn cases<R: Real>() -> Vec<Case<R>> {
    vec![
        // Nested boxes, in trees at most 64 deep: a thousand boxes whose sizes grow in even steps,
        // 120 boxes whose sizes are powers of two, and 2000 boxes that each grow by 2.5 percent.
        ("T12", |trial| {
            let halves: [Vec<f64>; 3] = [
                (1..=1000).map(f64::from).collect(),
                (-60..60).map(|k| 2_f64.powi(k)).collect(),
                // Half sizes from 1.9e-11 to 5.2e10, for which f32 can hold the surface areas.
                (0..2000).map(|i| 1.025_f64.powi(i - 1000)).collect(),
            ];
            let cuboid = |&half: &f64| Cuboid::new(DVec3::splat(-half), DVec3::splat(half)).into();
            let boxes = |halves: &Vec<f64>| halves.iter().map(cuboid).collect();
            let scenes: Vec<_> = halves.iter().map(boxes).collect();
            trial.build_scenes(scenes.clone());
            judge_random_rays(trial, (240, 40_000), |rng, scene| {
                (
                    rng.choose(&halves[scene]) * rng.next_uniform(0.5, 2.0),
                    R::INFINITY,
                )
            });
            trial.judge("depth", (0, 3), LIBRARY, |rng, _| {
                let scene = &scenes[rng.ray_index() as usize];
                let tree = build_geometry(scene, AcceleratorKind::default());
                let depth = tree.build_work().map_or(0, |work| work.depth);
                within(depth.into(), 64.0, || "depth of the tree")
            });
        }),
        // An unbounded plane below a thousand spheres. The tree must find the hits of the linear
        // scan. The plane must not slow the tree: the number of visited nodes is within a tenth of
        // the number without the plane.
        ("T14", |trial| {
            let ball = |i| {
                let rng = &mut CaseRng::new(242, i);
                build_sphere(
                    rng.sample_point_in_cube() * 10.0,
                    rng.next_uniform(0.1, 0.6),
                )
                .into()
            };
            let mut shapes: Vec<_> = (0..1000).map(ball).collect();
            let visits = |shapes: &[AnyShape<R>]| {
                let tree = build_geometry(shapes, AcceleratorKind::default());
                let mut stats = TraversalStats::default();
                for i in 0..4000 {
                    let ray = to_precision(draw_ray(&mut CaseRng::new(243, i), 12.0));
                    tree.closest(&ray, Interval::positive(), &mut stats);
                }
                stats.nodes as f64
            };
            let before = visits(&shapes);
            let [point, up] = [DVec3::Y * -11.0, DVec3::Y].map(to_scalar::<R>);
            shapes.push(Plane::new(point, up).into());
            let change = (visits(&shapes) / before - 1.0).abs();
            trial.judge("visited nodes", (0, 1), LIBRARY, |_, _| {
                within(change, 0.1, || "change of the visited nodes by a plane")
            });
            trial.build_scenes(vec![shapes]);
            judge_random_rays(trial, (243, 40_000), |_, _| (12.0, R::INFINITY));
        }),
        // Scenes of zero, one and two shapes, by trees of every build quality.
        ("T15", |trial| {
            let scenes = (0..60)
                .map(|scene| draw_scene(245, scene, scene / 3 % 3))
                .collect();
            trial.build_scenes(scenes);
            judge_random_rays(trial, (246, 40_000), |_, _| (6.0, R::INFINITY));
        }),
        // Ranges that end at hits in a scene of many shapes.
        ("T17", |trial| {
            trial.build_scenes(vec![draw_scene(247, 0, 60)]);
            judge_ends(trial, (248, 100_000), |rng, _| draw_ray(rng, 6.0));
        }),
        // The same for rays at single shapes, from near and far.
        ("T19", |trial| {
            let shape = |index| draw_shape::<R>(&mut CaseRng::new(249, index));
            let shapes: Vec<_> = (0..2000).map(shape).collect();
            trial.build_scenes(shapes.iter().map(|&shape| vec![shape]).collect());
            judge_ends(trial, (249, 100_000), |rng, scene| {
                let bounds = shapes[scene].bounds().expect("bounded shapes");
                let target = bounds.centre() + rng.sample_point_in_cube() * 0.3;
                let away = rng.sample_direction() * rng.choose(&[0.1, 1.0, 10.0, 1e4]);
                create_ray_towards(target + away, round_to_f32(target))
            });
        }),
        // 200 scenes of shapes of every kind, by trees and by linear scans.
        ("T20", |trial| {
            let scene = |scene| draw_scene(250, scene, 5 + scene % 40);
            trial.build_scenes((0..200).map(scene).collect());
            judge_random_rays(trial, (251, 500_000), |rng, _| {
                let range = [R::INFINITY, R::from_f64(rng.next_uniform(0.1, 10.0))];
                (6.0, rng.choose(&range))
            });
        }),
    ]
}
