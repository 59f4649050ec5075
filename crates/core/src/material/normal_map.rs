//! Normal maps, with shading normals bent so that no mirror direction points below the surface, as
//! textures and interpolation alone would allow.

use super::frame::ShadingFrame;
use crate::number::{Mask, Number, Vector3};

/// The normal map's value at a hit.
#[derive(Clone, Copy, Debug)]
pub struct NormalMap<N: Number> {
    /// The unperturbed shading normal, unit.
    pub normal: N::Vec3,
    /// Direction of the image's columns on the surface, unit.
    pub along: N::Vec3,
    /// Whether the image appears mirrored: see [`ShadingFrame::from_tangent`].
    pub mirrored: N::Mask,
    /// The image's normal along tangent, bitangent and normal; of any length.
    pub code: N::Vec3,
    /// The geometric normal, outwards.
    pub geometric: N::Vec3,
    /// Whether the ray comes from outside.
    pub outside: N::Mask,
    /// Unit direction of the ray, towards the surface.
    pub direction: N::Vec3,
}

impl<N: Number> NormalMap<N> {
    /// The perturbed normal, on the viewer's side; the unperturbed normal where the image holds
    /// none.
    #[inline(always)]
    pub fn perturbed_normal(&self) -> N::Vec3 {
        let perturbed = ShadingFrame::<N>::from_tangent(self.normal, self.along, self.mirrored)
            .to_world(self.code)
            .normalize();
        let turned = reflecting_above::<N>(perturbed, self.geometric, self.outside, self.direction);
        // Invalid texels, such as zero, leave the normal unperturbed.
        N::Vec3::select(is_unit::<N>(perturbed), turned, self.normal)
    }
}

/// Whether normalisation has succeeded: false where the square was NaN, or had few digits.
#[inline(always)]
fn is_unit<N: Number>(v: N::Vec3) -> N::Mask {
    let squared = v.dot(v);
    N::from_f64(1.0 + 1e-5).greater_than(squared) & squared.greater_than(N::from_f64(1.0 - 1e-5))
}

/// Height above the surface, as a cosine, below which the mirror direction is lifted, to half of
/// this height at least. The lobe of a nearly smooth mirror then lies above the surface too.
const LEAST_HEIGHT: f64 = 0.02;

/// Returns a shading normal that mirrors the viewer above the surface. A normal that mirrors below
/// is bent, so that the mirror direction keeps its azimuth and rises to just above the surface. The
/// direction's height h becomes m/2 + (m/2)²/(3m/2 − h) where h is less than m, so that normals
/// bend without a step or a kink. Where the geometric normal mirrors the viewer nearly along the
/// surface, m is less than that mirror direction's height: the geometric normal is never bent. A
/// normal that also faces away from the surface blends into the geometric normal.
///
/// Other renderers bend normals likewise, to avoid black rings in mirrors ("The Iray Light
/// Transport Simulation and Rendering System", Keller et al. 2017, §A.3; Cycles' valid reflections,
/// V-Ray). The bent normal depends on the view, so swapping light and view bends it differently.
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
    let minimum = (own * N::from_f64(0.9)).min(N::from_f64(LEAST_HEIGHT));
    let kept = !minimum.greater_than(height) & rise.greater_than(N::ZERO);
    // Nearly every normal is kept, and the rest of this function is a chain of dependent square
    // roots.
    if !(!kept).any() {
        return n;
    }
    let half = minimum * N::from_f64(0.5);
    let lifted = half + half * half / (half + minimum - height.min(minimum));
    // From the mirror direction along the normal to that height, then along the surface; scaled by
    // the rise, which may be zero.
    let (up, behind) = (rise.max(N::ZERO), (-rise).max(N::ZERO));
    let across = n * (own + lifted) + d * up;
    let along = (across - facing * facing.dot(across)).normalize();
    let mirrored = along * (N::ONE - lifted * lifted).sqrt() + facing * lifted;
    let perturbed = (mirrored - d).normalize();
    let perturbed = (perturbed * (N::ONE - behind) + facing * behind).normalize();
    N::Vec3::select(
        kept,
        n,
        N::Vec3::select(is_unit::<N>(perturbed), perturbed, facing),
    )
}
