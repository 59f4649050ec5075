//! Prepared materials: the classic and the physical family, with compiled inputs.

mod classic;
mod layered;
mod physical;

use raywright_bvh::{Real, Vector};

pub(crate) use classic::{ClassicInputs, SpecularInputs};
pub(super) use layered::MaterialContext;
use layered::is_directed;
pub(crate) use layered::{InputStage, LayeredInputs, SurfaceDirections, Thickness, count_layered};
pub(crate) use physical::{
    DielectricBoundary, PhysicalInputs, PhysicalTransmission, RefractiveIndex,
};

use super::error::PrepareError;
use super::inputs::Compiler;
use crate::material::MaterialTables;
use crate::scene::{AlphaMode, Colour, Material as MaterialData, Model, Scene};
use crate::texture::ShadingContext;

/// Returns the tables that the given layers need.
pub(super) fn tables<R: Real>(layers: &[LayeredInputs<R>]) -> MaterialTables {
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
        self.covers() && self.shadow_transmittance() == Some(R::ZERO)
    }

    /// Whether the material may emit light.
    pub fn glows(&self) -> bool {
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
                .map_or(R::Vec3::ZERO, |emission| emission.colour(context)),
            Self::Physical(m) => m.emission.as_ref().map_or(R::Vec3::ZERO, |emission| {
                emission.tint(context, R::Vec3::ONE)
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
                .map(vector::<R>),
            Self::Physical(m) => m.absorption,
            Self::Unused => None,
        }
    }

    /// Whether no ray passes straight through the surface at any point. Refracted rays do not
    /// count, because their direction changes.
    pub fn covers(&self) -> bool {
        !matches!(self, Self::Physical(m) if m.alpha != AlphaMode::Opaque)
    }

    /// Whether the material is a thin wall, which transmits light straight on.
    pub fn is_thin(&self) -> bool {
        matches!(self, Self::Physical(m) if m.is_thin())
    }

    /// Whether the material needs tangents, for normal maps or anisotropy.
    pub fn is_bumpy(&self, layers: &[LayeredInputs<R>]) -> bool {
        let directed = |index: u32| is_directed(&layers[index as usize]);
        matches!(self, Self::Physical(m) if m.bump.is_some() || m.layered.is_some_and(directed))
    }

    /// Whether the surface bounds a solid body, into which transmitted light enters.
    pub fn bounds_body(&self) -> bool {
        !matches!(self, Self::Physical(m) if m.thin)
    }

    /// Whether an expression of the material reads the distance of the nearest occluder.
    pub fn asks_how_far(&self) -> bool {
        matches!(self, Self::Classic(m) if m.asks_how_far)
    }

    /// Returns the transmittance for shadow rays if it is constant over the surface; `None` if it
    /// varies.
    pub fn shadow_transmittance(&self) -> Option<R> {
        match self {
            Self::Classic(m) => Some(m.shadow_transmittance),
            Self::Physical(m) => m
                .transmission
                .as_ref()
                .map_or(Some(R::ZERO), |transmission| transmission.even),
            Self::Unused => Some(R::ONE),
        }
    }
}

/// Prepares a material of the scene; `index` is its position in the list.
pub(super) fn prepare<R: Real>(
    material: &MaterialData,
    index: usize,
    scene: &Scene,
    inputs: &mut Compiler<'_, R>,
    context: &mut MaterialContext<R>,
) -> Result<PreparedMaterial<R>, PrepareError> {
    match &material.model {
        Model::Classic(m) => {
            inputs.path = format!("materials[{index}].model.classic");
            classic::classic(m, scene.classic.ambient, inputs).map(PreparedMaterial::Classic)
        }
        Model::Physical(m) => {
            inputs.path = format!("materials[{index}].model.physical");
            physical::physical(m, inputs, context).map(PreparedMaterial::Physical)
        }
    }
}

/// Prepares an optional part of a material, such as its highlight.
fn prepared<T, P>(
    part: Option<T>,
    prepare: impl FnOnce(T) -> Result<P, PrepareError>,
) -> Result<Option<P>, PrepareError> {
    part.map(prepare).transpose()
}

fn vector<R: Real>(c: Colour) -> R::Vec3 {
    R::Vec3::from_f64(c.0.into())
}
