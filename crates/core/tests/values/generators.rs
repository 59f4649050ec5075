//! Generators of many objects, and the transforms of their positions.

use glam::DVec3;
use raywright_core::affine_from_steps;
use raywright_core::generate::{count_objects, expand_generators};
use raywright_core::scene::{Scene, TransformStep};
use serde_json::{Value, json};

use crate::support::{ball, scene};

fn places(kind: Value, transform: Value) -> Vec<DVec3> {
    let mut object = ball([0.0; 3], 1.0, "grey");
    object["transform"] = transform;
    let scene: Scene = scene(
        json!({ "materials": [{ "name": "grey", "model": { "classic": {} } }],
        "objects": [ball([0.0; 3], 1.0, "grey")], "generators": [{ "kind": kind, "object": object }] }),
    );
    let objects = expand_generators(&scene);
    assert_eq!(objects.len() as u64, count_objects(&scene));
    objects[1..]
        .iter()
        .map(|object| affine_from_steps(&object.transform).transform_point3(DVec3::X))
        .collect()
}

/// Protects: a grid runs along x first, then y, then z, from its origin by its steps; an object's
/// own transform is applied first.
#[test]
fn grids_run_along_x_first() {
    let grid =
        json!({ "grid": { "counts": [2, 3, 2], "origin": [10, 20, 30], "step": [1, 2, 4] } });
    let found = places(grid, json!([{ "scale": [3, 1, 1] }]));
    let at = |x: f64, y: f64, z: f64| DVec3::new(13.0 + x, 20.0 + 2.0 * y, 30.0 + 4.0 * z);
    assert_eq!(found.len(), 12);
    assert_eq!(
        [found[0], found[1], found[2], found[6], found[11]],
        [
            at(0.0, 0.0, 0.0),
            at(1.0, 0.0, 0.0),
            at(0.0, 1.0, 0.0),
            at(0.0, 0.0, 1.0),
            at(1.0, 2.0, 1.0)
        ]
    );
}

/// Protects: scattered positions fill their box uniformly in each axis and depend on the seed; a
/// position does not depend on the number of objects.
#[test]
fn scattered_places_fill_their_box() {
    let scatter = |count: u32, seed: u64| json!({ "scatter": { "count": count, "min": [-1, 0, 10], "max": [1, 1, 14], "seed": seed } });
    let found: Vec<DVec3> = places(scatter(4000, 5), json!([]))
        .into_iter()
        .map(|p| (p - DVec3::new(0.0, 0.0, 10.0)) / DVec3::new(2.0, 1.0, 4.0))
        .collect();
    for axis in 0..3 {
        let numbers = || found.iter().map(|p| p[axis]);
        assert!(numbers().all(|x| (0.0..1.0).contains(&x)));
        let mean = numbers().sum::<f64>() / 4000.0;
        let next: f64 = found
            .iter()
            .map(|p| (p[axis] - 0.5) * (p[(axis + 1) % 3] - 0.5))
            .sum::<f64>()
            / 4000.0;
        assert!(
            (mean - 0.5).abs() < 0.02 && next.abs() < 0.006,
            "axis {axis}: {mean}, {next}"
        );
    }
    let mut all: Vec<u64> = found
        .iter()
        .flat_map(|p| p.to_array())
        .map(|x| (x * 1e9).round() as u64)
        .collect();
    all.sort_unstable();
    let repeated = all.windows(2).filter(|pair| pair[0] == pair[1]).count();
    assert!(
        repeated < 3,
        "{repeated} of 12 000 numbers stand at two places"
    );
    assert_eq!(
        places(scatter(3, 5), json!([])),
        places(scatter(9, 5), json!([]))[..3]
    );
    assert_ne!(
        places(scatter(3, 5), json!([])),
        places(scatter(3, 6), json!([]))
    );
}

/// Protects: transform steps are applied in order; a rotation is counter-clockwise seen from the
/// axis' tip; a matrix is given by its rows.
#[test]
fn steps_are_applied_in_order() {
    let map =
        |steps: &[TransformStep], p: [f64; 3]| affine_from_steps(steps).transform_point3(p.into());
    let close = |a: DVec3, b: [f64; 3]| {
        assert!(
            (a - DVec3::from(b)).length() < 1e-12,
            "{a} instead of {b:?}"
        )
    };
    let (scale, shift) = (
        TransformStep::Scale([2.0, 3.0, 4.0]),
        TransformStep::Translate([1.0, 1.0, 1.0]),
    );
    close(map(&[scale, shift], [1.0; 3]), [3.0, 4.0, 5.0]);
    close(map(&[shift, scale], [1.0; 3]), [4.0, 6.0, 8.0]);
    let turn = |axis| TransformStep::Rotate {
        axis,
        degrees: 90.0,
    };
    close(
        map(&[turn([0.0, 5.0, 0.0])], [0.0, 0.0, 1.0]),
        [1.0, 0.0, 0.0],
    );
    close(
        map(&[turn([0.0, 0.0, 1.0])], [1.0, 0.0, 0.0]),
        [0.0, 1.0, 0.0],
    );
    close(
        map(&[turn([1.0, 0.0, 0.0])], [0.0, 1.0, 0.0]),
        [0.0, 0.0, 1.0],
    );
    let matrix = TransformStep::Matrix([
        [1.0, 2.0, 3.0, 4.0],
        [5.0, 6.0, 7.0, 8.0],
        [9.0, 10.0, 11.0, 12.0],
    ]);
    close(map(&[matrix], [1.0, 10.0, 100.0]), [325.0, 773.0, 1221.0]);
    close(map(&[], [1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
}
