//! Findings about overlapping coplanar surfaces, judged by the rays that hit them.

use std::collections::BTreeMap;

use glam::DVec3;

use super::coplanar::DepthResolution;
use super::facts::{SceneFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::numbers::{append_metre_unit, format_metres, format_rounded_up};
use super::overlap_table::{CoplanarOverlap, OverlapTable};
use super::ray_survey::RaySurvey;
use crate::settings::PrecisionChoice;

/// Remedy for two bodies of glass that touch.
pub(super) const TOUCHING_GLASS_REMEDY: &str =
    "let one reach into the other and set a `priority` for the material of each";

/// An object that other objects cover in an overlap.
struct CoveredObject {
    other: usize,
    others: usize,
    /// Number of rays that hit the overlap, and number of those that hit this object first.
    rays: [u64; 2],
    position: DVec3,
    gap: f64,
    /// Whether both objects are visible in turns.
    flickers: bool,
    /// Whether one of the two objects emits light.
    shines: bool,
}

/// Returns the findings about overlaps. `is_told` tells whether a pair is reported elsewhere. The
/// picture is wrong in three cases:
/// - All rays that could see an object hit another object in its place.
/// - Rounding decides from ray to ray which object is visible.
/// - One of the two objects emits light.
pub(super) fn check_overlaps(
    scene_facts: &SceneFacts<'_>,
    overlaps: &OverlapTable,
    survey: &RaySurvey,
    resolution: &DepthResolution<'_>,
    is_told: impl Fn([usize; 2]) -> bool,
) -> Vec<StressFinding> {
    let mut pairs: BTreeMap<[usize; 2], &CoplanarOverlap> = BTreeMap::new();
    for overlap in overlaps.list.iter().filter(|o| !o.is_back_to_back) {
        pairs.entry(overlap.objects).or_insert(overlap);
    }
    let mut all: BTreeMap<(bool, usize), CoveredObject> = BTreeMap::new();
    for ([a, b], overlap) in pairs {
        let [first, second] =
            [[a, b], [b, a]].map(|pair| RaySurvey::sighting_count(&survey.coplanar, &pair));
        let is_seen = first + second >= 3;
        let flickers = first + second >= 10 && 20 * first.min(second) >= first + second;
        let is_apart = overlap.gap > resolution.min_separation_at(overlap.position) && !flickers;
        if is_told([a, b]) || is_apart || !is_seen && !overlap.are_sheets {
            continue;
        }
        let [hidden, other] = if second > first { [a, b] } else { [b, a] };
        let sighting = survey.coplanar.get(&[other, hidden]).filter(|_| is_seen);
        let position = sighting.map_or(overlap.position, |sighting| sighting.position);
        let covered = all.entry((flickers, hidden)).or_insert(CoveredObject {
            other,
            others: 0,
            rays: [0; 2],
            position,
            gap: overlap.gap,
            flickers,
            shines: false,
        });
        covered.shines |= [a, b]
            .iter()
            .any(|&of| scene_facts.objects[of].emits_light());
        if is_seen {
            (covered.rays[0], covered.rays[1]) = (
                covered.rays[0] + first + second,
                covered.rays[1] + first.min(second),
            );
        }
        covered.others += 1;
    }
    all.iter()
        .map(|(&(_, hidden), covered)| {
            overlap_finding(scene_facts, hidden, covered, survey, resolution)
        })
        .collect()
}

fn overlap_finding(
    scene_facts: &SceneFacts<'_>,
    hidden: usize,
    covered: &CoveredObject,
    survey: &RaySurvey,
    resolution: &DepthResolution<'_>,
) -> StressFinding {
    let named = scene_facts.objects[covered.other]
        .subject
        .display_name(scene_facts.scene);
    let others = match covered.others {
        1 => named,
        more => format!("{named} and {} more", more - 1),
    };
    let [rays, own] = covered.rays;
    let is_lost = 20 * own < rays && RaySurvey::sighting_count(&survey.first_hits, &hidden) <= own;
    let minimum = resolution.min_separation_at(covered.position);
    let lies = match covered.gap {
        0.0 => format!("it lies in one plane with {others}"),
        gap => format!(
            "it lies only {} from {others}, while the precision there separates surfaces that are {} or more apart",
            format_metres(gap),
            append_metre_unit(&format_rounded_up(minimum))
        ),
    };
    let elsewhere = RaySurvey::sighting_count(&survey.first_hits, &hidden).saturating_sub(own);
    let (code, severity, end) = overlap_verdict(covered, is_lost, elsewhere);
    let are_glass = [hidden, covered.other]
        .iter()
        .all(|&object| scene_facts.objects[object].surface_kind == SurfaceKind::Body);
    let separation = match are_glass {
        true => TOUCHING_GLASS_REMEDY.to_owned(),
        false => separation_remedy(minimum, covered.gap, resolution.precision),
    };
    let remedy = match severity {
        Severity::Harmless => {
            format!("nothing; if this object should be seen there, {separation}")
        }
        _ => separation,
    };
    let subject = scene_facts.objects[hidden].subject;
    let finding = StressFinding::new(code, severity, subject, lies + &end, remedy);
    let counted_finding = if rays > 0 {
        finding.with_count(rays, survey.rays, "rays", "of the cameras hit the overlap")
    } else {
        finding
    };
    counted_finding.with_place(finite_point(covered.position))
}

/// Returns the code, the severity and the end of the reason for a covered object. `is_lost`: other
/// objects cover it wherever it could be seen. `elsewhere`: rays that hit it outside the overlap.
fn overlap_verdict(
    covered: &CoveredObject,
    is_lost: bool,
    elsewhere: u64,
) -> (FindingCode, Severity, String) {
    let [rays, own] = covered.rays;
    match (covered.flickers, is_lost, covered.shines, rays) {
        (true, ..) => (
            FindingCode::FlickeringSurfaces,
            Severity::PictureWrong,
            format!(
                ": rounding decides from ray to ray which object is seen ({own} of {rays} rays hit this one)"
            ),
        ),
        (_, true, ..) => (
            FindingCode::CoplanarSurfaces,
            Severity::PictureWrong,
            format!(
                "; {} of {rays} rays in the overlap hit the other surface, and no ray hits this object outside the overlap",
                rays - own
            ),
        ),
        (_, _, true, _) => (
            FindingCode::CoplanarSurfaces,
            Severity::PictureWrong,
            "; one of the two emits light, and the order of the objects in the file decides whether that light is seen there, and what it lights".to_owned(),
        ),
        (.., 0) => (
            FindingCode::CoplanarSurfaces,
            Severity::Harmless,
            "; no ray of the cameras hits the overlap".to_owned(),
        ),
        _ => (
            FindingCode::CoplanarSurfaces,
            Severity::Harmless,
            format!(
                "; rounding does not decide which of the two is seen: {own} of {rays} rays in the overlap hit this object, and {elsewhere} rays hit it outside the overlap"
            ),
        ),
    }
}

/// Returns the remedy for two surfaces that are too close. `minimum` is the least distinguishable
/// separation, `gap` the actual one, both in metres.
pub(super) fn separation_remedy(minimum: f64, gap: f64, precision: PrecisionChoice) -> String {
    let exact = match precision {
        PrecisionChoice::Robust if gap > 0.0 => ", or render with --precision reference",
        _ => "",
    };
    // In double precision, files have fewer digits than storage.
    let minimum = match precision {
        PrecisionChoice::Robust => minimum,
        PrecisionChoice::Reference => 1e6 * minimum,
    };
    let least = append_metre_unit(&format_rounded_up(minimum));
    format!(
        "leave {least} or more between the two: move the object that should be seen to the side from which it should be seen, or remove the other{exact}"
    )
}
