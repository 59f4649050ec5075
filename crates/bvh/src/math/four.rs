//! Four scalars side by side, in which formulas are computed: the vector registers of the platform where glam has them for the scalar, the
//! same operations one by one elsewhere.

use core::ops::{Add, Div, Mul, Sub};

use glam::{DVec4, Vec4};

/// A scalar that comes four at a time too.
pub trait Laned: Sized {
    /// Four of them.
    type Four: Four<Self>;
}

/// What formulas need of four scalars.
pub trait Four<R>:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Mul<R, Output = Self>
    + Div<R, Output = Self>
{
    /// From their numbers.
    fn from_row(row: [R; 4]) -> Self;
    /// Their numbers.
    fn row(self) -> [R; 4];
    /// The same number four times.
    fn splat(value: R) -> Self;
}

macro_rules! laned {
    ($scalar:ident, $four:ident) => {
        impl Laned for $scalar {
            type Four = $four;
        }

        impl Four<$scalar> for $four {
            #[inline(always)]
            fn from_row(row: [$scalar; 4]) -> Self {
                Self::from_array(row)
            }
            #[inline(always)]
            fn row(self) -> [$scalar; 4] {
                self.to_array()
            }
            #[inline(always)]
            fn splat(value: $scalar) -> Self {
                Self::splat(value)
            }
        }
    };
}

laned!(f32, Vec4);
laned!(f64, DVec4);
