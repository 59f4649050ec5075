//! What lies below the facets of a layered surface: what it diffuses back and on of the light that
//! they leave, and what they send to each other.

use core::f64::consts::PI;

use super::albedo::Albedo;
use super::boundary;
use super::energy::{Remainder, mean_of};
use super::frame::Frame;
use super::fresnel::schlick_weight;
use super::ggx::Ggx;
use super::lobe_kind::{LobeKind, Pair, cosine_sample_either};
use super::reflectance::Reflectance;
use crate::number::{Mask, Number, Vector3};

/// The base of a layered surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseBase<N: Number> {
    /// Share that is diffused back, and what is let through diffusely.
    pub(super) back: N::Vec3,
    pub(super) through: N::Vec3,
    /// Factor of what white facets send to each other.
    pub(super) interreflected: N::Vec3,
    /// Whether something is let through.
    pub(super) both: bool,
    pub(super) top: DiffuseCover<N>,
}

/// How a layer of facets reflects that does not go by Schlick's way between two numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve<N: Number> {
    /// Where it does.
    pub(super) mask: N::Mask,
    pub(super) reflectance: Reflectance<N>,
    /// Where Fresnel's equations alone say how, of facets that are as rough any way, so that what
    /// they send back is tabulated by the index.
    pub(super) tabled: N::Mask,
}

/// The layer of facets over a base, seen from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseCover<N: Number> {
    pub(super) remainder: Remainder<N>,
    /// Where facets are rougher one way, and those.
    pub(super) anisotropic: Option<(N::Mask, Ggx<N>)>,
    /// Where the layer does not reflect by Schlick's way between two numbers.
    pub(super) curve: Option<Curve<N>>,
    /// Reflectances at normal and grazing incidence of glTF's sample formula, which leaves 1 − F by
    /// the half vector.
    pub(super) literal: Option<[N; 2]>,
}

impl<N: Number> DiffuseCover<N> {
    /// It as it is seen along `wo` at a cosine.
    pub(super) fn seen(self, wo: N::Vec3, cosine: N) -> Self {
        let albedo = Albedo::mean_of_either(self.remainder.roughness, &self.anisotropic);
        let [mut base, lost] = self.remainder.left(albedo);
        if let Some(curve) = self.curve {
            let mean = match &self.anisotropic {
                None => mean_of(|cosine| self.left(N::Vec3::ZERO, cosine)[0]),
                Some((_, facets)) => {
                    let frame = facets.frame();
                    // The quarter of all azimuths is that of any of them.
                    let turns =
                        [1.0, 3.0, 5.0, 7.0].map(|eighth| N::from_f64(eighth / 32.0).turned());
                    mean_of(|cosine| {
                        let sine = (N::ONE - cosine * cosine).max(N::ZERO).sqrt();
                        let towards = |[x, y]: [N; 2]| {
                            frame.to_world(N::Vec3::new(sine * x, sine * y, cosine))
                        };
                        let of = |turn: &[N; 2]| self.left(towards(*turn), cosine)[0];
                        turns.iter().map(of).fold(N::ZERO, |sum, base| sum + base)
                            * N::from_f64(0.25)
                    })
                }
            };
            base = N::select(curve.mask, mean, base);
            base = N::select(curve.tabled, self.tabled(&curve, albedo, None), base);
        }
        Self {
            remainder: self.remainder.seen(self.left(wo, cosine), [base, lost]),
            ..self
        }
    }

    /// What is left towards a direction and its cosine: by the layer, and by white facets.
    fn left(&self, direction: N::Vec3, cosine: N) -> [N; 2] {
        let albedo = Albedo::towards_either(
            direction,
            cosine,
            self.remainder.roughness,
            &self.anisotropic,
        );
        let [plain, lost] = self.remainder.left(albedo);
        let Some(curve) = &self.curve else {
            return [plain, lost];
        };
        let sent = || albedo.sent_by(|cosine| curve.reflectance.at(cosine).max_element());
        let read = if (curve.mask & !curve.tabled).any() {
            self.remainder.left_of(sent(), lost)[0]
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

    /// What is left where facets reflect by Fresnel's equations: towards a cosine, or in the mean.
    fn tabled(&self, curve: &Curve<N>, albedo: Albedo<N>, cosine: Option<N>) -> N {
        let (Some(index), roughness) = (curve.reflectance.exact, self.remainder.roughness) else {
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
        let sent =
            self.remainder
                .sent_exactly(N::of_lanes(sent), curve.reflectance.at_normal(), albedo);
        self.remainder.left_of(sent, albedo.lost)[0]
    }

    /// Factors of 1/π: of what a white base sends back, and of what white facets send to each
    /// other.
    fn factors(&self, pair: &Pair<N>) -> [N; 2] {
        let into = pair.into.max(-pair.into);
        let ([base, lost], seen) = (self.left(pair.wi, into), self.remainder.seen);
        let literal =
            |[f0, f90]: [N; 2]| N::ONE - (f0 + (f90 - f0) * schlick_weight(pair.folded().tilt));
        [self.literal.map_or(base * seen[0], literal), lost * seen[1]]
    }
}

impl<N: Number> DiffuseBase<N> {
    /// Chance that what is sent both ways is sent back.
    fn back_share(&self) -> N {
        let (back, through) = (
            (self.back + self.interreflected).max_element(),
            self.through.max_element(),
        );
        let some = (back + through).above(N::ZERO);
        if self.both {
            N::select(some, back / (back + through), N::ONE)
        } else {
            N::ONE
        }
    }
}

impl<N: Number> LobeKind<N> for DiffuseBase<N> {
    fn importance(&self, _: N) -> N {
        let [base, lost] = self.top.remainder.shown;
        let base = if self.top.literal.is_some() {
            N::ONE
        } else {
            base
        };
        ((self.back + self.through) * base + self.interreflected * lost).max_element()
    }

    fn lets_through(&self) -> bool {
        self.both
    }

    fn eval_and_pdf(&self, pair: &Pair<N>) -> (N::Vec3, N) {
        let ([base, lost], pi) = (self.top.factors(pair), N::from_f64(PI));
        (
            (self.back * base + self.interreflected * lost) / pi,
            self.back_share() * pair.into / pi,
        )
    }

    fn eval_diffuse(&self, pair: &Pair<N>) -> N::Vec3 {
        self.back * (self.top.factors(pair)[0] / N::from_f64(PI))
    }

    fn eval_and_pdf_through(&self, pair: &Pair<N>) -> (N::Vec3, N) {
        if !self.both {
            return (N::Vec3::ZERO, N::ZERO);
        }
        let pi = N::from_f64(PI);
        (
            self.through * (self.top.factors(pair)[0] / pi),
            (N::ONE - self.back_share()) * -pair.into / pi,
        )
    }

    fn sample(
        &self,
        frame: &Frame<N>,
        _: N::Vec3,
        _: N::Vec3,
        choice: N,
        point: [N; 2],
    ) -> N::Vec3 {
        cosine_sample_either::<N>(frame, self.back_share().above(choice), point)
    }
}
