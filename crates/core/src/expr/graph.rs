//! An expression as a graph of typed operations: equal operations are one node (common subexpressions), operations on
//! constants are computed at once, and a few identities bring the rest to a standard form ([`rules`](super::rules)).
//!
//! Operands always come before the operation that uses them, so every pass is a loop and no depth of nesting in a source
//! can overflow the stack here.

use std::collections::HashMap;

use raywright_bvh::scalar::{Real, Vector};

use super::rules::Simplified;
use super::scope::{Inputs, Variable};
use super::semantics::{self, Binary, Noise, Unary};

/// Index of a node in its graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Id(u32);

impl Id {
    // The source's length bounds the count of nodes far below 2³².
    pub const fn new(index: usize) -> Self {
        Self(index as u32)
    }

    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// One operation. Numbers are kept as bits so that operations can be compared and hashed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Operation {
    Number(u64),
    Input(Variable),
    /// Component 0, 1 or 2 of a vector.
    Component(Id, u8),
    /// A vector of three numbers.
    Compose([Id; 3]),
    Unary(Unary, Id),
    Binary(Binary, Id, Id),
    WholePower(Id, i32),
    /// a, b, t.
    Mix([Id; 3]),
    /// low, high, x.
    Smoothstep([Id; 3]),
    /// condition, then, else: numbers.
    Select([Id; 3]),
    /// The same operation in every component of two vectors.
    Vectors(Binary, Id, Id),
    /// A vector times a number.
    Scale(Id, Id),
    /// A vector divided by a number.
    Shrink(Id, Id),
    /// Two vectors, and a number t.
    MixVectors([Id; 3]),
    /// A number as the condition, and two vectors.
    SelectVectors([Id; 3]),
    Dot(Id, Id),
    Cross(Id, Id),
    Length(Id),
    Normalize(Id),
    /// Gradient noise at a point of space.
    SpaceNoise(Noise, Id),
    /// Gradient noise at a point of a plane.
    PlaneNoise(Noise, Id, Id),
}

/// What a node evaluates to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value<R: Real> {
    Number(R),
    Vector(R::Vec3),
}

impl<R: Real> Value<R> {
    /// The number; the first component of a vector, which the builder's types rule out where a number is meant.
    pub fn number(self) -> R {
        match self {
            Self::Number(x) => x,
            Self::Vector(v) => v.x(),
        }
    }

    /// The vector; a number in every component.
    pub fn vector(self) -> R::Vec3 {
        match self {
            Self::Number(x) => R::Vec3::splat(x),
            Self::Vector(v) => v,
        }
    }
}

impl Operation {
    /// Yields a vector; `false` for a number.
    pub const fn is_vector(self) -> bool {
        match self {
            Self::Input(variable) => variable.is_vector(),
            Self::Compose(_)
            | Self::Vectors(..)
            | Self::Scale(..)
            | Self::Shrink(..)
            | Self::MixVectors(_)
            | Self::SelectVectors(_)
            | Self::Cross(..)
            | Self::Normalize(_) => true,
            Self::Number(_)
            | Self::Component(..)
            | Self::Unary(..)
            | Self::Binary(..)
            | Self::WholePower(..)
            | Self::Mix(_)
            | Self::Smoothstep(_)
            | Self::Select(_)
            | Self::Dot(..)
            | Self::Length(_)
            | Self::SpaceNoise(..)
            | Self::PlaneNoise(..) => false,
        }
    }

    /// The operands in order, and how many of the three there are.
    pub fn operands(&self) -> ([Id; 3], usize) {
        match *self {
            Self::Number(_) | Self::Input(_) => ([Id(0); 3], 0),
            Self::Component(a, _)
            | Self::Unary(_, a)
            | Self::WholePower(a, _)
            | Self::Length(a)
            | Self::Normalize(a)
            | Self::SpaceNoise(_, a) => ([a; 3], 1),
            Self::Binary(_, a, b)
            | Self::Vectors(_, a, b)
            | Self::Scale(a, b)
            | Self::Shrink(a, b)
            | Self::Dot(a, b)
            | Self::Cross(a, b)
            | Self::PlaneNoise(_, a, b) => ([a, b, b], 2),
            Self::Compose(all)
            | Self::Mix(all)
            | Self::Smoothstep(all)
            | Self::Select(all)
            | Self::MixVectors(all)
            | Self::SelectVectors(all) => (all, 3),
        }
    }

    /// The same operation on other operands.
    pub fn with_operands(self, f: impl Fn(Id) -> Id) -> Self {
        match self {
            Self::Number(_) | Self::Input(_) => self,
            Self::Component(a, axis) => Self::Component(f(a), axis),
            Self::Unary(op, a) => Self::Unary(op, f(a)),
            Self::WholePower(a, exponent) => Self::WholePower(f(a), exponent),
            Self::Length(a) => Self::Length(f(a)),
            Self::Normalize(a) => Self::Normalize(f(a)),
            Self::SpaceNoise(kind, a) => Self::SpaceNoise(kind, f(a)),
            Self::PlaneNoise(kind, a, b) => Self::PlaneNoise(kind, f(a), f(b)),
            Self::Binary(op, a, b) => Self::Binary(op, f(a), f(b)),
            Self::Vectors(op, a, b) => Self::Vectors(op, f(a), f(b)),
            Self::Scale(a, b) => Self::Scale(f(a), f(b)),
            Self::Shrink(a, b) => Self::Shrink(f(a), f(b)),
            Self::Dot(a, b) => Self::Dot(f(a), f(b)),
            Self::Cross(a, b) => Self::Cross(f(a), f(b)),
            Self::Compose(all) => Self::Compose(all.map(f)),
            Self::Mix(all) => Self::Mix(all.map(f)),
            Self::Smoothstep(all) => Self::Smoothstep(all.map(f)),
            Self::Select(all) => Self::Select(all.map(f)),
            Self::MixVectors(all) => Self::MixVectors(all.map(f)),
            Self::SelectVectors(all) => Self::SelectVectors(all.map(f)),
        }
    }

    /// The result, from those of the operands.
    pub fn apply<R: Real>(self, inputs: &Inputs<R>, of: impl Fn(Id) -> Value<R>) -> Value<R> {
        let number = |id| of(id).number();
        let vector = |id| of(id).vector();
        if self.is_vector() {
            Value::Vector(match self {
                Self::Compose([x, y, z]) => R::Vec3::new(number(x), number(y), number(z)),
                Self::Vectors(op, a, b) => semantics::binary_vectors::<R>(op, vector(a), vector(b)),
                Self::Scale(a, b) => vector(a) * number(b),
                Self::Shrink(a, b) => vector(a) / number(b),
                Self::MixVectors([a, b, t]) => semantics::mix_vectors::<R>(vector(a), vector(b), number(t)),
                Self::SelectVectors([c, a, b]) => vector(if semantics::is_true(number(c)) { a } else { b }),
                Self::Cross(a, b) => vector(a).cross(vector(b)),
                Self::Normalize(a) => vector(a).normalize(),
                Self::Input(variable) => inputs.vector(variable),
                _ => R::Vec3::ZERO,
            })
        } else {
            Value::Number(match self {
                Self::Number(bits) => R::from_f64(f64::from_bits(bits)),
                Self::Component(a, axis) => vector(a).axis(usize::from(axis)),
                Self::Unary(op, a) => semantics::unary(op, number(a)),
                Self::Binary(op, a, b) => semantics::binary(op, number(a), number(b)),
                Self::WholePower(a, exponent) => semantics::whole_power(number(a), exponent),
                Self::Mix([a, b, t]) => semantics::mix(number(a), number(b), number(t)),
                Self::Smoothstep([low, high, x]) => semantics::smoothstep(number(low), number(high), number(x)),
                Self::Select([c, a, b]) => number(if semantics::is_true(number(c)) { a } else { b }),
                Self::Dot(a, b) => vector(a).dot(vector(b)),
                Self::Length(a) => vector(a).length(),
                Self::SpaceNoise(kind, a) => semantics::space_noise(kind, vector(a)),
                Self::PlaneNoise(kind, a, b) => semantics::plane_noise(kind, number(a), number(b)),
                Self::Input(variable) => inputs.number(variable),
                _ => R::ZERO,
            })
        }
    }
}

/// The nodes of one expression under construction.
#[derive(Debug, Default)]
pub(super) struct Graph {
    nodes: Vec<Operation>,
    known: HashMap<Operation, Id>,
}

impl Graph {
    /// The operation of a node.
    pub fn get(&self, id: Id) -> Operation {
        self.nodes[id.index()]
    }

    /// A constant.
    pub fn number(&mut self, value: f64) -> Id {
        self.intern(Operation::Number(value.to_bits()))
    }

    /// The value of a constant number.
    pub fn as_number(&self, id: Id) -> Option<f64> {
        match self.get(id) {
            Operation::Number(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// The value of a constant, number or vector.
    pub fn as_constant(&self, id: Id) -> Option<Value<f64>> {
        match self.get(id) {
            Operation::Number(bits) => Some(Value::Number(f64::from_bits(bits))),
            Operation::Compose([x, y, z]) => {
                Some(Value::Vector(glam::DVec3::new(self.as_number(x)?, self.as_number(y)?, self.as_number(z)?)))
            }
            _ => None,
        }
    }

    fn intern(&mut self, operation: Operation) -> Id {
        if let Some(id) = self.known.get(&operation) {
            return *id;
        }
        let id = Id::new(self.nodes.len());
        self.nodes.push(operation);
        self.known.insert(operation, id);
        id
    }

    /// The node of this operation: folded, simplified, shared.
    pub fn add(&mut self, operation: Operation) -> Id {
        let (operands, count) = operation.operands();
        let constant = !matches!(operation, Operation::Input(_) | Operation::Number(_) | Operation::Compose(_))
            && operands[..count].iter().all(|id| self.as_constant(*id).is_some());
        if constant {
            let value = operation.apply(&Inputs::default(), |id| self.as_constant(id).unwrap_or(Value::Number(f64::NAN)));
            return match value {
                Value::Number(x) => self.number(x),
                Value::Vector(v) => self.vector(v),
            };
        }
        match self.simplify(operation) {
            Simplified::Same(id) => id,
            Simplified::To(operation) => self.intern(operation),
        }
    }

    fn vector(&mut self, v: glam::DVec3) -> Id {
        let components = [self.number(v.x), self.number(v.y), self.number(v.z)];
        self.intern(Operation::Compose(components))
    }

    /// The operations that `root` needs, in order, with ids that count within the list; `root` is the last.
    pub fn reachable(&self, root: Id) -> Vec<Operation> {
        let mut needed = vec![false; root.index() + 1];
        needed[root.index()] = true;
        for index in (0..=root.index()).rev() {
            if needed[index] {
                let (operands, count) = self.nodes[index].operands();
                operands[..count].iter().for_each(|id| needed[id.index()] = true);
            }
        }
        let mut place = vec![Id(0); root.index() + 1];
        let mut list = Vec::new();
        for (index, operation) in self.nodes[..=root.index()].iter().enumerate().filter(|(index, _)| needed[*index]) {
            place[index] = Id::new(list.len());
            list.push(operation.with_operands(|id| place[id.index()]));
        }
        list
    }
}
