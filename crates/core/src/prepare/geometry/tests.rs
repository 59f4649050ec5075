//! Emitters and shapes as preparation makes them.

use super::*;
use crate::generate::expand;
use crate::scene::{Colour, Generator, GeneratorKind, Model, Physical};
use raywright_bvh::Robust;

fn glowing(shape: Shape, transform: Vec<TransformStep>) -> (Material, Object) {
    let physical = Physical { emission: Colour([2.0, 1.0, 0.5]).into(), ..Physical::default() };
    let material = Material { name: "glow".to_owned(), model: Model::Physical(Box::new(physical)) };
    let object = Object {
        name: String::new(),
        shape,
        material: "glow".to_owned(),
        side: SideRule::Outside,
        face_viewer: true,
        casts_shadow: true,
        transform,
    };
    (material, object)
}

/// Protects: what is only moved lights others as a shape of its own, so that tens of thousands of emitters are no matter, and
/// has the area and place of the one under a map.
#[test]
fn moved_emitters_need_no_map() {
    let (material, object) = glowing(Shape::Sphere { centre: [1.0, 0.0, 0.0], radius: 0.5 }, Vec::new());
    let kind = GeneratorKind::Scatter { count: 20_000, min: [-5.0; 3], max: [5.0; 3], seed: 3 };
    let turned = TransformStep::Rotate { axis: [0.0, 1.0, 0.0], degrees: 90.0 };
    let scene = Scene {
        materials: vec![material],
        objects: vec![Object { transform: vec![turned, TransformStep::Scale([2.0; 3])], ..object.clone() }],
        generators: vec![Generator { kind, object }],
        ..Scene::default()
    };
    let emitters = emitters::<Robust>(&scene, &Lookup::new(&scene));
    let area = core::f64::consts::PI;
    let (placed, plain) = emitters.split_first().expect("there are emitters");
    assert!(matches!(placed.form, Form::Placed(_)) && (placed.area - 4.0 * area).abs() < 1e-9, "{}", placed.area);
    assert_eq!(plain.len(), 20_000);
    let places = expand(&scene);
    for (emitter, object) in plain.iter().zip(&places[1..]) {
        let Form::Plain(AnyShape::Sphere(sphere)) = &emitter.form else { panic!("{:?} is not plain", emitter.form) };
        let place = affine(&object.transform).translation + DVec3::X;
        assert!((sphere.centre.to_f64() - place).length() < 1e-5 && (emitter.area - area).abs() < 1e-9);
    }
}

/// Protects: an area is taken over from the object before only where shape and map are the same.
#[test]
fn areas_are_each_emitters_own() {
    let ball = |radius| Shape::Sphere { centre: [0.0; 3], radius };
    let (material, object) = glowing(ball(1.0), Vec::new());
    let scaled = |shape: Shape, factor: f64| {
        let transform = vec![TransformStep::Scale([factor; 3]), TransformStep::Translate([factor, 0.0, 0.0])];
        Object { shape, transform, ..object.clone() }
    };
    let objects = vec![object.clone(), scaled(ball(1.0), 1.0), scaled(ball(1.0), 2.0), scaled(ball(2.0), 2.0), object.clone()];
    let scene = Scene { materials: vec![material], objects, ..Scene::default() };
    let areas: Vec<f64> =
        emitters::<Robust>(&scene, &Lookup::new(&scene)).iter().map(|e| e.area / (4.0 * core::f64::consts::PI)).collect();
    let expected = [1.0, 1.0, 4.0, 16.0, 1.0];
    assert!(areas.iter().zip(expected).all(|(a, b)| (a / b - 1.0).abs() < 1e-9), "{areas:?}");
}

/// Protects: a triangle without area is nothing that rays could hit, also where a map turns it.
#[test]
fn triangles_without_area_collapse() {
    let vertices = [[0.125, 0.25, 0.5], [1.125, 1.25, 1.5], [3.125, 3.25, 3.5]];
    let Some(AnyShape::Triangle(triangle)) = any_shape::<f32>(&Shape::Triangle { vertices }, DVec3::ZERO) else { panic!() };
    assert_eq!(triangle.vertices, [triangle.vertices[0]; 3]);
}

/// Protects: what storing makes nothing of is refused by its name, also where nobody validated, and kept where doubles are stored.
#[test]
fn collapsed_shapes_are_refused() {
    let (material, object) = glowing(Shape::Box { min: [0.0; 3], max: [1.0, 2.0, 0.01] }, Vec::new());
    let kind = GeneratorKind::Grid { counts: [1, 1, 2], origin: [0.0, 0.0, 3e5], step: [0.0, 0.0, 1.0] };
    let scene = Scene { materials: vec![material], generators: vec![Generator { kind, object }], ..Scene::default() };
    let lookup = Lookup::new(&scene);
    let narrow = build::<Robust>(&scene, &lookup, AcceleratorKind::Linear).err();
    assert_eq!(narrow, Some(PrepareError::Collapsed { object: 0 }));
    let wide = build::<raywright_bvh::Reference>(&scene, &lookup, AcceleratorKind::Linear).expect("f64 tells its faces apart");
    assert_eq!(wide.objects.len(), 2);
}
