//! Measurements with a clock that counts rays, so that every time is known.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::super::estimate::ReferenceTile;
use super::super::measurements::tile_errors::crop_picture;
use super::super::renderer::MARGIN;
use super::super::tiles::TileGrid;
use super::super::{LadderReport, RungReport};
use super::*;
use crate::picture::Picture;
use crate::scene::Scene;
use crate::settings::Crop;

/// Two walls that emit and mirror: a path of n segments has n rays, without randomness.
fn corridor() -> Scene {
    serde_json::from_str(
        r#"{"format": 1, "render": {"size": [4, 2], "pattern": "centre", "max_depth": 4},
        "cameras": [{"name": "c", "pose": {"look_at": {"eye": [0, 2, 0], "target": [0, 0, 0], "up": [0, 0, 1]}},
            "projection": {"pinhole": {"vertical_fov": 20}}}],
        "materials": [{"name": "m", "model": {"classic": {"local": 0, "emission": 1, "reflection": {"weight": 0.5}}}}],
        "objects": [{"shape": {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}, "material": "m"},
            {"shape": {"plane": {"point": [0, 4, 0], "normal": [0, -1, 0]}}, "material": "m"}]}"#,
    )
    .expect("a scene")
}

/// Records the reported steps.
#[derive(Default)]
struct RecordingListener(Vec<(String, f64)>);

impl ProgressListener for RecordingListener {
    fn report_step(&mut self, label: &str, share: f64) {
        self.0.push((label.to_owned(), share));
    }
}

fn measured(size: Option<[u32; 2]>, heard: &mut RecordingListener) -> AccuracyReport {
    measured_by(|work| work() as f64 * 1e-6, size, heard)
}

fn measured_by(
    stopwatch: Stopwatch,
    size: Option<[u32; 2]>,
    listener: &mut dyn ProgressListener,
) -> AccuracyReport {
    let scene = corridor();
    let effort = AccuracyEffort {
        budget: Duration::from_secs(600),
        size,
        rounds: 3,
    };
    let session = MeasurementSession::new(
        &scene,
        &Settings::from_scene(&scene),
        Display::from_render(&scene.render),
        effort,
        &(),
        (stopwatch, &Instant::now),
    );
    session
        .run_measurement(MeasurementStart::default(), listener)
        .expect("a report")
        .0
}

/// Protects: times are those of rendering alone, and ratios are a setting's time over that of the
/// scene's own. n segments take n/4 of the time of four, and trees as long as scans. The listener
/// is told every rung.
#[test]
fn times_are_what_the_clock_says() {
    let mut heard = RecordingListener::default();
    let report = measured(Some([4, 2]), &mut heard);
    let near = |value: f64, expected: f64| {
        assert!(
            (value / expected - 1.0).abs() < 1e-9,
            "{value}, not {expected}"
        )
    };
    assert_eq!(report.own.rays, 32);
    near(report.own.seconds.value, 32e-6);
    let lengths = report
        .ladders
        .iter()
        .find(|ladder| ladder.ladder == "path-length")
        .expect("mirrors");
    for rung in &lengths.rungs {
        let (n, each_measured) = (
            rung.rung.parse::<f64>().expect("a number"),
            rung.measured.as_ref().expect("time"),
        );
        near(each_measured.seconds.value, n * 8.0 * 1e-6);
        near(each_measured.ratio.value, n / 4.0);
        near(each_measured.ratio.high, n / 4.0);
    }
    for price in report.prices.iter().flat_map(|ladder| &ladder.rungs) {
        let rung_cost = price.rung_cost.as_ref().expect("time");
        assert_eq!(
            (
                rung_cost.preparing.median,
                rung_cost.ratio.median,
                rung_cost.same_bits
            ),
            (0.0, 1.0, true)
        );
        near(rung_cost.seconds.median, 32e-6);
    }
    let reference = &report.reference;
    near(
        reference.seconds,
        f64::from(reference.samples) * 64.0 * 8.0 * 1e-6,
    );
    let plan = format!(
        "plan: 13 settings on 1 of 1 tiles, reference of {} samples",
        reference.samples
    );
    assert!(
        [&plan[..], "path-length=64", "timing accelerator=linear"]
            .iter()
            .all(|words| heard.0.iter().any(|(label, _)| label == words)),
        "{:?}",
        heard.0
    );
    assert!(
        heard.0.is_sorted_by(|a, b| a.1 <= b.1)
            && heard.0.iter().all(|(_, share)| (0.0..=1.0).contains(share))
    );
}

/// Whether the machine is slowed down by other work.
static IS_BUSY: AtomicBool = AtomicBool::new(false);

/// Slows the machine while the setting in use is measured, except in turns.
struct Disturber;

impl ProgressListener for Disturber {
    fn report_step(&mut self, label: &str, _: f64) {
        IS_BUSY.store(label.ends_with("as it is"), Ordering::Relaxed);
    }
}

/// Protects: a machine that is slow while the setting in use is measured makes no other setting
/// appear twice as fast. Settings of the frontier take n/4 of the time of four segments, and the
/// intervals of all others contain that value.
#[test]
fn what_slows_one_setting_makes_no_other_fast() {
    let stopwatch: Stopwatch = |work| {
        work() as f64
            * if IS_BUSY.load(Ordering::Relaxed) {
                2e-6
            } else {
                1e-6
            }
    };
    let report = measured_by(stopwatch, Some([4, 2]), &mut Disturber);
    let near = |value: f64, expected: f64| {
        assert!(
            (value / expected - 1.0).abs() < 1e-9,
            "{value}, not {expected}"
        )
    };
    near(report.own.seconds.value, 32e-6);
    let lengths = report
        .ladders
        .iter()
        .find(|ladder| ladder.ladder == "path-length")
        .expect("mirrors");
    let mut timed_in_turns = 0;
    for rung in &lengths.rungs {
        let (share, measured) = (
            rung.rung.parse::<f64>().expect("a number") / 4.0,
            rung.measured.as_ref().expect("time"),
        );
        assert!(
            measured.ratio.low <= share * (1.0 + 1e-9)
                && share <= measured.ratio.high * (1.0 + 1e-9),
            "{rung:?}, not {share}"
        );
        let flag = rung.flag.iter().cloned().collect::<Vec<_>>();
        if report
            .frontier
            .iter()
            .any(|candidate| candidate.flags == flag)
        {
            timed_in_turns += 1;
            near(measured.ratio.value, share);
        }
    }
    assert!(
        timed_in_turns > 2,
        "{timed_in_turns} settings of the frontier"
    );
}

/// Protects: effects are timed by the same clock: mirrors add three rays to one camera ray.
#[test]
fn effects_are_priced_too() {
    let report = measured(Some([4, 2]), &mut RecordingListener::default());
    let costs = report.costs.expect("time");
    let mirror = costs
        .effects
        .iter()
        .find(|cost| cost.effect == "mirror reflection")
        .expect("a mirror");
    assert_eq!(
        (
            costs.size,
            mirror.rays,
            mirror.ratio.median,
            costs.late.len()
        ),
        ([4, 2], 4.0, 4.0, 0)
    );
}

/// Protects: each setting of the frontier is slower and better than the previous one, and no
/// measured setting beats it in both. Shorter paths than in use, whose error is all bias, are
/// excluded; longer ones are included, although their error is bias, too.
#[test]
fn the_frontier_is_what_nobody_beats() {
    let report = measured(Some([4, 2]), &mut RecordingListener::default());
    let point = |each_measured: &crate::accuracy::MeasuredSetting| {
        (
            each_measured.seconds.value,
            each_measured.errors.relmse.value,
        )
    };
    let front: Vec<(f64, f64)> = report
        .frontier
        .iter()
        .map(|candidate| point(&candidate.measured))
        .collect();
    assert!(
        front.is_sorted_by(|a, b| a.0 < b.0 && a.1 > b.1) && front.len() >= 3,
        "{front:?}"
    );
    assert!(
        report.frontier[0].flags.is_empty()
            && report.frontier.last().expect("some").flags == ["--rung path-length=64"]
    );
    for rung in report.ladders.iter().flat_map(|ladder| &ladder.rungs) {
        let (time, error) = point(rung.measured.as_ref().expect("time"));
        let is_short = rung.rung == "1" || rung.rung == "2";
        assert!(
            is_short
                || !front
                    .iter()
                    .any(|f| time < 0.95 * f.0 && error < 0.95 * f.1),
            "{} beats {front:?}",
            rung.rung
        );
    }
}

/// Protects: the light of a setting is its measured share of the reference's. With n segments and a
/// mirror of one half it is 1 − 0.5ⁿ.
#[test]
fn lost_light_is_measured() {
    let report = measured(Some([4, 2]), &mut RecordingListener::default());
    let ladder = report
        .ladders
        .iter()
        .find(|ladder| ladder.ladder == "path-length");
    let rungs = &ladder.expect("mirrors have path lengths").rungs;
    for rung in rungs {
        let segments: i32 = rung.rung.parse().expect("a number");
        let light = rung.measured.as_ref().expect("time").errors.light;
        let expected = 1.0 - 0.5_f64.powi(segments);
        assert!(
            (light.value - expected).abs() < 1e-6,
            "{}: {light:?}",
            rung.rung
        );
    }
    assert!(rungs.len() > 3);
}

/// Protects: without a given size, a scene that renders quickly is measured at its own size, with a
/// picture of each setting beside the reference's.
#[test]
fn small_scenes_are_measured_as_they_are() {
    let report = measured(None, &mut RecordingListener::default());
    assert_eq!(
        (report.size, report.tiles.measured, report.tiles.all),
        ([4, 2], 1, 1)
    );
    assert!(
        report.own.seconds.low == report.own.seconds.high
            && report.own.errors.relmse.low == report.own.errors.relmse.high
    );
    let names: Vec<&str> = report
        .pictures
        .iter()
        .map(|shown_mesh| shown_mesh.name.as_str())
        .collect();
    assert_eq!(names[..3], ["reference", "as it is", "samples=4"]);
    let rungs = report.ladders.iter().flat_map(|ladder| &ladder.rungs);
    assert_eq!(names.len(), 2 + rungs.filter(|rung| !rung.in_use).count());
    assert!(
        report
            .pictures
            .iter()
            .all(|shown_mesh| (shown_mesh.picture.width, shown_mesh.picture.height) == (4, 2))
    );
}

/// Protects: rungs that do not change the scene's picture are not measured: without a light or a
/// lamp, shadow rungs are left out.
#[test]
fn rungs_without_a_difference_are_left_out() {
    let scene = corridor();
    let effort = AccuracyEffort {
        budget: Duration::from_secs(600),
        size: Some([4, 2]),
        rounds: 2,
    };
    let stopwatch: Stopwatch = |work| work() as f64;
    let session = MeasurementSession::new(
        &scene,
        &Settings::from_scene(&scene),
        Display::from_render(&scene.render),
        effort,
        &(),
        (stopwatch, &Instant::now),
    );
    assert_eq!(
        session
            .applicable_rungs(Ladder::Shadows)
            .map(|choice| choice.rung())
            .collect::<Vec<_>>(),
        ["on"]
    );
    assert_eq!(session.applicable_rungs(Ladder::Precision).count(), 2);
}

/// Protects: rungs whose precision cannot store the scene are left out everywhere, also of
/// combinations, so that f64 rungs are measured.
#[test]
fn rungs_that_cannot_show_the_scene_are_left_out() {
    let mut scene = corridor();
    // Wherever the storage origin is, one of the two objects is far from it.
    for [min, max] in [
        ["[3e5, 0, 3e5]", "[300001, 2, 300000.01]"],
        ["[-300001, 0, -300000.01]", "[-3e5, 2, -3e5]"],
    ] {
        let thin =
            format!(r#"{{"shape": {{"box": {{"min": {min}, "max": {max}}}}}, "material": "m"}}"#);
        scene
            .objects
            .push(serde_json::from_str(&thin).expect("an object"));
    }
    let settings = Settings {
        precision: crate::settings::PrecisionChoice::Reference,
        ..Settings::from_scene(&scene)
    };
    let effort = AccuracyEffort {
        budget: Duration::from_secs(600),
        size: Some([4, 2]),
        rounds: 2,
    };
    let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
    let session = MeasurementSession::new(
        &scene,
        &settings,
        Display::from_render(&scene.render),
        effort,
        &(),
        (stopwatch, &Instant::now),
    );
    let report = session
        .run_measurement(MeasurementStart::default(), &mut ())
        .expect("a report")
        .0;
    let precision = report
        .ladders
        .iter()
        .find(|ladder| ladder.ladder == "precision")
        .expect("a ladder");
    assert_eq!(
        precision
            .rungs
            .iter()
            .map(|rung| rung.rung.as_str())
            .collect::<Vec<_>>(),
        ["reference"]
    );
    assert!(report.frontier.iter().all(|candidate| {
        candidate
            .flags
            .iter()
            .all(|flag| !flag.contains("precision"))
    }));
}

/// Protects: a rung that takes too long to measure is not the reference of comparisons: the next
/// most exact one is.
#[test]
fn what_is_beyond_reach_is_not_the_most_exact() {
    let scene = corridor();
    let effort = AccuracyEffort {
        budget: Duration::from_secs(600),
        size: Some([4, 2]),
        rounds: 2,
    };
    let stopwatch: Stopwatch = |work| work() as f64;
    let mut session = MeasurementSession::new(
        &scene,
        &Settings::from_scene(&scene),
        Display::from_render(&scene.render),
        effort,
        &(),
        (stopwatch, &Instant::now),
    );
    let lengths: Vec<RungChoice> = session.applicable_rungs(Ladder::PathLength).collect();
    let [.., second, first] = lengths[..] else {
        panic!("{lengths:?}")
    };
    assert_eq!(
        session.most_exact_setting(Ladder::PathLength),
        RungSetting::from_rung(first)
    );
    session.infeasible_rungs.push(first);
    assert_eq!(
        session.most_exact_setting(Ladder::PathLength),
        RungSetting::from_rung(second)
    );
}

/// A scene of many samples with a lamp, so that most ladders apply and rungs differ in time.
fn lamp() -> Scene {
    serde_json::from_str(
        r#"{"format": 1, "render": {"size": [16, 12], "samples": 16, "max_depth": 4}, "sky": {"constant": 0.2},
        "cameras": [{"name": "c", "pose": {"look_at": {"eye": [0, 2, 3], "target": [0, 0, 0], "up": [0, 1, 0]}},
            "projection": {"pinhole": {"vertical_fov": 40}}}],
        "materials": [{"name": "m", "model": {"physical": {"roughness": 0.5}}}, {"name": "l", "model": {"physical": {"emission": 4}}}],
        "objects": [{"shape": {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}, "material": "m"},
            {"shape": {"sphere": {"centre": [0, 2, 0], "radius": 0.3}}, "material": "l"}]}"#,
    )
    .expect("a scene")
}

/// A clock that each query advances by a millisecond.
struct CountingClock {
    start: Instant,
    questions: AtomicU64,
}

impl CountingClock {
    fn new() -> Self {
        Self {
            start: Instant::now(),
            questions: AtomicU64::new(0),
        }
    }

    fn seconds(&self) -> f64 {
        self.questions.load(Ordering::Relaxed) as f64 * 1e-3
    }

    fn now(&self) -> Instant {
        self.start + Duration::from_millis(1 + self.questions.fetch_add(1, Ordering::Relaxed))
    }
}

/// Protects: every render checks the time, and the measurement ends with its budget, whatever is in
/// progress. The report then holds the results so far: the scene's own picture, which is required,
/// and of the ladders the samples first.
#[test]
fn all_ends_with_the_time() {
    let scene = lamp();
    let settings = Settings {
        integrator: crate::scene::Integrator::Path,
        ..Settings::from_scene(&scene)
    };
    let measured = |seconds: f64| {
        let clock = CountingClock::new();
        let now = || clock.now();
        let effort = AccuracyEffort {
            budget: Duration::from_secs_f64(seconds),
            size: Some([16, 12]),
            rounds: 3,
        };
        let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
        let session = MeasurementSession::new(
            &scene,
            &settings,
            Display::from_render(&scene.render),
            effort,
            &(),
            (stopwatch, &now),
        );
        (
            session
                .run_measurement(MeasurementStart::default(), &mut ())
                .map(|(report, _)| report),
            clock.seconds(),
        )
    };
    for (budget, minimum) in [(1.0, 1), (2.0, 2), (4.0, 2)] {
        let (report, took) = measured(budget);
        let report = report.unwrap_or_else(|error| panic!("{budget}: {error}"));
        assert!(
            took <= 1.1 * budget && report.cut_short,
            "{took} of {budget}"
        );
        assert_eq!(
            report.ladders[..2]
                .iter()
                .map(|ladder| ladder.ladder)
                .collect::<Vec<_>>(),
            ["samples", "reconstruction"]
        );
        let known = report.ladders[0]
            .rungs
            .iter()
            .filter(|rung| rung.measured.is_some())
            .count();
        assert!(
            known >= minimum && report.reference.samples >= 2,
            "{known} rungs in {budget}"
        );
    }
    let (report, took) = measured(0.01);
    assert!(
        matches!(report, Err(MeasureError::InsufficientTime)) && took < 0.1,
        "{took}: {:?}",
        report.err()
    );
}

/// Protects: more time never yields fewer settings, nor fewer tiles of any setting, from a budget
/// that hardly suffices to one that suffices for all.
#[test]
fn more_time_shows_no_less() {
    let scene = lamp();
    let settings = Settings {
        integrator: crate::scene::Integrator::Path,
        size: [64, 48],
        ..Settings::from_scene(&scene)
    };
    let mut before: Vec<(String, usize)> = Vec::new();
    for budget in [6.0, 18.0, 54.0, 162.0] {
        let clock = CountingClock::new();
        let now = || clock.now();
        let effort = AccuracyEffort {
            budget: Duration::from_secs_f64(budget),
            size: None,
            rounds: 2,
        };
        let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
        let session = MeasurementSession::new(
            &scene,
            &settings,
            Display::from_render(&scene.render),
            effort,
            &(),
            (stopwatch, &now),
        );
        let (report, _) = session
            .run_measurement(MeasurementStart::default(), &mut ())
            .unwrap_or_else(|error| panic!("{budget}: {error}"));
        assert!(
            clock.seconds() <= 1.03 * budget,
            "{} of {budget}",
            clock.seconds()
        );
        let rung = |ladder: &LadderReport, rung: &RungReport| {
            Some((
                format!("{}={}", ladder.ladder, rung.rung),
                rung.measured.as_ref()?.tiles,
            ))
        };
        let all: Vec<(String, usize)> = report
            .ladders
            .iter()
            .flat_map(|ladder| {
                ladder
                    .rungs
                    .iter()
                    .filter_map(move |rung_report| rung(ladder, rung_report))
            })
            .collect();
        for (name, tiles) in &before {
            let now = all
                .iter()
                .find(|(other, _)| other == name)
                .map_or(0, |of| of.1);
            assert!(
                now >= *tiles,
                "{name}: {now} tiles in {budget}, {tiles} before"
            );
        }
        before = all;
    }
    assert!(before.len() >= 20, "{before:?}");
}

/// Protects: a tile equals the whole picture to the bit, with random samples and with a fixed
/// pattern. A denoised tile with its margin differs by less than a hundredth of the filter's
/// change, as squares.
#[test]
fn a_tile_is_a_part_of_the_picture() {
    let scene = lamp();
    let own_settings = Settings {
        integrator: crate::scene::Integrator::Path,
        size: [160, 120],
        ..Settings::from_scene(&scene)
    };
    let grid = TileGrid {
        size: own_settings.size,
        edge: 32,
        seed: 3,
    };
    let end = Instant::now() + Duration::from_secs(600);
    let stopwatch: Stopwatch = |work| work() as f64;
    for sampling in [
        own_settings.sampling,
        crate::settings::Sampling::Pattern(crate::scene::SamplePattern::Corners),
    ] {
        let settings = Settings {
            sampling,
            ..own_settings.clone()
        };
        let renderer = SettingRenderer::new(&scene, &settings, &(), (stopwatch, &Instant::now));
        let take = |setting: &RungSetting, parts: &[Crop]| {
            renderer
                .render_setting(setting, parts, 1, end)
                .expect("time")
                .remove(0)
                .picture
        };
        let crop = Crop {
            x: 0,
            y: 0,
            width: 160,
            height: 120,
        };
        let noisy = take(&RungSetting::default(), &[]);
        let denoised =
            RungSetting::from_rung(RungChoice::parse("reconstruction=denoised").expect("a rung"));
        let filtered = take(&denoised, &[]);
        for tile in [7, 8, 12] {
            let part = grid.tile_crop(tile);
            assert!(
                take(&RungSetting::default(), &[part]).rgb == crop_picture(&noisy, crop, part).rgb,
                "tile {tile}"
            );
            if sampling.is_fixed() {
                continue;
            }
            let around = grid.tile_crop_with_margin(tile, MARGIN);
            let (here, there, before) = (
                crop_picture(&take(&denoised, &[around]), around, part),
                crop_picture(&filtered, crop, part),
                crop_picture(&noisy, crop, part),
            );
            let apart = |a: &Picture, b: &Picture| {
                a.rgb
                    .iter()
                    .flatten()
                    .zip(b.rgb.iter().flatten())
                    .map(|(a, b)| f64::from(a - b).powi(2))
                    .sum::<f64>()
            };
            let (off, change) = (apart(&here, &there), apart(&there, &before));
            assert!(
                off < 0.01 * change && change > 0.0,
                "tile {tile}: {off} of {change}"
            );
        }
    }
}

/// Protects: by a clock of rays, which does not count the filter, a denoised tile takes as long as
/// the noisy one, although its margin is rendered, too, and takes a different time.
#[test]
fn denoised_tiles_take_what_noisy_ones_take() {
    let scene = lamp();
    let settings = Settings {
        integrator: crate::scene::Integrator::Path,
        size: [160, 120],
        ..Settings::from_scene(&scene)
    };
    let (grid, end) = (
        TileGrid {
            size: settings.size,
            edge: 32,
            seed: 3,
        },
        Instant::now() + Duration::from_secs(600),
    );
    let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
    let (renderer, display) = (
        SettingRenderer::new(&scene, &settings, &(), (stopwatch, &Instant::now)),
        Display::from_render(&scene.render),
    );
    let looks = renderer
        .run_pilot_pass(grid, &[7, 8, 12], end)
        .expect("time");
    let sample = TileSample::new(grid, &looks);
    let tiles: Vec<u32> = sample
        .passes
        .iter()
        .map(|pilot_pass| pilot_pass.tile)
        .collect();
    let mut exposure = renderer
        .prepare_reference(
            &RungSetting::default(),
            64,
            grid,
            MeasurementStart::default(),
            end,
        )
        .expect("time");
    assert!(exposure.render_tiles(&tiles, end));
    let mut measurements = Measurements::new(&renderer, &sample, display);
    measurements.add_reference_tiles(tiles.iter().map(|&tile| {
        let crop = grid.tile_crop(tile);
        ReferenceTile::new(
            [crop.width, crop.height],
            &exposure
                .film
                .tile_means_and_variances(tile)
                .expect("rendered"),
            display,
        )
    }));
    let (noisy, denoised) = (
        RungSetting::default(),
        RungSetting::from_rung(RungChoice::parse("reconstruction=denoised").expect("a rung")),
    );
    for setting in [&noisy, &denoised] {
        assert!(
            measurements
                .measure_setting(setting, (2, 2), None, false, end)
                .expect("a scene")
        );
    }
    let time = measurements
        .relative_cost(&denoised, &noisy)
        .expect("both")
        .time
        .value;
    assert!((time - 1.0).abs() < 1e-9, "{time}");
}

/// Protects: a stopped measurement returns its results so far; before the first picture, nothing.
#[test]
fn what_was_measured_is_kept_when_it_is_stopped() {
    struct StopsAt<'a> {
        clock: &'a CountingClock,
        seconds: f64,
    }
    impl Observer for StopsAt<'_> {
        fn is_cancelled(&self) -> bool {
            self.clock.seconds() >= self.seconds
        }
    }
    let scene = lamp();
    let settings = Settings {
        integrator: crate::scene::Integrator::Path,
        ..Settings::from_scene(&scene)
    };
    let measured = |seconds: f64| {
        let clock = CountingClock::new();
        let (now, observer) = (
            || clock.now(),
            StopsAt {
                clock: &clock,
                seconds,
            },
        );
        let effort = AccuracyEffort {
            budget: Duration::from_secs(4),
            size: Some([16, 12]),
            rounds: 2,
        };
        let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
        let session = MeasurementSession::new(
            &scene,
            &settings,
            Display::from_render(&scene.render),
            effort,
            &observer,
            (stopwatch, &now),
        );
        (
            session
                .run_measurement(MeasurementStart::default(), &mut ())
                .map(|(report, _)| report),
            clock.seconds(),
        )
    };
    assert_eq!(
        measured(0.02).0.err(),
        Some(MeasureError::Prepare(PrepareError::Cancelled))
    );
    let (report, took) = measured(2.6);
    let report = report.expect("what there is");
    assert!(
        report.cut_short && report.own.renders >= 1 && took < 3.0,
        "{took}"
    );
}
