//! Every kernel of the tree gives the hits of the scan, bit for bit, and no closed mesh leaks in
//! any kernel.

mod edge_on;
mod meshes;
mod packets;
mod rows;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use raywright_bvh::shapes::Sphere;
use raywright_bvh::{
    AcceleratorKind, BuildQuality, Geometry, Hit, Interval, Kernel, Occlusion, PrimitiveSet, Ray,
    Side, TraversalStats, Visibility,
};

use self::meshes::{MeshRng, TriangleSoup, families, range, ray};

/// Objects of a few triangles each, with every kind of visibility, and optionally spheres between
/// them.
fn group(mesh: &TriangleSoup, balls: bool) -> PrimitiveSet<f32> {
    let mut group = PrimitiveSet::default();
    for (i, part) in mesh.chunks(5).enumerate() {
        let side = [Side::Both, Side::Culled, Side::Outside, Side::Inside][i % 4];
        let occlusion = [Occlusion::Filtered, Occlusion::Opaque, Occlusion::None][i % 3];
        group
            .add_mesh(part.iter().copied(), Visibility { side, occlusion })
            .unwrap();
        if balls && i % 6 == 0 {
            let radius = (part[0][1] - part[0][0]).length();
            group
                .add_sphere(
                    Sphere {
                        centre: part[0][0],
                        radius,
                    },
                    Visibility { side, occlusion },
                )
                .unwrap();
        }
    }
    group
}

/// The hit with all numbers as bits.
fn bits(hit: Option<Hit<f32>>) -> Option<([u32; 3], [u32; 3])> {
    hit.map(|hit| ([hit.t, hit.u, hit.v].map(f32::to_bits), hit.tie_order()))
}

/// All hits passed to an any-hit filter, sorted, and whether an opaque object ended the query.
fn closest_hits(
    geometry: &Geometry<f32>,
    ray: &Ray<f32>,
    range: Interval<f32>,
) -> (bool, Vec<[u32; 3]>) {
    let mut hits = Vec::new();
    let ended = geometry.occluded(
        ray,
        range,
        &mut |hit| {
            hits.push(hit.tie_order());
            false
        },
        &mut (),
    );
    // Which hits precede an opaque object depends on the order of traversal.
    if ended {
        hits.clear();
    }
    hits.sort_unstable();
    (ended, hits)
}

/// Protects: every kernel gives the hits of the scan, bit for bit: for needles, edge-on slivers,
/// duplicates, points, exact hits of corners and edges, very small and very large objects, and all
/// of these together; along axes with zeros of either sign; with ranges that begin before the ray
/// or end at the hit.
#[test]
fn t20_kernels_find_what_the_scan_finds() {
    for ((name, mesh), balls) in families()
        .into_iter()
        .zip([false, true].into_iter().cycle())
    {
        let scan = Geometry::new(group(&mesh, balls), AcceleratorKind::Linear);
        for quality in BuildQuality::ALL {
            let mut tree = Geometry::new(group(&mesh, balls), AcceleratorKind::Tree(quality));
            assert!(tree.kernel().is_some(), "{name}");
            for kernel in Kernel::available() {
                tree.set_kernel(kernel);
                let rng = &mut MeshRng(11);
                let mut hits = 0;
                for i in 0..1500 {
                    let ray = Ray {
                        is_camera_ray: i % 3 == 0,
                        ..ray(rng, &mesh)
                    };
                    let label = format!("{name}, {quality:?}, {kernel:?}, ray {i}: {ray:?}");
                    let min = [0.0, f32::NEG_INFINITY][i % 2];
                    let all = Interval {
                        min,
                        max: f32::INFINITY,
                    };
                    let first = scan.closest(&ray, all, &mut ());
                    assert_eq!(
                        bits(tree.closest(&ray, all, &mut ())),
                        bits(first),
                        "{label}"
                    );
                    hits += usize::from(first.is_some());
                    let range = range(rng, first.map(|hit| hit.t));
                    let expected = bits(scan.closest(&ray, range, &mut ()));
                    assert_eq!(
                        bits(tree.closest(&ray, range, &mut ())),
                        expected,
                        "{label}, {range:?}"
                    );
                    assert_eq!(
                        closest_hits(&tree, &ray, range),
                        closest_hits(&scan, &ray, range),
                        "{label}, {range:?}"
                    );
                }
                assert!(hits > 300, "{name}: {hits} of 1500 rays hit anything");
            }
        }
    }
}

/// Maps of an instance: a translation, a rotation with flattening and reflection, a large
/// translation, and a small scale far away.
fn maps() -> [DAffine3; 4] {
    let turned = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0);
    let flat = DMat3::from_diagonal(DVec3::new(1.0, 1e-3, -2.0));
    let at = |matrix3: DMat3, translation: DVec3| DAffine3 {
        matrix3,
        translation,
    };
    [
        at(DMat3::IDENTITY, DVec3::X * 0.5),
        at(turned * flat, DVec3::ONE),
        at(turned, DVec3::new(1e6, -3e5, 2e4)),
        at(turned * 1e-4, DVec3::new(100.0, 0.0, -30.0)),
    ]
}

/// Protects: every kernel gives the hits of a scan inside an instance, bit for bit, under any map:
/// the ray is rounded once more there, and no hit may be lost by it.
#[test]
fn t20_instances_show_what_the_scan_finds() {
    let mut all = 0;
    for ((name, mesh), balls) in families()
        .into_iter()
        .zip([true, false].into_iter().cycle())
    {
        for (index, map) in maps().into_iter().enumerate() {
            let shown = |kind: AcceleratorKind| {
                let mut outer = PrimitiveSet::<f32>::default();
                let part = outer
                    .add_part(Geometry::new(group(&mesh, balls), kind))
                    .unwrap();
                let visibility = Visibility {
                    occlusion: Occlusion::Filtered,
                    ..Visibility::default()
                };
                outer
                    .add_instance(part, map, visibility)
                    .ok()
                    .map(|_| Geometry::new(outer, AcceleratorKind::Linear))
            };
            // A map that exceeds the range of f32 is refused.
            let Some(scan) = shown(AcceleratorKind::Linear) else {
                continue;
            };
            let mut tree = shown(AcceleratorKind::default()).unwrap();
            for kernel in Kernel::available() {
                tree.set_kernel(kernel);
                let rng = &mut MeshRng(17);
                for i in 0..400 {
                    let there = ray(rng, &mesh);
                    let origin = map.transform_point3(there.origin.as_dvec3());
                    let direction = map
                        .transform_vector3(there.direction.as_dvec3())
                        .normalize_or(DVec3::X);
                    let ray = Ray::new(origin.as_vec3(), direction.as_vec3());
                    let label = format!("{name}, map {index}, {kernel:?}, ray {i}: {ray:?}");
                    let min = [0.0, f32::NEG_INFINITY][i % 2];
                    let whole_range = Interval {
                        min,
                        max: f32::INFINITY,
                    };
                    let first = scan.closest(&ray, whole_range, &mut ());
                    assert_eq!(
                        bits(tree.closest(&ray, whole_range, &mut ())),
                        bits(first),
                        "{label}"
                    );
                    all += usize::from(first.is_some());
                    let range = range(rng, first.map(|hit| hit.t));
                    let expected = bits(scan.closest(&ray, range, &mut ()));
                    assert_eq!(
                        bits(tree.closest(&ray, range, &mut ())),
                        expected,
                        "{label}, {range:?}"
                    );
                    assert_eq!(
                        closest_hits(&tree, &ray, range),
                        closest_hits(&scan, &ray, range),
                        "{label}, {range:?}"
                    );
                }
            }
        }
    }
    assert!(all > 10_000, "{all} hits");
}

/// An octahedron with its faces subdivided into four `times` times and projected onto a sphere.
fn globe(times: usize) -> TriangleSoup {
    let mut faces = TriangleSoup::new();
    for octant in 0..8_usize {
        let sign = |bit: usize| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
        faces.push([Vec3::X * sign(0), Vec3::Y * sign(1), Vec3::Z * sign(2)]);
    }
    for _ in 0..times {
        let divided = faces.iter().flat_map(|&[a, b, c]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        faces = divided.collect();
    }
    faces
}

/// Protects: no ray from inside a closed mesh at a corner or edge leaves the mesh, in any kernel,
/// near the origin and far from it, by either query.
#[test]
fn p21_closed_meshes_do_not_leak() {
    for offset in [Vec3::ZERO, Vec3::new(1000.0, -200.0, 30.0)] {
        let mesh: TriangleSoup = globe(5)
            .into_iter()
            .map(|face| face.map(|p| p + offset))
            .collect();
        let mut group = PrimitiveSet::<f32>::default();
        group
            .add_mesh(mesh.iter().copied(), Visibility::default())
            .unwrap();
        let mut tree = Geometry::new(group, AcceleratorKind::default());
        for kernel in Kernel::available() {
            tree.set_kernel(kernel);
            let rng = &mut MeshRng(3);
            let mut leaks = 0;
            for i in 0..100_000 {
                let [a, b, _] = mesh[rng.below(mesh.len())];
                let target = if i % 2 == 0 { a } else { a.lerp(b, rng.unit()) };
                let origin = offset + rng.point() * 0.5;
                let ray = Ray::new(origin, (target - origin).as_dvec3().normalize().as_vec3());
                let is_hit = tree.closest(&ray, Interval::positive(), &mut ()).is_some();
                let blocked = tree.occluded(&ray, Interval::positive(), &mut |_| false, &mut ());
                leaks += usize::from(!is_hit) + usize::from(!blocked);
            }
            assert_eq!(leaks, 0, "{kernel:?} at {offset}");
        }
    }
}

/// Protects: the filter separates small triangles in a large scene: with a ground a thousand
/// kilometres wide, rays test at most a few times as many triangles as without it.
#[test]
fn a_wide_ground_does_not_blind_the_filter() {
    let rng = &mut MeshRng(1);
    let small: TriangleSoup = globe(4)
        .into_iter()
        .map(|face| face.map(|p| p * 0.01))
        .collect();
    let ground = [
        Vec3::new(-1e6, -0.011, -1e6),
        Vec3::new(1e6, -0.011, -1e6),
        Vec3::new(0.0, -0.011, 1e6),
    ];
    let visits = |mesh: &mut dyn Iterator<Item = [Vec3; 3]>, rng: &mut MeshRng| {
        let mut group = PrimitiveSet::<f32>::default();
        group.add_mesh(mesh, Visibility::default()).unwrap();
        let (tree, mut stats) = (
            Geometry::new(group, AcceleratorKind::default()),
            TraversalStats::default(),
        );
        for _ in 0..500 {
            let origin = rng.point().normalize() * 0.03;
            let direction = (rng.point() * 0.01 - origin).normalize();
            tree.closest(
                &Ray::new(origin, direction),
                Interval::positive(),
                &mut stats,
            );
        }
        stats
    };
    let alone = visits(&mut small.iter().copied(), &mut MeshRng(2));
    let both = visits(&mut small.iter().copied().chain([ground]), &mut MeshRng(2));
    let _ = rng.unit();
    assert!(
        both.nodes <= 2 * alone.nodes && both.primitives <= 2 * alone.primitives + 5000,
        "{both:?} against {alone:?}"
    );
}

/// Protects: a direction may have any length whose inverse f32 holds. Where its products might
/// leave the range of f32, and just before, no kernel's filter rejects a triangle that the scan
/// hits. Distances scale by the power of two and keep their bits.
#[test]
fn t05_directions_may_have_any_length() {
    for (name, mesh) in families() {
        let scan = Geometry::new(group(&mesh, false), AcceleratorKind::Linear);
        let mut tree = Geometry::new(group(&mesh, false), AcceleratorKind::default());
        for kernel in Kernel::available() {
            tree.set_kernel(kernel);
            let rng = &mut MeshRng(12);
            for exponent in [
                -100, -64, -63, -40, -21, -20, -19, 19, 20, 21, 40, 62, 63, 64, 100,
            ] {
                for _ in 0..60 {
                    let straight: Ray<f32> = ray(rng, &mesh);
                    let ray =
                        Ray::new(straight.origin, straight.direction * 2.0_f32.powi(exponent));
                    // Below that length box tests are undefined: a component whose inverse
                    // overflows f32 would count as zero.
                    if straight.direction.to_array().iter().any(|&d: &f32| {
                        d != 0.0 && (1.0 / (d * 2.0_f32.powi(exponent))).is_infinite()
                    }) {
                        continue;
                    }
                    let all = Interval {
                        min: 0.0,
                        max: f32::INFINITY,
                    };
                    let hit = |geometry: &Geometry<f32>| bits(geometry.closest(&ray, all, &mut ()));
                    assert_eq!(
                        hit(&tree),
                        hit(&scan),
                        "{name}, {kernel:?}, 2^{exponent}: {ray:?}"
                    );
                    assert_eq!(
                        closest_hits(&tree, &ray, all),
                        closest_hits(&scan, &ray, all),
                        "{name}, {kernel:?}, 2^{exponent}: {ray:?}"
                    );
                }
            }
        }
    }
}

/// Protects: traversal by rays with NaN, or without direction, ends, and hits nothing that the scan
/// does not.
#[test]
fn t18_rays_that_are_none_end() {
    let mesh = globe(2);
    let scan = Geometry::new(group(&mesh, true), AcceleratorKind::Linear);
    let mut tree = Geometry::new(group(&mesh, true), AcceleratorKind::default());
    let odd = [
        0.0,
        -0.0,
        1.0,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        1e-45,
    ];
    for kernel in Kernel::available() {
        tree.set_kernel(kernel);
        for (a, b) in odd.into_iter().flat_map(|a| odd.map(|b| (a, b))) {
            for ray in [
                Ray::new(Vec3::splat(a), Vec3::new(b, 0.0, 0.0)),
                Ray::new(Vec3::ZERO, Vec3::new(a, b, 1.0)),
            ] {
                let hit = |geometry: &Geometry<f32>| {
                    bits(geometry.closest(&ray, Interval::positive(), &mut ()))
                };
                assert_eq!(hit(&tree), hit(&scan), "{kernel:?} {ray:?}");
            }
        }
    }
}
