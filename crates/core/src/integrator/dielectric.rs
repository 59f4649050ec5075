//! Smooth interfaces: mirror and refracted directions, and how light divides between them.

use raywright_bvh::{Real, Vector};

/// A ray at an interface, from the side it arrives on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interface<R: Real> {
    /// Unit direction of the refracted ray; none under total reflection.
    pub refracted: Option<R::Vec3>,
    /// Cosine of the angle of incidence.
    pub cos_incident: f64,
    /// Cosine of the transmitted angle; zero under total reflection.
    cos_transmitted: f64,
    /// Index on the incident side over the other.
    eta: f64,
}

impl<R: Real> Interface<R> {
    /// `n` is the unit normal on the side of the ray, `eta` the index there over the index beyond. The few scalars on which
    /// the critical angle depends are formed in f64, where 1 − η²(1 − c²) keeps its digits.
    #[inline]
    pub fn new(d: R::Vec3, n: R::Vec3, eta: f64) -> Self {
        let cos_incident = -d.dot(n).to_f64();
        let sin2 = eta * eta * (1.0 - cos_incident * cos_incident);
        if sin2 > 1.0 {
            return Self { refracted: None, cos_incident, cos_transmitted: 0.0, eta };
        }
        let cos_transmitted = (1.0 - sin2).sqrt();
        let refracted = d * R::from_f64(eta) + n * R::from_f64(eta * cos_incident - cos_transmitted);
        Self { refracted: Some(refracted.normalize()), cos_incident, cos_transmitted, eta }
    }

    /// Schlick's reflectance at the *incident* angle, whichever side that is ("An Inexpensive BRDF Model for Physically-based
    /// Rendering", 1994).
    pub fn schlick(&self) -> f64 {
        let r0 = ((1.0 - self.eta) / (1.0 + self.eta)).powi(2);
        r0 + (1.0 - r0) * Real::powi(1.0 - self.cos_incident, 5)
    }

    /// Exact unpolarised reflectance of a dielectric (Fresnel's equations); 1 under total reflection.
    pub fn fresnel(&self) -> f64 {
        if self.refracted.is_none() {
            return 1.0;
        }
        let (ci, ct, eta) = (self.cos_incident.clamp(0.0, 1.0), self.cos_transmitted, self.eta);
        if ci + ct == 0.0 {
            return 1.0;
        }
        let perpendicular = (eta * ci - ct) / (eta * ci + ct);
        let parallel = (eta * ct - ci) / (eta * ct + ci);
        (0.5 * (perpendicular * perpendicular + parallel * parallel)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn at(cos: f64, eta: f64) -> Interface<f64> {
        Interface::new(DVec3::new((1.0 - cos * cos).sqrt(), -cos, 0.0), DVec3::Y, eta)
    }

    /// Protects: reflectance at normal incidence, at Brewster's angle (parallel part zero), at grazing and beyond the
    /// critical angle.
    #[test]
    fn fresnel_known_values() {
        assert!((at(1.0, 1.0 / 1.5).fresnel() - 0.04).abs() < 1e-12);
        let brewster = 1.0 / (1.0 + 1.5_f64 * 1.5).sqrt();
        let perpendicular = ((1.0 - 1.5_f64 * 1.5) / (1.0 + 1.5 * 1.5)).powi(2);
        assert!((at(brewster, 1.0 / 1.5).fresnel() - 0.5 * perpendicular).abs() < 1e-12);
        assert_eq!(at(0.0, 1.0 / 1.5).fresnel(), 1.0);
        assert_eq!(at(0.5, 1.5).fresnel(), 1.0);
        assert!(at(0.5, 1.5).refracted.is_none());
    }

    /// Protects: Snell's law and unit length.
    #[test]
    fn snell() {
        let refracted = at(0.6, 1.0 / 1.5).refracted.unwrap();
        assert!((refracted.x - 0.8 / 1.5).abs() < 1e-12 && (refracted.length() - 1.0).abs() < 1e-12);
    }
}
