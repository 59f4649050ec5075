//! One pass of non-local means: each pixel becomes a mean of pixels around it with similar
//! surroundings in a guide, and similar features.
//!
//! Differences in the guide are related to the differences that noise would cause (Rousselle, Knaus
//! and Zwicker, "Adaptive Rendering with Non-Local Means Filtering", 2012) and averaged over three
//! by three pixels. A feature can only reduce a weight.

use std::sync::LazyLock;

use raywright_bvh::{Loops, widest};

use super::plane::{Colour, PixelPlane, Window};

/// Strictness of the comparison: inverse of the squared tolerance in units of noise, and the least
/// share of a pixel's own difference in the mean over its neighbours.
#[derive(Clone, Copy)]
pub(super) struct Strictness {
    pub inverse: f32,
    pub own: f32,
}

/// Guide for comparing pixels.
pub(super) struct Guide<'a> {
    pub colour: &'a Colour,
    /// Variance of the guide, summed over channels.
    pub variance: &'a PixelPlane,
    /// Variance of the targets, and its inverse: much noisier pixels get less weight.
    pub noise: &'a PixelPlane,
    pub inverse_noise: &'a PixelPlane,
    /// Features, each with the inverse of the tolerated squared difference.
    pub features: &'a [(PixelPlane, PixelPlane)],
    pub strictness: Strictness,
}

/// Filtered means, and the weight of each pixel in its own mean.
pub(super) struct FilterOutput {
    pub means: Vec<PixelPlane>,
    pub own: PixelPlane,
}

/// Offsets around a pixel, down and to the right. Each comes with its opposite, so that no picture
/// is shifted.
pub(super) type Offsets = Vec<[isize; 2]>;

/// All offsets within a disc of two and a half pixels.
pub(super) static NEAR: LazyLock<Offsets> = LazyLock::new(|| offsets(2, 0.0, 2));
/// All offsets of a square of five by five, and beyond it a fifth of those in a disc of eight and a
/// half pixels.
pub(super) static FAR: LazyLock<Offsets> = LazyLock::new(|| offsets(8, 0.2, 2));

/// Offsets within `radius`; beyond a square of `dense` pixels to each side a share of them, spread
/// evenly (Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018).
fn offsets(radius: isize, share: f64, dense: isize) -> Offsets {
    let chosen = |y: isize, x: isize| {
        let (a, b) = if (y, x) > (-y, -x) { (y, x) } else { (-y, -x) };
        (0.754_877_666_2 * a as f64 + 0.569_840_291 * b as f64).rem_euclid(1.0) < share
    };
    let square = (-radius..=radius).flat_map(|y| (-radius..=radius).map(move |x| [y, x]));
    let disc = square.filter(|&[y, x]| ((x * x + y * y) as f64) <= (radius as f64 + 0.5).powi(2));
    disc.filter(|&[y, x]| y.abs().max(x.abs()) <= dense || chosen(y, x))
        .collect()
}

/// Filters the targets within `core`, a rectangle of their planes, by offsets. Pixels beyond the
/// planes are ignored: planes that end before the picture does must exceed the core by the reach of
/// the offsets, and one more.
pub(super) fn filter(
    guide: &Guide<'_>,
    targets: &[&PixelPlane],
    core: Window,
    offsets: &Offsets,
) -> FilterOutput {
    widest(Pass {
        guide,
        targets,
        core,
        offsets,
    })
}

struct Pass<'a> {
    guide: &'a Guide<'a>,
    targets: &'a [&'a PixelPlane],
    core: Window,
    offsets: &'a Offsets,
}

/// Buffered rows: differences, and means of three along them.
struct Rows {
    differences: [Vec<f32>; 3],
    means: [Vec<f32>; 3],
    weights: Vec<f32>,
}

impl Loops for Pass<'_> {
    type Output = FilterOutput;

    #[inline(always)]
    fn run(self) -> FilterOutput {
        let Self { core, targets, .. } = self;
        let mut means: Vec<PixelPlane> = targets
            .iter()
            .map(|_| PixelPlane::zero(core.width, core.height))
            .collect();
        let [mut sums, mut own] = [(); 2].map(|()| PixelPlane::zero(core.width, core.height));
        let width = self.guide.variance.width;
        let row = || [(); 3].map(|()| vec![0.0; width]);
        let mut rows = Rows {
            differences: row(),
            means: row(),
            weights: vec![0.0; width],
        };
        for &offset in self.offsets {
            self.add(offset, &mut rows, (&mut means, &mut sums, &mut own));
        }
        for plane in means.iter_mut().chain([&mut own]) {
            plane
                .at
                .iter_mut()
                .zip(&sums.at)
                .for_each(|(of, &sum)| *of /= sum);
        }
        FilterOutput { means, own }
    }
}

impl Pass<'_> {
    /// Adds the pixels at one offset.
    #[inline(always)]
    fn add(
        &self,
        [dy, dx]: [isize; 2],
        rows: &mut Rows,
        (means, sums, own): (&mut [PixelPlane], &mut PixelPlane, &mut PixelPlane),
    ) {
        let (width, height) = (self.guide.variance.width, self.guide.variance.height);
        // Range in which both pixels lie in the planes, limited to the core.
        let both = |step: isize, end: usize| {
            (
                (-step).max(0) as usize,
                (end as isize - step.max(0)).max(0) as usize,
            )
        };
        let ((left, right), (top, bottom)) = (both(dx, width), both(dy, height));
        let columns = self.core.x.max(left)..(self.core.x + self.core.width).min(right);
        let lines = self.core.y.max(top)..(self.core.y + self.core.height).min(bottom);
        if columns.is_empty() || lines.is_empty() {
            return;
        }
        let wide = columns.start.saturating_sub(1).max(left)..(columns.end + 1).min(right);
        let shift = |at: usize, step: isize| (at as isize + step) as usize;
        let mut next = lines.start.saturating_sub(1).max(top);
        for y in lines {
            let last = (y + 1).min(bottom - 1);
            while next <= last {
                self.compare(
                    [next, shift(next, dy)],
                    [wide.start, shift(wide.start, dx)],
                    wide.len(),
                    next % 3,
                    rows,
                );
                next += 1;
            }
            let around = [y.saturating_sub(1).max(top) % 3, y % 3, last % 3];
            let (inner, length) = (columns.start - wide.start, columns.len());
            self.weigh(
                [y, shift(y, dy)],
                [columns.start, shift(columns.start, dx)],
                (inner, length),
                around,
                rows,
            );
            let (weights, to) = (
                &rows.weights[..length],
                (y - self.core.y) * self.core.width + columns.start - self.core.x,
            );
            let (from_y, from_x) = (shift(y, dy), shift(columns.start, dx));
            for (mean, target) in means.iter_mut().zip(self.targets) {
                loops::add_weighed(
                    &mut mean.at[to..][..length],
                    weights,
                    &target.row(from_y)[from_x..][..length],
                );
            }
            loops::add(&mut sums.at[to..][..length], weights);
            if dx == 0 && dy == 0 {
                own.at[to..][..length].copy_from_slice(weights);
            }
        }
    }

    /// Differences of two rows in the guide, and means of three along them.
    #[inline(always)]
    fn compare(
        &self,
        [y, other]: [usize; 2],
        [x, beside]: [usize; 2],
        length: usize,
        slot: usize,
        rows: &mut Rows,
    ) {
        let Guide {
            colour,
            variance,
            strictness,
            ..
        } = self.guide;
        let to = &mut rows.differences[slot][..length];
        to.fill(0.0);
        for plane in colour.iter() {
            loops::add_square(
                to,
                &plane.row(y)[x..][..length],
                &plane.row(other)[beside..][..length],
            );
        }
        let (own, there) = (
            &variance.row(y)[x..][..length],
            &variance.row(other)[beside..][..length],
        );
        loops::relate(to, own, there, strictness.inverse);
        loops::average(
            &mut rows.means[slot][..length],
            &rows.differences[slot][..length],
        );
    }

    /// The weights of a row.
    #[inline(always)]
    fn weigh(
        &self,
        [y, other]: [usize; 2],
        [x, beside]: [usize; 2],
        (inner, length): (usize, usize),
        around: [usize; 3],
        rows: &mut Rows,
    ) {
        let Guide {
            noise,
            inverse_noise,
            features,
            strictness,
            ..
        } = self.guide;
        let [above, here, below] = around.map(|slot| &rows.means[slot][inner..][..length]);
        let (own, weights) = (
            &rows.differences[around[1]][inner..][..length],
            &mut rows.weights[..length],
        );
        loops::most(weights, above, here, below);
        loops::at_least(weights, own, strictness.own);
        for (feature, tolerance) in *features {
            let (a, b) = (
                &feature.row(y)[x..][..length],
                &feature.row(other)[beside..][..length],
            );
            loops::forbid(weights, a, b, &tolerance.row(y)[x..][..length]);
        }
        let (noise, inverse) = (
            &noise.row(y)[x..][..length],
            &inverse_noise.row(other)[beside..][..length],
        );
        loops::close(weights, noise, inverse);
    }
}

/// Loops over rows of equal length. Each is a function of its own with few rows, so that the
/// compiler knows that outputs do not alias inputs, and vectorises it.
pub(super) mod loops {
    /// Adds squares of differences.
    #[inline(always)]
    pub fn add_square(to: &mut [f32], a: &[f32], b: &[f32]) {
        let (a, b) = (&a[..to.len()], &b[..to.len()]);
        for i in 0..to.len() {
            let apart = a[i] - b[i];
            to[i] += apart * apart;
        }
    }

    /// Squared differences relative to the noise of these variances.
    #[inline(always)]
    pub fn relate(to: &mut [f32], own: &[f32], there: &[f32], inverse: f32) {
        let (own, there) = (&own[..to.len()], &there[..to.len()]);
        for i in 0..to.len() {
            let less = if own[i] < there[i] { own[i] } else { there[i] };
            to[i] = (to[i] - own[i] - less) / (1e-7 + own[i] + there[i]) * inverse;
        }
    }

    /// Means of three along a row; the ends count twice.
    #[inline(always)]
    pub fn average(to: &mut [f32], of: &[f32]) {
        const THIRD: f32 = 1.0 / 3.0;
        let length = to.len();
        let of = &of[..length];
        if length > 2 {
            let (before, here, behind) = (&of[..length - 2], &of[1..length - 1], &of[2..]);
            let to = &mut to[1..length - 1];
            for i in 0..to.len() {
                to[i] = (before[i] + here[i] + behind[i]) * THIRD;
            }
        }
        for i in [0, length - 1] {
            to[i] = (of[i.saturating_sub(1)] + of[i] + of[(i + 1).min(length - 1)]) * THIRD;
        }
    }

    /// Means of three rows, clamped to zero.
    #[inline(always)]
    pub fn most(to: &mut [f32], above: &[f32], here: &[f32], below: &[f32]) {
        let (above, here, below) = (&above[..to.len()], &here[..to.len()], &below[..to.len()]);
        for i in 0..to.len() {
            let mean = (above[i] + here[i] + below[i]) * (1.0 / 3.0);
            to[i] = if mean > 0.0 { mean } else { 0.0 };
        }
    }

    /// Maximum with a share of other numbers.
    #[inline(always)]
    pub fn at_least(to: &mut [f32], of: &[f32], share: f32) {
        let of = &of[..to.len()];
        for i in 0..to.len() {
            let least = share * of[i];
            to[i] = if least > to[i] { least } else { to[i] };
        }
    }

    /// Maximum with a feature's squared differences relative to the tolerance.
    #[inline(always)]
    pub fn forbid(to: &mut [f32], a: &[f32], b: &[f32], inverse: &[f32]) {
        let (a, b, inverse) = (&a[..to.len()], &b[..to.len()], &inverse[..to.len()]);
        for i in 0..to.len() {
            let apart = a[i] - b[i];
            let apart = apart * apart * inverse[i];
            to[i] = if apart > to[i] { apart } else { to[i] };
        }
    }

    /// Weights of these distances, exp(-x) with finite support, reduced if the noise is more than
    /// doubled.
    #[inline(always)]
    pub fn close(to: &mut [f32], noise: &[f32], inverse: &[f32]) {
        let (noise, inverse) = (&noise[..to.len()], &inverse[..to.len()]);
        for i in 0..to.len() {
            let close = 1.0 - to[i] * 0.25;
            let close = if close > 0.0 { close } else { 0.0 };
            let noisier = (2.0 * noise[i] + 1e-8) * inverse[i];
            to[i] = close * close * (close * close) * if noisier < 1.0 { noisier } else { 1.0 };
        }
    }

    /// Adds weighted numbers.
    #[inline(always)]
    pub fn add_weighed(to: &mut [f32], weights: &[f32], of: &[f32]) {
        let (weights, of) = (&weights[..to.len()], &of[..to.len()]);
        for i in 0..to.len() {
            to[i] += weights[i] * of[i];
        }
    }

    /// Adds numbers.
    #[inline(always)]
    pub fn add(to: &mut [f32], of: &[f32]) {
        let of = &of[..to.len()];
        for i in 0..to.len() {
            to[i] += of[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: offsets come in opposite pairs, so that no filter shifts a picture; 21 and 69 of
    /// them.
    #[test]
    fn offsets_are_symmetric() {
        for (offsets, count) in [(&*NEAR, 21), (&*FAR, 69)] {
            assert_eq!(offsets.len(), count);
            assert!(offsets.iter().all(|&[y, x]| offsets.contains(&[-y, -x])));
            assert_eq!(
                offsets.iter().filter(|&&offset| offset == [0, 0]).count(),
                1
            );
        }
    }
}
