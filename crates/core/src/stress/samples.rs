//! Findings from a small picture of each camera: samples that are not finite, rays that were cut
//! short, and lights that were not reached.

use std::collections::BTreeSet;

use super::chance::LightByChanceNoise;
use super::facts::{SceneFacts, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::light_survey::LightSurvey;
use super::small_render::SmallRender;
use super::{light_reach, lights};
use crate::counters::SampleLoss;
use crate::prepare::UnreachedLight;
use crate::scene::Triple;
use crate::settings::Settings;

/// Returns the findings about the samples of all cameras.
pub(super) fn check_samples(
    scene_facts: &SceneFacts<'_>,
    pictures: &[SmallRender],
    survey: &LightSurvey,
    settings: &Settings,
) -> Vec<StressFinding> {
    let (size, sampling) = (settings.size, settings.sampling);
    let mut findings: Vec<StressFinding> = pictures
        .iter()
        .flat_map(|picture| sample_loss_findings(picture, size))
        .collect();
    if let Some(brightest) = lights::max_emitted_radiance(scene_facts) {
        findings.extend(
            pictures
                .iter()
                .filter_map(|picture| brightness_finding(picture, brightest, size)),
        );
    }
    let by_chance = LightByChanceNoise {
        scene_facts,
        survey,
        samples_per_pixel: sampling.samples_per_pixel(),
    };
    findings.extend(unreached_light_findings(scene_facts, survey, pictures));
    let mut of_lamps = by_chance.check_enclosed_lamps(pictures);
    of_lamps.extend(by_chance.check_uneven_lamps(pictures));
    let of_picture = |picture| {
        by_chance
            .check_picture(picture)
            .filter(|_| of_lamps.is_empty())
    };
    findings.extend(pictures.iter().filter_map(of_picture));
    findings.extend(of_lamps);
    findings
}

fn sample_loss_findings(picture: &SmallRender, size: [u32; 2]) -> Vec<StressFinding> {
    let fewest = |layer: &[f32]| {
        layer
            .iter()
            .enumerate()
            .min_by(|a, b| a.1.total_cmp(b.1))
            .map(|(pixel, _)| pixel)
    };
    // Where time ended it, pixels lack samples for that too.
    let layer = picture
        .picture
        .layer("samples.N")
        .filter(|_| !picture.run.is_cut_short());
    let at = layer.and_then(|layer| fewest(&layer.samples));
    // A pixel without an object shows the sky.
    let objects = picture.picture.layer("object.id");
    let is_sky = at.is_some_and(|at| objects.is_some_and(|layer| layer.samples[at] < 0.0));
    let subject = if is_sky {
        FindingSubject::Sky
    } else {
        FindingSubject::Scene
    };
    let finding = |loss| {
        match loss {
        SampleLoss::NotFinite { dropped, of: total } => StressFinding {
            pixel: at.and_then(|pixel| picture.full_size_position(pixel, size)),
            ..StressFinding::new(
                FindingCode::SamplesNotFinite,
                Severity::PictureWrong,
                subject,
                "samples are not finite numbers and are dropped, so that their pixels are wrong",
                "look for numbers in materials, lights and sky that are too large or undefined, or render with --precision reference",
            )
            .with_count(dropped, total, "samples", "had to be dropped")
        },
        SampleLoss::CutShort { rays, most: maximum } => StressFinding::new(
            FindingCode::RaysCutShort,
            Severity::PictureWrong,
            FindingSubject::Scene,
            format!("rays end after {maximum} surfaces that are cut out or partly transparent, so that objects behind these surfaces are missing"),
            "place fewer such surfaces behind each other",
        )
        .with_count(rays, 0, "rays", "ended there"),
    }
    };
    picture.counters.sample_losses().map(finding).collect()
}

fn brightness_finding(
    picture: &SmallRender,
    brightest: f64,
    size: [u32; 2],
) -> Option<StressFinding> {
    // A few samples of a surface that is right may well be as bright as four lights together.
    let is_beyond = |pixel: [f32; 3]| {
        pixel
            .iter()
            .any(|&channel| f64::from(channel) > 4.0 * brightest)
    };
    let first = picture.first_pixel_where(is_beyond)?;
    let count = picture
        .picture
        .rgb
        .iter()
        .filter(|&&pixel| is_beyond(pixel))
        .count();
    let reason = "pixels are over four times as bright as the brightest light of the scene, which is noise: paths find light there too rarely";
    let remedy = "render with more --spp, or with --clamp for less noise and less light";
    let finding = StressFinding::new(
        FindingCode::BrighterThanLights,
        Severity::SlowOrNoisy,
        FindingSubject::Scene,
        reason,
        remedy,
    );
    let total = picture.picture.rgb.len() as u64;
    let finding = finding.with_count(count as u64, total, "pixels", "are that bright");
    Some(StressFinding {
        pixel: picture.full_size_position(first, size),
        ..finding
    })
}

/// Returns whether another check reports an unreached light: a lamp without area or in glass, or a
/// light behind glass.
fn is_reported_by_light_checks(
    scene_facts: &SceneFacts<'_>,
    survey: &LightSurvey,
    subject: FindingSubject,
) -> bool {
    match subject {
        FindingSubject::Object(index) => {
            let mut own = survey.lamps_of_object(index).iter();
            own.any(|lamp| {
                let has_no_size = light_reach::sizeless_lamp_finding(scene_facts, lamp).is_some();
                has_no_size || lamp.glass.is_some() && lamp.walks.unseen_walks().is_none()
            })
        }
        FindingSubject::Light(index) => {
            let reach = survey.lights.get(index);
            reach.is_some_and(light_reach::is_behind_glass)
        }
        _ => false,
    }
}

fn light_subject_position(scene_facts: &SceneFacts<'_>, subject: FindingSubject) -> Option<Triple> {
    match subject {
        FindingSubject::Light(index) => {
            light_reach::light_position(&scene_facts.scene.lights[index].kind)
        }
        _ => {
            let bounds = scene_facts.objects[subject.list_index()].bounds;
            bounds.and_then(|bounds| finite_point(bounds.centre()))
        }
    }
}

/// Returns the lights that reach no visible surface, each with the number of rays that show it: the
/// shadow rays of the pictures, or else the walks from the light.
fn unreached_lights(
    scene_facts: &SceneFacts<'_>,
    survey: &LightSurvey,
    pictures: &[SmallRender],
) -> Vec<(FindingSubject, u64, &'static str)> {
    const BLOCKED: &str = "towards it were blocked";
    const UNSEEN: &str = "from the light reached no visible surface";
    let subject_of = |unreached_light: &UnreachedLight| match *unreached_light {
        UnreachedLight::Light { index, rays } => (FindingSubject::Light(index), rays, BLOCKED),
        UnreachedLight::Object { index, rays } => {
            let object = scene_facts.facts_index(index as u32);
            (FindingSubject::Object(object), rays, BLOCKED)
        }
    };
    let Some((first, others)) = pictures.split_first() else {
        return Vec::new();
    };
    let unreached = |picture: &SmallRender| -> BTreeSet<FindingSubject> {
        let lights = picture.unreached_lights.iter().map(subject_of);
        lights.map(|(subject, ..)| subject).collect()
    };
    let of_others: Vec<_> = others.iter().map(unreached).collect();
    let everywhere = |(subject, ..): &(FindingSubject, u64, &str)| {
        of_others.iter().all(|subjects| subjects.contains(subject))
    };
    let by_picture = first.unreached_lights.iter().map(subject_of);
    let mut found: Vec<_> = by_picture.filter(everywhere).collect();
    let mut subjects: BTreeSet<_> = found.iter().map(|(subject, ..)| *subject).collect();
    let lights = survey.lights.iter().enumerate();
    let lights = lights.map(|(index, light)| (FindingSubject::Light(index), light.walks));
    let lamps = survey.lamps.iter();
    let lamps = lamps.map(|lamp| (FindingSubject::Object(lamp.object), lamp.walks));
    for (subject, walks) in lights.chain(lamps) {
        let Some(count) = walks.unseen_walks() else {
            continue;
        };
        if subjects.insert(subject) {
            found.push((subject, count, UNSEEN));
        }
    }
    found
}

/// Returns findings about lights that reach no visible surface of any camera.
fn unreached_light_findings(
    scene_facts: &SceneFacts<'_>,
    survey: &LightSurvey,
    pictures: &[SmallRender],
) -> Vec<StressFinding> {
    let finding = |(subject, rays, predicate): (FindingSubject, u64, &'static str)| {
        if is_reported_by_light_checks(scene_facts, survey, subject) {
            return None;
        }
        let reason = "this light reaches no visible surface: it is blocked, or turned away from all visible surfaces";
        let remedy = "open or remove the object that blocks the light, or remove the light, which only adds noise";
        // Of a generator's lamps some may well be hidden.
        let is_one = subject.list_index() < scene_facts.scene.objects.len()
            || matches!(subject, FindingSubject::Light(_));
        let (code, severity) = (FindingCode::UnreachedLight, Severity::SlowOrNoisy);
        let finding = || {
            StressFinding::new(code, severity, subject, reason, remedy)
                .with_count(rays, rays, "rays", predicate)
                .with_place(light_subject_position(scene_facts, subject))
        };
        is_one.then(finding)
    };
    let unreached = unreached_lights(scene_facts, survey, pictures);
    unreached.into_iter().filter_map(finding).collect()
}
