//! What rays of the cameras say of bodies and surfaces, and where rays start from them.

use std::collections::{BTreeMap, HashMap};

use super::aimed::AimedRays;
use super::facts::{Matter, SceneFacts, place};
use super::finding::{Code, Finding, Severity, Subject};
use super::ray_survey::{RaySurvey, Sighting};
use super::topology::Topology;
use crate::prepare::{ClosedGap, Lamp, LightLeak};
use crate::scene::{Object, Shape};

/// Share of the rays on whose way something is from which on it is seen in the picture.
const SEEN: f64 = 0.02;
/// Share of all rays from which on it is.
const OF_ALL: f64 = 0.002;

/// What rays say.
pub(super) fn check(
    facts: &SceneFacts<'_>,
    topologies: &BTreeMap<usize, Topology>,
    seen: &RaySurvey,
    aimed: &[AimedRays],
) -> Vec<Finding> {
    let mut found = open_bodies(facts, topologies, seen);
    found.extend(nested(facts, seen));
    found.extend(flickering(facts, seen));
    found.extend(duplicates(facts));
    let of = |code, why: &str, remedy: &str, (&object, sighting): (&usize, &Sighting), of: u64| {
        let finding = Finding::new(
            code,
            Severity::PictureWrong,
            facts.objects[object].subject,
            why,
            remedy,
        );
        finding
            .counted(sighting.count, of, "rays")
            .at(place(sighting.place))
    };
    for sighting in &seen.self_hits {
        let why = "rays that leave the surface meet it again where they start, which shows as dark speckles";
        let remedy = "leave `classic.spawn` away, or give it a larger `offset`";
        found.push(of(Code::SelfHit, why, remedy, sighting, seen.starts));
    }
    for sighting in seen
        .beyond
        .iter()
        .filter(|(_, beyond)| beyond.count as f64 > OF_ALL * seen.starts as f64)
    {
        let why = "rays that leave the surface start beyond another one: its shadow and its reflection are missing there";
        let remedy = "leave `classic.spawn` away, or give it a smaller `offset`";
        found.push(of(
            Code::StartBeyondSurface,
            why,
            remedy,
            sighting,
            seen.starts,
        ));
    }
    let sent = aimed.iter().map(|rays| rays.sent).sum();
    for (&object, &(count, point)) in aimed.iter().flat_map(|rays| &rays.leaks) {
        let why = "rays pass between triangles that share an edge or a corner";
        let finding = Finding::new(
            Code::Leak,
            Severity::PictureWrong,
            facts.objects[object].subject,
            why,
            "please report this: it is a fault of the program",
        );
        found.push(finding.counted(count, sent, "rays").at(place(point)));
    }
    found
}

/// Bodies of glass that are not closed, and are no meshes whose edges say so.
fn open_bodies(
    facts: &SceneFacts<'_>,
    topologies: &BTreeMap<usize, Topology>,
    seen: &RaySurvey,
) -> Vec<Finding> {
    let finding = |(&object, sighting): (&usize, &Sighting)| {
        let own = &facts.objects[object];
        let edges_tell = facts
            .mesh(own.object)
            .and_then(|(mesh, _)| topologies.get(&mesh))
            .is_some_and(|t| !t.is_closed());
        let met = RaySurvey::count(&seen.met, &object);
        // What has no end has an inside that nothing leaves.
        let is_endless = matches!(own.object.shape, Shape::Plane { .. });
        let is_few = sighting.count < 3 || (sighting.count as f64) < SEEN * met as f64;
        if edges_tell || is_endless || is_few {
            return None;
        }
        let why = "rays go into a body of glass and do not come out of it, or the other way round: it is open, and they are bent and tinted wrongly";
        let remedy = "close it (a tube by `caps`), or set `thin_walled` where it is to be a pane without an inside";
        let finding = Finding::new(
            Code::OpenBody,
            Severity::PictureWrong,
            own.subject,
            why,
            remedy,
        );
        Some(
            finding
                .counted(sighting.count, met, "rays")
                .at(place(sighting.place)),
        )
    };
    seen.unbalanced.iter().filter_map(finding).collect()
}

fn nested(facts: &SceneFacts<'_>, seen: &RaySurvey) -> Vec<Finding> {
    let has_priorities = facts
        .used_materials()
        .iter()
        .any(|(_, material)| matches!(&material.model, crate::scene::Model::Physical(m) if m.is_nested()));
    let finding = |([outer, inner], sighting): (&[usize; 2], &Sighting)| {
        let met = RaySurvey::count(&seen.met, inner);
        if sighting.count < 3 || (sighting.count as f64) < SEEN * met as f64 {
            return None;
        }
        let around = facts.objects[*outer].subject.words(facts.scene);
        let why = format!(
            "it is within {around} or reaches into it, and each boundary bends light as if there were air between them"
        );
        let remedy = "give both materials a `priority`: the body with the greater one is there where they overlap";
        let finding = Finding::new(
            Code::NestedGlass,
            Severity::PictureWrong,
            facts.objects[*inner].subject,
            why,
            remedy,
        );
        Some(
            finding
                .counted(sighting.count, met, "rays")
                .at(place(sighting.place)),
        )
    };
    if has_priorities {
        Vec::new()
    } else {
        seen.nested.iter().filter_map(finding).collect()
    }
}

/// Whether of two surfaces in one place each is seen here and there.
pub(super) fn flickers(facts: &SceneFacts<'_>, seen: &RaySurvey, [a, b]: [usize; 2]) -> bool {
    let [one, other] = [[a, b], [b, a]].map(|pair| RaySurvey::count(&seen.coincident, &pair));
    let differ = facts.objects[a].object.material != facts.objects[b].object.material;
    differ && one + other >= 10 && 20 * one.min(other) >= one + other
}

/// Those of which that is so.
fn flickering(facts: &SceneFacts<'_>, seen: &RaySurvey) -> Vec<Finding> {
    let finding = |(pair, sighting): (&[usize; 2], &Sighting)| {
        let [a, b] = *pair;
        if a > b || !flickers(facts, seen, *pair) {
            return None;
        }
        let all = sighting.count + RaySurvey::count(&seen.coincident, &[b, a]);
        let with = facts.objects[b].subject.words(facts.scene);
        let why = format!(
            "it lies in one place with {with}, and rounding decides from ray to ray which of them is seen"
        );
        let finding = Finding::new(
            Code::FlickeringSurfaces,
            Severity::PictureWrong,
            facts.objects[a].subject,
            why,
            "move one of them by a thousandth of its size, or take it away",
        );
        Some(
            finding
                .counted(all, seen.rays, "rays")
                .at(place(sighting.place)),
        )
    };
    seen.coincident.iter().filter_map(finding).collect()
}

/// Objects that are there twice.
fn duplicates(facts: &SceneFacts<'_>) -> Vec<Finding> {
    let mut first: HashMap<String, usize> = HashMap::new();
    let mut found = Vec::new();
    for (index, own) in facts
        .objects
        .iter()
        .enumerate()
        .take(facts.scene.objects.len())
    {
        let Object {
            shape,
            transform,
            transform_end,
            side,
            ..
        } = own.object;
        let key = format!("{shape:?}{transform:?}{transform_end:?}{side:?}");
        let Some(&before) = first.get(&key) else {
            first.insert(key, index);
            continue;
        };
        let passes = [before, index]
            .iter()
            .any(|&object| facts.objects[object].matter != Matter::Opaque);
        let other = facts.objects[before].subject.words(facts.scene);
        let (severity, why) = match passes {
            true => (
                Severity::PictureWrong,
                format!(
                    "{other} is there again in the same place, and light that passes is bent or dimmed twice"
                ),
            ),
            false => (
                Severity::Harmless,
                format!("{other} is there again in the same place; the first one is seen"),
            ),
        };
        found.push(Finding::new(
            Code::DuplicateObject,
            severity,
            own.subject,
            why,
            "remove one of them",
        ));
    }
    found
}

/// Gaps and covers that storing closes.
pub(super) fn closed(
    facts: &SceneFacts<'_>,
    gaps: &[ClosedGap],
    leaks: &[LightLeak],
) -> Vec<Finding> {
    let subject = |object: usize| facts.objects[facts.index_of(object as u32)].subject;
    let words = |object: usize| subject(object).words(facts.scene);
    let gap = |gap: &ClosedGap| {
        let why = format!(
            "the gap to {} is closed: light that passes the one starts beyond the other, since they touch or are nearer than rounding tells apart",
            words(gap.other)
        );
        let remedy = format!(
            "leave {:.1e} metres or more between them, or add --precision reference",
            gap.resolved
        );
        Finding::new(
            Code::ClosedGap,
            Severity::PictureWrong,
            subject(gap.object),
            why,
            remedy,
        )
    };
    let leak = |leak: &LightLeak| {
        let lamp = match leak.lamp {
            Lamp::Light(index) => Subject::Light(index),
            Lamp::Object(object) => subject(object),
        };
        let why = format!(
            "it shines through {}, which is opaque but nearer before it than rounding tells apart",
            words(leak.cover)
        );
        let remedy = format!(
            "leave {:.1e} metres or more between them, or add --precision reference",
            leak.resolved
        );
        Finding::new(
            Code::LightThroughCover,
            Severity::PictureWrong,
            lamp,
            why,
            remedy,
        )
    };
    gaps.iter().map(gap).chain(leaks.iter().map(leak)).collect()
}
