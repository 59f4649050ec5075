//! The lobes of common materials, each with its value, density and sampling.

use core::f64::consts::PI;

use super::dielectric::Dielectric;
use super::energy::EnergyComplement;
use super::fresnel::schlick_weight;
use super::ggx::{Ggx, alpha_from_roughness, reflect, sample_wm};
use super::lambert::Lambert;
use super::lobe_traits::{
    BsdfLobe, Directions, ScatteringLobe, normalize_if_drifted, sample_cosine_hemisphere,
    sample_disk,
};
use super::multiple_scattering::MultipleScattering;
use super::shading_frame::ShadingFrame;
use crate::number::{Mask, Number, Vector3};

/// A lobe of the BSDF of a common material: a surface without layers such as a coat or sheen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe<N: Number> {
    /// Lambert's lobe below microfacets with Schlick's reflectance. It includes the multiple
    /// scattering among these microfacets.
    Diffuse {
        /// Diffuse reflectance of the base, for light that passes the microfacets.
        albedo: N::Vec3,
        /// Factor by which these microfacets scale the multiple scattering of white microfacets.
        interreflected: N::Vec3,
        /// Energy that the microfacets do not reflect. It feeds the base and the multiple
        /// scattering.
        energy_complement: EnergyComplement<N>,
    },
    /// Lambert's lobe, which reflects the same radiance in every direction.
    Lambert(Lambert<N>),
    /// GGX microfacets with Schlick's reflectance from `f0` to `f90`.
    Rough {
        /// Reflectance of a microfacet at normal incidence.
        f0: N::Vec3,
        /// Reflectance of a microfacet at grazing incidence.
        f90: N::Vec3,
        /// Perceptual roughness; the microfacet α is its square.
        roughness: N,
    },
    /// A smooth mirror with Schlick's reflectance from `f0` to `f90`.
    Mirror {
        /// Reflectance at normal incidence.
        f0: N::Vec3,
        /// Reflectance at grazing incidence.
        f90: N::Vec3,
    },
    /// A dielectric boundary, smooth or rough.
    Dielectric(Dielectric<N>),
    /// Multiple scattering among the microfacets of a rough dielectric boundary.
    MultipleScattering(MultipleScattering<N>),
}

impl<N: Number> BsdfLobe<N> for Lobe<N> {
    const NOTHING: Self = Self::Mirror {
        f0: <N::Vec3 as Vector3<N>>::ZERO,
        f90: <N::Vec3 as Vector3<N>>::ZERO,
    };
}

impl<N: Number> ScatteringLobe<N> for Lobe<N> {
    #[inline(always)]
    fn is_delta(&self) -> bool {
        matches!(
            self,
            Self::Mirror { .. }
                | Self::Dielectric(Dielectric {
                    roughness: None,
                    ..
                })
        )
    }

    #[inline(always)]
    fn is_transmissive(&self) -> bool {
        matches!(
            self,
            Self::Dielectric(Dielectric {
                roughness: Some(_),
                ..
            }) | Self::MultipleScattering(_)
        )
    }

    #[inline(always)]
    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let by_cosine = |diffused: N::Vec3| {
            (
                diffused / N::from_f64(PI),
                directions.cos_wi / N::from_f64(PI),
            )
        };
        match *self {
            Self::Diffuse {
                albedo,
                interreflected,
                energy_complement,
            } => {
                // Matte surfaces of the classic model have no microfacets, so the tables are not
                // needed.
                if !energy_complement.has_reflective_layer()
                    && !interreflected
                        .max_element()
                        .greater_than(N::ZERO)
                        .any_lane()
                {
                    return by_cosine(albedo);
                }
                let [base, lost] = energy_complement.diffuse_factors(directions.cos_wi);
                by_cosine(albedo * base + interreflected * lost)
            }
            Self::Lambert(lambert) => lambert.eval_and_pdf(directions),
            Self::Rough { f0, f90, roughness } => {
                let reflectance = f0 + (f90 - f0) * schlick_weight(directions.cos_half);
                let (value, density) = Ggx::isotropic(directions.normal, roughness)
                    .eval_reflection_and_pdf(directions, reflectance);
                // The selection also gives zero for opposite directions, which have no half vector.
                let some = f0.max(f90).max_element().greater_than(N::ZERO);
                (N::Vec3::select(some, value, N::Vec3::ZERO), density)
            }
            Self::Dielectric(boundary) => boundary.eval_and_pdf(directions),
            Self::MultipleScattering(bare_interreflected) => {
                bare_interreflected.eval_and_pdf(directions)
            }
            Self::Mirror { .. } => (N::Vec3::ZERO, N::ZERO),
        }
    }

    #[inline(always)]
    fn eval_diffuse(&self, directions: &Directions<N>) -> N::Vec3 {
        match *self {
            Self::Diffuse {
                albedo,
                energy_complement,
                ..
            } => {
                let base = if energy_complement.has_reflective_layer() {
                    energy_complement.diffuse_factors(directions.cos_wi)[0]
                } else {
                    N::ONE
                };
                albedo * base / N::from_f64(PI)
            }
            Self::Lambert(lambert) => lambert.eval_diffuse(directions),
            _ => N::Vec3::ZERO,
        }
    }

    #[inline(always)]
    fn eval_transmission_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        match self {
            Self::Dielectric(boundary) => boundary.eval_transmission_and_pdf(directions),
            Self::MultipleScattering(interreflected) => {
                interreflected.eval_transmission_and_pdf(directions)
            }
            _ => (N::Vec3::ZERO, N::ZERO),
        }
    }

    #[inline(always)]
    fn sample(
        &self,
        frame: &ShadingFrame<N>,
        wo: N::Vec3,
        local: N::Vec3,
        choice: N,
        [u, v]: [N; 2],
    ) -> N::Vec3 {
        frame.to_world(match *self {
            Self::Dielectric(boundary) => return boundary.sample(frame, wo, local, choice, [u, v]),
            Self::MultipleScattering(interreflected) => {
                return interreflected.sample(frame, wo, local, choice, [u, v]);
            }
            Self::Rough { roughness, .. } => {
                let wm = sample_wm::<N>(
                    local,
                    [alpha_from_roughness(roughness); 2],
                    sample_disk([u, v]),
                );
                let mirrored = reflect::<N>(local, wm);
                // Light mirrored below the surface would hit another microfacet and counts as lost.
                // No other lobe may take its direction for transmission.
                N::Vec3::select(mirrored.z().greater_than(N::ZERO), mirrored, N::Vec3::ZERO)
            }
            _ => sample_cosine_hemisphere::<N>([u, v]),
        })
    }

    #[inline(always)]
    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, u: N) -> (N::Vec3, N::Vec3) {
        if let Self::Dielectric(boundary) = self {
            return boundary.sample_delta(normal, wo, u);
        }
        let cosine = normal.dot(wo);
        (
            normalize_if_drifted::<N>(normal * (N::from_f64(2.0) * cosine) - wo),
            self.reflectance(cosine),
        )
    }

    #[inline(always)]
    fn importance(&self, cosine: N) -> N {
        match *self {
            Self::Diffuse {
                albedo,
                interreflected,
                energy_complement,
            } => (albedo * energy_complement.view_energy[0]
                + interreflected * energy_complement.view_energy[1])
                .max_element(),
            Self::Lambert(lambert) => lambert.importance(cosine),
            Self::Rough { .. } | Self::Mirror { .. } => self.reflectance(cosine).max_element(),
            Self::Dielectric(boundary) => boundary.importance(cosine),
            Self::MultipleScattering(bare_interreflected) => bare_interreflected.importance(cosine),
        }
    }
}

impl<N: Number> Lobe<N> {
    /// Returns the reflectance of a mirror or of microfacets at a cosine of incidence; zero for
    /// other lobes.
    #[inline(always)]
    pub fn reflectance(&self, cosine: N) -> N::Vec3 {
        let (Self::Rough { f0, f90, .. } | Self::Mirror { f0, f90 }) = *self else {
            return N::Vec3::ZERO;
        };
        f0 + (f90 - f0) * schlick_weight(cosine.max(N::ZERO))
    }
}
