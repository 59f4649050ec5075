//! Closed rooms: walls of flat boxes in the outer faces of the scene's box.

use glam::DVec3;
use raywright_bvh::shapes::{AnyShape, Quad};
use raywright_bvh::{
    AcceleratorKind, BuildQuality, Geometry, Interval, PrimitiveSet, Ray, TraversalStats,
    Visibility,
};

use super::families::ArrangementRng;

/// Six walls of cells × cells quads with extent 2·half around the centre, each corner moved by up
/// to `jitter`.
fn room(cells: usize, centre: DVec3, half: f64, jitter: f64) -> PrimitiveSet<f32> {
    let rng = &mut ArrangementRng(2);
    let mut group = PrimitiveSet::default();
    let step = 2.0 * half / cells as f64;
    for wall in 0..6 {
        let axis = wall % 3;
        let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
        let corner = if wall < 3 {
            DVec3::splat(-half)
        } else {
            DVec3::splat(half) - (u + v) * (2.0 * half)
        };
        for cell in 0..cells * cells {
            let moved = rng.point().as_dvec3() * jitter * half;
            let point = centre
                + corner
                + u * (step * (cell % cells) as f64)
                + v * (step * (cell / cells) as f64)
                + moved;
            group
                .add_shape(
                    AnyShape::Quad(Quad::new(point, u * step, v * step)),
                    Visibility::default(),
                )
                .unwrap();
        }
    }
    group
}

/// Nodes and primitives visited by rays that start in the room.
fn visits(group: PrimitiveSet<f32>, centre: DVec3, half: f64, quality: BuildQuality) -> u64 {
    let geometry = Geometry::new(group, AcceleratorKind::Tree(quality));
    let (rng, mut stats) = (&mut ArrangementRng(3), TraversalStats::default());
    for _ in 0..2000 {
        let origin = centre + rng.point().as_dvec3() * (0.9 * half);
        let ray = Ray::new(origin.as_vec3(), rng.point().normalize());
        geometry.closest(&ray, Interval::positive(), &mut stats);
    }
    stats.nodes + stats.primitives
}

/// Protects: a room costs its rays at most twice as much as the same room with slightly moved
/// corners, at any position: also with its greatest corner at the origin, where padding is nearly
/// zero, and on an axis.
#[test]
fn t09_rooms_cost_the_same_everywhere() {
    let places = [
        DVec3::ZERO,
        DVec3::NEG_ONE,
        DVec3::ONE,
        DVec3::splat(-1.0 - 1e-7),
        DVec3::splat(-1.001),
        DVec3::splat(-7.0),
        DVec3::splat(1e4),
        DVec3::NEG_X,
        DVec3::NEG_Y,
        DVec3::NEG_Z,
        DVec3::new(-1.0, 5.0, -1.0),
        DVec3::new(3.0, -1.0, -0.25),
    ];
    for cells in [1, 8, 16, 32] {
        let jittered = visits(
            room(cells, DVec3::ZERO, 1.0, 1e-3),
            DVec3::ZERO,
            1.0,
            BuildQuality::default(),
        );
        for centre in places {
            let straight = visits(
                room(cells, centre, 1.0, 0.0),
                centre,
                1.0,
                BuildQuality::default(),
            );
            assert!(
                straight <= 2 * jittered,
                "{cells} cells at {centre}: {straight} against {jittered}"
            );
        }
    }
}

/// Protects: the same bound at every scale and for every build quality.
#[test]
fn t09_rooms_cost_the_same_at_every_scale() {
    for quality in BuildQuality::ALL {
        let jittered = visits(room(16, DVec3::ZERO, 1.0, 1e-3), DVec3::ZERO, 1.0, quality);
        for half in [1e-6, 1e-3, 10.0, 1e5, 1e9] {
            let centre = DVec3::splat(-half);
            let straight = visits(room(16, centre, half, 0.0), centre, half, quality);
            assert!(
                straight <= 2 * jittered,
                "{half}, {quality:?}: {straight} against {jittered}"
            );
        }
    }
}
