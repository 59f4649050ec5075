//! Each cause is told once: what follows from another finding is left out.

use super::facts::SceneFacts;
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use crate::scene::Sky;

/// What of a finding has to be the same in another one that follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ConsequentFindingScope {
    /// Nothing: it follows wherever it is.
    Scene,
    /// The subject.
    Subject,
    /// The image, which the material of the other one reads, or the sky.
    Image,
}

/// Causes with what follows from them.
const CONSEQUENCES: [(FindingCode, ConsequentFindingScope, &[FindingCode]); 12] = [
    (
        FindingCode::LightBehindGlass,
        ConsequentFindingScope::Scene,
        &[FindingCode::BlackPicture],
    ),
    (
        FindingCode::StrayVertices,
        ConsequentFindingScope::Scene,
        &[FindingCode::ExtremeScale],
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
        FindingCode::UnresolvedObject,
        ConsequentFindingScope::Subject,
        &[FindingCode::LostTriangles],
    ),
    (
        FindingCode::LightMissesScene,
        ConsequentFindingScope::Subject,
        &[FindingCode::UnreachedLight],
    ),
];

/// The findings without those that follow from others among them.
pub(super) fn remove_consequent_findings(
    scene_facts: &SceneFacts<'_>,
    mut findings: Vec<StressFinding>,
) -> Vec<StressFinding> {
    for (cause, scope, codes) in CONSEQUENCES {
        let causes: Vec<(FindingSubject, Severity)> = findings
            .iter()
            .filter(|finding| finding.code == cause)
            .map(|finding| (finding.subject, finding.severity))
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

/// Whether a material reads an image; of the scene and its cameras whether the sky or any material
/// does.
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
