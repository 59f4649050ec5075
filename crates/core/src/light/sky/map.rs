//! Environment map of a sky: radiance by direction, for a single ray or for many.

use std::sync::Arc;

use raywright_bvh::shapes::equirectangular_coordinates;
use raywright_bvh::{Real, SimdTask, Vector, run_widest};

use super::{DirectionBatch, LANES, SkySample, for_each_direction_batch};
use crate::scene::{ImageData, PixelData};
use crate::texture::decode_srgb;

/// An equirectangular environment map.
#[derive(Clone, Debug)]
pub struct EquirectMap<R: Real> {
    pub image: Arc<ImageData>,
    /// Texels packed as RGBE, a quarter of the bytes: memory access dominates the cost of
    /// incoherent lookups. Empty if packing would change a colour; it changes none in `.hdr` files.
    pub packed_texels: Vec<u32>,
    /// Rotation of the image about +y, in revolutions.
    pub turn: R,
    pub strength: R,
}

impl<R: Real> EquirectMap<R> {
    /// Creates a map from an image. `turn` is its rotation about +y in revolutions, `strength` a
    /// factor on its radiance.
    pub fn new(image: Arc<ImageData>, turn: R, strength: R) -> Self {
        let packed = match &image.pixels {
            PixelData::Linear(pixels) => pixels
                .iter()
                .map(|&[r, g, b, _]| pack_rgbe([r, g, b]))
                .collect(),
            PixelData::Codes(_) => None,
        };
        Self {
            packed_texels: packed.unwrap_or_default(),
            image,
            turn,
            strength,
        }
    }

    /// Returns the radiance of a texel, without the factor `strength`.
    #[inline(always)]
    pub fn texel(&self, x: usize, y: usize) -> R::Vec3 {
        self.decode_texel(y * self.image.width as usize + x)
    }

    #[inline(always)]
    fn decode_texel(&self, index: usize) -> R::Vec3 {
        let [r, g, b, _] = match &self.image.pixels {
            PixelData::Linear(p) => p[index].map(R::from_f32),
            PixelData::Codes(p) => p[index].map(|code| R::from_f64(decode_srgb(code))),
        };
        R::Vec3::new(r, g, b)
    }

    /// Returns the bilinearly filtered radiance at image coordinates in [0, 1]. The image repeats
    /// in azimuth and is clamped at the poles.
    pub fn radiance(&self, [u, v]: [R; 2]) -> R::Vec3 {
        let [[r], [g], [b]] = self.eval_lanes([&[u], &[v]]);
        R::Vec3::new(r, g, b)
    }

    /// Returns the radiance of [`Self::radiance`] at `N` image coordinates, by channel.
    #[inline(always)]
    fn eval_lanes<const N: usize>(&self, [u, v]: [&[R; N]; 2]) -> [[R; N]; 3] {
        let half = R::from_f64(0.5);
        let (width, height) = (self.image.width as i32, self.image.height as i32);
        let (across, down) = (
            R::from_f64(f64::from(width)),
            R::from_f64(f64::from(height)),
        );
        let (mut fx, mut fy, mut corners) = ([R::ZERO; N], [R::ZERO; N], [[0; N]; 4]);
        for i in 0..N {
            let u = u[i] - self.turn;
            let (x, y) = ((u - u.floor()) * across - half, v[i] * down - half);
            let (x0, y0) = (x.floor(), y.floor());
            (fx[i], fy[i]) = (x - x0, y - y0);
            let (left, top) = (x0.to_f64() as i32, y0.to_f64() as i32);
            // The column is at most one turn outside the image, so no division is needed.
            let column = |x: i32| {
                (if x < 0 { x + width } else { x } - if x >= width { width } else { 0 }) as u32
            };
            let row = |y: i32| y.clamp(0, height - 1) as u32 * width as u32;
            let (left, right, top, bottom) = (
                column(left),
                column(left + 1),
                row(top),
                row(top.saturating_add(1)),
            );
            [corners[0][i], corners[1][i], corners[2][i], corners[3][i]] =
                [top + left, top + right, bottom + left, bottom + right];
        }
        let mut texels = [[[R::ZERO; N]; 3]; 4];
        for (texels, places) in texels.iter_mut().zip(&corners) {
            self.fetch_texels(places, texels);
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

    /// Appends the radiance and image coordinates of many unit directions in order.
    pub fn eval_directions(
        &self,
        directions: impl Iterator<Item = R::Vec3>,
        out: &mut Vec<SkySample<R>>,
    ) {
        for_each_direction_batch::<R>(directions, |directions, count| {
            let [u, v, r, g, b] = run_widest(MapLookupTask {
                map: self,
                directions,
            });
            out.extend((0..count).map(|i| SkySample {
                image_coordinates: [u[i], v[i]],
                radiance: R::Vec3::new(r[i], g[i], b[i]),
            }));
        });
    }

    /// Loads the texels at the indices `places` of the image, by channel, without the factor
    /// `strength`.
    #[inline(always)]
    fn fetch_texels<const N: usize>(&self, places: &[u32; N], out: &mut [[R; N]; 3]) {
        if self.packed_texels.is_empty() {
            for (i, &index) in places.iter().enumerate() {
                let texel = self.decode_texel(index as usize);
                (out[0][i], out[1][i], out[2][i]) = (texel.x(), texel.y(), texel.z());
            }
            return;
        }
        let mut texels = [0; N];
        for (texel, &index) in texels.iter_mut().zip(places) {
            *texel = self.packed_texels[index as usize];
        }
        for (i, &texel) in texels.iter().enumerate() {
            let [r, g, b] = unpack_rgbe(texel);
            (out[0][i], out[1][i], out[2][i]) = (R::from_f32(r), R::from_f32(g), R::from_f32(b));
        }
    }
}

/// SIMD task: image coordinates and radiance of a batch of directions.
struct MapLookupTask<'a, R: Real> {
    map: &'a EquirectMap<R>,
    directions: &'a DirectionBatch<R>,
}

impl<R: Real> SimdTask for MapLookupTask<'_, R> {
    type Output = [[R; LANES]; 5];
    #[inline(always)]
    fn run(self) -> Self::Output {
        let (mut u, mut v) = ([R::ZERO; LANES], [R::ZERO; LANES]);
        let [x, y, z] = self.directions;
        for i in 0..LANES {
            [u[i], v[i]] = equirectangular_coordinates::<R>(R::Vec3::new(x[i], y[i], z[i]));
        }
        let [r, g, b] = self.map.eval_lanes([&u, &v]);
        [u, v, r, g, b]
    }
}

/// Packs a colour as RGBE: three mantissas of one byte, and a common exponent (Ward, "Real Pixels",
/// 1991). `None` if packing would change the colour.
pub fn pack_rgbe(colour: [f32; 3]) -> Option<u32> {
    let largest = colour.into_iter().fold(0.0_f32, f32::max);
    // Below this limit, the exponent underflows.
    if largest > 0.0 && largest < f32::MIN_POSITIVE * 256.0 {
        return None;
    }
    let exponent = (largest.to_bits() >> 23).saturating_sub(7).max(1);
    let unit = f32::from_bits(exponent << 23);
    let [r, g, b] = colour.map(|c| (c / unit) as u8);
    let texel = u32::from_le_bytes([r, g, b, u8::try_from(exponent).ok()?]);
    // Compared by bits, so that colours with minus zero or NaN are not packed.
    (unpack_rgbe(texel).map(f32::to_bits) == colour.map(f32::to_bits)).then_some(texel)
}

#[inline(always)]
pub fn unpack_rgbe(texel: u32) -> [f32; 3] {
    let unit = f32::from_bits(texel >> 24 << 23);
    let mantissa = |shift: u32| (texel >> shift & 255) as i32 as f32;
    [mantissa(0) * unit, mantissa(8) * unit, mantissa(16) * unit]
}
