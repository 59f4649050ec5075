//! Fresnel reflectance: the exact equations and their approximations.

use glam::DVec3;

use super::fresnel;
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

// Reflection and refraction of a ray at a smooth interface: the two directions and the
// reflectance.
//
// All arithmetic is in `f64`. Near 90° on the side of lower index, the cosine is the root of a
// small difference. It magnifies errors of direction and normal by η²·cosᵢ/cosₜ: 400 times at
// 89.9°, 4000 times at 89.99°. Here η is the index ratio, and cosᵢ and cosₜ are the cosines of
// incidence and refraction. Therefore vectors are normalised here, and no sum is in `f32`.

/// Reflection and refraction of a ray at a smooth interface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SmoothInterface {
    /// Unit direction of the reflected ray.
    pub reflected: DVec3,
    /// Unit direction of the refracted ray; `None` under total reflection.
    pub refracted: Option<DVec3>,
    /// Cosine of the angle of incidence.
    pub cos_incident: f64,
    /// Index on the incident side over the index on the far side.
    eta: f64,
}

impl SmoothInterface {
    /// Reflects and refracts a ray of direction `d` at the normal `n` on the ray's side. `d` and
    /// `n` may have any length. `eta` is the index on the ray's side over the index on the far
    /// side.
    #[inline]
    pub fn new(d: DVec3, n: DVec3, eta: f64) -> Self {
        let (d, n) = (d / d.length_squared().sqrt(), n / n.length_squared().sqrt());
        let cos_incident = -d.dot(n);
        let reflected = d + n * (2.0 * cos_incident);
        let sin2 = eta * eta * (1.0 - cos_incident * cos_incident);
        if sin2 > 1.0 {
            return Self {
                reflected,
                refracted: None,
                cos_incident,
                eta,
            };
        }
        let cos_transmitted = (1.0 - sin2).sqrt();
        let refracted = d * eta + n * (eta * cos_incident - cos_transmitted);
        Self {
            reflected,
            refracted: Some(refracted),
            cos_incident,
            eta,
        }
    }

    /// Returns Schlick's reflectance at a cosine of incidence.
    pub fn schlick(&self, cosine: f64) -> f64 {
        let r0 = ((1.0 - self.eta) / (1.0 + self.eta)).powi(2);
        r0 + (1.0 - r0) * fresnel::schlick_weight(cosine)
    }

    /// Returns the unpolarised reflectance by Fresnel's equations; 1 under total reflection.
    pub fn fresnel(&self) -> f64 {
        // Media of equal index must reflect nothing, so both cosines have to be equal to the last
        // bit. At grazing angles, one minus the squared sine has too few digits for this.
        let (c, eta) = (self.cos_incident, self.eta);
        let beyond = ((1.0 - eta) * (1.0 + eta) + eta * eta * c * c)
            .max(0.0)
            .sqrt();
        fresnel::fresnel_dielectric(c, self.refracted.map(|_| beyond), eta)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{PrecisionChoice, Settings};
    use crate::{Scene, prepare};
    use glam::DQuat;

    fn at(cos: f64, eta: f64) -> SmoothInterface {
        SmoothInterface::new(
            DVec3::new((1.0 - cos * cos).sqrt(), -cos, 0.0),
            DVec3::Y,
            eta,
        )
    }

    /// Protects: reflectance at normal incidence, at Brewster's angle (parallel part zero), at
    /// grazing, also between equal indices where the formula is 0/0, and beyond the critical angle.
    #[test]
    fn s14_fresnel_known_values() {
        assert!((at(1.0, 1.0 / 1.5).fresnel() - 0.04).abs() < 1e-12);
        let brewster = 1.0 / (1.0 + 1.5_f64 * 1.5).sqrt();
        let perpendicular = ((1.0 - 1.5_f64 * 1.5) / (1.0 + 1.5 * 1.5)).powi(2);
        assert!((at(brewster, 1.0 / 1.5).fresnel() - 0.5 * perpendicular).abs() < 1e-12);
        assert_eq!(at(0.0, 1.0 / 1.5).fresnel(), 1.0);
        assert_eq!(
            [
                at(0.0, 1.0).fresnel(),
                fresnel::fresnel_dielectric(0.0, Some(0.0), 1.0)
            ],
            [1.0; 2]
        );
        assert_eq!(at(0.5, 1.5).fresnel(), 1.0);
        assert!(at(0.5, 1.5).refracted.is_none());
    }

    /// Protects: Snell's law and unit length.
    #[test]
    fn snell() {
        let refracted = at(0.6, 1.0 / 1.5).refracted.unwrap();
        assert!(
            (refracted.x - 0.8 / 1.5).abs() < 1e-12 && (refracted.length() - 1.0).abs() < 1e-12
        );
    }

    /// Snell's law by the sines, in `f64`: the part perpendicular to the normal by a cross product,
    /// and the cosine by a product of two factors, so that nothing cancels.
    fn snell_by_sines(d: DVec3, n: DVec3, eta: f64) -> Option<DVec3> {
        let (d, n) = (d.normalize(), n.normalize());
        let across = n.cross(d).cross(n) * eta;
        let sine = across.length();
        (sine <= 1.0).then(|| across - n * ((1.0 - sine) * (1.0 + sine)).sqrt())
    }

    /// Protects (S12, S13): refracted and reflected directions of stored vectors with rounded
    /// lengths, from head-on to 89.999° on the thin side, both ways. The directions once lost their
    /// digits beyond 89°: 1.5e-4 at 89.99°.
    #[test]
    fn s12_directions_keep_their_digits_at_grazing_angles() {
        const U: f64 = 5.960_464_477_539_063e-8;
        for ior in [1.000_001, 1.0003, 1.333, 1.5, 2.42] {
            for degrees in [
                0.0, 1e-4, 1.0, 30.0, 60.0, 80.0, 89.0, 89.9, 89.99, 89.999_f64,
            ] {
                for turn in 0..200 {
                    let n = DVec3::new(
                        libm::sin(f64::from(turn)),
                        libm::cos(f64::from(turn) * 1.7),
                        libm::sin(f64::from(turn) * 0.3) + 0.1,
                    )
                    .normalize();
                    let (tangent, thin) = (n.any_orthonormal_vector(), degrees.to_radians());
                    for (sine, eta) in [(thin.sin(), 1.0 / ior), (thin.sin() / ior, ior)] {
                        let d = tangent * sine - n * (1.0 - sine * sine).sqrt();
                        let (d, n) = (d.as_vec3().as_dvec3(), n.as_vec3().as_dvec3());
                        let interface = SmoothInterface::new(d, n, eta);
                        let mirrored =
                            d.normalize() - n * (2.0 * d.normalize().dot(n) / n.length_squared());
                        assert!(
                            interface.reflected.distance(mirrored) <= U,
                            "reflected at {degrees}°, {eta}"
                        );
                        let (Some(found), Some(requested)) =
                            (interface.refracted, snell_by_sines(d, n, eta))
                        else {
                            // Rounding of the stored direction may take it past the critical angle;
                            // both must then agree.
                            assert_eq!(
                                interface.refracted.is_some(),
                                snell_by_sines(d, n, eta).is_some(),
                                "{degrees}°, {eta}"
                            );
                            continue;
                        };
                        let stored = found.as_vec3().as_dvec3();
                        let off = (stored - requested).abs().max_element();
                        assert!(off <= 4.0 * U, "{off:e} off at {degrees}°, index {eta}");
                        assert!(
                            (found.length() - 1.0).abs() <= 1e-12,
                            "length at {degrees}°, index {eta}"
                        );
                    }
                }
            }
        }
    }

    /// Direction of the rays of an orthographic view after they leave the objects, read from a sky
    /// that shows the direction.
    fn shown(objects: &str, d: DVec3, precision: PrecisionChoice) -> DVec3 {
        let (eye, up) = (d * -4.0, d.any_orthonormal_vector());
        let text = format!(
            r#"{{ "format": 1, "sky": {{ "expression": "d" }},
            "cameras": [{{ "pose": {{ "look_at": {{ "eye": [{}, {}, {}], "target": [0, 0, 0], "up": [{}, {}, {}] }} }},
                           "projection": {{ "orthographic": {{ "height": 1e-3 }} }} }}],
            "materials": [{{ "name": "glass", "model": {{ "classic": {{ "local": 0,
                "transmission": {{ "ior": 1.5, "choice": {{ "switch": {{ "threshold": 2 }} }} }} }} }} }}],
            "objects": [{objects}] }}"#,
            eye.x, eye.y, eye.z, up.x, up.y, up.z
        );
        let scene: Scene = serde_json::from_str(&text).expect("a scene");
        let settings = Settings {
            size: [1, 1],
            precision,
            max_depth: 8,
            ..Settings::from_scene(&scene)
        };
        let rendered = prepare(&scene, &settings, &())
            .expect("it can be prepared")
            .render(&());
        DVec3::from(
            rendered
                .picture
                .pixel(0, 0)
                .expect("one pixel")
                .map(f64::from),
        )
    }

    /// Protects: a slab shifts a ray without turning it, up to 89.99°. A direction stored in `f32`
    /// between the interfaces, magnified by the second interface, was 1.6e-5 and 1.5e-4 off.
    #[test]
    fn a_slab_of_glass_turns_no_ray() {
        const U: f64 = 5.960_464_477_539_063e-8;
        let axis = DVec3::new(1.0, 2.0, 3.0).normalize();
        let slab = r#"{ "shape": { "box": { "min": [-90, -1, -90], "max": [90, 0, 90] } }, "material": "glass",
            "transform": [{ "rotate": { "axis": [1, 2, 3], "degrees": 200 } }] }"#;
        let turned = DQuat::from_axis_angle(axis, 200_f64.to_radians());
        for precision in [PrecisionChoice::Robust, PrecisionChoice::Reference] {
            for degrees in [45.0, 89.0, 89.9, 89.99_f64] {
                let (sine, cosine) = degrees.to_radians().sin_cos();
                let d = turned * DVec3::new(sine * 0.6, -cosine, sine * 0.8);
                let (requested, found) = (shown("", d, precision), shown(slab, d, precision));
                let off = (found - requested.normalize()).abs().max_element();
                assert!(off <= 4.0 * U, "{precision:?}, {degrees}°: {off:e} off");
            }
        }
    }
}
