//! Diffuse base of a layered surface: its colours, the layer of microfacets above it, and the
//! multiple scattering in that layer.

use super::albedo::Albedo;
use super::diffuse_base::{DiffuseBase, MicrofacetLayer, NonSchlickReflectance};
use super::energy::{EnergyComplement, multiple_scattering_factors};
use super::fresnel::FresnelRule;
use super::ggx::{Ggx, LEAST_ROUGHNESS};
use super::layer_lobes::LayerLobe;
use super::layered_surface::{DiffuseTransmissionLayer, LayerLobeBuilder, LayeredSurface};
use super::microfacet_reflectance::MicrofacetReflectance;
use crate::number::{Mask, Number, Vector3};

impl<N: Number> LayeredSurface<N> {
    /// Adds the lobe of the diffuse base below the microfacets and of the multiple scattering among
    /// the microfacets. `over` is 1 in lanes where microfacets cover the base, else 0.
    pub(super) fn add_diffuse(
        &self,
        list: &mut LayerLobeBuilder<'_, N>,
        reflectance: &MicrofacetReflectance<N>,
        over: N,
    ) {
        let zero = N::Vec3::ZERO;
        let [back, through] = self.diffuse_tints();
        let roughness = self.base.roughness;
        // Anisotropic microfacets count as rough, even if the smoother of their axes is smooth.
        let (anisotropic, mut rough) = (
            self.anisotropic_ggx(),
            roughness.greater_than(N::from_f64(LEAST_ROUGHNESS)),
        );
        let mean = Albedo::mean_anisotropic(roughness, &anisotropic);
        if let Some((anisotropy, _)) = anisotropic {
            rough = anisotropy | rough;
        }
        let (mut scattered, mut own) = (zero, N::ZERO);
        let layer = [
            reflectance.dielectric[0].max_element() * over,
            reflectance.dielectric[1].max_element() * over,
        ];
        if self.multiple_scattering && rough.any_lane() {
            let (dielectric, all) = multiple_scattering_factors::<N>(
                layer,
                reflectance.metal,
                reflectance.shares,
                mean.multiple_scattering_loss,
            );
            (own, scattered) = (
                N::select(rough, dielectric, N::ZERO),
                N::Vec3::select(rough, all, zero),
            );
        }
        if !back
            .max(through)
            .max(scattered)
            .max_element()
            .greater_than(N::ZERO)
            .any_lane()
        {
            return;
        }
        let energy_complement = EnergyComplement::new([layer[0], layer[1], own], roughness);
        let top = MicrofacetLayer {
            energy_complement,
            anisotropic,
            non_schlick: self.non_schlick_reflectance(reflectance, over, &anisotropic),
            gltf_reflectances: self.gltf_reflectances(reflectance, over),
        }
        .with_view(list.wo, list.bsdf.normal().dot(list.wo));
        let both = through.max_element().greater_than(N::ZERO).any_lane();
        list.push_lobe(LayerLobe::Diffuse(DiffuseBase {
            reflectance: back,
            transmittance: through,
            multiple_scattering: scattered,
            transmits: both,
            microfacets: top,
        }));
    }

    /// Returns the reflected and the transmitted colour of the diffuse base.
    #[inline(always)]
    fn diffuse_tints(&self) -> [N::Vec3; 2] {
        let albedo = self.base.albedo();
        self.diffuse_transmission.map_or(
            [albedo, N::Vec3::ZERO],
            |DiffuseTransmissionLayer { share, colour }| {
                [
                    albedo * (N::ONE - share),
                    colour * (self.base.opaque_dielectric_share() * share),
                ]
            },
        )
    }

    /// Returns the reflectances at normal and at grazing incidence that glTF's own formula for the
    /// diffuse base needs; `None` under other Fresnel rules.
    #[inline(always)]
    fn gltf_reflectances(&self, reflectance: &MicrofacetReflectance<N>, over: N) -> Option<[N; 2]> {
        (self.rule == FresnelRule::Model).then(|| {
            let mixed = MicrofacetReflectance {
                shares: [N::ONE - self.base.metallic, self.base.metallic],
                ..*reflectance
            };
            [N::ONE, N::ZERO].map(|cosine| mixed.eval(cosine).max_element() * over)
        })
    }

    /// Returns the reflectance above the base in the lanes where Schlick's approximation does not
    /// hold: under a thin film, and where an index of refraction is given. `None` without such
    /// lanes.
    #[inline(always)]
    fn non_schlick_reflectance(
        &self,
        reflectance: &MicrofacetReflectance<N>,
        over: N,
        anisotropic: &Option<(N::Mask, Ggx<N>)>,
    ) -> Option<NonSchlickReflectance<N>> {
        // Only dielectric microfacets lie over the base. Metal lies beside the base and takes no
        // light from it.
        let alone = MicrofacetReflectance {
            shares: [over, N::ZERO],
            ..*reflectance
        };
        let filmed = reflectance
            .film
            .map_or(N::Mask::default(), |film| film.share.greater_than(N::ZERO));
        let none = N::Mask::default();
        let (exact, anisotropy) = (
            reflectance
                .exact
                .filter(|_| over.greater_than(N::ZERO).any_lane()),
            anisotropic.as_ref().map_or(none, |&(mask, _)| mask),
        );
        let indexed = exact.map_or(none, |ior| {
            let beyond_air = |lane| {
                if N::f64_lane(ior, lane) >= 1.0 {
                    1.0
                } else {
                    0.0
                }
            };
            N::from_lanes(beyond_air).greater_than(N::ZERO)
        });
        let mask = if reflectance.exact.is_some() {
            !none
        } else {
            filmed
        };
        mask.any_lane().then_some(NonSchlickReflectance {
            mask,
            reflectance: alone,
            tabulated_lanes: indexed & !anisotropy & !filmed,
        })
    }
}
