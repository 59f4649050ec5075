//! Preparation of physical materials.

use raywright_bvh::{Real, Vector};

use super::super::error::PrepareError;
use super::super::inputs::InputCompiler;
use super::super::medium::{MOST_ATTENUATION, PreparedMedium};
use super::prepare_optional;
use crate::effects::{Effect, EffectSet};
use crate::material::{
    Anisotropy, Coat, DiffuseTransmissionLayer, FresnelRule, Glass, LayerFieldTypes,
    LayeredSurface, MetallicRoughness, Sheen, ThinFilm,
};
use crate::scene::{AlphaMode, Boundary, Channel, MaterialModel, Physical as PhysicalData, Scene};
use crate::texture::{InputProduct, NormalMapInput, PreparedInput};

/// Inputs of a physical material, the metallic-roughness model.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhysicalInputs<R: Real> {
    pub base: InputProduct<R>,
    pub vertex_colours: bool,
    pub metallic: InputProduct<R>,
    pub roughness: InputProduct<R>,
    pub index: RefractiveIndex<R>,
    /// Transmission; `None` for a material that transmits nothing.
    pub transmission: Option<PhysicalTransmission<R>>,
    /// Absorption coefficient of the inside per metre; `None` without absorption.
    pub absorption: Option<R::Vec3>,
    /// Index of the medium inside; `None` if the inside scatters nothing.
    pub medium: Option<u32>,
    /// Whether the body has no surface. The material's alpha is then zero.
    pub is_open: bool,
    /// Emitted radiance; `None` without emission.
    pub emission: Option<InputProduct<R>>,
    pub alpha: AlphaMode,
    pub opacity: InputProduct<R>,
    pub unlit: bool,
    /// Whether the surface is a thin wall, without refraction.
    pub thin: bool,
    /// Index in the table of layers; `None` without layers, or if the integrator ignores layers.
    pub layers: Option<u32>,
    /// Factor on the dielectric part's reflectance (KHR_materials_specular); 1 if the layers hold
    /// the factor.
    pub specular: R,
    /// Normal map; `None` without a normal map.
    pub normal_map: Option<NormalMapInput<R>>,
    /// Whether the material is opaque, has no layers and reads no expressions. Several hits of such
    /// a material may be shaded at once.
    pub is_common: bool,
    /// Whether a smooth surface traces mirrored rays. If not, its reflection is shaded as rough.
    pub mirrors: bool,
    /// Model of a material whose inputs are the same everywhere; `None` if one varies.
    pub uniform_model: Option<MetallicRoughness<R>>,
}

/// Index of refraction of a physical material, at least 1. A constant index of 0 stands for total
/// reflection.
#[derive(Clone, Copy, Debug)]
pub(crate) enum RefractiveIndex<R: Real> {
    /// A constant index.
    Constant(ConstantIor<R>),
    Varying(InputProduct<R>),
}

/// A constant index of refraction with its reflectance at normal incidence.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ConstantIor<R> {
    /// Index of refraction, in `f64` as refraction needs.
    pub ior: f64,
    /// Reflectance at normal incidence; 1 for index 0. It is computed in `f64`, because `f32` would
    /// lose digits near index 1.
    pub f0: R,
}

impl<R: Real> ConstantIor<R> {
    /// Computes the reflectance of an index of refraction.
    pub fn new(ior: f64) -> Self {
        Self {
            ior,
            f0: R::from_f64(((ior - 1.0) / (ior + 1.0)) * ((ior - 1.0) / (ior + 1.0))),
        }
    }
}

/// Transmission of a physical material.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhysicalTransmission<R: Real> {
    pub share: InputProduct<R>,
    /// Transmittance for shadow rays if it is constant; `None` if it varies.
    pub constant_transmittance: Option<R>,
}

/// Returns the transmittance for shadow rays where `share` of the light is transmitted and tinted
/// by the base colour `base`: the mean over the channels.
pub(crate) fn tinted_shadow_transmittance<R: Real>(base: R::Vec3, share: R) -> R {
    (base * share).dot(R::Vec3::splat(R::from_f64(1.0 / 3.0)))
}

impl<R: Real> PhysicalInputs<R> {
    /// Returns the model of the material if no input of it varies.
    fn find_uniform_model(&self) -> Option<MetallicRoughness<R>> {
        let RefractiveIndex::Constant(boundary) = self.index else {
            return None;
        };
        if self.vertex_colours {
            return None;
        }
        let base = self.base.constant_value()?;
        let glass = match &self.transmission {
            Some(transmission) => {
                self.glass_of_share(transmission.share.constant_value()?.x(), base, boundary.ior)
            }
            None => None,
        };
        Some(MetallicRoughness {
            base,
            metallic: self.metallic.constant_value()?.x(),
            roughness: self.roughness.constant_value()?.x(),
            dielectric: boundary.f0 * self.specular,
            grazing: self.specular,
            glass,
        })
    }

    /// Returns the glass of a material whose base colour is `base` and of which a share transmits;
    /// `None` for a share of zero.
    #[inline(always)]
    pub fn glass_of_share(&self, share: R, base: R::Vec3, ior: f64) -> Option<Glass<R>> {
        let share = Real::clamp(share, R::ZERO, R::ONE);
        (share > R::ZERO).then_some(Glass {
            share,
            // A thin wall does not refract; in Whitted's integrator it does not reflect either.
            ior: if self.thin { 1.0 } else { ior },
            reflected: Vector::ONE,
            transmitted: base,
        })
    }

    /// Whether the material is a transmissive thin wall with layers.
    pub fn is_thin(&self) -> bool {
        self.thin && self.transmission.is_some() && self.layers.is_some()
    }
}

/// Prepares a physical material. Its layers are added to the list of the context.
///
/// # Errors
/// Inputs that do not compile.
pub(super) fn prepare_physical<R: Real>(
    m: &PhysicalData,
    inputs: &mut InputCompiler<'_, R>,
    context: &mut MaterialContext<R>,
) -> Result<PhysicalInputs<R>, PrepareError> {
    let base_image = inputs.compile_image(&m.base_colour_texture, "base_colour_texture")?;
    let base = inputs.compile_product(&m.base_colour, base_image, "base_colour")?;
    let opacity = prepare_opacity(m, base_image, inputs)?;
    let [roughness, metallic] = prepare_roughness(m, inputs)?;
    let emission = prepare_optional(m.active_emission(), |emission| {
        inputs.compile_factor(emission, &m.emission_texture, "emission")
    })?;
    let index = match m.ior.constant() {
        Some(ior) => RefractiveIndex::Constant(ConstantIor::new(ior)),
        None => RefractiveIndex::Varying(inputs.compile_factor(&m.ior, &None, "ior")?),
    };
    let transmission = prepare_optional(m.may_transmit().then_some(m), |m| {
        prepare_transmission(m, &base, inputs)
    })?;
    let normal_image = prepare_optional(m.active_normal_map(), |image| {
        inputs.compile_texture(image, "normal_texture")
    })?
    .flatten();
    let layers = prepare_layers(m, inputs, context)?.map(|layers| {
        context.layers.push(layers);
        context.layers.len() as u32 - 1
    });
    let specular = m
        .constant_specular_factor()
        .filter(|_| context.is_path_tracing && layers.is_none());
    let medium = prepare_optional(
        m.scattering_medium().filter(|_| context.is_path_tracing),
        |medium| {
            let body = PreparedMedium::new(medium, Some(context.material), inputs, "interior.")?;
            context.media.push(body);
            Ok(context.media.len() as u32 - 1)
        },
    )?;
    let is_open = m.boundary == Boundary::None;
    let alpha = if is_open {
        AlphaMode::Mask { cutoff: 2.0 }
    } else {
        m.alpha
    };
    let is_opaque = alpha == AlphaMode::Opaque && transmission.is_none() && !m.unlit;
    let physical = PhysicalInputs {
        is_common: is_opaque && layers.is_none() && !inputs.dependencies.expressions,
        layers,
        specular: R::from_f64(specular.unwrap_or(1.0)),
        thin: m.thin_walled,
        normal_map: normal_image.map(|image| NormalMapInput {
            image,
            scale: R::from_f64(m.normal_scale),
        }),
        base,
        vertex_colours: m.vertex_colours,
        metallic,
        roughness,
        index,
        transmission,
        absorption: m.absorption().map(|absorption| {
            R::Vec3::from_f64(absorption.map(|a| a.min(MOST_ATTENUATION)).into())
        }),
        medium,
        is_open,
        emission,
        alpha,
        opacity,
        unlit: m.unlit,
        mirrors: !context.disabled_effects.has(Effect::MirrorReflection),
        uniform_model: None,
    };
    Ok(PhysicalInputs {
        uniform_model: physical.find_uniform_model(),
        ..physical
    })
}

/// Prepares the opacity of a physical material: its factor times the alpha of the base colour's
/// image. Mipmaps average alpha, which changes the share of the surface above the cutoff of an
/// alpha mask. The opacity of a mask thus reads the image without mipmaps.
fn prepare_opacity<R: Real>(
    m: &PhysicalData,
    base_image: Option<PreparedInput<R>>,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<InputProduct<R>, PrepareError> {
    inputs.ignore_mipmaps = matches!(m.alpha, AlphaMode::Mask { .. });
    let needs_other_image = inputs.ignore_mipmaps
        && m.base_colour_texture
            .as_ref()
            .is_some_and(|texture| inputs.uses_mipmaps(texture));
    let image = if needs_other_image {
        inputs.compile_image(&m.base_colour_texture, "base_colour_texture")?
    } else {
        base_image
    };
    let opacity = inputs.compile_product(
        &m.opacity,
        image.map(|image| image.with_channel(Channel::Alpha)),
        "opacity",
    )?;
    inputs.ignore_mipmaps = false;
    Ok(opacity)
}

/// Prepares the roughness and the metallic share of a physical material, which are the green and
/// the blue channel of one image.
fn prepare_roughness<R: Real>(
    m: &PhysicalData,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<[InputProduct<R>; 2], PrepareError> {
    let image =
        inputs.compile_image(&m.metallic_roughness_texture, "metallic_roughness_texture")?;
    Ok([
        inputs.compile_product(
            &m.roughness,
            image.map(|image| image.with_channel(Channel::Green)),
            "roughness",
        )?,
        inputs.compile_product(
            &m.metallic,
            image.map(|image| image.with_channel(Channel::Blue)),
            "metallic",
        )?,
    ])
}

/// Prepares the transmission of a physical material with a base colour.
fn prepare_transmission<R: Real>(
    m: &PhysicalData,
    base: &InputProduct<R>,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<PhysicalTransmission<R>, PrepareError> {
    let share = inputs.compile_factor(&m.transmission, &m.transmission_texture, "transmission")?;
    let constant_base = base.constant_value().filter(|_| !m.vertex_colours);
    Ok(PhysicalTransmission {
        share,
        constant_transmittance: constant_base
            .zip(share.constant_value())
            .map(|(base, share)| tinted_shadow_transmittance(base, share.x())),
    })
}

// Preparation of a physical material's layers. Only path tracers use layers; other integrators
// ignore them.

/// The field types of a layer before a hit: inputs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InputFieldTypes<R>(R);

impl<R: Real> LayerFieldTypes for InputFieldTypes<R> {
    type Share = InputProduct<R>;
    type Tint = InputProduct<R>;
    type Colour = InputProduct<R>;
    type Thickness = FilmThickness<R>;
    type Constant = f64;
    type Spectrum = R::Vec3;
    /// Normal map of the coat; `None` for the surface's normal without its normal map.
    type Normal = Option<NormalMapInput<R>>;
    type Frame = AnisotropyFrame<R>;
    type Base = ();
}

/// The layers of a physical material, as inputs.
pub(crate) type LayeredInputs<R> = LayeredSurface<InputFieldTypes<R>>;

/// Thickness of a film in nanometres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FilmThickness<R: Real> {
    /// Thickness where the image is white, or everywhere without an image.
    pub thickest: InputProduct<R>,
    /// Thickness where the image is black.
    pub thinnest: R,
    pub image: Option<PreparedInput<R>>,
}

/// Directions of the rougher axis on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AnisotropyFrame<R: Real> {
    /// Cosine and sine of the angle from the tangent to the rougher axis, in the tangent plane.
    pub rotation: [R; 2],
    pub image: Option<PreparedInput<R>>,
}

/// Whether the layers depend on tangents.
pub(super) fn layers_need_tangents<R: Real>(layers: &LayeredInputs<R>) -> bool {
    layers.anisotropy.is_some()
        || layers
            .coat
            .as_ref()
            .is_some_and(|coat| coat.normal.is_some())
}

/// State while the materials of a scene are prepared: settings, and the layers of the materials so
/// far.
#[derive(Debug)]
pub(in crate::prepare) struct MaterialContext<R: Real> {
    /// Layers of the materials prepared so far. A prepared material holds an index into this list.
    pub layers: Vec<LayeredInputs<R>>,
    /// Media of the materials prepared so far.
    pub media: Vec<PreparedMedium>,
    /// Index of the material that is prepared.
    pub material: u32,
    /// Whether the integrator is the path tracer.
    pub is_path_tracing: bool,
    /// Effects that the user has disabled.
    pub disabled_effects: EffectSet,
    /// Choice of the reflectance formulas.
    pub fresnel: FresnelRule,
    /// Whether rough surfaces include multiple scattering among microfacets.
    pub multiple_scattering: bool,
}

/// Whether a physical material needs layers beyond the plain metallic-roughness model.
fn is_layered(m: &PhysicalData, rule: FresnelRule) -> bool {
    let clear = m.may_transmit() && (m.thin_walled || m.dispersion > 0.0);
    let present = [
        m.active_clearcoat().is_some(),
        m.active_sheen().is_some(),
        m.active_anisotropy().is_some(),
        m.active_iridescence().is_some(),
        m.active_conductor().is_some(),
    ];
    let tinted = m.has_specular_tint() && m.constant_specular_factor().is_none();
    rule != FresnelRule::default()
        || clear
        || m.may_transmit_diffusely()
        || tinted
        || present.contains(&true)
}

/// Counts the materials of a scene that need layers in a path tracer.
pub(crate) fn count_layered_materials(scene: &Scene, rule: FresnelRule) -> u64 {
    let has = |model: &MaterialModel| matches!(model, MaterialModel::Physical(m) if !m.unlit && is_layered(m, rule));
    scene
        .materials
        .iter()
        .filter(|material| has(&material.model))
        .count() as u64
}

/// Prepares the layers of a physical material; `None` for a material without layers, or if the
/// integrator ignores layers.
///
/// # Errors
/// Inputs that do not compile.
fn prepare_layers<R: Real>(
    m: &PhysicalData,
    inputs: &mut InputCompiler<'_, R>,
    context: &MaterialContext<R>,
) -> Result<Option<LayeredInputs<R>>, PrepareError> {
    if m.unlit || !context.is_path_tracing || !is_layered(m, context.fresnel) {
        return Ok(None);
    }
    let diffuse_transmission = prepare_optional(
        m.diffuse_transmission
            .as_ref()
            .filter(|_| m.may_transmit_diffusely()),
        |layer| {
            Ok(DiffuseTransmissionLayer {
                share: inputs.compile_factor(
                    &layer.factor,
                    &layer.factor_texture,
                    "diffuse_transmission.factor",
                )?,
                colour: inputs.compile_factor(
                    &layer.colour,
                    &layer.colour_texture,
                    "diffuse_transmission.colour",
                )?,
            })
        },
    )?;
    let sheen = prepare_optional(m.active_sheen(), |layer| {
        Ok(Sheen {
            colour: inputs.compile_factor(&layer.colour, &layer.colour_texture, "sheen.colour")?,
            roughness: inputs.compile_factor(
                &layer.roughness,
                &layer.roughness_texture,
                "sheen.roughness",
            )?,
        })
    })?;
    let anisotropy = prepare_optional(m.active_anisotropy(), |layer| {
        let image = inputs.compile_image(&layer.texture, "anisotropy.texture")?;
        let strength = inputs.compile_product(
            &layer.strength,
            image.map(|image| image.with_channel(Channel::Blue)),
            "anisotropy.strength",
        )?;
        let angle = layer.rotation.to_radians();
        Ok(Anisotropy {
            strength,
            frame: AnisotropyFrame {
                rotation: [libm::cos(angle), libm::sin(angle)].map(R::from_f64),
                image,
            },
        })
    })?;
    let film = prepare_optional(m.active_iridescence(), |layer| {
        Ok(ThinFilm {
            share: inputs.compile_factor(
                &layer.factor,
                &layer.factor_texture,
                "iridescence.factor",
            )?,
            ior: layer.ior,
            thickness: FilmThickness {
                thickest: inputs.compile_factor(
                    &layer.thickness,
                    &None,
                    "iridescence.thickness",
                )?,
                thinnest: R::from_f64(layer.thinnest),
                image: inputs
                    .compile_image(&layer.thickness_texture, "iridescence.thickness_texture")?,
            },
        })
    })?;
    let coat = prepare_optional(m.active_clearcoat(), |layer| {
        let normal_image =
            inputs.compile_image(&layer.normal_texture, "clearcoat.normal_texture")?;
        Ok(Coat {
            weight: inputs.compile_factor(
                &layer.factor,
                &layer.factor_texture,
                "clearcoat.factor",
            )?,
            roughness: inputs.compile_factor(
                &layer.roughness,
                &layer.roughness_texture,
                "clearcoat.roughness",
            )?,
            normal: normal_image.map(|image| NormalMapInput {
                image,
                scale: R::from_f64(layer.normal_scale),
            }),
        })
    })?;
    Ok(Some(LayeredSurface {
        base: (),
        // Before a hit, this field holds the dispersion in place of an index.
        ior: if m.thin_walled { 0.0 } else { m.dispersion },
        specular: inputs.compile_factor(&m.specular, &m.specular_texture, "specular")?,
        specular_colour: inputs.compile_factor(
            &m.specular_colour,
            &m.specular_colour_texture,
            "specular_colour",
        )?,
        conductor: m
            .active_conductor()
            .map(|index| [index.n, index.k].map(|c| R::Vec3::from_f64(c.0.into()))),
        thin: m.thin_walled,
        diffuse_transmission,
        anisotropy,
        film,
        sheen,
        coat,
        rule: context.fresnel,
        multiple_scattering: context.multiple_scattering,
    }))
}
