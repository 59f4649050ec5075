//! Compiler from an expression's graph to a program: instructions over registers, in the order of
//! execution.

use core::ops::Range;

use raywright_bvh::scalar::{Real, Vector};

use super::graph::{Constant, ExprGraph, ExprNode, NodeId};
use super::run::{Instruction, RegisterFile, RegisterRow};
use super::scope::{ExprError, Result, Variable, VariableValues};

/// Greatest number of operations of a program.
pub(crate) const MAX_OPERATIONS: usize = 1024;

/// Possible sizes of the register file, in rows of four registers. A program uses the smallest
/// sufficient size, because the file is initialised at each hit. Each row holds the result of at
/// least one operation, so a program has no more rows than operations.
pub(super) const SIZES: [usize; 4] = [8, 16, 64, MAX_OPERATIONS];

/// Position of a program in the tables of [`ProgramTable`](super::ProgramTable), and its
/// properties.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ProgramHeader {
    /// Index of the first instruction, and number of instructions.
    pub steps: [u32; 2],
    /// Index of the first row of registers, and number of rows.
    pub registers: [u32; 2],
    /// Bit mask of the rows of variables that the program reads; [`Variable::register_position`]
    /// defines the rows.
    pub variable_rows: u8,
    /// Whether the value is a vector.
    pub is_vector: bool,
    /// Register of the program's value.
    pub result: u16,
    /// Bit mask of the variables that the program reads, a [`Variable::bit_mask`] each.
    pub variables: u32,
}

/// A compiled expression: instructions over registers. The first registers hold variables, the
/// following registers hold constants, and the last registers hold results.
/// [`ProgramTable`](super::ProgramTable) runs programs in its scalar.
#[derive(Clone, Debug)]
pub struct Program {
    pub(super) steps: Vec<Instruction>,
    /// Registers before the first instruction, with the constants.
    pub(super) registers: Vec<[f64; 4]>,
    pub(super) header: ProgramHeader,
    constant: Option<Constant>,
}

impl Program {
    /// Compiles the part of a graph on which the node `root` depends. `span` is the place of the
    /// expression in its source.
    ///
    /// # Errors
    /// More than [`MAX_OPERATIONS`] operations.
    pub(super) fn new(graph: &ExprGraph, root: NodeId, span: Range<usize>) -> Result<Self> {
        let nodes = graph.nodes_up_to(root);
        let last_uses = find_last_readers(nodes);
        let count = last_uses.iter().flatten().count();
        if count > MAX_OPERATIONS {
            let message = format!(
                "this expression has {count} operations, but at most {MAX_OPERATIONS} are allowed; shorten the expression"
            );
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
        let rows = variables().fold(0_u8, |rows, variable| {
            rows | 1 << variable.register_position().0
        });
        let mut layout = RegisterLayout {
            registers: vec![[0.0; 4]; rows.count_ones() as usize],
            ..RegisterLayout::default()
        };
        let mut steps = Vec::new();
        let mut places = vec![0; nodes.len()];
        for (index, node, last_use) in needed() {
            places[index] = match node {
                ExprNode::Input(variable) => {
                    let (row, lane) = variable.register_position();
                    4 * (rows & ((1 << row) - 1)).count_ones() as u16 + u16::from(lane)
                }
                ExprNode::Number(bits) => layout.store_constant(f64::from_bits(bits)),
                ExprNode::Vector([x, y, z]) => {
                    layout.reserve_register_row([x, y, z, 0].map(f64::from_bits))
                }
                ExprNode::Component(of, axis) => places[of.index()] + u16::from(axis),
                ExprNode::Operation(operation, operands) => {
                    let to = layout.reserve_result_registers(index, last_use);
                    steps.push(Instruction {
                        operation,
                        destination: to,
                        sources: operands.map(|id| places[id.index()]),
                    });
                    to
                }
            };
        }
        let reads = variables().fold(0, |reads, variable| reads | variable.bit_mask());
        let header = ProgramHeader {
            variable_rows: rows,
            result: places[root.index()],
            is_vector: graph.is_vector(root),
            variables: reads,
            ..ProgramHeader::default()
        };
        Ok(Self {
            steps,
            registers: layout.into_register_file(),
            header,
            constant: graph.constant_node_value(root),
        })
    }

    /// Returns the value of a program that reads no variable, else `None`.
    pub fn constant_value(&self) -> Option<Constant> {
        self.constant
    }

    /// Whether the value is a vector.
    pub fn is_vector(&self) -> bool {
        self.header.is_vector
    }

    /// Whether the program reads a variable.
    pub fn uses_variable(&self, variable: Variable) -> bool {
        self.header.variables & variable.bit_mask() != 0
    }
}

/// Registers of a program under construction.
#[derive(Default)]
struct RegisterLayout {
    registers: Vec<[f64; 4]>,
    /// Number of constant numbers so far, four per row, and the row of the last constant.
    numbers: (usize, usize),
    /// First registers of the rows with results, each with the node that reads it last.
    results: Vec<(u16, usize)>,
    /// First registers of the rows free for reuse.
    free: Vec<u16>,
}

impl RegisterLayout {
    /// Reserves a row with the given content and returns its first register.
    fn reserve_register_row(&mut self, row: [f64; 4]) -> u16 {
        self.registers.push(row);
        4 * (self.registers.len() - 1) as u16
    }

    /// Stores a constant number and returns its register.
    fn store_constant(&mut self, x: f64) -> u16 {
        let (count, row) = self.numbers;
        let lane = count % 4;
        let row = if lane == 0 {
            usize::from(self.reserve_register_row([0.0; 4]) / 4)
        } else {
            row
        };
        self.registers[row][lane] = x;
        self.numbers = (count + 1, row);
        (4 * row + lane) as u16
    }

    /// Returns the rows before the first instruction, filled up to one of the [`SIZES`].
    fn into_register_file(self) -> Vec<[f64; 4]> {
        let mut registers = self.registers;
        registers.resize(
            SIZES
                .into_iter()
                .find(|size| registers.len() <= *size)
                .unwrap_or(registers.len()),
            [0.0; 4],
        );
        registers
    }

    /// Reserves a row for the result of a node and returns its first register. The row of an
    /// operand that is read for the last time may be reused.
    fn reserve_result_registers(&mut self, index: usize, last_use: usize) -> u16 {
        let Self { results, free, .. } = self;
        free.extend(
            results
                .extract_if(.., |(_, last_use)| *last_use <= index)
                .map(|(place, _)| place),
        );
        let place = self
            .free
            .pop()
            .unwrap_or_else(|| self.reserve_register_row([0.0; 4]));
        self.results.push((place, last_use));
        place
    }
}

/// Returns, for each node, the index of the last node that reads it, directly or through a
/// component; `None` for a node on which the value of the expression does not depend.
fn find_last_readers(nodes: &[ExprNode]) -> Vec<Option<usize>> {
    let mut last_uses = vec![None; nodes.len()];
    if let Some(root) = last_uses.last_mut() {
        *root = Some(usize::MAX);
    }
    for (index, node) in nodes.iter().enumerate().rev() {
        let reader = match node {
            ExprNode::Component(..) => last_uses[index],
            _ => last_uses[index].map(|_| index),
        };
        for id in node.operands() {
            last_uses[id.index()] = reader.max(last_uses[id.index()]);
        }
    }
    last_uses
}

// Table of all programs of a scene, for evaluation at hits in the scene's scalar.

/// Table of programs (compiled expressions). [`ProgramTable::add`] returns the index of a program.
/// With this index, any thread can evaluate the program without allocation.
///
/// ```
/// use std::collections::BTreeMap;
/// use raywright_core::expr::{ProgramTable, ExprScope, VariableValues, compile};
///
/// let mut programs = ProgramTable::<f32>::default();
/// let stripes = programs.add(&compile("fract(4*u) < 0.5 ? 1 : 0.2", &BTreeMap::new(), ExprScope::Surface)?);
/// assert_eq!(programs.eval_scalar(stripes, &VariableValues { u: 0.2, ..VariableValues::default() }), 0.2);
/// # Ok::<(), raywright_core::expr::ExprError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct ProgramTable<R: Real> {
    pub(super) steps: Vec<Instruction>,
    /// Initial registers of all programs, which contain the constants.
    pub(super) registers: Vec<RegisterRow<R>>,
    pub(super) headers: Vec<ProgramHeader>,
}

/// Returns `count` entries of a table, beginning with entry `start`.
#[inline(always)]
pub(super) fn table_slice<T>(table: &[T], [start, count]: [u32; 2]) -> &[T] {
    &table[start as usize..][..count as usize]
}

impl<R: Real> ProgramTable<R> {
    /// Creates a table with a single program, whose index is 0.
    pub fn from_program(program: &Program) -> Self {
        let mut programs = Self::default();
        programs.add(program);
        programs
    }

    /// Adds a program and returns its index.
    pub fn add(&mut self, program: &Program) -> u32 {
        let place = |len: usize, count: usize| [len as u32, count as u32];
        let steps = place(self.steps.len(), program.steps.len());
        let registers = place(self.registers.len(), program.registers.len());
        self.steps.extend_from_slice(&program.steps);
        self.registers
            .extend(program.registers.iter().map(|row| row.map(R::from_f64)));
        self.headers.push(ProgramHeader {
            steps,
            registers,
            ..program.header
        });
        self.headers.len() as u32 - 1
    }

    /// Runs a program and returns its value as a row of four registers. If the value is a number,
    /// all four registers hold it.
    #[inline(always)]
    fn run_program(&self, program: u32, inputs: &VariableValues<R>) -> RegisterRow<R> {
        let head = &self.headers[program as usize];
        match head.registers[1] {
            8 => self.run_with_rows::<8>(head, inputs),
            16 => self.run_with_rows::<16>(head, inputs),
            64 => self.run_with_rows::<64>(head, inputs),
            _ => self.run_with_rows::<MAX_OPERATIONS>(head, inputs),
        }
    }

    /// Runs a program that needs at most `ROWS` rows of four registers.
    #[inline(never)]
    fn run_with_rows<const ROWS: usize>(
        &self,
        head: &ProgramHeader,
        inputs: &VariableValues<R>,
    ) -> RegisterRow<R> {
        let Some(registers) = table_slice(&self.registers, head.registers).first_chunk::<ROWS>()
        else {
            return [R::ZERO; 4];
        };
        let mut file = RegisterFile([[R::ZERO; 4]; ROWS]);
        // The copy is in two halves: for more than eight rows the compiler emits a call, which
        // takes longer than some programs.
        let (half, other) = file.0.split_at_mut(ROWS / 2);
        half.copy_from_slice(&registers[..ROWS / 2]);
        other.copy_from_slice(&registers[ROWS / 2..]);
        file.load_variables(inputs, head.variable_rows);
        for step in table_slice(&self.steps, head.steps) {
            file.execute(*step);
        }
        if head.is_vector {
            file.vector(head.result).into()
        } else {
            [file.number(head.result); 4]
        }
    }

    /// Evaluates a program as a number. If its value is a vector, the first component is returned.
    ///
    /// # Panics
    /// If the program does not exist.
    #[inline]
    pub fn eval_scalar(&self, program: u32, inputs: &VariableValues<R>) -> R {
        self.run_program(program, inputs)[0]
    }

    /// Evaluates a program as a vector. If its value is a number, every component has this value.
    ///
    /// # Panics
    /// If the program does not exist.
    #[inline]
    pub fn eval_vector(&self, program: u32, inputs: &VariableValues<R>) -> R::Vec3 {
        let [x, y, z, _] = self.run_program(program, inputs);
        R::Vec3::new(x, y, z)
    }

    /// Whether a program reads a variable.
    ///
    /// # Panics
    /// If the program does not exist.
    pub fn uses_variable(&self, program: u32, variable: Variable) -> bool {
        self.headers[program as usize].variables & variable.bit_mask() != 0
    }
}
