//! Reflection and refraction of a ray at a smooth interface: the two directions and the
//! reflectance.
//!
//! All arithmetic is in `f64`. Near 90° on the side of lower index, the cosine is the root of a
//! small difference. It magnifies errors of direction and normal by η²·cosᵢ/cosₜ: 400 times at
//! 89.9°, 4000 times at 89.99°. Here η is the index ratio, and cosᵢ and cosₜ are the cosines of
//! incidence and refraction. Therefore vectors are normalised here, and no sum is in `f32`.

use glam::DVec3;

use super::fresnel;

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
