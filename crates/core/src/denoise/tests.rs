//! Denoised pictures with a known truth.

use super::*;
use crate::film::tests::{ReplicateSample, film_of};
use crate::hash::splitmix64;
use crate::prepare;
use crate::scene::Scene;
use crate::settings::{Sampling, Settings};

/// Nearly normal noise of mean 0 and variance 1: a sum of twelve uniform numbers, by seed, pixel,
/// replicate and channel.
fn noise(seed: u64, pixel: usize, replicate: usize, channel: usize) -> f64 {
    let mut state = splitmix64(
        seed ^ ((pixel as u64) << 20) ^ ((replicate as u64) << 8) ^ ((channel as u64) << 4),
    );
    let next = |_| {
        state = splitmix64(state);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(next).sum::<f64>() - 6.0
}

fn grey(radiance: f64) -> ReplicateSample {
    ReplicateSample {
        radiance: [radiance; 3],
        emission: [0.0; 3],
        albedo: [0.5; 3],
    }
}

fn denoised(film: &Film) -> DenoiseOutput {
    denoise(film, &()).unwrap_or_else(|e| panic!("{e}"))
}

/// Mean squared error of a picture.
fn error(picture: &Picture, truth: impl Fn(usize) -> f64) -> f64 {
    let square = |(pixel, rgb): (usize, &[f32; 3])| {
        rgb.iter()
            .map(|&c| (f64::from(c) - truth(pixel)).powi(2))
            .sum::<f64>()
    };
    picture.rgb.iter().enumerate().map(square).sum::<f64>() / (3 * picture.rgb.len()) as f64
}

/// Protects: a flat picture loses nearly all of its uniform noise, the error estimates of picture
/// and pixels hold, and light is neither gained nor lost.
#[test]
fn flat_pictures_lose_their_noise() {
    let film = film_of([96, 64], |pixel, replicate| {
        let mut replicate_sample = grey(0.0);
        replicate_sample.radiance =
            core::array::from_fn(|i| 0.5 + 0.1 * noise(1, pixel, replicate, i));
        replicate_sample
    });
    let found_denoised = denoised(&film);
    let [before, after] =
        [&film.picture(), &found_denoised.picture].map(|picture| error(picture, |_| 0.5));
    assert!(before / after > 20.0, "{before} became {after}");
    let estimate = found_denoised.error.rmse;
    assert!(
        estimate.low <= after.sqrt() && after.sqrt() <= estimate.high,
        "{} and {estimate:?}",
        after.sqrt()
    );
    let reported = found_denoised
        .standard_error
        .iter()
        .flatten()
        .map(|&e| f64::from(e * e))
        .sum::<f64>()
        / (3 * film.plan().pixel_count()) as f64;
    // The estimate of a pixel has a standard deviation of twice the noise's variance over 21, the
    // edge of its neighbourhood. As it is not below zero, 0.4 of that is added on average.
    let added = 0.4 * 2.0 * before / 21.0;
    assert!(
        (0.5 * after..after + 1.2 * added).contains(&reported),
        "{reported} for {after} and {added}"
    );
    assert!(
        found_denoised.light_change.abs() < 0.002,
        "{}",
        found_denoised.light_change
    );
}

/// Protects: a sketch loses most of strong noise and its single bright samples, keeps texture and the
/// edge of a shadow, and gains and loses little light; a film without the layers has none.
#[test]
fn sketches_lose_noise_and_keep_edges() {
    let truth = |pixel: usize| {
        let (x, y) = (pixel % 96, pixel / 96);
        let albedo = if (x / 4 + y / 4) % 2 == 0 { 0.8 } else { 0.2 };
        (albedo, if x < 48 { 1.0 } else { 0.2 })
    };
    let film = film_of([96, 64], |pixel, replicate| {
        let (albedo, light) = truth(pixel);
        let firefly = if pixel % 501 == 7 { 30.0 } else { 0.0 };
        let factor = 1.0 + noise(5, pixel, replicate, 0) + firefly;
        ReplicateSample {
            radiance: [albedo * light * factor; 3],
            emission: [0.0; 3],
            albedo: [albedo; 3],
        }
    });
    let sketched = sketch(&film).expect("all layers");
    let radiance = |pixel| truth(pixel).0 * truth(pixel).1;
    let [before, after] = [&film.picture(), &sketched].map(|picture| error(picture, radiance));
    assert!(before / after > 40.0, "{before} became {after}");
    let column = |x: usize| {
        let rows = (0..64).map(|y| {
            let pixel = y * 96 + x;
            f64::from(sketched.rgb[pixel][0]) / truth(pixel).0
        });
        rows.sum::<f64>() / 64.0
    };
    assert!(
        column(43) > 0.8 && column(52) < 0.4,
        "{} {}",
        column(43),
        column(52)
    );
    let total = |picture: &Picture| picture.rgb.iter().map(|rgb| f64::from(rgb[0])).sum::<f64>();
    let expected: f64 = (0..96 * 64).map(radiance).sum();
    assert!(
        (total(&sketched) / expected - 1.0).abs() < 0.1,
        "{}",
        total(&sketched) / expected
    );
    let of_truth = |pixel: usize| f64::from(sketched.rgb[pixel][0]) / radiance(pixel);
    let brightest = (0..96 * 64).map(of_truth).fold(0.0, f64::max);
    assert!(brightest < 3.0, "{brightest}");
    let settings = Settings {
        size: [8, 8],
        ..Settings::from_scene(&Scene::default())
    };
    let ready = prepare(&Scene::default(), &settings, &()).expect("an empty scene");
    assert!(sketch(&ready.new_film("")).is_none());
}

/// Protects: directly visible lamps and skies lose their noise too, and texture as strong as the
/// noise stays, because light over albedo is flat.
#[test]
fn lamps_lose_their_noise_and_texture_stays() {
    let film = film_of([64, 48], |pixel, replicate| {
        let radiance = [2.0 + 0.3 * noise(11, pixel, replicate, 0); 3];
        ReplicateSample {
            radiance,
            emission: radiance,
            albedo: [0.0; 3],
        }
    });
    let [before, after] =
        [film.picture(), denoised(&film).picture].map(|picture| error(&picture, |_| 2.0));
    assert!(before / after > 10.0, "{before} became {after}");
    let albedo = |pixel: usize| {
        if (pixel % 64).is_multiple_of(2) {
            0.4
        } else {
            0.5
        }
    };
    let film = film_of([64, 48], |pixel, replicate| {
        let light = 1.0 + 0.2 * noise(12, pixel, replicate, 0);
        ReplicateSample {
            radiance: [(albedo(pixel) + 0.1) * light; 3],
            emission: [0.0; 3],
            albedo: [albedo(pixel); 3],
        }
    });
    let [before, after] = [film.picture(), denoised(&film).picture]
        .map(|picture| error(&picture, |pixel| albedo(pixel) + 0.1));
    assert!(before / after > 15.0, "{before} became {after}");
}

/// Protects: light is divided by the albedo before filtering. Every pixel has its own albedo,
/// within the tolerance of one surface, under a light with noise of a third of the albedo's
/// variation: without the division, texture would be confused with noise. Nearly all noise goes.
#[test]
fn texture_within_a_surface_is_no_noise() {
    let albedo = |pixel: usize| 0.5 + 0.02 * noise(14, pixel, 0, 0).clamp(-2.0, 2.0);
    let film = film_of([64, 48], |pixel, replicate| {
        let light = 1.0 + 0.02 * noise(13, pixel, replicate, 0);
        ReplicateSample {
            radiance: [(albedo(pixel) + 0.1) * light; 3],
            emission: [0.0; 3],
            albedo: [albedo(pixel); 3],
        }
    });
    let [before, after] = [film.picture(), denoised(&film).picture]
        .map(|picture| error(&picture, |pixel| albedo(pixel) + 0.1));
    assert!(before / after > 15.0, "{before} became {after}");
}

/// Protects: a replicate's firefly is limited by the other replicate of its half, so that two
/// fireflies in one pixel, one in each half, are both dimmed: by nearly all of (100 + 100)/4
/// together.
#[test]
fn fireflies_do_not_confirm_themselves() {
    let position = 16 * 40 + 20;
    let film = film_of([40, 32], |pixel, replicate| {
        let is_firefly = pixel == position && replicate.is_multiple_of(2);
        grey(if is_firefly {
            100.0
        } else {
            0.5 + 0.05 * noise(15, pixel, replicate, 0)
        })
    });
    let four = film.merge_into_four_replicates().expect("all that is read");
    let mut pixels = vec![PixelCandidates::default(); 40 * 32];
    candidates::compute_candidates_of_rows(&four, [40, 32], 0, &mut pixels, &());
    let taken = pixels[position].changes[2][1];
    assert!((-50.0..-49.0).contains(&taken), "{taken}");
    assert!(
        pixels[position + 5].changes[2][1].abs() < 0.02,
        "{:?}",
        pixels[position + 5].changes[2]
    );
}

/// Protects: the leave-one-out colour hardly depends on the pixel's own noise: by the weights alone. A
/// changed sample of one replicate changes the neighbours' colours, and the pixel's by less than a
/// tenth of that. (With the pixel itself it would be as much.)
#[test]
fn a_pixel_has_no_part_in_its_own_base() {
    let position = 16 * 40 + 20;
    let value_of = |own: f64| {
        let film = film_of([40, 32], |pixel, replicate| match replicate {
            2 if pixel == position => grey(own),
            2 | 3 => grey(0.5 + 0.02 * noise(16, pixel, replicate, 0)),
            _ => grey(0.5),
        });
        let four = film.merge_into_four_replicates().expect("all that is read");
        let mut pixels = vec![PixelCandidates::default(); 40 * 32];
        candidates::compute_candidates_of_rows(&four, [40, 32], 0, &mut pixels, &());
        [
            pixels[position].base_colour[0],
            pixels[position + 1].base_colour[0],
        ]
    };
    let [low, high] = [0.45, 0.55].map(value_of);
    let [own, beside] = [0, 1].map(|k| (low[k] - high[k]).abs());
    assert!(own < 0.1 * beside && beside > 1e-5, "{low:?} {high:?}");
}

/// Protects: the expected noise is subtracted from a difference, (4 − 1 − 1)/(1 + 2)/2, and pixels
/// of more than twice the noise get less weight.
#[test]
fn weights_by_hand() {
    let apart = row_kernels::noise_relative_distance(4.0, 1.0, 2.0, 0.5);
    assert!((apart - 1.0 / 3.0).abs() < 1e-6, "{apart}");
    let weights = [(0.0, 1.0), (2.0, 1.0), (5.0, 1.0), (0.0, 0.125)]
        .map(|(apart, inverse)| row_kernels::weight_of_distance(apart, 1.0, inverse));
    assert_eq!(
        weights.map(|weight| (weight * 1e4_f32).round()),
        [10_000.0, 625.0, 0.0, 2500.0]
    );
}

/// A picture invisible to all features: a step, a ramp, a fine pattern, a faint lamp and a few
/// bright lines.
fn drawn(width: usize) -> impl Fn(usize) -> f64 {
    move |pixel| {
        let (x, y) = (pixel % width, pixel / width);
        match (x / 16, y / 16) {
            (0, _) => 0.2 + 0.6 * f64::from(u8::from(y.is_multiple_of(2))),
            (1, 0) => x as f64 / 40.0,
            (1, _) if x == 20 || y == 27 => 2.0,
            (2, 0) => 0.05,
            _ => 0.5,
        }
    }
}

/// Protects: the error estimate is unbiased for any filter: over 60 pictures with content invisible
/// to features, and noise that depends on brightness, the mean estimated squared error is the mean
/// true one within three standard errors. (Halves that know each other give a negative estimate.)
#[test]
fn claims_are_right_on_average() {
    const RUNS: u64 = 60;
    let (truth, mut relative) = (drawn(48), Vec::new());
    let runs: Vec<[f64; 2]> = (0..RUNS)
        .map(|seed| {
            let film = film_of([48, 32], |pixel, replicate| {
                let mut replicate_sample = grey(0.0);
                let of = truth(pixel);
                replicate_sample.radiance = core::array::from_fn(|i| {
                    of + 0.4 * of.sqrt() * noise(seed, pixel, replicate, i)
                });
                replicate_sample
            });
            let four = film.merge_into_four_replicates().expect("all that is read");
            let mut pixels = vec![PixelCandidates::default(); 48 * 32];
            candidates::compute_candidates_of_rows(&four, [48, 32], 0, &mut pixels, &());
            candidate_mixture::mix_candidates(&four, [48, 32], &mut pixels);
            let claimed = pixels
                .iter()
                .flat_map(|pixel| pixel.error_terms[0])
                .map(f64::from)
                .sum::<f64>()
                / (3 * pixels.len()) as f64;
            let found_denoised = denoised(&film);
            relative.push([
                found_denoised.error.root_relmse.value.powi(2),
                relative_error(&found_denoised.picture, &truth),
            ]);
            [claimed, error(&found_denoised.picture, &truth)]
        })
        .collect();
    let mean = |of: &dyn Fn(&[f64; 2]) -> f64| runs.iter().map(of).sum::<f64>() / RUNS as f64;
    let (claimed, true_error) = (mean(&|run| run[0]), mean(&|run| run[1]));
    let variance =
        mean(&|run| (run[0] - run[1] - claimed + true_error).powi(2)) / (RUNS - 1) as f64;
    assert!(
        (claimed - true_error).abs() < 3.0 * variance.sqrt(),
        "{claimed} for {true_error} ± {}",
        variance.sqrt()
    );
    assert!(
        variance.sqrt() < 0.05 * true_error,
        "the test tells nothing: ± {}",
        variance.sqrt()
    );
    let [claimed, true_error] =
        [0, 1].map(|k| relative.iter().map(|run: &[f64; 2]| run[k]).sum::<f64>() / RUNS as f64);
    assert!(
        (0.9..1.15).contains(&(claimed / true_error)),
        "{claimed} for {true_error}, relative"
    );
}

/// Mean relative squared error of a picture.
fn relative_error(picture: &Picture, truth: impl Fn(usize) -> f64) -> f64 {
    let square = |(pixel, rgb): (usize, &[f32; 3])| {
        rgb.iter()
            .map(|&c| {
                (f64::from(c) - truth(pixel)).powi(2) / (truth(pixel).powi(2) + features::FLOOR)
            })
            .sum::<f64>()
    };
    picture.rgb.iter().enumerate().map(square).sum::<f64>() / (3 * picture.rgb.len()) as f64
}

/// Protects: the relative error estimate accounts for pixels that spread light makes look too
/// bright: in stripes with one of three lit, they are most of the error. (Relative to the picture's
/// own colour the estimate is three fifths of it.)
#[test]
fn relative_claims_know_what_looks_too_bright() {
    const RUNS: u64 = 40;
    let is_bright = |pixel: usize| (pixel % 48).is_multiple_of(3);
    let runs = (0..RUNS).map(|seed| {
        let film = film_of([48, 32], |pixel, replicate| {
            // Half of the samples, or one in fifty, by the normal deviate.
            let minimum = if is_bright(pixel) { 0.0 } else { 2.054 };
            grey(
                (0..4)
                    .filter(|&sample| noise(seed, pixel, replicate, sample) > minimum)
                    .count() as f64,
            )
        });
        let found_denoised = denoised(&film);
        let truth = |pixel: usize| if is_bright(pixel) { 2.0 } else { 0.08 };
        [
            found_denoised.error.root_relmse.value.powi(2),
            relative_error(&found_denoised.picture, truth),
        ]
    });
    let [claimed, true_error] = runs.fold([0.0; 2], |sum, run| [sum[0] + run[0], sum[1] + run[1]]);
    assert!(
        (0.68..1.2).contains(&(claimed / true_error)),
        "{claimed} for {true_error}"
    );
}

/// Protects: a picture without noise is unchanged, black stays black, and the estimated error is
/// zero.
#[test]
fn pictures_without_noise_stay() {
    let truth = drawn(48);
    for (name, of) in [
        ("drawn", &truth as &dyn Fn(usize) -> f64),
        ("black", &|_| 0.0),
        ("bright", &|_| 1e6),
    ] {
        let found_denoised = denoised(&film_of([48, 40], |pixel, _| grey(of(pixel))));
        for (pixel, rgb) in found_denoised.picture.rgb.iter().enumerate() {
            let (is, was) = (f64::from(rgb[1]), of(pixel));
            assert!(
                (is - was).abs() < 2e-3 + 1e-6 * was,
                "{name}: {was} became {is} in pixel {pixel}"
            );
        }
        assert!(
            found_denoised.error.root_relmse.value < 2e-3,
            "{name}: {:?}",
            found_denoised.error
        );
    }
}

/// Protects: unlit pixels keep their emission to the bit, and nothing is added, in tiles with and
/// without light elsewhere.
#[test]
fn what_is_unlit_is_left_as_it_is() {
    let actual = |pixel: usize| 0.25 + (pixel % 7) as f64 / 8.0;
    for lit in [None, Some(3)] {
        let film = film_of([40, 32], |pixel, replicate| {
            let light = 1.0 + 0.25 * replicate as f64;
            ReplicateSample {
                radiance: [actual(pixel) + if lit == Some(pixel) { light } else { 0.0 }; 3],
                emission: [actual(pixel); 3],
                albedo: [0.0; 3],
            }
        });
        let four = film.merge_into_four_replicates().expect("all that is read");
        let mut pixels = vec![PixelCandidates::default(); 40 * 32];
        candidates::compute_candidates_of_rows(&four, [40, 32], 0, &mut pixels, &());
        for (position, pixel) in pixels.iter().enumerate().skip(12 * 40) {
            assert_eq!(
                pixel.base_colour,
                [actual(position) as f32; 3],
                "{lit:?}, {position}"
            );
            assert_eq!(
                (pixel.changes, pixel.error_terms),
                ([[0.0; 3]; 3], [[0.0; 3]; 3])
            );
        }
        assert_eq!(pixels[3].error_terms != [[0.0; 3]; 3], lit.is_some());
    }
}

/// Protects: pictures of any size and with invalid numbers yield finite numbers; values beyond the
/// range of pictures stay unchanged.
#[test]
fn odd_pictures_make_no_odd_numbers() {
    let noisy = |pixel: usize, replicate: usize| grey(0.3 + 0.1 * noise(3, pixel, replicate, 0));
    for size in [
        [1, 1],
        [1, 2],
        [2, 1],
        [3, 3],
        [1, 40],
        [40, 1],
        [129, 33],
        [7, 65],
    ] {
        let found_denoised = denoised(&film_of(size, noisy));
        assert!(
            found_denoised
                .picture
                .rgb
                .iter()
                .chain(&found_denoised.standard_error)
                .flatten()
                .all(|c| c.is_finite()),
            "{size:?}"
        );
        assert!(
            found_denoised
                .picture
                .rgb
                .iter()
                .flatten()
                .all(|&c| (-0.2..0.8).contains(&c)),
            "{size:?}"
        );
        let error = found_denoised.error.root_relmse;
        assert!(
            error.value.is_finite() && error.low <= error.value && error.value <= error.high,
            "{error:?}"
        );
    }
    let found_denoised = denoised(&film_of([1, 1], noisy));
    assert_eq!(
        found_denoised.error.doubt,
        Some(crate::film::EstimateDoubt::WideInterval),
        "one pixel has no blocks"
    );
    let odd = |pixel: usize, replicate: usize| match pixel {
        5 => grey(1e30),
        17 => grey(f64::INFINITY),
        29 => grey(f64::NAN),
        41 => ReplicateSample {
            albedo: [f64::NAN, f64::INFINITY, -3.0],
            ..noisy(pixel, replicate)
        },
        53 => ReplicateSample {
            emission: [1e20; 3],
            ..noisy(pixel, replicate)
        },
        77 => grey(-4.0),
        _ => noisy(pixel, replicate),
    };
    let film = film_of([32, 20], odd);
    let found_denoised = denoised(&film);
    for (pixel, rgb) in found_denoised
        .picture
        .rgb
        .iter()
        .enumerate()
        .filter(|(pixel, _)| ![17, 29].contains(pixel))
    {
        assert!(rgb.iter().all(|c| c.is_finite()), "pixel {pixel}: {rgb:?}");
    }
    assert_eq!(found_denoised.picture.rgb[5], film.picture().rgb[5]);
    let far = |pixel: &usize| pixel % 32 > 12 && pixel % 32 < 20 && pixel / 32 > 10;
    for pixel in (0..32 * 20).filter(far) {
        assert!(
            (0.1..0.5).contains(&found_denoised.picture.rgb[pixel][0]),
            "far from all that: {:?}",
            found_denoised.picture.rgb[pixel]
        );
    }
}

/// Protects: a film that lacks layers or replicates yields an error that names them, and a
/// deterministic film the error that there is no noise.
#[test]
fn what_is_missing_is_named() {
    let film = |settings: Settings| {
        prepare(&Scene::default(), &settings, &())
            .expect("nothing is wrong with it")
            .new_film("")
    };
    let base = || Settings {
        size: [4, 4],
        sampling: Sampling::General(64),
        ..Settings::from_scene(&Scene::default())
    };
    let why = |film: &Film| denoise(film, &()).err();
    assert_eq!(why(&film(base())), Some(DenoiseError::Layer("emission")));
    assert_eq!(
        why(&film(Settings {
            aovs: vec![Aov::Emission, Aov::Normal, Aov::Depth],
            ..base()
        })),
        Some(DenoiseError::Layer("albedo"))
    );
    assert_eq!(
        why(&film(Settings {
            denoise: true,
            ..base()
        })),
        Some(DenoiseError::Replicates)
    );
    let pattern = Sampling::Pattern(crate::scene::SamplePattern::Centre);
    assert_eq!(
        why(&film(Settings {
            denoise: true,
            sampling: pattern,
            ..base()
        })),
        Some(DenoiseError::NoChance)
    );
    let film = film_of([4, 4], |_, _| grey(1.0));
    struct StoppedObserver;
    impl Observer for StoppedObserver {
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    assert!(matches!(
        denoise(&film, &StoppedObserver),
        Err(DenoiseError::Cancelled)
    ));
}

/// Protects: a denoised picture has the same bits on one thread and on several.
#[test]
fn threads_change_no_bit() {
    let film = film_of([150, 70], |pixel, replicate| {
        grey(0.3 + 0.1 * noise(7, pixel, replicate, 0))
    });
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| denoised(&film))
    };
    let (single_denoised, three) = (on(1), on(3));
    assert_eq!(
        (single_denoised.picture, single_denoised.error),
        (three.picture, three.error)
    );
    assert_eq!(single_denoised.standard_error, three.standard_error);
}

/// Protects: tiles leave no seams: a region far from the picture's edges is the same elsewhere in
/// the tiles.
#[test]
fn tiles_leave_no_seams() {
    let value_of = |shift: usize| {
        let film = film_of([200, 40], |pixel, replicate| {
            let (x, y) = (pixel % 200 + shift, pixel / 200);
            grey(0.3 + 0.1 * noise(9, y * 1000 + x, replicate, 0))
        });
        let four = film.merge_into_four_replicates().expect("all that is read");
        let mut pixels = vec![PixelCandidates::default(); 200 * 40];
        candidates::compute_candidates_of_rows(&four, [200, 40], 0, &mut pixels, &());
        pixels
    };
    let (one, other) = (value_of(0), value_of(45));
    for (y, x) in (0..20).flat_map(|y| (100..150).map(move |x| (y, x))) {
        let [a, b] = [one[y * 200 + x], other[y * 200 + x - 45]]
            .map(|pixel| (pixel.base_colour, pixel.changes, pixel.error_terms));
        assert_eq!(a, b, "{x}, {y}");
    }
}

/// Protects: doubts about the noisy picture's error carry over to the denoised one: few pixels lit
/// in one replicate alone, and lamps hit by chance. A doubtful picture does not reach a target
/// error, however small the estimate is; without doubt it does, by the upper end of the interval.
#[test]
fn doubts_of_the_noisy_picture_are_doubts_of_the_denoised_one() {
    use crate::film::EstimateDoubt;
    let value_of = |rare: bool| {
        film_of([48, 32], |pixel, replicate| {
            let is_lit = rare && pixel % 97 == 5 && replicate == pixel % 4;
            grey(if is_lit {
                40.0
            } else {
                0.5 + 0.01 * noise(21, pixel, replicate, 0)
            })
        })
    };
    for (rare, doubt) in [(false, None), (true, Some(EstimateDoubt::FewPixels))] {
        let film = value_of(rare);
        let (found_denoised, noisy) = (
            denoised(&film),
            film.estimate_uncertainty().expect("four replicates"),
        );
        assert_eq!([found_denoised.error.doubt, noisy.doubt], [doubt; 2]);
        let estimate = found_denoised.error.root_relmse;
        assert_eq!(
            found_denoised.reaches_error(estimate.high.max(noisy.root_relmse.high), &noisy),
            !rare,
            "{rare}"
        );
        assert!(
            !found_denoised.reaches_error(f64::midpoint(estimate.value, estimate.high), &noisy),
            "{rare}: the value is no proof"
        );
    }
}

/// Protects: a denoised picture is doubtful if its true colours are so uncertain that two weightings
/// of the noisy error differ widely, even if that error is known: lamps in four of thirteen pixels
/// were each lit in zero to three replicates.
#[test]
fn rare_light_that_is_vouched_for_is_not_known_denoised() {
    use crate::film::EstimateDoubt;
    let film = film_of([48, 32], |pixel, replicate| {
        let lit = (7 * pixel % 13).saturating_sub(9);
        grey(if (replicate + pixel) % 4 < lit {
            40.0
        } else {
            0.0
        })
    });
    let (found_denoised, noisy) = (
        denoised(&film),
        film.estimate_uncertainty().expect("four replicates"),
    );
    assert_eq!(
        [noisy.doubt, found_denoised.error.doubt],
        [None, Some(EstimateDoubt::FewPixels)]
    );
}

/// Protects: a picture of less than two blocks, without an interval for its denoised error, reaches
/// a target error where the noisy one does.
#[test]
fn pictures_without_blocks_end() {
    let film = film_of([4, 4], |pixel, replicate| {
        grey(0.5 + 0.02 * noise(22, pixel, replicate, 0))
    });
    let (found_denoised, noisy) = (
        denoised(&film),
        film.estimate_uncertainty().expect("four replicates"),
    );
    assert!(
        found_denoised.error.doubt.is_some() && noisy.doubt.is_none(),
        "{:?} {:?}",
        found_denoised.error,
        noisy
    );
    assert!(
        found_denoised.reaches_error(noisy.root_relmse.high * 1.01, &noisy)
            && !found_denoised.reaches_error(noisy.root_relmse.high / 1.01, &noisy)
    );
}
