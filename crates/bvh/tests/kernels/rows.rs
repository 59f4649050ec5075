//! Rows of spheres and planes, and leaves of spheres, alone and beside triangles and other shapes,
//! compared with a scan that tests primitives one by one.

use glam::{DAffine3, DVec3, Vec3};
use raywright_bvh::shapes::{AnyShape, Cuboid, Disk, Plane, Quad, Sphere};
use raywright_bvh::{
    AcceleratorKind, BuildQuality, Geometry, Hit, Interval, Kernel, Occlusion, PacketBackoff,
    PrimitiveSet, Ray, RayPacket, Side, Visibility,
};

use super::meshes::{MeshRng, range};
use super::{bits, closest_hits};

/// Numbers of spheres, planes, triangles, disks, quads and boxes.
const SETS: [[usize; 6]; 16] = [
    [1, 0, 0, 0, 0, 0],
    [5, 1, 0, 0, 0, 0],
    [8, 0, 0, 0, 0, 0],
    [9, 9, 0, 0, 0, 0],
    [0, 1, 0, 0, 0, 0],
    [0, 3, 11, 0, 0, 0],
    [3, 0, 5, 1, 0, 0],
    [0, 0, 0, 1, 0, 0],
    [40, 2, 20, 1, 0, 0],
    [100, 1, 0, 0, 0, 0],
    [6, 1, 300, 4, 0, 0],
    [400, 10, 0, 0, 0, 0],
    [0, 0, 0, 0, 9, 0],
    [0, 1, 0, 0, 300, 2],
    [0, 0, 3, 0, 2, 90],
    [120, 0, 120, 5, 120, 40],
];

/// Arrangements of spheres: scattered, nested, coincident, of very mixed sizes, very small, very
/// large, and far from the origin.
const FAMILIES: [(&str, f32, f32, f32); 8] = [
    ("scattered", 1.0, 0.4, 0.0),
    ("nested", 0.01, 1.0, 0.0),
    ("in one place", 0.0, 1.0, 0.0),
    ("of all sizes", 1.0, -1.0, 0.0),
    ("of micrometres", 1e-6, 0.4e-6, 0.0),
    ("of gigametres", 1e9, 0.4e9, 0.0),
    ("far from the origin", 1.0, 0.4, 1e4),
    ("of no size", 1.0, 0.0, 0.0),
];

fn visibility(i: usize) -> Visibility {
    let side = [
        Side::Both,
        Side::Outside,
        Side::Inside,
        Side::Culled,
        Side::Outside,
        Side::Inside,
    ][i % 6];
    let occlusion = [
        Occlusion::Filtered,
        Occlusion::Filtered,
        Occlusion::Opaque,
        Occlusion::None,
    ][i / 3 % 4];
    Visibility { side, occlusion }
}

/// The set, and spheres as targets of rays.
fn group(
    [spheres, planes, triangles, disks, quads, boxes]: [usize; 6],
    (_, spread, size, away): (&str, f32, f32, f32),
) -> (PrimitiveSet<f32>, Vec<Sphere<f32>>) {
    let (rng, mut group, mut aims) = (&mut MeshRng(3), PrimitiveSet::default(), vec![]);
    let unit = spread.max(size);
    // Kinds alternate, so that object order differs from row order.
    for i in 0..spheres
        .max(planes)
        .max(triangles)
        .max(disks)
        .max(quads)
        .max(boxes)
    {
        let centre = rng.point() * spread + away;
        let radius = if size < 0.0 {
            1e-9_f32.powf(rng.unit())
        } else {
            size * (0.1 + rng.unit())
        };
        if i < disks {
            let disk = Disk::new(
                centre.as_dvec3(),
                rng.point().as_dvec3().normalize(),
                f64::from(unit),
            );
            group
                .add_shape(AnyShape::Disk(disk), visibility(i + 1))
                .unwrap();
        }
        if i < triangles {
            let corner = |rng: &mut MeshRng| centre + rng.point() * unit;
            let corners = [corner(rng), corner(rng), corner(rng)];
            group.add_mesh([corners], visibility(i + 2)).unwrap();
        }
        if i < planes {
            let normal = if i.is_multiple_of(2) {
                Vec3::Y
            } else {
                rng.point().normalize()
            };
            group
                .add_plane(Plane::new(centre, normal), visibility(i))
                .unwrap();
        }
        if i < boxes {
            let half = (rng.point().abs() * size.abs() + unit * 0.01).as_dvec3();
            group
                .add_shape(
                    Cuboid::new(centre.as_dvec3() - half, centre.as_dvec3() + half).into(),
                    visibility(i),
                )
                .unwrap();
            aims.push(Sphere {
                centre,
                radius: half.max_element() as f32,
            });
        }
        if i < quads {
            let quad = quad(rng, i, centre, size.abs());
            group.add_shape(quad.into(), visibility(i)).unwrap();
            let [a, b, c, d] = quad.corners;
            // A corner, an edge, the diagonal between both halves, and any point.
            let target = [
                a,
                a.lerp(b, 0.3),
                a.lerp(c, 0.6),
                d.lerp(a.lerp(b, rng.unit()), rng.unit()),
            ][rng.below(4)];
            aims.push(Sphere {
                centre: target,
                radius: unit * [1e-7, 0.01][rng.below(2)],
            });
        }
        if i < spheres {
            group
                .add_sphere(Sphere { centre, radius }, visibility(i))
                .unwrap();
            aims.push(Sphere { centre, radius });
        }
        if aims.is_empty() {
            aims.push(Sphere {
                centre,
                radius: unit,
            });
        }
    }
    (group, aims)
}

/// A parallelogram: every other one is axis-aligned; some have no area, some are a point.
fn quad(rng: &mut MeshRng, i: usize, corner: Vec3, size: f32) -> Quad<f32> {
    let edge = |rng: &mut MeshRng| (rng.point() * size).as_dvec3();
    let (u, v) = match i % 12 {
        0 => (DVec3::ZERO, DVec3::ZERO),
        1 => (edge(rng), DVec3::ZERO),
        2 => (DVec3::Y * f64::from(size), DVec3::Y * f64::from(size)),
        3..7 => (DVec3::X * edge(rng), DVec3::Z * edge(rng)),
        _ => (edge(rng), edge(rng)),
    };
    Quad::new(corner.as_dvec3(), u, v)
}

/// A ray at a sphere: at any point, just past its silhouette, from inside, from nearby, and from so
/// far that the sphere's test uses another formula. Some rays lie along axes or in axis-aligned
/// planes, some have the spheres behind them, and some are not of unit length.
fn ray(rng: &mut MeshRng, aims: &[Sphere<f32>]) -> Ray<f32> {
    let Sphere { centre, radius } = aims[rng.below(aims.len())];
    let mut direction = rng.point();
    match rng.below(6) {
        0 => direction *= [Vec3::X, -Vec3::Y, Vec3::Z][rng.below(3)],
        1 => direction *= [Vec3::new(1.0, -0.0, 1.0), Vec3::new(0.0, 1.0, 1.0)][rng.below(2)],
        _ => {}
    }
    let direction = direction.as_dvec3().normalize_or(DVec3::X);
    let across = rng
        .point()
        .as_dvec3()
        .cross(direction)
        .normalize_or(DVec3::ZERO);
    let beside = match rng.below(3) {
        0 => f64::from(rng.unit()),
        1 => 1.0 + 1e-7 * f64::from(rng.unit() - 0.5),
        _ => 1.0,
    };
    let away = [0.3, 3.0, 1e3, 2e3, 1e6][rng.below(5)] * f64::from(radius);
    let ahead = if rng.below(5) == 0 { -1.0 } else { 1.0 };
    let origin =
        centre.as_dvec3() + across * (f64::from(radius) * beside) - direction * (away * ahead);
    let length = [1.0, 1.0, 1.0, 1e-3, 1e5][rng.below(5)];
    Ray::new(origin.as_vec3(), (direction * length).as_vec3())
}

fn agree(
    name: &str,
    scan: &Geometry<f32>,
    rows: &mut Geometry<f32>,
    aims: &[Sphere<f32>],
    map: DAffine3,
) -> usize {
    let mut hits = 0;
    for kernel in Kernel::available() {
        rows.set_kernel(kernel);
        let rng = &mut MeshRng(23);
        for i in 0..300 {
            let there = ray(rng, aims);
            let to_world = |p: DVec3| map.transform_point3(p).as_vec3();
            let direction = map.transform_vector3(there.direction.as_dvec3()).as_vec3();
            let ray = Ray {
                is_camera_ray: i % 4 == 1,
                ..Ray::new(to_world(there.origin.as_dvec3()), direction)
            };
            let label = format!("{name}, {kernel:?}, ray {i}: {ray:?}");
            let all = Interval {
                min: [0.0, f32::NEG_INFINITY][i % 2],
                max: f32::INFINITY,
            };
            let first = scan.closest(&ray, all, &mut ());
            assert_eq!(
                bits(rows.closest(&ray, all, &mut ())),
                bits(first),
                "{label}"
            );
            hits += usize::from(first.is_some());
            let range = range(rng, first.map(|hit| hit.t));
            assert_eq!(
                bits(rows.closest(&ray, range, &mut ())),
                bits(scan.closest(&ray, range, &mut ())),
                "{label}, {range:?}"
            );
            assert_eq!(
                closest_hits(rows, &ray, range),
                closest_hits(scan, &ray, range),
                "{label}, {range:?}"
            );
        }
    }
    hits
}

/// Protects: rows give the bits of single tests in every kernel: distances, the flag for leaving a
/// solid, ties, sides and calls of the filter; for few primitives without nodes, for many beside a
/// tree, and inside an instance.
#[test]
fn t20_rows_find_what_the_scan_finds() {
    let mut hits = 0;
    let turned = DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0)
        * DAffine3::from_scale(DVec3::new(2.0, -0.5, 1.0));
    for (set, family) in SETS
        .into_iter()
        .flat_map(|set| FAMILIES.map(|family| (set, family)))
    {
        let (one, aims) = group(set, family);
        let name = format!("{set:?} {}", family.0);
        let built = |kind: AcceleratorKind| Geometry::new(one.clone(), kind);
        let (scan, mut rows) = (
            built(AcceleratorKind::Linear),
            built(AcceleratorKind::default()),
        );
        assert!(rows.kernel().is_some(), "{name}");
        hits += agree(&name, &scan, &mut rows, &aims, DAffine3::IDENTITY);
        let shown = |kind: AcceleratorKind| {
            let mut outer = PrimitiveSet::<f32>::default();
            let part = outer.add_part(built(kind)).unwrap();
            let shown = outer.add_instance(
                part,
                turned,
                Visibility {
                    occlusion: Occlusion::Filtered,
                    ..Visibility::default()
                },
            );
            shown
                .ok()
                .map(|_| Geometry::new(outer, AcceleratorKind::Linear))
        };
        if let (Some(scan), Some(mut rows)) = (
            shown(AcceleratorKind::Linear),
            shown(AcceleratorKind::default()),
        ) {
            hits += agree(&format!("{name}, shown"), &scan, &mut rows, &aims, turned);
        }
    }
    assert!(hits > 30_000, "{hits} hits");
}

/// Protects: trees of each build quality give the hits of the scan for spheres and quads among many
/// slivers.
#[test]
fn leaves_are_the_same_in_every_quality() {
    for family in FAMILIES {
        let (mut one, aims) = group([200, 1, 40, 3, 200, 9], family);
        // Slivers that lie across the axes.
        let (rng, size) = (&mut MeshRng(7), family.1.max(family.2));
        let sliver = |_| {
            let (a, along) = (rng.point() * size + family.3, rng.point() * size);
            [a, a + along, a + along * 0.5 + rng.point() * (size * 0.01)]
        };
        one.add_mesh(
            (0..if family == FAMILIES[0] { 4000 } else { 100 }).map(sliver),
            visibility(0),
        )
        .unwrap();
        let scan = Geometry::new(one.clone(), AcceleratorKind::Linear);
        for quality in BuildQuality::ALL {
            let mut tree = Geometry::new(one.clone(), AcceleratorKind::Tree(quality));
            let hits = agree(
                &format!("{quality:?} {}", family.0),
                &scan,
                &mut tree,
                &aims,
                DAffine3::IDENTITY,
            );
            assert!(hits > 100, "{}: {hits} hits", family.0);
        }
    }
}

/// Protects: the same hits for so many primitives that threads build the tree in pieces. Spheres
/// share leaves: with a box for each the tree would take more memory, 88 bytes per sphere. Each
/// quad has a box.
#[test]
fn leaves_of_many_are_shared() {
    let thin = ("scattered", 1.0, 0.02, 0.0);
    for (set, maximum) in [
        ([9000, 0, 0, 0, 0, 0], 80),
        ([0, 0, 0, 0, 9000, 0], 170),
        ([9000, 2, 0, 0, 9000, 0], 200),
    ] {
        let (one, aims) = group(set, thin);
        let count = one.len();
        let (scan, mut tree) = (
            Geometry::new(one.clone(), AcceleratorKind::Linear),
            Geometry::new(one, AcceleratorKind::default()),
        );
        assert!(
            tree.memory_bytes() < count * maximum,
            "{} bytes each",
            tree.memory_bytes() / count
        );
        let hits = agree(
            &format!("{set:?}"),
            &scan,
            &mut tree,
            &aims,
            DAffine3::IDENTITY,
        );
        assert!(hits > 100, "{set:?}: {hits} hits");
    }
}

/// Protects: packets find in these leaves what each ray finds alone.
#[test]
fn packets_equal_single_rays_in_leaves() {
    for family in FAMILIES {
        let (one, aims) = group([60, 1, 20, 2, 60, 3], family);
        let (rng, mut found_hits, mut hits) = (&mut MeshRng(5), vec![], 0);
        let mut tree = Geometry::new(one, AcceleratorKind::default());
        for kernel in Kernel::available() {
            tree.set_kernel(kernel);
            for i in 0..150 {
                let first = ray(rng, &aims);
                let width = first.direction.length() * [1e-6, 1e-3, 0.1][rng.below(3)];
                let directions: Vec<Vec3> = (0..16)
                    .map(|_| first.direction + rng.point() * width)
                    .collect();
                let t = tree
                    .closest(&first, Interval::positive(), &mut ())
                    .map(|hit| hit.t);
                let range = range(rng, t);
                let requested = RayPacket {
                    origin: first.origin,
                    directions: &directions,
                    time: 0.0,
                    culls: i % 2 == 0,
                    range,
                };
                tree.closest_of_packet(&requested, &mut PacketBackoff::default(), &mut found_hits);
                for (&direction, hit) in directions.iter().zip(&found_hits) {
                    let alone = tree.closest(
                        &Ray {
                            is_camera_ray: requested.culls,
                            ..Ray::new(first.origin, direction)
                        },
                        range,
                        &mut (),
                    );
                    assert_eq!(
                        bits(*hit),
                        bits(alone),
                        "{}, {kernel:?}: {direction} {requested:?}",
                        family.0
                    );
                    hits += usize::from(alone.is_some());
                }
            }
        }
        assert!(hits > 300, "{}: {hits} hits", family.0);
    }
}

/// Protects: queries of an empty set and of a single plane.
#[test]
fn nothing_and_next_to_nothing() {
    let down = Ray::new(Vec3::Y, Vec3::NEG_Y);
    let empty = Geometry::<f32>::new(PrimitiveSet::default(), AcceleratorKind::default());
    assert_eq!(empty.closest(&down, Interval::positive(), &mut ()), None);
    assert!(!empty.occluded(&down, Interval::positive(), &mut |_| true, &mut ()));
    let mut group = PrimitiveSet::<f32>::default();
    group
        .add_plane(Plane::new(Vec3::ZERO, Vec3::Y), Visibility::default())
        .unwrap();
    let plane = Geometry::new(group, AcceleratorKind::default());
    assert_eq!(
        plane
            .closest(&down, Interval::positive(), &mut ())
            .map(|hit| hit.t),
        Some(1.0)
    );
    assert!(plane.occluded(&down, Interval::positive(), &mut |_| false, &mut ()));
}

/// Protects: a tangent ray hits a sphere at the point of contact, where its discriminant is exactly
/// zero; compared with the closed form, in every kernel, by single rays and packets.
#[test]
fn rays_that_touch_hit() {
    let mut group = PrimitiveSet::<f32>::default();
    for i in 0..8_u8 {
        let centre = Vec3::X * 10.0 * f32::from(i);
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
    let mut rows = Geometry::new(group, AcceleratorKind::default());
    assert!(rows.build_work().is_some_and(|work| work.depth == 0));
    let origin = Vec3::new(-5.0, 1.0, 0.0);
    for kernel in Kernel::available() {
        rows.set_kernel(kernel);
        for (i, t) in (0..8_u8).map(|i| (u32::from(i), 5.0 + 10.0 * f32::from(i))) {
            let range = Interval {
                min: t - 1.0,
                max: f32::INFINITY,
            };
            let hit = |hit: Option<Hit<f32>>| hit.map(|hit| (hit.t, hit.object));
            assert_eq!(
                hit(rows.closest(&Ray::new(origin, Vec3::X), range, &mut ())),
                Some((t, i)),
                "{kernel:?}"
            );
            let mut together = vec![];
            let requested = RayPacket {
                origin,
                directions: &[Vec3::X, Vec3::NEG_X, Vec3::X],
                time: 0.0,
                culls: false,
                range,
            };
            rows.closest_of_packet(&requested, &mut PacketBackoff::default(), &mut together);
            let together: Vec<_> = together.into_iter().map(hit).collect();
            assert_eq!(together, [Some((t, i)), None, Some((t, i))], "{kernel:?}");
        }
    }
}
