//! Checks that all accelerators find the same hits: kernels and builds of the eight-wide tree, the
//! tree in f64, and the linear scan. It also checks that closed meshes do not leak. The tests do
//! both for thousands of rays, this program for millions.
//!
//! ```sh
//! cargo run --release -p raywright-bvh --example agreement -- compare_trees 10000000 [MESH..]   # rays a mesh
//! cargo run --release -p raywright-bvh --example agreement -- compare_with_scan 100000000000 [MESH..] # rays times triangles, in all
//! cargo run --release -p raywright-bvh --example agreement -- count_leaks 1000000              # rays a batch
//! ```
//!
//! MESH is a mesh file: two u32, the numbers of corners and of triangles, then three f32 per corner
//! and three u32 per triangle, little endian. Without MESH, the hard meshes of the tests are used.
//! The exit code is 1 if any hit differs or a mesh leaks.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[expect(dead_code, reason = "`visits` reads rays too")]
mod files;
#[path = "../tests/kernels/meshes.rs"]
mod meshes;
#[path = "../tests/split_mix.rs"]
mod split_mix;

use std::cell::RefCell;
use std::collections::HashMap;
use std::process::ExitCode;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use raywright_bvh::shapes::Triangle;
use raywright_bvh::{
    AcceleratorKind, BuildQuality, Geometry, Hit, Interval, Kernel, PreparedRay, PrimitiveSet, Ray,
    Real, Shape, Side, Vector, Visibility,
};

use meshes::{MeshRng, TriangleSoup, families, range, ray};

/// Number of rays of each parallel task.
const TASK_RAYS: u64 = 4096;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let count = words
        .get(1)
        .and_then(|word| word.parse::<f64>().ok())
        .map_or(1_000_000, |count| count as u64);
    let wrong = match words.first().map(String::as_str) {
        Some("trees") => load_meshes(&words[2..])
            .iter()
            .map(|(name, mesh)| compare_trees(name, mesh, count))
            .sum(),
        Some("scan") => {
            let meshes = load_meshes(&words[2..]);
            let each = count / meshes.len().max(1) as u64;
            meshes
                .iter()
                .map(|(name, mesh)| compare_with_scan(name, mesh, each / mesh.len() as u64 + 1))
                .sum()
        }
        Some("leaks") => count_leaks(count),
        _ => {
            println!(
                "usage: agreement trees RAYS [MESH..] | agreement scan TESTS [MESH..] | agreement leaks RAYS"
            );
            return ExitCode::from(2);
        }
    };
    println!("{wrong} differences or leaks in total");
    if wrong == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Reads the meshes of files, or returns the hard meshes of the tests if `files` is empty.
fn load_meshes(files: &[String]) -> Vec<(String, TriangleSoup)> {
    if files.is_empty() {
        return families()
            .into_iter()
            .map(|(name, mesh)| (name.to_owned(), mesh))
            .collect();
    }
    files
        .iter()
        .map(|file| (file.clone(), files::read_mesh(file)))
        .collect()
}

fn build_geometry<R: Real>(mesh: &TriangleSoup, kind: AcceleratorKind) -> Geometry<R> {
    let mut group = PrimitiveSet::<R>::default();
    let corners = mesh
        .iter()
        .map(|corners| corners.map(|p| Vector::from_f64(p.as_dvec3())));
    group
        .add_mesh(corners, Visibility::default())
        .unwrap_or_else(|e| panic!("{e}"));
    Geometry::new(group, kind)
}

/// Sums counts over rays in parallel tasks, each with its own random numbers. `one` returns the
/// counts of a ray.
fn sum_over_rays<const N: usize>(
    count: u64,
    one: impl Fn(&mut MeshRng) -> [u64; N] + Sync,
) -> [u64; N] {
    let piece = |number: u64| {
        let rng = &mut MeshRng(number.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 77);
        (0..TASK_RAYS.min(count - number * TASK_RAYS)).fold([0; N], |sum, _| {
            let found = one(rng);
            core::array::from_fn(|i| sum[i] + found[i])
        })
    };
    let sum = |a: [u64; N], b: [u64; N]| core::array::from_fn(|i| a[i] + b[i]);
    (0..count.div_ceil(TASK_RAYS))
        .into_par_iter()
        .map(piece)
        .reduce(|| [0; N], sum)
}

type HitBits = Option<([u32; 3], u32)>;

fn hit_bits(hit: Option<Hit<f32>>) -> HitBits {
    hit.map(|hit| ([hit.t, hit.u, hit.v].map(f32::to_bits), hit.primitive))
}

/// Chooses a range of accepted distances: everything ahead of the ray, or a range whose end just
/// includes or just excludes the first hit.
fn choose_range(rng: &mut MeshRng, first: Option<Hit<f32>>) -> Interval<f32> {
    range(rng, first.map(|hit| hit.t))
}

/// Rounds a distance to f32, and also its neighbours that differ in the last digits of f64. At a
/// common corner of several triangles, the f64 tree returns the first triangle. Its distance may
/// have other last digits than the nearest triangle's, and these decide between two neighbours in
/// f32.
fn f32_candidates(t: f64) -> [f32; 3] {
    const LAST: f64 = 1.0 / (1_u64 << 44) as f64;
    [t - t.abs() * LAST, t, t + t.abs() * LAST].map(Real::to_f32)
}

/// Compares the trees of every build quality and kernel with the tree in f64, whose distances are
/// rounded to f32 for the comparison. A hit of another triangle at the same rounded distance does
/// not count as a difference. Kernels and builds must agree to the bit.
fn compare_trees(name: &str, mesh: &TriangleSoup, count: u64) -> u64 {
    let exact = build_geometry::<f64>(mesh, AcceleratorKind::default());
    let mut all: Vec<(BuildQuality, Kernel, Geometry<f32>)> = Vec::new();
    for quality in BuildQuality::ALL {
        let tree = build_geometry::<f32>(mesh, AcceleratorKind::Tree(quality));
        for kernel in Kernel::available() {
            let mut tree = tree.clone();
            tree.set_kernel(kernel);
            all.push((quality, kernel, tree));
        }
    }
    let [hits, exactly, between, any] = sum_over_rays(count, |rng| {
        let ray = ray(rng, mesh);
        let range = Interval {
            min: 0.0,
            max: f32::INFINITY,
        };
        let first = all[0].2.closest(&ray, range, &mut ());
        let wide = Ray::new(ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let closest = exact.closest(
            &wide,
            Interval {
                min: 0.0,
                max: f64::INFINITY,
            },
            &mut (),
        );
        let differs = match (first, closest) {
            (Some(first), Some(closest)) => !f32_candidates(closest.t).contains(&first.t),
            (first, closest) => first.is_some() != closest.is_some(),
        };
        let part = choose_range(rng, first);
        let ended = |tree: &Geometry<f32>| tree.occluded(&ray, part, &mut |_| true, &mut ());
        let expected = (
            hit_bits(first),
            hit_bits(all[0].2.closest(&ray, part, &mut ())),
        );
        let (mut between, mut any) = (0, 0);
        for (_, _, tree) in &all {
            let found = (
                hit_bits(tree.closest(&ray, range, &mut ())),
                hit_bits(tree.closest(&ray, part, &mut ())),
            );
            between += u64::from(found != expected);
            any += u64::from(ended(tree) != expected.1.is_some());
        }
        [u64::from(first.is_some()), u64::from(differs), between, any]
    });
    println!(
        "{name}: {} triangles, {count} rays, {hits} hits, {} trees: {exactly} hits differ from f64, {between} differ between trees, {any} any-hit results differ",
        mesh.len(),
        all.len()
    );
    exactly + between + any
}

/// A mesh in the layout of [`compare_with_scan`]: each corner once, one array per coordinate.
struct MeshCorners {
    places: [Vec<f64>; 3],
    triangles: Vec<[u32; 3]>,
}

impl MeshCorners {
    fn new(mesh: &TriangleSoup) -> Self {
        let (mut known, mut places) = (HashMap::new(), [const { Vec::new() }; 3]);
        let mut number = |corner: Vec3| {
            *known
                .entry(corner.to_array().map(f32::to_bits))
                .or_insert_with(|| {
                    (0..3).for_each(|axis| places[axis].push(f64::from(corner[axis])));
                    places[0].len() as u32 - 1
                })
        };
        let triangles = mesh
            .iter()
            .map(|&corners| corners.map(&mut number))
            .collect();
        Self { places, triangles }
    }

    /// Collects the indices of the triangles that a line may hit, in ascending order. It omits only
    /// triangles that are certainly missed: the line is on one side of two edges and on the other
    /// side of the third, by more than the rounding of f64. It uses no tree, no box, and no f32.
    fn collect_hits(
        &self,
        ray: &Ray<f32>,
        [across, upwards]: &mut [Vec<f64>; 2],
        found: &mut Vec<u32>,
    ) {
        let d = ray.direction.as_dvec3().normalize_or_zero();
        let (side, up) = d.any_orthonormal_pair();
        let origin = ray.origin.as_dvec3();
        let mut maximum = 0.0_f64;
        let [xs, ys, zs] = &self.places;
        across.clear();
        upwards.clear();
        let part = |x: f64, y: f64, z: f64, v: DVec3| {
            (x - origin.x) * v.x + (y - origin.y) * v.y + (z - origin.z) * v.z
        };
        for ((&x, &y), &z) in xs.iter().zip(ys).zip(zs) {
            across.push(part(x, y, z, side));
            upwards.push(part(x, y, z, up));
            let size = (x - origin.x).abs() + (y - origin.y).abs() + (z - origin.z).abs();
            maximum = if size > maximum { size } else { maximum };
        }
        // A coordinate has an error of 8 w times the farthest corner's distance, with w = 2⁻⁵³,
        // including the rounding of the basis. An edge function has an error below 40 w times the
        // squared distance. The threshold is four times that bound.
        let unsure = maximum * maximum * (f64::EPSILON * 0.5 * 160.0);
        found.clear();
        for (number, &[a, b, c]) in (0..).zip(&self.triangles) {
            let at = |corner: u32| (across[corner as usize], upwards[corner as usize]);
            let edge = |(x, y): (f64, f64), (to_x, to_y): (f64, f64)| x * to_y - y * to_x;
            let (a, b, c) = (at(a), at(b), at(c));
            let (u, v, w) = (edge(b, c), edge(c, a), edge(a, b));
            let missed = (u.min(v).min(w) < -unsure) & (u.max(v).max(w) > unsure);
            if !missed {
                found.push(number);
            }
        }
    }
}

thread_local! {
    /// Buffers of a thread for the projected corners and the candidates of a scan.
    static ROOM: RefCell<([Vec<f64>; 2], Vec<u32>)> = RefCell::default();
}

/// Compares the default tree with a scan: every triangle that can't be ruled out goes through the
/// single-triangle test. [`MeshCorners::collect_hits`] makes the scan affordable, and shares no
/// code with the tree.
fn compare_with_scan(name: &str, mesh: &TriangleSoup, count: u64) -> u64 {
    let (tree, corners) = (
        build_geometry::<f32>(mesh, AcceleratorKind::default()),
        MeshCorners::new(mesh),
    );
    let scanned = |ray: &Ray<f32>, room: &mut [Vec<f64>; 2], found: &mut Vec<u32>| {
        corners.collect_hits(ray, room, found);
        let (prepared_ray, mut range, mut best) = (
            PreparedRay::new(*ray),
            Interval {
                min: 0.0,
                max: f32::INFINITY,
            },
            None,
        );
        for &number in &*found {
            let triangle = Triangle::<f32>::new(mesh[number as usize]);
            // At equal distance the first triangle wins.
            if let Some(hit) = triangle.intersect(&prepared_ray, range, Side::Both) {
                range.max = hit.t;
                best = Some(([hit.t, hit.u, hit.v].map(f32::to_bits), number));
            }
        }
        best
    };
    let [hits, tested, wrong] = sum_over_rays(count, |rng| {
        let ray = ray(rng, mesh);
        let whole_range = Interval {
            min: 0.0,
            max: f32::INFINITY,
        };
        ROOM.with_borrow_mut(|(room, found)| {
            let expected: HitBits = scanned(&ray, room, found);
            let differs = hit_bits(tree.closest(&ray, whole_range, &mut ())) != expected;
            [
                u64::from(expected.is_some()),
                found.len() as u64,
                u64::from(differs),
            ]
        })
    });
    println!(
        "{name}: {count} rays x {} triangles = {:.2e}, {tested} exact tests, {hits} hits, {wrong} hits differ from the scan",
        mesh.len(),
        count as f64 * mesh.len() as f64
    );
    wrong
}

/// Creates a closed room with walls divided into squares, and with sheets parallel to the walls
/// inside. All corners are jittered within their planes.
fn build_room_mesh(side: usize, position: Vec3, scale: f32) -> TriangleSoup {
    let mut mesh = TriangleSoup::new();
    let rng = &mut MeshRng(3);
    let levels: Vec<f32> = (0..=8).map(|i| i as f32 / 4.0 - 1.0).collect();
    for axis in 0..3 {
        for &level in &levels {
            // All sheets have the same jitter, and borders have none, so that walls share their
            // edges.
            let mut grid = vec![Vec3::ZERO; (side + 1) * (side + 1)];
            for (i, corner) in grid.iter_mut().enumerate() {
                let mut at = |i: usize| {
                    let inner = i > 0 && i < side;
                    (i as f32 + if inner { (rng.unit() - 0.5) * 0.6 } else { 0.0 }) / side as f32
                        * 2.0
                        - 1.0
                };
                let mut p = [level; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (at(i % (side + 1)), at(i / (side + 1)));
                // Corners on a border coincide with the corners of the adjacent wall.
                let border = i % (side + 1) == 0
                    || i % (side + 1) == side
                    || i / (side + 1) == 0
                    || i / (side + 1) == side;
                if border {
                    let even = |i: usize| i as f32 / side as f32 * 2.0 - 1.0;
                    (p[(axis + 1) % 3], p[(axis + 2) % 3]) =
                        (even(i % (side + 1)), even(i / (side + 1)));
                }
                *corner = Vec3::from_array(p) * scale + position;
            }
            for i in 0..side * side {
                let a = i / side * (side + 1) + i % side;
                let [a, b, c, d] = [a, a + 1, a + side + 2, a + side + 1].map(|i| grid[i]);
                mesh.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh
}

/// Traces rays from inside closed rooms: at corners, at edges, and along the sheets, whose
/// triangles they then see edge-on. Every ray must hit a triangle. Returns the number of rays that
/// do not.
fn count_leaks(count: u64) -> u64 {
    let rooms = [
        ("a room", Vec3::ZERO, 1.0),
        ("far away", Vec3::new(1e4, -3e3, 77.7), 1.0),
        ("of micrometres", Vec3::ZERO, 1e-6),
    ];
    let aims: [(&str, usize); 3] = [("corners", 0), ("edges", 1), ("edge-on", 2)];
    let mut wrong = 0;
    for (name, position, scale) in rooms {
        let mesh = build_room_mesh(16, position, scale);
        for quality in BuildQuality::ALL {
            let tree = build_geometry::<f32>(&mesh, AcceleratorKind::Tree(quality));
            for kernel in Kernel::available() {
                let mut tree = tree.clone();
                tree.set_kernel(kernel);
                for (aim_name, kind) in aims {
                    let [missed] = sum_over_rays(count, |rng| {
                        let inside = rng.point() * (0.9 * scale) + position;
                        let [a, b, c] = mesh[rng.below(mesh.len())];
                        let u = rng.unit();
                        let (origin, target) = match kind {
                            0 => (inside, a),
                            1 => (inside, a + (b - a) * u),
                            // From the centre of a sheet's triangle to a point of another triangle.
                            _ => {
                                let [d, e, f] = mesh[rng.below(mesh.len())];
                                let from = (d + e + f) / 3.0;
                                let flat = [0, 1, 2]
                                    .into_iter()
                                    .find(|&i| d[i] == e[i] && d[i] == f[i])
                                    .unwrap_or(0);
                                let mut to = a + (b - a) * (u * 0.5) + (c - a) * (rng.unit() * 0.5);
                                to[flat] = from[flat];
                                (from, to)
                            }
                        };
                        let direction = (target - origin)
                            .as_dvec3()
                            .normalize_or(glam::DVec3::X)
                            .as_vec3();
                        // A ray that starts on a wall may leave the room.
                        let within = |p: Vec3| ((p - position) / scale).abs().max_element() < 0.999;
                        let range = Interval {
                            min: 0.0,
                            max: f32::INFINITY,
                        };
                        let ray = Ray::new(origin, direction);
                        let hit = !within(origin) || tree.closest(&ray, range, &mut ()).is_some();
                        [u64::from(
                            !hit || within(origin)
                                && !tree.occluded(&ray, range, &mut |_| true, &mut ()),
                        )]
                    });
                    println!(
                        "{name}, {quality:?}, {kernel:?}, {aim_name}: {count} rays, {missed} of them leak"
                    );
                    wrong += missed;
                }
            }
        }
    }
    wrong
}
