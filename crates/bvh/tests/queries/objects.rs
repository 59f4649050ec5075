//! Objects: ids of hits, occlusion, and memory.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use raywright_bvh::shapes::{
    AnyShape, Cuboid, Cylinder, Disk, Plane, Quad, Sphere, TransformedShape, Triangle,
};
use raywright_bvh::{
    AcceleratorKind, Geometry, GeometryError, Hit, Interval, Occlusion, PrimitiveSet, Ray,
    Visibility,
};

use super::{QueryRng, halved, kinds, triangles};

fn disk() -> AnyShape<f32> {
    Disk::new(DVec3::ZERO, DVec3::Y, 1.0).into()
}

/// Protects: the reported bytes include every kind of primitive: each takes its own size and the
/// size of a slot.
#[test]
fn bytes_count_every_primitive() {
    let ball = Sphere {
        centre: Vec3::ZERO,
        radius: 1.0,
    };
    let more = |add: &dyn Fn(&mut PrimitiveSet<f32>) -> Result<u32, GeometryError>| {
        let bytes = |count: usize| {
            let mut group = PrimitiveSet::default();
            assert!((0..count).all(|_| add(&mut group).is_ok()));
            Geometry::new(group, AcceleratorKind::Linear).memory_bytes()
        };
        bytes(9) - bytes(8)
    };
    let own = [
        more(&|g| g.add_sphere(ball, Visibility::default())) - size_of::<Sphere<f32>>(),
        more(&|g| g.add_triangle([Vec3::ZERO, Vec3::X, Vec3::Y], Visibility::default()))
            - size_of::<Triangle<f32>>(),
        more(&|g| g.add_plane(Plane::new(Vec3::ZERO, Vec3::Y), Visibility::default()))
            - size_of::<Plane<f32>>(),
        more(&|g| g.add_shape(disk(), Visibility::default())) - size_of::<AnyShape<f32>>(),
        more(&|g| g.add_transformed_shape(disk(), halved(), Visibility::default()))
            - size_of::<TransformedShape<f32>>(),
    ];
    // Common to all: a slot with object, primitive, flags and an index.
    assert!(own == [16; 5], "{own:?}");
    // An instance has at least the numbers of a map and of the inverse of its linear part. Its part
    // is not counted again.
    let instance = |count: usize| {
        let shown = Geometry::new(triangles(&mut QueryRng(1), count), AcceleratorKind::Linear);
        more(&|g| {
            if g.is_empty() {
                g.add_part(shown.clone())?;
            }
            g.add_instance(0, halved(), Visibility::default())
        })
    };
    assert!(
        instance(1) > own[0] + (12 + 9) * size_of::<f64>() && instance(1) == instance(100),
        "{}",
        instance(1)
    );
}

/// Name of a kind, and a function that adds one across a ray down the y axis.
type AddPrimitive<'a> = (
    &'static str,
    &'a dyn Fn(&mut PrimitiveSet<f32>, Visibility) -> Result<u32, GeometryError>,
);

/// Protects: a primitive of any kind occludes rays that reach beyond it; without occlusion it is
/// visible and occludes none. Alone, and among others that the ray misses.
#[test]
fn every_kind_casts_its_shadow() {
    let ball = Sphere {
        centre: Vec3::ZERO,
        radius: 1.0,
    };
    let leaf = [
        Vec3::new(-1.0, 0.0, -1.0),
        Vec3::new(1.0, 0.0, -1.0),
        Vec3::new(0.0, 0.0, 1.0),
    ];
    let pipe = || AnyShape::from(Cylinder::new(DVec3::ZERO, DVec3::X, 1.0, None, false));
    let all: [AddPrimitive<'_>; 8] = [
        ("sphere", &|g, v| g.add_sphere(ball, v)),
        ("triangle", &|g, v| g.add_triangle(leaf, v)),
        ("plane", &|g, v| {
            g.add_plane(Plane::new(Vec3::ZERO, Vec3::Y), v)
        }),
        ("disk", &|g, v| g.add_shape(disk(), v)),
        ("infinite cylinder", &|g, v| g.add_shape(pipe(), v)),
        ("mapped disk", &|g, v| {
            g.add_transformed_shape(disk(), halved(), v)
        }),
        ("mapped infinite cylinder", &|g, v| {
            g.add_transformed_shape(pipe(), halved(), v)
        }),
        ("instance", &|g, v| {
            let mut inner = PrimitiveSet::default();
            inner.add_shape(disk(), Visibility::default())?;
            let inner = g.add_part(Geometry::new(inner, AcceleratorKind::default()))?;
            g.add_instance(inner, halved(), v)
        }),
    ];
    let ray = Ray::new(Vec3::Y * 3.0, Vec3::NEG_Y);
    let beings = [Occlusion::Opaque, Occlusion::Filtered, Occlusion::None];
    for ((name, add), others, occlusion) in all.iter().flat_map(|adding| {
        [0, 40]
            .into_iter()
            .flat_map(move |n| beings.map(|being| (adding, n, being)))
    }) {
        for kind in kinds().chain([AcceleratorKind::Linear]) {
            let mut group = PrimitiveSet::<f32>::default();
            for i in 0..others {
                group
                    .add_sphere(
                        Sphere {
                            centre: Vec3::X * (5.0 + 3.0 * i as f32),
                            radius: 1.0,
                        },
                        Visibility::default(),
                    )
                    .unwrap();
            }
            let id = add(
                &mut group,
                Visibility {
                    occlusion,
                    ..Visibility::default()
                },
            )
            .unwrap();
            let geometry = Geometry::new(group, kind);
            let message = format!("{name} among {others}, {kind:?}, {occlusion:?}");
            let hit = geometry
                .closest(&ray, Interval::positive(), &mut ())
                .expect(&message);
            assert_eq!(hit.outermost_id(), id, "{message}");
            for (max, reached) in [(f32::INFINITY, true), (hit.t * 0.99, false)] {
                let hidden =
                    geometry.occluded(&ray, Interval { min: 0.0, max }, &mut |_| true, &mut ());
                assert_eq!(
                    hidden,
                    occlusion != Occlusion::None && reached,
                    "{message} up to {max}"
                );
            }
        }
    }
}

/// Protects: unbounded shapes of a part are hit through its instances at any distance from all
/// bounded shapes, by closest and any-hit queries, alone in the part and beside a sphere.
#[test]
fn unbounded_shapes_are_hit_through_instances() {
    let pipe = || {
        AnyShape::from(Cylinder::new(
            DVec3::NEG_Y,
            DVec3::new(1.0, 0.0, 1.0),
            1.0,
            None,
            false,
        ))
    };
    let endless: [AddPrimitive<'_>; 2] = [
        ("plane", &|g, v| {
            g.add_plane(Plane::new(Vec3::ZERO, Vec3::Y), v)
        }),
        ("infinite cylinder", &|g, v| g.add_shape(pipe(), v)),
    ];
    let (start, map) = (
        Vec3::new(500.0, 3.0, 500.0),
        DAffine3::from_translation(DVec3::Y * -5.0) * halved(),
    );
    for ((name, add), beside, kind) in endless.iter().flat_map(|e| {
        [false, true]
            .into_iter()
            .flat_map(move |b| kinds().map(move |kind| (e, b, kind)))
    }) {
        let mut inner = PrimitiveSet::default();
        if beside {
            inner
                .add_sphere(
                    Sphere {
                        centre: Vec3::ZERO,
                        radius: 1.0,
                    },
                    Visibility::default(),
                )
                .unwrap();
        }
        add(&mut inner, Visibility::default()).unwrap();
        let mut group = triangles(&mut QueryRng(7), 40);
        let part = group.add_part(Geometry::new(inner, kind)).unwrap();
        let instance = group
            .add_instance(part, map, Visibility::default())
            .unwrap();
        let (geometry, ray) = (Geometry::new(group, kind), Ray::new(start, Vec3::NEG_Y));
        let message = format!("{name}, beside a ball {beside}, {kind:?}");
        let hit = geometry
            .closest(&ray, Interval::positive(), &mut ())
            .expect(&message);
        assert!(
            hit.instance == instance && (hit.t - 8.0).abs() < 1e-5,
            "{message}: {hit:?}"
        );
        for (max, hidden) in [(f32::INFINITY, true), (7.9, false)] {
            assert_eq!(
                geometry.occluded(&ray, Interval { min: 0.0, max }, &mut |_| false, &mut ()),
                hidden,
                "{message} up to {max}"
            );
        }
    }
}

/// Protects: an opaque object ends a query without a call of the filter, an `Filtered` object is
/// passed hit by hit, and an object without occlusion is ignored; for an instance, its own
/// occlusion decides.
#[test]
fn occlusion_belongs_to_objects() {
    let flat = |z: f32| {
        [
            Vec3::new(-4.0, -4.0, z),
            Vec3::new(4.0, -4.0, z),
            Vec3::new(0.0, 4.0, z),
        ]
    };
    let being = |occlusion| Visibility {
        occlusion,
        ..Visibility::default()
    };
    let all = [Occlusion::None, Occlusion::Opaque, Occlusion::Filtered];
    for (own, instanced) in all
        .into_iter()
        .flat_map(|own| all.map(|instanced| (own, instanced)))
    {
        for kind in [AcceleratorKind::Linear, AcceleratorKind::default()] {
            let mut inner = PrimitiveSet::<f32>::default();
            inner
                .add_mesh([flat(3.0), flat(4.0)], being(Occlusion::None))
                .unwrap();
            let mut group = PrimitiveSet::<f32>::default();
            let part = group.add_part(Geometry::new(inner, kind)).unwrap();
            group.add_mesh([flat(1.0), flat(2.0)], being(own)).unwrap();
            group
                .add_instance(part, DAffine3::IDENTITY, being(instanced))
                .unwrap();
            let geometry = Geometry::new(group, kind);
            let mut requested = Vec::new();
            let mut ask = |hit: &Hit<f32>| {
                requested.push((hit.outermost_id(), hit.t));
                false
            };
            let found = geometry.occluded(
                &Ray::new(Vec3::ZERO, Vec3::Z),
                Interval::positive(),
                &mut ask,
                &mut (),
            );
            requested.sort_by(|a, b| a.1.total_cmp(&b.1));
            assert_eq!(
                found,
                own == Occlusion::Opaque || instanced == Occlusion::Opaque,
                "{own:?} {instanced:?}"
            );
            if !found {
                let shown = |occlusion, hits| {
                    if occlusion == Occlusion::Filtered {
                        hits
                    } else {
                        Vec::new()
                    }
                };
                let expected = [
                    shown(own, vec![(0, 1.0), (0, 2.0)]),
                    shown(instanced, vec![(1, 3.0), (1, 4.0)]),
                ]
                .concat();
                assert_eq!(requested, expected, "{own:?} {instanced:?}");
            }
        }
    }
}

/// Protects: a hit identifies its object, the object's primitive and the instance, for any order of
/// insertion and any order of the tree.
#[test]
fn hits_name_their_objects() {
    let at = |x: f32, z: f32| {
        [
            Vec3::new(x, 0.0, z),
            Vec3::new(x + 0.5, 0.0, z),
            Vec3::new(x, 0.5, z),
        ]
    };
    let row = |x: f32| (0..5).map(move |i| at(x, 5.0 - i as f32));
    for kind in kinds().chain([AcceleratorKind::Linear]) {
        let mut inner = PrimitiveSet::<f32>::default();
        inner.add_mesh(row(0.0), Visibility::default()).unwrap();
        inner.add_mesh(row(1.0), Visibility::default()).unwrap();
        let mut group = PrimitiveSet::<f32>::default();
        group.add_mesh(row(10.0), Visibility::default()).unwrap();
        group.add_mesh([], Visibility::default()).unwrap();
        let ball = group
            .add_sphere(
                Sphere {
                    centre: Vec3::new(-3.0, 0.0, 0.0),
                    radius: 1.0,
                },
                Visibility::default(),
            )
            .unwrap();
        let part = group.add_part(Geometry::new(inner, kind)).unwrap();
        let moved = DAffine3::from_translation(DVec3::new(20.0, 0.0, 0.0));
        let instance = group
            .add_instance(part, moved, Visibility::default())
            .unwrap();
        let last = group.add_mesh(row(30.0), Visibility::default()).unwrap();
        assert_eq!(
            (ball, instance, last, group.object_count(), group.len()),
            (2, 3, 4, 5, 12)
        );
        let geometry = Geometry::new(group, kind);
        let name = |x: f32, z: f32| {
            let ray = Ray::new(Vec3::new(x, 0.1, z + 0.5), Vec3::NEG_Z);
            let hit = geometry
                .closest(&ray, Interval::positive(), &mut ())
                .unwrap();
            (hit.instance, hit.object, hit.primitive)
        };
        let none = Hit::<f32>::NO_INSTANCE;
        for i in 0..5 {
            let z = 5.0 - i as f32;
            assert_eq!(name(10.1, z), (none, 0, i), "{kind:?}");
            assert_eq!(name(20.1, z), (instance, 0, i), "{kind:?}");
            assert_eq!(name(21.1, z), (instance, 1, i), "{kind:?}");
            assert_eq!(name(30.1, z), (none, last, i), "{kind:?}");
        }
        assert_eq!(name(-3.0, 3.0), (none, ball, 0), "{kind:?}");
    }
}

/// Protects: ties are decided by the outermost object, then by the object within the instanced
/// part, then by the primitive.
#[test]
fn the_outermost_object_decides_first() {
    let mut inner = PrimitiveSet::<f32>::default();
    for x in [0.0, 1.0] {
        let at = |i: usize| {
            [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5)].map(|(u, v)| Vec3::new(x + u, v, -(i as f32)))
        };
        inner
            .add_mesh((0..2).map(at), Visibility::default())
            .unwrap();
    }
    let mut group = PrimitiveSet::<f32>::default();
    let part = group
        .add_part(Geometry::new(inner, AcceleratorKind::Linear))
        .unwrap();
    for x in [0.0, 10.0] {
        group
            .add_instance(
                part,
                DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)),
                Visibility::default(),
            )
            .unwrap();
    }
    let geometry = Geometry::new(group, AcceleratorKind::Linear);
    let order = |x: f32, behind: f32| {
        let ray = Ray::new(Vec3::new(x, 0.1, 0.5 - behind), Vec3::NEG_Z);
        geometry
            .closest(&ray, Interval::positive(), &mut ())
            .unwrap()
            .tie_order()
    };
    let found = [
        (0.1, 0.0),
        (0.1, 1.0),
        (1.1, 0.0),
        (1.1, 1.0),
        (10.1, 0.0),
        (11.1, 1.0),
    ]
    .map(|(x, behind)| order(x, behind));
    assert_eq!(
        found,
        [
            [0, 0, 0],
            [0, 0, 1],
            [0, 1, 0],
            [0, 1, 1],
            [1, 0, 0],
            [1, 1, 1]
        ]
    );
    assert!(found.is_sorted());
}

/// Protects: dp/du is returned in world space, through an instance's map.
#[test]
fn coordinates_of_instances_run_in_the_world() {
    let mut inner = PrimitiveSet::<f32>::default();
    let quad = Quad::new(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0);
    inner
        .add_shape(AnyShape::Quad(quad), Visibility::default())
        .unwrap();
    let mut group = PrimitiveSet::<f32>::default();
    let part = group
        .add_part(Geometry::new(inner, AcceleratorKind::Linear))
        .unwrap();
    // Maps x to 3y and y to −x.
    let turn = DMat3::from_cols(DVec3::Y * 3.0, -DVec3::X, DVec3::Z);
    group
        .add_instance(part, DAffine3::from_mat3(turn), Visibility::default())
        .unwrap();
    let geometry = Geometry::new(group, AcceleratorKind::Linear);
    let ray = Ray::new(Vec3::new(-0.5, 1.5, 1.0), Vec3::NEG_Z);
    let hit = geometry
        .closest(&ray, Interval::positive(), &mut ())
        .unwrap();
    let parameters = geometry.texture_coordinates(&ray, &hit);
    assert_eq!(parameters.dpdu, Vec3::new(0.0, 6.0, 0.0));
    assert!((parameters.u - 0.25).abs() < 1e-6, "{}", parameters.u);
}

/// Protects: if surfaces of different shapes coincide, the first object is hit in f64 too, where
/// each test has other last digits, by a scan and by trees; a surface nearer by more than rounding
/// is hit first, for any length of the direction.
#[test]
fn the_first_of_coincident_objects_is_hit() {
    let face = Quad {
        corners: [
            DVec3::new(-1.0, 0.0, -1.0),
            DVec3::new(-1.0, 0.0, 1.0),
            DVec3::new(1.0, 0.0, 1.0),
            DVec3::new(1.0, 0.0, -1.0),
        ],
    };
    let body = Cuboid::new(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, 0.0, 1.0));
    let shapes: [AnyShape<f64>; 4] = [
        face.into(),
        Disk::new(DVec3::ZERO, DVec3::Y, 1.0).into(),
        body.into(),
        face.into(),
    ];
    let eye = DVec3::new(1.0, 2.0, 3.0);
    for (kind, turn) in kinds()
        .chain([AcceleratorKind::Linear])
        .flat_map(|kind| (0..4).map(move |turn| (kind, turn)))
    {
        let mut group = PrimitiveSet::<f64>::default();
        for i in 0..4 {
            group
                .add_shape(shapes[(turn + i) % 4], Visibility::default())
                .unwrap();
        }
        let above = group
            .add_shape(
                Disk::new(DVec3::Y * 1e-9, DVec3::Y, 0.1).into(),
                Visibility::default(),
            )
            .unwrap();
        let (geometry, rng) = (Geometry::new(group, kind), &mut QueryRng(3));
        for _ in 0..2000 {
            let [x, z] = [rng.unit(), rng.unit()].map(|unit| f64::from(unit) * 1.2 - 0.6);
            let target = DVec3::new(x, 0.0, z);
            let expected = if target.length() < 0.1 { above } else { 0 };
            for length in [1.0, 1e10, 1e-10] {
                let hit = geometry.closest(
                    &Ray::new(eye, (target - eye).normalize() * length),
                    Interval::positive(),
                    &mut (),
                );
                assert_eq!(
                    hit.map(|hit| hit.object),
                    Some(expected),
                    "{kind:?}, from {turn} on, at {target}, {length} long"
                );
            }
        }
    }
}
