//! Instruction selection: which operations of a graph become one step together.
//!
//! From the result backwards, each operation that is needed takes with it those of its operands that nothing else uses,
//! where there is a step for the whole. A step computes what the operations alone would, bit for bit.

use super::graph::{Id, Operation};
use super::semantics::{Binary, Noise, Unary};
use super::step::{Opcode, Rare};
use super::sums::Neutral;

/// A step before its registers are known; `id` is the operation whose result it computes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tile {
    pub id: Id,
    /// A sum with a product; the opcode says nothing.
    pub is_sum: bool,
    pub opcode: Opcode,
    pub rare: Rare,
    operands: [Id; 4],
    count: usize,
    pub whole: u32,
}

impl Tile {
    pub fn new(id: Id, opcode: Opcode, operands: &[Id]) -> Self {
        let mut tile = Self { id, is_sum: false, opcode, rare: Rare::None, operands: [id; 4], count: operands.len(), whole: 0 };
        tile.operands.iter_mut().zip(operands).for_each(|(slot, operand)| *slot = *operand);
        tile
    }

    /// a b c + d
    pub fn sum(id: Id, operands: [Id; 4]) -> Self {
        Self { is_sum: true, ..Self::new(id, Opcode::RareNumber, &operands) }
    }

    fn rare(id: Id, opcode: Opcode, rare: Rare, operands: &[Id]) -> Self {
        Self { rare, ..Self::new(id, opcode, operands) }
    }

    /// What it reads.
    pub fn operands(&self) -> &[Id] {
        &self.operands[..self.count]
    }
}

/// The operations of one expression in order, and how often each is used.
pub(super) struct Selector {
    operations: Vec<Operation>,
    uses: Vec<u32>,
    /// The result.
    pub root: Id,
    pub neutral: Neutral,
}

impl Selector {
    /// For operations whose last one is the result.
    pub fn new(mut operations: Vec<Operation>) -> Self {
        let root = Id::new(operations.len().saturating_sub(1));
        let mut uses = vec![0; operations.len()];
        for operation in &operations {
            let (operands, count) = operation.operands();
            operands[..count].iter().for_each(|id| uses[id.index()] += 1);
        }
        let mut place = |operation: Operation| {
            let known = operations.iter().position(|other| *other == operation);
            Id::new(known.unwrap_or_else(|| {
                operations.push(operation);
                operations.len() - 1
            }))
        };
        let neutral = Neutral::new(&mut place);
        uses.resize(operations.len(), 0);
        Self { operations, uses, root, neutral }
    }

    /// The operations, and after them the constants that steps need beside.
    pub fn operations(&self) -> &[Operation] {
        &self.operations
    }

    /// The steps in order. What is constant, of the hit, or part of something else needs none.
    pub fn tiles(&self) -> Vec<Tile> {
        let mut needed = vec![false; self.operations.len()];
        needed[self.root.index()] = true;
        let mut tiles = Vec::new();
        for index in (0..self.operations.len()).rev() {
            let id = Id::new(index);
            if !needed[index] || self.is_constant(id) {
                continue;
            }
            let (of, _) = self.part_of(id);
            if of != id {
                needed[of.index()] = true;
                continue;
            }
            if let Some(tile) = self.tile(id) {
                tile.operands().iter().for_each(|id| needed[id.index()] = true);
                tiles.push(tile);
            }
        }
        tiles.reverse();
        tiles
    }

    /// What holds this result, and where in it: a component lies in its vector, everything else in itself.
    pub fn part_of(&self, id: Id) -> (Id, u8) {
        match self.get(id) {
            Operation::Component(of, axis) => (of, axis),
            _ => (id, 0),
        }
    }

    /// A number or a vector that is known beforehand.
    pub fn is_constant(&self, id: Id) -> bool {
        match self.get(id) {
            Operation::Number(_) => true,
            Operation::Compose(parts) => parts.iter().all(|id| matches!(self.get(*id), Operation::Number(_))),
            _ => false,
        }
    }

    pub fn get(&self, id: Id) -> Operation {
        self.operations[id.index()]
    }

    /// The operation, if nothing but the one that asks uses it.
    pub fn inner(&self, id: Id) -> Option<Operation> {
        (self.uses[id.index()] == 1).then(|| self.get(id))
    }

    /// Two factors whose product nothing else uses.
    pub fn product(&self, id: Id) -> Option<(Id, Id)> {
        match self.inner(id)? {
            Operation::Binary(Binary::Multiply, a, b) => Some((a, b)),
            Operation::WholePower(a, 2) => Some((a, a)),
            _ => None,
        }
    }

    /// The vectors of a product that nothing else uses.
    pub fn dot(&self, id: Id) -> Option<(Id, Id)> {
        match self.inner(id)? {
            Operation::Dot(u, v) => Some((u, v)),
            _ => None,
        }
    }

    /// The step for an operation; none for what already has a place.
    fn tile(&self, id: Id) -> Option<Tile> {
        let tile = |opcode, operands: &[Id]| Tile::new(id, opcode, operands);
        let Neutral { one, minus_one, minus_zero, minus_zeros } = self.neutral;
        Some(match self.get(id) {
            Operation::Input(_) | Operation::Number(_) | Operation::Component(..) => return None,
            Operation::Compose(parts) => tile(Opcode::Compose, &parts),
            Operation::Unary(Unary::Negate, a) => self.times(id, a, minus_one),
            Operation::Unary(op, a) => unary(id, op, a),
            Operation::Binary(op, a, b) => self.binary(id, op, a, b),
            Operation::WholePower(a, 2) => Tile::sum(id, [a, one, a, minus_zero]),
            Operation::WholePower(a, exponent) => self.power(id, a, exponent),
            Operation::Mix([a, b, t]) => tile(Opcode::Mix, &[t, a, b]),
            Operation::Smoothstep([low, high, x]) => tile(Opcode::Smoothstep, &[x, low, high]),
            Operation::Select(all) | Operation::SelectVectors(all) => self.select(id, all),
            Operation::MixVectors([a, b, t]) => tile(Opcode::MixVectors, &[t, a, b]),
            Operation::Vectors(op, a, b) => self.vectors(id, op, a, b),
            Operation::Scale(a, b) => tile(Opcode::VectorSum, &[a, b, minus_zeros]),
            Operation::Shrink(a, b) => tile(Opcode::Shrink, &[a, b]),
            Operation::Dot(a, b) => tile(Opcode::DotSum, &[a, b, one, minus_zero]),
            Operation::Cross(a, b) => Tile::rare(id, Opcode::RareVector, Rare::Cross, &[a, b]),
            Operation::Length(a) => match self.inner(a) {
                Some(Operation::Vectors(Binary::Subtract, x, y)) => tile(Opcode::Distance, &[x, y]),
                _ => tile(Opcode::Length, &[a]),
            },
            Operation::Normalize(a) => tile(Opcode::Normalize, &[a]),
            Operation::SpaceNoise(kind, a) => {
                let (rare, whole) = noise(kind, [Rare::SpaceNoise, Rare::SpaceSum, Rare::SpaceTurbulence]);
                Tile { whole, ..Tile::rare(id, Opcode::RareNumber, rare, &[a]) }
            }
            Operation::PlaneNoise(kind, a, b) => {
                let (rare, whole) = noise(kind, [Rare::PlaneNoise, Rare::PlaneSum, Rare::PlaneTurbulence]);
                Tile { whole, ..Tile::rare(id, Opcode::RareNumber, rare, &[a, b]) }
            }
        })
    }

    fn binary(&self, id: Id, op: Binary, a: Id, b: Id) -> Tile {
        let tile = |opcode, operands: &[Id]| Tile::new(id, opcode, operands);
        match op {
            Binary::Add => self.plus(id, a, b).or_else(|| self.plus(id, b, a)).unwrap_or_else(|| self.term(id, a, b)),
            Binary::Subtract => self.minus(id, a, b),
            Binary::Multiply => self.times(id, a, b),
            Binary::Divide => tile(Opcode::Divide, &[a, b]),
            Binary::Max => tile(Opcode::Max, &[a, b]),
            Binary::Min => match self.inner(a) {
                Some(Operation::Binary(Binary::Max, x, low)) => tile(Opcode::Clamp, &[x, low, b]),
                _ => tile(Opcode::Min, &[a, b]),
            },
            Binary::Checker => tile(Opcode::Checker, &[a, b]),
            _ => Tile::rare(id, Opcode::RareNumber, Rare::Binary(op), &[a, b]),
        }
    }

    fn power(&self, id: Id, a: Id, exponent: i32) -> Tile {
        let whole = exponent.unsigned_abs();
        if exponent < 0 {
            return Tile { whole, ..Tile::rare(id, Opcode::RareNumber, Rare::ReciprocalPower, &[a]) };
        }
        match self.inner(a) {
            Some(Operation::Binary(Binary::Max, x, y)) => Tile { whole, ..Tile::new(id, Opcode::LobePower, &[x, y]) },
            _ => Tile { whole, ..Tile::new(id, Opcode::Power, &[a]) },
        }
    }

    /// A choice between numbers or vectors, with a comparison that comes along.
    fn select(&self, id: Id, [condition, a, b]: [Id; 3]) -> Tile {
        let is_vector = self.get(id).is_vector();
        let less = if is_vector { Opcode::SelectVectorsLess } else { Opcode::SelectLess };
        match self.inner(condition) {
            Some(Operation::Binary(Binary::Less, x, y)) => Tile::new(id, less, &[x, y, a, b]),
            Some(Operation::Binary(Binary::Greater, x, y)) => Tile::new(id, less, &[y, x, a, b]),
            Some(Operation::Binary(Binary::Checker, x, y)) if is_vector => Tile::new(id, Opcode::CheckerVectors, &[x, y, b, a]),
            _ if is_vector => Tile::new(id, Opcode::SelectVectors, &[condition, a, b]),
            _ => Tile::new(id, Opcode::Select, &[condition, a, b]),
        }
    }

    fn vectors(&self, id: Id, op: Binary, a: Id, b: Id) -> Tile {
        let Neutral { one, minus_one, .. } = self.neutral;
        let sum = |v, factor, w| Tile::new(id, Opcode::VectorSum, &[v, factor, w]);
        match op {
            Binary::Add => self.added(id, a, b).or_else(|| self.added(id, b, a)).unwrap_or(sum(b, one, a)),
            Binary::Subtract => sum(b, minus_one, a),
            Binary::Multiply => Tile::new(id, Opcode::MultiplyVectors, &[a, b]),
            _ => Tile::rare(id, Opcode::RareVector, Rare::Vectors(op), &[a, b]),
        }
    }

    /// Vector a plus a vector b that comes along.
    fn added(&self, id: Id, a: Id, b: Id) -> Option<Tile> {
        match self.inner(b)? {
            Operation::Scale(v, s) => Some(Tile::new(id, Opcode::VectorSum, &[v, s, a])),
            // All three uses of the number are in this vector.
            Operation::Compose([x, y, z]) if x == y && y == z && self.uses[x.index()] == 3 => match self.get(x) {
                Operation::Binary(Binary::Multiply, x, factor) => Some(Tile::new(id, Opcode::AddGrey, &[a, x, factor])),
                _ => None,
            },
            _ => None,
        }
    }
}

fn unary(id: Id, op: Unary, a: Id) -> Tile {
    let opcode = match op {
        Unary::Sin => Opcode::Sine,
        Unary::Sqrt => Opcode::SquareRoot,
        Unary::Abs => Opcode::Absolute,
        Unary::Floor => Opcode::Floor,
        Unary::Fract => Opcode::Fraction,
        _ => return Tile::rare(id, Opcode::RareNumber, Rare::Unary(op), &[a]),
    };
    Tile::new(id, opcode, &[a])
}

fn noise(kind: Noise, [single, sum, turbulence]: [Rare; 3]) -> (Rare, u32) {
    match kind {
        Noise::Single => (single, 1),
        Noise::Sum(octaves) => (sum, octaves),
        Noise::Turbulence(octaves) => (turbulence, octaves),
    }
}
