//! The diffuse lobe of a layered surface. It holds the diffuse reflection and transmission of the
//! light that passes the microfacets, and the multiple scattering among the microfacets.

use core::f64::consts::PI;

use super::albedo::Albedo;
use super::boundary;
use super::energy::{EnergyComplement, mean_of};
use super::frame::ShadingFrame;
use super::fresnel::schlick_weight;
use super::ggx::Ggx;
use super::lobe_kind::{Directions, LobeKind, cosine_sample_either};
use super::reflectance::Reflectance;
use crate::number::{Mask, Number, Vector3};

/// The diffuse lobe below the microfacets of a layered surface, for one viewing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseBase<N: Number> {
    /// Diffuse reflectance by channel.
    pub(super) back: N::Vec3,
    /// Diffuse transmittance by channel.
    pub(super) through: N::Vec3,
    /// Factor on the multiple scattering among white microfacets.
    pub(super) interreflected: N::Vec3,
    /// Whether the base transmits light.
    pub(super) both: bool,
    /// The microfacets over the base.
    pub(super) top: DiffuseCover<N>,
}

/// Reflectance of microfacets that do not follow Schlick's formula: Fresnel's equations or a thin
/// film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve<N: Number> {
    /// Lanes with this reflectance; all others follow Schlick's formula.
    pub(super) mask: N::Mask,
    pub(super) reflectance: Reflectance<N>,
    /// Lanes of isotropic microfacets that reflect by Fresnel's equations alone. Their albedo is
    /// tabulated by the index of refraction.
    pub(super) tabled: N::Mask,
}

/// The microfacet layer over a base, for one viewing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseCover<N: Number> {
    pub(super) energy_complement: EnergyComplement<N>,
    /// Mask of the lanes with anisotropic microfacets, and these microfacets.
    pub(super) anisotropic: Option<(N::Mask, Ggx<N>)>,
    /// Reflectance of the lanes that do not follow Schlick's formula.
    pub(super) curve: Option<Curve<N>>,
    /// Reflectances at normal and at grazing incidence, for glTF's sample formula alone: the base
    /// is then weighted by 1 − F at the half vector.
    pub(super) literal: Option<[N; 2]>,
}

impl<N: Number> DiffuseCover<N> {
    /// Returns the layer viewed along `wo`, a unit direction of the given cosine to the normal.
    pub(super) fn seen(self, wo: N::Vec3, cosine: N) -> Self {
        let albedo = Albedo::mean_of_either(self.energy_complement.roughness, &self.anisotropic);
        let [mut base, lost] = self.energy_complement.remaining(albedo);
        if let Some(curve) = self.curve {
            let mean = match &self.anisotropic {
                None => mean_of(|cosine| self.left(N::Vec3::ZERO, cosine)[0]),
                Some((_, ggx)) => {
                    let frame = ggx.frame();
                    // By symmetry a quarter of the azimuths represents all.
                    let turns = [1.0, 3.0, 5.0, 7.0]
                        .map(|eighth| N::from_f64(eighth / 32.0).sin_cos_turns());
                    mean_of(|cosine| {
                        let sine = (N::ONE - cosine * cosine).max(N::ZERO).sqrt();
                        let direction = |[x, y]: [N; 2]| {
                            frame.to_world(N::Vec3::new(sine * x, sine * y, cosine))
                        };
                        let value_of = |turn: &[N; 2]| self.left(direction(*turn), cosine)[0];
                        turns
                            .iter()
                            .map(value_of)
                            .fold(N::ZERO, |sum, base| sum + base)
                            * N::from_f64(0.25)
                    })
                }
            };
            base = N::select(curve.mask, mean, base);
            base = N::select(curve.tabled, self.tabled(&curve, albedo, None), base);
        }
        Self {
            energy_complement: self
                .energy_complement
                .seen_with(self.left(wo, cosine), [base, lost]),
            ..self
        }
    }

    /// Returns two shares of energy for a direction of the given cosine: the energy that passes the
    /// layer to the base, and the energy that white microfacets lose in a single reflection.
    fn left(&self, direction: N::Vec3, cosine: N) -> [N; 2] {
        let albedo = Albedo::at_cosine_either(
            direction,
            cosine,
            self.energy_complement.roughness,
            &self.anisotropic,
        );
        let [plain, lost] = self.energy_complement.remaining(albedo);
        let Some(curve) = &self.curve else {
            return [plain, lost];
        };
        let sent = || albedo.sent_by(|cosine| curve.reflectance.at(cosine).max_element());
        let read = if (curve.mask & !curve.tabled).any() {
            self.energy_complement.remaining_of(sent(), lost)[0]
        } else {
            plain
        };
        let base = N::select(
            curve.tabled,
            self.tabled(curve, albedo, Some(cosine)),
            N::select(curve.mask, read, plain),
        );
        [base, lost]
    }

    /// Returns the share of energy that passes microfacets with Fresnel's equations to the base, by
    /// the table; at a cosine, or as the mean over the hemisphere for `None`.
    fn tabled(&self, curve: &Curve<N>, albedo: Albedo<N>, cosine: Option<N>) -> N {
        let (Some(index), roughness) = (curve.reflectance.exact, self.energy_complement.roughness)
        else {
            return N::ZERO;
        };
        let sent = |lane: usize| {
            let index = N::exact_lane(index, lane).max(1.0);
            boundary::reflected(
                index,
                roughness.lane(lane),
                cosine.map(|cosine| cosine.lane(lane)),
            )
        };
        let scattered = self.energy_complement.sent_exactly(
            N::of_lanes(sent),
            curve.reflectance.at_normal(),
            albedo,
        );
        self.energy_complement.remaining_of(scattered, albedo.lost)[0]
    }

    /// Returns two factors for a pair of directions. Times 1/π, they are the BRDF of a white base,
    /// and the BRDF of the multiple scattering among white microfacets.
    fn factors(&self, directions: &Directions<N>) -> [N; 2] {
        let into = directions.into.max(-directions.into);
        let ([base, lost], seen) = (
            self.left(directions.wi, into),
            self.energy_complement.view_factors,
        );
        let literal = |[f0, f90]: [N; 2]| {
            N::ONE - (f0 + (f90 - f0) * schlick_weight(directions.folded().tilt))
        };
        [self.literal.map_or(base * seen[0], literal), lost * seen[1]]
    }
}

impl<N: Number> DiffuseBase<N> {
    /// Returns the probability of sampling the reflection; the rest is the probability of sampling
    /// the transmission.
    fn back_share(&self) -> N {
        let (back, through) = (
            (self.back + self.interreflected).max_element(),
            self.through.max_element(),
        );
        let some = (back + through).greater_than(N::ZERO);
        if self.both {
            N::select(some, back / (back + through), N::ONE)
        } else {
            N::ONE
        }
    }
}

impl<N: Number> LobeKind<N> for DiffuseBase<N> {
    fn importance(&self, _: N) -> N {
        let [base, lost] = self.top.energy_complement.shown;
        let base = if self.top.literal.is_some() {
            N::ONE
        } else {
            base
        };
        ((self.back + self.through) * base + self.interreflected * lost).max_element()
    }

    fn is_transmissive(&self) -> bool {
        self.both
    }

    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let ([base, lost], pi) = (self.top.factors(directions), N::from_f64(PI));
        (
            (self.back * base + self.interreflected * lost) / pi,
            self.back_share() * directions.into / pi,
        )
    }

    fn eval_diffuse(&self, directions: &Directions<N>) -> N::Vec3 {
        self.back * (self.top.factors(directions)[0] / N::from_f64(PI))
    }

    fn eval_and_pdf_through(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        if !self.both {
            return (N::Vec3::ZERO, N::ZERO);
        }
        let pi = N::from_f64(PI);
        (
            self.through * (self.top.factors(directions)[0] / pi),
            (N::ONE - self.back_share()) * -directions.into / pi,
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
        cosine_sample_either::<N>(frame, self.back_share().greater_than(choice), point)
    }
}
