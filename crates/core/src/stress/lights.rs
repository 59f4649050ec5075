//! Findings about lights that light nothing, are seen by no camera, repeat another light, or are hit
//! by paths only by chance.

use super::coplanar::{FlatFace, shape_faces};
use super::light_survey::{Beam, LightFacts, LightSurvey};
use super::samples::SmallRender;
use super::*;
use crate::generate::generator_offsets;
use crate::metrics::RELATIVE_FLOOR;
use crate::scene::Light;

/// Limits below which a lamp lights nothing. With a distance d, they apply to these shares of d²: to
/// the lamp's area, and to its power (radiance times area, mean of three channels). The distance d is
/// that to the nearest camera, or the diagonal of the scene's bounds if shorter.
const NO_AREA: f64 = 1e-10;
const DARK: f64 = 1e-8;
/// Least number of rays through glass from which on a light counts as behind glass.
const FEWEST_THROUGH_GLASS: u64 = 8;
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
/// A light is covered if at most this percentage of its rays is unblocked.
const FREE: u64 = 10;

/// Findings that can explain a black picture, in the order in which they are tried.
const BLACK_CAUSES: [FindingCode; 3] = [
    FindingCode::UnreachedLight,
    FindingCode::LightMissesScene,
    FindingCode::LightByChance,
];

/// Returns whether glass is in the way of most rays to a light. Rays blocked by opaque objects do
/// not count.
fn is_behind_glass(light: &LightFacts) -> bool {
    light.through_glass >= FEWEST_THROUGH_GLASS && light.through_glass > light.unblocked
}

impl SceneFacts<'_> {
    /// Returns the findings about lights. Without a survey, only those that need no rays.
    pub fn check_lights(&self, survey: &LightSurvey) -> Vec<StressFinding> {
        let mut findings = Vec::new();
        let lights = &self.scene.lights;
        for (index, light) in lights.iter().enumerate() {
            let (subject, place) = (
                FindingSubject::Light(index),
                Beam::from(&light.kind).position,
            );
            let facts = survey.lights.get(index);
            if let Some((reason, remedy)) = self.missed_scene_texts(light, facts) {
                let code = FindingCode::LightMissesScene;
                findings.push(
                    code.finding(SlowOrNoisy, subject, reason, remedy)
                        .with_place(place),
                );
            }
            findings.extend(facts.and_then(|facts| self.behind_glass_finding(facts, place)));
            let twin = lights[..index]
                .iter()
                .position(|other| other.kind == light.kind);
            let twin = twin.map(|twin| self.duplicate_light_finding([twin, index]));
            findings.extend(twin.map(|finding| finding.with_place(place)));
        }
        let lamps = || self.objects.iter().filter(|object| object.emits_light());
        findings.extend(lamps().filter_map(|object| self.facing_away_finding(object)));
        findings.extend(self.lamp_below_pixel_finding(survey));
        let sizeless = survey.lamps.iter();
        findings.extend(sizeless.filter_map(|lamp| self.sizeless_lamp_finding(lamp)));
        findings
    }

    /// Returns the finding about a light without size that most visible surfaces face through glass.
    fn behind_glass_finding(
        &self,
        light: &LightFacts,
        place: Option<DVec3>,
    ) -> Option<StressFinding> {
        let glass = self.object_name(light.glass.filter(|_| is_behind_glass(light))?);
        let finding = FindingCode::LightBehindGlass.finding(
            PictureWrong,
            light.subject,
            format!("this light has no size, and {glass} in its way is glass: paths cannot hit a light without size through glass, so that it lights nothing behind the glass"),
            format!("set `thin_walled` for the material of {glass}, or replace the light by one with a size: an emissive object, or a sun in the sky"),
        );
        let all = light.through_glass + light.unblocked;
        let predicate = "that nothing opaque blocks pass through glass";
        Some(
            finding
                .with_rays(light.through_glass, all, predicate)
                .with_place(place),
        )
    }

    /// Returns the reason and the remedy if no light arrives at the scene, otherwise `None`.
    fn missed_scene_texts(
        &self,
        light: &Light,
        facts: Option<&LightFacts>,
    ) -> Option<(String, String)> {
        let Beam {
            position,
            range,
            cone,
            ..
        } = Beam::from(&light.kind);
        let position = position?;
        let missing = facts.filter(|facts| facts.rays > 0 && facts.hits == 0);
        // The surface that its rays hit; the box of everything is nearer, and has no surface there.
        let nearest = missing.and_then(|facts| facts.nearest);
        if let Some((range, nearest)) = range.zip(nearest).filter(|(range, near)| range <= near) {
            let [range, nearest] = [range, nearest].map(format_metres);
            return Some((
                format!(
                    "its `range` of {range} ends before any surface, so that it lights nothing: the nearest surface on its rays is {nearest} away"
                ),
                format!(
                    "move the light nearer, set its `range` well above {nearest}, or remove `range`"
                ),
            ));
        }
        let to_other = match cone {
            Some(_) => {
                "point its `direction` at the objects that it should light, or move the light"
            }
            None => "move the light to the objects that it should light",
        };
        if let Some(lamp) = missing.and_then(|facts| facts.lamp) {
            let lamp = self.object_name(lamp);
            let reason = format!("it lights nothing but {lamp}, which is a lamp itself");
            return Some((reason, to_other.to_owned()));
        }
        // A spot light outside the bounding sphere.
        let away = self.bounds.centre() - position;
        let radius = 0.5 * self.diagonal();
        let is_outside = !self.bounds.is_empty() && away.length() > radius;
        if let Some((direction, outer_angle)) = cone.filter(|_| is_outside) {
            let off = away.angle_between(direction).to_degrees();
            let half_width = (radius / away.length()).min(1.0).asin().to_degrees();
            if off > outer_angle + half_width || missing.is_some() {
                let reason = format!(
                    "its cone misses all objects: the middle of the scene is {off:.0} degrees off its `direction`, and its `outer_angle` is {outer_angle} degrees"
                );
                // No cone is wider than 90 degrees.
                let remedy = match off.ceil() {
                    angle if angle < 90.0 => format!(
                        "turn its `direction` to the scene, or widen its `outer_angle` to {angle:.0} degrees or more"
                    ),
                    _ => "turn its `direction` to the scene".to_owned(),
                };
                return Some((reason, remedy));
            }
        }
        let rays = missing?.rays;
        let reason = match cone {
            Some(_) => {
                format!(
                    "its cone misses all objects: none of {rays} rays in the cone hits a surface"
                )
            }
            None => format!("none of {rays} rays from it hits a surface"),
        };
        Some((reason, to_other.to_owned()))
    }

    fn duplicate_light_finding(&self, [twin, index]: [usize; 2]) -> StressFinding {
        let [a, b] = [twin, index].map(|index| self.scene.lights[index].colour);
        let (severity, end) = match a == b {
            true => (PictureWrong, "together they are twice as bright as one"),
            false => (
                Harmless,
                "the two differ in colour, and the light of both is added",
            ),
        };
        let other = self.name(FindingSubject::Light(twin));
        FindingCode::DuplicateLight.finding(
            severity,
            FindingSubject::Light(index),
            format!("it is in the same place as {other}: {end}"),
            "remove one of the two; if both are intended, keep one with the sum of their colours",
        )
    }

    /// Returns a finding if a flat, one-sided lamp has all objects behind it.
    fn facing_away_finding(&self, object: &ObjectFacts<'_>) -> Option<StressFinding> {
        let face = shape_faces(&object.object.shape).into_iter().next();
        let face: FlatFace = face
            .filter(|face| face.is_sheet && !face.is_endless)?
            .place(object)?;
        let (normal, point) = (object.visible_normal(face.normal)?, face.corners[0]);
        let Aabb { min, max } = self.bounds;
        let farthest = DVec3::select(normal.cmpgt(DVec3::ZERO), max, min);
        let finding = FindingCode::LightMissesScene.finding(
            SlowOrNoisy,
            object.subject(),
            "this lamp emits from one side only, and all objects are on its other side",
            "turn it over, or give it `side = \"both\"`",
        );
        let is_ahead = (farthest - point).dot(normal) > 1e-9 * self.diagonal();
        (!is_ahead).then(|| finding.with_place(point))
    }

    /// Returns a finding about lamps in view that are smaller than a pixel. Each copy of a generator
    /// counts.
    fn lamp_below_pixel_finding(&self, survey: &LightSurvey) -> Option<StressFinding> {
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
            for offset in &offsets {
                let centre = bounds.centre() + *offset - offsets[0];
                let mut views = self.views.iter();
                if views.any(|view| {
                    width < view.pixel_width_at(centre) && view.project_point(centre).is_some()
                }) {
                    small.push((object.subject(), centre));
                }
            }
            let lamp = survey.light(object.subject());
            let is_enclosed = lamp.is_some_and(|lamp| lamp.enclosing_glass.is_some());
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
        let finding = FindingCode::LampBelowPixel.finding(SlowOrNoisy, subject, reason, remedy);
        let finding = finding.with_count(count, total, "lamps", "are smaller than a pixel");
        Some(finding.with_place(centre))
    }

    /// Returns the finding about a lamp whose area is too small to light anything.
    fn sizeless_lamp_finding(&self, lamp: &LightFacts) -> Option<StressFinding> {
        let sizes = [self.diagonal(), lamp.eye_distance].into_iter();
        let distance = sizes
            .filter(|size| *size > 0.0)
            .fold(f64::INFINITY, f64::min);
        let square = distance * distance;
        if lamp.area > NO_AREA * square || lamp.power / 3.0 > DARK * square {
            return None;
        }
        let area = match lamp.area {
            0.0 => "no area".to_owned(),
            area => format!("an area of {} square metres", format_decimal(area)),
        };
        let finding = FindingCode::UnreachedLight.finding(
            SlowOrNoisy,
            lamp.subject,
            format!("this lamp has {area}, so that it gives almost no light, and rays to it are wasted"),
            "make the lamp larger, or remove it; for a light without size, add an entry to `lights`",
        );
        Some(finding.with_place(self.subject_centre(lamp.subject)))
    }

    /// Returns the position of a light, or the centre of an object.
    fn subject_centre(&self, subject: FindingSubject) -> Option<DVec3> {
        match subject {
            FindingSubject::Light(index) => Beam::from(&self.scene.lights[index].kind).position,
            FindingSubject::Object(index) => self.objects[index].centre(),
            _ => None,
        }
    }

    /// Returns findings about lights that reach no visible surface of any camera, by the shadow rays
    /// of the pictures or by the walks from the light. Of a generator's lamps some may well be hidden.
    pub fn unreached_light_findings(
        &self,
        survey: &LightSurvey,
        pictures: &[SmallRender],
    ) -> Vec<StressFinding> {
        let mut unreached: BTreeMap<FindingSubject, (u64, &'static str)> = BTreeMap::new();
        for light in survey.lights_and_lamps() {
            let walks = light.unseen_walks();
            let walks = walks.map(|count| (count, "from the light reached no visible surface"));
            unreached.extend(walks.map(|walks| (light.subject, walks)));
        }
        for (&subject, &rays) in pictures.iter().flat_map(|picture| &picture.unreached) {
            if pictures
                .iter()
                .all(|picture| picture.unreached.contains_key(&subject))
            {
                unreached.insert(subject, (rays, "towards it were blocked"));
            }
        }
        let is_told = |subject: FindingSubject| match subject {
            FindingSubject::Object(index) => {
                let mut own = survey.lamps.iter().filter(|lamp| lamp.subject == subject);
                self.generator(index).is_some()
                    || own.any(|lamp| {
                        let is_lit =
                            lamp.enclosing_glass.is_some() && lamp.unseen_walks().is_none();
                        is_lit || self.sizeless_lamp_finding(lamp).is_some()
                    })
            }
            _ => survey.light(subject).is_some_and(is_behind_glass),
        };
        let unreached = unreached
            .into_iter()
            .filter(|(subject, _)| !is_told(*subject));
        let finding = |(subject, (rays, predicate))| {
            let finding = FindingCode::UnreachedLight.finding(
                SlowOrNoisy,
                subject,
                "this light reaches no visible surface: it is blocked, or turned away from all visible surfaces",
                "open or remove the object that blocks the light, or remove the light, which only adds noise",
            );
            finding
                .with_rays(rays, rays, predicate)
                .with_place(self.subject_centre(subject))
        };
        unreached.map(finding).collect()
    }

    /// Returns the findings about lamps and suns that are only hit by chance: by paths that continue
    /// from mirrors or glass, or by samples of lamps that shine from a small part of their surface.
    pub fn light_by_chance_findings(
        &self,
        survey: &LightSurvey,
        pictures: &[SmallRender],
    ) -> Vec<StressFinding> {
        let Some(first) = pictures.first() else {
            return Vec::new();
        };
        let mut findings = self.enclosed_lamp_findings(survey, first);
        let lamps = survey.lamps.iter();
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
