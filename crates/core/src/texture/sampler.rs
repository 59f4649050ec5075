//! Image textures: wrap modes, nearest, bilinear and trilinear filtering, colour spaces.

use std::sync::LazyLock;

use raywright_bvh::{Real, Vector, prefetch};

use crate::display::curve::decode;
use crate::scene::{
    ColourSpace, Filter, ImageData, Pixels, Texture, TextureRef, TransferCurve, Wrap,
};

/// Sampling of a texture use: its settings besides the image and the coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampler<R: Real> {
    srgb: bool,
    filter: Filter,
    wrap: [Wrap; 2],
    transform: Option<[[R; 3]; 2]>,
    factor: R::Vec3,
}

/// Footprint of a texture sample in its image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint<'a, R> {
    /// Mipmaps of the image; empty: the image alone is read.
    pub levels: &'a [ImageData],
    /// Edge of a square in texture coordinates, before the use's own map.
    pub side: R,
}

impl<R: Real> Sampler<R> {
    /// Prepares the sampling of a texture use.
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

    /// Returns the filtered texel of an image: linear red, green, blue times the factor, and alpha.
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

    /// Returns [`Self::texel`] of the full-size image, at its [`Self::place`].
    #[inline(always)]
    pub fn texel_at(
        &self,
        image: &ImageData,
        codes: &TexelCodes<R>,
        place: &TexelFootprint<R>,
    ) -> [R; 4] {
        self.weighed(self.read(image, codes, place))
    }

    /// Returns the texel footprint of texture coordinates in an image: equal for all images of
    /// equal size, under uses that [`Self::shares_footprint`] this one.
    #[inline(always)]
    pub fn place(&self, image: &ImageData, coordinates: [R; 2]) -> TexelFootprint<R> {
        self.place_of(image, self.mapped(coordinates))
    }

    /// Whether another use reads the same texels.
    pub fn shares_footprint(&self, other: &Self) -> bool {
        let nearest = |sampler: &Self| sampler.filter == Filter::Nearest;
        nearest(self) == nearest(other)
            && self.wrap == other.wrap
            && self.transform == other.transform
    }

    #[inline(always)]
    fn weighed(&self, [r, g, b, a]: [R; 4]) -> [R; 4] {
        [
            r * self.factor.x(),
            g * self.factor.y(),
            b * self.factor.z(),
            a,
        ]
    }

    /// Applies the use's own map to coordinates.
    #[inline(always)]
    fn mapped(&self, [u, v]: [R; 2]) -> [R; 2] {
        match self.transform {
            Some([[a, b, c], [d, e, f]]) => [a * u + b * v + c, d * u + e * v + f],
            None => [u, v],
        }
    }

    /// Interpolates between the two levels whose texels are as large as the footprint. For smaller
    /// footprints, and for images without an area, the result is that of the full-size image.
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

    /// Returns the fractional level whose texels have the area of a footprint (Akenine-Möller et
    /// al., "Texture Level of Detail Strategies for Real-Time Ray Tracing", 2019, equation 20.3 and
    /// following); −∞ for an empty footprint.
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

    fn filtered(&self, image: &ImageData, codes: &TexelCodes<R>, coordinates: [R; 2]) -> [R; 4] {
        self.read(image, codes, &self.place_of(image, coordinates))
    }

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

    /// All four texels are loaded before any is used, because they are rarely cached.
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

/// The four texels around a point of an image, and the position between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelFootprint<R> {
    /// Upper left and right, lower left and right, as indices of the pixels.
    corners: [usize; 4],
    /// Weights from left to right and from top to bottom, in [0, 1).
    weights: [R; 2],
}

impl<R> TexelFootprint<R> {
    /// Prefetches the texels. The right ones mostly share a cache line with the left ones.
    #[inline(always)]
    pub fn prefetch(&self, image: &ImageData) {
        let [upper, _, lower, _] = self.corners;
        match &image.pixels {
            Pixels::Linear(pixels) => [upper, lower].map(|corner| prefetch(pixels, corner)),
            Pixels::Codes(pixels) => [upper, lower].map(|corner| prefetch(pixels, corner)),
        };
    }
}

/// Numbers of the codes of an image.
#[derive(Clone, Debug)]
pub(crate) struct TexelCodes<R> {
    shares: [R; 256],
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

    /// Alpha is always linear in the code.
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

/// Returns a pixel of an image as linear numbers.
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

#[inline(always)]
fn blend<R: Real>([ar, ag, ab, aa]: [R; 4], [br, bg, bb, ba]: [R; 4], weight: R) -> [R; 4] {
    let one = |a: R, b: R| a * (R::ONE - weight) + b * weight;
    // An alpha mask compares alpha with its cutoff: between two texels, alpha never leaves their
    // range.
    let alpha = Real::clamp(one(aa, ba), Real::min(aa, ba), Real::max(aa, ba));
    [one(ar, br), one(ag, bg), one(ab, bb), alpha]
}

/// Converts a coordinate to texels. Whole turns of a repeating image are removed first, so that
/// large tile counts keep their precision; NaN and infinity read the first texel. Computed in f64
/// for every precision: an f32 just below a seam, or below a border between texels, stays below it.
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

/// Returns the coordinate without its whole turns, always below one, also where the difference
/// rounds to one.
#[inline(always)]
fn fraction(u: f64) -> f64 {
    (u - Real::floor(u)).min(1.0_f64.next_down())
}

/// Returns the index of a texel under the wrap mode. Whatever the rounding before, it lies in the
/// image.
#[inline(always)]
fn index(texel: f64, size: u32, wrap: Wrap) -> usize {
    let (i, n) = (texel as i64, i64::from(size));
    // Whole turns are already removed, so at most one remains: no division.
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

/// Returns an sRGB code as a linear number.
pub(crate) fn decoded(code: u8) -> f64 {
    static CODES: LazyLock<TexelCodes<f64>> = LazyLock::new(TexelCodes::new);
    CODES.srgb[usize::from(code)]
}

#[cfg(test)]
mod tests;
