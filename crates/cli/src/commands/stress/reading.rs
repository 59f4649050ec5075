//! Findings about parts of a file that the reader left out or replaced.

use raywright_core::scene::Image;
use raywright_core::stress::{
    FindingCode, FindingSubject, Severity, StressFinding, StressSummary, is_uniform_image,
};
use raywright_io::{LoadedScene, Warning, WarningCode};

/// Adds findings about parts that the reader left out. They are missing in the scene, so that no
/// check can find them.
pub(super) fn add_reader_findings(report: &mut StressSummary, loaded: &LoadedScene) {
    let warnings = &loaded.warnings;
    // The file is named in front of all findings.
    let own = format!("{}: ", loaded.source.name);
    let message = |warning: &Warning| {
        let message = &warning.message;
        message.strip_prefix(&own).unwrap_or(message).to_owned()
    };
    add_dropped_triangles(report, warnings, &message);
    add_replaced_numbers(report, warnings, &message);

    for (about, code, remedy) in [
        (
            WarningCode::TextureCoordinates,
            FindingCode::NoTextureCoordinates,
            "export the mesh with these texture coordinates, or remove the image from the material",
        ),
        (
            WarningCode::Picture,
            FindingCode::MissingImage,
            "put a readable image at the path that the file names",
        ),
    ] {
        let is_told = report.findings.iter().any(|found| found.code == code);
        let is_needless =
            about == WarningCode::TextureCoordinates && all_images_are_uniform(loaded);
        if is_told || is_needless {
            continue;
        }
        let of_code = warnings.iter().filter(|warning| warning.code == about);
        let finding = |warning: &Warning| {
            let (severity, reason) = (Severity::PictureWrong, message(warning));
            StressFinding::new(code, severity, FindingSubject::Scene, reason, remedy)
        };
        report.findings.extend(of_code.map(finding));
    }
    report
        .findings
        .sort_by_key(|found| (found.severity, found.code));
}

/// Returns whether the scene has images and each has a single colour. They look the same with any
/// texture coordinates.
fn all_images_are_uniform(loaded: &LoadedScene) -> bool {
    let images = &loaded.scene.images;
    let is_uniform = |image: &Image| image.data.as_deref().is_some_and(is_uniform_image);
    !images.is_empty() && images.iter().all(is_uniform)
}

/// Adds findings about triangles that the reader left out. If the scene has no other object, they
/// become the reason of the finding about the empty scene.
fn add_dropped_triangles(
    report: &mut StressSummary,
    warnings: &[Warning],
    message: &impl Fn(&Warning) -> String,
) {
    let dropped = warnings.iter().filter(|warning| warning.triangles > 0);
    let remedy = "give the mesh finite vertices, at most 1e15 metres from the origin";
    let is_empty = |found: &&mut StressFinding| {
        found.code == FindingCode::NothingSeen && found.subject == FindingSubject::Scene
    };
    let mut nothing_seen = report.findings.iter_mut().find(is_empty);
    let mut findings = Vec::new();
    for warning in dropped {
        let (count, reason) = (warning.triangles, message(warning));
        match &mut nothing_seen {
            Some(found) if found.remedy == remedy => found.reason += &format!("; {reason}"),
            Some(found) => {
                found.reason = format!("the scene has no object: {reason}");
                found.remedy = remedy.to_owned();
            }
            None => {
                let (code, severity) = (FindingCode::DroppedTriangles, Severity::PictureWrong);
                let finding =
                    StressFinding::new(code, severity, FindingSubject::Scene, reason, remedy);
                findings.push(finding.with_count(count, 0, "triangles", "missing in the picture"));
            }
        }
    }
    report.findings.extend(findings);
}

/// Adds a finding about numbers out of range, which the reader replaced.
fn add_replaced_numbers(
    report: &mut StressSummary,
    warnings: &[Warning],
    message: &impl Fn(&Warning) -> String,
) {
    let mut replaced = warnings
        .iter()
        .filter(|warning| warning.code == WarningCode::Range);
    let Some(first) = replaced.next() else {
        return;
    };
    let count = 1 + replaced.count() as u64;
    let more = match count {
        1 => String::new(),
        _ => format!(", and {} more such", count - 1),
    };
    let reason = format!("{}{more}", message(first));
    let remedy =
        "change the number in the file to a value in the allowed range; -v lists all such numbers";
    let (code, severity) = (FindingCode::ValuesOutOfRange, Severity::Harmless);
    let finding = StressFinding::new(code, severity, FindingSubject::Scene, reason, remedy);
    report
        .findings
        .push(finding.with_count(count, 0, "numbers", "had to be replaced"));
}
