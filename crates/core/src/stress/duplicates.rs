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
    /// Offset of the first such copy from the copy that stands for its generator.
    offset: DVec3,
}

impl DuplicateObjects {
    /// Returns whether two objects, or some of their copies, coincide.
    pub fn are_duplicates(&self, [a, b]: [usize; 2]) -> bool {
        let first = |object: usize| self.first.get(object);
        first(a).is_some() && first(a) == first(b) || self.pairs.contains_key(&[a.min(b), a.max(b)])
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
        // By the placement: the first object of each shape in a place, and the number of objects there.
        let mut places: HashMap<u64, Vec<(usize, u64)>> = HashMap::new();
        for object in &self.objects {
            let generator = self.generator(object.index);
            let offsets = generator.map_or_else(
                || vec![DVec3::ZERO],
                |kind| generator_offsets(kind).collect(),
            );
            for offset in offsets.iter().map(|offset| *offset - object.offset) {
                let place = places.entry(place_key(object, offset)).or_default();
                let is_alike = |(first, _): &(usize, u64)| are_alike(&self.objects[*first], object);
                let index = place.iter().position(is_alike).unwrap_or(place.len());
                if index == place.len() {
                    place.push((object.index, 0));
                }
                let (first, number) = &mut place[index];
                *number += 1;
                if generator.is_none() {
                    found.first.push(*first);
                }
                if *number > 1 {
                    let pair = found.pairs.entry([*first, object.index]);
                    let pair = pair.or_insert(Coincidence {
                        offset,
                        ..Coincidence::default()
                    });
                    pair.count += 1;
                    pair.most = pair.most.max(*number);
                }
            }
        }
        found
    }

    /// Returns the findings about objects and copies of generators in the same place.
    pub fn check_duplicates(&self, survey: &RaySurvey) -> Vec<Fault> {
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
    ) -> Fault {
        let pair @ [first, own] = [before, index].map(|object| &self.objects[object]);
        let seen = [before, index].map(|object| survey.events.get(&RayEvent::Crossed(object)));
        let seen = seen.into_iter().flatten().next();
        let is_one_material = first.object.material == own.object.material;
        let is_exact = (&first.object.shape, &first.object.transform)
            == (&own.object.shape, &own.object.transform);
        let (severity, label) = if pair.iter().any(|object| object.is_blended()) {
            (PictureWrong, "and each dims the light that passes")
        } else if pair.iter().all(|object| object.emits_light()) {
            (
                PictureWrong,
                "and each emits light, so that together they give more light than one",
            )
        } else if is_one_material && coincidence.most > MANY {
            (
                SlowOrNoisy,
                "of which only one is seen, but rays are tested against all",
            )
        } else if is_one_material {
            (
                Harmless,
                "with the same material, so that the fault is not visible",
            )
        } else if seen.is_none() {
            (
                Harmless,
                "with another material; no camera sees either of the two",
            )
        } else if is_exact {
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
        let mut remedy = "remove one of the two";
        let mut predicate = "coincide with another object";
        let reason = match generator {
            Some(_) if before == index => {
                remedy = "set a `step` for the grid, or a larger box (`min`, `max`) or fewer copies for the scatter";
                predicate = "coincide with another one";
                format!(
                    "copies coincide, up to {} in one place, {label}",
                    coincidence.most
                )
            }
            Some(_) => format!("a copy of it is in the same place as {other}, {label}"),
            None => format!("it is in the same place as {other}, {label}"),
        };
        let finding = DuplicateObject
            .fault(index, reason, remedy)
            .with_severity(severity);
        let Some(kind) = generator else {
            return finding.with_place(seen.map(|at| at.position).or(own.centre()));
        };
        finding
            .with_count(
                coincidence.count,
                count_generated_objects(kind),
                "copies",
                predicate,
            )
            .with_place(own.centre().map(|centre| centre + coincidence.offset))
    }
}

/// Returns whether two objects in one place are the same surface.
fn are_alike(a: &ObjectFacts<'_>, b: &ObjectFacts<'_>) -> bool {
    let [(own, shape), (other, others)] = [a, b].map(|facts| (facts.object, &facts.object.shape));
    let is_one_shape = match (a.mesh, b.mesh) {
        (Some((i, own)), Some((j, other))) => {
            i == j || (&own.indices, &own.positions) == (&other.indices, &other.positions)
        }
        _ => is_ball(a) && is_ball(b) || shape == others,
    };
    // On its way a moving object is where both ends are said alike.
    let is_one_way = own.transform_end == other.transform_end
        && (own.transform_end.is_none() || own.transform == other.transform);
    is_one_shape && is_one_way && own.side == other.side
}

/// Returns whether an object is a ball at rest, which is the same however it is turned.
fn is_ball(facts: &ObjectFacts<'_>) -> bool {
    let matrix = facts.object_to_world.matrix3;
    let scale = matrix.determinant().abs().cbrt();
    let other = DMat3::from_diagonal(DVec3::splat(scale * scale));
    let is_similar = (matrix.transpose() * matrix).abs_diff_eq(other, 1e-9 * scale * scale);
    let is_sphere = matches!(facts.object.shape, Shape::Sphere { .. });
    is_sphere && is_similar && facts.object.transform_end.is_none()
}

/// Returns a hash of the rounded placement of an object, moved by an offset.
fn place_key(facts: &ObjectFacts<'_>, offset: DVec3) -> u64 {
    let mut map = facts.object_to_world;
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
    if let Shape::Sphere { centre, radius } = facts.object.shape
        && is_ball(facts)
    {
        hash_rounded(map.transform_point3(centre.into()), radius * scale);
        hash_rounded(DVec3::splat(libm::log(radius * scale)), 1.0);
    } else {
        let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        columns
            .into_iter()
            .for_each(|column| hash_rounded(column, scale));
        let size = facts.bounds.map_or(1.0, |bounds| bounds.extent().length());
        hash_rounded(
            facts
                .centre()
                .map_or(map.translation, |centre| centre + offset),
            size,
        );
    }
    hasher.finish()
}
