//! Reflectance of the microfacets of a layered surface: a mixture of dielectric and metal, each by
//! Schlick's formula or by Fresnel's equations, with or without a thin film.

use super::fresnel::{
    LEAST_UNREFLECTED, fresnel_conductor, fresnel_dielectric_in_air, schlick, schlick_weight,
};
use super::thin_film::ThinFilm;
use crate::number::{Mask, Number, Vector3};

/// Reflectance of a microfacet as a function of the cosine of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MicrofacetReflectance<N: Number> {
    /// Share of the surface that is dielectric, and share that is metal.
    pub shares: [N; 2],
    /// Reflectance of the dielectric part at normal and at grazing incidence.
    pub dielectric: [N::Vec3; 2],
    /// Index of refraction of the dielectric part for Fresnel's equations; `None` selects Schlick's
    /// formula.
    pub exact: Option<N::Exact>,
    /// Reflectance of the metal at normal incidence. At grazing incidence it is 1.
    pub metal: N::Vec3,
    /// Complex index n + ik of the metal by channel for Fresnel's equations; `None` selects
    /// Schlick's formula.
    pub conductor: Option<[N::Vec3; 2]>,
    /// Thin film over dielectric and metal; `None` without a film.
    pub film: Option<ThinFilm<N>>,
}

impl<N: Number> MicrofacetReflectance<N> {
    /// Returns the reflectance at a cosine of incidence.
    pub fn eval(&self, cosine: N) -> N::Vec3 {
        let cosine = cosine.max(N::ZERO).min(N::ONE);
        let mut sum = N::Vec3::ZERO;
        for (k, &share) in self.shares.iter().enumerate() {
            if share.greater_than(N::ZERO).any_lane() {
                let by_colour = || schlick(self.metal, cosine);
                let (bare, f0) = match k {
                    0 => (self.eval_dielectric(cosine), self.dielectric[0]),
                    _ => (
                        self.conductor
                            .map_or_else(by_colour, |index| eval_conductor(cosine, index)),
                        self.metal,
                    ),
                };
                sum += self
                    .film
                    .map_or(bare, |film| film.reflectance_with_film(bare, f0, cosine))
                    * share;
            }
        }
        sum
    }

    /// Returns the reflectance of the dielectric part at a cosine of incidence, without the film.
    fn eval_dielectric(&self, cosine: N) -> N::Vec3 {
        let [normal, grazing] = self.dielectric;
        let schlick = schlick_weight(cosine);
        let Some(ior) = self.exact else {
            return normal + (grazing - normal) * schlick;
        };
        // An index of zero stands for total reflection at every angle.
        let value_of = |ior: f64, cosine: f64| {
            if ior > 0.0 {
                fresnel_dielectric_in_air(cosine, ior)
            } else {
                1.0
            }
        };
        let exact = N::from_lanes(|lane| value_of(N::f64_lane(ior, lane), cosine.lane(lane)));
        // What a tint takes away at normal incidence fades as Schlick's weight rises. What it adds
        // fades as the reflectance rises: the sum is at most 1, whatever the index and the tint.
        let (f0, zero) = (self.f0_from_ior(), N::Vec3::ZERO);
        let added = normal - grazing * f0;
        let unreflected = (N::ONE - exact) / (N::ONE - f0).max(N::from_f64(LEAST_UNREFLECTED));
        (grazing * exact + added.min(zero) * (N::ONE - schlick) + added.max(zero) * unreflected)
            .max(zero)
            .min(N::Vec3::ONE)
    }

    /// Returns the Fresnel reflectance at normal incidence for the index [`Self::exact`]; zero
    /// without this index.
    pub(super) fn f0_from_ior(&self) -> N {
        let ior = |lane| self.exact.map_or(1.0, |ior| N::f64_lane(ior, lane));
        N::from_lanes(|lane| ((ior(lane) - 1.0) / (ior(lane) + 1.0)).powi(2))
    }

    /// Whether the reflectance can exceed zero in any lane.
    pub fn is_reflective(&self) -> bool {
        let dielectric = self.dielectric[0].max(self.dielectric[1]).max_element() * self.shares[0];
        dielectric
            .max(self.shares[1])
            .greater_than(N::ZERO)
            .any_lane()
    }
}

/// Returns the Fresnel reflectance of a metal with the complex index n + ik by channel, at a cosine
/// of incidence.
pub(super) fn eval_conductor<N: Number>(cosine: N, [n, k]: [N::Vec3; 2]) -> N::Vec3 {
    N::Vec3::from_lanes(|lane| {
        let (n, k) = (n.lane(lane), k.lane(lane));
        let value_of = |n: f64, k: f64| fresnel_conductor(cosine.lane(lane), [n, k]);
        glam::DVec3::new(value_of(n.x, k.x), value_of(n.y, k.y), value_of(n.z, k.z))
    })
}
