//! Error of noise by the number of samples, from the claims of whole pictures: the errors that
//! `render` states for them.
//!
//! A picture of n samples consists of R independent replicates of k = n/R samples each. Its squared
//! error is V(k)/R, where V is the squared error of a replicate. So a picture of four replicates
//! also tells the errors of pictures with a quarter of its samples.

use super::estimate::{ConfidenceInterval, RESOLUTION};
use crate::film::{ErrorEstimate, EstimateDoubt, Uncertainty};
use crate::settings::default_replicates;

/// Exponent of the law V(k) = b/kᵖ from one number of samples to another, and its standard error:
/// independent samples have 1, stratified ones more where pictures are smooth. From 1 to 64 samples
/// Cornell's box had 1.03 to 1.12 and a room behind a slit .95 to 1.06
/// (`benches/runs/2026-12-01-advice.md`).
const EXPONENT: f64 = 1.05;
const EXPONENT_ERROR: f64 = 0.12;
/// By how much more the exponent may be beyond the most samples of a claim: soft light fell with 1.53 from
/// 64 to 1024 samples of a model (`benches/runs/2026-12-01-advice.md`).
const FASTER: f64 = 0.25;
/// Variance of the logarithm of an error that a single pixel carries, from seed to seed. Of n squares
/// of normal numbers it is 0.5/n; errors of pixels have longer tails: twice that held
/// (`benches/runs/2026-12-01-claims.md`).
const TAIL: f64 = 1.0;
/// Share of an error, at most of .6, by which a claim may be too high: in a picture that is mostly noise,
/// so are the colours that errors are relative to. 16 samples of the preset depth-of-field claimed .75,
/// and forty pictures had .61 (`benches/runs/2026-12-01-advice.md`).
const EXCESS: f64 = 0.4;

/// Claim of a whole picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Claim {
    /// Samples per pixel.
    pub samples: u32,
    /// Number of replicates.
    pub replicates: u32,
    /// Claimed root relMSE.
    pub error: ErrorEstimate,
    pub doubt: Option<EstimateDoubt>,
}

impl Claim {
    /// Returns the claim of a picture.
    pub fn from_uncertainty(samples: u32, of: &Uncertainty) -> Self {
        Self {
            samples,
            replicates: of.replicates,
            error: of.root_relmse,
            doubt: of.doubt,
        }
    }

    /// Returns what pictures of one setting with different seeds claim together; `None` without a claim.
    /// They tell the mean of their squares. What they differ by adds to what another picture may differ
    /// by, as fewer carriers would. A doubt of one is a doubt of all.
    pub fn pool(claims: &[Self]) -> Option<Self> {
        let is_doubted =
            |claim: &&Self| !matches!(claim.doubt, None | Some(EstimateDoubt::FewSamples));
        let first = claims.iter().find(is_doubted).or(claims.first())?;
        let count = claims.len() as f64;
        let mean = |value: &dyn Fn(&ErrorEstimate) -> f64| {
            claims.iter().map(|claim| value(&claim.error)).sum::<f64>() / count
        };
        let square = mean(&|of| of.value * of.value);
        if count == 1.0 || square == 0.0 || is_doubted(&first) {
            return Some(*first);
        }
        let share = |of: &ErrorEstimate| of.value * of.value / square;
        let variance = |of: &ErrorEstimate| {
            let ErrorEstimate {
                value, low, high, ..
            } = *of;
            ConfidenceInterval { value, low, high }
                .logarithmic_error()
                .powi(2)
        };
        let sigma = (mean(&|of| share(of).powi(2) * variance(of)) / count).sqrt();
        let between = mean(&|of| (share(of) - 1.0).powi(2)) * count / (count - 1.0) / 4.0;
        let of_carriers = mean(&|of| share(of).powi(2) / of.carriers);
        let ConfidenceInterval { value, low, high } =
            ConfidenceInterval::from_logarithm(square.sqrt(), sigma);
        Some(Self {
            error: ErrorEstimate {
                value,
                low,
                high,
                carriers: 1.0 / ((1.0 + 1.0 / count) * of_carriers.max(between / TAIL)),
            },
            ..*first
        })
    }

    fn samples_of_replicate(&self) -> f64 {
        f64::from(self.samples) / f64::from(self.replicates)
    }

    /// Returns V for another number of samples, as this claim tells it, with the standard error of its
    /// logarithm.
    fn square_of_replicate(&self, samples: f64) -> (f64, f64) {
        let ratio = samples / self.samples_of_replicate();
        let square = self.square();
        let value = square.value * f64::from(self.replicates) * libm::pow(ratio, -EXPONENT);
        let distance = EXPONENT_ERROR * libm::log(ratio);
        (value, libm::hypot(square.logarithmic_error(), distance))
    }

    /// Returns the squared error of a picture with another seed. The fewer pixels carry the error, the
    /// more does it differ from the claimed one.
    /// A picture that is not converged may lack light, so that its error has no upper end.
    pub fn square(&self) -> ConfidenceInterval {
        let ErrorEstimate {
            value,
            low,
            high,
            carriers,
        } = self.error;
        if high == 0.0 {
            return ConfidenceInterval::from_exact(0.0);
        }
        let claim = ConfidenceInterval { value, low, high };
        let seed = libm::hypot(RESOLUTION, (TAIL / carriers).sqrt());
        let sigma = libm::hypot(claim.logarithmic_error(), seed);
        let claim = match self.doubt {
            Some(EstimateDoubt::NearlyBlack) => ConfidenceInterval::UNKNOWN,
            None | Some(EstimateDoubt::FewSamples) => {
                let claim = ConfidenceInterval::from_logarithm(value, sigma);
                let low = claim.low / (1.0 + EXCESS * value.min(0.6));
                ConfidenceInterval { low, ..claim }
            }
            Some(_) => ConfidenceInterval {
                high: f64::INFINITY,
                ..claim
            },
        };
        claim.map(|error| error * error)
    }
}

/// Squared error of noise for every number of samples.
#[derive(Clone, Debug)]
pub(super) struct NoiseCurve {
    claims: Vec<Claim>,
}

impl NoiseCurve {
    /// Returns the curve through claims of one setting; `None` without a claim.
    pub fn new(claims: Vec<Claim>) -> Option<Self> {
        (!claims.is_empty()).then_some(Self { claims })
    }

    /// Returns the squared error of noise of a picture with this number of samples per pixel: its own
    /// claim, unless larger pictures show that it missed light. The interval contains what the claim of
    /// this or the nearest number tells, since most pictures of few samples miss rare light.
    pub fn square(&self, samples: u32) -> ConfidenceInterval {
        let scale = 1.0 / f64::from(default_replicates(samples));
        let replicate = f64::from(samples) * scale;
        let square = scale * self.falling_square(replicate);
        let own = self.own_claim(replicate);
        let own = own.filter(|claim| claim.samples == samples);
        let own = own.map(Claim::square);
        if let Some(own) = own.filter(|own| own.value >= square * (1.0 - 1e-9)) {
            return own;
        }
        let (told, error) = self.told_square(replicate);
        if square == 0.0 {
            return ConfidenceInterval::from_exact(0.0);
        }
        let interval = ConfidenceInterval::from_logarithm(square, error);
        let most = self.claims.iter().map(Claim::samples_of_replicate);
        let beyond = (replicate / most.fold(0.0, f64::max)).max(1.0);
        ConfidenceInterval {
            low: interval.low.min(scale * told) * libm::pow(beyond, -FASTER),
            high: interval.high.max(scale * told),
            ..interval
        }
    }

    /// Returns V for a number of samples, with the standard error of its logarithm: of the picture's own
    /// claim, or of the one that knows it best. Claims in doubt count where no other is.
    fn told_square(&self, samples: f64) -> (f64, f64) {
        let of = |claim: &Claim| claim.square_of_replicate(samples);
        let best = || {
            self.claims
                .iter()
                .map(of)
                .min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let told = self.own_claim(samples).map(of).or_else(best);
        told.unwrap_or((0.0, f64::INFINITY))
    }

    /// Returns the known claim of a picture with this number of samples in a replicate, divided into
    /// replicates as `render` divides it.
    fn own_claim(&self, samples: f64) -> Option<&Claim> {
        self.claims.iter().find(|claim| {
            claim.replicates == default_replicates(claim.samples)
                && claim.samples_of_replicate() == samples
                && claim.square().map(f64::sqrt).is_known()
        })
    }

    /// Returns the ratio of the squared errors of two numbers of samples, which is known better than
    /// either. Where one of them is not known, no picture has the ratio of the law: errors of 16 samples
    /// of lamps of a pixel differed by a factor of 3 from seed to seed
    /// (`benches/runs/2026-12-01-claims.md`).
    pub fn ratio(&self, samples: u32, other: u32) -> ConfidenceInterval {
        if samples == other {
            return ConfidenceInterval::from_exact(1.0);
        }
        let squares = [samples, other].map(|samples| self.square(samples));
        if !squares.iter().all(|of| of.map(f64::sqrt).is_known()) {
            return ConfidenceInterval::UNKNOWN;
        }
        let [above, below] = squares.map(|square| square.value);
        let distance = libm::log(f64::from(samples) / f64::from(other)).abs();
        ConfidenceInterval::from_logarithm(above / below, EXPONENT_ERROR * distance)
    }

    /// Returns V for a number of samples. It falls at least as the inverse of the samples: a claim of
    /// few samples may have missed rare light that more samples found.
    fn falling_square(&self, samples: f64) -> f64 {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for claim in &self.claims {
            let samples = claim.samples_of_replicate();
            points.push((samples, self.told_square(samples).0));
        }
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        for i in (1..points.len()).rev() {
            let least = points[i].1 * points[i].0 / points[i - 1].0;
            points[i - 1].1 = points[i - 1].1.max(least);
        }
        let after = points.partition_point(|point| point.0 < samples);
        let place = after.clamp(1, points.len()) - 1;
        let from = points[if samples < points[0].0 { 0 } else { place }];
        let exponent = match points.get(place + 1) {
            Some(next) if samples > from.0 => {
                libm::log(from.1 / next.1) / libm::log(next.0 / from.0)
            }
            _ => EXPONENT,
        };
        if from.1 == 0.0 {
            return 0.0;
        }
        from.1 * libm::pow(from.0 / samples, exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(samples: u32, value: f64) -> Claim {
        Claim {
            samples,
            replicates: 4,
            error: ErrorEstimate {
                value,
                low: 0.95 * value,
                high: 1.05 * value,
                carriers: 1e4,
            },
            doubt: None,
        }
    }

    /// Protects: claims that fall as 1/√n give errors that do, within the exponent that is assumed, and
    /// the claim of a picture is its error, in an interval of its own width and that of other seeds. A
    /// picture of 16 samples in four replicates tells the error of one replicate of 4.
    #[test]
    fn the_curve_is_that_of_the_samples() {
        let curve = NoiseCurve::new(vec![claim(16, 0.2), claim(64, 0.1)]).expect("claims");
        for (samples, expected) in [(1, 0.8), (4, 0.4), (16, 0.2), (64, 0.1), (256, 0.05)] {
            let square = curve.square(samples).map(f64::sqrt);
            assert!(
                (square.value / expected - 1.0).abs() < 0.08,
                "{samples}: {square:?}"
            );
            assert!(square.low < expected && expected < square.high);
        }
        let own = curve.square(64).map(f64::sqrt);
        assert!(
            (own.value - 0.1).abs() < 1e-12 && (own.high - 0.108).abs() < 1e-3,
            "{own:?}"
        );
        assert!((curve.ratio(256, 64).value - 0.25).abs() < 0.04);
        let one = NoiseCurve::new(vec![claim(16, 0.2)]).expect("a claim");
        assert!((one.square(4).value.sqrt() - 0.4).abs() < 1e-9);
        // Soft light falls with 1.5.
        let clean = 0.2 * 16_f64.powf(-0.75);
        assert!(one.square(256).low.sqrt() < clean, "{:?}", one.square(256));
    }

    /// Protects: the error of a picture that a few pixels carry is not known, nor that of other numbers
    /// of samples which follows from it: in a room with a lamp of 3 cm, errors of 16 samples were .70
    /// to 1.57, of 4 samples .27 to 4.5. Of a thousand pixels it is known as the claim is.
    #[test]
    fn few_pixels_tell_little() {
        let carried = |carriers: f64| {
            let mut claim = claim(16, 0.5);
            claim.error.carriers = carriers;
            NoiseCurve::new(vec![claim]).expect("a claim")
        };
        for samples in [4, 16, 64] {
            let error = |carriers: f64| carried(carriers).square(samples).map(f64::sqrt);
            assert!(!error(2.0).is_known() && error(1e3).is_known(), "{samples}");
        }
        let error = carried(2.0).square(16).map(f64::sqrt);
        assert!(error.low < 0.27 && error.high > 1.25, "{error:?}");
    }

    /// Protects: the interval of a picture that is mostly noise holds an error a fifth below its claim; that
    /// of a clean picture is as narrow as its claim.
    #[test]
    fn claims_of_noise_may_be_too_high() {
        let low = |value: f64| claim(16, value).square().low.sqrt() / value;
        assert!(low(0.75) < 0.81 && low(0.75) > 0.7, "{}", low(0.75));
        assert!(low(0.01) > 0.9, "{}", low(0.01));
    }

    /// Protects: two pictures of a setting tell the mean of their squares, in an interval that holds what
    /// they differ by; where they agree it is as narrow as of one. Of a doubted one nothing is known.
    #[test]
    fn two_pictures_tell_how_errors_differ() {
        let pool = |claims: &[Claim]| {
            let pooled = Claim::pool(claims).expect("claims").square();
            pooled.map(f64::sqrt)
        };
        let one = pool(&[claim(16, 0.2)]);
        let equal = pool(&[claim(16, 0.2), claim(16, 0.2)]);
        assert!(
            (equal.value - 0.2).abs() < 1e-12 && equal.high <= one.high,
            "{equal:?}"
        );
        let apart = pool(&[claim(16, 0.18), claim(16, 0.22)]);
        assert!((apart.value - 0.0404_f64.sqrt()).abs() < 1e-12);
        assert!(
            apart.low < 0.18 && apart.high > 0.22 && apart.is_known(),
            "{apart:?}"
        );
        assert!(!pool(&[claim(16, 0.1), claim(16, 0.3)]).is_known());
        let doubted = Claim {
            doubt: Some(EstimateDoubt::FewPixels),
            ..claim(16, 0.2)
        };
        assert!(!pool(&[claim(16, 0.2), doubted]).is_known());
        assert!(Claim::pool(&[]).is_none());
    }

    /// Protects: more samples are never told worse, whatever a picture of few samples missed, and a
    /// doubted claim is less certain.
    #[test]
    fn more_samples_are_never_worse() {
        for few in [0.05, 0.1, 0.3, 2.0] {
            let curve = NoiseCurve::new(vec![claim(4, few), claim(16, 0.5 * few), claim(64, 0.1)]);
            let curve = curve.expect("claims");
            let errors = [1, 4, 16, 64, 256, 1024].map(|samples| curve.square(samples).value);
            assert!(errors.is_sorted_by(|a, b| a > b), "{few}: {errors:?}");
        }
        let missed = NoiseCurve::new(vec![claim(4, 0.05), claim(64, 0.1)]).expect("claims");
        assert!(!missed.square(1).map(f64::sqrt).is_known());
        let known = |doubt: EstimateDoubt| {
            let doubted = Claim {
                doubt: Some(doubt),
                ..claim(64, 0.1)
            };
            let curve = NoiseCurve::new(vec![doubted]).expect("a claim");
            let known = curve.square(64).map(f64::sqrt).is_known();
            assert_eq!(curve.ratio(256, 64).is_known(), known, "{doubt:?}");
            known
        };
        for doubt in [
            EstimateDoubt::LightByChance,
            EstimateDoubt::FewPixels,
            EstimateDoubt::WideInterval,
            EstimateDoubt::NearlyBlack,
        ] {
            assert!(!known(doubt), "{doubt:?}");
        }
        assert!(known(EstimateDoubt::FewSamples));
    }
}
