//! Fresnel reflectance: the exact equations and their approximations.

use crate::number::{Number, Vector3};

/// Lower limit of the light that a boundary lets pass, used as a divisor.
pub(super) const LEAST_UNREFLECTED: f64 = 1e-9;

/// Returns Schlick's weight (1 − cos)⁵: 0 at normal incidence, 1 at grazing incidence (Schlick, "An
/// Inexpensive BRDF Model for Physically-based Rendering", 1994).
#[inline(always)]
pub fn schlick_weight<N: Number>(cosine: N) -> N {
    (N::ONE - cosine.min(N::ONE)).powi(5)
}

/// Returns Schlick's reflectance at a cosine of incidence, from `f0` at normal incidence to 1 at
/// grazing incidence.
#[inline(always)]
pub fn schlick<N: Number>(f0: N::Vec3, cosine: N) -> N::Vec3 {
    f0 + (N::Vec3::ONE - f0) * schlick_weight(cosine)
}

/// Returns the reflectance of a rough surface under uniform light, by the fit of "Physically Based
/// Shading on Mobile" (Karis 2014). `facing` is the cosine of the view to the normal. The fit lies
/// within 0.02 of the integral.
#[inline(always)]
pub fn environment_reflectance<N: Number>(f0: N::Vec3, roughness: N, facing: N) -> N::Vec3 {
    let c = N::from_f64;
    let rx = roughness * c(-1.0) + c(1.0);
    let ry = roughness * c(-0.0275) + c(0.0425);
    let rz = roughness * c(-0.572) + c(1.04);
    let rw = roughness * c(0.022) + c(-0.04);
    // 2^(−9.28·cosine)
    let decay = (facing * c(-9.28 * core::f64::consts::LN_2)).exp();
    let a = (rx * rx).min(decay) * rx + ry;
    let (scale, offset) = (a * c(-1.04) + rz, a * c(1.04) + rw);
    (f0 * scale + N::Vec3::splat(offset))
        .max(N::Vec3::ZERO)
        .min(N::Vec3::ONE)
}

/// Returns the unpolarised Fresnel reflectance of a dielectric. `incident` and `transmitted` are
/// the cosines of incidence and refraction; `None` means total reflection. `eta` is the index on
/// the incident side over the index on the transmitted side.
pub fn fresnel_dielectric(incident: f64, transmitted: Option<f64>, eta: f64) -> f64 {
    let (ci, Some(ct)) = (incident.clamp(0.0, 1.0), transmitted) else {
        return 1.0;
    };
    if ci + ct == 0.0 {
        return 1.0;
    }
    let perpendicular = (eta * ci - ct) / (eta * ci + ct);
    let parallel = (eta * ct - ci) / (eta * ct + ci);
    (0.5 * (perpendicular * perpendicular + parallel * parallel)).clamp(0.0, 1.0)
}

/// Returns the unpolarised Fresnel reflectance of a conductor in air with the complex index n + ik,
/// at a cosine of incidence (Born, Wolf, "Principles of Optics", 1999, §14.4).
pub fn fresnel_conductor(cosine: f64, [n, k]: [f64; 2]) -> f64 {
    let c = cosine.clamp(0.0, 1.0);
    let (c2, s2) = (c * c, 1.0 - c * c);
    // p + iq = √((n + ik)² − sin²), computed without a difference of nearly equal numbers.
    let real = n * n - k * k - s2;
    let length = real.hypot(2.0 * n * k);
    let p = (0.5 * (length + real)).max(0.0).sqrt();
    let across = (length + c2 - 2.0 * p * c) / (length + c2 + 2.0 * p * c);
    let along = across * (length * c2 + s2 * s2 - 2.0 * p * c * s2)
        / (length * c2 + s2 * s2 + 2.0 * p * c * s2);
    let both = 0.5 * (across + along);
    // A result of 0/0 occurs at grazing incidence, where reflection is total.
    if both.is_finite() {
        both.clamp(0.0, 1.0)
    } else {
        1.0
    }
}

/// Returns the unpolarised Fresnel reflectance of a dielectric of index `ior` in air, at the cosine
/// of incidence in air.
pub fn fresnel_dielectric_in_air(cosine: f64, ior: f64) -> f64 {
    let c = cosine.clamp(0.0, 1.0);
    fresnel_dielectric(
        c,
        Some((1.0 - (1.0 - c * c) / (ior * ior)).max(0.0).sqrt()),
        1.0 / ior,
    )
}

/// Choice of the formulas for the Fresnel reflectance of all materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FresnelRule {
    /// Schlick's formula for every material, even for glass and for conductors with a complex
    /// index.
    Schlick,
    /// The sample formulas of the glTF specification, literally. Unlike [`Self::Conserving`], the
    /// diffuse base is weighted by 1 − F, with the Fresnel reflectance F at the half vector. This
    /// weight gains energy at grazing views.
    Model,
    /// Schlick's formula for the metallic-roughness model, as glTF defines it; Fresnel's equations
    /// for glass and for complex indices. The diffuse base is scaled by one minus the directional
    /// albedo of the microfacets above it (albedo scaling): no energy is gained.
    #[default]
    Conserving,
    /// As [`Self::Conserving`], but with Fresnel's equations for every material with an index of
    /// refraction. Metals that have only a colour keep Schlick's formula.
    Exact,
}

impl FresnelRule {
    /// All rules, from fast to exact.
    pub const ALL: [Self; 4] = [Self::Schlick, Self::Model, Self::Conserving, Self::Exact];
}
