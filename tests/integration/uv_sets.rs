//! Sets of texture coordinates: a material uses the set it names, whatever other sets the mesh has.

use std::sync::Arc;

use raywright::core::scene::{Image, ImageData, MeshSource, PixelData, Scene, TransformStep};
use raywright::core::settings::Sampling;
use raywright::core::{Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

use crate::support::Sandbox;

/// A triangle across the picture whose three sets lie in columns 1, 2 and 3 of an image of four
/// colours.
const SCENE: &str = r#"
format = 1
[[cameras]]
pose.look_at = { eye = [0, 0, 4], target = [0, 0, 0] }
projection.pinhole = { vertical_fov = 20 }
[[images]]
name = "columns"
path = "columns.png"
[[textures]]
name = "columns"
image = "columns"
filter = "nearest"
[[materials]]
name = "shown"
model.physical = { unlit = true, base_colour_texture = { name = "columns", uv_set = SET } }
[[meshes]]
name = "sheet"
[meshes.source.inline]
positions = [[-9, -9, 0], [9, -9, 0], [0, 9, 0]]
indices = [[0, 1, 2]]
uvs = [[[0.3, 0], [0.4, 0], [0.45, 0]], [[0.55, 0], [0.6, 0], [0.7, 0]], [[0.8, 0], [0.9, 0], [0.95, 0]]]
[[objects]]
shape.mesh = "sheet"
material = "shown"
"#;

const COLOURS: [[f32; 4]; 4] = [
    [1.0, 1.0, 1.0, 1.0],
    [1.0, 0.0, 0.0, 1.0],
    [0.0, 1.0, 0.0, 1.0],
    [0.0, 0.0, 1.0, 1.0],
];

/// The scene with its image in memory, and the warnings about the mesh.
fn scene(set: u32) -> (Scene, Vec<String>) {
    let sandbox = Sandbox::new();
    sandbox.write("uv.scene.toml", SCENE.replace("SET", &set.to_string()));
    let loaded = load(
        &Input::Path(sandbox.path("uv.scene.toml")),
        &LoadOptions::default(),
    )
    .unwrap_or_else(|e| panic!("{e}"));
    let mut scene = loaded.scene;
    let data = ImageData {
        width: 4,
        height: 1,
        pixels: PixelData::Linear(COLOURS.to_vec()),
    };
    scene.images = vec![Image {
        data: Some(Arc::new(data)),
        ..scene.images[0].clone()
    }];
    let message_of = loaded
        .warnings
        .into_iter()
        .map(|warning| warning.message)
        .filter(|message| message.contains("uv_set"));
    (scene, message_of.collect())
}

fn shown(scene: &Scene) -> [f32; 3] {
    let settings = Settings {
        size: [3, 3],
        sampling: Sampling::General(1),
        ..Settings::from_scene(scene)
    };
    prepare(scene, &settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
        .picture
        .rgb[4]
}

/// Protects: sets 0, 1, 2 are used, for a mesh that is single, reversed or shared; a missing set
/// gives (0, 0), which is the first column, and a warning with line and object. Sets from 2 on were
/// once replaced silently by set 0.
#[test]
fn each_set_is_read_and_a_missing_one_is_named() {
    for (set, column) in [(0, 1), (1, 2), (2, 3), (3, 0), (7, 0)] {
        let (mut scene, messages) = scene(set);
        let expected: [f32; 3] = core::array::from_fn(|k| COLOURS[column][k]);
        assert_eq!(shown(&scene), expected, "set {set}");
        match column {
            0 => assert!(
                messages[0].contains("line 22, objects[0]: ")
                    && messages[0].contains(&format!("`uv_set` {set}")),
                "{messages:?}"
            ),
            _ => assert!(messages.is_empty(), "{messages:?}"),
        }
        scene.objects[0].transform = vec![TransformStep::Scale([-1.0, 1.0, 1.0])];
        assert_eq!(shown(&scene), expected, "set {set}, mirrored");
        scene.objects.push(scene.objects[0].clone());
        scene.objects[1]
            .transform
            .push(TransformStep::Translate([0.0, 0.0, -5.0]));
        assert_eq!(shown(&scene), expected, "set {set}, shared");
    }
}

/// Protects: a set without entries counts as missing, and reading it does not panic.
#[test]
fn an_empty_set_is_no_set() {
    let (mut scene, _) = scene(1);
    let MeshSource::Inline(data) = &scene.meshes[0].source else {
        panic!("the mesh is in the file")
    };
    let mut data = (**data).clone();
    data.uvs[1].clear();
    scene.meshes[0].source = MeshSource::Inline(Arc::new(data));
    assert_eq!(shown(&scene), [1.0; 3]);
    assert_eq!(
        raywright::core::validate::find_missing_uv_sets(&scene).len(),
        1
    );
}
