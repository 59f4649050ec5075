//! Running a program: the loop over its steps.

use core::ops::{Add, Div, Mul, Sub};

use glam::{DVec4, Vec4};
use raywright_bvh::scalar::{Real, Vector};

use super::scope::{Inputs, Variable};
use super::semantics::{self, Noise};
use super::step::{Opcode, Rare, Step};

/// Four numbers, or a vector and one number that means nothing.
pub(super) type Row<R> = [R; 4];

/// A scalar with the four-component vector that the processor loads, computes and stores in one piece. To read a vector in
/// other pieces than it was written in costs more than all of a step's arithmetic.
pub(super) trait Lanes: Real {
    type Wide: Copy
        + Add<Output = Self::Wide>
        + Sub<Output = Self::Wide>
        + Mul<Output = Self::Wide>
        + Mul<Self, Output = Self::Wide>
        + Div<Self, Output = Self::Wide>;
    fn wide(row: Row<Self>) -> Self::Wide;
    fn row(wide: Self::Wide) -> Row<Self>;
}

impl Lanes for f32 {
    type Wide = Vec4;
    #[inline(always)]
    fn wide(row: Row<f32>) -> Vec4 {
        Vec4::from_array(row)
    }
    #[inline(always)]
    fn row(wide: Vec4) -> Row<f32> {
        wide.to_array()
    }
}

impl Lanes for f64 {
    type Wide = DVec4;
    #[inline(always)]
    fn wide(row: Row<f64>) -> DVec4 {
        DVec4::from_array(row)
    }
    #[inline(always)]
    fn row(wide: DVec4) -> Row<f64> {
        wide.to_array()
    }
}

/// The numbers of one evaluation; indices are masked, so that they need no check.
struct File<R, const ROWS: usize>([Row<R>; ROWS]);

impl<R: Lanes, const ROWS: usize> File<R, ROWS> {
    #[inline(always)]
    fn number(&self, register: u8) -> R {
        self.0.as_flattened()[usize::from(register) & (4 * ROWS - 1)]
    }

    #[inline(always)]
    fn set_number(&mut self, register: u8, value: R) {
        self.0.as_flattened_mut()[usize::from(register) & (4 * ROWS - 1)] = value;
    }

    #[inline(always)]
    fn vector(&self, register: u8) -> R::Wide {
        R::wide(self.0[usize::from(register >> 2) & (ROWS - 1)])
    }

    #[inline(always)]
    fn set_vector(&mut self, register: u8, value: R::Wide) {
        self.0[usize::from(register >> 2) & (ROWS - 1)] = R::row(value);
    }

    /// The variables that a program reads, in the first rows, in the order of [`input_place`].
    #[inline(always)]
    fn load(&mut self, inputs: &Inputs<R>, rows: u8) {
        const RARE: u8 = !0b111;
        let mut next = 0;
        let mut put = |index: u8, row: &dyn Fn() -> Row<R>| {
            if rows & (1 << index) != 0 {
                self.0[next & (ROWS - 1)] = row();
                next += 1;
            }
        };
        let vector = |v: &R::Vec3| R::row(R::wide([v.x(), v.y(), v.z(), R::ZERO]));
        put(0, &|| vector(&inputs.p));
        put(1, &|| vector(&inputs.n));
        put(2, &|| vector(&inputs.d));
        if rows & RARE != 0 {
            put(3, &|| vector(&inputs.r));
            put(4, &|| vector(&inputs.l));
            put(5, &|| vector(&inputs.o));
            put(6, &|| [inputs.u, inputs.v, inputs.distance, inputs.occluder_distance]);
            put(7, &|| [inputs.shadow; 4]);
        }
    }
}

/// Which row of the hit a variable is in (bit of [`Program`](super::Program)'s set of rows), and where in the row.
pub(super) const fn input_place(variable: Variable) -> (u8, u8) {
    match variable {
        Variable::Position => (0, 0),
        Variable::Normal => (1, 0),
        Variable::Direction => (2, 0),
        Variable::Reflected => (3, 0),
        Variable::ToLight => (4, 0),
        Variable::Origin => (5, 0),
        Variable::U => (6, 0),
        Variable::V => (6, 1),
        Variable::Distance => (6, 2),
        Variable::OccluderDistance => (6, 3),
        Variable::Shadow => (7, 0),
    }
}

#[inline(always)]
fn dot<R: Lanes>(a: R::Wide, b: R::Wide) -> R {
    let [x, y, z, _] = R::row(a * b);
    x + y + z
}

#[inline(always)]
fn splat<R: Lanes>(x: R) -> R::Wide {
    R::wide([x; 4])
}

#[inline(always)]
fn narrow<R: Lanes>(wide: R::Wide) -> R::Vec3 {
    let [x, y, z, _] = R::row(wide);
    R::Vec3::new(x, y, z)
}

#[inline(always)]
fn widen<R: Lanes>(v: R::Vec3) -> R::Wide {
    R::wide([v.x(), v.y(), v.z(), R::ZERO])
}

/// What is the same for every scalar type of a program, beside its template.
#[derive(Clone, Debug)]
pub(super) struct Code {
    pub steps: Vec<Step>,
    /// Bit i is set where row i of the hit is read, see [`input_place`].
    pub rows: u8,
    pub is_vector: bool,
}

impl Code {
    /// Runs the steps over a file of `ROWS` rows (a power of two) that starts as `template`: the row that is the result,
    /// or the number in every place of one.
    #[inline(never)]
    pub fn run<R: Lanes, const ROWS: usize>(&self, template: &[Row<R>], inputs: &Inputs<R>) -> Row<R> {
        let Some(template) = template.first_chunk::<ROWS>() else { return [R::ZERO; 4] };
        let mut file = File(*template);
        file.load(inputs, self.rows);
        let mut last = (R::ZERO, splat(R::ZERO));
        for step in &self.steps {
            if step.chained {
                perform::<R, ROWS, true>(step, &mut file, &mut last);
            } else {
                perform::<R, ROWS, false>(step, &mut file, &mut last);
            }
        }
        if self.is_vector { R::row(last.1) } else { [last.0; 4] }
    }
}

/// One step. `last` is the result of the step before, the number or the vector; where it is the first operand, the
/// step is `CHAINED` and takes it from there: a value that goes through memory takes longer than all of the arithmetic.
#[inline(always)]
fn perform<R: Lanes, const ROWS: usize, const CHAINED: bool>(step: &Step, file: &mut File<R, ROWS>, last: &mut (R, R::Wide)) {
    let [a, b, c, d] = step.from;
    macro_rules! number {
        ($value:expr) => {{
            let value = $value;
            last.0 = value;
            file.set_number(step.to, value)
        }};
    }
    macro_rules! vector {
        ($value:expr) => {{
            let value = $value;
            last.1 = value;
            file.set_vector(step.to, value)
        }};
    }
    // The first operand, as a number or as a vector; the others come from their registers.
    macro_rules! na {
        () => {
            if CHAINED { last.0 } else { file.number(a) }
        };
    }
    macro_rules! va {
        () => {
            if CHAINED { last.1 } else { file.vector(a) }
        };
    }
    macro_rules! n {
        ($register:expr) => {
            file.number($register)
        };
    }
    macro_rules! v {
        ($register:expr) => {
            file.vector($register)
        };
    }
    match step.opcode {
        Opcode::Rare => {
            rare(step, file);
            *last = (file.number(step.to), file.vector(step.to));
        }
        Opcode::Add => number!(na!() + n!(b)),
        Opcode::Subtract => number!(na!() - n!(b)),
        Opcode::Multiply => number!(na!() * n!(b)),
        Opcode::Divide => number!(na!() / n!(b)),
        Opcode::Min => number!(semantics::min(na!(), n!(b))),
        Opcode::Max => number!(semantics::max(na!(), n!(b))),
        Opcode::MultiplyAdd => number!(na!() * n!(b) + n!(c)),
        Opcode::MultiplySubtract => number!(na!() * n!(b) - n!(c)),
        Opcode::SubtractProduct => number!(na!() - n!(b) * n!(c)),
        Opcode::SubtractFrom => number!(n!(b) - na!()),
        Opcode::ScaledFrom => number!(n!(c) - na!() * n!(b)),
        Opcode::AddProduct => number!(na!() + n!(b) * n!(c)),
        Opcode::Clamp => number!(semantics::min(semantics::max(na!(), n!(b)), n!(c))),
        Opcode::Power => number!(semantics::power(na!(), step.whole)),
        Opcode::LobePower => number!(semantics::power(semantics::max(na!(), n!(b)), step.whole)),
        Opcode::Negate => number!(-na!()),
        Opcode::SquareRoot => number!(na!().sqrt()),
        Opcode::Absolute => number!(na!().abs()),
        Opcode::Floor => number!(semantics::floor(na!())),
        Opcode::Fraction => number!(semantics::fraction(na!())),
        Opcode::Checker => number!(semantics::truth(semantics::odd(na!(), n!(b)))),
        Opcode::Mix => number!(semantics::mix(n!(b), n!(c), na!())),
        Opcode::Smoothstep => number!(semantics::smoothstep(n!(b), n!(c), na!())),
        Opcode::Select => number!(n!(if semantics::is_true(na!()) { b } else { c })),
        Opcode::SelectLess => number!(n!(if na!() < n!(b) { c } else { d })),
        Opcode::Copy => number!(na!()),
        Opcode::CopyVector => vector!(va!()),
        Opcode::Compose => vector!(R::wide([na!(), n!(b), n!(c), R::ZERO])),
        Opcode::Splat => vector!(splat(na!())),
        Opcode::AddVectors => vector!(va!() + v!(b)),
        Opcode::SubtractVectors => vector!(va!() - v!(b)),
        Opcode::MultiplyVectors => vector!(va!() * v!(b)),
        Opcode::Scale => vector!(va!() * n!(b)),
        Opcode::ScaleBy => vector!(v!(b) * na!()),
        Opcode::Shrink => vector!(va!() / n!(b)),
        Opcode::AddScaledVector => vector!(va!() + v!(b) * n!(c)),
        Opcode::ScaledAdd => vector!(v!(b) + v!(c) * na!()),
        Opcode::GreyAdd => vector!(v!(c) + splat(na!() * n!(b))),
        Opcode::AddGrey => vector!(va!() + splat(n!(b) * n!(c))),
        Opcode::MixVectors => {
            let t = na!();
            vector!(v!(b) * (R::ONE - t) + v!(c) * t)
        }
        Opcode::SelectVectors => vector!(v!(if semantics::is_true(na!()) { b } else { c })),
        Opcode::SelectVectorsLess => vector!(v!(if na!() < n!(b) { c } else { d })),
        Opcode::CheckerVectors => vector!(v!(if semantics::odd(na!(), n!(b)) { d } else { c })),
        Opcode::Dot => number!(dot::<R>(va!(), v!(b))),
        Opcode::DotMultiplyAdd => number!(dot::<R>(va!(), v!(b)) * n!(c) + n!(d)),
        Opcode::Length => number!(dot::<R>(va!(), va!()).sqrt()),
        Opcode::Normalize => vector!(va!() * (R::ONE / dot::<R>(va!(), va!()).sqrt())),
    }
}

/// A step that takes so long that one more call is nothing, kept out of the loop that the others share.
#[inline(never)]
fn rare<R: Lanes, const ROWS: usize>(step: &Step, file: &mut File<R, ROWS>) {
    let [a, b, ..] = step.from;
    macro_rules! number {
        ($value:expr) => {{
            let value = $value;
            file.set_number(step.to, value)
        }};
    }
    macro_rules! vector {
        ($value:expr) => {{
            let value = $value;
            file.set_vector(step.to, value)
        }};
    }
    match step.rare {
        Rare::None => {}
        Rare::ReciprocalPower => number!(R::ONE / semantics::power(file.number(a), step.whole)),
        Rare::Unary(op) => number!(semantics::unary(op, file.number(a))),
        Rare::Binary(op) => number!(semantics::binary(op, file.number(a), file.number(b))),
        Rare::Vectors(op) => {
            vector!(widen::<R>(semantics::binary_vectors::<R>(op, narrow::<R>(file.vector(a)), narrow::<R>(file.vector(b)))))
        }
        Rare::Cross => vector!(widen::<R>(narrow::<R>(file.vector(a)).cross(narrow::<R>(file.vector(b))))),
        Rare::SpaceNoise => number!(semantics::space_noise(Noise::Single, narrow::<R>(file.vector(a)))),
        Rare::SpaceSum => number!(semantics::space_noise(Noise::Sum(step.whole), narrow::<R>(file.vector(a)))),
        Rare::SpaceTurbulence => number!(semantics::space_noise(Noise::Turbulence(step.whole), narrow::<R>(file.vector(a)))),
        Rare::PlaneNoise => number!(semantics::plane_noise(Noise::Single, file.number(a), file.number(b))),
        Rare::PlaneSum => number!(semantics::plane_noise(Noise::Sum(step.whole), file.number(a), file.number(b))),
        Rare::PlaneTurbulence => number!(semantics::plane_noise(Noise::Turbulence(step.whole), file.number(a), file.number(b))),
    }
}
