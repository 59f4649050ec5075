//! The diffuse lobe of a layered surface: diffuse reflection and transmission below the
//! microfacets, and multiple scattering among the microfacets.

use core::f64::consts::PI;

use super::albedo::Albedo;
use super::energy::{EnergyComplement, cosine_weighted_mean};
use super::fresnel::schlick_weight;
use super::ggx::Ggx;
use super::lobe_traits::{Directions, ScatteringLobe, sample_cosine_either_side};
use super::microfacet_reflectance::MicrofacetReflectance;
use super::rough_boundary_tables;
use super::shading_frame::ShadingFrame;
use crate::number::{Mask, Number, Vector3};

/// The diffuse lobe below the microfacets of a layered surface, for one viewing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseBase<N: Number> {
    /// Diffuse reflectance by channel.
    pub(super) reflectance: N::Vec3,
    /// Diffuse transmittance by channel.
    pub(super) transmittance: N::Vec3,
    /// Factor by which these microfacets scale the multiple scattering of white microfacets.
    pub(super) multiple_scattering: N::Vec3,
    /// Whether the base transmits light.
    pub(super) transmits: bool,
    /// The microfacets over the base.
    pub(super) microfacets: MicrofacetLayer<N>,
}

/// Reflectance of microfacets by Fresnel's equations or with a thin film, instead of Schlick's
/// formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonSchlickReflectance<N: Number> {
    /// Mask of the SIMD lanes with this reflectance; all other lanes follow Schlick's formula.
    pub(super) mask: N::Mask,
    pub(super) reflectance: MicrofacetReflectance<N>,
    /// Mask of the lanes with isotropic microfacets that reflect by Fresnel's equations without a
    /// film. A table by the index of refraction holds their albedo.
    pub(super) tabulated_lanes: N::Mask,
}

/// Greatest ratio of the energy that microfacets under a film leave along the view to its mean.
/// Both are estimates by different tables. Where little light passes the microfacets, their errors
/// may exceed the mean; the limit keeps the base as dark as the mean.
const MOST_OVER_MEAN: f64 = 4.0;

/// Microfacets over a diffuse base, for one viewing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MicrofacetLayer<N: Number> {
    /// Energy that the microfacets do not reflect. It feeds the base and the multiple scattering.
    pub(super) energy_complement: EnergyComplement<N>,
    /// Mask of the SIMD lanes with anisotropic microfacets, and the distribution of their normals.
    pub(super) anisotropic: Option<(N::Mask, Ggx<N>)>,
    /// Reflectance of the lanes that do not follow Schlick's formula.
    pub(super) non_schlick: Option<NonSchlickReflectance<N>>,
    /// Reflectances at normal and at grazing incidence, for
    /// [`FresnelRule::Model`](super::FresnelRule::Model) alone: this rule weights the base by 1 −
    /// F, with the Fresnel reflectance F at the half vector. `None` under every other rule.
    pub(super) gltf_reflectances: Option<[N; 2]>,
}

impl<N: Number> MicrofacetLayer<N> {
    /// Returns the layer viewed along `wo`, a unit direction of the given cosine to the normal.
    pub(super) fn with_view(self, wo: N::Vec3, cosine: N) -> Self {
        let albedo = Albedo::mean_anisotropic(self.energy_complement.roughness, &self.anisotropic);
        let [mut base, lost] = self.energy_complement.unreflected_energy(albedo);
        if let Some(curve) = self.non_schlick {
            let mean = match &self.anisotropic {
                None => {
                    cosine_weighted_mean(|cosine| self.unreflected_energy(N::Vec3::ZERO, cosine)[0])
                }
                Some((_, ggx)) => {
                    let frame = ggx.frame();
                    // By symmetry a quarter of the azimuths represents the whole circle.
                    let turns = [1.0, 3.0, 5.0, 7.0]
                        .map(|eighth| N::from_f64(eighth / 32.0).sin_cos_turns());
                    cosine_weighted_mean(|cosine| {
                        let sine = (N::ONE - cosine * cosine).max(N::ZERO).sqrt();
                        let direction = |[x, y]: [N; 2]| {
                            frame.to_world(N::Vec3::new(sine * x, sine * y, cosine))
                        };
                        let value_of =
                            |turn: &[N; 2]| self.unreflected_energy(direction(*turn), cosine)[0];
                        turns
                            .iter()
                            .map(value_of)
                            .fold(N::ZERO, |sum, base| sum + base)
                            * N::from_f64(0.25)
                    })
                }
            };
            base = N::select(curve.mask, mean, base);
            base = N::select(
                curve.tabulated_lanes,
                self.unreflected_energy_by_fresnel(&curve, albedo, None),
                base,
            );
        }
        let left = self.unreflected_energy(wo, cosine);
        let has_film = |curve: &NonSchlickReflectance<N>| curve.reflectance.film.is_some();
        if self.non_schlick.as_ref().is_some_and(has_film) {
            base = base.max(left[0] / N::from_f64(MOST_OVER_MEAN));
        }
        Self {
            energy_complement: self.energy_complement.with_view_energy(left, [base, lost]),
            ..self
        }
    }

    /// Returns two shares of energy for a direction of the given cosine to the normal:
    /// - the energy that passes the microfacets to the base;
    /// - the energy that white microfacets lose in a single reflection.
    fn unreflected_energy(&self, direction: N::Vec3, cosine: N) -> [N; 2] {
        let albedo = Albedo::at_cosine_anisotropic(
            direction,
            cosine,
            self.energy_complement.roughness,
            &self.anisotropic,
        );
        let [plain, lost] = self.energy_complement.unreflected_energy(albedo);
        let Some(curve) = &self.non_schlick else {
            return [plain, lost];
        };
        let sent = || {
            let film_cosine = curve.reflectance.film.map(|_| cosine);
            let reflectance = |cosine| curve.reflectance.eval(cosine).max_element();
            albedo.albedo_for_reflectance(reflectance, film_cosine)
        };
        let read = if (curve.mask & !curve.tabulated_lanes).any_lane() {
            self.energy_complement
                .unreflected_energy_for_albedo(sent(), lost)[0]
        } else {
            plain
        };
        let base = N::select(
            curve.tabulated_lanes,
            self.unreflected_energy_by_fresnel(curve, albedo, Some(cosine)),
            N::select(curve.mask, read, plain),
        );
        [base, lost]
    }

    /// Returns the share of energy that passes the microfacets to the base, for microfacets with
    /// Fresnel's equations. The table of rough boundaries gives the share at `cosine`; `None`
    /// selects the mean over the hemisphere.
    fn unreflected_energy_by_fresnel(
        &self,
        curve: &NonSchlickReflectance<N>,
        albedo: Albedo<N>,
        cosine: Option<N>,
    ) -> N {
        let (Some(index), roughness) = (curve.reflectance.exact, self.energy_complement.roughness)
        else {
            return N::ZERO;
        };
        let sent = |lane: usize| {
            let index = N::f64_lane(index, lane).max(1.0);
            rough_boundary_tables::fresnel_albedo(
                index,
                roughness.lane(lane),
                cosine.map(|cosine| cosine.lane(lane)),
            )
        };
        let scattered = self.energy_complement.fresnel_layer_albedo(
            N::from_lanes(sent),
            curve.reflectance.f0_from_ior(),
            albedo,
        );
        self.energy_complement
            .unreflected_energy_for_albedo(scattered, albedo.multiple_scattering_loss)[0]
    }

    /// Returns the BRDFs, times π, of a white base below the microfacets and of the multiple
    /// scattering among white microfacets.
    fn diffuse_factors(&self, directions: &Directions<N>) -> [N; 2] {
        let into = directions.cos_wi.max(-directions.cos_wi);
        let ([base, lost], seen) = (
            self.unreflected_energy(directions.wi, into),
            self.energy_complement.view_factors,
        );
        let literal = |[f0, f90]: [N; 2]| {
            N::ONE - (f0 + (f90 - f0) * schlick_weight(directions.with_wi_above().cos_half))
        };
        [
            self.gltf_reflectances.map_or(base * seen[0], literal),
            lost * seen[1],
        ]
    }
}

impl<N: Number> DiffuseBase<N> {
    /// Returns the probability of sampling a reflected direction. A transmitted direction is
    /// sampled with one minus this probability.
    fn reflection_probability(&self) -> N {
        let (back, through) = (
            (self.reflectance + self.multiple_scattering).max_element(),
            self.transmittance.max_element(),
        );
        let some = (back + through).greater_than(N::ZERO);
        if self.transmits {
            N::select(some, back / (back + through), N::ONE)
        } else {
            N::ONE
        }
    }
}

impl<N: Number> ScatteringLobe<N> for DiffuseBase<N> {
    fn importance(&self, _: N) -> N {
        let [base, lost] = self.microfacets.energy_complement.view_energy;
        let base = if self.microfacets.gltf_reflectances.is_some() {
            N::ONE
        } else {
            base
        };
        ((self.reflectance + self.transmittance) * base + self.multiple_scattering * lost)
            .max_element()
    }

    fn is_transmissive(&self) -> bool {
        self.transmits
    }

    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let ([base, lost], pi) = (
            self.microfacets.diffuse_factors(directions),
            N::from_f64(PI),
        );
        (
            (self.reflectance * base + self.multiple_scattering * lost) / pi,
            self.reflection_probability() * directions.cos_wi / pi,
        )
    }

    fn eval_diffuse(&self, directions: &Directions<N>) -> N::Vec3 {
        self.reflectance * (self.microfacets.diffuse_factors(directions)[0] / N::from_f64(PI))
    }

    fn eval_transmission_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        if !self.transmits {
            return (N::Vec3::ZERO, N::ZERO);
        }
        let pi = N::from_f64(PI);
        (
            self.transmittance * (self.microfacets.diffuse_factors(directions)[0] / pi),
            (N::ONE - self.reflection_probability()) * -directions.cos_wi / pi,
        )
    }

    fn sample(
        &self,
        frame: &ShadingFrame<N>,
        _: N::Vec3,
        _: N::Vec3,
        choice: N,
        point: [N; 2],
    ) -> N::Vec3 {
        sample_cosine_either_side::<N>(
            frame,
            self.reflection_probability().greater_than(choice),
            point,
        )
    }
}
