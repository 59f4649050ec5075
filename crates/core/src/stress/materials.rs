//! Materials: values that are none, energy, glass and what it absorbs.

use super::facts::{Matter, SceneFacts, place};
use super::finding::{Code, Finding, Severity, Subject, decimal};
use super::furnace::FurnaceResult;
use super::ray_survey::RaySurvey;
use crate::scene::{AlphaMode, Model};
use crate::settings::Settings;

/// A body that is this many times its distance of absorption across is black, and one so many times
/// thinner is clear.
const BLACK: f64 = 1e3;
const CLEAR: f64 = 1e-5;

/// What is wrong with the materials that objects show.
pub(super) fn check(
    facts: &SceneFacts<'_>,
    settings: &Settings,
    seen: &RaySurvey,
    furnaces: &[FurnaceResult],
) -> Vec<Finding> {
    let mut found = Vec::new();
    for (&(material, key), sighting) in &seen.not_numbers {
        let why = format!(
            "its `{key}` is no finite number in places: an expression or an image gives none there"
        );
        let finding = Finding::new(
            Code::ValuesNotNumbers,
            Severity::PictureWrong,
            Subject::Material(material),
            why,
            "look for a division by zero, a root or logarithm of what is negative, and for numbers that are too large",
        );
        found.push(
            finding
                .counted(
                    sighting.count,
                    seen.hits,
                    "rays",
                    "that met anything saw it so",
                )
                .at(place(sighting.place)),
        );
    }
    let makes_energy = |material: usize| {
        furnaces
            .iter()
            .any(|furnace| furnace.material == material && furnace.makes_energy())
    };
    for (key, sighting) in seen
        .out_of_range
        .iter()
        .filter(|((material, _), _)| !makes_energy(*material))
    {
        let &(material, name) = key;
        let greatest = seen.greatest.get(key).copied().unwrap_or(1.0);
        let why = format!("its `{name}` is up to {greatest:.3}, and its range ends at 1");
        let finding = Finding::new(
            Code::ValuesOutOfRange,
            Severity::Harmless,
            Subject::Material(material),
            why,
            "bring it into 0 to 1; an expression by `clamp`",
        );
        found.push(
            finding
                .counted(
                    sighting.count,
                    seen.hits,
                    "rays",
                    "that met anything saw it so",
                )
                .at(place(sighting.place)),
        );
    }
    found.extend(
        furnaces
            .iter()
            .filter(|furnace| furnace.makes_energy())
            .map(|furnace| energy(furnace, seen)),
    );
    found.extend(invisible(facts));
    found.extend(absorption(facts));
    found.extend(shallow(facts, settings.max_depth));
    found
}

fn energy(furnace: &FurnaceResult, seen: &RaySurvey) -> Finding {
    let (sent_back, material) = (furnace.sent_back, furnace.material);
    let beyond = seen.greatest.iter().filter(|((of, _), _)| *of == material);
    let values: Vec<String> = beyond
        .map(|((_, key), value)| format!("`{key}` is up to {value:.3}"))
        .collect();
    let values = match values.is_empty() {
        true => String::new(),
        false => format!(" ({})", values.join(", ")),
    };
    let why = format!(
        "under even light it sends back {sent_back:.3} times what it gets{values}: it glows, and between two of it light has no end"
    );
    let remedy = "bring its colours, weights and factors to 1 at most";
    let severity = Severity::PictureWrong;
    let subject = Subject::Material(material);
    let finding = Finding::new(Code::EnergyMade, severity, subject, why, remedy);
    let sighting = seen
        .out_of_range
        .iter()
        .find(|((of, _), _)| *of == material);
    finding.at(sighting.and_then(|(_, sighting)| place(sighting.place)))
}

/// Glass through which no path has segments to come.
fn shallow(facts: &SceneFacts<'_>, deepest: u32) -> Option<Finding> {
    let own = facts
        .objects
        .iter()
        .find(|own| own.matter == Matter::Body && deepest < 3)?;
    let why =
        format!("paths have {deepest} segments at most, and the way through glass takes three");
    let remedy = "raise `render.max_depth` or --max-depth to 8";
    Some(Finding::new(
        Code::DepthBelowGlass,
        Severity::PictureWrong,
        own.subject,
        why,
        remedy,
    ))
}

/// Objects that are nowhere there.
fn invisible(facts: &SceneFacts<'_>) -> Vec<Finding> {
    let is_absent = |model: &Model| match model {
        Model::Physical(m) => {
            let opacity = m.opacity.constant();
            match m.alpha {
                AlphaMode::Opaque => false,
                AlphaMode::Blend => opacity == Some(0.0),
                AlphaMode::Mask { cutoff } => {
                    cutoff > 1.0 || opacity.is_some_and(|opacity| opacity < cutoff)
                }
            }
        }
        Model::Classic(_) => false,
    };
    let finding = |own: &super::facts::ObjectFacts<'_>| {
        let (_, material) = own.material?;
        let why = "its opacity leaves nothing of it";
        let remedy = "raise `opacity`, lower the cutoff of `alpha`, or take the object away";
        is_absent(&material.model).then(|| {
            Finding::new(
                Code::InvisibleObject,
                Severity::Harmless,
                own.subject,
                why,
                remedy,
            )
        })
    };
    facts.objects.iter().filter_map(finding).collect()
}

/// Bodies that let nothing through, or absorb nothing.
fn absorption(facts: &SceneFacts<'_>) -> Vec<Finding> {
    let size = facts.diagonal();
    let finding = |(index, material): (usize, &crate::scene::Material)| {
        let Model::Physical(m) = &material.model else {
            return None;
        };
        let greatest = m
            .absorption()?
            .into_iter()
            .filter(|a| a.is_finite())
            .fold(0.0_f64, f64::max);
        let depth = greatest * size;
        let why = match depth {
            _ if depth > BLACK * 10.0 => format!(
                "light is absorbed within {} metres, and the scene is {} metres across, so that the body is black",
                decimal(1.0 / greatest),
                decimal(size)
            ),
            _ if depth < CLEAR => format!(
                "light is absorbed over {} metres, and the scene is {} metres across, so that the body is clear",
                decimal(1.0 / greatest),
                decimal(size)
            ),
            _ => return None,
        };
        let remedy = "give `attenuation_distance` in metres, about as large as the body";
        Some(Finding::new(
            Code::AbsorptionOutOfScale,
            Severity::Harmless,
            Subject::Material(index),
            why,
            remedy,
        ))
    };
    facts
        .used_materials()
        .into_iter()
        .filter_map(finding)
        .collect()
}
