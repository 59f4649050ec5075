//! Prepared materials: the classic and the physical family, with compiled inputs.

mod physical;

use physical::layers_need_tangents;
use raywright_bvh::{Real, Vector};

use super::error::PrepareError;
use super::geometry::UniformSurface;
use super::inputs::InputCompiler;
use crate::expr::{ExprScope, Variable};
use crate::material::{Glass, MaterialTables, MetallicRoughness};
use crate::scene::{
    AlphaMode, ClassicHighlight, ClassicMaterial as ClassicData, Colour, Material as MaterialData,
    MaterialModel, MirrorReflection, Mixture, Scene, SpecularModel, Transmission,
    TransmissionChoice,
};
use crate::texture::{PreparedInput, ShadingContext};

pub(super) use physical::MaterialContext;
pub(crate) use physical::{
    AnisotropyFrame, ConstantIor, FilmThickness, InputFieldTypes, LayeredInputs, PhysicalInputs,
    PhysicalTransmission, RefractiveIndex, count_layered_materials, tinted_shadow_transmittance,
};

/// Returns the tabulated functions that the given layers need.
pub(super) fn required_tables<R: Real>(layers: &[LayeredInputs<R>]) -> MaterialTables {
    let some = |has: fn(&LayeredInputs<R>) -> bool| layers.iter().any(has);
    MaterialTables {
        sheen: some(|layers| layers.sheen.is_some()),
        films: some(|layers| layers.film.is_some()),
        wavelengths: some(|layers| layers.ior > 0.0),
    }
}

/// A prepared material.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PreparedMaterial<R: Real> {
    Classic(ClassicInputs<R>),
    Physical(PhysicalInputs<R>),
    /// A material that no object uses, which is not prepared.
    Unused,
}

impl<R: Real> PreparedMaterial<R> {
    /// Whether the material blocks all light at every point.
    pub fn is_opaque(&self) -> bool {
        self.blocks_straight_rays() && self.shadow_transmittance() == Some(R::ZERO)
    }

    /// Whether the material may emit light.
    pub fn emits(&self) -> bool {
        match self {
            Self::Classic(m) => m.emission.is_some(),
            Self::Physical(m) => m.emission.is_some(),
            Self::Unused => false,
        }
    }

    /// Returns the emitted radiance at a hit.
    pub fn emission_at(&self, context: &ShadingContext<'_, R>) -> R::Vec3 {
        match self {
            Self::Classic(m) => m
                .emission
                .as_ref()
                .map_or(R::Vec3::ZERO, |emission| emission.eval_colour(context)),
            Self::Physical(m) => m.emission.as_ref().map_or(R::Vec3::ZERO, |emission| {
                emission.multiply_colour(context, R::Vec3::ONE)
            }),
            Self::Unused => R::Vec3::ZERO,
        }
    }

    /// Returns the base colour at a hit.
    pub fn base_colour_at(&self, context: &ShadingContext<'_, R>) -> R::Vec3 {
        match self {
            Self::Classic(m) => m.colour.eval_colour(context),
            Self::Physical(m) => m.base_colour_at(context),
            Self::Unused => R::Vec3::ZERO,
        }
    }

    /// Returns alpha, the coverage, at a hit.
    pub fn alpha_at(&self, context: &ShadingContext<'_, R>) -> R {
        if let Self::Physical(m) = self {
            m.alpha_at(context)
        } else {
            R::ONE
        }
    }

    /// Returns the absorption coefficient of the inside per metre; `None` without absorption.
    pub fn absorption(&self) -> Option<R::Vec3> {
        match self {
            Self::Classic(m) => m
                .mixture
                .map(|mixture| mixture.absorption)
                .filter(|&a| a != Colour::BLACK)
                .map(colour_vector::<R>),
            Self::Physical(m) => m.absorption,
            Self::Unused => None,
        }
    }

    /// Returns the index of the medium inside, if it scatters light.
    #[inline(always)]
    pub fn medium(&self) -> Option<u32> {
        match self {
            Self::Physical(m) => m.medium,
            _ => None,
        }
    }

    /// Whether the material bounds a body without a surface.
    #[inline(always)]
    pub fn is_open(&self) -> bool {
        matches!(self, Self::Physical(m) if m.is_open)
    }

    /// Whether every point of the surface blocks rays that go straight on. Surfaces that transmit
    /// rays only by refraction block such rays, because refraction changes the direction.
    pub fn blocks_straight_rays(&self) -> bool {
        !matches!(self, Self::Physical(m) if m.alpha != AlphaMode::Opaque)
    }

    /// Returns the model of a physical surface that is the same everywhere.
    #[inline(always)]
    pub fn uniform_model(&self) -> Option<&MetallicRoughness<R>> {
        match self {
            Self::Physical(m) => m.uniform_model.as_ref(),
            _ => None,
        }
    }

    /// Returns the kind of a rough surface without normal map, layers and emission that has a
    /// [`Self::uniform_model`].
    pub fn uniform_surface(&self) -> Option<UniformSurface> {
        match self {
            Self::Physical(m) if m.is_common && m.normal_map.is_none() && m.emission.is_none() => {
                let model = m.uniform_model.filter(|model| model.is_rough())?;
                Some(if model.is_matte() {
                    UniformSurface::Matte
                } else {
                    UniformSurface::Glossy
                })
            }
            _ => None,
        }
    }

    /// Whether the surface is everywhere a smooth mirror or smooth glass. No light sample reaches it.
    pub fn is_smooth(&self) -> bool {
        matches!(self, Self::Physical(m) if m.layers.is_none())
            && self
                .uniform_model()
                .is_some_and(|model| model.smooth_lobe(true).is_some())
    }

    /// Whether the surface is a thin wall, which transmits light without refraction.
    pub fn is_thin_wall(&self) -> bool {
        matches!(self, Self::Physical(m) if m.is_thin())
    }

    /// Whether the material needs tangents, for normal maps or anisotropy.
    pub fn needs_tangents(&self, layers: &[LayeredInputs<R>]) -> bool {
        let directed = |index: u32| layers_need_tangents(&layers[index as usize]);
        matches!(self, Self::Physical(m) if m.normal_map.is_some() || m.layers.is_some_and(directed))
    }

    /// Whether the surface encloses a solid body, into which transmitted light enters.
    pub fn is_solid_boundary(&self) -> bool {
        !matches!(self, Self::Physical(m) if m.thin)
    }

    /// Whether an expression of the material reads the distance of the nearest occluder.
    pub fn reads_occluder_distance(&self) -> bool {
        matches!(self, Self::Classic(m) if m.reads_occluder_distance)
    }

    /// Returns the transmittance for shadow rays if it is constant over the surface; `None` if it
    /// varies.
    pub fn shadow_transmittance(&self) -> Option<R> {
        match self {
            Self::Classic(m) => Some(m.shadow_transmittance),
            Self::Physical(m) => m
                .transmission
                .as_ref()
                .map_or(Some(R::ZERO), |transmission| {
                    transmission.constant_transmittance
                }),
            Self::Unused => Some(R::ONE),
        }
    }
}

/// Prepares a material of the scene; `index` is its position in the list.
pub(super) fn prepare_material<R: Real>(
    material: &MaterialData,
    index: usize,
    scene: &Scene,
    inputs: &mut InputCompiler<'_, R>,
    context: &mut MaterialContext<R>,
) -> Result<PreparedMaterial<R>, PrepareError> {
    match &material.model {
        MaterialModel::Classic(m) => {
            inputs.path = format!("materials[{index}].model.classic");
            prepare_classic(m, scene.classic.ambient, inputs).map(PreparedMaterial::Classic)
        }
        MaterialModel::Physical(m) => {
            inputs.path = format!("materials[{index}].model.physical");
            context.material = index as u32;
            physical::prepare_physical(m, inputs, context).map(PreparedMaterial::Physical)
        }
    }
}

/// Calls `prepare` for a part of a material, such as its highlight, if the part exists.
fn prepare_optional<T, P>(
    part: Option<T>,
    prepare: impl FnOnce(T) -> Result<P, PrepareError>,
) -> Result<Option<P>, PrepareError> {
    part.map(prepare).transpose()
}

/// Converts a colour to a vector of the stored scalar.
fn colour_vector<R: Real>(c: Colour) -> R::Vec3 {
    R::Vec3::from_f64(c.0.into())
}

// Preparation of classic materials.

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
fn prepare_classic<R: Real>(
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
