//! Wavelengths for spectral effects: the colour of a wavelength, dispersion in glass, and
//! interference in thin films.

use std::sync::LazyLock;

/// First visible wavelength in nanometres.
const FIRST_WAVELENGTH: f64 = 380.0;
/// Number of visible wavelengths, in steps of one nanometre from [`FIRST_WAVELENGTH`].
const STEPS: usize = 350;

/// Wavelengths in nanometres of the Fraunhofer lines F, d and C, which define the index and the
/// Abbe number of a glass.
pub(crate) const FRAUNHOFER_LINES: [f64; 3] = [486.13, 587.56, 656.27];

/// Returns the standard observer's response to a wavelength in linear Rec. 709 red, green and blue.
/// Channels are negative outside the gamut. The response is a sum of Gaussians ("Simple Analytic
/// Approximations to the CIE XYZ Color Matching Functions", Wyman, Sloan, Shirley 2013).
fn observer_response(nanometres: f64) -> [f64; 3] {
    let lobe = |height: f64, centre: f64, [below, above]: [f64; 2]| {
        let t = (nanometres - centre) / if nanometres < centre { below } else { above };
        height * libm::exp(-0.5 * t * t)
    };
    let x = lobe(1.056, 599.8, [37.9, 31.0])
        + lobe(0.362, 442.0, [16.0, 26.7])
        + lobe(-0.065, 501.1, [20.4, 26.2]);
    let y = lobe(0.821, 568.8, [46.9, 40.5]) + lobe(0.286, 530.9, [16.3, 31.1]);
    let z = lobe(1.217, 437.0, [11.8, 36.0]) + lobe(0.681, 459.0, [26.0, 13.8]);
    [
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266_0 * x + 1.876_010_8 * y + 0.041_556_0 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    ]
}

/// Returns the wavelength in nanometres at the middle of a step of one nanometre.
fn step_wavelength(step: usize) -> f64 {
    FIRST_WAVELENGTH + step as f64 + 0.5
}

/// Response of the observer for each wavelength step and channel. Each channel sums to 1: a uniform
/// spectrum is white.
static OBSERVER_WEIGHTS: LazyLock<Vec<[f64; 3]>> =
    LazyLock::new(|| normalise_channels(|step| observer_response(step_wavelength(step))));

/// The responses of [`OBSERVER_WEIGHTS`] with negative channels set to zero: a path's weight must
/// not be negative. Each channel sums to 1.
static GAMUT_WEIGHTS: LazyLock<Vec<[f64; 3]>> = LazyLock::new(|| {
    normalise_channels(|step| observer_response(step_wavelength(step)).map(|c| c.max(0.0)))
});

/// Evaluates a function at every wavelength step, and scales each channel to the sum 1.
fn normalise_channels(value_of: impl Fn(usize) -> [f64; 3]) -> Vec<[f64; 3]> {
    let all: Vec<[f64; 3]> = (0..STEPS).map(value_of).collect();
    let sums = [0, 1, 2].map(|k| all.iter().map(|c| c[k]).sum::<f64>());
    all.into_iter()
        .map(|c| [0, 1, 2].map(|k| c[k] / sums[k]))
        .collect()
}

/// Cumulative probability of sampling a wavelength step or an earlier step. The probability of a
/// step is the mean of its channels in [`GAMUT_WEIGHTS`].
pub(super) static CUMULATIVE_PROBABILITY: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let mut sum = 0.0;
    let each = GAMUT_WEIGHTS.iter().map(|[r, g, b]| {
        sum += (r + g + b) / 3.0;
        sum
    });
    each.collect()
});

/// The single wavelength that a path carries from its first dispersive surface on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeroWavelength {
    /// The wavelength in nanometres.
    pub nanometres: f64,
    /// Factor on the path's throughput in red, green and blue. Its mean over all sampled
    /// wavelengths is white.
    pub weight: [f64; 3],
}

impl HeroWavelength {
    /// Samples a wavelength for a random number in [0, 1). The density is proportional to the
    /// observer's response; the weight is the response by channel over the density.
    pub fn sample(u: f64) -> Self {
        let chances = &*CUMULATIVE_PROBABILITY;
        let step = chances.partition_point(|&sum| sum <= u).min(STEPS - 1);
        let before = if step == 0 { 0.0 } else { chances[step - 1] };
        let (chance, shares) = (chances[step] - before, GAMUT_WEIGHTS[step]);
        let within = if chance > 0.0 {
            ((u - before) / chance).clamp(0.0, 1.0)
        } else {
            0.5
        };
        Self {
            nanometres: FIRST_WAVELENGTH + step as f64 + within,
            weight: shares.map(|share| if chance > 0.0 { share / chance } else { 0.0 }),
        }
    }
}

/// Returns the index of refraction at a wavelength in nanometres, at least 1, by Cauchy's equation
/// with two terms. `ior` is the index at the Fraunhofer line d, and `dispersion` is 20 over the
/// Abbe number.
pub(crate) fn ior_at_wavelength(ior: f64, dispersion: f64, nanometres: f64) -> f64 {
    let per = |wavelength: f64| 1.0 / (wavelength * wavelength);
    let [f, d, c] = FRAUNHOFER_LINES.map(per);
    (ior + (ior - 1.0) * dispersion / 20.0 * (per(nanometres) - d) / (f - c)).max(1.0)
}

/// Step of the table [`COHERENCE`], in nanometres of optical path.
const COHERENCE_STEP: f64 = 4.0;
/// Number of entries of the table [`COHERENCE`].
const ENTRIES: usize = 3000;

/// Mean over white light of cos(2π·p/λ) by channel, for the optical path p in steps of
/// [`COHERENCE_STEP`] and the wavelength λ.
pub(super) static COHERENCE: LazyLock<Vec<[f64; 3]>> = LazyLock::new(|| {
    let mut table = vec![[0.0; 3]; ENTRIES];
    for (step, shares) in OBSERVER_WEIGHTS.iter().enumerate() {
        // cos((n + 1)·a) = 2·cos(a)·cos(n·a) − cos((n − 1)·a).
        let once = libm::cos(core::f64::consts::TAU * COHERENCE_STEP / step_wavelength(step));
        let (mut before, mut here) = (once, 1.0);
        for entry in &mut table {
            for k in 0..3 {
                entry[k] += shares[k] * here;
            }
            (before, here) = (here, 2.0 * once * here - before);
        }
    }
    table
});

/// Returns the mean over white light of cos(2π·path/λ) by channel. `path` is an optical path in
/// nanometres, λ the wavelength. The mean is 1 at a path of zero, where all wavelengths are in
/// phase, and falls to 0 for long paths.
pub(super) fn film_coherence(path: f64) -> [f64; 3] {
    let at = path / COHERENCE_STEP;
    if at.is_nan() || at >= (ENTRIES - 1) as f64 {
        return [0.0; 3];
    }
    let (below, share) = (at as usize, at - (at as usize) as f64);
    let [a, b] = [COHERENCE[below], COHERENCE[below + 1]];
    [0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * share)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Mean over white light of a quantity by wavelength, summed directly.
    pub fn direct(value_of: impl Fn(f64) -> [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (step, shares) in OBSERVER_WEIGHTS.iter().enumerate() {
            let found = value_of(step_wavelength(step));
            (0..3).for_each(|k| sum[k] += shares[k] * found[k]);
        }
        sum
    }

    /// Protects: paths of all wavelengths are white in the mean, exactly so for finely stratified
    /// samples, and every visible wavelength occurs.
    #[test]
    fn wavelengths_together_are_white() {
        const COUNT: usize = 200_000;
        let (mut sum, mut minimum, mut maximum) = ([0.0; 3], f64::INFINITY, 0.0_f64);
        for i in 0..COUNT {
            let hero = HeroWavelength::sample((i as f64 + 0.5) / COUNT as f64);
            assert!(
                hero.weight.iter().all(|w| (0.0..=3.0 + 1e-12).contains(w)),
                "{hero:?}"
            );
            (0..3).for_each(|k| sum[k] += hero.weight[k] / COUNT as f64);
            (minimum, maximum) = (minimum.min(hero.nanometres), maximum.max(hero.nanometres));
        }
        assert!(sum.iter().all(|mean| (mean - 1.0).abs() < 1e-3), "{sum:?}");
        assert!(
            (380.0..400.0).contains(&minimum) && (680.0..=730.0).contains(&maximum),
            "{minimum} to {maximum}"
        );
        for end in [0.0, 1.0 - f64::EPSILON / 2.0] {
            assert!((380.0..=730.0).contains(&HeroWavelength::sample(end).nanometres));
        }
        // Violet and blue, green, and red have their colours.
        let strongest = |u: f64| {
            let HeroWavelength { weight, .. } = HeroWavelength::sample(u);
            (0..3)
                .max_by(|&a, &b| weight[a].total_cmp(&weight[b]))
                .expect("three")
        };
        assert_eq!([strongest(0.1), strongest(0.5), strongest(0.95)], [2, 1, 0]);
    }

    /// Protects: Cauchy's indices equal those by hand: the Abbe number is (n_d − 1)/(n_F − n_C),
    /// for glass of 1.5 and 20, and without dispersion.
    #[test]
    fn indices_by_the_abbe_number() {
        let [f, d, c] = FRAUNHOFER_LINES.map(|line| ior_at_wavelength(1.5, 1.0, line));
        assert!(
            (d - 1.5).abs() < 1e-12 && (0.5 / (f - c) - 20.0).abs() < 1e-9,
            "{f} {d} {c}"
        );
        // B = 0.5/20/(1/0.48613² − 1/0.65627²) μm² = 0.013 094 7, A = 1.5 − B/0.58756² = 1.462 069.
        assert!(
            (ior_at_wavelength(1.5, 1.0, 400.0) - (1.462_069 + 0.013_094_7 / 0.16)).abs() < 2e-5
        );
        assert_eq!(ior_at_wavelength(1.5, 0.0, 400.0), 1.5);
        assert_eq!(ior_at_wavelength(1.0, 5.0, 700.0), 1.0);
        assert!(ior_at_wavelength(1.01, 400.0, 730.0) >= 1.0);
    }

    /// Protects: the table of coherence equals the sum over wavelengths.
    #[test]
    fn coherence_is_the_mean_of_cosines() {
        assert!(film_coherence(0.0).iter().all(|c| (c - 1.0).abs() < 1e-9));
        assert_eq!(
            (film_coherence(1e9), film_coherence(f64::NAN)),
            ([0.0; 3], [0.0; 3])
        );
        for path in [1.0, 37.0, 250.0, 551.3, 999.0, 2750.5, 5000.0, 11_000.0] {
            let requested =
                direct(|nanometres| [libm::cos(core::f64::consts::TAU * path / nanometres); 3]);
            let found = film_coherence(path);
            assert!(
                (0..3).all(|k| (found[k] - requested[k]).abs() < 1e-3),
                "{path}: {found:?}, not {requested:?}"
            );
        }
    }
}
