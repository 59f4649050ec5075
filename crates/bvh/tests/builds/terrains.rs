//! Terrains: triangles over a regular grid, in a flat box.

use glam::Vec3;
use raywright_bvh::{
    AcceleratorKind, BuildQuality, Geometry, Interval, PrimitiveSet, Ray, TraversalStats,
    Visibility,
};

use super::families::ArrangementRng;

/// Two triangles for each of cells × cells squares, over ±1 in two axes.
fn terrain(cells: u16) -> PrimitiveSet<f32> {
    let at = |x: u16, z: u16| {
        let [x, z] = [x, z].map(|i| f32::from(i) * 2.0 / f32::from(cells) - 1.0);
        Vec3::new(
            x,
            0.1 * (5.0 * x).sin() * (4.0 * z).cos() + 0.01 * (40.0 * x).sin() * (50.0 * z).cos(),
            z,
        )
    };
    let squares = (0..cells).flat_map(|x| (0..cells).map(move |z| (x, z)));
    let triangles = squares.flat_map(|(x, z)| {
        let [a, b, c, d] = [at(x, z), at(x + 1, z), at(x, z + 1), at(x + 1, z + 1)];
        [[a, b, c], [c, b, d]]
    });
    let mut group = PrimitiveSet::default();
    group.add_mesh(triangles, Visibility::default()).unwrap();
    group
}

/// Protects: clustering looks for the neighbours of a terrain's boxes beside them, not above, where
/// there are none. With cells as flat as the terrain, rays tested 3.01 nodes each in the tree of
/// `fast` and 2.91 in that of `medium`.
#[test]
fn rays_test_few_nodes_of_a_terrain() {
    for quality in BuildQuality::ALL {
        let geometry = Geometry::new(terrain(150), AcceleratorKind::Tree(quality));
        let (rng, mut stats, rays) = (&mut ArrangementRng(4), TraversalStats::default(), 4000);
        for _ in 0..rays {
            let from = rng.point() * Vec3::new(1.0, 0.05, 1.0) + Vec3::Y * 0.16;
            let direction = rng.point() * Vec3::new(1.0, 0.3, 1.0);
            geometry.closest(&Ray::new(from, direction), Interval::positive(), &mut stats);
        }
        let nodes = stats.nodes as f64 / f64::from(rays);
        assert!(nodes < 2.85, "{quality:?}: {nodes} nodes a ray");
    }
}
