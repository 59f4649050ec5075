//! Numerics beyond the standard library: angles, double-double arithmetic, vectors of four scalars,
//! and eight SIMD lanes.

pub(crate) mod angles;
pub(crate) mod double_double;
pub(crate) mod lanes;
pub(crate) mod simd;

use core::ops::{Add, Div, Mul, Sub};

use glam::{DVec4, Vec4};

/// Vector of four scalars for parallel arithmetic: the glam type for the scalar. glam uses SIMD
/// registers where it supports them for that scalar.
pub trait FourLanes<R>:
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

impl FourLanes<f32> for Vec4 {}
impl FourLanes<f64> for DVec4 {}
