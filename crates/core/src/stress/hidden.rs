//! Flat objects inside an opaque body, where no camera can see them.

use glam::DVec3;

use super::cameras::CameraView;
use super::facts::{ObjectFacts, SceneFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::ray_survey::RaySurvey;
use crate::scene::{AlphaMode, MaterialModel, Shape, SideRule};

/// Greatest number of flat objects, and of bodies, that are compared.
const MOST: usize = 4096;

/// Finds flat objects that no camera ray hit and that lie inside an opaque box or ball. Bodies with
/// a camera inside are left out.
pub(super) fn check_hidden_sheets(
    scene_facts: &SceneFacts<'_>,
    survey: &RaySurvey,
    views: &[CameraView],
) -> Vec<StressFinding> {
    let has_eye = |body: &&ObjectFacts<'_>| {
        views
            .iter()
            .any(|view| body_contains_point(body, view.eye()))
    };
    let bodies: Vec<&ObjectFacts<'_>> = listed_objects_at_rest(scene_facts)
        .filter(|object| is_opaque_closed_body(object))
        .filter(|body| !has_eye(body))
        .take(MOST)
        .collect();
    if bodies.is_empty() {
        return Vec::new();
    }
    let sheets = listed_objects_at_rest(scene_facts)
        .filter(|sheet| !sheet.emits_light())
        .filter(|sheet| {
            RaySurvey::sighting_count(&survey.first_hits, &sheet.subject.list_index()) == 0
        })
        .filter_map(|sheet| Some((sheet, sheet_corners(sheet)?)));
    let finding = |(sheet, corners): (&ObjectFacts<'_>, Vec<DVec3>)| {
        let mut around = bodies.iter();
        let body = around.find(|body| {
            corners
                .iter()
                .all(|&corner| body_contains_point(body, corner))
        })?;
        let name = body.subject.display_name(scene_facts.scene);
        let reason =
            format!("it lies entirely inside {name}, which is opaque, so that it is never visible");
        let remedy = format!("move the object to the surface of {name} or outside, or remove it");
        let (code, severity) = (FindingCode::InvisibleObject, Severity::Harmless);
        let place = sheet
            .bounds
            .and_then(|bounds| finite_point(bounds.centre()));
        let finding = StressFinding::new(code, severity, sheet.subject, reason, remedy);
        Some(finding.with_place(place))
    };
    sheets.take(MOST).filter_map(finding).collect()
}

fn listed_objects_at_rest<'a>(
    scene_facts: &'a SceneFacts<'a>,
) -> impl Iterator<Item = &'a ObjectFacts<'a>> {
    let count = scene_facts.scene.objects.len();
    let at_rest = |object: &&ObjectFacts<'_>| object.object.transform_end.is_none();
    scene_facts.objects.iter().take(count).filter(at_rest)
}

/// Returns whether a body is a closed box or ball, opaque everywhere when seen from outside.
pub(super) fn is_opaque_closed_body(body: &ObjectFacts<'_>) -> bool {
    let is_whole = body
        .material
        .is_some_and(|(_, material)| match &material.model {
            MaterialModel::Physical(m) => m.alpha == AlphaMode::Opaque,
            MaterialModel::Classic(_) => true,
        });
    let is_shown = matches!(body.object.side, SideRule::Both | SideRule::Outside);
    let is_closed = matches!(body.object.shape, Shape::Box { .. } | Shape::Sphere { .. });
    is_closed && is_shown && is_whole && body.surface_kind == SurfaceKind::Opaque
}

/// Returns whether a point is strictly inside a box or ball.
pub(super) fn body_contains_point(body: &ObjectFacts<'_>, point: DVec3) -> bool {
    if body
        .bounds
        .is_some_and(|b| point.cmplt(b.min).any() || point.cmpgt(b.max).any())
    {
        return false;
    }
    let point = body.object_to_world.inverse().transform_point3(point);
    match body.object.shape {
        Shape::Box { min, max } => {
            let [min, max] = [min, max].map(DVec3::from);
            let edge = 1e-9 * (max - min).max_element();
            point.cmpgt(min + edge).all() && point.cmplt(max - edge).all()
        }
        Shape::Sphere { centre, radius } => point.distance(centre.into()) < radius * (1.0 - 1e-9),
        _ => false,
    }
}

/// Returns the corners of a polygon around a flat object, in world space. `None` for other shapes.
fn sheet_corners(sheet: &ObjectFacts<'_>) -> Option<Vec<DVec3>> {
    let corners = match sheet.object.shape {
        Shape::Quad {
            corner,
            edge_u,
            edge_v,
        } => {
            let [c, u, v] = [corner, edge_u, edge_v].map(DVec3::from);
            vec![c, c + u, c + v, c + u + v]
        }
        Shape::Triangle { vertices } => vertices.map(DVec3::from).to_vec(),
        Shape::Disk {
            centre,
            normal,
            radius,
        } => {
            let (x, y) = DVec3::from(normal)
                .normalize_or_zero()
                .any_orthonormal_pair();
            let centre = DVec3::from(centre);
            let around = [x + y, x - y, y - x, -x - y];
            around.map(|away| centre + away * radius).to_vec()
        }
        _ => return None,
    };
    let in_world = |corner: DVec3| sheet.object_to_world.transform_point3(corner);
    Some(corners.into_iter().map(in_world).collect())
}
