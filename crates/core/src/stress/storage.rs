//! Findings about coordinates that are rounded for storage.

use glam::{DAffine3, DVec3};
use raywright_bvh::Real;

use super::cameras::{CameraView, is_box_in_view};
use super::coarse;
use super::facts::{SceneFacts, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::numbers::format_decimal;
use super::ray_survey::RaySurvey;
use crate::dispatch::ReadyScene;
use crate::extent::MeshUseCounts;
use crate::prepare::round_to_scalar;
use crate::scene::{MeshData, Scene, Shape};
use crate::settings::PrecisionChoice;
use crate::validate::{Problem, do_edges_span_no_area};

/// Returns findings about shapes that degenerate when they are stored. `problems` are the errors
/// for which the scene cannot be prepared.
pub(super) fn lost_shape_findings(scene: &Scene, problems: &[Problem]) -> Vec<StressFinding> {
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
            .map_or(FindingSubject::Scene, FindingSubject::Object);
        let remedy = problem
            .hint
            .clone()
            .unwrap_or_else(|| "make the shape larger".to_owned());
        StressFinding::new(
            FindingCode::LostShape,
            Severity::PictureWrong,
            object,
            problem.message.clone(),
            remedy,
        )
    };
    problems.iter().map(finding).collect()
}

/// Returns the findings about details that storage loses. The picture is wrong if a camera has the
/// object in view.
pub(super) fn check_storage(
    scene_facts: &SceneFacts<'_>,
    ready: &ReadyScene,
    survey: &RaySurvey,
    views: &[CameraView],
) -> Vec<StressFinding> {
    let finding = |code, object: u32, reason: &str, remedy: String| {
        let index = scene_facts.facts_index(object);
        let object_facts = &scene_facts.objects[index];
        let is_seen = RaySurvey::sighting_count(&survey.sightings, &index) > 0
            || object_facts
                .bounds
                .is_none_or(|bounds| is_box_in_view(views, &bounds));
        let at = object_facts
            .bounds
            .and_then(|bounds| finite_point(bounds.centre()));
        let (severity, end) = match is_seen {
            true => (Severity::PictureWrong, ""),
            false => (Severity::Harmless, "; no camera has it in view"),
        };
        StressFinding::new(
            code,
            severity,
            object_facts.subject,
            format!("{reason}{end}"),
            remedy,
        )
        .with_place(at)
    };
    let exact = match ready.settings().precision {
        PrecisionChoice::Reference => "",
        PrecisionChoice::Robust => ", or render with --precision reference",
    };
    let lost = ready.invisible_objects();
    let mut findings: Vec<StressFinding> = lost
        .iter()
        .map(|&object| {
            let reason = "it is so far from the rest of the scene that rounding merges all corners of its triangles, so that nothing is left of it";
            let remedy = format!("move the object nearer to the rest of the scene{exact}");
            finding(FindingCode::LostObject, object, reason, remedy)
        })
        .collect();
    let (coarse_findings, coarse_subjects) =
        coarse::check_coarse_objects(scene_facts, ready, survey, views);
    findings.extend(coarse_findings);
    let lost_triangles = match ready.settings().precision {
        PrecisionChoice::Robust => lost_triangle_findings::<f32>(scene_facts, lost, survey),
        PrecisionChoice::Reference => lost_triangle_findings::<f64>(scene_facts, lost, survey),
    };
    // What is stored coarsely loses triangles by that.
    let is_own = |finding: &StressFinding| !coarse_subjects.contains(&finding.subject);
    findings.extend(lost_triangles.into_iter().filter(is_own));
    findings
}

/// Finds triangles that lose their area when they are stored, in objects that keep other triangles.
fn lost_triangle_findings<R: Real>(
    scene_facts: &SceneFacts<'_>,
    lost: &[u32],
    survey: &RaySurvey,
) -> Vec<StressFinding> {
    let origin = crate::storage_origin::StorageOrigin::from_scene::<R>(
        scene_facts.scene,
        &scene_facts.lookup,
    )
    .origin;
    // What instances share is stored in its own space.
    let uses = MeshUseCounts::from_scene(scene_facts.scene);
    let mut findings = Vec::new();
    for object_facts in scene_facts
        .objects
        .iter()
        .filter(|object_facts| !lost.contains(&(object_facts.subject.list_index() as u32)))
    {
        let (Some((_, data)), Shape::Mesh(name)) = (
            scene_facts.mesh_of_object(object_facts.object),
            &object_facts.object.shape,
        ) else {
            continue;
        };
        if uses.is_shared(name, object_facts.object.side) {
            continue;
        }
        let (count, first) = count_lost_triangles::<R>(data, object_facts.object_to_world, origin);
        let Some(first) = first else { continue };
        let total = data.indices.len() as u64;
        let is_seen =
            RaySurvey::sighting_count(&survey.sightings, &object_facts.subject.list_index()) > 0;
        let severity = if count * 100 >= total && is_seen {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        };
        let (cause, remedy) = lost_triangle_cause(object_facts);
        let reason =
            format!("rounding merges corners of its triangles, or puts them on a line, as {cause}");
        let finding = StressFinding::new(
            FindingCode::LostTriangles,
            severity,
            object_facts.subject,
            reason,
            remedy,
        );
        let corner = data.indices[first as usize][0];
        let position = data.positions.position(corner as usize);
        let at = finite_point(object_facts.object_to_world.transform_point3(position));
        findings.push(
            finding
                .with_count(count, total, "triangles", "lost their area")
                .with_primitive(first)
                .with_place(at),
        );
    }
    findings
}

/// Returns why triangles of an object lose their area, and the remedy.
fn lost_triangle_cause(object_facts: &super::facts::ObjectFacts<'_>) -> (String, &'static str) {
    const FLAT: f64 = 1e-4;
    let matrix = object_facts.object_to_world.matrix3;
    let scales = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.length());
    let [least, greatest] = [
        scales.into_iter().fold(f64::INFINITY, f64::min),
        scales.into_iter().fold(0.0, f64::max),
    ];
    match least < FLAT * greatest {
        true => (
            format!("a scale of {} flattens the mesh", format_decimal(least)),
            "set a greater scale along that axis, replace the mesh by a flat one, or render with --precision reference",
        ),
        false => (
            "these triangles are so small and so far from the middle of the scene".to_owned(),
            "move the mesh nearer to the rest of the scene, or render with --precision reference",
        ),
    }
}

/// Returns the number of triangles that lose their area when they are stored under a transform, and
/// the first of them.
fn count_lost_triangles<R: Real>(
    data: &MeshData,
    map: DAffine3,
    origin: DVec3,
) -> (u64, Option<u32>) {
    if keeps_vertex_digits::<R>(data, map.translation - origin, map.matrix3.x_axis.length()) {
        return (0, None);
    }
    let is_flat = |corners: [DVec3; 3]| {
        let [a, b, c] = corners;
        a == b || b == c || c == a || do_edges_span_no_area(b - a, c - a)
    };
    let stored = |p: DVec3| {
        let relative = (map.transform_point3(p) - origin).to_array();
        DVec3::from(relative.map(round_to_scalar::<R>))
    };
    let is_lost = |corners: &[u32; 3]| {
        let corners = corners.map(|corner| data.positions.position(corner as usize));
        is_flat(corners.map(stored)) && !is_flat(corners)
    };
    let (mut count, mut first) = (0, None);
    for (index, corners) in data.indices.iter().enumerate() {
        if is_lost(corners) {
            count += 1;
            first = first.or(Some(index as u32));
        }
    }
    (count, first)
}

/// Returns whether storage keeps all digits of a mesh's vertices: its distance from the origin is
/// at most its greatest coordinate.
fn keeps_vertex_digits<R: Real>(data: &MeshData, away: DVec3, scale: f64) -> bool {
    let greatest = data
        .positions
        .iter()
        .fold(0.0_f64, |greatest, p| greatest.max(p.abs().max_element()));
    !R::IS_SINGLE
        || data.positions.origin() == DVec3::ZERO && away.abs().max_element() <= greatest * scale
}
