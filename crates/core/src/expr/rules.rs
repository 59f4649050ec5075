//! The identities by which a graph simplifies an operation before it becomes a node.

use super::graph::{Graph, Id, Operation};
use super::semantics::{self, Binary, Unary};

/// What an operation became.
pub(super) enum Simplified {
    /// A node that is there already.
    Same(Id),
    /// An operation, this one or another.
    To(Operation),
}

impl Graph {
    /// Identities that hold for every value, up to the sign of a zero and the payload of a NaN.
    pub(super) fn simplify(&mut self, operation: Operation) -> Simplified {
        match operation {
            Operation::Component(v, axis) => match self.get(v) {
                Operation::Compose(all) => Simplified::Same(all[usize::from(axis)]),
                _ => Simplified::To(operation),
            },
            Operation::Compose([x, y, z]) => match [x, y, z].map(|id| self.get(id)) {
                [Operation::Component(v, 0), Operation::Component(v1, 1), Operation::Component(v2, 2)] if v == v1 && v == v2 => {
                    Simplified::Same(v)
                }
                _ => Simplified::To(operation),
            },
            // Only the taken branch of a condition known beforehand remains.
            Operation::Select([c, a, b]) | Operation::SelectVectors([c, a, b]) => match self.as_number(c) {
                Some(condition) => Simplified::Same(if semantics::is_true(condition) { a } else { b }),
                None if a == b => Simplified::Same(a),
                None => Simplified::To(operation),
            },
            // What is 0 or 1 chooses; the other end is left alone, even where it is not finite.
            Operation::Mix([a, b, t]) if self.is_truth(t) => Simplified::Same(self.add(Operation::Select([t, b, a]))),
            Operation::MixVectors([a, b, t]) if self.is_truth(t) => {
                Simplified::Same(self.add(Operation::SelectVectors([t, b, a])))
            }
            Operation::Scale(v, factor) if self.as_number(factor) == Some(1.0) => Simplified::Same(v),
            Operation::Dot(a, b) => match (self.negated(a), self.negated(b)) {
                (Some(a), _) => self.minus(Operation::Dot(a, b)),
                (None, Some(b)) => self.minus(Operation::Dot(a, b)),
                (None, None) => Simplified::To(operation),
            },
            Operation::Unary(Unary::Negate, a) => match self.get(a) {
                Operation::Unary(Unary::Negate, inner) => Simplified::Same(inner),
                _ => Simplified::To(operation),
            },
            Operation::Binary(op, a, b) => self.simplify_binary(op, a, b),
            _ => Simplified::To(operation),
        }
    }

    /// Is 0 or 1, whatever the hit.
    fn is_truth(&self, id: Id) -> bool {
        match self.get(id) {
            Operation::Unary(op, _) => op == Unary::Not,
            Operation::Binary(op, ..) => {
                op.is_comparison() || matches!(op, Binary::And | Binary::Or | Binary::Checker | Binary::Step)
            }
            _ => false,
        }
    }

    fn minus(&mut self, operation: Operation) -> Simplified {
        let inner = self.add(operation);
        Simplified::Same(self.add(Operation::Unary(Unary::Negate, inner)))
    }

    /// What this is the negative of, number or vector.
    fn negated(&self, id: Id) -> Option<Id> {
        match self.get(id) {
            Operation::Unary(Unary::Negate, inner) => Some(inner),
            Operation::Scale(inner, factor) if self.as_number(factor) == Some(-1.0) => Some(inner),
            _ => None,
        }
    }

    fn simplify_binary(&mut self, op: Binary, a: Id, b: Id) -> Simplified {
        let two = |op, a, b| Operation::Binary(op, a, b);
        let (constant_a, constant_b) = (self.as_number(a), self.as_number(b));
        match op {
            // A constant goes second, and the rest in order, so that equal operations are found equal.
            _ if op.commutes() && (constant_a.is_some() || (constant_b.is_none() && b < a)) => {
                return match constant_b {
                    Some(_) => Simplified::To(two(op, a, b)),
                    None => self.simplify_binary(op, b, a),
                };
            }
            Binary::Multiply | Binary::Divide if constant_b == Some(1.0) => return Simplified::Same(a),
            Binary::Multiply => {
                if let (Some(inner), Some(factor)) = (self.negated(a), constant_b) {
                    let factor = self.number(-factor);
                    return Simplified::Same(self.add(two(op, inner, factor)));
                }
            }
            Binary::Add => match (self.negated(a), self.negated(b)) {
                (Some(a), _) => return Simplified::Same(self.add(two(Binary::Subtract, b, a))),
                (None, Some(b)) => return Simplified::Same(self.add(two(Binary::Subtract, a, b))),
                (None, None) => {}
            },
            Binary::Subtract => {
                if let Some(b) = self.negated(b) {
                    return Simplified::Same(self.add(two(Binary::Add, a, b)));
                }
                // Minus a product with a constant is plus one with its negative.
                if let Operation::Binary(Binary::Multiply, x, m) = self.get(b)
                    && let Some(factor) = self.as_number(m)
                {
                    let factor = self.number(-factor);
                    let product = self.add(two(Binary::Multiply, x, factor));
                    return Simplified::Same(self.add(two(Binary::Add, a, product)));
                }
            }
            _ => {}
        }
        Simplified::To(two(op, a, b))
    }
}
