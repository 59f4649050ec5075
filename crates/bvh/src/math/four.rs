//! Four scalars side by side, in which formulas are computed: the vector registers of the platform where glam has them for the scalar, the
//! same operations one by one elsewhere.

use core::ops::{Add, Div, Mul, Sub};

use glam::{DVec4, Vec4};

/// What formulas need of four scalars.
pub trait Four<R: Copy>:
    Copy
    + From<[R; 4]>
    + Into<[R; 4]>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Mul<R, Output = Self>
    + Div<R, Output = Self>
{
    /// From their numbers.
    #[inline(always)]
    fn from_row(row: [R; 4]) -> Self {
        row.into()
    }
    /// Their numbers.
    #[inline(always)]
    fn row(self) -> [R; 4] {
        self.into()
    }
    /// The same number four times.
    #[inline(always)]
    fn splat(value: R) -> Self {
        [value; 4].into()
    }
}

impl Four<f32> for Vec4 {}
impl Four<f64> for DVec4 {}
