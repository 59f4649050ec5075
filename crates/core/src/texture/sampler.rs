//! Filtering of image textures: colour spaces, wrap modes, and nearest, bilinear and trilinear
//! filters.

use std::sync::LazyLock;

use raywright_bvh::{Real, Vector, prefetch};

use crate::display::curve::decode_transfer;
use crate::scene::{
    ColourSpace, ImageData, PixelData, Texture, TextureFilter, TextureRef, TransferCurve, WrapMode,
};

/// Sampling state of a texture use (a texture as one material input reads it): colour space,
/// filter, wrap modes, transform of the coordinates, and factor on the colour.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextureSampler<R: Real> {
    srgb: bool,
    filter: TextureFilter,
    wrap: [WrapMode; 2],
    transform: Option<[[R; 3]; 2]>,
    factor: R::Vec3,
}

/// Area of an image that a texture lookup averages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilterFootprint<'a, R> {
    /// Mipmap levels of the image from level 1; empty for a lookup in the full-size image.
    pub levels: &'a [ImageData],
    /// Edge of the area, a square, in texture coordinates before their transform.
    pub side: R,
}

impl<R: Real> TextureSampler<R> {
    /// Creates the sampler of a texture use.
    pub fn new(texture: &Texture, reference: &TextureRef) -> Self {
        Self {
            srgb: texture.colour_space == ColourSpace::Srgb,
            filter: texture.filter,
            wrap: [texture.wrap_u, texture.wrap_v],
            transform: reference
                .uv_transform
                .map(|m| m.map(|row| row.map(R::from_f64))),
            factor: R::Vec3::from_f64(reference.factor.0.into()),
        }
    }

    /// Returns the filtered texel of an image: linear red, green and blue times the factor, then
    /// alpha.
    pub fn sample(
        &self,
        image: &ImageData,
        codes: &TexelDecoder<R>,
        coordinates: [R; 2],
        footprint: FilterFootprint<'_, R>,
    ) -> [R; 4] {
        match footprint.levels {
            [] => {
                self.apply_factor(self.sample_level(image, codes, self.transform_uv(coordinates)))
            }
            _ => self.apply_factor(self.sample_mipmaps(
                image,
                codes,
                self.transform_uv(coordinates),
                footprint,
            )),
        }
    }

    /// Returns the filtered texel of [`Self::sample`] in the full-size image, for a footprint from
    /// [`Self::texel_footprint`].
    #[inline(always)]
    pub fn sample_at_footprint(
        &self,
        image: &ImageData,
        codes: &TexelDecoder<R>,
        place: &TexelFootprint<R>,
    ) -> [R; 4] {
        self.apply_factor(self.filter_texels(image, codes, place))
    }

    /// Returns the texel footprint of texture coordinates in an image. Samplers for which
    /// [`Self::has_same_footprint`] holds have the same footprint in all images of equal size.
    #[inline(always)]
    pub fn texel_footprint(&self, image: &ImageData, coordinates: [R; 2]) -> TexelFootprint<R> {
        self.footprint_at_uv(image, self.transform_uv(coordinates))
    }

    /// Whether two samplers have the same texel footprint in images of equal size.
    pub fn has_same_footprint(&self, other: &Self) -> bool {
        let nearest = |sampler: &Self| sampler.filter == TextureFilter::Nearest;
        nearest(self) == nearest(other)
            && self.wrap == other.wrap
            && self.transform == other.transform
    }

    /// Multiplies a texel's colour by the factor of the texture use. Alpha is unchanged.
    #[inline(always)]
    fn apply_factor(&self, [r, g, b, a]: [R; 4]) -> [R; 4] {
        [
            r * self.factor.x(),
            g * self.factor.y(),
            b * self.factor.z(),
            a,
        ]
    }

    /// Applies the coordinate transform of the texture use.
    #[inline(always)]
    fn transform_uv(&self, [u, v]: [R; 2]) -> [R; 2] {
        match self.transform {
            Some([[a, b, c], [d, e, f]]) => [a * u + b * v + c, d * u + e * v + f],
            None => [u, v],
        }
    }

    /// Interpolates between two mipmap levels: the coarsest level whose texels are at most as large
    /// as the footprint, and the next coarser level. Footprints smaller than a texel read the
    /// full-size image.
    #[inline(never)]
    fn sample_mipmaps(
        &self,
        image: &ImageData,
        codes: &TexelDecoder<R>,
        coordinates: [R; 2],
        footprint: FilterFootprint<'_, R>,
    ) -> [R; 4] {
        let level = self.mipmap_level(image, footprint.side.to_f64());
        if level <= 0.0 {
            return self.sample_level(image, codes, coordinates);
        }
        let last = footprint.levels.len();
        let at = |level: usize| match level.min(last) {
            0 => self.sample_level(image, codes, coordinates),
            reduced => self.sample_level(&footprint.levels[reduced - 1], codes, coordinates),
        };
        let finer = level.min(last as f64) as usize;
        let share = level - finer as f64;
        if finer == last || share == 0.0 {
            at(finer)
        } else {
            lerp_texels(at(finer), at(finer + 1), R::from_f64(share))
        }
    }

    /// Returns the fractional mipmap level whose texels have the area of a square footprint with
    /// edge `side`; −∞ for an empty footprint (Akenine-Möller et al., "Texture Level of Detail
    /// Strategies for Real-Time Ray Tracing", 2019, equation 20.3 and following).
    fn mipmap_level(&self, image: &ImageData, side: f64) -> f64 {
        let stretch = self
            .transform
            .map_or(1.0, |[[a, b, _], [d, e, _]]| (a * e - b * d).to_f64().abs());
        let texels = side * side * stretch * f64::from(image.width) * f64::from(image.height);
        if texels > 0.0 {
            0.5 * libm::log2(texels)
        } else {
            f64::NEG_INFINITY
        }
    }

    /// Returns the filtered texel of one image at transformed coordinates. The image is the
    /// full-size image or a mipmap level.
    fn sample_level(
        &self,
        image: &ImageData,
        codes: &TexelDecoder<R>,
        coordinates: [R; 2],
    ) -> [R; 4] {
        self.filter_texels(image, codes, &self.footprint_at_uv(image, coordinates))
    }

    /// Returns the texel footprint at transformed texture coordinates.
    #[inline(always)]
    fn footprint_at_uv(&self, image: &ImageData, [u, v]: [R; 2]) -> TexelFootprint<R> {
        let (columns, x) = self.texels_around(u.to_f64(), image.width, self.wrap[0]);
        let (rows, y) = self.texels_around(v.to_f64(), image.height, self.wrap[1]);
        TexelFootprint {
            columns,
            rows,
            weights: [R::from_f64(x), R::from_f64(y)],
        }
    }

    /// Returns the two texels around a transformed texture coordinate along one axis, and the weight
    /// of the second.
    #[inline(always)]
    fn texels_around(&self, u: f64, size: u32, wrap: WrapMode) -> ([u32; 2], f64) {
        let x = texel_coordinate(u, size, wrap);
        let x = if self.filter == TextureFilter::Nearest {
            x
        } else {
            x - 0.5
        };
        // The position has few digits, so that an integer holds its floor.
        let whole = x as i64;
        let first = whole - i64::from(whole as f64 > x);
        let texels = if first >= 0 && first + 1 < i64::from(size) {
            [first as u32, first as u32 + 1]
        } else {
            [first, first + 1].map(|texel| wrap_texel_index(texel, size, wrap))
        };
        (texels, x - first as f64)
    }

    /// Loads and interpolates the texels of a footprint. All four texels are loaded before the
    /// first is used: they are rarely in the cache.
    #[inline(always)]
    fn filter_texels(
        &self,
        image: &ImageData,
        codes: &TexelDecoder<R>,
        place: &TexelFootprint<R>,
    ) -> [R; 4] {
        let corners = place.corners(image);
        if self.filter == TextureFilter::Nearest {
            return decode_texel(image, codes, self.srgb, corners[0]);
        }
        let [fx, fy] = place.weights;
        let corners = match &image.pixels {
            PixelData::Linear(pixels) => corners.map(|position| pixels[position].map(R::from_f32)),
            PixelData::Codes(pixels) => {
                let found = corners.map(|position| pixels[position]);
                // Most of a map of emission is black.
                if found == [[0, 0, 0, u8::MAX]; 4] {
                    return [R::ZERO, R::ZERO, R::ZERO, R::ONE];
                }
                let [a, b, c, d] = found;
                if a[3] & b[3] & c[3] & d[3] == u8::MAX {
                    let texel = |code| codes.decode_opaque(code, self.srgb);
                    let upper = lerp_channels(texel(a), texel(b), fx);
                    let [r, g, b, _] =
                        lerp_channels(upper, lerp_channels(texel(c), texel(d), fx), fy);
                    return [r, g, b, R::ONE];
                }
                found.map(|code| codes.decode(code, self.srgb))
            }
        };
        let [upper_left, upper_right, lower_left, lower_right] = corners;
        lerp_texels(
            lerp_texels(upper_left, upper_right, fx),
            lerp_texels(lower_left, lower_right, fx),
            fy,
        )
    }
}

/// The four texels around a point of an image, and the weights of their bilinear interpolation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelFootprint<R> {
    /// Left and right column.
    columns: [u32; 2],
    /// Upper and lower row.
    rows: [u32; 2],
    /// Weights in [0, 1): of the right texels against the left, and of the lower texels against the
    /// upper.
    weights: [R; 2],
}

impl<R: Real> TexelFootprint<R> {
    /// Returns the indices of the upper left, upper right, lower left and lower right texel.
    #[inline(always)]
    fn corners(&self, image: &ImageData) -> [usize; 4] {
        let [left, right] = self.columns.map(|column| column as usize);
        let [top, bottom] = self.rows.map(|row| row as usize * image.width as usize);
        [top + left, top + right, bottom + left, bottom + right]
    }

    /// Prefetches the two left texels. The right texels mostly lie in the same cache lines.
    #[inline(always)]
    pub fn prefetch(&self, image: &ImageData) {
        let [upper, _, lower, _] = self.corners(image);
        match &image.pixels {
            PixelData::Linear(pixels) => [upper, lower].map(|corner| prefetch(pixels, corner)),
            PixelData::Codes(pixels) => [upper, lower].map(|corner| prefetch(pixels, corner)),
        };
    }
}

/// Tables of the linear values of 8-bit codes.
#[derive(Clone, Debug)]
pub(crate) struct TexelDecoder<R> {
    /// Values of linear codes: the code divided by 255.
    linear: [R; 256],
    /// Values of sRGB codes.
    srgb: [R; 256],
}

impl<R: Real> TexelDecoder<R> {
    pub fn new() -> Self {
        let share = |code: usize| code as f64 / 255.0;
        Self {
            linear: core::array::from_fn(|code| R::from_f64(share(code))),
            srgb: core::array::from_fn(|code| {
                R::from_f64(decode_transfer(TransferCurve::Srgb, share(code)))
            }),
        }
    }

    /// Converts a pixel's codes to linear values. Alpha is always a linear code.
    #[inline(always)]
    fn decode(&self, code: [u8; 4], srgb: bool) -> [R; 4] {
        let [r, g, b, _] = self.decode_opaque(code, srgb);
        [r, g, b, self.linear[usize::from(code[3])]]
    }

    /// Converts as [`Self::decode`] does a pixel whose alpha is one.
    #[inline(always)]
    fn decode_opaque(&self, [r, g, b, _]: [u8; 4], srgb: bool) -> [R; 4] {
        let colours = if srgb { &self.srgb } else { &self.linear };
        let colour = |code: u8| colours[usize::from(code)];
        [colour(r), colour(g), colour(b), R::ONE]
    }
}

impl<R: Real> Default for TexelDecoder<R> {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns a pixel of an image as linear values. `srgb` matters only for pixels stored as 8-bit
/// codes.
#[inline(always)]
pub(super) fn decode_texel<R: Real>(
    image: &ImageData,
    codes: &TexelDecoder<R>,
    srgb: bool,
    position: usize,
) -> [R; 4] {
    match &image.pixels {
        PixelData::Linear(pixels) => pixels[position].map(R::from_f32),
        PixelData::Codes(pixels) => codes.decode(pixels[position], srgb),
    }
}

/// Interpolates between two texels. `weight` is the weight of the second texel, from 0 to 1.
#[inline(always)]
fn lerp_texels<R: Real>(a: [R; 4], b: [R; 4], weight: R) -> [R; 4] {
    let [red, green, blue, alpha] = lerp_channels(a, b, weight);
    // Rounding must not move alpha beyond the range of the two texels, because an alpha mask
    // compares alpha with a cutoff.
    let alpha = Real::clamp(alpha, Real::min(a[3], b[3]), Real::max(a[3], b[3]));
    [red, green, blue, alpha]
}

/// Interpolates as [`lerp_texels`] does, each channel by itself.
#[inline(always)]
fn lerp_channels<R: Real>(a: [R; 4], b: [R; 4], weight: R) -> [R; 4] {
    let (mut out, rest) = (a, R::ONE - weight);
    for (out, b) in out.iter_mut().zip(b) {
        *out = *out * rest + b * weight;
    }
    out
}

/// Converts a texture coordinate to a position in texels.
///
/// Whole repetitions of a repeating image are removed first: large coordinates keep their
/// precision. NaN and infinity become the first texel. All precisions compute in `f64`: an `f32`
/// just below a border between texels stays below it.
#[inline(always)]
fn texel_coordinate(u: f64, size: u32, wrap: WrapMode) -> f64 {
    if !u.is_finite() {
        return 0.0;
    }
    let size = f64::from(size);
    if (0.0..1.0).contains(&u) {
        return u * size;
    }
    match wrap {
        WrapMode::Repeat => fractional_part(u) * size,
        WrapMode::MirroredRepeat => fractional_part(u * 0.5) * 2.0 * size,
        WrapMode::Clamp => u.clamp(-1.0, 2.0) * size,
    }
}

/// Returns the fraction u − ⌊u⌋, kept below 1 even where the difference rounds to 1.
#[inline(always)]
fn fractional_part(u: f64) -> f64 {
    (u - Real::floor(u)).min(1.0_f64.next_down())
}

/// Returns the index in 0..size of a texel under the wrap mode. The index is valid for every
/// rounding of the position.
#[inline(always)]
fn wrap_texel_index(i: i64, size: u32, wrap: WrapMode) -> u32 {
    let n = i64::from(size);
    // Whole repetitions of the image are already removed from the coordinate, so at most a single
    // repetition remains and no division is needed.
    let turned = |i: i64, n: i64| {
        if i < 0 {
            i + n
        } else if i >= n {
            i - n
        } else {
            i
        }
    };
    let i = match wrap {
        WrapMode::Repeat => turned(i, n),
        WrapMode::MirroredRepeat => {
            let k = turned(i, 2 * n);
            if k < n { k } else { 2 * n - 1 - k }
        }
        WrapMode::Clamp => i.clamp(0, n - 1),
    };
    i as u32
}

/// Returns the linear value of an sRGB code.
pub(crate) fn decode_srgb(code: u8) -> f64 {
    static CODES: LazyLock<TexelDecoder<f64>> = LazyLock::new(TexelDecoder::new);
    CODES.srgb[usize::from(code)]
}

#[cfg(test)]
mod tests;
