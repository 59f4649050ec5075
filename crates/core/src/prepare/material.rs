//! Prepared materials: the two families with compiled inputs.

mod classic;
mod layered;
mod physical;

use raywright_bvh::{Real, Vector};

pub(crate) use classic::{ClassicInputs, SpecularInputs};
pub(super) use layered::Context;
use layered::is_directed;
pub(crate) use layered::{Directions, InputStage, LayeredInputs, Thickness, count_layered};
pub(crate) use physical::{Boundary, Index, PhysicalInputs, PhysicalTransmission};

use super::error::PrepareError;
use super::inputs::Compiler;
use crate::material::MaterialTables;
use crate::scene::{AlphaMode, Colour, Material as MaterialData, Model, Scene};
use crate::texture::ShadingContext;

/// The tables that these layers need.
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
pub(crate) enum Material<R: Real> {
    Classic(ClassicInputs<R>),
    Physical(PhysicalInputs<R>),
    /// A material without objects, which is not prepared.
    Unused,
}

impl<R: Real> Material<R> {
    /// Whether the material blocks all light of shadow rays everywhere.
    pub fn is_opaque(&self) -> bool {
        self.covers() && self.shadow_transmittance() == Some(R::ZERO)
    }

    /// Whether the material may emit.
    pub fn glows(&self) -> bool {
        match self {
            Self::Classic(m) => m.emission.is_some(),
            Self::Physical(m) => m.emission.is_some(),
            Self::Unused => false,
        }
    }

    /// Emitted radiance at a point.
    pub fn emission_at(&self, here: &ShadingContext<'_, R>) -> R::Vec3 {
        match self {
            Self::Classic(m) => m
                .emission
                .as_ref()
                .map_or(R::Vec3::ZERO, |emission| emission.colour(here)),
            Self::Physical(m) => m
                .emission
                .as_ref()
                .map_or(R::Vec3::ZERO, |emission| emission.tint(here, R::Vec3::ONE)),
            Self::Unused => R::Vec3::ZERO,
        }
    }

    /// Alpha (coverage) at a point.
    pub fn alpha_at(&self, here: &ShadingContext<'_, R>) -> R {
        if let Self::Physical(m) = self {
            m.alpha_at(here)
        } else {
            R::ONE
        }
    }

    /// Absorption coefficient of the inside per metre; `None` without absorption.
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

    /// Whether no ray passes straight through, anywhere: refracted light arrives on other paths.
    pub fn covers(&self) -> bool {
        !matches!(self, Self::Physical(m) if m.alpha != AlphaMode::Opaque)
    }

    /// Whether the material is a thin wall that light passes straight.
    pub fn is_wall(&self) -> bool {
        matches!(self, Self::Physical(m) if m.is_wall())
    }

    /// Whether the material needs tangents: for normal maps or anisotropy.
    pub fn is_bumpy(&self, layers: &[LayeredInputs<R>]) -> bool {
        let directed = |place: u32| is_directed(&layers[place as usize]);
        matches!(self, Self::Physical(m) if m.bump.is_some() || m.layered.is_some_and(directed))
    }

    /// Whether transmitted light enters a solid body.
    pub fn bounds_body(&self) -> bool {
        !matches!(self, Self::Physical(m) if m.thin)
    }

    /// Whether the material weights light by the distance of the nearest occluder.
    pub fn asks_how_far(&self) -> bool {
        matches!(self, Self::Classic(m) if m.asks_how_far)
    }

    /// Transmittance of the material as an occluder over its whole area; `None` if it varies.
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

pub(super) fn prepare<R: Real>(
    material: &MaterialData,
    index: usize,
    scene: &Scene,
    inputs: &mut Compiler<'_, R>,
    context: &mut Context<R>,
) -> Result<Material<R>, PrepareError> {
    match &material.model {
        Model::Classic(m) => {
            inputs.path = format!("materials[{index}].model.classic");
            classic::classic(m, scene.classic.ambient, inputs).map(Material::Classic)
        }
        Model::Physical(m) => {
            inputs.path = format!("materials[{index}].model.physical");
            physical::physical(m, inputs, context).map(Material::Physical)
        }
    }
}

/// Prepares an optional part of a material.
fn prepared<T, P>(
    part: Option<T>,
    prepare: impl FnOnce(T) -> Result<P, PrepareError>,
) -> Result<Option<P>, PrepareError> {
    part.map(prepare).transpose()
}

fn vector<R: Real>(c: Colour) -> R::Vec3 {
    R::Vec3::from_f64(c.0.into())
}
