//! Thin-film interference: soap, oil, and the colours of tempered steel.
//!
//! The light that the film reflects is a series of terms, by the number of internal reflections.
//! Each term is averaged over the observer's response before it becomes a colour. The method is
//! that of Belcour and Barla ("A Practical Extension to Microfacet Theory for the Modeling of
//! Varying Iridescence", 2017).
//!
//! Unlike the paper, the series includes every term above a threshold, and a table of the
//! observer's curves replaces the paper's fits. The error against a sum over wavelengths is about
//! 0.001.

use super::layer_fields::layer;
use super::spectrum::film_coherence;
use crate::number::{Number, Vector3};

layer! {
    /// A thin film on the microfacets, which colours reflections by interference.
    ThinFilm
    /// Share of the surface under the film, 0 to 1.
    share: Share by eval_unit_number;
    /// Index of refraction of the film.
    ior: Constant by eval_constant;
    /// Thickness in nanometres.
    thickness: Thickness by eval_thickness;
}

/// Greatest number of terms in the series of internal reflections.
const TERMS: usize = 64;
/// Amplitude at which the series ends: smaller terms are ignored.
const LEAST_AMPLITUDE: f64 = 1e-5;

impl<N: Number> ThinFilm<N> {
    /// Returns the reflectance of microfacets, partly covered by the film, at a cosine of incidence
    /// in air. `bare` is their reflectance without the film at this cosine, `f0` without the film
    /// at normal incidence.
    pub(super) fn reflectance_with_film(&self, bare: N::Vec3, f0: N::Vec3, cosine: N) -> N::Vec3 {
        let filmed = N::Vec3::from_lanes(|lane| {
            let ior = N::f64_lane(self.ior, lane);
            thin_film_reflectance(
                cosine.lane(lane),
                ior,
                self.thickness.lane(lane),
                f0.lane(lane).to_array(),
            )
            .into()
        });
        bare * (N::ONE - self.share) + filmed * self.share
    }
}

/// Returns the amplitude reflection coefficients of a boundary for perpendicular and for parallel
/// polarisation. `here` and `beyond` are the indices on the incident and on the transmitted side.
/// `ci` and `ct` are the cosines of incidence and refraction.
fn fresnel_amplitudes([here, beyond]: [f64; 2], [ci, ct]: [f64; 2]) -> [f64; 2] {
    let across = (here * ci - beyond * ct) / (here * ci + beyond * ct).max(f64::MIN_POSITIVE);
    let along = (beyond * ci - here * ct) / (beyond * ci + here * ct).max(f64::MIN_POSITIVE);
    [across, along]
}

/// Returns the sums 1 + 2·Σ (−q)ᵐ·cos mφ, averaged over white light, by polarisation and channel,
/// for the products q of the amplitudes at both boundaries and an optical path. Divided by 1 − q²
/// each is 1/(1 + q² + 2q·cos φ). The coherence of a term is looked up once for all sums; a sum
/// that has ended adds zeros.
fn sum_interference(products: [[f64; 3]; 2], path: f64) -> [[f64; 3]; 2] {
    let (mut sums, mut powers) = ([[1.0; 3]; 2], [[1.0; 3]; 2]);
    for m in 1..=TERMS {
        let coherence = film_coherence(path * m as f64);
        let mut ended = true;
        for pole in 0..2 {
            for k in 0..3 {
                let power: f64 = powers[pole][k] * -products[pole][k];
                let goes_on = power.abs() >= LEAST_AMPLITUDE;
                powers[pole][k] = if goes_on { power } else { 0.0 };
                ended &= !goes_on;
                sums[pole][k] += 2.0 * powers[pole][k] * coherence[k];
            }
        }
        if ended {
            break;
        }
    }
    sums
}

/// Returns the reflectance in red, green and blue of a film between air and a base.
/// - `cosine`: cosine of incidence in air.
/// - `ior`, `thickness`: the film's index of refraction and thickness in nanometres.
/// - `f0`: the base's reflectance in air at normal incidence. The base counts as a dielectric of
///   this reflectance, as in KHR_materials_iridescence.
pub(super) fn thin_film_reflectance(
    cosine: f64,
    ior: f64,
    thickness: f64,
    f0: [f64; 3],
) -> [f64; 3] {
    let cosine = cosine.clamp(0.0, 1.0);
    let within = |index: f64| {
        (1.0 - (1.0 - cosine * cosine) / (index * index))
            .max(0.0)
            .sqrt()
    };
    let inside = within(ior);
    let path = 2.0 * ior * thickness.max(0.0) * inside;
    let first = fresnel_amplitudes([1.0, ior], [cosine, inside]);
    let base_amplitudes = |f0: f64| {
        let root = f0.clamp(0.0, 0.9999).sqrt();
        let base = (1.0 + root) / (1.0 - root);
        fresnel_amplitudes([ior, base], [inside, within(base)])
    };
    let red = base_amplitudes(f0[0]);
    let bases = if f0 == [f0[0]; 3] {
        [red; 3]
    } else {
        [red, base_amplitudes(f0[1]), base_amplitudes(f0[2])]
    };
    let products = [0, 1].map(|pole| bases.map(|second| first[pole] * second[pole]));
    let sums = sum_interference(products, path);
    let mut out = [0.0; 3];
    for (k, second) in bases.iter().enumerate() {
        for (pole, (a, b)) in first.iter().zip(second).enumerate() {
            let rest = 1.0 - products[pole][k] * products[pole][k];
            out[k] += if rest <= 0.0 {
                0.5
            } else {
                0.5 * (1.0 - (1.0 - a * a) * (1.0 - b * b) / rest * sums[pole][k])
            };
        }
    }
    out.map(|r| r.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::fresnel::fresnel_dielectric;
    use super::super::spectrum::tests::direct;
    use super::*;

    fn base(f0: f64) -> f64 {
        let root = f0.sqrt();
        (1.0 + root) / (1.0 - root)
    }

    /// Airy's sum of all reflections in a film at one wavelength, computed in complex numbers and
    /// averaged over both polarisations.
    fn airy(cosine: f64, ior: f64, thickness: f64, f0: f64, nanometres: f64) -> f64 {
        let within = |index: f64| (1.0 - (1.0 - cosine * cosine) / (index * index)).sqrt();
        let (inside, below) = (within(ior), within(base(f0)));
        let phase = core::f64::consts::TAU * 2.0 * ior * thickness * inside / nanometres;
        let (re, im) = (phase.cos(), phase.sin());
        let value_of = |a: f64, b: f64| {
            // (a + b·e)/(1 + a·b·e)
            let (nr, ni, dr, di) = (a + b * re, b * im, 1.0 + a * b * re, a * b * im);
            (nr * nr + ni * ni) / (dr * dr + di * di)
        };
        let across = |n: f64, ci: f64, m: f64, ct: f64| (n * ci - m * ct) / (n * ci + m * ct);
        let along = |n: f64, ci: f64, m: f64, ct: f64| (m * ci - n * ct) / (m * ci + n * ct);
        let b = base(f0);
        0.5 * (value_of(
            across(1.0, cosine, ior, inside),
            across(ior, inside, b, below),
        ) + value_of(
            along(1.0, cosine, ior, inside),
            along(ior, inside, b, below),
        ))
    }

    /// Protects: the series with the table equals Airy's sum at each of 350 wavelengths, from soap
    /// to films on metal, head-on to grazing.
    #[test]
    fn films_are_airys_sum_over_wavelengths() {
        let mut worst = 0.0_f64;
        for ior in [1.0, 1.2, 1.33, 1.8, 2.4] {
            for f0 in [0.0204, 0.04, 0.25, 0.9] {
                for thickness in [0.0, 5.0, 100.0, 280.0, 400.0, 650.0, 1200.0] {
                    for cosine in [1.0, 0.9, 0.6, 0.3, 0.1, 0.02] {
                        let requested =
                            direct(|nanometres| [airy(cosine, ior, thickness, f0, nanometres); 3]);
                        let found = thin_film_reflectance(cosine, ior, thickness, [f0; 3]);
                        let off = (0..3)
                            .map(|k| (found[k] - requested[k].clamp(0.0, 1.0)).abs())
                            .fold(0.0, f64::max);
                        worst = worst.max(off);
                        assert!(
                            off <= 2e-3,
                            "{ior}, {f0}, {thickness} nm at {cosine}: {found:?}, not {requested:?}"
                        );
                    }
                }
            }
        }
        assert!(worst > 1e-9, "they are two computations");
    }

    /// Protects: a channel has the same bits beside equal and beside other channels: a metal, whose
    /// series is long, and a base without reflection, whose series ends at once.
    #[test]
    fn channels_do_not_change_each_other() {
        for f0 in [
            [0.04; 3],
            [0.9, 0.9, 0.1],
            [0.0, 0.95, 0.3],
            [1.0, 0.02, 1.0],
        ] {
            for (ior, thickness, cosine) in [(1.33, 300.0, 0.8), (2.0, 650.0, 0.05)] {
                let together = thin_film_reflectance(cosine, ior, thickness, f0);
                for (k, &own) in f0.iter().enumerate() {
                    let alone = thin_film_reflectance(cosine, ior, thickness, [own; 3]);
                    assert_eq!(together[k].to_bits(), alone[k].to_bits(), "{f0:?}, {k}");
                }
            }
        }
    }

    /// Protects: a film of zero thickness has no effect, whatever its index: Fresnel's equations of
    /// the base remain.
    #[test]
    fn no_thickness_is_no_film() {
        for ior in [1.0, 1.3, 2.0] {
            for (f0, cosine) in [(0.04, 1.0), (0.04, 0.3), (0.5, 0.1), (0.2, 0.7)] {
                let b = base(f0);
                let below = (1.0 - (1.0 - cosine * cosine) / (b * b)).sqrt();
                let requested = fresnel_dielectric(cosine, Some(below), 1.0 / b);
                let found = thin_film_reflectance(cosine, ior, 0.0, [f0; 3]);
                assert!(
                    found.iter().all(|r| (r - requested).abs() < 1e-4),
                    "{ior}, {f0} at {cosine}: {found:?}, not {requested}"
                );
            }
        }
    }

    /// Protects: reflectance stays in [0, 1] for any input: no light, grazing angles, no film, an
    /// index of one, metal, infinite or NaN numbers.
    #[test]
    fn films_reflect_a_share() {
        for cosine in [-0.1, 0.0, 1e-9, 0.5, 1.0, 1.1, f64::NAN] {
            for ior in [1.0, 1.5, 3.0] {
                for thickness in [0.0, 1.0, 1e9, f64::INFINITY] {
                    for f0 in [0.0, 0.04, 1.0] {
                        let found = thin_film_reflectance(cosine, ior, thickness, [f0; 3]);
                        let sound = found.iter().all(|r| (0.0..=1.0).contains(r));
                        assert!(
                            sound || cosine.is_nan(),
                            "{cosine} {ior} {thickness} {f0}: {found:?}"
                        );
                    }
                }
            }
        }
    }
}
