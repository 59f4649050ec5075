//! A dielectric boundary, smooth or rough. A smooth boundary follows Fresnel's equations. Each
//! microfacet of a rough boundary reflects and refracts as a smooth boundary ("Microfacet Models
//! for Refraction through Rough Surfaces", Walter, Marschner, Li, Torrance 2007). Microfacets are
//! sampled by visible normals.
//!
//! Refracted radiance is not scaled by the squared ratio of the indices. A path that enters and
//! leaves the glass would undo this factor.

use super::fresnel::SmoothInterface;
use super::ggx::{Ggx, alpha_from_roughness, reflect, sample_wm};
use super::lobe_traits::{Directions, ScatteringLobe, sample_disk};
use super::shading_frame::ShadingFrame;
use crate::number::{Mask, Number, Vector3};

/// Lobe of a smooth or rough dielectric boundary, viewed from one side. It reflects and transmits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric<N: Number> {
    /// Index of refraction on the ray's side over the index on the far side. In `f64`: refraction
    /// near the critical angle loses digits by cancellation.
    pub eta: N::Exact,
    /// [`Self::eta`] in the precision of the lanes, which suffices for microfacets.
    pub facet_eta: N,
    /// Share of the surface's area that this boundary covers, 0 to 1.
    pub share: N,
    /// Factor on the reflected light, in red, green and blue.
    pub reflected: N::Vec3,
    /// Factor on the transmitted light, in red, green and blue.
    pub transmitted: N::Vec3,
    /// Perceptual roughness, the square root of the microfacet α; `None` for a smooth boundary.
    pub roughness: Option<N>,
}

/// Returns the unpolarised Fresnel reflectance, and the cosine of the angle of refraction. `cosine`
/// is the cosine of incidence, `eta` the index on the incident side over the index on the far side.
/// Under total reflection the result is 1 and 0.
#[inline(always)]
pub(super) fn fresnel<N: Number>(cosine: N, eta: N) -> (N, N) {
    let c = cosine.max(N::ZERO).min(N::ONE);
    let beyond2 = N::ONE - eta * eta * (N::ONE - c * c);
    let beyond = beyond2.max(N::ZERO).sqrt();
    let perpendicular = (eta * c - beyond) / (eta * c + beyond);
    let parallel = (eta * beyond - c) / (eta * beyond + c);
    let half = N::from_f64(0.5);
    let part = half * (perpendicular * perpendicular + parallel * parallel);
    (
        N::select(beyond2.greater_than(N::ZERO), part.min(N::ONE), N::ONE),
        beyond,
    )
}

impl<N: Number> Dielectric<N> {
    /// Returns three things:
    /// - the unit normal of the microfacet that refracts between `wo` and `wi`;
    /// - its cosines to `wo` (positive) and to `wi` (negative);
    /// - the mask of the SIMD lanes in which such a microfacet exists.
    #[inline(always)]
    pub(super) fn refraction_half_vector(
        &self,
        directions: &Directions<N>,
    ) -> (N::Vec3, [N; 2], N::Mask) {
        let along = directions.wo * self.facet_eta + directions.wi;
        let length = along.dot(along).sqrt();
        let wm = along / length;
        let wm = N::Vec3::select(directions.normal.dot(wm).greater_than(N::ZERO), wm, -wm);
        let (out, into) = (wm.dot(directions.wo), wm.dot(directions.wi));
        // Equal indices bend no light and determine no microfacet.
        let able = out.greater_than(N::ZERO)
            & N::ZERO.greater_than(into)
            & length.greater_than(N::from_f64(1e-6));
        (wm, [out, into], able)
    }
}

impl<N: Number> ScatteringLobe<N> for Dielectric<N> {
    #[inline(always)]
    fn importance(&self, _: N) -> N {
        self.share * self.reflected.max(self.transmitted).max_element()
    }

    #[inline(always)]
    fn is_delta(&self) -> bool {
        self.roughness.is_none()
    }

    #[inline(always)]
    fn is_transmissive(&self) -> bool {
        self.roughness.is_some()
    }

    /// Evaluates the reflection by the microfacets.
    #[inline(always)]
    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let Some(roughness) = self.roughness else {
            return (N::Vec3::ZERO, N::ZERO);
        };
        let (reflectance, _) = fresnel(directions.cos_half, self.facet_eta);
        let ggx = Ggx::isotropic(directions.normal, roughness);
        let (value, density) =
            ggx.eval_reflection_and_pdf(directions, self.reflected * (self.share * reflectance));
        (
            N::Vec3::select(self.share.greater_than(N::ZERO), value, N::Vec3::ZERO),
            reflectance * density,
        )
    }

    /// Evaluates the transmission by the microfacets.
    #[inline(always)]
    fn eval_transmission_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let Some(roughness) = self.roughness else {
            return (N::Vec3::ZERO, N::ZERO);
        };
        let (ggx, (wm, [out, into], able)) = (
            Ggx::isotropic(directions.normal, roughness),
            self.refraction_half_vector(directions),
        );
        // The density of visible normals times the Jacobian of refraction; the transmitted share
        // follows below.
        let seen = N::from_f64(2.0) * out
            / (directions.cos_wo + ggx.smith_root(directions.wo, directions.cos_wo));
        let denominator = self.facet_eta * out + into;
        let spread = seen * -into / (ggx.reciprocal_d(wm) * denominator * denominator);
        let density = (N::ONE - fresnel(out, self.facet_eta).0) * spread;
        let below = -directions.cos_wi;
        // The factor after the density is Smith's G₁ of the far side over its cosine: masking on
        // the two sides is independent.
        let value = self.transmitted
            * (self.share * density * N::from_f64(2.0)
                / (below + ggx.smith_root(directions.wi, below)));
        let lit = able & directions.cos_wo.greater_than(N::ZERO) & below.greater_than(N::ZERO);
        (
            N::Vec3::select(lit, value, N::Vec3::ZERO),
            N::select(able, density, N::ZERO),
        )
    }

    /// Samples a reflected or a refracted direction; `choice` decides which. The direction is zero
    /// if the microfacet sends it to the wrong side of the surface.
    #[inline(always)]
    fn sample(
        &self,
        frame: &ShadingFrame<N>,
        _: N::Vec3,
        wo: N::Vec3,
        choice: N,
        point: [N; 2],
    ) -> N::Vec3 {
        let Some(roughness) = self.roughness else {
            return N::Vec3::ZERO;
        };
        let (eta, wm) = (
            self.facet_eta,
            sample_wm::<N>(wo, [alpha_from_roughness(roughness); 2], sample_disk(point)),
        );
        let cosine = wo.dot(wm);
        let (reflectance, beyond) = fresnel(cosine, eta);
        let mirrored = reflect::<N>(wo, wm);
        let refracted = wm * (eta * cosine - beyond) - wo * eta;
        // Light on the wrong side would hit another microfacet and counts as lost.
        let above = mirrored.z().greater_than(N::ZERO);
        let mirrored = N::Vec3::select(above, mirrored, N::Vec3::ZERO);
        let below = N::ZERO.greater_than(refracted.z());
        let refracted = N::Vec3::select(below, refracted.normalize(), N::Vec3::ZERO);
        frame.to_world(N::Vec3::select(
            reflectance.greater_than(choice),
            mirrored,
            refracted,
        ))
    }

    #[inline(always)]
    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, u: N) -> (N::Vec3, N::Vec3) {
        let mut through = N::Mask::default();
        let direction = N::Vec3::from_lanes(|lane| {
            let interface = SmoothInterface::new(
                -wo.lane(lane),
                normal.lane(lane),
                N::f64_lane(self.eta, lane),
            );
            // The probability is the Fresnel reflectance itself, so the weight is the tint.
            match interface.refracted {
                Some(direction) if u.lane(lane) >= interface.fresnel() => {
                    through.set_lane(lane);
                    direction
                }
                _ => interface.reflected,
            }
        });
        (
            direction,
            N::Vec3::select(through, self.transmitted, self.reflected) * self.share,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::fresnel;
    use crate::material::fresnel_dielectric as exact;

    /// Protects: microfacets reflect by Fresnel's equations from both sides, from head-on to
    /// grazing, at Brewster's angle and beyond the critical angle; the cosine beyond follows
    /// Snell's law.
    #[test]
    fn s14_facets_reflect_by_fresnels_equations() {
        for eta in [1.0 / 2.42, 1.0 / 1.5, 1.0 / 1.33, 1.0, 1.33, 1.5, 2.42_f64] {
            for cosine in [
                1.0,
                0.9,
                0.75,
                0.6,
                0.4,
                0.2,
                0.05,
                1.0 / (1.0 + 1.0 / (eta * eta)).sqrt(),
            ] {
                let sine2 = eta * eta * (1.0 - cosine * cosine);
                let beyond = (sine2 < 1.0).then(|| (1.0 - sine2).sqrt());
                let found = fresnel(cosine, eta);
                let requested = (exact(cosine, beyond, eta), beyond.unwrap_or(0.0));
                assert!(
                    (found.0 - requested.0).abs() < 1e-12,
                    "{found:?}, not {requested:?} at {cosine}, {eta}"
                );
                assert!(
                    (found.1 - requested.1).abs() < 1e-12,
                    "{found:?}, not {requested:?} at {cosine}, {eta}"
                );
            }
        }
        assert!((fresnel::<f64>(1.0, 1.5).0 - 0.04).abs() < 1e-15);
    }
}
