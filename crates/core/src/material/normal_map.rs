//! Shading normals by which nothing that is reflected goes below the surface, as images and
//! interpolation alone would have it.

use super::frame::Frame;
use crate::number::{Mask, Number, Vector3};

/// What an image says of a normal, where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct NormalMap<N: Number> {
    /// The shading normal before, unit.
    pub normal: N::Vec3,
    /// The way in which the image's columns follow each other, unit, and whether the image is seen
    /// mirrored.
    pub along: N::Vec3,
    /// See [`Frame::along`].
    pub mirrored: N::Mask,
    /// What the image holds, along the tangent, the bitangent and the normal; of any length.
    pub code: N::Vec3,
    /// The surface's own normal, outwards, and whether the ray comes from outside.
    pub geometric: N::Vec3,
    /// See there.
    pub outside: N::Mask,
    /// Unit direction of the ray, towards the surface.
    pub direction: N::Vec3,
}

impl<N: Number> NormalMap<N> {
    /// The normal as the image has it, on the viewer's side; as it was where the image says
    /// nothing.
    #[inline(always)]
    pub fn perturbed_normal(&self) -> N::Vec3 {
        let bent = Frame::<N>::along(self.normal, self.along, self.mirrored)
            .to_world(self.code)
            .normalize();
        let turned = reflecting_above::<N>(bent, self.geometric, self.outside, self.direction);
        // A texel of nothing, and the like, leave the normal as it is.
        N::Vec3::select(is_unit::<N>(bent), turned, self.normal)
    }
}

/// Whether a vector has been made a unit one: not where its square was no number, or one of few
/// digits.
#[inline(always)]
fn is_unit<N: Number>(v: N::Vec3) -> N::Mask {
    let squared = v.dot(v);
    N::from_f64(1.0 + 1e-5).above(squared) & squared.above(N::from_f64(1.0 - 1e-5))
}

/// Height over the surface, as a cosine, below which the viewer's mirror direction is lifted, to
/// half of it at least: the lobe of a mirror that is nearly smooth then lies above the surface with
/// it.
const LEAST_HEIGHT: f64 = 0.02;

/// A shading normal by which the viewer's mirror direction is above the surface that is there. One
/// that sends it below is bent back, so that the direction keeps its azimuth and rises to just
/// above the surface: by its height h, which becomes m/2 + (m/2)²/(3m/2 − h) where it is less than
/// m, so that normals bend without a step or a kink. Where the surface itself mirrors the viewer
/// nearly along it, m is less than the height there: a surface's own normal is never bent. One that
/// faces away from the surface too goes over to the surface's own.
///
/// As other renderers do it, whose mirrors with such normals would have black rings too ("The Iray
/// Light Transport Simulation and Rendering System", Keller et al. 2017, §A.3; Cycles' valid
/// reflections, V-Ray). It is no property of any surface: light and view swapped bend a normal
/// differently.
#[inline(always)]
pub fn reflecting_above<N: Number>(
    n: N::Vec3,
    geometric: N::Vec3,
    outside: N::Mask,
    d: N::Vec3,
) -> N::Vec3 {
    let facing = N::Vec3::select(outside, geometric, -geometric);
    let (rise, own) = (n.dot(facing), -d.dot(facing));
    let height = N::from_f64(-2.0) * d.dot(n) * rise - own;
    let least = (own * N::from_f64(0.9)).min(N::from_f64(LEAST_HEIGHT));
    let kept = !least.above(height) & rise.above(N::ZERO);
    // Nearly every normal is, and what follows is a row of roots that wait for each other.
    if !(!kept).any() {
        return n;
    }
    let half = least * N::from_f64(0.5);
    let lifted = half + half * half / (half + least - height.min(least));
    // Along the normal from the mirror direction to that height, and there along the surface; times
    // the rise, which may be none.
    let (up, behind) = (rise.max(N::ZERO), (-rise).max(N::ZERO));
    let across = n * (own + lifted) + d * up;
    let along = (across - facing * facing.dot(across)).normalize();
    let mirrored = along * (N::ONE - lifted * lifted).sqrt() + facing * lifted;
    let bent = (mirrored - d).normalize();
    let bent = (bent * (N::ONE - behind) + facing * behind).normalize();
    N::Vec3::select(kept, n, N::Vec3::select(is_unit::<N>(bent), bent, facing))
}
