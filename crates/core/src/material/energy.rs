//! Energy conservation of microfacets by their directional albedos: the base receives exactly the
//! energy that the microfacets leave, and the energy of multiple scattering returns.
//!
//! With E(o) the directional albedo towards o and Ē its cosine-weighted mean, the lobe (1 −
//! E(o))·(1 − E(i))/(π·(1 − Ē)) has the albedo 1 − E(o) ("A Microfacet Based Coupled Specular-Matte
//! BRDF Model with Importance Sampling", Kelemen, Szirmay-Kalos 2001; "Revisiting Physically Based
//! Shading at Imageworks", Kulla, Conty 2017). The lobe is reciprocal and keeps exactly the energy
//! that E leaves. Two uses share this formula: the base below a layer, where E is the layer's
//! albedo, and the multiple scattering among microfacets, where E is the albedo of white ones.
//! Refused for the base: glTF's 1 − F(h·l), by which white plastic reflects 1.89 times the incident
//! light at 89.5°; 1 − E(o) alone (Cycles, OpenPBR), which conserves energy but is not reciprocal;
//! min(1 − E(o), 1 − E(i)), the rule of coats, which never gains energy but loses 5 % head-on.

use super::albedo::{Albedo, MEAN_GRAZING};
use crate::number::{Mask, Number, Vector3};

/// Directional albedo of microfacets with Schlick's reflectance from `f0` to 1.
pub(super) fn directional_albedo(f0: f64, roughness: f64, cosine: f64) -> f64 {
    Albedo::<f64>::at_cosine(cosine, roughness)
        .sent(f0, 1.0)
        .clamp(0.0, 1.0)
}

/// Factor on the multiple scattering of white microfacets for reflectances from `f0` to `f90`:
/// F̄²·Ē/(1 − F̄·(1 − Ē)) with the mean reflectance F̄ (Kulla, Conty 2017). `lost` is 1 − Ē, the
/// mean loss of white microfacets.
#[inline(always)]
pub(super) fn interreflected_of<N: Number>(f0: N, f90: N, lost: N) -> N {
    let mean = f0 + (f90 - f0) * N::from_f64(MEAN_GRAZING);
    mean * mean * (N::ONE - lost) / (N::ONE - mean * lost)
}

/// Factors of multiple scattering: of dielectric microfacets with these reflectances at normal and
/// grazing incidence, and of all microfacets, with the shares of dielectric and metal.
#[inline(always)]
pub(super) fn interreflections<N: Number>(
    [f0, f90]: [N; 2],
    metal: N::Vec3,
    shares: [N; 2],
    lost: N,
) -> (N, N::Vec3) {
    let (dielectric, part) = (interreflected_of(f0, f90, lost), |f0: N| {
        interreflected_of(f0, N::ONE, lost)
    });
    let metal = N::Vec3::new(part(metal.x()), part(metal.y()), part(metal.z()));
    (
        dielectric,
        metal * shares[1] + N::Vec3::splat(dielectric * shares[0]),
    )
}

/// Cosine-weighted mean over the hemisphere of a function of the cosine: Gauss's rule in the
/// cosine's square.
pub(super) fn mean_of<N: Number>(value_of: impl Fn(N) -> N) -> N {
    const RULE: [[f64; 2]; 4] = [
        [0.069_431_844_202_973_7, 0.173_927_422_568_726_9],
        [0.330_009_478_207_571_9, 0.326_072_577_431_273_1],
        [0.669_990_521_792_428_1, 0.326_072_577_431_273_1],
        [0.930_568_155_797_026_3, 0.173_927_422_568_726_9],
    ];
    RULE.iter().fold(N::ZERO, |sum, [square, weight]| {
        sum + value_of(N::from_f64(square.sqrt())) * N::from_f64(*weight)
    })
}

/// Energy that a microfacet layer leaves to the base below, and energy that white microfacets leave
/// to multiple scattering, for one viewing direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyComplement<N: Number> {
    /// Reflectance of the layer at normal and at grazing incidence, and its factor on the multiple
    /// scattering of white microfacets.
    layer: [N; 3],
    /// Perceptual roughness.
    pub(super) roughness: N,
    /// Remaining energy towards the view over its mean: of the layer, and of white microfacets.
    pub(super) view_factors: [N; 2],
    /// Remaining energy towards the view: the albedo of a white base there, and of the multiple
    /// scattering of white microfacets. Importance for choosing a lobe.
    pub(super) shown: [N; 2],
}

/// Least mean that counts as above zero.
const LEAST_MEAN: f64 = 1e-6;

impl<N: Number> EnergyComplement<N> {
    /// The remainder of a layer, before a viewing direction is set.
    #[inline(always)]
    pub(super) fn new(layer: [N; 3], roughness: N) -> Self {
        Self {
            layer,
            roughness,
            view_factors: [N::ONE; 2],
            shown: [N::ONE; 2],
        }
    }

    /// Sets the viewing direction by its remaining energy and the mean.
    #[inline(always)]
    pub(super) fn seen_with(self, left: [N; 2], mean: [N; 2]) -> Self {
        let over = |k: usize| left[k] / mean[k].max(N::from_f64(LEAST_MEAN));
        Self {
            view_factors: [over(0), over(1)],
            shown: left,
            ..self
        }
    }

    /// Sets the viewing direction by its cosine.
    #[inline(always)]
    pub(super) fn seen_at(self, cosine: N, mean: Albedo<N>) -> Self {
        self.seen_with(
            self.remaining(Albedo::at_cosine(cosine, self.roughness)),
            self.remaining(mean),
        )
    }

    /// Remaining energy: below the layer, and of white microfacets.
    #[inline(always)]
    pub(super) fn remaining(&self, albedo: Albedo<N>) -> [N; 2] {
        self.remaining_of(albedo.sent(self.layer[0], self.layer[1]), albedo.lost)
    }

    /// Remaining energy for a layer with the given single-scattering albedo.
    #[inline(always)]
    pub(super) fn remaining_of(&self, scattered: N, lost: N) -> [N; 2] {
        [
            (N::ONE - (scattered + self.layer[2] * lost)).max(N::ZERO),
            lost,
        ]
    }

    /// Single-scattering albedo of a layer by Fresnel's equations, from the albedo of the bare
    /// index and its reflectance at normal incidence. A colour's addition at normal incidence falls
    /// as Schlick's weight rises.
    pub(super) fn sent_exactly(&self, scattered: N, normal: N, albedo: Albedo<N>) -> N {
        let falling = (N::ONE - albedo.lost - albedo.grazing).max(N::ZERO);
        (self.layer[1] * scattered + (self.layer[0] - self.layer[1] * normal) * falling)
            .max(N::ZERO)
    }

    /// Whether the layer reflects in any lane.
    #[inline(always)]
    pub(super) fn is_covered(&self) -> bool {
        self.layer[0]
            .max(self.layer[1])
            .max(self.layer[2])
            .greater_than(N::ZERO)
            .any()
    }

    /// Factors of 1/π for light from a direction: of the reflection by a white base, and of the
    /// multiple scattering of white microfacets.
    #[inline(always)]
    pub(super) fn factors(&self, cosine: N) -> [N; 2] {
        let left = self.remaining(Albedo::at_cosine(cosine, self.roughness));
        [
            left[0] * self.view_factors[0],
            left[1] * self.view_factors[1],
        ]
    }
}
