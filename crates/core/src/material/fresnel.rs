//! How much of the light that meets a surface is reflected: Fresnel's equations, and what is taken for them.

use raywright_bvh::{Real, Vector};

/// Schlick's share of the way from the reflectance at normal incidence to that at grazing incidence, by the cosine of the angle
/// of incidence ("An Inexpensive BRDF Model for Physically-based Rendering", 1994).
#[inline(always)]
pub fn towards_grazing<R: Real>(cosine: R) -> R {
    Real::powi(R::ONE - cosine.min(R::ONE), 5)
}

/// Schlick's reflectance of a surface that reflects `f0` at normal incidence and all at grazing incidence.
#[inline(always)]
pub fn schlick<R: Real>(f0: R::Vec3, cosine: R) -> R::Vec3 {
    f0 + (R::Vec3::ONE - f0) * towards_grazing(cosine)
}

/// Exact unpolarised reflectance of a dielectric (Fresnel's equations) from the cosines of the incident and the transmitted
/// angle and the index on the incident side over the other; 1 under total reflection, where the transmitted cosine is none.
pub fn dielectric(incident: f64, transmitted: Option<f64>, eta: f64) -> f64 {
    let (ci, Some(ct)) = (incident.clamp(0.0, 1.0), transmitted) else { return 1.0 };
    if ci + ct == 0.0 {
        return 1.0;
    }
    let perpendicular = (eta * ci - ct) / (eta * ci + ct);
    let parallel = (eta * ct - ci) / (eta * ct + ci);
    (0.5 * (perpendicular * perpendicular + parallel * parallel)).clamp(0.0, 1.0)
}
