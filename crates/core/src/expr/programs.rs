//! Table of all programs of a scene, for evaluation at hits in the scene's scalar.

use raywright_bvh::scalar::{Real, Vector};

use super::program::{MAX_OPERATIONS, Program, ProgramHeader};
use super::run::{Instruction, RegisterFile, RegisterRow};
use super::scope::{Variable, VariableValues};

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
    steps: Vec<Instruction>,
    /// Initial registers of all programs, which contain the constants.
    registers: Vec<RegisterRow<R>>,
    headers: Vec<ProgramHeader>,
}

/// Returns `count` entries of a table, beginning with entry `start`.
#[inline(always)]
fn table_slice<T>(table: &[T], [start, count]: [u32; 2]) -> &[T] {
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
