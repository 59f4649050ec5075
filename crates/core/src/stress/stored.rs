//! What stored coordinates make of a scene, and how large it is.

use glam::DVec3;
use raywright_bvh::Real;

use super::facts::{SceneFacts, place};
use super::finding::{Code, Finding, Severity, Subject};
use crate::dispatch::Ready;
use crate::extent::Uses;
use crate::prepare::rounded;
use crate::scene::{MeshData, Scene, Shape};
use crate::settings::PrecisionChoice;
use crate::validate::{Problem, no_area};

/// Sizes in metres between which scenes usually are.
const USUAL: [f64; 2] = [1e-3, 1e6];
/// Share of a scene's size below which an object is hardly a part of it.
const TINY: f64 = 1e-6;

/// Shapes of which storing leaves nothing, by the problems for which preparing them is refused.
pub(super) fn lost_shapes(scene: &Scene, problems: &[Problem]) -> Vec<Finding> {
    let finding = |problem: &Problem| {
        let index = |path: &str, list: &str| {
            path.strip_prefix(list)?
                .split(']')
                .next()?
                .parse::<usize>()
                .ok()
        };
        let object = index(&problem.path, "objects[")
            .or_else(|| Some(scene.objects.len() + index(&problem.path, "generators[")?))
            .map_or(Subject::Scene, Subject::Object);
        let remedy = problem
            .hint
            .clone()
            .unwrap_or_else(|| "make it larger".to_owned());
        Finding::new(
            Code::LostShape,
            Severity::PictureWrong,
            object,
            problem.message.clone(),
            remedy,
        )
    };
    problems.iter().map(finding).collect()
}

/// What storing takes from the objects of a prepared scene.
pub(super) fn check(facts: &SceneFacts<'_>, ready: &Ready) -> Vec<Finding> {
    let subject = |object: u32| facts.objects[facts.index_of(object)].subject;
    let exact = match ready.settings().precision {
        PrecisionChoice::Reference => "",
        PrecisionChoice::Robust => ", or add --precision reference",
    };
    let lost = ready.lost();
    let mut found: Vec<Finding> = lost
        .iter()
        .map(|&object| {
            let why = "so far from the rest of the scene, all corners of its triangles are stored as one, so that nothing of it is seen";
            let remedy = format!("move it nearer to the rest of the scene{exact}");
            Finding::new(Code::LostObject, Severity::PictureWrong, subject(object), why, remedy)
        })
        .collect();
    if let Some(object) = ready.unresolved().filter(|object| !lost.contains(object)) {
        let why = "so far from the rest of the scene, points a thousandth of its size apart are stored as one: its shape is shattered";
        let remedy = format!("move it nearer to the rest of the scene{exact}");
        found.push(Finding::new(
            Code::UnresolvedObject,
            Severity::PictureWrong,
            subject(object),
            why,
            remedy,
        ));
    }
    found.extend(match ready.settings().precision {
        PrecisionChoice::Robust => lost_triangles::<f32>(facts, lost),
        PrecisionChoice::Reference => lost_triangles::<f64>(facts, lost),
    });
    found.extend(scale(facts));
    found
}

/// Triangles with an area that storing makes flat, of objects of which others stay.
fn lost_triangles<R: Real>(facts: &SceneFacts<'_>, lost: &[u32]) -> Vec<Finding> {
    let origin = crate::origin::StorageOrigin::of::<R>(facts.scene, &facts.lookup).origin;
    // What instances share is stored in its own space.
    let uses = Uses::of(facts.scene);
    let mut found = Vec::new();
    for own in facts
        .objects
        .iter()
        .filter(|own| !lost.contains(&(own.subject.index() as u32)))
    {
        let (Some((_, data)), Shape::Mesh(name)) = (facts.mesh(own.object), &own.object.shape)
        else {
            continue;
        };
        if uses.share(name, own.object.side) {
            continue;
        }
        let map = own.map;
        let is_flat = |corners: [DVec3; 3]| {
            let [a, b, c] = corners;
            a == b || b == c || c == a || no_area(b - a, c - a)
        };
        let stored = |p: DVec3| {
            DVec3::from(
                (map.transform_point3(p) - origin)
                    .to_array()
                    .map(rounded::<R>),
            )
        };
        let is_lost = |corners: &[u32; 3]| {
            let corners = corners.map(|corner| data.positions.at(corner as usize));
            is_flat(corners.map(stored)) && !is_flat(corners)
        };
        if is_safe::<R>(data, map.translation - origin, map.matrix3.x_axis.length()) {
            continue;
        }
        let (mut count, mut first) = (0, None);
        for (index, _) in data
            .indices
            .iter()
            .enumerate()
            .filter(|(_, corners)| is_lost(corners))
        {
            count += 1;
            first = first.or(Some(index as u32));
        }
        let Some(first) = first else { continue };
        let of = data.indices.len() as u64;
        let severity = if count * 100 >= of {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        };
        let why = "corners of triangles are stored as one, or on a line, since they are so small and so far from the rest of the scene";
        let finding = Finding::new(
            Code::LostTriangles,
            severity,
            own.subject,
            why,
            "move the mesh nearer to the rest of the scene, or add --precision reference",
        );
        let corner = data.indices[first as usize][0];
        let at = place(map.transform_point3(data.positions.at(corner as usize)));
        found.push(
            finding
                .counted(count, of, "triangles")
                .from_primitive(first)
                .at(at),
        );
    }
    found
}

/// Whether a mesh is stored where its own digits are kept: no farther away than its own numbers are
/// great.
fn is_safe<R: Real>(data: &MeshData, away: DVec3, scale: f64) -> bool {
    let greatest = data
        .positions
        .iter()
        .fold(0.0_f64, |greatest, p| greatest.max(p.abs().max_element()));
    !R::IS_SINGLE
        || data.positions.origin() == DVec3::ZERO && away.abs().max_element() <= greatest * scale
}

/// Sizes that are probably in other units.
fn scale(facts: &SceneFacts<'_>) -> Vec<Finding> {
    let size = facts.diagonal();
    let mut found = Vec::new();
    if size > 0.0 && !(USUAL[0]..=USUAL[1]).contains(&size) {
        let why = format!(
            "all of it is {size:.1e} metres across: it is probably in other units, and lights and glass are in metres"
        );
        found.push(Finding::new(
            Code::ExtremeScale,
            Severity::Harmless,
            Subject::Scene,
            why,
            "scale it to metres",
        ));
    }
    for own in &facts.objects {
        let radius = match own.object.shape {
            Shape::Sphere { radius, .. } | Shape::Disk { radius, .. } => radius,
            _ => continue,
        };
        let size_of = radius * own.map.matrix3.determinant().abs().cbrt();
        if size_of < TINY * size {
            let why = format!("it is {:.1e} of the scene's size", size_of / size);
            let finding = Finding::new(
                Code::ExtremeScale,
                Severity::Harmless,
                own.subject,
                why,
                "look whether it is in other units than the rest",
            );
            found.push(finding);
        }
    }
    found
}
