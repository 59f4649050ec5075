//! Numerically hard cases S17 and S18: nearly smooth microfacets, and sampling of visible normals
//! at grazing angles.

use core::f64::consts::PI;

use raywright_bvh::stability::prelude::*;

use crate::material::{Bsdf, Lobe, ShadingFrame};

/// Tested roughness values α. Three are ordinary, the fourth is the least supported value. The last
/// two are smaller and are treated as the least.
const ALPHAS: [f64; 6] = [0.1, 1e-2, 1e-3, 9e-4, 1e-4, 1e-6];

/// Returns a BSDF of microfacets with reflectance 1 and the roughness α.
fn white_microfacet_bsdf<R: Real>(normal: R::Vec3, alpha: f64) -> Bsdf<R> {
    let white = R::Vec3::ONE;
    Bsdf::new(normal).with_lobe(Lobe::Rough {
        f0: white,
        f90: white,
        roughness: R::from_f64(alpha.sqrt()),
    })
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

/// Judges case S17: the BSDF value for retroreflection by microfacets whose normals are within an
/// angle of 5α of the shading normal. The expected value is computed from the slopes of the
/// microfacets.
pub(super) fn narrow_lobes<R: Real>(trial: &mut Trial<R>) {
    trial.judge("", (421, 200_000), |rng| {
        let (n, alpha) = (to_scalar::<R>(rng.sample_direction()), rng.choose(&ALPHAS));
        let (x, y) = n.to_f64().any_orthonormal_pair();
        let slope = rng.next_uniform(0.0, 5.0) * alpha.max(9e-4);
        let (sin, cos) = rng.next_uniform(0.0, 2.0 * PI).sin_cos();
        let h = to_scalar::<R>((n.to_f64() + (x * cos + y * sin) * slope).normalize());
        let judge = |found: f64, alpha: f64| {
            let expected = retroreflection(n.to_f64(), h.to_f64(), alpha);
            Verdict::from_error((found / expected - 1.0).abs(), 1e-3, || {
                format!(
                    "relative error of the reflection at α {alpha:e}, {found} instead of {expected}"
                )
            })
        };
        // α is computed from the roughness as stored.
        let roughness = R::from_f64(alpha.sqrt()).max(R::from_f64(0.03)).to_f64();
        let found = white_microfacet_bsdf::<R>(n, alpha).eval(h, h).x();
        let textbook = textbook_retroreflection(n.to_f32(), h.to_f32(), alpha as f32);
        let textbook = judge(textbook.into(), f64::from(alpha as f32));
        [judge(found.to_f64(), roughness * roughness), textbook]
    });
}

/// Judges case S18: directions sampled from microfacets of reflectance 1. The view is at normal
/// incidence, at grazing angles or just below the horizon. No weight may exceed 1, and no direction
/// may point below the horizon.
pub(super) fn visible_normals<R: Real>(trial: &mut Trial<R>) {
    trial.judge("", (422, 400_000), |rng| {
        let (n, alpha) = (to_scalar::<R>(rng.sample_direction()), rng.choose(&ALPHAS));
        let (x, _) = n.to_f64().any_orthonormal_pair();
        let height = rng.choose(&[1.0, 0.5, 1.745_240_6e-2, 1.745_329e-5, 1e-9, 0.0, -1e-6]);
        let wo = to_scalar::<R>(n.to_f64() * height + x * (1.0 - height * height).sqrt());
        let numbers = [(); 3].map(|()| R::from_f64(rng.next_in_unit_interval().min(1.0 - 6e-8)));
        let frame = ShadingFrame::<R>::from_normal(n);
        let sample = white_microfacet_bsdf::<R>(n, alpha).sample(&frame, wo, numbers);
        let weight = sample.weight.x().to_f64();
        let label = || format!("weight {weight} of a view at height {height:e} at α {alpha:e}, direction {:?}, random numbers {numbers:?}", sample.direction);
        let is_sound = sample.direction.is_finite() && sample.density.is_finite() && sample.density >= R::ZERO;
        let is_above = n.to_f64().dot(sample.direction.to_f64()) > 0.0;
        let is_shown = if sample.is_valid { is_above } else { weight == 0.0 };
        [Verdict::from_error(weight, 1.0 + 1e-4, label)
            .and_then(|| Verdict::from_condition(weight >= 0.0 && is_shown && is_sound, label))]
    });
}
