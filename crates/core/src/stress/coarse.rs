//! Objects whose coordinates are stored in steps that are coarse for their size, since one is far
//! from the others, and which one that is.

use raywright_bvh::Real;

use super::cameras::{CameraView, is_box_in_view};
use super::facts::{ObjectFacts, SceneFacts, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding, metres};
use super::ray_survey::RaySurvey;
use super::rounding::{RoundingEffect, effect};
use crate::dispatch::{ReadyScene, prepare};
use crate::origin::{StorageOrigin, resolves, spacing};
use crate::scene::Shape;
use crate::settings::{PrecisionChoice, Settings};

/// How many times as far from the cameras as an object another one is for whose sake the object is
/// stored coarsely.
const FARTHER: f64 = 100.0;

/// Objects that are stored coarsely for one cause and with one effect.
struct CoarseObjects {
    objects: Vec<usize>,
    /// The one that is far from the rest.
    far: usize,
    is_seen: bool,
    is_mesh: bool,
    spacing: f64,
    effect: Option<RoundingEffect>,
}

/// What a prepared scene stores coarsely, with the subjects that are stored so.
pub(super) fn check(
    scene_facts: &SceneFacts<'_>,
    ready: &ReadyScene,
    survey: &RaySurvey,
    views: &[CameraView],
) -> (Vec<StressFinding>, Vec<FindingSubject>) {
    let groups = match ready.settings().precision {
        PrecisionChoice::Robust => measure_coarse_objects::<f32>(scene_facts, ready, survey, views),
        PrecisionChoice::Reference => {
            measure_coarse_objects::<f64>(scene_facts, ready, survey, views)
        }
    };
    let exact = match ready.settings().precision {
        PrecisionChoice::Reference => "",
        PrecisionChoice::Robust => ", or add --precision reference",
    };
    let subjects = groups
        .iter()
        .flat_map(|group| &group.objects)
        .map(|&object| scene_facts.objects[object].subject)
        .collect();
    let findings = groups
        .iter()
        .map(|group| group.finding(scene_facts, exact))
        .collect();
    (findings, subjects)
}

fn measure_coarse_objects<R: Real>(
    scene_facts: &SceneFacts<'_>,
    ready: &ReadyScene,
    survey: &RaySurvey,
    views: &[CameraView],
) -> Vec<CoarseObjects> {
    let Some(first) = ready.first_unresolved_object() else {
        return Vec::new();
    };
    let origin = StorageOrigin::from_scene::<R>(scene_facts.scene, &scene_facts.lookup).origin;
    let lost = ready.invisible_objects();
    let is_coarse = |&(index, object_facts): &(usize, &ObjectFacts<'_>)| {
        let coarse_bounds = object_facts
            .bounds
            .is_some_and(|bounds| !resolves::<R>(&bounds, bounds.extent().max_element(), origin));
        (coarse_bounds || index == scene_facts.facts_index(first))
            && !lost.contains(&(index as u32))
    };
    // Doubles are prepared once, and only where a shape that is seen is stored coarsely.
    let mut exact: Option<Option<ReadyScene>> = None;
    let mut groups: Vec<CoarseObjects> = Vec::new();
    for (index, object_facts) in scene_facts.objects.iter().enumerate().filter(is_coarse) {
        let is_seen = RaySurvey::sighting_count(&survey.sightings, &index) > 0
            || object_facts
                .bounds
                .is_none_or(|bounds| is_box_in_view(views, &bounds));
        let is_mesh = matches!(object_facts.object.shape, Shape::Mesh(_));
        let measured = (is_seen && !is_mesh && R::IS_SINGLE)
            .then(|| {
                let exact = exact.get_or_insert_with(|| in_doubles(scene_facts, ready));
                let exact = exact.as_ref()?;
                Some(effect(scene_facts, [ready, exact], views, index))
            })
            .flatten();
        let coarse = CoarseObjects {
            objects: vec![index],
            far: find_farther_object(scene_facts, views, index).unwrap_or(index),
            is_seen,
            is_mesh,
            spacing: object_facts
                .bounds
                .map_or(0.0, |bounds| spacing::<R>(&bounds, origin)),
            effect: measured,
        };
        let is_alike = |group: &&mut CoarseObjects| {
            group.far == coarse.far && group.severity() == coarse.severity() && coarse.far != index
        };
        match groups.iter_mut().find(is_alike) {
            Some(group) => group.add(coarse),
            None => groups.push(coarse),
        }
    }
    groups
}

/// The scene in doubles.
fn in_doubles(scene_facts: &SceneFacts<'_>, ready: &ReadyScene) -> Option<ReadyScene> {
    let settings = Settings {
        precision: PrecisionChoice::Reference,
        ..ready.settings().clone()
    };
    prepare(scene_facts.scene, &settings, &()).ok()
}

/// The object that is farthest from all cameras, where that is much farther than this one.
fn find_farther_object(
    scene_facts: &SceneFacts<'_>,
    views: &[CameraView],
    index: usize,
) -> Option<usize> {
    let distance = |object_facts: &ObjectFacts<'_>| {
        let centre = object_facts.bounds?.centre();
        let distances = views.iter().map(|view| view.distance_from_eye(centre));
        Some(distances.fold(f64::INFINITY, f64::min))
    };
    let own = distance(&scene_facts.objects[index])?;
    let all = scene_facts.objects.iter().enumerate();
    all.filter_map(|(other, object_facts)| Some((distance(object_facts)?, other)))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(farthest, _)| *farthest > FARTHER * own)
        .map(|(_, other)| other)
}

impl CoarseObjects {
    /// Adds others of the same cause.
    fn add(&mut self, other: Self) {
        self.objects.extend(other.objects);
        self.spacing = self.spacing.max(other.spacing);
        self.is_seen |= other.is_seen;
        self.is_mesh |= other.is_mesh;
        self.effect = match (self.effect, other.effect) {
            (Some(own), Some(others)) => Some(own.plus(others)),
            (own, others) => own.or(others),
        };
    }

    fn severity(&self) -> Severity {
        let is_wrong = self.is_seen && self.effect.is_none_or(|effect| effect.is_seen());
        match is_wrong {
            true => Severity::PictureWrong,
            false => Severity::Harmless,
        }
    }

    fn finding(&self, scene_facts: &SceneFacts<'_>, exact: &str) -> StressFinding {
        let words = |object: usize| {
            scene_facts.objects[object]
                .subject
                .display_name(scene_facts.scene)
        };
        let object_facts = &scene_facts.objects[self.far];
        let steps = metres(self.spacing);
        let (near, own) = (self.objects[0], self.objects == [self.far]);
        let what = match (own, self.objects.len()) {
            (true, _) => "it".to_owned(),
            (_, 1) => words(near),
            (_, more) => format!("{} and {} more", words(near), more - 1),
        };
        let start = match own {
            true => format!(
                "it is so far from the rest of the scene that its coordinates are stored in steps of up to {steps}"
            ),
            false => format!(
                "it is so far from {what} that coordinates there are stored in steps of up to {steps}"
            ),
        };
        let end = match (self.is_seen, self.effect) {
            (false, _) => format!("; no camera has {what} in view"),
            (true, Some(effect)) => format!(
                "; {} of {} rays of the cameras to {what} meet something else or another direction of the surface than with --precision reference",
                effect.changed, effect.rays
            ),
            (true, None) if self.is_mesh => {
                format!(
                    ": points a thousandth of the size of {what} apart are one, and the shape is shattered"
                )
            }
            (true, None) => format!(": points a thousandth of the size of {what} apart are one"),
        };
        let remedy = match self.severity() {
            Severity::Harmless => "nothing, unless it is out of its place".to_owned(),
            _ => format!("move it nearer to the rest of the scene{exact}"),
        };
        let at = object_facts
            .bounds
            .and_then(|bounds| finite_point(bounds.centre()));
        let (code, severity) = (FindingCode::UnresolvedObject, self.severity());
        StressFinding::new(code, severity, object_facts.subject, start + &end, remedy)
            .with_place(at)
    }
}
