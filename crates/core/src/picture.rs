//! A finished picture as plain data: what the film hands over, and what files, displays and metrics
//! take.

/// A picture: linear scene-referred colour, an optional coverage and any number of further layers.
///
/// Every buffer holds `width · height` entries, row after row from the top, each row from the left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Pixels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance in linear Rec. 709 primaries; multiplied by the coverage where there is one
    /// (associated alpha).
    pub rgb: Vec<[f32; 3]>,
    /// Coverage, 0 (background) to 1; none: every pixel is covered.
    pub alpha: Option<Vec<f32>>,
    /// The part of the coverage that is a shadow on a studio's ground, black; none: all of it is
    /// surfaces.
    pub shadow: Option<Vec<f32>>,
    /// Further channels, in no particular order; names are unique.
    pub layers: Vec<Layer>,
    /// Where it lies in a larger picture of which it is a part; none: it is the whole.
    pub window: Option<DataWindow>,
}

/// The place of a picture in a larger one, as the data window of an OpenEXR file has it in its
/// display window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct DataWindow {
    /// Column and row of its first pixel in the whole; negative where it begins outside.
    pub origin: [i32; 2],
    /// Width and height of the whole in pixels.
    pub full: [u32; 2],
}

/// One further channel of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layer {
    /// Channel name as files have it, such as `depth.Z` or `albedo.R`.
    pub name: String,
    /// One number a pixel. Identifiers are exact up to 2²⁴.
    pub samples: Vec<f32>,
}

/// What the numbers of a picture that was read from a file mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// Display values in 0..1, after a tone map and a transfer curve (a PNG).
    Display,
    /// Linear scene-referred radiance (an EXR).
    Linear,
}

impl Picture {
    /// A black picture without coverage and layers.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            rgb: vec![[0.0; 3]; pixel_count(width, height)],
            alpha: None,
            shadow: None,
            layers: Vec::new(),
            window: None,
        }
    }

    /// Pixels in all.
    pub fn pixels(&self) -> usize {
        pixel_count(self.width, self.height)
    }

    /// Colour of the pixel in column `x`, row `y` from the top; none outside.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[f32; 3]> {
        if x >= self.width {
            return None;
        }
        self.rgb
            .get(y as usize * self.width as usize + x as usize)
            .copied()
    }

    /// The same with colours that no coverage multiplies; black where nothing is covered.
    #[must_use]
    pub fn straight(&self) -> Self {
        let mut straight = self.clone();
        for (rgb, &alpha) in straight.rgb.iter_mut().zip(self.alpha.iter().flatten()) {
            *rgb = straight_colour(*rgb, alpha);
        }
        straight
    }

    /// The share of a pixel that surfaces cover, and the share that is a ground's shadow.
    pub fn coverage(&self, pixel: usize) -> [f32; 2] {
        let shadow = self.shadow.as_ref().map_or(0.0, |shadow| shadow[pixel]);
        [
            self.alpha
                .as_ref()
                .map_or(1.0, |alpha| alpha[pixel] - shadow),
            shadow,
        ]
    }

    /// The same without its shadow: what surfaces cover alone.
    #[must_use]
    pub fn without_shadow(&self) -> Self {
        let surfaces = (0..self.pixels()).map(|pixel| self.coverage(pixel)[0]);
        Self {
            alpha: self.alpha.as_ref().map(|_| surfaces.collect()),
            shadow: None,
            ..self.clone()
        }
    }

    /// The colour of what surfaces show in a pixel, without the coverage that multiplies it; none
    /// where there are none.
    pub(crate) fn surface_colour(&self, pixel: usize) -> Option<[f32; 3]> {
        if self.alpha.is_none() {
            return Some(self.rgb[pixel]);
        }
        let [surfaces, _] = self.coverage(pixel);
        (surfaces > 0.0).then(|| straight_colour(self.rgb[pixel], surfaces))
    }

    /// The same before a colour that is seen where nothing covers it.
    #[must_use]
    pub fn over(&self, colour: [f64; 3]) -> Self {
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

    /// The layer of that name.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// Whether every buffer has one entry a pixel, as every reader of a picture relies on.
    pub fn is_consistent(&self) -> bool {
        let n = self.pixels();
        self.rgb.len() == n
            && self.alpha.as_ref().is_none_or(|alpha| alpha.len() == n)
            && self
                .shadow
                .as_ref()
                .is_none_or(|shadow| shadow.len() == n && self.alpha.is_some())
            && self.layers.iter().all(|layer| layer.samples.len() == n)
    }
}

/// A colour without the coverage that multiplies it; black where nothing is covered.
fn straight_colour(rgb: [f32; 3], alpha: f32) -> [f32; 3] {
    if alpha > 0.0 {
        rgb.map(|x| x / alpha)
    } else {
        [0.0; 3]
    }
}

fn pixel_count(width: u32, height: u32) -> usize {
    width as usize * height as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: rows count from the top and columns from the left, and places outside are none,
    /// also where the index would exist.
    #[test]
    fn pixels_are_addressed_by_column_and_row() {
        let mut picture = Picture::new(3, 2);
        picture.rgb[4] = [1.0, 2.0, 3.0];
        assert_eq!(picture.pixel(1, 1), Some([1.0, 2.0, 3.0]));
        assert_eq!(picture.pixel(3, 0), None);
        assert_eq!(picture.pixel(0, 2), None);
        assert_eq!(picture.pixels(), 6);
    }

    /// Protects: a buffer of the wrong length is seen, whichever it is.
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
        let layer = Layer {
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
