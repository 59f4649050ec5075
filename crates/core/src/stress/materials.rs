//! Findings about materials: invalid values, more reflected than received light, invisible objects,
//! glass and its absorption.

use super::depth_loss::FEWEST_SEGMENTS;
use super::facts::{SceneFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::furnace::FurnaceAlbedo;
use super::numbers::format_metres;
use super::ray_survey::RaySurvey;
use crate::scene::{AlphaMode, MaterialModel};
use crate::settings::Settings;

/// Limits on lengths, in units of the distance over which light is absorbed to 1/e. A body is
/// black if the scene's size in units of the shortest distance of the three channels is above
/// `BLACK`, or if the body's thickness in units of the longest distance is above `BLACK_BODY`. It is
/// clear if its own greatest edge in units of the shortest distance is below `CLEAR`.
const BLACK: f64 = 1e4;
const BLACK_BODY: f64 = 20.0;
const CLEAR: f64 = 1e-3;

/// Returns the findings about the materials in use.
pub(super) fn check_materials(
    scene_facts: &SceneFacts<'_>,
    settings: &Settings,
    survey: &RaySurvey,
    furnaces: &[FurnaceAlbedo],
) -> Vec<StressFinding> {
    let mut findings = value_findings(survey, furnaces);
    findings.extend(
        furnaces
            .iter()
            .filter(|furnace| furnace.creates_energy())
            .map(|furnace| energy_finding(furnace, survey)),
    );
    findings.extend(invisible_object_findings(scene_facts));
    findings.extend(absorption_findings(scene_facts));
    findings.extend(depth_limit_finding(scene_facts, settings.max_depth));
    findings
}

/// Returns findings about values that are not finite numbers, and about values out of range. The
/// latter are left out for materials that fail the furnace test.
fn value_findings(survey: &RaySurvey, furnaces: &[FurnaceAlbedo]) -> Vec<StressFinding> {
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
    let makes_energy = |material: usize| {
        furnaces
            .iter()
            .any(|furnace| furnace.material == material && furnace.creates_energy())
    };
    for (key, sighting) in survey
        .out_of_range
        .iter()
        .filter(|((material, _), _)| !makes_energy(*material))
    {
        let &(material, name) = key;
        let greatest = survey.greatest_values.get(key).copied().unwrap_or(1.0);
        let reason = format!("its `{name}` is up to {greatest:.3}, but must not exceed 1");
        let finding = StressFinding::new(
            FindingCode::ValuesOutOfRange,
            Severity::Harmless,
            FindingSubject::Material(material),
            reason,
            "keep the value between 0 and 1, in an expression with `clamp`",
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
    let beyond = survey
        .greatest_values
        .iter()
        .filter(|((of, _), _)| *of == material);
    let values: Vec<String> = beyond
        .map(|((_, key), value)| format!("`{key}` is up to {value:.3}"))
        .collect();
    let values = match values.is_empty() {
        true => String::new(),
        false => format!(" ({})", values.join(", ")),
    };
    let reason = format!(
        "under even light it reflects {sent_back:.3} times the light that it receives{values}: it glows, and between two such surfaces light grows without end"
    );
    let remedy = "reduce its colours, weights and factors to at most 1";
    let severity = Severity::PictureWrong;
    let subject = FindingSubject::Material(material);
    let finding = StressFinding::new(FindingCode::EnergyMade, severity, subject, reason, remedy);
    let sighting = survey
        .out_of_range
        .iter()
        .find(|((of, _), _)| *of == material);
    finding.with_place(sighting.and_then(|(_, sighting)| finite_point(sighting.position)))
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

/// Returns findings about objects whose opacity makes them invisible.
fn invisible_object_findings(scene_facts: &SceneFacts<'_>) -> Vec<StressFinding> {
    let is_absent = |model: &MaterialModel| match model {
        MaterialModel::Physical(m) => {
            let opacity = m.opacity.constant();
            match m.alpha {
                AlphaMode::Opaque => false,
                AlphaMode::Blend => opacity == Some(0.0),
                AlphaMode::Mask { cutoff } => {
                    cutoff > 1.0 || opacity.is_some_and(|opacity| opacity < cutoff)
                }
            }
        }
        MaterialModel::Classic(_) => false,
    };
    let finding = |object_facts: &super::facts::ObjectFacts<'_>| {
        let (_, material) = object_facts.material?;
        let (reason, remedy) = match &material.model {
            MaterialModel::Physical(m) if matches!(m.alpha, AlphaMode::Mask { .. }) => (
                "the `opacity` of its material is below the `cutoff` of its `alpha` everywhere, so that nothing of it is seen",
                "raise `opacity` or lower the `cutoff` of `alpha` in its material, or remove the object",
            ),
            _ => (
                "the `opacity` of its material makes it fully transparent",
                "raise `opacity` in its material, or remove the object",
            ),
        };
        is_absent(&material.model).then(|| {
            StressFinding::new(
                FindingCode::InvisibleObject,
                Severity::Harmless,
                object_facts.subject,
                reason,
                remedy,
            )
        })
    };
    scene_facts.objects.iter().filter_map(finding).collect()
}

/// Returns the shortest and the longest edge of the bounding boxes of a material's bodies, in metres.
/// An unbounded body has the edges 0 and infinity.
fn body_edges(scene_facts: &SceneFacts<'_>, material: usize) -> [f64; 2] {
    let objects = scene_facts.objects.iter();
    let own = objects.filter(|object| object.material.is_some_and(|(index, _)| index == material));
    let edges = own.map(|object| match object.bounds {
        None => [0.0, f64::INFINITY],
        Some(bounds) => [bounds.extent().min_element(), bounds.extent().max_element()],
    });
    edges
        .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
        .unwrap_or([0.0, f64::INFINITY])
}

/// Returns findings about bodies that absorb all light at once, or hardly any.
fn absorption_findings(scene_facts: &SceneFacts<'_>) -> Vec<StressFinding> {
    let size = scene_facts.largest_extent();
    let finding = |(index, material): (usize, &crate::scene::Material)| {
        let MaterialModel::Physical(m) = &material.model else {
            return None;
        };
        let absorption = m.absorption()?;
        let finite = || absorption.into_iter().filter(|a| a.is_finite());
        let greatest = finite().fold(0.0_f64, f64::max);
        let least = finite().fold(f64::INFINITY, f64::min);
        finite().next()?;
        let depth = greatest * size;
        let [thickness, widest] = body_edges(scene_facts, index);
        let reason = match depth {
            _ if least * thickness > BLACK_BODY => format!(
                "it absorbs light of every colour within {}, while its bodies are {} thick or more, so that they look black",
                format_metres(1.0 / least),
                format_metres(thickness)
            ),
            _ if depth > BLACK => format!(
                "it absorbs light within {}, while the scene is {} wide, so that bodies of this material look black",
                format_metres(1.0 / greatest),
                format_metres(size)
            ),
            _ if greatest * widest < CLEAR => format!(
                "it absorbs light only over {}, while its bodies are {} wide or less, so that they look clear",
                format_metres(1.0 / greatest),
                format_metres(widest)
            ),
            _ => return None,
        };
        let remedy = "set `attenuation_distance` in metres, about as large as the body";
        Some(StressFinding::new(
            FindingCode::AbsorptionOutOfScale,
            Severity::Harmless,
            FindingSubject::Material(index),
            reason,
            remedy,
        ))
    };
    scene_facts
        .used_materials()
        .into_iter()
        .filter_map(finding)
        .collect()
}
