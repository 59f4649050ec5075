//! Filters of FLIP: contrast sensitivity of the eye, and detectors of edges and points.

use core::f64::consts::PI;

use rayon::prelude::*;
use raywright_bvh::scalar::Real;

use super::OpponentImage;

/// Image of one number per pixel, row by row.
#[derive(Clone, Debug)]
pub(super) struct ScalarImage {
    pub(super) width: usize,
    pub(super) values: Vec<f32>,
}

impl ScalarImage {
    /// Correlates the image with a kernel of odd length along rows; border pixels are repeated
    /// outside.
    fn correlate_rows(&self, kernel: &[f32]) -> Self {
        let radius = kernel.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        values
            .par_chunks_mut(self.width)
            .zip(self.values.par_chunks(self.width))
            .for_each(|(out, row)| {
                let (first, last) = (row[0], row[row.len() - 1]);
                let mut padded = vec![first; radius];
                padded.extend_from_slice(row);
                padded.resize(row.len() + 2 * radius, last);
                for (tap, &weight) in kernel.iter().enumerate() {
                    for (out, x) in out.iter_mut().zip(&padded[tap..]) {
                        *out += weight * x;
                    }
                }
            });
        Self {
            width: self.width,
            values,
        }
    }

    /// Correlates the image with a kernel of odd length along columns; border pixels are repeated
    /// outside.
    fn correlate_columns(&self, kernel: &[f32]) -> Self {
        let radius = kernel.len() / 2;
        let rows: Vec<&[f32]> = self.values.chunks(self.width).collect();
        let mut values = vec![0.0; self.values.len()];
        values
            .par_chunks_mut(self.width)
            .enumerate()
            .for_each(|(y, out)| {
                for (tap, &weight) in kernel.iter().enumerate() {
                    let row = rows[(y + tap).saturating_sub(radius).min(rows.len() - 1)];
                    for (out, x) in out.iter_mut().zip(row) {
                        *out += weight * x;
                    }
                }
            });
        Self {
            width: self.width,
            values,
        }
    }

    fn add(mut self, other: &Self) -> Self {
        for (a, b) in self.values.iter_mut().zip(&other.values) {
            *a += b;
        }
        self
    }
}

/// Contrast sensitivity functions of the eye, as Fourier transforms (section 4.1.1 of the FLIP
/// paper). Each is a sum of two Gaussians a·√(π/b)·exp(−π²·x²/b), with x in degrees. An entry holds
/// the two pairs (a, b) of a channel: achromatic, red-green, blue-yellow. a = 0 marks an unused
/// second Gaussian.
const SENSITIVITY: [[(f64, f64); 2]; 3] = [
    [(1.0, 0.0047), (0.0, 1e-5)],
    [(1.0, 0.0053), (0.0, 1e-5)],
    [(34.1, 0.04), (13.5, 0.025)],
];

/// Filters that imitate the contrast sensitivity of the eye at a viewing distance, one per opponent
/// channel.
pub(super) struct ContrastFilters {
    /// Gaussians of each channel, as pairs of a row kernel and a column kernel. Over all Gaussians
    /// of a channel, the products of the two kernels sum to one.
    channels: [Vec<(Vec<f32>, Vec<f32>)>; 3],
}

impl ContrastFilters {
    pub(super) fn new(pixels_per_degree: f64) -> Self {
        // Three standard deviations of the widest Gaussian.
        let widest = SENSITIVITY
            .as_flattened()
            .iter()
            .fold(0.0, |widest: f64, &(_, b)| widest.max(b));
        let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil();
        Self {
            channels: SENSITIVITY
                .map(|gaussians| contrast_kernels(gaussians, radius, pixels_per_degree)),
        }
    }

    /// Returns the opponent channels after filtering each by the eye's contrast sensitivity.
    pub(super) fn filter(&self, planes: &OpponentImage) -> OpponentImage {
        [0, 1, 2].map(|c| {
            let filtered = self.channels[c]
                .iter()
                .map(|(row, column)| planes[c].correlate_rows(row).correlate_columns(column));
            filtered
                .reduce(|sum, part| sum.add(&part))
                .unwrap_or_else(|| planes[c].clone())
        })
    }
}

/// Returns the row kernel and the column kernel of each Gaussian of a channel. Over a square
/// window, the sum of all Gaussians is one. The weight of a Gaussian in this sum is a factor of its
/// column kernel.
fn contrast_kernels(
    gaussians: [(f64, f64); 2],
    radius: f64,
    pixels_per_degree: f64,
) -> Vec<(Vec<f32>, Vec<f32>)> {
    let shapes = gaussians
        .into_iter()
        .filter(|&(a, _)| a > 0.0)
        .map(|(a, b)| {
            let taps = sample_kernel_weights(radius, |x| {
                Real::exp(-PI * PI * (x / pixels_per_degree) * (x / pixels_per_degree) / b)
            });
            let sum: f64 = taps.iter().sum();
            (a * (PI / b).sqrt() * sum * sum, taps, sum)
        });
    let shapes: Vec<_> = shapes.collect();
    let total: f64 = shapes.iter().map(|(mass, ..)| mass).sum();
    let scaled = |taps: &[f64], factor: f64| taps.iter().map(|x| (x * factor) as f32).collect();
    shapes
        .iter()
        .map(|(mass, taps, sum)| (scaled(taps, 1.0 / sum), scaled(taps, mass / total / sum)))
        .collect()
}

/// Returns the values of a function at the whole numbers from −`radius` to `radius`.
fn sample_kernel_weights(radius: f64, f: impl Fn(f64) -> f64) -> Vec<f64> {
    let radius = radius as i32;
    (-radius..=radius).map(|x| f(f64::from(x))).collect()
}

/// Returns for each pixel, 0 to 1, how much edges and points differ between two pictures. Only the
/// achromatic channels are compared (section 4.2 of the FLIP paper).
pub(super) fn feature_differences(
    picture: &ScalarImage,
    reference: &ScalarImage,
    pixels_per_degree: f64,
) -> Vec<f32> {
    /// Width in degrees of visual angle of the edges that the eye detects best.
    const WIDTH: f64 = 0.082;
    /// Exponent below 1 that emphasises small feature differences.
    const EXPONENT: f32 = 0.5;
    let detectors = FeatureDetectors::new(0.5 * WIDTH * pixels_per_degree);
    let [a, b] = [picture, reference].map(|plane| detectors.edge_and_point_strengths(plane));
    let difference = |(a, b): (&[f32; 2], &[f32; 2])| {
        let largest = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        Real::powf(largest * core::f32::consts::FRAC_1_SQRT_2, EXPONENT).min(1.0)
    };
    a.par_iter().zip(&b).map(difference).collect()
}

/// Kernels that detect edges and points: a Gaussian and its first and second derivative.
struct FeatureDetectors {
    smooth: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl FeatureDetectors {
    fn new(deviation: f64) -> Self {
        let radius = (3.0 * deviation).ceil();
        let gaussian = |x: f64| Real::exp(-x * x / (2.0 * deviation * deviation));
        Self {
            smooth: normalize_signed_kernel(sample_kernel_weights(radius, gaussian)),
            edge: normalize_signed_kernel(sample_kernel_weights(radius, |x| -x * gaussian(x))),
            point: normalize_signed_kernel(sample_kernel_weights(radius, |x| {
                (x * x / (deviation * deviation) - 1.0) * gaussian(x)
            })),
        }
    }

    /// Returns the strength of edges and of points at each pixel, whatever their direction.
    fn edge_and_point_strengths(&self, plane: &ScalarImage) -> Vec<[f32; 2]> {
        // Lightness 0..100 to 0..1, as the detectors are calibrated for.
        let values = plane.values.iter().map(|y| (y + 16.0) / 116.0).collect();
        let plane = ScalarImage {
            width: plane.width,
            values,
        };
        let smooth = plane.correlate_rows(&self.smooth);
        let both = |kernel: &[f32]| {
            (
                plane.correlate_rows(kernel).correlate_columns(&self.smooth),
                smooth.correlate_columns(kernel),
            )
        };
        let (edge, point) = (both(&self.edge), both(&self.point));
        let length = |(x, y): (&f32, &f32)| (x * x + y * y).sqrt();
        let edges = edge.0.values.iter().zip(&edge.1.values).map(length);
        let points = point.0.values.iter().zip(&point.1.values).map(length);
        edges
            .zip(points)
            .map(|(edge, point)| [edge, point])
            .collect()
    }
}

/// Scales kernel weights so that the positive weights sum to 1 and the negative weights to −1.
fn normalize_signed_kernel(taps: Vec<f64>) -> Vec<f32> {
    let positive: f64 = taps.iter().filter(|&&x| x > 0.0).sum();
    let negative: f64 = -taps.iter().filter(|&&x| x < 0.0).sum::<f64>();
    taps.into_iter()
        .map(|x| {
            (if x > 0.0 {
                x / positive
            } else if x < 0.0 {
                x / negative
            } else {
                0.0
            }) as f32
        })
        .collect()
}
