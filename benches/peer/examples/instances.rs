//! Rays through many instances of one mesh, beside Embree if it is available: CPU time in turns,
//! and whether hits agree. Such scenes spend most time on rays that enter a part.
//!
//! ```sh
//! EMBREE_LIB=libembree4.so.4 cargo run --release -p raywright-peer --example instances -- 10000 [MESH] [REPEATS]
//! ```
//!
//! MESH is a file of the harness of ray kernels (`benches/README.md`); the default is a sphere of
//! 1280 triangles. Without `EMBREE_LIB` only this library runs, so that instructions can be counted
//! (`ONLY=camera`, or another kind, traces only rays of that kind).
#![expect(unsafe_code, reason = "the C interface of another library")]
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "instances/embree.rs"]
mod embree;
#[expect(dead_code, reason = "rays are made here")]
#[path = "../../../crates/bvh/examples/files/mod.rs"]
mod files;
#[path = "../../../crates/bvh/tests/split_mix.rs"]
mod split_mix;

use core::f32::consts::{PI, TAU};

use glam::{Affine3A, DAffine3, DMat3, Quat, Vec3};
use raywright_bvh::{AcceleratorKind, Geometry, Interval, PrimitiveSet, Ray, Visibility};

use embree::Embree;

type InstanceMesh = Vec<[Vec3; 3]>;
/// Distance, instance and triangle of a hit.
type InstanceHit = Option<(f32, u32, u32)>;

/// A seeded generator, so that every run has the same scene.
struct InstanceRng(u64);

impl InstanceRng {
    fn unit(&mut self) -> f32 {
        (split_mix::step(&mut self.0) >> 40) as f32 / (1 << 24) as f32
    }
    fn direction(&mut self) -> Vec3 {
        let (z, angle) = (2.0 * self.unit() - 1.0, TAU * self.unit());
        let radius = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
    }
}

/// A sphere of radius one.
fn ball() -> InstanceMesh {
    let (around, down) = (40_u32, 17_u32);
    let corner = |i: u32, j: u32| {
        let (a, b) = (
            (i % around) as f32 / around as f32 * TAU,
            j as f32 / down as f32 * PI,
        );
        Vec3::new(b.sin() * a.cos(), b.cos(), b.sin() * a.sin())
    };
    let squares = (0..around).flat_map(|i| (0..down).map(move |j| (i, j)));
    let halves = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [
            corner(i, j),
            corner(i + 1, j),
            corner(i + 1, j + 1),
            corner(i, j + 1),
        ];
        [[a, b, c], [a, c, d]]
    });
    halves
        .filter(|[a, b, c]| a != b && b != c && a != c)
        .collect()
}

/// The mesh scaled into the cube [−1, 1]³.
fn within_one(mesh: InstanceMesh) -> InstanceMesh {
    let corners = || mesh.iter().flatten();
    let least = corners().fold(Vec3::INFINITY, |all, p| all.min(*p));
    let most = corners().fold(Vec3::NEG_INFINITY, |all, p| all.max(*p));
    let (centre, size) = ((least + most) * 0.5, (most - least).max_element() * 0.5);
    mesh.iter()
        .map(|corners| corners.map(|p| (p - centre) / size))
        .collect()
}

/// Maps of `count` instances on a square, rotated and scaled randomly, at distances of three.
fn transforms(count: usize) -> Vec<Affine3A> {
    let (rng, side) = (&mut InstanceRng(7), (count as f32).sqrt().ceil() as usize);
    let mut one = |i: usize| {
        let at = Vec3::new((i % side) as f32, 0.0, (i / side) as f32) * 3.0;
        let at = at + Vec3::new(rng.unit(), rng.unit(), rng.unit());
        let turned = Quat::from_axis_angle(rng.direction(), TAU * rng.unit());
        Affine3A::from_scale_rotation_translation(Vec3::splat(0.5 + rng.unit()), turned, at)
    };
    (0..count).map(&mut one).collect()
}

fn geometry(mesh: &InstanceMesh, maps: &[Affine3A]) -> Geometry<f32> {
    let (mut part, mut scene) = (PrimitiveSet::default(), PrimitiveSet::default());
    let refused = |e| panic!("{e}");
    part.add_mesh(mesh.iter().copied(), Visibility::default())
        .unwrap_or_else(refused);
    let part = scene
        .add_part(Geometry::new(part, AcceleratorKind::default()))
        .unwrap_or_else(refused);
    for map in maps {
        let [x, y, z] =
            [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(|v| v.as_dvec3());
        let map = DAffine3 {
            matrix3: DMat3::from_cols(x, y, z),
            translation: map.translation.as_dvec3(),
        };
        scene
            .add_instance(part, map, Visibility::default())
            .unwrap_or_else(refused);
    }
    Geometry::new(scene, AcceleratorKind::default())
}

/// Rays of a pinhole camera above a corner of the square, scanline by scanline.
fn camera_rays(count: usize, side: usize) -> Vec<Ray<f32>> {
    let reach = (count as f32).sqrt() * 3.0;
    let (eye, to) = (
        Vec3::new(-0.1 * reach - 4.0, 0.25 * reach + 3.0, -0.1 * reach - 4.0),
        Vec3::new(0.45 * reach, 0.0, 0.45 * reach),
    );
    let ahead = (to - eye).normalize();
    let right = ahead.cross(Vec3::Y).normalize();
    let up = right.cross(ahead);
    let at = |i: usize| 2.0 * (i as f32 + 0.5) / side as f32 - 1.0;
    let ray = |i: usize| {
        Ray::new(
            eye,
            (ahead + 0.4 * (right * at(i % side) - up * at(i / side))).normalize(),
        )
    };
    (0..side * side).map(ray).collect()
}

/// For each hit, a cosine-distributed ray, and a ray to a distant light or to the sky.
fn later_rays(scene: &Geometry<f32>, rays: &[Ray<f32>]) -> [Vec<Ray<f32>>; 2] {
    let (rng, mut bounced, mut shadow) = (&mut InstanceRng(3), Vec::new(), Vec::new());
    for ray in rays {
        let Some(hit) = scene.closest(ray, Interval::positive(), &mut ()) else {
            continue;
        };
        let normal = scene.surface(ray, &hit).normal;
        let normal = if normal.dot(ray.direction) > 0.0 {
            -normal
        } else {
            normal
        };
        let start = ray.at(hit.t) + normal * 1e-3;
        bounced.push(Ray::new(
            start,
            (normal + rng.direction() * 0.999).normalize(),
        ));
        let sun = Vec3::new(0.4, 0.5, -0.3).normalize();
        let to = if bounced.len() % 2 == 0 && sun.dot(normal) > 0.0 {
            sun
        } else {
            (normal + rng.direction() * 0.999).normalize()
        };
        shadow.push(Ray::new(start, to));
    }
    [bounced, shadow]
}

/// CPU seconds of this thread.
fn seconds() -> f64 {
    #[repr(C)]
    struct Time(i64, i64);
    unsafe extern "C" {
        fn clock_gettime(clock: i32, time: *mut Time) -> i32;
    }
    let mut time = Time(0, 0);
    // SAFETY: `time` is large enough; 3 is the clock of the calling thread on Linux.
    unsafe { clock_gettime(3, &mut time) };
    time.0 as f64 + time.1 as f64 * 1e-9
}

fn ours(scene: &Geometry<f32>, ray: &Ray<f32>, any: bool) -> InstanceHit {
    if any {
        return scene
            .occluded(ray, Interval::positive(), &mut |_| true, &mut ())
            .then_some((0.0, 0, 0));
    }
    scene
        .closest(ray, Interval::positive(), &mut ())
        .map(|hit| (hit.t, hit.instance, hit.primitive))
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let count = words
        .first()
        .and_then(|word| word.parse::<f64>().ok())
        .map_or(10_000, |count| count as usize);
    let mesh = within_one(
        words
            .get(1)
            .filter(|word| word.as_str() != "ball")
            .map_or_else(ball, |file| files::read_mesh(file)),
    );
    let repeats = words.get(2).and_then(|word| word.parse().ok()).unwrap_or(7);
    let side = words
        .get(3)
        .and_then(|word| word.parse().ok())
        .unwrap_or(512);
    let maps = transforms(count);
    let scene = geometry(&mesh, &maps);
    let peer = std::env::var("EMBREE_LIB")
        .ok()
        .map(|file| Embree::new(&file, &mesh, &maps));
    let rays = camera_rays(count, side);
    let [bounced, shadow] = later_rays(&scene, &rays);
    let only = std::env::var("ONLY").ok();
    println!("{count} instances of {} triangles", mesh.len());
    for (name, rays, any) in [
        ("camera", &rays, false),
        ("bounced", &bounced, false),
        ("shadow", &shadow, true),
    ] {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let (mut times, mut differ, mut hits) = ([Vec::new(), Vec::new()], 0, 0);
        for _ in 0..repeats {
            let start = seconds();
            let own: Vec<InstanceHit> = rays.iter().map(|ray| ours(&scene, ray, any)).collect();
            times[0].push(seconds() - start);
            hits = own.iter().flatten().count();
            let Some(peer) = &peer else { continue };
            let start = seconds();
            let other: Vec<InstanceHit> = rays.iter().map(|ray| peer.ask(ray, any)).collect();
            times[1].push(seconds() - start);
            let same = |a: &InstanceHit, b: &InstanceHit| match (a, b) {
                (Some(a), Some(b)) => (a.0 - b.0).abs() <= 1e-3 * a.0,
                (a, b) => a.is_none() == b.is_none(),
            };
            differ = own.iter().zip(&other).filter(|(a, b)| !same(a, b)).count();
        }
        let [own, other] = times.map(|mut times| {
            times.sort_by(f64::total_cmp);
            [times.first(), times.get(times.len() / 2)]
                .map(|time| time.map_or(f64::NAN, |time| time / rays.len() as f64 * 1e9))
        });
        println!(
            "{name}: {} rays, {hits} hits, {differ} differ; ns a ray, least and median: ours {:.0} {:.0}, Embree {:.0} {:.0}; its time over ours {:.2} {:.2}",
            rays.len(),
            own[0],
            own[1],
            other[0],
            other[1],
            other[0] / own[0],
            other[1] / own[1]
        );
    }
}
