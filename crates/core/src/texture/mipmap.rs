//! Mipmaps (Williams, "Pyramidal Parametrics", 1983): copies of an image at decreasing size, called
//! levels. Each level has half the width and height of the previous level. Textures with the filter
//! `mipmaps` select a level by the width of the ray cone. Only images of such textures have
//! mipmaps.

use rayon::prelude::*;
use raywright_bvh::Real;

use super::sampler::{TexelDecoder, decode_texel};
use crate::scene::{ImageData, PixelData};

/// Builds the mipmap levels of an image from level 1 to a single texel; level 0 is the image
/// itself. Each level has half the width and height of the previous level, rounded down. Colours
/// are averaged as linear values: black and white average to half the radiance.
pub(crate) fn build_mipmaps(image: &ImageData, srgb: bool) -> Vec<ImageData> {
    let (mut levels, codes): (Vec<ImageData>, _) = (Vec::new(), TexelDecoder::new());
    while let Some([width, height]) =
        next_level_size(levels.last().map_or([image.width, image.height], |last| {
            [last.width, last.height]
        }))
    {
        let above = levels.last().unwrap_or(image);
        let (columns, rows) = (
            texel_weights(above.width, width),
            texel_weights(above.height, height),
        );
        let mut pixels = vec![[0.0; 4]; width as usize * height as usize];
        pixels
            .par_chunks_mut(width as usize)
            .zip(&rows)
            .for_each(|(line, row)| {
                for (pixel, column) in line.iter_mut().zip(&columns) {
                    *pixel = average_texels(above, (&codes, srgb), column, row);
                }
            });
        levels.push(ImageData {
            width,
            height,
            pixels: PixelData::Linear(pixels),
        });
    }
    levels
}

/// Returns the size in bytes of all mipmap levels of an image, except level 0.
pub(crate) fn mipmap_bytes(width: u32, height: u32) -> u64 {
    let (mut size, mut texels) = ([width, height], 0);
    while let Some(next) = next_level_size(size) {
        texels += u64::from(next[0]) * u64::from(next[1]);
        size = next;
    }
    texels * size_of::<[f32; 4]>() as u64
}

/// Returns the width and height in texels of the next mipmap level; `None` after a single texel.
fn next_level_size([width, height]: [u32; 2]) -> Option<[u32; 2]> {
    (width > 1 || height > 1).then(|| [(width / 2).max(1), (height / 2).max(1)])
}

/// Divides `from` texels along an axis among the `to` texels of the next mipmap level. Returns for
/// each new texel the index of the first covered old texel, and the weights of all covered old
/// texels.
///
/// Some old texels are split between two new texels if `from` is odd. Every old texel has the same
/// total weight.
fn texel_weights(from: u32, to: u32) -> Vec<(usize, Vec<f64>)> {
    let (from, to) = (u64::from(from), u64::from(to));
    let covered = |i: u64| {
        // In units in which a texel of the old level is `to` wide, and a texel of the new level
        // `from` wide.
        let (start, end) = (i * from, (i + 1) * from);
        let first = start / to;
        let share = |k: u64| (end.min((k + 1) * to) - start.max(k * to)) as f64 / from as f64;
        (
            first as usize,
            (first..end.div_ceil(to)).map(share).collect(),
        )
    };
    (0..to).map(covered).collect()
}

/// Returns the weighted mean of the texels that a texel of the next mipmap level covers, as linear
/// values. Weights and first covered texels are those of [`texel_weights`]: `left` and `columns`
/// across, `top` and `rows` down.
fn average_texels(
    image: &ImageData,
    (codes, srgb): (&TexelDecoder<f64>, bool),
    (left, columns): &(usize, Vec<f64>),
    (top, rows): &(usize, Vec<f64>),
) -> [f32; 4] {
    let mut sum = [0.0; 4];
    for (y, row) in (*top..).zip(rows) {
        for (x, column) in (*left..).zip(columns) {
            let texel = decode_texel(image, codes, srgb, y * image.width as usize + x);
            sum.iter_mut()
                .zip(texel)
                .for_each(|(sum, value)| *sum += value * row * column);
        }
    }
    sum.map(Real::to_f32)
}

#[cfg(test)]
mod tests;
