//! Materials, prepared: the two families with their inputs compiled.

use std::collections::BTreeMap;
use std::sync::Arc;

use raywright_bvh::{Real, Vector};

use super::PrepareError;
use super::colour::{ColourSource, Factor};
use super::texture::{Sampler, Textures};
use crate::effects::{Effect, EffectSet};
use crate::expr::{Scope, Variable};
use crate::scene::{
    AlphaMode, Classic as ClassicData, Colour, Material as MaterialData, Model, Physical as PhysicalData, Scene, SpecularModel,
    TextureRef, TransmissionChoice,
};

/// What a surface does to light.
#[derive(Clone, Debug)]
pub(crate) enum Material<R: Real> {
    Classic(Box<Classic<R>>),
    Physical(Box<Physical<R>>),
    /// No object has it, so nothing of it is prepared.
    Unused,
}

/// A local lighting model made of terms.
#[derive(Clone, Debug)]
pub(crate) struct Classic<R: Real> {
    pub colour: ColourSource<R>,
    pub local: Factor<R>,
    pub ambient: R::Vec3,
    pub diffuse: Factor<R>,
    pub specular: Option<Specular<R>>,
    pub rim: Option<(Factor<R>, u32)>,
    pub reflection: Option<Reflection<R>>,
    pub transmission: Option<Transmission<R>>,
    pub emission: Option<ColourSource<R>>,
    pub shadow_transmittance: R,
    pub shadow: Option<Factor<R>>,
    /// Whether a shadow ray is needed: not where `shadow` says what arrives without it.
    pub asks_what_is_between: bool,
}

/// A highlight.
#[derive(Clone, Debug)]
pub(crate) struct Specular<R: Real> {
    pub model: SpecularModel,
    pub exponent: u32,
    pub strength: Factor<R>,
    pub lit: bool,
    pub shadowed: bool,
    pub on_reflection: bool,
}

/// A traced mirror reflection.
#[derive(Clone, Debug)]
pub(crate) struct Reflection<R: Real> {
    pub weight: Factor<R>,
    pub tinted: bool,
    /// Amount and the rows of frequencies.
    pub fuzz: Option<(R, [R::Vec3; 3])>,
}

/// Traced refraction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transmission<R: Real> {
    /// Inside over outside; in f64, because refraction near the critical angle cancels.
    pub ior: f64,
    /// Schlick's reflectance above which one ray reflects; none: both rays, weighted.
    pub switch: Option<R>,
    pub reflected_tint: R::Vec3,
    pub refracted_tint: R::Vec3,
}

/// A texture that may be absent.
type OptionalSampler<R> = Option<Arc<Sampler<R>>>;

/// The metallic-roughness model.
#[derive(Clone, Debug)]
pub(crate) struct Physical<R: Real> {
    pub base: ColourSource<R>,
    pub base_texture: Option<Arc<Sampler<R>>>,
    pub vertex_colours: bool,
    pub metallic: R,
    pub roughness: R,
    pub metallic_roughness: Option<Arc<Sampler<R>>>,
    /// Reflectance of the dielectric at normal incidence.
    pub f0: R,
    pub transmission: Option<Transmission<R>>,
    /// Radiance given off, and what multiplies it; none: nothing.
    pub emission: Option<(R::Vec3, OptionalSampler<R>)>,
    pub alpha: Alpha<R>,
    pub opacity: R,
    pub unlit: bool,
    /// Whether smooth reflection is traced; otherwise it is shown as rough ones are.
    pub mirrors: bool,
}

/// What alpha means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Alpha<R> {
    Opaque,
    Mask(R),
    Blend,
}

impl<R: Real> Material<R> {
    /// Whether it depends on the texture coordinates of a surface.
    pub fn reads_coordinates(&self) -> bool {
        match self {
            Self::Classic(m) => {
                let colours = [Some(&m.colour), m.emission.as_ref()];
                let strength = m.specular.as_ref().map(|s| &s.strength);
                let reflected = m.reflection.as_ref().map(|r| &r.weight);
                let factors =
                    [Some(&m.local), Some(&m.diffuse), strength, m.rim.as_ref().map(|r| &r.0), reflected, m.shadow.as_ref()];
                colours.into_iter().flatten().any(ColourSource::reads_coordinates)
                    || factors.into_iter().flatten().any(Factor::reads_coordinates)
            }
            Self::Physical(m) => {
                let textures = [&m.base_texture, &m.metallic_roughness];
                let emission = m.emission.as_ref().is_some_and(|(_, texture)| texture.is_some());
                m.base.reads_coordinates() || emission || textures.into_iter().any(Option::is_some)
            }
            Self::Unused => false,
        }
    }

    /// Share of light that passes when this is the occluder, where it is the same everywhere.
    pub fn shadow_transmittance(&self) -> R {
        match self {
            Self::Classic(m) => m.shadow_transmittance,
            Self::Physical(m) => m.transmission.map_or(R::ZERO, |t| t.refracted_tint.dot(R::Vec3::splat(R::from_f64(1.0 / 3.0)))),
            Self::Unused => R::ONE,
        }
    }
}

struct Context<'a> {
    names: &'a BTreeMap<String, f64>,
    textures: &'a Textures<'a>,
    path: String,
}

pub(super) fn prepare<R: Real>(
    material: &MaterialData,
    index: usize,
    scene: &Scene,
    names: &BTreeMap<String, f64>,
    textures: &Textures<'_>,
    without: EffectSet,
) -> Result<Material<R>, PrepareError> {
    match &material.model {
        Model::Classic(m) => {
            let context = Context { names, textures, path: format!("materials[{index}].model.classic") };
            classic(m, scene.classic.ambient, &context).map(Box::new).map(Material::Classic)
        }
        Model::Physical(m) => {
            let context = Context { names, textures, path: format!("materials[{index}].model.physical") };
            physical(m, &context, without).map(Box::new).map(Material::Physical)
        }
    }
}

fn vector<R: Real>(c: Colour) -> R::Vec3 {
    R::Vec3::from_f64(c.0.into())
}

fn classic<R: Real>(m: &ClassicData, ambient: Colour, context: &Context<'_>) -> Result<Classic<R>, PrepareError> {
    let factor = |weight, scope, field: &str| Factor::new(weight, scope, context.names, &|| format!("{}.{field}", context.path));
    let colour = |input, field: &str| {
        ColourSource::new(input, Scope::Surface, context.names, context.textures, &|| format!("{}.{field}", context.path))
    };
    let specular = m.specular.as_ref().map(|s| {
        Ok(Specular {
            model: s.model,
            exponent: s.exponent,
            strength: factor(&s.strength, Scope::Light, "specular.strength")?,
            lit: s.lit,
            shadowed: s.shadowed,
            on_reflection: s.on_reflection,
        })
    });
    let reflection = m.reflection.as_ref().map(|r| {
        Ok(Reflection {
            weight: factor(&r.weight, Scope::Light, "reflection.weight")?,
            tinted: r.tinted,
            fuzz: r.fuzz.as_ref().map(|f| (R::from_f64(f.amount), f.frequencies.map(|row| R::Vec3::from_f64(row.into())))),
        })
    });
    let shadow = m.shadow.as_ref().map(|s| factor(s, Scope::Light, "shadow")).transpose()?;
    let rim = m.rim.as_ref().map(|r| Ok((factor(&r.strength, Scope::Surface, "rim.strength")?, r.exponent)));
    Ok(Classic {
        colour: colour(&m.colour, "colour")?,
        local: factor(&m.local, Scope::Surface, "local")?,
        ambient: vector::<R>(m.ambient.unwrap_or(ambient)),
        diffuse: factor(&m.diffuse, Scope::Light, "diffuse")?,
        specular: specular.transpose()?,
        rim: rim.transpose()?,
        reflection: reflection.transpose()?,
        transmission: m.transmission.as_ref().map(|t| Transmission {
            ior: t.ior,
            switch: match t.choice {
                TransmissionChoice::Split => None,
                TransmissionChoice::Switch { threshold } => Some(R::from_f64(threshold)),
            },
            reflected_tint: vector::<R>(t.reflected_tint),
            refracted_tint: vector::<R>(t.refracted_tint),
        }),
        emission: m.emission.as_ref().map(|e| colour(e, "emission")).transpose()?,
        shadow_transmittance: R::from_f64(m.shadow_transmittance),
        asks_what_is_between: shadow.as_ref().is_none_or(|s| s.reads(&[Variable::Shadow, Variable::OccluderDistance])),
        shadow,
    })
}

fn physical<R: Real>(m: &PhysicalData, context: &Context<'_>, without: EffectSet) -> Result<Physical<R>, PrepareError> {
    let path = |field: &str| format!("{}.{field}", context.path);
    let sampler = |reference: &Option<TextureRef>, field: &str| match reference {
        Some(reference) => context.textures.sampler(reference, context.names, &|| path(field)),
        None => Ok(None),
    };
    let base = ColourSource::new(&m.base_colour, Scope::Surface, context.names, context.textures, &|| path("base_colour"))?;
    let f0 = ((m.ior - 1.0) / (m.ior + 1.0)) * ((m.ior - 1.0) / (m.ior + 1.0));
    // A thin tint stands for what the base colour takes away on the way through.
    let tint = match (&base, &m.transmission) {
        (ColourSource::Constant(c), t) => *c * R::from_f64(*t),
        (_, t) => R::Vec3::splat(R::from_f64(*t)),
    };
    let emission_texture = sampler(&m.emission_texture, "emission_texture")?;
    Ok(Physical {
        base,
        base_texture: sampler(&m.base_colour_texture, "base_colour_texture")?,
        vertex_colours: m.vertex_colours,
        metallic: R::from_f64(m.metallic),
        roughness: R::from_f64(m.roughness),
        metallic_roughness: sampler(&m.metallic_roughness_texture, "metallic_roughness_texture")?,
        f0: R::from_f64(f0),
        transmission: (m.transmission > 0.0).then_some(Transmission {
            ior: m.ior,
            switch: None,
            reflected_tint: R::Vec3::ONE,
            refracted_tint: tint,
        }),
        emission: (m.emission != Colour::BLACK).then(|| (vector::<R>(m.emission), emission_texture)),
        alpha: match m.alpha {
            AlphaMode::Opaque => Alpha::Opaque,
            AlphaMode::Mask { cutoff } => Alpha::Mask(R::from_f64(cutoff)),
            AlphaMode::Blend => Alpha::Blend,
        },
        opacity: R::from_f64(m.opacity),
        unlit: m.unlit,
        mirrors: !without.has(Effect::MirrorReflection),
    })
}
