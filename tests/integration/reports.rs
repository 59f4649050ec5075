//! Small inputs modelled on bug reports of other programs, each with a known result: silently wrong
//! pictures, refusals of valid files, and file handling.

use std::path::{Path, PathBuf};

use crate::support::{Sandbox, shared};

/// A sky of radiance 1 everywhere, as a scene and, rendered from it, as an environment map.
const WHITE: &str = r#"
format = 1
render = { size = [16, 8], samples = 1 }
sky = { constant = 1 }
cameras = [{ pose.look_at = { eye = [0, 0, 4], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 5 } }]
"#;

/// A matte white ball that fills the picture.
const BALL: &str = r#"
format = 1
render = { size = [8, 8], samples = 256, integrator = "path", max_depth = 8 }
cameras = [{ pose.look_at = { eye = [0, 0, 5], target = [0, 0, 0] }, projection.orthographic = { height = 0.5 } }]
materials = [{ name = "white", model.classic = { colour = 1 } }]
objects = [{ shape.sphere = { centre = [0, 0, 0], radius = 1 }, material = "white" }]
"#;

/// A sky alone, viewed straight up or straight down.
const EMPTY: &str = r#"
format = 1
parameters = { up = 1 }
render = { size = [8, 8], samples = 4, integrator = "path" }
cameras = [{ pose.look_at = { eye = [0, 0, 0], target = [0, "up", 0.1] }, projection.pinhole = { vertical_fov = 20 } }]
"#;

/// Path of an input; `None` without the shared data.
fn report(name: &str) -> Option<PathBuf> {
    Some(shared("cases/reports")?.join(name))
}

/// Mean radiance of a picture's centre, and the messages of the render.
fn middle(sandbox: &Sandbox, file: &Path, flags: &[&str]) -> ([f32; 3], String) {
    let file = file.to_str().expect("a readable path");
    let run = sandbox.run(
        &[
            &[
                "render",
                file,
                "-o",
                "a.exr",
                "-q",
                "--threads",
                "1",
                "--allow-empty",
            ],
            flags,
        ]
        .concat(),
    );
    run.exits_with(0);
    let picture = sandbox.picture("a.exr");
    let [width, height] = [picture.width as usize, picture.height as usize];
    let inner = |edge: usize| edge / 4..(edge - edge / 4).max(edge / 4 + 1);
    let at = |x: usize, y: usize| picture.rgb[y * width + x];
    let pixels: Vec<[f32; 3]> = inner(height)
        .flat_map(|y| inner(width).map(move |x| (x, y)))
        .map(|(x, y)| at(x, y))
        .collect();
    (
        [0, 1, 2].map(|k| pixels.iter().map(|pixel| pixel[k]).sum::<f32>() / pixels.len() as f32),
        run.stderr,
    )
}

#[track_caller]
fn near(name: &str, found: [f32; 3], expected: [f32; 3], tolerance: f32) {
    assert!(
        found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() <= tolerance),
        "{name}: {found:?} instead of {expected:?}"
    );
}

/// Protects: alpha layers, masks, unlit surfaces, numbers at and beyond their limits, integers and
/// keys as written by programs, and extreme spotlights look as glTF and its extensions specify.
#[test]
fn models_of_reports_look_as_their_texts_say() {
    let sandbox = Sandbox::new();
    let background: &[&str] = &["--env", "none", "--background", "1,1,1"];
    let blue: &[&str] = &["--env", "none", "--background", "0,0,1"];
    let dark: &[&str] = &["--env", "none"];
    for (name, flags, expected, tolerance) in [
        ("layers-black-10.gltf", background, [0.5987; 3], 0.002),
        ("layers-white-12.gltf", background, [1.0; 3], 0.002),
        ("mask-equal-half.gltf", dark, [1.0; 3], 0.0),
        ("mask-equal-one.gltf", dark, [1.0; 3], 0.0),
        ("cutoff-2.gltf", blue, [0.0, 0.0, 1.0], 0.0),
        ("cutoff-1.5-texture.gltf", blue, [0.0, 0.0, 1.0], 0.0),
        ("unlit-emissive.gltf", dark, [0.0, 0.0, 1.0], 1e-6),
        ("unlit-emissive-texture.gltf", dark, [0.0, 0.0, 1.0], 1e-6),
        ("spot-hard.gltf", dark, [0.99; 3], 0.015),
        ("spot-hard-default.gltf", dark, [0.99; 3], 0.015),
        ("limit-range.gltf", dark, [0.99; 3], 0.015),
        ("integers-decimal.gltf", dark, [1.0, 0.0, 0.0], 1e-6),
        ("integers-exponent.gltf", dark, [1.0, 0.0, 0.0], 1e-6),
        ("duplicate-key.gltf", dark, [1.0, 0.0, 0.0], 1e-6),
        ("duplicate-key-material.gltf", dark, [1.0, 0.0, 0.0], 1e-6),
    ] {
        let Some(file) = report(name) else { return };
        near(
            name,
            middle(
                &sandbox,
                &file,
                &[&["--size", "16x16", "--spp", "256"], flags].concat(),
            )
            .0,
            expected,
            tolerance,
        );
    }
}

/// Protects: in a white furnace mirrors of index 0, indices beyond a limit, specular-glossiness
/// materials, and rough thin walls return their specified reflectance, and white walls all light.
#[test]
fn furnaces_of_reports() {
    let sandbox = Sandbox::new();
    sandbox.write("white.scene.toml", WHITE);
    sandbox
        .run(&["render", "white.scene.toml", "-o", "white.exr", "-q"])
        .exits_with(0);
    let furnace = [
        "--env",
        "white.exr",
        "--size",
        "16x16",
        "--spp",
        "1024",
        "--integrator",
        "path",
        "--max-depth",
        "64",
    ];
    for (name, expected, tolerance) in [
        ("ior-0-black.gltf", [1.0; 3], 0.01),
        ("ior-0-specular.gltf", [0.5; 3], 0.01),
        ("limit-ior.gltf", [0.996; 3], 0.005),
        ("specgloss-red.gltf", [0.82, 0.19, 0.19], 0.01),
        ("specgloss-two-colours.gltf", [0.5, 0.15, 0.5], 0.01),
        ("specgloss-texture.gltf", [0.86, 0.37, 0.37], 0.01),
        ("thin-rough-0.9.gltf", [1.0; 3], 0.01),
        ("thin-rough-scene.scene.toml", [1.0; 3], 0.01),
    ] {
        let Some(file) = report(name) else { return };
        near(
            name,
            middle(
                &sandbox,
                &file,
                if name.ends_with("toml") {
                    &furnace[2..]
                } else {
                    &furnace
                },
            )
            .0,
            expected,
            tolerance,
        );
    }
}

/// Protects: radiance pictures with either signature, skies of luminance or of a named layer, and
/// skies in a window are read correctly; an infinite texel gives a warning and does not spoil the
/// picture.
#[test]
fn skies_of_reports() {
    let sandbox = Sandbox::new();
    sandbox.write("ball.scene.toml", BALL);
    sandbox.write("empty.scene.toml", EMPTY);
    for name in [
        "rgbe-run-length.hdr",
        "rgbe-comments.hdr",
        "sky-luminance.exr",
        "sky-layer.exr",
        "sky-window-overscan.exr",
    ] {
        let Some(sky) = report(name) else { return };
        let sky = sky.to_str().expect("a readable path");
        near(
            name,
            middle(&sandbox, Path::new("ball.scene.toml"), &["--env", sky]).0,
            [1.0; 3],
            0.02,
        );
    }
    let sky = report("sky-window-half.exr").expect("the others are there");
    let sky = sky.to_str().expect("a readable path");
    for (up, expected) in [("up=1", 1.0), ("up=-1", 0.0)] {
        near(
            up,
            middle(
                &sandbox,
                Path::new("empty.scene.toml"),
                &["--env", sky, "--set", up],
            )
            .0,
            [expected; 3],
            1e-3,
        );
    }
    for name in ["sky-inf-half.exr", "sky-inf-float.exr"] {
        let sky = report(name).expect("the others are there");
        let run = sandbox.run(&[
            "render",
            "ball.scene.toml",
            "-o",
            "b.exr",
            "--env",
            sky.to_str().expect("a readable path"),
        ]);
        assert!(
            run.code == Some(3) || run.stderr.contains("infinite") || run.stderr.contains("finite"),
            "{name}: {}",
            run.stderr
        );
        if run.code == Some(0) {
            assert!(
                sandbox
                    .picture("b.exr")
                    .rgb
                    .iter()
                    .flatten()
                    .all(|x| *x < 1e7),
                "{name}"
            );
        }
    }
}

/// Protects: meshes far from zero look as near zero, faces of a PLY each have their own image,
/// indices of zero and CR line ends are read, and a byte order mark is not part of a scene.
#[test]
fn meshes_and_marks_of_reports() {
    let sandbox = Sandbox::new();
    let Some(far) = report("far-node.gltf") else {
        return;
    };
    let text = std::fs::read_to_string(&far)
        .expect("readable")
        .replace("448200.25", "0")
        .replace("4865499.5", "0");
    sandbox.write("near-node.gltf", text);
    let stairs =
        std::fs::read_to_string(report("far-text.obj").expect("beside it")).expect("readable");
    let moved: String = stairs
        .lines()
        .map(|line| match line.strip_prefix("v ") {
            Some(rest) => {
                let numbers: Vec<f64> = rest
                    .split_whitespace()
                    .map(|x| x.parse().expect("a number"))
                    .collect();
                format!(
                    "v {:.3} {:.3} {:.3}\n",
                    numbers[0] - 448_200.25,
                    numbers[1] - 4_865_499.469,
                    numbers[2] - 20.2
                )
            }
            None => format!("{line}\n"),
        })
        .collect();
    sandbox.write("near-text.obj", moved);
    let size = ["--size", "64x48", "--spp", "16"];
    for (name, twin) in [
        ("far-node.gltf", "near-node.gltf"),
        ("far-text.obj", "near-text.obj"),
    ] {
        let pictures = [report(name).expect("there"), sandbox.path(twin)].map(|file| {
            sandbox
                .run(
                    &[
                        &[
                            "render",
                            file.to_str().expect("readable"),
                            "-o",
                            "a.exr",
                            "-q",
                        ],
                        &size[..],
                    ]
                    .concat(),
                )
                .exits_with(0);
            sandbox.picture("a.exr")
        });
        let far = |i: &usize| {
            (0..3).any(|k| (pictures[0].rgb[*i][k] - pictures[1].rgb[*i][k]).abs() > 0.02)
        };
        let off = (0..pictures[0].rgb.len()).filter(far).count();
        assert!(
            off * 100 <= pictures[0].rgb.len(),
            "{name}: {off} pixels are not its twin's"
        );
    }
    for (name, left, right) in [
        ("ply-two-textures.ply", 0, 1),
        ("ply-upper-texture.ply", 0, 0),
    ] {
        let file = report(name).expect("there");
        sandbox
            .run(&[
                "render",
                file.to_str().expect("readable"),
                "-o",
                "a.exr",
                "-q",
                "--size",
                "32x32",
                "--view",
                "front",
            ])
            .exits_with(0);
        let picture = sandbox.picture("a.exr");
        for (x, channel) in [(12, left), (19, right)] {
            let pixel = picture.rgb[16 * 32 + x];
            let brightest = (0..3)
                .max_by(|a, b| pixel[*a].total_cmp(&pixel[*b]))
                .expect("three");
            assert!(
                brightest == channel && pixel[channel] > 2.0 * pixel[(channel + 1) % 3],
                "{name}: {pixel:?} at {x}"
            );
        }
    }
    for name in [
        "obj-zero-normal.obj",
        "obj-zero-texcoord.obj",
        "obj-cr-both.obj",
        "obj-cr-alone.obj",
        "bom-scene.scene.json",
        "bom-crlf-scene.scene.json",
    ] {
        let file = report(name).expect("there");
        let run = sandbox.run(&["check", file.to_str().expect("readable")]);
        run.exits_with(0);
        if name.starts_with("obj-zero") {
            assert_eq!(
                run.stderr.matches("warning").count(),
                1,
                "{name}: {}",
                run.stderr
            );
        }
    }
    let red = report("obj-cr-both.obj").expect("there");
    let (pixel, message) = middle(&sandbox, &red, &["--size", "32x32"]);
    assert!(
        pixel[0] > 3.0 * pixel[1] && message.is_empty(),
        "{pixel:?}: {message}"
    );
}

/// Protects: a render with few noisy pixels ends below its target error.
#[test]
fn small_subjects_of_reports_converge() {
    let sandbox = Sandbox::new();
    for (name, flags) in [
        (
            "small-subject.scene.toml",
            &["--background", "transparent"][..],
        ),
        (
            "small-model.gltf",
            &["--background", "transparent", "-s", "64x64"],
        ),
    ] {
        let Some(file) = report(name) else { return };
        let file = file.to_str().expect("readable");
        let requested = [
            "render",
            file,
            "-o",
            "a.png",
            "--stats",
            "s.json",
            "--max-error",
            "0.05",
            "--integrator",
            "path",
        ];
        sandbox.run(&[&requested[..], flags].concat()).exits_with(0);
        let stats: serde_json::Value =
            serde_json::from_slice(&std::fs::read(sandbox.path("s.json")).expect("written"))
                .expect("JSON");
        let samples = stats["samples"].as_f64().expect("a number") / 48.0 / 48.0;
        assert!(samples < 4096.0, "{name}: {samples} samples a pixel");
    }
}

/// Protects: a picture keeps its file permissions, an impossible file name is refused before the
/// first ray, a crop keeps its window, and a threshold of `compare` includes alpha.
#[test]
fn manners_of_reports() {
    let sandbox = Sandbox::new();
    sandbox.write("white.scene.toml", WHITE);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        sandbox.write("p.png", "");
        std::fs::set_permissions(
            sandbox.path("p.png"),
            std::fs::Permissions::from_mode(0o600),
        )
        .expect("may be set");
        sandbox
            .run(&["render", "white.scene.toml", "-o", "p.png", "-q"])
            .exits_with(0);
        let mode = std::fs::metadata(sandbox.path("p.png"))
            .expect("there")
            .permissions()
            .mode();
        assert_eq!(mode & 0o777, 0o600);
    }
    let long = format!("{}.png", "n".repeat(260));
    let run = sandbox.run(&[
        "render",
        "white.scene.toml",
        "--stats",
        "s.json",
        "-o",
        &long,
    ]);
    run.exits_with(4);
    assert!(!sandbox.path("s.json").exists(), "{}", run.stderr);
    sandbox
        .run(&[
            "render",
            "white.scene.toml",
            "-s",
            "64x48",
            "--crop",
            "10,20,16,8",
            "-o",
            "c.exr",
            "-q",
        ])
        .exits_with(0);
    let meta = exr::meta::MetaData::read_from_file(sandbox.path("c.exr"), false).expect("an EXR");
    let (header, whole) = (
        &meta.headers[0],
        meta.headers[0].shared_attributes.display_window,
    );
    let corner = header.own_attributes.layer_position;
    assert_eq!(
        (
            (corner.x(), corner.y()),
            (header.layer_size.x(), header.layer_size.y())
        ),
        ((10, 20), (16, 8))
    );
    assert_eq!(
        (
            (whole.position.x(), whole.position.y()),
            (whole.size.x(), whole.size.y())
        ),
        ((0, 0), (64, 48))
    );
    let Some(cut) = report("compare-alpha-cut.png") else {
        return;
    };
    let filled = report("compare-alpha-filled.png").expect("beside it");
    for threshold in ["--max-rmse", "--max-flip"] {
        let [cut, filled] = [&cut, &filled].map(|file| file.to_str().expect("readable"));
        sandbox
            .run(&["compare", cut, filled, threshold, "0.001"])
            .exits_with(1);
    }
}
