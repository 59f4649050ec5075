//! Measurements with a clock that counts rays, so that every time is known.

use std::sync::atomic::{AtomicU64, Ordering};

use super::super::figures::Figures;
use super::super::policy::{is_done, jobs};
use super::super::setting::RungSetting;
use super::super::tiles::{evenly_spread_tiles, tile_edge};
use super::super::{
    AccuracyReport, MeasureError, MeasuredSetting, ProgressListener, measure_by_clocks,
};
use super::*;
use crate::bench::clock::Stopwatch;
use crate::dispatch::prepare;
use crate::ladder::{Ladder, RungChoice};
use crate::observer::Observer;
use crate::scene::{Integrator, Scene};
use crate::settings::{PrecisionChoice, Sampling, Settings};

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

/// A scene with a lamp, so that most ladders apply and rungs differ in time.
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

fn path_settings(scene: &Scene) -> Settings {
    Settings {
        integrator: Integrator::Path,
        ..Settings::from_scene(scene)
    }
}

const MICROSECOND_A_RAY: Stopwatch = |work| work() as f64 * 1e-6;

fn effort(seconds: f64, rounds: u32) -> AccuracyEffort {
    AccuracyEffort {
        budget: Duration::from_secs_f64(seconds),
        rounds,
    }
}

fn measured_by(stopwatch: Stopwatch, listener: ProgressListener<'_>) -> AccuracyReport {
    let scene = corridor();
    measure_by_clocks(
        (&scene, &Settings::from_scene(&scene)),
        &effort(600.0, 3),
        &(),
        listener,
        (stopwatch, &Instant::now),
    )
    .expect("a report")
}

/// Calls a function with a study of a scene that has done no trial.
fn with_study<T>(
    scene: &Scene,
    settings: &Settings,
    use_study: impl FnOnce(&mut Study<'_>) -> T,
) -> T {
    let clocks: (Stopwatch, _) = (
        MICROSECOND_A_RAY,
        &Instant::now as &(dyn Fn() -> Instant + Sync),
    );
    let renderer = SettingRenderer::new(scene, settings, &(), clocks);
    use_study(&mut Study::new(&renderer, effort(600.0, 2), Instant::now()))
}

/// The measured rungs of a ladder beside the one in use.
fn rungs<'a>(report: &'a AccuracyReport, ladder: &str) -> Vec<(&'static str, &'a MeasuredSetting)> {
    let rung = |of: &'a MeasuredSetting| {
        let choice = of.single_rung()?;
        (choice.ladder().name() == ladder).then(|| (choice.rung(), of))
    };
    report.settings.iter().filter_map(rung).collect()
}

fn near(value: f64, expected: f64) {
    assert!(
        (value / expected - 1.0).abs() < 1e-9,
        "{value}, not {expected}"
    );
}

/// Protects: times are those of rendering and of the look for objects before it, and ratios are a
/// setting's time over that of the one in use. n segments take n/4 of the time of four. The light of n segments with a mirror of one
/// half is 1 − 0.5ⁿ of all. The listener is told every rung.
#[test]
fn times_are_what_the_clock_says() {
    let mut heard: Vec<(String, f64)> = Vec::new();
    let mut listener = |label: &str, share: f64| heard.push((label.to_owned(), share));
    let report = measured_by(MICROSECOND_A_RAY, &mut listener);
    // The look is as large as this small picture.
    near(report.own().seconds.value, 64e-6);
    let lengths = rungs(&report, "path-length");
    assert_eq!(lengths.len(), 5);
    for (rung, measured) in lengths {
        let n: f64 = rung.parse().expect("a number");
        near(measured.seconds.value, n * 16.0 * 1e-6);
        near(measured.ratio.value, n / 4.0);
        let light = measured.errors.light.value;
        assert!(
            (light - (1.0 - libm::exp2(-n))).abs() < 1e-6,
            "{n}: {light}"
        );
    }
    near(
        report.reference.seconds,
        f64::from(report.reference.samples) * 64.0 * 8.0 * 1e-6,
    );
    let words = ["the reference", "--max-depth 64"];
    let is_heard = |words: &&str| heard.iter().any(|(label, _)| label == words);
    assert!(words.iter().all(is_heard), "{heard:?}");
    let is_share = |share: &f64| (0.0..=1.0).contains(share);
    assert!(heard.is_sorted_by(|a, b| a.1 <= b.1) && heard.iter().all(|of| is_share(&of.1)));
}

/// Number of reported steps of the measurement on a machine that becomes slower.
static STEPS: AtomicU64 = AtomicU64::new(0);

/// Protects: a machine that becomes slower with each trial, by 3 %, makes no rung slow: its time is
/// compared with those of the baseline before and after it.
#[test]
fn a_slower_machine_makes_no_rung_slow() {
    let slower: Stopwatch =
        |work| work() as f64 * 1e-6 * 1.03_f64.powi(STEPS.load(Ordering::Relaxed) as i32);
    let mut listener = |_: &str, _: f64| {
        STEPS.fetch_add(1, Ordering::Relaxed);
    };
    let report = measured_by(slower, &mut listener);
    for (rung, measured) in rungs(&report, "path-length") {
        let share = rung.parse::<f64>().expect("a number") / 4.0;
        let ratio = measured.ratio;
        assert!(
            ratio.low <= share && share <= ratio.high,
            "{ratio:?}, not {share}"
        );
        assert!(
            (ratio.value / share - 1.0).abs() < 0.1,
            "{ratio:?}, not {share}"
        );
    }
}

/// Protects: a small scene is measured at its own size on the whole picture, which the page shows with
/// its setting in use, the recommended one and the exact one. Paths of four segments show less light
/// than exact ones.
#[test]
fn small_scenes_are_measured_as_they_are() {
    let report = measured_by(MICROSECOND_A_RAY, &mut |_, _| ());
    assert_eq!(
        (report.size, report.tiles.measured, report.tiles.all),
        ([4, 2], 1, 1)
    );
    let pictures = report.pictures;
    assert_eq!((pictures.whole.width, pictures.whole.height), (4, 2));
    let [first, .., last] = &pictures.details[..] else {
        panic!("{} pictures", pictures.details.len())
    };
    assert_eq!((first.row, last.row), (Some(0), None));
    assert_eq!(first.picture, pictures.whole);
    assert!(last.picture.rgb[0][0] > 1.03 * first.picture.rgb[0][0]);
}

/// Protects: the magnified part of a picture shows an object, never the sky beside it, whatever the
/// sky's own noise.
#[test]
fn the_magnified_part_shows_an_object() {
    let mut scene = lamp();
    // A sphere of the sky's own radiance has no noise, and a sun on the other side has.
    let sphere =
        r#"{"shape": {"sphere": {"centre": [1.5, -1.2, -0.5], "radius": 0.4}}, "material": "g"}"#;
    let glow = r#"{"name": "g", "model": {"classic": {"local": 0, "emission": 0.2}}}"#;
    let sky = r#"{"gradient": {"bottom": [0.2, 0.2, 0.2], "top": [0.2, 0.2, 0.2], "suns":
        [{"direction": [-0.3, -0.39, -0.94], "colour": [1, 1, 1], "weight": 50, "exponent": 50000}]}}"#;
    scene.objects = vec![serde_json::from_str(sphere).expect("an object")];
    scene.materials = vec![serde_json::from_str(glow).expect("a material")];
    scene.sky = serde_json::from_str(sky).expect("a sky");
    let settings = Settings {
        size: [256, 192],
        ..path_settings(&scene)
    };
    with_study(&scene, &settings, |study| {
        study.look_at_picture().expect("a picture");
        let [x, y] = [
            study.detail.x + study.detail.width / 2,
            study.detail.y + study.detail.height / 2,
        ];
        assert!(x > 128 && y > 96, "{:?}", study.detail);
    });
}

/// Protects: the error of the setting in use is the claim that a render of it states, more samples
/// are never told worse, and four times the samples have half the error for four times the time.
#[test]
fn errors_are_those_that_pictures_claim() {
    let scene = lamp();
    let settings = Settings {
        size: [64, 48],
        sampling: Sampling::General(64),
        max_depth: 64,
        ..path_settings(&scene)
    };
    let report = measure_by_clocks(
        (&scene, &settings),
        &effort(600.0, 2),
        &(),
        &mut |_, _| (),
        (MICROSECOND_A_RAY, &Instant::now),
    )
    .expect("a report");
    let mut film = prepare(&scene, &settings, &())
        .expect("a scene")
        .new_film("");
    let ready = prepare(&scene, &settings, &()).expect("a scene");
    let part = film.full_part();
    ready
        .render_part(&mut film, &part, &())
        .expect("its own film");
    let claim = film
        .estimate_uncertainty()
        .expect("random numbers")
        .root_relmse;
    let own = report.own().errors.root_relmse;
    assert!(
        (own.value / claim.value - 1.0).abs() < 0.01,
        "{own:?}, not {claim:?}"
    );
    assert!(own.low <= claim.low && claim.high <= own.high);
    let samples = rungs(&report, "samples").into_iter();
    let errors: Vec<f64> = samples.map(|(_, of)| of.errors.root_relmse.value).collect();
    assert!(
        errors.len() == 5 && errors.is_sorted_by(|a, b| a > b),
        "{errors:?}"
    );
    let half = report
        .recommendations
        .half_the_error
        .expect("four times the samples");
    let row = &report.settings[half.row];
    assert!(
        row.ratio.value < 4.2 && row.error_ratio.value < 0.56,
        "{row:?}"
    );
    assert!(report.frontier.contains(&half.row));
}

/// Protects: the time of another number of samples is that of a render: a first look, which does not
/// depend on the samples, and the samples.
#[test]
fn a_first_look_takes_the_same_time_for_all_samples() {
    let scene = lamp();
    let settings = Settings {
        size: [64, 48],
        ..path_settings(&scene)
    };
    let ready = prepare(&scene, &settings, &()).expect("a scene");
    let look = ready.look_for_objects(&()).0.counters.ray_count() as f64 * 1e-6;
    with_study(&scene, &settings, |study| {
        study.look_at_picture().expect("a picture");
        let job = Job::whole(&RungSetting::default());
        study.run_job(job).expect("a picture");
        let row = |rung: &str| {
            let choice = RungChoice::parse(rung).expect("a rung");
            Figures { study }.summarise(&RungSetting::from_rung(choice))
        };
        let own = Figures { study }.summarise(&RungSetting::default());
        let samples = own.expect("a row").seconds.value - look;
        for (rung, share) in [("samples=1", 1.0 / 16.0), ("samples=64", 4.0)] {
            let row = row(rung).expect("a row");
            near(row.seconds.value, share * samples + look);
            near(row.ratio.value, (share * samples + look) / (samples + look));
        }
        assert!(look > 0.04 * samples, "{look}, {samples}");
    });
}

/// Protects: a ratio of numbers of samples is known on a machine whose speed changes, where times are not.
#[test]
fn ratios_of_samples_do_not_depend_on_the_load() {
    let scene = lamp();
    with_study(&scene, &path_settings(&scene), |study| {
        let (own, few) = (
            RungSetting::default(),
            RungSetting::from_rung(RungChoice::parse("samples=4").expect("a rung")),
        );
        for (job, seconds) in [
            (Job::whole(&few), 3.0),
            (Job::whole(&own), 8.0),
            (Job::tiles(&own, 0), 1.0),
            (Job::tiles(&own, 1), 2.0),
        ] {
            study.table.push(Trial {
                seconds,
                sums: vec![TileSums::default()],
                ..Trial::too_long(job)
            });
        }
        let row = Figures { study }.summarise(&few).expect("a row");
        near(row.ratio.value, 0.25);
        assert!(row.ratio.high < 1.2 * row.ratio.low, "{:?}", row.ratio);
        assert!(row.seconds.high > 2.0 * row.seconds.low, "{row:?}");
    });
}

/// Protects: beside a denoised picture that of the next number of samples, whose error no other tells, is
/// rendered before any rung; beside a noisy one after all.
#[test]
fn more_samples_come_first_beside_a_denoised_picture() {
    let scene = lamp();
    for denoise in [true, false] {
        let settings = Settings {
            denoise,
            ..path_settings(&scene)
        };
        with_study(&scene, &settings, |study| {
            let rung =
                |name: &str| RungSetting::from_rung(RungChoice::parse(name).expect("a rung"));
            let jobs = jobs(study);
            let place = |job: Job| jobs.iter().position(|of| *of == job).expect("a job");
            let [next, early] = [
                place(Job::whole(&rung("samples=64"))),
                place(Job::tiles(&rung("roulette=early"), 0)),
            ];
            assert_eq!(next < early, denoise);
        });
    }
}

/// Protects: only films that are denoised, or tell what that costs, have the layers of the filter; the
/// time of a noisy row is without them, that of a denoised row with them and the filter, and a rung
/// changes the rest.
#[test]
fn noisy_rows_have_no_layers() {
    let scene = lamp();
    with_study(&scene, &path_settings(&scene), |study| {
        study.tiles = vec![0];
        let (baseline, own) = (study.space.baseline.clone(), RungSetting::default());
        let layered = study.space.layered_baseline().expect("a filter");
        let rung = |name: &str| RungSetting::from_rung(RungChoice::parse(name).expect("a rung"));
        let (early, end) = (
            rung("roulette=early"),
            Instant::now() + Duration::from_secs(600),
        );
        let (denoised, few) = (rung("reconstruction=denoised"), rung("samples=4"));
        let (_, reference) = study.render(&Job::tiles(&own, 1), end).expect("a picture");
        study.truth = reference.iter().map(|of| mean_of_replicates(of)).collect();
        study.reference_replicates = reference;
        for (job, seconds) in [
            (Job::whole(&few), 8.0),
            (Job::whole(&own), 40.0),
            (Job::tiles(&study.space.exact_baseline(), 0), 1.0),
            (Job::tiles(&baseline, 0), 1.0),
            (Job::tiles(&layered, 0), 1.25),
            (Job::tiles(&early, 0), 0.5),
            (Job::tiles(&baseline, 0), 1.0),
        ] {
            let (timed, replicates) = study.render(&job, end).expect("a picture");
            let has_layers = job == Job::whole(&own) || job.setting == layered;
            assert_eq!(timed.film.is_to_be_denoised(), has_layers, "{job:?}");
            let timed = TimedFilm { seconds, ..timed };
            match job.region {
                Region::Whole => study.record_whole(&job, &timed, 0.0, end),
                Region::Tiles => study.record_tiles(&job, &timed, replicates, 0.0),
            }
        }
        let filter = study.table[1].denoised.as_ref().expect("a filter").seconds;
        let early_denoised = early.with_rungs(denoised.choices());
        for (setting, seconds) in [
            (&own, 32.0),
            (&few, 8.0),
            (&denoised, 40.0 + filter),
            (&early, 16.0),
            (&early_denoised, 24.0 + filter),
        ] {
            let row = Figures { study }.summarise(setting).expect("a row");
            near(row.seconds.value, seconds);
            near(row.ratio.value, seconds / 32.0);
        }
    });
}

/// Protects: a rung that halves the noise of the tiles may leave all noise that lies between them, or
/// nothing of it; its error is known where the tiles have as much noise as the whole picture.
#[test]
fn noise_between_tiles_is_in_doubt() {
    let scene = lamp();
    let settings = Settings {
        size: [64, 48],
        ..path_settings(&scene)
    };
    let early = RungSetting::from_rung(RungChoice::parse("roulette=early").expect("a rung"));
    let error = |share: f64| {
        with_study(&scene, &settings, |study| {
            study.tiles = (0..12).collect();
            let own = RungSetting::default();
            let claim = |value: f64| ErrorEstimate {
                value,
                low: 0.97 * value,
                high: 1.03 * value,
                carriers: 1e4,
            };
            let sums = |noise: f64| {
                let sums = TileSums {
                    pixels: 64.0,
                    noise: 64.0 * noise,
                    ..TileSums::default()
                };
                vec![sums; 12]
            };
            for (job, sums) in [
                (Job::whole(&own), Vec::new()),
                (Job::tiles(&own, 0), sums(0.04 * share)),
                (Job::tiles(&early, 0), sums(0.02 * share)),
            ] {
                study.table.push(Trial {
                    seconds: 1.0,
                    sums,
                    claim: Some(Uncertainty {
                        rmse: claim(0.2),
                        root_relmse: claim(0.2),
                        replicates: 2,
                        doubt: None,
                    }),
                    ..Trial::too_long(job)
                });
            }
            let row = Figures { study }.summarise(&early).expect("a row");
            row.errors.root_relmse
        })
    };
    let full = error(1.0);
    assert!(full.low > 0.12 && full.high < 0.16, "{full:?}");
    let quarter = error(0.25);
    assert!(quarter.low < 0.08 && quarter.high > 0.18, "{quarter:?}");
}

/// Protects: beside an error that is not known stands nothing, neither bias nor light, and it is in no
/// advice; with a known one stands both.
#[test]
fn nothing_stands_beside_an_unknown_error() {
    for emission in ["4", "4e-3"] {
        let mut scene = lamp();
        let lamp =
            format!(r#"{{"name": "l", "model": {{"physical": {{"emission": {emission}}}}}}}"#);
        scene.materials[1] = serde_json::from_str(&lamp).expect("a material");
        let is_dark = emission == "4e-3";
        if is_dark {
            scene.sky = serde_json::from_str(r#"{"constant": 1e-3}"#).expect("a sky");
        }
        let report = measure_by_clocks(
            (&scene, &path_settings(&scene)),
            &effort(600.0, 2),
            &(),
            &mut |_, _| (),
            (MICROSECOND_A_RAY, &Instant::now),
        );
        let report = report.expect("a report");
        for MeasuredSetting { errors, flags, .. } in &report.settings {
            let is_told = errors.bias.is_some() && errors.light.value.is_finite();
            assert_eq!(
                errors.root_relmse.is_known(),
                is_told,
                "{flags:?}: {errors:?}"
            );
        }
        assert_eq!(report.own().errors.root_relmse.is_known(), !is_dark);
        let none = crate::accuracy::Recommendations::default();
        assert_eq!(report.recommendations == none, is_dark);
    }
}

/// Protects: the light of a denoised row is the ratio of the denoised picture's light to the noisy
/// one's, as summed here.
#[test]
fn denoised_rows_tell_what_light_the_filter_leaves() {
    let scene = lamp();
    with_study(&scene, &path_settings(&scene), |study| {
        let (job, end) = (
            Job::whole(&RungSetting::default()),
            Instant::now() + Duration::from_secs(600),
        );
        let (timed, _) = study.render(&job, end).expect("a picture");
        study.record_whole(&job, &timed, 0.0, end);
        let (output, _) = study
            .renderer
            .denoise_film(&timed.film, end)
            .expect("four replicates");
        let light = |picture: &Picture| -> f64 {
            let channels = picture.rgb.as_flattened().iter();
            channels.map(|&channel| f64::from(channel)).sum()
        };
        let expected = light(&output.picture) / light(&timed.film.mean_colours());
        let denoised = RungChoice::parse("reconstruction=denoised").expect("a rung");
        let row = Figures { study }.summarise(&RungSetting::from_rung(denoised));
        let told = row.expect("a row").errors.light;
        assert!((told.value - expected).abs() < 1e-5, "{told:?}, {expected}");
        assert!((expected - 1.0).abs() > 1e-4, "{expected}");
    });
}

/// Protects: rungs that do not change the scene's picture are not tried, nor rungs whose precision
/// cannot store the scene. A rung that took too long is not tried again, and has no figures.
#[test]
fn rungs_without_a_picture_are_left_out() {
    let mut scene = corridor();
    let names = |study: &Study<'_>, ladder: Ladder| -> Vec<&str> {
        study
            .space
            .applicable_rungs(ladder)
            .iter()
            .map(RungChoice::rung)
            .collect()
    };
    let settings = Settings::from_scene(&scene);
    with_study(&scene, &settings, |study| {
        assert_eq!(names(study, Ladder::Shadows), ["on"]);
        assert_eq!(names(study, Ladder::Precision).len(), 2);
        let longest = study
            .space
            .applicable_rungs(Ladder::PathLength)
            .pop()
            .expect("mirrors");
        let setting = RungSetting::from_rung(longest);
        let jobs = jobs(study);
        let at = jobs
            .iter()
            .position(|job| job.setting == setting)
            .expect("a job");
        assert!(!is_done(study, &jobs, at));
        study.table.push(Trial::too_long(jobs[at].clone()));
        assert!(is_done(study, &jobs, at) && Figures { study }.summarise(&setting).is_none());
    });
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
        precision: PrecisionChoice::Reference,
        ..settings
    };
    with_study(&scene, &settings, |study| {
        assert_eq!(names(study, Ladder::Precision), ["reference"]);
    });
}

/// Protects: tiles are the same parts of a picture for every number of them, and spread over it.
#[test]
fn tiles_are_spread_evenly() {
    let size = [320, 240];
    let tiles = evenly_spread_tiles(size, 7);
    assert_eq!(tiles.len(), 80);
    let crops: Vec<Crop> = tiles[..16]
        .iter()
        .map(|&tile| tile_crop(size, tile))
        .collect();
    for (x, y) in [(0, 0), (160, 0), (0, 120), (160, 120)] {
        let is_inside =
            |crop: &&Crop| (x..x + 160).contains(&crop.x) && (y..y + 128).contains(&crop.y);
        let count = crops.iter().filter(is_inside).count();
        assert!((2..=7).contains(&count), "{count} tiles at {x}, {y}");
    }
    assert_eq!([[4, 2], [64, 48], [1920, 1080]].map(tile_edge), [8, 8, 32]);
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

/// Measures the scene with the lamp by a counting clock. `stop` is the second at which the observer
/// stops the measurement. Returns the seconds, too.
fn measured_in(
    budget: f64,
    size: [u32; 2],
    stop: f64,
) -> (Result<AccuracyReport, MeasureError>, f64) {
    struct StopsAt<'a>(&'a CountingClock, f64);
    impl Observer for StopsAt<'_> {
        fn is_cancelled(&self) -> bool {
            self.0.seconds() >= self.1
        }
    }
    let (scene, clock) = (lamp(), CountingClock::new());
    let settings = Settings {
        size,
        ..path_settings(&scene)
    };
    let report = measure_by_clocks(
        (&scene, &settings),
        &effort(budget, 2),
        &StopsAt(&clock, stop),
        &mut |_, _| (),
        (MICROSECOND_A_RAY, &|| clock.now()),
    );
    (report, clock.seconds())
}

/// Settings with figures, each with the number of tiles.
fn known(report: &AccuracyReport) -> Vec<(String, usize)> {
    let settings = report.settings.iter();
    settings
        .map(|of| (of.setting.to_string(), report.tiles.measured))
        .collect()
}

/// Protects: every render checks the time, and the measurement ends with its budget, whatever is in
/// progress. The report then holds the results so far: all numbers of samples, and more rungs of
/// other ladders with more time, on no fewer tiles.
#[test]
fn more_time_shows_no_less() {
    let mut before: Vec<(String, usize)> = Vec::new();
    for budget in [6.0, 18.0, 54.0, 162.0] {
        let (report, took) = measured_in(budget, [64, 48], f64::INFINITY);
        let report = report.unwrap_or_else(|error| panic!("{budget}: {error}"));
        assert!(took <= 1.03 * budget, "{took} of {budget}");
        let all = known(&report);
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
        assert!(all.len() >= 6, "{all:?} in {budget}");
        before = all;
    }
    assert!(before.len() >= 20, "{before:?}");
    let (report, took) = measured_in(0.01, [64, 48], f64::INFINITY);
    assert!(
        matches!(report, Err(MeasureError::InsufficientTime)) && took < 0.1,
        "{took}"
    );
}

/// Protects: a stopped measurement returns its results so far; before the first picture, nothing.
#[test]
fn what_was_measured_is_kept_when_it_is_stopped() {
    let (report, _) = measured_in(60.0, [64, 48], 0.02);
    assert_eq!(
        report.err(),
        Some(MeasureError::Prepare(PrepareError::Cancelled))
    );
    let (report, took) = measured_in(60.0, [64, 48], 20.0);
    let report = report.expect("what there is");
    assert!(
        report.cut_short && report.own().seconds.value > 0.0 && took < 21.0,
        "{took}"
    );
}
