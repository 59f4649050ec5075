//! A rough boundary of a dielectric: facets that each reflect and refract as a smooth boundary does ("Microfacet Models for Refraction
//! through Rough Surfaces", Walter, Marschner, Li, Torrance 2007), drawn as they are seen.
//!
//! What is carried is the light that passes, as for smooth boundaries: radiance is not scaled by the square of the index, which a path
//! that leaves glass takes back.

use super::ggx::{Ggx, alpha, mirrored, sample_wm};
use super::lobe::{Pair, on_disk};
use crate::number::{Number, Vector3};

/// The boundary as one side sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughGlass<N: Number> {
    /// Index on the side that the ray comes from over the one beyond.
    pub eta: N,
    /// Share of the surface that is such a boundary.
    pub share: N,
    /// Factor of what is reflected.
    pub reflected: N::Vec3,
    /// Factor of what is let through.
    pub transmitted: N::Vec3,
    /// Perceptual roughness; the microfacet α is its square.
    pub roughness: N,
}

/// Unpolarised reflectance of a facet by the cosine of incidence and the index there over the one beyond, and the cosine beyond; 1
/// and none under total reflection.
#[inline(always)]
fn fresnel<N: Number>(cosine: N, eta: N) -> (N, N) {
    let c = cosine.max(N::ZERO).min(N::ONE);
    let beyond2 = N::ONE - eta * eta * (N::ONE - c * c);
    let beyond = beyond2.max(N::ZERO).sqrt();
    let perpendicular = (eta * c - beyond) / (eta * c + beyond);
    let parallel = (eta * beyond - c) / (eta * beyond + c);
    let half = N::from_f64(0.5);
    let part = half * (perpendicular * perpendicular + parallel * parallel);
    (N::select(beyond2.above(N::ZERO), part.min(N::ONE), N::ONE), beyond)
}

impl<N: Number> RoughGlass<N> {
    /// Value above the surface: what facets reflect.
    #[inline(always)]
    pub(super) fn value(&self, pair: &Pair<N>) -> N::Vec3 {
        let (reflectance, _) = fresnel(pair.tilt, self.eta);
        let (value, _) = pair.reflected(self.reflected * (self.share * reflectance), &self.facets(pair));
        N::Vec3::select(self.share.above(N::ZERO), value, N::Vec3::ZERO)
    }

    /// Density above the surface.
    #[inline(always)]
    pub(super) fn density(&self, pair: &Pair<N>) -> N {
        fresnel(pair.tilt, self.eta).0 * self.facets(pair).eval_and_pdf(pair).1
    }

    /// The facet's normal that refracts between both directions, its cosines to them (the one of the light is below zero), and
    /// whether there is one.
    #[inline(always)]
    fn between(&self, pair: &Pair<N>) -> (N::Vec3, N, N, N::Mask) {
        let along = pair.wo * self.eta + pair.wi;
        let length = along.dot(along).sqrt();
        let facet = along / length;
        let facet = N::Vec3::select(pair.normal.dot(facet).above(N::ZERO), facet, -facet);
        let (out, into) = (facet.dot(pair.wo), facet.dot(pair.wi));
        // Indices that are equal bend nothing, and there is no facet to tell.
        let able = out.above(N::ZERO) & N::ZERO.above(into) & length.above(N::from_f64(1e-6));
        (facet, out, into, able)
    }

    #[inline(always)]
    fn facets(&self, pair: &Pair<N>) -> Ggx<N> {
        Ggx::isotropic(pair.normal, self.roughness)
    }

    /// Density of the facets that are seen, of one between both directions, and what turns it into that of the refracted direction.
    #[inline(always)]
    fn density_between(&self, pair: &Pair<N>, facet: N::Vec3, [out, into]: [N; 2]) -> N {
        let facets = self.facets(pair);
        let seen = N::from_f64(2.0) * out / (pair.out + facets.root(pair.wo, pair.out));
        let denominator = self.eta * out + into;
        seen * -into / (facets.inverse_d(facet) * denominator * denominator)
    }

    /// Value below the surface: what facets let through.
    #[inline(always)]
    pub(super) fn value_through(&self, pair: &Pair<N>) -> N::Vec3 {
        let (facet, out, into, able) = self.between(pair);
        let density = self.density_of(pair, facet, [out, into]);
        let below = -pair.into;
        // Smith's G₁ of the side beyond, over the cosine: what is seen from one side says nothing of what hides there.
        let value =
            self.transmitted * (self.share * density * N::from_f64(2.0) / (below + self.facets(pair).root(pair.wi, below)));
        N::Vec3::select(able & pair.out.above(N::ZERO) & below.above(N::ZERO), value, N::Vec3::ZERO)
    }

    /// The cosine of the way back to the facet that refracts between both directions.
    pub(super) fn tilt_through(&self, pair: &Pair<N>) -> N {
        self.between(pair).1
    }

    /// Density below the surface.
    #[inline(always)]
    pub(super) fn density_through(&self, pair: &Pair<N>) -> N {
        let (facet, out, into, able) = self.between(pair);
        N::select(able, self.density_of(pair, facet, [out, into]), N::ZERO)
    }

    #[inline(always)]
    fn density_of(&self, pair: &Pair<N>, facet: N::Vec3, cosines: [N; 2]) -> N {
        let (reflectance, _) = fresnel(cosines[0], self.eta);
        (N::ONE - reflectance) * self.density_between(pair, facet, cosines)
    }

    /// A direction in the frame whose third axis is the normal, for the way back there and three numbers in [0, 1): by the first a
    /// facet reflects or refracts. Zero where that is lost.
    #[inline(always)]
    pub(super) fn drawn(&self, wo: N::Vec3, choice: N, point: [N; 2]) -> N::Vec3 {
        let facet = sample_wm::<N>(wo, [alpha(self.roughness); 2], on_disk(point));
        let cosine = wo.dot(facet);
        let (reflectance, beyond) = fresnel(cosine, self.eta);
        let mirrored = mirrored::<N>(wo, facet);
        let refracted = facet * (self.eta * cosine - beyond) - wo * self.eta;
        // What a facet sends to the wrong side meets another one, and is lost.
        let above = mirrored.z().above(N::ZERO);
        let mirrored = N::Vec3::select(above, mirrored, N::Vec3::ZERO);
        let below = N::ZERO.above(refracted.z());
        let refracted = N::Vec3::select(below, refracted.normalize(), N::Vec3::ZERO);
        N::Vec3::select(reflectance.above(choice), mirrored, refracted)
    }
}
