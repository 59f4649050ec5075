//! `--rung` and `--without`: from the command line to the picture and to what the picture says of itself.

use crate::support::Desk;

/// A white floor under the sun, a ball in between, and the lit floor of the shadow's place in sight.
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

/// Protects: an effect that is switched off on the command line, by either word, is off in the picture; a rung of samples is as
/// many samples; and the picture's file names what was chosen, so that it can be made again.
#[test]
fn choices_reach_picture_and_file() {
    let desk = Desk::new();
    desk.write("room.scene.toml", SCENE);
    let render = |flags: &[&str]| {
        let words = [&["render", "room.scene.toml", "-o", "a.exr", "--stats", "s.json", "-q"], flags].concat();
        desk.run(&words).exits_with(0).says("");
        let stored = desk.stored("a.exr");
        let stats = std::fs::read_to_string(desk.path("s.json")).expect("a file");
        let stats: serde_json::Value = serde_json::from_str(&stats).expect("JSON");
        let samples = stats["samples"].as_u64().expect("a number");
        (stored.picture.rgb, stored.texts["raywright_settings"].clone(), samples, stats["rays"]["shadow"].as_u64())
    };
    let (dark, plain, samples, asked) = render(&[]);
    assert!(dark.iter().all(|pixel| *pixel == [0.0; 3]) && samples == 64 && asked > Some(0), "{samples} {asked:?}");
    assert!(!plain.contains("rung") && !plain.contains("without"), "{plain}");
    for (flags, told) in [(["--without", "shadows"], " without=shadows"), (["--rung", "shadows=off"], " rung:shadows=off")] {
        let (lit, settings, _, asked) = render(&flags);
        assert!(lit.iter().flatten().all(|x| (x - 1.0).abs() < 1e-5) && asked == Some(0), "{flags:?}: {lit:?}");
        assert_eq!(settings, format!("{plain}{told}"));
    }
    let (_, settings, samples, _) = render(&["--rung", "samples=4"]);
    assert!(samples == 4 * 64 && settings.contains(" samples=4 ") && settings.ends_with(" rung:samples=4"), "{settings}");
}
