//! Moving instances: at any time they are hit like still instances under the same map.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use raywright_bvh::shapes::{Disk, Sphere, Triangle};
use raywright_bvh::{
    AcceleratorKind, Geometry, GeometryError, Hit, Interval, PrimitiveSet, Ray, Real, Vector,
    Visibility,
};

use super::{ASKED, QueryRng, halved, kinds};

/// A sphere, a disk and a few triangles within two units of the origin.
fn part<R: Real>(kind: AcceleratorKind) -> Geometry<R> {
    let (rng, mut group) = (&mut QueryRng(7), PrimitiveSet::<R>::default());
    let v = |p: Vec3| R::Vec3::from_f64(p.as_dvec3());
    group
        .add_sphere(
            Sphere {
                centre: v(Vec3::X),
                radius: R::from_f64(0.5),
            },
            ASKED,
        )
        .unwrap();
    group
        .add_shape(Disk::new(DVec3::NEG_X, DVec3::Y, 0.75).into(), ASKED)
        .unwrap();
    group
        .add_mesh(
            (0..8).map(|_| [(); 3].map(|()| v(rng.point() * 0.1))),
            ASKED,
        )
        .unwrap();
    Geometry::new(group, kind)
}

/// A multiple of 1/256 up to `size`. Between two such numbers, the interpolation at a time that is
/// a multiple of 1/1024 is exact in f64.
fn coarse(rng: &mut QueryRng, size: f64) -> f64 {
    ((f64::from(rng.unit()) * 2.0 - 1.0) * size * 256.0).round() / 256.0
}

/// Ends of motions: a dozen pairs of maps that stretch, shear and rotate, invertible throughout, on
/// paths that cross.
fn journeys(rng: &mut QueryRng) -> Vec<[DAffine3; 2]> {
    let map = |rng: &mut QueryRng| DAffine3 {
        matrix3: DMat3::from_cols_array(&[(); 9].map(|()| coarse(rng, 1.5)))
            + DMat3::IDENTITY * 1.25,
        translation: DVec3::from_array([(); 3].map(|()| coarse(rng, 6.0))),
    };
    let mut group = PrimitiveSet::<f32>::default();
    let part = group.add_part(part(AcceleratorKind::Linear)).unwrap();
    let drawn = core::iter::repeat_with(|| [map(rng), map(rng)]);
    drawn
        .filter(|&ends| group.add_moving_instance(part, ends, ASKED).is_ok())
        .take(12)
        .collect()
}

fn at(&[start, end]: &[DAffine3; 2], time: f64) -> DAffine3 {
    DAffine3 {
        matrix3: start.matrix3 + (end.matrix3 - start.matrix3) * time,
        translation: start.translation + (end.translation - start.translation) * time,
    }
}

fn moving<R: Real>(journeys: &[[DAffine3; 2]], kind: AcceleratorKind) -> Geometry<R> {
    let mut group = PrimitiveSet::default();
    let part = group.add_part(part(kind)).unwrap();
    journeys
        .iter()
        .for_each(|&ends| assert!(group.add_moving_instance(part, ends, ASKED).is_ok()));
    Geometry::new(group, kind)
}

fn standing<R: Real>(journeys: &[[DAffine3; 2]], time: f64) -> Geometry<R> {
    let mut group = PrimitiveSet::default();
    let part = group.add_part(part(AcceleratorKind::Linear)).unwrap();
    journeys
        .iter()
        .for_each(|ends| assert!(group.add_instance(part, at(ends, time), ASKED).is_ok()));
    Geometry::new(group, AcceleratorKind::Linear)
}

/// Every result of a geometry for a ray: the hit, its surface and texture coordinates, and the hits
/// passed to an any-hit filter.
fn told<R: Real>(geometry: &Geometry<R>, ray: &Ray<R>) -> (Option<Hit<R>>, String) {
    let (range, mut shown) = (Interval::positive(), Vec::new());
    let hit = geometry.closest(ray, range, &mut ());
    let ask = &mut |hit: &Hit<R>| {
        shown.push((hit.tie_order(), hit.t.to_f64().to_bits()));
        false
    };
    assert!(!geometry.occluded(ray, range, ask, &mut ()));
    shown.sort_unstable();
    let place = hit.map(|hit| {
        (
            geometry.surface_point(ray, &hit),
            geometry.surface(ray, &hit),
            geometry.texture_coordinates(ray, &hit),
        )
    });
    (hit, format!("{place:?} {shown:?}"))
}

/// Traces rays from all sides at a thousand times, towards objects there, through every
/// accelerator.
fn met_where_they_are<R: Real>() {
    let rng = &mut QueryRng(21);
    let journeys = journeys(rng);
    let scan = moving::<R>(&journeys, AcceleratorKind::Linear);
    let others: Vec<_> = kinds().map(|kind| moving::<R>(&journeys, kind)).collect();
    let (mut hits, mut named) = (0, [0; 12]);
    for i in 0..1000 {
        let time = f64::from((rng.unit() * 1024.0).round()) / 1024.0;
        let there = standing::<R>(&journeys, time);
        let target = at(&journeys[i % 12], time).transform_point3(rng.point().as_dvec3() * 0.1);
        let from = target + rng.direction().as_dvec3() * f64::from(20.0 * rng.unit() + 0.1);
        let v = |v: DVec3| R::Vec3::from_f64(v);
        let ray = Ray::new(v(from), v((target - from).normalize()));
        let timed = ray.with_time(R::from_f64(time));
        let found = told(&scan, &timed);
        for other in &others {
            assert_eq!(told(other, &timed), found, "{timed:?}");
        }
        assert_eq!(told(&there, &ray), found, "{timed:?}");
        if let Some(hit) = found.0 {
            hits += 1;
            named[hit.instance as usize] += 1;
        }
    }
    assert!(
        hits > 500 && named.iter().all(|&times| times > 10),
        "{hits} {named:?}"
    );
}

/// Protects: moving instances are hit, located, parametrised and passed to any-hit filters with the
/// bits of still instances under the map of that time; by the scan, by box tests and by every tree,
/// none of which culls a moving instance.
#[test]
fn moving_objects_are_hit_where_they_are() {
    met_where_they_are::<f32>();
    met_where_they_are::<f64>();
}

/// A set with a sphere of radius one as a part.
fn ball() -> (PrimitiveSet<f32>, u32) {
    let (mut inner, mut group) = (PrimitiveSet::default(), PrimitiveSet::default());
    inner
        .add_sphere(
            Sphere {
                centre: Vec3::ZERO,
                radius: 1.0,
            },
            Visibility::default(),
        )
        .unwrap();
    let part = group
        .add_part(Geometry::new(inner, AcceleratorKind::default()))
        .unwrap();
    (group, part)
}

/// A motion from the origin by `to` along x.
fn along_x(to: f64) -> [DAffine3; 2] {
    [
        DAffine3::IDENTITY,
        DAffine3::from_translation(DVec3::X * to),
    ]
}

/// Protects: a sphere that moves from 0 to 8 along x is hit as in closed form, exactly where the
/// numbers are exact, and nowhere else. Times beyond the ends are clamped, a ray without a time is
/// at the start, and a NaN time hits nothing. The box is that around both ends.
#[test]
fn a_ball_on_its_way() {
    for kind in kinds().chain([AcceleratorKind::Linear]) {
        let (mut group, part) = ball();
        group
            .add_moving_instance(part, along_x(8.0), Visibility::default())
            .unwrap();
        let geometry = Geometry::new(group, kind);
        let bounds = geometry.bounds().unwrap();
        assert_eq!(
            (bounds.min, bounds.max),
            (DVec3::NEG_ONE, DVec3::new(9.0, 1.0, 1.0))
        );
        let down = |x: f32| Ray::new(Vec3::new(x, 0.0, 3.0), Vec3::NEG_Z);
        for (time, x) in [
            (0.0, 0.0),
            (0.125, 1.0),
            (0.5, 4.0),
            (1.0, 8.0),
            (-3.0, 0.0),
            (7.0, 8.0),
            (f32::INFINITY, 8.0),
        ] {
            let ray = down(x).with_time(time);
            let hit = geometry
                .closest(&ray, Interval::positive(), &mut ())
                .unwrap();
            let surface = geometry.surface(&ray, &hit);
            assert_eq!(
                (hit.t, surface.point, surface.normal),
                (2.0, Vec3::new(x, 0.0, 1.0), Vec3::Z),
                "{time}"
            );
            for beside in [x - 1.001, x + 1.001] {
                let ray = down(beside).with_time(time);
                assert_eq!(
                    geometry.closest(&ray, Interval::positive(), &mut ()),
                    None,
                    "{time}"
                );
                assert!(!geometry.occluded(&ray, Interval::positive(), &mut |_| true, &mut ()));
            }
            assert!(geometry.occluded(&ray, Interval::positive(), &mut |_| false, &mut ()));
        }
        let never = down(0.0).with_time(f32::NAN);
        assert_eq!(
            geometry.closest(&never, Interval::positive(), &mut ()),
            None
        );
        assert!(
            geometry
                .closest(&down(0.0), Interval::positive(), &mut ())
                .is_some()
        );
    }
}

/// Protects: if two moving objects and a still one coincide at some time, the lowest object is hit,
/// whichever that is.
#[test]
fn ties_go_to_the_lowest_object() {
    let half = DAffine3::from_translation(DVec3::X * 4.0);
    let journeys = [
        along_x(8.0),
        [along_x(8.0)[1], along_x(8.0)[0]],
        [half, half],
    ];
    for (kind, first) in kinds()
        .chain([AcceleratorKind::Linear])
        .flat_map(|kind| (0..3).map(move |first| (kind, first)))
    {
        let (mut group, part) = ball();
        (0..3).for_each(|i| {
            assert_eq!(
                group.add_moving_instance(part, journeys[(first + i) % 3], Visibility::default()),
                Ok(i as u32)
            )
        });
        let geometry = Geometry::new(group, kind);
        let ray = Ray::new(Vec3::new(4.0, 0.0, 3.0), Vec3::NEG_Z).with_time(0.5);
        let hit = geometry
            .closest(&ray, Interval::positive(), &mut ())
            .unwrap();
        assert_eq!((hit.instance, hit.t), (0, 2.0), "{kind:?} {first}");
    }
}

/// Protects: a motion that is invalid at some time is refused with its reason, and nothing is
/// added.
#[test]
fn impossible_ways_are_refused() {
    let (mut group, part) = ball();
    let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    let mut refused = |part, ends| {
        group
            .add_moving_instance(part, ends, Visibility::default())
            .unwrap_err()
    };
    let half_turn = DAffine3::from_rotation_y(core::f64::consts::PI);
    assert_eq!(
        refused(part, [DAffine3::IDENTITY, half_turn]),
        GeometryError::SingularDuringMotion
    );
    assert_eq!(
        refused(part, [DAffine3::IDENTITY, flat]),
        GeometryError::Singular
    );
    assert_eq!(
        refused(part, [flat, DAffine3::IDENTITY]),
        GeometryError::Singular
    );
    assert_eq!(refused(part, along_x(1e39)), GeometryError::NotFinite);
    // Each end has a box in f32, but the motion between them does not.
    let wide =
        [1.0, -1.0].map(|side| DAffine3::from_translation(DVec3::X * (side * 3.402_821_2e38)));
    assert_eq!(refused(part, wide), GeometryError::NotFinite);
    assert_eq!(refused(part + 1, along_x(1.0)), GeometryError::UnknownPart);
    assert!(
        group.is_empty() && Geometry::new(group, AcceleratorKind::Linear).instance_count() == 0
    );
}

/// A function that adds another instance of a part.
type AddInstance<'a> = &'a dyn Fn(&mut PrimitiveSet<f32>, u32) -> Result<u32, GeometryError>;

/// Protects: a still instance takes no memory for motion, also if it is added as a motion between
/// equal maps; a moving instance takes its two maps in addition.
#[test]
fn only_motion_takes_bytes() {
    let more = |add: AddInstance<'_>| {
        let bytes = |count: usize| {
            let (mut group, part) = ball();
            assert!((0..count).all(|_| add(&mut group, part).is_ok()));
            Geometry::new(group, AcceleratorKind::Linear).memory_bytes()
        };
        bytes(9) - bytes(8)
    };
    // A slot; an optional box; twelve numbers of the map, nine of its inverse and its magnification;
    // the part; rounded to whole pairs of cache lines.
    let still = 16 + 7 * 8 + 22 * 8 + 8 + 16;
    assert_eq!(
        more(&|group, part| group.add_instance(part, halved(), ASKED)),
        still
    );
    assert_eq!(
        more(&|group, part| group.add_moving_instance(part, [halved(); 2], ASKED)),
        still
    );
    assert_eq!(
        more(&|group, part| group.add_moving_instance(part, along_x(1.0), ASKED)),
        still + 2 * 12 * 8
    );
}

/// Protects: the corners of a hit triangle are those in the world at the ray's time: of a triangle
/// alone, under a map, in an instance and in a moving one, as a shape and as a mesh.
#[test]
fn corners_of_triangles_are_where_the_ray_hits_them() {
    let corners = [
        DVec3::ZERO,
        DVec3::new(2.0, 0.25, 0.0),
        DVec3::new(0.5, 1.5, 0.5),
    ];
    let stored = corners.map(|corner| corner.as_vec3());
    let shape = Triangle { vertices: stored }.into();
    let turn = DAffine3 {
        matrix3: DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z * 2.0),
        translation: DVec3::new(0.5, -1.0, 0.25),
    };
    let ends = [turn, DAffine3::from_translation(DVec3::X * 4.0) * turn];
    let middle = DAffine3::from_translation(DVec3::X * 2.0) * turn;
    for (kind, is_mapped) in kinds()
        .chain([AcceleratorKind::Linear])
        .zip([false, true].into_iter().cycle())
    {
        let part = |group: &mut PrimitiveSet<f32>| {
            let mut inner = PrimitiveSet::default();
            match is_mapped {
                true => inner.add_transformed_shape(shape, halved(), ASKED).unwrap(),
                false => inner.add_mesh([stored], ASKED).unwrap(),
            };
            group.add_part(Geometry::new(inner, kind)).unwrap()
        };
        let own = if is_mapped {
            halved()
        } else {
            DAffine3::IDENTITY
        };
        for (number, map) in [DAffine3::IDENTITY, turn, turn * own, middle * own]
            .into_iter()
            .enumerate()
        {
            let mut group = PrimitiveSet::default();
            match number {
                0 => group.add_shape(shape, ASKED).unwrap(),
                1 => group.add_transformed_shape(shape, turn, ASKED).unwrap(),
                2 => {
                    let part = part(&mut group);
                    group.add_instance(part, turn, ASKED).unwrap()
                }
                _ => {
                    let part = part(&mut group);
                    group.add_moving_instance(part, ends, ASKED).unwrap()
                }
            };
            let geometry = Geometry::new(group, kind);
            let there = corners.map(|corner| map.transform_point3(corner));
            let target = (there[0] + there[1] + there[2]) / 3.0;
            let origin = target + DVec3::new(0.1, 0.2, 5.0);
            let ray =
                Ray::new(origin.as_vec3(), (target - origin).normalize().as_vec3()).with_time(0.5);
            let hit = geometry
                .closest(&ray, Interval::positive(), &mut ())
                .unwrap();
            assert_eq!(
                geometry.triangle_corners(&ray, &hit),
                Some(there),
                "{kind:?}, {number}"
            );
        }
    }
}
