//! Multiple scattering among the microfacets of a rough boundary, reflected or transmitted: the
//! energy that single scattering loses.
//!
//! With L(o) the lost share of light from o and L̄ its cosine-weighted mean, the lobe
//! L(o)·L(i)/(π·L̄) on each side returns the loss, divided between the sides ("Revisiting
//! Physically Based Shading at Imageworks", Kulla, Conty 2017). Between sides the lobe is
//! reciprocal, up to the square of the index, if the transmitted share follows the étendue of the
//! loss: n²·L̄·t is equal on both sides.

use core::f64::consts::PI;

use super::albedo::Albedo;
use super::boundary;
use super::energy::mean_of;
use super::frame::ShadingFrame;
use super::ggx::Ggx;
use super::lobe_kind::{Directions, LobeKind, cosine_sample_either};
use crate::number::{Number, Vector3};

/// Least mean that counts as above zero.
const LEAST_MEAN: f64 = 1e-6;

/// The microfacets.
#[derive(Clone, Copy, Debug, PartialEq)]
enum LossyGgx<N: Number> {
    /// Microfacets of a boundary: the index on the view's side over the other, and the least and
    /// the greatest ratio to the Fresnel reflectance.
    Boundary { eta: N, tint: [N::Vec3; 2] },
    /// Microfacets of a thin wall, the same on both sides; with the lanes of anisotropic
    /// microfacets.
    Wall {
        anisotropic: Option<(N::Mask, Ggx<N>)>,
    },
}

/// Multiple scattering for one viewing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interreflected<N: Number> {
    lossy_ggx: LossyGgx<N>,
    roughness: N,
    /// Factors on the loss for the direction of light: of reflection, and of transmission.
    back: N::Vec3,
    on: N::Vec3,
    /// Reflected and transmitted share, in the strongest channel.
    shown: [N; 2],
}

impl<N: Number> Interreflected<N> {
    /// Multiple scattering at a boundary that covers a share of a surface, for a viewing cosine.
    pub(super) fn of_boundary(
        eta: N,
        roughness: N,
        [share, cosine]: [N; 2],
        tint: [N::Vec3; 2],
        transmitted: N::Vec3,
    ) -> Self {
        let one = N::Vec3::ONE;
        let lossy_ggx = LossyGgx::Boundary { eta, tint };
        let bare = Self {
            lossy_ggx,
            roughness,
            back: one,
            on: one,
            shown: [N::ONE; 2],
        };
        let [own, beyond] =
            [eta, N::ONE / eta].map(|eta| bare.of_boundary_towards(eta, tint, None));
        // Mean transmission of a smooth boundary.
        let smooth = |lane: usize| {
            let eta = eta.lane(lane);
            [
                boundary::mean_reflectance(eta.max(1.0 / eta)),
                (1.0 / eta).min(1.0).powi(2),
            ]
        };
        let (mean, dense) = (
            N::of_lanes(|lane| smooth(lane)[0]),
            N::of_lanes(|lane| smooth(lane)[1]),
        );
        let through = (one - tint[0] * mean).max(N::Vec3::ZERO)
            * dense
            * (own.min(beyond) * inverse::<N>(own));
        bare.seen(
            bare.of_boundary_towards(eta, tint, Some(cosine)) * share,
            [one - through, through * transmitted],
            [own, beyond],
        )
    }

    /// Multiple scattering at a thin wall that covers a share of a surface, viewed along `wo`; with
    /// the wall's mean reflectance.
    pub(super) fn of_wall(
        roughness: N,
        anisotropic: Option<(N::Mask, Ggx<N>)>,
        share: N,
        wo: [N::Vec3; 2],
        [mean, transmitted]: [N::Vec3; 2],
    ) -> Self {
        let one = N::Vec3::ONE;
        let bare = Self {
            lossy_ggx: LossyGgx::Wall { anisotropic },
            roughness,
            back: one,
            on: one,
            shown: [N::ONE; 2],
        };
        let lost = Albedo::mean_of_either(roughness, &anisotropic).lost;
        let [wo, normal] = wo;
        let seen = bare.lost_towards(wo, normal.dot(wo), false) * share;
        bare.seen(
            seen,
            [mean, (one - mean) * transmitted],
            [N::Vec3::splat(lost); 2],
        )
    }

    /// Sets the viewing direction by its loss, the shares of reflection and transmission, and the
    /// mean loss on each side.
    fn seen(self, lost: N::Vec3, shares: [N::Vec3; 2], means: [N::Vec3; 2]) -> Self {
        let [back, on] =
            [0, 1].map(|k| lost * shares[k] * inverse::<N>(means[k]) / N::from_f64(PI));
        Self {
            back,
            on,
            shown: shares.map(|share| (lost * share).max_element()),
            ..self
        }
    }

    fn of_boundary_towards(&self, eta: N, tint: [N::Vec3; 2], cosine: Option<N>) -> N::Vec3 {
        let both = <N::Vec3 as Vector3<N>>::of_lanes(|lane| {
            let [whole, clear] = boundary::lost(
                eta.lane(lane),
                self.roughness.lane(lane),
                cosine.map(|cosine| cosine.lane(lane)),
            );
            glam::DVec3::new(whole, clear, 0.0)
        });
        let clear = N::Vec3::splat(both.y());
        // The lesser value where the ratio varies, so that no energy is gained.
        let [least, most] = tint.map(|tint| clear + tint * (both.x() - both.y()));
        least.min(most).max(N::Vec3::ZERO).min(N::Vec3::ONE)
    }

    /// Lost share of light from a direction of this cosine, on the view's side or beyond.
    fn lost_towards(&self, direction: N::Vec3, cosine: N, beyond: bool) -> N::Vec3 {
        match &self.lossy_ggx {
            LossyGgx::Boundary { eta, tint } => self.of_boundary_towards(
                if beyond { N::ONE / *eta } else { *eta },
                *tint,
                Some(cosine),
            ),
            LossyGgx::Wall { anisotropic } => N::Vec3::splat(
                Albedo::at_cosine_either(direction, cosine, self.roughness, anisotropic).lost,
            ),
        }
    }

    /// Probability of sampling the view's side.
    fn back_share(&self) -> N {
        let sum = self.shown[0] + self.shown[1];
        N::select(sum.greater_than(N::ZERO), self.shown[0] / sum, N::ONE)
    }
}

/// Inverse of means, each clamped to the least mean.
pub(super) fn inverse<N: Number>(of: N::Vec3) -> N::Vec3 {
    let one = |mean: N| N::ONE / mean.max(N::from_f64(LEAST_MEAN));
    N::Vec3::new(one(of.x()), one(of.y()), one(of.z()))
}

/// Cosine-weighted mean over the hemisphere of a reflectance by cosine.
pub(super) fn mean_reflectance<N: Number>(value_of: impl Fn(N) -> N::Vec3) -> N::Vec3 {
    let channel = |k: fn(N::Vec3) -> N| mean_of(|cosine| k(value_of(cosine)));
    N::Vec3::new(channel(|v| v.x()), channel(|v| v.y()), channel(|v| v.z()))
}

impl<N: Number> LobeKind<N> for Interreflected<N> {
    fn importance(&self, _: N) -> N {
        self.shown[0] + self.shown[1]
    }

    fn is_transmissive(&self) -> bool {
        true
    }

    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        (
            self.back * self.lost_towards(directions.wi, directions.into, false),
            self.back_share() * directions.into / N::from_f64(PI),
        )
    }

    fn eval_and_pdf_through(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let below = -directions.into;
        (
            self.on * self.lost_towards(directions.wi, below, true),
            (N::ONE - self.back_share()) * below / N::from_f64(PI),
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
