//! Findings about surfaces in one place, judged by the camera rays that hit them.

use super::bodies::TOUCHING_GLASS_REMEDY;
use super::*;

/// Greatest gap of surfaces that are seen in turns by rounding, in units of the least separation that
/// the precision always distinguishes.
const FLICKERING: f64 = 16.0;
/// Two surfaces lie in one plane if their separation in double precision, as a share of the
/// coordinates there, is at most this.
const ONE_PLANE: f64 = 1e-12;

/// An object that other objects cover in places.
#[derive(Default)]
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
    /// Returns the greatest separation of two objects where one lies in the place of the other, in
    /// metres: 0 in one plane. `None` if camera rays find no such place. `exact` holds the rays in
    /// double precision.
    pub fn gap_between(
        &self,
        (survey, exact): (&RaySurvey, Option<&RaySurvey>),
        [a, b]: [usize; 2],
    ) -> Option<f64> {
        let places = |survey: &RaySurvey| {
            let pairs =
                [[a, b], [b, a]].map(|pair| survey.events.get(&RayEvent::InPlace(pair)).copied());
            let places = pairs.into_iter().flatten();
            places.reduce(|a, b| if a.value > b.value { a } else { b })
        };
        let place = exact.and_then(places).or_else(|| places(survey))?;
        let reach = place.position.abs().max_element() + self.diagonal();
        Some(if place.value > ONE_PLANE * reach {
            place.value
        } else {
            0.0
        })
    }

    /// Returns the findings about surfaces in one place. `gap` returns their separation, and `is_told`
    /// whether a pair is reported elsewhere. The picture is wrong in three cases:
    /// - All rays that could see an object hit another object in its place.
    /// - Rounding decides from ray to ray which object is visible.
    /// - One of the two objects emits light.
    pub fn check_overlaps(
        &self,
        survey: &RaySurvey,
        gap: impl Fn([usize; 2]) -> Option<f64>,
        is_told: impl Fn([usize; 2]) -> bool,
    ) -> Vec<Fault> {
        let mut all: BTreeMap<(bool, usize), CoveredObject> = BTreeMap::new();
        let pairs = survey.of(|event| match event {
            RayEvent::InPlace(pair) => Some(pair),
            _ => None,
        });
        for ([a, b], at) in pairs {
            let second = survey.count(RayEvent::InPlace([b, a]));
            // Of a pair, the object that fewer rays hit is the covered one.
            if (second, a) > (at.count, b) || at.count + second < 3 || is_told([a.min(b), a.max(b)])
            {
                continue;
            }
            let flickers = at.count + second >= 10 && 20 * second >= at.count + second;
            // Rounding decides at slightly more than what is always told apart.
            let roundings = if flickers { FLICKERING } else { 1.0 };
            let gap = gap([a, b]).unwrap_or(0.0);
            if gap > roundings * self.min_separation_at(at.position) {
                continue;
            }
            let covered = all.entry((flickers, b)).or_default();
            if covered.others == 0 {
                (covered.other, covered.position, covered.gap) = (a, at.position, gap);
            }
            covered.others += 1;
            covered.shines |= [a, b].iter().any(|&of| self.objects[of].emits_light());
            covered.rays[0] += at.count + second;
            covered.rays[1] += second;
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
            0.0 => format!("it lies in one place with {others}"),
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
        let (severity, end) = match (flickers, is_lost, covered.shines) {
            (true, ..) => (
                PictureWrong,
                format!(
                    ": rounding decides from ray to ray which object is seen ({own} of {rays} rays hit this one)"
                ),
            ),
            (_, true, _) => (
                PictureWrong,
                format!(
                    "; {} of {rays} rays in the overlap hit the other surface, and no ray hits this object outside the overlap",
                    rays - own
                ),
            ),
            (.., true) => (
                PictureWrong,
                "; one of the two emits light, and the order of the objects in the file decides whether that light is seen there, and what it lights".to_owned(),
            ),
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
            .with_severity(severity)
            .with_rays(rays, survey.rays, "of the cameras hit the overlap");
        finding.with_place(covered.position)
    }
}
