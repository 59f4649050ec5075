//! Closest hits of rays with a mesh, by this crate alone: a tree over triangles, and a picture of
//! the hit distances in letters.
//!
//! ```sh
//! cargo run --release -p raywright-bvh --example closest_hits
//! ```
#![expect(clippy::print_stdout, reason = "the picture is this program's result")]

use core::f32::consts::TAU;

use glam::Vec3;
use raywright_bvh::{AcceleratorKind, Geometry, Interval, PrimitiveSet, Ray, Visibility};

/// Creates a torus around +z of `around` by `across` quads, each of two triangles.
fn torus_mesh(around: u32, across: u32) -> Vec<[Vec3; 3]> {
    let vertex = |i: u32, j: u32| {
        let (a, b) = (
            (i % around) as f32 / around as f32 * TAU,
            (j % across) as f32 / across as f32 * TAU,
        );
        let radius = 0.75 + 0.25 * b.cos();
        Vec3::new(radius * a.cos(), radius * a.sin(), 0.25 * b.sin())
    };
    let quads = (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
    quads
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

fn main() -> Result<(), raywright_bvh::GeometryError> {
    let mut set = PrimitiveSet::<f32>::default();
    set.add_mesh(torus_mesh(256, 128), Visibility::default())?;
    let geometry = Geometry::new(set, AcceleratorKind::default());

    for row in 0..24 {
        let line: String = (0..48)
            .map(|column| {
                let target = Vec3::new(
                    (column as f32 - 23.5) / 22.0,
                    (11.5 - row as f32) / 11.0,
                    0.0,
                );
                let eye = Vec3::new(0.0, 0.0, 3.0);
                // Distances are in units of the direction's length, which need not be one.
                match geometry.closest(&Ray::new(eye, target - eye), Interval::positive(), &mut ())
                {
                    Some(hit) => {
                        char::from(b"@%#*+=-:."[((hit.t - 0.9) * 60.0).clamp(0.0, 8.0) as usize])
                    }
                    None => ' ',
                }
            })
            .collect();
        println!("{}", line.trim_end());
    }
    Ok(())
}
