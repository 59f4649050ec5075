//! The GGX microfacet distribution, isotropic or anisotropic: density of normals, Smith's
//! height-correlated masking-shadowing, and sampling of visible normals ("Microfacet Models for
//! Refraction through Rough Surfaces", Walter et al. 2007; "Understanding the Masking-Shadowing
//! Function", Heitz 2014; "Physically-Based Shading at Disney", Burley 2012).

use core::f64::consts::PI;

use super::lobe_traits::{Directions, sample_disk};
use super::shading_frame::ShadingFrame;
use crate::number::{Number, Vector3};

/// Least perceptual roughness of a glossy lobe. A smoother surface would show a delta light as a
/// spike.
pub(super) const LEAST_ROUGHNESS: f64 = 0.03;

/// Returns the microfacet α, the square of the perceptual roughness. Roughnesses below
/// [`LEAST_ROUGHNESS`] count as that limit.
#[inline(always)]
pub(super) fn alpha_from_roughness<N: Number>(roughness: N) -> N {
    roughness.max(N::from_f64(LEAST_ROUGHNESS)).powi(2)
}

/// A GGX distribution of microfacets about a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx<N: Number> {
    /// Unit normal of the surface.
    pub(super) normal: N::Vec3,
    /// Unit tangent and bitangent of anisotropic microfacets; `None` for isotropic microfacets.
    axes: Option<[N::Vec3; 2]>,
    /// Microfacet α along the tangent and along the bitangent.
    pub(super) alpha: [N; 2],
}

impl<N: Number> Ggx<N> {
    /// Creates an isotropic distribution with a perceptual roughness.
    #[inline(always)]
    pub fn isotropic(normal: N::Vec3, roughness: N) -> Self {
        Self {
            normal,
            axes: None,
            alpha: [alpha_from_roughness(roughness); 2],
        }
    }

    /// Creates an anisotropic distribution, rougher along the frame's tangent, as in
    /// KHR_materials_anisotropy. `strength` lies in [0, 1]. The α along the bitangent is that of
    /// `roughness`, a; the α along the tangent is a + (1 − a)·`strength`².
    #[inline]
    pub fn anisotropic(frame: ShadingFrame<N>, roughness: N, strength: N) -> Self {
        let alpha = alpha_from_roughness(roughness);
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

    /// Returns the perceptual roughness: the fourth root of the product of α along tangent and
    /// bitangent.
    pub fn roughness(&self) -> N {
        (self.alpha[0] * self.alpha[1]).sqrt().sqrt()
    }

    /// Returns the frame of normal, tangent and bitangent. Isotropic microfacets have an arbitrary
    /// tangent.
    pub(super) fn frame(&self) -> ShadingFrame<N> {
        let value_of = |[tangent, bitangent]: [N::Vec3; 2]| ShadingFrame {
            tangent,
            bitangent,
            normal: self.normal,
        };
        self.axes
            .map_or_else(|| ShadingFrame::from_normal(self.normal), value_of)
    }

    /// Returns 1/D for the density D of microfacet normals at the half vector h = (hx, hy, hz). The
    /// isotropic form contains (hx² + hy²)/α² + hz²: it keeps its digits at low roughness.
    #[inline(always)]
    pub(super) fn reciprocal_d(&self, half: N::Vec3) -> N {
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

    /// Returns cos·(1 + 2Λ) for a unit direction whose cosine to the normal is cos. Λ is Smith's
    /// auxiliary function; the masking is G₁ = 2·cos/(cos + cos·(1 + 2Λ)). For isotropic
    /// microfacets the result is √(α² + (1 − α²)·cos²).
    #[inline(always)]
    pub(super) fn smith_root(&self, v: N::Vec3, cosine: N) -> N {
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

    /// Returns the BRDF of white microfacets, D·G₂/(4·cosₒ·cosᵢ), and the density by solid angle of
    /// sampling `wi`, D·G₁/(4·cosₒ). D is the density of normals, G₁ and G₂ are Smith's masking and
    /// masking-shadowing. Cosines are those of `wo` and `wi` to the normal.
    #[inline(always)]
    pub(super) fn eval_and_pdf(&self, directions: &Directions<N>) -> (N, N) {
        let (d, root) = (
            N::ONE / self.reciprocal_d(directions.half),
            self.smith_root(directions.wo, directions.cos_wo),
        );
        let visibility = N::from_f64(0.5)
            / (directions.cos_wi * root
                + directions.cos_wo * self.smith_root(directions.wi, directions.cos_wi));
        (
            d * visibility,
            d / (N::from_f64(2.0) * (directions.cos_wo + root)),
        )
    }

    /// Returns the BRDF of microfacets of the given reflectance, and the density by solid angle of
    /// [`Self::sample_reflection`].
    #[inline(always)]
    pub(super) fn eval_reflection_and_pdf(
        &self,
        directions: &Directions<N>,
        reflectance: N::Vec3,
    ) -> (N::Vec3, N) {
        let (value, density) = self.eval_and_pdf(directions);
        (
            N::Vec3::select(
                directions.cos_wo.greater_than(N::ZERO),
                reflectance * value,
                N::Vec3::ZERO,
            ),
            density,
        )
    }

    /// Samples a microfacet normal visible along `wo` by two random numbers in [0, 1). Returns this
    /// normal, and `wo` mirrored at it.
    ///
    /// The mirrored direction is zero where it would lie below `normal`: its light would hit
    /// another microfacet and counts as lost. No other lobe may take such a direction for
    /// transmission.
    pub(crate) fn sample_reflection(
        &self,
        normal: N::Vec3,
        wo: N::Vec3,
        point: [N; 2],
    ) -> (N::Vec3, N::Vec3) {
        let frame = self.frame();
        let wm = frame.to_world(sample_wm::<N>(
            frame.to_local(wo),
            self.alpha,
            sample_disk(point),
        ));
        let direction = reflect::<N>(wo, wm);
        (
            wm,
            N::Vec3::select(
                normal.dot(direction).greater_than(N::ZERO),
                direction,
                N::Vec3::ZERO,
            ),
        )
    }
}

/// Returns `wo` mirrored at a unit microfacet normal.
#[inline(always)]
pub(super) fn reflect<N: Number>(wo: N::Vec3, wm: N::Vec3) -> N::Vec3 {
    wm * (N::from_f64(2.0) * wo.dot(wm)) - wo
}

/// Samples a microfacet normal visible along `wo`, from a uniform point of the unit disk ("Sampling
/// the GGX Distribution of Visible Normals", Heitz 2018). `[ax, ay]` is α along both axes;
/// directions are in the frame of the microfacets.
///
/// Stretching by α turns the half-ellipsoid of microfacets into a hemisphere. Its projection along
/// `wo` is half a disk and half an ellipse.
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
    let wm = first * a + second * b + seen * up;
    N::Vec3::new(ax * wm.x(), ay * wm.y(), wm.z().max(N::ZERO)).normalize()
}
