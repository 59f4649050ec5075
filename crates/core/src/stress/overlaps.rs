//! Findings about overlapping coplanar surfaces, judged by the rays that hit them.

use super::bodies::{TOUCHING_GLASS_REMEDY, shows_in_turns};
use super::coplanar::CoplanarOverlap;
use super::*;

/// Greatest gap of surfaces that are seen in turns by rounding, in units of the least separation that
/// the precision always distinguishes.
const FLICKERING: f64 = 16.0;

/// An object that other objects cover in an overlap.
struct CoveredObject {
    other: usize,
    others: usize,
    /// Number of rays that hit the overlap, and number of those that hit this object first.
    rays: [u64; 2],
    position: DVec3,
    gap: f64,
    /// Whether one of the two objects emits light.
    shines: bool,
}

impl SceneFacts<'_> {
    /// Returns the findings about overlaps. `is_told` tells whether a pair is reported elsewhere. The
    /// picture is wrong in three cases:
    /// - All rays that could see an object hit another object in its place.
    /// - Rounding decides from ray to ray which object is visible.
    /// - One of the two objects emits light.
    pub fn check_overlaps(
        &self,
        survey: &RaySurvey,
        is_told: impl Fn([usize; 2]) -> bool,
    ) -> Vec<Fault> {
        let mut pairs: BTreeMap<[usize; 2], &CoplanarOverlap> = BTreeMap::new();
        for overlap in self.overlaps.list.iter().filter(|o| !o.is_back_to_back) {
            pairs.entry(overlap.objects).or_insert(overlap);
        }
        let mut all: BTreeMap<(bool, usize), CoveredObject> = BTreeMap::new();
        for ([a, b], overlap) in pairs {
            let [first, second] =
                [[a, b], [b, a]].map(|pair| survey.count(RayEvent::Coplanar(pair)));
            let is_seen = first + second >= 3;
            let flickers = shows_in_turns(first, second);
            // Rounding decides at slightly more than what is always told apart.
            let roundings = if flickers { FLICKERING } else { 1.0 };
            let is_apart = overlap.gap > roundings * self.min_separation_at(overlap.position);
            if is_told([a, b]) || is_apart || !is_seen && !overlap.are_sheets {
                continue;
            }
            let [hidden, other] = if second > first { [a, b] } else { [b, a] };
            let sighting = survey.events.get(&RayEvent::Coplanar([other, hidden]));
            let position = sighting.filter(|_| is_seen).map(|at| at.position);
            let covered = all.entry((flickers, hidden)).or_insert(CoveredObject {
                other,
                others: 0,
                rays: [0; 2],
                position: position.unwrap_or(overlap.position),
                gap: overlap.gap,
                shines: false,
            });
            covered.others += 1;
            covered.shines |= [a, b].iter().any(|&of| self.objects[of].emits_light());
            if is_seen {
                covered.rays[0] += first + second;
                covered.rays[1] += first.min(second);
            }
        }
        let finding = |(&(flickers, hidden), covered): (&(bool, usize), &CoveredObject)| {
            self.overlap_finding(survey, hidden, covered, flickers)
        };
        all.iter().map(finding).collect()
    }

    /// Returns the finding about a covered object. `flickers`: whether both objects are visible in
    /// turns.
    fn overlap_finding(
        &self,
        survey: &RaySurvey,
        hidden: usize,
        covered: &CoveredObject,
        flickers: bool,
    ) -> Fault {
        let named = self.object_name(covered.other);
        let others = match covered.others {
            1 => named,
            more => format!("{named} and {} more", more - 1),
        };
        let minimum = self.min_separation_at(covered.position);
        let lies = match covered.gap {
            0.0 => format!("it lies in one plane with {others}"),
            gap => format!(
                "it lies only {} from {others}, while the precision there separates surfaces that are {} or more apart",
                format_metres(gap),
                format_metres(round_up(minimum))
            ),
        };
        let [rays, own] = covered.rays;
        let elsewhere = survey.count(RayEvent::FirstHit(hidden)).saturating_sub(own);
        // Other objects cover it wherever it could be seen.
        let is_lost = 20 * own < rays && elsewhere == 0;
        let (severity, end) = match (flickers, is_lost, covered.shines, rays) {
            (true, ..) => (
                PictureWrong,
                format!(
                    ": rounding decides from ray to ray which object is seen ({own} of {rays} rays hit this one)"
                ),
            ),
            (_, true, ..) => (
                PictureWrong,
                format!(
                    "; {} of {rays} rays in the overlap hit the other surface, and no ray hits this object outside the overlap",
                    rays - own
                ),
            ),
            (_, _, true, _) => (
                PictureWrong,
                "; one of the two emits light, and the order of the objects in the file decides whether that light is seen there, and what it lights".to_owned(),
            ),
            (.., 0) => (Harmless, "; no ray of the cameras hits the overlap".to_owned()),
            _ => (
                Harmless,
                format!(
                    "; rounding does not decide which of the two is seen: {own} of {rays} rays in the overlap hit this object, and {elsewhere} rays hit it outside the overlap"
                ),
            ),
        };
        let mut pair = [hidden, covered.other].into_iter();
        let separation = match pair.all(|object| self.objects[object].is_body()) {
            true => TOUCHING_GLASS_REMEDY.to_owned(),
            false => self.separation_remedy(minimum, covered.gap),
        };
        let remedy = match severity {
            Harmless => format!("nothing; if this object should be seen there, {separation}"),
            _ => separation,
        };
        let kind = match flickers {
            true => FlickeringSurfaces,
            false => CoplanarSurfaces,
        };
        let finding = kind
            .fault(hidden, lies + &end, remedy)
            .with_severity(severity);
        let finding = match rays {
            0 => finding,
            _ => finding.with_rays(rays, survey.rays, "of the cameras hit the overlap"),
        };
        finding.with_place(covered.position)
    }
}
