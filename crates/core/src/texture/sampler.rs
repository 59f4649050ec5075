//! Filtering of image textures: wrap modes, nearest, bilinear and trilinear filters, colour spaces.

use std::sync::LazyLock;

use raywright_bvh::{Real, Vector, prefetch};

use crate::display::curve::decode;
use crate::scene::{
    ColourSpace, Filter, ImageData, Pixels, Texture, TextureRef, TransferCurve, Wrap,
};

/// Settings of a texture use: colour space, filter, wrap modes, transform of the coordinates, and
/// factor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampler<R: Real> {
    srgb: bool,
    filter: Filter,
    wrap: [Wrap; 2],
    transform: Option<[[R; 3]; 2]>,
    factor: R::Vec3,
}

/// Area of an image that a filtered texture sample covers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint<'a, R> {
    /// Mipmap levels of the image from level 1; empty if the image is read at full size.
    pub levels: &'a [ImageData],
    /// Edge of a square in texture coordinates, before the transform of the coordinates.
    pub side: R,
}

impl<R: Real> Sampler<R> {
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

    /// Returns the filtered texel of an image: linear red, green and blue times the factor, and
    /// alpha.
    pub fn texel(
        &self,
        image: &ImageData,
        codes: &TexelCodes<R>,
        coordinates: [R; 2],
        footprint: Footprint<'_, R>,
    ) -> [R; 4] {
        match footprint.levels {
            [] => self.weighed(self.filtered(image, codes, self.mapped(coordinates))),
            _ => self.weighed(self.seen_afar(image, codes, self.mapped(coordinates), footprint)),
        }
    }

    /// Returns the filtered texel of a full-size image at a footprint from [`Self::place`], as
    /// [`Self::texel`] does.
    #[inline(always)]
    pub fn texel_at(
        &self,
        image: &ImageData,
        codes: &TexelCodes<R>,
        place: &TexelFootprint<R>,
    ) -> [R; 4] {
        self.weighed(self.read(image, codes, place))
    }

    /// Returns the texel footprint of texture coordinates in an image. The footprint is equal for
    /// all images of equal size and all samplers for which [`Self::shares_footprint`] holds.
    #[inline(always)]
    pub fn place(&self, image: &ImageData, coordinates: [R; 2]) -> TexelFootprint<R> {
        self.place_of(image, self.mapped(coordinates))
    }

    /// Whether another sampler has the same footprint in an image of the same size.
    pub fn shares_footprint(&self, other: &Self) -> bool {
        let nearest = |sampler: &Self| sampler.filter == Filter::Nearest;
        nearest(self) == nearest(other)
            && self.wrap == other.wrap
            && self.transform == other.transform
    }

    /// Multiplies a texel's colour by the factor.
    #[inline(always)]
    fn weighed(&self, [r, g, b, a]: [R; 4]) -> [R; 4] {
        [
            r * self.factor.x(),
            g * self.factor.y(),
            b * self.factor.z(),
            a,
        ]
    }

    /// Applies the transform of the texture use to coordinates.
    #[inline(always)]
    fn mapped(&self, [u, v]: [R; 2]) -> [R; 2] {
        match self.transform {
            Some([[a, b, c], [d, e, f]]) => [a * u + b * v + c, d * u + e * v + f],
            None => [u, v],
        }
    }

    /// Interpolates between the two mipmap levels whose texels are next larger and next smaller
    /// than the footprint. Footprints smaller than a texel read the full-size image.
    #[inline(never)]
    fn seen_afar(
        &self,
        image: &ImageData,
        codes: &TexelCodes<R>,
        coordinates: [R; 2],
        footprint: Footprint<'_, R>,
    ) -> [R; 4] {
        let level = self.level(image, footprint.side.to_f64());
        if level <= 0.0 {
            return self.filtered(image, codes, coordinates);
        }
        let last = footprint.levels.len();
        let at = |level: usize| match level.min(last) {
            0 => self.filtered(image, codes, coordinates),
            reduced => self.filtered(&footprint.levels[reduced - 1], codes, coordinates),
        };
        let finer = level.min(last as f64) as usize;
        let share = level - finer as f64;
        if finer == last || share == 0.0 {
            at(finer)
        } else {
            blend(at(finer), at(finer + 1), R::from_f64(share))
        }
    }

    /// Returns the fractional mipmap level whose texels have the area of a square footprint with
    /// edge `side`; −∞ for an empty footprint (Akenine-Möller et al., "Texture Level of Detail
    /// Strategies for Real-Time Ray Tracing", 2019, equation 20.3 and following).
    fn level(&self, image: &ImageData, side: f64) -> f64 {
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

    /// Returns the filtered texel of a single mipmap level at transformed coordinates.
    fn filtered(&self, image: &ImageData, codes: &TexelCodes<R>, coordinates: [R; 2]) -> [R; 4] {
        self.read(image, codes, &self.place_of(image, coordinates))
    }

    /// Returns the texel footprint of transformed coordinates.
    #[inline(always)]
    fn place_of(&self, image: &ImageData, [u, v]: [R; 2]) -> TexelFootprint<R> {
        let x = scaled(u.to_f64(), image.width, self.wrap[0]);
        let y = scaled(v.to_f64(), image.height, self.wrap[1]);
        let (x, y) = if self.filter == Filter::Nearest {
            (x, y)
        } else {
            (x - 0.5, y - 0.5)
        };
        let (x0, y0) = (Real::floor(x), Real::floor(y));
        let column = |x: f64| index(x, image.width, self.wrap[0]);
        let row = |y: f64| index(y, image.height, self.wrap[1]) * image.width as usize;
        let (left, right, top, bottom) = (column(x0), column(x0 + 1.0), row(y0), row(y0 + 1.0));
        TexelFootprint {
            corners: [top + left, top + right, bottom + left, bottom + right],
            weights: [R::from_f64(x - x0), R::from_f64(y - y0)],
        }
    }

    /// Loads the texels of a footprint and interpolates them. All four texels are loaded before the
    /// first is used, because they are rarely cached.
    #[inline(always)]
    fn read(&self, image: &ImageData, codes: &TexelCodes<R>, place: &TexelFootprint<R>) -> [R; 4] {
        if self.filter == Filter::Nearest {
            return texel(image, codes, self.srgb, place.corners[0]);
        }
        let [upper_left, upper_right, lower_left, lower_right] = match &image.pixels {
            Pixels::Linear(pixels) => place
                .corners
                .map(|position| pixels[position].map(R::from_f32)),
            Pixels::Codes(pixels) => place
                .corners
                .map(|position| pixels[position])
                .map(|code| codes.linear(code, self.srgb)),
        };
        let [fx, fy] = place.weights;
        blend(
            blend(upper_left, upper_right, fx),
            blend(lower_left, lower_right, fx),
            fy,
        )
    }
}

/// The four texels around a point of an image, and the weights of their interpolation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelFootprint<R> {
    /// Indices of the upper left, upper right, lower left and lower right pixel.
    corners: [usize; 4],
    /// Weights of the right and of the lower texels, in [0, 1).
    weights: [R; 2],
}

impl<R> TexelFootprint<R> {
    /// Prefetches the left texels. The right texels mostly lie in the same cache lines.
    #[inline(always)]
    pub fn prefetch(&self, image: &ImageData) {
        let [upper, _, lower, _] = self.corners;
        match &image.pixels {
            Pixels::Linear(pixels) => [upper, lower].map(|corner| prefetch(pixels, corner)),
            Pixels::Codes(pixels) => [upper, lower].map(|corner| prefetch(pixels, corner)),
        };
    }
}

/// Linear values of the 8-bit codes 0 to 255.
#[derive(Clone, Debug)]
pub(crate) struct TexelCodes<R> {
    /// Values of linear codes: code / 255.
    shares: [R; 256],
    /// Values of sRGB codes.
    srgb: [R; 256],
}

impl<R: Real> TexelCodes<R> {
    pub fn new() -> Self {
        let share = |code: usize| code as f64 / 255.0;
        Self {
            shares: core::array::from_fn(|code| R::from_f64(share(code))),
            srgb: core::array::from_fn(|code| {
                R::from_f64(decode(TransferCurve::Srgb, share(code)))
            }),
        }
    }

    /// Converts a pixel's codes to linear values. Alpha is always linear in its code.
    #[inline(always)]
    fn linear(&self, [r, g, b, a]: [u8; 4], srgb: bool) -> [R; 4] {
        let colours = if srgb { &self.srgb } else { &self.shares };
        let at = |table: &[R; 256], code: u8| table[usize::from(code)];
        [
            at(colours, r),
            at(colours, g),
            at(colours, b),
            at(&self.shares, a),
        ]
    }
}

impl<R: Real> Default for TexelCodes<R> {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns a pixel of an image as linear values; `srgb` applies to pixels stored as codes.
#[inline(always)]
pub(super) fn texel<R: Real>(
    image: &ImageData,
    codes: &TexelCodes<R>,
    srgb: bool,
    position: usize,
) -> [R; 4] {
    match &image.pixels {
        Pixels::Linear(pixels) => pixels[position].map(R::from_f32),
        Pixels::Codes(pixels) => codes.linear(pixels[position], srgb),
    }
}

/// Interpolates between two texels; `weight` is that of the second.
#[inline(always)]
fn blend<R: Real>([ar, ag, ab, aa]: [R; 4], [br, bg, bb, ba]: [R; 4], weight: R) -> [R; 4] {
    let one = |a: R, b: R| a * (R::ONE - weight) + b * weight;
    // Alpha stays within the range of the two texels in spite of rounding, because an alpha mask
    // compares it with a cutoff.
    let alpha = Real::clamp(one(aa, ba), Real::min(aa, ba), Real::max(aa, ba));
    [one(ar, br), one(ag, bg), one(ab, bb), alpha]
}

/// Converts a texture coordinate to a position in texels. The whole repetitions of a repeating
/// image are removed first, so that large coordinates keep their precision. NaN and infinity become
/// the first texel. The computation is in `f64` for every precision, so that an `f32` just below a
/// border between texels stays below the border.
#[inline(always)]
fn scaled(u: f64, size: u32, wrap: Wrap) -> f64 {
    if !u.is_finite() {
        return 0.0;
    }
    let size = f64::from(size);
    match wrap {
        Wrap::Repeat => fraction(u) * size,
        Wrap::MirroredRepeat => fraction(u * 0.5) * 2.0 * size,
        Wrap::Clamp => u.clamp(-1.0, 2.0) * size,
    }
}

/// Returns the fraction u − ⌊u⌋, always below 1, even if the difference rounds to 1.
#[inline(always)]
fn fraction(u: f64) -> f64 {
    (u - Real::floor(u)).min(1.0_f64.next_down())
}

/// Returns the index in 0..size of a texel under the wrap mode. The index lies in the image for
/// every rounding of the position.
#[inline(always)]
fn index(texel: f64, size: u32, wrap: Wrap) -> usize {
    let (i, n) = (texel as i64, i64::from(size));
    // Whole repetitions are already removed, so at most one remains and no division is needed.
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
        Wrap::Repeat => turned(i, n),
        Wrap::MirroredRepeat => {
            let k = turned(i, 2 * n);
            if k < n { k } else { 2 * n - 1 - k }
        }
        Wrap::Clamp => i.clamp(0, n - 1),
    };
    i as usize
}

/// Returns the linear value of an sRGB code.
pub(crate) fn decoded(code: u8) -> f64 {
    static CODES: LazyLock<TexelCodes<f64>> = LazyLock::new(TexelCodes::new);
    CODES.srgb[usize::from(code)]
}

#[cfg(test)]
mod tests;
