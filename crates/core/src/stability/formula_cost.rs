//! Cost of the library's numerically robust formulas, in nanoseconds per ray or sample. They and
//! textbook formulas are timed alternately by the CPU time of a thread.

use core::hint::black_box;
use std::rc::Rc;

use glam::{DVec3, Vec3};
use raywright_bvh::stability::cost_comparison::{self, CostComparison, TimedWork};
use raywright_bvh::stability::verdicts::CaseRng;
use raywright_bvh::{Real, Vector};

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

/// Number of random samples; below, the number of times that each sample is computed in a round.
const SAMPLES: u32 = 4096;
const TURNS: u32 = 40;

/// Returns the textbook formula and the library's formulas for the hard case with this number,
/// ready to be timed. `None` for a case without textbook formula.
pub fn build_formula_comparison(number: &str) -> Option<CostComparison> {
    Some(match number {
        "S09" => frame_comparison(),
        "S11" => reflection_comparison(),
        "S13" => reflectance_comparison(),
        _ => return cost_comparison::build_cost_comparison(number),
    })
}

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

/// Returns the work of timing three formulas on random samples. `value_of` creates a sample.
/// `works` holds the textbook formula, then the library's formula in the precisions `robust` and
/// `reference`.
fn comparison_over_samples<S: 'static>(
    label: &'static str,
    value_of: impl Fn(&mut CaseRng) -> S,
    works: [fn(&S); 3],
) -> CostComparison {
    let samples: Rc<[S]> = (0..SAMPLES)
        .map(|index| value_of(&mut CaseRng::new(2, index.into())))
        .collect();
    let [textbook, robust, reference] = works.map(|work| {
        let samples = samples.clone();
        Box::new(move || (0..TURNS).for_each(|_| samples.iter().for_each(work))) as TimedWork
    });
    CostComparison {
        label,
        count: SAMPLES * TURNS,
        textbook,
        library: [robust, reference],
    }
}

/// Returns the formulas for a shading frame about a normal.
fn frame_comparison() -> CostComparison {
    let drawn = |rng: &mut CaseRng| {
        let n = rng.sample_direction();
        (n.as_vec3(), n)
    };
    comparison_over_samples(
        "a shading frame about a normal",
        drawn,
        [
            |&(n, _)| {
                black_box(textbook_shading_frame(n));
            },
            |&(n, _)| {
                black_box(ShadingFrame::<f32>::from_normal(n));
            },
            |&(_, n)| {
                black_box(ShadingFrame::<f64>::from_normal(n));
            },
        ],
    )
}

/// Returns the formulas for a mirrored direction: d − 2(d·n)n in f32, and the library's. d is the
/// direction and n the normal.
fn reflection_comparison() -> CostComparison {
    fn reflect_direction<R: Real>([d, n]: [R::Vec3; 2]) {
        black_box(R::Vec3::from_f64(
            SmoothInterface::new(d.to_f64(), n.to_f64(), 1.0).reflected,
        ));
    }
    let drawn = |rng: &mut CaseRng| {
        let pair = [rng.sample_direction(), rng.sample_direction()];
        (pair.map(|v| v.as_vec3()), pair)
    };
    let by_textbook = |&([d, n], _): &([Vec3; 2], [DVec3; 2])| {
        black_box(d - n * (2.0 * d.dot(n)));
    };
    comparison_over_samples(
        "a mirror-reflected direction",
        drawn,
        [
            by_textbook,
            |&(pair, _)| reflect_direction::<f32>(pair),
            |&(_, pair)| reflect_direction::<f64>(pair),
        ],
    )
}

/// Returns the formulas for a reflectance: Schlick's approximation in f32, and the library's
/// Fresnel equations. The latter use f64 in both precisions.
fn reflectance_comparison() -> CostComparison {
    let schlick = |&cosine: &f32| {
        let (r0, m) = (0.04_f32, 1.0 - cosine);
        black_box(r0 + (1.0 - r0) * (m * m * m * m * m));
    };
    let exact = |&cosine: &f32| {
        let (cosine, eta) = (f64::from(cosine), 1.5_f64.recip());
        let beyond = (1.0 - eta * eta * (1.0 - cosine) * (1.0 + cosine)).sqrt();
        black_box(fresnel_dielectric(cosine, Some(beyond), eta));
    };
    comparison_over_samples(
        "a reflectance of glass",
        |rng| rng.next_in_unit_interval() as f32,
        [schlick, exact, exact],
    )
}
