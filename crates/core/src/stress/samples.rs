//! A small picture of each camera: samples that are no numbers, rays that were cut short, what is
//! black, and lights that were not found.

use super::facts::{SceneFacts, place};
use super::finding::{CheckRun, Code, Finding, Severity, Subject, decimal};
use super::{Deadline, lamps};
use crate::counters::{Counters, SampleLoss};
use crate::dispatch::Ready;
use crate::picture::Picture;
use crate::prepare::ShutAway;

/// What a small picture of a camera showed.
pub(super) struct SmallPicture {
    pub camera: usize,
    pub picture: Picture,
    pub counters: Counters,
    pub shut_away: Vec<ShutAway>,
    pub run: CheckRun,
}

impl SmallPicture {
    /// Renders it, as far as there is time.
    pub fn of(ready: &Ready, camera: usize, deadline: &Deadline<'_>) -> Self {
        let mut film = ready.film("");
        let whole = film.whole();
        let pixels = u64::from(film.size()[0]) * u64::from(film.size()[1]);
        let planned = pixels * u64::from(ready.settings().sampling.count());
        // The film is its own, so that it can't be refused.
        let _ = ready.render_part(&mut film, &whole, deadline);
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
    facts: &SceneFacts<'_>,
    pictures: &[SmallPicture],
    size: [u32; 2],
) -> Vec<Finding> {
    let mut found: Vec<Finding> = pictures
        .iter()
        .flat_map(|picture| losses(picture, size))
        .collect();
    found.extend(pictures.iter().filter_map(|picture| black(facts, picture)));
    if let Some(brightest) = lamps::brightest(facts) {
        found.extend(
            pictures
                .iter()
                .filter_map(|picture| too_bright(picture, brightest, size)),
        );
    }
    found.extend(unreached(facts, pictures));
    tell_why_black(facts, &mut found);
    found.extend(
        pictures
            .iter()
            .filter_map(|picture| by_chance(facts, picture)),
    );
    found
}

fn subject(facts: &SceneFacts<'_>, picture: &SmallPicture) -> Subject {
    Subject::Camera((!facts.scene.cameras.is_empty()).then_some(picture.camera))
}

fn losses(picture: &SmallPicture, size: [u32; 2]) -> Vec<Finding> {
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
        SampleLoss::NotFinite { dropped, of } => Finding {
            pixel: at.and_then(|pixel| picture.full(pixel, size)),
            ..Finding::new(
                Code::SamplesNotFinite,
                Severity::PictureWrong,
                Subject::Scene,
                "samples are not finite numbers and are dropped, so that the picture is wrong where they lie",
                "look for numbers that are too large or not defined in materials, lights and sky, or add --precision reference",
            )
            .counted(dropped, of, "samples", "had to be dropped")
        },
        SampleLoss::CutShort { rays, most } => Finding::new(
            Code::RaysCutShort,
            Severity::PictureWrong,
            Subject::Scene,
            format!("rays end after {most} surfaces that are absent or there in part, and what lies behind is missing"),
            "leave fewer such surfaces one behind the other",
        )
        .counted(rays, 0, "rays", "ended so"),
    }
    };
    picture.counters.losses().map(finding).collect()
}

fn black(facts: &SceneFacts<'_>, picture: &SmallPicture) -> Option<Finding> {
    let is_black = picture
        .first(|pixel| pixel.iter().any(|&channel| channel > 0.0))
        .is_none();
    let subject = subject(facts, picture);
    if picture.counters.met > 0 && is_black && !picture.run.is_cut() {
        let (why, remedy) = (
            "everything that is seen is black: no light arrives",
            "add a light or a sky, or open what is in its way",
        );
        return Some(Finding::new(
            Code::BlackPicture,
            Severity::PictureWrong,
            subject,
            why,
            remedy,
        ));
    }
    None
}

fn too_bright(picture: &SmallPicture, brightest: f64, size: [u32; 2]) -> Option<Finding> {
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
    let why = "pixels are over four times as bright as the brightest light of the scene, which no surface can be: light is found too rarely there";
    let remedy = "take more --spp, or --clamp for less noise and less light";
    let finding = Finding::new(
        Code::BrighterThanLights,
        Severity::SlowOrNoisy,
        Subject::Scene,
        why,
        remedy,
    );
    let of = picture.picture.rgb.len() as u64;
    let finding = finding.counted(count as u64, of, "pixels", "came out that bright");
    Some(Finding {
        pixel: picture.full(first, size),
        ..finding
    })
}

/// Where everything is black since lights are shut away, tells that as one.
fn tell_why_black(facts: &SceneFacts<'_>, found: &mut Vec<Finding>) {
    if !found.iter().any(|found| found.code == Code::BlackPicture) {
        return;
    }
    let is_shut = |found: &Finding| found.code == Code::UnreachedLight;
    let shut: Vec<String> = found
        .iter()
        .filter(|found| is_shut(found))
        .map(|found| found.subject.words(facts.scene))
        .collect();
    let Some(first) = shut.first() else {
        return;
    };
    found.retain(|found| !is_shut(found));
    let lights = match shut.len() {
        1 => format!("{first} is"),
        more => format!("{first} and {} more are", more - 1),
    };
    for black in found
        .iter_mut()
        .filter(|found| found.code == Code::BlackPicture)
    {
        black.why = format!(
            "everything that is seen is black: {lights} shut away, or turned from all of that"
        );
        black.remedy =
            "open the cover of the light or take it away, or add a light or a sky".to_owned();
    }
}

/// Lights from which nothing arrives in the picture of any camera.
fn unreached(facts: &SceneFacts<'_>, pictures: &[SmallPicture]) -> Vec<Finding> {
    let subject_of = |shut: &ShutAway| match *shut {
        ShutAway::Light { index, .. } => Subject::Light(index),
        ShutAway::Object { index, .. } => Subject::Object(facts.index_of(index as u32)),
    };
    let in_vain = |shut: &ShutAway| match *shut {
        ShutAway::Light { rays, .. } | ShutAway::Object { rays, .. } => rays,
    };
    let Some((first, others)) = pictures.split_first() else {
        return Vec::new();
    };
    let everywhere = |subject: Subject| {
        others
            .iter()
            .all(|p| p.shut_away.iter().any(|shut| subject_of(shut) == subject))
    };
    let finding = |shut: &ShutAway| {
        let subject = subject_of(shut);
        if let Subject::Object(index) = subject
            && let Some(glass) = lamps::glass_around(facts, index)
        {
            return Some(through_glass(facts, index, glass));
        }
        let why = "it lights nothing that is seen: it is shut away, or turned from all of that";
        let remedy =
            "open its cover or take it away; if it is meant to be hidden, it only costs noise";
        // Of a generator's lamps some may well be hidden.
        let is_one =
            subject.index() < facts.scene.objects.len() || matches!(subject, Subject::Light(_));
        (is_one && everywhere(subject)).then(|| {
            Finding::new(
                Code::UnreachedLight,
                Severity::SlowOrNoisy,
                subject,
                why,
                remedy,
            )
            .counted(
                in_vain(shut),
                in_vain(shut),
                "rays",
                "to it ended on their way",
            )
        })
    };
    first.shut_away.iter().filter_map(finding).collect()
}

/// Light that is found by chance alone, by what it comes from.
fn by_chance(facts: &SceneFacts<'_>, picture: &SmallPicture) -> Option<Finding> {
    const ENOUGH: u64 = 1000;
    const RARE: u64 = 1000;
    let Counters { unaided, found, .. } = picture.counters;
    if unaided < ENOUGH || found * RARE > unaided {
        return None;
    }
    let lamps = || facts.objects.iter().filter(|own| own.emits());
    let within = lamps().find_map(|own| {
        let glass = lamps::glass_around(facts, own.subject.index())?;
        Some((own, glass))
    });
    let finding = if let Some((own, glass)) = within {
        through_glass(facts, own.subject.index(), glass)
    } else if lamps().next().is_some() {
        let why = "lamps and suns that shine by way of mirrors or glass are met by chance, and hardly any path meets one";
        let remedy = "make them larger, or what they shine through thin (`thin_walled`) or rough; or take more --spp";
        met_by_chance(Subject::Scene, why, remedy)
    } else {
        let why = "the sky has a small bright sun, and hardly any path by way of mirrors or glass meets it";
        let remedy = "take more --spp, or a sky with a larger sun or none";
        met_by_chance(Subject::Sky, why, remedy)
    };
    Some(finding.counted(unaided - found, unaided, "paths", "met no light"))
}

fn met_by_chance(subject: Subject, why: impl Into<String>, remedy: impl Into<String>) -> Finding {
    let (code, severity) = (Code::LightByChance, Severity::SlowOrNoisy);
    Finding::new(code, severity, subject, why, remedy)
}

/// A lamp within a body of glass.
fn through_glass(facts: &SceneFacts<'_>, lamp: usize, glass: Subject) -> Finding {
    let (own, glass) = (&facts.objects[lamp], glass.words(facts.scene));
    let across = own.bounds.map_or(0.0, |bounds| bounds.extent().length());
    let why = format!(
        "it is {} metres across and shines through {glass}, which is glass around it: paths come to it by chance alone, and hardly any does",
        decimal(across)
    );
    let remedy = format!(
        "set `thin_walled` for the material of {glass}, make the lamp larger, or take more --spp"
    );
    let at = own.bounds.and_then(|bounds| place(bounds.centre()));
    met_by_chance(own.subject, why, remedy).at(at)
}
