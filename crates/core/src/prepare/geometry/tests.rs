//! Prepared shapes.

use glam::DVec3;

use super::*;
use crate::scene::{
    Colour, Generator, GeneratorKind, Material, MaterialModel, Mesh, MeshSource, Object, Physical,
    Shape, TransformStep,
};
use crate::shape::convert_moved_shape;
use raywright_bvh::shapes::AnyShape;

pub(in crate::prepare) fn glowing(
    shape: Shape,
    transform: Vec<TransformStep>,
) -> (Material, Object) {
    let physical = Physical {
        emission: Colour([2.0, 1.0, 0.5]).into(),
        ..Physical::default()
    };
    let material = Material {
        name: "glow".to_owned(),
        model: MaterialModel::Physical(Box::new(physical)),
    };
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

/// Protects: a triangle without area collapses to a point that rays cannot hit, also under a
/// rotation.
#[test]
fn triangles_without_area_collapse() {
    let vertices = [[0.125, 0.25, 0.5], [1.125, 1.25, 1.5], [3.125, 3.25, 3.5]];
    let Some(AnyShape::Triangle(triangle)) =
        convert_moved_shape::<f32>(&Shape::Triangle { vertices }, DVec3::ZERO)
    else {
        panic!()
    };
    assert_eq!(triangle.vertices, [triangle.vertices[0]; 3]);
}

/// Protects: shapes that vanish when stored are rejected by name, without validation too, and kept
/// in double precision.
#[test]
fn collapsed_shapes_are_refused() {
    let (material, object) = glowing(
        Shape::Box {
            min: [0.0; 3],
            max: [1.0, 2.0, 0.01],
        },
        Vec::new(),
    );
    let kind = GeneratorKind::Grid {
        counts: [1, 1, 2],
        origin: [0.0, 0.0, 3e5],
        step: [0.0, 0.0, 1.0],
    };
    // Most of the scene is around zero.
    let ball = Object {
        shape: Shape::Sphere {
            centre: [0.0; 3],
            radius: 1.0,
        },
        ..object.clone()
    };
    let generators = vec![Generator { kind, object }];
    let scene = Scene {
        materials: vec![material],
        objects: vec![ball; 3],
        generators,
        ..Scene::default()
    };
    let lookup = SceneLookup::new(&scene);
    let narrow = build_geometry::<f32>(&scene, &lookup, AcceleratorKind::Linear, &()).err();
    let Some(PrepareError::Collapsed { problems }) = narrow else {
        panic!("{narrow:?}")
    };
    assert_eq!(problems.len(), 1);
    assert_eq!(problems[0].path, "generators[0].object.shape.box.max");
    let wide = build_geometry::<f64>(&scene, &lookup, AcceleratorKind::Linear, &())
        .expect("f64 tells its faces apart");
    assert_eq!(wide.objects.len(), 5);
}

/// Protects: a mesh that vanishes when stored is reported by its object, and no other mesh: not
/// near the origin, not if one triangle survives, not without area before, not if instances keep
/// its coordinates small, not in double precision.
#[test]
fn vanished_meshes_are_told() {
    let triangle = |size: f32| vec![[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]];
    let mesh = |name: &str, positions: Vec<[f32; 3]>| {
        let indices = (0..positions.len() as u32)
            .step_by(3)
            .map(|i| [i, i + 1, i + 2])
            .collect();
        let data = MeshData {
            positions: positions.into(),
            indices,
            ..MeshData::default()
        };
        Mesh {
            name: name.to_owned(),
            source: MeshSource::Inline(Arc::new(data)),
            model: None,
        }
    };
    let small_and_large = [triangle(1.0), triangle(1e4)].concat();
    let meshes = vec![
        mesh("small", triangle(1.0)),
        mesh("small too", triangle(2.0)),
        mesh("near", triangle(1.0)),
        mesh("large", small_and_large),
        mesh("flat", vec![[0.0; 3]; 3]),
        mesh("twice", triangle(1.0)),
    ];
    let (material, _) = glowing(Shape::Mesh(String::new()), Vec::new());
    let object = |name: &str, x: f64| {
        glowing(
            Shape::Mesh(name.to_owned()),
            vec![TransformStep::Translate([x, 0.0, 0.0])],
        )
        .1
    };
    let placed = [
        ("near", 1e3),
        ("small", 1e9),
        ("large", 1e9),
        ("twice", 1e9),
        ("flat", 1e9),
        ("twice", 2e9),
        ("small too", -1e9),
    ];
    let objects = placed
        .into_iter()
        .map(|(name, x)| object(name, x))
        .collect();
    let scene = Scene {
        materials: vec![material],
        meshes,
        objects,
        ..Scene::default()
    };
    let lookup = SceneLookup::new(&scene);
    let narrow = build_geometry::<f32>(&scene, &lookup, AcceleratorKind::Linear, &())
        .expect("it can be built");
    assert_eq!(narrow.collapsed_meshes, [1, 6]);
    let wide = build_geometry::<f64>(&scene, &lookup, AcceleratorKind::Linear, &())
        .expect("it can be built");
    assert_eq!(wide.collapsed_meshes, [0; 0]);
}
