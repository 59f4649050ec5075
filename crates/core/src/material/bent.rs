//! Shading normals that an image bends.

use super::frame::Frame;
use crate::number::{Number, Vector3};

/// What an image says of a normal, where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Bent<N: Number> {
    /// The shading normal before, unit.
    pub normal: N::Vec3,
    /// The way in which the image's columns follow each other, unit, and whether the image is seen mirrored.
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

impl<N: Number> Bent<N> {
    /// The normal as the image has it, on the viewer's side; as it was where the image says nothing.
    #[inline(always)]
    pub fn bent(&self) -> N::Vec3 {
        let bent = Frame::<N>::along(self.normal, self.along, self.mirrored).to_world(self.code).normalize();
        let turned = towards_viewer::<N>(bent, self.geometric, self.outside, self.direction);
        // A texel of nothing, and the like, leave the normal as it is.
        N::Vec3::select(is_finite::<N>(bent), turned, self.normal)
    }
}

/// Of what has been made a unit vector.
#[inline(always)]
fn is_finite<N: Number>(v: N::Vec3) -> N::Mask {
    N::from_f64(2.0).above(v.dot(v))
}

/// A shading normal on the viewer's side: where interpolation or an image tilts it past the silhouette, it is bent back until it is just
/// perpendicular to the view, so that no reflection goes through the surface unseen.
#[inline(always)]
pub fn towards_viewer<N: Number>(n: N::Vec3, geometric: N::Vec3, outside: N::Mask, d: N::Vec3) -> N::Vec3 {
    let facing = N::Vec3::select(outside, geometric, -geometric);
    let away = d.dot(n);
    let bent = (n - d * (away * N::from_f64(1.001))).normalize();
    let sound = is_finite::<N>(bent) & n.dot(facing).above(N::ZERO);
    N::Vec3::select(N::ZERO.above(away), n, N::Vec3::select(sound, bent, facing))
}
