//! Packets of rays find what each ray finds alone, bit for bit.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use raywright_bvh::shapes::{AnyShape, Disk, Plane, Sphere};
use raywright_bvh::{
    AcceleratorKind, Geometry, Interval, Kernel, Occlusion, PacketBackoff, PrimitiveSet, Ray,
    RayPacket, Real, Vector, Visibility,
};

use super::meshes::{MeshRng, TriangleSoup, families, range, ray};
use super::{bits, group};

/// Packet sizes: fewer than are traced together, one less than a vector, and more than a packet.
const COUNTS: [usize; 6] = [1, 4, 7, 16, 17, 40];

/// Times of packets: the ends of a motion, and two between.
const TIMES: [f32; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// Directions around a given direction: as close as samples of a pixel, as close as pixels, far
/// apart, to all sides, and all equal.
fn around(rng: &mut MeshRng, direction: Vec3, count: usize) -> Vec<Vec3> {
    let width = [1e-7, 1e-3, 0.05, 2.0, 0.0][rng.below(5)];
    let one = |rng: &mut MeshRng| direction + rng.point() * (width * direction.length());
    (0..count).map(|_| one(rng)).collect()
}

fn agree(
    name: &str,
    geometry: &mut Geometry<f32>,
    mesh: &TriangleSoup,
    scan: Option<&Geometry<f32>>,
) -> [usize; 2] {
    let mut all = [0; 2];
    for kernel in Kernel::available() {
        geometry.set_kernel(kernel);
        let (rng, mut hits) = (&mut MeshRng(31), vec![]);
        for i in 0..150 {
            let first = ray(rng, mesh);
            let directions = around(rng, first.direction, COUNTS[i % COUNTS.len()]);
            let t = geometry
                .closest(&first, Interval::positive(), &mut ())
                .map(|hit| hit.t);
            let range = if i % 3 == 0 {
                range(rng, t)
            } else {
                Interval {
                    min: [0.0, -1.0][i % 2],
                    max: f32::INFINITY,
                }
            };
            let requested = RayPacket {
                origin: first.origin,
                directions: &directions,
                time: TIMES[i % TIMES.len()],
                culls: i % 2 == 0,
                range,
            };
            geometry.closest_of_packet(&requested, &mut PacketBackoff::default(), &mut hits);
            assert_eq!(hits.len(), directions.len());
            for (&direction, hit) in directions.iter().zip(&hits) {
                let ray = Ray {
                    is_camera_ray: requested.culls,
                    ..Ray::new(first.origin, direction).with_time(requested.time)
                };
                let alone = scan.unwrap_or(geometry).closest(&ray, range, &mut ());
                assert_eq!(
                    bits(*hit),
                    bits(alone),
                    "{name}, {kernel:?}, {i}: {ray:?} {range:?}"
                );
                all[0] += usize::from(hit.is_some());
                all[1] += 1;
            }
        }
    }
    all
}

/// Protects: the hits of a packet have the bits of each ray's hit by a scan: for needles, edge-on
/// slivers, duplicates, exact hits of corners and edges, very small and very large objects; for
/// close, spread and equal directions; for ranges that begin before the rays or end at a hit; in
/// each kernel.
#[test]
fn together_is_as_alone() {
    let mut all = [0; 2];
    for ((name, mesh), balls) in families()
        .into_iter()
        .zip([false, true].into_iter().cycle())
    {
        let scan = Geometry::new(group(&mesh, balls), AcceleratorKind::Linear);
        let mut tree = Geometry::new(group(&mesh, balls), AcceleratorKind::default());
        let [hits, rays] = agree(name, &mut tree, &mesh, Some(&scan));
        all = [all[0] + hits, all[1] + rays];
    }
    assert!(all[0] > 10_000 && all[1] > all[0], "{all:?}");
}

/// An infinite plane, an infinite cylinder, spheres, disks, and a mesh instanced under two maps and
/// along two motions.
fn mixed<R: Real>(kind: AcceleratorKind, mesh: &TriangleSoup) -> Geometry<R> {
    let v = |p: Vec3| R::Vec3::from_f64(p.as_dvec3());
    let mut part = PrimitiveSet::<R>::default();
    part.add_mesh(
        mesh.iter().map(|corners| corners.map(v)),
        Visibility::default(),
    )
    .unwrap();
    let mut group = PrimitiveSet::<R>::default();
    let part = group.add_part(Geometry::new(part, kind)).unwrap();
    let ask = Visibility {
        occlusion: Occlusion::Filtered,
        ..Visibility::default()
    };
    for shift in [DVec3::ZERO, DVec3::new(0.3, -0.1, 0.2)] {
        group
            .add_instance(part, DAffine3::from_translation(shift), ask)
            .unwrap();
        let end = DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::new(0.8, 1.2, 1.0)),
            translation: DVec3::new(0.7, 0.3, -0.5) - shift,
        };
        group
            .add_moving_instance(part, [DAffine3::from_translation(shift), end], ask)
            .unwrap();
    }
    group
        .add_plane(
            Plane::new(v(Vec3::new(0.0, -0.4, 0.0)), v(Vec3::Y)),
            Visibility::default(),
        )
        .unwrap();
    for i in 0..12 {
        let point = Vec3::new(i as f32 / 6.0 - 1.0, 0.1, 0.2);
        group
            .add_sphere(
                Sphere {
                    centre: v(point),
                    radius: R::from_f32(0.1),
                },
                ask,
            )
            .unwrap();
        group
            .add_shape(
                AnyShape::Disk(Disk::new(point.as_dvec3(), DVec3::Z, 0.12)),
                ask,
            )
            .unwrap();
    }
    let endless = raywright_bvh::shapes::Cylinder {
        base: v(Vec3::ZERO),
        axis: v(Vec3::new(0.0, 0.0, 1.0)),
        radius: R::from_f32(0.05),
        ends: raywright_bvh::shapes::CylinderEnds::None,
    };
    group.add_shape(AnyShape::Cylinder(endless), ask).unwrap();
    Geometry::new(group, kind)
}

/// Protects: packets at planes, spheres, other shapes and instances, still and moving, at any time,
/// and in a precision without a wide tree.
#[test]
fn packets_at_shapes_and_instances() {
    let (_, mesh) = families().swap_remove(2);
    let mut tree = mixed::<f32>(AcceleratorKind::default(), &mesh);
    let scan = mixed::<f32>(AcceleratorKind::Linear, &mesh);
    let [hits, rays] = agree("mixed", &mut tree, &mesh, Some(&scan));
    assert!(2 * hits > rays, "{hits} of {rays}");
    let exact = mixed::<f64>(AcceleratorKind::default(), &mesh);
    let directions = [
        DVec3::X,
        DVec3::new(0.8, 0.6, 0.0),
        DVec3::Z,
        DVec3::NEG_Y,
        DVec3::Y,
    ];
    let requested = RayPacket {
        origin: DVec3::new(0.1, 0.2, 0.05),
        directions: &directions,
        time: 0.75,
        culls: false,
        range: Interval::positive(),
    };
    let mut hits = vec![None; 3];
    exact.closest_of_packet(&requested, &mut PacketBackoff::default(), &mut hits);
    let alone = |&d: &DVec3| {
        let ray = Ray::new(requested.origin, d).with_time(requested.time);
        exact.closest(&ray, requested.range, &mut ())
    };
    assert_eq!(hits, directions.iter().map(alone).collect::<Vec<_>>());
    assert!(hits.iter().flatten().count() > 1);
}

/// Protects: empty packets, and packets with NaN rays.
#[test]
fn empty_and_nan_packets() {
    let (_, mesh) = families().swap_remove(2);
    let tree = mixed::<f32>(AcceleratorKind::default(), &mesh);
    let mut hits = vec![None];
    let mut from = |directions: &[Vec3]| {
        let requested = RayPacket {
            origin: Vec3::X,
            directions,
            time: 0.0,
            culls: false,
            range: Interval::positive(),
        };
        tree.closest_of_packet(&requested, &mut PacketBackoff::default(), &mut hits);
        hits.len()
    };
    assert_eq!(from(&[]), 0);
    assert_eq!(from(&[Vec3::NAN; 20]), 20);
    assert_eq!(from(&[Vec3::ZERO; 16]), 16);
    assert_eq!(from(&[Vec3::splat(f32::INFINITY); 16]), 16);
}
