//! Layered surfaces: the metallic-roughness model of glTF with the layers of its extensions.

use super::bsdf::Bsdf;
use super::fresnel::FresnelRule;
use super::ggx::{Ggx, LEAST_ROUGHNESS};
use super::glass_layer::{ThinDielectric, TintedDielectric, TintedFresnel};
use super::layer_fields::{LayerFieldEvaluator, LayerFieldTypes, layer};
use super::layer_lobes::{Coat, CoatedLobe, Coating, GgxLobe, LayerLobe};
use super::metallic_roughness::MetallicRoughness;
use super::microfacet_reflectance::{MicrofacetReflectance, eval_conductor};
use super::sheen::Sheen;
use super::thin_film::ThinFilm;
use crate::number::{Mask, Number, Vector3};

/// Greatest number of lobes of a [`LayeredBsdf`].
pub const MOST_LAYERED_LOBES: usize = 9;

/// The BSDF of a [`LayeredSurface`] at a point.
pub type LayeredBsdf<N> = Bsdf<N, CoatedLobe<N>, MOST_LAYERED_LOBES>;

layer! {
    /// Anisotropy of the microfacets: its strength, and the direction of greater roughness.
    Anisotropy
    /// Strength, from 0 (isotropic) to 1.
    strength: Share by eval_unit_number;
    /// Frame whose tangent is the rougher direction.
    frame: Frame by eval_frame;
}

layer! {
    /// Diffuse transmission of light through a surface, such as a leaf.
    DiffuseTransmissionLayer
    /// Share of the diffuse light that is transmitted instead of reflected, 0 to 1.
    share: Share by eval_unit_number;
    /// Colour of the transmission.
    colour: Tint by eval_tint;
}

/// Parameters of a layered surface: the metallic-roughness base and glTF's extensions. The type
/// parameter `S` determines the types of the parameters: inputs before a hit, numbers at a hit (see
/// [`LayerFieldTypes`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayeredSurface<S: LayerFieldTypes> {
    /// The metallic-roughness base.
    pub base: S::Base,
    /// Index of refraction of the dielectric part.
    pub ior: S::Constant,
    /// Factor on the dielectric part's reflectance, 0 to 1 (KHR_materials_specular).
    pub specular: S::Share,
    /// Colour of the dielectric part's reflectance at normal incidence.
    pub specular_colour: S::Colour,
    /// Complex index n and k of the metal by channel, in place of the metal's colour.
    pub conductor: Option<[S::Spectrum; 2]>,
    /// Whether glass is a thin wall, without refraction.
    pub thin: bool,
    /// Diffuse transmission.
    pub diffuse_transmission: Option<DiffuseTransmissionLayer<S>>,
    /// Anisotropy of the microfacets.
    pub anisotropy: Option<Anisotropy<S>>,
    /// A thin film on the microfacets.
    pub film: Option<ThinFilm<S>>,
    /// Sheen over all layers except the coat.
    pub sheen: Option<Sheen<S>>,
    /// A clear coat over all layers.
    pub coat: Option<Coat<S>>,
    /// Choice of the reflectance formulas.
    pub rule: FresnelRule,
    /// Whether multiple scattering among microfacets is included.
    pub multiple_scattering: bool,
}

impl<S: LayerFieldTypes> LayeredSurface<S> {
    /// Evaluates all layers at a hit. `base` is the metallic-roughness base at the hit, `ior` the
    /// index of refraction there.
    pub fn eval_at<N: Number>(
        &self,
        here: &impl LayerFieldEvaluator<S, N>,
        base: MetallicRoughness<N>,
        ior: N::Exact,
    ) -> LayeredSurface<N> {
        LayeredSurface {
            base,
            ior,
            specular: here.eval_unit_number(&self.specular),
            specular_colour: here.eval_colour(&self.specular_colour),
            conductor: self
                .conductor
                .as_ref()
                .map(|index| index.each_ref().map(|part| here.eval_spectrum(part))),
            thin: self.thin,
            diffuse_transmission: self
                .diffuse_transmission
                .as_ref()
                .map(|layer| layer.at(here)),
            anisotropy: self.anisotropy.as_ref().map(|layer| layer.at(here)),
            film: self.film.as_ref().map(|layer| layer.at(here)),
            sheen: self.sheen.as_ref().map(|layer| layer.at(here)),
            coat: self.coat.as_ref().map(|layer| layer.at(here)),
            rule: self.rule,
            multiple_scattering: self.multiple_scattering,
        }
    }
}

impl<N: Number> LayeredBsdf<N> {
    /// Returns the transmittance for light straight on, from −`wo` to `wo`.
    pub fn straight(&self, wo: N::Vec3) -> N::Vec3 {
        self.lobes().iter().fold(N::Vec3::ZERO, |sum, lobe| {
            sum + lobe.straight_transmittance(self.normal(), wo)
        })
    }
}

impl<N: Number> LayeredSurface<N> {
    /// Creates a surface without layers.
    pub fn from_base(base: MetallicRoughness<N>, ior: N::Exact) -> Self {
        Self {
            base,
            ior,
            specular: N::ONE,
            specular_colour: N::Vec3::ONE,
            conductor: None,
            thin: false,
            diffuse_transmission: None,
            anisotropy: None,
            film: None,
            sheen: None,
            coat: None,
            rule: FresnelRule::default(),
            multiple_scattering: true,
        }
    }

    /// Returns the reflectance of the surface's microfacets as a function of the cosine.
    /// `dielectric` is the share of the surface that is neither metal nor glass.
    fn reflectance(&self, dielectric: N) -> MicrofacetReflectance<N> {
        let normal =
            (self.specular_colour * self.base.dielectric).min(N::Vec3::ONE) * self.specular;
        MicrofacetReflectance {
            shares: [dielectric, self.base.metallic],
            dielectric: [normal, N::Vec3::splat(self.specular)],
            exact: (self.rule == FresnelRule::Exact).then_some(self.ior),
            metal: self
                .conductor
                .map_or(self.base.base, |index| eval_conductor(N::ONE, index)),
            conductor: self.conductor.filter(|_| self.rule != FresnelRule::Schlick),
            film: self.film,
        }
    }

    /// Returns the BSDF for light transport, viewed along `wo`. `outside` is the mask of the SIMD
    /// lanes whose ray comes from outside.
    pub fn transport_bsdf(&self, normal: N::Vec3, wo: N::Vec3, outside: N::Mask) -> LayeredBsdf<N> {
        let mut bsdf = LayeredBsdf::new(normal);
        self.add_lobes_to(&mut bsdf, wo, outside);
        bsdf
    }

    /// Returns the mask of the SIMD lanes with anisotropic microfacets, and these microfacets;
    /// `None` if all lanes are isotropic.
    pub(super) fn anisotropic_ggx(&self) -> Option<(N::Mask, Ggx<N>)> {
        let Anisotropy { strength, frame } = self.anisotropy?;
        let mask = strength.greater_than(N::ZERO);
        mask.any_lane()
            .then(|| (mask, Ggx::anisotropic(frame, self.base.roughness, strength)))
    }

    /// Returns the distribution of the surface's microfacets about a normal. It is anisotropic if
    /// any SIMD lane is.
    fn surface_ggx(&self, normal: N::Vec3) -> Ggx<N> {
        self.anisotropic_ggx().map_or_else(
            || Ggx::isotropic(normal, self.base.roughness),
            |(_, ggx)| ggx,
        )
    }

    /// Adds all lobes, viewed along `wo`, to an empty BSDF. The BSDF is filled in place, because
    /// moving it would be slow.
    pub fn add_lobes_to(&self, bsdf: &mut LayeredBsdf<N>, wo: N::Vec3, outside: N::Mask) {
        let (through, normal) = (self.base.glass_share(), bsdf.normal());
        let mut list = LayerLobeBuilder {
            bsdf,
            wo,
            coating: Coating {
                rule: self.rule,
                ..Coating::NONE
            },
        };
        // For a ray inside a body, all layers and the microfacets of the paint lie beyond the
        // boundary.
        let over = if self.base.glass.is_none() || self.thin {
            N::ONE
        } else {
            N::select(outside, N::ONE, N::ZERO)
        };
        let is_over = over.greater_than(N::ZERO).any_lane();
        let coat = self.coat.filter(|_| is_over);
        if let Some(coat) = coat {
            list.add_ggx(
                Ggx::isotropic(coat.normal, coat.roughness),
                coat.reflectance(self.rule),
                coat.roughness,
            );
        }
        list.coating.coat = coat;
        if let Some(sheen) = self.sheen.filter(|_| is_over) {
            list.push_lobe(LayerLobe::Sheen(sheen));
            list.coating.sheen = Some(sheen);
        }
        let reflectance = self.reflectance(self.base.opaque_dielectric_share() * over);
        self.add_diffuse(&mut list, &reflectance, over);
        if reflectance.is_reflective() {
            let own = self.base.roughness;
            let roughness = self
                .anisotropic_ggx()
                .map_or(own, |(mask, ggx)| N::select(mask, ggx.roughness(), own));
            list.add_ggx(self.surface_ggx(normal), reflectance, roughness);
        }
        self.add_glass(&mut list, through, outside);
    }

    /// Adds the boundary lobes of glass, which covers a share of the surface.
    fn add_glass(&self, list: &mut LayerLobeBuilder<'_, N>, share: N, outside: N::Mask) {
        let Some(glass) = self
            .base
            .glass
            .filter(|_| share.greater_than(N::ZERO).any_lane())
        else {
            return;
        };
        let reflected = self.specular_colour.min(N::Vec3::ONE) * self.specular;
        let tinted_fresnel = TintedFresnel {
            reflected,
            film: self.film,
            rule: self.rule,
            ior: glass.ior,
        };
        let (roughness, transmitted) = (self.base.roughness, glass.transmitted);
        let rough = roughness.greater_than(N::from_f64(LEAST_ROUGHNESS));
        let rough = if self.thin {
            rough
        } else {
            rough & glass.is_refractive()
        };
        for (of, is_rough) in [(rough, true), (!rough, false)] {
            let share = N::select(of, share, N::ZERO);
            if of.any_lane() && self.thin {
                let ggx = is_rough.then(|| self.surface_ggx(list.bsdf.normal()));
                let wall = ThinDielectric {
                    tinted_fresnel,
                    share,
                    transmitted,
                    ggx,
                };
                list.push_lobe(LayerLobe::ThinDielectric(wall));
                if is_rough && self.multiple_scattering {
                    let seen = [list.wo, list.bsdf.normal()];
                    list.push_lobe(LayerLobe::MultipleScattering(wall.multiple_scattering(
                        roughness,
                        self.anisotropic_ggx(),
                        seen,
                    )));
                }
            } else if of.any_lane() {
                let boundary = glass.dielectric_lobe(outside, share, is_rough.then_some(roughness));
                list.push_lobe(LayerLobe::Dielectric(TintedDielectric {
                    tinted_fresnel,
                    boundary,
                    outside,
                }));
                if is_rough && self.multiple_scattering {
                    let seen = [share, list.bsdf.normal().dot(list.wo)];
                    list.push_lobe(LayerLobe::MultipleScattering(glass.multiple_scattering(
                        outside,
                        roughness,
                        seen,
                        tinted_fresnel.tint_bounds(),
                    )));
                }
            }
        }
    }
}

/// Builder that adds lobes to a BSDF, each under the current coating.
pub(super) struct LayerLobeBuilder<'a, N: Number> {
    pub(super) bsdf: &'a mut LayeredBsdf<N>,
    pub(super) wo: N::Vec3,
    coating: Coating<N>,
}

impl<N: Number> LayerLobeBuilder<'_, N> {
    /// Adds a lobe under the current coating.
    pub(super) fn push_lobe(&mut self, lobe: LayerLobe<N>) {
        self.bsdf.add_lobe(CoatedLobe::new(
            lobe,
            self.coating,
            self.bsdf.normal(),
            self.wo,
        ));
    }

    /// Adds a lobe of microfacets for the rough lanes, and a mirror for the smooth lanes.
    fn add_ggx(&mut self, ggx: Ggx<N>, reflectance: MicrofacetReflectance<N>, roughness: N) {
        let rough = roughness.greater_than(N::from_f64(LEAST_ROUGHNESS));
        for (of, smooth) in [(rough, false), (!rough, true)] {
            if of.any_lane() {
                let shares = reflectance
                    .shares
                    .map(|share| N::select(of, share, N::ZERO));
                self.push_lobe(LayerLobe::Ggx(GgxLobe {
                    ggx,
                    smooth,
                    reflectance: MicrofacetReflectance {
                        shares,
                        ..reflectance
                    },
                }));
            }
        }
    }
}
