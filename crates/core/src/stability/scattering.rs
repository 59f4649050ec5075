//! Numerically hard cases S13, S14, S15, S17 and S18: Fresnel reflectance from normal to grazing
//! incidence and between media of nearly equal refractive index, nearly smooth microfacets, and
//! sampling of visible normals at grazing angles.

use core::f64::consts::PI;

use raywright_bvh::stability::prelude::*;

use crate::material::{Bsdf, Ggx, Lobe, ShadingFrame, SmoothInterface, fresnel_dielectric};

/// Returns the smooth interface that a ray meets on a horizontal boundary from above. `cosine` is
/// the cosine of the angle of incidence, `eta` the relative index of refraction.
fn interface_at_cosine(cosine: f64, eta: f64) -> SmoothInterface {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
    SmoothInterface::new(DVec3::new(sine, -cosine, 0.0), DVec3::Y, eta)
}

/// Returns the unpolarised Fresnel reflectance, computed without cancellation; 1 under total
/// reflection. A difference of two cosines is computed as the difference of their squares divided
/// by their sum.
fn accurate_reflectance(cosine: f64, eta: f64) -> f64 {
    let sine2 = (1.0 - cosine) * (1.0 + cosine);
    let beyond2 = 1.0 - eta * eta * sine2;
    if beyond2 < 0.0 {
        return 1.0;
    }
    let beyond = beyond2.sqrt();
    // cos − cos′ = (η − 1)(η + 1)·sin²/(cos + cos′).
    let difference = (eta - 1.0) * (eta + 1.0) * sine2 / (cosine + beyond).max(f64::MIN_POSITIVE);
    let across = ((eta - 1.0) * cosine + difference) / (eta * cosine + beyond);
    let along = ((eta - 1.0) * beyond - difference) / (eta * beyond + cosine);
    0.5 * (across * across + along * along)
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
fn judge_reflectance(found: f64, expected: f64, bound: f64, at: [f64; 2]) -> Verdict {
    let label = || {
        format!(
            "reflectance {found} instead of {expected} at the cosine and ratio of indices {at:?}"
        )
    };
    within((found - expected).abs(), bound, label) & require((0.0..=1.0).contains(&found), label)
}

/// Tested roughness values α. Three are ordinary, the fourth is the least supported value. The last
/// two are smaller and are treated as the least.
const ALPHAS: [f64; 6] = [0.1, 1e-2, 1e-3, 9e-4, 1e-4, 1e-6];

/// Returns a BSDF of microfacets with reflectance 1 and the roughness α.
fn white_microfacet_bsdf<R: Real>(normal: R::Vec3, alpha: f64) -> Bsdf<R> {
    let [f0, f90] = [R::Vec3::ONE; 2];
    let roughness = R::from_f64(alpha.sqrt());
    Bsdf::new(normal).with_lobe(Lobe::Rough { f0, f90, roughness })
}

/// BSDF value of retroreflection by microfacets, D/(4·cos·root), in f64 from the stored numbers.
fn retroreflection(n: DVec3, h: DVec3, alpha: f64) -> f64 {
    let (n, h) = (n.normalize(), h.normalize());
    let (cosine, across, a2) = (n.dot(h), n.cross(h).length_squared(), alpha * alpha);
    let slope = across / a2 + cosine * cosine;
    let root = (a2 + (1.0 - a2) * cosine * cosine).sqrt();
    1.0 / (PI * a2 * slope * slope) / (4.0 * cosine * root)
}

/// Returns the same by the textbook, with the denominator (n·h)²·(α² − 1) + 1, in f32.
fn textbook_retroreflection(n: Vec3, h: Vec3, alpha: f32) -> f32 {
    let (a2, cosine) = (alpha * alpha, n.dot(h));
    let denominator = cosine * cosine * (a2 - 1.0) + 1.0;
    let d = a2 / (core::f32::consts::PI * denominator * denominator);
    d / (4.0 * cosine * (a2 + (1.0 - a2) * cosine * cosine).sqrt())
}

/// Cases of Fresnel reflectance and microfacets.
pub(super) fn cases<R: Real>() -> Vec<Case<R>> {
    vec![
        // Reflectance between media with a relative index of exactly or nearly one. The textbook's
        // formula is Schlick's approximation, which approaches one at grazing angles for any
        // indices.
        ("S13", |trial| {
            trial.judge("", (411, 200_000), BOTH, |rng, formula| {
                let eta = draw_ratio(rng, &[1.0, 1.0003, 1.0 + 1e-6]);
                let cosine = draw_cosine(rng);
                let interface = interface_at_cosine(cosine, eta);
                let found = if formula.is_textbook {
                    interface.schlick(cosine)
                } else {
                    interface.fresnel()
                };
                judge_reflectance(
                    found,
                    accurate_reflectance(cosine, eta),
                    1e-6,
                    [cosine, eta],
                )
            });
            trial.judge("straight", (412, 50_000), LIBRARY, |rng, _| {
                let [d, n] = [(); 2].map(|()| rng.sample_direction());
                let refracted = SmoothInterface::new(d, n * -d.dot(n).signum(), 1.0).refracted;
                let off = refracted.map_or(f64::INFINITY, |v| (v - d).abs().max_element());
                within(off, 4.0 * UNIT_ROUNDOFF, || {
                    format!("refraction of {d} at {n}")
                })
            });
        }),
        // The relative error of the Fresnel reflectance of glasses and diamond, from outside and
        // from inside.
        ("S14", |trial| {
            trial.judge("", (413, 400_000), LIBRARY, |rng, _| {
                let eta = draw_ratio(rng, &[1.333, 1.5, 1.7, 2.42]);
                let cosine = if rng.next_bits().is_multiple_of(50) {
                    rng.choose(&[0.0, -0.0, 1.0, 1.0 + 2.0 * UNIT_ROUNDOFF])
                } else {
                    draw_cosine(rng)
                };
                let beyond2 = 1.0 - eta * eta * (1.0 - cosine) * (1.0 + cosine);
                let beyond = (beyond2 >= 0.0).then(|| beyond2.sqrt());
                let found = fresnel_dielectric(cosine, beyond, eta);
                let expected = accurate_reflectance(cosine.clamp(0.0, 1.0), eta);
                let verdict = judge_reflectance(found, expected, 1e-6 * expected, [cosine, eta]);
                if !(beyond2 > 0.0 && cosine > 0.0 && cosine <= 1.0) {
                    return verdict;
                }
                // Transmittance by the amplitudes of both polarisations, the complement of the
                // reflectance.
                let (c, b) = (cosine, beyond2.sqrt());
                let [across, along] = [eta * c + b, eta * b + c].map(|sum| 2.0 * eta * c / sum);
                let through = 0.5 * (across * across + along * along) * b / (eta * c);
                verdict & judge_reflectance(found, 1.0 - through, 1e-6, [cosine, eta])
            });
        }),
        // The difference between Schlick's approximation and the Fresnel equations. It must not
        // exceed its known maximum. For a ray from inside, the cosine is taken in the thinner
        // medium; the textbook takes that inside.
        ("S15", |trial| {
            trial.judge("", (414, 40_000), BOTH, |rng, formula| {
                let (ior, maximum) = rng.choose(&[(1.333, 0.059), (1.5, 0.036), (2.42, 0.076)]);
                let outside = rng.next_in_unit_interval();
                let expected = accurate_reflectance(outside, 1.0 / ior);
                // Cosine of the same ray in the reverse direction.
                let inside = (1.0 - (1.0 - outside) * (1.0 + outside) / (ior * ior)).sqrt();
                let judge =
                    |found, eta| judge_reflectance(found, expected, maximum + 5e-4, [outside, eta]);
                let from_inside = interface_at_cosine(inside, ior);
                if formula.is_textbook {
                    return judge(from_inside.schlick(inside), ior);
                }
                let from_outside = interface_at_cosine(outside, 1.0 / ior).schlick(outside);
                judge(from_outside, 1.0 / ior) & judge(from_inside.schlick(outside), ior)
            });
        }),
        // The BSDF value for retroreflection by microfacets whose normals are within an angle of 5α
        // of the shading normal. The expected value is computed from the slopes of the microfacets.
        ("S17", |trial| {
            trial.judge("", (421, 200_000), BOTH, |rng, formula| {
                let (n, alpha) = (to_scalar::<R>(rng.sample_direction()), rng.choose(&ALPHAS));
                let (x, y) = n.to_f64().any_orthonormal_pair();
                let slope = rng.next_uniform(0.0, 5.0) * alpha.max(9e-4);
                let (sin, cos) = rng.next_uniform(0.0, 2.0 * PI).sin_cos();
                let h = to_scalar::<R>((n.to_f64() + (x * cos + y * sin) * slope).normalize());
                let (found, exact) = if formula.is_textbook {
                    let alpha = alpha as f32;
                    let found = textbook_retroreflection(n.to_f32(), h.to_f32(), alpha);
                    (found.into(), f64::from(alpha))
                } else {
                    // α is computed from the roughness as stored.
                    let roughness = R::from_f64(alpha.sqrt()).max(R::from_f64(0.03)).to_f64();
                    let found = white_microfacet_bsdf::<R>(n, alpha).eval(h, h).x();
                    (found.to_f64(), roughness * roughness)
                };
                let expected = retroreflection(n.to_f64(), h.to_f64(), exact);
                within((found / expected - 1.0).abs(), bound_in::<R>(1e-3), || {
                    format!("relative error of the reflection {found}, not {expected}, α {alpha:e}")
                })
            });
        }),
        // Directions sampled from microfacets of reflectance 1. The view is at normal incidence, at
        // grazing angles or just below the horizon. No weight may exceed 1, and no direction may
        // point below the horizon.
        ("S18", |trial| {
            trial.judge("", (422, 400_000), LIBRARY, |rng, _| {
                let (n, alpha) = (to_scalar::<R>(rng.sample_direction()), rng.choose(&ALPHAS));
                let (x, _) = n.to_f64().any_orthonormal_pair();
                let heights = [1.0, 0.5, 1.745_240_6e-2, 1.745_329e-5, 1e-9, 0.0, -1e-6];
                let height = rng.choose(&heights);
                let wo = to_scalar::<R>(n.to_f64() * height + x * (1.0 - height * height).sqrt());
                let numbers = rng
                    .next_numbers()
                    .map(|u: f64| R::from_f64(u.min(1.0 - 6e-8)));
                let frame = ShadingFrame::<R>::from_normal(n);
                let sample = white_microfacet_bsdf::<R>(n, alpha).sample(&frame, wo, numbers);
                let (direction, density) = (sample.direction, sample.density);
                let weight = sample.weight.x().to_f64();
                let label = || {
                    format!(
                        "weight {weight}, {direction:?} of {height:e}, α {alpha:e}, {numbers:?}"
                    )
                };
                // Layers take the mirrored direction itself.
                let [_, u, v] = numbers;
                let roughness = R::from_f64(alpha.sqrt());
                let (_, mirrored) = Ggx::isotropic(n, roughness).sample_reflection(n, wo, [u, v]);
                let is_lost = mirrored.to_f64() == DVec3::ZERO;
                let is_above = |d: R::Vec3| n.dot(d) > R::ZERO;
                let is_sound = (is_lost || is_above(mirrored))
                    && direction.is_finite()
                    && density.is_finite()
                    && density >= R::ZERO;
                let is_shown = if sample.is_valid {
                    is_above(direction)
                } else {
                    weight == 0.0
                };
                within(weight, 1.0 + 1e-4, label)
                    & require(weight >= 0.0 && is_shown && is_sound, label)
            });
        }),
    ]
}
