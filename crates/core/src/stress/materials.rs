//! Findings about materials: values that are not numbers, more reflected than received light, and
//! glass.

use super::depth_loss::FEWEST_SEGMENTS;
use super::facts::{SceneFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::furnace::FurnaceAlbedo;
use super::ray_survey::RaySurvey;
use crate::settings::Settings;

/// Returns the findings about the materials in use.
pub(super) fn check_materials(
    scene_facts: &SceneFacts<'_>,
    settings: &Settings,
    survey: &RaySurvey,
    furnaces: &[FurnaceAlbedo],
) -> Vec<StressFinding> {
    let mut findings = not_number_findings(survey);
    findings.extend(
        furnaces
            .iter()
            .filter(|furnace| furnace.creates_energy())
            .map(|furnace| energy_finding(furnace, survey)),
    );
    findings.extend(depth_limit_finding(scene_facts, settings.max_depth));
    findings
}

/// Returns findings about values that are not finite numbers.
fn not_number_findings(survey: &RaySurvey) -> Vec<StressFinding> {
    let mut findings = Vec::new();
    for (&(material, key), sighting) in &survey.not_numbers {
        let reason = format!(
            "its `{key}` is NaN or infinite at some points of the surface, where its expression or image gives such a value"
        );
        let finding = StressFinding::new(
            FindingCode::ValuesNotNumbers,
            Severity::PictureWrong,
            FindingSubject::Material(material),
            reason,
            "look for a division by zero, a root or logarithm of a negative number, and for numbers that are too large",
        );
        findings.push(
            finding
                .with_count(
                    sighting.count,
                    survey.hits,
                    "rays",
                    "that hit an object found such a value",
                )
                .with_place(finite_point(sighting.position)),
        );
    }
    findings
}

fn energy_finding(furnace: &FurnaceAlbedo, survey: &RaySurvey) -> StressFinding {
    let (sent_back, material) = (furnace.albedo, furnace.material);
    let values = survey.greatest_colours.get(&material);
    let values = values.map_or(String::new(), |greatest| {
        format!(" (`base_colour` is up to {greatest:.3})")
    });
    let reason = format!(
        "under even light it reflects {sent_back:.3} times the light that it receives{values}: it glows, and between two such surfaces light grows without end"
    );
    let remedy = "reduce its colours, weights and factors to at most 1";
    let severity = Severity::PictureWrong;
    let subject = FindingSubject::Material(material);
    let finding = StressFinding::new(FindingCode::EnergyMade, severity, subject, reason, remedy);
    let sighting = survey.colours_above_one.get(&material);
    finding.with_place(sighting.and_then(|sighting| finite_point(sighting.position)))
}

/// Returns a finding if the scene has glass and its paths have fewer than three segments.
fn depth_limit_finding(scene_facts: &SceneFacts<'_>, deepest: u32) -> Option<StressFinding> {
    let object_facts = scene_facts.objects.iter().find(|object_facts| {
        object_facts.surface_kind == SurfaceKind::Body && deepest < FEWEST_SEGMENTS
    })?;
    let reason =
        format!("paths have at most {deepest} segments, but a path through glass needs three");
    let remedy = "raise `render.max_depth` to 8, or render with --max-depth 8";
    Some(StressFinding::new(
        FindingCode::DepthBelowGlass,
        Severity::PictureWrong,
        object_facts.subject,
        reason,
        remedy,
    ))
}
