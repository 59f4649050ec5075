//! The hard cases of numerics: what is hard about each, and the bound that it is held to. Each is a
//! test, or several, whose name begins with its number; those that are functions here are measured
//! by programs too.

mod cameras;
mod facets;
mod fresnel;
mod price;
mod sampling;
mod shading;

pub use price::{Price, contest, price};
pub use raywright_bvh::stability::Measurement;
pub use raywright_bvh::stability::contest::Contest;
pub use raywright_bvh::stability::judge::{Outcome, Rays};

/// A hard case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HardCase {
    /// A letter and two digits: P primitives, T traversal, S rays that leave surfaces and shading,
    /// M sampling, F camera and film.
    pub number: &'static str,
    /// What is hard.
    pub hard: &'static str,
    /// The bound, in words.
    pub bound: &'static str,
    /// What of it this program has no such thing for, and why; none where all of it is held.
    pub left_out: Option<&'static str>,
}

/// One case a line: number, what is hard, bound and what is left out, with a bar between two spaces
/// from one to the next.
const LIST: &str = include_str!("stability/cases.txt");

/// All hard cases in the order of the list.
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

/// Measures a case in both precisions, and by every kernel that this processor has where a tree is
/// walked; none where the case is a test alone.
pub fn measure(number: &str, rays: Rays) -> Option<Vec<Measurement>> {
    /// A case of both precisions.
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
        "S17" => both!(facets::narrow_lobes),
        "S18" => both!(facets::visible_normals),
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
