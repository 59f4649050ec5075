//! Picture in memory. Films produce it; image files, displays and metrics read it.

use crate::display::curve::luminance;

/// Picture: linear scene-referred colour, optional coverage (alpha) and any number of additional
/// layers.
///
/// Every buffer holds `width · height` entries, row by row from the top.
#[derive(Clone, Debug, Default, PartialEq)]
#[doc(alias("DynamicImage", "ImageBuffer", "framebuffer"))]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Radiance in linear Rec. 709 primaries. In a picture with coverage, it is multiplied by the
    /// coverage (associated alpha).
    pub rgb: Vec<[f32; 3]>,
    /// Coverage of each pixel, 0 (background) to 1; `None` if all pixels are fully covered.
    pub alpha: Option<Vec<f32>>,
    /// Part of the coverage, 0 to 1, that is due to a black shadow on a studio's ground. `None` if
    /// the picture has no such shadow.
    pub shadow: Option<Vec<f32>>,
    /// Additional channels, in no particular order; names are unique.
    pub layers: Vec<PictureLayer>,
    /// Position of a rendered crop in the whole picture; `None` for a whole picture.
    pub window: Option<DataWindow>,
}

/// Radiance of drawn lines, such as those of a wireframe: on bright surfaces, and on dark surfaces.
pub(crate) const LINE_RADIANCES: [f64; 2] = [0.01, 0.6];

/// Whether a base colour is so dark that lines on it are bright.
pub(crate) fn needs_bright_lines(colour: [f64; 3]) -> bool {
    luminance(colour) <= 0.12
}

/// Position of a rendered crop in the whole picture. It corresponds to the data window in the
/// display window of an OpenEXR file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct DataWindow {
    /// Column and row, in the whole picture, of the first pixel of the crop. They are negative if
    /// the crop starts outside the whole picture.
    pub origin: [i32; 2],
    /// Width and height of the whole picture in pixels.
    pub full: [u32; 2],
}

/// Additional channel of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PictureLayer {
    /// Channel name as in files, for example `depth.Z` or `albedo.R`.
    pub name: String,
    /// One number per pixel, row by row. Integers, such as object indices, are exact up to 2²⁴.
    pub samples: Vec<f32>,
}

/// Encoding of the colours of a picture that was read from a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// Display values in 0..1, after a tone map and a transfer curve (as in PNG files).
    Display,
    /// Linear scene-referred radiance (as in EXR files).
    Linear,
}

impl Picture {
    /// Returns a black picture without coverage and layers.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            rgb: vec![[0.0; 3]; pixels_of_size(width, height)],
            alpha: None,
            shadow: None,
            layers: Vec::new(),
            window: None,
        }
    }

    /// Returns the number of pixels.
    pub fn pixel_count(&self) -> usize {
        pixels_of_size(self.width, self.height)
    }

    /// Returns the colour of the pixel in column `x`, row `y` from the top, or `None` outside the
    /// picture.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[f32; 3]> {
        if x >= self.width {
            return None;
        }
        self.rgb
            .get(y as usize * self.width as usize + x as usize)
            .copied()
    }

    /// Returns the picture with unassociated (straight) alpha: each colour is divided by its
    /// coverage. Pixels without coverage become black.
    #[must_use]
    pub fn to_straight_alpha(&self) -> Self {
        let mut straight = self.clone();
        for (rgb, &alpha) in straight.rgb.iter_mut().zip(self.alpha.iter().flatten()) {
            *rgb = unpremultiply(*rgb, alpha);
        }
        straight
    }

    /// Returns the coverage of a pixel by surfaces and by the shadow on a studio's ground, each 0
    /// to 1.
    ///
    /// # Panics
    /// If the picture has coverage and the pixel does not exist.
    pub fn coverage(&self, pixel: usize) -> [f32; 2] {
        let shadow = self.shadow.as_ref().map_or(0.0, |shadow| shadow[pixel]);
        [
            self.alpha
                .as_ref()
                .map_or(1.0, |alpha| alpha[pixel] - shadow),
            shadow,
        ]
    }

    /// Returns the picture without the shadow on a studio's ground. Its coverage is that of
    /// surfaces.
    #[must_use]
    pub fn without_shadow(&self) -> Self {
        let surfaces = (0..self.pixel_count()).map(|pixel| self.coverage(pixel)[0]);
        Self {
            alpha: self.alpha.as_ref().map(|_| surfaces.collect()),
            shadow: None,
            ..self.clone()
        }
    }

    /// Returns the colour of a pixel's surfaces, divided by their coverage; `None` for a pixel that
    /// no surface covers.
    pub(crate) fn surface_colour(&self, pixel: usize) -> Option<[f32; 3]> {
        if self.alpha.is_none() {
            return Some(self.rgb[pixel]);
        }
        let [surfaces, _] = self.coverage(pixel);
        (surfaces > 0.0).then(|| unpremultiply(self.rgb[pixel], surfaces))
    }

    /// Returns the picture composited over a background colour in linear radiance. The result has
    /// no coverage.
    #[must_use]
    pub fn composite_over(&self, colour: [f64; 3]) -> Self {
        let mut over = Self {
            alpha: None,
            shadow: None,
            ..self.clone()
        };
        for (rgb, &alpha) in over.rgb.iter_mut().zip(self.alpha.iter().flatten()) {
            let clear = 1.0 - f64::from(alpha);
            *rgb = core::array::from_fn(|i| (f64::from(rgb[i]) + clear * colour[i]) as f32);
        }
        over
    }

    /// Returns the layer with this name, or `None`.
    pub fn layer(&self, name: &str) -> Option<&PictureLayer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// Whether every buffer has one entry per pixel, as all users of a picture require.
    pub fn is_consistent(&self) -> bool {
        let n = self.pixel_count();
        self.rgb.len() == n
            && self.alpha.as_ref().is_none_or(|alpha| alpha.len() == n)
            && self
                .shadow
                .as_ref()
                .is_none_or(|shadow| shadow.len() == n && self.alpha.is_some())
            && self.layers.iter().all(|layer| layer.samples.len() == n)
    }
}

/// Returns a colour divided by its coverage `alpha`; black if the coverage is 0.
fn unpremultiply(rgb: [f32; 3], alpha: f32) -> [f32; 3] {
    if alpha > 0.0 {
        rgb.map(|x| x / alpha)
    } else {
        [0.0; 3]
    }
}

fn pixels_of_size(width: u32, height: u32) -> usize {
    width as usize * height as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: rows count from the top and columns from the left. Positions outside the picture
    /// return `None`, even where the index exists.
    #[test]
    fn pixels_are_addressed_by_column_and_row() {
        let mut picture = Picture::new(3, 2);
        picture.rgb[4] = [1.0, 2.0, 3.0];
        assert_eq!(picture.pixel(1, 1), Some([1.0, 2.0, 3.0]));
        assert_eq!(picture.pixel(3, 0), None);
        assert_eq!(picture.pixel(0, 2), None);
        assert_eq!(picture.pixel_count(), 6);
    }

    /// Protects: a buffer of the wrong length is detected, whichever buffer it is.
    #[test]
    fn inconsistent_buffers_are_seen() {
        let good = Picture::new(2, 2);
        assert!(good.is_consistent());
        assert!(
            !Picture {
                rgb: vec![[0.0; 3]; 3],
                ..good.clone()
            }
            .is_consistent()
        );
        assert!(
            !Picture {
                alpha: Some(vec![1.0]),
                ..good.clone()
            }
            .is_consistent()
        );
        let layer = PictureLayer {
            name: "depth.Z".into(),
            samples: vec![0.0; 5],
        };
        assert!(
            !Picture {
                layers: vec![layer],
                ..good
            }
            .is_consistent()
        );
    }
}
