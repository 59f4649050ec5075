//! Scenes, variants and times of a model on the command line, and motion in a scene: from the flags
//! to picture, report and file.

use raywright::core::settings::Sampling;
use raywright::prelude::*;

use crate::support::Sandbox;

/// A model with a white wall across the view in its first scene and nothing visible in its second;
/// red or blue by variant; animated from the left edge of the picture to beyond its right edge
/// within a second.
pub fn model() -> String {
    let floats = |numbers: &[f32]| {
        numbers
            .iter()
            .flat_map(|n| n.to_le_bytes())
            .collect::<Vec<_>>()
    };
    let corners = [-9.0, -9.0, 0.0, 9.0, -9.0, 0.0, 0.0, 18.0, 0.0];
    let bytes = [
        floats(&corners),
        floats(&[0.0, 1.0]),
        floats(&[0.0, 0.0, 0.0, 90.0, 0.0, 0.0]),
    ]
    .concat();
    let hex: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    let unlit = |colour: &str| {
        let extensions = r#""extensions": { "KHR_materials_unlit": {} }"#;
        format!(
            r#"{{ "pbrMetallicRoughness": {{ "baseColorFactor": [{colour}, 1] }}, {extensions} }}"#
        )
    };
    let (red, blue) = (unlit("1, 0, 0"), unlit("0, 0, 1"));
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0,
        "scenes": [{{ "name": "wall", "nodes": [0, 1] }}, {{ "name": "void", "nodes": [1] }}],
        "nodes": [{{ "mesh": 0 }}, {{ "camera": 0, "translation": [0, 0, 2] }}],
        "cameras": [{{ "type": "perspective", "perspective": {{ "yfov": 0.5, "znear": 0.1 }} }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "material": 0, "extensions": {{
            "KHR_materials_variants": {{ "mappings": [{{ "material": 1, "variants": [1] }}] }} }} }}] }}],
        "materials": [{red}, {blue}],
        "extensions": {{ "KHR_materials_variants": {{ "variants": [{{ "name": "red" }}, {{ "name": "blue" }}] }} }},
        "animations": [{{ "name": "leave", "channels": [{{ "sampler": 0, "target": {{ "node": 0, "path": "translation" }} }}],
            "samplers": [{{ "input": 1, "output": 2 }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }},
            {{ "bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR" }},
            {{ "bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3" }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}, {{ "buffer": 0, "byteOffset": 36, "byteLength": 8 }},
            {{ "buffer": 0, "byteOffset": 44, "byteLength": 24 }}],
        "buffers": [{{ "byteLength": 68, "uri": "data:application/octet-stream,{hex}" }}] }}"#
    )
}

/// Protects: `--scene`, `--variant` and `--at` select the visible part of a model, and `info` lists
/// the choices.
#[test]
fn parts_of_a_model_are_chosen() {
    let sandbox = Sandbox::new();
    sandbox.write("wall.gltf", model());
    let actual = |flags: &[&str]| {
        let words = [
            &[
                "render",
                "wall.gltf",
                "--size",
                "4x4",
                "--spp",
                "1",
                "--background",
                "0,1,0",
                "-q",
                "-o",
                "a.exr",
                "--allow-empty",
            ],
            flags,
        ]
        .concat();
        sandbox.run(&words).exits_with(0);
        sandbox.picture("a.exr").rgb[0]
    };
    let (red, blue, green) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
    for (flags, colour) in [
        (&[][..], red),
        (&["--scene", "void"], green),
        (&["--scene", "1"], green),
        (&["--scene", "wall", "--variant", "blue"], blue),
        (&["--at", "0"], red),
        (&["--at", "1"], green),
    ] {
        assert_eq!(actual(flags), colour, "{flags:?}");
    }
    let info = sandbox.run(&["info", "wall.gltf"]);
    for row in [
        "scenes      0 wall, 1 void",
        "variants    red, blue",
        "animations  leave (1 s)",
    ] {
        assert!(
            info.exits_with(0).text().lines().any(|line| line == row),
            "{row}\n{}",
            info.text()
        );
    }
}

/// Protects: an unknown choice is a usage error with one message that lists the known ones; so is
/// any choice for a file without choices.
#[test]
fn unknown_parts_are_listed() {
    let sandbox = Sandbox::new();
    sandbox.write("wall.gltf", model());
    sandbox.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let message_of = |flags: &[&str]| {
        sandbox
            .run(&[&["check"], flags].concat())
            .exits_with(2)
            .stderr
            .clone()
    };
    let scenes = "error: wall.gltf: has no scene `viod`; did you mean `void`? Its scenes: 0 `wall`, 1 `void`\n";
    assert_eq!(message_of(&["wall.gltf", "--scene", "viod"]), scenes);
    assert_eq!(
        message_of(&["wall.gltf", "--variant", "green"]),
        "error: wall.gltf: has no variant `green`; its variants: `red`, `blue`\n"
    );
    let none = "error: flat.obj has no scenes, but the scene `0` was requested\nhelp: only glTF and GLB files have scenes\n";
    assert_eq!(message_of(&["flat.obj", "--scene", "0"]), none);
}

/// Protects: motion is an effect that `explain` names, that a shutter enables, and that can be
/// switched off; an invalid motion is a problem of the scene, at its line.
#[test]
fn motion_is_explained_switched_off_and_checked() {
    let sandbox = Sandbox::new();
    let scene = |shutter: &str, end: &str| {
        format!(
            "format = 1\nclassic.ambient = 1\nmaterials = [{{ name = \"clay\", model.classic = {{}} }}]\n{shutter}\n[[objects]]\n\
            shape.sphere = {{ centre = [0, 0, 0], radius = 1 }}\nmaterial = \"clay\"\ntransform_end = [{end}]\n"
        )
    };
    let camera = "cameras = [{ pose.orbit = { target = [0, 0, 0], distance = 5, azimuth = 0, elevation = 0 }, shutter = [0, 1], \
        projection.pinhole.vertical_fov = 40 }]";
    let moves = "{ translate = [1, 0, 0] }";
    let status = |flags: &[&str]| {
        let words = [&["explain", "a.scene.toml", "--json"], flags].concat();
        let report: serde_json::Value =
            serde_json::from_str(sandbox.run(&words).exits_with(0).text()).expect("JSON");
        let effects = report["effects"].as_array().expect("a list");
        let motion = effects
            .iter()
            .find(|effect| effect["name"] == "motion")
            .expect("it is listed");
        (
            motion["status"].as_str().expect("a word").to_owned(),
            motion["because"].as_str().expect("a text").to_owned(),
        )
    };
    let told = |status: &str, because: &str| (status.to_owned(), because.to_owned());
    sandbox.write("a.scene.toml", scene(camera, moves));
    assert_eq!(
        status(&[]),
        told("simulated", "something moves while the shutter is open")
    );
    assert_eq!(
        status(&["--without", "motion"]),
        told("left-out", "switched off")
    );
    sandbox.write("a.scene.toml", scene("", moves));
    assert_eq!(
        status(&[]),
        told(
            "left-out",
            "the camera has no shutter, so the picture shows the scene at time 0"
        )
    );
    sandbox.write("a.scene.toml", scene(camera, ""));
    assert_eq!(
        status(&[]),
        told("absent", "nothing moves while the shutter is open")
    );
    sandbox.write(
        "a.scene.toml",
        scene(camera, "{ rotate = { axis = [0, 1, 0], degrees = 180 } }"),
    );
    let message = sandbox
        .run(&["check", "a.scene.toml"])
        .exits_with(3)
        .stderr
        .clone();
    assert!(
        message.contains("a.scene.toml:8:") && message.contains("less than 180 degrees"),
        "{message}"
    );
}

/// Protects: `--frames all` covers the whole animation, or the chosen one, and fails with a message
/// without any.
#[test]
fn films_last_as_long_as_animations() {
    let sandbox = Sandbox::new();
    sandbox.write("wall.gltf", model());
    let run = |words: &str| sandbox.run(&words.split(' ').collect::<Vec<_>>());
    let film = "render wall.gltf --size 4x4 --spp 1 -q -o f%d.exr --frames";
    run(&format!("{film} all:4")).exits_with(0);
    assert_eq!(
        sandbox
            .names()
            .iter()
            .filter(|name| name.starts_with('f'))
            .count(),
        4
    );
    let kept: Vec<_> = (0..4)
        .map(|i| sandbox.picture(&format!("f{i}.exr")).rgb)
        .collect();
    run(&format!("{film} 0..1:4")).exits_with(0);
    (0..4).for_each(|i| assert!(sandbox.picture(&format!("f{i}.exr")).rgb == kept[i], "{i}"));
    run(&format!("{film} all:4 --animation leave")).exits_with(0);
    run(&format!("{film} all:4 --animation come"))
        .exits_with(2)
        .prints_like("leave");
    run(&format!("{film} all:1e9"))
        .exits_with(2)
        .prints_like("1000000000 pictures are too many");
    run("render preset:pendulum -s 4x4 -q -o p%d.exr --frames all:1").exits_with(0);
    let films = sandbox.names();
    let count = films.iter().filter(|name| name.starts_with('p')).count();
    assert_eq!(count, 7, "a period of 2π seconds");
    run("render preset:quadrics -q --frames all:25")
        .exits_with(2)
        .prints_like(
            "--frames all needs an animation longer than 0 s, or a scene file with a `period`",
        );
    run("render - -q --frames all:25")
        .exits_with(2)
        .prints_like("standard input can be read only once");
    run("render wall.gltf wall.gltf -q --frames all:25")
        .exits_with(2)
        .prints_like("--frames all needs a single model");
}

/// Protects: `info` as JSON: counts, names, choices, supported extensions, bounds and memory.
#[test]
fn models_are_told_as_json() {
    let sandbox = Sandbox::new();
    let text = model().replacen(
        "\"asset\"",
        "\"extensionsUsed\": [\"VENDOR_fog\", \"KHR_materials_variants\"], \"asset\"",
        1,
    );
    sandbox.write("wall.gltf", text);
    let run = sandbox.run(&["info", "wall.gltf", "--json"]);
    let printed: serde_json::Value = serde_json::from_str(run.exits_with(0).text()).expect("JSON");
    assert_eq!(
        (printed["notation"].as_str(), printed["scenes"][0].as_str()),
        (Some("glTF 2.0"), Some("wall"))
    );
    assert_eq!(printed["variants"], serde_json::json!(["red", "blue"]));
    assert_eq!(printed["animations"][0]["seconds"], 1.0);
    let extensions = serde_json::json!([{ "name": "KHR_materials_variants", "required": false, "read": true },
        { "name": "VENDOR_fog", "required": false, "read": false }]);
    assert_eq!(printed["extensions"], extensions);
    assert!(
        printed["bounds"][1][0].is_number()
            && printed["memory"]["geometry"]
                .as_u64()
                .is_some_and(|bytes| bytes > 0),
        "{printed}"
    );
    let shown = printed["triangles"]["shown"].as_u64();
    assert!(
        shown.is_some_and(|n| n > 0) && printed["triangles"]["stored"].as_u64() == shown,
        "{printed}"
    );
}

/// Protects: files outside the scene's folder are read only with `--allow-outside`, which the
/// refusal names.
#[test]
fn files_outside_are_read_where_allowed() {
    let sandbox = Sandbox::new();
    sandbox.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    std::fs::create_dir(sandbox.path("sub")).expect("a folder");
    sandbox.write(
        "sub/b.scene.toml",
        "format = 1\n[[models]]\nfile = \"../a.obj\"\n",
    );
    let refused = sandbox.run(&["check", "sub/b.scene.toml"]);
    assert!(
        refused.exits_with(3).stderr.contains("--allow-outside"),
        "{}",
        refused.stderr
    );
    sandbox
        .run(&["check", "sub/b.scene.toml", "--allow-outside"])
        .exits_with(0);
}

/// Protects: an object of a pixel, which a coarse picture misses, is not nothing to see.
#[test]
fn an_object_of_a_pixel_is_something_to_see() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "a.scene.toml",
        "format = 1\nsky.constant = 1\n[[cameras]]\npose.look_at = { eye = [0, 0, 10], target = [0, 0, 0] }\nprojection.pinhole = { vertical_fov = 40 }\n\
        [[materials]]\nname = \"m\"\nmodel.classic = { colour = 1 }\n\
        [[objects]]\nshape.sphere = { centre = [0.013, 0.017, 0], radius = 0.012 }\nmaterial = \"m\"\n",
    );
    let line = "render a.scene.toml -s 640x480 --spp 1 -o a.png -q";
    sandbox
        .run(&line.split(' ').collect::<Vec<_>>())
        .exits_with(0);
}

/// Protects: a picture without any hit reports the scene's position; a picture with hits does not.
/// A model without lights gets the studio, whatever emits in it, with a note; a deliberately dark
/// scene stays dark.
#[test]
fn nothing_to_be_seen_is_told() {
    let sandbox = Sandbox::new();
    let obj = "mtllib a.mtl\nusemtl lamp\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl wall\nv 0 0 -1\nv 90 0 -1\nv 0 90 -1\nf 4 5 6\n";
    sandbox.write("a.obj", obj);
    sandbox.write(
        "a.mtl",
        "newmtl lamp\nKd 0 0 0\nKe 0.1 0.1 0.1\nnewmtl wall\nKd 1 1 1\n",
    );
    let render = |file: &str, target: &str| {
        let words = [
            "render",
            file,
            "--size",
            "8x8",
            "--spp",
            "1",
            "--eye",
            "0.2,0.2,5",
            "--target",
            target,
            "-o",
            "a.png",
        ];
        sandbox.run(&words)
    };
    let there = render("a.obj", "0.2,0.2,0").exits_with(0).stderr.clone();
    assert!(
        !there.contains("no camera ray")
            && there.contains("the file has no camera: the whole scene is shown"),
        "{there}"
    );
    std::fs::remove_file(sandbox.path("a.png")).expect("a picture");
    let away = render("a.obj", "0.2,0.2,9");
    let message = "no camera ray hits an object: the scene lies between (0.000000, 0.000000, -1.000000) and (90.000000, 90.000000, 0.000000)";
    away.exits_with(3)
        .prints_like(message)
        .prints_like("help: --allow-empty writes the picture nevertheless");
    assert!(!sandbox.path("a.png").exists());
    let flags = [
        "render",
        "a.obj",
        "--size",
        "8x8",
        "--spp",
        "1",
        "--eye",
        "0.2,0.2,5",
        "--target",
        "0.2,0.2,9",
    ];
    sandbox
        .run(&[&flags[..], &["--allow-empty", "-o", "a.png"]].concat())
        .exits_with(0)
        .prints_like(message);
    // A crop may well be empty.
    sandbox
        .run(&[&flags[..], &["--crop", "0,0,2,2", "-o", "a.png"]].concat())
        .exits_with(0)
        .prints_like(message);
    // A single non-empty picture of a scene is enough.
    sandbox
        .run(&[
            "render",
            "a.obj",
            "--views",
            "left,front",
            "--size",
            "8x8",
            "--spp",
            "1",
            "-o",
            "v%d.png",
        ])
        .exits_with(0);
    sandbox.write("thin.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n");
    sandbox.run(&["render", "thin.obj"]).exits_with(3).prints_like(
        "thin.obj: there is nothing to see: the file has only points and lines, which are not rendered",
    );
    sandbox.write("void.scene.toml", "format = 1\n");
    sandbox
        .run(&[
            "render",
            "a.obj",
            "void.scene.toml",
            "--size",
            "8x8",
            "--spp",
            "1",
            "-o",
            "n%d.png",
        ])
        .exits_with(3)
        .prints_like("void.scene.toml: there is nothing to see: the scene has no object")
        .prints_like("wrote n0.png");
    sandbox.write(
        "dim.scene.toml",
        "format = 1\n[[models]]\nfile = \"a.obj\"\n",
    );
    let dim = render("dim.scene.toml", "0.2,0.2,0")
        .exits_with(0)
        .stderr
        .clone();
    assert!(!dim.contains("sky") && !dim.contains("studio"), "{dim}");
}

/// Protects: loading, preparing and rendering by the library gives the command line's picture, bit
/// for bit, also for models and scenes without light, with a report of added light; no environment
/// means none for both.
#[test]
fn the_library_completes_what_the_program_completes() {
    let sandbox = Sandbox::new();
    sandbox.write("bare.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    sandbox.write(
        "lamp.gltf",
        model().replace("KHR_materials_unlit", "VENDOR_nothing"),
    );
    sandbox.write(
        "bare.scene.toml",
        "format = 1\n[[models]]\nfile = \"bare.obj\"\n",
    );
    for file in ["bare.obj", "lamp.gltf", "bare.scene.toml"] {
        for (env, source) in [
            (None, None),
            (Some(["--env", "none"]), Some(EnvironmentSource::None)),
        ] {
            let words = [
                "render", file, "--size", "12x8", "--spp", "4", "-o", "a.exr", "-q",
            ];
            sandbox
                .run(
                    &[
                        &words[..],
                        env.iter().flatten().copied().collect::<Vec<_>>().as_slice(),
                    ]
                    .concat(),
                )
                .exits_with(0);
            let environment = EnvironmentOptions {
                source: source.clone(),
                ..EnvironmentOptions::default()
            };
            let options = LoadOptions {
                environment,
                ..LoadOptions::default()
            };
            let loaded = load(&Input::Path(sandbox.path(file)), &options).expect("a model");
            let own = Settings::from_scene(&loaded.scene);
            let settings = Settings {
                size: [12, 8],
                sampling: Sampling::from_spp(&loaded.scene, Some(4)),
                ..own
            };
            let picture = prepare(&loaded.scene, &settings, &())
                .expect("a small picture")
                .render(&())
                .picture;
            assert_eq!(picture.rgb, sandbox.picture("a.exr").rgb, "{file}, {env:?}");
            assert_eq!(
                picture.rgb.iter().any(|pixel| *pixel != [0.0; 3]),
                source.is_none(),
                "{file}, {env:?}"
            );
            assert_eq!(
                loaded.added_sky,
                source.is_none().then_some(LightShortage::NoLight),
                "{file}"
            );
        }
    }
}

/// Protects: a model with up axis z is upright from every side, on the studio's ground: STL by
/// default, others on request. It looks like one written with y up; the camera alone can still be
/// rotated, except in views that choose their own up vector.
#[test]
fn models_stand_upright() {
    // A wedge, which looks different from each side.
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
        [0.0, 0.0, 3.0],
    ];
    let facets = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let obj = |turned: bool| {
        let place = |[x, y, z]: [f64; 3]| if turned { [x, z, -y] } else { [x, y, z] };
        let vertices = corners.map(|corner| place(corner).map(|x| x.to_string()).join(" "));
        let faces = facets.map(|facet| facet.map(|i| (i + 1).to_string()).join(" "));
        vertices.map(|vertex| format!("v {vertex}\n")).concat()
            + &faces.map(|face| format!("f {face}\n")).concat()
    };
    let facet = |facet: [usize; 3]| {
        let corners = facet.map(|i| {
            format!(
                "vertex {}\n",
                corners[i].map(|x: f64| x.to_string()).join(" ")
            )
        });
        format!(
            "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n",
            corners.concat()
        )
    };
    let sandbox = Sandbox::new();
    sandbox.write("y.obj", obj(true));
    sandbox.write("z.obj", obj(false));
    sandbox.write(
        "z.stl",
        format!("solid s\n{}endsolid\n", facets.map(facet).concat()),
    );
    let render = [
        "-v",
        "--size",
        "24x24",
        "--spp",
        "16",
        "--views",
        "front,left,top,iso",
        "-o",
        "%d.exr",
    ];
    let pictures = |args: &[&str]| {
        let run = sandbox.run(&[&["render"], args, &render[..]].concat());
        run.exits_with(0);
        let views = (0..4).map(|i| sandbox.picture(&format!("{i}.exr")).rgb);
        (views.collect::<Vec<_>>(), run.stderr)
    };
    let (upright, _) = pictures(&["y.obj"]);
    let (printed, message) = pictures(&["z.stl"]);
    assert!(
        message.contains("STL files state no up axis: z is assumed; --up y makes y the up axis"),
        "{message}"
    );
    let (lying, _) = pictures(&["z.stl", "--up", "y"]);
    let far = |a: &[Vec<[f32; 3]>], b: &[Vec<[f32; 3]>]| {
        let pairs = a
            .iter()
            .flatten()
            .flatten()
            .zip(b.iter().flatten().flatten());
        pairs.map(|(a, b)| (a - b).abs()).sum::<f32>() / (4 * 24 * 24 * 3) as f32
    };
    for (label, other) in [
        ("STL", &printed),
        ("OBJ", &pictures(&["z.obj", "--up", "z"]).0),
    ] {
        assert!(
            far(&upright, other) < 1e-3,
            "{label}: {}",
            far(&upright, other)
        );
    }
    assert!(far(&upright, &lying) > 0.01);
    let refused = sandbox.run(&["render", "z.obj", "--up", "0,0,1", "--view", "front"]);
    refused
        .exits_with(2)
        .prints_like("turn a model instead: --up z");
    sandbox
        .run(&["render", "preset:whitted", "--up", "z"])
        .exits_with(2)
        .prints_like("only models have an up axis");
    sandbox
        .run(&["render", "z.obj", "--up", "w"])
        .exits_with(2)
        .prints_like("expected an axis of the model");
}

/// A square of two triangles, in three formats.
fn square() -> [(&'static str, &'static str); 3] {
    let stl = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    [
        (
            "square.obj",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n",
        ),
        ("square.stl", stl),
        ("square.ply", ply),
    ]
}

/// Protects: every command that reads a model reads all formats, from a file and through a pipe,
/// with the same picture; a picture of a pipe gets a default name, and a piped model that names
/// other files gets a message that they are unavailable.
#[test]
fn formats_and_pipes() {
    let sandbox = Sandbox::new();
    let render = [
        "render", "--up", "y", "--size", "16x12", "--spp", "4", "-q", "-o", "a.exr",
    ];
    let mut pictures = Vec::new();
    for (name, text) in square() {
        sandbox.write(name, text);
        let format = ["Wavefront OBJ", "STL", "PLY"]
            .into_iter()
            .find(|format| format.to_lowercase().ends_with(&name[7..]))
            .expect("known");
        for (input, bytes) in [(name, ""), ("-", text)] {
            let info = sandbox.pipe(&["info", input], bytes.as_bytes());
            let rows: Vec<String> = info
                .exits_with(0)
                .text()
                .lines()
                .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "))
                .collect();
            for row in [
                format!("format {format}"),
                "triangles 2 in 1 mesh".to_owned(),
            ] {
                assert!(rows.contains(&row), "{row}\n{}", info.text());
            }
            sandbox
                .pipe(&["check", input], bytes.as_bytes())
                .exits_with(0);
            assert!(
                sandbox
                    .pipe(&["explain", input], bytes.as_bytes())
                    .exits_with(0)
                    .text()
                    .contains("sky")
            );
            sandbox
                .pipe(&[&render[..], &[input]].concat(), bytes.as_bytes())
                .exits_with(0);
            pictures.push(sandbox.picture("a.exr").rgb);
        }
    }
    assert!(
        pictures[0].iter().any(|pixel| *pixel != pictures[0][0])
            && pictures.iter().all(|picture| *picture == pictures[0])
    );
    let before = sandbox.names();
    sandbox
        .pipe(
            &["render", "--size", "2x2", "--spp", "1", "-q", "-"],
            square()[1].1.as_bytes(),
        )
        .exits_with(0);
    let new: Vec<String> = sandbox
        .names()
        .into_iter()
        .filter(|name| !before.contains(name))
        .collect();
    assert_eq!(new, ["standard-input.png"]);
    let beside = sandbox.pipe(
        &["check", "-"],
        b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    );
    beside
        .exits_with(0)
        .prints_like("standard input: material library: `a.mtl` cannot be read: a scene read from a pipe has no folder");
    sandbox
        .pipe(&["check", "-"], b"")
        .exits_with(3)
        .prints_like("error: standard input: is empty");
    sandbox
        .pipe(
            &["check", "-", "--variant", "red"],
            square()[2].1.as_bytes(),
        )
        .exits_with(2)
        .prints_like("has no variants");
}
