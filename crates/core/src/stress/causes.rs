//! Each cause is told once: what follows from another finding is left out.

use super::facts::SceneFacts;
use super::finding::{Code, Finding, Severity, Subject};
use crate::scene::Sky;

/// What of a finding has to be the same in another one that follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    /// Nothing: it follows wherever it is.
    Scene,
    /// The subject.
    Subject,
    /// The image, which the material of the other one reads, or the sky.
    Image,
}

/// Causes with what follows from them.
const CONSEQUENCES: [(Code, Scope, &[Code]); 9] = [
    (Code::EnergyMade, Scope::Scene, &[Code::BrighterThanLights]),
    (
        Code::LightByChance,
        Scope::Scene,
        &[Code::BrighterThanLights],
    ),
    (
        Code::LightByChance,
        Scope::Subject,
        &[Code::UnreachedLight, Code::LampBelowPixel],
    ),
    (
        Code::ValuesNotNumbers,
        Scope::Scene,
        &[Code::SamplesNotFinite, Code::BlackPicture],
    ),
    (
        Code::ImageNotLight,
        Scope::Image,
        &[
            Code::ValuesNotNumbers,
            Code::SamplesNotFinite,
            Code::BlackPicture,
            Code::EnergyMade,
        ],
    ),
    (Code::CameraInBody, Scope::Subject, &[Code::BlackPicture]),
    (Code::SceneBelowPixel, Scope::Subject, &[Code::NothingSeen]),
    (
        Code::UnresolvedObject,
        Scope::Subject,
        &[Code::LostTriangles],
    ),
    (
        Code::LightMissesScene,
        Scope::Subject,
        &[Code::UnreachedLight],
    ),
];

/// The findings without those that follow from others among them.
pub(super) fn without_consequences(
    facts: &SceneFacts<'_>,
    mut findings: Vec<Finding>,
) -> Vec<Finding> {
    for (cause, scope, codes) in CONSEQUENCES {
        let causes: Vec<(Subject, Severity)> = findings
            .iter()
            .filter(|found| found.code == cause)
            .map(|found| (found.subject, found.severity))
            .collect();
        let follows = |found: &Finding| {
            codes.contains(&found.code)
                && causes.iter().any(|&(subject, severity)| match scope {
                    Scope::Scene => true,
                    // What is harmless makes nothing else wrong.
                    Scope::Subject => subject == found.subject && severity <= found.severity,
                    Scope::Image => reads(facts, found.subject, subject),
                })
        };
        findings.retain(|found| !follows(found));
    }
    findings
}

/// Whether a material reads an image; of the scene and its cameras whether the sky or any material
/// does.
fn reads(facts: &SceneFacts<'_>, reader: Subject, image: Subject) -> bool {
    let Subject::Image(image) = image else {
        return false;
    };
    let is_it = |name: &str| facts.lookup.images.get(name) == Some(image);
    let of_material = |index: usize| {
        facts.scene.materials[index]
            .textures()
            .filter_map(|reference| facts.lookup.texture(&reference.name))
            .any(|texture| is_it(&texture.image))
    };
    match reader {
        Subject::Material(index) => of_material(index),
        _ => {
            let in_sky = matches!(&facts.scene.sky, Some(Sky::Map(map)) if is_it(&map.image));
            in_sky
                || facts
                    .used_materials()
                    .iter()
                    .any(|(index, _)| of_material(*index))
        }
    }
}
