//! Meshes that are hard for a filter in f32, and rays that are hard for it to decide.

use glam::Vec3;
use raywright_bvh::{Interval, Ray};

use crate::split_mix::step;

/// A small seeded generator (SplitMix64), so that a failure can be repeated.
pub struct Random(pub u64);

impl Random {
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

pub type Mesh = Vec<[Vec3; 3]>;

fn scattered(random: &mut Random, count: usize, size: f32) -> Mesh {
    let mut one = || {
        let a = random.point();
        [a, a + random.point() * size, a + random.point() * size]
    };
    (0..count).map(|_| one()).collect()
}

/// Slivers three hundred times as long as wide.
fn needles(random: &mut Random, count: usize) -> Mesh {
    let mut one = || {
        let (a, along) = (random.point(), random.point());
        [a, a + along, a + along * 0.5 + random.point() * 0.003]
    };
    (0..count).map(|_| one()).collect()
}

/// A rough terrain of squares, each of two triangles.
fn terrain(random: &mut Random, side: usize) -> Mesh {
    let heights: Vec<f32> = (0..(side + 1) * (side + 1))
        .map(|_| random.unit() * 0.1)
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
fn coplanar(random: &mut Random, count: usize) -> Mesh {
    let mut one = || {
        let level = random.below(3) as f32 * 0.25;
        let mut corner = || random.point() * Vec3::new(1.0, 0.0, 1.0) + Vec3::Y * level;
        let (a, b, c) = (corner(), corner(), corner());
        match random.below(8) {
            0 => [a; 3],
            1 => [a, b, b],
            _ => [a, b, c],
        }
    };
    let once: Mesh = (0..count).map(|_| one()).collect();
    once.iter().chain(&once).copied().collect()
}

/// Axis-aligned walls and floors.
fn room(side: usize) -> Mesh {
    let at = |i: usize| i as f32 / side as f32 * 2.0 - 1.0;
    let mut mesh = Mesh::new();
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

fn scaled(mesh: Mesh, scale: f32, offset: Vec3) -> Mesh {
    mesh.into_iter()
        .map(|corners| corners.map(|p| p * scale + offset))
        .collect()
}

/// Each mesh with its name.
pub fn families() -> Vec<(&'static str, Mesh)> {
    let random = &mut Random(5);
    let small = scaled(scattered(random, 300, 0.1), 1e-2, Vec3::ZERO);
    let ground = |reach: f32| {
        let [a, b, c, d] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, z]| Vec3::new(x, -0.02, z) * reach);
        [
            [a, b, c].map(|p| Vec3 { y: -0.02, ..p }),
            [a, c, d].map(|p| Vec3 { y: -0.02, ..p }),
        ]
    };
    vec![
        ("three", scattered(random, 3, 1.0)),
        ("nine", scattered(random, 9, 1.0)),
        ("scattered", scattered(random, 1000, 0.2)),
        ("crowded", scattered(random, 300, 2.0)),
        ("needles", needles(random, 700)),
        ("terrain", terrain(random, 20)),
        ("coplanar", coplanar(random, 200)),
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
            scaled(scattered(random, 400, 0.2), 1.0, Vec3::splat(1e4)),
        ),
        (
            "of micrometres",
            scaled(scattered(random, 400, 0.2), 1e-6, Vec3::ZERO),
        ),
        (
            "of nothing",
            scaled(scattered(random, 400, 0.2), 1e-22, Vec3::ZERO),
        ),
        (
            "of gigametres",
            scaled(scattered(random, 400, 0.2), 1e9, Vec3::ZERO),
        ),
        (
            "beyond the filter",
            scaled(scattered(random, 400, 0.2), 1e13, Vec3::ZERO),
        ),
    ]
}

/// A ray at the mesh: at a corner, at an edge, into a face, along a face or anywhere, from near and
/// far, some along axes, and some with the mesh behind them.
pub fn ray(random: &mut Random, mesh: &[[Vec3; 3]]) -> Ray<f32> {
    let [a, b, c] = mesh[random.below(mesh.len())];
    let (u, v) = (random.unit(), random.unit());
    let target = match random.below(4) {
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
    let away = size * [0.01, 1.0, 30.0, 1e4][random.below(4)];
    let mut direction = random.point();
    match random.below(6) {
        // Nearly in the plane of the face.
        0 => direction = (b - a) / size + (c - a) / size * (u - 0.5),
        1 => direction *= [Vec3::X, -Vec3::Y, Vec3::Z][random.below(3)],
        2 => direction *= [Vec3::new(1.0, 1.0, -0.0), Vec3::new(0.0, 1.0, 1.0)][random.below(2)],
        _ => {}
    }
    let direction = direction.as_dvec3().normalize_or(glam::DVec3::X).as_vec3();
    let ahead = if random.below(4) == 0 { -1.0 } else { 1.0 };
    // Directions need no unit length.
    let length = [1.0, 1.0, 1.0, 1.0, 1e-30, 1e-10, 1e10, 1e30][random.below(8)];
    Ray::new(target - direction * (away * ahead), direction * length)
}

/// Accepted distances: up to a hit and from it, including and excluding it, before and behind the
/// origin.
pub fn range(random: &mut Random, first: Option<f32>) -> Interval<f32> {
    let t = first.unwrap_or(1.0);
    let (min, max) = match random.below(7) {
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
