//! Preparation of classic materials.

use raywright_bvh::{Real, Vector};

use super::super::error::PrepareError;
use super::super::inputs::InputCompiler;
use super::{colour_vector, prepare_optional};
use crate::expr::{ExprScope, Variable};
use crate::material::Glass;
use crate::scene::{
    ClassicHighlight, ClassicMaterial as ClassicData, Colour, MirrorReflection, Mixture,
    SpecularModel, Transmission, TransmissionChoice,
};
use crate::texture::PreparedInput;

/// Inputs of a classic material, a local lighting model of several terms (see
/// [`ClassicMaterial`](crate::scene::ClassicMaterial)).
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClassicInputs<R: Real> {
    pub colour: PreparedInput<R>,
    /// Factor on the local term: ambient and diffuse light, highlights and rim.
    pub local: PreparedInput<R>,
    pub ambient: R::Vec3,
    /// Factor on the Lambert term.
    pub diffuse: PreparedInput<R>,
    pub specular: Option<SpecularInputs<R>>,
    /// Strength and exponent of the additional light at grazing angles.
    pub rim: Option<(PreparedInput<R>, u32)>,
    pub reflection: Option<ReflectionInputs<R>>,
    pub transmission: Option<TransmissionInputs<R>>,
    pub emission: Option<PreparedInput<R>>,
    /// Probabilities of reflection, transmission and diffusion for a path tracer.
    pub mixture: Option<Mixture>,
    /// Share of a light that passes through this surface as an occluder, from 0 to 1.
    pub shadow_transmittance: R,
    /// Share of a light that reaches this surface, in place of the shadow rule's factor.
    pub shadow: Option<PreparedInput<R>>,
    /// Whether a shadow ray is needed. It is not if the expression `shadow` reads no property of an
    /// occluder.
    pub needs_shadow_ray: bool,
    /// Whether an expression reads the distance of the nearest occluder.
    pub reads_occluder_distance: bool,
    /// Whether the material consists of Lambert's lobe and emission alone for a path tracer.
    pub matte: bool,
}

/// Inputs of a highlight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpecularInputs<R: Real> {
    pub model: SpecularModel,
    pub exponent: u32,
    pub strength: PreparedInput<R>,
    /// Whether the light's colour tints the highlight.
    pub lit: bool,
    /// Whether shadows dim the highlight.
    pub shadowed: bool,
    /// Whether the weight of the mirror reflection multiplies the highlight, in place of the factor
    /// `local`.
    pub on_reflection: bool,
}

/// Inputs of a traced mirror reflection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReflectionInputs<R: Real> {
    pub weight: PreparedInput<R>,
    /// Whether the base colour tints the reflection.
    pub tinted: bool,
    /// Disturbance of the mirrored direction: its length, and three rows of frequencies in radians
    /// per metre.
    pub fuzz: Option<(R, [R::Vec3; 3])>,
}

/// Inputs of traced refraction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TransmissionInputs<R: Real> {
    pub glass: Glass<R>,
    pub choice: TransmissionChoice,
}

/// Prepares a classic material. `ambient` is the scene's ambient light, for a material without its
/// own.
///
/// # Errors
/// Inputs that do not compile.
pub(super) fn prepare_classic<R: Real>(
    m: &ClassicData,
    ambient: Colour,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<ClassicInputs<R>, PrepareError> {
    let specular = prepare_optional(m.specular.as_ref(), |s| prepare_specular(s, inputs))?;
    let reflection = prepare_optional(m.reflection.as_ref(), |r| prepare_reflection(r, inputs))?;
    let diffuse = inputs.compile_weight(&m.diffuse, ExprScope::Light, "diffuse")?;
    let shadow = prepare_optional(m.shadow.as_ref(), |s| {
        inputs.compile_weight(s, ExprScope::Light, "shadow")
    })?;
    let reads_occluder_distance = [
        Some(&diffuse),
        shadow.as_ref(),
        specular.as_ref().map(|s| &s.strength),
        reflection.as_ref().map(|r| &r.weight),
    ]
    .into_iter()
    .flatten()
    .any(|w| w.reads_variable(&inputs.texture_tables, &[Variable::OccluderDistance]));
    let rim = prepare_optional(m.rim.as_ref(), |r| {
        Ok((
            inputs.compile_weight(&r.strength, ExprScope::Surface, "rim.strength")?,
            r.exponent,
        ))
    })?;
    Ok(ClassicInputs {
        rim,
        colour: inputs.compile_input(&m.colour, "colour")?,
        local: inputs.compile_weight(&m.local, ExprScope::Surface, "local")?,
        ambient: colour_vector::<R>(m.ambient.unwrap_or(ambient)),
        diffuse,
        specular,
        reflection,
        transmission: m.transmission.as_ref().map(prepare_transmission),
        emission: prepare_optional(m.emission.as_ref(), |e| inputs.compile_input(e, "emission"))?,
        mixture: m.mixture,
        shadow_transmittance: R::from_f64(m.shadow_transmittance),
        needs_shadow_ray: shadow.is_none_or(|s| {
            s.reads_variable(
                &inputs.texture_tables,
                &[Variable::Shadow, Variable::OccluderDistance],
            )
        }),
        shadow,
        reads_occluder_distance,
        matte: m.specular.is_none()
            && m.reflection.is_none()
            && m.transmission.is_none()
            && m.mixture.is_none(),
    })
}

/// Prepares the highlight of a classic material.
fn prepare_specular<R: Real>(
    specular: &ClassicHighlight,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<SpecularInputs<R>, PrepareError> {
    Ok(SpecularInputs {
        model: specular.model,
        exponent: specular.exponent,
        strength: inputs.compile_weight(
            &specular.strength,
            ExprScope::Light,
            "specular.strength",
        )?,
        lit: specular.lit,
        shadowed: specular.shadowed,
        on_reflection: specular.on_reflection,
    })
}

/// Prepares the traced mirror reflection of a classic material.
fn prepare_reflection<R: Real>(
    reflection: &MirrorReflection,
    inputs: &mut InputCompiler<'_, R>,
) -> Result<ReflectionInputs<R>, PrepareError> {
    Ok(ReflectionInputs {
        weight: inputs.compile_weight(&reflection.weight, ExprScope::Light, "reflection.weight")?,
        tinted: reflection.tinted,
        fuzz: reflection.fuzz.as_ref().map(|fuzz| {
            (
                R::from_f64(fuzz.amount),
                fuzz.frequencies.map(|row| R::Vec3::from_f64(row.into())),
            )
        }),
    })
}

/// Prepares the traced refraction of a classic material.
fn prepare_transmission<R: Real>(transmission: &Transmission) -> TransmissionInputs<R> {
    TransmissionInputs {
        glass: Glass {
            share: R::ONE,
            ior: transmission.ior,
            reflected: colour_vector::<R>(transmission.reflected_tint),
            transmitted: colour_vector::<R>(transmission.refracted_tint),
        },
        choice: transmission.choice,
    }
}
