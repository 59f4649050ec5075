//! Traversal statistics per ray for the tree of each build quality, independent of the machine's
//! load: nodes, blocks, and triangles.
//!
//! ```sh
//! cargo run --release -p raywright-bvh --example visits -- MESH RAYS..
//! ```
//!
//! MESH is a mesh file as for the example `agreement`. RAYS are files of eight f32 per ray, little
//! endian: origin, least distance, direction, greatest distance. Of every sixteen blocks of 4096
//! rays, one is traced. A file with `shadow` in its name is traced by any-hit queries, any other
//! file by closest-hit queries.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

mod files;

use glam::Vec3;
use raywright_bvh::{
    AcceleratorKind, BuildQuality, Geometry, Interval, PrimitiveSet, Ray, TraversalStats,
    Visibility,
};

/// Number of rays in a block, and number of blocks of which one is traced.
const BLOCK: usize = 4096;
const THIN: usize = 16;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let Some((mesh, sets)) = words.split_first() else {
        println!("usage: visits MESH RAYS..");
        return;
    };
    let mesh = files::read_mesh(mesh);
    let rays: Vec<_> = sets.iter().map(|set| files::read_rays(set)).collect();
    println!("{:10}{:>8}  {}", "", "bytes", sets.join("  "));
    for quality in BuildQuality::ALL {
        let mut group = PrimitiveSet::<f32>::default();
        group
            .add_mesh(mesh.iter().copied(), Visibility::default())
            .unwrap_or_else(|e| panic!("{e}"));
        let tree = Geometry::new(group, AcceleratorKind::Tree(quality));
        let cells: Vec<String> = sets
            .iter()
            .zip(&rays)
            .map(|(set, rays)| count_visits(&tree, rays, set.contains("shadow")))
            .collect();
        println!(
            "{:10}{:>8.1}  {}",
            format!("{quality:?}"),
            tree.memory_bytes() as f64 / mesh.len() as f64,
            cells.join("  ")
        );
    }
}

/// Returns a line with the numbers of nodes, blocks, triangles and hits per ray.
fn count_visits(tree: &Geometry<f32>, rays: &[[f32; 8]], any: bool) -> String {
    let (mut stats, mut hits, mut count) = (TraversalStats::default(), 0, 0);
    for &[ox, oy, oz, min, dx, dy, dz, max] in rays.chunks(BLOCK).step_by(THIN).flatten() {
        let (ray, range) = (
            Ray::new(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz)),
            Interval { min, max },
        );
        let hit = if any {
            tree.occluded(&ray, range, &mut |_| true, &mut stats)
        } else {
            tree.closest(&ray, range, &mut stats).is_some()
        };
        (hits, count) = (hits + u32::from(hit), count + 1);
    }
    let each = |n: f64| n / f64::from(count.max(1));
    format!(
        "{:6.2} nodes {:6.2} blocks {:6.2} triangles {:4.2} hit",
        each(stats.nodes as f64),
        each(stats.leaves as f64),
        each(stats.primitives as f64),
        each(hits.into())
    )
}
