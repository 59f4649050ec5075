//! Compiled expressions: the operations of a graph in order, run over a fixed file of registers.

use raywright_bvh::scalar::Real;

use super::error::{ExprError, Result};
use super::graph::{Graph, Id, Operation, Value};
use super::scope::{Inputs, Variable};

/// Operations that a program may have.
pub const MAX_OPERATIONS: usize = 256;

/// The value of an expression that is the same at every hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constant {
    /// A number.
    Number(f64),
    /// A vector, or linear red, green and blue.
    Vector([f64; 3]),
}

/// An expression ready to be evaluated at hits, in f32 or f64, from any thread and without allocating.
#[derive(Clone, Debug)]
pub struct Program {
    operations: Vec<Operation>,
}

impl Program {
    pub(super) fn new(graph: &Graph, root: Id, span: core::ops::Range<usize>) -> Result<Self> {
        let operations = graph.reachable(root);
        if operations.len() > MAX_OPERATIONS {
            let message = format!("this expression has {} operations; the limit is {MAX_OPERATIONS}", operations.len());
            return Err(ExprError::new(message, span));
        }
        Ok(Self { operations })
    }

    fn run<R: Real>(&self, inputs: &Inputs<R>) -> Value<R> {
        let mut registers = [Value::Number(R::ZERO); MAX_OPERATIONS];
        let mut last = Value::Number(R::ZERO);
        for (register, operation) in self.operations.iter().enumerate() {
            last = operation.apply(inputs, |id| registers[id.index()]);
            registers[register] = last;
        }
        last
    }

    /// The value as a number; the first component of a vector.
    pub fn scalar<R: Real>(&self, inputs: &Inputs<R>) -> R {
        self.run(inputs).number()
    }

    /// The value as a vector; a number in every component.
    pub fn vector<R: Real>(&self, inputs: &Inputs<R>) -> R::Vec3 {
        self.run(inputs).vector()
    }

    /// The value, where it is the same at every hit.
    pub fn is_constant(&self) -> Option<Constant> {
        if self.operations.iter().any(|operation| matches!(operation, Operation::Input(_))) {
            return None;
        }
        Some(match self.run::<f64>(&Inputs::default()) {
            Value::Number(x) => Constant::Number(x),
            Value::Vector(v) => Constant::Vector(v.to_array()),
        })
    }

    /// The value is a vector.
    pub fn is_vector(&self) -> bool {
        self.operations.last().is_some_and(|operation| operation.is_vector())
    }

    /// Whether the value depends on this variable.
    pub fn uses(&self, variable: Variable) -> bool {
        self.operations.contains(&Operation::Input(variable))
    }
}
