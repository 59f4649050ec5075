//! Summary of all findings: each cause once, worst first, with pixels.

use std::collections::BTreeMap;

use super::cameras::{self, CameraView};
use super::facts::SceneFacts;
use super::finding::{FindingSubject, StressFinding};
use super::finding_code::{FindingCode, Severity};
use super::{StressSummary, consequences, sightlines};
use crate::dispatch::ReadyScene;

/// Greatest number of findings that are kept for each pair of severity and code.
const KEPT: usize = 16;

/// Returns the summary: each cause once, worst first, with the pixels at which cameras see it.
/// Without a prepared scene, no pixel is set.
pub(super) fn summarise_findings(
    scene_facts: &SceneFacts<'_>,
    views: &[CameraView],
    ready: Option<&ReadyScene>,
    mut findings: Vec<StressFinding>,
) -> StressSummary {
    findings.extend(empty_scene_finding(scene_facts));
    let findings = consequences::remove_consequent_findings(scene_facts, findings);
    let mut findings = merge_findings(views, findings);
    findings.sort_by(|a, b| {
        (a.severity, a.code, a.subject, &a.reason).cmp(&(b.severity, b.code, b.subject, &b.reason))
    });
    let (all, mut of_kind) = (findings.len(), BTreeMap::new());
    findings.retain(|finding| {
        let kept = of_kind.entry((finding.severity, finding.code)).or_insert(0);
        *kept += 1;
        *kept <= KEPT
    });
    let left_out = all - findings.len();
    if let Some(ready) = ready {
        sightlines::assign_pixels(scene_facts, ready, views, &mut findings);
    }
    StressSummary {
        findings,
        left_out,
        checks: Vec::new(),
        cameras: [0; 2],
        size: views.first().map_or([1, 1], |view| view.size),
    }
}

/// Returns a finding if the scene has no object.
fn empty_scene_finding(scene_facts: &SceneFacts<'_>) -> Option<StressFinding> {
    let reason = "the scene has no object: the file has no object, or all its objects were left out when it was read";
    let remedy =
        "check the warnings about the file, and whether the file has a mesh with finite vertices";
    scene_facts.is_empty().then(|| {
        let (code, severity) = (FindingCode::NothingSeen, Severity::PictureWrong);
        StressFinding::new(code, severity, FindingSubject::Scene, reason, remedy)
    })
}

/// Merges findings that agree in severity, code, reason, remedy and kind of subject. The position
/// nearest to a camera is kept.
fn merge_findings(views: &[CameraView], mut findings: Vec<StressFinding>) -> Vec<StressFinding> {
    findings.sort_by(|a, b| {
        (a.severity, a.code, &a.reason, &a.remedy, a.subject)
            .cmp(&(b.severity, b.code, &b.reason, &b.remedy, b.subject))
    });
    let mut groups: Vec<StressFinding> = Vec::new();
    for finding in findings {
        let is_one = |last: &&mut StressFinding| {
            (last.severity, last.code, &last.reason, &last.remedy)
                == (
                    finding.severity,
                    finding.code,
                    &finding.reason,
                    &finding.remedy,
                )
                && last.subject.is_same_kind(finding.subject)
        };
        match groups.last_mut().filter(is_one) {
            // Of several cameras.
            Some(last) if last.subject == finding.subject => {}
            Some(last) => last.merge(finding, |place| {
                cameras::view_distance_key(views, place.into())
            }),
            None => groups.push(finding),
        }
    }
    groups
        .iter_mut()
        .for_each(|group| group.others.sort_unstable());
    groups
}
