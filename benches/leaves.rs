//! Benefit of leaves of spheres and quads: trees over random spheres, quads, boxes and a mixture of
//! all three, traversed by each kernel of this processor and compared with a scan, in turns.
//! `benches/README.md` quotes the table.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "support/random.rs"]
mod random;
#[path = "../crates/bvh/tests/split_mix.rs"]
mod split_mix;
#[path = "support/turns.rs"]
mod turns;

use std::hint::black_box;

use glam::Vec3;
use raywright::bvh::shapes::{Cuboid, Quad, Sphere};
use raywright::bvh::{
    AcceleratorKind, Geometry, Interval, Kernel, PacketBackoff, PrimitiveSet, Ray, RayPacket,
    Visibility,
};

use random::SplitMix64;
use turns::{Contestant, interleaved, measuring};

/// Rays per turn, and rounds.
const RAYS: usize = 20_000;
const ROUNDS: usize = 9;
/// Most primitives for which the scan is timed.
const SCANNED: usize = 1000;

/// Traces all rays of a kind through a tree.
type RayQuery<'a> = &'a dyn Fn(&Geometry<f32>);

/// Adds a primitive of about a given size at a random position in the cube.
type PlacePrimitive = fn(&mut PrimitiveSet<f32>, &mut SplitMix64, f64);

fn sphere(group: &mut PrimitiveSet<f32>, rng: &mut SplitMix64, size: f64) {
    let sphere = Sphere {
        centre: rng.cube().as_vec3(),
        radius: (size * (0.5 + rng.unit())) as f32,
    };
    group
        .add_sphere(sphere, Visibility::default())
        .unwrap_or_else(|e| panic!("{e}"));
}

fn quad(group: &mut PrimitiveSet<f32>, rng: &mut SplitMix64, size: f64) {
    let (corner, u, v) = (rng.cube(), rng.cube() * size * 2.0, rng.cube() * size * 2.0);
    group
        .add_shape(Quad::new(corner, u, v).into(), Visibility::default())
        .unwrap_or_else(|e| panic!("{e}"));
}

fn cuboid(group: &mut PrimitiveSet<f32>, rng: &mut SplitMix64, size: f64) {
    let (middle, half) = (rng.cube(), (rng.cube().abs() + 0.5) * size);
    group
        .add_shape(
            Cuboid::new(middle - half, middle + half).into(),
            Visibility::default(),
        )
        .unwrap_or_else(|e| panic!("{e}"));
}

fn any_kind(group: &mut PrimitiveSet<f32>, rng: &mut SplitMix64, size: f64) {
    let kinds: [PlacePrimitive; 3] = [sphere, quad, cuboid];
    kinds[(rng.unit() * 3.0) as usize % 3](group, rng, size);
}

/// `count` primitives of a kind; each takes 1 % of the cube if there are a hundred.
fn geometry(put: PlacePrimitive, count: usize, kind: AcceleratorKind) -> Geometry<f32> {
    let (mut group, mut rng) = (PrimitiveSet::default(), SplitMix64(count as u64));
    let size = 0.5 * (count as f64).powf(-1.0 / 3.0);
    (0..count).for_each(|_| put(&mut group, &mut rng, size));
    Geometry::new(group, kind)
}

/// `cargo bench --bench leaves -- 1000 100000`: numbers of primitives.
fn main() {
    if !measuring() {
        return;
    }
    let counts: Vec<usize> = std::env::args()
        .filter_map(|argument| argument.parse().ok())
        .collect();
    let counts = if counts.is_empty() {
        vec![1000, 100_000]
    } else {
        counts
    };
    let kinds: [(&str, PlacePrimitive); 4] = [
        ("spheres", sphere),
        ("quads", quad),
        ("boxes", cuboid),
        ("spheres, quads and boxes", any_kind),
    ];
    for count in counts {
        for (name, put) in kinds {
            table(name, put, count);
        }
    }
}

fn table(name: &str, put: PlacePrimitive, count: usize) {
    let mut trees: Vec<(String, Geometry<f32>)> = Vec::new();
    for kernel in Kernel::available() {
        let mut tree = geometry(put, count, AcceleratorKind::default());
        tree.set_kernel(kernel);
        trees.push((format!("{kernel:?}"), tree));
    }
    if count <= SCANNED {
        trees.push((
            "scan".to_owned(),
            geometry(put, count, AcceleratorKind::Linear),
        ));
    }
    let bytes = trees[0].1.memory_bytes() as f64 / count as f64;
    let rng = &mut SplitMix64(7);
    let rays: Vec<Ray<f32>> = (0..RAYS)
        .map(|_| {
            Ray::new(
                (rng.cube() * 1.5).as_vec3(),
                rng.cube().normalize().as_vec3(),
            )
        })
        .collect();
    let side = (RAYS as f64).sqrt() as usize;
    let across = |i: usize| (i as f32 / side as f32 - 0.5) * 0.8;
    let directions: Vec<Vec3> = (0..side * side)
        .map(|i| {
            Vec3::new(across(i % side), across(i / side), 1.0)
                .as_dvec3()
                .normalize()
                .as_vec3()
        })
        .collect();
    let from = RayPacket {
        origin: Vec3::new(0.0, 0.0, -3.0),
        directions: &directions,
        time: 0.0,
        culls: false,
        range: Interval::positive(),
    };
    let closest = |tree: &Geometry<f32>| {
        for ray in &rays {
            black_box(tree.closest(ray, Interval::positive(), &mut ()));
        }
    };
    let any = |tree: &Geometry<f32>| {
        for ray in &rays {
            black_box(tree.occluded(ray, Interval::positive(), &mut |_| true, &mut ()));
        }
    };
    let camera = |tree: &Geometry<f32>| {
        for &direction in &directions {
            black_box(tree.closest(
                &Ray::new(from.origin, direction),
                Interval::positive(),
                &mut (),
            ));
        }
    };
    let together = |tree: &Geometry<f32>| {
        let mut hits = Vec::new();
        tree.closest_of_packet(&from, &mut PacketBackoff::default(), &mut hits);
        black_box(&hits);
    };
    let queries: [(&str, RayQuery<'_>); 4] = [
        ("closest", &closest),
        ("any", &any),
        ("camera's, one by one", &camera),
        ("camera's, together", &together),
    ];
    for (query, ask) in queries {
        let works: Vec<_> = trees.iter().map(|(_, tree)| move || ask(tree)).collect();
        let contestants: Vec<_> = trees
            .iter()
            .zip(&works)
            .map(|((name, _), work)| Contestant { name, work })
            .collect();
        let title = format!("{count} {name}, {bytes:.0} bytes each; {query}: {RAYS} rays");
        println!("{}", interleaved(&title, ROUNDS, &contestants));
    }
}
