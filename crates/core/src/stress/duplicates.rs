//! Objects that are there again in the same place, however their files say where that is.

use std::collections::HashMap;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};

use glam::{DAffine3, DVec3};

use super::facts::{ObjectFacts, SceneFacts, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::ray_survey::RaySurvey;
use crate::generate::generator_offsets;
use crate::scene::{MeshData, Object, Shape};

/// Share of an object's size that parts two places. No round number of it is on the border between
/// two steps.
const STEP: f64 = 0.739_085e-8;

/// Where and what an object is, the same for all that are in one place.
type ObjectKey = (String, Vec<i64>);

/// Objects by what they are, and then by where.
type PlacedObjects = HashMap<String, HashMap<Vec<i64>, usize>>;

/// Which objects are in one place and of one shape.
pub(super) struct DuplicateObjects {
    /// The first of those in its place, for each listed object.
    first: Vec<usize>,
    /// Whether others are in its place.
    have_twins: Vec<bool>,
    places: PlacedObjects,
    /// Hashes of the meshes that listed objects show.
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
            let (label, place) = object_key(object_facts, object_facts.map, content);
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

    /// Objects that are there twice.
    pub fn check(&self, scene_facts: &SceneFacts<'_>, survey: &RaySurvey) -> Vec<StressFinding> {
        let twins = self.first.iter().enumerate();
        twins
            .filter(|(index, first)| index != *first)
            .map(|(index, &first)| duplicate_finding(scene_facts, survey, [first, index]))
            .collect()
    }

    /// Copies of a generator in the place of a listed object: how many, and the first with its
    /// offset from the generator's first copy.
    pub fn copies_over_objects(
        &self,
        scene_facts: &SceneFacts<'_>,
        generator: usize,
    ) -> Option<(u64, usize, DVec3)> {
        let object_facts = &scene_facts.objects[scene_facts.scene.objects.len() + generator];
        let mesh = scene_facts.mesh_of_object(object_facts.object);
        let content = mesh.and_then(|(mesh, _)| self.meshes.get(&mesh).copied());
        let (label, _) = object_key(object_facts, object_facts.map, content);
        let alike = self.places.get(&label)?;
        let kind = &scene_facts.scene.generators[generator].kind;
        let start = generator_offsets(kind).next()?;
        let (mut count, mut first) = (0, None);
        for offset in generator_offsets(kind) {
            let mut map = object_facts.map;
            map.translation += offset - start;
            let (_, place) = object_key(object_facts, map, content);
            if let Some(&listed) = alike.get(&place) {
                count += 1;
                first = first.or(Some((listed, offset - start)));
            }
        }
        first.map(|(listed, offset)| (count, listed, offset))
    }

    /// Whether both of two objects are in one place.
    pub fn are_duplicates(&self, [a, b]: [usize; 2]) -> bool {
        let first = |object: usize| self.first.get(object);
        first(a).is_some() && first(a) == first(b)
    }

    /// Whether there are others in the place of one.
    pub fn has_duplicate(&self, object: usize) -> bool {
        self.have_twins
            .get(object)
            .is_some_and(|&has_twin| has_twin)
    }
}

/// A number that meshes of the same corners and triangles have in common.
fn mesh_content_hash(data: &MeshData) -> u64 {
    let mut hasher = DefaultHasher::new();
    for corner in data.positions.iter() {
        corner.to_array().map(f64::to_bits).hash(&mut hasher);
    }
    data.indices.hash(&mut hasher);
    hasher.finish()
}

/// What an object is and where a map puts it.
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

/// Numbers in steps of a size. Where that is finer than their own digits, the digits count.
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

/// Whether a matrix only turns, mirrors and scales alike along all axes.
fn is_similarity_transform(matrix: glam::DMat3, scale: f64) -> bool {
    let square = matrix.transpose() * matrix;
    let other = glam::DMat3::from_diagonal(glam::DVec3::splat(scale * scale));
    square.abs_diff_eq(other, 1e-9 * scale * scale)
}

/// The finding that the second of two objects is in one place with the first.
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
        let label = "light that passes is dimmed twice";
        (Severity::PictureWrong, label)
    } else if pair.iter().all(|object_facts| object_facts.emits_light()) {
        let label = "both shine, so that it gives twice the light that its look suggests";
        (Severity::PictureWrong, label)
    } else if pair[0].object.material == pair[1].object.material {
        (
            Severity::Harmless,
            "of the same material, so that nothing of it is seen",
        )
    } else if is_seen {
        let label =
            "of another material, and only one of the two is seen; the scene does not say which";
        (Severity::PictureWrong, label)
    } else {
        (Severity::Harmless, "of another material; no camera sees it")
    };
    let reason = format!("it is in one place with {other}: {label}");
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
        "remove one of them",
    )
    .with_place(at)
}
