//! Findings about coordinates that are rounded for storage: lost shapes and objects, and objects
//! whose coordinates are stored in steps that are large for their size.

use super::*;
use crate::prepare::lost_object;
use crate::storage_origin::{StorageOrigin, coordinate_spacing_in_box, resolves_object_shape};

/// Least ratio of two objects' distances from the cameras for the farther one to be the cause of
/// coarse coordinates.
const FARTHER: f64 = 100.0;
/// A difference is not visible up to this share of the object's rays, or up to this area in pixels.
const SHARE: f64 = 0.01;
const PIXELS: f64 = 1.0;

/// End of the message about a fault out of view.
pub(super) const OUT_OF_VIEW: &str = "; no camera has it in view";

/// Coarsely stored objects with the same cause.
#[derive(Default)]
struct CoarseObjects {
    objects: Vec<usize>,
    is_seen: bool,
    is_wrong: bool,
    /// Greatest distance of neighbouring coordinates, in metres.
    spacing: f64,
    /// Number of rays that hit the objects first, and of those that differ in double precision. `None`
    /// if that is not known.
    rays: Option<[u64; 2]>,
}

impl SceneFacts<'_> {
    /// Returns the findings about details that storage in the scalar type `R` loses. The picture is wrong
    /// if a camera has the object in view. `exact` holds the rays in double precision.
    pub fn check_storage<R: Real>(
        &self,
        ready: &ReadyScene,
        survey: &RaySurvey,
        exact: Option<&RaySurvey>,
    ) -> Vec<Fault> {
        let lost = ready.invisible_objects().iter();
        let lost: BTreeSet<usize> = lost.map(|&object| self.facts_index(object)).collect();
        let lost_finding = |&index: &usize| {
            let object = &self.objects[index];
            let is_seen = self.is_object_in_view(survey, object);
            let finding = lost_object(object.subject(), self.settings.precision);
            let finding = finding.if_seen_or(is_seen, OUT_OF_VIEW);
            finding.with_place(object.centre())
        };
        let mut findings: Vec<Fault> = lost.iter().map(lost_finding).collect();
        let groups = self.coarse_objects::<R>(ready, survey, exact, &lost);
        findings.extend(groups.iter().map(|(&far, group)| {
            let (reason, remedy) = self.coarse_texts(far, group);
            let finding = UnresolvedObject
                .fault(far, reason, remedy)
                .if_seen(group.is_wrong);
            finding.with_place(self.objects[far].centre())
        }));
        findings
    }

    /// Returns the coarsely stored objects, by the distant object that causes the coarse coordinates.
    fn coarse_objects<R: Real>(
        &self,
        ready: &ReadyScene,
        survey: &RaySurvey,
        exact: Option<&RaySurvey>,
        lost: &BTreeSet<usize>,
    ) -> BTreeMap<usize, CoarseObjects> {
        let mut groups: BTreeMap<usize, CoarseObjects> = BTreeMap::new();
        let Some(first) = ready.first_unresolved_object() else {
            return groups;
        };
        let origin = StorageOrigin::from_scene::<R>(self.scene, &self.lookup).origin;
        let is_coarse = |object: &&ObjectFacts<'_>| {
            let is_first = object.index == self.facts_index(first);
            let is_coarse = object.bounds.is_some_and(|bounds| {
                !resolves_object_shape::<R>(&bounds, bounds.extent().max_element(), origin)
            });
            (is_coarse || is_first) && !lost.contains(&object.index)
        };
        let distance = |object: &ObjectFacts<'_>| {
            let centre = object.centre()?;
            let distances = self.views.iter().map(|view| view.distance_from_eye(centre));
            Some((distances.fold(f64::INFINITY, f64::min), object.index))
        };
        let distances = self.objects.iter().filter_map(distance);
        let farthest = distances.max_by(|a, b| a.0.total_cmp(&b.0));
        for object in self.objects.iter().filter(is_coarse) {
            let own = distance(object);
            let far = farthest.filter(|far| own.is_some_and(|own| far.0 > FARTHER * own.0));
            let far = far.map_or(object.index, |(_, far)| far);
            let is_seen = self.is_object_in_view(survey, object);
            // Of a mesh, rounding shatters the shape.
            let rays = exact.filter(|_| object.mesh.is_none()).map(|exact| {
                let hits = RayEvent::FirstHit(object.index);
                let [own, others] = [survey, exact].map(|survey| survey.count(hits));
                [own.max(others), own.abs_diff(others)]
            });
            let group = groups.entry(far).or_default();
            group.objects.push(object.index);
            group.is_seen |= is_seen;
            group.is_wrong |= is_seen && rays.is_none();
            let spacing = object.bounds.map_or(0.0, |bounds| {
                coordinate_spacing_in_box::<R>(&bounds, origin)
            });
            group.spacing = group.spacing.max(spacing);
            group.rays = match (group.rays, rays) {
                (Some(own), Some(others)) => Some([own[0] + others[0], own[1] + others[1]]),
                (own, others) => own.or(others),
            };
        }
        // A few rays along the outlines differ by rounding alone.
        let pixels = self.views[0]
            .size
            .map(f64::from)
            .into_iter()
            .product::<f64>();
        for group in groups.values_mut() {
            let [rays, changed] = group.rays.unwrap_or_default().map(|rays| rays as f64);
            let is_changed =
                changed > SHARE * rays && changed * pixels > PIXELS * survey.rays as f64;
            group.is_wrong |= group.is_seen && is_changed;
        }
        groups
    }

    /// Returns the reason and the remedy for coarsely stored objects.
    fn coarse_texts(&self, far: usize, group: &CoarseObjects) -> (String, String) {
        let steps = format_metres(group.spacing);
        let others: Vec<usize> = group
            .objects
            .iter()
            .copied()
            .filter(|&o| o != far)
            .collect();
        let what = match others[..] {
            [] => "it".to_owned(),
            [first] => self.object_name(first),
            [first, ..] => format!("{} and {} more", self.object_name(first), others.len() - 1),
        };
        let end = match group.rays {
            _ if !group.is_seen => format!("; no camera has {what} in view"),
            Some([rays, changed]) => format!(
                "; {changed} of {rays} rays of the cameras to {what} hit something else than with --precision reference"
            ),
            None => {
                format!(": points a thousandth of the object's size apart are merged in {what}")
            }
        };
        let reason = match others.is_empty() {
            true => format!(
                "it is so far from the rest of the scene that its coordinates are rounded to steps of up to {steps}{end}"
            ),
            false => format!(
                "it is so far from {what} that the coordinates of {what} are rounded to steps of up to {steps}{end}"
            ),
        };
        let remedy = match group.is_wrong {
            false => "nothing, unless the object is misplaced".to_owned(),
            true => format!(
                "move the object nearer to the rest of the scene{}",
                self.settings.precision.or_reference()
            ),
        };
        (reason, remedy)
    }
}
