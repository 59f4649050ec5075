//! Shapes that are valid in the file and vanish when stored.

use super::super::geometry::tests::glowing;
use super::*;
use crate::scene::{GeneratorKind, TransformStep, Triple};

/// [`collapsed_relative_to`] with the origin zero.
fn collapsed<R: Real>(scene: &Scene) -> Vec<Fault> {
    collapsed_relative_to::<R>(scene, DVec3::ZERO)
}

const HERE: Triple = [0.0; 3];
const ABOVE: Triple = [0.0, 1.0, 0.0];

fn object(shape: Shape, transform: Vec<TransformStep>) -> Object {
    glowing(shape, transform).1
}

/// The problems of a single object in single precision; asserts that double precision has none.
fn alone(object: Object) -> Vec<Fault> {
    let scene = Scene {
        objects: vec![object],
        ..Scene::default()
    };
    assert_eq!(collapsed::<f64>(&scene), []);
    collapsed::<f32>(&scene)
}

fn one(shape: Shape) -> String {
    match alone(object(shape, Vec::new())).as_slice() {
        [Fault { path, message, .. }] => format!("{path}: {message}"),
        others => panic!("{others:?}"),
    }
}

/// Protects: shapes that vanish in `f32` are reported with their path, unless a transform or a
/// motion keeps their own numbers; never in double precision, which resolves them.
#[test]
fn sizes_survive_single_precision() {
    let wide = Shape::Box {
        min: [1e8; 3],
        max: [100_000_001.0, 1e9, 1e9],
    };
    let message = "the distance between `min` and `max` rounds to zero in single precision, so nothing is visible";
    assert_eq!(one(wide), format!("objects[0].shape.box.max: {message}"));
    let unit = Shape::Box {
        min: HERE,
        max: [1.0; 3],
    };
    let away = vec![TransformStep::Translate([1e8, 0.0, 0.0])];
    let turned = [
        vec![TransformStep::Rotate {
            axis: ABOVE,
            degrees: 30.0,
        }],
        away.clone(),
    ]
    .concat();
    assert_eq!(alone(object(unit.clone(), turned)), []);
    let moved = object(unit, away);
    assert_eq!(alone(moved.clone())[0].path, "objects[0].shape.box.max");
    assert_eq!(
        alone(Object {
            transform_end: Some(vec![TransformStep::Translate([2e8, 0.0, 0.0])]),
            ..moved
        }),
        []
    );
    let torus = Shape::Torus {
        centre: HERE,
        axis: ABOVE,
        major_radius: 1.000_000_01,
        minor_radius: 1.0,
    };
    assert!(one(torus.clone()).contains(
        "torus.minor_radius: the difference between `minor_radius` and `major_radius` rounds to zero"
    ));
    assert_eq!(
        alone(object(torus, Vec::new()))[0].remedy,
        "add --precision reference"
    );
    let quad = Shape::Quad {
        corner: [1e8; 3],
        edge_u: ABOVE,
        edge_v: [100.0, 0.0, 0.0],
    };
    assert!(one(quad.clone()).contains("quad.corner: the size of the quad"));
    let triangle = |far: f64| Shape::Triangle {
        vertices: [[far, 0.0, 0.0], [far, 1.0, 0.0], [far + 1.0, 0.0, 0.0]],
    };
    assert!(
        one(triangle(1e8))
            .contains("triangle.vertices: the distance between the corners rounds to zero")
    );
    assert_eq!(alone(object(triangle(1e6), Vec::new())), []);
    let hint = alone(object(quad, Vec::new())).remove(0).remedy;
    assert_eq!(
        hint,
        "move the object nearer to the rest of the scene, or add --precision reference"
    );
}

/// Protects: double precision loses shapes too, farther away, and then no other precision is
/// suggested.
#[test]
fn doubles_lose_what_is_too_far_for_them() {
    let far = object(
        Shape::Box {
            min: HERE,
            max: [1.0, 2.0, 0.01],
        },
        vec![TransformStep::Translate([1e15; 3])],
    );
    let lost = collapsed::<f64>(&Scene {
        objects: vec![far],
        ..Scene::default()
    });
    assert!(
        lost[0]
            .message
            .contains("rounds to zero in double precision"),
        "{lost:?}"
    );
    assert_eq!(
        lost[0].remedy,
        "move the object nearer to the rest of the scene"
    );
}

/// Protects: a generator's objects are tested at their positions, by the sum of both translations,
/// and the first one lost is reported.
#[test]
fn generated_shapes_are_judged_where_they_land() {
    let thin = |z: f64| Shape::Box {
        min: [0.0, 0.0, z],
        max: [1.0, 2.0, z + 0.01],
    };
    let value_of = |kind: GeneratorKind, object: Object| {
        let scene = Scene {
            generators: vec![Generator { kind, object }],
            ..Scene::default()
        };
        assert_eq!(collapsed::<f64>(&scene), []);
        collapsed::<f32>(&scene)
    };
    let with = |shape: Shape, transform: Vec<TransformStep>, origin: f64| {
        let kind = GeneratorKind::Grid {
            counts: [1, 1, 3],
            origin: [0.0, 0.0, origin],
            step: [0.0, 0.0, 100_000.0],
        };
        value_of(kind, object(shape, transform))
    };
    let found = with(thin(0.0), Vec::new(), 100_000.0);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].path, "generators[0].object.shape.box.max");
    assert_eq!(
        found[0].message,
        "the distance between `min` and `max` rounds to zero in single precision, so nothing is visible of the generator's object 2, \
         at [0, 0, 300000]"
    );
    assert!(found[0].remedy.ends_with("or add --precision reference"));
    assert_eq!(with(thin(0.0), Vec::new(), 0.0), []);
    let moved = |z| vec![TransformStep::Translate([0.0, 0.0, z])];
    assert_eq!(
        with(thin(0.0), moved(250_000.0), 0.0)[0].path,
        "generators[0].object.shape.box.max"
    );
    assert_eq!(with(thin(300_000.0), moved(-250_000.0), -100_000.0), []);
    // A rotated shape keeps its own space.
    let turned = vec![TransformStep::Rotate {
        axis: ABOVE,
        degrees: 30.0,
    }];
    assert_eq!(with(thin(0.0), turned, 300_000.0), []);
    let quad = Shape::Quad {
        corner: HERE,
        edge_u: [0.0, 0.0, 0.01],
        edge_v: ABOVE,
    };
    assert_eq!(
        with(quad, Vec::new(), 300_000.0)[0].path,
        "generators[0].object.shape.quad.corner"
    );
    let triangle = Shape::Triangle {
        vertices: [HERE, ABOVE, [0.0, 0.0, 0.01]],
    };
    assert_eq!(
        with(triangle, Vec::new(), 300_000.0)[0].path,
        "generators[0].object.shape.triangle.vertices"
    );
    let torus = Shape::Torus {
        centre: HERE,
        axis: ABOVE,
        major_radius: 1.000_000_01,
        minor_radius: 1.0,
    };
    assert_eq!(
        with(torus, Vec::new(), 0.0)[0].path,
        "generators[0].object.shape.torus.minor_radius"
    );
    let kind = GeneratorKind::Scatter {
        count: 1000,
        min: [0.0, 0.0, 1e5],
        max: [0.0, 0.0, 1e6],
        seed: 1,
    };
    assert_eq!(value_of(kind, object(thin(0.0), Vec::new())).len(), 1);
}
