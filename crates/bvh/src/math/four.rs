//! Four scalars side by side, in which formulas are computed: the vector registers of the platform where glam has them for the scalar, the
//! same operations one by one elsewhere.

use core::ops::{Add, Div, Mul, Sub};

use glam::{DVec4, Vec4};

/// What formulas need of four scalars.
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
