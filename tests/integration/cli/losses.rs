//! Lost samples of a picture: commands that make a picture report non-finite samples and truncated
//! paths.

use serde_json::Value;

use crate::support::Sandbox;

/// A sky that is NaN on one side.
const HALF: &str = r#"
format = 1
render = { size = [64, 8], samples = 4 }
sky.expression = "d.x < 0 ? sqrt(d.x) : 1"
[[cameras]]
pose.look_at = { eye = [0, 0, 2], target = [0, 0, 0] }
projection.pinhole = { vertical_fov = 10 }
"#;

/// More invisible surfaces than a ray may cross.
const LAYERS: &str = r#"
format = 1
render = { size = [2, 1], samples = 1 }
[[cameras]]
pose.look_at = { eye = [0, 0, 2], target = [0, 0, 0] }
projection.pinhole = { vertical_fov = 10 }
[[materials]]
name = "absent"
model.physical = { opacity = 0.2, alpha = { mask = { cutoff = 0.5 } } }
[[generators]]
kind.grid = { counts = [1, 1, 8193], origin = [0, 0, -1], step = [0, 0, 1e-4] }
object = { shape.disk = { centre = [0, 0, 0], normal = [0, 0, 1], radius = 2 }, material = "absent" }
"#;

fn stats(sandbox: &Sandbox, name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(sandbox.path(name)).expect("a file"))
        .expect("JSON")
}

/// Protects: dropped samples are counted in the statistics, with a warning there and on standard
/// error, for both integrators; also for a resumed film, for merged parts, and for a denoised film.
#[test]
fn dropped_samples_are_told() {
    let sandbox = Sandbox::new();
    sandbox.write("half.scene.toml", HALF);
    let text = "(1024 of 2048 samples had to be dropped)";
    for integrator in ["whitted", "path"] {
        let run = sandbox.run(&[
            "render",
            "half.scene.toml",
            "--integrator",
            integrator,
            "-v",
            "-o",
            "a.exr",
            "--stats",
            "a.json",
        ]);
        run.exits_with(0).prints_like(text);
        let stats = stats(&sandbox, "a.json");
        assert_eq!(
            (&stats["samples"], &stats["dropped"], &stats["cut_short"]),
            (&1024.into(), &1024.into(), &0.into())
        );
        assert!(
            stats["warnings"][0]["message"]
                .as_str()
                .is_some_and(|message| message.ends_with(text)),
            "{}",
            stats["warnings"]
        );
    }
    for part in ["1", "2"] {
        let (part, film) = (format!("{part}/2"), format!("{part}.film"));
        sandbox
            .run(&[
                "render",
                "half.scene.toml",
                "--spp",
                "8",
                "--denoise",
                "--part",
                &part,
                "--checkpoint",
                &film,
            ])
            .exits_with(0);
    }
    let text = "(2048 of 4096 samples had to be dropped)";
    sandbox
        .run(&[
            "merge",
            "1.film",
            "2.film",
            "-o",
            "b.exr",
            "--checkpoint",
            "both.film",
        ])
        .exits_with(0)
        .prints_like(text);
    sandbox
        .run(&["denoise", "both.film", "-o", "c.exr"])
        .exits_with(0)
        .prints_like(text);
    let resumed = [
        "render",
        "half.scene.toml",
        "--spp",
        "16",
        "--denoise",
        "--resume",
        "both.film",
        "-o",
        "d.exr",
        "--stats",
        "d.json",
    ];
    sandbox
        .run(&resumed)
        .exits_with(0)
        .prints_like("(4096 of 8192 samples had to be dropped)");
    assert_eq!(stats(&sandbox, "d.json")["dropped"], 4096);
}

/// Protects: rays that end at the limit of crossed surfaces are counted with a warning, for both
/// integrators.
#[test]
fn rays_that_are_cut_short_are_told() {
    let sandbox = Sandbox::new();
    sandbox.write("layers.scene.toml", LAYERS);
    for integrator in ["whitted", "path"] {
        let run = sandbox.run(&[
            "render",
            "layers.scene.toml",
            "--integrator",
            integrator,
            "-v",
            "-o",
            "a.exr",
            "--stats",
            "a.json",
        ]);
        run.exits_with(0).prints_like(
            "rays end after 8192 surfaces that are cut out or partly transparent, so that objects behind these surfaces are missing, or after a million scatterings in a medium (2 rays ended there)",
        );
        let stats = stats(&sandbox, "a.json");
        assert_eq!(
            (&stats["dropped"], &stats["cut_short"]),
            (&0.into(), &2.into())
        );
        assert_eq!(stats["warnings"].as_array().map(Vec::len), Some(1));
    }
}
