//! A small picture of each camera: samples that are no numbers, rays that were cut short, what is
//! black, and lights that were not found.

use super::covers::Cover;
use super::facts::{SceneFacts, SurfaceKind, finite_point};
use super::finding::{CheckRun, FindingCode, FindingSubject, Severity, StressFinding, metres};
use super::{RayDeadline, lights};
use crate::counters::{Counters, SampleLoss};
use crate::dispatch::ReadyScene;
use crate::picture::Picture;
use crate::prepare::UnreachedLight;
use crate::scene::Sky;

/// What a small picture of a camera showed.
pub(super) struct SmallRender {
    pub camera: usize,
    pub picture: Picture,
    pub counters: Counters,
    pub shut_away: Vec<UnreachedLight>,
    pub run: CheckRun,
    /// What is in the way of light, where everything is black.
    pub cover: Option<Cover>,
}

impl SmallRender {
    /// Renders it, as far as there is time.
    pub fn render_small_picture(
        ready: &ReadyScene,
        camera: usize,
        deadline: &RayDeadline<'_>,
    ) -> Self {
        let mut film = ready.new_film("");
        let part = film.full_part();
        let pixels = u64::from(film.size()[0]) * u64::from(film.size()[1]);
        let planned = pixels * u64::from(ready.settings().sampling.samples_per_pixel());
        // The film is its own, so that it can't be refused.
        let _ = ready.render_part(&mut film, &part, deadline);
        let (shut_away, counters) = (ready.find_unreached_lights(&film), film.counters());
        let looked_at = if film.unfinished_pixels() == 0 {
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
            cover: None,
        }
    }

    /// Whether something is seen, and all of it is black.
    pub fn is_black(&self) -> bool {
        let shines = |pixel: [f32; 3]| pixel.iter().any(|&channel| channel > 0.0);
        self.counters.hits > 0
            && self.first_pixel_where(shines).is_none()
            && !self.run.is_cut_short()
    }

    /// The middle of a pixel of it as a place of the picture, whose size is another.
    fn full_size_position(&self, pixel: usize, size: [u32; 2]) -> Option<([f64; 2], usize)> {
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
    fn first_pixel_where(&self, holds: impl Fn([f32; 3]) -> bool) -> Option<usize> {
        self.picture.rgb.iter().position(|&pixel| holds(pixel))
    }
}

/// What is wrong with the samples of all cameras.
pub(super) fn check_samples(
    scene_facts: &SceneFacts<'_>,
    pictures: &[SmallRender],
    size: [u32; 2],
) -> Vec<StressFinding> {
    let mut findings: Vec<StressFinding> = pictures
        .iter()
        .flat_map(|picture| sample_loss_findings(picture, size))
        .collect();
    findings.extend(
        pictures
            .iter()
            .filter_map(|picture| black_picture_finding(scene_facts, picture)),
    );
    if let Some(brightest) = lights::max_emitted_radiance(scene_facts) {
        findings.extend(
            pictures
                .iter()
                .filter_map(|picture| brightness_finding(picture, brightest, size)),
        );
    }
    findings.extend(unreached_light_findings(scene_facts, pictures));
    let cover = pictures.iter().find_map(|picture| picture.cover);
    merge_black_picture_findings(scene_facts, cover, &mut findings);
    findings.extend(
        pictures
            .iter()
            .filter_map(|picture| light_hit_by_chance_finding(scene_facts, picture)),
    );
    findings
}

fn camera_subject(scene_facts: &SceneFacts<'_>, picture: &SmallRender) -> FindingSubject {
    FindingSubject::Camera((!scene_facts.scene.cameras.is_empty()).then_some(picture.camera))
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
    let finding = |loss| {
        match loss {
        SampleLoss::NotFinite { dropped, of: total } => StressFinding {
            pixel: at.and_then(|pixel| picture.full_size_position(pixel, size)),
            ..StressFinding::new(
                FindingCode::SamplesNotFinite,
                Severity::PictureWrong,
                FindingSubject::Scene,
                "samples are not finite numbers and are dropped, so that the picture is wrong where they lie",
                "look for numbers that are too large or not defined in materials, lights and sky, or add --precision reference",
            )
            .with_count(dropped, total, "samples", "had to be dropped")
        },
        SampleLoss::CutShort { rays, most: maximum } => StressFinding::new(
            FindingCode::RaysCutShort,
            Severity::PictureWrong,
            FindingSubject::Scene,
            format!("rays end after {maximum} surfaces that are absent or there in part, and what lies behind is missing"),
            "leave fewer such surfaces one behind the other",
        )
        .with_count(rays, 0, "rays", "ended so"),
    }
    };
    picture.counters.sample_losses().map(finding).collect()
}

fn black_picture_finding(
    scene_facts: &SceneFacts<'_>,
    picture: &SmallRender,
) -> Option<StressFinding> {
    let words = |subject: FindingSubject| subject.display_name(scene_facts.scene);
    let (reason, remedy) = match picture.cover {
        None => (
            "everything that is seen is black: no light arrives".to_owned(),
            "add a light or a sky, or open what is in its way".to_owned(),
        ),
        Some(Cover { object, light }) => {
            let cover = words(scene_facts.objects[object].subject);
            (
                format!(
                    "everything that is seen is black: {cover} is in the way of the light of {}",
                    words(light)
                ),
                format!("open or remove {cover}, or add a light on this side of it"),
            )
        }
    };
    let (code, severity) = (FindingCode::BlackPicture, Severity::PictureWrong);
    let subject = camera_subject(scene_facts, picture);
    picture
        .is_black()
        .then(|| StressFinding::new(code, severity, subject, reason, remedy))
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
    let finding = finding.with_count(count as u64, total, "pixels", "came out that bright");
    Some(StressFinding {
        pixel: picture.full_size_position(first, size),
        ..finding
    })
}

/// Where everything is black since lights are shut away, tells that as one.
fn merge_black_picture_findings(
    scene_facts: &SceneFacts<'_>,
    cover: Option<Cover>,
    findings: &mut Vec<StressFinding>,
) {
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
        .map(|finding| finding.subject.display_name(scene_facts.scene))
        .collect();
    let Some(first) = shut.first() else {
        return;
    };
    findings.retain(|finding| !is_shut(finding));
    let lights = match shut.len() {
        1 => format!("{first} is"),
        more => format!("{first} and {} more are", more - 1),
    };
    let cover = cover.map(|cover| {
        let subject = scene_facts.objects[cover.object].subject;
        subject.display_name(scene_facts.scene)
    });
    let (why, what) = match &cover {
        Some(cover) => (format!("shut away by {cover}"), cover.as_str()),
        None => (
            "shut away, or turned from all of that".to_owned(),
            "the cover of the light",
        ),
    };
    let is_black = |finding: &&mut StressFinding| finding.code == FindingCode::BlackPicture;
    for black in findings.iter_mut().filter(is_black) {
        black.reason = format!("everything that is seen is black: {lights} {why}");
        black.remedy = format!("open or remove {what}, or add a light or a sky");
    }
}

/// Lights from which nothing arrives in the picture of any camera.
fn unreached_light_findings(
    scene_facts: &SceneFacts<'_>,
    pictures: &[SmallRender],
) -> Vec<StressFinding> {
    let subject_of = |unreached_light: &UnreachedLight| match *unreached_light {
        UnreachedLight::Light { index, .. } => FindingSubject::Light(index),
        UnreachedLight::Object { index, .. } => {
            FindingSubject::Object(scene_facts.facts_index(index as u32))
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
            && let Some(glass) = lights::enclosing_glass(scene_facts, index)
        {
            return Some(enclosed_light_finding(scene_facts, index, glass));
        }
        let reason = "it lights nothing that is seen: it is shut away, or turned from all of that";
        let remedy = "open or remove its cover; if it is meant to be hidden, it only costs noise";
        // Of a generator's lamps some may well be hidden.
        let is_one = subject.list_index() < scene_facts.scene.objects.len()
            || matches!(subject, FindingSubject::Light(_));
        (is_one && everywhere(subject)).then(|| {
            StressFinding::new(
                FindingCode::UnreachedLight,
                Severity::SlowOrNoisy,
                subject,
                reason,
                remedy,
            )
            .with_count(
                in_vain(unreached_light),
                in_vain(unreached_light),
                "rays",
                "towards it were blocked",
            )
        })
    };
    first.shut_away.iter().filter_map(finding).collect()
}

/// Light that is found by chance alone, by what it comes from.
fn light_hit_by_chance_finding(
    scene_facts: &SceneFacts<'_>,
    picture: &SmallRender,
) -> Option<StressFinding> {
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
            .filter(|object_facts| object_facts.emits_light())
    };
    let within = lamps().find_map(|object_facts| {
        let glass = lights::enclosing_glass(scene_facts, object_facts.subject.list_index())?;
        Some((object_facts, glass))
    });
    let finding = if let Some((object_facts, glass)) = within {
        enclosed_light_finding(scene_facts, object_facts.subject.list_index(), glass)
    } else if let Some(lamp) = lamps().next() {
        let reason = "lamps and suns that shine by way of mirrors or glass are met by chance, and hardly any path meets one";
        let lamp = lamp.subject.display_name(scene_facts.scene);
        // What is thin already, and mirrors, can only be rougher.
        let has_body = scene_facts
            .objects
            .iter()
            .any(|object_facts| object_facts.matter == SurfaceKind::Body);
        let thin = match has_body {
            true => ", the glass thin (`thin_walled`),",
            false => "",
        };
        let remedy =
            format!("make {lamp} larger{thin} or mirrors and glass rough; or take more --spp");
        new_light_by_chance_finding(FindingSubject::Scene, reason, remedy)
    } else if matches!(scene_facts.scene.sky, Some(Sky::Studio(_))) {
        let reason =
            "the studio's lights are met by way of mirrors or glass, and hardly any path meets one";
        let remedy = "take more --spp, or another environment with --env, or make the mirrors or the glass rough";
        new_light_by_chance_finding(FindingSubject::Sky, reason, remedy)
    } else {
        let reason = "the sky has a small bright sun, and hardly any path by way of mirrors or glass meets it";
        let remedy = "take more --spp, or a sky with a larger sun or none";
        new_light_by_chance_finding(FindingSubject::Sky, reason, remedy)
    };
    Some(finding.with_count(unaided - found, unaided, "paths", "met no light"))
}

fn new_light_by_chance_finding(
    subject: FindingSubject,
    reason: impl Into<String>,
    remedy: impl Into<String>,
) -> StressFinding {
    let (code, severity) = (FindingCode::LightByChance, Severity::SlowOrNoisy);
    StressFinding::new(code, severity, subject, reason, remedy)
}

/// A lamp within a body of glass.
fn enclosed_light_finding(
    scene_facts: &SceneFacts<'_>,
    lamp: usize,
    glass: FindingSubject,
) -> StressFinding {
    let (object_facts, glass) = (
        &scene_facts.objects[lamp],
        glass.display_name(scene_facts.scene),
    );
    let across = object_facts
        .bounds
        .map_or(0.0, |bounds| bounds.extent().max_element());
    let reason = format!(
        "it is {} across and shines through {glass}, which is glass around it: paths come to it by chance alone, and hardly any does",
        metres(across)
    );
    let remedy = format!(
        "set `thin_walled` for the material of {glass}, make the lamp larger, or take more --spp"
    );
    let at = object_facts
        .bounds
        .and_then(|bounds| finite_point(bounds.centre()));
    new_light_by_chance_finding(object_facts.subject, reason, remedy).with_place(at)
}
