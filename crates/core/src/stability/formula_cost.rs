//! Cost of the library's numerically robust formulas, in nanoseconds per ray or sample. They and
//! textbook formulas are timed alternately by the CPU time of a thread.

use core::hint::black_box;

use raywright_bvh::stability::cost_comparison::{
    CostComparison, build_cost_comparison, compare_formulas,
};
use raywright_bvh::stability::prelude::*;

use super::shading::textbook_shading_frame;
use crate::bench::SampleQuantiles;
use crate::bench::clock::thread_seconds;
use crate::material::{ShadingFrame, SmoothInterface, fresnel_dielectric};

/// Times of the textbook formula and of the library's formulas for a numerically hard case.
#[derive(Clone, Copy, Debug)]
pub struct CaseCost {
    /// Description of the work that is done per ray or sample.
    pub label: &'static str,
    /// Time of the textbook formula in `f32`, in nanoseconds per ray or sample.
    pub textbook: SampleQuantiles,
    /// Time of the library's formula minus that of the textbook formula, in nanoseconds per ray or
    /// sample. The two values are for the precisions `robust` and `reference`.
    pub overhead: [SampleQuantiles; 2],
}

/// Number of timed rounds. A round before them is not counted.
const ROUNDS: usize = 15;

/// Times the textbook formula and the library's formulas for the hard case with this number. `None`
/// for a case without textbook formula.
pub fn time_case_formulas(number: &str) -> Option<CaseCost> {
    let CostComparison {
        label,
        count,
        textbook,
        library: [robust, reference],
    } = build_formula_comparison(number)?;
    let works = [textbook, robust, reference];
    let mut rounds = Vec::with_capacity(ROUNDS);
    for round in 0..=ROUNDS {
        let mut nanoseconds = [0.0; 3];
        for index in 0..works.len() {
            let turn = (index + round) % works.len();
            let start = thread_seconds();
            works[turn]();
            nanoseconds[turn] = (thread_seconds() - start) * 1e9 / f64::from(count);
        }
        if round > 0 {
            rounds.push(nanoseconds);
        }
    }
    let spread = |of: &dyn Fn(&[f64; 3]) -> f64| {
        SampleQuantiles::from_samples(&rounds.iter().map(of).collect::<Vec<_>>())
    };
    Some(CaseCost {
        label,
        textbook: spread(&|round| round[0]),
        overhead: [1, 2].map(|selected| spread(&|round| round[selected] - round[0])),
    })
}

/// Number of times that each sample is computed in a round.
const TURNS: u32 = 40;

/// Returns the textbook formula and the library's formulas for the hard case with this number,
/// ready to be timed. `None` for a case without textbook formula.
pub fn build_formula_comparison(number: &str) -> Option<CostComparison> {
    Some(match number {
        "S09" => compare_formulas(
            "a shading frame about a normal",
            TURNS,
            |rng| draw_directions(rng)[0],
            |&(n, _)| consume(textbook_shading_frame(n)),
            |&(n, _)| consume(ShadingFrame::<f32>::from_normal(n)),
            |&(_, n)| consume(ShadingFrame::<f64>::from_normal(n)),
        ),
        // d − 2(d·n)n in f32, and the library's.
        "S11" => compare_formulas(
            "a mirror-reflected direction",
            TURNS,
            draw_directions,
            |&[(d, _), (n, _)]| consume(d - n * (2.0 * d.dot(n))),
            |&[(d, _), (n, _)]| consume(reflect::<f32>(d, n)),
            |&[(_, d), (_, n)]| consume(reflect::<f64>(d, n)),
        ),
        // Schlick's approximation in f32, and the library's Fresnel equations, which use f64 in both
        // precisions.
        "S13" => compare_formulas(
            "a reflectance of glass",
            TURNS,
            |rng| rng.next_in_unit_interval() as f32,
            |&cosine| consume(0.04 + 0.96 * (1.0 - cosine).powi(5)),
            |&cosine| consume(reflectance_of_glass(cosine)),
            |&cosine| consume(reflectance_of_glass(cosine)),
        ),
        _ => return build_cost_comparison(number),
    })
}

/// Keeps the compiler from leaving out a computation without further use.
fn consume<T>(value: T) {
    black_box(value);
}

/// Draws two directions in both precisions.
fn draw_directions(rng: &mut CaseRng) -> [(Vec3, DVec3); 2] {
    [(); 2].map(|()| {
        let direction = rng.sample_direction();
        (direction.as_vec3(), direction)
    })
}

fn reflect<R: Real>(d: R::Vec3, n: R::Vec3) -> R::Vec3 {
    R::Vec3::from_f64(SmoothInterface::new(d.to_f64(), n.to_f64(), 1.0).reflected)
}

fn reflectance_of_glass(cosine: f32) -> f64 {
    let (cosine, eta) = (f64::from(cosine), 1.5_f64.recip());
    let beyond = (1.0 - eta * eta * (1.0 - cosine) * (1.0 + cosine)).sqrt();
    fresnel_dielectric(cosine, Some(beyond), eta)
}
