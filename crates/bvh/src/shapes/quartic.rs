//! Sign changes of a quartic on an interval: where a ray crosses a torus.
//!
//! The curve is cut where its slope is zero, and those places where the slope's slope is: on each
//! piece it runs one way, so a root is there iff the ends differ in sign, and a bracket finds it
//! whatever the coefficients. Crossings therefore come in the right number and order, and a double
//! root gives none or two.

use arrayvec::ArrayVec;

use crate::scalar::Real;

/// x⁴ + p·x² + q·x + w.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quartic {
    pub p: f64,
    pub q: f64,
    pub w: f64,
}

impl Quartic {
    #[inline(always)]
    fn value(&self, x: f64) -> f64 {
        ((x * x + self.p) * x + self.q) * x + self.w
    }

    /// Half of the slope.
    #[inline(always)]
    fn slope(&self, x: f64) -> f64 {
        (x * x * 2.0 + self.p) * x + self.q * 0.5
    }

    /// The interval [−reach, reach], cut where the curve turns: up to five places in ascending
    /// order that bound four pieces, each monotone.
    fn pieces(&self, reach: f64) -> ArrayVec<f64, 5> {
        let mut pieces = ArrayVec::from_iter([-reach]);
        // The slope turns at ± `knee`, and not at all where the curve is convex throughout.
        let knee = (-self.p / 6.0).max(0.0).sqrt().min(reach);
        for (from, to) in [(-reach, -knee), (-knee, knee), (knee, reach)] {
            let (at_from, at_to) = (self.slope(from), self.slope(to));
            if (at_from < 0.0) != (at_to < 0.0) {
                let slope_of_slope = |x: f64| x * x * 6.0 + self.p;
                pieces.push(find(from, to, at_from, |x| {
                    (self.slope(x), slope_of_slope(x))
                }));
            }
        }
        pieces.push(reach);
        pieces
    }

    /// The crossings of zero in ascending order, with whether the curve falls there, until `take`
    /// has what it wants. The curve counts as positive at both ends.
    pub fn crossings<T>(
        &self,
        reach: f64,
        mut take: impl FnMut(f64, bool) -> Option<T>,
    ) -> Option<T> {
        let pieces = self.pieces(reach);
        let mut at_from = 1.0;
        for (i, ends) in pieces.windows(2).enumerate() {
            let (from, to) = (ends[0], ends[1]);
            let at_to = if i + 2 == pieces.len() {
                1.0
            } else {
                self.value(to)
            };
            if (at_from < 0.0) != (at_to < 0.0) {
                let falls = at_to < 0.0;
                let root = find(from, to, at_from, |x| (self.value(x), self.slope(x) * 2.0));
                if let Some(taken) = take(root, falls) {
                    return Some(taken);
                }
            }
            at_from = at_to;
        }
        None
    }
}

/// The zero between two places where a monotone function differs in sign: Newton's steps, and a
/// halving where a step leaves the bracket or gains less than a halving would.
fn find(from: f64, to: f64, at_from: f64, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    let rises = at_from < 0.0;
    let (mut low, mut high) = (from, to);
    let mut x = (from + to) * 0.5;
    let mut last = to - from;
    // A halving a step would need as many as the scalar has digits; Newton's steps take six or
    // seven.
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
