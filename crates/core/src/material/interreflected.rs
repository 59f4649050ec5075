//! Multiple scattering among the microfacets of a rough boundary. A reflected and a transmitted
//! lobe return the energy that single scattering loses.
//!
//! Let L(o) be the share of light from o that single scattering loses, and L̄ its cosine-weighted
//! mean. The lobes L(o)·L(i)/(π·L̄) of the two sides, times the shares r and t with r + t = 1,
//! return the loss ("Revisiting Physically Based Shading at Imageworks", Kulla, Conty 2017). The
//! transmitted lobe is reciprocal, up to the square of the index, if n²·L̄·t is equal on both
//! sides.

use core::f64::consts::PI;

use super::albedo::Albedo;
use super::boundary;
use super::energy::mean_of;
use super::frame::ShadingFrame;
use super::ggx::Ggx;
use super::lobe_kind::{Directions, LobeKind, cosine_sample_either};
use crate::number::{Number, Vector3};

/// Lower limit of a mean that divides.
const LEAST_MEAN: f64 = 1e-6;

/// Kind of the boundary whose microfacets scatter.
#[derive(Clone, Copy, Debug, PartialEq)]
enum LossyGgx<N: Number> {
    /// A dielectric boundary: `eta` is the index on the view's side over the index on the far side,
    /// `tint` the least and the greatest ratio of the reflectance to the Fresnel reflectance.
    Boundary { eta: N, tint: [N::Vec3; 2] },
    /// A thin wall, equal on both sides, with the mask of the lanes whose microfacets are
    /// anisotropic.
    Wall {
        anisotropic: Option<(N::Mask, Ggx<N>)>,
    },
}

/// Lobe of the multiple scattering among the microfacets of a boundary, for one viewing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interreflected<N: Number> {
    lossy_ggx: LossyGgx<N>,
    roughness: N,
    /// Factor on the lost share L(i) of the light, for reflection.
    back: N::Vec3,
    /// Factor on the lost share L(i) of the light, for transmission.
    on: N::Vec3,
    /// Reflected and transmitted share of the light along the view, in the strongest channel.
    shown: [N; 2],
}

impl<N: Number> Interreflected<N> {
    /// Creates the lobe of a dielectric boundary that covers a share of the surface, for the cosine
    /// of the view. `eta` and `tint` are as in [`LossyGgx::Boundary`].
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
        // Mean reflectance of a smooth boundary on its side of lower index, and a factor on the
        // mean transmittance: 1 on the side of lower index, 1/η² on the side of higher index.
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

    /// Creates the lobe of a thin wall that covers a share of the surface. `wo` holds the viewing
    /// direction and the normal, the last argument the wall's mean reflectance and its factor on
    /// the transmission.
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

    /// Returns the lobe for a viewing direction. `lost` is the share of light along this direction
    /// that single scattering loses, `shares` divides it between reflection and transmission, and
    /// `means` holds the mean loss on each side.
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

    /// Returns the share of light that a dielectric boundary loses by single scattering, at a
    /// cosine on the side with the relative index `eta`; `None` for the mean over the hemisphere.
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
        // Of the values for the least and the greatest tint, the lesser gains no energy.
        let [least, most] = tint.map(|tint| clear + tint * (both.x() - both.y()));
        least.min(most).max(N::Vec3::ZERO).min(N::Vec3::ONE)
    }

    /// Returns the share of light from a direction that single scattering loses. The direction lies
    /// on the view's side, or on the far side where `beyond`.
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

    /// Returns the probability of sampling a reflected direction.
    fn back_share(&self) -> N {
        let sum = self.shown[0] + self.shown[1];
        N::select(sum.greater_than(N::ZERO), self.shown[0] / sum, N::ONE)
    }
}

/// Returns the inverse of each component, which is first raised to at least [`LEAST_MEAN`].
pub(super) fn inverse<N: Number>(of: N::Vec3) -> N::Vec3 {
    let one = |mean: N| N::ONE / mean.max(N::from_f64(LEAST_MEAN));
    N::Vec3::new(one(of.x()), one(of.y()), one(of.z()))
}

/// Returns the cosine-weighted mean over the hemisphere of a reflectance that depends on the
/// cosine.
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
