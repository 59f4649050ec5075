//! Tests of the shared reference pictures, where available.

use super::*;

/// Returns a folder of the shared reference pictures, or prints a line and returns `None` without
/// them.
fn reference(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/reference")
        .join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    #[expect(clippy::print_stderr, reason = "a skipped test says so")]
    {
        eprintln!("skipped: shared data not found ({})", folder.display());
    }
    None
}

/// Protects: the reference's display picture follows from its linear one, code for code. Exceptions
/// lie on the border of two codes, where the single-precision power of the shader moved them.
#[test]
fn reference_display_pictures_are_reproduced() {
    let Some(folder) = reference("whitted") else {
        return;
    };
    let display = Display {
        tone_map: ToneMap::Aces,
        curve: TransferCurve::Gamma22,
        exposure_stops: 0.0,
        ..Display::PLAIN
    };
    for (linear, shown) in [
        ("t0_640x360/linear.exr", "t0_640x360/final.png"),
        ("t2p5_640x360/linear.exr", "t2p5_640x360/final.png"),
        ("t12_256x256/linear.exr", "t12_256x256/final.png"),
        (
            "bounces_t2p5_320x180/linear_b4.exr",
            "bounces_t2p5_320x180/final_b4.png",
        ),
    ] {
        let linear = read_picture(&folder.join(linear), &Limits::default())
            .unwrap()
            .picture;
        let expected = Display {
            curve: TransferCurve::None,
            ..Display::PLAIN
        }
        .to_codes(
            &read_picture(&folder.join(shown), &Limits::default())
                .unwrap()
                .picture,
        );
        let codes = display.to_codes(&linear);
        let different: Vec<usize> = (0..codes.len())
            .filter(|&i| codes[i] != expected[i])
            .collect();
        assert!(
            different.len() * 10_000 <= codes.len(),
            "{shown}: {} of {}",
            different.len(),
            codes.len()
        );
        for i in different {
            let step = 255.0 * exact_display_value(linear.rgb[i / 3][i % 3]);
            assert!(
                (step.fract() - 0.5).abs() < 2e-4,
                "{shown}: code {} of {step} is no rounding matter",
                codes[i]
            );
        }
    }
}

/// The reference's tone map and transfer curve, with the platform's power function.
fn exact_display_value(x: f32) -> f64 {
    let x = f64::from(x);
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14))
        .clamp(0.0, 1.0)
        .powf(1.0 / 2.2)
}

/// Protects: every reference picture can be read, with its colour or its named channels.
#[test]
fn every_reference_picture_is_read() {
    let Some(root) = reference("") else { return };
    let (mut folders, mut exr, mut png) = (vec![root], 0, 0);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let Ok(format) = PictureFormat::from_path(&path) else {
                continue;
            };
            let read =
                read_picture(&path, &Limits::default()).unwrap_or_else(|error| panic!("{error}"));
            let aov = path.file_stem().is_some_and(|stem| stem == "aov");
            assert_eq!(read.has_colour, !aov, "{}", path.display());
            assert_eq!(aov, !read.picture.layers.is_empty(), "{}", path.display());
            if format == PictureFormat::Exr {
                exr += 1
            } else {
                png += 1
            }
        }
    }
    assert!(exr >= 40 && png >= 20, "{exr} {png}");
    let aov = read_picture(
        &reference("whitted/t0_640x360").unwrap().join("aov.exr"),
        &Limits::default(),
    )
    .unwrap()
    .picture;
    let names: Vec<&str> = aov.layers.iter().map(|layer| layer.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "material", "normal.X", "normal.Y", "normal.Z", "object", "t"
        ]
    );
    // The camera is 6.5 units from the scene's centre and 2.8 above it; the sky is at the top.
    let distance = aov.layer("t").unwrap();
    assert_eq!(distance.samples[0], -1.0);
    assert!((1.0..8.0).contains(&distance.samples[180 * 640 + 320]));
}
