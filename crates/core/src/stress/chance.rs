//! Noise of lamps and suns that are only hit by chance: by paths that continue from mirrors or
//! glass and cannot sample the light directly.

use super::emission_peaks::UnevenLamp;
use super::facts::{SceneFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::light_survey::{Lamp, LightSurvey};
use super::numbers::{format_decimal, format_metres, format_rounded_up};
use super::small_render::SmallRender;
use crate::counters::Counters;
use crate::metrics::RELATIVE_FLOOR;
use crate::scene::Sky;

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

/// Estimates the noise of light that paths find by chance.
pub(super) struct LightByChanceNoise<'a> {
    pub scene_facts: &'a SceneFacts<'a>,
    pub survey: &'a LightSurvey,
    pub samples_per_pixel: u32,
}

impl LightByChanceNoise<'_> {
    /// Returns a finding if the light found by chance contributes to the picture and is noisy. The
    /// noise is that of the scene's own number of samples.
    pub fn check_picture(&self, picture: &SmallRender) -> Option<StressFinding> {
        let Counters { unaided, found, .. } = picture.counters;
        if unaided < ENOUGH {
            return None;
        }
        // One sample in so many meets the light, each as bright as the light at most.
        let radiance = self.survey.max_radiance();
        let chance = (found + UNSEEN) as f64 / picture.counters.samples.max(1) as f64;
        let mean = picture.mean_radiance();
        let noise = radiance * (chance / f64::from(self.samples_per_pixel.max(1))).sqrt();
        let error = self.error_of_picture(picture, relative_error(noise, mean));
        if chance * radiance < SHARE * mean || error < NOISY {
            return None;
        }
        let finding = self.light_by_chance_finding(error);
        Some(finding.with_count(unaided - found, unaided, "paths", "hit no light"))
    }

    /// Returns the error with the scene's number of samples. The picture's own estimate holds for
    /// all light of the scene and corrects `modelled`, unless too few paths hit a lamp.
    fn error_of_picture(&self, picture: &SmallRender, modelled: f64) -> f64 {
        let measured = picture.expected_error(self.samples_per_pixel);
        measured.map_or(modelled, |measured| measured.min(modelled))
    }

    /// Returns findings about lamps inside glass whose light is noticeable and noisy in the first
    /// picture. The light is that which the lamp would send without the glass: the paths that hit
    /// the lamp may be too few to tell.
    pub fn check_enclosed_lamps(&self, pictures: &[SmallRender]) -> Vec<StressFinding> {
        let Some(picture) = pictures.first() else {
            return Vec::new();
        };
        let mean = picture.mean_radiance();
        let samples = f64::from(self.samples_per_pixel.max(1));
        let noisy = |lamp: &Lamp| {
            let glass = lamp.glass?;
            let share = lamp.arriving / (lamp.arriving + mean);
            // Paths that hit the target of the lamp's size bring the lamp's radiance.
            let chance = (lamp.target_ratio * lamp.arriving / lamp.radiance).min(1.0);
            let noise = lamp.arriving / (chance * samples).sqrt();
            let error = self.error_of_picture(picture, relative_error(noise, lamp.arriving + mean));
            let is_noisy = error >= NOISY || picture.is_black();
            (share >= SHARE && is_noisy).then_some((lamp.object, glass, error))
        };
        let noisy: Vec<_> = self.survey.lamps.iter().filter_map(noisy).collect();
        // Lamps with the same fault have the same remedy.
        let worst = noisy.iter().map(|(.., error)| *error).fold(0.0, f64::max);
        let finding = |&(lamp, glass, _): &(usize, usize, f64)| {
            let more = more_samples_remedy(worst, self.samples_per_pixel);
            enclosed_light_finding(self.scene_facts, lamp, glass, &more)
        };
        noisy.iter().map(finding).collect()
    }

    /// Returns findings about lamps most of whose light comes from a small part of their surface, if
    /// it is noticeable and noisy in the first picture.
    pub fn check_uneven_lamps(&self, pictures: &[SmallRender]) -> Vec<StressFinding> {
        let mean = pictures.first().map_or(0.0, SmallRender::mean_radiance);
        let samples = f64::from(self.samples_per_pixel.max(1));
        let finding = |lamp: &UnevenLamp| {
            let share = lamp.arriving / (lamp.arriving + mean);
            let noise = lamp.arriving * (lamp.variance / samples).sqrt();
            let error = relative_error(noise, lamp.arriving + mean);
            let is_told = lamp.variance >= UNEVEN && share >= SHARE && error >= NOISY;
            let more = || more_samples_remedy(error, self.samples_per_pixel);
            is_told.then(|| uneven_lamp_finding(self.scene_facts, lamp, &more()))
        };
        self.survey
            .uneven_lamps
            .iter()
            .filter_map(finding)
            .collect()
    }

    /// Returns the finding for the scene's kind of light: a lamp inside glass, other lamps, a
    /// studio or a sky.
    fn light_by_chance_finding(&self, error: f64) -> StressFinding {
        let more = more_samples_remedy(error, self.samples_per_pixel);
        let scene_facts = self.scene_facts;
        let mut lamps = self.survey.lamps.iter();
        let enclosed = lamps.find_map(|lamp| Some((lamp.object, lamp.glass?)));
        let mut emissive = scene_facts.objects.iter();
        if let Some((lamp, glass)) = enclosed {
            enclosed_light_finding(scene_facts, lamp, glass, &more)
        } else if let Some(lamp) = emissive.find(|object_facts| object_facts.emits_light()) {
            let reason = "light of lamps and suns by way of mirrors or glass is noisy: paths hit these lights only by chance, and hardly any does";
            let place = lamp.bounds.and_then(|bounds| finite_point(bounds.centre()));
            let lamp = lamp.subject.display_name(scene_facts.scene);
            let has_body = scene_facts
                .objects
                .iter()
                .any(|object_facts| object_facts.surface_kind == SurfaceKind::Body);
            let thin = match has_body {
                true => ", make the glass thin (`thin_walled`),",
                false => ",",
            };
            let remedy = format!("make {lamp} larger{thin} or {more}");
            new_light_by_chance_finding(FindingSubject::Scene, reason, remedy).with_place(place)
        } else if matches!(scene_facts.scene.sky, Some(Sky::Studio(_))) {
            let reason = "light of the studio by way of mirrors or glass is noisy: paths hit its lights only by chance, and hardly any does";
            let remedy = format!("{more} or with another environment (--env)");
            new_light_by_chance_finding(FindingSubject::Sky, reason, remedy)
        } else {
            let reason = "the sky has a small bright sun, whose light by way of mirrors or glass is noisy: paths hit the sun only by chance, and hardly any does";
            let remedy = format!("{more}, or give the scene a sky with a larger sun or none");
            new_light_by_chance_finding(FindingSubject::Sky, reason, remedy)
        }
    }
}

fn new_light_by_chance_finding(
    subject: FindingSubject,
    reason: impl Into<String>,
    remedy: impl Into<String>,
) -> StressFinding {
    let (code, severity) = (FindingCode::LightByChance, Severity::SlowOrNoisy);
    StressFinding::new(code, severity, subject, reason, remedy)
}

/// Returns the finding about a lamp inside a glass body.
fn enclosed_light_finding(
    scene_facts: &SceneFacts<'_>,
    lamp: usize,
    glass: usize,
    more: &str,
) -> StressFinding {
    let [object_facts, glass] = [lamp, glass].map(|object| &scene_facts.objects[object]);
    let glass = glass.subject.display_name(scene_facts.scene);
    let across = object_facts
        .bounds
        .map_or(0.0, |bounds| bounds.extent().max_element());
    let reason = format!(
        "it is {} wide and shines through {glass}, the glass around it: paths hit the lamp only by chance, and hardly any does",
        format_metres(across)
    );
    let remedy =
        format!("set `thin_walled` for the material of {glass}, make the lamp larger, or {more}");
    let at = object_facts
        .bounds
        .and_then(|bounds| finite_point(bounds.centre()));
    new_light_by_chance_finding(object_facts.subject, reason, remedy).with_place(at)
}

/// Returns the finding about a lamp that shines from a small part of its surface.
fn uneven_lamp_finding(
    scene_facts: &SceneFacts<'_>,
    lamp: &UnevenLamp,
    more: &str,
) -> StressFinding {
    let object_facts = &scene_facts.objects[lamp.object];
    let area = format_decimal(100.0 * lamp.half_light_area);
    let reason = format!(
        "{area} % of its surface emit half of its light, and samples of the lamp are spread evenly over the surface: they hit the bright part only by chance"
    );
    let remedy = format!("make the bright part a lamp of its own with even `emission`, or {more}");
    let bounds = object_facts.bounds;
    let at = bounds.and_then(|bounds| finite_point(bounds.centre()));
    new_light_by_chance_finding(object_facts.subject, reason, remedy).with_place(at)
}

/// Returns the advice to take more samples, given the error with `samples` per pixel.
fn more_samples_remedy(error: f64, samples: u32) -> String {
    let enough = f64::from(samples.max(1)) * (error / AIM).max(1.0).powi(2);
    let enough = format_rounded_up(enough.max(1.0));
    format!("render with more --spp (about {enough} for an error of {AIM})")
}

/// Returns a noise as `render` measures errors: as a share of the radiance, but of a dark surface
/// not as more than ten times the radiance.
fn relative_error(noise: f64, mean_radiance: f64) -> f64 {
    noise / (mean_radiance * mean_radiance + RELATIVE_FLOOR).sqrt()
}
