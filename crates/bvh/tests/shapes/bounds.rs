//! Boxes are tight: a box that is too large costs time in every tree.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::TransformedShape;

use super::gallery::gallery;

/// Support of a surface by search: the best of a grid of its points, improved by steps in both
/// sampling numbers, which are halved when neither improves.
fn reach(shape: &TransformedShape<f64>, direction: DVec3) -> f64 {
    const STEPS: u32 = 60;
    let value = |u: f64, v: f64| {
        // Angles wrap around; the very end is a border.
        let inside = |x: f64| {
            if x == 1.0 {
                1.0 - 1e-15
            } else {
                x.rem_euclid(1.0)
            }
        };
        shape
            .sample_area(inside(u), inside(v))
            .expect("of finite area")
            .0
            .point
            .dot(direction)
    };
    let grid = (0..=STEPS).flat_map(|i| {
        (0..=STEPS).map(move |j| {
            (
                f64::from(i) / f64::from(STEPS),
                f64::from(j) / f64::from(STEPS),
            )
        })
    });
    let (mut u, mut v) = grid
        .max_by(|a, b| value(a.0, a.1).total_cmp(&value(b.0, b.1)))
        .expect("a grid");
    let (mut best, mut step) = (value(u, v), 1.0 / f64::from(STEPS));
    while step > 1e-14 {
        let around =
            [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)].map(|(a, b)| (u + a, v + b));
        let next = around
            .into_iter()
            .max_by(|a, b| value(a.0, a.1).total_cmp(&value(b.0, b.1)))
            .expect("four");
        if value(next.0, next.1) > best {
            ((u, v), best) = (next, value(next.0, next.1));
        } else {
            step *= 0.5;
        }
    }
    best
}

/// Protects: bounds, plain and mapped, contain every point and are tight.
#[test]
fn bounds_are_tight() {
    let turned = DAffine3::from_translation(DVec3::new(0.2, -0.1, 0.3))
        * DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.0)
        * DAffine3::from_scale(DVec3::new(-0.8, 1.3, 0.6));
    for (name, shape, _) in gallery::<f64>() {
        for map in [DAffine3::IDENTITY, turned] {
            let transformed_shape = TransformedShape::<f64>::new(shape, map).unwrap();
            let Some(bounds) = transformed_shape.bounds() else {
                assert!(
                    name == "plane" || name == "infinite cylinder",
                    "{name} has no box"
                );
                continue;
            };
            let extent = bounds.extent().max_element();
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                for (direction, side) in
                    [(axis, bounds.max.dot(axis)), (-axis, -bounds.min.dot(axis))]
                {
                    let room = side - reach(&transformed_shape, direction);
                    assert!(
                        room >= -1e-12 * extent,
                        "{name} sticks out of {bounds:?} by {room:e} along {direction:?}"
                    );
                    assert!(
                        room <= 1e-5 * extent,
                        "{name} leaves {room:e} of {bounds:?} along {direction:?}"
                    );
                }
            }
        }
    }
}
