//! Models placed by a scene file with all their contents: names, transforms, lights, replaced
//! materials, and sharing.

use glam::DVec3;
use raywright_core::prepare;
use raywright_core::scene::{Colour, LightKind, MaterialModel, ModelFile, Scene};
use raywright_core::{Settings, affine_from_steps};
use raywright_io::{Error, ErrorKind, Input, LoadOptions, LoadedScene};
use serde_json::json;

use crate::built;
use crate::keyed::KeyedTriangle;
use crate::shared::mesh_of;

/// Loads a scene file of these lines in a folder of models.
fn scene(folder: &std::path::Path, lines: &str) -> Result<LoadedScene, Error> {
    let path = folder.join("a.scene.toml");
    std::fs::write(&path, format!("format = 1\n{lines}\n")).expect("a file");
    let loaded = raywright_io::load(&Input::Path(path.clone()), &LoadOptions::default())?;
    let problems = raywright_core::validate::validate(&loaded.scene);
    assert!(problems.is_empty(), "{problems:?}");
    Ok(loaded)
}

/// World position of an object's origin.
fn origin(loaded: &LoadedScene, object: usize) -> DVec3 {
    affine_from_steps(&loaded.scene.objects[object].transform).translation
}

/// Protects: what a model has brought is located at the model's entry, whatever place it has in the
/// scene's lists, and what the text has itself at its own.
#[test]
fn what_models_bring_is_located_at_their_entry() {
    let folder = tempfile::tempdir().expect("a folder");
    built::models(folder.path());
    let lines = "[[objects]]\nshape.sphere = { centre = [0, 0, 0], radius = 1 }\nmaterial = \"m\"\n[[materials]]\nname = \"m\"\n\
        model.physical = { base_colour = 0.5 }\n[[models]]\nfile = \"square.glb\"\n[[models]]\nfile = \"square.glb\"";
    let loaded = scene(folder.path(), lines).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.scene.objects.len(), 5);
    let line = |path: &str| {
        let place = loaded.source.format_value_position(path);
        place.rsplit(':').nth(1).map(str::to_owned)
    };
    let paths = ["objects[0]", "objects[2]", "objects[4]", "materials[1]"];
    assert_eq!(
        paths.map(|path| line(path).unwrap_or_default()),
        ["2", "8", "10", "8"]
    );
}

/// Protects: a placed model has its objects under its own hierarchy and then the scene's transform,
/// its lights likewise and no brighter, its material with its texture under unique names; its
/// camera is ignored.
#[test]
fn models_bring_what_they_have() {
    let folder = tempfile::tempdir().expect("a folder");
    built::models(folder.path());
    let placed = r#"[[models]]
        file = "square.glb"
        transform = [{ scale = [2, 2, 2] }, { rotate = { axis = [0, 1, 0], degrees = 90 } }, { translate = [0, 0, 100] }]"#;
    let loaded = scene(folder.path(), placed).unwrap_or_else(|e| panic!("{e}"));
    let Scene {
        objects,
        lights,
        cameras,
        models,
        images,
        textures,
        materials,
        ..
    } = &loaded.scene;
    assert_eq!(
        (objects.len(), lights.len(), cameras.len(), models.len()),
        (2, 1, 0, 0)
    );
    // Without the scene's transform, the root is at (1, 2, 3); doubled and rotated, x becomes −z
    // and z becomes x.
    let point = DVec3::new(6.0, 4.0, 98.0);
    assert!(
        origin(&loaded, 0).distance(point) < 1e-9,
        "{:?}",
        origin(&loaded, 0)
    );
    let LightKind::Spot {
        position,
        direction,
        ..
    } = lights[0].kind
    else {
        panic!("{:?}", lights[0])
    };
    assert!(
        DVec3::from(position).distance(point + DVec3::Y * 4.0) < 1e-6,
        "{position:?}"
    );
    assert!(
        DVec3::from(direction).distance(DVec3::NEG_X) < 1e-6,
        "{direction:?}"
    );
    assert_eq!(lights[0].colour, Colour([100.0, 50.0, 25.0]));
    let names = [
        &images[0].name,
        &textures[0].name,
        &materials[0].name,
        &lights[0].name,
    ];
    assert!(
        names.iter().all(|name| name.starts_with("square/")),
        "{names:?}"
    );
    let MaterialModel::Physical(paint) = &materials[0].model else {
        panic!("{materials:?}")
    };
    assert_eq!(
        paint
            .base_colour_texture
            .as_ref()
            .map(|texture| &texture.name),
        Some(&textures[0].name)
    );
    assert!(prepare(&loaded.scene, &Settings::from_scene(&loaded.scene), &()).is_ok());
}

/// Protects: a second placement shares meshes and images and may have another material; names of
/// the scene and of other models stay distinct; an OBJ file is a model, too.
#[test]
fn models_are_shared_and_told_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    built::models(folder.path());
    let lines = r#"
        materials = [{ name = "gold", model.physical.metallic = 1 }, { name = "square/default", model.physical = {} }]
        models = [{ file = "square.glb" }, { file = "square.glb", transform = [{ translate = [9, 0, 0] }], materials = { default = "gold" } },
            { file = "square.obj", name = "square" }]"#;
    let loaded = scene(folder.path(), lines).unwrap_or_else(|e| panic!("{e}"));
    let materials: Vec<&str> = loaded
        .scene
        .objects
        .iter()
        .map(|object| object.material.as_str())
        .collect();
    assert_eq!(
        materials[..4],
        ["square/default (1)", "square/default (1)", "gold", "gold"]
    );
    assert!(
        materials[4..]
            .iter()
            .all(|name| name.starts_with("square/"))
            && materials.len() == 6,
        "{materials:?}"
    );
    let meshes: Vec<*const _> = loaded
        .scene
        .objects
        .iter()
        .map(|object| std::ptr::from_ref(mesh_of(&loaded, object)))
        .collect();
    assert!(meshes[..4].iter().all(|mesh| *mesh == meshes[0]) && meshes[4] != meshes[0]);
    assert_eq!(origin(&loaded, 2) - origin(&loaded, 0), DVec3::X * 9.0);
    // One picture of the GLB file, one of the OBJ file.
    assert_eq!(loaded.scene.images.len(), 2);
}

/// Protects: each placed model has its own scene, variant and time; an unknown one is an error at
/// its key that lists the known ones.
#[test]
fn models_are_chosen_from() {
    let made = KeyedTriangle::new().animated(
        "",
        0,
        "translation",
        "LINEAR",
        &[0.0, 0.0, 5.0, 4.0, 8.0, 5.0],
    );
    let path = made.write();
    let folder = path.parent().expect("a folder");
    let lines = r#"
        models = [{ file = "made.gltf" }, { file = "made.gltf", time = 2 }, { file = "made.gltf", scene = "1" },
            { file = "made.gltf", variant = "blue" }]"#;
    let loaded = scene(folder, lines).unwrap_or_else(|e| panic!("{e}"));
    let places: Vec<DVec3> = (0..4).map(|i| origin(&loaded, i)).collect();
    let five = DVec3::Z * 5.0;
    assert_eq!(
        places,
        [five, five + DVec3::new(2.0, 4.0, 0.0), DVec3::X * 7.0, five]
    );
    assert_ne!(
        loaded.scene.objects[0].material,
        loaded.scene.objects[3].material
    );
    for (model, words) in [
        (r#"scene = "dya""#, "has no scene `dya`; did you mean `day`"),
        (r#"variant = "grey""#, "has no variant `grey`"),
        (
            r#"materials = { paint = "gold" }"#,
            "`made.gltf` has no material `paint`",
        ),
        (r#"materials = { paint = "golt" }"#, "`golt`"),
        (
            r#"transform = [{ translate = [1e15, 1e15, 1e15] }, { scale = [1e-3, 1e-3, 1e3] }]"#,
            "farther than 1e15",
        ),
        ("time = nan", "time"),
    ] {
        let lines = format!(
            "materials = [{{ name = \"gold\", model.physical = {{}} }}]\n[[models]]\nfile = \"made.gltf\"\n{model}"
        );
        let error = scene(folder, &lines).expect_err(model);
        let text = error.to_string();
        assert_eq!(error.kind(), ErrorKind::Input, "{text}");
        assert!(
            text.contains(words) && text.contains("a.scene.toml:5:"),
            "{words}: {text}"
        );
    }
    for (file, kind, words) in [
        ("none.glb", ErrorKind::File, "no such file"),
        ("../none.glb", ErrorKind::Input, "--allow-outside"),
        ("a.scene.toml", ErrorKind::Input, ".obj, .gltf and .glb"),
    ] {
        let error = scene(folder, &format!("[[models]]\nfile = \"{file}\"")).expect_err(file);
        assert!(
            error.kind() == kind && error.to_string().contains(words),
            "{error}"
        );
        assert!(error.to_string().contains("a.scene.toml:3:"), "{error}");
    }
    std::fs::write(folder.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("a file");
    let timed = scene(folder, "[[models]]\nfile = \"a.obj\"\ntime = 1")
        .expect_err("an OBJ file does not move")
        .to_string();
    assert!(
        timed.contains("no scenes, variants or animations") && timed.contains(":4:"),
        "{timed}"
    );
}

/// Protects: a scene built without the loader gets an error for its models, which were not loaded.
#[test]
fn models_that_nobody_loads_are_missing() {
    let scene = Scene {
        models: vec![ModelFile {
            file: "a.glb".to_owned(),
            ..ModelFile::default()
        }],
        ..Scene::default()
    };
    let error = prepare(&scene, &Settings::from_scene(&scene), &())
        .err()
        .expect("nothing was loaded")
        .to_string();
    assert!(
        error.contains("models[0].file") && error.contains("a.glb"),
        "{error}"
    );
    let again: Scene =
        serde_json::from_value(json!({ "format": 1, "models": [{ "file": "a.glb" }] }))
            .expect("a scene");
    assert_eq!(again, scene);
}
