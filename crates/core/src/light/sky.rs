//! The sky: radiance by direction.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::shapes::equirectangular;
use raywright_bvh::{Real, Vector, prefetch};

use crate::expr::{Inputs, Programs, Scope, compile};
use crate::lookup::Lookup;
use crate::prepare::PrepareError;
use crate::prepare::texture::decoded;
use crate::scene::{ColourInput, ImageData, Pixels, Scene, Sky as SkyData};

/// What a ray sees that hits nothing.
#[derive(Clone, Debug)]
pub struct Sky<R: Real> {
    pub(super) kind: Kind<R>,
}

#[derive(Clone, Debug)]
pub(super) enum Kind<R: Real> {
    /// No sky: black.
    None,
    Constant(R::Vec3),
    Gradient {
        bottom: R::Vec3,
        top: R::Vec3,
        suns: Vec<Sun<R>>,
    },
    /// Of one program.
    Expression(Programs<R>),
    Map(Map<R>),
}

/// A lobe around a direction.
#[derive(Clone, Debug)]
pub(super) struct Sun<R: Real> {
    pub direction: R::Vec3,
    pub colour: R::Vec3,
    pub exponent: u32,
}

/// An equirectangular picture.
#[derive(Clone, Debug)]
pub(super) struct Map<R: Real> {
    pub image: Arc<ImageData>,
    /// Its texels in a quarter of the bytes, where all of them are the same then, as those of an .hdr file are; empty otherwise. Sky
    /// lookups go anywhere, and what they cost is reaching memory.
    packed: Vec<[u8; 4]>,
    /// Share of a whole turn by which the picture is turned about +y.
    pub turn: R,
    pub strength: R,
}

/// The sky of a scene, black where it has none.
pub(crate) fn prepare<R: Real>(
    scene: &Scene,
    lookup: &Lookup<'_>,
    names: &BTreeMap<String, f64>,
) -> Result<Sky<R>, PrepareError> {
    let v = |c: crate::scene::Colour| R::Vec3::from_f64(c.0.into());
    let kind = match &scene.sky {
        None => Kind::None,
        Some(SkyData::Constant(c)) => Kind::Constant(v(*c)),
        Some(SkyData::Gradient { bottom, top, suns }) => {
            let suns = suns.iter().map(|s| Sun {
                direction: R::Vec3::from_f64(DVec3::from(s.direction).normalize()),
                colour: R::Vec3::from_f64(DVec3::from(s.colour.0) * s.weight),
                exponent: s.exponent,
            });
            Kind::Gradient { bottom: v(*bottom), top: v(*top), suns: suns.collect() }
        }
        Some(SkyData::Expression(ColourInput::Expression(text))) => {
            let failed = |source| PrepareError::Expression { path: "sky.expression".to_owned(), source };
            Kind::Expression(Programs::of(&compile(text, names, Scope::Sky).map_err(failed)?))
        }
        Some(SkyData::Expression(ColourInput::Constant(c))) => Kind::Constant(v(*c)),
        // Validation has said that a sky has no surface for these.
        Some(SkyData::Expression(ColourInput::Texture(_) | ColourInput::Checker(_))) => Kind::None,
        Some(SkyData::Map(map)) => {
            let image = lookup.image(&map.image);
            let missing = || PrepareError::Missing { path: "sky.map.image".to_owned(), kind: "image", name: map.image.clone() };
            match &image.ok_or_else(missing)?.data {
                Some(image) => {
                    Kind::Map(Map::new(Arc::clone(image), R::from_f64(map.rotation / 360.0), R::from_f64(map.strength)))
                }
                None => Kind::None,
            }
        }
    };
    Ok(Sky { kind })
}

impl<R: Real> Sky<R> {
    /// Whether it gives no light at all.
    pub fn is_black(&self) -> bool {
        matches!(self.kind, Kind::None)
    }

    /// The picture that it shows, if it is one.
    pub(crate) fn image(&self) -> Option<&Arc<ImageData>> {
        if let Kind::Map(map) = &self.kind { Some(&map.image) } else { None }
    }

    /// Bytes of what is kept besides the picture.
    pub(crate) fn bytes(&self) -> u64 {
        if let Kind::Map(map) = &self.kind { size_of_val(map.packed.as_slice()) as u64 } else { 0 }
    }

    /// Where a direction lies in the sky's picture, from 0 to 1 each way; nothing of use where it is none. Told once to whoever asks
    /// there for radiance and density.
    #[inline(always)]
    pub fn place(&self, d: R::Vec3) -> [R; 2] {
        if let Kind::Map(_) = &self.kind { equirectangular::<R>(d) } else { [R::ZERO; 2] }
    }

    /// Has what the picture holds at a [`Self::place`] brought near.
    #[inline(always)]
    pub fn prefetch(&self, place: [R; 2]) {
        if let Kind::Map(map) = &self.kind {
            map.prefetch(place);
        }
    }

    /// Radiance along a unit direction, seen from an origin.
    #[inline(always)]
    pub fn radiance(&self, origin: R::Vec3, d: R::Vec3) -> R::Vec3 {
        self.radiance_at(origin, d, self.place(d))
    }

    /// The same of a direction that has this [`Self::place`].
    #[inline(always)]
    pub fn radiance_at(&self, origin: R::Vec3, d: R::Vec3, place: [R; 2]) -> R::Vec3 {
        match &self.kind {
            Kind::None => R::Vec3::ZERO,
            Kind::Constant(c) => *c,
            Kind::Gradient { bottom, top, suns } => {
                let s = R::from_f64(0.5) * (d.y() + R::ONE);
                let mut sky = *bottom * (R::ONE - s) + *top * s;
                for sun in suns {
                    let g = d.dot(sun.direction).max(R::ZERO);
                    sky += sun.colour * g.powi(sun.exponent);
                }
                sky
            }
            Kind::Expression(programs) => programs.vector(0, &Inputs::<R> { d, o: origin, ..Inputs::default() }),
            Kind::Map(map) => map.radiance(place),
        }
    }
}

impl<R: Real> Map<R> {
    /// Of a picture, turned and weighed.
    pub fn new(image: Arc<ImageData>, turn: R, strength: R) -> Self {
        let packed = match &image.pixels {
            Pixels::Linear(pixels) => pixels.iter().map(|&[r, g, b, _]| packed([r, g, b])).collect(),
            Pixels::Codes(_) => None,
        };
        Self { packed: packed.unwrap_or_default(), image, turn, strength }
    }

    /// What the picture holds, before its strength.
    #[inline(always)]
    pub fn texel(&self, x: usize, y: usize) -> R::Vec3 {
        let i = y * self.image.width as usize + x;
        if let Some(&texel) = self.packed.get(i) {
            let [r, g, b] = unpacked(texel).map(R::from_f32);
            return R::Vec3::new(r, g, b);
        }
        let [r, g, b, _] = match &self.image.pixels {
            Pixels::Linear(p) => p[i].map(R::from_f32),
            Pixels::Codes(p) => p[i].map(|code| R::from_f64(decoded(code))),
        };
        R::Vec3::new(r, g, b)
    }

    /// Has the texels at a place brought near.
    #[inline(always)]
    fn prefetch(&self, [u, v]: [R; 2]) {
        let (left, top, ..) = self.corner([u, v]);
        for row in [top, top + 1] {
            let at = self.row(row) * self.image.width as usize + self.column(left);
            prefetch(&self.packed, at);
            if let Pixels::Linear(pixels) = &self.image.pixels
                && self.packed.is_empty()
            {
                prefetch(pixels, at);
            }
        }
    }

    /// Bilinear at a place of the picture, repeating around and clamped at the poles.
    fn radiance(&self, [u, v]: [R; 2]) -> R::Vec3 {
        let (left, top, [fx, fy]) = self.corner([u, v]);
        let at = |x: usize, y: usize| self.texel(x, y);
        let mix = |a: R::Vec3, b: R::Vec3, w: R| a * (R::ONE - w) + b * w;
        let (left, right, top, bottom) = (self.column(left), self.column(left + 1), self.row(top), self.row(top + 1));
        mix(mix(at(left, top), at(right, top), fx), mix(at(left, bottom), at(right, bottom), fx), fy) * self.strength
    }
}

impl<R: Real> Map<R> {
    /// The upper left one of the four texels around a place, and where the place lies between them.
    #[inline(always)]
    fn corner(&self, [u, v]: [R; 2]) -> (i64, i64, [R; 2]) {
        let half = R::from_f64(0.5);
        let u = u - self.turn;
        let x = (u - u.floor()) * R::from_f64(f64::from(self.image.width)) - half;
        let y = v * R::from_f64(f64::from(self.image.height)) - half;
        let (x0, y0) = (x.floor(), y.floor());
        (x0.to_f64() as i64, y0.to_f64() as i64, [x - x0, y - y0])
    }

    /// At most one turn away, so no division is needed.
    #[inline(always)]
    fn column(&self, x: i64) -> usize {
        let width = i64::from(self.image.width);
        (if x < 0 {
            x + width
        } else if x >= width {
            x - width
        } else {
            x
        }) as usize
    }

    #[inline(always)]
    fn row(&self, y: i64) -> usize {
        y.clamp(0, i64::from(self.image.height) - 1) as usize
    }
}

/// Most bytes that a sky keeps besides its picture.
pub(crate) fn packed_bytes(image: &Arc<ImageData>) -> u64 {
    if let Pixels::Linear(pixels) = &image.pixels { (pixels.len() * size_of::<[u8; 4]>()) as u64 } else { 0 }
}

/// Three mantissas of a byte and their common exponent, where that is what a colour is exactly (Ward, "Real Pixels", 1991).
fn packed(colour: [f32; 3]) -> Option<[u8; 4]> {
    let largest = colour.into_iter().fold(0.0_f32, f32::max);
    // Below this, the exponent has no room.
    if largest > 0.0 && largest < f32::MIN_POSITIVE * 256.0 {
        return None;
    }
    let exponent = (largest.to_bits() >> 23).saturating_sub(7).max(1);
    let unit = f32::from_bits(exponent << 23);
    let [r, g, b] = colour.map(|c| (c / unit) as u8);
    let texel = [r, g, b, u8::try_from(exponent).ok()?];
    // To the bit, so that minus zero and what is no number stay what they are.
    (unpacked(texel).map(f32::to_bits) == colour.map(f32::to_bits)).then_some(texel)
}

#[inline(always)]
fn unpacked([r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
    let unit = f32::from_bits(u32::from(exponent) << 23);
    [r, g, b].map(|mantissa| f32::from(mantissa) * unit)
}

#[cfg(test)]
mod tests;
