//! Numbers beyond those of the language: angles, twice the precision, four scalars in a formula,
//! eight lanes.

pub(crate) mod angles;
pub(crate) mod double_double;
pub(crate) mod simd;

use core::ops::{Add, Div, Mul, Sub};

use glam::{DVec4, Vec4};

/// Four scalars side by side, in which formulas are computed: the vector registers of the platform
/// where glam has them for the scalar, the same operations one by one elsewhere.
pub trait Four<R>:
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
}

impl Four<f32> for Vec4 {}
impl Four<f64> for DVec4 {}
