//! Compiled expressions, ready to be evaluated at hits.

use core::any::Any;
use core::ops::Range;

use raywright_bvh::scalar::{Real, Vector};

use super::error::{ExprError, Result};
use super::graph::{Constant, Graph, Id, Node};
use super::run::{File, Lanes, Row, Step};
use super::scope::{Inputs, Variable};

/// Operations that a program may have.
pub const MAX_OPERATIONS: usize = 1024;

/// Rows of registers that a program may have: the least that will do are set up at each hit. A row holds at least one of
/// the operations, so that there are never more.
const SIZES: [usize; 4] = [8, 16, 64, MAX_OPERATIONS];

/// An expression ready to be evaluated at hits, in f32 or f64, from any thread and without allocating: steps over
/// registers, the first of which hold the variables, the next ones constants, and the rest what steps computed.
#[derive(Clone, Debug)]
pub struct Program {
    steps: Vec<Step>,
    /// Bit i is set where row i of the hit is read, see [`Variable::place`].
    rows: u8,
    /// The registers before the first step, in each scalar type.
    single: Vec<Row<f32>>,
    double: Vec<Row<f64>>,
    /// The place of the value in them.
    result: u16,
    is_vector: bool,
    constant: Option<Constant>,
    variables: Vec<Variable>,
}

impl Program {
    pub(super) fn new(graph: &Graph, root: Id, span: Range<usize>) -> Result<Self> {
        let nodes = graph.up_to(root);
        let last_uses = last_uses(nodes);
        let count = last_uses.iter().flatten().count();
        if count > MAX_OPERATIONS {
            let message = format!("this expression has {count} operations; the limit is {MAX_OPERATIONS}");
            return Err(ExprError::new(message, span));
        }
        let needed =
            || nodes.iter().zip(&last_uses).enumerate().filter_map(|(index, (node, last))| Some((index, *node, (*last)?)));
        let variables: Vec<Variable> = needed().filter_map(|(_, node, _)| node.variable()).collect();
        let rows = variables.iter().fold(0_u8, |rows, variable| rows | 1 << variable.place().0);
        let mut layout = Layout { registers: vec![[0.0; 4]; rows.count_ones() as usize], ..Layout::default() };
        let mut steps = Vec::new();
        let mut places = vec![0; nodes.len()];
        for (index, node, last_use) in needed() {
            places[index] = match node {
                Node::Input(variable) => {
                    let (row, lane) = variable.place();
                    4 * (rows & ((1 << row) - 1)).count_ones() as u16 + u16::from(lane)
                }
                Node::Number(bits) => layout.number(f64::from_bits(bits)),
                Node::Vector([x, y, z]) => layout.row([x, y, z, 0].map(f64::from_bits)),
                Node::Component(of, axis) => places[of.index()] + u16::from(axis),
                Node::Operation(operation, operands) => {
                    let to = layout.result(index, last_use);
                    steps.push(Step { operation, to, from: operands.map(|id| places[id.index()]) });
                    to
                }
            };
        }
        let mut double = layout.registers;
        double.resize(SIZES.into_iter().find(|size| double.len() <= *size).unwrap_or(double.len()), [0.0; 4]);
        let single = double.iter().map(|row| row.map(|x| x as f32)).collect();
        let result = places[root.index()];
        Ok(Self {
            steps,
            rows,
            single,
            double,
            result,
            is_vector: graph.is_vector(root),
            constant: graph.constant(root),
            variables,
        })
    }

    /// The value's row; a number in every place. Which scalar type it is, and so which registers, the compiler knows.
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
    fn run_on<R: Lanes>(&self, registers: &[Row<R>], inputs: &Inputs<R>) -> Row<R> {
        match registers.len() {
            8 => self.run_in::<R, 8>(registers, inputs),
            16 => self.run_in::<R, 16>(registers, inputs),
            64 => self.run_in::<R, 64>(registers, inputs),
            _ => self.run_in::<R, MAX_OPERATIONS>(registers, inputs),
        }
    }

    #[inline(never)]
    fn run_in<R: Lanes, const ROWS: usize>(&self, registers: &[Row<R>], inputs: &Inputs<R>) -> Row<R> {
        let Some(registers) = registers.first_chunk::<ROWS>() else { return [R::ZERO; 4] };
        let mut file = File([[R::ZERO; 4]; ROWS]);
        // Of more than eight rows at once, the compiler makes a call, which takes longer than many a program.
        let (half, other) = file.0.split_at_mut(ROWS / 2);
        half.copy_from_slice(&registers[..ROWS / 2]);
        other.copy_from_slice(&registers[ROWS / 2..]);
        file.load(inputs, self.rows);
        for step in &self.steps {
            file.perform(*step);
        }
        if self.is_vector { R::row(file.vector(self.result)) } else { [file.number(self.result); 4] }
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
        self.is_vector
    }

    /// Whether the value depends on this variable.
    pub fn uses(&self, variable: Variable) -> bool {
        self.variables.contains(&variable)
    }
}

/// The registers of a program while it is made.
#[derive(Default)]
struct Layout {
    registers: Vec<[f64; 4]>,
    /// Constant numbers so far, four to a row, and the row of the last of them.
    numbers: (usize, usize),
    /// Rows that hold results, each with the last use of it, and rows that do no longer.
    results: Vec<(u16, usize)>,
    free: Vec<u16>,
}

impl Layout {
    /// A place for a vector, or for a number that has a row for itself.
    fn row(&mut self, row: [f64; 4]) -> u16 {
        self.registers.push(row);
        4 * (self.registers.len() - 1) as u16
    }

    fn number(&mut self, x: f64) -> u16 {
        let (count, row) = self.numbers;
        let lane = count % 4;
        let row = if lane == 0 { usize::from(self.row([0.0; 4]) / 4) } else { row };
        self.registers[row][lane] = x;
        self.numbers = (count + 1, row);
        (4 * row + lane) as u16
    }

    /// A place for the result of this node, which may be that of one it is the last to use.
    fn result(&mut self, index: usize, last_use: usize) -> u16 {
        let Self { results, free, .. } = self;
        free.extend(results.extract_if(.., |(_, last_use)| *last_use <= index).map(|(place, _)| place));
        let place = self.free.pop().unwrap_or_else(|| self.row([0.0; 4]));
        self.results.push((place, last_use));
        place
    }
}

/// Index of the last node that reads each one, those that read a component of it among them; none for what the last node
/// does not need.
fn last_uses(nodes: &[Node]) -> Vec<Option<usize>> {
    let mut last_uses = vec![None; nodes.len()];
    if let Some(root) = last_uses.last_mut() {
        *root = Some(usize::MAX);
    }
    for (index, node) in nodes.iter().enumerate().rev() {
        let reader = match node {
            Node::Component(..) => last_uses[index],
            _ => last_uses[index].map(|_| index),
        };
        for id in node.operands() {
            last_uses[id.index()] = reader.max(last_uses[id.index()]);
        }
    }
    last_uses
}
