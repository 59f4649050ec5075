//! Numerically hard cases S13, S14, S15: Fresnel reflectance from normal to grazing incidence, and
//! between media of nearly equal refractive index.

use raywright_bvh::stability::prelude::*;

use crate::material::{SmoothInterface, fresnel_dielectric};

/// Returns the smooth interface that a ray meets on a horizontal boundary from above. `cosine` is
/// the cosine of the angle of incidence, `eta` the relative index of refraction.
fn interface_at_cosine(cosine: f64, eta: f64) -> SmoothInterface {
    SmoothInterface::new(
        DVec3::new(
            ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt(),
            -cosine,
            0.0,
        ),
        DVec3::Y,
        eta,
    )
}

/// Returns the unpolarised Fresnel reflectance, computed without cancellation; `None` under total
/// reflection. A difference of two cosines is computed as the difference of their squares divided
/// by their sum.
fn accurate_reflectance(cosine: f64, eta: f64) -> Option<f64> {
    let sine2 = (1.0 - cosine) * (1.0 + cosine);
    let beyond2 = 1.0 - eta * eta * sine2;
    if beyond2 < 0.0 {
        return None;
    }
    let beyond = beyond2.sqrt();
    // cos − cos′ = (η − 1)(η + 1)·sin²/(cos + cos′).
    let difference = (eta - 1.0) * (eta + 1.0) * sine2 / (cosine + beyond).max(f64::MIN_POSITIVE);
    let across = ((eta - 1.0) * cosine + difference) / (eta * cosine + beyond);
    let along = ((eta - 1.0) * beyond - difference) / (eta * beyond + cosine);
    Some(0.5 * (across * across + along * along))
}

/// Draws a cosine of incidence: uniform, near 0, near 1, or a special value.
fn draw_cosine(rng: &mut CaseRng) -> f64 {
    match rng.next_bits() % 4 {
        0 => rng.next_in_unit_interval(),
        1 => 10_f64.powf(rng.next_uniform(-8.0, 0.0)),
        2 => 1.0 - 10_f64.powf(rng.next_uniform(-8.0, 0.0)),
        _ => rng.choose(&[1.0, 0.5, 1e-4, 1e-6, 1.0 - UNIT_ROUNDOFF]),
    }
}

/// Draws a ratio of indices from a list, or its inverse.
fn draw_ratio(rng: &mut CaseRng, ratios: &[f64]) -> f64 {
    let ratio = rng.choose(ratios);
    rng.choose(&[ratio, 1.0 / ratio])
}

/// Judges a reflectance, which lies in [0, 1], by its error.
fn judge_reflectance(found: f64, expected: f64, bound: f64, [cosine, eta]: [f64; 2]) -> Verdict {
    let label = || {
        format!(
            "reflectance {found} instead of {expected} at the cosine with bits {:016x} and the ratio of indices {eta}",
            cosine.to_bits()
        )
    };
    Verdict::from_error((found - expected).abs(), bound, label)
        .and_then(|| Verdict::from_condition((0.0..=1.0).contains(&found), label))
}

/// Judges case S13: reflectance between media with a relative index of exactly or nearly one. The
/// textbook's formula is Schlick's approximation, which approaches one at grazing angles for any
/// indices.
pub(super) fn matched_indices<R: Real>(trial: &mut Trial<R>) {
    trial.judge("", (411, 200_000), |rng| {
        let eta = draw_ratio(rng, &[1.0, 1.0003, 1.0 + 1e-6]);
        let cosine = draw_cosine(rng);
        let expected = accurate_reflectance(cosine, eta).unwrap_or(1.0);
        let interface = interface_at_cosine(cosine, eta);
        [interface.fresnel(), interface.schlick(cosine)]
            .map(|found| judge_reflectance(found, expected, 1e-6, [cosine, eta]))
    });
    trial.judge("straight", (412, 50_000), |rng| {
        let (d, n) = (rng.sample_direction(), rng.sample_direction());
        let n = n * -d.dot(n).signum();
        let refracted = SmoothInterface::new(d, n, 1.0).refracted;
        let off = refracted.map_or(f64::INFINITY, |v| (v - d).abs().max_element());
        [Verdict::from_error(off, 4.0 * UNIT_ROUNDOFF, || {
            format!("refraction of {d} at {n}")
        })]
    });
}

/// Judges case S14: the relative error of the Fresnel reflectance of glasses and diamond, from
/// outside and from inside.
pub(super) fn fresnel<R: Real>(trial: &mut Trial<R>) {
    trial.judge("", (413, 400_000), |rng| {
        let eta = draw_ratio(rng, &[1.333, 1.5, 1.7, 2.42]);
        let cosine = if rng.next_bits().is_multiple_of(50) {
            rng.choose(&[0.0, -0.0, 1.0, 1.0 + 2.0 * UNIT_ROUNDOFF])
        } else {
            draw_cosine(rng)
        };
        let beyond2 = 1.0 - eta * eta * (1.0 - cosine) * (1.0 + cosine);
        let beyond = (beyond2 >= 0.0).then(|| beyond2.sqrt());
        let found = fresnel_dielectric(cosine, beyond, eta);
        let expected = accurate_reflectance(cosine.clamp(0.0, 1.0), eta).unwrap_or(1.0);
        // Transmittance by the amplitudes of both polarisations, the complement of the reflectance.
        let through = if beyond2 > 0.0 && cosine > 0.0 && cosine <= 1.0 {
            let (c, b) = (cosine, beyond2.sqrt());
            let [across, along] = [2.0 * eta * c / (eta * c + b), 2.0 * eta * c / (eta * b + c)];
            0.5 * (across * across + along * along) * b / (eta * c)
        } else {
            1.0 - found
        };
        [
            judge_reflectance(found, expected, 1e-6 * expected, [cosine, eta])
                .and_then(|| judge_reflectance(found, 1.0 - through, 1e-6, [cosine, eta])),
        ]
    });
}

/// Judges case S15: the difference between Schlick's approximation and the Fresnel equations. It
/// must not exceed its known maximum. For a ray from inside, the cosine is taken in the thinner
/// medium; the textbook takes that inside.
pub(super) fn schlick<R: Real>(trial: &mut Trial<R>) {
    trial.judge("", (414, 40_000), |rng| {
        let (ior, maximum) = rng.choose(&[(1.333, 0.059), (1.5, 0.036), (2.42, 0.076)]);
        let outside = rng.next_in_unit_interval();
        let expected = accurate_reflectance(outside, 1.0 / ior).unwrap_or(1.0);
        // Cosine of the same ray in the reverse direction.
        let inside = (1.0 - (1.0 - outside) * (1.0 + outside) / (ior * ior)).sqrt();
        let within = interface_at_cosine(inside, ior);
        let judge = |found, eta| judge_reflectance(found, expected, maximum + 5e-4, [outside, eta]);
        let from_outside = interface_at_cosine(outside, 1.0 / ior).schlick(outside);
        let own = judge(from_outside, 1.0 / ior).and_then(|| judge(within.schlick(outside), ior));
        [own, judge(within.schlick(inside), ior)]
    });
}
