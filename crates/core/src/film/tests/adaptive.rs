//! Adaptive sampling: placement, number and end of samples, independent of observers.

use core::sync::atomic::{AtomicU32, Ordering};

use super::{in_order, scene};
use crate::film::adaptive::ErrorProgress;
use crate::film::{EstimateDoubt, Film, ReplicateBuffer};
use crate::hash::splitmix64;
use crate::observer::Observer;
use crate::scene::{Integrator, Scene};
use crate::settings::{Aov, Sampling, Settings};
use crate::{ReadyScene, prepare};

/// A film of a row of tiles, each 16 × 16 pixels.
pub(super) fn row(tiles: u32, maximum: u32) -> Film {
    let size = [16 * tiles, 16];
    let settings = Settings {
        size,
        sampling: Sampling::General(maximum),
        max_error: Some(0.1),
        ..Settings::from_scene(&Scene::default())
    };
    prepare(&Scene::default(), &settings, &())
        .expect("an empty scene")
        .new_film("")
}

/// Takes the requested samples: the mean of replicate r of each pixel is given by its tile and
/// number of samples.
pub(super) fn add_samples(film: &mut Film, mean: impl Fn(u32, u32, f64) -> f64) {
    let plan = film.plan.clone();
    for replicate in 0..4 {
        let tile_of = |pixel: usize| plan.tile_of_pixel(pixel);
        let samples: Vec<u16> = (0..plan.pixel_count())
            .map(|p| film.sample_goal(tile_of(p), replicate) as u16)
            .collect();
        let value_of = |(pixel, &n): (usize, &u16)| {
            [mean(replicate, tile_of(pixel), f64::from(n)) * f64::from(n); 3]
        };
        let sums = samples.iter().enumerate().map(value_of).collect();
        film.buffers[replicate as usize] = Some(ReplicateBuffer {
            sums,
            samples,
            ..ReplicateBuffer::default()
        });
    }
    film.samples_drawn
        .copy_from_slice(&film.sample_goals.clone());
}

/// Means about 1 whose samples deviate by `sigma`: up in the first two replicates, down in the
/// other two, so that each half of the replicates knows it exactly.
fn known(sigma: impl Fn(u32) -> f64) -> impl Fn(u32, u32, f64) -> f64 {
    move |replicate, tile, n| 1.0 + if replicate < 2 { 1.0 } else { -1.0 } * sigma(tile) / n.sqrt()
}

fn total(film: &Film) -> u64 {
    film.progress(&film.full_part()).0
}

/// Protects: a nearly black picture ends after some hundred samples, since more do not tell its error. A
/// picture a hundred times as bright takes all samples that it may.
#[test]
fn a_nearly_black_picture_ends_early() {
    let samples = |radiance: f64| {
        let mut film = row(4, 4096);
        loop {
            add_samples(&mut film, |replicate, tile, n| {
                radiance * known(|_| 1.0)(replicate, tile, n)
            });
            if film.plan_next_round(1e-3, &()) != ErrorProgress::NeedsSamples {
                return total(&film) / film.plan.pixel_count() as u64;
            }
        }
    };
    assert!((256..512).contains(&samples(1e-3)), "{}", samples(1e-3));
    assert_eq!(samples(0.1), 4096);
}

/// Protects: tiles whose samples deviate four times as much get four times as many, up to the grid
/// of counts. A round adds at most a quarter. The requested error is reached by the upper end of
/// the interval, with at most a sixteenth and a grid step too many.
#[test]
fn samples_go_where_the_error_is() {
    let sigma = |tile: u32| if tile < 5 { 0.5 } else { 2.0 };
    let mut film = row(10, 65_536);
    let mut before = 0;
    let mut claimed = f64::INFINITY;
    loop {
        add_samples(&mut film, known(sigma));
        let now = total(&film);
        assert!(
            before == 0 || now as f64 <= 1.25 * before as f64,
            "{before} to {now}"
        );
        let high = film
            .estimate_uncertainty()
            .expect("four replicates")
            .root_relmse
            .high;
        match film.plan_next_round(0.05, &()) {
            ErrorProgress::NeedsSamples => assert!(high > 0.05 && now > before),
            ErrorProgress::Reached => {
                assert!(high <= 0.05 && claimed > 0.05);
                assert!(now as f64 <= 1.2 * before as f64 || before == 0);
                break;
            }
            ErrorProgress::Exhausted => panic!("at {high}"),
        }
        (before, claimed) = (now, high);
    }
    let (quiet, noisy) = (film.samples_drawn(2, 0), film.samples_drawn(7, 0));
    let ratio = f64::from(noisy) / f64::from(quiet);
    assert!((3.5..=4.6).contains(&ratio), "{quiet} and {noisy}");
    for tile in 0..10 {
        assert!(
            (0..4).all(|r| film.samples_drawn(tile, r) == film.samples_drawn(tile, 0)),
            "both halves know the same"
        );
    }
}

/// Protects: a tile that looks quiet gets at least a quarter of the samples of a tile with the mean
/// variance.
#[test]
fn nothing_is_left_behind() {
    let mut film = row(12, 65_536);
    for _ in 0..30 {
        add_samples(&mut film, known(|tile| if tile < 6 { 0.0 } else { 2.0 }));
        assert_eq!(film.plan_next_round(0.01, &()), ErrorProgress::NeedsSamples);
    }
    let (still, noisy) = (
        f64::from(film.sample_goal(0, 0)),
        f64::from(film.sample_goal(10, 0)),
    );
    // The mean variance is half the noisy tiles'.
    let expected = noisy / 4.0 / 2.0_f64.sqrt();
    assert!((still / expected - 1.0).abs() < 0.15, "{still} and {noisy}");
}

/// Protects: each half of the replicates decides for the other half, and not for itself.
#[test]
fn each_half_decides_for_the_other() {
    let mut film = row(12, 65_536);
    for _ in 0..12 {
        // The even replicates differ in the first tiles, the odd ones in the last.
        add_samples(&mut film, |replicate, tile, n| {
            let loud = if replicate % 2 == 0 {
                tile < 3
            } else {
                tile >= 9
            };
            1.0 + if replicate < 2 { 1.0 } else { -1.0 } * if loud { 2.0 } else { 0.2 } / n.sqrt()
        });
        assert_eq!(
            film.plan_next_round(0.005, &()),
            ErrorProgress::NeedsSamples
        );
    }
    for (replicate, more, fewer) in [(0, 11, 0), (2, 11, 0), (1, 0, 11), (3, 0, 11)] {
        assert!(
            film.sample_goal(more, replicate) > 3 * film.sample_goal(fewer, replicate),
            "replicate {replicate}"
        );
    }
}

/// Protects: no pixel exceeds the greatest number of samples, and reaching it is reported, also for
/// small numbers.
#[test]
fn samples_have_a_maximum() {
    for maximum in [4, 10, 100, 1000] {
        let mut film = row(3, maximum);
        let mut rounds = 0;
        loop {
            add_samples(&mut film, known(|_| 3.0));
            rounds += 1;
            match film.plan_next_round(1e-6, &()) {
                ErrorProgress::NeedsSamples => assert!(rounds < 60),
                end => break assert_eq!(end, ErrorProgress::Exhausted),
            }
        }
        let all: Vec<u32> = (0..4)
            .map(|replicate| film.samples_drawn(1, replicate))
            .collect();
        assert!(
            all.iter().sum::<u32>() <= maximum && all.iter().all(|&n| n >= maximum / 4),
            "{maximum}: {all:?}"
        );
    }
}

/// Protects: replicates have equal weight whatever their number of samples. Means of 1, 2, 3 and 6
/// with 4, 8, 4 and 8 samples have the mean 3; weighted by samples it would be 10/3. The variance
/// of the mean is (4 + 1 + 0 + 9)/12.
#[test]
fn replicates_count_the_same() {
    let mut film = row(1, 4096);
    for (replicate, (mean, n)) in [(1.0, 4), (2.0, 8), (3.0, 4), (6.0, 8)]
        .into_iter()
        .enumerate()
    {
        let pixels = film.plan.pixel_count();
        let sums = vec![[mean * f64::from(n); 3]; pixels];
        film.buffers[replicate] = Some(ReplicateBuffer {
            sums,
            samples: vec![n; pixels],
            ..ReplicateBuffer::default()
        });
    }
    assert!(
        film.picture()
            .rgb
            .iter()
            .all(|colour| colour.iter().all(|c| (c - 3.0).abs() < 1e-6))
    );
    let rmse = film
        .estimate_uncertainty()
        .expect("four replicates")
        .rmse
        .value;
    assert!((rmse - (14.0_f64 / 12.0).sqrt()).abs() < 1e-12, "{rmse}");
}

/// Protects: coverage weighs replicates equally, too: with 4, 8, 4 and 8 samples, of which those of
/// the first replicate are covered, it is a quarter.
#[test]
fn coverage_counts_replicates_the_same() {
    let background = crate::settings::Background::Transparent;
    let size = [16, 16];
    let settings = Settings {
        size,
        max_error: Some(0.1),
        background,
        ..Settings::from_scene(&Scene::default())
    };
    let settings = Settings {
        sampling: Sampling::General(4096),
        ..settings
    };
    let mut film = prepare(&Scene::default(), &settings, &())
        .expect("an empty scene")
        .new_film("");
    for (replicate, n) in [4_u16, 8, 4, 8].into_iter().enumerate() {
        let covered = vec![
            if replicate == 0 {
                4 * crate::film::sums::COVERAGE_UNITS
            } else {
                0
            };
            256
        ];
        let buffer = ReplicateBuffer {
            sums: vec![[0.0; 3]; 256],
            samples: vec![n; 256],
            covered,
            ..ReplicateBuffer::default()
        };
        film.buffers[replicate] = Some(buffer);
    }
    assert!(
        film.picture()
            .alpha
            .expect("it was asked for")
            .iter()
            .all(|&alpha| alpha == 0.25)
    );
}

/// Sets the counters as if all of a thousand paths that hit lights by chance alone, or none of them,
/// had hit one of great brightness.
fn set_chance_hits(film: &mut Film, found: bool) {
    let power = 1 << 50;
    (film.counters.narrow, film.counters.narrow_power) = (1000, power);
    film.counters.narrow_found = if found { power } else { 0 };
    film.counters.samples = 1000;
}

/// Protects: the expected number of samples follows the claimed error, even of a doubted claim: a
/// picture that needs a hundred times as many samples is not reported as nearly finished.
#[test]
fn the_end_is_told_by_the_claim() {
    for found in [true, false] {
        let mut film = row(3, 65_536);
        add_samples(&mut film, known(|_| 0.1));
        set_chance_hits(&mut film, found);
        let claim = film.estimate_uncertainty().expect("four replicates");
        assert!(found || claim.doubt.is_some());
        assert_eq!(
            film.plan_next_round(0.1 * claim.root_relmse.high, &()),
            ErrorProgress::NeedsSamples
        );
        let (done, all) = film.progress(&film.full_part());
        let reported = all as f64 / done as f64;
        assert!((reported - 100.0).abs() < 0.01, "{reported}");
    }
}

/// Protects: a doubted error does not count as reached, however small the claim. The first such
/// event is recorded with its reason, and none where the claim itself is too large.
#[test]
fn doubted_errors_are_not_reached() {
    let mut film = row(3, 65_536);
    add_samples(&mut film, known(|_| 0.01));
    set_chance_hits(&mut film, false);
    assert_eq!(
        (
            film.plan_next_round(1e-9, &()),
            film.first_doubtful_estimate()
        ),
        (ErrorProgress::NeedsSamples, None)
    );
    add_samples(&mut film, known(|_| 0.01));
    assert_eq!(film.plan_next_round(0.5, &()), ErrorProgress::NeedsSamples);
    let first = film.first_doubtful_estimate().expect("a claim below");
    let samples = film.sample_range(&film.full_part());
    assert_eq!(
        (first.samples, first.doubt),
        (
            [*samples.start(), *samples.end()],
            EstimateDoubt::LightByChance
        )
    );
    assert_eq!(
        first.error,
        film.estimate_uncertainty()
            .expect("four replicates")
            .root_relmse
            .value
    );
    add_samples(&mut film, known(|_| 0.01));
    assert_eq!(
        (
            film.plan_next_round(0.5, &()),
            film.first_doubtful_estimate()
        ),
        (ErrorProgress::NeedsSamples, Some(first))
    );
    set_chance_hits(&mut film, true);
    assert_eq!(film.plan_next_round(0.5, &()), ErrorProgress::Reached);
}

/// Protects: no tile more than doubles its samples in a round, however noisy it looks.
#[test]
fn tiles_grow_by_two_at_most() {
    let mut film = row(12, 65_536);
    for _ in 0..8 {
        add_samples(&mut film, known(|tile| if tile == 5 { 50.0 } else { 0.01 }));
        let before = film.samples_drawn(5, 0);
        assert_eq!(film.plan_next_round(1e-6, &()), ErrorProgress::NeedsSamples);
        assert!(
            film.sample_goal(5, 0) <= 2 * before,
            "{before} to {}",
            film.sample_goal(5, 0)
        );
    }
}

/// Protects: black tiles beside noisy ones keep getting samples. A single black tile gets samples
/// by the variance of its neighbours: √½ of theirs. A black tile among black ones gets a quarter of
/// the samples of a tile with the mean variance.
#[test]
fn m14_black_tiles_are_not_given_up() {
    // Black tiles of eight, and the share of the last tile's samples that the first black one
    // takes.
    for (black, share) in [(2..3, 0.5_f64.sqrt()), (0..4, 0.25 * 0.5_f64.sqrt())] {
        let mut film = row(8, 65_536);
        let loud = known(|_| 2.0);
        for _ in 0..30 {
            add_samples(&mut film, |replicate, tile, n| {
                if black.contains(&tile) {
                    0.0
                } else {
                    loud(replicate, tile, n)
                }
            });
            assert_eq!(film.plan_next_round(1e-3, &()), ErrorProgress::NeedsSamples);
        }
        let [still, other] = [black.start, 7].map(|tile| f64::from(film.sample_goal(tile, 0)));
        assert!(
            (still / (share * other) - 1.0).abs() < 0.15,
            "{black:?}: {still} and {other}"
        );
    }
}

/// Protects: pictures of rare bright samples are unbiased, to a fifth of their standard error and a
/// hundredth of the truth.
#[test]
fn m14_rare_light_is_not_lost() {
    const RUNS: u64 = 300;
    let (bright, chance) = (20.0, 0.02);
    let mut means = Vec::new();
    for run in 0..RUNS {
        let mut film = row(4, 4096);
        loop {
            let plan = film.plan.clone();
            for replicate in 0..4_u32 {
                let goal = |pixel: usize| film.sample_goal(plan.tile_of_pixel(pixel), replicate);
                let is_hit = |pixel: usize, index: u32| {
                    let address = run << 48
                        | u64::from(replicate) << 44
                        | (pixel as u64) << 20
                        | u64::from(index);
                    (splitmix64(splitmix64(address) ^ 77) >> 11) as f64 / (1_u64 << 53) as f64
                        > 1.0 - chance
                };
                let count = |pixel: usize| {
                    (0..goal(pixel))
                        .filter(|&index| is_hit(pixel, index))
                        .count()
                };
                let sums = (0..plan.pixel_count())
                    .map(|pixel| [bright * count(pixel) as f64; 3])
                    .collect();
                let samples = (0..plan.pixel_count())
                    .map(|pixel| goal(pixel) as u16)
                    .collect();
                film.buffers[replicate as usize] = Some(ReplicateBuffer {
                    sums,
                    samples,
                    ..ReplicateBuffer::default()
                });
            }
            film.samples_drawn
                .copy_from_slice(&film.sample_goals.clone());
            if film.plan_next_round(0.9, &()) != ErrorProgress::NeedsSamples {
                break;
            }
        }
        let rgb = film.picture().rgb;
        means.push(rgb.iter().map(|c| f64::from(c[0])).sum::<f64>() / rgb.len() as f64);
    }
    let mean = means.iter().sum::<f64>() / RUNS as f64;
    let spread = (means.iter().map(|m| (m - mean) * (m - mean)).sum::<f64>() / RUNS as f64).sqrt();
    let bias = (mean - bright * chance) / spread;
    let share = mean / (bright * chance) - 1.0;
    assert!(
        bias.abs() < 0.2 && share.abs() <= 0.01,
        "{bias} standard errors, {share} of the truth"
    );
}

fn settings() -> Settings {
    Settings {
        size: [40, 24],
        sampling: Sampling::General(400),
        max_error: Some(0.03),
        aovs: vec![Aov::Samples, Aov::StandardError],
        integrator: Integrator::Whitted,
        ..Settings::from_scene(&scene())
    }
}

fn of(settings: &Settings) -> ReadyScene {
    prepare(&scene(), settings, &()).unwrap_or_else(|e| panic!("{e}"))
}

fn rendered(ready: &ReadyScene) -> Film {
    let mut film = ready.new_film("scene");
    let part = film.full_part();
    ready
        .render_part(&mut film, &part, &())
        .unwrap_or_else(|e| panic!("{e}"));
    film
}

fn bits(film: &Film) -> Vec<u32> {
    let picture = film.picture();
    let layers = picture.layers.iter().flat_map(|layer| &layer.samples);
    picture
        .rgb
        .iter()
        .flatten()
        .chain(layers)
        .map(|x| x.to_bits())
        .collect()
}

/// Ends the render after this many tiles.
struct EnoughAfter(AtomicU32);

impl Observer for EnoughAfter {
    fn progress(&self, done: u64, total: u64) {
        assert!(done <= total);
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
    fn has_enough_samples(&self, _: bool) -> bool {
        self.0.load(Ordering::Relaxed) == 0
    }
}

/// Protects: adaptive sampling depends on the picture alone: not on threads, the tile size setting,
/// or stops in the middle of a round or between rounds.
#[test]
fn only_the_picture_decides() {
    let ready = of(&settings());
    let whole = rendered(&ready);
    let samples = whole.sample_range(&whole.full_part());
    assert!(
        samples.start() < samples.end() && *samples.start() >= 16,
        "{samples:?}"
    );
    assert!(
        whole
            .estimate_uncertainty()
            .expect("four replicates")
            .root_relmse
            .high
            <= 0.03
    );
    assert!(
        bits(&in_order(|| rendered(&ready))) == bits(&whole),
        "threads"
    );
    assert!(
        bits(&rendered(&of(&Settings {
            tile_size: 7,
            ..settings()
        }))) == bits(&whole),
        "tiles"
    );
    for step in [1, 5, 24] {
        let mut film = ready.new_film("scene");
        let mut pauses = 0;
        loop {
            in_order(|| {
                ready.render_part(
                    &mut film,
                    &whole.full_part(),
                    &EnoughAfter(AtomicU32::new(step)),
                )
            })
            .expect("its own film");
            if film.unfinished_tiles(&whole.full_part()) == 0 {
                break;
            }
            pauses += 1;
        }
        assert!(
            pauses > 2 && bits(&film) == bits(&whole),
            "stopped every {step} tiles"
        );
    }
}

/// Protects: replaying the sample counts of a stopped film gives its bits; a film of another
/// picture is refused.
#[test]
fn maps_are_replayed() {
    let ready = of(&settings());
    let mut film = ready.new_film("scene");
    let part = film.full_part();
    in_order(|| ready.render_part(&mut film, &part, &EnoughAfter(AtomicU32::new(70))))
        .expect("its own film");
    assert!(film.unfinished_tiles(&part) > 0);
    let mut again = ready.new_film("scene");
    again
        .repeat_sample_counts(&film)
        .expect("a map of the same picture");
    ready
        .render_part(&mut again, &part, &())
        .expect("its own film");
    assert!(bits(&again) == bits(&film));
    assert_eq!(again.unfinished_tiles(&part), 0);
    assert!(
        of(&Settings {
            seed: 9,
            ..settings()
        })
        .new_film("scene")
        .repeat_sample_counts(&film)
        .is_err()
    );
    assert!(
        ready
            .new_film("another scene")
            .repeat_sample_counts(&film)
            .is_err()
    );
}
