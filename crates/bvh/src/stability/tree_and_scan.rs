//! Cases T12, T14, T15, T17, T19 and T20: trees compared with linear scans, for any primitives and
//! any query.

use super::prelude::*;
use super::sphere::build_sphere;

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
fn draw_ray<R: Real>(rng: &mut CaseRng, size: f64) -> Ray<R> {
    let origin = rng.sample_point_in_cube() * size;
    create_ray_towards::<R>(origin, rng.sample_point_in_cube() * (0.8 * size))
}

/// Judges random rays through the scenes in turns. The function `size` draws the size of the cube
/// from which they come, and the far end of the range.
fn judge_random_rays<R: Real>(
    trial: &mut Trial<R>,
    rays: (u64, u32),
    size: impl Fn(&mut CaseRng, usize) -> (f64, R) + Sync,
) {
    trial.judge_rays("", rays, |rng, scans| {
        let scene = rng.ray_index() as usize % scans.len();
        let (size, max) = size(rng, scene);
        let (min, ray) = (R::ZERO, draw_ray(rng, size));
        Ok([TestRay::with_hit_of_scan(
            scans,
            scene,
            ray,
            Interval { min, max },
        )])
    });
}

/// Judges case T12: nested boxes, in trees at most 64 deep. There are three scenes:
///
/// - a thousand boxes whose sizes grow in even steps,
/// - 120 boxes whose sizes are powers of two,
/// - 5000 boxes that each grow by one percent.
pub(super) fn nested_boxes<R: Real>(trial: &mut Trial<R>) {
    let halves: [Vec<f64>; 3] = [
        (1..=1000).map(f64::from).collect(),
        (-60..60).map(|k| 2_f64.powi(k)).collect(),
        // Half sizes from 1.6e-11 to 6.3e10, for which f32 can hold the surface areas.
        (0..5000).map(|i| 1.01_f64.powi(i - 2500)).collect(),
    ];
    let boxes = |halves: &Vec<f64>| {
        let corners = halves.iter().map(|&half| DVec3::splat(half));
        corners
            .map(|corner| Cuboid::new(-corner, corner).into())
            .collect()
    };
    trial.build_scenes(&halves.each_ref().map(boxes));
    judge_random_rays(trial, (240, 40_000), |rng, scene| {
        (
            rng.choose(&halves[scene]) * rng.next_uniform(0.5, 2.0),
            R::INFINITY,
        )
    });
    trial.judge_figure("depth of the trees", 64.0, |trees| {
        let work = trees.iter().filter_map(Geometry::build_work);
        work.map(|work| work.depth.into()).fold(0.0, f64::max)
    });
}

/// Judges case T14: an unbounded plane below a thousand spheres. The tree must find the hits of the
/// linear scan. The plane must not slow the tree: the number of visited nodes is within a tenth of
/// the number without the plane.
pub(super) fn plane_beside_tree<R: Real>(trial: &mut Trial<R>) {
    let ball = |i| {
        let rng = &mut CaseRng::new(242, i);
        build_sphere(
            rng.sample_point_in_cube() * 10.0,
            rng.next_uniform(0.1, 0.6),
        )
        .into()
    };
    let balls: Vec<AnyShape<R>> = (0..1000).map(ball).collect();
    let ground = Plane::new(to_scalar::<R>(DVec3::Y * -11.0), to_scalar::<R>(DVec3::Y));
    let without = build_geometry(balls.clone(), AcceleratorKind::default());
    trial.build_scenes(&[[&balls[..], &[ground.into()]].concat()]);
    judge_random_rays(trial, (243, 40_000), |_, _| (12.0, R::INFINITY));
    trial.judge_figure("change of the visited nodes by a plane", 0.1, |trees| {
        let nodes = |tree: &Geometry<R>| {
            let mut stats = TraversalStats::default();
            for i in 0..4000 {
                let ray = draw_ray(&mut CaseRng::new(243, i), 12.0);
                tree.closest(&ray, Interval::positive(), &mut stats);
            }
            stats.nodes as f64
        };
        (nodes(&trees[0]) / nodes(&without) - 1.0).abs()
    });
}

/// Judges case T15: scenes of zero, one and two shapes, by trees of every build quality.
pub(super) fn tiny_scenes<R: Real>(trial: &mut Trial<R>) {
    let scenes: Vec<_> = (0..60)
        .map(|scene| draw_scene(245, scene, scene / 3 % 3))
        .collect();
    trial.build_scenes_for(&scenes, &BuildQuality::ALL, &Kernel::available());
    judge_random_rays(trial, (246, 40_000), |_, _| (6.0, R::INFINITY));
}

/// Judges case T17: ranges of distances that start or end at the distance of a hit, or an ulp beside
/// it. Tree and scan must exclude both ends.
pub(super) fn ranges_that_end_at_hits<R: Real>(trial: &mut Trial<R>) {
    trial.build_scenes(&[draw_scene(247, 0, 60)]);
    trial.judge_rays("", (248, 100_000), |rng, scans| {
        let ray = draw_ray(rng, 6.0);
        let everything = Interval::positive();
        let first = scans[0]
            .closest(&ray, everything, &mut ())
            .ok_or(Verdict::Skipped)?;
        let min = rng.choose(&[R::ZERO, -R::ZERO, R::from_f64(1e-30)]);
        let (above, below) = (first.t.next_up(), -(-first.t).next_up());
        let until = |max: R, expected: Option<Hit<R>>| {
            let test_ray = TestRay::with_hit_of_scan(scans, 0, ray, Interval { min, max });
            if test_ray.expected == expected {
                return Ok(test_ray);
            }
            Err(Verdict::Wrong(format!(
                "the scan must find {expected:?} for {test_ray:?}"
            )))
        };
        let from = |min: R| {
            let range = Interval { min, ..everything };
            TestRay::with_hit_of_scan(scans, 0, ray, range)
        };
        Ok([
            until(first.t, None)?,
            until(below, None)?,
            until(above, Some(first))?,
            from(first.t),
            from(below),
            from(above),
        ])
    });
}

/// Judges case T19: no shape may return a distance that is NaN or outside the range, even if the
/// range starts at the distance of a hit.
pub(super) fn distances_in_interval<R: Real>(trial: &mut Trial<R>) {
    trial.judge("", (249, 400_000), |rng| {
        let shape = draw_shape::<R>(rng);
        let target = shape.bounds().map_or(DVec3::ZERO, |bounds| bounds.centre())
            + rng.sample_point_in_cube() * 0.3;
        let away = rng.sample_direction() * rng.choose(&[0.1, 1.0, 10.0, 1e4]);
        let ray = create_ray_towards::<R>(target + away, round_to_f32(target));
        let prepared = PreparedRay::new(ray);
        let intersect = |range: Interval<R>| shape.intersect(&prepared, range, Side::Both);
        let Some(first) = intersect(Interval::positive()) else {
            return [Verdict::Skipped];
        };
        let (at, above, below) = (first.t, first.t.next_up(), -(-first.t).next_up());
        let ends = [
            R::from_f64(rng.next_in_unit_interval()),
            at,
            above,
            below,
            -R::ONE,
        ];
        let ranges = ends
            .into_iter()
            .flat_map(|min| [R::INFINITY, at, above].map(|max| Interval { min, max }));
        let outside = |range: Interval<R>| {
            intersect(range).filter(|hit| !range.contains(hit.t) || !hit.t.is_finite())
        };
        let wrong = ranges.filter_map(outside).next();
        [Verdict::from_condition(wrong.is_none(), || {
            format!(
                "{wrong:?} lies outside the range{} {shape:?}",
                format_ray_bits(&ray)
            )
        })]
    });
}

/// Judges case T20: 200 scenes of shapes of every kind, by trees and by linear scans.
pub(super) fn tree_against_scan<R: Real>(trial: &mut Trial<R>) {
    let scenes: Vec<_> = (0..200)
        .map(|scene| draw_scene(250, scene, 5 + scene % 40))
        .collect();
    trial.build_scenes(&scenes);
    judge_random_rays(trial, (251, 2_000_000), |rng, _| {
        let range = [R::INFINITY, R::from_f64(rng.next_uniform(0.1, 10.0))];
        (6.0, rng.choose(&range))
    });
}
