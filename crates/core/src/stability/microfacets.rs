//! Numerically hard cases S17 and S18: nearly smooth microfacets, and sampling of visible normals
//! at grazing angles.

use core::f64::consts::PI;

use glam::DVec3;
use raywright_bvh::stability::verdicts::{RayCount, Verdict, judge_rays, to_scalar};
use raywright_bvh::stability::{Measurement, create_treeless_measurement};
use raywright_bvh::{Real, Vector};

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

/// Measures case S17: the BSDF value for retroreflection by microfacets whose normals are within an
/// angle of 5α of the shading normal. The expected value is computed in f64 from the slopes of the
/// microfacets.
pub fn measure_narrow_lobes<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let drawn = |rng: &mut raywright_bvh::stability::verdicts::CaseRng| {
        let (n, alpha) = (to_scalar::<R>(rng.sample_direction()), rng.choose(&ALPHAS));
        let (x, y) = n.to_f64().any_orthonormal_pair();
        let (slope, turn) = (
            rng.next_uniform(0.0, 5.0) * alpha.max(9e-4),
            rng.next_uniform(0.0, 2.0 * PI),
        );
        (
            n,
            alpha,
            to_scalar::<R>((n.to_f64() + (x * turn.cos() + y * turn.sin()) * slope).normalize()),
        )
    };
    // BSDF value of retroreflection by microfacets, D/(4·cos·root), from the stored numbers.
    let requested = |n: DVec3, h: DVec3, alpha: f64| {
        let (n, h) = (n.normalize(), h.normalize());
        let (cosine, across, a2) = (n.dot(h), n.cross(h).length_squared(), alpha * alpha);
        let slope = across / a2 + cosine * cosine;
        1.0 / (PI * a2 * slope * slope)
            / (4.0 * cosine * (a2 + (1.0 - a2) * cosine * cosine).sqrt())
    };
    let outcome = judge_rays("S17", 421, 200_000, rays, |rng| {
        let (n, alpha, h) = drawn(rng);
        let found = white_microfacet_bsdf::<R>(n, alpha).eval(h, h).x().to_f64();
        // α is computed from the roughness as stored.
        let roughness = R::from_f64(alpha.sqrt())
            .to_f64()
            .max(R::from_f64(0.03).to_f64());
        let requested = requested(n.to_f64(), h.to_f64(), roughness * roughness);
        Verdict::from_error((found / requested - 1.0).abs(), 1e-3, || {
            format!(
                "relative error of the reflection at α {alpha:e}, {found} instead of {requested}"
            )
        })
    });
    // The textbook's denominator (n·h)²·(α² − 1) + 1, in f32.
    let textbook = judge_rays("S17", 421, 200_000, rays, |rng| {
        let (n, alpha, h) = drawn(rng);
        let (alpha, cosine) = (alpha as f32, n.to_f32().dot(h.to_f32()));
        let a2 = alpha * alpha;
        let denominator = cosine * cosine * (a2 - 1.0) + 1.0;
        let d = f64::from(a2 / (core::f32::consts::PI * denominator * denominator));
        let root = f64::from((a2 + (1.0 - a2) * cosine * cosine).sqrt());
        let found = d / (4.0 * f64::from(cosine) * root);
        Verdict::from_error(
            (found / requested(n.to_f64(), h.to_f64(), f64::from(alpha)) - 1.0).abs(),
            1e-3,
            || format!("α {alpha:e}"),
        )
    });
    vec![Measurement {
        textbook: Some(textbook),
        ..create_treeless_measurement::<R>(outcome)
    }]
}

/// Measures case S18: directions sampled from microfacets of reflectance 1. The view is at normal
/// incidence, at grazing angles or just below the horizon. No weight may exceed 1, and no direction
/// may point below the horizon.
pub fn measure_visible_normals<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let outcome = judge_rays("S18", 422, 400_000, rays, |rng| {
        let (n, alpha) = (to_scalar::<R>(rng.sample_direction()), rng.choose(&ALPHAS));
        let (x, _) = n.to_f64().any_orthonormal_pair();
        let height = rng.choose(&[1.0, 0.5, 1.745_240_6e-2, 1.745_329e-5, 1e-9, 0.0, -1e-6]);
        let wo = to_scalar::<R>(n.to_f64() * height + x * (1.0 - height * height).sqrt());
        let bsdf = white_microfacet_bsdf::<R>(n, alpha);
        let numbers = [
            rng.next_in_unit_interval(),
            rng.next_in_unit_interval(),
            rng.next_in_unit_interval(),
        ]
        .map(|u| R::from_f64(u.min(1.0 - 6e-8)));
        let bsdf_sample = bsdf.sample(&ShadingFrame::<R>::from_normal(n), wo, numbers);
        let weight = bsdf_sample.weight.x().to_f64();
        let describe = || {
            format!(
                "sample at α {alpha:e} of a view at height {height:e}, with weight {weight}, direction {:?} and random numbers {numbers:?}",
                bsdf_sample.direction
            )
        };
        let is_above =
            !bsdf_sample.is_valid || n.to_f64().dot(bsdf_sample.direction.to_f64()) > 0.0;
        let is_sound = bsdf_sample.direction.is_finite()
            && bsdf_sample.density.is_finite()
            && bsdf_sample.density >= R::ZERO;
        let is_black = bsdf_sample.is_valid || weight == 0.0;
        Verdict::from_error(weight, 1.0 + 1e-4, describe).and_then(|| {
            Verdict::from_condition(weight >= 0.0 && is_above && is_sound && is_black, describe)
        })
    });
    vec![create_treeless_measurement::<R>(outcome)]
}
