//! The interface of all kinds of lobes, and the pair of directions that they evaluate.

use super::frame::ShadingFrame;
use crate::number::{Number, Vector3};

/// Two unit directions away from a surface, with the quantities that lobes share.
#[derive(Clone, Copy, Debug)]
pub struct Directions<N: Number> {
    pub(super) normal: N::Vec3,
    pub(super) wo: N::Vec3,
    pub(super) wi: N::Vec3,
    /// Half vector, unit.
    pub(super) half: N::Vec3,
    /// Cosines of `wo` and of `wi` to the normal.
    pub(super) out: N,
    pub(super) into: N,
    /// Cosine between `wi` and `half`.
    pub(super) tilt: N,
}

impl<N: Number> Directions<N> {
    #[inline(always)]
    pub(super) fn new(normal: N::Vec3, wo: N::Vec3, wi: N::Vec3) -> Self {
        let half = (wi + wo).normalize();
        Self {
            normal,
            wo,
            wi,
            half,
            out: normal.dot(wo),
            into: normal.dot(wi),
            tilt: half.dot(wi).max(N::ZERO),
        }
    }

    /// The pair with `wi` above the surface, mirrored there if it lies below.
    pub(super) fn folded(&self) -> Self {
        let up = self.wi - self.normal * (N::from_f64(2.0) * self.into);
        Self::new(
            self.normal,
            self.wo,
            N::Vec3::select(self.into.greater_than(N::ZERO), self.wi, up),
        )
    }

    /// The pair about another normal.
    pub(super) fn about(&self, normal: N::Vec3) -> Self {
        Self {
            normal,
            out: normal.dot(self.wo),
            into: normal.dot(self.wi),
            ..*self
        }
    }
}

/// A lobe that a [`Bsdf`](super::Bsdf) holds.
pub trait LobeFamily<N: Number>: LobeKind<N> + Copy + core::fmt::Debug {
    /// A lobe of value zero.
    const NOTHING: Self;
    /// Whether lobes may have other normals than the surface's.
    const COATED: bool = false;
}

/// A lobe: value, density and sampling. By default it neither transmits nor reflects diffusely.
pub trait LobeKind<N: Number> {
    /// Estimate of the albedo for an outgoing direction of this cosine, by which lobes are chosen.
    fn importance(&self, cosine: N) -> N;
    /// Whether the lobe is a delta distribution, with neither a value nor a density.
    fn is_delta(&self) -> bool {
        false
    }
    /// Whether the lobe transmits, other than as a delta.
    fn is_transmissive(&self) -> bool {
        false
    }
    /// BRDF for a light above the surface, and the density by solid angle with which
    /// [`Self::sample`] returns the light's direction.
    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N);
    /// Diffuse part of the BRDF, for lights that make no highlights.
    fn eval_diffuse(&self, _pair: &Directions<N>) -> N::Vec3 {
        N::Vec3::ZERO
    }
    /// BTDF for a light below the surface, and the density of that light's direction.
    fn eval_and_pdf_through(&self, _pair: &Directions<N>) -> (N::Vec3, N) {
        (N::Vec3::ZERO, N::ZERO)
    }
    /// Samples `wi` for `wo`, given in the world and in the frame about the surface's normal, by
    /// three numbers in [0, 1). For non-delta lobes.
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
    /// Direction and weight of a delta lobe; a number in [0, 1) chooses between reflection and
    /// refraction.
    fn sample_delta(&self, normal: N::Vec3, _wo: N::Vec3, _u: N) -> (N::Vec3, N::Vec3) {
        (normal, N::Vec3::ZERO)
    }
}

/// Normalises a mirrored direction: its length strays from 1 by the rounding of each normal along
/// the path. The direction changes only if its length is off by four millionths, after ten mirrors
/// at the earliest, and keeps its bits otherwise.
#[inline(always)]
pub(super) fn kept_unit<N: Number>(direction: N::Vec3) -> N::Vec3 {
    let off = N::ONE - direction.dot(direction);
    let has_strayed = off.max(-off).greater_than(N::from_f64(8e-6));
    N::Vec3::select(
        has_strayed,
        direction * (N::ONE + N::from_f64(0.5) * off),
        direction,
    )
}

/// Uniform point of the unit disk for two numbers in [0, 1).
#[inline(always)]
pub(super) fn on_disk<N: Number>([u, v]: [N; 2]) -> [N; 2] {
    let [cos, sin] = v.sin_cos_turns();
    [u.sqrt() * cos, u.sqrt() * sin]
}

/// Cosine-weighted direction about the third axis for two numbers in [0, 1): a point of the disk,
/// raised to the hemisphere (Malley).
#[inline(always)]
pub(crate) fn cosine_sample<N: Number>([u, v]: [N; 2]) -> N::Vec3 {
    let [x, y] = on_disk([u, v]);
    N::Vec3::new(x, y, (N::ONE - u).max(N::ZERO).sqrt())
}

/// Cosine-weighted direction in a frame: above where the mask is set, below elsewhere.
pub(super) fn cosine_sample_either<N: Number>(
    frame: &ShadingFrame<N>,
    above: N::Mask,
    point: [N; 2],
) -> N::Vec3 {
    let up = cosine_sample::<N>(point);
    let down = N::Vec3::new(up.x(), up.y(), -up.z());
    frame.to_world(N::Vec3::select(above, up, down))
}
