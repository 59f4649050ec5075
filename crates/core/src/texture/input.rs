//! Inputs that may vary over a surface, as they are read: constants stay constants, everything else
//! is evaluated where a ray hit. What they refer to lies in flat tables, so an input is a number or
//! two itself.

use core::cell::Cell;
use core::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use super::sampler::{Codes, Footprint, Place, Sampler};
use crate::expr::{Inputs, Programs, Variable};
use crate::interaction::{Beam, Interaction};
use crate::scene::{Channel, ImageData};

/// The tables that inputs refer to by index.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sources<R: Real> {
    pub programs: Programs<R>,
    /// Of a scene whose coordinates are counted from an origin.
    pub far: Option<Box<FarPrograms>>,
    pub textures: Vec<TextureUse<R>>,
    /// Which of them each material reads.
    pub of_materials: Vec<Range<u32>>,
    /// Each once, however many textures show it; the scene's own, because pixels are not copied.
    pub images: Vec<Arc<ImageData>>,
    /// Mip maps of images, for each colour space in which one is read with them; empty where no
    /// texture asks for any.
    pub pyramids: Vec<Vec<ImageData>>,
    pub codes: Codes<R>,
}

/// Programs of a scene far from zero: they see the world's coordinates, which take doubles there.
#[derive(Clone, Debug)]
pub(crate) struct FarPrograms {
    /// What stored coordinates are counted from.
    pub origin: DVec3,
    /// The scene's programs by the same indices.
    pub programs: Programs<f64>,
}

/// A use of a texture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextureUse<R: Real> {
    /// Its place in the table of images.
    pub image: u32,
    pub sampler: Sampler<R>,
    /// The image's mip maps in their table; none: it is read as it is.
    pub pyramid: Option<u32>,
    /// Of a mesh's sets of texture coordinates.
    pub set: usize,
    /// Expressions in place of the surface's own coordinates.
    pub coordinates: Option<[Input<R>; 2]>,
    /// The first use that finds the same texels wherever it is asked, as the maps of a material
    /// mostly do; none: what is found depends on more than a set of coordinates.
    pub lies_as: Option<u32>,
}

impl<R: Real> TextureUse<R> {
    /// Where it reads its image, where that depends on a set of coordinates alone.
    #[inline(always)]
    fn place(&self, here: &ShadingContext<'_, R>) -> Option<Place<R>> {
        let first = self.lies_as?;
        Some(match here.place.get() {
            Some((found, place)) if found == first => place,
            _ => {
                let place = self.place_in(&here.sources.images[self.image as usize], here.at);
                here.place.set(Some((first, place)));
                place
            }
        })
    }

    #[inline(always)]
    fn place_in(&self, image: &ImageData, at: &Interaction<R>) -> Place<R> {
        let coordinates = at.uv.get(self.set).copied().unwrap_or([R::ZERO; 2]);
        self.sampler.place(image, coordinates)
    }

    #[inline(always)]
    fn texel(&self, here: &ShadingContext<'_, R>) -> [R; 4] {
        let Some(place) = self.place(here) else {
            return self.texel_anywhere(here);
        };
        self.sampler.texel_at(
            &here.sources.images[self.image as usize],
            &here.sources.codes,
            &place,
        )
    }

    #[inline(never)]
    fn texel_anywhere(&self, here: &ShadingContext<'_, R>) -> [R; 4] {
        let coordinates = match &self.coordinates {
            Some(own) => own.map(|input| input.coordinate(here)),
            None => here.at.uv.get(self.set).copied().unwrap_or([R::ZERO; 2]),
        };
        let footprint = match self.pyramid {
            None => Footprint {
                levels: &[],
                side: R::ZERO,
            },
            Some(pyramid) => Footprint {
                levels: &here.sources.pyramids[pyramid as usize],
                side: here.at.footprint.get(self.set).copied().unwrap_or(R::ZERO),
            },
        };
        self.sampler.texel(
            &here.sources.images[self.image as usize],
            &here.sources.codes,
            coordinates,
            footprint,
        )
    }
}

impl<R: Real> Sources<R> {
    /// Reads inputs at an interaction.
    #[inline(always)]
    pub fn at<'a>(&'a self, at: &'a Interaction<R>) -> ShadingContext<'a, R> {
        ShadingContext {
            sources: self,
            at,
            beam: Beam::default(),
            last: Cell::new(None),
            place: Cell::new(at.lies),
        }
    }

    /// Has the texels brought near that a material's textures will read at an interaction, as far
    /// as texture coordinates alone say which, and notes where they lie.
    #[inline(always)]
    pub fn prefetch(&self, at: &mut Interaction<R>) {
        let Range { start, end } = self.of_materials[at.material as usize];
        if start < end {
            self.prefetch_each(&self.textures[start as usize..end as usize], at);
        }
    }

    #[inline(never)]
    fn prefetch_each(&self, textures: &[TextureUse<R>], at: &mut Interaction<R>) {
        let mut asked = None;
        for texture in textures {
            let Some(first) = texture.lies_as else {
                continue;
            };
            let image = &self.images[texture.image as usize];
            let place = match at.lies {
                Some((found, place)) if found == first => place,
                _ => texture.place_in(image, at),
            };
            at.lies = Some((first, place));
            // Channels of one image are uses of their own.
            if asked != Some((first, texture.image)) {
                asked = Some((first, texture.image));
                place.prefetch(image);
            }
        }
    }
}

/// Where inputs are read, and of what light where one is weighed.
pub(crate) struct ShadingContext<'a, R: Real> {
    sources: &'a Sources<R>,
    pub at: &'a Interaction<R>,
    pub beam: Beam<R>,
    /// The use of a texture that was read last and its texel: several inputs may read channels of
    /// one.
    last: Cell<Option<(u32, [R; 4])>>,
    /// Where the use that was read last lies: see [`TextureUse::lies_as`].
    place: Cell<Option<(u32, Place<R>)>>,
}

impl<R: Real> ShadingContext<'_, R> {
    /// The value of a program as a vector; a number in every component.
    #[inline(always)]
    fn run(&self, program: u32) -> R::Vec3 {
        match &self.sources.far {
            None => self
                .sources
                .programs
                .vector(program, &self.at.inputs(&self.beam)),
            Some(far) => self.run_far(far, program),
        }
    }

    #[inline(never)]
    fn run_far(&self, far: &FarPrograms, program: u32) -> R::Vec3 {
        let near = self.at.inputs(&self.beam).to_f64();
        let inputs = Inputs::<f64> {
            p: near.p + far.origin,
            o: near.o + far.origin,
            ..near
        };
        R::Vec3::from_f64(far.programs.vector(program, &inputs))
    }

    /// Whether the point lies in an odd cell of a pattern in the world's x and z.
    #[inline(always)]
    fn is_odd_cell(&self, frequency: R) -> bool {
        let p = self.at.surface.point;
        match &self.sources.far {
            None => is_odd_cell([p.x(), p.z()], frequency),
            Some(far) => {
                let p = p.to_f64() + far.origin;
                is_odd_cell([p.x, p.z], frequency.to_f64())
            }
        }
    }

    fn texel(&self, texture: u32) -> [R; 4] {
        match self.last.get() {
            Some((last, texel)) if last == texture => texel,
            _ => {
                let texel = self.sources.textures[texture as usize].texel(self);
                self.last.set(Some((texture, texel)));
                texel
            }
        }
    }
}

/// A number or a colour of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Input<R: Real> {
    /// The same everywhere; a number in every component.
    Constant(R::Vec3),
    /// Two colours in cells of world x and z.
    Checker {
        even: R::Vec3,
        odd: R::Vec3,
        frequency: R,
    },
    Program(u32),
    /// A use of a texture, and which of its channels; none: the colour.
    Texture(u32, Option<Channel>),
}

impl<R: Real> Input<R> {
    /// Its value as a colour.
    #[inline(always)]
    pub fn colour(&self, here: &ShadingContext<'_, R>) -> R::Vec3 {
        match *self {
            Self::Constant(c) => c,
            Self::Checker {
                even,
                odd,
                frequency,
            } => {
                if here.is_odd_cell(frequency) {
                    odd
                } else {
                    even
                }
            }
            Self::Program(program) => clamp_negative::<R>(here.run(program)),
            Self::Texture(texture, None) => {
                let [r, g, b, _] = here.texel(texture);
                R::Vec3::new(r, g, b)
            }
            Self::Texture(texture, Some(channel)) => {
                R::Vec3::splat(here.texel(texture)[channel as usize])
            }
        }
    }

    /// Its value as a number; of a colour the red part.
    #[inline(always)]
    pub fn number(&self, here: &ShadingContext<'_, R>) -> R {
        match *self {
            Self::Constant(c) => c.x(),
            Self::Checker {
                even,
                odd,
                frequency,
            } => {
                if here.is_odd_cell(frequency) {
                    odd.x()
                } else {
                    even.x()
                }
            }
            Self::Program(_) => zero_if_negative(self.coordinate(here)),
            Self::Texture(texture, channel) => {
                here.texel(texture)[channel.unwrap_or(Channel::Red) as usize]
            }
        }
    }

    /// Its value as a texture coordinate, the one number that an expression may make negative.
    #[inline(always)]
    fn coordinate(&self, here: &ShadingContext<'_, R>) -> R {
        match *self {
            Self::Program(program) => here.run(program).x(),
            _ => self.number(here),
        }
    }

    /// Zero everywhere.
    #[inline(always)]
    pub fn is_zero(&self) -> bool {
        matches!(self, Self::Constant(c) if *c == R::Vec3::ZERO)
    }

    /// Another channel of the same texture; any other input is itself.
    pub fn channel(self, channel: Channel) -> Self {
        if let Self::Texture(texture, _) = self {
            Self::Texture(texture, Some(channel))
        } else {
            self
        }
    }

    /// Whether it depends on one of these variables by an expression.
    pub fn reads(&self, sources: &Sources<R>, variables: &[Variable]) -> bool {
        match self {
            Self::Program(program) => variables
                .iter()
                .any(|&variable| sources.programs.uses(*program, variable)),
            _ => false,
        }
    }
}

/// What an expression makes of a colour: parts below zero have no meaning and are zero; what is no
/// number stays none.
#[inline(always)]
fn clamp_negative<R: Real>(colour: R::Vec3) -> R::Vec3 {
    R::Vec3::new(
        zero_if_negative(colour.x()),
        zero_if_negative(colour.y()),
        zero_if_negative(colour.z()),
    )
}

#[inline(always)]
fn zero_if_negative<R: Real>(x: R) -> R {
    if x < R::ZERO { R::ZERO } else { x }
}

fn is_odd_cell<R: Real>([x, z]: [R; 2], frequency: R) -> bool {
    let cell = (x * frequency).floor() + (z * frequency).floor();
    let half = cell * R::from_f64(0.5);
    half.floor() != half
}

/// An input, and the image of a key of its own that multiplies it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Product<R: Real> {
    pub own: Input<R>,
    pub image: Option<Input<R>>,
}

impl<R: Real> Product<R> {
    /// The value as a number.
    #[inline(always)]
    pub fn number(&self, here: &ShadingContext<'_, R>) -> R {
        let own = self.own.number(here);
        if let Some(image) = &self.image {
            own * image.number(here)
        } else {
            own
        }
    }

    /// A colour times the value.
    #[inline(always)]
    pub fn tint(&self, here: &ShadingContext<'_, R>, colour: R::Vec3) -> R::Vec3 {
        let own = colour * self.own.colour(here);
        if let Some(image) = &self.image {
            own * image.colour(here)
        } else {
            own
        }
    }

    /// The value of the input itself where no hit changes it.
    pub fn constant(&self) -> Option<R::Vec3> {
        match self.own {
            Input::Constant(c) => Some(c),
            _ => None,
        }
    }

    /// The value where it is the same everywhere.
    pub fn even(&self) -> Option<R::Vec3> {
        self.constant().filter(|_| self.image.is_none())
    }
}

/// An image of directions about the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bump<R: Real> {
    pub image: Input<R>,
    /// Factor of the directions across the normal.
    pub scale: R,
}
