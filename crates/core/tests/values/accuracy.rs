//! Measurements of accuracy ladders on scenes with errors in closed form.

use core::time::Duration;

use raywright_core::Settings;
use raywright_core::accuracy::{
    AccuracyEffort, AccuracyReport, LadderReport, MeasureError, MeasurementStart, measure_accuracy,
};
use raywright_core::display::OutputFormat;
use raywright_core::prepare::PrepareError;
use raywright_core::scene::{Scene, ToneMap, TransferCurve};
use raywright_core::settings::Sampling;
use serde_json::json;

use crate::support::{DOWN, classic, floor, scene, settings};

/// A budget that never ends a measurement, on any machine.
const EFFORT: AccuracyEffort = AccuracyEffort {
    budget: Duration::from_secs(600),
    size: Some([4, 3]),
    rounds: 2,
};

/// Two walls that emit 1 and mirror a half: n segments show 2 − 2^(1−n).
fn corridor() -> Scene {
    let wall = |y: f64, up: f64| json!({ "shape": { "plane": { "point": [0, y, 0], "normal": [0, up, 0] } }, "material": "m" });
    let mirror = classic(json!({ "local": 0, "emission": 1, "reflection": { "weight": 0.5 } }));
    scene(
        json!({ "objects": [wall(0.0, 1.0), wall(4.0, -1.0)], "materials": [{ "name": "m", "model": mirror }],
        "render": { "max_depth": 4, "pattern": "centre" } }),
    )
}

fn measured(scene: &Scene) -> AccuracyReport {
    let settings = Settings {
        max_depth: 4,
        ..settings(scene, DOWN)
    };
    measure_accuracy(
        scene,
        &settings,
        &EFFORT,
        MeasurementStart::default(),
        &(),
        &mut (),
    )
    .expect("a report")
    .0
}

fn ladder<'a>(report: &'a AccuracyReport, name: &str) -> &'a LadderReport {
    report
        .ladders
        .iter()
        .find(|ladder| ladder.ladder == name)
        .unwrap_or_else(|| panic!("no {name}"))
}

/// Protects: each rung gets its true error: for n segments 2^(1−n), all of it bias. The rung in use is the scene's own setting and needs no flag.
#[test]
fn errors_are_those_of_the_closed_form() {
    let report = measured(&corridor());
    let lengths = ladder(&report, "path-length");
    assert_eq!((lengths.in_use.as_str(), lengths.rungs.len()), ("4", 6));
    for rung in &lengths.rungs {
        let n: i32 = rung.rung.parse().expect("a number");
        let expected = 2_f64.powi(1 - n) - 2_f64.powi(-63);
        let measured = rung.measured.as_ref().expect("there is time");
        let errors = &measured.errors;
        let rmse = errors.rmse.value;
        assert!(
            (rmse - expected).abs() < 1e-6,
            "{n}: {rmse}, not {expected}"
        );
        for interval in [errors.relmse, errors.bias.expect("there is no chance")] {
            assert!(
                (interval.value - expected * expected / 4.01).abs() < 1e-6,
                "{n}: {interval:?}"
            );
        }
        assert!(
            (errors.light.value - (2.0 - 2_f64.powi(1 - n)) / 2.0).abs() < 1e-6,
            "{n}: {:?}",
            errors.light
        );
        assert_eq!((rung.in_use, rung.flag.is_none()), (n == 4, n == 4), "{n}");
        // One ray per segment and sample.
        let samples = report.own.rays / 4;
        assert_eq!(measured.rays, n as u64 * samples, "{n}");
    }
    assert!(report.own.errors.rmse.value > 0.12 && !report.cut_short);
    assert_eq!(
        (
            report.size,
            report.tiles.all,
            report.reference.standard_error
        ),
        ([4, 3], 1, 0.0)
    );
}

/// Protects: the precision of files is measured on the scene's own picture: under a linear curve a
/// grey of 0.2 is off by 0.2·255 − 51, and one brighter than white is clipped; floats are exact,
/// and each format has its size in bytes.
#[test]
fn files_keep_what_they_can() {
    let grey = |radiance: f64| {
        let mut scene = corridor();
        let model = json!({ "classic": { "local": 0, "emission": radiance } });
        scene.materials[0] =
            serde_json::from_value(json!({ "name": "m", "model": model })).expect("a material");
        scene.render.gamma = TransferCurve::None;
        scene.render.tone_map = ToneMap::None;
        let settings = Settings {
            output: OutputFormat::Sixteen,
            ..settings(&scene, DOWN)
        };
        measure_accuracy(
            &scene,
            &settings,
            &EFFORT,
            MeasurementStart::default(),
            &(),
            &mut (),
        )
        .expect("a report")
        .0
        .outputs
    };
    let value = f64::from(0.2005_f32);
    let (outputs, white) = (grey(0.2005), grey(1.5));
    let names: Vec<_> = outputs
        .iter()
        .map(|output| (output.rung, output.bytes_per_pixel, output.in_use))
        .collect();
    assert_eq!(
        names,
        [
            ("8-bit", 3, false),
            ("8-bit-dither", 3, false),
            ("16-bit", 6, true),
            ("float", 12, false)
        ]
    );
    let off = |steps: f64| (value - (steps * value).round() / steps).abs();
    for (output, steps) in [(&outputs[0], 255.0), (&outputs[2], 65535.0)] {
        assert!(
            (output.rmse - off(steps)).abs() < 1e-7 && (output.greatest - off(steps)).abs() < 1e-7,
            "{output:?}"
        );
    }
    assert!(
        outputs[1].greatest > off(255.0) && outputs[1].greatest < 1.0 / 255.0,
        "{:?}",
        outputs[1]
    );
    assert!(outputs[3].rmse == 0.0 && outputs[3].seconds.is_none() && outputs[0].seconds.is_some());
    assert_eq!(
        (
            outputs[0].clipped,
            white[0].clipped,
            white[2].clipped,
            white[3].clipped
        ),
        (0.0, 1.0, 1.0, 0.0)
    );
}

/// Protects: the frontier goes from the shortest paths to paths without error, its settings match
/// their flags, and ladders that the scene does not need are named and not measured; trees and
/// scans give the same picture.
#[test]
fn the_frontier_ends_without_error() {
    let report = measured(&corridor());
    let last = report.frontier.last().expect("a frontier");
    assert!(
        last.measured.errors.rmse.value < 1e-6
            && last
                .flags
                .iter()
                .any(|flag| flag.starts_with("--rung path-length=")),
        "{last:?}"
    );
    let errors: Vec<f64> = report
        .frontier
        .iter()
        .map(|candidate| candidate.measured.errors.relmse.value)
        .collect();
    assert!(errors.is_sorted_by(|a, b| a > b), "{errors:?}");
    assert_eq!(
        report.inapplicable,
        [
            "integrator",
            "shadows",
            "light-sampling",
            "sky-choice",
            "fresnel",
            "microfacets",
            "colour",
            "texture-filter",
            "roulette",
            "clamp",
            "pixel-filter",
            "sampler",
            "reconstruction"
        ]
    );
    for rung in ["build", "accelerator"]
        .into_iter()
        .flat_map(|name| &ladder(&report, name).rungs)
    {
        let cost = rung.cost.as_ref().expect("there is time");
        assert!(cost.same_bits, "{}", rung.rung);
    }
}

/// Protects: sampling noise is not measured as bias: for stripes much finer than a pixel each
/// sample sees another shade, and the mean is right.
#[test]
fn noise_is_no_bias() {
    let stripes = json!({ "local": 0, "emission": "1 + sin(1e4*p.x)" });
    let scene = floor(classic(stripes), json!({ "render": { "samples": 16 } }));
    let effort = AccuracyEffort {
        rounds: 6,
        ..EFFORT
    };
    let settings = Settings {
        sampling: Sampling::General(16),
        ..settings(&scene, DOWN)
    };
    let (report, _) = measure_accuracy(
        &scene,
        &settings,
        &effort,
        MeasurementStart::default(),
        &(),
        &mut (),
    )
    .expect("a report");
    let samples = ladder(&report, "samples");
    let errors = |rung: &raywright_core::accuracy::RungReport| {
        rung.measured
            .as_ref()
            .map(|measured| measured.errors)
            .expect("there is time")
    };
    let noise: Vec<f64> = samples
        .rungs
        .iter()
        .map(|rung| errors(rung).relmse.value)
        .collect();
    assert!(
        noise.is_sorted_by(|a, b| a > b) && noise[0] > 0.01,
        "{noise:?}"
    );
    let bias = errors(&samples.rungs[0]).bias.expect("two rounds");
    assert!(bias.value < 0.25 * noise[0], "{bias:?} of {noise:?}");
}

/// Protects: a measurement can be cancelled, and then returns no report.
#[test]
fn a_measurement_can_be_stopped() {
    struct StopsAtOnce;
    impl raywright_core::Observer for StopsAtOnce {
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let scene = corridor();
    let stopped = measure_accuracy(
        &scene,
        &settings(&scene, DOWN),
        &EFFORT,
        MeasurementStart::default(),
        &StopsAtOnce,
        &mut (),
    );
    assert_eq!(stopped.err(), Some(PrepareError::Cancelled.into()));
}

/// Protects: a kept reference serves the next measurement, to the bit and without further rays; a
/// reference of another scene, seed or size is rejected.
#[test]
fn a_reference_is_used_again() {
    let scene = corridor();
    let settings = Settings {
        max_depth: 4,
        ..settings(&scene, DOWN)
    };
    let again = |scene: &str, settings: &Settings, effort: &AccuracyEffort, reference| {
        measure_accuracy(
            &corridor(),
            settings,
            effort,
            MeasurementStart { scene, reference },
            &(),
            &mut (),
        )
    };
    let (first, kept_reference) = again("a", &settings, &EFFORT, None).expect("a report");
    let (second, same) =
        again("a", &settings, &EFFORT, Some(kept_reference.clone())).expect("its own reference");
    assert!(!first.reference.reused && second.reference.reused && second.size == [4, 3]);
    assert_eq!(
        (
            first.pictures.details.last().map(|of| of.picture.clone()),
            kept_reference.rungs.clone()
        ),
        (
            second.pictures.details.last().map(|of| of.picture.clone()),
            same.rungs
        )
    );
    assert_eq!(
        (first.reference.samples, kept_reference.film.counters()),
        (second.reference.samples, same.film.counters())
    );
    let lengths = |report: &AccuracyReport| {
        ladder(report, "path-length")
            .rungs
            .iter()
            .map(|rung| rung.measured.as_ref().map(|measured| measured.errors))
            .collect::<Vec<_>>()
    };
    assert_eq!(lengths(&first), lengths(&second));
    let refused = |scene, settings: &Settings, effort: &AccuracyEffort| {
        let error = again(scene, settings, effort, Some(kept_reference.clone()))
            .expect_err("another picture");
        assert!(matches!(error, MeasureError::Reference(_)), "{error}");
        error.to_string()
    };
    assert!(refused("b", &settings, &EFFORT).contains("scene differs"));
    assert!(
        refused(
            "a",
            &Settings {
                seed: 7,
                ..settings.clone()
            },
            &EFFORT
        )
        .contains("seed differs")
    );
    assert!(
        refused(
            "a",
            &settings,
            &AccuracyEffort {
                size: Some([5, 3]),
                ..EFFORT
            }
        )
        .contains("size differs")
    );
}
