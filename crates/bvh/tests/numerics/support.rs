//! Cases of the library and of the tests, with as many rays as the environment selects, checked
//! against their bounds.

use std::env;
use std::sync::LazyLock;

use raywright_bvh::stability::trial::{TEXTBOOK, measure_precisions};
pub use raywright_bvh::stability::verdicts::{
    CaseOutcome, CaseRng, RayCount, UNIT_ROUNDOFF, Verdict, create_ray_towards,
    create_unnormalised_ray, nearest_hit, require, round_to_f32, to_precision, to_scalar, ulp,
    within,
};
use raywright_bvh::stability::{cases, verdicts};
use raywright_bvh::{Ray, Real, Vector};

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
    verdicts::judge_indices(case, count, rays(), |index| {
        f(&mut CaseRng::new(seed, index))
    })
}

/// Formats the bit patterns of the ray's numbers as f32, for a message.
pub fn format_ray_bits<R: Real>(ray: &Ray<R>) -> String {
    let [origin, direction] = [ray.origin.to_f32(), ray.direction.to_f32()].map(|v| {
        let [x, y, z] = [v.x, v.y, v.z].map(f32::to_bits);
        format!("{x:08x} {y:08x} {z:08x}")
    });
    format!(" (bits of the ray as f32: origin {origin}, direction {direction})")
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
/// are judged. Each precision has an outcome. Returns the textbook's outcomes of the parts.
pub fn expect_all(number: &str, share: f64) -> Vec<CaseOutcome> {
    let outcomes = measure_precisions(number, rays(), &cases(), &cases());
    let (textbook, own): (Vec<_>, Vec<_>) = outcomes
        .expect("a case of the library")
        .into_iter()
        .partition(|outcome| outcome.setting == TEXTBOOK);
    for part in &own {
        eprint!("{}: ", part.setting);
        part.expect_right((share * part.rays as f64).floor() as u64);
    }
    for precision in ["robust", "reference"] {
        let is_of = |outcome: &CaseOutcome| outcome.setting.starts_with(precision);
        assert!(own.iter().any(is_of), "{number} in {precision}");
    }
    textbook
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
