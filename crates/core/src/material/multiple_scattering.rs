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
use super::energy::cosine_weighted_mean;
use super::frame::ShadingFrame;
use super::ggx::Ggx;
use super::lobe_kind::{Directions, ScatteringLobe, sample_cosine_either_side};
use crate::number::{Number, Vector3};

/// Lower limit of a mean by which another number is divided.
const LEAST_MEAN: f64 = 1e-6;

/// Kind of the boundary whose microfacets scatter.
#[derive(Clone, Copy, Debug, PartialEq)]
enum RoughBoundaryKind<N: Number> {
    /// A dielectric boundary: `eta` is the index on the view's side over the index on the far side,
    /// `tint` the least and the greatest ratio of the reflectance to the Fresnel reflectance.
    Boundary { eta: N, tint: [N::Vec3; 2] },
    /// A thin wall, equal on both sides, with the mask of the SIMD lanes whose microfacets are
    /// anisotropic.
    Wall {
        anisotropic: Option<(N::Mask, Ggx<N>)>,
    },
}

/// Lobe of the multiple scattering among the microfacets of a boundary, for one viewing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultipleScattering<N: Number> {
    boundary_kind: RoughBoundaryKind<N>,
    roughness: N,
    /// BRDF over L(i), the share of light from `wi` that single scattering loses.
    reflection_factor: N::Vec3,
    /// BTDF over L(i), the share of light from `wi` that single scattering loses.
    transmission_factor: N::Vec3,
    /// Reflected and transmitted share of the light along the view, in the strongest channel.
    view_shares: [N; 2],
}

impl<N: Number> MultipleScattering<N> {
    /// Creates the lobe of a dielectric boundary that covers a share of the surface, for the cosine
    /// of the view. `eta` and `tint` are as in [`RoughBoundaryKind::Boundary`].
    pub(super) fn for_boundary(
        eta: N,
        roughness: N,
        [share, cosine]: [N; 2],
        tint: [N::Vec3; 2],
        transmitted: N::Vec3,
    ) -> Self {
        let one = N::Vec3::ONE;
        let lossy_ggx = RoughBoundaryKind::Boundary { eta, tint };
        let bare = Self {
            boundary_kind: lossy_ggx,
            roughness,
            reflection_factor: one,
            transmission_factor: one,
            view_shares: [N::ONE; 2],
        };
        let [own, beyond] = [eta, N::ONE / eta].map(|eta| bare.boundary_loss(eta, tint, None));
        // Mean reflectance of a smooth boundary on its side of lower index, and a factor on the
        // mean transmittance: 1 on the side of lower index, 1/η² on the side of higher index.
        let smooth = |lane: usize| {
            let eta = eta.lane(lane);
            [
                boundary::smooth_mean_reflectance(eta.max(1.0 / eta)),
                (1.0 / eta).min(1.0).powi(2),
            ]
        };
        let (mean, dense) = (
            N::from_lanes(|lane| smooth(lane)[0]),
            N::from_lanes(|lane| smooth(lane)[1]),
        );
        let through = (one - tint[0] * mean).max(N::Vec3::ZERO)
            * dense
            * (own.min(beyond) * clamped_inverse::<N>(own));
        bare.with_view(
            bare.boundary_loss(eta, tint, Some(cosine)) * share,
            [one - through, through * transmitted],
            [own, beyond],
        )
    }

    /// Creates the lobe of a thin wall that covers a share of the surface. `wo` holds the viewing
    /// direction and the surface normal. The last argument holds the wall's mean reflectance and
    /// its factor on the transmission.
    pub(super) fn for_wall(
        roughness: N,
        anisotropic: Option<(N::Mask, Ggx<N>)>,
        share: N,
        wo: [N::Vec3; 2],
        [mean, transmitted]: [N::Vec3; 2],
    ) -> Self {
        let one = N::Vec3::ONE;
        let bare = Self {
            boundary_kind: RoughBoundaryKind::Wall { anisotropic },
            roughness,
            reflection_factor: one,
            transmission_factor: one,
            view_shares: [N::ONE; 2],
        };
        let lost = Albedo::mean_anisotropic(roughness, &anisotropic).multiple_scattering_loss;
        let [wo, normal] = wo;
        let seen = bare.lost_energy(wo, normal.dot(wo), false) * share;
        bare.with_view(
            seen,
            [mean, (one - mean) * transmitted],
            [N::Vec3::splat(lost); 2],
        )
    }

    /// Returns the lobe for a viewing direction. `lost` is the share of light along this direction
    /// that single scattering loses, `shares` divides it between reflection and transmission, and
    /// `means` holds the mean loss on each side.
    fn with_view(self, lost: N::Vec3, shares: [N::Vec3; 2], means: [N::Vec3; 2]) -> Self {
        let [back, on] =
            [0, 1].map(|k| lost * shares[k] * clamped_inverse::<N>(means[k]) / N::from_f64(PI));
        Self {
            reflection_factor: back,
            transmission_factor: on,
            view_shares: shares.map(|share| (lost * share).max_element()),
            ..self
        }
    }

    /// Returns the share of light that a dielectric boundary loses by single scattering, at a
    /// cosine on the side with the relative index `eta`; `None` for the mean over the hemisphere.
    fn boundary_loss(&self, eta: N, tint: [N::Vec3; 2], cosine: Option<N>) -> N::Vec3 {
        let both = <N::Vec3 as Vector3<N>>::from_lanes(|lane| {
            let [whole, clear] = boundary::single_scattering_loss(
                eta.lane(lane),
                self.roughness.lane(lane),
                cosine.map(|cosine| cosine.lane(lane)),
            );
            glam::DVec3::new(whole, clear, 0.0)
        });
        let clear = N::Vec3::splat(both.y());
        // Of the losses at the least and the greatest tint, the lesser loss gains no energy.
        let [least, most] = tint.map(|tint| clear + tint * (both.x() - both.y()));
        least.min(most).max(N::Vec3::ZERO).min(N::Vec3::ONE)
    }

    /// Returns the share of light from a direction that single scattering loses. The direction lies
    /// on the view's side, or on the far side if `beyond`.
    fn lost_energy(&self, direction: N::Vec3, cosine: N, beyond: bool) -> N::Vec3 {
        match &self.boundary_kind {
            RoughBoundaryKind::Boundary { eta, tint } => self.boundary_loss(
                if beyond { N::ONE / *eta } else { *eta },
                *tint,
                Some(cosine),
            ),
            RoughBoundaryKind::Wall { anisotropic } => N::Vec3::splat(
                Albedo::at_cosine_anisotropic(direction, cosine, self.roughness, anisotropic)
                    .multiple_scattering_loss,
            ),
        }
    }

    /// Returns the probability of sampling a reflected direction.
    fn reflection_probability(&self) -> N {
        let sum = self.view_shares[0] + self.view_shares[1];
        N::select(sum.greater_than(N::ZERO), self.view_shares[0] / sum, N::ONE)
    }
}

/// Returns one over each component, which is first raised to at least [`LEAST_MEAN`].
pub(super) fn clamped_inverse<N: Number>(of: N::Vec3) -> N::Vec3 {
    let one = |mean: N| N::ONE / mean.max(N::from_f64(LEAST_MEAN));
    N::Vec3::new(one(of.x()), one(of.y()), one(of.z()))
}

/// Returns the cosine-weighted mean over the hemisphere of a reflectance that depends on the
/// cosine.
pub(super) fn hemispherical_mean_reflectance<N: Number>(
    value_of: impl Fn(N) -> N::Vec3,
) -> N::Vec3 {
    let channel = |k: fn(N::Vec3) -> N| cosine_weighted_mean(|cosine| k(value_of(cosine)));
    N::Vec3::new(channel(|v| v.x()), channel(|v| v.y()), channel(|v| v.z()))
}

impl<N: Number> ScatteringLobe<N> for MultipleScattering<N> {
    fn importance(&self, _: N) -> N {
        self.view_shares[0] + self.view_shares[1]
    }

    fn is_transmissive(&self) -> bool {
        true
    }

    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        (
            self.reflection_factor * self.lost_energy(directions.wi, directions.cos_wi, false),
            self.reflection_probability() * directions.cos_wi / N::from_f64(PI),
        )
    }

    fn eval_transmission_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let below = -directions.cos_wi;
        (
            self.transmission_factor * self.lost_energy(directions.wi, below, true),
            (N::ONE - self.reflection_probability()) * below / N::from_f64(PI),
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
