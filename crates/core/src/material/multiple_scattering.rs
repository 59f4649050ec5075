//! Multiple scattering among the microfacets of a rough boundary. A reflected and a transmitted
//! lobe return the energy that single scattering loses.
//!
//! Let L(o) be the share of light from the direction o that single scattering loses, and L̄ its
//! cosine-weighted mean. The lobe L(o)·L(i)/(π·L̄) returns this share ("Revisiting Physically Based
//! Shading at Imageworks", Kulla, Conty 2017). A share r of the lobe is reflected, a share t = 1 −
//! r is transmitted; in the transmitted lobe, L(i) and L̄ are those of the far side. If n²·L̄·t is
//! equal on both sides, where n is the index of a side, the transmitted lobe is reciprocal up to
//! the square of the index.
//!
//! The lobe gains no energy if no mean of L exceeds L̄. The loss of microfacets is linear in their
//! reflectance. A tint or a film therefore mixes the tabulated losses of three reflectances with
//! shares from 0 to 1, see [`mix_by_tint`]; L̄ is the same mixture of their means.

use core::f64::consts::PI;

use super::albedo::Albedo;
use super::energy::cosine_weighted_mean;
use super::ggx::Ggx;
use super::lobe_traits::{Directions, ScatteringLobe, sample_cosine_either_side};
use super::rough_boundary_tables::{self, UNIT};
use super::shading_frame::ShadingFrame;
use crate::number::{Mask, Number, Vector3};

/// Lower limit of a mean used as a divisor: the tables round a lesser mean to zero.
const LEAST_MEAN: f64 = 1.0 / UNIT;

/// Kind of the boundary whose microfacets scatter.
#[derive(Clone, Copy, Debug, PartialEq)]
enum RoughBoundaryKind<N: Number> {
    /// A dielectric boundary. `eta` is the index on the view's side over the index on the far side.
    /// `tint` holds the least and the greatest tint of the reflectance, as in [`mix_by_tint`].
    Boundary { eta: N, tint: [N::Vec3; 2] },
    /// A thin wall, equal on both sides. `anisotropic` holds the mask of the SIMD lanes with
    /// anisotropic microfacets, and their distribution.
    Wall {
        anisotropic: Option<(N::Mask, Ggx<N>)>,
    },
}

/// Lobe of the multiple scattering among the microfacets of a boundary, for one viewing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultipleScattering<N: Number> {
    boundary_kind: RoughBoundaryKind<N>,
    roughness: N,
    /// BRDF divided by L(i), the share of light from `wi` that single scattering loses.
    reflection_factor: N::Vec3,
    /// BTDF divided by L(i), the share of light from `wi` that single scattering loses.
    transmission_factor: N::Vec3,
    /// Shares of the light along the view that multiple scattering reflects and transmits, in the
    /// strongest channel.
    view_shares: [N; 2],
}

impl<N: Number> MultipleScattering<N> {
    /// Creates the lobe of a dielectric boundary. `share` is the boundary's share of the surface,
    /// `cosine` that of the view to the normal. `eta` and `tint` are as in
    /// [`RoughBoundaryKind::Boundary`]; `transmitted` is the factor on transmission.
    pub(super) fn for_boundary(
        eta: N,
        roughness: N,
        [share, cosine]: [N; 2],
        tint: [N::Vec3; 2],
        transmitted: N::Vec3,
    ) -> Self {
        let one = N::Vec3::ONE;
        let bare = Self::without_view(RoughBoundaryKind::Boundary { eta, tint }, roughness);
        let [own, beyond] =
            [eta, N::ONE / eta].map(|eta| boundary_loss([eta, roughness], tint, None));
        // Mean reflectance of a smooth boundary on its side of lower index, and a factor on the
        // mean transmittance: 1 on the side of lower index, 1/η² on the side of higher index.
        let smooth = |lane: usize| {
            let eta = eta.lane(lane);
            [
                rough_boundary_tables::smooth_mean_reflectance(eta.max(1.0 / eta)),
                (1.0 / eta).min(1.0).powi(2),
            ]
        };
        let (mean, dense) = (
            N::from_lanes(|lane| smooth(lane)[0]),
            N::from_lanes(|lane| smooth(lane)[1]),
        );
        let reflected = mix_by_tint::<N>(tint[0], [N::Vec3::ZERO, N::Vec3::splat(mean), one]);
        let through = (one - reflected) * dense * (own.min(beyond) * clamped_inverse::<N>(own));
        bare.with_view(
            boundary_loss([eta, roughness], tint, Some(cosine)) * share,
            [one - through, through * transmitted],
            [own, beyond],
        )
    }

    /// Creates the lobe of a thin wall. `share` is the wall's share of the surface. `wo` holds the
    /// viewing direction and the surface normal. `mean` is the wall's mean reflectance,
    /// `transmitted` the factor on its transmission.
    pub(super) fn for_wall(
        roughness: N,
        anisotropic: Option<(N::Mask, Ggx<N>)>,
        share: N,
        wo: [N::Vec3; 2],
        [mean, transmitted]: [N::Vec3; 2],
    ) -> Self {
        let bare = Self::without_view(RoughBoundaryKind::Wall { anisotropic }, roughness);
        let lost = Albedo::mean_anisotropic(roughness, &anisotropic).multiple_scattering_loss;
        let [wo, normal] = wo;
        let seen = bare.lost_energy(wo, normal.dot(wo), false) * share;
        bare.with_view(
            seen,
            [mean, (N::Vec3::ONE - mean) * transmitted],
            [N::Vec3::splat(lost); 2],
        )
    }

    /// Creates the lobe of a boundary whose viewing direction is not known yet.
    fn without_view(boundary_kind: RoughBoundaryKind<N>, roughness: N) -> Self {
        Self {
            boundary_kind,
            roughness,
            reflection_factor: N::Vec3::ONE,
            transmission_factor: N::Vec3::ONE,
            view_shares: [N::ONE; 2],
        }
    }

    /// Returns the lobe for a viewing direction.
    ///
    /// - `lost`: share of the light along this direction that single scattering loses.
    /// - `shares`: the parts of `lost` that are reflected and transmitted.
    /// - `means`: mean of `lost` over directions on the view's side and on the far side.
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

    /// Returns the share of light from a direction that single scattering loses. `beyond`: whether
    /// the direction lies on the far side instead of the view's side.
    fn lost_energy(&self, direction: N::Vec3, cosine: N, beyond: bool) -> N::Vec3 {
        match &self.boundary_kind {
            RoughBoundaryKind::Boundary { eta, tint } => boundary_loss(
                [if beyond { N::ONE / *eta } else { *eta }, self.roughness],
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

/// Returns the share of light that a dielectric boundary loses by single scattering. `cosine`
/// lies on the side whose index over the other side's index is `eta`; `None` selects the
/// hemispherical mean.
pub(super) fn boundary_loss<N: Number>(
    [eta, roughness]: [N; 2],
    tint: [N::Vec3; 2],
    cosine: Option<N>,
) -> N::Vec3 {
    let both = <N::Vec3 as Vector3<N>>::from_lanes(|lane| {
        let [whole, clear] = rough_boundary_tables::single_scattering_loss(
            eta.lane(lane),
            roughness.lane(lane),
            cosine.map(|cosine| cosine.lane(lane)),
        );
        glam::DVec3::new(whole, clear, 0.0)
    });
    let [clear, whole] = [both.y(), both.x()].map(N::Vec3::splat);
    let all = if tint[1].max_element().greater_than(N::ONE).any_lane() {
        let albedo = cosine.map_or_else(
            || Albedo::mean(roughness),
            |cosine| Albedo::at_cosine(cosine, roughness),
        );
        N::Vec3::splat(albedo.multiple_scattering_loss)
    } else {
        whole
    };
    // Of the losses at the least and the greatest tint, the lesser loss gains no energy.
    let [least, most] = tint.map(|tint| mix_by_tint::<N>(tint, [clear, whole, all]));
    least.min(most).max(N::Vec3::ZERO).min(N::Vec3::ONE)
}

/// Returns a quantity that is linear in the reflectance of a boundary, from its values for no
/// reflectance, Fresnel's reflectance F and total reflectance. A tint t stands for the reflectance
/// t·F up to t = 1 and for 1 − (2 − t)·(1 − F) from 1 to 2: at most 1, whatever F is.
fn mix_by_tint<N: Number>(tint: N::Vec3, [none, fresnel, all]: [N::Vec3; 3]) -> N::Vec3 {
    let (one, above) = (N::Vec3::ONE, tint - N::Vec3::ONE);
    none + tint.min(one) * (fresnel - none) + above.max(N::Vec3::ZERO) * (all - fresnel)
}

/// Returns one over each component. Components below [`LEAST_MEAN`] count as this limit.
pub(super) fn clamped_inverse<N: Number>(of: N::Vec3) -> N::Vec3 {
    let one = |mean: N| N::ONE / mean.max(N::from_f64(LEAST_MEAN));
    N::Vec3::new(one(of.x()), one(of.y()), one(of.z()))
}

/// Returns the cosine-weighted hemispherical mean of a reflectance given as a function of the
/// cosine.
pub(super) fn mean_reflectance<N: Number>(value_of: impl Fn(N) -> N::Vec3) -> N::Vec3 {
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
