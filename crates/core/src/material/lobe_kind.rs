//! What a lobe is asked, and by which directions: the rule that all kinds of lobes follow.

use super::frame::Frame;
use crate::number::{Number, Vector3};

/// Two unit directions away from a surface and what the lobes ask of them.
#[derive(Clone, Copy, Debug)]
pub struct Pair<N: Number> {
    pub(super) normal: N::Vec3,
    pub(super) wo: N::Vec3,
    pub(super) wi: N::Vec3,
    /// Unit, halfway between them.
    pub(super) half: N::Vec3,
    /// Cosines to the normal: of the way back, and of the light.
    pub(super) out: N,
    pub(super) into: N,
    /// Cosine between the light and `half`.
    pub(super) tilt: N,
}

impl<N: Number> Pair<N> {
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

    /// The pair with the light above the surface, mirrored there if it was below.
    pub(super) fn folded(&self) -> Self {
        let up = self.wi - self.normal * (N::from_f64(2.0) * self.into);
        Self::new(
            self.normal,
            self.wo,
            N::Vec3::select(self.into.above(N::ZERO), self.wi, up),
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
    /// A lobe that sends nothing.
    const NOTHING: Self;
    /// Whether there are mirrors about other normals than the surface's.
    const COATED: bool = false;
}

/// What a lobe does with light: nothing, where it does not say otherwise.
pub trait LobeKind<N: Number> {
    /// How much it may send back to a direction with this cosine to the normal: what choosing among
    /// lobes goes by.
    fn importance(&self, cosine: N) -> N;
    /// Whether it answers in single directions only, so that it has neither a value nor a density.
    fn is_delta(&self) -> bool {
        false
    }
    /// Whether it lets light through that could have been drawn.
    fn lets_through(&self) -> bool {
        false
    }
    /// Its bidirectional reflectance for a light above the surface, and the density by solid angle
    /// with which [`Self::sample`] gives the light's direction.
    fn eval_and_pdf(&self, pair: &Pair<N>) -> (N::Vec3, N);
    /// The part of it that is diffused, with which it answers to lights that make no highlights.
    fn eval_diffuse(&self, _pair: &Pair<N>) -> N::Vec3 {
        N::Vec3::ZERO
    }
    /// What it lets through of a light below the surface, over the cosine there, and the density of
    /// that light's direction.
    fn eval_and_pdf_through(&self, _pair: &Pair<N>) -> (N::Vec3, N) {
        (N::Vec3::ZERO, N::ZERO)
    }
    /// A direction for the way back, in the world and in the frame about the surface's normal, and
    /// three numbers in [0, 1). Of a lobe that is not delta.
    fn sample(
        &self,
        _frame: &Frame<N>,
        _wo: N::Vec3,
        _local: N::Vec3,
        _choice: N,
        _point: [N; 2],
    ) -> N::Vec3 {
        N::Vec3::ZERO
    }
    /// Direction and weight of a delta lobe; one that divides its light does so by a number in [0,
    /// 1).
    fn sample_delta(&self, normal: N::Vec3, _wo: N::Vec3, _u: N) -> (N::Vec3, N::Vec3) {
        (normal, N::Vec3::ZERO)
    }
}

/// A mirrored direction, whose length strays from one by the rounding of each normal that it was
/// mirrored at: brought back where it is off by four millionths, as after ten mirrors at the
/// earliest, and to the bit what it is elsewhere.
#[inline(always)]
pub(super) fn kept_unit<N: Number>(direction: N::Vec3) -> N::Vec3 {
    let off = N::ONE - direction.dot(direction);
    let has_strayed = off.max(-off).above(N::from_f64(8e-6));
    N::Vec3::select(
        has_strayed,
        direction * (N::ONE + N::from_f64(0.5) * off),
        direction,
    )
}

/// An even point of the unit disk for two numbers in [0, 1).
#[inline(always)]
pub(super) fn on_disk<N: Number>([u, v]: [N; 2]) -> [N; 2] {
    let [cos, sin] = v.turned();
    [u.sqrt() * cos, u.sqrt() * sin]
}

/// A direction about the third axis, drawn by the cosine for two numbers in [0, 1): a point of the
/// disk, raised to the hemisphere (Malley).
#[inline(always)]
pub(crate) fn cosine_sample<N: Number>([u, v]: [N; 2]) -> N::Vec3 {
    let [x, y] = on_disk([u, v]);
    N::Vec3::new(x, y, (N::ONE - u).max(N::ZERO).sqrt())
}

/// Such a direction in a frame, on its side where a mask is set and beyond elsewhere.
pub(super) fn cosine_sample_either<N: Number>(
    frame: &Frame<N>,
    above: N::Mask,
    point: [N; 2],
) -> N::Vec3 {
    let up = cosine_sample::<N>(point);
    let down = N::Vec3::new(up.x(), up.y(), -up.z());
    frame.to_world(N::Vec3::select(above, up, down))
}
