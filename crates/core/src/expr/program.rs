//! Compiled expressions, ready to be evaluated at hits.

use core::any::Any;
use core::ops::Range;

use raywright_bvh::scalar::{Real, Vector};

use super::assemble::{Assembly, assemble};
use super::error::{ExprError, Result};
use super::graph::{Graph, Id, Operation, Value};
use super::run::{Code, Lanes, Row};
use super::scope::{Inputs, Variable};

/// Operations that a program may have.
pub const MAX_OPERATIONS: usize = 1024;

/// Rows that a file of registers may have: the smallest that holds a program is the one that is set up at each hit.
const FILE_SIZES: [usize; 4] = [4, 8, 16, 64];

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
    code: Code,
    /// The file of registers before the first step, in each scalar type: constants in their places.
    single: Vec<Row<f32>>,
    double: Vec<Row<f64>>,
    constant: Option<Constant>,
    variables: Vec<Variable>,
}

impl Program {
    pub(super) fn new(graph: &Graph, root: Id, span: Range<usize>) -> Result<Self> {
        let operations = graph.reachable(root);
        if operations.len() > MAX_OPERATIONS {
            let message = format!("this expression has {} operations; the limit is {MAX_OPERATIONS}", operations.len());
            return Err(ExprError::new(message, span));
        }
        let variables = operations.iter().filter_map(|operation| match operation {
            Operation::Input(variable) => Some(*variable),
            _ => None,
        });
        let variables = variables.collect();
        let Assembly { code, mut template } = assemble(operations, &span)?;
        let size = FILE_SIZES.into_iter().find(|size| template.len() <= *size).unwrap_or(template.len());
        template.resize(size, [0.0; 4]);
        let constant = graph.as_constant(root).map(|value| match value {
            Value::Number(x) => Constant::Number(x),
            Value::Vector(v) => Constant::Vector(v.to_array()),
        });
        Ok(Self {
            code,
            single: template.iter().map(|row| row.map(|x| x as f32)).collect(),
            double: template,
            constant,
            variables,
        })
    }

    /// The result's row; a number in every place. Which scalar type it is, and so which template, is known at compile time.
    #[inline(always)]
    fn run<R: Real>(&self, inputs: &Inputs<R>) -> Row<R> {
        let inputs: &dyn Any = inputs;
        if let Some(inputs) = inputs.downcast_ref::<Inputs<f32>>() {
            self.run_on(&self.single, inputs).map(R::from_f32)
        } else if let Some(inputs) = inputs.downcast_ref::<Inputs<f64>>() {
            self.run_on(&self.double, inputs).map(R::from_f64)
        } else {
            [R::ZERO; 4]
        }
    }

    #[inline(always)]
    fn run_on<R: Lanes>(&self, template: &[Row<R>], inputs: &Inputs<R>) -> Row<R> {
        match template.len() {
            4 => self.code.run::<R, 4>(template, inputs),
            8 => self.code.run::<R, 8>(template, inputs),
            16 => self.code.run::<R, 16>(template, inputs),
            _ => self.code.run::<R, 64>(template, inputs),
        }
    }

    /// The value as a number; the first component of a vector.
    #[inline]
    pub fn scalar<R: Real>(&self, inputs: &Inputs<R>) -> R {
        self.run(inputs)[0]
    }

    /// The value as a vector; a number in every component.
    #[inline]
    pub fn vector<R: Real>(&self, inputs: &Inputs<R>) -> R::Vec3 {
        let [x, y, z, _] = self.run(inputs);
        R::Vec3::new(x, y, z)
    }

    /// The value, where it is the same at every hit.
    pub fn is_constant(&self) -> Option<Constant> {
        self.constant
    }

    /// The value is a vector.
    pub fn is_vector(&self) -> bool {
        self.code.is_vector
    }

    /// Whether the value depends on this variable.
    pub fn uses(&self, variable: Variable) -> bool {
        self.variables.contains(&variable)
    }
}
