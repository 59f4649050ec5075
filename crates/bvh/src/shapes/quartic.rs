//! Sign changes of a quartic on an interval: where a ray crosses a torus.
//!
//! The curve is cut where its slope is zero, and those places where the slope's slope is: on each piece it runs one way, so a
//! root is there iff the ends differ in sign, and a bracket finds it whatever the coefficients. Crossings therefore come in
//! the right number and order, and a double root gives none or two.

use crate::scalar::Real;

use super::num;

/// x⁴ + p·x² + q·x + w.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quartic<C> {
    pub p: C,
    pub q: C,
    pub w: C,
}

/// Up to five places in ascending order that bound four pieces, each monotone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pieces<C> {
    places: [C; 5],
    count: usize,
}

impl<C: Real> Quartic<C> {
    #[inline(always)]
    fn value(&self, x: C) -> C {
        ((x * x + self.p) * x + self.q) * x + self.w
    }

    /// Half of the slope.
    #[inline(always)]
    fn slope(&self, x: C) -> C {
        let half: C = num(0.5);
        (x * x * num(2.0) + self.p) * x + self.q * half
    }

    /// Half of the slope's slope.
    #[inline(always)]
    fn bend(&self, x: C) -> C {
        x * x * num(6.0) + self.p
    }

    /// The interval [−reach, reach], cut where the curve turns.
    pub fn pieces(&self, reach: C) -> Pieces<C> {
        let mut pieces = Pieces { places: [-reach; 5], count: 1 };
        // The slope turns at ± `knee`, and not at all where the curve is convex throughout.
        let knee = (-self.p / num(6.0)).max(C::ZERO).sqrt().min(reach);
        for (from, to) in [(-reach, -knee), (-knee, knee), (knee, reach)] {
            let (at_from, at_to) = (self.slope(from), self.slope(to));
            if (at_from < C::ZERO) != (at_to < C::ZERO) {
                pieces.push(find(from, to, at_from, |x| (self.slope(x), self.bend(x))));
            }
        }
        pieces.push(reach);
        pieces
    }

    /// The crossings of zero in ascending order, with whether the curve falls there, until `take` has what it wants. The
    /// curve counts as positive at both ends.
    pub fn crossings<T>(&self, reach: C, mut take: impl FnMut(C, bool) -> Option<T>) -> Option<T> {
        let pieces = self.pieces(reach);
        let last = pieces.count - 1;
        let mut at_from = C::ONE;
        for i in 0..last {
            let (from, to) = (pieces.places[i], pieces.places[i + 1]);
            let at_to = if i + 1 == last { C::ONE } else { self.value(to) };
            if (at_from < C::ZERO) != (at_to < C::ZERO) {
                let falls = at_to < C::ZERO;
                let root = find(from, to, at_from, |x| (self.value(x), self.slope(x) * num(2.0)));
                if let Some(taken) = take(root, falls) {
                    return Some(taken);
                }
            }
            at_from = at_to;
        }
        None
    }
}

impl<C: Real> Pieces<C> {
    fn push(&mut self, place: C) {
        if let Some(slot) = self.places.get_mut(self.count) {
            *slot = place;
            self.count += 1;
        }
    }
}

/// The zero between two places where a monotone function differs in sign: Newton's steps, and a halving where a step leaves
/// the bracket or gains less than a halving would.
fn find<C: Real>(from: C, to: C, at_from: C, f: impl Fn(C) -> (C, C)) -> C {
    let half: C = num(0.5);
    let rises = at_from < C::ZERO;
    let (mut low, mut high) = (from, to);
    let mut x = (from + to) * half;
    let mut last = to - from;
    // A halving a step would need as many as the scalar has digits; Newton's steps take six or seven.
    for _ in 0..64 {
        let (value, slope) = f(x);
        if (value < C::ZERO) == rises {
            low = x;
        } else {
            high = x;
        }
        let step = value / slope;
        let next = x - step;
        // NaN and infinite steps fail the comparison.
        let better = low < next && next < high && step.abs() < last * half;
        let next = if better { next } else { (low + high) * half };
        last = (next - x).abs();
        if last <= x.abs().max(high - low) * C::ROUNDOFF * num(2.0) {
            return next;
        }
        x = next;
    }
    x
}
