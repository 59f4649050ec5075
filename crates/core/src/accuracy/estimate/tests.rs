//! Errors of a tile from a reference that is itself wrong.

use super::*;
use crate::hash::splitmix64;
use crate::scene::RenderSettings;

const SIZE: [u32; 2] = [64, 64];

/// A picture of 0.5 with normal noise and an offset.
fn noisy(seed: u64, sigma: f64, offset: f64) -> Picture {
    let uniform = |k: usize, i: usize| {
        splitmix64(seed ^ splitmix64((16 * k + i) as u64)) as f64 / 2_f64.powi(64)
    };
    let mut picture = Picture::new(SIZE[0], SIZE[1]);
    for (k, value) in picture.rgb.iter_mut().flatten().enumerate() {
        // Twelve uniform numbers less six: variance 1.
        let sum: f64 = (0..12).map(|i| uniform(k, i)).sum();
        *value = (0.5 + offset + sigma * (sum - 6.0)) as f32;
    }
    picture
}

fn display() -> Display {
    Display::from_render(&RenderSettings::default())
}

fn truth(sigma: f64) -> ReferenceTile {
    let means: Vec<PixelMeanAndVariance> = noisy(99, sigma, 0.0)
        .rgb
        .iter()
        .map(|rgb| [rgb.map(f64::from), [sigma * sigma; 3]])
        .collect();
    ReferenceTile::new(SIZE, &means, display())
}

fn judged(sigma: f64, renders: &[Picture], by_chance: bool) -> TileErrors {
    truth(sigma).measure_tile_errors(renders, by_chance, &[], display())
}

/// Root of a mean over pixels.
fn root(values: &[f64]) -> f64 {
    (values.iter().sum::<f64>() / 4096.0).max(0.0).sqrt()
}

fn near(value: f64, expected: f64, share: f64) {
    assert!(
        (value - expected).abs() <= share * expected,
        "{value}, not {expected}"
    );
}

/// Protects: the reference's own noise is subtracted, and the rest is divided into bias and noise.
/// An offset of 0.03 with noise of 0.04 is an error of 0.05, even from a reference with an error of
/// 0.05.
#[test]
fn a_noisy_reference_is_seen_through() {
    let renders: Vec<Picture> = (1..=8).map(|seed| noisy(seed, 0.04, 0.03)).collect();
    near(root(&judged(0.05, &renders, true).squared), 0.05, 0.03);
    // A reference that noisy affects the weight of each pixel by its noise; a reference with a
    // hundredth of the variance does not.
    let errors = judged(0.005, &renders, true);
    near(root(&errors.relative), 0.05 / 0.26_f64.sqrt(), 0.02);
    near(root(&errors.bias), 0.03 / 0.26_f64.sqrt(), 0.02);
    near((truth(0.05).summed_variance() / 4096.0).sqrt(), 0.05, 1e-6);
    assert_eq!(
        (errors.squared.len(), truth(0.0).block_pixel_counts()),
        (64, vec![64.0; 64])
    );
}

/// Protects: a setting without error is within the reference's noise, and an offset is beyond it. A
/// single render leaves bias unknown, except without random numbers.
#[test]
fn no_error_is_lost_in_noise() {
    let sum = |offset: f64| {
        judged(0.05, &[noisy(1, 0.0, offset)], false)
            .relative
            .iter()
            .sum::<f64>()
    };
    let doubt = truth(0.05).error_variance.sqrt();
    assert!(
        sum(0.0).abs() < 2.0 * doubt && sum(0.02) > 4.0 * doubt,
        "{} and {} of {doubt}",
        sum(0.0),
        sum(0.02)
    );
    near(
        root(&judged(0.0, &[noisy(1, 0.0, 0.02)], false).bias),
        0.02 / 0.26_f64.sqrt(),
        1e-3,
    );
    assert!(judged(0.0, &[noisy(1, 0.1, 0.0)], true).bias.is_empty());
}

/// Protects: the difference of pairs is free of their common noise, and light is counted unchanged.
#[test]
fn pairs_share_their_noise() {
    let [own, other] = [0.0, 0.01].map(|offset| {
        (1..4)
            .map(|seed| noisy(seed, 0.5, offset))
            .collect::<Vec<_>>()
    });
    let errors = truth(0.0).measure_tile_errors(&other, true, &own, display());
    near((errors.paired_difference[0] / 4096.0).sqrt(), 0.01, 1e-4);
    near(errors.paired_difference[1] / 4096.0, 1e-4 / 0.26, 1e-3);
    near(errors.light, truth(0.0).total_radiance() * 1.02, 0.02);
    assert_eq!(
        truth(0.0)
            .measure_tile_errors(&own, true, &own, display())
            .paired_difference,
        [0.0; 2]
    );
}

/// Protects: files state roots, with the unit of the root mean squared error, and no squares.
#[test]
fn reports_have_roots() {
    let interval = |value: f64| ConfidenceInterval {
        value,
        low: 0.25 * value,
        high: 4.0 * value,
    };
    let errors = SettingErrors {
        rmse: interval(0.5),
        relmse: interval(0.04),
        bias: Some(interval(0.01)),
        light: interval(1.0),
    };
    let json = serde_json::to_value(errors).expect("JSON");
    let near = |at: &str, expected: f64| {
        let found = json.pointer(at).and_then(|number| number.as_f64());
        let is_near = found.is_some_and(|found| (found / expected - 1.0).abs() < 1e-12);
        assert!(is_near, "{at}: {found:?}, not {expected}");
    };
    for (name, value, root) in [
        ("root_relmse", 0.2, 2.0),
        ("bias", 0.1, 2.0),
        ("rmse", 0.5, 4.0),
    ] {
        near(&format!("/{name}/value"), value);
        near(&format!("/{name}/low"), value / root);
        near(&format!("/{name}/high"), value * root);
    }
    assert_eq!(json.as_object().map(|object| object.len()), Some(4));
}
