//! Cases T12, T14, T15, T17, T19 and T20: trees compared with linear scans, for any primitives and
//! any query.

use glam::DVec3;

use super::verdicts::{
    CaseOutcome, CaseRng, RayCount, Verdict, create_ray_towards, format_ray_bits, judge_rays,
    round_to_f32, to_scalar,
};
use super::{Measurement, create_treeless_measurement, measure_by_each_kernel};
use crate::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, Paraboloid, Plane, Quad,
    Sphere, Torus, Triangle,
};
use crate::{
    AcceleratorKind, BuildQuality, Geometry, Interval, PreparedRay, PrimitiveSet, Ray, Real, Shape,
    Side, TraversalStats, Visibility,
};

/// Creates a random bounded shape of about unit size in a cube of size 10.
fn create_random_shape<R: Real>(rng: &mut CaseRng) -> AnyShape<R> {
    let (c, axis) = (rng.sample_point_in_cube() * 5.0, rng.sample_direction());
    let mut size = || rng.next_uniform(0.2, 1.2);
    let [a, b, h] = [size(), size(), size()];
    let v = |p: DVec3| to_scalar::<R>(p);
    let (x, y) = axis.any_orthonormal_pair();
    match rng.next_bits() % 11 {
        0 => AnyShape::Sphere(Sphere {
            centre: v(c),
            radius: R::from_f64(a),
        }),
        1 => AnyShape::Triangle(Triangle::new([v(c), v(c + x * a), v(c + y * b)])),
        2 => AnyShape::Cuboid(Cuboid::new(c, c + DVec3::new(a, b, h))),
        3 => AnyShape::Cylinder(Cylinder::new(c, axis, a, Some(h), true)),
        4 => AnyShape::Cone(Cone::new(c, axis, a, 0.0, h)),
        5 => AnyShape::Disk(Disk::new(c, axis, a)),
        6 => AnyShape::Ellipsoid(Ellipsoid::new(c, DVec3::new(a, b, h))),
        7 => AnyShape::Hyperboloid(Hyperboloid::new(c, a * 0.5, b, h)),
        8 => AnyShape::Paraboloid(Paraboloid::new(c, a, h)),
        9 => AnyShape::Quad(Quad::new(c, x * a, y * b)),
        _ => AnyShape::Torus(Torus::new(c, axis, a, a * 0.3)),
    }
}

/// Builds a geometry of `count` random shapes. Every fifth shape is added twice, so that some hits
/// are at equal distances.
fn build_random_geometry<R: Real>(
    seed: u64,
    scene: u64,
    count: u64,
    kind: AcceleratorKind,
) -> Geometry<R> {
    let mut group = PrimitiveSet::<R>::default();
    for i in 0..count {
        let shape = create_random_shape::<R>(&mut CaseRng::new(seed, scene * 1000 + i));
        for _ in 0..=u64::from(i.is_multiple_of(5)) {
            group
                .add_shape(shape, Visibility::default())
                .expect("finite shapes");
        }
    }
    Geometry::new(group, kind)
}

/// Creates a ray from a random point of a cube towards a random point of a concentric cube with 0.8
/// times the edge. `size` is half the edge of the greater cube.
fn create_random_ray<R: Real>(rng: &mut CaseRng, size: f64) -> Ray<R> {
    let origin = rng.sample_point_in_cube() * size;
    create_ray_towards::<R>(origin, rng.sample_point_in_cube() * (0.8 * size))
}

/// Judges whether a tree and a linear scan agree on two results for a ray and a range of distances:
/// the closest hit and the occlusion.
fn judge_tree_against_scan<R: Real>(
    tree: &Geometry<R>,
    scan: &Geometry<R>,
    ray: &Ray<R>,
    range: Interval<R>,
) -> Verdict {
    let (hit, expected) = (
        tree.closest(ray, range, &mut ()),
        scan.closest(ray, range, &mut ()),
    );
    let is_any = tree.occluded(ray, range, &mut |_| true, &mut ());
    let is_right = hit == expected
        && is_any == expected.is_some()
        && hit.is_none_or(|hit| range.contains(hit.t));
    Verdict::from_condition(is_right, || {
        format!(
            "in the range {range:?} the linear scan finds the closest hit {expected:?}, the tree {hit:?}, and the tree's any-hit query returns {is_any}{}",
            format_ray_bits(ray)
        )
    })
}

/// Measures case T12: nested boxes, with trees and with linear scans. There are three scenes:
///
/// - a thousand boxes whose sizes grow in even steps,
/// - 120 boxes whose sizes are powers of two,
/// - 5000 boxes that each grow by one percent.
pub fn measure_nested_boxes<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let halves: [Vec<f64>; 3] = [
        (1..=1000).map(f64::from).collect(),
        (-60..60).map(|k| 2_f64.powi(k)).collect(),
        // Half sizes from 1.6e-11 to 6.3e10, for which f32 can hold the surface areas.
        (0..5000).map(|i| 1.01_f64.powi(i - 2500)).collect(),
    ];
    let geometry = |halves: &Vec<f64>, kind| {
        let mut group = PrimitiveSet::<R>::default();
        for &half in halves {
            let corner = DVec3::splat(half);
            group
                .add_shape(
                    AnyShape::Cuboid(Cuboid::new(-corner, corner)),
                    Visibility::default(),
                )
                .expect("finite corners");
        }
        Geometry::new(group, kind)
    };
    let scans = halves
        .each_ref()
        .map(|halves| geometry(halves, AcceleratorKind::Linear));
    let trees = halves
        .iter()
        .map(|halves| geometry(halves, AcceleratorKind::default()))
        .collect();
    measure_by_each_kernel(trees, |trees: &[Geometry<R>]| {
        let deepest = trees
            .iter()
            .filter_map(Geometry::build_work)
            .map(|work| work.depth)
            .max()
            .unwrap_or(0);
        let depth = judge_rays("T12 depth", 241, 1, rays, |_| {
            Verdict::from_error(deepest.into(), 64.0, || "depth of the tree".to_owned())
        });
        let hits = judge_rays("T12", 240, 40_000, rays, |rng| {
            let index = rng.ray_index() as usize % 3;
            let size = rng.choose(&halves[index]) * rng.next_uniform(0.5, 2.0);
            judge_tree_against_scan(
                &trees[index],
                &scans[index],
                &create_random_ray::<R>(rng, size),
                Interval::positive(),
            )
        });
        hits.merge(depth)
    })
}

/// Measures case T14: an unbounded plane below a thousand spheres. The tree must find the hits of
/// the linear scan. The plane must not slow the tree: the number of visited nodes is within a tenth
/// of the number without the plane.
pub fn measure_plane_beside_tree<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let geometry = |kind, has_plane| {
        let mut group = PrimitiveSet::<R>::default();
        for i in 0..1000 {
            let rng = &mut CaseRng::new(242, i);
            let (centre, radius) = (
                to_scalar::<R>(rng.sample_point_in_cube() * 10.0),
                R::from_f64(rng.next_uniform(0.1, 0.6)),
            );
            group
                .add_sphere(Sphere { centre, radius }, Visibility::default())
                .expect("finite balls");
        }
        if has_plane {
            let ground = Plane::new(to_scalar::<R>(DVec3::Y * -11.0), to_scalar::<R>(DVec3::Y));
            group
                .add_plane(ground, Visibility::default())
                .expect("a finite plane");
        }
        Geometry::new(group, kind)
    };
    let tree = AcceleratorKind::default();
    let (scan, without) = (
        geometry(AcceleratorKind::Linear, true),
        geometry(tree, false),
    );
    measure_by_each_kernel(vec![geometry(tree, true)], |trees| {
        let nodes = |geometry: &Geometry<R>| {
            let mut stats = TraversalStats::default();
            for i in 0..4000 {
                geometry.closest(
                    &create_random_ray::<R>(&mut CaseRng::new(243, i), 12.0),
                    Interval::positive(),
                    &mut stats,
                );
            }
            stats.nodes as f64
        };
        let change = (nodes(&trees[0]) / nodes(&without) - 1.0).abs();
        let work = judge_rays("T14 work", 244, 1, rays, |_| {
            Verdict::from_error(change, 0.1, || {
                "relative change in the number of visited nodes that the plane causes".to_owned()
            })
        });
        let hits = judge_rays("T14", 243, 40_000, rays, |rng| {
            judge_tree_against_scan(
                &trees[0],
                &scan,
                &create_random_ray::<R>(rng, 12.0),
                Interval::positive(),
            )
        });
        hits.merge(work)
    })
}

/// Measures case T15: scenes of zero, one and two shapes, by trees of every build quality.
pub fn measure_tiny_scenes<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let scenes = 0..60_u64;
    let scan =
        |scene: u64| build_random_geometry::<R>(245, scene, scene % 3, AcceleratorKind::Linear);
    let scans: Vec<_> = scenes.clone().map(scan).collect();
    let tree = |scene: u64| {
        let quality = BuildQuality::ALL[(scene / 3 % 3) as usize];
        build_random_geometry::<R>(245, scene, scene % 3, AcceleratorKind::Tree(quality))
    };
    measure_by_each_kernel(scenes.map(tree).collect(), |trees| {
        judge_rays("T15", 246, 40_000, rays, |rng| {
            let index = rng.ray_index() as usize % scans.len();
            judge_tree_against_scan(
                &trees[index],
                &scans[index],
                &create_random_ray::<R>(rng, 6.0),
                Interval::positive(),
            )
        })
    })
}

/// Measures case T17: ranges of distances that start or end at the distance of a hit, or an ulp
/// beside it.
pub fn measure_ranges_that_end_at_hits<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let scan = build_random_geometry::<R>(247, 0, 60, AcceleratorKind::Linear);
    measure_by_each_kernel(
        vec![build_random_geometry::<R>(
            247,
            0,
            60,
            AcceleratorKind::default(),
        )],
        |trees| {
            judge_rays("T17", 248, 100_000, rays, |rng| {
                let ray = create_random_ray::<R>(rng, 6.0);
                let Some(first) = scan.closest(&ray, Interval::positive(), &mut ()) else {
                    return Verdict::Skipped;
                };
                let min = rng.choose(&[R::ZERO, -R::ZERO, R::from_f64(1e-30)]);
                let (above, below) = (first.t.next_up(), -(-first.t).next_up());
                let before = |max: R| {
                    let hit = trees[0].closest(&ray, Interval { min, max }, &mut ());
                    Verdict::from_condition(hit.is_none(), || {
                        format!(
                            "the tree finds {hit:?}, although the range ends before this hit, at {max:?}{}",
                            format_ray_bits(&ray)
                        )
                    })
                };
                let within = Interval { min, max: above };
                let found = || {
                    let hit = trees[0].closest(&ray, within, &mut ());
                    Verdict::from_condition(hit == Some(first), || {
                        format!(
                            "the tree finds {hit:?} instead of {first:?}, which lies just before the end of the range{}",
                            format_ray_bits(&ray)
                        )
                    })
                };
                let beyond = |min: R| {
                    judge_tree_against_scan(
                        &trees[0],
                        &scan,
                        &ray,
                        Interval {
                            min,
                            max: R::INFINITY,
                        },
                    )
                };
                before(first.t)
                    .and_then(|| before(below))
                    .and_then(found)
                    .and_then(|| judge_tree_against_scan(&trees[0], &scan, &ray, within))
                    .and_then(|| beyond(first.t))
                    .and_then(|| beyond(below))
                    .and_then(|| beyond(above))
            })
        },
    )
}

/// Measures case T19: no shape may return a distance that is NaN or outside the range, even if the
/// range starts at the distance of a hit.
pub fn measure_distances_in_interval<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let outcome = judge_rays("T19", 249, 400_000, rays, |rng| {
        let shape = create_random_shape::<R>(rng);
        let target = shape.bounds().map_or(DVec3::ZERO, |bounds| bounds.centre())
            + rng.sample_point_in_cube() * 0.3;
        let ray = create_ray_towards::<R>(
            target + rng.sample_direction() * rng.choose(&[0.1, 1.0, 10.0, 1e4]),
            round_to_f32(target),
        );
        let prepared = PreparedRay::new(ray);
        let intersect = |range: Interval<R>| shape.intersect(&prepared, range, Side::Both);
        let Some(first) = intersect(Interval::positive()) else {
            return Verdict::Skipped;
        };
        let ends = [
            R::from_f64(rng.next_in_unit_interval()),
            first.t,
            first.t.next_up(),
            -(-first.t).next_up(),
            -R::ONE,
        ];
        let ranges = ends.iter().flat_map(|&min| {
            [R::INFINITY, first.t, first.t.next_up()].map(|max| Interval { min, max })
        });
        let is_outside = |range: &Interval<R>| {
            intersect(*range).is_some_and(|hit| !range.contains(hit.t) || !hit.t.is_finite())
        };
        let wrong = ranges.into_iter().find(is_outside);
        wrong.map_or(Verdict::Right(0.0), |range| {
            Verdict::Wrong(format!(
                "the shape returns {:?}, outside the range {range:?}{} {shape:?}",
                intersect(range),
                format_ray_bits(&ray)
            ))
        })
    });
    vec![create_treeless_measurement::<R>(outcome)]
}

/// Measures case T20: 200 scenes of shapes of every kind, by trees and by linear scans.
pub fn measure_tree_against_scan<R: Real>(rays: RayCount) -> Vec<Measurement> {
    const SCENES: u64 = 200;
    let each = |kind| {
        (0..SCENES)
            .map(|scene| build_random_geometry::<R>(250, scene, 5 + scene % 40, kind))
            .collect::<Vec<_>>()
    };
    let scans = each(AcceleratorKind::Linear);
    measure_by_each_kernel(each(AcceleratorKind::default()), |trees| -> CaseOutcome {
        judge_rays("T20", 251, 2_000_000, rays, |rng| {
            let index = (rng.ray_index() % SCENES) as usize;
            let max = if rng.next_sign() > 0.0 {
                R::INFINITY
            } else {
                R::from_f64(rng.next_uniform(0.1, 10.0))
            };
            judge_tree_against_scan(
                &trees[index],
                &scans[index],
                &create_random_ray::<R>(rng, 6.0),
                Interval { min: R::ZERO, max },
            )
        })
    })
}
