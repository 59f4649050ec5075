//! `--rung` and `--without`: from the command line to the picture and its metadata.

use crate::support::Sandbox;

/// A white floor under the sun, with a ball between them, and a view of the floor in the ball's
/// shadow.
const SCENE: &str = r#"
format = 1
render = { size = [8, 8], samples = 1, max_depth = 3 }
cameras = [{ pose.look_at = { eye = [4, 1, 0], target = [0, 0, 0] }, projection.pinhole = { vertical_fov = 2 } }]
lights = [{ kind.directional = { to_light = [0, 1, 0] }, colour = 1 }]
materials = [{ name = "white", model.classic = {} }]
objects = [
  { shape.plane = { point = [0, 0, 0], normal = [0, 1, 0] }, material = "white" },
  { shape.sphere = { centre = [0, 3, 0], radius = 0.5 }, material = "white" },
]
"#;

/// Protects: an effect switched off by either flag is absent from the picture; a rung of samples
/// sets their number; the metadata of the file list the choices, so that the picture can be
/// rendered again.
#[test]
fn choices_reach_picture_and_file() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let render = |flags: &[&str]| {
        let words = [
            &[
                "render",
                "room.scene.toml",
                "-o",
                "a.exr",
                "--stats",
                "s.json",
                "-q",
            ],
            flags,
        ]
        .concat();
        sandbox.run(&words).exits_with(0).prints("");
        let stored_picture = sandbox.stored("a.exr");
        let stats = std::fs::read_to_string(sandbox.path("s.json")).expect("a file");
        let stats: serde_json::Value = serde_json::from_str(&stats).expect("JSON");
        let samples = stats["samples"].as_u64().expect("a number");
        (
            stored_picture.picture.rgb,
            stored_picture.texts["raywright_settings"].clone(),
            samples,
            stats["rays"]["shadow"].as_u64(),
        )
    };
    let (dark, plain, samples, requested) = render(&[]);
    assert!(
        dark.iter().all(|pixel| *pixel == [0.0; 3]) && samples == 64 && requested > Some(0),
        "{samples} {requested:?}"
    );
    assert!(
        !plain.contains("rung") && !plain.contains("without"),
        "{plain}"
    );
    for (flags, message) in [
        (["--without", "shadows"], " without=shadows"),
        (["--rung", "shadows=off"], " rung:shadows=off"),
    ] {
        let (lit, settings, _, requested) = render(&flags);
        assert!(
            lit.iter().flatten().all(|x| (x - 1.0).abs() < 1e-5) && requested == Some(0),
            "{flags:?}: {lit:?}"
        );
        assert_eq!(settings, format!("{plain}{message}"));
    }
    let (_, settings, samples, _) = render(&["--rung", "samples=4"]);
    assert!(
        samples == 4 * 64
            && settings.contains(" samples=4 ")
            && settings.ends_with(" rung:samples=4"),
        "{settings}"
    );
}

/// Protects: the output rung decides the file: PNGs of 16 bits or with dithered codes, read back as
/// written, and floats in an EXR named after the scene, while a PNG for floats is refused; the
/// linear picture is the same for all, and its film can be resumed with another output.
#[test]
fn outputs_are_what_was_asked_for() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let base = [
        "render",
        "room.scene.toml",
        "--without",
        "shadows",
        "--exposure",
        "-0.7",
        "--gamma",
        "none",
        "--tonemap",
        "none",
        "-q",
    ];
    let render = |more: &[&str]| sandbox.run(&[&base[..], more].concat());
    for (rung, name) in [
        ("8-bit", "8.png"),
        ("8-bit-dither", "d.png"),
        ("16-bit", "16.png"),
    ] {
        render(&[
            "--rung",
            &format!("output={rung}"),
            "-o",
            name,
            "-o",
            &format!("{name}.exr"),
        ])
        .exits_with(0)
        .prints("");
    }
    // This byte of a PNG's header is the bit depth.
    let bits = |name: &str| std::fs::read(sandbox.path(name)).expect("a picture")[24];
    assert_eq!((bits("8.png"), bits("d.png"), bits("16.png")), (8, 8, 16));
    let value = 2.0_f64.powf(-0.7);
    let values = |name: &str| {
        sandbox
            .stored(name)
            .picture
            .rgb
            .iter()
            .map(|pixel| f64::from(pixel[0]))
            .collect::<Vec<f64>>()
    };
    assert!(
        values("16.png")
            .iter()
            .all(|v| (v - value).abs() < 0.51 / 65535.0),
        "{:?} instead of {value}",
        values("16.png")
    );
    assert!(
        values("8.png")
            .iter()
            .all(|v| (v - value).abs() < 0.51 / 255.0)
    );
    let dithered = values("d.png");
    assert!(
        dithered.iter().any(|v| *v != dithered[0])
            && dithered.iter().all(|v| (v - value).abs() < 1.0 / 255.0),
        "{dithered:?}"
    );
    assert_eq!(
        sandbox.stored("8.png.exr").picture.rgb,
        sandbox.stored("16.png.exr").picture.rgb
    );

    render(&["--rung", "output=float"]).exits_with(0);
    assert_eq!(
        sandbox.stored("room.exr").picture.rgb,
        sandbox.stored("8.png.exr").picture.rgb
    );
    assert!(!sandbox.path("room.png").exists());
    render(&["--rung", "output=float", "-o", "f.png"])
        .exits_with(2)
        .prints_like("which .exr files alone can hold");

    render(&["--checkpoint", "a.film", "-o", "a.png"]).exits_with(0);
    render(&[
        "--resume",
        "a.film",
        "--rung",
        "output=16-bit",
        "-o",
        "b.png",
    ])
    .exits_with(0);
    assert_eq!(bits("b.png"), 16);
}
