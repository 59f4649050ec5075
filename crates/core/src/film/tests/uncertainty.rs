//! Errors of whole pictures against closed forms, and against scenes whose true pixels are known.

use super::{layers, ready, rendered, settings};
use crate::film::{Counters, EstimateDoubt, Film, ReplicateBuffer};
use crate::hash::splitmix64;
use crate::scene::Scene;
use crate::settings::{Sampling, Settings};
use crate::{ReadyScene, prepare};

/// A film of pixels whose replicates have these means, each of two samples.
pub(super) fn film(pixels: &[[f64; 4]]) -> Film {
    let all = Settings {
        size: [pixels.len() as u32, 1],
        sampling: Sampling::General(8),
        replicates: Some(4),
        ..Settings::from_scene(&Scene::default())
    };
    let ready = prepare(&Scene::default(), &all, &()).expect("an empty scene");
    let mut film = ready.new_film("");
    for replicate in 0..4 {
        let sums = pixels
            .iter()
            .map(|means| [2.0 * means[replicate]; 3])
            .collect();
        film.buffers[replicate] = Some(ReplicateBuffer {
            sums,
            samples: vec![2; pixels.len()],
            ..ReplicateBuffer::default()
        });
    }
    film
}

/// Protects: a picture to be denoised has the samples of the same picture without denoising, and its
/// errors are estimated from as many independent nets: two below 64 samples.
#[test]
fn denoising_changes_no_sample() {
    for samples in [8, 16, 64] {
        let [plain, kept] = [false, true].map(|denoise| {
            let settings = Settings {
                denoise,
                replicates: None,
                ..settings(samples)
            };
            rendered(&ready(&settings))
        });
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-6 * a.abs().max(1e-3);
        let all = |a: &[[f32; 3]], b: &[[f32; 3]]| {
            let [a, b] = [a, b].map(|of| of.as_flattened().iter().map(|&c| f64::from(c)));
            assert!(a.zip(b).all(|(a, b)| close(a, b)), "{samples}");
        };
        all(&plain.picture().rgb, &kept.picture().rgb);
        let [(of_plain, freedom), (of_kept, same)] =
            [&plain, &kept].map(|film| film.standard_errors().expect("two nets"));
        all(&of_plain, &of_kept);
        assert_eq!(freedom, same);
        let [a, b] = [&plain, &kept].map(|film| film.estimate_uncertainty().expect("two nets"));
        assert_eq!((a.replicates, a.doubt), (b.replicates, b.doubt));
        assert!(close(a.root_relmse.high, b.root_relmse.high), "{samples}");
        // All four replicates tell more than the two nets that they belong to.
        let (all_four, _) = kept.estimate_by_replicates().expect("four replicates");
        assert_eq!(all_four.replicates, b.replicates);
        assert_ne!(all_four.doubt, Some(EstimateDoubt::FewSamples));
        for pixel in [0, 5] {
            let [a, b] =
                [&plain, &kept].map(|film| film.pixel_variance(pixel, 3).expect("samples"));
            assert!((0..3).all(|i| close(a[i], b[i])), "{samples}: {a:?} {b:?}");
        }
    }
}

/// Protects: for replicates with the means 1, 2, 3, 4 the mean has a variance of 5/12, whose root
/// is the error. Differences of pairs are (−1, −1), (−2, −2) and (−3, 1) in each of three fully
/// correlated channels, so that their squared products are 9 times 1, 16 and 9: a mean of 78 over
/// 24 = 2R(R − 1), relative to (3 · 5/12)² in each of fifty pixels of a hundred. Fifty equal
/// products have a hundred degrees of freedom, with a factor of 1.98397 in tables.
#[test]
fn errors_of_pictures_by_hand() {
    let mut pixels = [[2.5; 4]; 100];
    pixels[20..70].fill([1.0, 2.0, 3.0, 4.0]);
    let uncertainty = film(&pixels)
        .estimate_uncertainty()
        .expect("four replicates");
    assert!((uncertainty.rmse.value - (5.0_f64 / 24.0).sqrt()).abs() < 1e-12);
    assert!((uncertainty.rmse.carriers - 50.0).abs() < 1e-9);
    let half = 1.983_971_5 * (78.0 / 24.0 / (1.25_f64 * 1.25) / 50.0).sqrt() / 2.0;
    assert!((uncertainty.rmse.high / uncertainty.rmse.value - half.exp()).abs() < 1e-6);
    assert!((uncertainty.rmse.low / uncertainty.rmse.value - (-half).exp()).abs() < 1e-6);
    assert_eq!((uncertainty.doubt, uncertainty.replicates), (None, 4));
}

/// Protects: where pixels differ by noise alone, an error is relative to 0.01 plus the square of the
/// neighbours' mean: for the means 1, 1, 1 and 2, of variance 3/48, to 1.25². The interval has two
/// parts: three hundred equal variances, since products of two independent differences are 0; and
/// twice the standard error of each weight, by the variance of the mean of four neighbours, at the
/// ends of two and three.
#[test]
fn relative_errors_by_hand() {
    let estimate = film(&[[1.0, 1.0, 1.0, 2.0]; 100])
        .estimate_uncertainty()
        .expect("four replicates")
        .root_relmse;
    let (variance, square): (f64, f64) = (3.0 / 48.0, 1.25 * 1.25 + 0.01);
    assert!((estimate.value - (variance / square).sqrt()).abs() < 1e-12);
    let of_weight = |neighbours: f64| 16.0 * 1.25 * 1.25 * variance / neighbours / square / square;
    let weights = (96.0 * of_weight(4.0) + 2.0 * of_weight(3.0) + 2.0 * of_weight(2.0)) / 1e4;
    let width = 1.959_963_984_540_054 * (8.0 / 9.0 / 100.0 + weights).sqrt();
    assert!(((estimate.high / estimate.low).ln() - width).abs() < 1e-6);
}

/// Protects: where pixels truly differ, an error is relative to the pixel's own colour: for pixels of
/// 1 and 3 in turn whose noise is far less, to 1.01 and 9.01.
#[test]
fn contrast_is_no_noise() {
    let pixels: Vec<[f64; 4]> = (0..1000)
        .map(|pixel| {
            [0.02, 0.06, -0.02, -0.06].map(|off| if pixel % 2 == 0 { 1.0 } else { 3.0 } + off)
        })
        .collect();
    let estimate = film(&pixels)
        .estimate_uncertainty()
        .expect("four replicates")
        .root_relmse;
    let variance = 2.0 * (0.02_f64.powi(2) + 0.06_f64.powi(2)) / 12.0;
    let expected = (variance * (1.0 / 1.01 + 1.0 / 9.01) / 2.0).sqrt();
    assert!(
        (estimate.value / expected - 1.0).abs() < 0.01,
        "{estimate:?} {expected}"
    );
    assert!(estimate.high < 1.1 * estimate.value, "{estimate:?}");
}

/// Protects: a bright sample that few pixels found is part of both the error and its estimate, and
/// so does not widen the interval; differences in both pairs of replicates do. No interval is
/// narrower than that of as many normal numbers.
#[test]
fn rare_bright_samples_are_in_both() {
    let width = |pixels: &[[f64; 4]]| {
        let estimate = film(pixels)
            .estimate_uncertainty()
            .expect("four replicates")
            .rmse;
        (estimate.high / estimate.low).ln()
    };
    let minimum = 1.959_963_984_540_054 * (8.0_f64 / 9.0 / 100.0).sqrt();
    assert!((width(&[[0.0, 0.0, 0.0, 5.0]; 100]) - minimum).abs() < 1e-6);
    assert!(width(&[[0.0, 5.0, 0.0, 5.0]; 100]) > 1.15 * minimum);
}

/// Protects: intervals of pictures with known noise contain the error in 93 to 97 of 100, for even
/// noise, for noise nearly all in a tenth of the pixels, for independent channels, and for noise as
/// skewed as that of 36 exponential numbers. Of 4000 films the share is known to 0.4 of 100.
#[test]
fn intervals_hold_known_errors() {
    /// Noise of one channel of a pixel, by its own address.
    type Noise<'a> = &'a dyn Fn(usize, u64, u64) -> f64;
    const FILMS: u64 = 4000;
    const PIXELS: usize = 300;
    let uniform = |address: u64| ((splitmix64(address) >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
    let exponential = move |address: u64| -uniform(address).ln();
    let normal = move |address: u64| {
        (2.0 * exponential(2 * address)).sqrt()
            * (core::f64::consts::TAU * uniform(2 * address + 1)).cos()
    };
    let truth = |pixel: usize| 0.2 + 0.1 * (pixel % 9) as f64;
    let noises: [(&str, Noise<'_>); 4] = [
        ("even", &|_, address, _| 0.15 * normal(address)),
        ("in few pixels", &|pixel, address, _| if pixel.is_multiple_of(10) { 0.2 } else { 0.01 } * normal(address)),
        ("by channel", &|_, address, channel| 0.15 * normal(3 * address + channel)),
        ("skewed", &|_, address, _| (0..36).map(|k| exponential(36 * address + k)).sum::<f64>() / 36.0 - 1.0),
    ];
    for (name, noise) in noises {
        let mut held = 0;
        let mut film = film(&[[0.0; 4]; PIXELS]);
        for run in 0..FILMS {
            for replicate in 0..4_usize {
                let sum = |pixel: usize| {
                    let address = (run * PIXELS as u64 + pixel as u64) * 4 + replicate as u64;
                    [0, 1, 2]
                        .map(|channel| 2.0 * truth(pixel) * (1.0 + noise(pixel, address, channel)))
                };
                let sums = (0..PIXELS).map(sum).collect();
                film.buffers[replicate] = Some(ReplicateBuffer {
                    sums,
                    samples: vec![2; PIXELS],
                    ..ReplicateBuffer::default()
                });
            }
            let square = |(pixel, colour): (usize, &[f32; 3])| {
                let value_of = |&c: &f32| {
                    (f64::from(c) - truth(pixel)).powi(2) / (truth(pixel).powi(2) + 0.01)
                };
                colour.iter().map(value_of).sum::<f64>()
            };
            let error = (film
                .picture()
                .rgb
                .iter()
                .enumerate()
                .map(square)
                .sum::<f64>()
                / (3 * PIXELS) as f64)
                .sqrt();
            let estimate = film
                .estimate_uncertainty()
                .expect("four replicates")
                .root_relmse;
            held += u64::from((estimate.low..=estimate.high).contains(&error));
        }
        let share = held as f64 / FILMS as f64;
        assert!((0.93..=0.97).contains(&share), "{name}: {share}");
    }
}

/// Protects: with two replicates, a pixel is compared with the next one, and the last of a row with
/// the previous one; no reliable interval is claimed.
#[test]
fn two_replicates_are_held_against_neighbours() {
    let value_of = |pixels: &[[f64; 2]], width: u32| {
        let size = [width, pixels.len() as u32 / width];
        let all = Settings {
            size,
            sampling: Sampling::General(8),
            replicates: Some(2),
            ..Settings::from_scene(&Scene::default())
        };
        let mut film = prepare(&Scene::default(), &all, &())
            .expect("an empty scene")
            .new_film("");
        for replicate in 0..2 {
            let sums = pixels
                .iter()
                .map(|means| [4.0 * means[replicate]; 3])
                .collect();
            film.buffers[replicate] = Some(ReplicateBuffer {
                sums,
                samples: vec![4; pixels.len()],
                ..ReplicateBuffer::default()
            });
        }
        let uncertainty = film.estimate_uncertainty().expect("two replicates");
        assert_eq!(
            (uncertainty.doubt, uncertainty.replicates),
            (Some(EstimateDoubt::FewSamples), 2)
        );
        uncertainty.rmse
    };
    // Variances of 3/4 in the upper row, and products of 9 there alone, over 4 = 2R(R − 1); two
    // products have four degrees of freedom.
    let estimate = value_of(&[[0.0, 1.0], [0.0, 1.0], [0.0, 0.0], [0.0, 0.0]], 2);
    assert!((estimate.value - (1.5_f64 / 12.0).sqrt()).abs() < 1e-12);
    let expected = 2.776_445 * (18.0_f64 / 4.0 / (1.5 * 1.5)).sqrt();
    assert!(((estimate.high / estimate.low).ln() - expected).abs() < 1e-5);
}

/// Protects: with three replicates the difference of the first two is used: its square over six is
/// the variance of the mean of three, since ½ of a squared difference is that of a replicate. In
/// three channels of difference 1 it is a half, over three channels again a sixth.
#[test]
fn three_replicates_are_surer_than_two() {
    let all = Settings {
        size: [10, 1],
        sampling: Sampling::General(6),
        replicates: Some(3),
        ..Settings::from_scene(&Scene::default())
    };
    let mut film = prepare(&Scene::default(), &all, &())
        .expect("an empty scene")
        .new_film("");
    for (replicate, mean) in [0.0, 1.0, 0.5].into_iter().enumerate() {
        film.buffers[replicate] = Some(ReplicateBuffer {
            sums: vec![[2.0 * mean; 3]; 10],
            samples: vec![2; 10],
            ..ReplicateBuffer::default()
        });
    }
    let uncertainty = film.estimate_uncertainty().expect("three replicates");
    assert_eq!(
        (uncertainty.doubt, uncertainty.replicates),
        (Some(EstimateDoubt::FewSamples), 3)
    );
    assert!(
        (uncertainty.rmse.value - (1.0_f64 / 6.0).sqrt()).abs() < 1e-12,
        "{uncertainty:?}"
    );
}

/// Protects: where replicates have equal weight, so have their deviations. Means of 0, 0 and 3 with
/// 1, 1 and 4 samples deviate from 1, with a variance of (1 + 1 + 4)/2, of which the mean of three
/// has a third; weighted by samples they deviate from 2, 4·(1 + 1 + 1)/(6·2) = 1.
#[test]
fn deviations_count_as_their_means_do() {
    let plane = |mean: f64, n: u16| ReplicateBuffer {
        sums: vec![[mean * f64::from(n); 3]],
        samples: vec![n],
        ..ReplicateBuffer::default()
    };
    let buffers = [plane(0.0, 1), plane(0.0, 1), plane(3.0, 4)];
    for (even, mean) in [(true, 1.0), (false, 2.0)] {
        let replicate_stats = crate::film::estimate::ReplicateStats::new(
            buffers.iter().map(|buffer| vec![buffer]),
            even,
        );
        assert_eq!(
            (
                replicate_stats.mean(0).0,
                replicate_stats.replicate_deviations(0).variance()
            ),
            ([mean; 3], [1.0; 3]),
            "{even}"
        );
    }
}

/// Protects: an error carried by a single pixel of many is doubted; without variance the error is
/// zero and certain.
#[test]
fn few_pixels_say_little() {
    let mut pixels = [[1.0, 1.01, 0.99, 1.0]; 100];
    pixels[40] = [1.0, 1.0, 1.0, 90.0];
    let uncertainty = film(&pixels)
        .estimate_uncertainty()
        .expect("four replicates");
    assert!(
        uncertainty.doubt == Some(EstimateDoubt::FewPixels) && uncertainty.rmse.carriers < 2.0,
        "{uncertainty:?}"
    );
    let still = film(&[[0.5; 4]; 10])
        .estimate_uncertainty()
        .expect("four replicates");
    assert_eq!(
        (still.rmse.value, still.rmse.high, still.doubt),
        (0.0, 0.0, None)
    );
}

/// Protects: bright samples of one replicate among black pixels are doubted where they are few: small
/// lamps can't be told from rare light. Of a hundred, none is seen again, and the error is relative
/// to black: 100 · 25/16 in a tenth of the pixels, to a percent. Where the neighbours have as much,
/// the error is relative to it.
#[test]
fn light_that_others_miss_is_doubted() {
    let value_of = |means: &[[f64; 4]], pixels: usize| {
        let all: Vec<[f64; 4]> = (0..pixels)
            .map(|pixel| means[pixel % means.len()])
            .collect();
        let uncertainty = film(&all).estimate_uncertainty().expect("four replicates");
        (uncertainty.root_relmse.value, uncertainty.doubt)
    };
    let mut rare = [[0.0; 4]; 10];
    rare[3] = [0.0, 0.0, 0.0, 5.0];
    assert_eq!(value_of(&rare, 200).1, Some(EstimateDoubt::FewPixels));
    let (value, doubt) = value_of(&rare, 1000);
    assert!(
        (value / 15.625_f64.sqrt() - 1.0).abs() < 0.01 && doubt.is_none(),
        "{value}"
    );
    let (value, doubt) = value_of(&rare[3..4], 100);
    assert!((value - 1.0).abs() < 0.01 && doubt.is_none(), "{value}");
}

/// Protects: where paths can hit a light by chance alone, and hits that may be missing exceed the
/// upper end, the picture is doubted. Three hits of a radiance of c, of 800 samples in 100 pixels of
/// 2.5, have an error of c√(3 · 100/800²/(2.5² + 0.01)), 0.0087 c. The picture is not doubted where
/// that is less, where every path hit the light, or without such paths.
#[test]
fn light_by_chance_is_doubted() {
    let value_of = |narrow: u64, hit: f64, found: u64| {
        let mut film = film(&[[1.0, 2.0, 3.0, 4.0]; 100]);
        let power = (hit * hit * crate::counters::POWER_UNITS) as u64;
        film.counters = Counters {
            narrow,
            narrow_power: narrow * power,
            narrow_found: found * power,
            samples: 800,
            ..film.counters
        };
        let estimate = film.estimate_uncertainty().expect("four replicates");
        (estimate.doubt, estimate.root_relmse.high)
    };
    let (none, high) = value_of(0, 1e6, 0);
    let least = high / (3.0 * 100.0 / 640_000.0 / 6.26_f64).sqrt();
    assert_eq!(none, None);
    for (hit, found, doubt) in [
        (0.99 * least, 0, None),
        (1.01 * least, 0, Some(EstimateDoubt::LightByChance)),
        (10.0 * least, 25, Some(EstimateDoubt::LightByChance)),
        (10.0 * least, 50, None),
    ] {
        assert_eq!(value_of(50, hit, found).0, doubt, "{hit} {found}");
    }
}

/// Protects: too few replicates for an interval hide no other doubt. In a room with a mirror ball and
/// a lamp of 3 cm, pictures of 16 samples claimed .13 where half of the renders had 2.4.
#[test]
fn few_samples_hide_no_other_doubt() {
    let doubt_of = |hit: f64| {
        let mut film = film(&[[1.0, 2.0, 3.0, 4.0]; 100]);
        film.buffers[2..].fill(None);
        film.counters = Counters {
            narrow: 50,
            narrow_power: 50 * (hit * hit * crate::counters::POWER_UNITS) as u64,
            samples: 400,
            ..film.counters
        };
        film.estimate_uncertainty().expect("two replicates").doubt
    };
    assert_eq!(
        [0.0, 1e6].map(doubt_of),
        [EstimateDoubt::FewSamples, EstimateDoubt::LightByChance].map(Some)
    );
}

/// Protects: a small sun that scattered paths see in chrome is light by chance, as a lamp in a
/// mirror is, and a picture that never found it is doubted. A wide sun is not, nor a sun in metal
/// so rough that light sampling works.
#[test]
fn a_small_sun_in_chrome_is_met_by_chance() {
    let value_of = |exponent: f64, roughness: f64| {
        let text = format!(
            r#"{{ "format": 1,
            "cameras": [{{ "pose": {{ "look_at": {{ "eye": [0, 1, 4], "target": [0, 0.4, 0] }} }}, "projection": {{ "pinhole": {{ "vertical_fov": 40 }} }} }}],
            "sky": {{ "gradient": {{ "bottom": 0.3, "top": 0.6,
                                   "suns": [{{ "direction": [1, 1.2, 0.4], "colour": 800, "weight": 1, "exponent": {exponent} }}] }} }},
            "materials": [{{ "name": "floor", "model": {{ "physical": {{ "base_colour": 0.8 }} }} }},
                          {{ "name": "metal", "model": {{ "physical": {{ "base_colour": 0.9, "metallic": 1, "roughness": {roughness} }} }} }}],
            "objects": [{{ "shape": {{ "plane": {{ "point": [0, 0, 0], "normal": [0, 1, 0] }} }}, "material": "floor" }},
                        {{ "shape": {{ "sphere": {{ "centre": [0, 0.5, 0], "radius": 0.5 }} }}, "material": "metal" }}] }}"#
        );
        let scene: Scene = serde_json::from_str(&text).expect("a scene");
        let settings = Settings {
            size: [12, 8],
            sampling: Sampling::General(64),
            ..Settings::from_scene(&scene)
        };
        let ready = prepare(&scene, &settings, &()).expect("a scene");
        let estimate = rendered(&ready).estimate_uncertainty();
        estimate.expect("four replicates").doubt == Some(EstimateDoubt::LightByChance)
    };
    assert_eq!(
        [
            value_of(4000.0, 0.02),
            value_of(4000.0, 0.04),
            value_of(20.0, 0.02),
            value_of(4000.0, 0.4)
        ],
        [true, true, false, false]
    );
}

/// Protects: the uncertainty is `None` where it is unknown: with one replicate, for a pixel without
/// samples, for a pattern.
#[test]
fn unknown_uncertainty_is_none() {
    let value_of = |settings: Settings| rendered(&ready(&settings)).estimate_uncertainty();
    assert!(
        value_of(Settings {
            replicates: Some(1),
            ..settings(6)
        })
        .is_none()
    );
    assert!(value_of(settings(6)).is_some());
    assert!(
        value_of(Settings {
            sampling: Sampling::Pattern(crate::scene::SamplePattern::Corners),
            aovs: layers(),
            ..settings(4)
        })
        .is_none()
    );
    let ready: ReadyScene = ready(&settings(6));
    let mut film = ready.new_film("scene");
    let first = crate::film::FilmPart {
        tiles: 0..1,
        ..film.full_part()
    };
    ready
        .render_part(&mut film, &first, &())
        .expect("its own film");
    assert!(film.estimate_uncertainty().is_none());
}

/// Protects: small pictures, and small objects before an empty background, are not doubted for
/// their size: for even noise in one pixel or ten among a thousand without any, the interval is
/// right. Doubted are pictures where few of many noisy pixels have most of the noise, and where ten
/// apart from each other were each lit in one replicate.
#[test]
fn pixels_without_noise_do_not_count() {
    let noisy = [1.0, 1.1, 0.9, 1.05];
    let doubt = |pixels: &[[f64; 4]]| {
        film(pixels)
            .estimate_uncertainty()
            .expect("four replicates")
            .doubt
    };
    let mut small = [[0.5; 4]; 1000];
    small[300..310].fill(noisy);
    assert_eq!(
        [doubt(&[noisy]), doubt(&[noisy; 16]), doubt(&small)],
        [None; 3]
    );
    let mut quiet = [[1.0, 1.01, 0.99, 1.0]; 1000];
    quiet[300..310].fill([1.0, 1.9, 0.6, 1.4]);
    assert_eq!(doubt(&quiet), Some(EstimateDoubt::FewPixels));
    small[300..310].fill([0.5; 4]);
    small[300..370]
        .iter_mut()
        .step_by(7)
        .for_each(|pixel| pixel[3] = 9.0);
    assert_eq!(doubt(&small), Some(EstimateDoubt::FewPixels));
}

/// Protects: where few pixels carry the error, a requested error of ten times the upper end is
/// reached, and no smaller one; where too few lamps were hit, none is.
#[test]
fn doubts_of_few_pixels_fall_silent_far_below() {
    let mut pixels = [[1.0, 1.01, 0.99, 1.0]; 100];
    pixels[40] = [1.0, 1.0, 1.0, 9.0];
    let uncertainty = film(&pixels)
        .estimate_uncertainty()
        .expect("four replicates");
    let high = uncertainty.root_relmse.high;
    assert_eq!(uncertainty.doubt, Some(EstimateDoubt::FewPixels));
    assert_eq!(
        [9.99, 10.01].map(|times| uncertainty.is_error_below(times * high)),
        [false, true]
    );
    let by_chance = crate::film::Uncertainty {
        doubt: Some(EstimateDoubt::LightByChance),
        ..uncertainty
    };
    assert!(!by_chance.is_error_below(100.0 * high));
}

/// Protects: a black picture is not accepted where rays searched for lamps: it is doubted, reaches
/// no error, and its pixels' errors are unknown. Without such rays a black picture is valid.
#[test]
fn a_black_picture_is_doubted_where_there_are_lamps() {
    let value_of = |shadow| {
        let mut film = film(&[[0.0; 4]; 10]);
        film.counters.shadow = shadow;
        let uncertainty = film.estimate_uncertainty().expect("four replicates");
        (
            uncertainty.doubt,
            uncertainty.is_error_below(1.0),
            film.standard_errors().expect("four replicates").0[0],
        )
    };
    assert_eq!(value_of(0), (None, true, [0.0; 3]));
    assert_eq!(
        value_of(100),
        (Some(EstimateDoubt::FewPixels), false, [-1.0; 3])
    );
}

/// Protects: a picture darker than what the constant in relative errors hides claims no error and
/// reaches none, with any number of replicates, although its noise is small beside that constant.
/// A picture ten times as bright does.
#[test]
fn a_nearly_black_picture_claims_no_error() {
    let value_of = |scale: f64| {
        let uncertainty = film(&[[1.0, 1.1, 0.9, 1.05].map(|mean| scale * mean); 100])
            .estimate_uncertainty()
            .expect("four replicates");
        (uncertainty.doubt, uncertainty.is_error_below(1.0))
    };
    for scale in [1e-9, 1e-4, 0.009] {
        assert_eq!(
            value_of(scale),
            (Some(EstimateDoubt::NearlyBlack), false),
            "{scale}"
        );
    }
    assert_eq!(value_of(0.01), (None, true));
}
