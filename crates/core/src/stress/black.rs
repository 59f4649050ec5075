//! Black pictures. Each is reported together with its cause in a single finding.

use super::covers::LightBlocker;
use super::facts::SceneFacts;
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::small_render::{SmallRender, camera_subject};
use crate::scene::Sky;

/// Findings that can explain a black picture, in the order in which they are tried.
const CAUSES: [FindingCode; 3] = [
    FindingCode::UnreachedLight,
    FindingCode::LightMissesScene,
    FindingCode::LightByChance,
];

/// Adds a finding for each black picture, and removes the findings about lights that explain it.
pub(super) fn add_black_picture_findings(
    scene_facts: &SceneFacts<'_>,
    pictures: &[SmallRender],
    findings: &mut Vec<StressFinding>,
) {
    let black: Vec<StressFinding> = pictures
        .iter()
        .filter_map(|picture| black_picture_finding(scene_facts, picture))
        .collect();
    if black.is_empty() {
        return;
    }
    let cover = pictures.iter().find_map(|picture| picture.cover);
    let (reason, remedy) = match black_picture_cause_texts(scene_facts, cover, findings) {
        Some(texts) => texts,
        None => return findings.extend(black),
    };
    findings.retain(|finding| !CAUSES.contains(&finding.code));
    findings.extend(black.into_iter().map(|finding| StressFinding {
        reason: reason.clone(),
        remedy: remedy.clone(),
        ..finding
    }));
}

fn black_picture_finding(
    scene_facts: &SceneFacts<'_>,
    picture: &SmallRender,
) -> Option<StressFinding> {
    let words = |subject: FindingSubject| subject.display_name(scene_facts.scene);
    let has_expression = matches!(scene_facts.scene.sky, Some(Sky::Expression(_)));
    let (reason, remedy) = match picture.cover {
        None if has_expression => (
            "all visible surfaces are black: no sample found light in the sky, whose `expression` is black or bright only in a small place".to_owned(),
            "make the bright place of the sky larger, or replace it by an entry of `suns` in a `gradient` sky: samples are aimed at such suns".to_owned(),
        ),
        None => (
            "all visible surfaces are black: no light reaches them".to_owned(),
            "add a light or a sky, or move the objects that block the light".to_owned(),
        ),
        Some(LightBlocker { object, light }) => {
            let cover = words(scene_facts.objects[object].subject);
            (
                format!(
                    "all visible surfaces are black: {cover} blocks the light of {}",
                    words(light)
                ),
                format!("open or remove {cover}, or add a light on the camera's side of it"),
            )
        }
    };
    let (code, severity) = (FindingCode::BlackPicture, Severity::PictureWrong);
    let subject = camera_subject(scene_facts, picture);
    picture
        .is_black()
        .then(|| StressFinding::new(code, severity, subject, reason, remedy))
}

/// Returns the reason and the remedy for a black picture, derived from the findings about lights.
/// Returns `None` if no such finding explains it.
fn black_picture_cause_texts(
    scene_facts: &SceneFacts<'_>,
    cover: Option<LightBlocker>,
    findings: &[StressFinding],
) -> Option<(String, String)> {
    let of_code = |code| findings.iter().filter(move |finding| finding.code == code);
    let code = CAUSES
        .into_iter()
        .find(|&code| of_code(code).next().is_some())?;
    let names: Vec<String> = of_code(code)
        .map(|finding| finding.subject.display_name(scene_facts.scene))
        .collect();
    let lights = match names.len() {
        1 => format!("{} is", names[0]),
        more => format!("{} and {} more are", names[0], more - 1),
    };
    if code != FindingCode::UnreachedLight {
        let first = of_code(code).next()?;
        let what = match code {
            FindingCode::LightByChance => " hit by none of the few samples of this check",
            _ => " without effect",
        };
        let reason = format!(
            "all visible surfaces are black: {lights}{what}; {}",
            first.reason
        );
        return Some((reason, first.remedy.clone()));
    }
    let cover = cover.map(|cover| {
        let subject = scene_facts.objects[cover.object].subject;
        subject.display_name(scene_facts.scene)
    });
    let (why, what) = match &cover {
        Some(cover) => (format!("blocked by {cover}"), cover.as_str()),
        None => (
            "blocked, or turned away from all visible surfaces".to_owned(),
            "the object that blocks the light",
        ),
    };
    Some((
        format!("all visible surfaces are black: {lights} {why}"),
        format!("open or remove {what}, or add a light or a sky"),
    ))
}
