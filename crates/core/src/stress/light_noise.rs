//! Noise of lamps and suns that are only hit by chance: by paths that continue from mirrors or glass,
//! or by samples of lamps that shine from a small part of their surface.

use super::light_survey::{LightFacts, LightSurvey};
use super::samples::SmallRender;
use super::*;
use crate::metrics::RELATIVE_FLOOR;

/// Least number of paths that may hit a light by chance. With fewer, the noise is not estimated.
const ENOUGH: u64 = 1000;
/// Least reported error of a pixel, as `render` measures it (root relMSE).
const NOISY: f64 = 0.2;
/// Share of the picture's radiance below which light found by chance is ignored.
const SHARE: f64 = 0.01;
/// Least variance of a lamp's radiance over its surface, in units of the squared mean, of an uneven
/// lamp: as if its light came from a twentieth of its area.
const UNEVEN: f64 = 20.0;
/// Number added to the counted hits, for an upper bound. Without any hit, the expected number is
/// below 3 with 95 % confidence (the rule of three).
const UNSEEN: u64 = 3;
/// Error for which a remedy gives the number of samples.
const AIM: f64 = 0.1;
impl SceneFacts<'_> {
    /// Returns the findings about light that is hit by chance.
    pub fn light_by_chance_findings(
        &self,
        survey: &LightSurvey,
        pictures: &[SmallRender],
    ) -> Vec<StressFinding> {
        let Some(first) = pictures.first() else {
            return Vec::new();
        };
        let mut findings = self.enclosed_lamp_findings(survey, first);
        let lamps = survey.uneven_lamps.iter();
        findings.extend(lamps.filter_map(|lamp| self.uneven_lamp_finding(lamp, first)));
        if findings.is_empty() {
            let pictures = pictures.iter();
            findings.extend(pictures.filter_map(|picture| self.chance_finding(survey, picture)));
        }
        findings
    }

    /// Returns the number of samples per pixel of the scene.
    fn samples(&self) -> f64 {
        f64::from(self.settings.sampling.samples_per_pixel().max(1))
    }

    /// Returns the error of a picture with the scene's number of samples, by a model. The picture's
    /// own estimate holds for all light of the scene and corrects the model, unless too few paths hit
    /// a lamp. The noise counts as `render` measures errors: as a share of the radiance, but of a dark
    /// surface not as more than ten times the radiance.
    fn error(&self, picture: Option<&SmallRender>, noise: f64, mean: f64) -> f64 {
        let modelled = noise / (mean * mean + RELATIVE_FLOOR).sqrt();
        let measured = picture.and_then(|picture| picture.expected_error(self.samples()));
        measured.map_or(modelled, |measured| measured.min(modelled))
    }

    /// Returns findings about lamps inside glass whose light is noticeable and noisy in a picture. The
    /// light is that which the lamp would send without the glass: the paths that hit the lamp may be
    /// too few to tell.
    fn enclosed_lamp_findings(
        &self,
        survey: &LightSurvey,
        picture: &SmallRender,
    ) -> Vec<StressFinding> {
        let mean = picture.mean_radiance();
        let noisy = |lamp: &LightFacts| {
            let (own, glass) = (lamp.subject, lamp.enclosing_glass?);
            let share = lamp.arriving / (lamp.arriving + mean);
            // Paths that hit the target of the lamp's size bring the lamp's radiance.
            let ratio = self.target_area_ratio(own, glass);
            let chance = (ratio * lamp.arriving / lamp.radiance).min(1.0);
            let noise = lamp.arriving / (chance * self.samples()).sqrt();
            let error = self.error(Some(picture), noise, lamp.arriving + mean);
            let is_noisy = error >= NOISY || picture.is_black();
            (share >= SHARE && is_noisy).then_some((own, glass, error))
        };
        let noisy: Vec<_> = survey.lamps.iter().filter_map(noisy).collect();
        // Lamps with the same fault have the same remedy.
        let worst = noisy.iter().map(|(.., error)| *error).fold(0.0, f64::max);
        let finding = |&(lamp, glass, _): &_| self.enclosed_lamp_finding(lamp, glass, worst);
        noisy.iter().map(finding).collect()
    }

    /// Returns the area of a target that paths have to hit, in multiples of the lamp's own: rough
    /// glass scatters light samples of its surface to the lamp, so that hits near the lamp suffice.
    fn target_area_ratio(&self, lamp: FindingSubject, glass: usize) -> f64 {
        let glass = &self.objects[glass];
        let roughness = match glass.material.map(|(_, material)| &material.model) {
            Some(MaterialModel::Physical(m)) => m.roughness.constant().unwrap_or(0.0),
            _ => 0.0,
        };
        let FindingSubject::Object(lamp) = lamp else {
            return 1.0;
        };
        let width = |object: &ObjectFacts<'_>| {
            let bounds = object.bounds;
            bounds.map_or(0.0, |bounds| bounds.extent().min_element())
        };
        let (own, around) = (width(&self.objects[lamp]), width(glass));
        let reached = (own + roughness * roughness * around).min(around.max(own));
        let ratio = reached / own;
        if ratio.is_finite() {
            ratio * ratio
        } else {
            1.0
        }
    }

    /// Returns the finding about a lamp inside a glass body.
    fn enclosed_lamp_finding(
        &self,
        lamp: FindingSubject,
        glass: usize,
        error: f64,
    ) -> StressFinding {
        let glass = self.object_name(glass);
        let bounds = match lamp {
            FindingSubject::Object(index) => self.objects[index].bounds,
            _ => None,
        };
        let across = bounds.map_or(0.0, |bounds| bounds.extent().max_element());
        let finding = FindingCode::LightByChance.finding(
            SlowOrNoisy,
            lamp,
            format!(
                "it is {} wide and shines through {glass}, the glass around it: paths hit the lamp only by chance, and hardly any does",
                format_metres(across)
            ),
            format!(
                "set `thin_walled` for the material of {glass}, make the lamp larger, or {}",
                self.more_samples(error)
            ),
        );
        finding.with_place(bounds.map(|bounds| bounds.centre()))
    }

    /// Returns the finding about a lamp that shines from a small part of its surface, if its light is
    /// noticeable and noisy in a picture.
    fn uneven_lamp_finding(
        &self,
        lamp: &LightFacts,
        picture: &SmallRender,
    ) -> Option<StressFinding> {
        let mean = lamp.arriving + picture.mean_radiance();
        let noise = lamp.arriving * (lamp.variance / self.samples()).sqrt();
        let error = self.error(None, noise, mean);
        let is_told = lamp.variance >= UNEVEN && lamp.arriving >= SHARE * mean && error >= NOISY;
        let finding = FindingCode::LightByChance.finding(
            SlowOrNoisy,
            lamp.subject,
            format!(
                "{} % of its surface emit half of its light, and samples of the lamp are spread evenly over the surface: they hit the bright part only by chance",
                format_decimal(100.0 * lamp.half_light_area)
            ),
            format!(
                "make the bright part a lamp of its own with even `emission`, or {}",
                self.more_samples(error)
            ),
        );
        is_told.then(|| finding.with_place(self.subject_centre(lamp.subject)))
    }

    /// Returns a finding if the light that paths find by chance contributes to a picture and is noisy.
    fn chance_finding(&self, survey: &LightSurvey, picture: &SmallRender) -> Option<StressFinding> {
        let counters = picture.counters;
        let (unaided, found) = (counters.unaided, counters.found);
        // One sample in so many meets the light, each as bright as the light at most.
        let radiance = survey.max_radiance;
        let chance = (found + UNSEEN) as f64 / counters.samples.max(1) as f64;
        let mean = picture.mean_radiance();
        let noise = radiance * (chance / self.samples()).sqrt();
        let error = self.error(Some(picture), noise, mean);
        if unaided < ENOUGH || chance * radiance < SHARE * mean || error < NOISY {
            return None;
        }
        let more = self.more_samples(error);
        let mut lamps = survey.lamps.iter();
        let enclosed = lamps.find_map(|lamp| Some((lamp.subject, lamp.enclosing_glass?)));
        let lamp = self.objects.iter().find(|object| object.emits_light());
        let of_sky = |reason: &str, remedy| {
            FindingCode::LightByChance.finding(SlowOrNoisy, FindingSubject::Sky, reason, remedy)
        };
        let finding = match (enclosed, lamp, &self.scene.sky) {
            (Some((lamp, glass)), ..) => self.enclosed_lamp_finding(lamp, glass, error),
            (_, Some(lamp), _) => {
                let thin = match self.objects.iter().any(ObjectFacts::is_body) {
                    true => ", make the glass thin (`thin_walled`),",
                    false => ",",
                };
                FindingCode::LightByChance
                    .finding(
                        SlowOrNoisy,
                        FindingSubject::Scene,
                        "light of lamps and suns by way of mirrors or glass is noisy: paths hit these lights only by chance, and hardly any does",
                        format!("make {} larger{thin} or {more}", self.object_name(lamp.index)),
                    )
                    .with_place(lamp.centre())
            }
            (.., Some(Sky::Studio(_))) => of_sky(
                "light of the studio by way of mirrors or glass is noisy: paths hit its lights only by chance, and hardly any does",
                format!("{more} or with another environment (--env)"),
            ),
            _ => of_sky(
                "the sky has a small bright sun, whose light by way of mirrors or glass is noisy: paths hit the sun only by chance, and hardly any does",
                format!("{more}, or give the scene a sky with a larger sun or none"),
            ),
        };
        Some(finding.with_count(unaided - found, unaided, "paths", "hit no light"))
    }

    /// Returns the advice to take more samples, given the error with the scene's number of samples.
    fn more_samples(&self, error: f64) -> String {
        let enough = self.samples() * (error / AIM).max(1.0).powi(2);
        let enough = format_decimal(round_up(enough.max(1.0)));
        format!("render with more --spp (about {enough} for an error of {AIM})")
    }
}
