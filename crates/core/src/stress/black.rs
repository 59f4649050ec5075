//! Black pictures. Each is reported together with its cause in a single finding.

use super::light_survey::LightSurvey;
use super::samples::SmallRender;
use super::*;

/// A light is covered if at most this percentage of its rays is unblocked.
const FREE: u64 = 10;

/// Findings that can explain a black picture, in the order in which they are tried.
const BLACK_CAUSES: [FindingCode; 3] = [
    FindingCode::UnreachedLight,
    FindingCode::LightMissesScene,
    FindingCode::LightByChance,
];

impl SceneFacts<'_> {
    /// Adds a finding for each black picture, together with its cause, and removes the findings about
    /// lights that explain it.
    pub fn add_black_picture_findings(
        &self,
        survey: &LightSurvey,
        pictures: &[SmallRender],
        findings: &mut Vec<StressFinding>,
    ) {
        let black: Vec<&SmallRender> = pictures
            .iter()
            .filter(|picture| picture.is_black())
            .collect();
        if black.is_empty() {
            return;
        }
        let blocker = self.find_blocker(survey);
        let cause = self.black_picture_cause(blocker, findings);
        if cause.is_some() {
            findings.retain(|finding| !BLACK_CAUSES.contains(&finding.code));
        }
        let has_expression = matches!(self.scene.sky, Some(Sky::Expression(_)));
        let (reason, remedy) = cause.unwrap_or_else(|| match blocker {
            Some((object, light)) => {
                let (cover, light) = (self.object_name(object), self.name(light));
                (
                    format!("{cover} blocks the light of {light}"),
                    format!("open or remove {cover}, or add a light on the camera's side of it"),
                )
            }
            None if has_expression => (
                "no sample found light in the sky, whose `expression` is black or bright only in a small place".to_owned(),
                "make the bright place of the sky larger, or replace it by an entry of `suns` in a `gradient` sky: samples are aimed at such suns".to_owned(),
            ),
            None => (
                "no light reaches them".to_owned(),
                "add a light or a sky, or move the objects that block the light".to_owned(),
            ),
        });
        let reason = format!("all visible surfaces are black: {reason}");
        findings.extend(black.into_iter().map(|picture| {
            let code = FindingCode::BlackPicture;
            code.finding(PictureWrong, picture.subject, &reason, &remedy)
        }));
    }

    /// Returns an opaque object that blocks most rays between a light and the visible surfaces.
    fn find_blocker(&self, survey: &LightSurvey) -> Option<(usize, FindingSubject)> {
        let sky = survey.sky.iter().filter(|_| !self.is_sky_dark());
        survey.lights_and_lamps().chain(sky).find_map(|light| {
            let free = light.unblocked + light.through_glass;
            let total = free + light.blocked.values().sum::<u64>();
            let (&object, _) = light.blocked.iter().max_by_key(|(_, count)| **count)?;
            (100 * free <= FREE * total).then_some((object, light.subject))
        })
    }

    /// Returns why pictures are black and the remedy, by the findings about lights. Returns `None` if
    /// no such finding explains it.
    fn black_picture_cause(
        &self,
        blocker: Option<(usize, FindingSubject)>,
        findings: &[StressFinding],
    ) -> Option<(String, String)> {
        let of_code = |code| findings.iter().filter(move |finding| finding.code == code);
        let mut causes = BLACK_CAUSES.into_iter();
        let code = causes.find(|&code| of_code(code).next().is_some())?;
        let first = of_code(code).next()?;
        let name = self.name(first.subject);
        let lights = match of_code(code).count() {
            1 => format!("{name} is"),
            more => format!("{name} and {} more are", more - 1),
        };
        let effect = match code {
            FindingCode::LightByChance => "hit by none of the few samples of this check",
            FindingCode::LightMissesScene => "without effect",
            _ => {
                let (why, what) = match blocker.map(|(cover, _)| self.object_name(cover)) {
                    Some(cover) => (format!("blocked by {cover}"), cover),
                    None => (
                        "blocked, or turned away from all visible surfaces".to_owned(),
                        "the object that blocks the light".to_owned(),
                    ),
                };
                let remedy = format!("open or remove {what}, or add a light or a sky");
                return Some((format!("{lights} {why}"), remedy));
            }
        };
        Some((
            format!("{lights} {effect}; {}", first.reason),
            first.remedy.clone(),
        ))
    }
}
