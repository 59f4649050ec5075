//! T11, T13, T18: coincident primitives, and primitives and rays with NaN or infinite numbers.

use glam::{DVec3, Vec3};
use raywright_bvh::shapes::{AnyShape, Cuboid, Disk, Ellipsoid, Sphere, Torus};
use raywright_bvh::{
    AcceleratorKind, BuildQuality, Geometry, GeometryError, Hit, Interval, Occlusion, PrimitiveSet,
    Ray, TraversalStats, Visibility,
};

use super::{ASKED, QueryRng, kinds, mixed, triangles};

/// Protects: a thousand to ten thousand coincident triangles, or triangles collapsed to points,
/// build a shallow tree with at most three times the work of random ones, and the lowest id wins.
#[test]
fn t11_coincident_primitives() {
    let many = |count: usize, corners: [Vec3; 3]| {
        let mut group = PrimitiveSet::<f32>::default();
        for _ in 0..count {
            group
                .add_triangle(corners, Visibility::default())
                .expect("finite corners");
        }
        group
    };
    for (count, quality) in [1000, 4000, 10_000]
        .into_iter()
        .flat_map(|count| BuildQuality::ALL.map(|quality| (count, quality)))
    {
        let built = |group: PrimitiveSet<f32>| Geometry::new(group, AcceleratorKind::Tree(quality));
        let base = built(triangles(&mut QueryRng(11), count))
            .build_work()
            .expect("a tree");
        for (name, corners) in [
            ("triangles", [Vec3::ZERO, Vec3::X, Vec3::Y]),
            ("points", [Vec3::ONE; 3]),
        ] {
            let tree = built(many(count, corners));
            let work = tree.build_work().expect("a tree");
            assert!(
                work.depth <= 64 && work.boxes_visited <= 3 * base.boxes_visited,
                "{count} {name}, {quality:?}: {work:?} against {base:?}"
            );
            let point = corners[0] + (corners[1] + corners[2] - corners[0] * 2.0) * 0.25;
            let hit = tree.closest(
                &Ray::new(point + Vec3::Z * 3.0, Vec3::NEG_Z),
                Interval::positive(),
                &mut (),
            );
            let expected = if name == "triangles" {
                Some((0, 3.0))
            } else {
                None
            };
            assert_eq!(
                hit.map(|hit| (hit.object, hit.t)),
                expected,
                "{count} {name}"
            );
        }
    }
}

/// Protects: hits at one distance are all visited, whatever shadows their objects cast, once each and
/// within the range alone, until the visitor ends the visit.
#[test]
fn hits_in_one_place_are_all_visited() {
    for kind in kinds().chain([AcceleratorKind::Linear]) {
        let mut group = PrimitiveSet::<f32>::default();
        for occlusion in [Occlusion::Opaque, Occlusion::None, Occlusion::Filtered] {
            let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
            let visibility = Visibility {
                occlusion,
                ..Visibility::default()
            };
            for z in [0.0, -1.0] {
                let corners = corners.map(|corner| corner + Vec3::Z * z);
                group.add_triangle(corners, visibility).expect("a triangle");
            }
        }
        let geometry = Geometry::new(group, kind);
        let ray = Ray::new(Vec3::new(0.25, 0.25, 3.0), Vec3::NEG_Z);
        let visited = |max: f32, most: usize| {
            let mut objects = Vec::new();
            let mut visit = |hit: &Hit<f32>| {
                objects.push(hit.object);
                objects.len() == most
            };
            geometry.visit_hits(&ray, Interval { min: 2.5, max }, &mut visit);
            objects.sort_unstable();
            objects
        };
        assert_eq!(visited(3.5, 9), [0, 2, 4], "{kind:?}");
        assert_eq!(visited(4.5, 9), [0, 1, 2, 3, 4, 5], "{kind:?}");
        assert_eq!(visited(4.5, 2).len(), 2, "{kind:?}");
    }
}

/// Protects: a primitive with a non-finite coordinate, or without size, is refused with a reason
/// before any build, alone among a thousand or ten; the remaining set has the hits of one that
/// never contained it.
#[test]
fn t13_not_finite_is_refused() {
    let bad: Vec<AnyShape<f32>> = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY]
        .into_iter()
        .flat_map(|x| -> [AnyShape<f32>; 5] {
            let (point, wide) = (DVec3::new(0.0, f64::from(x), 0.0), f64::from(x));
            [
                Sphere {
                    centre: Vec3::new(x, 0.0, 0.0),
                    radius: 1.0,
                }
                .into(),
                Sphere {
                    centre: Vec3::ZERO,
                    radius: x.abs(),
                }
                .into(),
                AnyShape::Cuboid(Cuboid::new(point, DVec3::ONE)),
                Ellipsoid::new(DVec3::ZERO, DVec3::new(1.0, wide, 1.0)).into(),
                Torus::new(point, DVec3::Y, 2.0, 0.5).into(),
            ]
        })
        .collect();
    for count in [1, 10] {
        let (mut clean, mut repaired) = (
            triangles(&mut QueryRng(7), 1000),
            triangles(&mut QueryRng(7), 1000),
        );
        for &shape in bad.iter().cycle().take(count * bad.len()) {
            assert_eq!(
                repaired.add_shape(shape, ASKED),
                Err(GeometryError::NotFinite),
                "{shape:?}"
            );
        }
        for corner in 0..3 {
            let mut corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
            corners[corner].z = f32::NAN;
            assert_eq!(
                repaired.add_triangle(corners, ASKED),
                Err(GeometryError::NotFinite)
            );
        }
        assert_eq!(
            (repaired.len(), repaired.object_count()),
            (clean.len(), clean.object_count())
        );
        let disk = Disk::new(DVec3::ZERO, DVec3::Y, 1.0);
        for group in [&mut clean, &mut repaired] {
            group.add_shape(disk.into(), ASKED).expect("a finite one");
        }
        // A box with exchanged corners is empty, whether refused or not.
        let _ = repaired.add_shape(
            AnyShape::Cuboid(Cuboid::new(DVec3::ONE, DVec3::NEG_ONE)),
            ASKED,
        );
        let [clean, repaired] =
            [clean, repaired].map(|group| Geometry::new(group, AcceleratorKind::default()));
        let rng = &mut QueryRng(8);
        for _ in 0..2000 {
            let ray = Ray::new(rng.point(), rng.direction());
            let [a, b] =
                [&clean, &repaired].map(|tree| tree.closest(&ray, Interval::positive(), &mut ()));
            assert_eq!(a, b, "{ray:?}");
        }
    }
}

/// A ray with a non-finite number in each component in turn, and in all.
fn odd_rays() -> impl Iterator<Item = Ray<f32>> {
    [f32::NAN, f32::INFINITY, f32::NEG_INFINITY]
        .into_iter()
        .flat_map(|bad| {
            // NaN in every component: such a ray enters even empty boxes.
            let all = Ray::new(Vec3::splat(bad), Vec3::splat(bad));
            let of_lane = move |lane: usize| {
                let mut v = [0.1, 0.2, 0.3, 0.6, 0.0, 0.8];
                v[lane] = bad;
                Ray::new(Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]))
            };
            [all].into_iter().chain((0..6).map(of_lane))
        })
}

/// Protects: rays with NaN or infinite numbers hit nothing, by either query, with at most two and a
/// half times the work of ordinary rays; so do ordinary rays with invalid ranges.
#[test]
fn t18_rays_that_are_not_finite_hit_nothing() {
    let ranges = [
        (f32::NAN, 9.0),
        (0.0, f32::NAN),
        (f32::NAN, f32::NAN),
        (f32::INFINITY, f32::INFINITY),
        (0.0, f32::NEG_INFINITY),
    ];
    for kind in kinds() {
        let geometry = Geometry::new(mixed(9, 101), kind);
        let work = |rays: &[Ray<f32>]| {
            let mut stats = TraversalStats::default();
            for ray in rays {
                geometry.closest(ray, Interval::positive(), &mut stats);
            }
            (stats.nodes + stats.primitives) as f64 / rays.len() as f64
        };
        let rng = &mut QueryRng(10);
        let sound: Vec<Ray<f32>> = (0..500)
            .map(|_| Ray::new(rng.point(), rng.direction()))
            .collect();
        let odd: Vec<Ray<f32>> = odd_rays().collect();
        let (odd_work, sound_work) = (work(&odd), work(&sound));
        assert!(
            odd_work <= 2.5 * sound_work,
            "{kind:?}: {odd_work} against {sound_work}"
        );
        let misses = |ray: &Ray<f32>, range: Interval<f32>| {
            assert_eq!(
                geometry.closest(ray, range, &mut ()),
                None,
                "{kind:?} {ray:?} {range:?}"
            );
            assert!(
                !geometry.occluded(ray, range, &mut |_| true, &mut ()),
                "{kind:?} {ray:?} {range:?}"
            );
        };
        odd.iter().for_each(|ray| misses(ray, Interval::positive()));
        for (min, max) in ranges {
            sound
                .iter()
                .for_each(|ray| misses(ray, Interval { min, max }));
        }
    }
}
