//! How much of the light that meets a surface is reflected: Fresnel's equations, and what is taken
//! for them.

use crate::number::{Number, Vector3};

/// Schlick's share of the way from the reflectance at normal incidence to that at grazing
/// incidence, by the cosine of the angle of incidence ("An Inexpensive BRDF Model for
/// Physically-based Rendering", 1994).
#[inline(always)]
pub fn schlick_weight<N: Number>(cosine: N) -> N {
    (N::ONE - cosine.min(N::ONE)).powi(5)
}

/// Schlick's reflectance of a surface that reflects `f0` at normal incidence and all at grazing
/// incidence.
#[inline(always)]
pub fn schlick<N: Number>(f0: N::Vec3, cosine: N) -> N::Vec3 {
    f0 + (N::Vec3::ONE - f0) * schlick_weight(cosine)
}

/// Reflectance of a rough surface under uniform light: the analytic fit of "Physically Based
/// Shading on Mobile" (Karis 2014), which lies within 0.02 of the integral.
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

/// Exact unpolarised reflectance of a dielectric (Fresnel's equations) from the cosines of the
/// incident and the transmitted angle and the index on the incident side over the other; 1 under
/// total reflection, where the transmitted cosine is none.
pub fn dielectric(incident: f64, transmitted: Option<f64>, eta: f64) -> f64 {
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

/// Exact unpolarised reflectance of a conductor in air with the complex index n + ik, by the cosine
/// of the angle of incidence (Born, Wolf, "Principles of Optics", 1999, §14.4).
pub fn conductor(cosine: f64, [n, k]: [f64; 2]) -> f64 {
    let c = cosine.clamp(0.0, 1.0);
    let (c2, s2) = (c * c, 1.0 - c * c);
    // The square of p + iq = √((n + ik)² − sin²): its parts without a difference of nearly equal
    // numbers.
    let real = n * n - k * k - s2;
    let length = real.hypot(2.0 * n * k);
    let p = (0.5 * (length + real)).max(0.0).sqrt();
    let across = (length + c2 - 2.0 * p * c) / (length + c2 + 2.0 * p * c);
    let along = across * (length * c2 + s2 * s2 - 2.0 * p * c * s2)
        / (length * c2 + s2 * s2 + 2.0 * p * c * s2);
    let both = 0.5 * (across + along);
    // All is reflected where nothing is above the surface's plane.
    if both.is_finite() {
        both.clamp(0.0, 1.0)
    } else {
        1.0
    }
}

/// Exact unpolarised reflectance of a dielectric in air, by its index and the cosine of the angle
/// of incidence outside.
pub fn dielectric_in_air(cosine: f64, ior: f64) -> f64 {
    let c = cosine.clamp(0.0, 1.0);
    dielectric(
        c,
        Some((1.0 - (1.0 - c * c) / (ior * ior)).max(0.0).sqrt()),
        1.0 / ior,
    )
}

/// Which formulas tell how much surfaces reflect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FresnelRule {
    /// Schlick's for everything, for glass and conductors with a complex index too.
    Schlick,
    /// glTF's sample formulas to the letter: as [`Self::Conserving`], but what is diffused loses
    /// Fresnel's share by the half vector, which makes light at grazing views.
    Model,
    /// Schlick's for the metallic-roughness model, which is defined by it; the exact ones for glass
    /// and for complex indices. What is diffused loses what the facets over it send back in the
    /// mean (albedo scaling), so that nothing makes light.
    #[default]
    Conserving,
    /// As that, by the exact ones for whatever has an index; metals that have a colour alone keep
    /// Schlick's.
    Exact,
}

impl FresnelRule {
    /// Every rule, from fast to exact.
    pub const ALL: [Self; 4] = [Self::Schlick, Self::Model, Self::Conserving, Self::Exact];
}
