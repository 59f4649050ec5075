//! Numerically hard cases: situations in which textbook formulas lose digits. For each case, the
//! library promises an error bound. One or several tests check it; their names begin with the
//! case's number. The function [`measure_case`] and the command `raywright stability` also measure
//! many of the cases.

mod cameras;
mod formula_cost;
mod sampling;
mod scattering;
mod shading;

pub use formula_cost::{CaseCost, time_case_formulas};
pub use raywright_bvh::stability::trial::TEXTBOOK;
pub use raywright_bvh::stability::verdicts::{CaseOutcome, RayCount};

use raywright_bvh::stability::prelude::*;

/// A numerically hard case: what makes it hard, and the bound of the error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HardCase {
    /// Number of the case: a letter for the subject and two digits. The letters are P (primitives),
    /// T (traversal), S (spawned rays and shading), M (sampling) and F (camera and film).
    pub number: &'static str,
    /// Short name.
    pub name: &'static str,
    /// What makes the case hard, in words.
    pub difficulty: &'static str,
    /// Bound that the error of the result must meet, in words.
    pub bound: &'static str,
    /// Part of the case that does not apply to this program or does not hold, with the reason.
    /// `None` if every part applies and holds.
    pub left_out: Option<&'static str>,
    /// Number of results that are known to exceed the bound in a setting.
    pub known_wrong: u64,
}

/// List of the cases, one per line: number, name, difficulty, bound, omitted part and number of
/// results known to be wrong, separated by ` | `.
const LIST: &str = include_str!("stability/cases.txt");

/// Iterates over all hard cases in the order of the list.
pub fn hard_cases() -> impl Iterator<Item = HardCase> {
    LIST.lines().map(|line| {
        let mut parts = line.split(" | ");
        let [number, name, difficulty, bound] = [(); 4].map(|()| parts.next().unwrap_or_default());
        HardCase {
            number,
            name,
            difficulty,
            bound,
            left_out: parts.next(),
            known_wrong: parts
                .next()
                .map_or(0, |count| count.parse().expect("a number")),
        }
    })
}

/// Measures the hard case with this number: an outcome for each part in both precisions, by textbook
/// formulas where it has any, and, for a case of BVH traversal, with every SIMD kernel that the
/// processor supports. `None` for a case that exists only as a test.
pub fn measure_case(number: &str, rays: RayCount) -> Option<Vec<CaseOutcome>> {
    fn cases<R: Real>() -> Vec<Case<R>> {
        let bvh = raywright_bvh::stability::cases;
        let cases = [
            bvh,
            shading::cases,
            scattering::cases,
            sampling::cases,
            cameras::cases,
        ];
        cases.map(|cases| cases()).concat()
    }
    measure_precisions(number, rays, &cases(), &cases())
}

#[cfg(test)]
mod tests;
