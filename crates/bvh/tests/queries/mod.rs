//! The tree, for every build quality, and the scan give the same bits for every query.

mod extremes;
mod moving;
mod objects;

use glam::{DAffine3, DVec3, Vec3};
use raywright_bvh::shapes::{Plane, Sphere};
use raywright_bvh::{
    Aabb, AcceleratorKind, BuildQuality, Geometry, GeometryError, Hit, Interval, Occlusion,
    PrimitiveSet, Ray, Real, Side, Surface, TraversalStats, Visibility,
};

use crate::split_mix::step;

/// A small seeded generator (SplitMix64), so that a failure can be repeated.
struct QueryRng(u64);

impl QueryRng {
    fn unit(&mut self) -> f32 {
        (step(&mut self.0) >> 40) as f32 / (1 << 24) as f32
    }
    fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 20.0 - 10.0
    }
    fn direction(&mut self) -> Vec3 {
        (self.point()).normalize()
    }
}

/// Visibility that passes every hit to the filter.
const ASKED: Visibility = Visibility {
    side: Side::Both,
    occlusion: Occlusion::Filtered,
};

fn corners(rng: &mut QueryRng) -> [Vec3; 3] {
    let a = rng.point();
    [a, a + rng.direction() * 2.0, a + rng.direction() * 2.0]
}

fn triangles(rng: &mut QueryRng, count: usize) -> PrimitiveSet<f32> {
    let mut group = PrimitiveSet::default();
    for _ in 0..count {
        group.add_triangle(corners(rng), ASKED).unwrap();
    }
    group
}

/// Spheres, triangles (many of them duplicated, so that ties occur), a plane and instances.
fn mixed(seed: u64, count: usize) -> PrimitiveSet<f32> {
    let rng = &mut QueryRng(seed);
    let shared = Geometry::new(triangles(rng, 20), AcceleratorKind::default());
    let mut group = triangles(rng, count);
    let shared = group.add_part(shared).unwrap();
    for i in 0..count {
        let visibility = if i % 3 == 0 {
            Visibility {
                occlusion: Occlusion::None,
                ..ASKED
            }
        } else {
            ASKED
        };
        let sphere = Sphere {
            centre: rng.point(),
            radius: 0.1 + rng.unit(),
        };
        group.add_sphere(sphere, visibility).unwrap();
        if i % 4 == 0 {
            group.add_sphere(sphere, visibility).unwrap();
        }
    }
    group
        .add_plane(Plane::new(Vec3::new(0.0, -9.0, 0.0), Vec3::Y), ASKED)
        .unwrap();
    for _ in 0..count / 10 {
        let map = DAffine3::from_translation(rng.point().as_dvec3() * 3.0)
            * DAffine3::from_axis_angle(rng.direction().as_dvec3(), f64::from(rng.unit()) * 6.0)
            * DAffine3::from_scale(DVec3::new(0.5, 2.0, -0.7));
        group.add_instance(shared, map, ASKED).unwrap();
    }
    group
}

/// A scale by one half.
fn halved() -> DAffine3 {
    DAffine3::from_scale(DVec3::splat(0.5))
}

fn kinds() -> impl Iterator<Item = AcceleratorKind> {
    BuildQuality::ALL.into_iter().map(AcceleratorKind::Tree)
}

/// Protects: the primitives of a box are the same for the tree and for the scan, but for instances, which
/// the tree knows more closely; they contain each whose hit lies in the box, and no plane beside the box;
/// and a search ends when it is told to.
#[test]
fn boxes_have_all_their_primitives() {
    let found = |geometry: &Geometry<f32>, bounds: &Aabb| {
        let mut found = Vec::new();
        geometry.visit_box(bounds, &mut |object, primitive, corners| {
            found.push((object, primitive, corners.is_some()));
            false
        });
        found.sort_unstable();
        found
    };
    for (seed, count) in [(1, 0), (2, 1), (4, 9), (6, 400)] {
        let scan = Geometry::new(mixed(seed, count), AcceleratorKind::Linear);
        let rng = &mut QueryRng(seed);
        let (mut hits, mut some, mut instances) = (0, 0, 0);
        for kind in kinds() {
            let tree = Geometry::new(mixed(seed, count), kind);
            for _ in 0..500 {
                let half = rng.direction().abs() * 10_f32.powf(rng.unit() * 4.0 - 3.0);
                let bounds = Aabb::from_centre(rng.point().as_dvec3(), half.as_dvec3());
                let (all, own) = (found(&scan, &bounds), found(&tree, &bounds));
                let is_instance = |entry: &&(u32, u32, bool)| entry.1 == u32::MAX;
                let rest = |found: &[(u32, u32, bool)]| -> Vec<_> {
                    found
                        .iter()
                        .filter(|entry| !is_instance(entry))
                        .copied()
                        .collect()
                };
                assert_eq!(rest(&own), rest(&all), "{kind:?} {bounds:?}");
                assert!(
                    own.iter().all(|entry| all.contains(entry)),
                    "{kind:?} {bounds:?}"
                );
                some += usize::from(!own.is_empty());
                instances += usize::from(own.iter().any(|entry| is_instance(&entry)));
                assert_eq!(
                    tree.visit_box(&bounds, &mut |_, _, _| true),
                    !own.is_empty()
                );
                let (from, centre) = (rng.point(), (bounds.min + bounds.max) * 0.5);
                let ray = Ray::new(from, centre.as_vec3() - from);
                scan.visit_hits(&ray, Interval::positive(), &mut |hit| {
                    let point = scan.surface_point(&ray, hit).point;
                    let is_inside = point.cmpge(bounds.min).all() && point.cmple(bounds.max).all();
                    hits += usize::from(is_inside);
                    // The primitives of an instance are one.
                    let object = hit.outermost_id();
                    let has = |entry: &(u32, u32, bool)| entry.0 == object;
                    assert!(!is_inside || own.iter().any(has), "{hit:?} {bounds:?}");
                    false
                });
            }
        }
        assert!(
            count < 400 || hits > 20 && some > 200 && instances > 20,
            "{hits} {some} {instances}"
        );
    }
    let floor = Geometry::new(mixed(1, 0), AcceleratorKind::default());
    for (height, count) in [(-8.0, 0), (-9.0, 1), (-10.0, 0)] {
        let bounds = Aabb::from_centre(DVec3::Y * height, DVec3::splat(0.5));
        assert_eq!(found(&floor, &bounds).len(), count, "{height}");
    }
}

/// Protects: hits are identical bit for bit, the lowest id wins ties, and any-hit agrees with
/// closest-hit.
#[test]
fn t20_tree_equals_scan() {
    for (seed, count) in [(1, 0), (2, 1), (3, 2), (4, 9), (5, 60), (6, 400)] {
        let scan = Geometry::new(mixed(seed, count), AcceleratorKind::Linear);
        for kind in kinds() {
            let tree = Geometry::new(mixed(seed, count), kind);
            let rng = &mut QueryRng(seed ^ 0xabcd);
            for _ in 0..3000 {
                let ray = Ray::new(rng.point(), rng.direction());
                let range = Interval {
                    min: 0.0,
                    max: if rng.unit() < 0.5 {
                        f32::INFINITY
                    } else {
                        8.0 * rng.unit()
                    },
                };
                let expected = scan.closest(&ray, range, &mut ());
                assert_eq!(
                    tree.closest(&ray, range, &mut ()),
                    expected,
                    "{kind:?} seed {seed} {ray:?} {range:?}"
                );
                let lowest = |g: &Geometry<f32>| {
                    let mut lowest = [u32::MAX; 3];
                    g.occluded(
                        &ray,
                        range,
                        &mut |h| {
                            lowest = lowest.min(h.tie_order());
                            false
                        },
                        &mut (),
                    );
                    lowest
                };
                assert_eq!(
                    lowest(&tree),
                    lowest(&scan),
                    "{kind:?} seed {seed} {ray:?} {range:?}"
                );
            }
        }
    }
}

/// Protects: surfaces located for many hits at once have the bits and indices of those located one
/// by one, for any shapes in any order, any number of hits, and on borders of triangles, where
/// points are moved.
#[test]
fn surfaces_of_many_are_those_of_each() {
    let geometry = Geometry::new(mixed(7, 200), AcceleratorKind::default());
    let rng = &mut QueryRng(7);
    // The first twenty belong to the instanced geometry.
    let triangles: Vec<[Vec3; 3]> = (0..220).map(|_| corners(rng)).skip(20).collect();
    let mut on_borders = 0;
    let mut aimed = || {
        let [a, b, c] = triangles[(rng.unit() * 200.0) as usize];
        let (u, v) = match (rng.unit() * 4.0) as u32 {
            0 => (0.0, 0.0),
            1 => (rng.unit(), 0.0),
            _ => (rng.unit() * 0.5, rng.unit() * 0.5),
        };
        let target = a + (b - a) * u + (c - a) * v;
        let origin = rng.point();
        Ray::new(origin, (target - origin).normalize())
    };
    let closest_hit = core::iter::from_fn(|| Some(aimed()))
        .filter_map(|ray| Some((ray, geometry.closest(&ray, Interval::positive(), &mut ())?)));
    let hits: Vec<(Ray<f32>, Hit<f32>)> = closest_hit.take(5000).collect();
    for count in [0, 1, 7, 8, 9, 16, 5000] {
        let these = &hits[..count];
        let mut found = vec![None; count];
        geometry.surfaces(
            these.iter().map(|(ray, hit)| (ray, hit)),
            |index, surface| {
                assert!(found[index].replace(surface).is_none(), "{index} twice");
            },
        );
        for ((ray, hit), surface) in these.iter().zip(found) {
            let (surface, alone) = (surface.expect("each is told"), geometry.surface(ray, hit));
            let bits = |s: &Surface<f32>| {
                let vectors =
                    [s.point, s.above, s.below, s.normal].map(|v| v.to_array().map(f32::to_bits));
                (vectors, s.error.to_bits())
            };
            assert_eq!(bits(&surface), bits(&alone), "{ray:?} {hit:?}");
            on_borders +=
                usize::from(hit.object < 200 && hit.u.min(hit.v).min(1.0 - hit.u - hit.v) < 1e-6);
        }
    }
    assert!(on_borders > 300, "{on_borders} on borders");
}

/// Protects: a ray along an axis or in an axis-aligned plane enters boxes whichever sign its zeros
/// have, since reflected or mapped rays may have either; tree and box tests hit the spheres along
/// it, at coordinates of every sign, as a scan does.
#[test]
fn t02_zeros_of_either_sign_are_one_direction() {
    let row = |kind| {
        let mut group = PrimitiveSet::<f32>::default();
        for i in 0..5 * 5 * 5 {
            let centre = Vec3::new((i % 5) as f32, (i / 5 % 5) as f32, (i / 25) as f32) * 3.0 - 6.0;
            group
                .add_sphere(
                    Sphere {
                        centre,
                        radius: 1.0,
                    },
                    Visibility::default(),
                )
                .unwrap();
        }
        Geometry::new(group, kind)
    };
    let (scan, others) = (
        row(AcceleratorKind::Linear),
        kinds().map(|kind| (kind, row(kind))).collect::<Vec<_>>(),
    );
    let rng = &mut QueryRng(13);
    let mut hit_count = 0;
    for i in 0..2000 {
        let mut direction = rng.direction();
        for axis in (0..3).filter(|axis| (i % 6 + 1) >> axis & 1 != 0) {
            direction[axis] = if rng.unit() < 0.5 { 0.0 } else { -0.0 };
        }
        let ray = Ray::new(rng.point() * 0.7, direction.normalize());
        let expected = scan.closest(&ray, Interval::positive(), &mut ());
        hit_count += u32::from(expected.is_some());
        for (kind, other) in &others {
            assert_eq!(
                other.closest(&ray, Interval::positive(), &mut ()),
                expected,
                "{kind:?} {ray:?}"
            );
        }
    }
    assert!(
        (500..2000).contains(&hit_count),
        "{hit_count} rays met something"
    );
}

/// Protects: a mesh refused for one of its triangles leaves none of its triangles behind, and takes
/// no id.
#[test]
fn refused_meshes_leave_nothing() {
    let at = |x: f32| {
        [
            Vec3::new(x, 0.0, 0.0),
            Vec3::new(x + 1.0, 0.0, 0.0),
            Vec3::new(x, 1.0, 0.0),
        ]
    };
    let mut group = PrimitiveSet::<f32>::default();
    assert_eq!(
        group.add_mesh([at(0.0), at(f32::NAN)], Visibility::default()),
        Err(GeometryError::NotFinite)
    );
    assert_eq!(
        (group.len(), group.object_count(), group.triangles().len()),
        (0, 0, 0)
    );
    assert_eq!(group.add_mesh([at(5.0)], Visibility::default()), Ok(0));
    let geometry = Geometry::new(group, AcceleratorKind::default());
    let closest_hit = |x: f32| {
        geometry.closest(
            &Ray::new(Vec3::new(x, 0.2, 1.0), Vec3::NEG_Z),
            Interval::positive(),
            &mut (),
        )
    };
    assert!(
        closest_hit(0.2).is_none()
            && closest_hit(5.2).is_some_and(|hit| (hit.object, hit.primitive) == (0, 0))
    );
}

/// Protects: both precisions agree on an easy case, so that neither is connected to the wrong
/// formulas.
#[test]
fn precisions_agree() {
    fn distance<R: Real>() -> f64 {
        use raywright_bvh::Vector;
        let v = |x: f64, y: f64, z: f64| R::Vec3::from_f64(DVec3::new(x, y, z));
        let mut group = PrimitiveSet::<R>::default();
        group
            .add_sphere(
                Sphere {
                    centre: v(0.0, 0.0, 0.0),
                    radius: R::from_f64(1.0),
                },
                Visibility::default(),
            )
            .unwrap();
        let geometry = Geometry::new(group, AcceleratorKind::default());
        geometry
            .closest(
                &Ray::new(v(0.5, 0.0, 3.0), v(0.0, 0.0, -1.0)),
                Interval::positive(),
                &mut (),
            )
            .unwrap()
            .t
            .to_f64()
    }
    let exact = 3.0 - 0.75_f64.sqrt();
    assert!((distance::<f32>() - exact).abs() < 1e-6);
    assert!((distance::<f64>() - exact).abs() < 1e-15);
}

/// Protects: a third level of instances, whose hits could not be located, is refused.
#[test]
fn instances_of_instances_are_refused() {
    let mut middle = PrimitiveSet::<f32>::default();
    let leaf = middle
        .add_part(Geometry::new(
            triangles(&mut QueryRng(3), 5),
            AcceleratorKind::default(),
        ))
        .unwrap();
    middle
        .add_instance(leaf, DAffine3::IDENTITY, Visibility::default())
        .unwrap();
    let mut outer = PrimitiveSet::default();
    assert_eq!(
        outer.add_part(Geometry::new(middle, AcceleratorKind::default())),
        Err(GeometryError::NestedInstance)
    );
    assert_eq!(
        outer.add_instance(0, DAffine3::IDENTITY, Visibility::default()),
        Err(GeometryError::UnknownPart)
    );
    assert!(outer.is_empty());
}

/// Protects: a hit shortens the remaining range. Of a row of spheres along a ray the first is hit;
/// the others are neither tested nor reached, except those in the same leaf of eight: by the tree,
/// for either order of insertion, in the outer set and inside an instance.
#[test]
fn nothing_behind_a_hit_is_looked_at() {
    const LEVELS: u32 = 6;
    const COUNT: usize = 4_usize.pow(LEVELS);
    let row = |backwards: bool| {
        let mut group = PrimitiveSet::<f32>::default();
        for i in 0..COUNT {
            let index = if backwards { COUNT - i } else { i + 1 };
            group
                .add_sphere(
                    Sphere {
                        centre: Vec3::X * (3.0 * index as f32),
                        radius: 1.0,
                    },
                    Visibility::default(),
                )
                .unwrap();
        }
        group
    };
    let shown = |kind: AcceleratorKind, backwards: bool, instanced: bool| {
        let geometry = Geometry::new(row(backwards), kind);
        if !instanced {
            return geometry;
        }
        let mut group = PrimitiveSet::<f32>::default();
        let part = group.add_part(geometry).unwrap();
        group
            .add_instance(part, halved(), Visibility::default())
            .unwrap();
        Geometry::new(group, AcceleratorKind::Linear)
    };
    for (kind, backwards) in kinds().flat_map(|kind| [(kind, false), (kind, true)]) {
        for instanced in [false, true] {
            let (geometry, mut stats) =
                (shown(kind, backwards, instanced), TraversalStats::default());
            let hit = geometry
                .closest(
                    &Ray::new(Vec3::ZERO, Vec3::X),
                    Interval::positive(),
                    &mut stats,
                )
                .expect("a row");
            let nearest = if backwards { COUNT - 1 } else { 0 };
            assert_eq!(hit.object as usize, nearest, "{kind:?}");
            let message =
                format!("{kind:?}, backwards {backwards}, instanced {instanced}: {stats:?}");
            // An instance counts as a primitive.
            let tested = stats.primitives - u64::from(instanced);
            assert!(
                stats.nodes <= 2 * u64::from(LEVELS) && tested <= 8,
                "{message}"
            );
        }
    }
}
