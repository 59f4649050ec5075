//! Materials, prepared: the two families with their inputs compiled.

use raywright_bvh::{Real, Vector};

use super::PrepareError;
use super::input::{Compiler, Input, Product, Sources};
use crate::effects::{Effect, EffectSet};
use crate::expr::{Scope, Variable};
use crate::material::Glass;
use crate::scene::{
    AlphaMode, Channel, Classic as ClassicData, Colour, Material as MaterialData, Mixture as MixtureData, Model,
    Physical as PhysicalData, Scene, SpecularModel, TransmissionChoice,
};

/// What a surface does to light.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Material<R: Real> {
    Classic(Classic<R>),
    Physical(Physical<R>),
    /// No object has it, so nothing of it is prepared.
    Unused,
}

/// A local lighting model made of terms.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Classic<R: Real> {
    pub colour: Input<R>,
    pub local: Input<R>,
    pub ambient: R::Vec3,
    pub diffuse: Input<R>,
    pub specular: Option<Specular<R>>,
    pub rim: Option<(Input<R>, u32)>,
    pub reflection: Option<Reflection<R>>,
    pub transmission: Option<Transmission<R>>,
    pub emission: Option<Input<R>>,
    pub mixture: Option<Mixture<R>>,
    pub shadow_transmittance: R,
    pub shadow: Option<Input<R>>,
    /// Whether a shadow ray is needed: not where `shadow` says what arrives without it.
    pub asks_what_is_between: bool,
    /// Whether some weight depends on the distance of the nearest occluder.
    pub asks_how_far: bool,
}

/// A highlight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Specular<R: Real> {
    pub model: SpecularModel,
    pub exponent: u32,
    pub strength: Input<R>,
    pub lit: bool,
    pub shadowed: bool,
    pub on_reflection: bool,
}

/// A traced mirror reflection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reflection<R: Real> {
    pub weight: Input<R>,
    pub tinted: bool,
    /// Amount and the rows of frequencies.
    pub fuzz: Option<(R, [R::Vec3; 3])>,
}

/// Traced refraction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transmission<R: Real> {
    pub glass: Glass<R>,
    /// Schlick's reflectance above which one ray reflects; none: both rays, weighted.
    pub switch: Option<R>,
}

/// Three ways by chance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mixture<R: Real> {
    pub specular_chance: f64,
    pub specular_colour: R::Vec3,
    pub specular_roughness: f64,
    pub refraction_chance: f64,
    pub refraction_roughness: f64,
    pub ior: Option<f64>,
    /// None where it absorbs nothing.
    pub absorption: Option<R::Vec3>,
    pub published_roulette: bool,
}

impl<R: Real> Mixture<R> {
    fn new(m: &MixtureData) -> Self {
        Self {
            specular_chance: m.specular_chance,
            specular_colour: vector::<R>(m.specular_colour),
            specular_roughness: m.specular_roughness,
            refraction_chance: m.refraction_chance,
            refraction_roughness: m.refraction_roughness,
            ior: m.ior,
            absorption: (m.absorption != Colour::BLACK).then(|| vector::<R>(m.absorption)),
            published_roulette: m.published_roulette,
        }
    }
}

/// The metallic-roughness model.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Physical<R: Real> {
    pub base: Product<R>,
    pub vertex_colours: bool,
    pub metallic: Product<R>,
    pub roughness: Product<R>,
    pub index: Index<R>,
    /// What lets light through; none: nothing.
    pub passage: Option<Passage<R>>,
    /// What the inside absorbs per metre; none where nothing.
    pub absorption: Option<R::Vec3>,
    /// Radiance given off; none: nothing.
    pub emission: Option<Product<R>>,
    pub alpha: Alpha<R>,
    pub opacity: Product<R>,
    pub unlit: bool,
    /// What bends its normals; none: nothing.
    pub bump: Option<Bump<R>>,
    /// Whether smooth reflection is traced; otherwise it is shown as rough ones are.
    pub mirrors: bool,
}

/// An image of directions about the normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bump<R: Real> {
    pub image: Input<R>,
    /// Factor of the directions across the normal.
    pub scale: R,
}

/// Index of refraction of a physical material, at least 1.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Index<R: Real> {
    /// The same everywhere.
    Even(Boundary<R>),
    Varying(Product<R>),
}

/// An index of refraction and what follows from it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Boundary<R> {
    /// In f64, in which refraction is computed.
    pub ior: f64,
    /// Reflectance at normal incidence, which f32 would lose digits of near index 1.
    pub f0: R,
}

impl<R: Real> Boundary<R> {
    pub fn new(ior: f64) -> Self {
        Self { ior, f0: R::from_f64(((ior - 1.0) / (ior + 1.0)) * ((ior - 1.0) / (ior + 1.0))) }
    }
}

/// How a physical material lets light through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passage<R: Real> {
    pub share: Product<R>,
    /// A thin tint stands for what the base colour takes away on the way through.
    pub tint: R::Vec3,
    /// Share of a light that passes where this is the occluder; none where it varies.
    pub even: Option<R>,
}

impl<R: Real> Passage<R> {
    /// Share of a light that passes where this is the share of the surface that lets light through.
    pub fn of_light(&self, share: R) -> R {
        (self.tint * share).dot(R::Vec3::splat(R::from_f64(1.0 / 3.0)))
    }
}

/// What a black attenuation colour absorbs per metre: all, in a number that f32 has.
const MOST_ABSORPTION: f64 = 1e30;

/// What alpha means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Alpha<R> {
    Opaque,
    Mask(R),
    Blend,
}

impl<R: Real> Material<R> {
    /// Whether it depends on the texture coordinates of a surface.
    pub fn reads_coordinates(&self, sources: &Sources<R>) -> bool {
        let reads = |input: &Input<R>| input.reads_coordinates(sources);
        match self {
            Self::Classic(m) => {
                let strength = m.specular.as_ref().map(|s| &s.strength);
                let reflected = m.reflection.as_ref().map(|r| &r.weight);
                let further = [m.emission.as_ref(), strength, m.rim.as_ref().map(|r| &r.0), reflected, m.shadow.as_ref()];
                [&m.colour, &m.local, &m.diffuse].into_iter().chain(further.into_iter().flatten()).any(reads)
            }
            Self::Physical(m) => {
                let products = [&m.base, &m.metallic, &m.roughness, &m.opacity];
                let index = if let Index::Varying(index) = &m.index { Some(index) } else { None };
                let bump = m.bump.as_ref().map(|bump| &bump.image);
                let further = [m.emission.as_ref(), index, m.passage.as_ref().map(|passage| &passage.share)];
                products.into_iter().chain(further.into_iter().flatten()).flat_map(Product::factors).chain(bump).any(reads)
            }
            Self::Unused => false,
        }
    }

    /// Whether nothing passes, wherever it is the occluder.
    pub fn is_opaque(&self) -> bool {
        let solid = match self {
            Self::Classic(_) | Self::Unused => true,
            Self::Physical(m) => m.alpha == Alpha::Opaque,
        };
        solid && self.shadow_transmittance() == Some(R::ZERO)
    }

    /// Whether its inside absorbs light.
    pub fn absorbs(&self) -> bool {
        match self {
            Self::Classic(m) => m.mixture.as_ref().is_some_and(|mixture| mixture.absorption.is_some()),
            Self::Physical(m) => m.absorption.is_some(),
            Self::Unused => false,
        }
    }

    /// Whether no ray passes it straight, wherever it is the occluder: light bent by glass arrives on other ways.
    pub fn covers(&self) -> bool {
        !matches!(self, Self::Physical(m) if m.alpha != Alpha::Opaque)
    }

    /// Whether an image bends its normals.
    pub fn is_bumpy(&self) -> bool {
        matches!(self, Self::Physical(m) if m.bump.is_some())
    }

    /// Whether it weighs light by how far away the nearest occluder is.
    pub fn asks_how_far(&self) -> bool {
        matches!(self, Self::Classic(m) if m.asks_how_far)
    }

    /// Share of light that passes when this is the occluder and covers all of what is behind it; none where it varies.
    pub fn shadow_transmittance(&self) -> Option<R> {
        match self {
            Self::Classic(m) => Some(m.shadow_transmittance),
            Self::Physical(m) => m.passage.as_ref().map_or(Some(R::ZERO), |passage| passage.even),
            Self::Unused => Some(R::ONE),
        }
    }
}

pub(super) fn prepare<R: Real>(
    material: &MaterialData,
    index: usize,
    scene: &Scene,
    inputs: &mut Compiler<'_, R>,
    without: EffectSet,
) -> Result<Material<R>, PrepareError> {
    match &material.model {
        Model::Classic(m) => {
            inputs.path = format!("materials[{index}].model.classic");
            classic(m, scene.classic.ambient, inputs).map(Material::Classic)
        }
        Model::Physical(m) => {
            inputs.path = format!("materials[{index}].model.physical");
            physical(m, inputs, without).map(Material::Physical)
        }
    }
}

fn vector<R: Real>(c: Colour) -> R::Vec3 {
    R::Vec3::from_f64(c.0.into())
}

fn classic<R: Real>(m: &ClassicData, ambient: Colour, inputs: &mut Compiler<'_, R>) -> Result<Classic<R>, PrepareError> {
    let specular = m.specular.as_ref().map(|s| {
        Ok(Specular {
            model: s.model,
            exponent: s.exponent,
            strength: inputs.weight(&s.strength, Scope::Light, "specular.strength")?,
            lit: s.lit,
            shadowed: s.shadowed,
            on_reflection: s.on_reflection,
        })
    });
    let specular = specular.transpose()?;
    let reflection = m.reflection.as_ref().map(|r| {
        Ok(Reflection {
            weight: inputs.weight(&r.weight, Scope::Light, "reflection.weight")?,
            tinted: r.tinted,
            fuzz: r.fuzz.as_ref().map(|f| (R::from_f64(f.amount), f.frequencies.map(|row| R::Vec3::from_f64(row.into())))),
        })
    });
    let reflection = reflection.transpose()?;
    let diffuse = inputs.weight(&m.diffuse, Scope::Light, "diffuse")?;
    let shadow = m.shadow.as_ref().map(|s| inputs.weight(s, Scope::Light, "shadow")).transpose()?;
    let further = [specular.as_ref().map(|s: &Specular<R>| &s.strength), reflection.as_ref().map(|r: &Reflection<R>| &r.weight)];
    let weights = [Some(&diffuse), shadow.as_ref()].into_iter().chain(further).flatten();
    let asks_how_far = weights.into_iter().any(|w| w.reads(&inputs.sources, &[Variable::OccluderDistance]));
    let rim = m.rim.as_ref().map(|r| Ok((inputs.weight(&r.strength, Scope::Surface, "rim.strength")?, r.exponent)));
    Ok(Classic {
        rim: rim.transpose()?,
        colour: inputs.input(&m.colour, "colour")?,
        local: inputs.weight(&m.local, Scope::Surface, "local")?,
        ambient: vector::<R>(m.ambient.unwrap_or(ambient)),
        diffuse,
        specular,
        reflection,
        transmission: m.transmission.as_ref().map(|t| Transmission {
            glass: Glass { ior: t.ior, reflected: vector::<R>(t.reflected_tint), transmitted: vector::<R>(t.refracted_tint) },
            switch: match t.choice {
                TransmissionChoice::Split => None,
                TransmissionChoice::Switch { threshold } => Some(R::from_f64(threshold)),
            },
        }),
        emission: m.emission.as_ref().map(|e| inputs.input(e, "emission")).transpose()?,
        mixture: m.mixture.as_ref().map(Mixture::new),
        shadow_transmittance: R::from_f64(m.shadow_transmittance),
        asks_what_is_between: shadow.is_none_or(|s| s.reads(&inputs.sources, &[Variable::Shadow, Variable::OccluderDistance])),
        shadow,
        asks_how_far,
    })
}

fn physical<R: Real>(m: &PhysicalData, inputs: &mut Compiler<'_, R>, without: EffectSet) -> Result<Physical<R>, PrepareError> {
    let image = inputs.image(&m.base_colour_texture, "base_colour_texture")?;
    let base = inputs.product(&m.base_colour, image, "base_colour")?;
    let opacity = inputs.product(&m.opacity, image.map(|image| image.channel(Channel::Alpha)), "opacity")?;
    let image = inputs.image(&m.metallic_roughness_texture, "metallic_roughness_texture")?;
    let roughness = inputs.product(&m.roughness, image.map(|image| image.channel(Channel::Green)), "roughness")?;
    let metallic = inputs.product(&m.metallic, image.map(|image| image.channel(Channel::Blue)), "metallic")?;
    let emission = if m.emission == Colour::BLACK.into() {
        None
    } else {
        let image = inputs.image(&m.emission_texture, "emission_texture")?;
        Some(inputs.product(&m.emission, image, "emission")?)
    };
    let index = match m.ior.constant() {
        Some(ior) => Index::Even(Boundary::new(ior)),
        None => Index::Varying(inputs.product(&m.ior, None, "ior")?),
    };
    let passage = if m.may_transmit() {
        let image = inputs.image(&m.transmission_texture, "transmission_texture")?;
        let share = inputs.product(&m.transmission, image, "transmission")?;
        let passage = Passage { share, tint: base.constant().unwrap_or(R::Vec3::ONE), even: None };
        Some(Passage { even: share.even().map(|share| passage.of_light(share.x())), ..passage })
    } else {
        None
    };
    let bump = match m.bent_by() {
        Some(image) => inputs.texture(image, "normal_texture")?,
        None => None,
    };
    Ok(Physical {
        bump: bump.map(|image| Bump { image, scale: R::from_f64(m.normal_scale) }),
        base,
        vertex_colours: m.vertex_colours,
        metallic,
        roughness,
        index,
        passage,
        absorption: m.absorption().map(|absorption| R::Vec3::from_f64(absorption.map(|a| a.min(MOST_ABSORPTION)).into())),
        emission,
        alpha: match m.alpha {
            AlphaMode::Opaque => Alpha::Opaque,
            AlphaMode::Mask { cutoff } => Alpha::Mask(R::from_f64(cutoff)),
            AlphaMode::Blend => Alpha::Blend,
        },
        opacity,
        unlit: m.unlit,
        mirrors: !without.has(Effect::MirrorReflection),
    })
}
