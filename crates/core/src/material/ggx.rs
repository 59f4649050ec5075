//! The GGX microfacet distribution, isotropic or anisotropic: density of normals, Smith's
//! height-correlated masking-shadowing, and sampling of visible normals ("Microfacet Models for
//! Refraction through Rough Surfaces", Walter et al. 2007; "Understanding the Masking-Shadowing
//! Function", Heitz 2014; "Physically-Based Shading at Disney", Burley 2012).

use core::f64::consts::PI;

use super::frame::ShadingFrame;
use super::lobe_kind::{Directions, on_disk};
use crate::number::{Number, Vector3};

/// Least perceptual roughness of a glossy lobe: below it, the highlight of a delta light is a
/// spike.
pub(super) const LEAST_ROUGHNESS: f64 = 0.03;

/// α of a perceptual roughness.
#[inline(always)]
pub(super) fn alpha<N: Number>(roughness: N) -> N {
    roughness.max(N::from_f64(LEAST_ROUGHNESS)).powi(2)
}

/// A GGX distribution about a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx<N: Number> {
    pub(super) normal: N::Vec3,
    /// Unit tangent and bitangent; `None` for isotropic microfacets.
    axes: Option<[N::Vec3; 2]>,
    /// α along the axes.
    pub(super) alpha: [N; 2],
}

impl<N: Number> Ggx<N> {
    /// An isotropic distribution.
    #[inline(always)]
    pub fn isotropic(normal: N::Vec3, roughness: N) -> Self {
        Self {
            normal,
            axes: None,
            alpha: [alpha(roughness); 2],
        }
    }

    /// An anisotropic distribution, rougher along the frame's tangent by a strength from 0 to 1, as
    /// in glTF's KHR_materials_anisotropy: α along the tangent rises from the roughness's α to one
    /// with the square of the strength.
    #[inline]
    pub fn anisotropic(frame: ShadingFrame<N>, roughness: N, strength: N) -> Self {
        let alpha = alpha(roughness);
        let ShadingFrame {
            tangent,
            bitangent,
            normal,
        } = frame;
        let wide = alpha + (N::ONE - alpha) * strength * strength;
        Self {
            normal,
            axes: Some([tangent, bitangent]),
            alpha: [wide, alpha],
        }
    }

    /// Perceptual roughness of comparable isotropic microfacets.
    pub fn roughness(&self) -> N {
        (self.alpha[0] * self.alpha[1]).sqrt().sqrt()
    }

    /// The frame of the axes; any frame for isotropic microfacets.
    pub(super) fn frame(&self) -> ShadingFrame<N> {
        let value_of = |[tangent, bitangent]: [N::Vec3; 2]| ShadingFrame {
            tangent,
            bitangent,
            normal: self.normal,
        };
        self.axes
            .map_or_else(|| ShadingFrame::from_normal(self.normal), value_of)
    }

    /// Inverse of the density D at a microfacet normal. The isotropic form (hx² + hy²)/α² + hz²
    /// keeps its digits at low roughness.
    #[inline(always)]
    pub(super) fn inverse_d(&self, half: N::Vec3) -> N {
        let (hz, [wide, fine], pi) = (self.normal.dot(half), self.alpha, N::from_f64(PI));
        let (slope, area) = match self.axes {
            None => {
                let across = self.normal.cross(half);
                let a2 = wide * wide;
                (across.dot(across) / a2 + hz * hz, pi * a2)
            }
            Some([x, y]) => {
                let [x, y] = [x.dot(half) / wide, y.dot(half) / fine];
                (x * x + y * y + hz * hz, pi * wide * fine)
            }
        };
        area * slope * slope
    }

    /// cos·(1 + 2Λ) for a direction of this cosine; √(α² + (1 − α²)·cos²) for isotropic
    /// microfacets. Smith's masking is G₁ = 2·cos/(cos + root).
    #[inline(always)]
    pub(super) fn root(&self, v: N::Vec3, cosine: N) -> N {
        let [wide, fine] = self.alpha;
        match self.axes {
            None => {
                let a2 = wide * wide;
                (a2 + (N::ONE - a2) * cosine * cosine).sqrt()
            }
            Some([x, y]) => {
                let [x, y] = [wide * x.dot(v), fine * y.dot(v)];
                (x * x + y * y + cosine * cosine).sqrt()
            }
        }
    }

    /// BRDF of white microfacets, D·G₂/(4·cosₒ·cosᵢ), and the density by solid angle of directions
    /// mirrored at visible normals, D·G₁/(4·cosₒ).
    #[inline(always)]
    pub(super) fn eval_and_pdf(&self, directions: &Directions<N>) -> (N, N) {
        let (d, root) = (
            N::ONE / self.inverse_d(directions.half),
            self.root(directions.wo, directions.out),
        );
        let visibility = N::from_f64(0.5)
            / (directions.into * root + directions.out * self.root(directions.wi, directions.into));
        (
            d * visibility,
            d / (N::from_f64(2.0) * (directions.out + root)),
        )
    }

    /// BRDF of microfacets with this reflectance, and the density of its sampling.
    #[inline(always)]
    pub(super) fn reflected(
        &self,
        directions: &Directions<N>,
        reflectance: N::Vec3,
    ) -> (N::Vec3, N) {
        let (value, density) = self.eval_and_pdf(directions);
        (
            N::Vec3::select(
                directions.out.greater_than(N::ZERO),
                reflectance * value,
                N::Vec3::ZERO,
            ),
            density,
        )
    }

    /// Samples a visible normal along `wo` by two numbers in [0, 1), and the direction mirrored
    /// there. The direction is zero where it lies below the surface's normal: that light would hit
    /// another microfacet and is lost, and no other lobe may take it for transmission.
    pub(super) fn sample_mirrored(
        &self,
        normal: N::Vec3,
        wo: N::Vec3,
        point: [N; 2],
    ) -> (N::Vec3, N::Vec3) {
        let frame = self.frame();
        let facet = frame.to_world(sample_wm::<N>(
            frame.to_local(wo),
            self.alpha,
            on_disk(point),
        ));
        let direction = mirrored::<N>(wo, facet);
        (
            facet,
            N::Vec3::select(
                normal.dot(direction).greater_than(N::ZERO),
                direction,
                N::Vec3::ZERO,
            ),
        )
    }
}

/// Mirrors `wo` at a microfacet normal.
#[inline(always)]
pub(super) fn mirrored<N: Number>(wo: N::Vec3, facet: N::Vec3) -> N::Vec3 {
    facet * (N::from_f64(2.0) * wo.dot(facet)) - wo
}

/// Samples a visible normal along `wo`, for the α along both axes and a point of the unit disk
/// ("Sampling the GGX Distribution of Visible Normals", Heitz 2018). The half-ellipsoid of
/// microfacets is stretched to a hemisphere, which projects to half a disk and half an ellipse.
#[inline(always)]
pub(super) fn sample_wm<N: Number>(wo: N::Vec3, [ax, ay]: [N; 2], [a, b]: [N; 2]) -> N::Vec3 {
    let seen = N::Vec3::new(ax * wo.x(), ay * wo.y(), wo.z()).normalize();
    let across = (seen.x() * seen.x() + seen.y() * seen.y()).sqrt();
    let slanted = N::Vec3::new(-seen.y() / across, seen.x() / across, N::ZERO);
    let first = N::Vec3::select(
        across.greater_than(N::ZERO),
        slanted,
        N::Vec3::new(N::ONE, N::ZERO, N::ZERO),
    );
    let second = seen.cross(first);
    let half = N::from_f64(0.5) * (N::ONE + seen.z());
    let b = (N::ONE - half) * (N::ONE - a * a).max(N::ZERO).sqrt() + half * b;
    let up = (N::ONE - a * a - b * b).max(N::ZERO).sqrt();
    let facet = first * a + second * b + seen * up;
    N::Vec3::new(ax * facet.x(), ay * facet.y(), facet.z().max(N::ZERO)).normalize()
}
