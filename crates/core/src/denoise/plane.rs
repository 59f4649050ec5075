//! Windows (rectangles of a picture), and planes (one number per pixel of a window).

/// Rectangle of a picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
}

impl Window {
    /// Returns the window extended by `by` pixels on each side, clipped to a picture of `width` ×
    /// `height` pixels.
    pub fn grow(self, by: usize, [width, height]: [usize; 2]) -> Self {
        let (x, y) = (self.x.saturating_sub(by), self.y.saturating_sub(by));
        let (right, bottom) = (
            (self.x + self.width + by).min(width),
            (self.y + self.height + by).min(height),
        );
        Self {
            x,
            y,
            width: right - x,
            height: bottom - y,
        }
    }

    /// Returns the window in coordinates relative to `outer`, a window that contains it.
    pub fn relative_to(self, outer: Self) -> Self {
        Self {
            x: self.x - outer.x,
            y: self.y - outer.y,
            ..self
        }
    }

    pub fn pixel_count(self) -> usize {
        self.width * self.height
    }
}

/// Single-channel picture: one number per pixel of a window, row by row.
#[derive(Clone, Debug)]
pub(super) struct PixelPlane {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

impl PixelPlane {
    pub fn zero(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            values: vec![0.0; width * height],
        }
    }

    pub fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..][..self.width]
    }

    /// Returns a plane whose number at each pixel is `make` of the numbers in the given planes at
    /// that pixel.
    pub fn map_planes<const N: usize>(from: [&Self; N], make: impl Fn([f32; N]) -> f32) -> Self {
        let mut made = Self::zero(from[0].width, from[0].height);
        map_values(
            &mut made.values,
            from.map(|plane| plane.values.as_slice()),
            make,
        );
        made
    }

    /// Returns a plane in which `join` combines each number with the numbers up to `reach` pixels
    /// away: first along rows, then along columns.
    fn combine_neighbours(&self, reach: usize, join: impl Fn(f32, f32) -> f32) -> Self {
        let (width, height) = (self.width, self.height);
        let into = |to: &mut [f32], from: &[f32]| {
            to.iter_mut()
                .zip(from)
                .for_each(|(to, &of)| *to = join(*to, of))
        };
        let mut along = self.clone();
        for (from, to) in self
            .values
            .chunks_exact(width)
            .zip(along.values.chunks_exact_mut(width))
        {
            for step in 1..=reach.min(width - 1) {
                into(&mut to[step..], &from[..width - step]);
                into(&mut to[..width - step], &from[step..]);
            }
        }
        let mut all = along.clone();
        for step in (1..=reach.min(height - 1)).map(|step| step * width) {
            let rest = along.values.len() - step;
            into(&mut all.values[step..], &along.values[..rest]);
            into(&mut all.values[..rest], &along.values[step..]);
        }
        all
    }

    /// Returns for each pixel the mean over the square of (2 `reach` + 1)² pixels around it. Pixels
    /// outside the plane are ignored.
    pub fn box_mean(&self, reach: usize) -> Self {
        let mut sums = self.combine_neighbours(reach, |a, b| a + b);
        let count = |position: usize, end: usize| {
            ((position + reach + 1).min(end) - position.saturating_sub(reach)) as f32
        };
        let columns: Vec<f32> = (0..self.width).map(|x| count(x, self.width)).collect();
        for (y, row) in sums.values.chunks_exact_mut(self.width).enumerate() {
            let rows = count(y, self.height);
            row.iter_mut()
                .zip(&columns)
                .for_each(|(sum, &columns)| *sum /= rows * columns);
        }
        sums
    }

    /// Returns for each pixel the maximum over the square of (2 `reach` + 1)² pixels around it.
    pub fn max_filter(&self, reach: usize) -> Self {
        self.combine_neighbours(reach, |a, b| if b > a { b } else { a })
    }

    /// Returns the squared slope at each pixel. Along the row, it is the square of the smaller of
    /// the differences to the left and right neighbour. The same along the column is added.
    pub fn squared_slope(&self) -> Self {
        let (width, height) = (self.width, self.height);
        let mut slope = Self::zero(width, height);
        for (y, to) in slope.values.chunks_exact_mut(width).enumerate() {
            let row = self.row(y);
            if width > 1 {
                (to[0], to[width - 1]) = (
                    squared_smaller_difference(row[0], [row[1]; 2]),
                    squared_smaller_difference(row[width - 1], [row[width - 2]; 2]),
                );
                let (before, here, behind) = (&row[..width - 2], &row[1..width - 1], &row[2..]);
                to[1..]
                    .iter_mut()
                    .zip(before)
                    .zip(here)
                    .zip(behind)
                    .for_each(|(((to, &a), &b), &c)| *to = squared_smaller_difference(b, [a, c]));
            }
            if height > 1 {
                let other =
                    |there: bool, step: usize, or: usize| self.row(if there { step } else { or });
                let above = other(y > 0, y.wrapping_sub(1), y + 1);
                let below = other(y + 1 < height, y + 1, y.wrapping_sub(1));
                to.iter_mut()
                    .zip(above)
                    .zip(row)
                    .zip(below)
                    .for_each(|(((to, &a), &b), &c)| *to += squared_smaller_difference(b, [a, c]));
            }
        }
        slope
    }
}

/// Writes to each entry of `to` the result of `make` for the entries of all lists at that index.
/// The loop is a function of its own: the compiler then knows that the output does not alias the
/// inputs.
#[inline]
fn map_values<const N: usize>(to: &mut [f32], from: [&[f32]; N], make: impl Fn([f32; N]) -> f32) {
    let from = from.map(|values| &values[..to.len()]);
    for (i, to) in to.iter_mut().enumerate() {
        *to = make(from.map(|values| values[i]));
    }
}

/// Returns the square of the smaller of the absolute differences between `here` and two neighbours;
/// zero if it is not finite.
#[inline(always)]
fn squared_smaller_difference(here: f32, others: [f32; 2]) -> f32 {
    let [one, other] = others.map(|other| (here - other).abs());
    let minimum = one.min(other);
    if minimum.is_finite() {
        minimum * minimum
    } else {
        0.0
    }
}

/// Colour picture as three planes: red, green and blue.
pub(super) type ColourPlanes = [PixelPlane; 3];

/// Returns a black colour picture of the given width and height.
pub(super) fn black_planes([width, height]: [usize; 2]) -> ColourPlanes {
    [(); 3].map(|()| PixelPlane::zero(width, height))
}

/// Returns, for each pixel, the value of its brightest channel.
pub(super) fn brightest_channel(of: &ColourPlanes) -> PixelPlane {
    PixelPlane::map_planes(of.each_ref(), |[r, g, b]| r.max(g).max(b))
}

/// Returns the variance of the mean of two colour pictures, summed over channels: a quarter of
/// their squared difference.
pub(super) fn variance_of_mean([one, other]: [&ColourPlanes; 2]) -> PixelPlane {
    let mut made = PixelPlane::zero(one[0].width, one[0].height);
    for (one, other) in one.iter().zip(other) {
        add_squared_differences(&mut made.values, &one.values, &other.values);
    }
    made.values.iter_mut().for_each(|of| *of /= 4.0);
    made
}

/// Adds to each entry of `to` the squared difference of the entries of `one` and `other`.
#[inline]
fn add_squared_differences(to: &mut [f32], one: &[f32], other: &[f32]) {
    for ((to, one), other) in to.iter_mut().zip(one).zip(other) {
        *to += (one - other) * (one - other);
    }
}

/// Returns the mean of two colour pictures.
pub(super) fn mean_colour([one, other]: [&ColourPlanes; 2]) -> ColourPlanes {
    [0, 1, 2].map(|i: usize| PixelPlane::map_planes([&one[i], &other[i]], |[a, b]| (a + b) / 2.0))
}

/// Returns smoothed variances: the mean over five by five pixels, or half of the pixel's own
/// variance if that is larger. Variances of few samples are noisy.
pub(super) fn smooth_variance(variance: &PixelPlane) -> PixelPlane {
    const REACH: usize = 2;
    PixelPlane::map_planes([&variance.box_mean(REACH), variance], |[near, own]| {
        near.max(own / 2.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a slope is the smaller difference to both sides, along rows and columns, so that
    /// edges have none.
    #[test]
    fn slopes_leave_edges_out() {
        let plane = |width, height, at: &[f32]| PixelPlane {
            width,
            height,
            values: at.to_vec(),
        };
        assert_eq!(
            plane(4, 1, &[0.0, 1.0, 3.0, 3.0]).squared_slope().values,
            [1.0, 1.0, 0.0, 0.0]
        );
        assert_eq!(
            plane(1, 3, &[0.0, 2.0, 3.0]).squared_slope().values,
            [4.0, 1.0, 1.0]
        );
        assert_eq!(
            plane(2, 2, &[0.0, 1.0, 2.0, f32::NAN])
                .squared_slope()
                .values,
            [5.0, 1.0, 4.0, 0.0]
        );
        assert_eq!(plane(1, 1, &[7.0]).squared_slope().values, [0.0]);
    }
}
