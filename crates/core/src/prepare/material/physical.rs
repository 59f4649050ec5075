//! Preparation of physical materials.

use raywright_bvh::{Real, Vector};

use super::super::error::PrepareError;
use super::super::inputs::InputCompiler;
use super::super::medium::{MOST_ATTENUATION, PreparedMedium};
use super::layered::{MaterialContext, prepare_layers};
use super::prepare_optional;
use crate::effects::Effect;
use crate::material::MetallicRoughness;
use crate::scene::{AlphaMode, Boundary, Channel, Physical as PhysicalData};
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
    /// Model of an opaque material whose inputs are the same everywhere; `None` if one varies.
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
    /// Returns the model of the material if it is opaque and no input of it varies.
    fn find_uniform_model(&self) -> Option<MetallicRoughness<R>> {
        let RefractiveIndex::Constant(boundary) = self.index else {
            return None;
        };
        if self.vertex_colours || self.transmission.is_some() {
            return None;
        }
        Some(MetallicRoughness {
            base: self.base.constant_value()?,
            metallic: self.metallic.constant_value()?.x(),
            roughness: self.roughness.constant_value()?.x(),
            dielectric: boundary.f0 * self.specular,
            grazing: self.specular,
            glass: None,
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
