//! Numerically hard cases of ray intersection: rays for which textbook formulas lose digits or
//! hits.
//!
//! Each case has a number, such as P01 or T03. It also has an oracle of higher accuracy, which
//! judges the library's results. A case is a row of a file's table: its number, and the function
//! that builds its scenes, and draws and judges its rays. A [`trial::Trial`] has the loops over
//! rays, kernels and textbook formulas. Tests run the cases, and `raywright stability` prints their
//! outcomes.

mod boxes;
pub mod meshes;
pub mod quadrics;
pub mod shapes;
pub mod textbook;
pub mod trees;
pub mod trial;
pub mod verdicts;

/// What the functions of cases use.
pub mod prelude {
    pub use glam::{DVec3, Vec3};

    pub use super::trial::*;
    pub use super::verdicts::*;
    pub use crate::shapes::*;
    pub use crate::*;
}

use self::prelude::*;

/// Returns the cases of this crate.
pub fn cases<R: Real>() -> Vec<Case<R>> {
    let cases = [
        shapes::cases,
        quadrics::cases,
        meshes::cases,
        boxes::cases,
        trees::cases,
    ];
    cases.map(|cases| cases()).concat()
}
