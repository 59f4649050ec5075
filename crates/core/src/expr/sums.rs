//! Sums and products of numbers as steps: nearly all that formulas are made of, in one form.

use super::graph::{Id, Operation};
use super::select::{Selector, Tile};
use super::step::Opcode;

/// Constants that fill a step without changing a bit of its result: x · 1 = x and x + (−0) = x for every x.
#[derive(Clone, Copy)]
pub(super) struct Neutral {
    pub one: Id,
    pub minus_one: Id,
    pub minus_zero: Id,
    /// A vector.
    pub minus_zeros: Id,
}

impl Neutral {
    /// The constants, where `place` puts them.
    pub fn new(place: &mut impl FnMut(Operation) -> Id) -> Self {
        let [one, minus_one, minus_zero] = [1.0, -1.0, -0.0_f64].map(|x| place(Operation::Number(x.to_bits())));
        Self { one, minus_one, minus_zero, minus_zeros: place(Operation::Compose([minus_zero; 3])) }
    }
}

impl Selector {
    /// a + b, where b alone is a number.
    pub fn term(&self, id: Id, a: Id, b: Id) -> Tile {
        Tile::sum(id, [self.neutral.one, self.neutral.one, b, a])
    }

    /// a + b, where b is a product that comes along.
    pub fn plus(&self, id: Id, a: Id, b: Id) -> Option<Tile> {
        if let Some((u, v)) = self.dot(b) {
            return Some(Tile::new(id, Opcode::DotSum, &[u, v, self.neutral.one, a]));
        }
        let (x, y) = self.product(b)?;
        Some(self.product_plus(id, x, y, a))
    }

    /// a − b
    pub fn minus(&self, id: Id, a: Id, b: Id) -> Tile {
        let Neutral { one, minus_one, .. } = self.neutral;
        match (self.dot(b), self.product(b)) {
            (Some((u, v)), _) => Tile::new(id, Opcode::DotSum, &[u, v, minus_one, a]),
            (None, Some((x, y))) => self.scaled_plus(id, x, y, minus_one, a),
            (None, None) => Tile::sum(id, [one, minus_one, b, a]),
        }
    }

    /// a b
    pub fn times(&self, id: Id, a: Id, b: Id) -> Tile {
        self.product_plus(id, a, b, self.neutral.minus_zero)
    }

    /// x y + d, where x or y may be a product itself that comes along. To exchange factors changes no bit.
    fn product_plus(&self, id: Id, x: Id, y: Id, d: Id) -> Tile {
        for (x, y) in [(x, y), (y, x)] {
            if let Some((u, v)) = self.dot(x) {
                return Tile::new(id, Opcode::DotSum, &[u, v, y, d]);
            }
            if let Some((a, b)) = self.product(x) {
                return Tile::sum(id, [a, b, y, d]);
            }
        }
        self.scaled_plus(id, x, y, self.neutral.one, d)
    }

    /// ± x y + d. What is known last goes last, where it waits for the fewest operations.
    fn scaled_plus(&self, id: Id, x: Id, y: Id, sign: Id, d: Id) -> Tile {
        let at_once = |id| self.is_constant(id) || matches!(self.get(self.part_of(id).0), Operation::Input(_));
        let (early, late) = if at_once(y) || (!at_once(x) && x > y) { (y, x) } else { (x, y) };
        Tile::sum(id, [early, sign, late, d])
    }
}
