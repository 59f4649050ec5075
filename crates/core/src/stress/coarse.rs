//! Objects whose coordinates are stored in steps that are large for their size. The cause is an
//! object far from the others; the finding names it.

use raywright_bvh::Real;

use super::cameras::{CameraView, is_box_in_view};
use super::facts::{ObjectFacts, SceneFacts, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::numbers::format_metres;
use super::ray_survey::RaySurvey;
use super::rounding::{RoundingEffect, measure_rounding_effects};
use crate::dispatch::{ReadyScene, prepare};
use crate::scene::Shape;
use crate::settings::{PrecisionChoice, Settings};
use crate::storage_origin::{StorageOrigin, coordinate_spacing_in_box, resolves_object_shape};

/// Least ratio of two objects' distances from the cameras for the farther one to be the cause of
/// coarse coordinates.
const FARTHER: f64 = 100.0;

/// Coarsely stored objects with the same cause and severity.
struct CoarseObjects {
    objects: Vec<usize>,
    /// The distant object that causes the coarse coordinates.
    far: usize,
    is_seen: bool,
    is_mesh: bool,
    spacing: f64,
    effect: Option<RoundingEffect>,
}

/// Returns the findings about coarsely stored objects, and the subjects of these objects.
pub(super) fn check_coarse_objects(
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
        PrecisionChoice::Robust => ", or render with --precision reference",
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
        let coarse_bounds = object_facts.bounds.is_some_and(|bounds| {
            !resolves_object_shape::<R>(&bounds, bounds.extent().max_element(), origin)
        });
        (coarse_bounds || index == scene_facts.facts_index(first))
            && !lost.contains(&(index as u32))
    };
    let coarse: Vec<_> = scene_facts
        .objects
        .iter()
        .enumerate()
        .filter(is_coarse)
        .map(|(index, object_facts)| {
            let is_seen = RaySurvey::sighting_count(&survey.sightings, &index) > 0
                || object_facts
                    .bounds
                    .is_none_or(|bounds| is_box_in_view(views, &bounds));
            (index, object_facts, is_seen)
        })
        .collect();
    let is_mesh =
        |object_facts: &ObjectFacts<'_>| matches!(object_facts.object.shape, Shape::Mesh(_));
    let measured: Vec<usize> = coarse
        .iter()
        .filter(|(_, object_facts, is_seen)| *is_seen && !is_mesh(object_facts) && R::IS_SINGLE)
        .map(|(index, ..)| *index)
        .collect();
    // Doubles are prepared only where a shape that is seen is stored coarsely.
    let exact = (!measured.is_empty())
        .then(|| prepare_in_double_precision(scene_facts, ready))
        .flatten();
    let effects = exact
        .map(|exact| measure_rounding_effects(scene_facts, [ready, &exact], views, &measured))
        .unwrap_or_default();
    let distances = CameraDistances::new(scene_facts, views);
    let own_group =
        |(index, object_facts, is_seen): (usize, &ObjectFacts<'_>, bool)| CoarseObjects {
            objects: vec![index],
            far: distances.find_much_farther_object(index).unwrap_or(index),
            is_seen,
            is_mesh: is_mesh(object_facts),
            spacing: object_facts.bounds.map_or(0.0, |bounds| {
                coordinate_spacing_in_box::<R>(&bounds, origin)
            }),
            effect: effects.get(&index).copied(),
        };
    group_by_cause(coarse.into_iter().map(own_group))
}

/// Groups coarsely stored objects by their distant object and severity. Each item of `all` holds a
/// single object.
fn group_by_cause(all: impl Iterator<Item = CoarseObjects>) -> Vec<CoarseObjects> {
    let mut groups: Vec<CoarseObjects> = Vec::new();
    for coarse in all {
        let is_alike = |group: &&mut CoarseObjects| {
            group.far == coarse.far && group.severity() == coarse.severity()
        };
        // An object that is far away itself has a group of its own.
        let alike = (coarse.objects[0] != coarse.far)
            .then(|| groups.iter_mut().find(is_alike))
            .flatten();
        match alike {
            Some(group) => group.merge(coarse),
            None => groups.push(coarse),
        }
    }
    groups
}

/// Prepares the scene again in double precision. Returns `None` on failure.
fn prepare_in_double_precision(
    scene_facts: &SceneFacts<'_>,
    ready: &ReadyScene,
) -> Option<ReadyScene> {
    let settings = Settings {
        precision: PrecisionChoice::Reference,
        ..ready.settings().clone()
    };
    prepare(scene_facts.scene, &settings, &()).ok()
}

/// Distance of each object from the nearest camera in metres; `None` for an unbounded object.
struct CameraDistances {
    distances: Vec<Option<f64>>,
    farthest: Option<usize>,
}

impl CameraDistances {
    fn new(scene_facts: &SceneFacts<'_>, views: &[CameraView]) -> Self {
        let distance = |object_facts: &ObjectFacts<'_>| {
            let centre = object_facts.bounds?.centre();
            let distances = views.iter().map(|view| view.distance_from_eye(centre));
            Some(distances.fold(f64::INFINITY, f64::min))
        };
        let distances: Vec<_> = scene_facts.objects.iter().map(distance).collect();
        let known = distances.iter().enumerate();
        let farthest = known
            .filter_map(|(index, distance)| Some(((*distance)?, index)))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, index)| index);
        Self {
            distances,
            farthest,
        }
    }

    /// Returns the object farthest from the cameras, if it is more than `FARTHER` times as far as
    /// object `index`.
    fn find_much_farther_object(&self, index: usize) -> Option<usize> {
        let own = self.distances[index]?;
        self.farthest
            .filter(|&other| self.distances[other].is_some_and(|far| far > FARTHER * own))
    }
}

impl CoarseObjects {
    /// Adds the objects of another group with the same cause.
    fn merge(&mut self, other: Self) {
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
        let is_wrong = self.is_seen && self.effect.is_none_or(|effect| effect.is_visible());
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
        let steps = format_metres(self.spacing);
        let (near, own) = (self.objects[0], self.objects == [self.far]);
        let what = match (own, self.objects.len()) {
            (true, _) => "it".to_owned(),
            (_, 1) => words(near),
            (_, more) => format!("{} and {} more", words(near), more - 1),
        };
        let start = match own {
            true => format!(
                "it is so far from the rest of the scene that its coordinates are rounded to steps of up to {steps}"
            ),
            false => format!(
                "it is so far from {what} that the coordinates of {what} are rounded to steps of up to {steps}"
            ),
        };
        let end = match (self.is_seen, self.effect) {
            (false, _) => format!("; no camera has {what} in view"),
            (true, Some(effect)) if effect.rays == 0 => {
                format!("; no ray of the cameras hits {what}")
            }
            (true, Some(effect)) => format!(
                "; {} of {} rays of the cameras to {what} hit another object or a differently turned surface than with --precision reference",
                effect.changed, effect.rays
            ),
            (true, None) if self.is_mesh => {
                format!(
                    ": points a thousandth of the object's size apart are merged in {what}, and the shape is shattered"
                )
            }
            (true, None) => {
                format!(": points a thousandth of the object's size apart are merged in {what}")
            }
        };
        let remedy = match self.severity() {
            Severity::Harmless => "nothing, unless the object is misplaced".to_owned(),
            _ => format!("move the object nearer to the rest of the scene{exact}"),
        };
        let at = object_facts
            .bounds
            .and_then(|bounds| finite_point(bounds.centre()));
        let (code, severity) = (FindingCode::UnresolvedObject, self.severity());
        StressFinding::new(code, severity, object_facts.subject, start + &end, remedy)
            .with_place(at)
    }
}
