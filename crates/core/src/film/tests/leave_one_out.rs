//! Light that a single replicate found: when other pixels confirm it, the denominator of its error,
//! and the doubt about rare light.

use glam::DVec3;

use super::adaptive::{add_samples, row};
use super::uncertainty::film;
use crate::film::ReplicateBuffer;
use crate::film::adaptive::ErrorProgress;
use crate::film::leave_one_out::{LeaveOneOutStats, weight_of_small_lamp};
use crate::hash::splitmix64;

/// Statistics of this many pixels with these means of four replicates, over neighbours of this
/// radiance.
fn statistics(neighbours: f64, pixels: &[(usize, [f64; 4])]) -> LeaveOneOutStats {
    let mut again = LeaveOneOutStats::default();
    for &(count, means) in pixels {
        let four = means.map(|mean| [mean; 3]);
        (0..count).for_each(|_| again.add_pixel(four, DVec3::splat(neighbours)));
    }
    again
}

/// Protects: a pixel lit in one replicate has three held-out replicates of zero; a pixel lit in two
/// has two with three times the mean of the others. For 100 and 60 pixels the confirmed share is
/// 360/420 = 0.86, within 2/√420 = 0.10. Pixels lit in all replicates never count, and what the
/// neighbours have in common confirms nothing. Without such pixels nothing is known.
#[test]
fn light_counts_as_known_where_replicates_agree() {
    let value_of = |over: f64, once: usize, twice: usize| {
        let pixels = [
            (once, [0.0, 0.0, 2.0, 0.0]),
            (twice, [2.0, 0.0, 0.0, 2.0]),
            (1000, [2.0; 4]),
        ];
        statistics(over, &pixels.map(|(n, of)| (n, of.map(|mean| mean + over))))
    };
    for over in [0.0, 7.0] {
        let lamps = value_of(over, 100, 60).fraction_of_lamps();
        let expected = 360.0 / 420.0 - 2.0 / 420.0_f64.sqrt();
        assert!((lamps - expected).abs() < 1e-9, "{lamps} over {over}");
        let excluded = [(100, 60), (100, 0), (30, 0), (0, 0)]
            .map(|(once, twice)| value_of(over, once, twice).excludes_lamps());
        assert_eq!(excluded, [false, true, false, false]);
        assert_eq!(value_of(over, 0, 0).fraction_of_lamps(), 0.0);
    }
}

/// Protects: brighter light needs more confirmation: 600 dim replicates with three times the
/// expected light, and 300 of a hundredfold brightness with none, weigh by the root of the
/// brightness. One replicate far brighter than its pixel's others counts four times the expected
/// light, not 270 times. Dark pixels give no information.
#[test]
fn bright_light_needs_more_to_vouch_for_it() {
    let lamps = |pixels: &[(usize, [f64; 4])]| statistics(0.0, pixels).fraction_of_lamps();
    let dim = (300, [1.0, 1.0, 0.0, 0.0]);
    assert!(lamps(&[dim, (100, [0.0, 1.0, 0.0, 0.0])]) > 0.9);
    assert!(lamps(&[dim, (100, [0.0, 100.0, 0.0, 0.0])]) < 0.45);
    assert!(lamps(&[(100, [0.0, 1.0, 0.0, 0.0]), (8, [1.0, 0.0, 0.0, 90.0])]) < 0.1);
    assert_eq!(lamps(&[(300, [0.25, 0.25, 0.0, 0.0])]), 0.0);
    assert!(lamps(&[(300, [0.35, 0.35, 0.0, 0.0])]) > 0.9);
}

/// Protects: a pixel lit once is weighted by the geometric mean of the averages of 1/(T² + δ²) for
/// gamma distributions of T with shapes 3/2 and 2 and scale m, its mean. With x = m/δ the first is
/// 1/m² times √(2πx) − 4 + … for large x (the second term is Γ(−1/2)/Γ(3/2)), approximated by
/// √(2πx) + 1. So the geometric mean is too large by the root of the ratio of the two, for an x of 1
/// to 10 by at most two fifths. For small x, 1/(1 + 2x) approximates the second, which is
/// 1 − 6x² + …: too small by a share of x for the geometric mean.
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
        let average = |shape: f64, norm: f64| {
            let mut sum = 0.0;
            for step in -30_000..5_000 {
                let t = (f64::from(step) / 1000.0).exp();
                let density = t.powf(shape) * (-t).exp() / norm / 1000.0;
                sum += density / (mean * mean * t * t + 0.01);
            }
            sum
        };
        let jeffreys = average(1.5, core::f64::consts::PI.sqrt() / 2.0);
        let even = average(2.0, 1.0);
        // Of four replicates one has all of the light.
        let lit = [0.0, 4.0 * mean, 0.0, 0.0].map(DVec3::splat);
        let over = mean / 0.1;
        let root = (core::f64::consts::TAU * over).sqrt();
        let ratio = (weight_of_small_lamp(lit).x / (jeffreys * even).sqrt()).ln();
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
    }
}

/// Protects: a black pixel was never lit, and has a finite weight.
#[test]
fn what_is_black_is_weighed_as_black() {
    assert_eq!(weight_of_small_lamp([DVec3::ZERO; 4]), DVec3::splat(100.0));
}

/// A uniform number below one, by an address.
fn share(address: u64) -> f64 {
    (splitmix64(splitmix64(address) ^ 0xA5A5) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Protects: claims hold for small lamps that cover any share of a pixel, for lamps that each pixel
/// hits with one sample of a thousand, and for both. The error is below the upper end in 95 of 100
/// pictures of small lamps, in 80 of 100 of rare light, where four pixels around each say how bright
/// it is, and between half and twice the claim.
#[test]
fn small_lamps_are_told_from_rare_light() {
    /// Share of a pixel that a lamp covers.
    type LampCoverage = fn(u64) -> f64;
    const FILMS: u64 = 60;
    const PIXELS: u64 = 2000;
    const SAMPLES: u64 = 16;
    let covered: [(&str, u64, LampCoverage); 4] = [
        ("any share", 95, share),
        ("small shares", 95, |pixel| share(pixel).powi(2) / 2.0),
        ("rare", 80, |_| 0.001),
        ("both", 95, |pixel| {
            if pixel.is_multiple_of(5) {
                share(pixel)
            } else {
                0.001
            }
        }),
    ];
    for (name, least, covered) in covered {
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
            let square = |(pixel, rgb): (u64, &[f32; 3])| {
                let truth = colour(covered(run * PIXELS + pixel));
                (f64::from(rgb[0]) - truth).powi(2) / (truth * truth + 0.01)
            };
            let error =
                ((0..).zip(&film.picture().rgb).map(square).sum::<f64>() / PIXELS as f64).sqrt();
            below += u64::from(error <= uncertainty.root_relmse.high);
            let ratio = error / uncertainty.root_relmse.value;
            assert!((0.5..=2.0).contains(&ratio), "{name}: {ratio}");
        }
        assert!(below * 100 >= FILMS * least, "{name}: {below}");
    }
}

/// Protects: a requested error is reached with small lamps, of which half were lit once.
#[test]
fn small_lamps_do_not_go_on() {
    let mut film = row(8, 65_536);
    add_samples(&mut film, |replicate, tile, _| {
        let lit = if tile >= 4 { 2 } else { 1 };
        f64::from(u8::from((replicate + tile) % 4 < lit))
    });
    assert_eq!(film.plan_next_round(2.0, &()), ErrorProgress::Reached);
}
