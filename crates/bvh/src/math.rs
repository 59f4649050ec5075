//! Numbers beyond those of the language: angles, twice the precision, four scalars in a formula, eight lanes.

pub(crate) mod angles;
pub(crate) mod double_double;
pub(crate) mod four;
pub(crate) mod simd;
