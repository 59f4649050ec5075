//! Execution of a program: the register file, and the effect of each operation.

use raywright_bvh::scalar::{Real, Vector};

use super::operation::Operation;
use super::scope::VariableValues;
use super::semantics::{
    fraction, is_true, max, min, mix, odd, power, remainder, sign, smoothstep, truth,
};
use crate::noise;

/// A row of the register file: four numbers, or a vector in the first three places. A row is
/// loaded, computed and stored as a unit. If a vector were read in other pieces than it was stored
/// in, the processor would stall for longer than the arithmetic of an instruction takes.
pub(super) type RegisterRow<R> = [R; 4];

/// An instruction. The register of a number is its index among the places of all rows. The register
/// of a vector is the index of its x, at the start of a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instruction {
    pub operation: Operation,
    /// Register of the result.
    pub to: u16,
    /// Registers of the operands.
    pub from: [u16; 4],
}

/// Register file of an evaluation. The number of rows is a power of two, so that masking an index
/// replaces its bounds check.
pub(super) struct RegisterFile<R, const ROWS: usize>(pub [RegisterRow<R>; ROWS]);

impl<R: Real, const ROWS: usize> RegisterFile<R, ROWS> {
    #[inline(always)]
    pub fn number(&self, register: u16) -> R {
        self.0.as_flattened()[usize::from(register) & (4 * ROWS - 1)]
    }

    #[inline(always)]
    fn set_number(&mut self, register: u16, value: R) {
        self.0.as_flattened_mut()[usize::from(register) & (4 * ROWS - 1)] = value;
    }

    #[inline(always)]
    pub fn vector(&self, register: u16) -> R::Four {
        R::Four::from(self.0[(usize::from(register) / 4) & (ROWS - 1)])
    }

    #[inline(always)]
    fn set_vector(&mut self, register: u16, value: R::Four) {
        self.0[(usize::from(register) / 4) & (ROWS - 1)] = value.into();
    }

    /// Reads a vector component by component, for operations that need single components. If the
    /// compiler knew that the components are adjacent, it would read them in different pieces than
    /// they were written in, which would stall the processor.
    #[inline(always)]
    fn point(&self, register: u16) -> R::Vec3 {
        let [x, y, z] = [0, 1, 2].map(|axis| self.number(register.wrapping_add(axis)));
        R::Vec3::new(x, y, z)
    }

    /// Writes a vector as a whole row.
    #[inline(always)]
    fn set_point(&mut self, register: u16, v: R::Vec3) {
        self.set_vector(register, R::Four::from([v.x(), v.y(), v.z(), R::ZERO]));
    }

    /// Stores the rows of variables in the first rows of the file. The bits of `rows` select the
    /// rows, whose order is that of [`Variable::place`](super::scope::Variable::place).
    #[inline(always)]
    pub fn load(&mut self, inputs: &VariableValues<R>, rows: u8) {
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
    fn one(&mut self, step: Instruction, f: impl Fn(R) -> R) {
        self.set_number(step.to, f(self.number(step.from[0])));
    }

    /// Applies `f` to two numbers.
    #[inline(always)]
    fn two(&mut self, step: Instruction, f: impl Fn(R, R) -> R) {
        self.set_number(
            step.to,
            f(self.number(step.from[0]), self.number(step.from[1])),
        );
    }

    /// Stores the truth value of `f` on two numbers.
    #[inline(always)]
    fn test(&mut self, step: Instruction, f: impl Fn(R, R) -> bool) {
        self.two(step, |a, b| truth(f(a, b)));
    }

    /// Applies `f` to three numbers.
    #[inline(always)]
    fn three(&mut self, step: Instruction, f: impl Fn(R, R, R) -> R) {
        let [a, b, c, _] = step.from.map(|register| self.number(register));
        self.set_number(step.to, f(a, b, c));
    }

    /// Stores the number that `f` returns for a vector.
    #[inline(always)]
    fn of_point(&mut self, step: Instruction, f: impl Fn(R::Vec3) -> R) {
        self.set_number(step.to, f(self.point(step.from[0])));
    }

    /// Applies `f` to two vectors.
    #[inline(always)]
    fn vectors(&mut self, step: Instruction, f: impl Fn(R::Four, R::Four) -> R::Four) {
        self.set_vector(
            step.to,
            f(self.vector(step.from[0]), self.vector(step.from[1])),
        );
    }

    /// Applies `f` to each component of two vectors.
    #[inline(always)]
    fn each(&mut self, step: Instruction, f: impl Fn(R, R) -> R) {
        let (a, b) = (self.point(step.from[0]), self.point(step.from[1]));
        self.set_point(
            step.to,
            R::Vec3::new(f(a.x(), b.x()), f(a.y(), b.y()), f(a.z(), b.z())),
        );
    }

    /// Executes an instruction.
    #[inline(always)]
    pub fn perform(&mut self, step: Instruction) {
        let [a, b, c, d] = step.from;
        match step.operation {
            Operation::Negate => self.one(step, |a| -a),
            Operation::Not => self.one(step, |a| truth(!is_true(a))),
            Operation::Sin => self.one(step, R::sin),
            Operation::Cos => self.one(step, R::cos),
            Operation::Tan => self.one(step, R::tan),
            Operation::Asin => self.one(step, R::asin),
            Operation::Acos => self.one(step, R::acos),
            Operation::Atan => self.one(step, R::atan),
            Operation::Exp => self.one(step, R::exp),
            Operation::Ln => self.one(step, R::ln),
            Operation::Sqrt => self.one(step, R::sqrt),
            Operation::Abs => self.one(step, R::abs),
            Operation::Sign => self.one(step, sign),
            Operation::Floor => self.one(step, Real::floor),
            Operation::Ceil => self.one(step, |a| -(-a).floor()),
            Operation::Fract => self.one(step, fraction),
            Operation::Round => self.one(step, |a| (a + R::from_f32(0.5)).floor()),
            Operation::Add => self.two(step, |a, b| a + b),
            Operation::Subtract => self.two(step, |a, b| a - b),
            Operation::Multiply => self.two(step, |a, b| a * b),
            Operation::Divide => self.two(step, |a, b| a / b),
            Operation::Modulo => self.two(step, remainder),
            Operation::Power => self.two(step, R::powf),
            Operation::WholePower(exponent) => self.two(step, |a, limit| power(a, exponent, limit)),
            Operation::Min => self.two(step, min),
            Operation::Max => self.two(step, max),
            Operation::Atan2 => self.two(step, R::atan2),
            Operation::Step => self.two(step, |a, b| if b < a { R::ZERO } else { R::ONE }),
            Operation::Checker => self.test(step, odd),
            Operation::Less => self.test(step, |a, b| a < b),
            Operation::LessOrEqual => self.test(step, |a, b| a <= b),
            Operation::Greater => self.test(step, |a, b| a > b),
            Operation::GreaterOrEqual => self.test(step, |a, b| a >= b),
            Operation::Equal => self.test(step, |a, b| a == b),
            Operation::NotEqual => self.test(step, |a, b| a != b),
            Operation::And => self.test(step, |a, b| is_true(a) && is_true(b)),
            Operation::Or => self.test(step, |a, b| is_true(a) || is_true(b)),
            Operation::Mix => self.three(step, mix),
            Operation::Smoothstep => self.three(step, smoothstep),
            Operation::ProductSum => {
                self.set_number(
                    step.to,
                    self.number(a) * self.number(b) * self.number(c) + self.number(d),
                );
            }
            Operation::Select => self.set_number(
                step.to,
                self.number(if is_true(self.number(a)) { b } else { c }),
            ),
            Operation::Dot => self.set_number(step.to, self.point(a).dot(self.point(b))),
            Operation::Length => self.of_point(step, R::Vec3::length),
            Operation::Noise => self.of_point(step, noise::noise3),
            Operation::Sum(octaves) => self.of_point(step, |p| noise::fbm3(p, octaves)),
            Operation::Turbulence(octaves) => {
                self.of_point(step, |p| noise::turbulence3(p, octaves))
            }
            Operation::PlaneNoise => self.two(step, noise::noise2),
            Operation::PlaneSum(octaves) => self.two(step, |x, y| noise::fbm2(x, y, octaves)),
            Operation::PlaneTurbulence(octaves) => {
                self.two(step, |x, y| noise::turbulence2(x, y, octaves))
            }
            Operation::Compose => {
                self.set_vector(
                    step.to,
                    R::Four::from([self.number(a), self.number(b), self.number(c), R::ZERO]),
                );
            }
            Operation::AddVectors => self.vectors(step, |a, b| a + b),
            Operation::SubtractVectors => self.vectors(step, |a, b| a - b),
            Operation::MultiplyVectors => self.vectors(step, |a, b| a * b),
            Operation::DivideVectors => self.vectors(step, |a, b| a / b),
            Operation::MinVectors => self.each(step, min),
            Operation::MaxVectors => self.each(step, max),
            Operation::Scale => self.set_vector(step.to, self.vector(a) * self.number(b)),
            Operation::Shrink => self.set_vector(step.to, self.vector(a) / self.number(b)),
            Operation::MixVectors => {
                let t = self.number(c);
                self.vectors(step, |a, b| a * (R::ONE - t) + b * t);
            }
            Operation::SelectVectors => self.set_vector(
                step.to,
                self.vector(if is_true(self.number(a)) { b } else { c }),
            ),
            Operation::Cross => self.set_point(step.to, self.point(a).cross(self.point(b))),
            Operation::Normalize => {
                self.set_vector(step.to, self.vector(a) * (R::ONE / self.point(a).length()))
            }
        }
    }
}

/// Runs a single operation on four rows of operands, to fold constants.
pub(super) fn alone(operation: Operation, [a, b, c, d]: [RegisterRow<f64>; 4]) -> RegisterRow<f64> {
    let mut file = RegisterFile([a, b, c, d, [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]]);
    file.perform(Instruction {
        operation,
        to: 16,
        from: [0, 4, 8, 12],
    });
    file.0[4]
}
