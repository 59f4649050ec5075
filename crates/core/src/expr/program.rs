//! From an expression's graph to a program: steps over registers, laid out in the order in which
//! they run.

use core::ops::Range;

use super::error::{ExprError, Result};
use super::graph::{Constant, Graph, Id, Node};
use super::run::Step;
use super::scope::Variable;

/// Operations that a program may have.
pub const MAX_OPERATIONS: usize = 1024;

/// Rows of registers that a program may have: the least that will do are set up at each hit. A row
/// holds at least one of the operations, so that there are never more.
pub(super) const SIZES: [usize; 4] = [8, 16, 64, MAX_OPERATIONS];

/// Where a program is, and what is to be known of it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Head {
    /// Its first step and how many there are.
    pub steps: [u32; 2],
    /// Its first row of registers and how many there are.
    pub registers: [u32; 2],
    /// Bit i is set where row i of the hit is read, see [`Variable::place`].
    pub rows: u8,
    pub is_vector: bool,
    /// The place of the value in the registers.
    pub result: u16,
    /// The variables that it reads, see [`Variable::bit`].
    pub reads: u32,
}

/// A compiled expression: steps over registers, the first of which hold the variables, the next
/// ones constants, and the rest what steps computed. It runs among [`Programs`](super::Programs),
/// in the scalar that those have.
#[derive(Clone, Debug)]
pub struct Program {
    pub(super) steps: Vec<Step>,
    /// The registers before the first step.
    pub(super) registers: Vec<[f64; 4]>,
    pub(super) head: Head,
    constant: Option<Constant>,
}

impl Program {
    pub(super) fn new(graph: &Graph, root: Id, span: Range<usize>) -> Result<Self> {
        let nodes = graph.up_to(root);
        let last_uses = last_uses(nodes);
        let count = last_uses.iter().flatten().count();
        if count > MAX_OPERATIONS {
            let message =
                format!("this expression has {count} operations; the limit is {MAX_OPERATIONS}");
            return Err(ExprError::new(message, span));
        }
        let needed = || {
            nodes
                .iter()
                .zip(&last_uses)
                .enumerate()
                .filter_map(|(index, (node, last))| Some((index, *node, (*last)?)))
        };
        let variables = || needed().filter_map(|(_, node, _)| node.variable());
        let rows = variables().fold(0_u8, |rows, variable| rows | 1 << variable.place().0);
        let mut layout = Layout {
            registers: vec![[0.0; 4]; rows.count_ones() as usize],
            ..Layout::default()
        };
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
                    steps.push(Step {
                        operation,
                        to,
                        from: operands.map(|id| places[id.index()]),
                    });
                    to
                }
            };
        }
        let mut registers = layout.registers;
        registers.resize(
            SIZES
                .into_iter()
                .find(|size| registers.len() <= *size)
                .unwrap_or(registers.len()),
            [0.0; 4],
        );
        let reads = variables().fold(0, |reads, variable| reads | variable.bit());
        let head = Head {
            rows,
            result: places[root.index()],
            is_vector: graph.is_vector(root),
            reads,
            ..Head::default()
        };
        Ok(Self {
            steps,
            registers,
            head,
            constant: graph.constant(root),
        })
    }

    /// The value, where it is the same at every hit.
    pub fn is_constant(&self) -> Option<Constant> {
        self.constant
    }

    /// The value is a vector.
    pub fn is_vector(&self) -> bool {
        self.head.is_vector
    }

    /// Whether the value depends on this variable.
    pub fn uses(&self, variable: Variable) -> bool {
        self.head.reads & variable.bit() != 0
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
        let row = if lane == 0 {
            usize::from(self.row([0.0; 4]) / 4)
        } else {
            row
        };
        self.registers[row][lane] = x;
        self.numbers = (count + 1, row);
        (4 * row + lane) as u16
    }

    /// A place for the result of this node, which may be that of one it is the last to use.
    fn result(&mut self, index: usize, last_use: usize) -> u16 {
        let Self { results, free, .. } = self;
        free.extend(
            results
                .extract_if(.., |(_, last_use)| *last_use <= index)
                .map(|(place, _)| place),
        );
        let place = self.free.pop().unwrap_or_else(|| self.row([0.0; 4]));
        self.results.push((place, last_use));
        place
    }
}

/// Index of the last node that reads each one, those that read a component of it among them; none
/// for what the last node does not need.
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
