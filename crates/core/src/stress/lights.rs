//! Findings about lights that light nothing, are seen by no camera, or repeat another light.

use super::faces::{FlatFace, shape_faces};
use super::light_survey::{Beam, LightFacts, LightSurvey};
use super::samples::SmallRender;
use super::*;
use crate::generate::generator_offsets;
use crate::scene::Light;

/// Limits below which a lamp lights nothing. With a distance d, they apply to these shares of d²: to
/// the lamp's area, and to its power (radiance times area, mean of three channels). The distance d is
/// that to the nearest camera, or the diagonal of the scene's bounds if shorter.
const NO_AREA: f64 = 1e-10;
const DARK: f64 = 1e-8;
/// Least number of rays through glass from which on a light counts as behind glass.
const FEWEST_THROUGH_GLASS: u64 = 8;
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
    pub fn subject_centre(&self, subject: FindingSubject) -> Option<DVec3> {
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
}
