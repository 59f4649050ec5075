//! `--env`, `--env-rotation`, `--env-strength`: another sky from the command line.

use crate::support::Sandbox;

const FLOOR: &str = r#"
format = 1
render = { size = [6, 4], samples = 64, integrator = "path", max_depth = 3 }
cameras = [{ pose.look_at = { eye = [0, 1, 4], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 5 } }]
materials = [{ name = "grey", model.classic = { colour = 0.5 } }]
objects = [{ shape.plane = { point = [0, 0, 0], normal = [0, 1, 0] }, material = "grey" }]
"#;

/// A picture of the sky alone: blue above, and dim.
const SKY: &str = r#"
format = 1
render = { size = [16, 8], samples = 1 }
sky = { constant = [0.1, 0.2, 0.4] }
cameras = [{ pose.look_at = { eye = [0, 1, 4], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 5 } }]
"#;

/// Protects: a floor under another sky has that light, scaled as requested; `none` means no light;
/// errors have their kind, and the environment's own file is never overwritten.
#[test]
fn environments_replace_the_sky() {
    let sandbox = Sandbox::new();
    sandbox.write("floor.scene.toml", FLOOR);
    sandbox.write("sky.scene.toml", SKY);
    sandbox
        .run(&["render", "sky.scene.toml", "-o", "sky.exr", "-q"])
        .exits_with(0);
    let floor = |flags: &[&str]| {
        sandbox
            .run(&[&["render", "floor.scene.toml", "-o", "a.exr", "-q"], flags].concat())
            .exits_with(0)
            .prints("");
        let rgb = sandbox.picture("a.exr").rgb;
        [0, 1, 2].map(|k| rgb.iter().map(|pixel| pixel[k]).sum::<f32>() / rgb.len() as f32)
    };
    let near = |found: [f32; 3], expected: [f32; 3]| {
        assert!(
            found
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() <= 0.02 * b),
            "{found:?} instead of {expected:?}"
        );
    };
    near(floor(&["--env", "sky.exr"]), [0.05, 0.1, 0.2]);
    near(
        floor(&[
            "--env",
            "sky.exr",
            "--env-strength",
            "3",
            "--env-rotation",
            "-77",
        ]),
        [0.15, 0.3, 0.6],
    );
    // Linear from 1 above to 0.4 below: 0.7 + 0.3 · ⅔ on a surface that faces up.
    near(floor(&["--env", "default"]), [0.45; 3]);
    near(floor(&["--env", "none"]), [0.0; 3]);
    for (flags, code, words) in [
        (
            &["--env", "none", "--env-rotation", "5"][..],
            2,
            "--env default",
        ),
        (&["--env", "missing.hdr"], 4, "missing.hdr"),
        (&["--env", "floor.scene.toml"], 3, "HDR"),
        (
            &["--env", "sky.exr", "--env-strength", "-1"],
            2,
            "--env-strength",
        ),
    ] {
        let run = sandbox.run(&[&["render", "floor.scene.toml", "-o", "b.exr"], flags].concat());
        assert!(
            run.exits_with(code).stderr.contains(words),
            "{flags:?}: {}",
            run.stderr
        );
    }
    let before = std::fs::read(sandbox.path("sky.exr")).expect("a file");
    let run = sandbox.run(&[
        "render",
        "floor.scene.toml",
        "--env",
        "sky.exr",
        "-o",
        "sky.exr",
    ]);
    assert!(
        run.code != Some(0) && std::fs::read(sandbox.path("sky.exr")).expect("a file") == before,
        "{}",
        run.stderr
    );
}
