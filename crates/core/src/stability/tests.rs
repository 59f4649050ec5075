//! The measured cases of this crate, against their bounds.

use std::collections::BTreeSet;
use std::env;

use super::{CaseOutcome, RayCount, TEXTBOOK, hard_cases, measure_case};

/// Requires that no part of a case is wrong in any precision beyond what the list states, and at
/// most one in a thousand too close to call; returns the outcomes.
fn expect_all(number: &str) -> Vec<CaseOutcome> {
    let rays = if env::var("RAYS").is_ok_and(|rays| rays == "all") {
        RayCount::All
    } else {
        RayCount::Quarter
    };
    let case = hard_cases()
        .find(|case| case.number == number)
        .expect("a hard case");
    let outcomes = measure_case(number, rays).expect("a case of the library");
    for outcome in outcomes.iter().filter(|own| own.setting != TEXTBOOK) {
        let is_known = outcome.setting == "robust" && outcome.case.ends_with("in a ball");
        let known = if is_known { case.known_wrong } else { 0 };
        assert!(outcome.wrong <= known, "{outcome:?}");
        assert!(
            2 * outcome.judged >= outcome.shot && outcome.undecidable * 1000 <= outcome.shot,
            "{outcome:?}"
        );
    }
    for precision in ["robust", "reference"] {
        let is_of = |outcome: &CaseOutcome| outcome.setting.starts_with(precision);
        assert!(outcomes.iter().any(is_of), "{number} in {precision}");
    }
    outcomes
}

/// Requires that the textbook's formula fails at the difficulty of the case, in at least this share
/// of the judged cases.
fn expect_hard(outcomes: Vec<CaseOutcome>, minimum: f64) {
    let textbook = outcomes.into_iter().filter(|own| own.setting == TEXTBOOK);
    let share = textbook
        .reduce(CaseOutcome::merge)
        .expect("of the textbook")
        .wrong_fraction();
    assert!(share >= minimum, "only {share} wrong");
}

/// Protects: random numbers are below one for every word, and filters place them within their
/// radius.
#[test]
fn m01_numbers_are_below_one() {
    expect_all("M01");
}

/// Protects: directions and points sampled at the corners of the unit square are unit, finite and
/// have a density.
#[test]
fn m02_corners_of_the_unit_square() {
    expect_all("M02");
}

/// Protects: a whole sequence is stratified in every division of the square, at either end of the
/// addresses.
#[test]
fn m11_a_whole_sequence_is_stratified() {
    expect_all("M11");
}

/// Protects: frames about any normal are orthonormal, also near −z, where the textbook's is not.
#[test]
fn s09_frames_are_orthonormal() {
    expect_hard(expect_all("S09"), 1e-2);
}

/// Protects: vectors of any length are normalised, or replaced by a defined fallback.
#[test]
fn s10_vectors_of_any_length() {
    expect_all("S10");
}

/// Protects: ten thousand mirror bounces keep a direction's length and the invariant of the closed
/// form. In a ball in `robust` nine rays of sixty exceed the bound, as the list states; no more
/// than those may.
#[test]
fn s11_mirror_bounces() {
    let judged: u64 = expect_all("S11").iter().map(|outcome| outcome.judged).sum();
    assert_eq!(judged, 4 * 60);
}

/// Protects: media of nearly equal index deflect no ray and reflect nearly nothing.
#[test]
fn s13_matched_indices() {
    expect_hard(expect_all("S13"), 1e-2);
}

/// Protects: Fresnel's equations keep their digits, and reflected and transmitted light add up to
/// all.
#[test]
fn s14_exact_equations() {
    expect_all("S14");
}

/// Protects: Schlick's approximation is within its known error, also from inside.
#[test]
fn s15_schlick() {
    expect_hard(expect_all("S15"), 0.1);
}

/// Protects: nearly smooth microfacets have a density where the textbook's form has lost it.
#[test]
fn s17_narrow_lobes() {
    expect_hard(expect_all("S17"), 0.1);
}

/// Protects: no sampled direction of microfacets has a weight above their reflectance, also at
/// grazing views.
#[test]
fn s18_visible_normals() {
    expect_all("S18");
}

/// Protects: cameras without a defined up direction are refused, and each pixel of all others has a
/// ray.
#[test]
fn f01_degenerate_views() {
    expect_all("F01");
}

/// Protects: no row or column of an odd number of pixels looks through the edges at which it is
/// aimed.
#[test]
fn f02_symmetric_views() {
    expect_all("F02");
}

/// Protects: a lens without an aperture is a pinhole, and any focus distance gives finite rays.
#[test]
fn f03_lenses() {
    expect_all("F03");
}

/// Protects: the list is complete: each number once, none missing between a letter's first and
/// last, and each with a difficulty and a bound.
#[test]
fn the_list_is_whole() {
    let numbers: BTreeSet<_> = hard_cases().map(|case| case.number.to_owned()).collect();
    let letters = [("P", 23), ("T", 21), ("S", 21), ("M", 14), ("F", 10)];
    let expected = letters
        .iter()
        .flat_map(|(letter, last)| (1..=*last).map(move |i| format!("{letter}{i:02}")));
    assert_eq!(numbers, expected.collect());
    assert_eq!(hard_cases().count(), numbers.len());
    assert!(hard_cases().all(|case| !case.difficulty.is_empty() && !case.bound.is_empty()));
    let names: BTreeSet<_> = hard_cases().map(|case| case.name).collect();
    assert_eq!(names.len(), numbers.len());
    // A bar is also an absolute value.
    let bound = |number: &str| {
        hard_cases()
            .find(|case| case.number == number)
            .expect("a case")
            .bound
    };
    assert!(bound("P06").contains("t·|d| within") && bound("P23").ends_with("inverse transpose"));
    let left_out: Vec<_> = hard_cases()
        .filter(|case| case.left_out.is_some())
        .map(|case| case.number)
        .collect();
    assert_eq!(left_out, ["T19", "S07", "S11", "S21"]);
}
