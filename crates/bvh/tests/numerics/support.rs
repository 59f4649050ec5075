//! Cases of the library and of the tests, with as many rays as the environment selects, checked
//! against their bounds.

use std::env;
use std::sync::LazyLock;

use raywright_bvh::stability::trial::Measurement;
pub use raywright_bvh::stability::verdicts::{
    CaseOutcome, CaseRng, RayCount, UNIT_ROUNDOFF, Verdict, create_ray_towards,
    create_unnormalised_ray, format_ray_bits, nearest_hit, round_to_f32, to_scalar, ulp,
};
use raywright_bvh::stability::{measure_case, verdicts};

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

/// Asserts every part of a case of the library: no ray is wrong, and at least `share` of the rays
/// are judged. Each precision has a measurement. Returns the textbook's outcomes of the parts.
pub fn expect_all(number: &str, share: f64) -> Vec<CaseOutcome> {
    let measurements = measure_case(number, rays()).expect("a case of the library");
    for Measurement { setting, parts, .. } in &measurements {
        for part in parts {
            eprint!("{setting}: ");
            part.expect_right((share * part.rays as f64).floor() as u64);
        }
    }
    for precision in ["robust", "reference"] {
        let is_of = |measurement: &Measurement| measurement.setting.starts_with(precision);
        assert!(measurements.iter().any(is_of), "{number} in {precision}");
    }
    measurements
        .into_iter()
        .next()
        .expect("one of each")
        .textbook
}

/// Asserts that the textbook's formulas fail where the specification says so, so that a case is
/// hard: in more than `share` of the rays of the part with this name, in all such parts together.
pub fn expect_hard(textbook: &[CaseOutcome], part: &str, share: f64) {
    let parts = textbook
        .iter()
        .filter(|outcome| outcome.case.contains(part))
        .cloned();
    let outcome = parts
        .reduce(CaseOutcome::merge)
        .expect("a part of the textbook");
    let wrong = outcome.wrong_fraction();
    eprintln!(
        "{}: the textbook is wrong in {:.3} %",
        outcome.case,
        100.0 * wrong
    );
    assert!(wrong > share, "{}: only {wrong} wrong", outcome.case);
}
