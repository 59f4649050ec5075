//! Sign changes of a quartic on an interval, for the intersection of a ray with a torus.
//!
//! The interval is cut at the zeros of the derivative. These are bracketed by the zeros of the
//! second derivative. The quartic is monotone on each piece. So a piece contains a root if and only
//! if the signs at its ends differ, and bracketing then finds that root for any coefficients. So
//! the number and the order of crossings are correct. A double root gives zero or two crossings.

use arrayvec::ArrayVec;

use crate::scalar::Real;

/// The quartic polynomial x⁴ + p·x² + q·x + w.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quartic {
    pub p: f64,
    pub q: f64,
    pub w: f64,
}

impl Quartic {
    #[inline(always)]
    fn eval(&self, x: f64) -> f64 {
        ((x * x + self.p) * x + self.q) * x + self.w
    }

    /// Half of the derivative at `x`.
    #[inline(always)]
    fn half_derivative(&self, x: f64) -> f64 {
        (x * x * 2.0 + self.p) * x + self.q * 0.5
    }

    /// Cuts the interval [−reach, reach] at the extrema of the quartic. Returns the ends of up to
    /// four monotone pieces, in ascending order.
    fn split_into_monotone_pieces(&self, reach: f64) -> ArrayVec<f64, 5> {
        let mut pieces = ArrayVec::from_iter([-reach]);
        // The derivative has its extrema at ±`knee`, and no extrema if the quartic is convex.
        let knee = (-self.p / 6.0).max(0.0).sqrt().min(reach);
        for (from, to) in [(-reach, -knee), (-knee, knee), (knee, reach)] {
            let (at_from, at_to) = (self.half_derivative(from), self.half_derivative(to));
            if (at_from < 0.0) != (at_to < 0.0) {
                let slope_of_slope = |x: f64| x * x * 6.0 + self.p;
                pieces.push(find_zero(from, to, at_from, |x| {
                    (self.half_derivative(x), slope_of_slope(x))
                }));
            }
        }
        pieces.push(reach);
        pieces
    }

    /// Calls `take` for each zero crossing in ascending order, until `take` returns a result. The
    /// arguments of `take` are the crossing, and whether the quartic is decreasing there. Both ends
    /// of [−reach, reach] count as points with a positive value.
    pub fn find_crossings<T>(
        &self,
        reach: f64,
        mut take: impl FnMut(f64, bool) -> Option<T>,
    ) -> Option<T> {
        let pieces = self.split_into_monotone_pieces(reach);
        let mut at_from = 1.0;
        for (i, ends) in pieces.windows(2).enumerate() {
            let (from, to) = (ends[0], ends[1]);
            let at_to = if i + 2 == pieces.len() {
                1.0
            } else {
                self.eval(to)
            };
            if (at_from < 0.0) != (at_to < 0.0) {
                let falls = at_to < 0.0;
                let root = find_zero(from, to, at_from, |x| {
                    (self.eval(x), self.half_derivative(x) * 2.0)
                });
                if let Some(taken) = take(root, falls) {
                    return Some(taken);
                }
            }
            at_from = at_to;
        }
        None
    }
}

/// Finds the zero of a monotone function that changes sign between two points, by Newton's method.
/// `f` returns the value and the slope, and `at_from` is the value at `from`. Bisection replaces a
/// step that leaves the bracket, or that is longer than half the last step.
fn find_zero(from: f64, to: f64, at_from: f64, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    let rises = at_from < 0.0;
    let (mut low, mut high) = (from, to);
    let mut x = (from + to) * 0.5;
    let mut last = to - from;
    // Bisection alone would take as many steps as the scalar has digits. Newton's method takes six
    // or seven.
    for _ in 0..64 {
        let (value, slope) = f(x);
        if (value < 0.0) == rises {
            low = x;
        } else {
            high = x;
        }
        let step = value / slope;
        let next = x - step;
        // NaN and infinite steps fail the comparison.
        let better = low < next && next < high && step.abs() < last * 0.5;
        let next = if better { next } else { (low + high) * 0.5 };
        last = (next - x).abs();
        if last <= x.abs().max(high - low) * f64::ROUNDOFF * 2.0 {
            return next;
        }
        x = next;
    }
    x
}
