//! A small picture of each camera: samples that are no numbers, rays that were cut short, what is
//! black, and lights that were not found.

use super::facts::{SceneFacts, scene_point};
use super::finding::{CheckRun, FindingCode, FindingSubject, Severity, StressFinding, decimal};
use super::{RayDeadline, lamps};
use crate::counters::{Counters, SampleLoss};
use crate::dispatch::ReadyScene;
use crate::picture::Picture;
use crate::prepare::UnreachedLight;

/// What a small picture of a camera showed.
pub(super) struct SmallPicture {
    pub camera: usize,
    pub picture: Picture,
    pub counters: Counters,
    pub shut_away: Vec<UnreachedLight>,
    pub run: CheckRun,
}

impl SmallPicture {
    /// Renders it, as far as there is time.
    pub fn of(ready: &ReadyScene, camera: usize, deadline: &RayDeadline<'_>) -> Self {
        let mut film = ready.film("");
        let part = film.whole_part();
        let pixels = u64::from(film.size()[0]) * u64::from(film.size()[1]);
        let planned = pixels * u64::from(ready.settings().sampling.count());
        // The film is its own, so that it can't be refused.
        let _ = ready.render_part(&mut film, &part, deadline);
        let (shut_away, counters) = (ready.shut_away(&film), film.counters());
        let looked_at = if film.unfinished() == 0 {
            planned
        } else {
            counters.samples + counters.dropped
        };
        let run = CheckRun {
            name: "samples",
            looked_at,
            unit: "samples",
            planned,
        };
        Self {
            camera,
            picture: film.picture(),
            counters,
            shut_away,
            run,
        }
    }

    /// The middle of a pixel of it as a place of the picture, whose size is another.
    fn full(&self, pixel: usize, size: [u32; 2]) -> Option<([f64; 2], usize)> {
        let (width, height) = (self.picture.width as usize, f64::from(self.picture.height));
        let at = [(pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5];
        Some((
            [
                at[0] / width as f64 * f64::from(size[0]),
                at[1] / height * f64::from(size[1]),
            ],
            self.camera,
        ))
    }

    /// The first pixel of which this holds.
    fn first(&self, holds: impl Fn([f32; 3]) -> bool) -> Option<usize> {
        self.picture.rgb.iter().position(|&pixel| holds(pixel))
    }
}

/// What is wrong with the samples of all cameras.
pub(super) fn check(
    scene_facts: &SceneFacts<'_>,
    pictures: &[SmallPicture],
    size: [u32; 2],
) -> Vec<StressFinding> {
    let mut findings: Vec<StressFinding> = pictures
        .iter()
        .flat_map(|picture| losses(picture, size))
        .collect();
    findings.extend(
        pictures
            .iter()
            .filter_map(|picture| black(scene_facts, picture)),
    );
    if let Some(brightest) = lamps::brightest(scene_facts) {
        findings.extend(
            pictures
                .iter()
                .filter_map(|picture| too_bright(picture, brightest, size)),
        );
    }
    findings.extend(unreached(scene_facts, pictures));
    tell_why_black(scene_facts, &mut findings);
    findings.extend(
        pictures
            .iter()
            .filter_map(|picture| by_chance(scene_facts, picture)),
    );
    findings
}

fn subject(scene_facts: &SceneFacts<'_>, picture: &SmallPicture) -> FindingSubject {
    FindingSubject::Camera((!scene_facts.scene.cameras.is_empty()).then_some(picture.camera))
}

fn losses(picture: &SmallPicture, size: [u32; 2]) -> Vec<StressFinding> {
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
        .filter(|_| !picture.run.is_cut());
    let at = layer.and_then(|layer| fewest(&layer.samples));
    let finding = |loss| {
        match loss {
        SampleLoss::NotFinite { dropped, of: total } => StressFinding {
            pixel: at.and_then(|pixel| picture.full(pixel, size)),
            ..StressFinding::new(
                FindingCode::SamplesNotFinite,
                Severity::PictureWrong,
                FindingSubject::Scene,
                "samples are not finite numbers and are dropped, so that the picture is wrong where they lie",
                "look for numbers that are too large or not defined in materials, lights and sky, or add --precision reference",
            )
            .counted(dropped, total, "samples", "had to be dropped")
        },
        SampleLoss::CutShort { rays, most: maximum } => StressFinding::new(
            FindingCode::RaysCutShort,
            Severity::PictureWrong,
            FindingSubject::Scene,
            format!("rays end after {maximum} surfaces that are absent or there in part, and what lies behind is missing"),
            "leave fewer such surfaces one behind the other",
        )
        .counted(rays, 0, "rays", "ended so"),
    }
    };
    picture.counters.losses().map(finding).collect()
}

fn black(scene_facts: &SceneFacts<'_>, picture: &SmallPicture) -> Option<StressFinding> {
    let is_black = picture
        .first(|pixel| pixel.iter().any(|&channel| channel > 0.0))
        .is_none();
    let subject = subject(scene_facts, picture);
    if picture.counters.hits > 0 && is_black && !picture.run.is_cut() {
        let (reason, remedy) = (
            "everything that is seen is black: no light arrives",
            "add a light or a sky, or open what is in its way",
        );
        return Some(StressFinding::new(
            FindingCode::BlackPicture,
            Severity::PictureWrong,
            subject,
            reason,
            remedy,
        ));
    }
    None
}

fn too_bright(picture: &SmallPicture, brightest: f64, size: [u32; 2]) -> Option<StressFinding> {
    // A few samples of a surface that is right may well be as bright as four lights together.
    let is_beyond = |pixel: [f32; 3]| {
        pixel
            .iter()
            .any(|&channel| f64::from(channel) > 4.0 * brightest)
    };
    let first = picture.first(is_beyond)?;
    let count = picture
        .picture
        .rgb
        .iter()
        .filter(|&&pixel| is_beyond(pixel))
        .count();
    let reason = "pixels are over four times as bright as the brightest light of the scene, which no surface can be: light is found too rarely there";
    let remedy = "take more --spp, or --clamp for less noise and less light";
    let finding = StressFinding::new(
        FindingCode::BrighterThanLights,
        Severity::SlowOrNoisy,
        FindingSubject::Scene,
        reason,
        remedy,
    );
    let total = picture.picture.rgb.len() as u64;
    let finding = finding.counted(count as u64, total, "pixels", "came out that bright");
    Some(StressFinding {
        pixel: picture.full(first, size),
        ..finding
    })
}

/// Where everything is black since lights are shut away, tells that as one.
fn tell_why_black(scene_facts: &SceneFacts<'_>, findings: &mut Vec<StressFinding>) {
    if !findings
        .iter()
        .any(|finding| finding.code == FindingCode::BlackPicture)
    {
        return;
    }
    let is_shut = |finding: &StressFinding| finding.code == FindingCode::UnreachedLight;
    let shut: Vec<String> = findings
        .iter()
        .filter(|finding| is_shut(finding))
        .map(|finding| finding.subject.words(scene_facts.scene))
        .collect();
    let Some(first) = shut.first() else {
        return;
    };
    findings.retain(|finding| !is_shut(finding));
    let lights = match shut.len() {
        1 => format!("{first} is"),
        more => format!("{first} and {} more are", more - 1),
    };
    for black in findings
        .iter_mut()
        .filter(|finding| finding.code == FindingCode::BlackPicture)
    {
        black.reason = format!(
            "everything that is seen is black: {lights} shut away, or turned from all of that"
        );
        black.remedy =
            "open the cover of the light or take it away, or add a light or a sky".to_owned();
    }
}

/// Lights from which nothing arrives in the picture of any camera.
fn unreached(scene_facts: &SceneFacts<'_>, pictures: &[SmallPicture]) -> Vec<StressFinding> {
    let subject_of = |unreached_light: &UnreachedLight| match *unreached_light {
        UnreachedLight::Light { index, .. } => FindingSubject::Light(index),
        UnreachedLight::Object { index, .. } => {
            FindingSubject::Object(scene_facts.index_of(index as u32))
        }
    };
    let in_vain = |unreached_light: &UnreachedLight| match *unreached_light {
        UnreachedLight::Light { rays, .. } | UnreachedLight::Object { rays, .. } => rays,
    };
    let Some((first, others)) = pictures.split_first() else {
        return Vec::new();
    };
    let everywhere = |subject: FindingSubject| {
        others.iter().all(|p| {
            p.shut_away
                .iter()
                .any(|unreached_light| subject_of(unreached_light) == subject)
        })
    };
    let finding = |unreached_light: &UnreachedLight| {
        let subject = subject_of(unreached_light);
        if let FindingSubject::Object(index) = subject
            && let Some(glass) = lamps::glass_around(scene_facts, index)
        {
            return Some(through_glass(scene_facts, index, glass));
        }
        let reason = "it lights nothing that is seen: it is shut away, or turned from all of that";
        let remedy =
            "open its cover or take it away; if it is meant to be hidden, it only costs noise";
        // Of a generator's lamps some may well be hidden.
        let is_one = subject.index() < scene_facts.scene.objects.len()
            || matches!(subject, FindingSubject::Light(_));
        (is_one && everywhere(subject)).then(|| {
            StressFinding::new(
                FindingCode::UnreachedLight,
                Severity::SlowOrNoisy,
                subject,
                reason,
                remedy,
            )
            .counted(
                in_vain(unreached_light),
                in_vain(unreached_light),
                "rays",
                "to it ended on their way",
            )
        })
    };
    first.shut_away.iter().filter_map(finding).collect()
}

/// Light that is found by chance alone, by what it comes from.
fn by_chance(scene_facts: &SceneFacts<'_>, picture: &SmallPicture) -> Option<StressFinding> {
    const ENOUGH: u64 = 1000;
    const RARE: u64 = 1000;
    let Counters { unaided, found, .. } = picture.counters;
    if unaided < ENOUGH || found * RARE > unaided {
        return None;
    }
    let lamps = || {
        scene_facts
            .objects
            .iter()
            .filter(|object_facts| object_facts.emits())
    };
    let within = lamps().find_map(|object_facts| {
        let glass = lamps::glass_around(scene_facts, object_facts.subject.index())?;
        Some((object_facts, glass))
    });
    let finding = if let Some((object_facts, glass)) = within {
        through_glass(scene_facts, object_facts.subject.index(), glass)
    } else if lamps().next().is_some() {
        let reason = "lamps and suns that shine by way of mirrors or glass are met by chance, and hardly any path meets one";
        let remedy = "make them larger, or what they shine through thin (`thin_walled`) or rough; or take more --spp";
        met_by_chance(FindingSubject::Scene, reason, remedy)
    } else {
        let reason = "the sky has a small bright sun, and hardly any path by way of mirrors or glass meets it";
        let remedy = "take more --spp, or a sky with a larger sun or none";
        met_by_chance(FindingSubject::Sky, reason, remedy)
    };
    Some(finding.counted(unaided - found, unaided, "paths", "met no light"))
}

fn met_by_chance(
    subject: FindingSubject,
    reason: impl Into<String>,
    remedy: impl Into<String>,
) -> StressFinding {
    let (code, severity) = (FindingCode::LightByChance, Severity::SlowOrNoisy);
    StressFinding::new(code, severity, subject, reason, remedy)
}

/// A lamp within a body of glass.
fn through_glass(
    scene_facts: &SceneFacts<'_>,
    lamp: usize,
    glass: FindingSubject,
) -> StressFinding {
    let (object_facts, glass) = (&scene_facts.objects[lamp], glass.words(scene_facts.scene));
    let across = object_facts
        .bounds
        .map_or(0.0, |bounds| bounds.extent().length());
    let reason = format!(
        "it is {} metres across and shines through {glass}, which is glass around it: paths come to it by chance alone, and hardly any does",
        decimal(across)
    );
    let remedy = format!(
        "set `thin_walled` for the material of {glass}, make the lamp larger, or take more --spp"
    );
    let at = object_facts
        .bounds
        .and_then(|bounds| scene_point(bounds.centre()));
    met_by_chance(object_facts.subject, reason, remedy).with_place(at)
}
