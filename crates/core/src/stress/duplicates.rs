//! Objects and copies of generators that occur twice in one place. The transforms that place them
//! may be written differently.

use std::hash::{DefaultHasher, Hash, Hasher};

use glam::DMat3;

use super::*;
use crate::generate::{count_generated_objects, generator_offsets};

/// Step to which positions are rounded before they are compared, as a share of the object's size.
/// Not a round number, so that round coordinates are not on the border between two steps.
const STEP: f64 = 0.739_085e-8;
/// Number of objects at one position above which they slow rays down.
const MANY: u64 = 64;

/// The objects that coincide with other objects.
#[derive(Clone, Debug, Default)]
pub(super) struct DuplicateObjects {
    /// For each listed object, the index of the first object that coincides with it (possibly
    /// itself).
    first: Vec<usize>,
    /// Objects and generators that coincide: the first one in the scene and the other one, which may
    /// be the same generator.
    pairs: BTreeMap<[usize; 2], Coincidence>,
}

/// Coincidence of two objects or generators.
#[derive(Clone, Copy, Debug, Default)]
struct Coincidence {
    /// Number of copies of the second that coincide with the first.
    count: u64,
    /// Greatest number of objects in one place.
    most: u64,
    /// Offset of the first such copy from the first copy of its generator.
    offset: DVec3,
}

impl DuplicateObjects {
    /// Returns whether two listed objects coincide.
    pub fn are_duplicates(&self, [a, b]: [usize; 2]) -> bool {
        let first = |object: usize| self.first.get(object);
        first(a).is_some() && first(a) == first(b)
    }

    /// Returns whether another listed object coincides with this object.
    pub fn has_duplicate(&self, object: usize) -> bool {
        (0..self.first.len()).any(|other| other != object && self.are_duplicates([object, other]))
    }
}

impl SceneFacts<'_> {
    /// Finds the objects and copies of generators that coincide.
    pub fn find_duplicates(&self) -> DuplicateObjects {
        let mut found = DuplicateObjects::default();
        let mut meshes: HashMap<usize, u64> = HashMap::new();
        // The first object in each place, and the number of objects there.
        let mut places: HashMap<u64, (usize, u64)> = HashMap::new();
        for object in &self.objects {
            let content = object.mesh.map(|(mesh, data)| {
                *meshes.entry(mesh).or_insert_with(|| {
                    let mut hasher = DefaultHasher::new();
                    let corners = data.positions.iter();
                    corners
                        .for_each(|corner| corner.to_array().map(f64::to_bits).hash(&mut hasher));
                    data.indices.hash(&mut hasher);
                    hasher.finish()
                })
            });
            let generator = self.generator(object.index);
            let offsets = match generator {
                Some(kind) => generator_offsets(kind),
                None => Box::new([DVec3::ZERO].into_iter()),
            };
            let mut start = None;
            for offset in offsets {
                let offset = offset - *start.get_or_insert(offset);
                let key = place_key(object, offset, content);
                let place = places.entry(key).or_insert((object.index, 0));
                place.1 += 1;
                if generator.is_none() {
                    found.first.push(place.0);
                }
                if place.1 > 1 {
                    let pair = found.pairs.entry([place.0, object.index]);
                    let pair = pair.or_insert(Coincidence {
                        offset,
                        ..Coincidence::default()
                    });
                    pair.count += 1;
                    pair.most = pair.most.max(place.1);
                }
            }
        }
        found
    }

    /// Returns the findings about objects and copies of generators in the same place.
    pub fn check_duplicates(&self, survey: &RaySurvey) -> Vec<StressFinding> {
        let pairs = self.duplicates.pairs.iter();
        let finding = |(&pair, coincidence): (&[usize; 2], &Coincidence)| {
            self.duplicate_finding(survey, pair, coincidence)
        };
        pairs.map(finding).collect()
    }

    fn duplicate_finding(
        &self,
        survey: &RaySurvey,
        [before, index]: [usize; 2],
        coincidence: &Coincidence,
    ) -> StressFinding {
        let &Coincidence {
            count,
            most,
            offset,
        } = coincidence;
        let pair @ [first, own] = [before, index].map(|object| &self.objects[object]);
        let seen = [before, index].map(|object| survey.events.get(&RayEvent::Crossed(object)));
        let seen = seen.into_iter().flatten().next();
        let (severity, label) = if pair.iter().any(|object| object.is_blended()) {
            (PictureWrong, "and each dims the light that passes")
        } else if pair.iter().all(|object| object.emits_light()) {
            (
                PictureWrong,
                "and each emits light, so that together they give more light than one",
            )
        } else if first.object.material == own.object.material && most > MANY {
            (
                SlowOrNoisy,
                "of which only one is seen, but rays are tested against all",
            )
        } else if first.object.material == own.object.material {
            (
                Harmless,
                "with the same material, so that the fault is not visible",
            )
        } else if seen.is_none() {
            (
                Harmless,
                "with another material; no camera sees either of the two",
            )
        } else if first.object.shape == own.object.shape
            && first.object.transform == own.object.transform
        {
            (
                PictureWrong,
                "with another material; only the first of the two in the file is seen",
            )
        } else {
            (
                PictureWrong,
                "with another material; only one of the two is seen, and rounding may decide which",
            )
        };
        let generator = self.generator(index);
        let other = self.object_name(before);
        let (reason, remedy) = match generator {
            Some(_) if before == index => (
                format!("copies coincide, up to {most} in one place, {label}"),
                "set a `step` for the grid, or a larger box (`min`, `max`) or fewer copies for the scatter",
            ),
            Some(_) => (
                format!("a copy of it is in the same place as {other}, {label}"),
                "remove one of the two",
            ),
            None => (
                format!("it is in the same place as {other}, {label}"),
                "remove one of the two",
            ),
        };
        let finding = FindingCode::DuplicateObject.finding(severity, own.subject(), reason, remedy);
        let Some(kind) = generator else {
            return finding.with_place(seen.map(|at| at.position).or(own.centre()));
        };
        let predicate = match before == index {
            true => "coincide with another one",
            false => "coincide with another object",
        };
        finding
            .with_count(count, count_generated_objects(kind), "copies", predicate)
            .with_place(own.centre().map(|centre| centre + offset))
    }
}

/// Returns a hash of the shape and the rounded placement of an object, moved by an offset. `content`
/// is the hash of its mesh.
fn place_key(facts: &ObjectFacts<'_>, offset: DVec3, content: Option<u64>) -> u64 {
    let (object, mut map) = (facts.object, facts.object_to_world);
    map.translation += offset;
    let matrix = map.matrix3;
    let scale = matrix.determinant().abs().cbrt();
    let mut hasher = DefaultHasher::new();
    let mut hash_rounded = |values: DVec3, size: f64| {
        let step = |value: f64| {
            let steps = (value / (STEP * size.max(f64::MIN_POSITIVE))).round();
            // A value that has fewer digits than such a step is kept exactly.
            let is_coarse = steps.abs() >= 1e15;
            if is_coarse {
                (value + 0.0).to_bits() as i64
            } else {
                steps as i64
            }
        };
        values.to_array().map(step).hash(&mut hasher);
    };
    // On its way a moving object is where both ends are said alike.
    let way = object
        .transform_end
        .as_ref()
        .map(|end| (&object.transform, end));
    // A ball is the same however it is turned.
    if let Shape::Sphere { centre, radius } = object.shape
        && is_similarity_transform(matrix, scale)
        && way.is_none()
    {
        hash_rounded(map.transform_point3(centre.into()), radius * scale);
        hash_rounded(DVec3::splat(libm::log(radius * scale)), 1.0);
        format!("ball{:?}", object.side).hash(&mut hasher);
        return hasher.finish();
    }
    [matrix.x_axis, matrix.y_axis, matrix.z_axis]
        .into_iter()
        .for_each(|column| hash_rounded(column, scale));
    let size = facts.bounds.map_or(1.0, |bounds| bounds.extent().length());
    hash_rounded(map.translation, size);
    match content {
        Some(content) => content.hash(&mut hasher),
        None => format!("{:?}", object.shape).hash(&mut hasher),
    }
    format!("{:?}{way:?}", object.side).hash(&mut hasher);
    hasher.finish()
}

/// Returns whether a matrix only rotates, mirrors and scales uniformly by `scale`.
fn is_similarity_transform(matrix: DMat3, scale: f64) -> bool {
    let square = matrix.transpose() * matrix;
    let other = DMat3::from_diagonal(DVec3::splat(scale * scale));
    square.abs_diff_eq(other, 1e-9 * scale * scale)
}
