//! Prepared inputs of materials: constants, and values that are evaluated at a hit. An input holds
//! indices into flat tables, so it consists of one or two numbers.

use core::cell::Cell;
use core::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use super::sampler::{Footprint, Sampler, TexelCodes, TexelFootprint};
use crate::expr::{Programs, Variable, VariableValues};
use crate::interaction::{Interaction, LightInputs};
use crate::scene::{Channel, ImageData};

/// Flat tables of programs, texture uses and images, to which inputs refer by index.
#[derive(Clone, Debug, Default)]
pub(crate) struct TextureTables<R: Real> {
    /// Compiled expressions.
    pub programs: Programs<R>,
    /// The programs in `f64`, for a scene whose coordinates are relative to a storage origin;
    /// `None` for a scene near zero.
    pub far: Option<Box<FarPrograms>>,
    /// Uses of textures, ordered by material.
    pub textures: Vec<TextureBinding<R>>,
    /// Range in [`Self::textures`] of each material's texture uses.
    pub of_materials: Vec<Range<u32>>,
    /// Images without duplicates, shared with the scene, so that pixels are not copied.
    pub images: Vec<Arc<ImageData>>,
    /// Mipmap levels for each pair of an image and a colour space that a texture reads with
    /// mipmaps.
    pub pyramids: Vec<Vec<ImageData>>,
    /// Linear values of 8-bit codes.
    pub codes: TexelCodes<R>,
}

/// Programs of a scene far from zero. Expressions read world coordinates, which need `f64` there.
#[derive(Clone, Debug)]
pub(crate) struct FarPrograms {
    /// Storage origin of the coordinates.
    pub origin: DVec3,
    /// The scene's programs in `f64`, with the indices of [`TextureTables::programs`].
    pub programs: Programs<f64>,
}

/// A use of a texture by a material's input.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextureBinding<R: Real> {
    /// Index in the table of images.
    pub image: u32,
    /// Filter, wrap modes, transform and factor.
    pub sampler: Sampler<R>,
    /// Index of the image's mipmaps; `None` if the image is read at full size.
    pub pyramid: Option<u32>,
    /// Index of the mesh's set of texture coordinates.
    pub set: usize,
    /// Expressions for u and v in place of the surface's own texture coordinates.
    pub coordinates: Option<[PreparedInput<R>; 2]>,
    /// Index of the first texture use that has the same texel footprint at every hit; most textures
    /// of a material share a footprint. `None` if the footprint depends on expressions or on
    /// mipmaps.
    pub footprint_of: Option<u32>,
}

impl<R: Real> TextureBinding<R> {
    /// Returns the texel footprint, from the context's cache if possible; `None` if it depends on
    /// expressions or on mipmaps.
    #[inline(always)]
    fn place(&self, context: &ShadingContext<'_, R>) -> Option<TexelFootprint<R>> {
        let first = self.footprint_of?;
        Some(match context.place.get() {
            Some((found, place)) if found == first => place,
            _ => {
                let place = self.place_in(
                    &context.texture_tables.images[self.image as usize],
                    context.interaction,
                );
                context.place.set(Some((first, place)));
                place
            }
        })
    }

    /// Computes the texel footprint in an image from the interaction's texture coordinates.
    #[inline(always)]
    fn place_in(&self, image: &ImageData, interaction: &Interaction<R>) -> TexelFootprint<R> {
        let coordinates = interaction
            .uv
            .get(self.set)
            .copied()
            .unwrap_or([R::ZERO; 2]);
        self.sampler.place(image, coordinates)
    }

    /// Returns the filtered texel: red, green, blue and alpha.
    #[inline(always)]
    fn texel(&self, context: &ShadingContext<'_, R>) -> [R; 4] {
        let Some(place) = self.place(context) else {
            return self.texel_anywhere(context);
        };
        self.sampler.texel_at(
            &context.texture_tables.images[self.image as usize],
            &context.texture_tables.codes,
            &place,
        )
    }

    /// Returns the filtered texel of a texture with expressions or mipmaps.
    #[inline(never)]
    fn texel_anywhere(&self, context: &ShadingContext<'_, R>) -> [R; 4] {
        let coordinates = match &self.coordinates {
            Some(own) => own.map(|input| input.coordinate(context)),
            None => context
                .interaction
                .uv
                .get(self.set)
                .copied()
                .unwrap_or([R::ZERO; 2]),
        };
        let footprint = match self.pyramid {
            None => Footprint {
                levels: &[],
                side: R::ZERO,
            },
            Some(pyramid) => Footprint {
                levels: &context.texture_tables.pyramids[pyramid as usize],
                side: context
                    .interaction
                    .footprint
                    .get(self.set)
                    .copied()
                    .unwrap_or(R::ZERO),
            },
        };
        self.sampler.texel(
            &context.texture_tables.images[self.image as usize],
            &context.texture_tables.codes,
            coordinates,
            footprint,
        )
    }
}

impl<R: Real> TextureTables<R> {
    /// Returns the context in which inputs are evaluated at an interaction.
    #[inline(always)]
    pub fn shading_context<'a>(&'a self, interaction: &'a Interaction<R>) -> ShadingContext<'a, R> {
        ShadingContext {
            texture_tables: self,
            interaction,
            light_inputs: LightInputs::default(),
            last: Cell::new(None),
            place: Cell::new(interaction.texel_footprint),
        }
    }

    /// Prefetches the texels that the textures of the hit material will read, and stores their
    /// footprint in the interaction. Textures with expressions or mipmaps are skipped.
    #[inline(always)]
    pub fn prefetch(&self, interaction: &mut Interaction<R>) {
        let Range { start, end } = self.of_materials[interaction.material as usize];
        if start < end {
            self.prefetch_each(&self.textures[start as usize..end as usize], interaction);
        }
    }

    /// [`Self::prefetch`] for a material's texture uses.
    #[inline(never)]
    fn prefetch_each(&self, textures: &[TextureBinding<R>], interaction: &mut Interaction<R>) {
        let mut requested = None;
        for texture in textures {
            let Some(first) = texture.footprint_of else {
                continue;
            };
            let image = &self.images[texture.image as usize];
            let place = match interaction.texel_footprint {
                Some((found, place)) if found == first => place,
                _ => texture.place_in(image, interaction),
            };
            interaction.texel_footprint = Some((first, place));
            // Two channels of an image are two texture uses, which need a single prefetch.
            if requested != Some((first, texture.image)) {
                requested = Some((first, texture.image));
                place.prefetch(image);
            }
        }
    }
}

/// Context in which inputs are evaluated: an interaction, and the properties of a light while its
/// contribution is computed.
pub(crate) struct ShadingContext<'a, R: Real> {
    texture_tables: &'a TextureTables<R>,
    pub interaction: &'a Interaction<R>,
    pub light_inputs: LightInputs<R>,
    /// The last evaluated texture use and its texel, because several inputs may read channels of
    /// the same texel.
    last: Cell<Option<(u32, [R; 4])>>,
    /// The last computed footprint, with the index of its first texture use: see
    /// [`TextureBinding::footprint_of`].
    place: Cell<Option<(u32, TexelFootprint<R>)>>,
}

impl<R: Real> ShadingContext<'_, R> {
    /// Runs a program and returns its value as a vector; a number is repeated in every component.
    #[inline(always)]
    fn run(&self, program: u32) -> R::Vec3 {
        match &self.texture_tables.far {
            None => self
                .texture_tables
                .programs
                .vector(program, &self.interaction.inputs(&self.light_inputs)),
            Some(far) => self.run_far(far, program),
        }
    }

    /// Runs a program in `f64`, with points in world coordinates.
    #[inline(never)]
    fn run_far(&self, far: &FarPrograms, program: u32) -> R::Vec3 {
        let near = self.interaction.inputs(&self.light_inputs).to_f64();
        let inputs = VariableValues::<f64> {
            p: near.p + far.origin,
            o: near.o + far.origin,
            ..near
        };
        R::Vec3::from_f64(far.programs.vector(program, &inputs))
    }

    /// Whether the hit point lies in an odd cell of a checkerboard in world x and z. `frequency` is
    /// the inverse edge of a cell.
    #[inline(always)]
    fn is_odd_cell(&self, frequency: R) -> bool {
        let p = self.interaction.surface.point;
        match &self.texture_tables.far {
            None => is_odd_cell([p.x(), p.z()], frequency),
            Some(far) => {
                let p = p.to_f64() + far.origin;
                is_odd_cell([p.x, p.z], frequency.to_f64())
            }
        }
    }

    /// Returns the texel of a texture use, from the cache if it is the last one.
    fn texel(&self, texture: u32) -> [R; 4] {
        match self.last.get() {
            Some((last, texel)) if last == texture => texel,
            _ => {
                let texel = self.texture_tables.textures[texture as usize].texel(self);
                self.last.set(Some((texture, texel)));
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
    /// A checkerboard of two colours in world x and z. `frequency` is the inverse edge of a cell.
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
    pub fn colour(&self, context: &ShadingContext<'_, R>) -> R::Vec3 {
        match *self {
            Self::Constant(c) => c,
            Self::Checker {
                even,
                odd,
                frequency,
            } => {
                if context.is_odd_cell(frequency) {
                    odd
                } else {
                    even
                }
            }
            Self::Program(program) => clamp_negative::<R>(context.run(program)),
            Self::Texture(texture, None) => {
                let [r, g, b, _] = context.texel(texture);
                R::Vec3::new(r, g, b)
            }
            Self::Texture(texture, Some(channel)) => {
                R::Vec3::splat(context.texel(texture)[channel as usize])
            }
        }
    }

    /// Evaluates the input as a number: of a colour, the red channel.
    #[inline(always)]
    pub fn number(&self, context: &ShadingContext<'_, R>) -> R {
        match *self {
            Self::Constant(c) => c.x(),
            Self::Checker {
                even,
                odd,
                frequency,
            } => {
                if context.is_odd_cell(frequency) {
                    odd.x()
                } else {
                    even.x()
                }
            }
            Self::Program(_) => zero_if_negative(self.coordinate(context)),
            Self::Texture(texture, channel) => {
                context.texel(texture)[channel.unwrap_or(Channel::Red) as usize]
            }
        }
    }

    /// Evaluates the input as a texture coordinate. Unlike [`Self::number`], an expression may be
    /// negative here.
    #[inline(always)]
    fn coordinate(&self, context: &ShadingContext<'_, R>) -> R {
        match *self {
            Self::Program(program) => context.run(program).x(),
            _ => self.number(context),
        }
    }

    /// Whether the input is the constant zero.
    #[inline(always)]
    pub fn is_zero(&self) -> bool {
        matches!(self, Self::Constant(c) if *c == R::Vec3::ZERO)
    }

    /// Returns the input with another channel of its texture. Inputs without a texture are returned
    /// unchanged.
    pub fn channel(self, channel: Channel) -> Self {
        if let Self::Texture(texture, _) = self {
            Self::Texture(texture, Some(channel))
        } else {
            self
        }
    }

    /// Whether the input is an expression that reads any of the given variables.
    pub fn reads(&self, texture_tables: &TextureTables<R>, variables: &[Variable]) -> bool {
        match self {
            Self::Program(program) => variables
                .iter()
                .any(|&variable| texture_tables.programs.uses(*program, variable)),
            _ => false,
        }
    }
}

/// Clamps negative channels of a colour to zero. NaN stays NaN.
#[inline(always)]
fn clamp_negative<R: Real>(colour: R::Vec3) -> R::Vec3 {
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
fn is_odd_cell<R: Real>([x, z]: [R; 2], frequency: R) -> bool {
    let cell = (x * frequency).floor() + (z * frequency).floor();
    let half = cell * R::from_f64(0.5);
    half.floor() != half
}

/// Product of an input and an image from a separate key of the file, such as `roughness` and
/// `roughness_texture`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InputProduct<R: Real> {
    pub own: PreparedInput<R>,
    pub image: Option<PreparedInput<R>>,
}

impl<R: Real> InputProduct<R> {
    /// Evaluates the product as a number.
    #[inline(always)]
    pub fn number(&self, context: &ShadingContext<'_, R>) -> R {
        let own = self.own.number(context);
        if let Some(image) = &self.image {
            own * image.number(context)
        } else {
            own
        }
    }

    /// Multiplies a colour by the product.
    #[inline(always)]
    pub fn tint(&self, context: &ShadingContext<'_, R>, colour: R::Vec3) -> R::Vec3 {
        let own = colour * self.own.colour(context);
        if let Some(image) = &self.image {
            own * image.colour(context)
        } else {
            own
        }
    }

    /// Returns the input's value without the image, or `None` if the input varies.
    pub fn constant(&self) -> Option<R::Vec3> {
        match self.own {
            PreparedInput::Constant(c) => Some(c),
            _ => None,
        }
    }

    /// Returns the product's value, or `None` if the input or the image varies.
    pub fn even(&self) -> Option<R::Vec3> {
        self.constant().filter(|_| self.image.is_none())
    }
}

/// A normal map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bump<R: Real> {
    pub image: PreparedInput<R>,
    /// Factor on the tangential components of the image's normal.
    pub scale: R,
}
