//! A raster of colour codes: what a contact sheet is put together of.

/// Colour codes, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Raster {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<[u8; 3]>,
}

impl Raster {
    pub fn new(width: u32, height: u32, code: [u8; 3]) -> Self {
        Self { width, height, pixels: vec![code; width as usize * height as usize] }
    }

    /// The pixel at a place; none beyond the edges.
    pub fn at(&mut self, x: u32, y: u32) -> Option<&mut [u8; 3]> {
        let inside = x < self.width && y < self.height;
        self.pixels.get_mut(y as usize * self.width as usize + x as usize).filter(|_| inside)
    }

    /// Puts another raster on it; what of it lies beyond the edges is left out.
    pub fn put(&mut self, other: &Self, [left, top]: [u32; 2]) {
        for (y, row) in (top..).zip(other.pixels.chunks_exact(other.width.max(1) as usize)) {
            for (x, code) in (left..).zip(row) {
                self.at(x, y).into_iter().for_each(|pixel| *pixel = *code);
            }
        }
    }

    /// The same, made smaller: each pixel the mean of those around it, weighted by a tent as wide as two pixels of the result.
    pub fn shrunk(&self, width: u32, height: u32) -> Self {
        let (wide, rows) = (self.width as usize, tents(self.height, height));
        // Columns first, in numbers that are not rounded yet.
        let low = rows.iter().flat_map(|(first, weights)| {
            (0..wide).map(move |x| mean(weights, |i| self.pixels[(first + i) * wide + x].map(f32::from)))
        });
        let (low, columns): (Vec<[f32; 3]>, _) = (low.collect(), tents(self.width, width));
        let pixels = low.chunks_exact(wide.max(1)).flat_map(|row| {
            columns
                .iter()
                .map(|(first, weights)| mean(weights, |i| row[first + i]).map(|code| code.clamp(0.0, 255.0).round() as u8))
        });
        Self { width, height, pixels: pixels.collect() }
    }
}

/// For each pixel of a shorter line the first one of the longer line that counts, and how much it and those behind it do.
fn tents(from: u32, to: u32) -> Vec<(usize, Vec<f32>)> {
    let ratio = from as f32 / to as f32;
    let tent = |place: u32| {
        let middle = (place as f32 + 0.5) * ratio;
        let first = ((middle - ratio).floor().max(0.0) as u32).min(from - 1);
        let end = ((middle + ratio).ceil() as u32).clamp(first + 1, from);
        let weights: Vec<f32> = (first..end).map(|i| (1.0 - ((i as f32 - (middle - 0.5)) / ratio).abs()).max(0.0)).collect();
        let sum: f32 = weights.iter().sum();
        (first as usize, weights.iter().map(|weight| weight / sum).collect())
    };
    (0..to).map(tent).collect()
}

fn mean(weights: &[f32], code: impl Fn(usize) -> [f32; 3]) -> [f32; 3] {
    weights.iter().enumerate().fold([0.0; 3], |sum, (i, weight)| {
        let code = code(i);
        core::array::from_fn(|c| sum[c] + code[c] * weight)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: what is made smaller has the codes of `image`'s triangle filter, to the last, at any ratio.
    #[test]
    fn shrinking_is_that_of_a_triangle_filter() {
        let (width, height) = (97, 61);
        let code = |i: u32| [i * 7 % 256, i * i % 251, if i.is_multiple_of(5) { 255 } else { 0 }].map(|code| code as u8);
        let raster = Raster { width, height, pixels: (0..width * height).map(code).collect() };
        let other = image::RgbImage::from_raw(width, height, raster.pixels.as_flattened().to_vec()).expect("as many");
        for [small, low] in [[96, 60], [48, 31], [33, 1], [1, 20], [2, 2]] {
            let expected = image::imageops::resize(&other, small, low, image::imageops::FilterType::Triangle);
            assert_eq!(raster.shrunk(small, low).pixels.as_flattened(), expected.as_raw(), "{small} x {low}");
        }
    }
}
