//! `compare`: figures, thresholds and exit codes.

use serde_json::Value;

use crate::support::{Sandbox, carried};

/// Two pictures of the preset with different path depths.
fn desk_with_pictures() -> Option<Sandbox> {
    if !carried("whitted") {
        return None;
    }
    let sandbox = Sandbox::new();
    let render = ["render", "preset:whitted", "--size", "48x27", "-q"];
    sandbox
        .run(&[&render[..], &["-o", "a.exr", "-o", "a.png"]].concat())
        .exits_with(0);
    sandbox
        .run(
            &[
                &render[..],
                &["-o", "b.exr", "-o", "b.png", "--max-depth", "2"],
            ]
            .concat(),
        )
        .exits_with(0);
    Some(sandbox)
}

/// Protects: a picture is identical to itself, in both formats, and passes the strictest
/// thresholds.
#[test]
fn the_same_picture_is_identical() {
    let Some(sandbox) = desk_with_pictures() else {
        return;
    };
    for file in ["a.exr", "a.png"] {
        let strict = [
            "--max-rmse",
            "0",
            "--max-relmse",
            "0",
            "--max-relmse-trimmed",
            "0",
            "--max-flip",
            "0",
            "--min-psnr",
            "200",
        ];
        let run = sandbox.run(&[&["compare", file, file], &strict[..]].concat());
        run.exits_with(0).prints("");
        assert!(
            run.text().contains("identical  yes, bit for bit\n"),
            "{}",
            run.text()
        );
    }
}

/// Protects: a value beyond its threshold gives exit code 1 and is named; within the threshold, the
/// code is 0.
#[test]
fn thresholds_decide_the_exit_code() {
    let Some(sandbox) = desk_with_pictures() else {
        return;
    };
    let figures: Value = serde_json::from_str(
        sandbox
            .run(&["compare", "a.exr", "b.exr", "--json"])
            .exits_with(0)
            .text(),
    )
    .expect("JSON");
    let number = |path: &str| figures.pointer(path).and_then(Value::as_f64).expect(path);
    for (flag, name, value) in [
        ("--max-rmse", "RMSE", number("/errors/rmse")),
        ("--max-relmse", "relMSE", number("/errors/relmse")),
        (
            "--max-relmse-trimmed",
            "trimmed relMSE",
            number("/errors/relmse_trimmed"),
        ),
        ("--max-flip", "mean FLIP", number("/flip/mean")),
    ] {
        assert!(value > 0.0, "{name}");
        sandbox
            .run(&[
                "compare",
                "a.exr",
                "b.exr",
                flag,
                &(value * 1.01).to_string(),
            ])
            .exits_with(0)
            .prints("");
        let run = sandbox.run(&[
            "compare",
            "a.exr",
            "b.exr",
            flag,
            &(value * 0.99).to_string(),
        ]);
        run.exits_with(1);
        assert!(
            run.stderr
                .starts_with(&format!("error: a.exr differs from b.exr: {name} ")),
            "{}",
            run.stderr
        );
    }
    let psnr = number("/errors/psnr");
    sandbox
        .run(&[
            "compare",
            "a.exr",
            "b.exr",
            "--min-psnr",
            &(psnr - 0.1).to_string(),
        ])
        .exits_with(0);
    sandbox
        .run(&[
            "compare",
            "a.exr",
            "b.exr",
            "--min-psnr",
            &(psnr + 0.1).to_string(),
        ])
        .exits_with(1);
}

/// Protects: the difference picture has the pictures' size, and is written even beyond a threshold.
#[test]
fn the_difference_is_shown() {
    let Some(sandbox) = desk_with_pictures() else {
        return;
    };
    sandbox
        .run(&[
            "compare",
            "a.png",
            "b.png",
            "--diff",
            "d.png",
            "--max-rmse",
            "0",
        ])
        .exits_with(1);
    let difference = sandbox.picture("d.png");
    assert_eq!((difference.width, difference.height), (48, 27));
    sandbox
        .run(&["compare", "a.png", "a.png", "--diff", "none.png"])
        .exits_with(0);
    let none = sandbox.picture("none.png");
    assert!(none.rgb.iter().all(|pixel| *pixel == none.rgb[0]) && none.rgb != difference.rgb);
}

/// Protects: a linear picture and a display picture are compared as display values, with the
/// display of the flags.
#[test]
fn unlike_kinds_meet_as_display_values() {
    let Some(sandbox) = desk_with_pictures() else {
        return;
    };
    let display = ["--tonemap", "aces", "--gamma", "2.2"];
    // Codes of a PNG are rounded, by half a code at most.
    sandbox
        .run(
            &[
                &["compare", "a.exr", "a.png", "--max-rmse", "0.002"],
                &display[..],
            ]
            .concat(),
        )
        .exits_with(0);
    sandbox
        .run(&[
            "compare",
            "a.exr",
            "a.png",
            "--max-rmse",
            "0.002",
            "--tonemap",
            "none",
        ])
        .exits_with(1);
    let brighter = [
        &[
            "compare",
            "a.exr",
            "a.png",
            "--max-rmse",
            "0.002",
            "--exposure",
            "-1",
        ],
        &display[..],
    ]
    .concat();
    sandbox.run(&brighter).exits_with(1);
}

/// Protects: linear pictures are displayed as recorded in the files, first in those of display
/// values; the report names the source of the settings, or its absence; flags take precedence.
#[test]
fn the_display_is_the_files_own() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "sky.scene.toml",
        "format = 1\nsky.constant = [0.2, 0.7, 3]\n",
    );
    let render = |flags: &[&str], files: [&str; 2]| {
        let common = ["render", "sky.scene.toml", "-q", "-s", "16x8", "--spp", "1"];
        sandbox
            .run(&[&common[..], flags, &["-o", files[0], "-o", files[1]]].concat())
            .exits_with(0);
    };
    render(
        &["--tonemap", "agx", "--gamma", "2.2", "--exposure", "-0.5"],
        ["a.exr", "a.png"],
    );
    render(
        &["--no-metadata", "--tonemap", "agx"],
        ["bare.exr", "bare.png"],
    );
    render(
        &["--background", "transparent", "--tonemap", "aces"],
        ["clear.exr", "clear.png"],
    );
    let shown = |files: [&str; 2], flags: &[&str]| {
        let run = sandbox.run(&[&["compare"], &files[..], flags].concat());
        run.text()
            .lines()
            .find_map(|line| line.strip_prefix("shown by "))
            .unwrap_or_default()
            .trim()
            .to_owned()
    };
    for files in [
        ["a.exr", "a.png"],
        ["a.png", "a.exr"],
        ["bare.exr", "a.png"],
        ["a.exr", "a.exr"],
        ["clear.exr", "clear.png"],
    ] {
        sandbox
            .run(
                &[
                    &["compare"],
                    &files[..],
                    &["--max-rmse", "0.002", "--max-flip", "0.02"],
                ]
                .concat(),
            )
            .exits_with(0);
    }
    let own = "tone map agx, gamma 2.2, exposure -0.5, from the file ";
    assert_eq!(shown(["a.exr", "a.png"], &[]), format!("{own}a.png"));
    assert_eq!(shown(["a.exr", "bare.exr"], &[]), format!("{own}a.exr"));
    assert_eq!(shown(["a.exr", "bare.png"], &[]), format!("{own}a.exr"));
    let default = "tone map khronos-neutral, gamma srgb, exposure 0, the default, because neither file records a display";
    assert_eq!(shown(["bare.exr", "bare.png"], &[]), default);
    let flags = ["--tonemap", "none", "--gamma", "srgb", "--exposure", "1"];
    assert_eq!(
        shown(["a.exr", "a.png"], &flags),
        "tone map none, gamma srgb, exposure 1"
    );
    assert_eq!(shown(["a.png", "bare.png"], &[]), "");
}

/// Protects: coverage has figures and thresholds of its own; equal coverage changes nothing.
#[test]
fn coverage_is_beyond_thresholds() {
    use raywright::core::display::Display;
    use raywright::core::picture::Picture;
    use raywright::io::output::{PictureMetadata, write_picture};
    let sandbox = Sandbox::new();
    let write = |name: &str, alpha: Option<f32>| {
        let mut picture = Picture::new(10, 10);
        picture.alpha = alpha.map(|alpha| [vec![alpha; 25], vec![1.0; 75]].concat());
        let (png, exr) = (
            sandbox.path(format!("{name}.png")),
            sandbox.path(format!("{name}.exr")),
        );
        write_picture(&png, &picture, Display::PLAIN, &PictureMetadata::default())
            .expect("a picture");
        write_picture(&exr, &picture, Display::PLAIN, &PictureMetadata::default())
            .expect("a picture");
    };
    write("cut", Some(0.0));
    write("filled", Some(1.0));
    write("opaque", None);
    let thresholds = [
        ["--max-rmse", "0.49"],
        ["--max-flip", "0.05"],
        ["--max-relmse", "0.2"],
        ["--max-relmse-trimmed", "0.2"],
        ["--min-psnr", "7"],
    ];
    for ending in ["png", "exr"] {
        let [cut, filled, opaque] =
            ["cut", "filled", "opaque"].map(|name| format!("{name}.{ending}"));
        for threshold in thresholds {
            for other in [&filled, &opaque] {
                let run = sandbox.run(&["compare", &cut, other, threshold[0], threshold[1]]);
                run.exits_with(1).prints_like(": coverage: ");
            }
            sandbox
                .run(&["compare", &filled, &opaque, threshold[0], threshold[1]])
                .exits_with(0);
        }
        // A quarter of the pixels differs by 1.
        sandbox
            .run(&["compare", &cut, &filled, "--max-rmse", "0.51"])
            .exits_with(0);
        let run = sandbox.run(&["compare", &cut, &filled]);
        assert!(
            run.text()
                .contains("coverage   differs by up to 1, RMSE 0.5, mean FLIP "),
            "{}",
            run.text()
        );
    }
}

/// Protects: a linear picture with premultiplied alpha equals its own display picture with straight
/// alpha, even in partly covered pixels.
#[test]
fn partly_covered_pictures_are_their_own_display_pictures() {
    use raywright::core::display::Display;
    use raywright::core::picture::Picture;
    use raywright::io::output::{PictureMetadata, write_picture};
    let sandbox = Sandbox::new();
    let mut picture = Picture::new(8, 8);
    picture.rgb.fill([0.2, 0.1, 0.05]);
    picture.alpha = Some(vec![0.25; 64]);
    write_picture(
        &sandbox.path("a.exr"),
        &picture,
        Display::PLAIN,
        &PictureMetadata::default(),
    )
    .expect("a picture");
    write_picture(
        &sandbox.path("a.png"),
        &picture,
        Display::PLAIN,
        &PictureMetadata::default(),
    )
    .expect("a picture");
    // Codes are rounded, by half a code at most.
    let flags = [
        "--max-rmse",
        "0.002",
        "--tonemap",
        "none",
        "--exposure",
        "0",
    ];
    for sides in [["a.exr", "a.png"], ["a.png", "a.exr"]] {
        sandbox
            .run(&[&["compare"], &sides[..], &flags].concat())
            .exits_with(0);
    }
}

/// Protects: an EXR picture of a crop records its window in the whole as OpenEXR's data window,
/// with its layers, denoised, and from merged films; the window is read back, and crops with
/// different windows are not compared.
#[test]
fn crops_keep_their_place() {
    use raywright::core::picture::DataWindow;
    let sandbox = Sandbox::new();
    if !carried("cornell") {
        return;
    }
    let common = [
        "render",
        "preset:cornell",
        "-q",
        "-s",
        "64x48",
        "--spp",
        "8",
        "--crop",
    ];
    let render = |crop: &str, rest: &[&str]| {
        sandbox
            .run(&[&common[..], &[crop], rest].concat())
            .exits_with(0)
            .code
    };
    render(
        "10,20,40,8",
        &[
            "-o",
            "a.exr",
            "-o",
            "a.png",
            "--aov",
            "depth,stderr",
            "--checkpoint",
            "all.film",
        ],
    );
    render("10,20,40,8", &["--denoise", "-o", "denoised.exr"]);
    render("10,20,40,8", &["--part", "1/2", "--checkpoint", "1.film"]);
    render("10,20,40,8", &["--part", "2/2", "--checkpoint", "2.film"]);
    sandbox
        .run(&[
            "merge",
            "1.film",
            "2.film",
            "-o",
            "merged.exr",
            "--checkpoint",
            "both.film",
        ])
        .exits_with(0);
    sandbox
        .run(&["merge", "both.film", "-o", "again.exr"])
        .exits_with(0);
    let window = Some(DataWindow {
        origin: [10, 20],
        full: [64, 48],
    });
    for name in ["a.exr", "denoised.exr", "merged.exr", "again.exr"] {
        assert_eq!(sandbox.picture(name).window, window, "{name}");
    }
    assert!(sandbox.picture("a.exr").layers.len() >= 4);
    render("0,0,64,48", &["-o", "whole.exr"]);
    assert_eq!(sandbox.picture("whole.exr").window, None);
    render("11,20,40,8", &["-o", "b.exr"]);
    sandbox.run(&["compare", "a.exr", "b.exr"]).exits_with(3).prints(
        "error: a.exr and b.exr: the pictures are different crops of larger pictures: at 10, 20 of 64x48 pixels and at 11, 20 of 64x48 pixels\n\
        help: compare pictures rendered with the same --crop",
    );
    for other in ["merged.exr", "all.film"] {
        let run = sandbox.run(&["compare", "a.exr", other, "--max-rmse", "0"]);
        run.exits_with(0);
        assert!(
            run.text()
                .contains("place      at 10, 20 of 64x48 pixels\n"),
            "{}",
            run.text()
        );
    }
    let run = sandbox.run(&["compare", "a.exr", "a.png", "--max-rmse", "0.002"]);
    assert!(
        run.exits_with(0)
            .text()
            .contains("place      at 10, 20 of 64x48 pixels, compared with an uncropped picture\n"),
        "{}",
        run.text()
    );
}

/// Protects: pictures of different sizes, files that are no picture, missing files and unwritable
/// difference pictures are refused with an explanation.
#[test]
fn what_cannot_be_compared_is_explained() {
    let Some(sandbox) = desk_with_pictures() else {
        return;
    };
    sandbox
        .run(&[
            "render",
            "preset:whitted",
            "--size",
            "20x10",
            "-q",
            "-o",
            "small.png",
        ])
        .exits_with(0);
    sandbox.run(&["compare", "a.png", "small.png"])
        .exits_with(3)
        .prints("error: a.png and small.png: the pictures have different sizes, 48 × 27 and 20 × 10 pixels; only pictures of the same size can be compared");
    sandbox.write("text.png", "not a picture");
    sandbox
        .run(&["compare", "a.png", "text.png"])
        .exits_with(3)
        .prints("error: text.png: the file is not a PNG, JPEG, WebP or OpenEXR picture");
    sandbox
        .run(&["compare", "a.png", "missing.png"])
        .exits_with(4)
        .prints("error: cannot read missing.png: no such file or folder");
    sandbox
        .run(&["compare", "a.png", "b.png", "--diff", "no/d.png"])
        .exits_with(4);
    sandbox
        .run(&["compare", "a.png", "b.png", "--diff", "d.exr"])
        .exits_with(2)
        .prints("error: d.exr: --diff writes a PNG file; use a name that ends in .png\nhelp: --diff d.png");
    sandbox
        .run(&["compare", "a.png", "b.png", "--max-rmse", "-1"])
        .exits_with(2);
}

/// Protects: a NaN pixel is beyond any threshold, although no figure includes it; without a
/// threshold it is reported.
#[test]
fn numbers_that_are_none_pass_no_threshold() {
    use raywright::core::display::Display;
    use raywright::core::picture::Picture;
    use raywright::io::output::{PictureMetadata, write_picture};
    let sandbox = Sandbox::new();
    let mut picture = Picture::new(2, 1);
    write_picture(
        &sandbox.path("black.exr"),
        &picture,
        Display::PLAIN,
        &PictureMetadata::default(),
    )
    .expect("a picture");
    picture.rgb[1][2] = f32::NAN;
    write_picture(
        &sandbox.path("nan.exr"),
        &picture,
        Display::PLAIN,
        &PictureMetadata::default(),
    )
    .expect("a picture");
    let run = sandbox.run(&["compare", "nan.exr", "black.exr"]);
    run.exits_with(0);
    assert!(
        run.text().contains("1 pixels, left out of all measures"),
        "{}",
        run.text()
    );
    for threshold in [
        ["--max-rmse", "1000"],
        ["--max-flip", "1"],
        ["--min-psnr", "0"],
    ] {
        let run = sandbox.run(&[&["compare", "nan.exr", "black.exr"], &threshold[..]].concat());
        run.exits_with(1);
        assert!(
            run.stderr
                .contains("1 pixels have values that are not finite numbers"),
            "{}",
            run.stderr
        );
    }
}

/// Protects: the figures of the printed table, computed by hand: of eight pixels one differs by
/// 51/255 in a channel and one by 3/255, so that their squares are the only terms among 24 numbers;
/// shares are in percent of all pixels.
#[test]
fn the_table_has_the_figures() {
    use raywright::core::display::Display;
    use raywright::core::picture::Picture;
    use raywright::io::output::{PictureMetadata, write_picture};
    let sandbox = Sandbox::new();
    let mut picture = Picture::new(4, 2);
    picture.rgb = vec![[1.0, 0.0, 0.0]; 8];
    let display = Display {
        curve: raywright::core::scene::TransferCurve::None,
        ..Display::PLAIN
    };
    let write = |name: &str, picture: &Picture| {
        write_picture(
            &sandbox.path(name),
            picture,
            display,
            &PictureMetadata::default(),
        )
        .expect("a picture")
    };
    write("a.png", &picture);
    picture.rgb[6] = [1.0, 0.0, 51.0 / 255.0];
    picture.rgb[2] = [252.0 / 255.0, 0.0, 0.0];
    write("b.png", &picture);
    let run = sandbox.run(&["compare", "b.png", "a.png"]);
    run.exits_with(0);
    // √((0.2² + (3/255)²)/24) = 0.0409, and 20·log₁₀ of its inverse 27.77 dB.
    for line in [
        "pixels     4x2, display values 0 to 1",
        "identical  no",
        "RMSE       0.0409",
        "PSNR       27.77 dB",
        "differ     25 % of the pixels, 25 % by more than 1/255, 25 % by more than 2/255, 12.5 % by more than 8/255, 12.5 % by more than 32/255",
        "worst      2, 1: 1 0 0.2 against 1 0 0",
    ] {
        assert!(
            run.text().lines().any(|found| found == line),
            "{line}
in
{}",
            run.text()
        );
    }
}
