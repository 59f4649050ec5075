//! Cases of the library and of the tests, with as many rays as the environment selects, checked
//! against their bounds.

use std::env;
use std::sync::LazyLock;

pub use raywright_bvh::stability::verdicts::{
    CaseOutcome, CaseRng, RayCount, UNIT_ROUNDOFF, Verdict, create_ray_towards,
    create_unnormalised_ray, format_ray_bits, nearest_hit, round_to_f32, to_scalar, ulp,
};
use raywright_bvh::stability::{Measurement, verdicts};

/// All rays if the variable `RAYS` is `all`, otherwise a quarter.
pub fn rays() -> RayCount {
    static ALL: LazyLock<bool> = LazyLock::new(|| env::var("RAYS").is_ok_and(|rays| rays == "all"));
    if *ALL {
        RayCount::All
    } else {
        RayCount::Quarter
    }
}

/// Judges as many rays of a case as the environment selects.
pub fn judge(
    case: &str,
    seed: u64,
    count: u32,
    f: impl Fn(&mut CaseRng) -> Verdict + Sync,
) -> CaseOutcome {
    verdicts::judge_rays(case, seed, count, rays(), f)
}

/// An outcome to be checked.
pub trait Expect {
    /// Asserts that no ray is wrong, that at least `minimum` of all rays are judged (in proportion
    /// if fewer are shot), and that at most one in a thousand is too close to decide.
    fn expect_right(&self, minimum: u64);
}

impl Expect for CaseOutcome {
    fn expect_right(&self, minimum: u64) {
        let Self {
            case,
            rays,
            shot,
            judged,
            undecidable: band,
            wrong,
            skipped,
            worst,
            ..
        } = self;
        eprintln!(
            "{case}: {judged} judged, {band} in the band, {skipped} skipped, {wrong} wrong, worst {worst:.3} of the bound"
        );
        if let Some((index, message)) = &self.first_wrong {
            panic!("{case}: {wrong} of {judged} wrong; first at {index}: {message}");
        }
        assert!(
            *judged >= (minimum * shot).div_ceil(*rays),
            "{case}: only {judged} of {shot} judged"
        );
        assert!(
            band * 1000 <= judged + band,
            "{case}: {band} of {judged} in the band"
        );
    }
}

/// Asserts every measurement of a case, of which each precision has at least one, and returns them.
pub fn expect_all(number: &str, minimum: u64) -> Vec<Measurement> {
    let measurements =
        raywright_bvh::stability::measure_case(number, rays()).expect("a case of the library");
    for Measurement {
        setting, outcome, ..
    } in &measurements
    {
        eprint!("{setting}: ");
        outcome.expect_right(minimum);
    }
    for precision in ["robust", "reference"] {
        assert!(
            measurements
                .iter()
                .any(|measurement| measurement.setting.starts_with(precision)),
            "{number} in {precision}"
        );
    }
    measurements
}

/// Fraction of rays that textbook formulas get wrong, printed beside those of `robust` and
/// `reference` on the same rays.
pub fn textbook_share(outcomes: [CaseOutcome; 3]) -> f64 {
    let [textbook, robust, reference] = outcomes
        .each_ref()
        .map(|outcome| 100.0 * outcome.wrong_fraction());
    let case = &outcomes[0].case;
    eprintln!(
        "{case}: the textbook is wrong in {textbook:.3} %, robust in {robust:.3} %, reference in {reference:.3} %"
    );
    outcomes[0].wrong_fraction()
}
