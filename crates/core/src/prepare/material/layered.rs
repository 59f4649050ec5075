//! What lies over, under and in a physical surface, prepared: only where a path tracer runs and something of it is there.

use raywright_bvh::{Real, Vector};

use super::super::PrepareError;
use super::super::input::{Compiler, Input, Product};
use super::{Bump, Context};
use crate::material::FresnelRule;
use crate::scene::{Channel, Model, Physical as PhysicalData, Scene, TextureRef};

/// The layers of a physical surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layered<R: Real> {
    pub specular: Product<R>,
    pub specular_colour: Product<R>,
    /// Complex index, n and k.
    pub conductor: Option<[R::Vec3; 2]>,
    pub dispersion: f64,
    /// Share and colour of what is diffused to the other side.
    pub diffused: Option<[Product<R>; 2]>,
    pub combed: Option<Combed<R>>,
    pub film: Option<Film<R>>,
    /// Colour and roughness of fibres.
    pub sheen: Option<[Product<R>; 2]>,
    pub coat: Option<Coat<R>>,
    pub rule: FresnelRule,
}

/// How facets are combed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Combed<R: Real> {
    pub strength: Product<R>,
    /// Cosine and sine of the angle from the tangent.
    pub turn: [R; 2],
    /// Directions, and a factor of the strength.
    pub image: Option<Input<R>>,
}

/// A thin film.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Film<R: Real> {
    pub factor: Product<R>,
    pub ior: f64,
    /// Nanometres where the image is white and where it is black.
    pub thickness: Product<R>,
    pub thinnest: R,
    pub image: Option<Input<R>>,
}

/// A clear coat.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coat<R: Real> {
    pub factor: Product<R>,
    pub roughness: Product<R>,
    pub bump: Option<Bump<R>>,
}

impl<R: Real> Layered<R> {
    /// Every input that may be read.
    pub fn inputs(&self) -> impl Iterator<Item = &Input<R>> {
        let mut products = vec![&self.specular, &self.specular_colour];
        products.extend(self.diffused.iter().chain(&self.sheen).flatten());
        products.extend(self.combed.as_ref().map(|combed| &combed.strength));
        products.extend(self.film.iter().flat_map(|film| [&film.factor, &film.thickness]));
        products.extend(self.coat.iter().flat_map(|coat| [&coat.factor, &coat.roughness]));
        let combed = self.combed.as_ref().and_then(|combed| combed.image.as_ref());
        let film = self.film.as_ref().and_then(|film| film.image.as_ref());
        let coat = self.coat.as_ref().and_then(|coat| coat.bump.as_ref()).map(|bump| &bump.image);
        products.into_iter().flat_map(Product::factors).chain([combed, film, coat].into_iter().flatten())
    }

    /// Whether directions on the surface count.
    pub fn is_directed(&self) -> bool {
        self.combed.is_some() || self.coat.as_ref().is_some_and(|coat| coat.bump.is_some())
    }
}

/// Whether a material has something that the metallic-roughness model alone has not.
fn is_layered(m: &PhysicalData, rule: FresnelRule) -> bool {
    let clear = m.may_transmit() && (m.thin_walled || m.dispersion > 0.0);
    let present = [m.coat().is_some(), m.fibres().is_some(), m.combed().is_some(), m.film().is_some(), m.metal().is_some()];
    let tinted = m.tints_reflections() && m.factor_of_reflections().is_none();
    rule != FresnelRule::default() || clear || m.may_diffuse_through() || tinted || present.contains(&true)
}

/// Materials of a scene that get layers where paths are followed.
pub(crate) fn count_layered(scene: &Scene, rule: FresnelRule) -> u64 {
    let has = |model: &Model| matches!(model, Model::Physical(m) if !m.unlit && is_layered(m, rule));
    scene.materials.iter().filter(|material| has(&material.model)).count() as u64
}

pub(super) fn layered<R: Real>(
    m: &PhysicalData,
    inputs: &mut Compiler<'_, R>,
    context: &Context<R>,
) -> Result<Option<Layered<R>>, PrepareError> {
    if m.unlit || !context.paths || !is_layered(m, context.fresnel) {
        return Ok(None);
    }
    let number = |inputs: &mut Compiler<'_, R>, input: &crate::scene::NumberInput, image: &Option<TextureRef>, key: &str| {
        let image = inputs.image(image, key)?;
        inputs.product(input, image, key)
    };
    let colour = |inputs: &mut Compiler<'_, R>, input: &crate::scene::ColourInput, image: &Option<TextureRef>, key: &str| {
        let image = inputs.image(image, key)?;
        inputs.product(input, image, key)
    };
    let diffused = m.diffuse_transmission.as_ref().filter(|_| m.may_diffuse_through()).map(|layer| {
        Ok([
            number(inputs, &layer.factor, &layer.factor_texture, "diffuse_transmission.factor")?,
            colour(inputs, &layer.colour, &layer.colour_texture, "diffuse_transmission.colour")?,
        ])
    });
    let diffused = diffused.transpose()?;
    let sheen = m.fibres().map(|layer| {
        Ok([
            colour(inputs, &layer.colour, &layer.colour_texture, "sheen.colour")?,
            number(inputs, &layer.roughness, &layer.roughness_texture, "sheen.roughness")?,
        ])
    });
    let sheen = sheen.transpose()?;
    Ok(Some(Layered {
        specular: number(inputs, &m.specular, &m.specular_texture, "specular")?,
        specular_colour: colour(inputs, &m.specular_colour, &m.specular_colour_texture, "specular_colour")?,
        conductor: m.metal().map(|index| [index.n, index.k].map(|c| R::Vec3::from_f64(c.0.into()))),
        dispersion: if m.thin_walled { 0.0 } else { m.dispersion },
        diffused,
        combed: combed(m, inputs)?,
        film: film(m, inputs)?,
        sheen,
        coat: coat(m, inputs)?,
        rule: context.fresnel,
    }))
}

fn combed<R: Real>(m: &PhysicalData, inputs: &mut Compiler<'_, R>) -> Result<Option<Combed<R>>, PrepareError> {
    let Some(layer) = m.combed() else { return Ok(None) };
    let image = inputs.image(&layer.texture, "anisotropy.texture")?;
    let angle = layer.rotation.to_radians();
    Ok(Some(Combed {
        strength: inputs.product(&layer.strength, image.map(|image| image.channel(Channel::Blue)), "anisotropy.strength")?,
        turn: [R::from_f64(libm::cos(angle)), R::from_f64(libm::sin(angle))],
        image,
    }))
}

fn film<R: Real>(m: &PhysicalData, inputs: &mut Compiler<'_, R>) -> Result<Option<Film<R>>, PrepareError> {
    let Some(layer) = m.film() else { return Ok(None) };
    let factor = inputs.image(&layer.factor_texture, "iridescence.factor_texture")?;
    Ok(Some(Film {
        factor: inputs.product(&layer.factor, factor, "iridescence.factor")?,
        ior: layer.ior,
        thickness: inputs.product(&layer.thickness, None, "iridescence.thickness")?,
        thinnest: R::from_f64(layer.thinnest),
        image: inputs.image(&layer.thickness_texture, "iridescence.thickness_texture")?,
    }))
}

fn coat<R: Real>(m: &PhysicalData, inputs: &mut Compiler<'_, R>) -> Result<Option<Coat<R>>, PrepareError> {
    let Some(layer) = m.coat() else { return Ok(None) };
    let factor = inputs.image(&layer.factor_texture, "clearcoat.factor_texture")?;
    let roughness = inputs.image(&layer.roughness_texture, "clearcoat.roughness_texture")?;
    let bump = inputs.image(&layer.normal_texture, "clearcoat.normal_texture")?;
    Ok(Some(Coat {
        factor: inputs.product(&layer.factor, factor, "clearcoat.factor")?,
        roughness: inputs.product(&layer.roughness, roughness, "clearcoat.roughness")?,
        bump: bump.map(|image| Bump { image, scale: R::from_f64(layer.normal_scale) }),
    }))
}
