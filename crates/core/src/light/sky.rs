//! The sky: radiance by direction.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::shapes::equirectangular;
use raywright_bvh::{Loops, Real, Vector, widest};

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

/// What a ray sees of the sky.
#[derive(Clone, Copy, Debug)]
pub struct Seen<R: Real> {
    /// Where that lies in its picture: see [`Sky::place`].
    pub place: [R; 2],
    /// Radiance.
    pub radiance: R::Vec3,
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
    packed: Vec<u32>,
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

    /// Radiance along a unit direction, seen from an origin.
    #[inline(always)]
    pub fn radiance(&self, origin: R::Vec3, d: R::Vec3) -> R::Vec3 {
        self.radiance_at(origin, d, self.place(d))
    }

    /// What many rays see, one after the other, with the [`Self::place`] of each: in less time than one by one.
    pub fn look(&self, rays: impl Iterator<Item = (R::Vec3, R::Vec3)>, out: &mut Vec<Seen<R>>) {
        let Kind::Map(map) = &self.kind else {
            out.extend(rays.map(|(origin, d)| Seen { place: [R::ZERO; 2], radiance: self.radiance(origin, d) }));
            return;
        };
        let mut rays = rays.fuse();
        loop {
            // What is looked along where no ray is left does not matter.
            let mut directions = [[R::ZERO; LANES]; 3];
            let mut count = 0;
            for (i, (_, d)) in (0..LANES).zip(&mut rays) {
                [directions[0][i], directions[1][i], directions[2][i]] = [d.x(), d.y(), d.z()];
                count += 1;
            }
            if count == 0 {
                return;
            }
            let [u, v, r, g, b] = widest(Look { map, directions: &directions });
            out.extend((0..count).map(|i| Seen { place: [u[i], v[i]], radiance: R::Vec3::new(r[i], g[i], b[i]) }));
        }
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
        self.stored(y * self.image.width as usize + x)
    }

    #[inline(always)]
    fn stored(&self, place: usize) -> R::Vec3 {
        let [r, g, b, _] = match &self.image.pixels {
            Pixels::Linear(p) => p[place].map(R::from_f32),
            Pixels::Codes(p) => p[place].map(|code| R::from_f64(decoded(code))),
        };
        R::Vec3::new(r, g, b)
    }

    /// Bilinear at a place of the picture, repeating around and clamped at the poles.
    fn radiance(&self, [u, v]: [R; 2]) -> R::Vec3 {
        let [[r], [g], [b]] = self.radiances([&[u], &[v]]);
        R::Vec3::new(r, g, b)
    }

    /// The same of several places.
    #[inline(always)]
    fn radiances<const N: usize>(&self, [u, v]: [&[R; N]; 2]) -> [[R; N]; 3] {
        let half = R::from_f64(0.5);
        let (width, height) = (self.image.width as i32, self.image.height as i32);
        let (across, down) = (R::from_f64(f64::from(width)), R::from_f64(f64::from(height)));
        let (mut fx, mut fy, mut corners) = ([R::ZERO; N], [R::ZERO; N], [[0; N]; 4]);
        for i in 0..N {
            let u = u[i] - self.turn;
            let (x, y) = ((u - u.floor()) * across - half, v[i] * down - half);
            let (x0, y0) = (x.floor(), y.floor());
            (fx[i], fy[i]) = (x - x0, y - y0);
            let (left, top) = (x0.to_f64() as i32, y0.to_f64() as i32);
            // At most one turn away, so no division is needed.
            let column = |x: i32| (if x < 0 { x + width } else { x } - if x >= width { width } else { 0 }) as u32;
            let row = |y: i32| y.clamp(0, height - 1) as u32 * width as u32;
            let (left, right, top, bottom) = (column(left), column(left + 1), row(top), row(top.saturating_add(1)));
            [corners[0][i], corners[1][i], corners[2][i], corners[3][i]] =
                [top + left, top + right, bottom + left, bottom + right];
        }
        let mut texels = [[[R::ZERO; N]; 3]; 4];
        for (texels, places) in texels.iter_mut().zip(&corners) {
            self.texels(places, texels);
        }
        let mut out = [[R::ZERO; N]; 3];
        for (channel, out) in out.iter_mut().enumerate() {
            for i in 0..N {
                let mix = |a: R, b: R, w: R| a * (R::ONE - w) + b * w;
                let upper = mix(texels[0][channel][i], texels[1][channel][i], fx[i]);
                let lower = mix(texels[2][channel][i], texels[3][channel][i], fx[i]);
                out[i] = mix(upper, lower, fy[i]) * self.strength;
            }
        }
        out
    }

    /// What the picture holds at places in its list of pixels, channel by channel.
    #[inline(always)]
    fn texels<const N: usize>(&self, places: &[u32; N], out: &mut [[R; N]; 3]) {
        if self.packed.is_empty() {
            for (i, &place) in places.iter().enumerate() {
                let texel = self.stored(place as usize);
                (out[0][i], out[1][i], out[2][i]) = (texel.x(), texel.y(), texel.z());
            }
            return;
        }
        let mut texels = [0; N];
        for (texel, &place) in texels.iter_mut().zip(places) {
            *texel = self.packed[place as usize];
        }
        for (i, &texel) in texels.iter().enumerate() {
            let [r, g, b] = unpacked(texel);
            (out[0][i], out[1][i], out[2][i]) = (R::from_f32(r), R::from_f32(g), R::from_f32(b));
        }
    }
}

/// Directions that are looked along side by side.
const LANES: usize = 16;

/// Places in a picture of directions, and what it holds there.
struct Look<'a, R: Real> {
    map: &'a Map<R>,
    directions: &'a [[R; LANES]; 3],
}

impl<R: Real> Loops for Look<'_, R> {
    type Output = [[R; LANES]; 5];
    #[inline(always)]
    fn run(self) -> Self::Output {
        let (mut u, mut v) = ([R::ZERO; LANES], [R::ZERO; LANES]);
        let [x, y, z] = self.directions;
        for i in 0..LANES {
            [u[i], v[i]] = equirectangular::<R>(R::Vec3::new(x[i], y[i], z[i]));
        }
        let [r, g, b] = self.map.radiances([&u, &v]);
        [u, v, r, g, b]
    }
}

/// Most bytes that a sky keeps besides its picture.
pub(crate) fn packed_bytes(image: &Arc<ImageData>) -> u64 {
    if let Pixels::Linear(pixels) = &image.pixels { (pixels.len() * size_of::<u32>()) as u64 } else { 0 }
}

/// Three mantissas of a byte and their common exponent, where that is what a colour is exactly (Ward, "Real Pixels", 1991).
fn packed(colour: [f32; 3]) -> Option<u32> {
    let largest = colour.into_iter().fold(0.0_f32, f32::max);
    // Below this, the exponent has no room.
    if largest > 0.0 && largest < f32::MIN_POSITIVE * 256.0 {
        return None;
    }
    let exponent = (largest.to_bits() >> 23).saturating_sub(7).max(1);
    let unit = f32::from_bits(exponent << 23);
    let [r, g, b] = colour.map(|c| (c / unit) as u8);
    let texel = u32::from_le_bytes([r, g, b, u8::try_from(exponent).ok()?]);
    // To the bit, so that minus zero and what is no number stay what they are.
    (unpacked(texel).map(f32::to_bits) == colour.map(f32::to_bits)).then_some(texel)
}

#[inline(always)]
fn unpacked(texel: u32) -> [f32; 3] {
    let unit = f32::from_bits(texel >> 24 << 23);
    let mantissa = |shift: u32| (texel >> shift & 255) as i32 as f32;
    [mantissa(0) * unit, mantissa(8) * unit, mantissa(16) * unit]
}

#[cfg(test)]
mod tests;
