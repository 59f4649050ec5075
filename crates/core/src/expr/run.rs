//! Execution of a program: the register file, and the effect of each operation.

use raywright_bvh::scalar::{Real, Vector};

use super::operation::Operation;
use super::scope::VariableValues;
use super::semantics::{
    fraction, integer_power, is_odd_checker_cell, is_true, max, min, mix,
    modulo_with_sign_of_divisor, sign, smoothstep, truth_to_number,
};
use crate::noise;

/// A row of the register file: four numbers, or a vector in the first three registers. A row is
/// loaded, computed and stored as a unit. If a vector were read in other parts than it was stored
/// in, the processor would stall for longer than the arithmetic of an instruction takes.
pub(super) type RegisterRow<R> = [R; 4];

/// An instruction. A register is numbered by its position in the register file, which has four
/// registers to a row. The register of a vector is the register of its x, the first of a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instruction {
    pub operation: Operation,
    /// Register of the result.
    pub destination: u16,
    /// Registers of the operands.
    pub sources: [u16; 4],
}

/// Register file of an evaluation. The number of rows is a power of two, so that masking an index
/// replaces its bounds check.
pub(super) struct RegisterFile<R, const ROWS: usize>(pub [RegisterRow<R>; ROWS]);

impl<R: Real, const ROWS: usize> RegisterFile<R, ROWS> {
    /// Reads a number.
    #[inline(always)]
    pub fn number(&self, register: u16) -> R {
        self.0.as_flattened()[usize::from(register) & (4 * ROWS - 1)]
    }

    /// Writes a number.
    #[inline(always)]
    fn set_number(&mut self, register: u16, value: R) {
        self.0.as_flattened_mut()[usize::from(register) & (4 * ROWS - 1)] = value;
    }

    /// Reads a vector as a whole row.
    #[inline(always)]
    pub fn vector(&self, register: u16) -> R::Four {
        R::Four::from(self.0[(usize::from(register) / 4) & (ROWS - 1)])
    }

    /// Writes a vector and the last number of its row.
    #[inline(always)]
    fn set_vector(&mut self, register: u16, value: R::Four) {
        self.0[(usize::from(register) / 4) & (ROWS - 1)] = value.into();
    }

    /// Reads a vector component by component, for operations that need single components. If the
    /// compiler knew that the components are adjacent, it would read them in other parts than they
    /// were written in, and the processor would stall.
    #[inline(always)]
    fn vec3(&self, register: u16) -> R::Vec3 {
        let [x, y, z] = [0, 1, 2].map(|axis| self.number(register.wrapping_add(axis)));
        R::Vec3::new(x, y, z)
    }

    /// Writes a vector as a whole row.
    #[inline(always)]
    fn set_vec3(&mut self, register: u16, v: R::Vec3) {
        self.set_vector(register, R::Four::from([v.x(), v.y(), v.z(), R::ZERO]));
    }

    /// Stores the rows of variables in the first rows of the file. The bits of `rows` select the
    /// rows, whose order is that of
    /// [`Variable::register_position`](super::scope::Variable::register_position).
    #[inline(always)]
    pub fn load_variables(&mut self, inputs: &VariableValues<R>, rows: u8) {
        const RARE: u8 = !0b111;
        let mut next = 0;
        let mut put = |index: u8, row: &dyn Fn() -> RegisterRow<R>| {
            if rows & (1 << index) != 0 {
                self.0[next & (ROWS - 1)] = row();
                next += 1;
            }
        };
        let vector = |v: &R::Vec3| -> RegisterRow<R> {
            R::Four::from([v.x(), v.y(), v.z(), R::ZERO]).into()
        };
        put(0, &|| vector(&inputs.p));
        put(1, &|| vector(&inputs.n));
        put(2, &|| vector(&inputs.d));
        if rows & RARE != 0 {
            put(3, &|| vector(&inputs.r));
            put(4, &|| vector(&inputs.l));
            put(5, &|| vector(&inputs.o));
            put(6, &|| {
                [
                    inputs.u,
                    inputs.v,
                    inputs.distance,
                    inputs.occluder_distance,
                ]
            });
            put(7, &|| [inputs.shadow; 4]);
        }
    }

    /// Applies `f` to a number.
    #[inline(always)]
    fn apply_to_number(&mut self, step: Instruction, f: impl Fn(R) -> R) {
        self.set_number(step.destination, f(self.number(step.sources[0])));
    }

    /// Applies `f` to two numbers.
    #[inline(always)]
    fn apply_to_two_numbers(&mut self, step: Instruction, f: impl Fn(R, R) -> R) {
        self.set_number(
            step.destination,
            f(self.number(step.sources[0]), self.number(step.sources[1])),
        );
    }

    /// Stores the truth value of `f` on two numbers.
    #[inline(always)]
    fn store_truth_value(&mut self, step: Instruction, f: impl Fn(R, R) -> bool) {
        self.apply_to_two_numbers(step, |a, b| truth_to_number(f(a, b)));
    }

    /// Applies `f` to three numbers.
    #[inline(always)]
    fn apply_to_three_numbers(&mut self, step: Instruction, f: impl Fn(R, R, R) -> R) {
        let [a, b, c, _] = step.sources.map(|register| self.number(register));
        self.set_number(step.destination, f(a, b, c));
    }

    /// Stores the number that `f` returns for a vector.
    #[inline(always)]
    fn apply_to_vec3(&mut self, step: Instruction, f: impl Fn(R::Vec3) -> R) {
        self.set_number(step.destination, f(self.vec3(step.sources[0])));
    }

    /// Applies `f` to two vectors.
    #[inline(always)]
    fn apply_to_vectors(&mut self, step: Instruction, f: impl Fn(R::Four, R::Four) -> R::Four) {
        self.set_vector(
            step.destination,
            f(self.vector(step.sources[0]), self.vector(step.sources[1])),
        );
    }

    /// Applies `f` to each component of two vectors.
    #[inline(always)]
    fn apply_to_components(&mut self, step: Instruction, f: impl Fn(R, R) -> R) {
        let (a, b) = (self.vec3(step.sources[0]), self.vec3(step.sources[1]));
        self.set_vec3(
            step.destination,
            R::Vec3::new(f(a.x(), b.x()), f(a.y(), b.y()), f(a.z(), b.z())),
        );
    }

    /// Executes an instruction.
    #[inline(always)]
    pub fn execute(&mut self, step: Instruction) {
        let [a, b, c, d] = step.sources;
        match step.operation {
            Operation::Negate => self.apply_to_number(step, |a| -a),
            Operation::Not => self.apply_to_number(step, |a| truth_to_number(!is_true(a))),
            Operation::Sin => self.apply_to_number(step, R::sin),
            Operation::Cos => self.apply_to_number(step, R::cos),
            Operation::Tan => self.apply_to_number(step, R::tan),
            Operation::Asin => self.apply_to_number(step, R::asin),
            Operation::Acos => self.apply_to_number(step, R::acos),
            Operation::Atan => self.apply_to_number(step, R::atan),
            Operation::Exp => self.apply_to_number(step, R::exp),
            Operation::Ln => self.apply_to_number(step, R::ln),
            Operation::Sqrt => self.apply_to_number(step, R::sqrt),
            Operation::Abs => self.apply_to_number(step, R::abs),
            Operation::Sign => self.apply_to_number(step, sign),
            Operation::Floor => self.apply_to_number(step, Real::floor),
            Operation::Ceil => self.apply_to_number(step, |a| -(-a).floor()),
            Operation::Fract => self.apply_to_number(step, fraction),
            Operation::Round => self.apply_to_number(step, |a| (a + R::from_f32(0.5)).floor()),
            Operation::Add => self.apply_to_two_numbers(step, |a, b| a + b),
            Operation::Subtract => self.apply_to_two_numbers(step, |a, b| a - b),
            Operation::Multiply => self.apply_to_two_numbers(step, |a, b| a * b),
            Operation::Divide => self.apply_to_two_numbers(step, |a, b| a / b),
            Operation::Modulo => self.apply_to_two_numbers(step, modulo_with_sign_of_divisor),
            Operation::Power => self.apply_to_two_numbers(step, R::powf),
            Operation::WholePower(exponent) => {
                self.apply_to_two_numbers(step, |a, limit| integer_power(a, exponent, limit))
            }
            Operation::Min => self.apply_to_two_numbers(step, min),
            Operation::Max => self.apply_to_two_numbers(step, max),
            Operation::Atan2 => self.apply_to_two_numbers(step, R::atan2),
            Operation::Step => {
                self.apply_to_two_numbers(step, |a, b| if b < a { R::ZERO } else { R::ONE })
            }
            Operation::Checker => self.store_truth_value(step, is_odd_checker_cell),
            Operation::Less => self.store_truth_value(step, |a, b| a < b),
            Operation::LessOrEqual => self.store_truth_value(step, |a, b| a <= b),
            Operation::Greater => self.store_truth_value(step, |a, b| a > b),
            Operation::GreaterOrEqual => self.store_truth_value(step, |a, b| a >= b),
            Operation::Equal => self.store_truth_value(step, |a, b| a == b),
            Operation::NotEqual => self.store_truth_value(step, |a, b| a != b),
            Operation::And => self.store_truth_value(step, |a, b| is_true(a) && is_true(b)),
            Operation::Or => self.store_truth_value(step, |a, b| is_true(a) || is_true(b)),
            Operation::Mix => self.apply_to_three_numbers(step, mix),
            Operation::Smoothstep => self.apply_to_three_numbers(step, smoothstep),
            Operation::ProductSum => {
                self.set_number(
                    step.destination,
                    self.number(a) * self.number(b) * self.number(c) + self.number(d),
                );
            }
            Operation::Select => self.set_number(
                step.destination,
                self.number(if is_true(self.number(a)) { b } else { c }),
            ),
            Operation::Dot => self.set_number(step.destination, self.vec3(a).dot(self.vec3(b))),
            Operation::Length => self.apply_to_vec3(step, R::Vec3::length),
            Operation::Noise => self.apply_to_vec3(step, noise::noise3),
            Operation::Sum(octaves) => self.apply_to_vec3(step, |p| noise::fbm3(p, octaves)),
            Operation::Turbulence(octaves) => {
                self.apply_to_vec3(step, |p| noise::turbulence3(p, octaves))
            }
            Operation::PlaneNoise => self.apply_to_two_numbers(step, noise::noise2),
            Operation::PlaneSum(octaves) => {
                self.apply_to_two_numbers(step, |x, y| noise::fbm2(x, y, octaves))
            }
            Operation::PlaneTurbulence(octaves) => {
                self.apply_to_two_numbers(step, |x, y| noise::turbulence2(x, y, octaves))
            }
            Operation::Compose => {
                self.set_vector(
                    step.destination,
                    R::Four::from([self.number(a), self.number(b), self.number(c), R::ZERO]),
                );
            }
            Operation::AddVectors => self.apply_to_vectors(step, |a, b| a + b),
            Operation::SubtractVectors => self.apply_to_vectors(step, |a, b| a - b),
            Operation::MultiplyVectors => self.apply_to_vectors(step, |a, b| a * b),
            Operation::DivideVectors => self.apply_to_vectors(step, |a, b| a / b),
            Operation::MinVectors => self.apply_to_components(step, min),
            Operation::MaxVectors => self.apply_to_components(step, max),
            Operation::Scale => self.set_vector(step.destination, self.vector(a) * self.number(b)),
            Operation::DivideByNumber => {
                self.set_vector(step.destination, self.vector(a) / self.number(b))
            }
            Operation::MixVectors => {
                let t = self.number(c);
                self.apply_to_vectors(step, |a, b| a * (R::ONE - t) + b * t);
            }
            Operation::SelectVectors => self.set_vector(
                step.destination,
                self.vector(if is_true(self.number(a)) { b } else { c }),
            ),
            Operation::Cross => self.set_vec3(step.destination, self.vec3(a).cross(self.vec3(b))),
            Operation::Normalize => self.set_vector(
                step.destination,
                self.vector(a) * (R::ONE / self.vec3(a).length()),
            ),
        }
    }
}

/// Runs a single operation on four rows of operands, to fold constants.
pub(super) fn run_operation(
    operation: Operation,
    [a, b, c, d]: [RegisterRow<f64>; 4],
) -> RegisterRow<f64> {
    let mut file = RegisterFile([a, b, c, d, [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]]);
    file.execute(Instruction {
        operation,
        destination: 16,
        sources: [0, 4, 8, 12],
    });
    file.0[4]
}
