//! Numerically hard cases S13, S14, S15: Fresnel reflectance from normal to grazing incidence, and
//! between media of nearly equal refractive index.

use glam::DVec3;
use raywright_bvh::stability::Measurement;
use raywright_bvh::stability::verdicts::{
    CaseOutcome, CaseRng, RayCount, UNIT_ROUNDOFF, Verdict, judge_rays,
};

use crate::material::{SmoothInterface, fresnel_dielectric};

/// Returns the measurements of the precisions `robust` and `reference`. They are equal, because the
/// computation always uses f64. Each is paired with the result of the textbook formula.
fn precision_independent_measurements(
    outcome: &CaseOutcome,
    textbook: Option<&CaseOutcome>,
) -> Vec<Measurement> {
    let value_of = |setting: &str| Measurement {
        setting: setting.to_owned(),
        outcome: outcome.clone(),
        textbook: textbook.cloned(),
    };
    vec![value_of("robust"), value_of("reference")]
}

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

/// Measures case S13: reflectance between media with a relative index of exactly or nearly one.
pub fn measure_matched_indices(rays: RayCount) -> Vec<Measurement> {
    let drawn = |rng: &mut CaseRng| {
        let ratio = rng.choose(&[1.0, 1.0003, 1.0 + 1e-6]);
        (
            draw_cosine(rng),
            if rng.next_sign() > 0.0 {
                ratio
            } else {
                1.0 / ratio
            },
        )
    };
    let describe = |cosine: f64, eta: f64| {
        format!(
            "reflectance at the cosine with bits {:016x} and the ratio of indices {eta}",
            cosine.to_bits()
        )
    };
    let judged = |f: &(dyn Fn(f64, f64) -> f64 + Sync)| {
        judge_rays("S13", 411, 200_000, rays, |rng| {
            let (cosine, eta) = drawn(rng);
            let (found, requested) = (
                f(cosine, eta),
                accurate_reflectance(cosine, eta).unwrap_or(1.0),
            );
            Verdict::from_error((found - requested).abs(), 1e-6, || describe(cosine, eta)).and_then(
                || Verdict::from_condition((0.0..=1.0).contains(&found), || describe(cosine, eta)),
            )
        })
    };
    let straight = judge_rays("S13 straight", 412, 50_000, rays, |rng| {
        let (d, n) = (rng.sample_direction(), rng.sample_direction());
        let n = if d.dot(n) < 0.0 { n } else { -n };
        let off = SmoothInterface::new(d, n, 1.0)
            .refracted
            .map_or(f64::INFINITY, |refracted| {
                (refracted - d).abs().max_element()
            });
        Verdict::from_error(off, 4.0 * UNIT_ROUNDOFF, || format!("{d} at {n}"))
    });
    // Schlick's approximation approaches one at grazing angles for any indices.
    let textbook = judged(&|cosine, eta| interface_at_cosine(cosine, eta).schlick(cosine));
    precision_independent_measurements(
        &judged(&|cosine, eta| interface_at_cosine(cosine, eta).fresnel()).merge(straight),
        Some(&textbook),
    )
}

/// Measures case S14: the relative error of the Fresnel reflectance of glasses and diamond, from
/// outside and from inside.
pub fn measure_fresnel(rays: RayCount) -> Vec<Measurement> {
    let outcome = judge_rays("S14", 413, 400_000, rays, |rng| {
        let ior = rng.choose(&[1.333, 1.5, 1.7, 2.42]);
        let eta = if rng.next_sign() > 0.0 {
            ior
        } else {
            1.0 / ior
        };
        let cosine = if rng.next_bits().is_multiple_of(50) {
            rng.choose(&[0.0, -0.0, 1.0, 1.0 + 2.0 * UNIT_ROUNDOFF])
        } else {
            draw_cosine(rng)
        };
        let beyond2 = 1.0 - eta * eta * (1.0 - cosine) * (1.0 + cosine);
        let found = fresnel_dielectric(cosine, (beyond2 >= 0.0).then(|| beyond2.sqrt()), eta);
        let requested = accurate_reflectance(cosine.clamp(0.0, 1.0), eta).unwrap_or(1.0);
        let describe = || {
            format!(
                "reflectance at the cosine with bits {:016x} and the ratio of indices {eta}, {found} instead of {requested}",
                cosine.to_bits()
            )
        };
        // Transmittance by the amplitudes of both polarisations, the complement of the reflectance.
        let through = if beyond2 > 0.0 && cosine > 0.0 && cosine <= 1.0 {
            let (c, b) = (cosine, beyond2.sqrt());
            let [across, along] = [2.0 * eta * c / (eta * c + b), 2.0 * eta * c / (eta * b + c)];
            0.5 * (across * across + along * along) * b / (eta * c)
        } else {
            1.0 - found
        };
        Verdict::from_error((found - requested).abs(), 1e-6 * requested, describe)
            .and_then(|| Verdict::from_condition((0.0..=1.0).contains(&found), describe))
            .and_then(|| Verdict::from_error((found + through - 1.0).abs(), 1e-6, describe))
    });
    precision_independent_measurements(&outcome, None)
}

/// Measures case S15: the difference between Schlick's approximation and the Fresnel equations. It
/// must not exceed its known maximum. For a ray from inside, the cosine is taken in the thinner
/// medium.
pub fn measure_schlick(rays: RayCount) -> Vec<Measurement> {
    let outcome = judge_rays("S15", 414, 40_000, rays, |rng| {
        let (ior, maximum) = rng.choose(&[(1.333, 0.059), (1.5, 0.036), (2.42, 0.076)]);
        let outside = rng.next_in_unit_interval();
        let requested = accurate_reflectance(outside, 1.0 / ior).unwrap_or(1.0);
        let describe = || {
            format!(
                "Schlick's reflectance at the cosine with bits {:016x} and the index of refraction {ior}",
                outside.to_bits()
            )
        };
        let from_without = interface_at_cosine(outside, 1.0 / ior).schlick(outside);
        // Cosine of the same ray in the reverse direction.
        let inside = (1.0 - (1.0 - outside) * (1.0 + outside) / (ior * ior)).sqrt();
        let from_within = interface_at_cosine(inside, ior).schlick(outside);
        Verdict::from_error((from_without - requested).abs(), maximum + 5e-4, describe).and_then(
            || Verdict::from_error((from_within - requested).abs(), maximum + 5e-4, describe),
        )
    });
    let textbook = judge_rays("S15", 414, 40_000, rays, |rng| {
        let (ior, maximum) = rng.choose(&[(1.333, 0.059), (1.5, 0.036), (2.42, 0.076)]);
        let outside = rng.next_in_unit_interval();
        let inside = (1.0 - (1.0 - outside) * (1.0 + outside) / (ior * ior)).sqrt();
        let requested = accurate_reflectance(outside, 1.0 / ior).unwrap_or(1.0);
        Verdict::from_error(
            (interface_at_cosine(inside, ior).schlick(inside) - requested).abs(),
            maximum + 5e-4,
            || format!("index {ior}"),
        )
    });
    precision_independent_measurements(&outcome, Some(&textbook))
}
