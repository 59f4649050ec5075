//! Arrangements of primitives that are hard for builders, and random ones for comparison; shared
//! with the bench of builds.

use glam::Vec3;
use raywright_bvh::shapes::Sphere;
use raywright_bvh::{PrimitiveSet, Visibility};

use crate::split_mix::step;

/// A primitive of an arrangement.
#[derive(Clone, Copy, Debug)]
pub enum Item {
    /// A sphere: centre and radius.
    Ball(Vec3, f32),
    /// A triangle: corners.
    Triangle([Vec3; 3]),
}

/// A small seeded generator (SplitMix64).
pub struct ArrangementRng(pub u64);

impl ArrangementRng {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (step(&mut self.0) >> 40) as f32 / (1 << 24) as f32
    }

    /// Uniform in the cube [−1, 1]³.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

/// Random spheres, one in 500 thirty times as large: an ordinary set for which reinsertion pays
/// too.
pub fn uneven(n: usize) -> Vec<Item> {
    let larger = |(i, item): (usize, Item)| match item {
        Item::Ball(centre, radius) if i % 500 == 0 => Item::Ball(centre, 30.0 * radius),
        other => other,
    };
    random(n).into_iter().enumerate().map(larger).collect()
}

/// Name of an arrangement, and its constructor for a number of primitives.
pub type Family = (&'static str, fn(usize) -> Vec<Item>);

/// Random spheres in a cube, as in the benchmark: the baseline of the other families.
pub fn random(n: usize) -> Vec<Item> {
    let rng = &mut ArrangementRng(1);
    let radius = 0.3 / (n as f32).cbrt();
    (0..n).map(|_| Item::Ball(rng.point(), radius)).collect()
}

/// The families, each once.
pub const FAMILIES: [Family; 30] = [
    ("a fifth in one place", |n| replaced(n, |i| i % 5 == 0)),
    ("a twentieth in one place", |n| replaced(n, |i| i % 20 == 0)),
    ("half in one place, in a row", |n| {
        replaced(n, move |i| i < n / 2)
    }),
    ("all in one place", |n| vec![Item::Ball(Vec3::ONE, 1.0); n]),
    ("all in one place but one", |n| {
        with_first(
            vec![Item::Ball(Vec3::ONE, 1.0); n],
            Item::Ball(Vec3::ZERO, 1e3),
        )
    }),
    ("all in one place but every 512th", every_512th),
    ("each twice", |n| pairs(&random(n.div_ceil(2)), n)),
    ("concentric, rising", |n| concentric(n, |i| i)),
    ("concentric, falling", |n| concentric(n, move |i| n - 1 - i)),
    ("concentric, shuffled", |n| {
        concentric(n, move |i| shuffled(i, n))
    }),
    ("thin shells", |n| {
        (0..n)
            .map(|i| Item::Ball(Vec3::ZERO, 1.0 + i as f32 * 1e-7))
            .collect()
    }),
    ("geometric row", |n| geometric(n, Vec3::X)),
    ("geometric row, reversed", |n| {
        geometric(n, Vec3::X).into_iter().rev().collect()
    }),
    ("geometric diagonal", |n| geometric(n, Vec3::ONE)),
    ("geometric row in pairs", |n| {
        pairs(&geometric(n.div_ceil(2), Vec3::X), n)
    }),
    ("geometric rows side by side", geometric_rows),
    ("powers of two", |n| {
        (0..n)
            .map(|i| Item::Ball(Vec3::ZERO, 2.0_f32.powi((i % 120) as i32 - 60)))
            .collect()
    }),
    ("on a line", |n| {
        (0..n)
            .map(|i| Item::Ball(Vec3::X * i as f32, 0.4))
            .collect()
    }),
    ("on a line, touching", |n| {
        (0..n)
            .map(|i| Item::Ball(Vec3::X * i as f32, 0.5))
            .collect()
    }),
    ("regular grid", grid),
    ("flat grid of quads", flat),
    ("fan of needles", fan),
    ("crossing sticks", sticks),
    ("crossing sticks along axes", axis_sticks),
    ("two clusters far apart", |n| clusters(n, 1e9)),
    ("two clusters very far apart", |n| clusters(n, 1e25)),
    ("all within one step", |n| {
        with_first(random(n), Item::Ball(Vec3::splat(1e12), 1.0))
    }),
    ("identical centres, random sizes", |n| {
        let rng = &mut ArrangementRng(5);
        (0..n)
            .map(|_| Item::Ball(Vec3::ONE, 0.1 + rng.unit()))
            .collect()
    }),
    ("nested boxes with a common corner", |n| {
        corner(n, Vec3::splat)
    }),
    ("random, huge", |n| {
        random(n)
            .into_iter()
            .map(|item| scaled(item, 1e20))
            .collect()
    }),
];

fn replaced(n: usize, by_one: impl Fn(usize) -> bool) -> Vec<Item> {
    let items = random(n);
    items
        .iter()
        .enumerate()
        .map(|(i, &item)| if by_one(i) { items[0] } else { item })
        .collect()
}

fn with_first(mut items: Vec<Item>, first: Item) -> Vec<Item> {
    items[0] = first;
    items
}

fn every_512th(n: usize) -> Vec<Item> {
    let mut items = vec![Item::Ball(Vec3::ONE, 1.0); n];
    let step = (n / 512).max(1);
    let others = random(n);
    (0..n).step_by(step).for_each(|i| items[i] = others[i]);
    items
}

/// A permutation of the indices: multiplication by a stride coprime to `n`.
fn shuffled(i: usize, n: usize) -> usize {
    (0..)
        .map(|k| n * 5 / 8 + k)
        .find(|&stride| gcd(stride, n) == 1)
        .map_or(i, |stride| i * stride % n)
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn concentric(n: usize, place: impl Fn(usize) -> usize) -> Vec<Item> {
    (0..n)
        .map(|i| Item::Ball(Vec3::ZERO, 1.0 + place(i) as f32 / n as f32 * 20.0))
        .collect()
}

/// Radius and position grow by a constant factor, up to about 5·10⁸ in total.
fn geometric(n: usize, along: Vec3) -> Vec<Item> {
    let growth = 20.0 / n as f64;
    (0..n)
        .map(|i| (growth * i as f64).exp() as f32)
        .map(|s| Item::Ball(along * s, 0.3 * s))
        .collect()
}

fn pairs(items: &[Item], n: usize) -> Vec<Item> {
    items.iter().flat_map(|&item| [item; 2]).take(n).collect()
}

fn geometric_rows(n: usize) -> Vec<Item> {
    let row = geometric(n.div_ceil(4), Vec3::X);
    let moved = |item: &Item, y: f32| match *item {
        Item::Ball(centre, radius) => Item::Ball(centre + Vec3::Y * (y * centre.x), radius),
        other => other,
    };
    (0..4)
        .flat_map(|y| row.iter().map(move |item| moved(item, y as f32)))
        .take(n)
        .collect()
}

fn grid(n: usize) -> Vec<Item> {
    let side = (n as f32).cbrt().ceil() as usize;
    let at = |i: usize| {
        Vec3::new(
            (i % side) as f32,
            (i / side % side) as f32,
            (i / side / side) as f32,
        )
    };
    (0..n).map(|i| Item::Ball(at(i), 0.3)).collect()
}

fn flat(n: usize) -> Vec<Item> {
    let side = ((n / 2) as f32).sqrt().ceil() as usize;
    let half = |i: usize| {
        let a = Vec3::new((i / 2 % side) as f32, 0.0, (i / 2 / side) as f32);
        if i.is_multiple_of(2) {
            [a, a + Vec3::X, a + Vec3::ONE.with_y(0.0)]
        } else {
            [a, a + Vec3::ONE.with_y(0.0), a + Vec3::Z]
        }
    };
    (0..n).map(|i| Item::Triangle(half(i))).collect()
}

fn fan(n: usize) -> Vec<Item> {
    let tip = |i: usize| {
        let (angle, height) = (i as f32 * 2.4, i as f32 / n as f32 * 2.0 - 1.0);
        let flat = (1.0 - height * height).sqrt();
        Vec3::new(flat * angle.cos(), height, flat * angle.sin())
    };
    (0..n)
        .map(|i| Item::Triangle([Vec3::ZERO, tip(i), tip(i) + Vec3::splat(1e-3)]))
        .collect()
}

fn sticks(n: usize) -> Vec<Item> {
    let rng = &mut ArrangementRng(3);
    let mut stick = || {
        let (a, b) = (rng.point(), rng.point());
        [a, b, b + Vec3::splat(1e-3)]
    };
    (0..n).map(|_| Item::Triangle(stick())).collect()
}

fn axis_sticks(n: usize) -> Vec<Item> {
    let rng = &mut ArrangementRng(4);
    let mut stick = |i: usize| {
        let (mut a, along) = (rng.point(), Vec3::AXES[i % 3]);
        a[i % 3] = -1.0;
        [
            a,
            a + along * 2.0,
            a + along * 2.0 + Vec3::AXES[(i + 1) % 3] * 1e-3,
        ]
    };
    (0..n).map(|i| Item::Triangle(stick(i))).collect()
}

/// Two random sets of size 1, one at the origin and one far away, where f32 resolves only a single
/// point.
fn clusters(n: usize, apart: f32) -> Vec<Item> {
    let moved = |(i, item): (usize, Item)| match item {
        Item::Ball(centre, radius) if i % 2 == 0 => Item::Ball(centre + Vec3::X * apart, radius),
        other => other,
    };
    random(n).into_iter().enumerate().map(moved).collect()
}

fn corner(n: usize, far: impl Fn(f32) -> Vec3) -> Vec<Item> {
    let triangle = |p: Vec3| [Vec3::ZERO, p, Vec3::new(p.x, p.y, 0.0)];
    (0..n)
        .map(|i| Item::Triangle(triangle(far(1.0 + i as f32 / n as f32))))
        .collect()
}

fn scaled(item: Item, by: f32) -> Item {
    match item {
        Item::Ball(centre, radius) => Item::Ball(centre * by, radius * by),
        Item::Triangle(corners) => Item::Triangle(corners.map(|c| c * by)),
    }
}

/// The set of these primitives.
pub fn group(items: &[Item]) -> PrimitiveSet<f32> {
    let mut group = PrimitiveSet::default();
    for item in items {
        let added = match *item {
            Item::Ball(centre, radius) => {
                group.add_sphere(Sphere { centre, radius }, Visibility::default())
            }
            Item::Triangle(corners) => group.add_triangle(corners, Visibility::default()),
        };
        added.unwrap_or_else(|e| panic!("{item:?}: {e}"));
    }
    group
}
