//! Microfacets that may be combed: GGX with a width along each of two directions ("Understanding the Masking-Shadowing Function", Heitz
//! 2014; "Physically-Based Shading at Disney", Burley 2012).

use core::f64::consts::PI;

use super::frame::Frame;
use super::lobe::{LEAST_ROUGHNESS, on_disk, visible_facet};
use crate::number::{Number, Vector3};

/// Facets about a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facets<N: Number> {
    pub(super) frame: Frame<N>,
    /// α along tangent and bitangent.
    pub(super) alpha: [N; 2],
}

impl<N: Number> Facets<N> {
    /// As rough along any direction.
    #[inline]
    pub fn even(normal: N::Vec3, roughness: N) -> Self {
        let alpha = least(roughness).powi(2);
        Self { frame: Frame::about(normal), alpha: [alpha; 2] }
    }

    /// Rougher along the frame's tangent, by a strength from 0 to 1, as glTF's KHR_materials_anisotropy has it: α there goes from that of
    /// the roughness to one with the strength's square.
    #[inline]
    pub fn combed(frame: Frame<N>, roughness: N, strength: N) -> Self {
        let alpha = least(roughness).powi(2);
        Self { frame, alpha: [alpha + (N::ONE - alpha) * strength * strength, alpha] }
    }

    /// Perceptual roughness of even facets about as rough.
    pub fn roughness(&self) -> N {
        (self.alpha[0] * self.alpha[1]).sqrt().sqrt()
    }

    /// The direction at a cosine to the normal, by the cosine and the sine of its azimuth.
    pub(super) fn towards(&self, cosine: N, [x, y]: [N; 2]) -> N::Vec3 {
        let sine = (N::ONE - cosine * cosine).max(N::ZERO).sqrt();
        self.frame.to_world(N::Vec3::new(sine * x, sine * y, cosine))
    }

    /// The normal that they lie about.
    pub fn normal(&self) -> N::Vec3 {
        self.frame.normal
    }

    /// √((αx·x)² + (αy·y)² + z²), of which Smith's shadowing is made.
    #[inline(always)]
    fn stretched(&self, v: N::Vec3) -> N {
        let [x, y] = [self.alpha[0] * v.x(), self.alpha[1] * v.y()];
        (x * x + y * y + v.z() * v.z()).sqrt()
    }

    /// Density of facets by the half vector in the frame.
    #[inline(always)]
    fn density_of(&self, half: N::Vec3) -> N {
        let [x, y] = [half.x() / self.alpha[0], half.y() / self.alpha[1]];
        let slope = x * x + y * y + half.z() * half.z();
        N::ONE / (N::from_f64(PI) * self.alpha[0] * self.alpha[1] * slope * slope)
    }

    /// What white facets send from one direction to the other, over the cosine there; zero where either is below.
    pub fn value(&self, wo: N::Vec3, wi: N::Vec3) -> N {
        let (o, i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        let visibility = N::from_f64(0.5) / (i.z() * self.stretched(o) + o.z() * self.stretched(i));
        let value = self.density_of((o + i).normalize()) * visibility;
        N::select(o.z().above(N::ZERO) & i.z().above(N::ZERO), value, N::ZERO)
    }

    /// Density by solid angle of the directions that seen facets mirror `wo` to.
    pub fn density(&self, wo: N::Vec3, wi: N::Vec3) -> N {
        let (o, i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        let density = self.density_of((o + i).normalize()) / (N::from_f64(2.0) * (o.z() + self.stretched(o)));
        N::select(o.z().above(N::ZERO), density, N::ZERO)
    }

    /// The normal of a facet that is seen along `wo`, for two numbers in [0, 1).
    pub fn drawn(&self, wo: N::Vec3, point: [N; 2]) -> N::Vec3 {
        self.frame.to_world(visible_facet::<N>(self.frame.to_local(wo), self.alpha, on_disk(point)))
    }
}

/// Mirrored at a facet.
#[inline(always)]
pub(super) fn mirrored<N: Number>(wo: N::Vec3, facet: N::Vec3) -> N::Vec3 {
    facet * (N::from_f64(2.0) * wo.dot(facet)) - wo
}

#[inline(always)]
fn least<N: Number>(roughness: N) -> N {
    roughness.max(N::from_f64(LEAST_ROUGHNESS))
}
