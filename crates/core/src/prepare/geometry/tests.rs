//! Shapes as preparation makes them.

use super::*;
use crate::scene::{Colour, Generator, GeneratorKind, Material, Model, Physical, TransformStep};
use raywright_bvh::Robust;

pub(in crate::prepare) fn glowing(shape: Shape, transform: Vec<TransformStep>) -> (Material, Object) {
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
        transform_end: None,
    };
    (material, object)
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
    let narrow = build::<Robust>(&scene, &lookup, AcceleratorKind::Linear, &()).err();
    assert_eq!(narrow, Some(PrepareError::Collapsed { object: 0 }));
    let wide =
        build::<raywright_bvh::Reference>(&scene, &lookup, AcceleratorKind::Linear, &()).expect("f64 tells its faces apart");
    assert_eq!(wide.objects.len(), 2);
}
