//! The diffuse base below the microfacets of a layered surface: diffuse reflection and transmission
//! of the light that the microfacets let in, and the multiple scattering among the microfacets.

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

/// The base of a layered surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseBase<N: Number> {
    /// Diffuse reflectance, and diffuse transmittance.
    pub(super) back: N::Vec3,
    pub(super) through: N::Vec3,
    /// Factor of the multiple scattering among white microfacets.
    pub(super) interreflected: N::Vec3,
    /// Whether the base transmits light.
    pub(super) both: bool,
    pub(super) top: DiffuseCover<N>,
}

/// Reflectance of a microfacet layer that Schlick's formula does not describe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve<N: Number> {
    /// Lanes of this reflectance.
    pub(super) mask: N::Mask,
    pub(super) reflectance: Reflectance<N>,
    /// Lanes of isotropic microfacets that reflect by Fresnel's equations alone; their albedo is
    /// tabulated by the index.
    pub(super) tabled: N::Mask,
}

/// The microfacet layer over a base, for one viewing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseCover<N: Number> {
    pub(super) energy_complement: EnergyComplement<N>,
    /// Lanes of anisotropic microfacets, and those microfacets.
    pub(super) anisotropic: Option<(N::Mask, Ggx<N>)>,
    /// Reflectance in the lanes that do not follow Schlick's formula.
    pub(super) curve: Option<Curve<N>>,
    /// Reflectances at normal and grazing incidence of glTF's sample formula, where the base gets 1
    /// − F at the half vector.
    pub(super) literal: Option<[N; 2]>,
}

impl<N: Number> DiffuseCover<N> {
    /// The layer as viewed along `wo`, at a cosine.
    pub(super) fn seen(self, wo: N::Vec3, cosine: N) -> Self {
        let albedo = Albedo::mean_of_either(self.energy_complement.roughness, &self.anisotropic);
        let [mut base, lost] = self.energy_complement.remaining(albedo);
        if let Some(curve) = self.curve {
            let mean = match &self.anisotropic {
                None => mean_of(|cosine| self.left(N::Vec3::ZERO, cosine)[0]),
                Some((_, ggx)) => {
                    let frame = ggx.frame();
                    // By symmetry one quarter of the azimuths stands for all.
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

    /// Energy that remains for a direction and its cosine: below the layer, and the loss of white
    /// microfacets.
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

    /// Energy that remains below microfacets that reflect by Fresnel's equations: for a cosine, or
    /// in the mean.
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

    /// Factors of 1/π: of the reflection by a white base, and of the multiple scattering among
    /// white microfacets.
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
    /// Probability of reflection where the base both reflects and transmits.
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
