//! Numerically hard cases: situations in which textbook formulas lose digits. For each case, the
//! library promises an error bound. One or several tests check it; their names begin with the
//! case's number. The function [`measure_case`] and the command `raywright stability` also measure
//! many of the cases.

mod cameras;
mod formula_cost;
mod fresnel;
mod microfacets;
mod sampling;
mod shading;

pub use formula_cost::{CaseCost, build_formula_comparison, time_case_formulas};
pub use raywright_bvh::stability::Measurement;
pub use raywright_bvh::stability::cost_comparison::CostComparison;
pub use raywright_bvh::stability::verdicts::{CaseOutcome, RayCount};

/// A numerically hard case: what makes it hard, and the bound of the error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HardCase {
    /// Number of the case: a letter for the subject and two digits. The letters are P (primitives),
    /// T (traversal), S (spawned rays and shading), M (sampling) and F (camera and film).
    pub number: &'static str,
    /// What makes the case hard, in words.
    pub difficulty: &'static str,
    /// Bound that the error of the result must meet, in words.
    pub bound: &'static str,
    /// Part of the case that does not apply to this program, with the reason. `None` if every part
    /// applies.
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
            difficulty: hard,
            bound,
            left_out: parts.next(),
        }
    })
}

/// Measures the hard case with this number in both precisions. A case of BVH traversal is also
/// measured with every SIMD kernel that the processor supports. `None` for a case that exists only
/// as a test.
pub fn measure_case(number: &str, rays: RayCount) -> Option<Vec<Measurement>> {
    /// Measures a case in both precisions, `robust` and `reference`.
    macro_rules! both {
        ($module:ident::$of:ident) => {
            [$module::$of::<f32>(rays), $module::$of::<f64>(rays)].concat()
        };
    }
    Some(match number {
        "S09" => both!(shading::measure_shading_frames),
        "S10" => both!(shading::measure_normalisation),
        "S11" => both!(shading::measure_mirror_bounces),
        "S13" => fresnel::measure_matched_indices(rays),
        "S14" => fresnel::measure_fresnel(rays),
        "S15" => fresnel::measure_schlick(rays),
        "S17" => both!(microfacets::measure_narrow_lobes),
        "S18" => both!(microfacets::measure_visible_normals),
        "M01" => sampling::measure_random_range(rays),
        "M02" => both!(sampling::measure_sample_mappings),
        "M11" => sampling::measure_stratification(rays),
        "F01" => both!(cameras::measure_degenerate_views),
        "F02" => both!(cameras::measure_symmetric_views),
        "F03" => both!(cameras::measure_degenerate_lenses),
        _ => return raywright_bvh::stability::measure_case(number, rays),
    })
}

#[cfg(test)]
mod tests;
