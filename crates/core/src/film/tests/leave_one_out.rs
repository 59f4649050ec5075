//! Light that a single replicate found: when other pixels confirm it, the denominator of its error,
//! and the doubt about rare light.

use super::adaptive::{add_samples, row};
use super::uncertainty::film;
use crate::film::adaptive::ErrorProgress;
use crate::film::leave_one_out::{LeaveOneOutStats, SingleReplicateBound};
use crate::film::{EstimateDoubt, ReplicateBuffer};
use crate::hash::splitmix64;
use crate::metrics::student_factor_95;

/// Whether this many pixels with these means of four replicates confirm light that was found once.
fn vouch(pixels: &[(usize, [f64; 4])]) -> bool {
    let mut again = LeaveOneOutStats::default();
    for &(count, means) in pixels {
        (0..count).for_each(|_| again.add_pixel(means.map(|mean| [mean; 3])));
    }
    again.confirms_enough_light()
}

/// Protects: a pixel lit in one replicate has three held-out replicates of zero; a pixel lit in two
/// has two with three times the mean of the others. For 100 and 60 pixels the confirmed share is
/// 360/420 = 0.86, within 2/√420 = 0.10; for 100 and 40 pixels 0.63, within 0.10. 33 of each
/// suffice and 30 do not (150 held out of 160); pixels lit in all replicates never count.
#[test]
fn light_counts_as_known_where_replicates_agree() {
    let (once, twice) = ([0.0, 0.0, 2.0, 0.0], [2.0, 0.0, 0.0, 2.0]);
    let value_of =
        |lit_once, lit_twice| vouch(&[(lit_once, once), (lit_twice, twice), (1000, [2.0; 4])]);
    assert_eq!(
        [
            value_of(100, 60),
            value_of(100, 40),
            value_of(33, 33),
            value_of(30, 30),
            value_of(0, 0)
        ],
        [true, false, true, false, false]
    );
}

/// Protects: brighter light needs more confirmation. 600 dim replicates with three times the
/// expected light and 300 of a hundredfold brightness with none are 2 on average, but 1/2 when
/// weighted by the root of the brightness. One replicate far brighter than its pixel's others does
/// not confirm a hundred others: it counts four times the expected light, not 270 times. Black
/// pixels give no information.
#[test]
fn bright_light_needs_more_to_vouch_for_it() {
    let dim = (300, [1.0, 1.0, 0.0, 0.0]);
    assert!(vouch(&[dim, (100, [0.0, 1.0, 0.0, 0.0])]));
    assert!(!vouch(&[dim, (100, [0.0, 100.0, 0.0, 0.0])]));
    assert!(!vouch(&[
        (100, [0.0, 1.0, 0.0, 0.0]),
        (8, [1.0, 0.0, 0.0, 90.0])
    ]));
    assert!(!vouch(&[(300, [0.25, 0.25, 0.0, 0.0])]) && vouch(&[(300, [0.35, 0.35, 0.0, 0.0])]));
}

/// Protects: a pixel lit once is weighted by the geometric mean of the averages of 1/(T² + δ²) for
/// gamma distributions of T with shapes 3/2 and 2 and scale m, its mean. With x = m/δ the first is
/// 1/m² times √(2πx) − 4 + … for large x (the second term is Γ(−1/2)/Γ(3/2)), approximated by
/// √(2πx) + 1. So the geometric mean is too large by the root of the ratio of the two, the distance
/// of both distributions by its logarithm, and the mean square over the squared mean too small by
/// (1 − 4/√(2πx))². For an x of 1 to 10 the first is at most two fifths. For small x, 1/(1 + 2x)
/// approximates the second, which is 1 − 6x² + …: too small by a share of x for the geometric mean.
/// The integrals are sums over steps of a thousandth in log T.
#[test]
fn what_was_seen_once_has_a_gamma_distribution() {
    for mean in [
        0.001,
        0.01,
        0.1,
        0.3,
        1.0,
        10.0,
        100.0,
        1000.0,
        10_000.0_f64,
    ] {
        let moments = |shape: f64, norm: f64| {
            let (mut first, mut second) = (0.0, 0.0);
            for step in -30_000..5_000 {
                let t = (f64::from(step) / 1000.0).exp();
                let density = t.powf(shape) * (-t).exp() / norm / 1000.0;
                let weight = 1.0 / (mean * mean * t * t + 0.01);
                first += density * weight;
                second += density * weight * weight;
            }
            [first, second]
        };
        let [jeffreys, even] = [
            moments(1.5, core::f64::consts::PI.sqrt() / 2.0),
            moments(2.0, 1.0),
        ];
        // Of four replicates one has all of the light.
        let once =
            SingleReplicateBound::from_means([[0.0; 3], [4.0 * mean; 3], [0.0; 3], [0.0; 3]]);
        let over = mean / 0.1;
        let root = (core::f64::consts::TAU * over).sqrt();
        let ratio = (once.max_weight[0] / (jeffreys[0] * even[0]).sqrt()).ln();
        let above = if root > 4.0 {
            ((root + 1.0) / (root - 4.0)).ln()
        } else {
            f64::INFINITY
        };
        let maximum = (above / 2.0).min(1.4_f64.ln());
        assert!(
            (-over.min(0.06)..=maximum).contains(&ratio),
            "{mean}: {ratio}"
        );
        let apart = once.prior_uncertainty[0] * 12.0_f64.sqrt() - (jeffreys[0] / even[0]).ln();
        assert!((0.0..=above.min(0.8)).contains(&apart), "{mean}: {apart}");
        if mean >= 100.0 {
            let ratio =
                once.event_uncertainty[0].powi(2) / (jeffreys[1] / (jeffreys[0] * jeffreys[0]));
            assert!(
                (ratio - (1.0 - 4.0 / root).powi(2)).abs() < 0.004,
                "{mean}: {ratio}"
            );
        }
    }
}

/// Protects: a black pixel was never lit, and has a finite weight.
#[test]
fn what_is_black_is_weighed_as_black() {
    let SingleReplicateBound {
        max_weight: most,
        event_uncertainty: deviation,
        prior_uncertainty: prior,
    } = SingleReplicateBound::from_means([[0.0; 3]; 4]);
    assert_eq!((most, deviation, prior), ([100.0; 3], [0.0; 3], [0.0; 3]));
}

/// Protects: where light is confirmed, pixels lit once have the gamma distribution's denominator at
/// least, and pixels lit twice that of products. Uncertainties common to all pixels add up, and the
/// square of their sum adds to the squares of the independent ones. Of 100 pixels with one
/// replicate of 2 and 100 with two, the first have a variance of 4/16 in each channel, the second
/// of 4/12.
#[test]
fn errors_of_light_that_is_vouched_for_by_hand() {
    let mut pixels = [[0.0, 2.0, 0.0, 0.0]; 200];
    pixels[100..].fill([2.0, 2.0, 0.0, 0.0]);
    let uncertainty = film(&pixels)
        .estimate_uncertainty()
        .expect("four replicates");
    assert_eq!(uncertainty.doubt, None);
    // A mean of 1/2, which is five times 0.1.
    let factors = [
        1.0 + (core::f64::consts::TAU * 5.0).sqrt(),
        (6.0 + 25.0 * (-2.0 * 0.577_215_664_901_532_9_f64).exp()).ln() / 2.0,
    ];
    let [jeffreys, even] = factors.map(|factor| 1.0 / (0.25 / factor + 0.01));
    let lit_once = 3.0 * 0.25 * (jeffreys * even).sqrt();
    let unsure = lit_once * (5.0_f64.powf(1.5) / (4.0 * core::f64::consts::TAU.sqrt())).sqrt();
    let prior = lit_once * (jeffreys / even).ln() / 12.0_f64.sqrt();
    // Across: 0.01/(0.01² + 2²). Among: 4/6 and 0.01.
    let twice =
        [0.01 / (0.01 * 0.01 + 4.0), 1.0 / (4.0 / 6.0 + 0.01)].map(|weight| 3.0 * weight / 3.0);
    let [across, among] = twice.map(|twice| 100.0 * (lit_once + twice));
    let expected = ((across * among).sqrt() / 600.0).sqrt();
    assert!(
        (uncertainty.root_relmse.value / expected - 1.0).abs() < 1e-12,
        "{} and {expected}",
        uncertainty.root_relmse.value
    );
    // In two pairings of three both differences are 2, in each of three channels.
    let product = 100.0 * 2.0 / 3.0 * (3.0 * twice[1] * 4.0_f64).powi(2);
    let weights = 100.0 * (twice[0] - twice[1]).powi(2) / (across * across);
    let once = 100.0 * unsure * unsure / (across * among);
    let alike = (across / among).ln().abs() / 2.0 + 100.0 * prior / (across * among).sqrt();
    // At least the variance of two hundred equal variances.
    let products = (product / 24.0 / (among * among)).max(8.0 / 9.0 / 200.0);
    let width = student_factor_95(200) * (products + weights + once + alike * alike).sqrt();
    // Two hundred degrees of freedom may be rounded down by one: a factor of 1.97196 in place of
    // 1.97190.
    let found = (uncertainty.root_relmse.high / expected).ln() * 2.0;
    assert!((found / width - 1.0).abs() < 5e-5, "{found} and {width}");
}

/// Protects: where light is not rare, an error is relative to means of replicates, even if light
/// found once is confirmed. Dim pixels as above, of 0.31 in place of 2, have weights by two
/// pairings that differ by less than a factor of four.
#[test]
fn common_light_needs_no_second_sample() {
    let mut pixels = [[0.0, 0.31, 0.0, 0.0]; 200];
    pixels[100..].fill([0.31, 0.31, 0.0, 0.0]);
    assert!(vouch(&[(100, pixels[0]), (100, pixels[100])]));
    let uncertainty = film(&pixels)
        .estimate_uncertainty()
        .expect("four replicates");
    let variances = [1.0 / 16.0, 1.0 / 12.0].map(|share| share * 0.31 * 0.31);
    let [of_four, of_two] = [0.0775, 0.155].map(|mean| 1.0 / (mean * mean + 0.01));
    let own: f64 = variances[0] * of_four + variances[1] * of_two;
    let actual = (variances[0] + variances[1]) * of_two;
    assert!(
        (uncertainty.root_relmse.value - ((2.0 * own - actual) / 2.0).sqrt()).abs() < 1e-12,
        "{:?}",
        uncertainty.root_relmse
    );
    assert_eq!(uncertainty.doubt, None);
}

/// A uniform number below one, by an address.
fn share(address: u64) -> f64 {
    (splitmix64(splitmix64(address) ^ 0xA5A5) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Protects: small lamps that cover any share of a pixel are not doubted; the error is below the
/// upper end in 95 of 100 pictures, and between half and twice the claim. Every picture is doubted
/// where each pixel hits a lamp with one sample of a thousand, in all pixels or in four fifths of
/// them.
#[test]
fn small_lamps_are_told_from_rare_light() {
    /// Share of a pixel that a lamp covers.
    type LampCoverage = fn(u64) -> f64;
    const FILMS: u64 = 60;
    const PIXELS: u64 = 2000;
    const SAMPLES: u64 = 16;
    let covered: [(&str, bool, LampCoverage); 4] = [
        ("any share", true, share),
        ("small shares", true, |pixel| share(pixel).powi(2) / 2.0),
        ("rare", false, |_| 0.001),
        ("both", false, |pixel| {
            if pixel.is_multiple_of(5) {
                share(pixel)
            } else {
                0.001
            }
        }),
    ];
    for (name, is_sure, covered) in covered {
        let mut below = 0;
        let mut film = film(&[[0.0; 4]; PIXELS as usize]);
        for run in 0..FILMS {
            let colour = |lit: f64| 10.0 * lit + 0.003;
            for replicate in 0..4 {
                let sum = |pixel: u64| {
                    let address = |index| {
                        ((run * 4 + replicate) * PIXELS + pixel) * SAMPLES + index + (1 << 40)
                    };
                    let lit = (0..SAMPLES)
                        .filter(|&index| share(address(index)) < covered(run * PIXELS + pixel))
                        .count();
                    [2.0 * colour(lit as f64 / SAMPLES as f64); 3]
                };
                let sums = (0..PIXELS).map(sum).collect();
                film.buffers[replicate as usize] = Some(ReplicateBuffer {
                    sums,
                    samples: vec![2; PIXELS as usize],
                    ..ReplicateBuffer::default()
                });
            }
            let uncertainty = film.estimate_uncertainty().expect("four replicates");
            assert_eq!(
                uncertainty.doubt,
                (!is_sure).then_some(EstimateDoubt::FewPixels),
                "{name}"
            );
            let square = |(pixel, rgb): (u64, &[f32; 3])| {
                let truth = colour(covered(run * PIXELS + pixel));
                (f64::from(rgb[0]) - truth).powi(2) / (truth * truth + 0.01)
            };
            let error =
                ((0..).zip(&film.picture().rgb).map(square).sum::<f64>() / PIXELS as f64).sqrt();
            below += u64::from(error <= uncertainty.root_relmse.high);
            let ratio = error / uncertainty.root_relmse.value;
            assert!(!is_sure || (0.5..=2.0).contains(&ratio), "{name}: {ratio}");
        }
        assert!(!is_sure || below * 100 >= FILMS * 95, "{name}: {below}");
    }
}

/// Protects: a requested error is reached with small lamps, and not where as many pixels were lit
/// once each.
#[test]
fn small_lamps_do_not_go_on() {
    let advance = |is_seen_again: bool| {
        let mut film = row(8, 65_536);
        add_samples(&mut film, |replicate, tile, _| {
            let lit = if tile >= 4 && is_seen_again { 2 } else { 1 };
            if (replicate + tile) % 4 < lit {
                1.0
            } else {
                0.0
            }
        });
        film.plan_next_round(2.0, &())
    };
    assert_eq!(
        [advance(true), advance(false)],
        [ErrorProgress::Reached, ErrorProgress::NeedsSamples]
    );
}
