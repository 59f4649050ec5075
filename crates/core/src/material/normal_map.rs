//! Normal maps, and the correction of shading normals. Textures and interpolated normals may
//! reflect the view below the surface. Such normals are bent until the reflected direction lies
//! above the surface.

use super::shading_frame::ShadingFrame;
use crate::number::{Mask, Number, Vector3};

/// The value of a normal map at a hit, with the geometry that it perturbs.
#[derive(Clone, Copy, Debug)]
pub struct NormalMap<N: Number> {
    /// Unperturbed unit shading normal.
    pub normal: N::Vec3,
    /// Unit direction on the surface in which the image's u coordinate grows.
    pub along: N::Vec3,
    /// Mask of the lanes in which the image appears mirrored, see [`ShadingFrame::from_tangent`].
    pub mirrored: N::Mask,
    /// Normal decoded from the image, of any length: its components along tangent, bitangent and
    /// normal.
    pub code: N::Vec3,
    /// Geometric unit normal, outwards.
    pub geometric: N::Vec3,
    /// Mask of the lanes whose ray comes from outside.
    pub outside: N::Mask,
    /// Unit direction of the ray, towards the surface.
    pub direction: N::Vec3,
}

impl<N: Number> NormalMap<N> {
    /// Returns the perturbed unit normal on the viewer's side; the unperturbed normal if the texel
    /// encodes no direction.
    #[inline(always)]
    pub fn perturbed_normal(&self) -> N::Vec3 {
        let perturbed = ShadingFrame::<N>::from_tangent(self.normal, self.along, self.mirrored)
            .to_world(self.code)
            .normalize();
        let turned =
            ensure_reflection_above::<N>(perturbed, self.geometric, self.outside, self.direction);
        // Invalid texels, such as zero, leave the normal unperturbed.
        N::Vec3::select(has_unit_length::<N>(perturbed), turned, self.normal)
    }
}

/// Whether a vector has length 1 up to rounding. False for NaN, and for a vector whose
/// normalisation lost too many digits.
#[inline(always)]
fn has_unit_length<N: Number>(v: N::Vec3) -> N::Mask {
    let squared = v.dot(v);
    N::from_f64(1.0 + 1e-5).greater_than(squared) & squared.greater_than(N::from_f64(1.0 - 1e-5))
}

/// Height (cosine to the normal) below which the reflected direction is lifted. The lifted height
/// is at least half of this limit: the lobe of a nearly smooth mirror then lies above the surface.
const LEAST_HEIGHT: f64 = 0.02;

/// Heights above a surface, as cosines to its geometric normal on the view's side.
struct ReflectionHeights<N: Number> {
    /// Height of the shading normal.
    rise: N,
    /// Height of the view.
    own: N,
    /// Height of the view's reflection at the shading normal.
    height: N,
    /// Height below which the reflection is lifted.
    minimum: N,
}

impl<N: Number> ReflectionHeights<N> {
    /// Computes the heights for a shading normal `n`, the geometric normal `facing` on the view's
    /// side, and the direction `d` of the ray towards the surface.
    #[inline(always)]
    fn new(n: N::Vec3, facing: N::Vec3, d: N::Vec3) -> Self {
        let (rise, own) = (n.dot(facing), -d.dot(facing));
        Self {
            rise,
            own,
            height: N::from_f64(-2.0) * d.dot(n) * rise - own,
            minimum: (own * N::from_f64(0.9)).min(N::from_f64(LEAST_HEIGHT)),
        }
    }
}

/// Whether a shading normal reflects the view to a direction above the surface, so that
/// [`ensure_reflection_above`] keeps it.
#[inline(always)]
pub fn reflects_above<N: Number>(
    n: N::Vec3,
    geometric: N::Vec3,
    outside: N::Mask,
    d: N::Vec3,
) -> N::Mask {
    let facing = N::Vec3::select(outside, geometric, -geometric);
    let heights = ReflectionHeights::<N>::new(n, facing, d);
    !heights.minimum.greater_than(heights.height) & heights.rise.greater_than(N::ZERO)
}

/// Returns a shading normal that reflects the view to a direction above the surface. `n` is the
/// given shading normal, `d` the unit direction of the ray towards the surface.
///
/// A normal that reflects the view below the surface is bent. The reflected direction keeps its
/// azimuth and is lifted to just above the surface. A height h (cosine to the geometric normal)
/// below m becomes m/2 + (m/2)²/(3m/2 − h): normals bend without a step or a kink. The limit m is
/// 0.02, or 0.9 of the view's own height if this is less: the geometric normal is never bent. A
/// normal that faces away from the surface blends into the geometric normal.
///
/// Other renderers bend normals too, to avoid black rings in mirrors ("The Iray Light Transport
/// Simulation and Rendering System", Keller et al. 2017, §A.3; Cycles' valid reflections, V-Ray).
/// The bent normal depends on the view: the BSDF is not reciprocal.
#[inline(always)]
pub fn ensure_reflection_above<N: Number>(
    n: N::Vec3,
    geometric: N::Vec3,
    outside: N::Mask,
    d: N::Vec3,
) -> N::Vec3 {
    let facing = N::Vec3::select(outside, geometric, -geometric);
    let ReflectionHeights {
        rise,
        own,
        height,
        minimum,
    } = ReflectionHeights::<N>::new(n, facing, d);
    let kept = reflects_above::<N>(n, geometric, outside, d);
    // An early return is worthwhile: nearly every normal is kept, and the remaining code is a chain
    // of dependent square roots.
    if !(!kept).any_lane() {
        return n;
    }
    let half = minimum * N::from_f64(0.5);
    let lifted = half + half * half / (half + minimum - height.min(minimum));
    // Moves the mirror direction along the normal to the lifted height; `across` is scaled by the
    // rise, which may be zero. `along` is the azimuth on the surface.
    let (up, behind) = (rise.max(N::ZERO), (-rise).max(N::ZERO));
    let across = n * (own + lifted) + d * up;
    let along = (across - facing * facing.dot(across)).normalize();
    let mirrored = along * (N::ONE - lifted * lifted).sqrt() + facing * lifted;
    let perturbed = (mirrored - d).normalize();
    let perturbed = (perturbed * (N::ONE - behind) + facing * behind).normalize();
    N::Vec3::select(
        kept,
        n,
        N::Vec3::select(has_unit_length::<N>(perturbed), perturbed, facing),
    )
}
