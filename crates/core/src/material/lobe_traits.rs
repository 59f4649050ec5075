//! The interface of all lobes, and the pair of directions for which a lobe is evaluated.

use super::shading_frame::ShadingFrame;
use crate::number::{Number, Vector3};

/// Unit directions `wo` to the viewer and `wi` to the light, with the normal, the half vector and
/// the cosines. Both directions point away from the surface.
#[derive(Clone, Copy, Debug)]
pub struct Directions<N: Number> {
    pub(super) normal: N::Vec3,
    pub(super) wo: N::Vec3,
    pub(super) wi: N::Vec3,
    /// Unit half vector of `wo` and `wi`.
    pub(super) half: N::Vec3,
    /// Cosine of `wo` to the normal.
    pub(super) cos_wo: N,
    /// Cosine of `wi` to the normal; negative below the surface.
    pub(super) cos_wi: N,
    /// Cosine of `wi` to `half`, clamped to at least zero.
    pub(super) cos_half: N,
}

impl<N: Number> Directions<N> {
    /// Creates the pair of directions with their cosines to a unit normal.
    #[inline(always)]
    pub(super) fn new(normal: N::Vec3, wo: N::Vec3, wi: N::Vec3) -> Self {
        let half = (wi + wo).normalize();
        Self {
            normal,
            wo,
            wi,
            half,
            cos_wo: normal.dot(wo),
            cos_wi: normal.dot(wi),
            cos_half: half.dot(wi).max(N::ZERO),
        }
    }

    /// Returns the pair with `wi` above the surface. A `wi` below the surface is mirrored at the
    /// surface's plane.
    pub(super) fn with_wi_above(&self) -> Self {
        let up = self.wi - self.normal * (N::from_f64(2.0) * self.cos_wi);
        Self::new(
            self.normal,
            self.wo,
            N::Vec3::select(self.cos_wi.greater_than(N::ZERO), self.wi, up),
        )
    }

    /// Returns the pair with another normal and the cosines to this normal.
    pub(super) fn with_normal(&self, normal: N::Vec3) -> Self {
        Self {
            normal,
            cos_wo: normal.dot(self.wo),
            cos_wi: normal.dot(self.wi),
            ..*self
        }
    }
}

/// Type of the lobes that a [`Bsdf`](super::Bsdf) holds: [`Lobe`](super::Lobe), or
/// [`CoatedLobe`](super::CoatedLobe) for layered surfaces.
pub trait BsdfLobe<N: Number>: ScatteringLobe<N> + Copy + core::fmt::Debug {
    /// A black lobe, for the unused entries of a BSDF's array.
    const NOTHING: Self;
    /// Whether lobes lie under a coat whose normal may differ from the surface's normal.
    const COATED: bool = false;
}

/// Interface of a lobe: its value, density and sampling. The default methods suit a lobe without
/// transmission and without diffuse reflection.
pub trait ScatteringLobe<N: Number> {
    /// Returns the sampling weight of the lobe: an estimate of its albedo for the cosine of `wo`.
    fn importance(&self, cosine: N) -> N;
    /// Whether the lobe is a delta lobe: value and density are then zero.
    fn is_delta(&self) -> bool {
        false
    }
    /// Whether the lobe transmits light and is not a delta lobe.
    fn is_transmissive(&self) -> bool {
        false
    }
    /// Returns the BRDF for light from `wi` above the surface, and the density by solid angle with
    /// which [`Self::sample`] returns `wi`.
    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N);
    /// Returns the diffuse part of the BRDF, for lights that make no highlights.
    fn eval_diffuse(&self, _pair: &Directions<N>) -> N::Vec3 {
        N::Vec3::ZERO
    }
    /// Returns the BTDF for light from `wi` below the surface, and the density by solid angle with
    /// which [`Self::sample`] returns `wi`.
    fn eval_transmission_and_pdf(&self, _pair: &Directions<N>) -> (N::Vec3, N) {
        (N::Vec3::ZERO, N::ZERO)
    }
    /// Samples `wi` by three random numbers in [0, 1), `_choice` and `_point`. Returns zero for a
    /// failed sample. `_wo` is the viewing direction in world space, `_local` in `_frame`. Delta
    /// lobes use [`Self::sample_delta`] instead.
    fn sample(
        &self,
        _frame: &ShadingFrame<N>,
        _wo: N::Vec3,
        _local: N::Vec3,
        _choice: N,
        _point: [N; 2],
    ) -> N::Vec3 {
        N::Vec3::ZERO
    }
    /// Samples a delta lobe. Returns `wi` and its weight. The random number `_u` in [0, 1) chooses
    /// between reflection and refraction.
    fn sample_delta(&self, normal: N::Vec3, _wo: N::Vec3, _u: N) -> (N::Vec3, N::Vec3) {
        (normal, N::Vec3::ZERO)
    }
}

/// Normalises a mirrored direction whose length differs from 1 by more than 4·10⁻⁶; returns other
/// directions unchanged. Each mirror's rounding error changes the length. Ten mirrors or more are
/// needed to exceed this limit.
#[inline(always)]
pub(super) fn normalize_if_drifted<N: Number>(direction: N::Vec3) -> N::Vec3 {
    let off = N::ONE - direction.dot(direction);
    let has_strayed = off.max(-off).greater_than(N::from_f64(8e-6));
    N::Vec3::select(
        has_strayed,
        direction * (N::ONE + N::from_f64(0.5) * off),
        direction,
    )
}

/// Returns a uniform point of the unit disk for two random numbers in [0, 1).
#[inline(always)]
pub(super) fn sample_disk<N: Number>([u, v]: [N; 2]) -> [N; 2] {
    let [cos, sin] = v.sin_cos_turns();
    [u.sqrt() * cos, u.sqrt() * sin]
}

/// Returns a cosine-weighted direction about the z axis for two random numbers in [0, 1). A point
/// of the unit disk is projected up to the hemisphere (Malley).
#[inline(always)]
pub(crate) fn sample_cosine_hemisphere<N: Number>([u, v]: [N; 2]) -> N::Vec3 {
    let [x, y] = sample_disk([u, v]);
    N::Vec3::new(x, y, (N::ONE - u).max(N::ZERO).sqrt())
}

/// Returns a cosine-weighted world direction about a frame's normal: above the surface in lanes of
/// the mask `above`, below it in all other lanes.
pub(super) fn sample_cosine_either_side<N: Number>(
    frame: &ShadingFrame<N>,
    above: N::Mask,
    point: [N; 2],
) -> N::Vec3 {
    let up = sample_cosine_hemisphere::<N>(point);
    let down = N::Vec3::new(up.x(), up.y(), -up.z());
    frame.to_world(N::Vec3::select(above, up, down))
}
