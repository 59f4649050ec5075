//! Numbers with operators for arithmetic that is written once, for a single f32 and for eight SIMD
//! lanes. Each lane has the bits of the single number: no product is fused with a sum.

use core::ops::{Add, Div, Mul, Neg, Sub};

use super::simd::{Simd, WIDTH};

/// An f32, or an f32 in each of eight SIMD lanes. Numbers of an instruction set exist only where the
/// processor has it, so constants are made from another number.
pub trait LaneFloats:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// An f64 in each lane.
    type Doubles: Copy
        + Add<Output = Self::Doubles>
        + Sub<Output = Self::Doubles>
        + Mul<Output = Self::Doubles>
        + Div<Output = Self::Doubles>;
    /// Returns a constant in each lane.
    fn like(self, value: f32) -> Self;
    /// Returns the numbers of an array; a single number is the first.
    fn load_like(self, values: &[f32; WIDTH]) -> Self;
    /// Returns the numbers of all lanes; a single number in all places.
    fn to_array(self) -> [f32; WIDTH];
    /// Square root.
    fn sqrt(self) -> Self;
    /// Integer part of a number below 2³¹.
    fn trunc(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Returns this number, negated where the sign bit of `sign` is set.
    fn flip_sign(self, sign: Self) -> Self;
    /// Returns this number if it is greater than the other, else the other.
    fn max_or_second(self, other: Self) -> Self;
    /// Returns this number if it is less than the other, else the other.
    fn min_or_second(self, other: Self) -> Self;
    /// Returns `yes` where this number is less than `other`, else `no`.
    fn select_less(self, other: Self, yes: Self, no: Self) -> Self;
    /// Returns the number of a table at this index, an integer from 0 to 7.
    fn lookup(self, table: &[f32; WIDTH]) -> Self;
    /// Returns the mask of the lanes with a number above zero.
    fn positive_lanes(self) -> u32;
    /// Returns a constant f64 in each lane.
    fn double_like(self, value: f64) -> Self::Doubles;
    /// Returns the f64 of an array; a single number is the first.
    fn load_doubles_like(self, values: &[f64; WIDTH]) -> Self::Doubles;
    /// Returns the f64 of all lanes; a single number in all places.
    fn doubles_to_array(doubles: Self::Doubles) -> [f64; WIDTH];
    /// Exact conversion to f64.
    fn widen(self) -> Self::Doubles;
    /// Conversion of f64 that `self` takes the place of, rounded to nearest.
    fn narrow_like(self, doubles: Self::Doubles) -> Self;
    /// Returns `yes` where the first of two numbers is at most the second, else `no`.
    fn select_at_most(
        self,
        pair: [Self::Doubles; 2],
        yes: Self::Doubles,
        no: Self::Doubles,
    ) -> Self::Doubles;
}

/// Implements methods that are one expression each.
macro_rules! methods {
    ($(fn $name:ident($($argument:ident $(: $kind:ty)?),*) -> $out:ty { $body:expr })*) => { $(
        #[inline(always)]
        fn $name($($argument $(: $kind)?),*) -> $out { $body }
    )* };
}

impl LaneFloats for f32 {
    type Doubles = f64;
    methods! {
        fn like(self, value: f32) -> f32 { value }
        fn load_like(self, values: &[f32; WIDTH]) -> f32 { values[0] }
        fn to_array(self) -> [f32; WIDTH] { [self; WIDTH] }
        fn sqrt(self) -> f32 { f32::sqrt(self) }
        fn trunc(self) -> f32 { self as i32 as f32 }
        fn abs(self) -> f32 { f32::abs(self) }
        fn flip_sign(self, sign: f32) -> f32 { f32::from_bits(self.to_bits() ^ sign.to_bits() & 1 << 31) }
        fn max_or_second(self, other: f32) -> f32 { if self > other { self } else { other } }
        fn min_or_second(self, other: f32) -> f32 { if self < other { self } else { other } }
        fn select_less(self, other: f32, yes: f32, no: f32) -> f32 { if self < other { yes } else { no } }
        fn lookup(self, table: &[f32; WIDTH]) -> f32 { table[self as usize % WIDTH] }
        fn positive_lanes(self) -> u32 { u32::from(self > 0.0) }
        fn double_like(self, value: f64) -> f64 { value }
        fn load_doubles_like(self, values: &[f64; WIDTH]) -> f64 { values[0] }
        fn doubles_to_array(doubles: f64) -> [f64; WIDTH] { [doubles; WIDTH] }
        fn widen(self) -> f64 { self.into() }
        fn narrow_like(self, doubles: f64) -> f32 { doubles as f32 }
        fn select_at_most(self, pair: [f64; 2], yes: f64, no: f64) -> f64 { if pair[0] <= pair[1] { yes } else { no } }
    }
}

/// Eight f32 in the lanes of an instruction set.
#[derive(Clone, Copy)]
pub struct SimdFloats<S: Simd> {
    simd: S,
    floats: S::Floats,
}

/// Eight f64 in the lanes of an instruction set.
#[derive(Clone, Copy)]
pub struct SimdDoubles<S: Simd> {
    simd: S,
    doubles: S::Doubles,
}

impl<S: Simd> SimdFloats<S> {
    /// Creates a constant. The token proves that the processor has the instructions.
    #[inline(always)]
    pub fn splat(simd: S, value: f32) -> Self {
        Self {
            simd,
            floats: simd.splat(value),
        }
    }

    #[inline(always)]
    fn with(self, floats: S::Floats) -> Self {
        Self { floats, ..self }
    }

    #[inline(always)]
    fn doubles(self, doubles: S::Doubles) -> SimdDoubles<S> {
        SimdDoubles {
            simd: self.simd,
            doubles,
        }
    }
}

macro_rules! operators {
    ($type:ident $field:ident: $($operator:ident $name:ident $instruction:ident),*) => { $(
        impl<S: Simd> $operator for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self { $field: self.simd.$instruction(self.$field, other.$field), ..self }
            }
        }
    )* };
}
operators!(SimdFloats floats: Add add add, Sub sub sub, Mul mul mul, Div div div);
operators!(SimdDoubles doubles: Add add add_f64, Sub sub sub_f64, Mul mul mul_f64, Div div div_f64);

impl<S: Simd> Neg for SimdFloats<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.with(self.simd.negate(self.floats))
    }
}

impl<S: Simd> LaneFloats for SimdFloats<S> {
    type Doubles = SimdDoubles<S>;
    methods! {
        fn like(self, value: f32) -> Self { Self::splat(self.simd, value) }
        fn load_like(self, values: &[f32; WIDTH]) -> Self { self.with(self.simd.load(values)) }
        fn to_array(self) -> [f32; WIDTH] { self.simd.to_array(self.floats) }
        fn sqrt(self) -> Self { self.with(self.simd.sqrt(self.floats)) }
        fn trunc(self) -> Self { self.with(self.simd.trunc(self.floats)) }
        fn abs(self) -> Self { self.with(self.simd.abs(self.floats)) }
        fn flip_sign(self, sign: Self) -> Self { self.with(self.simd.flip_signs(self.floats, sign.floats)) }
        fn max_or_second(self, other: Self) -> Self { self.with(self.simd.max(self.floats, other.floats)) }
        fn min_or_second(self, other: Self) -> Self { self.with(self.simd.min(self.floats, other.floats)) }
        fn select_less(self, other: Self, yes: Self, no: Self) -> Self { self.with(self.simd.select_less([self.floats, other.floats], yes.floats, no.floats)) }
        fn lookup(self, table: &[f32; WIDTH]) -> Self { self.with(self.simd.lookup(table, self.floats)) }
        fn positive_lanes(self) -> u32 { self.simd.less(self.simd.splat(0.0), self.floats) }
        fn double_like(self, value: f64) -> SimdDoubles<S> { self.doubles(self.simd.splat_f64(value)) }
        fn load_doubles_like(self, values: &[f64; WIDTH]) -> SimdDoubles<S> { self.doubles(self.simd.load_f64(values)) }
        fn doubles_to_array(doubles: SimdDoubles<S>) -> [f64; WIDTH] { doubles.simd.to_array_f64(doubles.doubles) }
        fn widen(self) -> SimdDoubles<S> { self.doubles(self.simd.widen(&self.to_array())) }
        fn narrow_like(self, doubles: SimdDoubles<S>) -> Self { self.with(self.simd.narrow(doubles.doubles)) }
        fn select_at_most(self, pair: [SimdDoubles<S>; 2], yes: SimdDoubles<S>, no: SimdDoubles<S>) -> SimdDoubles<S> {
            self.doubles(self.simd.select_at_most_f64([pair[0].doubles, pair[1].doubles], yes.doubles, no.doubles))
        }
    }
}

/// A vector of three numbers in each lane.
#[derive(Clone, Copy)]
pub struct LaneVector<F> {
    /// First component.
    pub x: F,
    /// Second component.
    pub y: F,
    /// Third component.
    pub z: F,
}

impl<F: LaneFloats> LaneVector<F> {
    /// Creates a vector from its components.
    #[inline(always)]
    pub fn new(x: F, y: F, z: F) -> Self {
        Self { x, y, z }
    }

    /// Loads the vectors of columns, with lanes as those of `like`.
    #[inline(always)]
    pub fn load_like(like: F, [x, y, z]: &[[f32; WIDTH]; 3]) -> Self {
        Self::new(like.load_like(x), like.load_like(y), like.load_like(z))
    }

    /// Returns the vectors at indices of tables.
    #[inline(always)]
    pub fn lookup(index: F, [x, y, z]: &[[f32; WIDTH]; 3]) -> Self {
        Self::new(index.lookup(x), index.lookup(y), index.lookup(z))
    }

    /// Returns the vectors of all lanes as columns.
    #[inline(always)]
    pub fn to_columns(self) -> [[f32; WIDTH]; 3] {
        [self.x.to_array(), self.y.to_array(), self.z.to_array()]
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> F {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Greatest component.
    #[inline(always)]
    pub fn max_element(self) -> F {
        self.x.max_or_second(self.y.max_or_second(self.z))
    }

    /// Sum of the absolute values of the components.
    #[inline(always)]
    pub fn absolute_sum(self) -> F {
        self.x.abs() + self.y.abs() + self.z.abs()
    }
}

impl<F: LaneFloats> Add for LaneVector<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<F: LaneFloats> Sub for LaneVector<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

/// Componentwise.
impl<F: LaneFloats> Mul for LaneVector<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(self.x * other.x, self.y * other.y, self.z * other.z)
    }
}

impl<F: LaneFloats> Mul<F> for LaneVector<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: F) -> Self {
        Self::new(self.x * other, self.y * other, self.z * other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::angles::LaneAngles;
    use crate::processor::{LaneTask, RegisterWidth, run_in_lanes_of};

    const TABLE: [f32; WIDTH] = [3.0, -1.0, 0.5, 7.0, 1e-9, 2e9, -0.0, 4.0];

    /// Every operation on two numbers.
    #[inline(always)]
    fn operations<F: LaneFloats>(a: F, b: F) -> [F; 16] {
        let (c, one) = (a.widen() / b.widen(), a.like(1.0));
        let turns = a.abs() / (b.abs() + one);
        let share = turns - turns.trunc();
        let [cos, sin] = share.cos_sin_turns();
        [
            a + b,
            a - b,
            a * b,
            a / b,
            -a,
            a.abs().sqrt(),
            a.trunc(),
            a.flip_sign(b),
            a.max_or_second(b),
            a.min_or_second(b),
            a.select_less(b, one, b),
            a.abs().min_or_second(a.like(7.5)).lookup(&TABLE),
            a.narrow_like(c * a.double_like(3.0) - b.widen() + c),
            a.narrow_like(a.select_at_most([a.widen(), c], c, b.widen())),
            a.angle_from(b),
            cos + sin,
        ]
    }

    struct OperationsTask<'a>([&'a [f32; WIDTH]; 2]);

    impl LaneTask for OperationsTask<'_> {
        type Output = ([[f32; WIDTH]; 16], u32);
        #[inline(always)]
        fn run<S: Simd>(self, zero: SimdFloats<S>) -> Self::Output {
            let [a, b] = self.0;
            let (a, b) = (zero.load_like(a), zero.load_like(b));
            let mut out = [[0.0; WIDTH]; 16];
            for (out, number) in out.iter_mut().zip(operations(a, b)) {
                *out = number.to_array();
            }
            (out, (a - b).positive_lanes())
        }
    }

    /// Protects: each operation in lanes has the bits of single numbers, with registers of each width;
    /// also of zeros, and where the compared numbers are equal.
    #[test]
    fn lanes_have_the_bits_of_single_numbers() {
        let mut state = 88_172_645_463_325_252_u64;
        let mut number = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            let exponent = (state >> 20) % 24;
            [
                0.0,
                -0.0,
                1.0,
                (state >> 32) as i32 as f32 * 0.5_f32.powi(exponent as i32 + 16),
            ][if state % 9 < 3 {
                (state % 3) as usize
            } else {
                3
            }]
        };
        for _ in 0..4_000 {
            let [a, b] = [(); 2].map(|()| [(); WIDTH].map(|()| number()));
            for width in [
                RegisterWidth::Baseline,
                RegisterWidth::Avx2,
                RegisterWidth::Avx512,
            ] {
                let (found, positive) = run_in_lanes_of(width, OperationsTask([&a, &b]));
                for lane in 0..WIDTH {
                    let single = operations(a[lane], b[lane]);
                    for (k, (found, single)) in found.iter().zip(single).enumerate() {
                        let is_equal = found[lane].to_bits() == single.to_bits();
                        let both_nan = found[lane].is_nan() && single.is_nan();
                        assert!(
                            is_equal || both_nan,
                            "{k} of {} and {}, {width:?}",
                            a[lane],
                            b[lane]
                        );
                    }
                    assert_eq!(positive >> lane & 1, (a[lane] - b[lane]).positive_lanes());
                }
            }
        }
    }
}
