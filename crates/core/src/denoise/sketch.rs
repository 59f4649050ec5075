//! Filter for sketches: pictures of too few samples for denoising. It has no estimate of its error.
//!
//! Reflected light, divided by the albedo, is averaged over wider and wider neighbourhoods, by
//! weights that fall where surfaces differ and where light differs by more than its noise (Dammertz,
//! Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform for fast Global Illumination
//! Filtering", 2010). As few samples say little about their noise, it is estimated from the
//! neighbours, as in Schied et al., "Spatiotemporal Variance-Guided Filtering" (2017).

use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use super::plane::PixelPlane;
use crate::film::Film;
use crate::picture::Picture;
use crate::settings::Aov;

/// Distances in pixels of the neighbours in the successive passes.
const STEPS: [usize; 4] = [1, 2, 4, 8];
/// Added to the albedo by which light is divided.
const LEAST_ALBEDO: f32 = 0.1;
/// Greatest luminance of a pixel, relative to the mean of its neighbours.
const OUTLIER: f32 = 3.0;
/// Tolerated difference of luminances, squared, in units of their variance.
const TOLERANCE: f32 = 8.0;

/// Light of a pixel: red, green and blue, and the variance of its luminance.
type Light = [f32; 4];

/// Surface in a pixel: normal, distance (negative for the sky) and its tolerated difference from
/// pixel to pixel.
struct Surface {
    normal: [f32; 3],
    distance: f32,
    slope: f32,
}

/// Returns the filtered picture of a film; `None` if the film has no noise or lacks a layer that the
/// filter needs ([`REQUIRED_LAYERS`](super::REQUIRED_LAYERS)).
pub fn sketch(film: &Film) -> Option<Picture> {
    if !film.plan().random {
        return None;
    }
    let layer = |aov| film.mean_layer(aov);
    let (albedo, normal, mut emission) = (
        layer(Aov::Albedo)?,
        layer(Aov::Normal)?,
        layer(Aov::Emission)?,
    );
    let depth = film.centre_layer(Aov::Depth)?;
    // Beside all surfaces, the shadow on a studio's ground is noise in the light of the backdrop.
    for (emission, depth) in emission.iter_mut().zip(depth) {
        if *depth < 0.0 {
            *emission = [0.0; 3];
        }
    }
    let mut picture = film.mean_colours();
    let [width, height] = film.size().map(|edge| edge as usize);
    let plane = |values: Vec<f32>| PixelPlane {
        width,
        height,
        values,
    };
    let slopes = plane(depth.to_vec()).squared_slope();
    let surfaces: Vec<Surface> = (0..width * height)
        .map(|i| Surface {
            normal: normal[i],
            distance: depth[i],
            slope: 0.005 * depth[i].abs() + slopes.values[i].sqrt(),
        })
        .collect();
    let colours = picture.rgb.iter().zip(&emission).zip(&albedo);
    let mut light: Vec<Light> = colours
        .map(|((rgb, emission), albedo)| {
            let [r, g, b] = core::array::from_fn(|i| {
                let reflected = (rgb[i] - emission[i]) / (albedo[i] + LEAST_ALBEDO);
                // Also zero for NaN.
                reflected.max(0.0).clamp(0.0, 1e6)
            });
            [r, g, b, 0.0]
        })
        .collect();
    let means = plane(light.iter().map(luminance).collect()).box_mean(1);
    for (light, mean) in light.iter_mut().zip(&means.values) {
        let (own, around) = (luminance(light), (9.0 * mean - luminance(light)) / 8.0);
        if own > OUTLIER * around {
            let factor = OUTLIER * around.max(0.0) / own;
            *light = light.map(|channel| channel * factor);
        }
    }
    let squares = plane(light.iter().map(|light| luminance(light).powi(2)).collect()).box_mean(2);
    let means = plane(light.iter().map(luminance).collect()).box_mean(2);
    for ((light, square), mean) in light.iter_mut().zip(&squares.values).zip(&means.values) {
        light[3] = (square - mean * mean).max(0.0);
    }
    for step in STEPS {
        light = smooth(&light, &surfaces, [width, height], step);
    }
    for (i, rgb) in picture.rgb.iter_mut().enumerate() {
        *rgb =
            core::array::from_fn(|c| light[i][c] * (albedo[i][c] + LEAST_ALBEDO) + emission[i][c]);
    }
    film.finish_picture(&mut picture);
    Some(picture)
}

fn luminance(&[r, g, b, _]: &Light) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Averages the light of each pixel and of its eight neighbours at a distance of `step` pixels.
fn smooth(
    light: &[Light],
    surfaces: &[Surface],
    [width, height]: [usize; 2],
    step: usize,
) -> Vec<Light> {
    let mut smoothed = vec![Light::default(); light.len()];
    let smooth_row = |(y, row): (usize, &mut [Light])| {
        for (x, to) in row.iter_mut().enumerate() {
            let i = y * width + x;
            let (own, here) = (&light[i], &surfaces[i]);
            let tolerance = TOLERANCE * own[3] + 1e-8;
            let (mut sum, mut weights) = (Light::default(), 0.0);
            for (dy, dx) in (0..9).map(|n| (n / 3, n % 3)) {
                // Coordinates beyond the left or upper edge wrap to large numbers.
                let [x, y] = [(x, dx), (y, dy)].map(|(at, n)| (at + n * step).wrapping_sub(step));
                if x >= width || y >= height {
                    continue;
                }
                let j = y * width + x;
                let apart = luminance(&light[j]) - luminance(own);
                let kernel = if dx == 1 { 2.0 } else { 1.0 } * if dy == 1 { 2.0 } else { 1.0 };
                let weight = match i == j {
                    true => kernel,
                    false => {
                        kernel * likeness(here, &surfaces[j], step as f32)
                            / (1.0 + apart * apart / tolerance)
                    }
                };
                for (sum, of) in sum[..3].iter_mut().zip(light[j]) {
                    *sum += weight * of;
                }
                sum[3] += weight * weight * light[j][3];
                weights += weight;
            }
            *to =
                core::array::from_fn(|c| sum[c] / if c == 3 { weights * weights } else { weights });
        }
    };
    smoothed
        .par_chunks_mut(width.max(1))
        .enumerate()
        .for_each(smooth_row);
    smoothed
}

/// Returns how far two pixels show the same surface, 0 to 1.
fn likeness(one: &Surface, other: &Surface, step: f32) -> f32 {
    match (one.distance < 0.0, other.distance < 0.0) {
        (true, true) => return 1.0,
        (false, false) => {}
        _ => return 0.0,
    }
    let cosine: f32 = (0..3).map(|i| one.normal[i] * other.normal[i]).sum();
    let apart = (one.distance - other.distance) / (2.0 * step * one.slope.max(1e-30));
    cosine.clamp(0.0, 1.0).powi(16) / (1.0 + apart * apart)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: light stays on its surface, however noisy it is: beside another orientation, another
    /// distance, and the sky; on one surface it spreads.
    #[test]
    fn light_stays_on_its_surface() {
        let surface = |normal, distance| Surface {
            normal,
            distance,
            slope: 0.01,
        };
        let floor = || surface([0.0, 1.0, 0.0], 5.0);
        for (other, stays) in [
            (surface([0.0, 0.0, 1.0], 5.0), true),
            (surface([0.0, 1.0, 0.0], 50.0), true),
            (surface([0.0; 3], -1.0), true),
            (floor(), false),
        ] {
            let other = || surface(other.normal, other.distance);
            let surfaces: Vec<Surface> = (0..32)
                .map(|i| if i % 8 < 4 { floor() } else { other() })
                .collect();
            let noisy = |i: usize| [[1.0, 1.0, 1.0, 9.0], [2.0, 2.0, 2.0, 9.0]][i % 8 / 4];
            let mut light: Vec<Light> = (0..32).map(noisy).collect();
            for step in STEPS {
                light = smooth(&light, &surfaces, [8, 4], step);
            }
            let apart = (0..32).map(|i| (light[i][0] - noisy(i)[0]).abs());
            let apart = apart.fold(0.0, f32::max);
            assert_eq!(apart < 0.01, stays, "{apart}");
        }
    }
}
