//! Meshes that are hard for a filter in f32, and rays that are hard for it to decide.

use glam::Vec3;
use raywright_bvh::{Interval, Ray};

use crate::split_mix::step;

/// A small seeded generator (SplitMix64), so that a failure can be repeated.
pub struct MeshRng(pub u64);

impl MeshRng {
    fn bits(&mut self) -> u64 {
        step(&mut self.0)
    }
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }
    pub fn below(&mut self, limit: usize) -> usize {
        (self.bits() % limit as u64) as usize
    }
    /// Uniform in the cube [−1, 1]³.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

pub type TriangleSoup = Vec<[Vec3; 3]>;

fn scattered(rng: &mut MeshRng, count: usize, size: f32) -> TriangleSoup {
    let mut one = || {
        let a = rng.point();
        [a, a + rng.point() * size, a + rng.point() * size]
    };
    (0..count).map(|_| one()).collect()
}

/// Slivers three hundred times as long as wide.
fn needles(rng: &mut MeshRng, count: usize) -> TriangleSoup {
    let mut one = || {
        let (a, along) = (rng.point(), rng.point());
        [a, a + along, a + along * 0.5 + rng.point() * 0.003]
    };
    (0..count).map(|_| one()).collect()
}

/// A rough terrain of squares, each of two triangles.
fn terrain(rng: &mut MeshRng, side: usize) -> TriangleSoup {
    let heights: Vec<f32> = (0..(side + 1) * (side + 1))
        .map(|_| rng.unit() * 0.1)
        .collect();
    let corner = |x: usize, z: usize| {
        let place = |i: usize| i as f32 / side as f32 * 2.0 - 1.0;
        Vec3::new(place(x), heights[z * (side + 1) + x], place(z))
    };
    let square = |i: usize| {
        let (x, z) = (i % side, i / side);
        let [a, b, c, d] = [
            corner(x, z),
            corner(x + 1, z),
            corner(x + 1, z + 1),
            corner(x, z + 1),
        ];
        [[a, c, b], [a, d, c]]
    };
    (0..side * side).flat_map(square).collect()
}

/// Triangles in few planes, each twice, with points and segments among them.
fn coplanar(rng: &mut MeshRng, count: usize) -> TriangleSoup {
    let mut one = || {
        let level = rng.below(3) as f32 * 0.25;
        let mut corner = || rng.point() * Vec3::new(1.0, 0.0, 1.0) + Vec3::Y * level;
        let (a, b, c) = (corner(), corner(), corner());
        match rng.below(8) {
            0 => [a; 3],
            1 => [a, b, b],
            _ => [a, b, c],
        }
    };
    let once: TriangleSoup = (0..count).map(|_| one()).collect();
    once.iter().chain(&once).copied().collect()
}

/// Axis-aligned walls and floors.
fn room(side: usize) -> TriangleSoup {
    let at = |i: usize| i as f32 / side as f32 * 2.0 - 1.0;
    let mut mesh = TriangleSoup::new();
    for axis in 0..3 {
        for (i, level) in (0..side * side).flat_map(|i| [(i, -1.0), (i, 1.0)]) {
            let corner = |x: usize, y: usize| {
                let mut p = [level; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (at(x), at(y));
                Vec3::from_array(p)
            };
            let (x, y) = (i % side, i / side);
            let [a, b, c, d] = [
                corner(x, y),
                corner(x + 1, y),
                corner(x + 1, y + 1),
                corner(x, y + 1),
            ];
            mesh.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn scaled(mesh: TriangleSoup, scale: f32, offset: Vec3) -> TriangleSoup {
    mesh.into_iter()
        .map(|corners| corners.map(|p| p * scale + offset))
        .collect()
}

/// Each mesh with its name.
pub fn families() -> Vec<(&'static str, TriangleSoup)> {
    let rng = &mut MeshRng(5);
    let small = scaled(scattered(rng, 300, 0.1), 1e-2, Vec3::ZERO);
    let ground = |reach: f32| {
        let [a, b, c, d] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, z]| Vec3::new(x, -0.02, z) * reach);
        [
            [a, b, c].map(|p| Vec3 { y: -0.02, ..p }),
            [a, c, d].map(|p| Vec3 { y: -0.02, ..p }),
        ]
    };
    vec![
        ("three", scattered(rng, 3, 1.0)),
        ("nine", scattered(rng, 9, 1.0)),
        ("scattered", scattered(rng, 1000, 0.2)),
        ("crowded", scattered(rng, 300, 2.0)),
        ("needles", needles(rng, 700)),
        ("terrain", terrain(rng, 20)),
        ("coplanar", coplanar(rng, 200)),
        ("room", room(6)),
        (
            "small on a wide ground",
            small.iter().copied().chain(ground(1e5)).collect(),
        ),
        (
            "small on an endless ground",
            small.iter().copied().chain(ground(1e9)).collect(),
        ),
        (
            "far from the origin",
            scaled(scattered(rng, 400, 0.2), 1.0, Vec3::splat(1e4)),
        ),
        (
            "of micrometres",
            scaled(scattered(rng, 400, 0.2), 1e-6, Vec3::ZERO),
        ),
        (
            "of nothing",
            scaled(scattered(rng, 400, 0.2), 1e-22, Vec3::ZERO),
        ),
        (
            "of gigametres",
            scaled(scattered(rng, 400, 0.2), 1e9, Vec3::ZERO),
        ),
        (
            "beyond the filter",
            scaled(scattered(rng, 400, 0.2), 1e13, Vec3::ZERO),
        ),
    ]
}

/// A ray at the mesh: at a corner, at an edge, into a face, along a face or anywhere, from near and
/// far, some along axes, and some with the mesh behind them.
pub fn ray(rng: &mut MeshRng, mesh: &[[Vec3; 3]]) -> Ray<f32> {
    let [a, b, c] = mesh[rng.below(mesh.len())];
    let (u, v) = (rng.unit(), rng.unit());
    let target = match rng.below(4) {
        0 => a,
        1 => a + (b - a) * u,
        2 => a + (b - a) * (u * (1.0 - v)) + (c - a) * v,
        _ => b.lerp(c, u),
    };
    let size = (b - a)
        .abs()
        .max_element()
        .max((c - a).abs().max_element())
        .max(f32::MIN_POSITIVE);
    let away = size * [0.01, 1.0, 30.0, 1e4][rng.below(4)];
    let mut direction = rng.point();
    match rng.below(6) {
        // Nearly in the plane of the face.
        0 => direction = (b - a) / size + (c - a) / size * (u - 0.5),
        1 => direction *= [Vec3::X, -Vec3::Y, Vec3::Z][rng.below(3)],
        2 => direction *= [Vec3::new(1.0, 1.0, -0.0), Vec3::new(0.0, 1.0, 1.0)][rng.below(2)],
        _ => {}
    }
    let direction = direction.as_dvec3().normalize_or(glam::DVec3::X).as_vec3();
    let ahead = if rng.below(4) == 0 { -1.0 } else { 1.0 };
    // Directions need no unit length.
    let length = [1.0, 1.0, 1.0, 1.0, 1e-30, 1e-10, 1e10, 1e30][rng.below(8)];
    Ray::new(target - direction * (away * ahead), direction * length)
}

/// Accepted distances: up to a hit and from it, including and excluding it, before and behind the
/// origin.
pub fn range(rng: &mut MeshRng, first: Option<f32>) -> Interval<f32> {
    let t = first.unwrap_or(1.0);
    let (min, max) = match rng.below(7) {
        0 => (-t.abs(), t.next_up()),
        1 => (t - t.abs(), t),
        2 => (t - t.abs(), t.next_up()),
        3 => (t, f32::INFINITY),
        4 => (t.next_down(), t + t.abs()),
        5 => (t.next_down(), t.next_up()),
        _ => (-2.0 * t.abs(), -0.5 * t.abs()),
    };
    Interval { min, max }
}
