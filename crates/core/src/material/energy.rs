//! Energy conservation of microfacets by their directional albedos. The base below the microfacets
//! receives exactly the energy that they do not reflect. A further lobe returns the energy of
//! multiple scattering.
//!
//! Let E(o) be the directional albedo of the microfacets for the direction o, and Ē its
//! cosine-weighted mean. Then the lobe (1 − E(o))·(1 − E(i))/(π·(1 − Ē)) has the albedo 1 − E(o)
//! ("A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling", Kelemen,
//! Szirmay-Kalos 2001; "Revisiting Physically Based Shading at Imageworks", Kulla, Conty 2017). The
//! lobe is reciprocal and conserves energy exactly. Two lobes have this form:
//! - the base below a layer, with the albedo E of the layer;
//! - multiple scattering among microfacets, with the albedo E of white microfacets.
//!
//! Three other factors on the base were rejected:
//! - 1 − F(h·l), of glTF: white plastic reflects 1.89 times the incident light at 89.5°.
//! - 1 − E(o) alone, of Cycles and OpenPBR: it conserves energy but is not reciprocal.
//! - min(1 − E(o), 1 − E(i)), used here for coats: it gains no energy but loses 5 % at normal
//!   incidence.

use super::albedo::{Albedo, MEAN_GRAZING};
use super::fresnel::LEAST_UNREFLECTED;
use crate::number::{Mask, Number, Vector3};

/// Returns the directional albedo in [0, 1] of microfacets with Schlick's reflectance, from `f0` at
/// normal incidence to 1 at grazing incidence.
pub(super) fn directional_albedo(f0: f64, roughness: f64, cosine: f64) -> f64 {
    Albedo::<f64>::at_cosine(cosine, roughness)
        .schlick_albedo(f0, 1.0)
        .clamp(0.0, 1.0)
}

/// Returns the factor F̄²·Ē/(1 − F̄·(1 − Ē)) by which coloured microfacets scale the multiple
/// scattering of white microfacets (Kulla, Conty 2017). F̄ is the mean of Schlick's reflectance
/// from `f0` to `f90`. `lost` is 1 − Ē, the mean loss of white microfacets in a single reflection.
#[inline(always)]
pub(super) fn multiple_scattering_factor<N: Number>(f0: N, f90: N, lost: N) -> N {
    let mean = f0 + (f90 - f0) * N::from_f64(MEAN_GRAZING);
    mean * mean * (N::ONE - lost) / (N::ONE - mean * lost)
}

/// Returns [`multiple_scattering_factor`] for dielectric microfacets alone, and for the mixture of
/// dielectric and metal. `[f0, f90]` are the dielectric's reflectances at normal and grazing
/// incidence, `metal` is the metal's reflectance at normal incidence. `shares` are the shares of
/// dielectric and metal.
#[inline(always)]
pub(super) fn multiple_scattering_factors<N: Number>(
    [f0, f90]: [N; 2],
    metal: N::Vec3,
    shares: [N; 2],
    lost: N,
) -> (N, N::Vec3) {
    let (dielectric, part) = (multiple_scattering_factor(f0, f90, lost), |f0: N| {
        multiple_scattering_factor(f0, N::ONE, lost)
    });
    let metal = N::Vec3::new(part(metal.x()), part(metal.y()), part(metal.z()));
    (
        dielectric,
        metal * shares[1] + N::Vec3::splat(dielectric * shares[0]),
    )
}

/// Returns the cosine-weighted hemispherical mean of a function of the cosine. Gauss–Legendre
/// quadrature, with the squared cosine as variable.
pub(super) fn cosine_weighted_mean<N: Number>(value_of: impl Fn(N) -> N) -> N {
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

/// Energy 1 − E that microfacets of directional albedo E do not reflect, for one viewing direction.
/// Two energies are kept: of the actual layer, for the base below, and of white microfacets, for
/// multiple scattering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyComplement<N: Number> {
    /// Reflectances of the layer at normal and at grazing incidence, and its factor on the multiple
    /// scattering of white microfacets.
    layer: [N; 3],
    /// Perceptual roughness.
    pub(super) roughness: N,
    /// Ratio (1 − E(o))/(1 − Ē) for the viewing direction o: first of the layer, then of white
    /// microfacets.
    pub(super) view_factors: [N; 2],
    /// Energy 1 − E(o) for the viewing direction o: first of the layer, then of white microfacets.
    /// The first number is the albedo of a white base. Both numbers are sampling weights, of the
    /// base and of multiple scattering.
    pub(super) view_energy: [N; 2],
}

/// Lower limit of a mean energy used as a divisor.
const LEAST_MEAN: f64 = 1e-6;

impl<N: Number> EnergyComplement<N> {
    /// Creates the energies of a layer, before its viewing direction is known. `layer` holds the
    /// layer's reflectances at normal and at grazing incidence, and its factor on the multiple
    /// scattering of white microfacets.
    #[inline(always)]
    pub(super) fn new(layer: [N; 3], roughness: N) -> Self {
        Self {
            layer,
            roughness,
            view_factors: [N::ONE; 2],
            view_energy: [N::ONE; 2],
        }
    }

    /// Sets the energies for a viewing direction o: `left` is 1 − E(o), `mean` is 1 − Ē. Each holds
    /// a number for the layer and a number for white microfacets.
    #[inline(always)]
    pub(super) fn with_view_energy(self, left: [N; 2], mean: [N; 2]) -> Self {
        let over = |k: usize| left[k] / mean[k].max(N::from_f64(LEAST_MEAN));
        Self {
            view_factors: [over(0), over(1)],
            view_energy: left,
            ..self
        }
    }

    /// Sets the viewing direction by its cosine to the normal. `mean` is the hemispherical mean of
    /// the albedo.
    #[inline(always)]
    pub(super) fn with_view_cosine(self, cosine: N, mean: Albedo<N>) -> Self {
        self.with_view_energy(
            self.unreflected_energy(Albedo::at_cosine(cosine, self.roughness)),
            self.unreflected_energy(mean),
        )
    }

    /// Returns the energy 1 − E that an albedo leaves: first of the layer, then of white
    /// microfacets.
    #[inline(always)]
    pub(super) fn unreflected_energy(&self, albedo: Albedo<N>) -> [N; 2] {
        self.unreflected_energy_for_albedo(
            albedo.schlick_albedo(self.layer[0], self.layer[1]),
            albedo.multiple_scattering_loss,
        )
    }

    /// Returns the energies of [`Self::unreflected_energy`] for a layer of any reflectance.
    /// `scattered` is the layer's albedo by single scattering, `lost` the loss of white microfacets
    /// in a single reflection.
    #[inline(always)]
    pub(super) fn unreflected_energy_for_albedo(&self, scattered: N, lost: N) -> [N; 2] {
        [
            (N::ONE - (scattered + self.layer[2] * lost)).max(N::ZERO),
            lost,
        ]
    }

    /// Returns the single-scattering albedo of a layer that follows Fresnel's equations.
    /// `scattered` is the albedo for the index of refraction alone, `normal` the reflectance of
    /// that index at normal incidence. The layer's tint may change the reflectance at normal
    /// incidence: what it takes away fades as Schlick's weight rises, what it adds fades as the
    /// reflectance rises.
    pub(super) fn fresnel_layer_albedo(&self, scattered: N, normal: N, albedo: Albedo<N>) -> N {
        let white = N::ONE - albedo.multiple_scattering_loss;
        let added = self.layer[0] - self.layer[1] * normal;
        let unreflected = (white - scattered).max(N::ZERO)
            / (N::ONE - normal).max(N::from_f64(LEAST_UNREFLECTED));
        (self.layer[1] * scattered
            + added.min(N::ZERO) * (white - albedo.schlick_part).max(N::ZERO)
            + added.max(N::ZERO) * unreflected)
            .max(N::ZERO)
    }

    /// Whether the layer reflects in any lane.
    #[inline(always)]
    pub(super) fn has_reflective_layer(&self) -> bool {
        self.layer[0]
            .max(self.layer[1])
            .max(self.layer[2])
            .greater_than(N::ZERO)
            .any_lane()
    }

    /// Returns the BRDFs, times π, of a white base below the layer and of the multiple scattering
    /// of white microfacets. `cosine` is the cosine of the light's direction to the normal.
    #[inline(always)]
    pub(super) fn diffuse_factors(&self, cosine: N) -> [N; 2] {
        let left = self.unreflected_energy(Albedo::at_cosine(cosine, self.roughness));
        [
            left[0] * self.view_factors[0],
            left[1] * self.view_factors[1],
        ]
    }
}
