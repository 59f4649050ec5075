//! Findings that follow from other findings. They are left out, so that each cause is reported
//! once.

use super::facts::SceneFacts;
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use crate::scene::Sky;

/// What two findings must have in common for the second to follow from the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ConsequentFindingScope {
    /// Nothing: the second follows anywhere in the scene.
    Scene,
    /// The subject.
    Subject,
    /// An image: the first finding is about it, and the material or the sky of the second reads it.
    Image,
}

/// Codes of causes, each with the codes that follow from it.
const CONSEQUENCES: [(FindingCode, ConsequentFindingScope, &[FindingCode]); 18] = [
    (
        FindingCode::LightBehindGlass,
        ConsequentFindingScope::Scene,
        &[FindingCode::BlackPicture],
    ),
    (
        FindingCode::DegenerateTriangles,
        ConsequentFindingScope::Scene,
        &[FindingCode::NothingSeen],
    ),
    (
        FindingCode::EnergyMade,
        ConsequentFindingScope::Scene,
        &[FindingCode::BrighterThanLights],
    ),
    (
        FindingCode::LightByChance,
        ConsequentFindingScope::Scene,
        &[FindingCode::BrighterThanLights],
    ),
    (
        FindingCode::LightByChance,
        ConsequentFindingScope::Subject,
        &[FindingCode::UnreachedLight, FindingCode::LampBelowPixel],
    ),
    (
        FindingCode::ValuesNotNumbers,
        ConsequentFindingScope::Scene,
        &[FindingCode::SamplesNotFinite, FindingCode::BlackPicture],
    ),
    (
        FindingCode::ImageNotLight,
        ConsequentFindingScope::Image,
        &[
            FindingCode::ValuesNotNumbers,
            FindingCode::SamplesNotFinite,
            FindingCode::BlackPicture,
            FindingCode::EnergyMade,
        ],
    ),
    (
        FindingCode::CameraInBody,
        ConsequentFindingScope::Subject,
        &[FindingCode::BlackPicture],
    ),
    (
        FindingCode::SceneBelowPixel,
        ConsequentFindingScope::Subject,
        &[FindingCode::NothingSeen],
    ),
    (
        FindingCode::LostObject,
        ConsequentFindingScope::Scene,
        &[FindingCode::SceneBelowPixel],
    ),
    (
        FindingCode::UnresolvedObject,
        ConsequentFindingScope::Subject,
        &[FindingCode::LostTriangles],
    ),
    (
        FindingCode::LightMissesScene,
        ConsequentFindingScope::Subject,
        &[FindingCode::UnreachedLight],
    ),
    (
        FindingCode::NestedGlass,
        ConsequentFindingScope::Scene,
        &[FindingCode::DepthBelowGlass],
    ),
    (
        FindingCode::NestedGlass,
        ConsequentFindingScope::Subject,
        &[FindingCode::OpenBody, FindingCode::ClosedGap],
    ),
    (
        FindingCode::OpenBody,
        ConsequentFindingScope::Subject,
        &[FindingCode::DepthBelowGlass],
    ),
    (
        FindingCode::OpenEdges,
        ConsequentFindingScope::Subject,
        &[FindingCode::DepthBelowGlass],
    ),
    (
        FindingCode::InsideOut,
        ConsequentFindingScope::Subject,
        &[FindingCode::DepthBelowGlass],
    ),
    (
        FindingCode::FlippedTriangles,
        ConsequentFindingScope::Subject,
        &[FindingCode::DepthBelowGlass],
    ),
];

/// Removes the findings that follow from other findings of the list.
pub(super) fn remove_consequent_findings(
    scene_facts: &SceneFacts<'_>,
    mut findings: Vec<StressFinding>,
) -> Vec<StressFinding> {
    for (cause, scope, codes) in CONSEQUENCES {
        let causes: Vec<(FindingSubject, Severity)> = findings
            .iter()
            .filter(|finding| finding.code == cause)
            .flat_map(|finding| {
                let subjects = finding.others.iter().chain([&finding.subject]);
                subjects.map(|&subject| (subject, finding.severity))
            })
            .collect();
        let follows = |finding: &StressFinding| {
            codes.contains(&finding.code)
                && causes.iter().any(|&(subject, severity)| match scope {
                    // What is harmless makes nothing else wrong.
                    ConsequentFindingScope::Scene => severity <= finding.severity,
                    ConsequentFindingScope::Subject => {
                        subject == finding.subject && severity <= finding.severity
                    }
                    ConsequentFindingScope::Image => {
                        reads_image(scene_facts, finding.subject, subject)
                    }
                })
        };
        findings.retain(|finding| !follows(finding));
    }
    findings
}

/// Returns whether a material reads an image. For any other `reader`, returns whether the sky or
/// any material in use reads it.
fn reads_image(
    scene_facts: &SceneFacts<'_>,
    reader: FindingSubject,
    image: FindingSubject,
) -> bool {
    let FindingSubject::Image(image) = image else {
        return false;
    };
    let is_it = |name: &str| scene_facts.lookup.images.index_of(name) == Some(image);
    let of_material = |index: usize| {
        scene_facts.scene.materials[index]
            .textures()
            .filter_map(|reference| scene_facts.lookup.texture(&reference.name))
            .any(|texture| is_it(&texture.image))
    };
    match reader {
        FindingSubject::Material(index) => of_material(index),
        _ => {
            let in_sky = matches!(&scene_facts.scene.sky, Some(Sky::Map(map)) if is_it(&map.image));
            in_sky
                || scene_facts
                    .used_materials()
                    .iter()
                    .any(|(index, _)| of_material(*index))
        }
    }
}
