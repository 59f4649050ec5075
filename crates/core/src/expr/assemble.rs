//! Registers for the steps of a program, by one walk over them: a register is free again after its last use.

use std::ops::Range;

use super::error::{ExprError, Result};
use super::graph::{Id, Operation};
use super::run::{Code, input_place};
use super::select::{Selector, Tile};
use super::semantics::vanishing;
use super::step::Step;

/// Numbers in the largest file: as many as a register's name can tell apart.
const REGISTERS: usize = 256;

/// Steps with their registers, and the file before the first one: constants in their places.
pub(super) struct Assembly {
    pub code: Code,
    pub template: Vec<[f64; 4]>,
}

/// Which places of the file are taken.
struct Registers {
    taken: [bool; REGISTERS],
    rows: usize,
}

impl Registers {
    /// A free place for a number, or a free row for a vector.
    fn take(&mut self, is_vector: bool) -> Option<usize> {
        let width = if is_vector { 4 } else { 1 };
        let first = self.taken.chunks(width).position(|places| places.iter().all(|taken| !taken))? * width;
        self.taken[first..first + width].fill(true);
        self.rows = self.rows.max(first / 4 + 1);
        Some(first)
    }

    fn free(&mut self, first: usize, is_vector: bool) {
        let width = if is_vector { 4 } else { 1 };
        self.taken[first..first + width].fill(false);
    }
}

/// Chooses steps and registers for operations whose last one is the result; `span` is the place for an error.
pub(super) fn assemble(operations: Vec<Operation>, span: &Range<usize>) -> Result<Assembly> {
    let selector = Selector::new(operations);
    let operations = selector.operations();
    let tiles = selector.tiles();
    let too_many = || {
        let error = ExprError::new("this expression keeps too many values at once", span.clone());
        error.with_hint(format!("numbers and constants share {REGISTERS} places, and a vector takes four"))
    };
    let is_vector = |id: Id| operations[id.index()].is_vector();
    let holder = |id: Id| selector.part_of(id).0;
    let root = selector.root;

    let mut registers = Registers { taken: [false; REGISTERS], rows: 0 };
    let mut places: Vec<Option<usize>> = vec![None; operations.len()];
    let rows = place_inputs(operations, &mut registers, &mut places);
    let mut constants = Vec::new();
    for id in tiles.iter().flat_map(|tile| tile.operands()).chain([&root]) {
        if selector.is_constant(*id) && places[id.index()].is_none() {
            places[id.index()] = Some(registers.take(is_vector(*id)).ok_or_else(too_many)?);
            constants.push(*id);
        }
    }
    let mut last_use = vec![0; operations.len()];
    for (index, tile) in tiles.iter().enumerate() {
        for id in tile.operands() {
            let last = &mut last_use[holder(*id).index()];
            *last = index.max(*last);
        }
    }
    last_use[holder(root).index()] = usize::MAX;

    let register = |places: &[Option<usize>], id: Id| {
        let (of, axis) = selector.part_of(id);
        (places[of.index()].unwrap_or_default() + usize::from(axis)) as u8
    };
    let mut steps = Vec::with_capacity(tiles.len());
    for (index, tile) in tiles.iter().enumerate() {
        let mut from = [0; 4];
        for (slot, id) in from.iter_mut().zip(tile.operands()) {
            *slot = register(&places, *id);
        }
        for id in tile.operands().iter().map(|id| holder(*id)).filter(|id| last_use[id.index()] == index) {
            if let Some(first) = places[id.index()] {
                registers.free(first, is_vector(id));
            }
        }
        let to = registers.take(is_vector(tile.id)).ok_or_else(too_many)?;
        places[tile.id.index()] = Some(to);
        let &Tile { is_sum, opcode, rare, whole, .. } = tile;
        steps.push(Step { is_sum, opcode, rare, to: to as u8, from, whole, limit: vanishing(whole) });
    }
    let template = template(operations, &constants, &places, registers.rows);
    let code = Code { steps, rows, is_vector: is_vector(root), result: register(&places, root) };
    Ok(Assembly { code, template })
}

/// Gives the rows of the hit that are read the first rows of the file, and says which they are.
fn place_inputs(operations: &[Operation], registers: &mut Registers, places: &mut [Option<usize>]) -> u8 {
    let inputs = || {
        operations.iter().enumerate().filter_map(|(index, operation)| match operation {
            Operation::Input(variable) => Some((index, input_place(*variable))),
            _ => None,
        })
    };
    let rows = inputs().fold(0, |rows, (_, (row, _))| rows | 1 << row);
    for (index, (row, lane)) in inputs() {
        let before: u8 = rows & ((1 << row) - 1);
        places[index] = Some(4 * before.count_ones() as usize + usize::from(lane));
    }
    for _ in 0..rows.count_ones() {
        registers.take(true);
    }
    rows
}

fn template(operations: &[Operation], constants: &[Id], places: &[Option<usize>], rows: usize) -> Vec<[f64; 4]> {
    let number = |id: Id| match operations[id.index()] {
        Operation::Number(bits) => f64::from_bits(bits),
        _ => 0.0,
    };
    let mut template = vec![[0.0; 4]; rows];
    for id in constants {
        let first = places[id.index()].unwrap_or_default();
        match operations[id.index()] {
            Operation::Compose([x, y, z]) => template[first / 4] = [number(x), number(y), number(z), 0.0],
            _ => template[first / 4][first % 4] = number(*id),
        }
    }
    template
}
