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

/// The numbers of one evaluation, four in a row; indices are masked, so that they need no check.
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
        R::wide(self.0[(usize::from(register) & (4 * ROWS - 4)) / 4])
    }

    #[inline(always)]
    fn set_vector(&mut self, register: u8, value: R::Wide) {
        self.0[(usize::from(register) & (4 * ROWS - 4)) / 4] = R::row(value);
    }

    /// A vector by its components. Not taken from a row: to read other pieces of it than were written takes longer than
    /// all of a step's arithmetic, and which pieces these are, the compiler chooses where it knows that they lie together.
    #[inline(always)]
    fn point(&self, register: u8) -> R::Vec3 {
        let [x, y, z] = [0, 1, 2].map(|axis| self.number(register.wrapping_add(axis)));
        R::Vec3::new(x, y, z)
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
fn splat<R: Lanes>(x: R) -> R::Wide {
    R::wide([x; 4])
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
    /// The register of the result.
    pub result: u8,
}

impl Code {
    /// Runs the steps over a file of `ROWS` rows (a power of two) that starts as `template`: the row that is the result,
    /// or the number in every place of one.
    #[inline(never)]
    pub fn run<R: Lanes, const ROWS: usize>(&self, template: &[Row<R>], inputs: &Inputs<R>) -> Row<R> {
        let Some(template) = template.first_chunk::<ROWS>() else { return [R::ZERO; 4] };
        let mut file = File::<R, ROWS>([[R::ZERO; 4]; ROWS]);
        // Of more than eight rows at once, the compiler makes a call, which takes longer than many a program.
        let (half, other) = file.0.split_at_mut(ROWS / 2);
        half.copy_from_slice(&template[..ROWS / 2]);
        other.copy_from_slice(&template[ROWS / 2..]);
        file.load(inputs, self.rows);
        for step in &self.steps {
            let [a, b, c, d] = step.from;
            if step.is_sum {
                file.set_number(step.to, file.number(a) * file.number(b) * file.number(c) + file.number(d));
            } else {
                perform(step, &mut file);
            }
        }
        if self.is_vector { R::row(file.vector(self.result)) } else { [file.number(self.result); 4] }
    }
}

/// A step that is no sum with a product.
#[inline(always)]
fn perform<R: Lanes, const ROWS: usize>(step: &Step, file: &mut File<R, ROWS>) {
    let [a, b, c, d] = step.from;
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
        Opcode::Divide => number!(n!(a) / n!(b)),
        Opcode::Min => number!(semantics::min(n!(a), n!(b))),
        Opcode::Max => number!(semantics::max(n!(a), n!(b))),
        Opcode::Clamp => number!(semantics::min(semantics::max(n!(a), n!(b)), n!(c))),
        Opcode::Power => number!(semantics::power(n!(a), step.whole, step.limit)),
        Opcode::LobePower => number!(semantics::power(semantics::max(n!(a), n!(b)), step.whole, step.limit)),
        Opcode::Sine => number!(n!(a).sin()),
        Opcode::SquareRoot => number!(n!(a).sqrt()),
        Opcode::Absolute => number!(n!(a).abs()),
        Opcode::Floor => number!(semantics::floor(n!(a))),
        Opcode::Fraction => number!(semantics::fraction(n!(a))),
        Opcode::Checker => number!(semantics::truth(semantics::odd(n!(a), n!(b)))),
        Opcode::Mix => number!(semantics::mix(n!(b), n!(c), n!(a))),
        Opcode::Smoothstep => number!(semantics::smoothstep(n!(b), n!(c), n!(a))),
        Opcode::Select => number!(n!(if semantics::is_true(n!(a)) { b } else { c })),
        Opcode::SelectLess => number!(n!(if n!(a) < n!(b) { c } else { d })),
        Opcode::Length => number!(file.point(a).length()),
        Opcode::Distance => number!((file.point(a) - file.point(b)).length()),
        Opcode::VectorSum => vector!(v!(a) * n!(b) + v!(c)),
        Opcode::DotSum => number!(file.point(a).dot(file.point(b)) * n!(c) + n!(d)),
        Opcode::RareNumber => number!(rare_number(step, file)),
        Opcode::Compose => vector!(R::wide([n!(a), n!(b), n!(c), R::ZERO])),
        Opcode::MultiplyVectors => vector!(v!(a) * v!(b)),
        Opcode::Shrink => vector!(v!(a) / n!(b)),
        Opcode::AddGrey => vector!(v!(a) + splat(n!(b) * n!(c))),
        Opcode::MixVectors => {
            let t = n!(a);
            vector!(v!(b) * (R::ONE - t) + v!(c) * t)
        }
        Opcode::SelectVectors => vector!(v!(if semantics::is_true(n!(a)) { b } else { c })),
        Opcode::SelectVectorsLess => vector!(v!(if n!(a) < n!(b) { c } else { d })),
        Opcode::CheckerVectors => vector!(v!(if semantics::odd(n!(a), n!(b)) { d } else { c })),
        Opcode::Normalize => vector!(v!(a) * (R::ONE / file.point(a).length())),
        Opcode::RareVector => vector!(rare_vector(step, file)),
    }
}

/// A number that takes so long that one more call is nothing, kept out of the loop that the other steps share.
#[inline(never)]
fn rare_number<R: Lanes, const ROWS: usize>(step: &Step, file: &File<R, ROWS>) -> R {
    let [a, b, ..] = step.from.map(|register| file.number(register));
    let point = || file.point(step.from[0]);
    match step.rare {
        Rare::ReciprocalPower => R::ONE / semantics::power(a, step.whole, step.limit),
        Rare::Unary(op) => semantics::unary(op, a),
        Rare::Binary(op) => semantics::binary(op, a, b),
        Rare::SpaceNoise => semantics::space_noise(Noise::Single, point()),
        Rare::SpaceSum => semantics::space_noise(Noise::Sum(step.whole), point()),
        Rare::SpaceTurbulence => semantics::space_noise(Noise::Turbulence(step.whole), point()),
        Rare::PlaneNoise => semantics::plane_noise(Noise::Single, a, b),
        Rare::PlaneSum => semantics::plane_noise(Noise::Sum(step.whole), a, b),
        Rare::PlaneTurbulence => semantics::plane_noise(Noise::Turbulence(step.whole), a, b),
        Rare::None | Rare::Cross | Rare::Vectors(_) => R::ZERO,
    }
}

/// A vector that takes long.
#[inline(never)]
fn rare_vector<R: Lanes, const ROWS: usize>(step: &Step, file: &File<R, ROWS>) -> R::Wide {
    let [a, b, ..] = step.from.map(|register| file.point(register));
    widen::<R>(match step.rare {
        Rare::Cross => a.cross(b),
        Rare::Vectors(op) => semantics::binary_vectors::<R>(op, a, b),
        _ => R::Vec3::ZERO,
    })
}
