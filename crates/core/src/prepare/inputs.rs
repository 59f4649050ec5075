//! Preparation of material inputs: conversion of the file's inputs to table entries that shading
//! evaluates.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use super::error::PrepareError;
use crate::expr::{ExprScope, Programs, Variable, compile};
use crate::lookup::SceneLookup;
use crate::scene::{
    ColourSpace, Filter, ImageData, Input as InputData, InputValue, TextureRef, Weight,
};
use crate::texture::{
    FarPrograms, InputProduct, PreparedInput, Sampler, TexelCodes, TextureBinding, TextureTables,
    pyramid,
};

/// Dependencies of a material's inputs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InputReads {
    /// The surface's texture coordinates.
    pub coordinates: bool,
    /// Expressions.
    pub expressions: bool,
}

/// Prepares the inputs of materials, one material after the other, into shared tables.
pub(super) struct Compiler<'a, R: Real> {
    names: &'a BTreeMap<String, f64>,
    lookup: &'a SceneLookup<'a>,
    /// Path of the current material in the scene.
    pub path: String,
    pub texture_tables: TextureTables<R>,
    /// Index of each image in the table of images, by address.
    places: HashMap<*const ImageData, u32>,
    /// Index of mip maps, by the image's index and whether its codes are sRGB.
    pyramids: HashMap<(u32, bool), u32>,
    /// Whether textures are read without mip maps in any case.
    pub finest: bool,
    /// Dependencies of the current material so far.
    pub reads: InputReads,
}

impl<'a, R: Real> Compiler<'a, R> {
    /// A compiler for points relative to an origin.
    pub fn new(
        names: &'a BTreeMap<String, f64>,
        lookup: &'a SceneLookup<'a>,
        origin: DVec3,
    ) -> Self {
        let texture_tables = TextureTables {
            programs: Programs::default(),
            far: (origin != DVec3::ZERO).then(|| {
                Box::new(FarPrograms {
                    origin,
                    programs: Programs::default(),
                })
            }),
            textures: Vec::new(),
            of_materials: Vec::new(),
            images: Vec::new(),
            pyramids: Vec::new(),
            codes: TexelCodes::new(),
        };
        Self {
            names,
            lookup,
            path: String::new(),
            texture_tables,
            places: HashMap::new(),
            pyramids: HashMap::new(),
            finest: false,
            reads: InputReads::default(),
        }
    }

    fn program(
        &mut self,
        text: &str,
        scope: ExprScope,
        field: &str,
    ) -> Result<PreparedInput<R>, PrepareError> {
        let failed = |source| PrepareError::Expression {
            path: format!("{}.{field}", self.path),
            source,
        };
        let program = compile(text, self.names, scope).map_err(failed)?;
        self.texture_tables
            .far
            .iter_mut()
            .for_each(|far| _ = far.programs.add(&program));
        let program = self.texture_tables.programs.add(&program);
        self.reads.expressions = true;
        self.reads.coordinates |= [Variable::U, Variable::V]
            .iter()
            .any(|&variable| self.texture_tables.programs.uses(program, variable));
        Ok(PreparedInput::Program(program))
    }

    /// A weight of a classic material, or a texture coordinate.
    pub fn weight(
        &mut self,
        weight: &Weight,
        scope: ExprScope,
        field: &str,
    ) -> Result<PreparedInput<R>, PrepareError> {
        match weight {
            Weight::Number(v) => Ok(PreparedInput::Constant(R::Vec3::splat(R::from_f64(*v)))),
            Weight::Expression(text) => self.program(text, scope, field),
        }
    }

    /// A use of a texture; `None` if its image is unavailable.
    pub fn texture(
        &mut self,
        reference: &TextureRef,
        field: &str,
    ) -> Result<Option<PreparedInput<R>>, PrepareError> {
        let Some(texture) = self.lookup.texture(&reference.name) else {
            let path = format!("{}.{field}", self.path);
            return Err(PrepareError::Missing {
                path,
                kind: "texture",
                name: reference.name.clone(),
            });
        };
        let coordinates = match &reference.uv {
            None => None,
            Some([u, v]) => Some([
                self.weight(u, ExprScope::Surface, field)?,
                self.weight(v, ExprScope::Surface, field)?,
            ]),
        };
        let image = self
            .lookup
            .image(&texture.image)
            .and_then(|image| image.data.as_ref());
        let Some(image) = image else { return Ok(None) };
        let (image, sampler) = (self.place_of(image), Sampler::new(texture, reference));
        // Expressions stretch an image in an unknown way, so they read it without mip maps.
        let filtered = texture.filter == Filter::Mipmaps && coordinates.is_none() && !self.finest;
        let pyramid =
            filtered.then(|| self.pyramid_of(image, texture.colour_space == ColourSpace::Srgb));
        let set = reference.uv_set as usize;
        let depends = pyramid.is_some() || coordinates.is_some();
        let footprint_of = (!depends).then(|| self.first_like(image, &sampler, set));
        self.reads.expressions |= coordinates.is_some();
        self.reads.coordinates |= coordinates.is_none();
        self.texture_tables.textures.push(TextureBinding {
            image,
            sampler,
            pyramid,
            set,
            coordinates,
            footprint_of,
        });
        Ok(Some(PreparedInput::Texture(
            self.texture_tables.textures.len() as u32 - 1,
            reference.channel,
        )))
    }

    /// The first use with the same texel lookup as a new one: the new use itself, or one of the
    /// latest uses, since the maps of a material are added together.
    fn first_like(&self, image: u32, sampler: &Sampler<R>, set: usize) -> u32 {
        const LAST: usize = 16;
        let TextureTables {
            textures, images, ..
        } = &self.texture_tables;
        let size = |image: u32| (images[image as usize].width, images[image as usize].height);
        let equal = |other: &&TextureBinding<R>| {
            other.footprint_of.is_some()
                && other.set == set
                && size(other.image) == size(image)
                && other.sampler.shares_footprint(sampler)
        };
        let found = textures
            .iter()
            .rev()
            .take(LAST)
            .find(equal)
            .and_then(|other| other.footprint_of);
        found.unwrap_or(textures.len() as u32)
    }

    fn place_of(&mut self, image: &Arc<ImageData>) -> u32 {
        let images = &mut self.texture_tables.images;
        *self.places.entry(Arc::as_ptr(image)).or_insert_with(|| {
            images.push(Arc::clone(image));
            images.len() as u32 - 1
        })
    }

    /// Whether a texture is filtered by mip maps.
    pub fn reduces(&self, reference: &TextureRef) -> bool {
        self.lookup
            .texture(&reference.name)
            .is_some_and(|texture| texture.filter == Filter::Mipmaps)
    }

    fn pyramid_of(&mut self, image: u32, srgb: bool) -> u32 {
        let TextureTables {
            images, pyramids, ..
        } = &mut self.texture_tables;
        *self.pyramids.entry((image, srgb)).or_insert_with(|| {
            pyramids.push(pyramid::levels(&images[image as usize], srgb));
            pyramids.len() as u32 - 1
        })
    }

    /// An optional image that multiplies an input.
    pub fn image(
        &mut self,
        reference: &Option<TextureRef>,
        field: &str,
    ) -> Result<Option<PreparedInput<R>>, PrepareError> {
        reference
            .as_ref()
            .map_or(Ok(None), |reference| self.texture(reference, field))
    }

    /// A number or a colour that may vary over the surface.
    pub fn input<T: InputValue>(
        &mut self,
        input: &InputData<T>,
        field: &str,
    ) -> Result<PreparedInput<R>, PrepareError> {
        let colour = |c: crate::scene::Colour| R::Vec3::from_f64(c.0.into());
        Ok(match input {
            InputData::Constant(value) => PreparedInput::Constant(colour(value.colour())),
            InputData::Expression(text) => self.program(text, ExprScope::Surface, field)?,
            InputData::Checker(c) => {
                let checker = &c.checker;
                PreparedInput::Checker {
                    even: colour(checker.even),
                    odd: colour(checker.odd),
                    frequency: R::from_f64(1.0 / checker.size),
                }
            }
            InputData::Texture(t) => self
                .texture(&t.texture, field)?
                .unwrap_or(PreparedInput::Constant(colour(t.texture.factor))),
        })
    }

    /// An input, with the image of a separate key that multiplies it.
    pub fn factor<T: InputValue>(
        &mut self,
        input: &InputData<T>,
        image: &Option<TextureRef>,
        field: &str,
    ) -> Result<InputProduct<R>, PrepareError> {
        let image = self.image(image, field)?;
        self.product(input, image, field)
    }

    /// An input, with the image that multiplies it.
    pub fn product<T: InputValue>(
        &mut self,
        input: &InputData<T>,
        image: Option<PreparedInput<R>>,
        field: &str,
    ) -> Result<InputProduct<R>, PrepareError> {
        Ok(InputProduct {
            own: self.input(input, field)?,
            image,
        })
    }
}
