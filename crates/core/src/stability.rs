//! Hard cases of numerics: situations in which textbook formulas lose digits, each with a bound
//! that the library must keep. Each case is one or several tests whose names begin with its number.
//! Cases that are functions in this module are also measured by programs.

mod cameras;
mod fresnel;
mod microfacets;
mod price;
mod sampling;
mod shading;

pub use price::{CasePrice, contest, price};
pub use raywright_bvh::stability::Measurement;
pub use raywright_bvh::stability::contest::Contest;
pub use raywright_bvh::stability::judge::{Outcome, RayCount};

/// Hard case of numerics, with its difficulty and its bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HardCase {
    /// Number of the case: a letter (P primitives, T traversal, S spawned rays and shading, M
    /// sampling, F camera and film) and two digits.
    pub number: &'static str,
    /// Difficulty of the case, in words.
    pub hard: &'static str,
    /// Bound that the result must keep, in words.
    pub bound: &'static str,
    /// Part of the case that does not apply to this program, with the reason; `None` if the whole
    /// case is covered.
    pub left_out: Option<&'static str>,
}

/// List of the cases, one per line: number, difficulty, bound and omitted part, separated by ` | `.
const LIST: &str = include_str!("stability/cases.txt");

/// Iterates over all hard cases in the order of the list.
pub fn hard_cases() -> impl Iterator<Item = HardCase> {
    LIST.lines().map(|line| {
        let mut parts = line.split(" | ");
        let mut next = || parts.next().unwrap_or_default();
        let (number, hard, bound) = (next(), next(), next());
        HardCase {
            number,
            hard,
            bound,
            left_out: parts.next(),
        }
    })
}

/// Measures the hard case with this number, in both precisions and, for a tree traversal, with
/// every kernel of the processor; `None` for a case that is only a test.
pub fn measure(number: &str, rays: RayCount) -> Option<Vec<Measurement>> {
    /// Measures a case in both precisions.
    macro_rules! both {
        ($module:ident::$of:ident) => {
            [$module::$of::<f32>(rays), $module::$of::<f64>(rays)].concat()
        };
    }
    Some(match number {
        "S09" => both!(shading::frames),
        "S10" => both!(shading::lengths),
        "S11" => both!(shading::mirrors),
        "S13" => fresnel::matched_indices(rays),
        "S14" => fresnel::exact_equations(rays),
        "S15" => fresnel::schlick(rays),
        "S17" => both!(microfacets::narrow_lobes),
        "S18" => both!(microfacets::visible_normals),
        "M01" => sampling::below_one(rays),
        "M02" => both!(sampling::warps),
        "M11" => sampling::stratified(rays),
        "F01" => both!(cameras::degenerate_views),
        "F02" => both!(cameras::symmetric_views),
        "F03" => both!(cameras::lenses),
        _ => return raywright_bvh::stability::measure(number, rays),
    })
}

#[cfg(test)]
mod tests;
