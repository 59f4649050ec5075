//! Two levels where a scene repeats a mesh, one otherwise, and the same picture with both.

use std::sync::Arc;

use raywright::core::effects::{Effect, EffectStatus};
use raywright::core::scene::{
    Camera, ClassicMaterial, Colour, ColourInput, Generator, GeneratorKind, Light, LightKind,
    Material, MaterialModel, Mesh, MeshData, MeshSource, Object, Pinhole, Pose, Projection, Scene,
    Shape, SideRule, TransformStep,
};
use raywright::core::settings::Settings;
use raywright::core::{RenderOutput, prepare};

/// A closed tetrahedron in which no two faces are alike.
fn tetrahedron() -> MeshData {
    MeshData {
        positions: vec![
            [0.0_f32, 0.0, 0.0],
            [1.0, 0.0, 0.1],
            [0.2, 1.1, 0.0],
            [0.1, 0.2, 0.9],
        ]
        .into(),
        indices: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..MeshData::default()
    }
}

/// Affine maps of all kinds: rotations, non-uniform scales, shear, a reflection.
fn maps() -> Vec<Vec<TransformStep>> {
    let turn = |axis, degrees| TransformStep::Rotate { axis, degrees };
    vec![
        vec![
            TransformStep::Scale([1.0, 2.0, 0.5]),
            turn([0.0, 1.0, 0.3], 40.0),
            TransformStep::Translate([-2.0, -0.5, 0.0]),
        ],
        vec![
            TransformStep::Scale([-1.2, 0.8, 1.0]),
            turn([1.0, 0.0, 0.0], -25.0),
            TransformStep::Translate([0.6, 0.0, -0.4]),
        ],
        vec![TransformStep::Matrix([
            [0.7, 0.5, 0.0, 1.2],
            [0.0, 0.9, 0.2, -0.6],
            [0.1, 0.0, 1.0, 0.3],
        ])],
    ]
}

/// Builds a scene whose objects share a mesh, or each have a copy.
fn scene(shared: bool) -> Scene {
    let mesh = |name: String| Mesh {
        name,
        source: MeshSource::Inline(Arc::new(tetrahedron())),
        model: None,
    };
    let name = |i: usize| {
        if shared {
            "mesh".to_owned()
        } else {
            format!("mesh {i}")
        }
    };
    let object = |(i, transform): (usize, Vec<TransformStep>)| Object {
        name: String::new(),
        shape: Shape::Mesh(name(i)),
        material: "matte".to_owned(),
        side: SideRule::Outside,
        face_viewer: true,
        casts_shadow: true,
        transform,
        transform_end: None,
    };
    let classic = ClassicMaterial {
        colour: ColourInput::Constant(Colour([0.8, 0.6, 0.4])),
        ..ClassicMaterial::default()
    };
    let mut scene = Scene {
        cameras: vec![Camera {
            name: String::new(),
            pose: Pose::LookAt {
                eye: [0.5, 1.5, 6.0],
                target: [0.0, 0.2, 0.0],
                up: [0.0, 1.0, 0.0],
            },
            projection: Projection::Pinhole(Pinhole {
                vertical_fov: Some(35.0),
                ..Pinhole::default()
            }),
            aspect: None,
            fit: Default::default(),
            pose_end: None,
            shutter: None,
        }],
        lights: vec![Light {
            name: String::new(),
            kind: LightKind::Directional {
                to_light: [0.5, 1.0, 0.8],
            },
            colour: Colour::WHITE,
            shadows: true,
            specular: true,
        }],
        materials: vec![Material {
            name: "matte".to_owned(),
            model: MaterialModel::Classic(Box::new(classic)),
        }],
        meshes: if shared {
            vec![mesh(name(0))]
        } else {
            (0..maps().len()).map(|i| mesh(name(i))).collect()
        },
        objects: maps().into_iter().enumerate().map(object).collect(),
        ..Scene::default()
    };
    scene.classic.ambient = Colour([0.1; 3]);
    scene.render.size = [160, 90];
    scene.render.samples = 4;
    scene
}

fn render(scene: &Scene) -> (RenderOutput, usize, u64) {
    let ready = prepare(scene, &Settings::from_scene(scene), &()).unwrap_or_else(|e| panic!("{e}"));
    (
        ready.render(&()),
        ready.table_sizes().instances,
        ready.memory().geometry,
    )
}

/// Protects: only meshes shown more than once are instanced, with the picture of the flattened
/// copies: the same facets, normals by the inverse transpose, and outsides preserved under a
/// reflection. Rounding may move a silhouette.
#[test]
fn shared_meshes_are_instances_and_look_like_copies() {
    let (shared, instances, _) = render(&scene(true));
    let (copies, none, _) = render(&scene(false));
    assert_eq!((instances, none), (maps().len(), 0));
    let pairs = shared.picture.rgb.iter().zip(&copies.picture.rgb);
    let off = pairs
        .filter(|(a, b)| (0..3).any(|k| (a[k] - b[k]).abs() > 1e-4))
        .count();
    assert!(
        off <= shared.picture.rgb.len() / 1000,
        "{off} of {} pixels differ",
        shared.picture.rgb.len()
    );
    let lit = shared.picture.rgb.iter().filter(|p| p[0] > 0.05).count();
    assert!(lit > 1000, "only {lit} pixels show anything");
}

/// Protects: a mesh with a thousand instances is stored once.
#[test]
fn repeated_meshes_are_stored_once() {
    let mut many = scene(true);
    let first = many.objects[0].clone();
    many.objects.extend((0..1000).map(|i| {
        let mut object = first.clone();
        object
            .transform
            .push(TransformStep::Translate([f64::from(i), 0.0, -5.0]));
        object
    }));
    let (_, instances, bytes) = render(&many);
    assert_eq!(instances, maps().len() + 1000);
    // A map with its inverse takes about 200 bytes in f64, a tree node 128.
    assert!(bytes < 1003 * 600, "{bytes} bytes");
}

/// The scene with every map twice, one behind the other, so that each visible side is shown more
/// than once.
fn sided_scene(shared: bool, sides: [SideRule; 3], some_cast_none: bool) -> Scene {
    let mut scene = scene(shared);
    let (mut meshes, mut objects) = (scene.meshes.clone(), scene.objects.clone());
    for (i, object) in objects.iter_mut().enumerate() {
        object
            .transform
            .push(TransformStep::Translate([0.4, 0.9, -0.8]));
        if let (false, Shape::Mesh(name)) = (shared, &mut object.shape) {
            *name = format!("second {i}");
            meshes[i].name.clone_from(name);
        }
    }
    scene.meshes.extend(meshes.into_iter().filter(|_| !shared));
    scene.objects.extend(objects);
    for (i, object) in scene.objects.iter_mut().enumerate() {
        object.side = sides[i % 3];
        object.casts_shadow = !(some_cast_none && i % 2 == 0);
    }
    scene
}

/// Protects: visible sides and shadow casting belong to each object, whichever objects share its
/// mesh, in any order.
#[test]
fn objects_that_share_a_mesh_keep_their_own_rules() {
    use SideRule::{Both, Inside, Outside};
    let differing = |a: &RenderOutput, b: &RenderOutput| {
        let pairs = a.picture.rgb.iter().zip(&b.picture.rgb);
        pairs
            .filter(|(a, b)| (0..3).any(|k| (a[k] - b[k]).abs() > 1e-4))
            .count()
    };
    let alike = render(&sided_scene(true, [Outside; 3], false)).0;
    let minimum = alike.picture.rgb.len() / 1000;
    for sides in [
        [Outside, Inside, Both],
        [Inside, Both, Outside],
        [Both, Outside, Inside],
    ] {
        let (shared, instances, _) = render(&sided_scene(true, sides, false));
        let copies = render(&sided_scene(false, sides, false)).0;
        assert_eq!(instances, 2 * maps().len());
        let off = differing(&shared, &copies);
        assert!(
            off <= minimum,
            "{sides:?}: {off} pixels differ from those of copies"
        );
        assert!(
            differing(&shared, &alike) > 10 * minimum,
            "{sides:?}: the sides show nowhere"
        );
        let quiet = render(&sided_scene(true, sides, true)).0;
        let off = differing(&quiet, &render(&sided_scene(false, sides, true)).0);
        assert!(
            off <= minimum,
            "{sides:?}, some cast no shadow: {off} pixels differ from those of copies"
        );
        assert!(
            differing(&quiet, &shared) > 2 * minimum,
            "{sides:?}: the shadows show nowhere"
        );
    }
}

/// Protects: the report of effects agrees with the built instances, even for repetitions by a
/// generator, and for two objects that show two sides and share nothing.
#[test]
fn instances_are_reported_where_they_are_built() {
    let mut one = scene(true);
    one.objects.truncate(1);
    let grid = |x| GeneratorKind::Grid {
        counts: [x, 1, 1],
        origin: [0.0; 3],
        step: [1.5, 0.0, 0.0],
    };
    let generated = |x, object: &Object| Scene {
        objects: Vec::new(),
        generators: vec![Generator {
            kind: grid(x),
            object: object.clone(),
        }],
        ..one.clone()
    };
    let sides = vec![
        one.objects[0].clone(),
        Object {
            side: SideRule::Inside,
            ..one.objects[0].clone()
        },
    ];
    let both = Scene {
        objects: one.objects.clone(),
        ..generated(1, &one.objects[0])
    };
    for (scene, expected) in [
        (generated(1, &one.objects[0]), 0),
        (generated(3, &one.objects[0]), 3),
        (both, 2),
        (
            Scene {
                objects: sides,
                ..one.clone()
            },
            0,
        ),
    ] {
        let ready =
            prepare(&scene, &Settings::from_scene(&scene), &()).unwrap_or_else(|e| panic!("{e}"));
        let reported = ready.effects().status(Effect::Instances) == EffectStatus::Simulated;
        assert_eq!(
            (ready.table_sizes().instances, reported),
            (expected, expected > 0)
        );
    }
}

/// A hilly sheet of 2·n² triangles.
fn sheet(n: u32) -> MeshData {
    let at = |i: u32| i as f32 / n as f32;
    let positions = (0..=n)
        .flat_map(|z| (0..=n).map(move |x| [at(x), at(x) * at(z), at(z)]))
        .collect::<Vec<[f32; 3]>>()
        .into();
    let corner = |x: u32, z: u32| z * (n + 1) + x;
    let indices = (0..n).flat_map(|z| {
        (0..n).flat_map(move |x| {
            let [a, b, c, d] = [
                corner(x, z),
                corner(x + 1, z),
                corner(x + 1, z + 1),
                corner(x, z + 1),
            ];
            [[a, c, b], [a, d, c]]
        })
    });
    MeshData {
        positions,
        indices: indices.collect(),
        ..MeshData::default()
    }
}

/// Protects: objects that show a mesh from the same side share one tree, and the report counts
/// every tree.
#[test]
fn a_hundred_instances_share_a_tree() {
    let mut one = scene(true);
    one.meshes[0].source = MeshSource::Inline(Arc::new(sheet(24)));
    one.objects.truncate(1);
    let first = one.objects[0].clone();
    let many = |sides: &[SideRule]| {
        let object = |i: usize| {
            let mut object = Object {
                side: sides[i % sides.len()],
                ..first.clone()
            };
            object
                .transform
                .push(TransformStep::Translate([i as f64, 0.0, -5.0]));
            object
        };
        Scene {
            objects: (0..100).map(object).collect(),
            ..one.clone()
        }
    };
    let (_, none, copy) = render(&one);
    let (_, instances, shared) = render(&many(&[SideRule::Outside]));
    assert_eq!((none, instances), (0, 100));
    assert!(
        copy > 1152 * 36,
        "{copy} bytes are too few for the triangles"
    );
    assert!(
        shared < 2 * copy + 100 * 300,
        "{shared} bytes for a hundred, {copy} for one"
    );
    let (_, _, sided) = render(&many(&[SideRule::Outside, SideRule::Inside]));
    assert!(
        (2 * copy..3 * copy + 100 * 300).contains(&sided),
        "{sided} bytes for a hundred with two sides, {copy} for one"
    );
}
