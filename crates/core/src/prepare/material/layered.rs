//! Preparation of a physical material's layers. Only path tracers use layers; other integrators
//! ignore them.

use raywright_bvh::{Real, Vector};

use super::super::PreparedMedium;
use super::super::error::PrepareError;
use super::super::inputs::InputCompiler;
use super::prepare_optional;
use crate::effects::EffectSet;
use crate::material::{
    Anisotropy, Coat, DiffuseTransmissionLayer, FresnelRule, LayerFieldTypes, LayeredSurface,
    Sheen, ThinFilm,
};
use crate::scene::{
    Anisotropy as AnisotropyData, Channel, Clearcoat, DiffuseTransmission, Iridescence,
    MaterialModel, Physical as PhysicalData, Scene, Sheen as SheenData,
};
use crate::texture::{InputProduct, NormalMapInput, PreparedInput};

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
pub(super) fn prepare_layers<R: Real>(
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
        |layer| prepare_diffuse_transmission(layer, inputs),
    )?;
    let sheen = prepare_optional(m.active_sheen(), |layer| prepare_sheen(layer, inputs))?;
    let anisotropy = prepare_optional(m.active_anisotropy(), |layer| {
        prepare_anisotropy(layer, inputs)
    })?;
    let film = prepare_optional(m.active_iridescence(), |layer| prepare_film(layer, inputs))?;
    let coat = prepare_optional(m.active_clearcoat(), |layer| prepare_coat(layer, inputs))?;
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

/// Prepares the layer that transmits light diffusely.
fn prepare_diffuse_transmission<R: Real>(
    layer: &DiffuseTransmission,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<DiffuseTransmissionLayer<InputFieldTypes<R>>, PrepareError> {
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
}

/// Prepares the layer of fibres.
fn prepare_sheen<R: Real>(
    layer: &SheenData,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<Sheen<InputFieldTypes<R>>, PrepareError> {
    Ok(Sheen {
        colour: inputs.compile_factor(&layer.colour, &layer.colour_texture, "sheen.colour")?,
        roughness: inputs.compile_factor(
            &layer.roughness,
            &layer.roughness_texture,
            "sheen.roughness",
        )?,
    })
}

/// Prepares the anisotropy of a material's roughness.
fn prepare_anisotropy<R: Real>(
    layer: &AnisotropyData,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<Anisotropy<InputFieldTypes<R>>, PrepareError> {
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
}

/// Prepares the thin film that makes a material iridescent.
fn prepare_film<R: Real>(
    layer: &Iridescence,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<ThinFilm<InputFieldTypes<R>>, PrepareError> {
    Ok(ThinFilm {
        share: inputs.compile_factor(&layer.factor, &layer.factor_texture, "iridescence.factor")?,
        ior: layer.ior,
        thickness: FilmThickness {
            thickest: inputs.compile_factor(&layer.thickness, &None, "iridescence.thickness")?,
            thinnest: R::from_f64(layer.thinnest),
            image: inputs
                .compile_image(&layer.thickness_texture, "iridescence.thickness_texture")?,
        },
    })
}

/// Prepares the clear coat, with its normal map.
fn prepare_coat<R: Real>(
    layer: &Clearcoat,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<Coat<InputFieldTypes<R>>, PrepareError> {
    let normal_image = inputs.compile_image(&layer.normal_texture, "clearcoat.normal_texture")?;
    Ok(Coat {
        weight: inputs.compile_factor(&layer.factor, &layer.factor_texture, "clearcoat.factor")?,
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
}
