//! Microfacets by the GGX distribution, as rough along every direction or rougher along one: the
//! density of their normals, Smith's height-correlated masking and shadowing, and normals drawn as
//! they are seen ("Microfacet Models for Refraction through Rough Surfaces", Walter et al. 2007;
//! "Understanding the Masking-Shadowing Function", Heitz 2014; "Physically-Based Shading at
//! Disney", Burley 2012).

use core::f64::consts::PI;

use super::frame::Frame;
use super::lobe_kind::{Pair, on_disk};
use crate::number::{Number, Vector3};

/// Least perceptual roughness of a glossy lobe: below it the highlight of a light without size is a
/// spike.
pub(super) const LEAST_ROUGHNESS: f64 = 0.03;

/// α of a perceptual roughness.
#[inline(always)]
pub(super) fn alpha<N: Number>(roughness: N) -> N {
    roughness.max(N::from_f64(LEAST_ROUGHNESS)).powi(2)
}

/// Facets about a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx<N: Number> {
    pub(super) normal: N::Vec3,
    /// Unit, across the normal and each other; none: facets are as rough along any.
    axes: Option<[N::Vec3; 2]>,
    /// α along the axes.
    pub(super) alpha: [N; 2],
}

impl<N: Number> Ggx<N> {
    /// As rough along any direction.
    #[inline(always)]
    pub fn isotropic(normal: N::Vec3, roughness: N) -> Self {
        Self {
            normal,
            axes: None,
            alpha: [alpha(roughness); 2],
        }
    }

    /// Rougher along the frame's tangent, by a strength from 0 to 1, as glTF's
    /// KHR_materials_anisotropy has it: α there goes from that of the roughness to one with the
    /// strength's square.
    #[inline]
    pub fn anisotropic(frame: Frame<N>, roughness: N, strength: N) -> Self {
        let alpha = alpha(roughness);
        let Frame {
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

    /// Perceptual roughness of isotropic facets about as rough.
    pub fn roughness(&self) -> N {
        (self.alpha[0] * self.alpha[1]).sqrt().sqrt()
    }

    /// The frame of the axes, any where there are none.
    pub(super) fn frame(&self) -> Frame<N> {
        let of = |[tangent, bitangent]: [N::Vec3; 2]| Frame {
            tangent,
            bitangent,
            normal: self.normal,
        };
        self.axes.map_or_else(|| Frame::about(self.normal), of)
    }

    /// One over the density D of facets about a normal of theirs. Isotropic ones in the form (hx² +
    /// hy²)/α² + hz², which keeps its digits at low roughness.
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

    /// cos·(1 + 2Λ) of a direction with this cosine, √(α² + (1 − α²)·cos²) where facets are
    /// isotropic, of which Smith's masking is made: G₁ = 2·cos/(cos + root).
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

    /// What white facets send from one direction of a pair about their normal to the other,
    /// D·G₂/(4·cosₒ·cosᵢ), and the density by solid angle of the directions that seen facets mirror
    /// the view to, D·G₁/(4·cosₒ).
    #[inline(always)]
    pub(super) fn eval_and_pdf(&self, pair: &Pair<N>) -> (N, N) {
        let (d, root) = (
            N::ONE / self.inverse_d(pair.half),
            self.root(pair.wo, pair.out),
        );
        let visibility =
            N::from_f64(0.5) / (pair.into * root + pair.out * self.root(pair.wi, pair.into));
        (d * visibility, d / (N::from_f64(2.0) * (pair.out + root)))
    }

    /// What facets of such a reflectance send back, and their density.
    #[inline(always)]
    pub(super) fn reflected(&self, pair: &Pair<N>, reflectance: N::Vec3) -> (N::Vec3, N) {
        let (value, density) = self.eval_and_pdf(pair);
        (
            N::Vec3::select(pair.out.above(N::ZERO), reflectance * value, N::Vec3::ZERO),
            density,
        )
    }

    /// The normal of a facet that is seen along `wo`, for two numbers in [0, 1), and the direction
    /// that is mirrored there; zero where that is below a surface's normal. It meets another facet
    /// there and is lost: no other lobe may take it for light that goes through.
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
                normal.dot(direction).above(N::ZERO),
                direction,
                N::Vec3::ZERO,
            ),
        )
    }
}

/// Mirrored at a facet.
#[inline(always)]
pub(super) fn mirrored<N: Number>(wo: N::Vec3, facet: N::Vec3) -> N::Vec3 {
    facet * (N::from_f64(2.0) * wo.dot(facet)) - wo
}

/// The normal of a facet that is seen along `wo`, for the α along both axes and a point of the unit
/// disk ("Sampling the GGX Distribution of Visible Normals", Heitz 2018): the half-ellipsoid of
/// facets is stretched to a half-sphere, whose outline is a disk and half a disk.
#[inline(always)]
pub(super) fn sample_wm<N: Number>(wo: N::Vec3, [ax, ay]: [N; 2], [a, b]: [N; 2]) -> N::Vec3 {
    let seen = N::Vec3::new(ax * wo.x(), ay * wo.y(), wo.z()).normalize();
    let across = (seen.x() * seen.x() + seen.y() * seen.y()).sqrt();
    let slanted = N::Vec3::new(-seen.y() / across, seen.x() / across, N::ZERO);
    let first = N::Vec3::select(
        across.above(N::ZERO),
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
