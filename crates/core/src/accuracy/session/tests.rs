//! Measurements by a clock that counts rays, so that every time is known.

use core::time::Duration;

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
    let session = Session::new(&scene, &Settings::of(&scene), Display::of(&scene.render), effort, &(), stopwatch);
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
    assert_eq!(names[..3], ["reference", "as it is", "precision=fast"]);
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
    let session = Session::new(&scene, &settings, Display::of(&scene.render), effort, &(), stopwatch);
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
    let session = Session::new(&scene, &Settings::of(&scene), Display::of(&scene.render), effort, &(), stopwatch);
    assert_eq!(session.choices_of(Ladder::Shadows).map(|choice| choice.rung()).collect::<Vec<_>>(), ["on"]);
    assert_eq!(session.choices_of(Ladder::Precision).count(), 3);
}

/// Protects: what a price says of bits is compared: another accelerator gives the same picture, fewer segments do not.
#[test]
fn another_picture_is_told_from_the_same() {
    let scene = corridor();
    let settings = Settings { size: [4, 2], ..Settings::of(&scene) };
    let stopwatch: Stopwatch = |work| work() as f64;
    let studio = Studio { scene: &scene, settings: &settings, observer: &(), stopwatch };
    let display = Display::of(&scene.render);
    let (truth, ..) = studio.reference(&Setting::default(), display, Instant::now(), Start::default()).expect("a reference");
    let shots = Shots::new(&studio, &truth);
    let same = |rung: &str| {
        let setting = Setting::one(Choice::parse(rung).expect("a rung"));
        let paid = shots.paid(&setting, Instant::now() + Duration::from_secs(600)).expect("a small picture");
        paid.expect("time").same_bits
    };
    assert!(same("accelerator=linear") && !same("path-length=1"));
}
