//! Image textures: wrap modes, nearest, bilinear and trilinear filtering, colour spaces.

use std::sync::LazyLock;

use raywright_bvh::{Real, Vector, prefetch};

use crate::display::curve::decode;
use crate::scene::{
    ColourSpace, Filter, ImageData, Pixels, Texture, TextureRef, TransferCurve, Wrap,
};

/// How texels are found and read: what a use of a texture says besides its image and where on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampler<R: Real> {
    srgb: bool,
    filter: Filter,
    wrap: [Wrap; 2],
    transform: Option<[[R; 3]; 2]>,
    factor: R::Vec3,
}

/// What of an image a sample is to stand for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint<'a, R> {
    /// The image's mip maps; empty: the image alone is read.
    pub levels: &'a [ImageData],
    /// Side of a square of texture coordinates, before the use's own map.
    pub side: R,
}

impl<R: Real> Sampler<R> {
    /// How to read this use of a texture.
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

    /// The filtered texel of an image: linear red, green, blue, with the factor, and alpha.
    pub fn texel(
        &self,
        image: &ImageData,
        codes: &Codes<R>,
        coordinates: [R; 2],
        footprint: Footprint<'_, R>,
    ) -> [R; 4] {
        match footprint.levels {
            [] => self.weighed(self.filtered(image, codes, self.mapped(coordinates))),
            _ => self.weighed(self.seen_afar(image, codes, self.mapped(coordinates), footprint)),
        }
    }

    /// [`Self::texel`] of the image itself, at its [`Self::place`].
    #[inline(always)]
    pub fn texel_at(&self, image: &ImageData, codes: &Codes<R>, place: &Place<R>) -> [R; 4] {
        self.weighed(self.read(image, codes, place))
    }

    /// Where texture coordinates lie in an image: the same for all whose sizes are alike, under
    /// uses that [`Self::lies_as`] this one.
    #[inline(always)]
    pub fn place(&self, image: &ImageData, coordinates: [R; 2]) -> Place<R> {
        self.place_of(image, self.mapped(coordinates))
    }

    /// Whether another use finds the same texels.
    pub fn lies_as(&self, other: &Self) -> bool {
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

    /// Coordinates under the use's own map.
    #[inline(always)]
    fn mapped(&self, [u, v]: [R; 2]) -> [R; 2] {
        match self.transform {
            Some([[a, b, c], [d, e, f]]) => [a * u + b * v + c, d * u + e * v + f],
            None => [u, v],
        }
    }

    /// Between the two levels whose texels are as large as the footprint. Nearer than the image's
    /// own texels, and of images without an area, it is the image.
    #[inline(never)]
    fn seen_afar(
        &self,
        image: &ImageData,
        codes: &Codes<R>,
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

    /// The level, not a whole one, whose texels have the area of a footprint (Akenine-Möller et
    /// al., "Texture Level of Detail Strategies for Real-Time Ray Tracing", 2019, equation 20.3 and
    /// following); −∞ where there is none.
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

    fn filtered(&self, image: &ImageData, codes: &Codes<R>, coordinates: [R; 2]) -> [R; 4] {
        self.read(image, codes, &self.place_of(image, coordinates))
    }

    #[inline(always)]
    fn place_of(&self, image: &ImageData, [u, v]: [R; 2]) -> Place<R> {
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
        Place {
            corners: [top + left, top + right, bottom + left, bottom + right],
            weights: [R::from_f64(x - x0), R::from_f64(y - y0)],
        }
    }

    /// All four texels are asked for before any is waited for: mostly they lie in no cache.
    #[inline(always)]
    fn read(&self, image: &ImageData, codes: &Codes<R>, place: &Place<R>) -> [R; 4] {
        if self.filter == Filter::Nearest {
            return texel(image, codes, self.srgb, place.corners[0]);
        }
        let [upper_left, upper_right, lower_left, lower_right] = match &image.pixels {
            Pixels::Linear(pixels) => place.corners.map(|at| pixels[at].map(R::from_f32)),
            Pixels::Codes(pixels) => place
                .corners
                .map(|at| pixels[at])
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

/// Texels around a point of an image, and where it lies between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place<R> {
    /// Upper left and right, lower left and right, as places in the list of pixels.
    corners: [usize; 4],
    /// From left to right and from top to bottom, in [0, 1).
    weights: [R; 2],
}

impl<R> Place<R> {
    /// Has the texels brought near. The right ones mostly are where the left ones are.
    #[inline(always)]
    pub fn prefetch(&self, image: &ImageData) {
        let [upper, _, lower, _] = self.corners;
        match &image.pixels {
            Pixels::Linear(pixels) => [upper, lower].map(|corner| prefetch(pixels, corner)),
            Pixels::Codes(pixels) => [upper, lower].map(|corner| prefetch(pixels, corner)),
        };
    }
}

/// What the codes of an image stand for.
#[derive(Clone, Debug)]
pub(crate) struct Codes<R> {
    shares: [R; 256],
    srgb: [R; 256],
}

impl<R: Real> Codes<R> {
    pub fn new() -> Self {
        let share = |code: usize| code as f64 / 255.0;
        Self {
            shares: core::array::from_fn(|code| R::from_f64(share(code))),
            srgb: core::array::from_fn(|code| {
                R::from_f64(decode(TransferCurve::Srgb, share(code)))
            }),
        }
    }

    /// Alpha is a share of the largest code always.
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

impl<R: Real> Default for Codes<R> {
    fn default() -> Self {
        Self::new()
    }
}

/// A pixel of an image as linear numbers.
#[inline(always)]
pub(super) fn texel<R: Real>(image: &ImageData, codes: &Codes<R>, srgb: bool, at: usize) -> [R; 4] {
    match &image.pixels {
        Pixels::Linear(pixels) => pixels[at].map(R::from_f32),
        Pixels::Codes(pixels) => codes.linear(pixels[at], srgb),
    }
}

#[inline(always)]
fn blend<R: Real>([ar, ag, ab, aa]: [R; 4], [br, bg, bb, ba]: [R; 4], weight: R) -> [R; 4] {
    let one = |a: R, b: R| a * (R::ONE - weight) + b * weight;
    // A mask asks on which side of its cutoff alpha lies: between two texels it is never beyond
    // both.
    let alpha = Real::clamp(one(aa, ba), Real::min(aa, ba), Real::max(aa, ba));
    [one(ar, br), one(ag, bg), one(ab, bb), alpha]
}

/// A coordinate in texels. Whole turns of a repeating image are removed first, so that large tile
/// counts keep their precision; what is not a number reads the first texel. In f64 whatever the
/// precision: there an f32 just below a seam, or below a border between texels, stays below it.
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

/// What is left without the whole turns; below one, where the difference would round to it.
#[inline(always)]
fn fraction(u: f64) -> f64 {
    (u - Real::floor(u)).min(1.0_f64.next_down())
}

/// The texel that a whole coordinate means. Whatever the rounding before, it lies in the image.
#[inline(always)]
fn index(texel: f64, size: u32, wrap: Wrap) -> usize {
    let (i, n) = (texel as i64, i64::from(size));
    // Whole turns are gone already, so that at most one is left: no division.
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

/// An sRGB code as a linear number.
pub(crate) fn decoded(code: u8) -> f64 {
    static CODES: LazyLock<Codes<f64>> = LazyLock::new(Codes::new);
    CODES.srgb[usize::from(code)]
}

#[cfg(test)]
mod tests;
