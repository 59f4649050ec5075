//! Findings about coordinates that are rounded for storage: lost shapes, objects and triangles, and
//! objects whose coordinates are stored in steps that are large for their size.

use super::*;
use crate::dispatch::prepare;
use crate::extent::MeshUseCounts;
use crate::prepare::round_to_scalar;
use crate::storage_origin::{StorageOrigin, coordinate_spacing_in_box, resolves_object_shape};
use crate::validate::{Problem, do_edges_span_no_area};

/// Least ratio of two objects' distances from the cameras for the farther one to be the cause of
/// coarse coordinates.
const FARTHER: f64 = 100.0;
/// A mesh counts as flattened if its scale along an axis is less than this share of the greatest.
const FLAT: f64 = 1e-4;
/// Number of rays along the width and along the height of the picture.
const GRID: u32 = 512;
/// Cosine of two degrees: normals with a smaller angle between them look alike.
const ALIKE: f64 = 0.9994;
/// A difference is not visible up to this share of the object's rays, or up to this area in pixels.
const SHARE: f64 = 0.01;
const PIXELS: f64 = 1.0;

/// Difference between the rays to objects in two precisions, over all cameras.
#[derive(Clone, Copy, Debug, Default)]
struct RoundingEffect {
    /// `rays`: number of rays that hit the objects in either precision. `changed`: number of these
    /// rays for which the hit object or its normal differs.
    rays: u64,
    changed: u64,
    /// Greatest differing area in the picture of a camera, in pixels.
    area: f64,
}

impl RoundingEffect {
    fn plus(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            changed: self.changed + other.changed,
            area: self.area.max(other.area),
        }
    }
}

/// Coarsely stored objects with the same cause and severity.
struct CoarseObjects {
    objects: Vec<usize>,
    is_seen: bool,
    is_mesh: bool,
    /// Greatest distance of neighbouring coordinates, in metres.
    spacing: f64,
    effect: Option<RoundingEffect>,
}

impl SceneFacts<'_> {
    /// Returns findings about shapes that degenerate when they are stored. `problems` are the errors
    /// for which the scene cannot be prepared.
    pub fn lost_shape_findings(&self, problems: &[Problem]) -> Vec<StressFinding> {
        let finding = |problem: &Problem| {
            let mut subjects = self.objects.iter().map(ObjectFacts::subject);
            let own = |subject: &FindingSubject| {
                problem.path.starts_with(&subject.scene_path(self.scene))
            };
            let hint = problem.hint.as_deref();
            FindingCode::LostShape.finding(
                PictureWrong,
                subjects.find(own).unwrap_or(FindingSubject::Scene),
                &problem.message,
                hint.unwrap_or("make the shape larger"),
            )
        };
        problems.iter().map(finding).collect()
    }

    /// Returns the findings about details that storage loses. The picture is wrong if a camera has
    /// the object in view.
    pub fn check_storage(&self, ready: &ReadyScene, survey: &RaySurvey) -> Vec<StressFinding> {
        match self.settings.precision {
            PrecisionChoice::Robust => self.check_storage_as::<f32>(ready, survey),
            PrecisionChoice::Reference => self.check_storage_as::<f64>(ready, survey),
        }
    }

    fn check_storage_as<R: Real>(
        &self,
        ready: &ReadyScene,
        survey: &RaySurvey,
    ) -> Vec<StressFinding> {
        let lost = ready.invisible_objects().iter();
        let lost: BTreeSet<usize> = lost.map(|&object| self.facts_index(object)).collect();
        let lost_finding = |&index: &usize| {
            let object = &self.objects[index];
            let is_seen = self.is_object_in_view(survey, object);
            let end = if is_seen {
                ""
            } else {
                "; no camera has it in view"
            };
            let finding = FindingCode::LostObject.finding(
                Severity::if_seen(is_seen),
                object.subject(),
                format!("it is so far from the rest of the scene that rounding merges all corners of its triangles, so that nothing is left of it{end}"),
                format!("move the object nearer to the rest of the scene{}", self.or_reference()),
            );
            finding.with_place(object.centre())
        };
        let mut findings: Vec<StressFinding> = lost.iter().map(lost_finding).collect();
        let groups = self.coarse_objects::<R>(ready, survey, &lost);
        let coarse: BTreeSet<usize> = groups.values().flat_map(|g| g.objects.clone()).collect();
        let groups = groups.iter();
        findings.extend(groups.map(|(&(far, severity, _), group)| {
            let (reason, remedy) = self.coarse_texts(far, severity, group);
            let (object, code) = (&self.objects[far], FindingCode::UnresolvedObject);
            let finding = code.finding(severity, object.subject(), reason, remedy);
            finding.with_place(object.centre())
        }));
        // What is stored coarsely loses triangles by that.
        let others = self.objects.iter();
        let others = others.filter(|o| !lost.contains(&o.index) && !coarse.contains(&o.index));
        let origin = StorageOrigin::from_scene::<R>(self.scene, &self.lookup).origin;
        let uses = MeshUseCounts::from_scene(self.scene);
        findings.extend(others.filter_map(|object| {
            // What instances share is stored in its own space.
            let is_shared = matches!(&object.object.shape, Shape::Mesh(name) if uses.is_shared(name, object.object.side));
            let finding = || self.lost_triangle_finding::<R>(object, survey, origin);
            (!is_shared).then(finding).flatten()
        }));
        findings
    }

    /// Returns the finding about triangles that lose their area when they are stored relative to an
    /// origin.
    fn lost_triangle_finding<R: Real>(
        &self,
        object: &ObjectFacts<'_>,
        survey: &RaySurvey,
        origin: DVec3,
    ) -> Option<StressFinding> {
        let ((_, data), map) = (object.mesh?, object.object_to_world);
        let scales =
            [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(DVec3::length);
        // Storage keeps all digits if the distance from the origin is at most the greatest coordinate.
        let greatest = data.positions.iter().map(|p| p.abs().max_element());
        let away = (map.translation - origin).abs().max_element();
        let keeps_digits = || {
            let is_near = away <= greatest.fold(0.0, f64::max) * scales[0];
            !R::IS_SINGLE || data.positions.origin() == DVec3::ZERO && is_near
        };
        if keeps_digits() {
            return None;
        }
        let is_flat = |[a, b, c]: [DVec3; 3]| {
            a == b || b == c || c == a || do_edges_span_no_area(b - a, c - a)
        };
        let stored = |p: DVec3| {
            let relative = (map.transform_point3(p) - origin).to_array();
            DVec3::from(relative.map(round_to_scalar::<R>))
        };
        let is_lost = |&index: &u32| {
            let corners = data.indices[index as usize];
            let corners = corners.map(|corner| data.positions.position(corner as usize));
            is_flat(corners.map(stored)) && !is_flat(corners)
        };
        let tally: CountAndFirst = (0..data.indices.len() as u32).filter(is_lost).collect();
        let &first = tally.some.first()?;
        let least = scales.into_iter().fold(f64::INFINITY, f64::min);
        let (cause, remedy) = match least < FLAT * scales.into_iter().fold(0.0, f64::max) {
            true => (
                format!("a scale of {} flattens the mesh", format_decimal(least)),
                "set a greater scale along that axis, replace the mesh by a flat one, or render with --precision reference",
            ),
            false => (
                "these triangles are so small and so far from the middle of the scene".to_owned(),
                "move the mesh nearer to the rest of the scene, or render with --precision reference",
            ),
        };
        let total = data.indices.len() as u64;
        let is_seen =
            tally.count * 100 >= total && survey.count(RayEvent::Crossed(object.index)) > 0;
        let corner = data
            .positions
            .position(data.indices[first as usize][0] as usize);
        let reason =
            format!("rounding merges corners of its triangles, or puts them on a line, as {cause}");
        let finding = FindingCode::LostTriangles
            .finding(Severity::if_seen(is_seen), object.subject(), reason, remedy)
            .with_count(tally.count, total, "triangles", "lost their area");
        Some(
            finding
                .with_primitive(first)
                .with_place(map.transform_point3(corner)),
        )
    }

    /// Returns the coarsely stored objects, by the distant object that causes the coarse coordinates,
    /// by severity, and by whether they are that object.
    fn coarse_objects<R: Real>(
        &self,
        ready: &ReadyScene,
        survey: &RaySurvey,
        lost: &BTreeSet<usize>,
    ) -> BTreeMap<(usize, Severity, bool), CoarseObjects> {
        let mut groups = BTreeMap::new();
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
        let coarse: Vec<_> = self.objects.iter().filter(is_coarse).collect();
        let measured: Vec<usize> = coarse
            .iter()
            .filter(|o| R::IS_SINGLE && o.mesh.is_none() && self.is_object_in_view(survey, o))
            .map(|o| o.index)
            .collect();
        let effects = self.measure_rounding_effects(ready, &measured);
        let distance = |object: &ObjectFacts<'_>| {
            let centre = object.centre()?;
            let distances = self.views.iter().map(|view| view.distance_from_eye(centre));
            Some((distances.fold(f64::INFINITY, f64::min), object.index))
        };
        let distances = self.objects.iter().filter_map(distance);
        let farthest = distances.max_by(|a, b| a.0.total_cmp(&b.0));
        for object in coarse {
            let own = distance(object);
            let far = farthest.filter(|far| own.is_some_and(|own| far.0 > FARTHER * own.0));
            let far = far.map_or(object.index, |(_, far)| far);
            let effect = effects.get(&object.index).copied();
            let is_seen = self.is_object_in_view(survey, object);
            let is_wrong = effect.is_none_or(|effect| {
                effect.changed as f64 > SHARE * effect.rays as f64 && effect.area > PIXELS
            });
            let key = (
                far,
                Severity::if_seen(is_seen && is_wrong),
                object.index == far,
            );
            let group = groups.entry(key).or_insert(CoarseObjects {
                objects: Vec::new(),
                is_seen,
                is_mesh: false,
                spacing: 0.0,
                effect: None,
            });
            group.objects.push(object.index);
            group.is_seen |= is_seen;
            group.is_mesh |= object.mesh.is_some();
            let spacing = object.bounds.map_or(0.0, |bounds| {
                coordinate_spacing_in_box::<R>(&bounds, origin)
            });
            group.spacing = group.spacing.max(spacing);
            group.effect = match (group.effect, effect) {
                (Some(own), Some(others)) => Some(own.plus(others)),
                (own, others) => own.or(others),
            };
        }
        groups
    }

    /// Returns the reason and the remedy for coarsely stored objects.
    fn coarse_texts(
        &self,
        far: usize,
        severity: Severity,
        group: &CoarseObjects,
    ) -> (String, String) {
        let steps = format_metres(group.spacing);
        let is_own = group.objects == [far];
        let what = match group.objects.len() {
            _ if is_own => "it".to_owned(),
            1 => self.object_name(group.objects[0]),
            more => format!(
                "{} and {} more",
                self.object_name(group.objects[0]),
                more - 1
            ),
        };
        let start = match is_own {
            true => format!(
                "it is so far from the rest of the scene that its coordinates are rounded to steps of up to {steps}"
            ),
            false => format!(
                "it is so far from {what} that the coordinates of {what} are rounded to steps of up to {steps}"
            ),
        };
        let end = match group.effect {
            _ if !group.is_seen => format!("; no camera has {what} in view"),
            Some(effect) if effect.rays == 0 => format!("; no ray of the cameras hits {what}"),
            Some(RoundingEffect { rays, changed, .. }) => format!(
                "; {changed} of {rays} rays of the cameras to {what} hit another object or a differently turned surface than with --precision reference"
            ),
            None => {
                let shape = if group.is_mesh {
                    ", and the shape is shattered"
                } else {
                    ""
                };
                format!(
                    ": points a thousandth of the object's size apart are merged in {what}{shape}"
                )
            }
        };
        let remedy = match severity {
            Harmless => "nothing, unless the object is misplaced".to_owned(),
            _ => format!(
                "move the object nearer to the rest of the scene{}",
                self.or_reference()
            ),
        };
        (start + &end, remedy)
    }

    /// Compares the cameras' rays to objects in two precisions: that of the settings and double. All
    /// objects share the rays of the whole picture, so that the time does not grow with their number.
    /// Doubles are prepared only if there are objects.
    fn measure_rounding_effects(
        &self,
        ready: &ReadyScene,
        objects: &[usize],
    ) -> BTreeMap<usize, RoundingEffect> {
        let none = |&object: &usize| (object, RoundingEffect::default());
        let mut effects: BTreeMap<_, _> = objects.iter().map(none).collect();
        let settings = Settings {
            precision: PrecisionChoice::Reference,
            ..ready.settings().clone()
        };
        let exact = (!objects.is_empty()).then(|| prepare(self.scene, &settings, &()).ok());
        let Some(exact) = exact.flatten() else {
            return BTreeMap::new();
        };
        for view in &self.views {
            let [_, [width, height]] = view.rectangle();
            let area = width * height / f64::from(GRID * GRID);
            let rays = || view.grid_rays(view.rectangle(), [GRID; 2]);
            let [robust, exact] = [ready, &exact].map(|ready| self.trace(ready, rays()));
            let mut areas: BTreeMap<usize, f64> = BTreeMap::new();
            for (a, b) in robust.iter().zip(&exact) {
                let pair = [a, b].map(|hits| hits.first());
                let is_same = matches!(pair, [Some(a), Some(b)] if a.object == b.object && a.normal.dot(b.normal) >= ALIKE);
                let hit: BTreeSet<usize> = pair.into_iter().flatten().map(|h| h.object).collect();
                for object in hit {
                    let Some(effect) = effects.get_mut(&object) else {
                        continue;
                    };
                    effect.rays += 1;
                    effect.changed += u64::from(!is_same);
                    *areas.entry(object).or_default() += if is_same { 0.0 } else { area };
                }
            }
            for (object, area) in areas {
                if let Some(effect) = effects.get_mut(&object) {
                    effect.area = effect.area.max(area);
                }
            }
        }
        effects
    }
}
