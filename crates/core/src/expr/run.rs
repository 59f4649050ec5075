//! Execution of a program: the register file, and the effect of each operation.

use raywright_bvh::scalar::{Real, Vector};

use super::function::Operation;
use super::scope::VariableValues;
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
        use Operation::*;
        let [a, b, c, d] = step.sources;
        match step.operation {
            Negate => self.apply_to_number(step, |a| -a),
            Not => self.apply_to_number(step, |a| truth_to_number(!is_true(a))),
            Sin => self.apply_to_number(step, R::sin),
            Cos => self.apply_to_number(step, R::cos),
            Tan => self.apply_to_number(step, R::tan),
            Asin => self.apply_to_number(step, R::asin),
            Acos => self.apply_to_number(step, R::acos),
            Atan => self.apply_to_number(step, R::atan),
            Exp => self.apply_to_number(step, R::exp),
            Ln => self.apply_to_number(step, R::ln),
            Sqrt => self.apply_to_number(step, R::sqrt),
            Abs => self.apply_to_number(step, R::abs),
            Sign => self.apply_to_number(step, sign),
            Floor => self.apply_to_number(step, Real::floor),
            Ceil => self.apply_to_number(step, |a| -(-a).floor()),
            Fract => self.apply_to_number(step, fraction),
            Round => self.apply_to_number(step, |a| (a + R::from_f32(0.5)).floor()),
            Add => self.apply_to_two_numbers(step, |a, b| a + b),
            Subtract => self.apply_to_two_numbers(step, |a, b| a - b),
            Multiply => self.apply_to_two_numbers(step, |a, b| a * b),
            Divide => self.apply_to_two_numbers(step, |a, b| a / b),
            Modulo => self.apply_to_two_numbers(step, modulo_with_sign_of_divisor),
            Power => self.apply_to_two_numbers(step, R::powf),
            WholePower(exponent) => {
                self.apply_to_two_numbers(step, |a, limit| integer_power(a, exponent, limit))
            }
            Min => self.apply_to_two_numbers(step, min),
            Max => self.apply_to_two_numbers(step, max),
            Atan2 => self.apply_to_two_numbers(step, R::atan2),
            Step => self.apply_to_two_numbers(step, |a, b| if b < a { R::ZERO } else { R::ONE }),
            Checker => self.store_truth_value(step, is_odd_checker_cell),
            Less => self.store_truth_value(step, |a, b| a < b),
            LessOrEqual => self.store_truth_value(step, |a, b| a <= b),
            Greater => self.store_truth_value(step, |a, b| a > b),
            GreaterOrEqual => self.store_truth_value(step, |a, b| a >= b),
            Equal => self.store_truth_value(step, |a, b| a == b),
            NotEqual => self.store_truth_value(step, |a, b| a != b),
            And => self.store_truth_value(step, |a, b| is_true(a) && is_true(b)),
            Or => self.store_truth_value(step, |a, b| is_true(a) || is_true(b)),
            Mix => self.apply_to_three_numbers(step, mix),
            Smoothstep => self.apply_to_three_numbers(step, smoothstep),
            ProductSum => {
                self.set_number(
                    step.destination,
                    self.number(a) * self.number(b) * self.number(c) + self.number(d),
                );
            }
            Select => self.set_number(
                step.destination,
                self.number(if is_true(self.number(a)) { b } else { c }),
            ),
            Dot => self.set_number(step.destination, self.vec3(a).dot(self.vec3(b))),
            Length => self.apply_to_vec3(step, R::Vec3::length),
            Noise => self.apply_to_vec3(step, noise::noise3),
            Sum(octaves) => self.apply_to_vec3(step, |p| noise::fbm3(p, octaves)),
            Turbulence(octaves) => self.apply_to_vec3(step, |p| noise::turbulence3(p, octaves)),
            PlaneNoise => self.apply_to_two_numbers(step, noise::noise2),
            PlaneSum(octaves) => self.apply_to_two_numbers(step, |x, y| noise::fbm2(x, y, octaves)),
            PlaneTurbulence(octaves) => {
                self.apply_to_two_numbers(step, |x, y| noise::turbulence2(x, y, octaves))
            }
            Compose => {
                self.set_vector(
                    step.destination,
                    R::Four::from([self.number(a), self.number(b), self.number(c), R::ZERO]),
                );
            }
            AddVectors => self.apply_to_vectors(step, |a, b| a + b),
            SubtractVectors => self.apply_to_vectors(step, |a, b| a - b),
            MultiplyVectors => self.apply_to_vectors(step, |a, b| a * b),
            DivideVectors => self.apply_to_vectors(step, |a, b| a / b),
            MinVectors => self.apply_to_components(step, min),
            MaxVectors => self.apply_to_components(step, max),
            Scale => self.set_vector(step.destination, self.vector(a) * self.number(b)),
            DivideByNumber => self.set_vector(step.destination, self.vector(a) / self.number(b)),
            MixVectors => {
                let t = self.number(c);
                self.apply_to_vectors(step, |a, b| a * (R::ONE - t) + b * t);
            }
            SelectVectors => self.set_vector(
                step.destination,
                self.vector(if is_true(self.number(a)) { b } else { c }),
            ),
            Cross => self.set_vec3(step.destination, self.vec3(a).cross(self.vec3(b))),
            Normalize => self.set_vector(
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

// Numeric functions of the language that are not a single processor instruction. They are defined
// for every scalar type.

/// Converts a truth value to a number: 1 or 0.
#[inline(always)]
fn truth_to_number<R: Real>(value: bool) -> R {
    if value { R::ONE } else { R::ZERO }
}

/// Converts a number to a truth value: every number but zero and NaN is true.
#[inline(always)]
pub(super) fn is_true<R: Real>(value: R) -> bool {
    value.abs() > R::ZERO
}

/// Returns the smaller of two numbers. If one is NaN, the other is returned; of two zeros, the
/// first. [`f32::min`] does not specify the sign of the zero, which could change a bit of the
/// picture.
#[inline(always)]
pub(super) fn min<R: Real>(a: R, b: R) -> R {
    if b < a || a.is_nan() { b } else { a }
}

/// Returns the larger of two numbers. If one is NaN, the other is returned; of two zeros, the
/// first.
#[inline(always)]
pub(super) fn max<R: Real>(a: R, b: R) -> R {
    if b > a || a.is_nan() { b } else { a }
}

/// Returns −1 or 1, the sign of x. Zero and NaN are returned unchanged.
#[inline(always)]
pub(super) fn sign<R: Real>(x: R) -> R {
    if x > R::ZERO {
        R::ONE
    } else if x < R::ZERO {
        -R::ONE
    } else {
        x
    }
}

/// Returns x − ⌊x⌋, always below 1. A difference that rounds to 1 becomes the next smaller number.
#[inline(always)]
pub(super) fn fraction<R: Real>(x: R) -> R {
    let below_one = R::ONE - R::ROUNDOFF;
    let fraction = x - x.floor();
    if fraction > below_one {
        below_one
    } else {
        fraction
    }
}

/// Returns a − b ⌊a/b⌋, from zero to b, excluding b. Two rounding errors are corrected. The
/// quotient may round up to a whole number, so that the remainder has the wrong sign. The
/// difference may round to b.
#[inline(always)]
pub(super) fn modulo_with_sign_of_divisor<R: Real>(a: R, b: R) -> R {
    let rest = a - b * (a / b).floor();
    let (low, high) = if b > R::ZERO {
        (R::ZERO, b.next_down())
    } else {
        (b.next_up(), R::ZERO)
    };
    let wrong_side = if b > R::ZERO {
        rest < R::ZERO
    } else {
        rest > R::ZERO
    };
    let rest = if wrong_side { rest + b } else { rest };
    // Written so that NaN stays NaN.
    if rest < low {
        low
    } else if rest > high {
        high
    } else {
        rest
    }
}

/// Whether ⌊x⌋ + ⌊y⌋ is odd. Infinities and NaN count as even.
#[inline(always)]
pub(super) fn is_odd_checker_cell<R: Real>(x: R, y: R) -> bool {
    let half = (x.floor() + y.floor()) * R::from_f32(0.5);
    // Infinities and NaN count as even.
    half - half.floor() > R::ZERO
}

/// Returns the same bits as [`Real::powi`]. The last squaring of that function is omitted, because
/// its result is unused and may be a slow subnormal. `limit` is the [`underflow_limit_of_power`] of the
/// exponent; an `f32` of a smaller magnitude gives zero.
#[inline(always)]
pub(super) fn integer_power<R: Real>(mut base: R, exponent: u32, limit: R) -> R {
    if size_of::<R>() == size_of::<f32>() && base.abs() < limit {
        return if exponent & 1 == 1 {
            base * R::ZERO
        } else {
            R::ZERO
        };
    }
    let mut result = if exponent & 1 == 1 { base } else { R::ONE };
    let mut rest = exponent >> 1;
    while rest != 0 {
        base *= base;
        result *= core::hint::select_unpredictable(rest & 1 == 1, base, R::ONE);
        rest >>= 1;
    }
    result
}

/// Returns a magnitude below which an `f32` raised to this exponent is zero. Such powers are
/// frequent, because highlights with high exponents are zero at most hits. Computing them would be
/// slow, because their squares are subnormal.
pub(super) fn underflow_limit_of_power(exponent: u32) -> f64 {
    // Magnitudes below 2⁻¹⁵⁰ round to zero. The last factor is below 2⁻⁷⁵, and at most twice too
    // large if it is subnormal. A further factor of two exceeds all other roundings.
    libm::exp2(-152.0 / f64::from(exponent))
}

/// Interpolates from a at t = 0 to b at t = 1, exact at both ends.
#[inline(always)]
pub(super) fn mix<R: Real>(a: R, b: R, t: R) -> R {
    a * (R::ONE - t) + b * t
}

/// Returns a cubic step: 0 below `low`, 1 above `high`, with zero slope at both ends.
#[inline(always)]
pub(super) fn smoothstep<R: Real>(low: R, high: R, x: R) -> R {
    // Comparisons in this direction compile to an instruction each, without a branch. NaN becomes
    // zero.
    let t = (x - low) / (high - low);
    let t = if t > R::ZERO { t } else { R::ZERO };
    let t = if t < R::ONE { t } else { R::ONE };
    t * t * (R::from_f64(3.0) - R::from_f64(2.0) * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stay_below<R: Real>(smallest: f64) {
        for x in [
            smallest, 1e-9, 1e-3, 0.1, 0.2999, 1.0, 2.9999, 12_345.678, 1e8, 1e20,
        ] {
            for x in [
                R::from_f64(x),
                R::from_f64(-x),
                R::from_f64(x).next_down(),
                R::from_f64(-x).next_up(),
            ] {
                let f = fraction(x);
                assert!(
                    (R::ZERO..R::ONE).contains(&f),
                    "the fraction of {x:?} is {f:?}"
                );
                for divisor in [1.0, 0.1, 3.0, 7.3, 1e-3] {
                    let b = R::from_f64(divisor);
                    let (above, below) = (
                        modulo_with_sign_of_divisor(x, b),
                        modulo_with_sign_of_divisor(x, -b),
                    );
                    assert!(
                        above >= R::ZERO && above < b,
                        "{x:?} mod {b:?} is {above:?}"
                    );
                    assert!(
                        below <= R::ZERO && below > -b,
                        "{x:?} mod {:?} is {below:?}",
                        -b
                    );
                }
            }
        }
        let far = (R::ONE - R::ROUNDOFF, R::ROUNDOFF * R::from_f64(0.1));
        assert_eq!(
            (
                fraction(-far.1),
                modulo_with_sign_of_divisor(-far.1, R::ONE)
            ),
            (far.0, far.0)
        );
        assert!(
            fraction(R::INFINITY).is_nan() && modulo_with_sign_of_divisor(R::ONE, R::ZERO).is_nan()
        );
    }

    /// Protects: a fraction is below one and a remainder smaller than its divisor, also where x −
    /// ⌊x⌋ rounds to one.
    #[test]
    fn s19_fractions_are_below_one() {
        stay_below::<f32>(1e-38);
        stay_below::<f64>(1e-300);
        assert_eq!((fraction(-0.25_f32), fraction(1.75_f64)), (0.75, 0.75));
        assert_eq!(
            (
                modulo_with_sign_of_divisor(-1.0_f32, 3.0),
                modulo_with_sign_of_divisor(7.5_f64, -2.0)
            ),
            (2.0, -0.5)
        );
    }
}
