//! Copies of a generator at the same position.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use glam::DVec3;

use super::duplicates::{DuplicateObjects, duplicate_finding};
use super::facts::{SceneFacts, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::ray_survey::RaySurvey;
use crate::generate::{count_generated_objects, generator_offsets};
use crate::scene::Generator;

/// Number of copies at one position above which they slow rays down.
const MANY: u64 = 64;

/// Finds generators with copies that coincide: with each other, with copies of an earlier
/// generator, or with a listed object. The time grows with the number of copies, not with the
/// number of pairs of generators.
pub(super) fn check_generator_copies(
    scene_facts: &SceneFacts<'_>,
    doubles: &DuplicateObjects,
    survey: &RaySurvey,
) -> Vec<StressFinding> {
    let mut first_by_key: HashMap<(u64, String), usize> = HashMap::new();
    let mut findings = Vec::new();
    for (index, generator) in scene_facts.scene.generators.iter().enumerate() {
        let first = *first_by_key
            .entry(generator_key(generator))
            .or_insert(index);
        findings.extend(
            coinciding_copies_finding(scene_facts, index, generator).or_else(|| {
                (first < index).then(|| twin_generator_finding(scene_facts, [first, index]))
            }),
        );
        if let Some(found) = doubles.find_copies_over_objects(scene_facts, index) {
            findings.push(copy_over_object_finding(scene_facts, survey, index, found));
        }
    }
    findings
}

/// Returns a key of a generator: a hash of its copies' positions, and its shape, transform and side
/// rule as text. Generators with equal keys make coinciding copies.
fn generator_key(generator: &Generator) -> (u64, String) {
    let mut hasher = DefaultHasher::new();
    for offset in generator_offsets(&generator.kind) {
        // Adding zero makes both zeros one.
        (offset + DVec3::ZERO)
            .to_array()
            .map(f64::to_bits)
            .hash(&mut hasher);
    }
    let object = &generator.object;
    let label = format!("{:?}{:?}{:?}", object.shape, object.transform, object.side);
    (hasher.finish(), label)
}

/// Returns the severity of coinciding copies and the words for their effect. `most` is the greatest
/// number of copies at one position.
fn coinciding_copies_severity(
    scene_facts: &SceneFacts<'_>,
    generator: usize,
    most: u64,
) -> (Severity, &'static str) {
    let object_facts = &scene_facts.objects[scene_facts.scene.objects.len() + generator];
    if object_facts.is_blended() {
        let label = "each copy dims the light that passes";
        (Severity::PictureWrong, label)
    } else if object_facts.emits_light() {
        let label = "each copy emits light, so that they give more light than a single one";
        (Severity::PictureWrong, label)
    } else if most > MANY {
        let label = "only one copy is seen, but rays are tested against all copies";
        (Severity::SlowOrNoisy, label)
    } else {
        let label = "all have the same material, so that the fault is not visible";
        (Severity::Harmless, label)
    }
}

fn coinciding_copies_finding(
    scene_facts: &SceneFacts<'_>,
    index: usize,
    generator: &Generator,
) -> Option<StressFinding> {
    let mut counts: HashMap<[u64; 3], u64> = HashMap::new();
    let (mut first, mut total) = (None, 0);
    for position in generator_offsets(&generator.kind) {
        // Adding zero makes both zeros one.
        let key = (position + DVec3::ZERO).to_array().map(f64::to_bits);
        let count = counts.entry(key).or_insert(0);
        (*count, total) = (*count + 1, total + 1);
        if *count == 2 {
            first = first.or(Some(position));
        }
    }
    let first = first?;
    let most = counts.values().copied().max().unwrap_or(0);
    let copies = counts.values().map(|count| count - 1).sum();
    let (severity, label) = coinciding_copies_severity(scene_facts, index, most);
    let object_facts = &scene_facts.objects[scene_facts.scene.objects.len() + index];
    let reason = format!("copies coincide, up to {most} in one place: {label}");
    let remedy =
        "set a `step` for the grid, or a larger box (`min`, `max`) or fewer copies for the scatter";
    let code = FindingCode::DuplicateObject;
    let finding = StressFinding::new(code, severity, object_facts.subject, reason, remedy)
        .with_count(copies, total, "copies", "coincide with another one");
    // Its bounds are those of its first copy.
    let start = generator_offsets(&generator.kind)
        .next()
        .unwrap_or_default();
    let at = object_facts
        .bounds
        .and_then(|bounds| finite_point(bounds.centre() + first - start));
    Some(finding.with_place(at))
}

/// Returns the finding that copies of a generator coincide with listed objects.
fn copy_over_object_finding(
    scene_facts: &SceneFacts<'_>,
    survey: &RaySurvey,
    generator: usize,
    (count, listed, offset): (u64, usize, DVec3),
) -> StressFinding {
    let own = scene_facts.scene.objects.len() + generator;
    let finding = duplicate_finding(scene_facts, survey, [listed, own]);
    let total = count_generated_objects(&scene_facts.scene.generators[generator].kind);
    let centre = scene_facts.objects[own]
        .bounds
        .map(|bounds| bounds.centre());
    StressFinding {
        reason: finding.reason.replacen("it is", "a copy of it is", 1),
        ..finding
    }
    .with_count(count, total, "copies", "coincide with a listed object")
    .with_place(centre.and_then(|centre| finite_point(centre + offset)))
}

/// Returns the finding that a generator repeats the copies of an earlier generator.
fn twin_generator_finding(
    scene_facts: &SceneFacts<'_>,
    [before, index]: [usize; 2],
) -> StressFinding {
    let listed = scene_facts.scene.objects.len();
    let [other, own] = [before, index].map(|generator| &scene_facts.objects[listed + generator]);
    let (severity, label) = match coinciding_copies_severity(scene_facts, index, 2) {
        (Severity::Harmless, _) if other.object.material != own.object.material => (
            Severity::PictureWrong,
            "the materials differ; of each two copies, only that of the first generator in the file is seen",
        ),
        known => known,
    };
    let reason = format!(
        "its copies coincide with those of {}: {label}",
        other.subject.display_name(scene_facts.scene)
    );
    let (code, remedy) = (
        FindingCode::DuplicateObject,
        "remove one of the two generators",
    );
    let at = own.bounds.and_then(|bounds| finite_point(bounds.centre()));
    StressFinding::new(code, severity, own.subject, reason, remedy).with_place(at)
}
