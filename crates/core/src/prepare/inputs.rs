//! Preparation of materials' inputs. The inputs of the scene file are converted to entries of
//! tables, which are evaluated during shading.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use super::error::PrepareError;
use crate::expr::{ExprScope, ProgramTable, Variable, compile};
use crate::lookup::SceneLookup;
use crate::scene::{
    ColourSpace, ImageData, Input as InputData, InputValue, ScalarFactor, TextureFilter, TextureRef,
};
use crate::texture::{
    F64Programs, InputProduct, InputTables, PreparedInput, TexelDecoder, TextureBinding,
    TextureSampler, mipmap,
};

/// Properties of a hit that the inputs of a material read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InputDependencies {
    /// Whether an input reads the surface's texture coordinates.
    pub coordinates: bool,
    /// Whether an input is an expression.
    pub expressions: bool,
}

/// Compiler of materials' inputs. It takes one material after the other and fills common tables.
pub(super) struct InputCompiler<'a, R: Real> {
    constants: &'a BTreeMap<String, f64>,
    lookup: &'a SceneLookup<'a>,
    /// Path of the current material in the scene, for errors.
    pub path: String,
    pub texture_tables: InputTables<R>,
    /// Index of each image in [`InputTables::images`], by its address in memory.
    image_indices: HashMap<*const ImageData, u32>,
    /// Index of an image's mipmap levels in [`InputTables::pyramids`], by the image's index and
    /// whether its codes are sRGB.
    mipmap_indices: HashMap<(u32, bool), u32>,
    /// Whether texture uses ignore mipmaps.
    pub ignore_mipmaps: bool,
    /// Dependencies of the inputs that were compiled so far for the current material.
    pub dependencies: InputDependencies,
}

impl<'a, R: Real> InputCompiler<'a, R> {
    /// Creates a compiler for a scene whose coordinates are relative to an origin. `names` are the
    /// time and the parameters.
    pub fn new(
        names: &'a BTreeMap<String, f64>,
        lookup: &'a SceneLookup<'a>,
        origin: DVec3,
    ) -> Self {
        let texture_tables = InputTables {
            programs: ProgramTable::default(),
            f64_programs: (origin != DVec3::ZERO).then(|| {
                Box::new(F64Programs {
                    origin,
                    programs: ProgramTable::default(),
                })
            }),
            textures: Vec::new(),
            material_textures: Vec::new(),
            images: Vec::new(),
            pyramids: Vec::new(),
            texel_decoder: TexelDecoder::new(),
        };
        Self {
            constants: names,
            lookup,
            path: String::new(),
            texture_tables,
            image_indices: HashMap::new(),
            mipmap_indices: HashMap::new(),
            ignore_mipmaps: false,
            dependencies: InputDependencies::default(),
        }
    }

    /// Compiles an expression and adds its program to the tables. `field` is the path of the input
    /// in the material.
    fn compile_program(
        &mut self,
        text: &str,
        scope: ExprScope,
        field: &str,
    ) -> Result<PreparedInput<R>, PrepareError> {
        let failed = |source| PrepareError::Expression {
            path: format!("{}.{field}", self.path),
            source,
        };
        let program = compile(text, self.constants, scope).map_err(failed)?;
        self.texture_tables
            .f64_programs
            .iter_mut()
            .for_each(|far| _ = far.programs.add(&program));
        let program = self.texture_tables.programs.add(&program);
        self.dependencies.expressions = true;
        self.dependencies.coordinates |= [Variable::U, Variable::V].iter().any(|&variable| {
            self.texture_tables
                .programs
                .uses_variable(program, variable)
        });
        Ok(PreparedInput::Program(program))
    }

    /// Compiles a weight of a classic material, or a texture coordinate.
    pub fn compile_weight(
        &mut self,
        weight: &ScalarFactor,
        scope: ExprScope,
        field: &str,
    ) -> Result<PreparedInput<R>, PrepareError> {
        match weight {
            ScalarFactor::Number(v) => Ok(PreparedInput::Constant(R::Vec3::splat(R::from_f64(*v)))),
            ScalarFactor::Expression(text) => self.compile_program(text, scope, field),
        }
    }

    /// Compiles a texture use; `None` if the image could not be read.
    pub fn compile_texture(
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
                self.compile_weight(u, ExprScope::Surface, field)?,
                self.compile_weight(v, ExprScope::Surface, field)?,
            ]),
        };
        let image = self
            .lookup
            .image(&texture.image)
            .and_then(|image| image.data.as_ref());
        let Some(image) = image else { return Ok(None) };
        let (image, sampler) = (
            self.find_or_add_image(image),
            TextureSampler::new(texture, reference),
        );
        // Expressions stretch an image by an unknown factor, so they read it without mipmaps.
        let filtered = texture.filter == TextureFilter::Mipmaps
            && coordinates.is_none()
            && !self.ignore_mipmaps;
        let pyramid = filtered
            .then(|| self.find_or_build_mipmaps(image, texture.colour_space == ColourSpace::Srgb));
        let set = reference.uv_set as usize;
        let depends = pyramid.is_some() || coordinates.is_some();
        let footprint_of = (!depends).then(|| self.first_footprint_use(image, &sampler, set));
        self.dependencies.expressions |= coordinates.is_some();
        self.dependencies.coordinates |= coordinates.is_none();
        self.texture_tables.textures.push(TextureBinding {
            image,
            sampler,
            pyramid,
            set,
            coordinates,
            footprint_source: footprint_of,
        });
        Ok(Some(PreparedInput::Texture(
            self.texture_tables.textures.len() as u32 - 1,
            reference.channel,
        )))
    }

    /// Returns the index of the first texture use that has the same footprint as a new texture use.
    /// Only the last 16 texture uses are searched, because a material's textures are added in
    /// sequence. Without a match, the index of the new use itself is returned.
    fn first_footprint_use(&self, image: u32, sampler: &TextureSampler<R>, set: usize) -> u32 {
        const LAST: usize = 16;
        let InputTables {
            textures, images, ..
        } = &self.texture_tables;
        let size = |image: u32| (images[image as usize].width, images[image as usize].height);
        let equal = |other: &&TextureBinding<R>| {
            other.footprint_source.is_some()
                && other.set == set
                && size(other.image) == size(image)
                && other.sampler.has_same_footprint(sampler)
        };
        let found = textures
            .iter()
            .rev()
            .take(LAST)
            .find(equal)
            .and_then(|other| other.footprint_source);
        found.unwrap_or(textures.len() as u32)
    }

    /// Returns the index of an image in the table. A missing image is added.
    fn find_or_add_image(&mut self, image: &Arc<ImageData>) -> u32 {
        let images = &mut self.texture_tables.images;
        *self
            .image_indices
            .entry(Arc::as_ptr(image))
            .or_insert_with(|| {
                images.push(Arc::clone(image));
                images.len() as u32 - 1
            })
    }

    /// Whether a texture is filtered by mipmaps.
    pub fn uses_mipmaps(&self, reference: &TextureRef) -> bool {
        self.lookup
            .texture(&reference.name)
            .is_some_and(|texture| texture.filter == TextureFilter::Mipmaps)
    }

    /// Returns the index of an image's mipmap levels. Missing levels are built.
    fn find_or_build_mipmaps(&mut self, image: u32, srgb: bool) -> u32 {
        let InputTables {
            images, pyramids, ..
        } = &mut self.texture_tables;
        *self.mipmap_indices.entry((image, srgb)).or_insert_with(|| {
            pyramids.push(mipmap::build_mipmaps(&images[image as usize], srgb));
            pyramids.len() as u32 - 1
        })
    }

    /// Compiles the image by which an input is multiplied; `None` without an image.
    pub fn compile_image(
        &mut self,
        reference: &Option<TextureRef>,
        field: &str,
    ) -> Result<Option<PreparedInput<R>>, PrepareError> {
        reference
            .as_ref()
            .map_or(Ok(None), |reference| self.compile_texture(reference, field))
    }

    /// Compiles a number or a colour that may vary over the surface.
    pub fn compile_input<T: InputValue>(
        &mut self,
        input: &InputData<T>,
        field: &str,
    ) -> Result<PreparedInput<R>, PrepareError> {
        let colour = |c: crate::scene::Colour| R::Vec3::from_f64(c.0.into());
        Ok(match input {
            InputData::Constant(value) => PreparedInput::Constant(colour(value.to_colour())),
            InputData::Expression(text) => self.compile_program(text, ExprScope::Surface, field)?,
            InputData::Checker(c) => {
                let checker = &c.checker;
                PreparedInput::Checker {
                    even: colour(checker.even),
                    odd: colour(checker.odd),
                    frequency: R::from_f64(1.0 / checker.size),
                }
            }
            InputData::Texture(t) => self
                .compile_texture(&t.texture, field)?
                .unwrap_or(PreparedInput::Constant(colour(t.texture.factor))),
        })
    }

    /// Compiles the product of an input and the image under a separate key, such as `base_colour`
    /// and `base_colour_texture`.
    pub fn compile_factor<T: InputValue>(
        &mut self,
        input: &InputData<T>,
        image: &Option<TextureRef>,
        field: &str,
    ) -> Result<InputProduct<R>, PrepareError> {
        let image = self.compile_image(image, field)?;
        self.compile_product(input, image, field)
    }

    /// Compiles the product of an input and a compiled image.
    pub fn compile_product<T: InputValue>(
        &mut self,
        input: &InputData<T>,
        image: Option<PreparedInput<R>>,
        field: &str,
    ) -> Result<InputProduct<R>, PrepareError> {
        Ok(InputProduct {
            input: self.compile_input(input, field)?,
            image,
        })
    }
}
