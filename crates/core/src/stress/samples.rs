//! A small picture of each camera, from which the checks judge samples, blackness, noise, and light
//! that is lost where paths end at their depth limit.

use super::*;
use crate::counters::{Counters, SampleLoss};
use crate::picture::Picture;
use crate::prepare::UnreachedLight;
use crate::scene::AlphaMode;

/// Fewest hits of lamps by chance alone from which the light of such lamps is determined.
const FEWEST_FOUND: u64 = 40;
/// If fewer than one path in this number of samples may hit lamps by chance alone, the light of
/// these lamps is negligible.
const ONE_IN: u64 = 500;
/// Greatest radiance that counts as black, which rounding can cause at grazing angles.
const BLACK: f32 = 1e-6;
/// Least number of segments for which the loss at the depth limit is measured. With fewer, no path
/// passes through glass.
const FEWEST_SEGMENTS: u32 = 3;
/// The longer paths have so many times as many segments, but at most `MOST_SEGMENTS`.
const LONGER: u32 = 4;
const MOST_SEGMENTS: u32 = 128;
/// Reported loss of an object, as a share of its light. Where no glass is seen, paths lose light by
/// reflections alone: the loss must exceed `REFLECTIONS` times that loss by this share.
const LOSS: f64 = 0.2;
const REFLECTIONS: f64 = 1.5;
/// Loss that the advised depth may leave.
const REST: f64 = 0.01;
/// Least number of pixels of an object: this share of the picture, and at least so many.
const PIXEL_SHARE: f64 = 0.005;
const PIXELS: usize = 24;

/// A small picture of a camera, with its counters.
pub(super) struct SmallRender {
    camera: usize,
    /// The camera as the subject of a finding.
    pub subject: FindingSubject,
    picture: Picture,
    pub counters: Counters,
    /// The lights that reach no visible surface, with the number of their shadow rays, all blocked.
    pub unreached: BTreeMap<FindingSubject, u64>,
    /// Error of the picture (root relMSE), estimated from its own samples, times the root of its
    /// samples per pixel. `None` if the samples are too few to tell.
    error: Option<f64>,
    pub run: CheckRun,
}

impl SmallRender {
    /// Renders the small picture, until it is complete or the time is over.
    pub fn render(
        facts: &SceneFacts<'_>,
        ready: &ReadyScene,
        view: &CameraView,
        deadline: &RayDeadline<'_>,
    ) -> Self {
        let mut film = ready.new_film("");
        let part = film.full_part();
        // The film is its own, so that it can't be refused.
        let _ = ready.render_part(&mut film, &part, deadline);
        let counters = film.counters();
        let samples = u64::from(ready.settings().sampling.samples_per_pixel());
        let planned = film.size().map(u64::from).into_iter().product::<u64>() * samples;
        let run = CheckRun {
            name: "samples",
            unit: "samples",
            looked_at: match film.unfinished_pixels() {
                0 => planned,
                _ => counters.samples + counters.dropped,
            },
            planned,
        };
        let unreached = |light: UnreachedLight| match light {
            UnreachedLight::Light { index, rays } => (FindingSubject::Light(index), rays),
            UnreachedLight::Object { index, rays } => (
                FindingSubject::Object(facts.facts_index(index as u32)),
                rays,
            ),
        };
        let lights = ready.find_unreached_lights(&film).into_iter();
        // Where too few paths hit lamps by chance, the error lacks their noise.
        let lacks_hits = counters.unaided.saturating_mul(ONE_IN) > counters.samples
            && counters.found < FEWEST_FOUND;
        let error = film
            .estimate_uncertainty()
            .map(|error| error.root_relmse.value);
        let is_known = !run.is_cut_short() && !lacks_hits;
        Self {
            camera: view.index,
            subject: view.subject,
            picture: film.picture(),
            counters,
            unreached: lights.map(unreached).collect(),
            error: error
                .filter(|error| is_known && error.is_finite())
                .map(|error| error * (samples as f64).sqrt()),
            run,
        }
    }

    /// Returns the expected error (root relMSE) of a picture with a number of samples per pixel: the
    /// variance falls as their inverse. `None` if the samples are too few to tell.
    pub fn expected_error(&self, samples: f64) -> Option<f64> {
        self.error.map(|error| error / samples.sqrt())
    }

    /// Returns whether surfaces are visible and all of them are black, unless most surfaces show some
    /// light: then faint light reaches them.
    pub fn is_black(&self) -> bool {
        let brightest = |pixel: &[f32; 3]| pixel.iter().copied().fold(0.0, f32::max);
        let mut pixels = self.picture.rgb.iter();
        let is_dark = pixels.all(|pixel| brightest(pixel) <= BLACK);
        let surfaces = self.surface_pixels();
        let lit = surfaces
            .iter()
            .filter(|pixel| brightest(pixel) > 0.0)
            .count();
        let is_seen = self.counters.hits > 0 && !self.run.is_cut_short();
        is_seen && is_dark && 2 * lit <= surfaces.len()
    }

    /// Returns the pixels that show a surface.
    fn surface_pixels(&self) -> Vec<[f32; 3]> {
        let objects = self.picture.layer("object.id");
        let shows = |pixel: usize| objects.is_none_or(|layer| layer.samples[pixel] >= 0.0);
        let pixels = self.picture.rgb.iter().enumerate();
        pixels
            .filter_map(|(pixel, &rgb)| shows(pixel).then_some(rgb))
            .collect()
    }

    /// Returns the mean radiance of the pixels that show a surface, without the brightest twentieth
    /// of them. Pixels of the sky do not count.
    pub fn mean_radiance(&self) -> f64 {
        let value = |pixel: [f32; 3]| f64::from(pixel.iter().sum::<f32>()) / 3.0;
        let mut values: Vec<f64> = self.surface_pixels().into_iter().map(value).collect();
        values.retain(|value| value.is_finite());
        values.sort_unstable_by(f64::total_cmp);
        values.truncate(values.len() - values.len() / 20);
        values.iter().sum::<f64>() / values.len().max(1) as f64
    }

    /// Returns the findings about samples that are not finite, and rays that were cut short.
    pub fn loss_findings(&self, size: [u32; 2]) -> Vec<StressFinding> {
        // Where time ended it, pixels lack samples for that too.
        let layer = self.picture.layer("samples.N");
        let samples = layer.filter(|_| !self.run.is_cut_short());
        let samples = samples
            .into_iter()
            .flat_map(|layer| layer.samples.iter().enumerate());
        let fewest = samples
            .min_by(|a, b| a.1.total_cmp(b.1))
            .map(|(pixel, _)| pixel);
        let position = |pixel: usize| {
            let [width, height] =
                [self.picture.width, self.picture.height].map(|edge| edge as usize);
            let at = [(pixel % width, width), (pixel / width, height)];
            let share = at.map(|(cell, total)| (cell as f64 + 0.5) / total as f64);
            (
                [0, 1].map(|axis| share[axis] * f64::from(size[axis])),
                self.camera,
            )
        };
        // A pixel without an object shows the sky.
        let objects = self.picture.layer("object.id");
        let is_sky = fewest
            .zip(objects)
            .is_some_and(|(at, layer)| layer.samples[at] < 0.0);
        let finding = |loss| {
            match loss {
            SampleLoss::NotFinite { dropped, of: total } => {
                let finding = FindingCode::SamplesNotFinite.finding(
                    PictureWrong,
                    if is_sky { FindingSubject::Sky } else { FindingSubject::Scene },
                    "samples are not finite numbers and are dropped, so that their pixels are wrong",
                    "look for numbers in materials, lights and sky that are too large or undefined, or render with --precision reference",
                );
                StressFinding {
                    pixel: fewest.map(position),
                    ..finding.with_count(dropped, total, "samples", "had to be dropped")
                }
            }
            SampleLoss::CutShort { rays, most } => FindingCode::RaysCutShort
                .finding(
                    PictureWrong,
                    FindingSubject::Scene,
                    format!("rays end after {most} surfaces that are cut out or partly transparent, so that objects behind these surfaces are missing"),
                    "place fewer such surfaces behind each other",
                )
                .with_rays(rays, 0, "ended there"),
        }
        };
        self.counters.sample_losses().map(finding).collect()
    }
}

impl SceneFacts<'_> {
    /// Returns a finding if the scene has glass and its paths have fewer than three segments.
    pub fn depth_limit_finding(&self) -> Option<StressFinding> {
        let deepest = self.settings.max_depth;
        let mut bodies = self.objects.iter().filter(|object| object.is_body());
        let body = bodies.find(|_| deepest < FEWEST_SEGMENTS)?;
        Some(FindingCode::DepthBelowGlass.wrong(
            body.index,
            format!("paths have at most {deepest} segments, but a path through glass needs three"),
            "raise `render.max_depth` to 8, or render with --max-depth 8",
        ))
    }

    /// Returns the finding about the glass object that loses the greatest share of its light where
    /// paths end at their depth limit, with that share. The small picture is rendered again with
    /// longer paths. Both pictures have the same samples, so that their difference is the light of
    /// the longer paths.
    pub fn depth_loss_finding(
        &self,
        ready: &mut ReadyScene,
        view: &CameraView,
        picture: &SmallRender,
        deadline: &RayDeadline<'_>,
    ) -> Option<(f64, StressFinding)> {
        let depth = ready.settings().max_depth;
        let is_measured =
            ready.is_path_traced() && (FEWEST_SEGMENTS..MOST_SEGMENTS).contains(&depth);
        if !is_measured || picture.run.is_cut_short() {
            return None;
        }
        let glass = self.glass_pixels(ready, view);
        if glass.iter().flatten().count() < PIXELS {
            return None;
        }
        let mut render_at = |depth: u32| {
            ready.set_max_depth(depth);
            let picture = SmallRender::render(self, ready, view, deadline);
            (!picture.run.is_cut_short()).then_some(picture)
        };
        let [between, longer] = [2, LONGER].map(|times| (times * depth).min(MOST_SEGMENTS));
        let deep = render_at(longer);
        let worst = deep
            .as_ref()
            .and_then(|deep| greatest_loss(&glass, picture, deep));
        let is_enough = worst
            .zip(deep.as_ref())
            .is_some_and(|((object, ..), deep)| {
                let left = render_at(between)
                    .and_then(|picture| mean_loss(&glass, Some(object), &picture, deep));
                left.is_some_and(|(loss, _)| loss < REST)
            });
        ready.set_max_depth(depth);
        let (object, pixels, loss) = worst?;
        let enough = if is_enough { between } else { longer };
        let finding = FindingCode::DepthBelowGlass.wrong(object,
            format!(
                "paths have at most {depth} segments, so that many end in glass or behind it: pixels that show this glass lack {:.0} % of their light",
                100.0 * loss
            ),
            format!(
                "raise `render.max_depth` to {enough}, or render with --max-depth {enough}; a path needs two segments for each pane or ball of glass, and two more if its light comes back through the same glass"
            ),
        );
        let (unit, predicate) = ("pixels of a small test picture", "show this glass");
        let mut places = glass.iter().flatten();
        let place = places
            .find(|(other, _)| *other == object)
            .map(|(_, place)| *place);
        let finding = finding
            .with_count(pixels as u64, 0, unit, predicate)
            .with_place(place);
        Some((loss, finding))
    }

    /// Returns the glass object that each pixel of the small picture shows, with the position of its
    /// surface. `None` for a pixel that shows something else.
    fn glass_pixels(&self, ready: &ReadyScene, view: &CameraView) -> Vec<Option<(usize, DVec3)>> {
        let is_glass = |object: usize| match self.objects[object].material {
            Some((_, material)) => match &material.model {
                MaterialModel::Physical(m) => m.may_transmit() && m.alpha != AlphaMode::Blend,
                MaterialModel::Classic(_) => false,
            },
            None => false,
        };
        let rays = view.grid_rays(view.rectangle(), ready.settings().size);
        let hits = self.trace(ready, rays).into_iter();
        let first = hits.map(|hits| hits.first().map(|hit| (hit.object, hit.position)));
        first
            .map(|hit| hit.filter(|(object, _)| is_glass(*object)))
            .collect()
    }
}

/// Returns the object with the greatest loss, the number of its pixels, and the loss. `None` if the
/// loss is not worth a finding.
fn greatest_loss(
    glass: &[Option<(usize, DVec3)>],
    picture: &SmallRender,
    deep: &SmallRender,
) -> Option<(usize, usize, f64)> {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    for (object, _) in glass.iter().flatten() {
        *counts.entry(*object).or_insert(0) += 1;
    }
    let elsewhere = mean_loss(glass, None, picture, deep).map_or(0.0, |(loss, _)| loss);
    let fewest = PIXELS.max((PIXEL_SHARE * glass.len() as f64) as usize);
    let objects = counts.into_iter().filter(|(_, count)| *count >= fewest);
    let losses = objects.filter_map(|(object, _)| {
        let (loss, count) = mean_loss(glass, Some(object), picture, deep)?;
        Some((object, count, loss))
    });
    losses
        .filter(|(.., loss)| *loss >= REFLECTIONS * elsewhere + LOSS)
        .max_by(|a, b| a.2.total_cmp(&b.2))
}

/// Returns the mean over the pixels of an object (`None`: over the pixels without glass) of the
/// share of the light that a picture lacks, and the number of pixels. Each pixel counts equally, so
/// that a few bright samples do not decide.
fn mean_loss(
    glass: &[Option<(usize, DVec3)>],
    object: Option<usize>,
    picture: &SmallRender,
    deep: &SmallRender,
) -> Option<(f64, usize)> {
    let lost = |index: usize| {
        let [own, whole] =
            [picture, deep].map(|of| f64::from(of.picture.rgb[index].iter().sum::<f32>()));
        let share = (whole - own) / whole;
        (whole > 0.0 && share.is_finite()).then(|| share.clamp(0.0, 1.0))
    };
    let of_object = glass.iter().enumerate();
    let of_object = of_object.filter(|(_, seen)| seen.map(|(seen, _)| seen) == object);
    let lost: Vec<f64> = of_object.filter_map(|(index, _)| lost(index)).collect();
    let mean = lost.iter().sum::<f64>() / lost.len() as f64;
    (!lost.is_empty()).then_some((mean, lost.len()))
}
