//! Preparation of a physical material's layers. Only path tracers use layers; other integrators
//! ignore them.

use raywright_bvh::{Real, Vector};

use super::super::error::PrepareError;
use super::super::inputs::Compiler;
use super::prepared;
use crate::effects::EffectSet;
use crate::material::{
    Anisotropy, Coat, Diffused, FresnelRule, LayerStage, Layered, Sheen, ThinFilm,
};
use crate::scene::{Channel, Model, Physical as PhysicalData, Scene};
use crate::texture::{Bump, InputProduct, PreparedInput};

/// The field types of a layer before a hit: inputs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InputStage<R>(R);

impl<R: Real> LayerStage for InputStage<R> {
    type Share = InputProduct<R>;
    type Tint = InputProduct<R>;
    type Colour = InputProduct<R>;
    type Thickness = Thickness<R>;
    type Constant = f64;
    type Spectrum = R::Vec3;
    /// Normal map of the coat; `None` for the surface's normal without its normal map.
    type Normal = Option<Bump<R>>;
    type Frame = SurfaceDirections<R>;
    type Base = ();
}

/// The layers of a physical material, as inputs.
pub(crate) type LayeredInputs<R> = Layered<InputStage<R>>;

/// Thickness of a film in nanometres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Thickness<R: Real> {
    /// Thickness where the image is white, or everywhere without an image.
    pub thickest: InputProduct<R>,
    /// Thickness where the image is black.
    pub thinnest: R,
    pub image: Option<PreparedInput<R>>,
}

/// Directions of the rougher axis on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfaceDirections<R: Real> {
    /// Cosine and sine of the angle from the tangent to the rougher axis.
    pub turn: [R; 2],
    pub image: Option<PreparedInput<R>>,
}

/// Whether the layers depend on tangents.
pub(super) fn is_directed<R: Real>(layers: &LayeredInputs<R>) -> bool {
    layers.anisotropy.is_some()
        || layers
            .coat
            .as_ref()
            .is_some_and(|coat| coat.normal.is_some())
}

/// State of the preparation of materials: settings, and the layers so far.
#[derive(Debug)]
pub(in crate::prepare) struct MaterialContext<R: Real> {
    /// Layers so far, to which prepared materials refer by index.
    pub layers: Vec<LayeredInputs<R>>,
    /// Whether the integrator is the path tracer.
    pub paths: bool,
    /// Effects that the user has disabled.
    pub without: EffectSet,
    /// Choice of the reflectance formulas.
    pub fresnel: FresnelRule,
    /// Whether rough surfaces include multiple scattering among microfacets.
    pub compensates: bool,
}

/// Whether a physical material needs layers beyond the plain metallic-roughness model.
fn is_layered(m: &PhysicalData, rule: FresnelRule) -> bool {
    let clear = m.may_transmit() && (m.thin_walled || m.dispersion > 0.0);
    let present = [
        m.coat().is_some(),
        m.fibres().is_some(),
        m.active_anisotropy().is_some(),
        m.film().is_some(),
        m.metal().is_some(),
    ];
    let tinted = m.tints_reflections() && m.factor_of_reflections().is_none();
    rule != FresnelRule::default()
        || clear
        || m.may_diffuse_through()
        || tinted
        || present.contains(&true)
}

/// Counts the materials of a scene that need layers in a path tracer.
pub(crate) fn count_layered(scene: &Scene, rule: FresnelRule) -> u64 {
    let has =
        |model: &Model| matches!(model, Model::Physical(m) if !m.unlit && is_layered(m, rule));
    scene
        .materials
        .iter()
        .filter(|material| has(&material.model))
        .count() as u64
}

pub(super) fn layered<R: Real>(
    m: &PhysicalData,
    inputs: &mut Compiler<'_, R>,
    context: &MaterialContext<R>,
) -> Result<Option<LayeredInputs<R>>, PrepareError> {
    if m.unlit || !context.paths || !is_layered(m, context.fresnel) {
        return Ok(None);
    }
    let diffused = m
        .diffuse_transmission
        .as_ref()
        .filter(|_| m.may_diffuse_through());
    let diffused = prepared(diffused, |layer| {
        Ok(Diffused {
            share: inputs.factor(
                &layer.factor,
                &layer.factor_texture,
                "diffuse_transmission.factor",
            )?,
            colour: inputs.factor(
                &layer.colour,
                &layer.colour_texture,
                "diffuse_transmission.colour",
            )?,
        })
    })?;
    let sheen = prepared(m.fibres(), |layer| {
        Ok(Sheen {
            colour: inputs.factor(&layer.colour, &layer.colour_texture, "sheen.colour")?,
            roughness: inputs.factor(
                &layer.roughness,
                &layer.roughness_texture,
                "sheen.roughness",
            )?,
        })
    })?;
    let anisotropy = prepared(m.active_anisotropy(), |layer| {
        let image = inputs.image(&layer.texture, "anisotropy.texture")?;
        let strength = inputs.product(
            &layer.strength,
            image.map(|image| image.channel(Channel::Blue)),
            "anisotropy.strength",
        )?;
        let angle = layer.rotation.to_radians();
        Ok(Anisotropy {
            strength,
            frame: SurfaceDirections {
                turn: [libm::cos(angle), libm::sin(angle)].map(R::from_f64),
                image,
            },
        })
    })?;
    let film = prepared(m.film(), |layer| {
        Ok(ThinFilm {
            share: inputs.factor(&layer.factor, &layer.factor_texture, "iridescence.factor")?,
            ior: layer.ior,
            thickness: Thickness {
                thickest: inputs.factor(&layer.thickness, &None, "iridescence.thickness")?,
                thinnest: R::from_f64(layer.thinnest),
                image: inputs.image(&layer.thickness_texture, "iridescence.thickness_texture")?,
            },
        })
    })?;
    let coat = prepared(m.coat(), |layer| {
        let bump = inputs.image(&layer.normal_texture, "clearcoat.normal_texture")?;
        Ok(Coat {
            weight: inputs.factor(&layer.factor, &layer.factor_texture, "clearcoat.factor")?,
            roughness: inputs.factor(
                &layer.roughness,
                &layer.roughness_texture,
                "clearcoat.roughness",
            )?,
            normal: bump.map(|image| Bump {
                image,
                scale: R::from_f64(layer.normal_scale),
            }),
        })
    })?;
    Ok(Some(Layered {
        base: (),
        // Before a hit, this field holds the dispersion in place of an index.
        ior: if m.thin_walled { 0.0 } else { m.dispersion },
        specular: inputs.factor(&m.specular, &m.specular_texture, "specular")?,
        specular_colour: inputs.factor(
            &m.specular_colour,
            &m.specular_colour_texture,
            "specular_colour",
        )?,
        conductor: m
            .metal()
            .map(|index| [index.n, index.k].map(|c| R::Vec3::from_f64(c.0.into()))),
        thin: m.thin_walled,
        diffused,
        anisotropy,
        film,
        sheen,
        coat,
        rule: context.fresnel,
        compensated: context.compensates,
    }))
}
