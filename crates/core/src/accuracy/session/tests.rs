//! Measurements by a clock that counts rays, so that every time is known.

use core::time::Duration;
use std::sync::atomic::{AtomicU64, Ordering};

use super::*;
use crate::scene::Scene;

/// Two walls that glow and mirror: a path of n segments has n rays, and no chance.
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

/// Remembers what it hears.
#[derive(Default)]
struct Heard(Vec<(String, f64)>);

impl Listener for Heard {
    fn step(&mut self, what: &str, share: f64) {
        self.0.push((what.to_owned(), share));
    }
}

fn measured(size: Option<[u32; 2]>, heard: &mut Heard) -> Report {
    let scene = corridor();
    let effort = Effort { budget: Duration::from_secs(600), size, rounds: 3 };
    let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
    let session =
        Session::new(&scene, &Settings::of(&scene), Display::of(&scene.render), effort, &(), (stopwatch, &Instant::now));
    session.run(Start::default(), heard).expect("a report").0
}

/// Protects: times are those of rendering alone, and ratios are a setting's time over the scene's own: n segments take n/4 of what
/// four take, trees and scans the same; and who listens hears of every rung.
#[test]
fn times_are_what_the_clock_says() {
    let mut heard = Heard::default();
    let report = measured(Some([4, 2]), &mut heard);
    assert_eq!((report.own.rays, report.own.seconds.median), (32, 32e-6));
    let lengths = report.ladders.iter().find(|ladder| ladder.ladder == "path-length").expect("mirrors");
    for rung in &lengths.rungs {
        let (n, of) = (rung.rung.parse::<f64>().expect("a number"), rung.measured.as_ref().expect("time"));
        let times = (of.renders, of.seconds.median, of.ratio.median, of.ratio.max);
        assert_eq!(times, (3, n * 8.0 * 1e-6, n / 4.0, n / 4.0), "{n}");
    }
    for price in report.prices.iter().flat_map(|ladder| &ladder.rungs) {
        let paid = price.paid.as_ref().expect("time");
        assert_eq!((paid.preparing.median, paid.seconds.median, paid.ratio.median, paid.same_bits), (0.0, 32e-6, 1.0, true));
    }
    let reference = &report.reference;
    assert_eq!(reference.seconds, f64::from(reference.samples) * 64.0 * 8.0 * 1e-6);
    assert!(
        ["rendering the reference", "round 3: path-length=64", "time of accelerator=linear"]
            .iter()
            .all(|words| heard.0.iter().any(|(what, _)| what == words)),
        "{:?}",
        heard.0
    );
    assert!(heard.0.is_sorted_by(|a, b| a.1 <= b.1) && heard.0.iter().all(|(_, share)| (0.0..=1.0).contains(share)));
}

thread_local! {
    static AFTER_THE_REFERENCE: core::cell::Cell<bool> = const { core::cell::Cell::new(false) };
}

/// Protects: the first picture after the reference, which takes longer for what it finds cold, is no reason to call others sooner: `reference`
/// has the rays and the error of the scene as it is.
#[test]
fn a_cold_first_render_is_not_counted() {
    let scene = corridor();
    let effort = Effort { budget: Duration::from_secs(600), size: Some([4, 2]), rounds: 2 };
    let stopwatch: Stopwatch = |work| {
        let rays = work();
        let is_cold = rays > 0 && AFTER_THE_REFERENCE.replace(rays > 10_000);
        rays as f64 * if is_cold { 2e-6 } else { 1e-6 }
    };
    let session =
        Session::new(&scene, &Settings::of(&scene), Display::of(&scene.render), effort, &(), (stopwatch, &Instant::now));
    let report = session.run(Start::default(), &mut ()).expect("a report").0;
    let seconds = report.own.seconds;
    assert_eq!((report.own.renders, seconds.min, seconds.max, report.answer.same_error), (2, 32e-6, 32e-6, None));
}

thread_local! {
    static SHORT_RENDERS: core::cell::Cell<u32> = const { core::cell::Cell::new(0) };
}

/// Protects: one round says what a setting takes, and that it is not known to be sooner; two say how far apart they are, of which the slower one
/// counts: one segment takes a quarter of what four take, and by this clock the second time a half.
#[test]
fn one_round_does_not_tell_who_is_sooner() {
    let scene = corridor();
    let settings = Settings { size: [4, 2], ..Settings::of(&scene) };
    let stopwatch: Stopwatch = |work| match work() {
        8 => 8.0 * f64::from(SHORT_RENDERS.replace(SHORT_RENDERS.get() + 1) + 1),
        rays => rays as f64,
    };
    let studio = Renderer { scene: &scene, settings: &settings, observer: &(), stopwatch, now: &Instant::now };
    let time = ReferenceTime { end: Instant::now(), latest: Instant::now() + Duration::from_secs(600) };
    let (truth, ..) =
        studio.reference(&Setting::default(), Display::of(&scene.render), time, Start::default()).expect("a reference");
    let mut measurements = Measurements::new(&studio, &truth);
    let (own, short) = (Setting::default(), Setting::one(Choice::parse("path-length=1").expect("a rung")));
    for (round, time_over, most) in [(0, 0.25, f64::INFINITY), (1, 0.375, 0.5)] {
        assert_eq!(measurements.relative_cost(&short, &own).is_some(), round > 0);
        for setting in [&own, &short] {
            assert!(measurements.take(setting, round, time.latest).expect("a small picture"));
        }
        let cost = measurements.relative_cost(&short, &own).expect("both");
        assert_eq!((cost.time, cost.most_time), (time_over, most));
    }
}

/// Protects: effects are priced by the same clock: what mirrors add to one ray of camera is three more.
#[test]
fn effects_are_priced_too() {
    let report = measured(Some([4, 2]), &mut Heard::default());
    let costs = report.costs.expect("time");
    let mirror = costs.effects.iter().find(|cost| cost.effect == "mirror reflection").expect("a mirror");
    assert_eq!((costs.size, mirror.rays, mirror.ratio.median, costs.late.len()), ([4, 2], 4.0, 4.0, 0));
}

/// Protects: the frontier goes by time and error alone: each setting on it is slower and better than the one before it, the fastest
/// traces one segment, and no setting measured is better in both.
#[test]
fn the_frontier_is_what_nobody_beats() {
    let report = measured(Some([4, 2]), &mut Heard::default());
    let point = |of: &crate::accuracy::Measured| (of.seconds.median, of.errors.relmse.value);
    let front: Vec<(f64, f64)> = report.frontier.iter().map(|candidate| point(&candidate.measured)).collect();
    assert!(front.is_sorted_by(|a, b| a.0 < b.0 && a.1 > b.1) && front.len() >= 4, "{front:?}");
    assert_eq!(report.frontier[0].flags, ["--rung path-length=1"]);
    for rung in report.ladders.iter().flat_map(|ladder| &ladder.rungs) {
        let (time, error) = point(rung.measured.as_ref().expect("time"));
        assert!(!front.iter().any(|f| time < 0.95 * f.0 && error < 0.95 * f.1), "{} beats {front:?}", rung.rung);
    }
}

/// Protects: where no size is asked for, a scene that is rendered in no time is measured at its own, with its own pictures beside
/// the reference's, as many as there are settings.
#[test]
fn small_scenes_are_measured_as_they_are() {
    let report = measured(None, &mut Heard::default());
    assert_eq!((report.size, report.full_size), ([4, 2], [4, 2]));
    let names: Vec<&str> = report.pictures.iter().map(|shown| shown.name.as_str()).collect();
    assert_eq!(names[..3], ["reference", "as it is", "samples=4"]);
    let rungs = report.ladders.iter().flat_map(|ladder| &ladder.rungs);
    assert_eq!(names.len(), 2 + rungs.filter(|rung| !rung.in_use).count());
    assert!(report.pictures.iter().all(|shown| (shown.picture.width, shown.picture.height) == (4, 2)));
}

/// Protects: a kept reference of which one replicate is there is gone on with to the second, without which nothing is known of its error:
/// what that took is told, and the film is that of a render of both.
#[test]
fn a_reference_that_is_not_done_is_gone_on_with() {
    let scene = corridor();
    let settings = Settings::of(&scene);
    let rungs: Vec<Choice> = ["path-length=64"].map(|text| Choice::parse(text).expect("a rung")).to_vec();
    let film_of = |replicates: u32| {
        let (scene, settings) = super::super::setting::reference(&Setting::of(&rungs), &scene, &settings, 64 * 256);
        let settings = Settings { replicates: Some(64), aovs: vec![crate::settings::Aov::StandardError], ..settings };
        let ready = crate::prepare(&scene, &settings, &()).expect("a reference");
        let mut film = ready.film("corridor");
        let part = crate::film::Part { replicates: 0..replicates, ..film.whole() };
        ready.render_part(&mut film, &part, &()).expect("its own film");
        film
    };
    let start = Start { scene: "corridor", reference: Some(KeptReference { rungs: rungs.clone(), film: film_of(1) }) };
    let effort = Effort { budget: Duration::from_secs(600), size: Some([4, 2]), rounds: 2 };
    let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
    let session = Session::new(&scene, &settings, Display::of(&scene.render), effort, &(), (stopwatch, &Instant::now));
    let (report, kept) = session.run(start, &mut ()).expect("a report");
    let told = (report.reference.samples, report.reference.seconds, report.reference.kept);
    assert_eq!(told, (2 * 256, 256.0 * 64.0 * 8.0 * 1e-6, true));
    let both = film_of(2);
    assert_eq!((kept.film.picture(), kept.film.counters()), (both.picture(), both.counters()));
}

/// Protects: rungs that are no other picture to a scene are not measured: without a light or a lamp there is neither a shadow to leave out
/// nor one to harden.
#[test]
fn rungs_without_a_difference_are_left_out() {
    let scene = corridor();
    let effort = Effort { budget: Duration::from_secs(600), size: Some([4, 2]), rounds: 2 };
    let stopwatch: Stopwatch = |work| work() as f64;
    let session =
        Session::new(&scene, &Settings::of(&scene), Display::of(&scene.render), effort, &(), (stopwatch, &Instant::now));
    assert_eq!(session.choices_of(Ladder::Shadows).map(|choice| choice.rung()).collect::<Vec<_>>(), ["on"]);
    assert_eq!(session.choices_of(Ladder::Precision).count(), 2);
}

/// Protects: rungs whose numbers can't store the scene are left out, also of what is worth its time, so that doubles that can are measured.
#[test]
fn rungs_that_cannot_show_the_scene_are_left_out() {
    let mut scene = corridor();
    // Wherever the origin of storage is, one of both is far from it.
    for [min, max] in [["[3e5, 0, 3e5]", "[300001, 2, 300000.01]"], ["[-300001, 0, -300000.01]", "[-3e5, 2, -3e5]"]] {
        let thin = format!(r#"{{"shape": {{"box": {{"min": {min}, "max": {max}}}}}, "material": "m"}}"#);
        scene.objects.push(serde_json::from_str(&thin).expect("an object"));
    }
    let settings = Settings { precision: crate::settings::PrecisionChoice::Reference, ..Settings::of(&scene) };
    let effort = Effort { budget: Duration::from_secs(600), size: Some([4, 2]), rounds: 2 };
    let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
    let session = Session::new(&scene, &settings, Display::of(&scene.render), effort, &(), (stopwatch, &Instant::now));
    let report = session.run(Start::default(), &mut ()).expect("a report").0;
    let precision = report.ladders.iter().find(|ladder| ladder.ladder == "precision").expect("a ladder");
    assert_eq!(precision.rungs.iter().map(|rung| rung.rung.as_str()).collect::<Vec<_>>(), ["reference"]);
    assert!(report.frontier.iter().all(|candidate| candidate.flags.iter().all(|flag| !flag.contains("precision"))));
}

/// Protects: a rung that takes too long to be looked at is not what others are held against: the most exact one is the next.
#[test]
fn what_is_beyond_reach_is_not_the_most_exact() {
    let scene = corridor();
    let effort = Effort { budget: Duration::from_secs(600), size: Some([4, 2]), rounds: 2 };
    let stopwatch: Stopwatch = |work| work() as f64;
    let mut session =
        Session::new(&scene, &Settings::of(&scene), Display::of(&scene.render), effort, &(), (stopwatch, &Instant::now));
    let lengths: Vec<Choice> = session.choices_of(Ladder::PathLength).collect();
    let [.., second, first] = lengths[..] else { panic!("{lengths:?}") };
    assert_eq!(session.most_exact(Ladder::PathLength), Setting::one(first));
    session.beyond.push(first);
    assert_eq!(session.most_exact(Ladder::PathLength), Setting::one(second));
}

/// Protects: what a price says of bits is compared: another accelerator gives the same picture, fewer segments do not.
#[test]
fn another_picture_is_told_from_the_same() {
    let scene = corridor();
    let settings = Settings { size: [4, 2], ..Settings::of(&scene) };
    let stopwatch: Stopwatch = |work| work() as f64;
    let studio = Renderer { scene: &scene, settings: &settings, observer: &(), stopwatch, now: &Instant::now };
    let display = Display::of(&scene.render);
    let time = ReferenceTime { end: Instant::now(), latest: Instant::now() + Duration::from_secs(600) };
    let (truth, ..) = studio.reference(&Setting::default(), display, time, Start::default()).expect("a reference");
    let measurements = Measurements::new(&studio, &truth);
    let same = |rung: &str| {
        let setting = Setting::one(Choice::parse(rung).expect("a rung"));
        let paid =
            measurements.paid(&setting, &Setting::default(), Instant::now() + Duration::from_secs(600)).expect("a small picture");
        paid.expect("time").same_bits
    };
    assert!(same("accelerator=linear") && !same("path-length=1"));
}

/// A scene of many samples with a lamp, so that most ladders are reached and rungs differ in what they take.
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

/// A clock that each question moves on by a millisecond.
struct Asked {
    start: Instant,
    questions: AtomicU64,
}

impl Asked {
    fn new() -> Self {
        Self { start: Instant::now(), questions: AtomicU64::new(0) }
    }

    fn seconds(&self) -> f64 {
        self.questions.load(Ordering::Relaxed) as f64 * 1e-3
    }

    fn now(&self) -> Instant {
        self.start + Duration::from_millis(1 + self.questions.fetch_add(1, Ordering::Relaxed))
    }
}

/// Protects: the time is asked within every render, and all of it ends when it is over, whatever is under way, with what was measured by
/// then: the scene's own picture, and of the ladders the samples first.
#[test]
fn all_ends_with_the_time() {
    let scene = lamp();
    let settings = Settings { integrator: crate::scene::Integrator::Path, ..Settings::of(&scene) };
    let measured = |seconds: f64| {
        let clock = Asked::new();
        let now = || clock.now();
        let effort = Effort { budget: Duration::from_secs_f64(seconds), size: Some([16, 12]), rounds: 3 };
        let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
        let session = Session::new(&scene, &settings, Display::of(&scene.render), effort, &(), (stopwatch, &now));
        (session.run(Start::default(), &mut ()).map(|(report, _)| report), clock.seconds())
    };
    for budget in [1.0, 2.0, 4.0] {
        let (report, took) = measured(budget);
        let report = report.unwrap_or_else(|error| panic!("{budget}: {error}"));
        assert!(took <= 1.1 * budget && report.cut_short, "{took} of {budget}");
        assert_eq!(report.ladders[..2].iter().map(|ladder| ladder.ladder).collect::<Vec<_>>(), ["samples", "integrator"]);
        let known = report.ladders[0].rungs.iter().filter(|rung| rung.measured.is_some()).count();
        assert!(known >= 2 && report.reference.samples >= 2, "{known} rungs in {budget}");
    }
    let (report, took) = measured(0.01);
    assert!(matches!(report, Err(MeasureError::NoTime)) && took < 0.1, "{took}: {:?}", report.err());
}

/// Protects: how long a rung of samples will take is told by the time of one sample, not of the whole picture: where there is time for twenty
/// pictures of 16 samples, one of 64 takes that of four.
#[test]
fn rungs_are_begun_that_can_be_finished() {
    let scene = lamp();
    let settings = Settings { integrator: crate::scene::Integrator::Path, ..Settings::of(&scene) };
    let (clock, stopwatch): (Asked, Stopwatch) = (Asked::new(), |work| work() as f64 * 1e-6);
    let now = || clock.now();
    let studio = Renderer { scene: &scene, settings: &settings, observer: &(), stopwatch, now: &now };
    let far = clock.start + Duration::from_secs(1_000_000);
    let before = clock.seconds();
    assert!(studio.take(&Setting::default(), 0, far).is_ok());
    let own = clock.seconds() - before;
    let time = ReferenceTime { end: clock.start, latest: far };
    let (truth, ..) =
        studio.reference(&Setting::default(), Display::of(&scene.render), time, Start::default()).expect("a reference");
    let mut measurements = Measurements::new(&studio, &truth);
    let effort = Effort { budget: Duration::from_secs_f64(20.0 * own / RUNGS), size: None, rounds: 2 };
    let mut session = Session::new(&scene, &settings, Display::of(&scene.render), effort, &(), (stopwatch, &now));
    let more = Choice::parse("samples=64").expect("a rung");
    session.pictured = vec![Ladder::Samples];
    session.beyond = Ladder::Samples.choices().filter(|&choice| choice != more).collect();
    session.rounds(&mut measurements, &mut ()).expect("time enough");
    assert!(measurements.measured(&Setting::one(more), &Setting::default()).is_some() && !session.cut_short);
}

/// Protects: a reference that lacks its second replicate when its share of the time is over has half of what is left.
#[test]
fn a_slow_reference_has_half_of_what_is_left() {
    let scene = corridor();
    let budget = Duration::from_secs(600);
    let effort = Effort { budget, size: Some([4, 2]), rounds: 2 };
    let stopwatch: Stopwatch = |work| work() as f64;
    let session =
        Session::new(&scene, &Settings::of(&scene), Display::of(&scene.render), effort, &(), (stopwatch, &Instant::now));
    let (time, over) = (session.reference_time(), session.start + budget);
    let (longer, left) = (time.latest - time.end, over - time.latest);
    assert!(!longer.is_zero() && longer.abs_diff(left) < Duration::from_millis(1), "{longer:?} and {left:?}");
}

/// Protects: who stops a measurement gets what was measured by then; before there is a picture, that is nothing.
#[test]
fn what_was_measured_is_kept_when_it_is_stopped() {
    struct StopsAt<'a> {
        clock: &'a Asked,
        seconds: f64,
    }
    impl Observer for StopsAt<'_> {
        fn cancelled(&self) -> bool {
            self.clock.seconds() >= self.seconds
        }
    }
    let scene = lamp();
    let settings = Settings { integrator: crate::scene::Integrator::Path, ..Settings::of(&scene) };
    let measured = |seconds: f64| {
        let clock = Asked::new();
        let (now, observer) = (|| clock.now(), StopsAt { clock: &clock, seconds });
        let effort = Effort { budget: Duration::from_secs(4), size: Some([16, 12]), rounds: 2 };
        let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
        let session = Session::new(&scene, &settings, Display::of(&scene.render), effort, &observer, (stopwatch, &now));
        (session.run(Start::default(), &mut ()).map(|(report, _)| report), clock.seconds())
    };
    assert_eq!(measured(0.02).0.err(), Some(MeasureError::Prepare(PrepareError::Cancelled)));
    let (report, took) = measured(2.6);
    let report = report.expect("what there is");
    assert!(report.cut_short && report.own.renders >= 1 && took < 3.0, "{took}");
}

/// Protects: a scene of 64 samples is measured as it is, and its rungs with 16 and beside that: what is in use takes as long as itself, base
/// and rung of 16 samples a quarter of the scene's own time, and the flag of a rung names the rung alone. Numbers of samples come first, but
/// for those that take sixteen times as long.
#[test]
fn rungs_are_put_on_fewer_samples() {
    let scene = Scene { render: crate::scene::Render { samples: 64, ..lamp().render }, ..lamp() };
    let settings = Settings { integrator: crate::scene::Integrator::Path, ..Settings::of(&scene) };
    assert_eq!(settings.sampling.count(), 64);
    let effort = Effort { budget: Duration::from_secs(600), size: Some([8, 6]), rounds: 2 };
    let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
    let session = Session::new(&scene, &settings, Display::of(&scene.render), effort, &(), (stopwatch, &Instant::now));
    let order: Vec<String> = session.rounds_of().iter().map(Setting::to_string).collect();
    assert_eq!(order[..5], ["as it is", "samples=1", "samples=4", "samples=16", "samples=256"]);
    assert!(order[5..order.len() - 1].iter().all(|name| name.contains("samples=16") && name.contains(' ')), "{order:?}");
    assert_eq!(order.last().map(String::as_str), Some("samples=1024"));
    let report = session.run(Start::default(), &mut ()).expect("a report").0;
    let ladder = |name: &str| report.ladders.iter().find(|ladder| ladder.ladder == name).expect("a ladder");
    let ratio = |of: &crate::accuracy::Measured| of.ratio.median;
    let base = report.base.as_ref().expect("fewer samples");
    assert!(base.samples == 16 && (ratio(&base.measured) - 0.25).abs() < 0.02, "{base:?}");
    assert!((report.own.rays as f64 / base.measured.rays as f64 - 4.0).abs() < 0.3);
    let samples = ladder("samples");
    let of =
        |name: &str| samples.rungs.iter().find(|rung| rung.rung == name).and_then(|rung| rung.measured.as_ref()).expect("time");
    assert_eq!((ratio(of("64")), ratio(of("16"))), (1.0, ratio(&base.measured)));
    for rung in &ladder("path-length").rungs {
        let (measured, in_use) = (rung.measured.as_ref().expect("time"), rung.rung == "4");
        assert_eq!((rung.in_use, &rung.flag), (in_use, &(!in_use).then(|| format!("--rung path-length={}", rung.rung))));
        assert!(if in_use { ratio(measured) == 1.0 } else { (0.05..2.5).contains(&ratio(measured)) }, "{}", rung.rung);
        assert!(measured.rays < 2 * base.measured.rays && rung.own_error.is_some(), "{}", rung.rung);
    }
    assert!(report.prices.iter().flat_map(|ladder| &ladder.rungs).all(|rung| {
        rung.paid.as_ref().is_some_and(|paid| paid.ratio.median == 1.0 && paid.seconds.median < 0.5 * report.own.seconds.median)
    }));
    let half = report.answer.half_the_error.as_ref().expect("more samples");
    assert!(half.error <= 0.55 && half.time <= 16.5, "{half:?}");
}
