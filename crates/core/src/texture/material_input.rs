//! Prepared inputs of materials: constants, and values that are evaluated at a hit. An input holds
//! indices into flat tables, so it is only a few numbers large.

use core::cell::Cell;
use core::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use super::sampler::{FilterFootprint, TexelDecoder, TexelFootprint, TextureSampler};
use crate::expr::{ProgramTable, Variable, VariableValues};
use crate::interaction::{Interaction, LightVariableValues};
use crate::scene::{Channel, ImageData};

/// Flat tables of programs, texture uses and images, to which inputs refer by index.
#[derive(Clone, Debug, Default)]
pub(crate) struct InputTables<R: Real> {
    /// Compiled expressions.
    pub programs: ProgramTable<R>,
    /// The programs in `f64`, for a scene whose coordinates are relative to a storage origin;
    /// `None` for a scene near zero.
    pub f64_programs: Option<Box<F64Programs>>,
    /// Texture uses, ordered by material. A texture use is a texture as one input of a material
    /// reads it.
    pub textures: Vec<TextureBinding<R>>,
    /// Range in [`Self::textures`] of each material's texture uses.
    pub material_textures: Vec<Range<u32>>,
    /// Images without duplicates, shared with the scene, so that pixels are not copied.
    pub images: Vec<Arc<ImageData>>,
    /// Mipmap levels for each pair of an image and a colour space that a texture reads with
    /// mipmaps.
    pub pyramids: Vec<Vec<ImageData>>,
    /// Linear values of 8-bit codes.
    pub texel_decoder: TexelDecoder<R>,
}

/// Programs of a scene far from zero. Expressions read world coordinates, which need `f64` there.
#[derive(Clone, Debug)]
pub(crate) struct F64Programs {
    /// Storage origin of the coordinates.
    pub origin: DVec3,
    /// The scene's programs in `f64`, with the indices of [`InputTables::programs`].
    pub programs: ProgramTable<f64>,
}

/// A texture use: a texture as one input of a material reads it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextureBinding<R: Real> {
    /// Index in the table of images.
    pub image: u32,
    /// Colour space, filter, wrap modes, transform of the coordinates, and factor.
    pub sampler: TextureSampler<R>,
    /// Index of the image's mipmaps; `None` if the image is read at full size.
    pub pyramid: Option<u32>,
    /// Index of the mesh's set of texture coordinates.
    pub set: usize,
    /// Expressions for u and v in place of the surface's own texture coordinates.
    pub coordinates: Option<[PreparedInput<R>; 2]>,
    /// Index of the first texture use that has the same texel footprint at every hit; most textures
    /// of a material share a footprint. `None` if the footprint depends on expressions or on
    /// mipmaps.
    pub footprint_source: Option<u32>,
}

impl<R: Real> TextureBinding<R> {
    /// Returns the texel footprint, from the context's cache if possible; `None` if it depends on
    /// expressions or on mipmaps.
    #[inline(always)]
    fn texel_footprint(&self, context: &ShadingContext<'_, R>) -> Option<TexelFootprint<R>> {
        let first = self.footprint_source?;
        if let Some((found, place)) = context.interaction.texel_footprint
            && found == first
        {
            return Some(place);
        }
        Some(match context.footprint.get() {
            Some((found, place)) if found == first => place,
            _ => self.compute_footprint(first, context),
        })
    }

    /// Computes the texel footprint, and keeps it in the context for the uses from `first` on.
    #[inline(never)]
    fn compute_footprint(&self, first: u32, context: &ShadingContext<'_, R>) -> TexelFootprint<R> {
        let image = &context.texture_tables.images[self.image as usize];
        let place = self.footprint_in_image(image, context.interaction);
        context.footprint.set(Some((first, place)));
        place
    }

    /// Computes the texel footprint in an image from the interaction's texture coordinates.
    #[inline(always)]
    fn footprint_in_image(
        &self,
        image: &ImageData,
        interaction: &Interaction<R>,
    ) -> TexelFootprint<R> {
        let coordinates = interaction
            .uv
            .get(self.set)
            .copied()
            .unwrap_or([R::ZERO; 2]);
        self.sampler.texel_footprint(image, coordinates)
    }

    /// Returns the filtered texel: red, green, blue and alpha.
    #[inline(always)]
    fn sample(&self, context: &ShadingContext<'_, R>) -> [R; 4] {
        let Some(place) = self.texel_footprint(context) else {
            return self.sample_uncached(context);
        };
        self.sampler.sample_at_footprint(
            &context.texture_tables.images[self.image as usize],
            &context.texture_tables.texel_decoder,
            &place,
        )
    }

    /// Returns the filtered texel of a texture with expressions or mipmaps.
    #[inline(never)]
    fn sample_uncached(&self, context: &ShadingContext<'_, R>) -> [R; 4] {
        let coordinates = match &self.coordinates {
            Some(own) => own.map(|input| input.eval_coordinate(context)),
            None => context
                .interaction
                .uv
                .get(self.set)
                .copied()
                .unwrap_or([R::ZERO; 2]),
        };
        let footprint = match self.pyramid {
            None => FilterFootprint {
                levels: &[],
                side: R::ZERO,
            },
            Some(pyramid) => FilterFootprint {
                levels: &context.texture_tables.pyramids[pyramid as usize],
                side: context
                    .interaction
                    .footprint
                    .get(self.set)
                    .copied()
                    .unwrap_or(R::ZERO),
            },
        };
        self.sampler.sample(
            &context.texture_tables.images[self.image as usize],
            &context.texture_tables.texel_decoder,
            coordinates,
            footprint,
        )
    }
}

impl<R: Real> InputTables<R> {
    /// Returns the context in which inputs are evaluated at an interaction.
    #[inline(always)]
    pub fn shading_context<'a>(&'a self, interaction: &'a Interaction<R>) -> ShadingContext<'a, R> {
        ShadingContext {
            texture_tables: self,
            interaction,
            light_inputs: LightVariableValues::default(),
            last_texel: Cell::new(None),
            footprint: Cell::new(None),
        }
    }

    /// Evaluates a program of the position alone at a point, such as the density of a medium.
    pub fn eval_at_point(&self, program: u32, p: R::Vec3) -> f64 {
        match &self.f64_programs {
            None => {
                let inputs = VariableValues {
                    p,
                    ..Default::default()
                };
                self.programs.eval_scalar(program, &inputs).to_f64()
            }
            Some(far) => {
                let inputs = VariableValues {
                    p: p.to_f64() + far.origin,
                    ..Default::default()
                };
                far.programs.eval_scalar(program, &inputs)
            }
        }
    }

    /// Returns two numbers between which the value of such a program lies in a box, see
    /// [`ProgramTable::bounds`](crate::expr::ProgramTable::bounds).
    pub fn bounds_in_box(&self, program: u32, corners: [DVec3; 2]) -> [f64; 2] {
        match &self.f64_programs {
            None => self.programs.bounds(program, corners),
            Some(far) => far
                .programs
                .bounds(program, corners.map(|p| p + far.origin)),
        }
    }

    /// Prefetches the texels that the textures of the hit material will read, and stores their
    /// footprint in the interaction. Textures with expressions or mipmaps are skipped.
    #[inline(always)]
    pub fn prefetch_texels(&self, interaction: &mut Interaction<R>) {
        let Range { start, end } = self.material_textures[interaction.material as usize];
        if start < end {
            self.prefetch_textures(&self.textures[start as usize..end as usize], interaction);
        }
    }

    /// Prefetches as [`Self::prefetch_texels`] does, for the texture uses of the hit material.
    #[inline(never)]
    fn prefetch_textures(&self, textures: &[TextureBinding<R>], interaction: &mut Interaction<R>) {
        let (mut last_image, mut kept) = (u32::MAX, None);
        for texture in textures {
            let Some(first) = texture.footprint_source else {
                continue;
            };
            let image = &self.images[texture.image as usize];
            let place = match kept {
                // Two channels of an image are two texture uses, which need a single prefetch.
                Some((found, _)) if found == first && texture.image == last_image => continue,
                Some((found, place)) if found == first => place,
                _ => texture.footprint_in_image(image, interaction),
            };
            kept = Some((first, place));
            place.prefetch(image);
            last_image = texture.image;
        }
        interaction.texel_footprint = kept;
    }
}

/// Context in which inputs are evaluated: an interaction, and the properties of a light while its
/// contribution is computed.
pub(crate) struct ShadingContext<'a, R: Real> {
    texture_tables: &'a InputTables<R>,
    pub interaction: &'a Interaction<R>,
    pub light_inputs: LightVariableValues<R>,
    /// Index and texel of the texture use that was evaluated last, because several inputs may read
    /// channels of the same texel.
    last_texel: Cell<Option<(u32, [R; 4])>>,
    /// The last footprint computed besides that of the interaction, with the index of its first
    /// texture use: see [`TextureBinding::footprint_source`].
    footprint: Cell<Option<(u32, TexelFootprint<R>)>>,
}

impl<R: Real> ShadingContext<'_, R> {
    /// Runs a program and returns its value as a vector; a number is repeated in every component.
    #[inline(always)]
    fn run_program(&self, program: u32) -> R::Vec3 {
        match &self.texture_tables.f64_programs {
            None => self.texture_tables.programs.eval_vector(
                program,
                &self.interaction.expression_inputs(&self.light_inputs),
            ),
            Some(far) => self.run_f64_program(far, program),
        }
    }

    /// Runs a program in `f64`, with points in world coordinates.
    #[inline(never)]
    fn run_f64_program(&self, far: &F64Programs, program: u32) -> R::Vec3 {
        let near = self
            .interaction
            .expression_inputs(&self.light_inputs)
            .to_f64();
        let inputs = VariableValues::<f64> {
            p: near.p + far.origin,
            o: near.o + far.origin,
            ..near
        };
        R::Vec3::from_f64(far.programs.eval_vector(program, &inputs))
    }

    /// Whether the hit point lies in an odd cell of a checkerboard in world x and z. `frequency` is
    /// one over the edge of a cell, per metre.
    #[inline(always)]
    fn is_odd_checker_cell(&self, frequency: R) -> bool {
        let p = self.interaction.surface.point;
        match &self.texture_tables.f64_programs {
            None => is_odd_pattern_cell([p.x(), p.z()], frequency),
            Some(far) => {
                let p = p.to_f64() + far.origin;
                is_odd_pattern_cell([p.x, p.z], frequency.to_f64())
            }
        }
    }

    /// Returns the texel of a texture use, from the context's cache if this use was evaluated last.
    fn sample_texture(&self, texture: u32) -> [R; 4] {
        match self.last_texel.get() {
            Some((last, texel)) if last == texture => texel,
            _ => {
                let texel = self.texture_tables.textures[texture as usize].sample(self);
                self.last_texel.set(Some((texture, texel)));
                texel
            }
        }
    }
}

/// A prepared input of a material: a number or a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PreparedInput<R: Real> {
    /// A constant; a number is repeated in every component.
    Constant(R::Vec3),
    /// A checkerboard of two colours in world x and z. `frequency` is one over the edge of a cell,
    /// per metre.
    Checker {
        even: R::Vec3,
        odd: R::Vec3,
        frequency: R,
    },
    /// Index of a program.
    Program(u32),
    /// Index of a texture use, and its channel; `None` for the colour.
    Texture(u32, Option<Channel>),
}

impl<R: Real> PreparedInput<R> {
    /// Evaluates the input as a colour.
    #[inline(always)]
    pub fn eval_colour(&self, context: &ShadingContext<'_, R>) -> R::Vec3 {
        match *self {
            Self::Constant(c) => c,
            Self::Checker {
                even,
                odd,
                frequency,
            } => {
                if context.is_odd_checker_cell(frequency) {
                    odd
                } else {
                    even
                }
            }
            Self::Program(program) => clamp_negative_to_zero::<R>(context.run_program(program)),
            Self::Texture(texture, None) => {
                let [r, g, b, _] = context.sample_texture(texture);
                R::Vec3::new(r, g, b)
            }
            Self::Texture(texture, Some(channel)) => {
                R::Vec3::splat(context.sample_texture(texture)[channel as usize])
            }
        }
    }

    /// Evaluates the input as a number: of a colour, the red channel.
    #[inline(always)]
    pub fn eval_number(&self, context: &ShadingContext<'_, R>) -> R {
        match *self {
            Self::Constant(c) => c.x(),
            Self::Checker {
                even,
                odd,
                frequency,
            } => {
                if context.is_odd_checker_cell(frequency) {
                    odd.x()
                } else {
                    even.x()
                }
            }
            Self::Program(_) => zero_if_negative(self.eval_coordinate(context)),
            Self::Texture(texture, channel) => {
                context.sample_texture(texture)[channel.unwrap_or(Channel::Red) as usize]
            }
        }
    }

    /// Evaluates the input as a texture coordinate. Unlike [`Self::eval_number`], an expression may
    /// be negative here.
    #[inline(always)]
    fn eval_coordinate(&self, context: &ShadingContext<'_, R>) -> R {
        match *self {
            Self::Program(program) => context.run_program(program).x(),
            _ => self.eval_number(context),
        }
    }

    /// Returns the number of a constant input; zero for any other input.
    pub fn constant_number(&self) -> R {
        match self {
            Self::Constant(c) => c.x(),
            _ => R::ZERO,
        }
    }

    /// Whether the input is the constant zero.
    #[inline(always)]
    pub fn is_zero(&self) -> bool {
        matches!(self, Self::Constant(c) if *c == R::Vec3::ZERO)
    }

    /// Returns the input with another channel of its texture. Inputs without a texture are returned
    /// unchanged.
    pub fn with_channel(self, channel: Channel) -> Self {
        if let Self::Texture(texture, _) = self {
            Self::Texture(texture, Some(channel))
        } else {
            self
        }
    }

    /// Whether the input is an expression that reads any of the given variables.
    pub fn reads_variable(&self, texture_tables: &InputTables<R>, variables: &[Variable]) -> bool {
        match self {
            Self::Program(program) => variables
                .iter()
                .any(|&variable| texture_tables.programs.uses_variable(*program, variable)),
            _ => false,
        }
    }
}

/// Clamps negative channels of a colour to zero. NaN stays NaN.
#[inline(always)]
fn clamp_negative_to_zero<R: Real>(colour: R::Vec3) -> R::Vec3 {
    R::Vec3::new(
        zero_if_negative(colour.x()),
        zero_if_negative(colour.y()),
        zero_if_negative(colour.z()),
    )
}

/// Returns zero for a negative number; NaN stays NaN.
#[inline(always)]
fn zero_if_negative<R: Real>(x: R) -> R {
    if x < R::ZERO { R::ZERO } else { x }
}

/// Whether ⌊x·frequency⌋ + ⌊z·frequency⌋ is odd.
fn is_odd_pattern_cell<R: Real>([x, z]: [R; 2], frequency: R) -> bool {
    let cell = (x * frequency).floor() + (z * frequency).floor();
    let half = cell * R::from_f64(0.5);
    half.floor() != half
}

// Products of inputs, and the inputs of normal maps.

/// Product of an input and an image from a separate key of the file, such as `roughness` and
/// `register_roughness_texture`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InputProduct<R: Real> {
    pub input: PreparedInput<R>,
    pub image: Option<PreparedInput<R>>,
}

impl<R: Real> InputProduct<R> {
    /// Evaluates the product as a number.
    #[inline(always)]
    pub fn eval_number(&self, context: &ShadingContext<'_, R>) -> R {
        let own = self.input.eval_number(context);
        if let Some(image) = &self.image {
            own * image.eval_number(context)
        } else {
            own
        }
    }

    /// Multiplies a colour by the product.
    #[inline(always)]
    pub fn multiply_colour(&self, context: &ShadingContext<'_, R>, colour: R::Vec3) -> R::Vec3 {
        let own = colour * self.input.eval_colour(context);
        if let Some(image) = &self.image {
            own * image.eval_colour(context)
        } else {
            own
        }
    }

    /// Returns the product's value, or `None` if the input or the image varies.
    pub fn constant_value(&self) -> Option<R::Vec3> {
        match (self.input, self.image) {
            (PreparedInput::Constant(value), None) => Some(value),
            _ => None,
        }
    }
}

/// A normal map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NormalMapInput<R: Real> {
    pub image: PreparedInput<R>,
    /// Factor on the tangential components of the image's normal.
    pub scale: R,
}
