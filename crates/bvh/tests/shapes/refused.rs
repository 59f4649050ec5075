//! Invalid shapes: NaN, infinite or huge numbers in any of their fields.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, Paraboloid, Plane, Quad,
    Sphere, Torus, Triangle,
};
use raywright_bvh::{PrimitiveSet, Visibility};

/// Shapes from eleven numbers, with the indices of the numbers that each uses.
fn shapes(x: [f64; 11]) -> Vec<(&'static str, Vec<usize>, AnyShape<f64>)> {
    let (point, axis, edge) = (
        DVec3::new(x[0], x[1], x[2]),
        DVec3::new(x[3], x[4], x[5]),
        DVec3::new(x[6], x[7], x[8]),
    );
    let used = |more: &[usize]| [&[0, 1, 2][..], more].concat();
    let tangent = DVec3::X;
    vec![
        (
            "sphere",
            used(&[9]),
            Sphere {
                centre: point,
                radius: x[9],
            }
            .into(),
        ),
        (
            "plane",
            used(&[3, 4, 5]),
            Plane {
                point,
                normal: axis,
                tangent,
            }
            .into(),
        ),
        (
            "disk",
            used(&[3, 4, 5, 9]),
            Disk {
                centre: point,
                normal: axis,
                radius: x[9],
            }
            .into(),
        ),
        (
            "quad",
            used(&[3, 4, 5, 6, 7, 8]),
            Quad::new(point, axis, edge).into(),
        ),
        (
            "box",
            used(&[6, 7, 8]),
            Cuboid {
                min: point,
                max: edge,
            }
            .into(),
        ),
        (
            "cylinder",
            used(&[9]),
            Cylinder::new(point, DVec3::Y, x[9], Some(1.0), true).into(),
        ),
        (
            "endless cylinder",
            used(&[9]),
            Cylinder::new(point, DVec3::Y, x[9], None, true).into(),
        ),
        (
            "cone",
            used(&[9, 10]),
            Cone::new(point, DVec3::Y, x[9], x[10], 1.0).into(),
        ),
        (
            "ellipsoid",
            used(&[6, 7, 8]),
            Ellipsoid::new(point, edge).into(),
        ),
        (
            "hyperboloid",
            used(&[9, 10]),
            Hyperboloid::new(point, 1.0, x[9], x[10]).into(),
        ),
        (
            "paraboloid",
            used(&[9, 10]),
            Paraboloid::new(point, x[9], x[10]).into(),
        ),
        (
            "torus",
            used(&[9, 10]),
            Torus::new(point, DVec3::Y, x[10], x[9]).into(),
        ),
        (
            "triangle",
            used(&[3, 4, 5, 6, 7, 8]),
            Triangle {
                vertices: [point, axis, edge],
            }
            .into(),
        ),
    ]
}

/// Protects: a set refuses every shape with a NaN or infinite number in any field, with or without
/// a map, and a refused shape leaves nothing behind.
#[test]
fn numbers_that_are_none_are_refused() {
    let sound = [0.1, 0.2, 0.3, 0.0, 1.0, 0.5, 1.5, 2.0, 2.5, 0.5, 1.5];
    let moved = DAffine3::from_scale(DVec3::new(1.0, -2.0, 3.0));
    for (name, used, shape) in shapes(sound) {
        for map in [DAffine3::IDENTITY, moved] {
            let mut group = PrimitiveSet::<f64>::default();
            assert!(
                group
                    .add_transformed_shape(shape, map, Visibility::default())
                    .is_ok(),
                "{name}"
            );
            for place in &used {
                for wrong in [f64::NAN, f64::INFINITY] {
                    let mut numbers = sound;
                    numbers[*place] = wrong;
                    let (.., shape) = shapes(numbers)
                        .into_iter()
                        .find(|(other, ..)| *other == name)
                        .expect("the same shape");
                    assert!(
                        group
                            .add_transformed_shape(shape, map, Visibility::default())
                            .is_err(),
                        "{name} with {wrong} as number {place}"
                    );
                }
            }
            assert_eq!((group.len(), group.object_count()), (1, 1), "{name}");
        }
    }
}
