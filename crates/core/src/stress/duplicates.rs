//! Objects that occur twice in one place. The transforms that place them may be written
//! differently.

use std::collections::HashMap;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};

use glam::{DAffine3, DVec3};

use super::facts::{ObjectFacts, SceneFacts, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::ray_survey::RaySurvey;
use crate::generate::generator_offsets;
use crate::scene::{MeshData, Object, Shape};

/// Step to which positions are rounded before they are compared, as a share of the object's size.
/// Not a round number, so that round coordinates are not on the border between two steps.
const STEP: f64 = 0.739_085e-8;

/// Shape and rounded placement of an object. Equal for objects that coincide.
type ObjectKey = (String, Vec<i64>);

/// Indices of objects, by shape and then by rounded placement.
type PlacedObjects = HashMap<String, HashMap<Vec<i64>, usize>>;

/// The listed objects that coincide with other listed objects.
pub(super) struct DuplicateObjects {
    /// For each listed object, the index of the first object that coincides with it (possibly
    /// itself).
    first: Vec<usize>,
    /// For each listed object, whether another one coincides with it.
    have_twins: Vec<bool>,
    places: PlacedObjects,
    /// Hash of each mesh that listed objects use, by the index of the mesh.
    meshes: HashMap<usize, u64>,
}

impl DuplicateObjects {
    pub fn from_scene(scene_facts: &SceneFacts<'_>) -> Self {
        let mut places = PlacedObjects::new();
        let mut meshes: HashMap<usize, u64> = HashMap::new();
        let listed = scene_facts
            .objects
            .iter()
            .take(scene_facts.scene.objects.len());
        let first_of = |(index, object_facts): (usize, &ObjectFacts<'_>)| {
            let content = scene_facts
                .mesh_of_object(object_facts.object)
                .map(|(mesh, data)| {
                    *meshes
                        .entry(mesh)
                        .or_insert_with(|| mesh_content_hash(data))
                });
            let (label, place) = object_key(object_facts, object_facts.object_to_world, content);
            let alike = places.entry(label).or_default();
            *alike.entry(place).or_insert(index)
        };
        let first: Vec<usize> = listed.enumerate().map(first_of).collect();
        let mut have_twins = vec![false; first.len()];
        for (index, &first) in first.iter().enumerate().filter(|(i, first)| i != *first) {
            (have_twins[index], have_twins[first]) = (true, true);
        }
        Self {
            first,
            have_twins,
            places,
            meshes,
        }
    }

    /// Returns a finding for each listed object that coincides with an earlier one.
    pub fn check_listed_objects(
        &self,
        scene_facts: &SceneFacts<'_>,
        survey: &RaySurvey,
    ) -> Vec<StressFinding> {
        let twins = self.first.iter().enumerate();
        twins
            .filter(|(index, first)| index != *first)
            .map(|(index, &first)| duplicate_finding(scene_facts, survey, [first, index]))
            .collect()
    }

    /// Finds copies of a generator that coincide with listed objects. Returns the number of these
    /// copies, the listed object of the first, and the offset of the first from the generator's
    /// first copy.
    pub fn find_copies_over_objects(
        &self,
        scene_facts: &SceneFacts<'_>,
        generator: usize,
    ) -> Option<(u64, usize, DVec3)> {
        let object_facts = &scene_facts.objects[scene_facts.scene.objects.len() + generator];
        let mesh = scene_facts.mesh_of_object(object_facts.object);
        let content = mesh.and_then(|(mesh, _)| self.meshes.get(&mesh).copied());
        let (label, _) = object_key(object_facts, object_facts.object_to_world, content);
        let alike = self.places.get(&label)?;
        let kind = &scene_facts.scene.generators[generator].kind;
        let start = generator_offsets(kind).next()?;
        let (mut count, mut first) = (0, None);
        for offset in generator_offsets(kind) {
            let mut map = object_facts.object_to_world;
            map.translation += offset - start;
            let (_, place) = object_key(object_facts, map, content);
            if let Some(&listed) = alike.get(&place) {
                count += 1;
                first = first.or(Some((listed, offset - start)));
            }
        }
        first.map(|(listed, offset)| (count, listed, offset))
    }

    /// Returns whether two listed objects coincide.
    pub fn are_duplicates(&self, [a, b]: [usize; 2]) -> bool {
        let first = |object: usize| self.first.get(object);
        first(a).is_some() && first(a) == first(b)
    }

    /// Returns whether another listed object coincides with this object.
    pub fn has_duplicate(&self, object: usize) -> bool {
        self.have_twins
            .get(object)
            .is_some_and(|&has_twin| has_twin)
    }
}

/// Returns a hash of a mesh's positions and triangles.
fn mesh_content_hash(data: &MeshData) -> u64 {
    let mut hasher = DefaultHasher::new();
    for corner in data.positions.iter() {
        corner.to_array().map(f64::to_bits).hash(&mut hasher);
    }
    data.indices.hash(&mut hasher);
    hasher.finish()
}

/// Returns the shape and the rounded placement of an object under a transform. `content` is the
/// hash of the object's mesh.
fn object_key(object_facts: &ObjectFacts<'_>, map: DAffine3, content: Option<u64>) -> ObjectKey {
    let Object {
        shape,
        transform_end,
        transform,
        side,
        ..
    } = object_facts.object;
    // On its way it is where both ends are said alike.
    let way = transform_end
        .as_ref()
        .map(|end| format!("{transform:?}{end:?}"));
    let matrix = map.matrix3;
    let scale = matrix.determinant().abs().cbrt();
    // A ball is the same however it is turned.
    if let Shape::Sphere { centre, radius } = *shape
        && is_similarity_transform(matrix, scale)
        && way.is_none()
    {
        let (centre, size) = (map.transform_point3(centre.into()), radius * scale);
        let mut place = quantise_coordinates(&centre.to_array(), size);
        place.extend(quantise_coordinates(&[libm::log(size)], 1.0));
        return (format!("ball{side:?}"), place);
    }
    let label = match content {
        Some(content) => format!("mesh{content:x}"),
        None => format!("{shape:?}"),
    };
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let mut place: Vec<i64> = columns
        .iter()
        .flat_map(|column| quantise_coordinates(&column.to_array(), scale.max(f64::MIN_POSITIVE)))
        .collect();
    let size = object_facts
        .bounds
        .map_or(1.0, |bounds| bounds.extent().length());
    let origin = map.translation.to_array();
    place.extend(quantise_coordinates(&origin, size.max(f64::MIN_POSITIVE)));
    (format!("{label}{side:?}{way:?}"), place)
}

/// Rounds coordinates to steps of `STEP` times `size`. A value that has fewer digits than such a
/// step is kept exactly.
fn quantise_coordinates(values: &[f64], size: f64) -> Vec<i64> {
    let step = |value: &f64| {
        let steps = (value / (STEP * size)).round();
        if steps.abs() < 1e15 {
            steps as i64
        } else {
            (value + 0.0).to_bits() as i64
        }
    };
    values.iter().map(step).collect()
}

/// Returns whether a matrix only rotates, mirrors and scales uniformly by `scale`.
fn is_similarity_transform(matrix: glam::DMat3, scale: f64) -> bool {
    let square = matrix.transpose() * matrix;
    let other = glam::DMat3::from_diagonal(glam::DVec3::splat(scale * scale));
    square.abs_diff_eq(other, 1e-9 * scale * scale)
}

/// Returns the finding that the second of two objects coincides with the first.
pub(super) fn duplicate_finding(
    scene_facts: &SceneFacts<'_>,
    survey: &RaySurvey,
    [before, index]: [usize; 2],
) -> StressFinding {
    let object_facts = &scene_facts.objects[index];
    let pair = [&scene_facts.objects[before], object_facts];
    let other = pair[0].subject.display_name(scene_facts.scene);
    let sightings =
        [before, index].map(|object| RaySurvey::sighting_count(&survey.sightings, &object));
    let is_seen = sightings.iter().sum::<u64>() > 0;
    let (severity, label) = if pair.iter().any(|object_facts| object_facts.is_blended()) {
        let label = "and both dim the light that passes";
        (Severity::PictureWrong, label)
    } else if pair.iter().all(|object_facts| object_facts.emits_light()) {
        let label = "and both emit light, so that they give twice the light of one";
        (Severity::PictureWrong, label)
    } else if pair[0].object.material == pair[1].object.material {
        (
            Severity::Harmless,
            "with the same material, so that the fault is not visible",
        )
    } else if is_seen {
        let [first, own] = pair.map(|object_facts| object_facts.object);
        let label = match first.shape == own.shape && first.transform == own.transform {
            true => "with another material; only the first of the two in the file is seen",
            false => {
                "with another material; only one of the two is seen, and rounding may decide which"
            }
        };
        (Severity::PictureWrong, label)
    } else {
        (
            Severity::Harmless,
            "with another material; no camera sees either of the two",
        )
    };
    let reason = format!("it is in the same place as {other}, {label}");
    let seen_at = [before, index]
        .iter()
        .find_map(|object| finite_point(survey.sightings.get(object)?.position));
    let at = seen_at.or_else(|| {
        object_facts
            .bounds
            .and_then(|bounds| finite_point(bounds.centre()))
    });
    StressFinding::new(
        FindingCode::DuplicateObject,
        severity,
        object_facts.subject,
        reason,
        "remove one of the two",
    )
    .with_place(at)
}
