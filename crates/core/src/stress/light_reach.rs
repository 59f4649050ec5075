//! Lights that light nothing: they shine past all objects or are behind glass.
//! Lamps of almost no area are among them.

use glam::DVec3;
use raywright_bvh::Aabb;

use super::facts::{SceneFacts, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::light_survey::{Lamp, LightReach};
use super::numbers::{format_decimal, format_metres};
use crate::scene::{Light, LightKind, Triple};

/// Limits below which a lamp lights nothing. With a distance d, they apply to these shares of d²:
/// - `NO_AREA`: to the lamp's area.
/// - `DARK`: to its power (radiance times area, mean of three channels).
///
/// The distance d is that to the nearest camera, or the diagonal of the scene's bounds if shorter.
const NO_AREA: f64 = 1e-10;
const DARK: f64 = 1e-8;

/// Returns the position of a light, or `None` for a directional light.
pub(super) fn light_position(kind: &LightKind) -> Option<Triple> {
    match *kind {
        LightKind::Directional { .. } => None,
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some(position),
    }
}

/// Returns whether glass is in the way of most rays to a light. Rays blocked by opaque objects do
/// not count.
pub(super) fn is_behind_glass(reach: &LightReach) -> bool {
    const FEWEST: u64 = 8;
    reach.rays_through_glass >= FEWEST && reach.rays_through_glass > reach.unblocked_rays
}

/// Returns the findings about a light. `reach` holds the rays that were traced for the light;
/// `None` if none were.
pub(super) fn check_light(
    scene_facts: &SceneFacts<'_>,
    index: usize,
    reach: Option<&LightReach>,
) -> Vec<StressFinding> {
    let light = &scene_facts.scene.lights[index];
    let name = |object: usize| {
        let subject = scene_facts.objects[object].subject;
        subject.display_name(scene_facts.scene)
    };
    let finding = |code, severity, reason: String, remedy: String| {
        StressFinding::new(code, severity, FindingSubject::Light(index), reason, remedy)
            .with_place(light_position(&light.kind))
    };
    let mut findings = Vec::new();
    if let Some((reason, remedy)) = missed_scene_texts(scene_facts, light, reach) {
        let (code, severity) = (FindingCode::LightMissesScene, Severity::SlowOrNoisy);
        findings.push(finding(code, severity, reason, remedy));
    }
    if let Some((reach, glass)) = reach
        .filter(|reach| is_behind_glass(reach))
        .and_then(|reach| Some((reach, reach.glass?)))
    {
        let glass = name(glass);
        let reason = format!(
            "this light has no size, and {glass} in its way is glass: paths cannot hit a light without size through glass, so that it lights nothing behind the glass"
        );
        let remedy = format!(
            "set `thin_walled` for the material of {glass}, or replace the light by one with a size: an emissive object, or a sun in the sky"
        );
        let (code, severity) = (FindingCode::LightBehindGlass, Severity::PictureWrong);
        let all = reach.rays_through_glass + reach.unblocked_rays;
        findings.push(finding(code, severity, reason, remedy).with_count(
            reach.rays_through_glass,
            all,
            "rays",
            "that nothing opaque blocks pass through glass",
        ));
    }
    findings
}

/// Returns the reason and the remedy if no light arrives at the scene, otherwise `None`.
fn missed_scene_texts(
    scene_facts: &SceneFacts<'_>,
    light: &Light,
    reach: Option<&LightReach>,
) -> Option<(String, String)> {
    let (position, range) = match light.kind {
        LightKind::Directional { .. } => return None,
        LightKind::Point {
            position, range, ..
        }
        | LightKind::Spot {
            position, range, ..
        } => (DVec3::from(position), range),
    };
    let sent = reach.filter(|reach| reach.rays > 0);
    let misses = sent.is_some_and(|reach| reach.hits == 0);
    // The surface that its rays hit; the box of everything is nearer, and has no surface there.
    let nearest = sent.and_then(|reach| reach.nearest);
    if let Some(range) = range.filter(|range| misses && nearest.is_some_and(|n| *range <= n)) {
        let nearest = format_metres(nearest?);
        let reason = format!(
            "its `range` of {} ends before any surface, so that it lights nothing: the nearest surface on its rays is {nearest} away",
            format_metres(range)
        );
        let remedy = format!(
            "move the light nearer, set its `range` well above {nearest}, or remove `range`"
        );
        return Some((reason, remedy));
    }
    let to_other = match light.kind {
        LightKind::Spot { .. } => {
            "point its `direction` at the objects that it should light, or move the light"
        }
        _ => "move the light to the objects that it should light",
    };
    if let Some(lamp) = sent.filter(|_| misses).and_then(|reach| reach.lamp) {
        let lamp = scene_facts.objects[lamp].subject;
        let reason = format!(
            "it lights nothing but {}, which is a lamp itself",
            lamp.display_name(scene_facts.scene)
        );
        return Some((reason, to_other.to_owned()));
    }
    if let Some((reason, remedy)) = spot_miss_texts(light, position, &scene_facts.bounds, misses) {
        return Some((reason, remedy));
    }
    let rays = sent.filter(|_| misses)?.rays;
    let reason = match light.kind {
        LightKind::Spot { .. } => {
            format!("its cone misses all objects: none of {rays} rays in the cone hits a surface")
        }
        _ => format!("none of {rays} rays from it hits a surface"),
    };
    Some((reason, to_other.to_owned()))
}

/// Returns the reason and the remedy for a spot light outside the scene's bounding sphere whose
/// cone misses the scene.
fn spot_miss_texts(
    light: &Light,
    position: DVec3,
    bounds: &Aabb,
    misses: bool,
) -> Option<(String, String)> {
    let LightKind::Spot {
        direction,
        outer_angle,
        ..
    } = light.kind
    else {
        return None;
    };
    if bounds.is_empty() {
        return None;
    }
    let away = bounds.centre() - position;
    let radius = 0.5 * bounds.extent().length();
    if away.length() <= radius {
        return None;
    }
    let direction = DVec3::from(direction).normalize_or_zero();
    let off = away
        .normalize()
        .dot(direction)
        .clamp(-1.0, 1.0)
        .acos()
        .to_degrees();
    let half_width = (radius / away.length()).min(1.0).asin().to_degrees();
    if off <= outer_angle + half_width && !misses {
        return None;
    }
    let reason = format!(
        "its cone misses all objects: the middle of the scene is {off:.0} degrees off its `direction`, and its `outer_angle` is {outer_angle} degrees"
    );
    // No cone is wider than 90 degrees.
    let remedy = match off.ceil() {
        angle if angle < 90.0 => format!(
            "turn its `direction` to the scene, or widen its `outer_angle` to {angle:.0} degrees or more"
        ),
        _ => "turn its `direction` to the scene".to_owned(),
    };
    Some((reason, remedy))
}

/// Returns the finding about a lamp whose area is too small to light anything.
pub(super) fn sizeless_lamp_finding(
    scene_facts: &SceneFacts<'_>,
    lamp: &Lamp,
) -> Option<StressFinding> {
    let object_facts = &scene_facts.objects[lamp.object];
    let size = scene_facts.bounds_diagonal();
    let distance = if size > 0.0 {
        size.min(lamp.eye_distance)
    } else {
        lamp.eye_distance
    };
    let square = distance * distance;
    if lamp.area > NO_AREA * square || lamp.power / 3.0 > DARK * square {
        return None;
    }
    let area = match lamp.area {
        0.0 => "no area".to_owned(),
        area => format!("an area of {} square metres", format_decimal(area)),
    };
    let reason = format!(
        "this lamp has {area}, so that it gives almost no light, and rays to it are wasted"
    );
    let remedy =
        "make the lamp larger, or remove it; for a light without size, add an entry to `lights`";
    let (code, severity) = (FindingCode::UnreachedLight, Severity::SlowOrNoisy);
    let place = object_facts.bounds.map(|bounds| bounds.centre());
    let finding = StressFinding::new(code, severity, object_facts.subject, reason, remedy);
    Some(finding.with_place(place.and_then(finite_point)))
}
