//! Bodies around cameras, and bodies that hide everything else from a camera.

use glam::DVec3;
use raywright_bvh::Aabb;

use super::cameras::{CameraView, is_bounded};
use super::facts::{ObjectFacts, SceneFacts, SurfaceKind};
use super::finding::{FindingCode, Severity, StressFinding};
use super::ray_survey::{RaySurvey, SightingCount};
use crate::scene::{AlphaMode, MaterialModel, Projection, Shape, SideRule};

/// Share of a camera's rays that begin inside a body from which on a lens in the body shows.
const SHARE: f64 = 0.002;

/// Returns the findings about bodies around the cameras or in front of them. `surveys` holds the
/// rays of each camera.
pub(super) fn check_bodies_at_cameras(
    scene_facts: &SceneFacts<'_>,
    views: &[CameraView],
    surveys: &[RaySurvey],
) -> Vec<StressFinding> {
    let of_view = |(view, survey)| camera_in_body_findings(scene_facts, view, survey);
    views.iter().zip(surveys).flat_map(of_view).collect()
}

/// Finds bodies that contain the camera: glass bodies, and opaque bodies whose inside fills the
/// whole picture.
fn camera_in_body_findings(
    scene_facts: &SceneFacts<'_>,
    view: &CameraView,
    survey: &RaySurvey,
) -> Vec<StressFinding> {
    let in_glass = |(&object, sighting): (&usize, &SightingCount)| {
        let body = scene_facts.objects[object]
            .subject
            .display_name(scene_facts.scene);
        let reason = format!(
            "it is inside {body}, which is transparent: everything is seen from inside that body"
        );
        let remedy = "move the camera out of the body, unless it should be inside";
        let (code, severity) = (FindingCode::CameraInBody, Severity::Harmless);
        let predicate = "leave the body without entering it";
        StressFinding::new(code, severity, view.subject, reason, remedy).with_count(
            sighting.count,
            survey.rays,
            "rays",
            predicate,
        )
    };
    let mut findings: Vec<StressFinding> =
        survey.bodies_around_camera.iter().map(in_glass).collect();
    let enclosing = enclosing_body_finding(scene_facts, view, survey);
    // What is behind an opaque body is not seen.
    if enclosing.is_some() {
        findings.clear();
    }
    findings.extend(enclosing);
    findings.extend(lens_in_body_findings(scene_facts, view, survey));
    findings.extend(hiding_body_finding(scene_facts, view, survey));
    findings
}

/// Finds an opaque body around the camera whose inside fills the whole picture, although the scene
/// has other objects.
fn enclosing_body_finding(
    scene_facts: &SceneFacts<'_>,
    view: &CameraView,
    survey: &RaySurvey,
) -> Option<StressFinding> {
    // Below an endless floor, rays beyond the horizon hit nothing.
    let fills_view = |(object, sighting): &(&usize, &SightingCount)| {
        let is_endless = !is_bounded(&scene_facts.objects[**object].object.shape);
        sighting.count == survey.rays || is_endless && sighting.count == survey.hits
    };
    let alone = survey.first_within.iter().find(fills_view);
    let others = |object: usize| {
        let emits = scene_facts.objects[object].emits_light();
        let all = scene_facts.objects.iter().enumerate();
        // A lamp around the camera may be the sky over an endless ground.
        all.filter(|(index, _)| *index != object).any(|(_, other)| {
            match is_bounded(&scene_facts.objects[object].object.shape) {
                true => !emits || is_bounded(&other.object.shape),
                false => other.bounds.is_some_and(|bounds| {
                    hides_point(&scene_facts.objects[object], view.eye(), bounds.centre())
                }),
            }
        })
    };
    let encloses = |object: usize| {
        scene_facts.objects[object].surface_kind == SurfaceKind::Opaque
            && may_contain_point(scene_facts, object, view.eye())
    };
    let (&object, sighting) = alone.filter(|(object, _)| others(**object) && encloses(**object))?;
    let body = scene_facts.objects[object]
        .subject
        .display_name(scene_facts.scene);
    let is_plane = matches!(
        scene_facts.objects[object].object.shape,
        Shape::Plane { .. }
    );
    let reason = match is_plane {
        true => format!(
            "it is behind {body}, on the side away from its `normal`, and sees no other object"
        ),
        false => format!(
            "it is inside {body} and sees nothing but that body's inside, although the scene has other objects"
        ),
    };
    let remedy = match is_plane {
        true => "move the camera to the other side of the plane (`pose`, or render with --eye)",
        false => "move the camera out of the body (`pose`, or render with --eye)",
    };
    Some(
        StressFinding::new(
            FindingCode::CameraInBody,
            Severity::PictureWrong,
            view.subject,
            reason,
            remedy,
        )
        .with_count(sighting.count, survey.rays, "rays", "hit its inside first"),
    )
}

/// Returns whether a point may be inside an object. Always true for closed shapes; for a mesh its
/// bounding box decides.
fn may_contain_point(scene_facts: &SceneFacts<'_>, object: usize, point: DVec3) -> bool {
    let own = scene_facts.objects[object].object;
    match &own.shape {
        Shape::Sphere { .. }
        | Shape::Box { .. }
        | Shape::Ellipsoid { .. }
        | Shape::Torus { .. }
        | Shape::Plane { .. }
        | Shape::Cone { .. } => true,
        Shape::Cylinder { height, caps, .. } => height.is_some() && *caps,
        Shape::Mesh(_) => scene_facts.mesh_of_object(own).is_some_and(|(_, data)| {
            let map = scene_facts.objects[object].object_to_world;
            let bounds = Aabb::from_points(
                data.positions
                    .iter()
                    .map(|position| map.transform_point3(position)),
            );
            point.cmpgt(bounds.min).all() && point.cmplt(bounds.max).all()
        }),
        _ => false,
    }
}

/// Returns whether a point is on the other side of a plane or a box than the eye.
fn hides_point(body: &ObjectFacts<'_>, eye: DVec3, point: DVec3) -> bool {
    const NEAR: f64 = 1e-3;
    let to_object = body.object_to_world.inverse();
    let [eye, point] = [eye, point].map(|p| to_object.transform_point3(p));
    match body.object.shape {
        Shape::Plane { point: own, normal } => {
            let height =
                |p: DVec3| (p - DVec3::from(own)).dot(DVec3::from(normal).normalize_or_zero());
            let [from, to] = [eye, point].map(height);
            from * to < 0.0 && to.abs() > NEAR * from.abs()
        }
        Shape::Box { min, max } => {
            let [low, high] = [min, max].map(|corner| (DVec3::from(corner) - eye) / (point - eye));
            let enters = low.min(high).max_element();
            let leaves = low.max(high).min_element();
            enters < leaves && enters > 0.0 && leaves < 1.0 - NEAR
        }
        _ => false,
    }
}

/// Finds opaque boxes and balls into which a lens reaches, with the eye outside.
fn lens_in_body_findings(
    scene_facts: &SceneFacts<'_>,
    view: &CameraView,
    survey: &RaySurvey,
) -> Vec<StressFinding> {
    let Projection::ThinLens {
        aperture_radius, ..
    } = view.data.projection
    else {
        return Vec::new();
    };
    let finding = |(&object, sighting): (&usize, &SightingCount)| {
        let body = &scene_facts.objects[object];
        let is_seen = sighting.count as f64 > SHARE * survey.rays as f64;
        if !is_seen || !is_opaque_closed_body(body) || body_contains_point(body, view.eye()) {
            return None;
        }
        let reason = format!(
            "its lens, {aperture_radius} metres in radius, reaches into {}, which is opaque and lies as a veil over the picture",
            body.subject.display_name(scene_facts.scene)
        );
        let remedy = "move the camera away from the body (`pose`, or render with --eye), or set a smaller `aperture_radius`";
        let (code, severity) = (FindingCode::CameraInBody, Severity::PictureWrong);
        let finding = StressFinding::new(code, severity, view.subject, reason, remedy);
        Some(finding.with_count(
            sighting.count,
            survey.rays,
            "rays",
            "begin inside that body",
        ))
    };
    survey.first_within.iter().filter_map(finding).collect()
}

/// Finds a box that hides all objects at which a camera is aimed.
fn hiding_body_finding(
    scene_facts: &SceneFacts<'_>,
    view: &CameraView,
    survey: &RaySurvey,
) -> Option<StressFinding> {
    let mut hit = survey.first_hits.iter();
    let (&object, sighting) = hit.next().filter(|_| hit.next().is_none())?;
    let own = &scene_facts.objects[object];
    let is_box = matches!(own.object.shape, Shape::Box { .. });
    let is_hidden = |other: &&ObjectFacts<'_>| {
        let centre = other.bounds.map(|bounds| bounds.centre());
        centre.is_some_and(|centre| {
            view.project_point(centre).is_some() && hides_point(own, view.eye(), centre)
        })
    };
    let others = || {
        let all = scene_facts.objects.iter();
        all.filter(|other| other.subject != own.subject && !other.emits_light())
    };
    let hidden = others().filter(is_hidden).count();
    let is_inside = RaySurvey::sighting_count(&survey.first_within, &object) > 0;
    let hides_all = hidden > 0 && hidden == others().count();
    if !is_box || is_inside || own.surface_kind != SurfaceKind::Opaque || !hides_all {
        return None;
    }
    let name = own.subject.display_name(scene_facts.scene);
    let reason = format!("{name} hides all other objects, at which this camera is aimed");
    let remedy = format!(
        "move the camera to the other side of {name} (`pose`, or render with --eye), or remove {name}"
    );
    let (code, severity) = (FindingCode::NothingSeen, Severity::PictureWrong);
    let finding = StressFinding::new(code, severity, view.subject, reason, remedy);
    Some(finding.with_count(
        sighting.count,
        survey.rays,
        "rays",
        "hit that object, and none another one",
    ))
}

/// Returns whether a body is a closed box or ball, opaque everywhere when seen from outside.
fn is_opaque_closed_body(body: &ObjectFacts<'_>) -> bool {
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
fn body_contains_point(body: &ObjectFacts<'_>, point: DVec3) -> bool {
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
