//! Measurements of accuracy ladders on scenes with errors in closed form.

use core::time::Duration;

use raywright_core::Settings;
use raywright_core::accuracy::{AccuracyEffort, AccuracyReport, MeasuredSetting, measure_accuracy};
use raywright_core::prepare::PrepareError;
use raywright_core::scene::Scene;
use raywright_core::settings::Sampling;
use serde_json::json;

use crate::support::{DOWN, classic, floor, scene, settings};

/// A budget that never ends a measurement, on any machine.
const EFFORT: AccuracyEffort = AccuracyEffort {
    budget: Duration::from_secs(600),
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
        size: [4, 3],
        ..settings(scene, DOWN)
    };
    measure_accuracy(scene, &settings, &EFFORT, &(), &mut |_, _| ()).expect("a report")
}

/// The measured rungs of a ladder, by name; the one in use is the scene's own setting.
fn rungs<'a>(report: &'a AccuracyReport, ladder: &str) -> Vec<(String, &'a MeasuredSetting)> {
    let ladders = report.ladders.iter();
    let in_use = ladders.filter(|of| of.ladder == ladder);
    let own = in_use.map(|of| (of.in_use.clone(), report.own()));
    let others = report.settings.iter().filter_map(|of| {
        let choice = of.single_rung()?;
        (choice.ladder().name() == ladder).then(|| (choice.rung().to_owned(), of))
    });
    own.chain(others).collect()
}

/// Protects: each rung gets its true error: for n segments 2^(1−n), all of it bias. The rung in use is the scene's own setting and needs no flag.
#[test]
fn errors_are_those_of_the_closed_form() {
    let report = measured(&corridor());
    let lengths = rungs(&report, "path-length");
    assert_eq!((lengths[0].0.as_str(), lengths.len()), ("4", 6));
    for (rung, measured) in lengths {
        let n: i32 = rung.parse().expect("a number");
        let expected = 2_f64.powi(1 - n) - 2_f64.powi(-63);
        let errors = &measured.errors;
        for interval in [errors.root_relmse, errors.bias.expect("there is no chance")] {
            assert!(
                (interval.value.powi(2) - expected * expected / 4.01).abs() < 1e-6,
                "{n}: {interval:?}"
            );
        }
        assert!(
            (errors.light.value - (2.0 - 2_f64.powi(1 - n)) / 2.0).abs() < 1e-6,
            "{n}: {:?}",
            errors.light
        );
    }
    assert!(report.own().errors.root_relmse.value > 0.06 && !report.cut_short);
    assert_eq!(
        (report.size, report.tiles.all, report.reference.error),
        ([4, 3], 1, 0.0)
    );
}

/// Protects: the frontier goes from the shortest paths to paths without error, its settings match
/// their flags, and ladders that the scene does not need are not measured.
#[test]
fn the_frontier_ends_without_error() {
    let report = measured(&corridor());
    let rows = report.frontier.iter();
    let rows: Vec<&MeasuredSetting> = rows.map(|&row| &report.settings[row]).collect();
    let last = rows.last().expect("a frontier");
    let is_length = last.single_rung().map(|of| of.ladder().name()) == Some("path-length");
    assert!(
        last.errors.root_relmse.value < 1e-6 && is_length,
        "{last:?}"
    );
    let errors: Vec<f64> = rows.iter().map(|of| of.errors.root_relmse.value).collect();
    assert!(errors.is_sorted_by(|a, b| a > b), "{errors:?}");
    let idle = [
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
        "reconstruction",
    ];
    let mut ladders = report.ladders.iter();
    assert!(
        ladders.all(|of| !idle.contains(&of.ladder)),
        "{:?}",
        report.ladders
    );
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
        size: [16, 12],
        ..settings(&scene, DOWN)
    };
    let report =
        measure_accuracy(&scene, &settings, &effort, &(), &mut |_, _| ()).expect("a report");
    let samples = |name: &str| {
        let all = rungs(&report, "samples");
        let found = all.into_iter().find(|(rung, _)| rung == name);
        found.expect("there is time").1.errors
    };
    let noise = ["1", "4", "16", "64", "256", "1024"].map(|name| samples(name).root_relmse.value);
    assert!(
        noise.is_sorted_by(|a, b| a > b) && noise[0] > 0.1,
        "{noise:?}"
    );
    let bias = samples("1").bias.expect("two rounds");
    assert!(
        bias.value < 0.25 * noise[0].powi(2),
        "{bias:?} of {noise:?}"
    );
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
        &StopsAtOnce,
        &mut |_, _| (),
    );
    assert_eq!(stopped.err(), Some(PrepareError::Cancelled.into()));
}
