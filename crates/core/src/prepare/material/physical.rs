//! Preparation of physical materials.

use raywright_bvh::{Real, Vector};

use super::super::error::PrepareError;
use super::super::inputs::InputCompiler;
use super::layered::{MaterialContext, prepare_layers};
use super::prepare_optional;
use crate::effects::Effect;
use crate::scene::{AlphaMode, Channel, Physical as PhysicalData};
use crate::texture::{InputProduct, NormalMapInput};

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
    /// Tint of shadow rays by the base colour; white if the base colour varies.
    pub tint: R::Vec3,
    /// Transmittance for shadow rays if it is constant; `None` if it varies.
    pub constant_transmittance: Option<R>,
}

impl<R: Real> PhysicalTransmission<R> {
    /// Returns the transmittance for shadow rays where `share` of the light is transmitted: the
    /// mean over the channels.
    pub fn shadow_transmittance(&self, share: R) -> R {
        (self.tint * share).dot(R::Vec3::splat(R::from_f64(1.0 / 3.0)))
    }
}

impl<R: Real> PhysicalInputs<R> {
    /// Whether the material is a transmissive thin wall with layers.
    pub fn is_thin(&self) -> bool {
        self.thin && self.transmission.is_some() && self.layers.is_some()
    }
}

/// Greatest absorption coefficient per metre, which stands for a black attenuation colour: it
/// absorbs practically all light and fits an `f32`.
const MOST_ABSORPTION: f64 = 1e30;

pub(super) fn prepare_physical<R: Real>(
    m: &PhysicalData,
    inputs: &mut InputCompiler<'_, R>,
    context: &mut MaterialContext<R>,
) -> Result<PhysicalInputs<R>, PrepareError> {
    let image = inputs.compile_image(&m.base_colour_texture, "base_colour_texture")?;
    let base = inputs.compile_product(&m.base_colour, image, "base_colour")?;
    // Mipmaps average alpha, which changes the share of the surface above the alpha cutoff.
    inputs.ignore_mipmaps = matches!(m.alpha, AlphaMode::Mask { .. });
    let again = inputs.ignore_mipmaps
        && m.base_colour_texture
            .as_ref()
            .is_some_and(|texture| inputs.uses_mipmaps(texture));
    let cover = if again {
        inputs.compile_image(&m.base_colour_texture, "base_colour_texture")?
    } else {
        image
    };
    let opacity = inputs.compile_product(
        &m.opacity,
        cover.map(|image| image.with_channel(Channel::Alpha)),
        "opacity",
    )?;
    inputs.ignore_mipmaps = false;
    let image =
        inputs.compile_image(&m.metallic_roughness_texture, "metallic_roughness_texture")?;
    let roughness = inputs.compile_product(
        &m.roughness,
        image.map(|image| image.with_channel(Channel::Green)),
        "roughness",
    )?;
    let metallic = inputs.compile_product(
        &m.metallic,
        image.map(|image| image.with_channel(Channel::Blue)),
        "metallic",
    )?;
    let emission = prepare_optional(m.active_emission(), |emission| {
        inputs.compile_factor(emission, &m.emission_texture, "emission")
    })?;
    let index = match m.ior.constant() {
        Some(ior) => RefractiveIndex::Constant(ConstantIor::new(ior)),
        None => RefractiveIndex::Varying(inputs.compile_factor(&m.ior, &None, "ior")?),
    };
    let transmission = prepare_optional(m.may_transmit().then_some(&m.transmission), |share| {
        let share = inputs.compile_factor(share, &m.transmission_texture, "transmission")?;
        let transmission = PhysicalTransmission {
            share,
            tint: base.constant_factor().unwrap_or(R::Vec3::ONE),
            constant_transmittance: None,
        };
        Ok(PhysicalTransmission {
            constant_transmittance: share
                .constant_value()
                .map(|share| transmission.shadow_transmittance(share.x())),
            ..transmission
        })
    })?;
    let bump = prepare_optional(m.active_normal_map(), |image| {
        inputs.compile_texture(image, "normal_texture")
    })?
    .flatten();
    let layered = prepare_layers(m, inputs, context)?.map(|layered| {
        context.layers.push(layered);
        context.layers.len() as u32 - 1
    });
    let factor = m
        .constant_specular_factor()
        .filter(|_| context.is_path_tracing && layered.is_none());
    let opaque = m.alpha == AlphaMode::Opaque && transmission.is_none() && !m.unlit;
    Ok(PhysicalInputs {
        is_common: opaque && layered.is_none() && !inputs.dependencies.expressions,
        layers: layered,
        specular: R::from_f64(factor.unwrap_or(1.0)),
        thin: m.thin_walled,
        normal_map: bump.map(|image| NormalMapInput {
            image,
            scale: R::from_f64(m.normal_scale),
        }),
        base,
        vertex_colours: m.vertex_colours,
        metallic,
        roughness,
        index,
        transmission,
        absorption: m
            .absorption()
            .map(|absorption| R::Vec3::from_f64(absorption.map(|a| a.min(MOST_ABSORPTION)).into())),
        emission,
        alpha: m.alpha,
        opacity,
        unlit: m.unlit,
        mirrors: !context.disabled_effects.has(Effect::MirrorReflection),
    })
}
