//! What the facets of a rough boundary send to each other, and then back or on: the light that they
//! lose who meet it once.
//!
//! With L(o) the share of light from o that is lost, and L̄ its mean by the cosine,
//! L(o)·L(i)/(π·L̄) for each side gives back what L has taken, to the side in the share of each
//! ("Revisiting Physically Based Shading at Imageworks", Kulla, Conty 2017). Between sides it is
//! the same both ways, but for the square of the index, where the share that goes through is as the
//! étendue of what is lost: n²·L̄·t on both.

use core::f64::consts::PI;

use super::albedo::Albedo;
use super::boundary;
use super::energy::mean_of;
use super::frame::Frame;
use super::ggx::Ggx;
use super::lobe_kind::{LobeKind, Pair, cosine_sample_either};
use crate::number::{Number, Vector3};

/// Least mean that is told from none.
const LEAST_MEAN: f64 = 1e-6;

/// Facets that lose light.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Losing<N: Number> {
    /// Of a boundary: the index on the side of the view over the other, and the least and the most
    /// of Fresnel's share that they reflect.
    Boundary { eta: N, tint: [N::Vec3; 2] },
    /// Of a wall, whose two sides have the same ones; where they are rougher one way, and those.
    Wall {
        anisotropic: Option<(N::Mask, Ggx<N>)>,
    },
}

/// What facets that are seen from one direction lost, sent back and on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interreflected<N: Number> {
    facets: Losing<N>,
    roughness: N,
    /// Factors of what the direction of light loses: of what is sent back, and of what is sent on.
    back: N::Vec3,
    on: N::Vec3,
    /// What is sent back and on, in the strongest channel.
    shown: [N; 2],
}

impl<N: Number> Interreflected<N> {
    /// Of a boundary in a share of a surface, seen at a cosine.
    pub(super) fn of_boundary(
        eta: N,
        roughness: N,
        [share, cosine]: [N; 2],
        tint: [N::Vec3; 2],
        transmitted: N::Vec3,
    ) -> Self {
        let one = N::Vec3::ONE;
        let facets = Losing::Boundary { eta, tint };
        let bare = Self {
            facets,
            roughness,
            back: one,
            on: one,
            shown: [N::ONE; 2],
        };
        let [own, beyond] =
            [eta, N::ONE / eta].map(|eta| bare.of_boundary_towards(eta, tint, None));
        // What a smooth boundary lets through in the mean.
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

    /// Of a thin wall in a share of a surface, which reflects so much in the mean, seen along `wo`.
    pub(super) fn of_wall(
        roughness: N,
        anisotropic: Option<(N::Mask, Ggx<N>)>,
        share: N,
        wo: [N::Vec3; 2],
        [mean, transmitted]: [N::Vec3; 2],
    ) -> Self {
        let one = N::Vec3::ONE;
        let bare = Self {
            facets: Losing::Wall { anisotropic },
            roughness,
            back: one,
            on: one,
            shown: [N::ONE; 2],
        };
        let lost = Albedo::mean_of_either(roughness, &anisotropic).lost;
        let [wo, normal] = wo;
        let seen = bare.towards(wo, normal.dot(wo), false) * share;
        bare.seen(
            seen,
            [mean, (one - mean) * transmitted],
            [N::Vec3::splat(lost); 2],
        )
    }

    /// Seen where so much is lost, of which shares go to each side, with such means of what these
    /// lose.
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
        // The lesser one where it varies, so that nothing makes light.
        let [least, most] = tint.map(|tint| clear + tint * (both.x() - both.y()));
        least.min(most).max(N::Vec3::ZERO).min(N::Vec3::ONE)
    }

    /// Share that is lost of light from a direction with this cosine, on the side of the view or
    /// beyond.
    fn towards(&self, direction: N::Vec3, cosine: N, beyond: bool) -> N::Vec3 {
        match &self.facets {
            Losing::Boundary { eta, tint } => self.of_boundary_towards(
                if beyond { N::ONE / *eta } else { *eta },
                *tint,
                Some(cosine),
            ),
            Losing::Wall { anisotropic } => N::Vec3::splat(
                Albedo::towards_either(direction, cosine, self.roughness, anisotropic).lost,
            ),
        }
    }

    /// Chance that a direction is drawn on the side of the view.
    fn back_share(&self) -> N {
        let sum = self.shown[0] + self.shown[1];
        N::select(sum.above(N::ZERO), self.shown[0] / sum, N::ONE)
    }
}

/// One over means, none of which is told from less than the least.
pub(super) fn inverse<N: Number>(of: N::Vec3) -> N::Vec3 {
    let one = |mean: N| N::ONE / mean.max(N::from_f64(LEAST_MEAN));
    N::Vec3::new(one(of.x()), one(of.y()), one(of.z()))
}

/// Mean of a reflectance that is said of cosines, over the hemisphere.
pub(super) fn mean_reflectance<N: Number>(of: impl Fn(N) -> N::Vec3) -> N::Vec3 {
    let channel = |k: fn(N::Vec3) -> N| mean_of(|cosine| k(of(cosine)));
    N::Vec3::new(channel(|v| v.x()), channel(|v| v.y()), channel(|v| v.z()))
}

impl<N: Number> LobeKind<N> for Interreflected<N> {
    fn importance(&self, _: N) -> N {
        self.shown[0] + self.shown[1]
    }

    fn lets_through(&self) -> bool {
        true
    }

    fn eval_and_pdf(&self, pair: &Pair<N>) -> (N::Vec3, N) {
        (
            self.back * self.towards(pair.wi, pair.into, false),
            self.back_share() * pair.into / N::from_f64(PI),
        )
    }

    fn eval_and_pdf_through(&self, pair: &Pair<N>) -> (N::Vec3, N) {
        let below = -pair.into;
        (
            self.on * self.towards(pair.wi, below, true),
            (N::ONE - self.back_share()) * below / N::from_f64(PI),
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
