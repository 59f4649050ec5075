//! Errors of whole pictures against closed forms, and against the truth of a scene whose pixels are known.

use super::{layers, ready, rendered, settings};
use crate::film::{Counters, Doubt, Film, Plane};
use crate::scene::Scene;
use crate::settings::{Sampling, Settings};
use crate::{Ready, prepare};

/// A film of pixels whose replicates have these means, each of two samples.
fn film(pixels: &[[f64; 4]]) -> Film {
    let all = Settings {
        size: [pixels.len() as u32, 1],
        sampling: Sampling::General(8),
        replicates: Some(4),
        ..Settings::of(&Scene::default())
    };
    let ready = prepare(&Scene::default(), &all, &()).expect("an empty scene");
    let mut film = ready.film("");
    for replicate in 0..4 {
        let sums = pixels.iter().map(|means| [2.0 * means[replicate]; 3]).collect();
        film.planes[replicate] = Some(Plane { sums, samples: vec![2; pixels.len()], ..Plane::default() });
    }
    film
}

/// Protects: of replicates with the means 1, 2, 3, 4 the mean has a variance of 5/12, whose root is the error. Differences of pairs are
/// (−1, −1), (−2, −2) and (−3, 1) in each of three channels that go together, so that their squared products are 9 times 1, 16 and 9: a
/// mean of 78 over 24 = 2R(R − 1), relative to (3 · 5/12)² in each of fifty pixels of a hundred, and 1/50 for the pixels that carry it.
#[test]
fn errors_of_pictures_by_hand() {
    let mut pixels = [[2.5; 4]; 100];
    pixels[20..70].fill([1.0, 2.0, 3.0, 4.0]);
    let found = film(&pixels).uncertainty().expect("four replicates");
    assert!((found.rmse.value - (5.0_f64 / 24.0).sqrt()).abs() < 1e-12);
    assert!((found.rmse.carriers - 50.0).abs() < 1e-9);
    let half = 1.959_963_984_540_054 * (78.0 / 24.0 / (1.25_f64 * 1.25) / 50.0 + 0.02).sqrt() / 2.0;
    assert!((found.rmse.high / found.rmse.value - half.exp()).abs() < 1e-12);
    assert!((found.rmse.low / found.rmse.value - (-half).exp()).abs() < 1e-12);
    assert_eq!((found.doubt, found.replicates), (None, 4));
}

/// Protects: a squared difference is relative to the product of the two replicates that are not in it, and 0.01. With the means 1, 1, 1
/// and 2 those are 1 · 2 for the three pairs without the last, which are 0, and 1 · 1 for the three with it: 3/48 · 1/1.01. That is where
/// pairs agree; 1 and 2 differ by a variance of 1/9 of their squared mean, so that 1/9 comes from the neighbours, which are the same.
#[test]
fn relative_errors_by_hand() {
    let found = film(&[[1.0, 1.0, 1.0, 2.0]; 100]).uncertainty().expect("four replicates");
    assert!((found.root_relmse.value - (3.0 / 48.0 / 1.01_f64).sqrt()).abs() < 1e-12);
    // Among neighbours with 3 in place of 1 and 2, a pair that differs is relative to a mix of both: 1/9 of what is near.
    let mut pixels = [[3.0; 4]; 5];
    pixels[2] = [1.0, 2.0, 1.0, 2.0];
    let found = film(&pixels).uncertainty().expect("four replicates").root_relmse.value;
    let (sure, near) = (8.0_f64 / 9.0, (4.0 * 9.0 + 2.0) / 5.0);
    // Four of the six pairs differ, by one, and are weighed by pairs that differ too.
    let mixed = 1.0 / (sure * 2.0 + (1.0 - sure) * near + 0.01);
    assert!((found - (4.0 * mixed / 48.0 / 5.0).sqrt()).abs() < 1e-12, "{found}");
}

/// Protects: a bright sample that few pixels met is in the error and in what is known of it, and so makes no interval wider; what does is
/// that replicates differ in pairs. Nothing makes it narrower than as many normal numbers would.
#[test]
fn rare_bright_samples_are_in_both() {
    let width = |pixels: &[[f64; 4]]| {
        let found = film(pixels).uncertainty().expect("four replicates").rmse;
        (found.high / found.low).ln()
    };
    let least = 1.959_963_984_540_054 * (8.0_f64 / 3.0 / 100.0 + 0.01).sqrt();
    assert!((width(&[[0.0, 0.0, 0.0, 5.0]; 100]) - least).abs() < 1e-12);
    assert!(width(&[[0.0, 5.0, 0.0, 5.0]; 100]) > 1.15 * least);
}

/// Protects: of two replicates, a pixel is held against the next one, and the last of a row against the one before; no interval is
/// claimed to hold.
#[test]
fn two_replicates_are_held_against_neighbours() {
    let of = |pixels: &[[f64; 2]], width: u32| {
        let size = [width, pixels.len() as u32 / width];
        let all = Settings { size, sampling: Sampling::General(8), replicates: Some(2), ..Settings::of(&Scene::default()) };
        let mut film = prepare(&Scene::default(), &all, &()).expect("an empty scene").film("");
        for replicate in 0..2 {
            let sums = pixels.iter().map(|means| [4.0 * means[replicate]; 3]).collect();
            film.planes[replicate] = Some(Plane { sums, samples: vec![4; pixels.len()], ..Plane::default() });
        }
        let found = film.uncertainty().expect("two replicates");
        assert_eq!((found.doubt, found.replicates), (Some(Doubt::FewSamples), 2));
        found.rmse
    };
    // Variances of 3/4 in the upper row, and products of 9 there alone, over 4 = 2R(R − 1); two pixels carry it.
    let found = of(&[[0.0, 1.0], [0.0, 1.0], [0.0, 0.0], [0.0, 0.0]], 2);
    assert!((found.value - (1.5_f64 / 12.0).sqrt()).abs() < 1e-12);
    let expected = 1.959_963_984_540_054 * (18.0_f64 / 4.0 / (1.5 * 1.5) + 0.5).sqrt();
    assert!(((found.high / found.low).ln() - expected).abs() < 1e-12);
}

/// Protects: where one pixel of many carries the error it is said, and where nothing varies the error is zero and sure.
#[test]
fn few_pixels_say_little() {
    let mut pixels = [[1.0, 1.01, 0.99, 1.0]; 100];
    pixels[40] = [1.0, 1.0, 1.0, 90.0];
    let found = film(&pixels).uncertainty().expect("four replicates");
    assert!(found.doubt == Some(Doubt::FewPixels) && found.rmse.carriers < 2.0, "{found:?}");
    let still = film(&[[0.5; 4]; 10]).uncertainty().expect("four replicates");
    assert_eq!((still.rmse.value, still.rmse.high, still.doubt), (0.0, 0.0, None));
}

/// Protects: where each of many pixels has a bright sample in one replicate alone, what the error is relative to is not known: the three
/// others have black, so that 25 is relative to 0.01, and what the pair itself has is 2.5.
#[test]
fn light_that_others_miss_is_doubted() {
    let of = |means| film(&[means; 100]).uncertainty().expect("four replicates");
    let rare = of([0.0, 0.0, 0.0, 5.0]);
    assert!(rare.root_relmse.carriers > 99.0 && rare.doubt == Some(Doubt::FewPixels), "{rare:?}");
    // Of 1 and 0.8 each is relative to what the other has, nearly.
    assert_eq!(of([1.0, 1.0, 1.0, 0.8]).doubt, None);
}

/// Protects: where paths went on by mirrors or through glass and met no lamp, or few, it is said that such light may be unseen; where
/// they met many, and where no path did that, nothing is.
#[test]
fn light_by_chance_is_doubted() {
    let of = |unaided, found| {
        let mut film = film(&[[1.0, 2.0, 3.0, 4.0]; 100]);
        film.counters = Counters { unaided, found, ..film.counters };
        film.uncertainty().expect("four replicates").doubt
    };
    assert_eq!([of(0, 0), of(1, 0), of(9, 39), of(9, 40)], [None, Some(Doubt::LightByChance), Some(Doubt::LightByChance), None]);
}

/// Protects: nothing is said where nothing is known: of one replicate, of a pixel without samples, of a pattern.
#[test]
fn nothing_is_said_of_nothing() {
    let of = |settings: Settings| rendered(&ready(&settings)).uncertainty();
    assert!(of(Settings { replicates: Some(1), ..settings(6) }).is_none());
    assert!(of(settings(6)).is_some());
    assert!(
        of(Settings { sampling: Sampling::Pattern(crate::scene::Pattern::Corners), aovs: layers(), ..settings(4) }).is_none()
    );
    let ready: Ready = ready(&settings(6));
    let mut film = ready.film("scene");
    let first = crate::film::Part { tiles: 0..1, ..film.whole() };
    ready.render_part(&mut film, &first, &()).expect("its own film");
    assert!(film.uncertainty().is_none());
}
