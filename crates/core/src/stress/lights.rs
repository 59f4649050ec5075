//! Findings about lights that light nothing, are found only by chance, or repeat another light, and
//! about black pictures.

use super::light_survey::{LightFacts, LightSurvey};
use super::samples::SmallRender;
use super::*;
use crate::generate::generator_offsets;
use crate::metrics::RELATIVE_FLOOR;
use crate::prepare::unreached_light;
use crate::scene::{Colour, LightKind, PixelData};

/// Limits below which a lamp lights nothing. With a distance d, they apply to these shares of d²: to
/// the lamp's area, and to its power (radiance times area, mean of three channels). The distance d is
/// that to the nearest camera, or the diagonal of the scene's bounds if shorter.
const NO_AREA: f64 = 1e-10;
const DARK: f64 = 1e-8;
/// Least number of paths that may hit a light by chance. With fewer, the noise is not estimated.
const ENOUGH: u64 = 1000;
/// Least reported error of a pixel, as `render` measures it (root relMSE).
const NOISY: f64 = 0.2;
/// Share of the picture's radiance below which light found by chance is ignored.
const SHARE: f64 = 0.01;
/// Number added to the counted hits, for an upper bound. Without any hit, the expected number is
/// below 3 with 95 % confidence (the rule of three).
const UNSEEN: u64 = 3;
/// Error for which a remedy gives the number of samples.
const AIM: f64 = 0.1;
/// A light is covered if at most this percentage of its rays is unblocked.
const FREE: u64 = 10;
/// Findings that can explain a black picture, in the order in which they are tried.
const BLACK_CAUSES: [FaultKind; 3] = [UnreachedLight, LightMissesScene, LightByChance];

impl SceneFacts<'_> {
    /// Returns the findings about lights. Without a survey, only those that need no rays.
    pub fn check_lights(&self, survey: &LightSurvey) -> Vec<Fault> {
        let mut findings = Vec::new();
        for (&subject, light) in &survey.lights {
            let found = self
                .misses_scene_finding(subject, light)
                .or_else(|| self.behind_glass_finding(subject, light))
                .or_else(|| self.sizeless_lamp_finding(subject, light))
                .or_else(|| {
                    let is_told = light.is_unreached();
                    is_told.then(|| unreached_light(subject, light.shadow_rays[0]))
                });
            findings.extend(found.map(|found| found.with_place(self.subject_centre(subject))));
        }
        let lights = &self.scene.lights;
        for (index, light) in lights.iter().enumerate() {
            let mut others = lights[..index].iter();
            let twin = others.position(|other| other.kind == light.kind);
            findings.extend(twin.map(|twin| self.duplicate_light_finding([twin, index])));
        }
        findings.extend(self.lamp_below_pixel_finding(survey));
        findings
    }

    /// Returns the finding about a light without size that most visible surfaces face through glass.
    fn behind_glass_finding(&self, subject: Subject, light: &LightFacts) -> Option<Fault> {
        let is_told = light.is_behind_glass() && matches!(subject, Subject::Light(_));
        let glass = self.object_name(light.glass.filter(|_| is_told)?);
        let finding = LightBehindGlass.fault(subject,
            format!("this light has no size, and {glass} in its way is glass: paths cannot hit a light without size through glass, so that it lights nothing behind the glass"),
            format!("set `thin_walled` for the material of {glass}, or replace the light by one with a size: an emissive object, or a sun in the sky"),
        );
        let all = light.through_glass + light.unblocked;
        let predicate = "that nothing opaque blocks pass through glass";
        Some(finding.with_rays(light.through_glass, all, predicate))
    }

    /// Returns the finding about a light that shines past all visible surfaces.
    fn misses_scene_finding(&self, subject: Subject, light: &LightFacts) -> Option<Fault> {
        let is_aimed_at_nothing = light.is_aimed_at_nothing();
        let (reason, remedy) = match subject {
            Subject::Light(index) => self.missed_scene_texts(index, light)?,
            Subject::Object(index)
                if is_aimed_at_nothing && self.objects[index].hides_back_faces() =>
            (
                "this lamp emits from one side only, and all visible surfaces are on its other side".to_owned(),
                "turn it over, or give it `side = \"both\"`".to_owned(),
            ),
            _ => return None,
        };
        Some(LightMissesScene.fault(subject, reason, remedy))
    }

    /// Returns why a delta light shines past all visible surfaces, or its cone past all bounded
    /// objects, and the remedy. `None` if it does not.
    fn missed_scene_texts(&self, index: usize, light: &LightFacts) -> Option<(String, String)> {
        let (position, range, cone) = match self.scene.lights[index].kind {
            LightKind::Directional { .. } => return None,
            LightKind::Point {
                position, range, ..
            } => (position, range, None),
            LightKind::Spot {
                position,
                range,
                direction,
                outer_angle,
                ..
            } => (position, range, Some((direction, outer_angle))),
        };
        let away = self.bounds.centre() - DVec3::from(position);
        let radius = 0.5 * self.diagonal();
        let off = cone.map_or(0.0, |(direction, _)| {
            away.angle_between(direction.into()).to_degrees()
        });
        let is_outside = !self.bounds.is_empty() && away.length() > radius;
        let is_off = cone.is_some_and(|(_, outer_angle)| {
            is_outside && off > outer_angle + (radius / away.length()).asin().to_degrees()
        });
        if !is_off && !light.is_aimed_at_nothing() {
            return None;
        }
        if let Some((range, nearest)) = range
            .zip(light.nearest)
            .filter(|(range, near)| range <= near)
        {
            let [range, nearest] = [range, nearest].map(format_metres);
            return Some((
                format!(
                    "its `range` of {range} ends before any visible surface, so that it lights nothing: the nearest one is {nearest} away"
                ),
                format!(
                    "move the light nearer, set its `range` well above {nearest}, or remove `range`"
                ),
            ));
        }
        let Some((_, outer_angle)) = cone else {
            return Some((
                "no visible surface faces it, so that it lights nothing".to_owned(),
                "move the light to the objects that it should light".to_owned(),
            ));
        };
        let mut remedy =
            "point its `direction` at the objects that it should light, or move the light"
                .to_owned();
        if let Some(lamp) = light
            .aim
            .filter(|&object| self.objects[object].emits_light())
        {
            let lamp = self.object_name(lamp);
            return Some((
                format!("it lights nothing but {lamp}, which is a lamp itself"),
                remedy,
            ));
        }
        // No cone is wider than 90 degrees.
        if is_outside && off.ceil() < 90.0 {
            remedy = format!(
                "turn its `direction` to the scene, or widen its `outer_angle` to {:.0} degrees or more",
                off.ceil()
            );
        }
        Some((
            format!(
                "its cone misses all objects: none of the visible surfaces is in it; the middle of the scene is {off:.0} degrees off its `direction`, and its `outer_angle` is {outer_angle} degrees"
            ),
            remedy,
        ))
    }

    fn duplicate_light_finding(&self, [twin, index]: [usize; 2]) -> Fault {
        let [a, b] = [twin, index].map(|index| self.scene.lights[index].colour);
        let (severity, end) = match a == b {
            true => (PictureWrong, "together they are twice as bright as one"),
            false => (
                Harmless,
                "the two differ in colour, and the light of both is added",
            ),
        };
        let (subject, other) = (Subject::Light(index), self.name(Subject::Light(twin)));
        let finding = DuplicateLight.fault(
            subject,
            format!("it is in the same place as {other}: {end}"),
            "remove one of the two; if both are intended, keep one with the sum of their colours",
        );
        finding
            .with_severity(severity)
            .with_place(self.subject_centre(subject))
    }

    /// Returns a finding about lamps in view that are smaller than a pixel. Each copy of a generator
    /// counts.
    fn lamp_below_pixel_finding(&self, survey: &LightSurvey) -> Option<Fault> {
        let (mut total, mut small, mut is_in_glass) = (0, Vec::new(), false);
        let lamps = self.objects.iter();
        for object in lamps.filter(|object| object.emits_light() && object.mesh.is_none()) {
            let Some(bounds) = object.bounds else {
                continue;
            };
            let offsets: Vec<DVec3> = match self.generator(object.index) {
                None => vec![DVec3::ZERO],
                Some(kind) => generator_offsets(kind).collect(),
            };
            total += offsets.len() as u64;
            let (width, before) = (bounds.extent().length(), small.len());
            let centres = offsets
                .iter()
                .map(|offset| bounds.centre() + *offset - object.offset);
            small.extend(
                centres
                    .filter(|&centre| {
                        let mut views = self.views.iter();
                        views.any(|view| {
                            width < view.pixel_width_at(centre)
                                && view.project_point(centre).is_some()
                        })
                    })
                    .map(|centre| (object.subject(), centre)),
            );
            let lamp = survey.lights.get(&object.subject());
            let is_enclosed = lamp.is_some_and(LightFacts::is_behind_glass);
            is_in_glass |= small.len() > before && is_enclosed;
        }
        let count = small.len() as u64;
        let (subject, centre) = self.nearest_to_camera(small)?;
        // No path hits an entry in `lights` through glass.
        let remedy = match is_in_glass {
            true => "make the lamps larger, or move them out of view",
            false => {
                "make the lamps larger, move them out of view, or replace them by entries in `lights`"
            }
        };
        let reason = "lamps in view are smaller than a pixel: the few samples that hit one show as bright specks";
        let finding = LampBelowPixel.fault(subject, reason, remedy);
        let finding = finding.with_count(count, total, "lamps", "are smaller than a pixel");
        Some(finding.with_place(centre))
    }

    /// Returns the finding about a lamp whose area is too small to light anything.
    fn sizeless_lamp_finding(&self, subject: Subject, lamp: &LightFacts) -> Option<Fault> {
        let Subject::Object(object) = subject else {
            return None;
        };
        let centre = self.objects[object].centre();
        let sizes = [
            Some(self.diagonal()),
            centre.map(|centre| self.view_distance_key(centre).1),
        ];
        let sizes = sizes.into_iter().flatten().filter(|size| *size > 0.0);
        let distance = sizes.fold(f64::INFINITY, f64::min);
        let square = distance * distance;
        let area = match lamp.area {
            0.0 => "no area".to_owned(),
            area => format!("an area of {} square metres", format_decimal(area)),
        };
        let finding = UnreachedLight.fault(subject,
            format!("this lamp has {area}, so that it gives almost no light, and rays to it are wasted"),
            "make the lamp larger, or remove it; for a light without size, add an entry to `lights`",
        );
        let is_told = lamp.area <= NO_AREA * square && lamp.power / 3.0 <= DARK * square;
        is_told.then_some(finding)
    }

    /// Returns a finding if the light that paths find by chance contributes to a picture and is noisy:
    /// light behind glass, or by way of mirrors.
    pub fn light_by_chance_finding(
        &self,
        survey: &LightSurvey,
        picture: &SmallRender,
    ) -> Option<Fault> {
        let mut lights = survey.lights.iter();
        let enclosed = lights.find_map(|(subject, light)| match subject {
            Subject::Object(lamp) if light.is_behind_glass() => Some((*lamp, light.glass?)),
            _ => None,
        });
        let counters = picture.counters;
        let (unaided, found) = (counters.unaided, counters.found);
        // One sample in so many meets the light, each as bright as the light at most.
        let radiance = survey.max_radiance;
        let chance = (found + UNSEEN) as f64 / counters.samples.max(1) as f64;
        let mean = picture.mean_radiance();
        let samples = f64::from(self.settings.sampling.samples_per_pixel().max(1));
        let noise = radiance * (chance / samples).sqrt();
        // The picture's own estimate corrects the model, unless too few paths hit a lamp. Of a dark
        // surface, noise counts as not more than ten times the radiance, as `render` measures errors.
        let modelled = noise / (mean * mean + RELATIVE_FLOOR).sqrt();
        // Of a black picture, no error is known.
        let measured = picture
            .expected_error(samples)
            .filter(|_| !picture.is_black());
        let error = measured.map_or(modelled, |measured| measured.min(modelled));
        let is_rare = unaided < ENOUGH && enclosed.is_none();
        if is_rare || chance * radiance < SHARE * mean || error < NOISY {
            return None;
        }
        let enough = format_decimal(round_up((samples * (error / AIM).powi(2)).max(1.0)));
        let more = format!("render with more --spp (about {enough} for an error of {AIM})");
        let lamp = self.objects.iter().find(|object| object.emits_light());
        let (subject, reason, remedy) = match (enclosed, lamp, &self.scene.sky) {
            (Some((lamp, glass)), ..) => {
                let glass = self.object_name(glass);
                (Subject::Object(lamp), format!("it shines through {glass}, the glass around it: paths hit the lamp only by chance, and hardly any does"), format!("set `thin_walled` for the material of {glass}, make the lamp larger, or {more}"))
            }
            (_, Some(lamp), _) => {
                let thin = match self.objects.iter().any(ObjectFacts::is_body) {
                    true => ", make the glass thin (`thin_walled`),",
                    false => ",",
                };
                (Subject::Scene, "light of lamps and suns by way of mirrors or glass is noisy: paths hit these lights only by chance, and hardly any does".to_owned(), format!("make {} larger{thin} or {more}", self.object_name(lamp.index)))
            }
            (.., Some(Sky::Studio(_))) => (Subject::Sky, "light of the studio by way of mirrors or glass is noisy: paths hit its lights only by chance, and hardly any does".to_owned(), format!("{more} or with another environment (--env)")),
            _ => (Subject::Sky, "the sky has a small bright sun, whose light by way of mirrors or glass is noisy: paths hit the sun only by chance, and hardly any does".to_owned(), format!("{more}, or give the scene a sky with a larger sun or none")),
        };
        let finding = LightByChance.fault(subject, reason, remedy);
        let place = enclosed
            .map(|(lamp, _)| lamp)
            .or(lamp.map(|lamp| lamp.index));
        let place = place.and_then(|lamp| self.objects[lamp].centre());
        Some(
            finding
                .with_count(unaided - found, unaided, "paths", "hit no light")
                .with_place(place),
        )
    }

    /// Adds a finding for each black picture, together with its cause, and removes the findings about
    /// lights that explain it.
    pub fn add_black_picture_findings(
        &self,
        survey: &LightSurvey,
        pictures: &[SmallRender],
        findings: &mut Vec<Fault>,
    ) {
        let black = pictures.iter().filter(|picture| picture.is_black());
        let black: Vec<Subject> = black.map(|picture| picture.subject).collect();
        if black.is_empty() {
            return;
        }
        let blocker = self.find_blocker(survey);
        let mut causes = BLACK_CAUSES.into_iter();
        let cause = causes.find(|code| findings.iter().any(|finding| finding.kind == *code));
        let (reason, remedy) = match cause {
            Some(code) => self.black_picture_cause(blocker, code, findings),
            None => self.dark_scene_texts(blocker),
        };
        if cause.is_some() {
            findings.retain(|finding| !BLACK_CAUSES.contains(&finding.kind));
        }
        let reason = format!("all visible surfaces are black: {reason}");
        let finding = |subject| BlackPicture.fault(subject, &reason, &remedy);
        findings.extend(black.into_iter().map(finding));
    }

    /// Returns an opaque object that blocks most rays between a light and the visible surfaces.
    fn find_blocker(&self, survey: &LightSurvey) -> Option<(usize, Subject)> {
        let is_dark = matches!(self.scene.sky, None | Some(Sky::Constant(Colour::BLACK)));
        let mut lights = survey.lights.iter();
        lights.find_map(|(&subject, light)| {
            let free = light.unblocked + light.through_glass;
            let total = free + light.blocked.values().sum::<u64>();
            let (&object, _) = light.blocked.iter().max_by_key(|(_, count)| **count)?;
            let is_covered = 100 * free <= FREE * total;
            let is_light = subject != Subject::Sky || !is_dark;
            (is_covered && is_light).then_some((object, subject))
        })
    }

    /// Returns why pictures without a finding about lights are black, and the remedy.
    fn dark_scene_texts(&self, blocker: Option<(usize, Subject)>) -> (String, String) {
        if let Some((cover, light)) = blocker {
            let (cover, light) = (self.object_name(cover), self.name(light));
            return (
                format!("{cover} blocks the light of {light}"),
                format!("open or remove {cover}, or add a light on the camera's side of it"),
            );
        }
        let [reason, remedy] = match self.scene.sky {
            Some(Sky::Expression(_)) => [
                "no sample found light in the sky, whose `expression` is black or bright only in a small place",
                "make the bright place of the sky larger, or replace it by an entry of `suns` in a `gradient` sky: samples are aimed at such suns",
            ],
            _ => [
                "no light reaches them",
                "add a light or a sky, or move the objects that block the light",
            ],
        };
        (reason.to_owned(), remedy.to_owned())
    }

    /// Returns why pictures are black and the remedy, by the findings of a kind about lights.
    fn black_picture_cause(
        &self,
        blocker: Option<(usize, Subject)>,
        code: FaultKind,
        findings: &[Fault],
    ) -> (String, String) {
        let causes: Vec<_> = findings
            .iter()
            .filter(|finding| finding.kind == code)
            .collect();
        let first = causes[0];
        let lights = match causes.len() {
            1 => format!("{} is", self.name(first.subject)),
            more => format!("{} and {} more are", self.name(first.subject), more - 1),
        };
        let effect = match code {
            LightByChance => "hit by none of the few samples of this check",
            LightMissesScene => "without effect",
            _ => {
                let cover = blocker.map(|(cover, _)| self.object_name(cover));
                let why = match &cover {
                    Some(cover) => format!("blocked by {cover}"),
                    None => "blocked, or turned away from all visible surfaces".to_owned(),
                };
                let cover = cover.unwrap_or_else(|| "the object that blocks the light".to_owned());
                let remedy = format!("open or remove {cover}, or add a light or a sky");
                return (format!("{lights} {why}"), remedy);
            }
        };
        (
            format!("{lights} {effect}; {}", first.message),
            first.remedy.clone(),
        )
    }
}

// Texels of a sky map that are far brighter than most of the sky. Their light by way of mirrors and
// glass is noisy.

/// A texel is bright if it is so many times as bright as the median. Greatest share of the sky that
/// bright texels may cover, for a finding.
const SPIKE: f64 = 1e4;
const FEW: f64 = 1e-4;

impl SceneFacts<'_> {
    /// Returns a finding about texels of a sky map that are far brighter than most of the sky.
    pub fn sky_spike_finding(&self) -> Option<Fault> {
        let Some(Sky::Map(map)) = &self.scene.sky else {
            return None;
        };
        let data = self.lookup.image(&map.image)?.data.as_deref()?;
        let PixelData::Linear(pixels) = &data.pixels else {
            return None;
        };
        // The brightness of each texel, and its share of the sky.
        let texel = |(index, pixel): (usize, &[f32; 4])| {
            let row_centre = (index / data.width as usize) as f64 + 0.5;
            let weight = (PI * row_centre / f64::from(data.height)).sin();
            (f64::from(pixel[0].max(pixel[1]).max(pixel[2])), weight)
        };
        let texels = pixels.iter().enumerate().map(texel);
        let mut texels: Vec<(f64, f64)> = texels.filter(|(bright, _)| bright.is_finite()).collect();
        texels.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (median, _) = *texels.get(texels.len() / 2)?;
        let from = texels.partition_point(|(bright, _)| *bright <= SPIKE * median.max(1e-6));
        let weight = |texels: &[(f64, f64)]| texels.iter().map(|(_, weight)| weight).sum::<f64>();
        let share = weight(&texels[from..]) / weight(&texels);
        let count = (texels.len() - from) as u64;
        let finding = SkySpikes.fault(Subject::Sky,
            format!("a few points of the sky are over {SPIKE:.0} times as bright as most of it: their light by way of mirrors and glass is noisy"),
            "remove the sun from the sky image and add a directional light in its place, or render with more --spp",
        );
        let total = pixels.len() as u64;
        (count > 0 && share < FEW)
            .then(|| finding.with_count(count, total, "texels", "are that bright"))
    }
}
