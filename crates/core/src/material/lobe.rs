//! The lobes that a surface's answer to light is made of: plain data, each with its value, its density and its weight.

use core::f64::consts::PI;

use raywright_bvh::{Real, Vector};

use super::fresnel::{schlick, towards_grazing};

/// Least perceptual roughness of a glossy lobe: below it the highlight of a light without size is a spike.
const LEAST_ROUGHNESS: f64 = 0.03;

/// One way in which a surface sends light back or on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe<R: Real> {
    /// Lambert's below a layer that reflects by Schlick: albedo · (1 − F(h·l)) / π.
    Diffuse {
        /// Share that is diffused of what comes through the layer.
        albedo: R::Vec3,
        /// Reflectance of the layer at normal incidence.
        f0: R::Vec3,
    },
    /// Microfacets by the GGX distribution with height-correlated shadowing.
    Glossy {
        /// Reflectance of a facet at normal incidence.
        f0: R::Vec3,
        /// Perceptual roughness; the microfacet α is its square.
        roughness: R,
    },
    /// A smooth mirror, whose reflectance goes from the one to the other by Schlick.
    Mirror {
        /// Reflectance at normal incidence.
        f0: R::Vec3,
        /// Reflectance at grazing incidence.
        f90: R::Vec3,
    },
    /// A smooth boundary of a dielectric, by Fresnel's equations.
    Dielectric {
        /// Index on the side that the ray comes from over the one beyond; in f64, because refraction near the critical angle
        /// cancels.
        eta: f64,
        /// Share of the surface that is such a boundary.
        share: R,
        /// Factor of what is reflected.
        reflected: R::Vec3,
        /// Factor of what is let through.
        transmitted: R::Vec3,
    },
}

/// Two unit directions away from a surface and what the lobes ask of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair<R: Real> {
    normal: R::Vec3,
    /// Unit, halfway between them.
    half: R::Vec3,
    /// Cosines to the normal: of the way back, and of the light.
    out: R,
    into: R,
    /// Cosine between the light and `half`.
    tilt: R,
}

impl<R: Real> Pair<R> {
    #[inline(always)]
    pub fn new(normal: R::Vec3, wo: R::Vec3, wi: R::Vec3) -> Self {
        let half = (wi + wo).normalize();
        Self { normal, half, out: normal.dot(wo), into: normal.dot(wi), tilt: half.dot(wi).max(R::ZERO) }
    }

    /// GGX's density of facets ("Microfacet Models for Refraction through Rough Surfaces", Walter et al. 2007), in the form
    /// (hx² + hy²)/α² + hz², which keeps its digits at low roughness. Takes α².
    #[inline(always)]
    fn facets(&self, a2: R) -> R {
        let across = self.normal.cross(self.half);
        let hz = self.normal.dot(self.half);
        let slope = across.dot(across) / a2 + hz * hz;
        R::ONE / (R::from_f64(PI) * a2 * slope * slope)
    }
}

/// α² of a perceptual roughness.
#[inline(always)]
fn squared_alpha<R: Real>(roughness: R) -> R {
    Real::powi(roughness.max(R::from_f64(LEAST_ROUGHNESS)), 4)
}

/// √(α² + (1 − α²)·cos²), of which Smith's shadowing is made ("Understanding the Masking-Shadowing Function", Heitz 2014).
#[inline(always)]
fn smith<R: Real>(a2: R, cosine: R) -> R {
    (a2 + (R::ONE - a2) * cosine * cosine).sqrt()
}

impl<R: Real> Lobe<R> {
    /// Whether it answers in single directions only, so that it has neither a value nor a density.
    #[inline(always)]
    pub fn is_delta(&self) -> bool {
        matches!(self, Self::Mirror { .. } | Self::Dielectric { .. })
    }

    /// Its bidirectional reflectance, for a light above the surface.
    #[inline(always)]
    pub(super) fn value(&self, pair: &Pair<R>) -> R::Vec3 {
        match *self {
            Self::Diffuse { albedo, f0 } => albedo * (R::Vec3::ONE - schlick(f0, pair.tilt)) / R::from_f64(PI),
            Self::Glossy { f0, roughness } if pair.out > R::ZERO => {
                let a2 = squared_alpha(roughness);
                let visibility = R::from_f64(0.5) / (pair.into * smith(a2, pair.out) + pair.out * smith(a2, pair.into));
                schlick(f0, pair.tilt) * (pair.facets(a2) * visibility)
            }
            _ => R::Vec3::ZERO,
        }
    }

    /// Density by solid angle with which [`Self::drawn`] gives the light's direction, both above the surface.
    pub(super) fn density(&self, pair: &Pair<R>) -> R {
        match *self {
            Self::Diffuse { .. } => pair.into / R::from_f64(PI),
            // The density of visible facets D·G₁·(o·h)/cosₒ over 4·(o·h), with G₁ = 2·cosₒ / (cosₒ + smith(cosₒ)).
            Self::Glossy { roughness, .. } => {
                let a2 = squared_alpha(roughness);
                pair.facets(a2) / (R::from_f64(2.0) * (pair.out + smith(a2, pair.out)))
            }
            Self::Mirror { .. } | Self::Dielectric { .. } => R::ZERO,
        }
    }

    /// A direction in the frame whose third axis is the normal, for the way back in that frame and two numbers in [0, 1). Of a
    /// lobe that is not delta.
    pub(super) fn drawn(&self, wo: R::Vec3, [u, v]: [R; 2]) -> R::Vec3 {
        let angle = R::from_f64(2.0 * PI) * v;
        let disk = [u.sqrt() * angle.cos(), u.sqrt() * angle.sin()];
        match *self {
            Self::Glossy { roughness, .. } => {
                let facet = visible_facet::<R>(wo, squared_alpha(roughness).sqrt(), disk);
                facet * (R::from_f64(2.0) * wo.dot(facet)) - wo
            }
            // By the cosine: a point of the disk, raised to the hemisphere (Malley).
            _ => R::Vec3::new(disk[0], disk[1], (R::ONE - u).max(R::ZERO).sqrt()),
        }
    }

    /// How much it may send back to a direction with this cosine to the normal: what choosing among lobes goes by.
    pub(super) fn importance(&self, cosine: R) -> R {
        match *self {
            Self::Diffuse { albedo, .. } => albedo.max_element(),
            Self::Glossy { f0, .. } => schlick(f0, cosine.max(R::ZERO)).max_element(),
            Self::Mirror { .. } => self.reflectance(cosine).max_element(),
            Self::Dielectric { share, reflected, transmitted, .. } => share * reflected.max(transmitted).max_element(),
        }
    }

    /// Share that a mirror reflects at this cosine to the normal; of other lobes nothing.
    #[inline(always)]
    pub fn reflectance(&self, cosine: R) -> R::Vec3 {
        let Self::Mirror { f0, f90 } = *self else { return R::Vec3::ZERO };
        f0 + (f90 - f0) * towards_grazing(cosine.max(R::ZERO))
    }
}

/// The normal of a facet that is seen along `wo`, for a point of the unit disk ("Sampling the GGX Distribution of Visible
/// Normals", Heitz 2018): the half-ellipsoid of facets is stretched to a half-sphere, whose outline is a disk and half a disk.
fn visible_facet<R: Real>(wo: R::Vec3, alpha: R, [a, b]: [R; 2]) -> R::Vec3 {
    let seen = R::Vec3::new(alpha * wo.x(), alpha * wo.y(), wo.z()).normalize();
    let across = (seen.x() * seen.x() + seen.y() * seen.y()).sqrt();
    let first = if across > R::ZERO {
        R::Vec3::new(-seen.y() / across, seen.x() / across, R::ZERO)
    } else {
        R::Vec3::new(R::ONE, R::ZERO, R::ZERO)
    };
    let second = seen.cross(first);
    let half = R::from_f64(0.5) * (R::ONE + seen.z());
    let b = (R::ONE - half) * (R::ONE - a * a).max(R::ZERO).sqrt() + half * b;
    let up = (R::ONE - a * a - b * b).max(R::ZERO).sqrt();
    let facet = first * a + second * b + seen * up;
    R::Vec3::new(alpha * facet.x(), alpha * facet.y(), facet.z().max(R::ZERO)).normalize()
}
