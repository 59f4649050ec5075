//! Image textures: wrap modes, nearest, bilinear and trilinear filtering, colour spaces.

use std::sync::LazyLock;

use raywright_bvh::{Real, Vector};

use crate::display::curve::decode;
use crate::scene::{ColourSpace, Filter, ImageData, Pixels, Texture, TextureRef, TransferCurve, Wrap};

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
            transform: reference.uv_transform.map(|m| m.map(|row| row.map(R::from_f64))),
            factor: R::Vec3::from_f64(reference.factor.0.into()),
        }
    }

    /// The filtered texel of an image: linear red, green, blue, with the factor, and alpha.
    pub fn texel(&self, image: &ImageData, coordinates: [R; 2], footprint: Footprint<'_, R>) -> [R; 4] {
        let [r, g, b, a] = match footprint.levels {
            [] => self.filtered(image, self.mapped(coordinates)),
            _ => self.seen_afar(image, self.mapped(coordinates), footprint),
        };
        [r * self.factor.x(), g * self.factor.y(), b * self.factor.z(), a]
    }

    /// Coordinates under the use's own map.
    #[inline(always)]
    fn mapped(&self, [u, v]: [R; 2]) -> [R; 2] {
        match self.transform {
            Some([[a, b, c], [d, e, f]]) => [a * u + b * v + c, d * u + e * v + f],
            None => [u, v],
        }
    }

    /// Between the two levels whose texels are as large as the footprint. Nearer than the image's own texels, and of images
    /// without an area, it is the image.
    #[inline(never)]
    fn seen_afar(&self, image: &ImageData, coordinates: [R; 2], footprint: Footprint<'_, R>) -> [R; 4] {
        let level = self.level(image, footprint.side.to_f64());
        if level <= 0.0 {
            return self.filtered(image, coordinates);
        }
        let last = footprint.levels.len();
        let at = |level: usize| match level.min(last) {
            0 => self.filtered(image, coordinates),
            reduced => self.filtered(&footprint.levels[reduced - 1], coordinates),
        };
        let finer = level.min(last as f64) as usize;
        let share = level - finer as f64;
        if finer == last || share == 0.0 { at(finer) } else { blend(at(finer), at(finer + 1), R::from_f64(share)) }
    }

    /// The level, not a whole one, whose texels have the area of a footprint (Akenine-Möller et al., "Texture Level of Detail Strategies
    /// for Real-Time Ray Tracing", 2019, equation 20.3 and following); −∞ where there is none.
    fn level(&self, image: &ImageData, side: f64) -> f64 {
        let stretch = self.transform.map_or(1.0, |[[a, b, _], [d, e, _]]| (a * e - b * d).to_f64().abs());
        let texels = side * side * stretch * f64::from(image.width) * f64::from(image.height);
        if texels > 0.0 { 0.5 * libm::log2(texels) } else { f64::NEG_INFINITY }
    }

    fn filtered(&self, image: &ImageData, [u, v]: [R; 2]) -> [R; 4] {
        let x = scaled(u.to_f64(), image.width, self.wrap[0]);
        let y = scaled(v.to_f64(), image.height, self.wrap[1]);
        let column = |x: f64| index(x, image.width, self.wrap[0]);
        let row = |y: f64| index(y, image.height, self.wrap[1]);
        match self.filter {
            Filter::Nearest => self.fetch(image, column(Real::floor(x)), row(Real::floor(y))),
            Filter::Bilinear | Filter::Mipmaps => {
                let (x, y) = (x - 0.5, y - 0.5);
                let (x0, y0) = (Real::floor(x), Real::floor(y));
                let (fx, fy) = (R::from_f64(x - x0), R::from_f64(y - y0));
                let (left, right) = (column(x0), column(x0 + 1.0));
                let (top, bottom) = (row(y0), row(y0 + 1.0));
                let upper = blend(self.fetch(image, left, top), self.fetch(image, right, top), fx);
                let lower = blend(self.fetch(image, left, bottom), self.fetch(image, right, bottom), fx);
                blend(upper, lower, fy)
            }
        }
    }

    fn fetch(&self, image: &ImageData, column: usize, row: usize) -> [R; 4] {
        texel(image, self.srgb, column, row)
    }
}

/// A pixel of an image as linear numbers.
#[inline(always)]
pub(super) fn texel<R: Real>(image: &ImageData, srgb: bool, column: usize, row: usize) -> [R; 4] {
    let at = row * image.width as usize + column;
    match &image.pixels {
        Pixels::Linear(pixels) => pixels[at].map(R::from_f32),
        Pixels::Codes(pixels) => {
            let [r, g, b, a] = pixels[at];
            let (colours, share) = (codes(srgb), codes(false));
            let [r, g, b] = [r, g, b].map(|code| colours[usize::from(code)]);
            [r, g, b, share[usize::from(a)]].map(R::from_f64)
        }
    }
}

fn blend<R: Real>(a: [R; 4], b: [R; 4], weight: R) -> [R; 4] {
    core::array::from_fn(|i| a[i] * (R::ONE - weight) + b[i] * weight)
}

/// A coordinate in texels. Whole turns of a repeating image are removed first, so that large tile counts keep their
/// precision; what is not a number reads the first texel. In f64 whatever the precision: there an f32 just below a seam, or
/// below a border between texels, stays below it.
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
fn fraction(u: f64) -> f64 {
    (u - Real::floor(u)).min(1.0_f64.next_down())
}

/// The texel that a whole coordinate means. Whatever the rounding before, it lies in the image.
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
    codes(true)[usize::from(code)]
}

/// What codes stand for: linear numbers of sRGB, or shares of the largest one.
#[inline]
fn codes(srgb: bool) -> &'static [f64; 256] {
    static TABLES: LazyLock<[[f64; 256]; 2]> = LazyLock::new(|| {
        let share = |code: usize| code as f64 / 255.0;
        [core::array::from_fn(share), core::array::from_fn(|code| decode(TransferCurve::Srgb, share(code)))]
    });
    &TABLES[usize::from(srgb)]
}

#[cfg(test)]
mod tests;
