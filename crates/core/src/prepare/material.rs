//! Prepared materials: the classic and the physical family, with compiled inputs.

mod classic;
mod layered;
mod physical;

use raywright_bvh::{Real, Vector};

pub(crate) use classic::{ClassicInputs, ReflectionInputs, SpecularInputs, TransmissionInputs};
pub(super) use layered::MaterialContext;
use layered::layers_need_tangents;
pub(crate) use layered::{
    AnisotropyFrame, FilmThickness, InputFieldTypes, LayeredInputs, count_layered_materials,
};
pub(crate) use physical::{
    ConstantIor, PhysicalInputs, PhysicalTransmission, RefractiveIndex, tinted_shadow_transmittance,
};

use super::error::PrepareError;
use super::geometry::UniformSurface;
use super::inputs::InputCompiler;
use crate::material::{MaterialTables, MetallicRoughness};
use crate::scene::{AlphaMode, Colour, Material as MaterialData, MaterialModel, Scene};
use crate::texture::ShadingContext;

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

    /// Returns the model of an opaque physical surface that is the same everywhere.
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
            classic::prepare_classic(m, scene.classic.ambient, inputs)
                .map(PreparedMaterial::Classic)
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
