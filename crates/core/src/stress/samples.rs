//! A small picture of each camera, from which the checks judge samples, blackness, noise, and light
//! that is lost where paths end at their depth limit.

use super::*;
use crate::counters::Counters;
use crate::picture::Picture;
use crate::prepare::LightRays;
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
/// Least number of pixels of an object: this share of the picture, and at least so many.
const PIXEL_SHARE: f64 = 0.005;
const PIXELS: usize = 24;

/// A small picture of a camera, with its counters.
pub(super) struct SmallRender {
    camera: usize,
    /// The camera as the subject of a finding.
    pub subject: Subject,
    picture: Picture,
    pub counters: Counters,
    pub light_rays: Vec<LightRays>,
    /// Error of the picture (root relMSE), estimated from its own samples, times the root of its
    /// samples per pixel. `None` if the samples are too few to tell.
    error: Option<f64>,
    /// Numbers of samples, finished and planned.
    pub samples: [u64; 2],
}

impl SmallRender {
    /// Renders the small picture, until it is complete or the time is over.
    pub fn render(ready: &ReadyScene, view: &CameraView, deadline: &RayDeadline<'_>) -> Self {
        let mut film = ready.new_film("");
        let part = film.full_part();
        // The film is its own, so that it can't be refused.
        let _ = ready.render_part(&mut film, &part, deadline);
        let counters = film.counters();
        let samples = u64::from(ready.settings().sampling.samples_per_pixel());
        let planned = film.size().map(u64::from).into_iter().product::<u64>() * samples;
        let finished = match film.unfinished_pixels() {
            0 => planned,
            _ => counters.samples + counters.dropped,
        };
        // Where too few paths hit lamps by chance, the error lacks their noise.
        let lacks_hits = counters.unaided.saturating_mul(ONE_IN) > counters.samples
            && counters.found < FEWEST_FOUND;
        let error = film
            .estimate_uncertainty()
            .map(|error| error.root_relmse.value);
        let is_known = finished == planned && !lacks_hits;
        Self {
            camera: view.index,
            subject: view.subject,
            picture: film.picture(),
            counters,
            light_rays: ready.light_rays(&film),
            error: error
                .filter(|error| is_known && error.is_finite())
                .map(|error| error * (samples as f64).sqrt()),
            samples: [finished, planned],
        }
    }

    fn is_cut_short(&self) -> bool {
        self.samples[0] < self.samples[1]
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
        let is_seen = self.counters.hits > 0 && !self.is_cut_short();
        is_seen && is_dark && 2 * lit <= surfaces.len()
    }

    /// Returns the pixels that show a surface.
    fn surface_pixels(&self) -> Vec<[f32; 3]> {
        let pixels = self.picture.rgb.iter().zip(self.objects());
        let pixels = pixels.filter(|(_, object)| object.is_some());
        pixels.map(|(&rgb, _)| rgb).collect()
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

    /// Returns the objects that the pixels show, by their indices among all objects; `None` for the sky.
    fn objects(&self) -> Vec<Option<u32>> {
        let layer = self.picture.layer("object.id");
        let ids = layer.into_iter().flat_map(|layer| layer.samples.iter());
        ids.map(|&id| (id >= 0.0).then_some(id as u32)).collect()
    }

    /// Returns the findings about samples that are not finite, and rays that were cut short.
    pub fn loss_findings(&self, size: [u32; 2]) -> Vec<Fault> {
        // Where time ended it, pixels lack samples for that too.
        let layer = self.picture.layer("samples.N");
        let samples = layer.filter(|_| !self.is_cut_short()).into_iter();
        let samples = samples.flat_map(|layer| layer.samples.iter().enumerate());
        let fewest = samples
            .min_by(|a, b| a.1.total_cmp(b.1))
            .map(|(pixel, _)| pixel);
        let is_sky = fewest.is_some_and(|pixel| self.objects()[pixel].is_none());
        let position = |pixel: usize| {
            let width = self.picture.width as usize;
            let cell = [pixel % width, pixel / width].map(|cell| cell as f64 + 0.5);
            let edges = [self.picture.width, self.picture.height];
            let at = |axis: usize| cell[axis] / f64::from(edges[axis]) * f64::from(size[axis]);
            ([at(0), at(1)], self.camera)
        };
        let finding = |fault: Fault| match fault.kind {
            SamplesNotFinite => Fault {
                subject: if is_sky { Subject::Sky } else { Subject::Scene },
                pixel: fewest.map(position),
                ..fault
            },
            _ => fault,
        };
        self.counters.faults().map(finding).collect()
    }
}

impl SceneFacts<'_> {
    /// Returns a finding if the scene has glass and its paths have fewer than three segments.
    pub fn depth_limit_finding(&self) -> Option<Fault> {
        let deepest = self.settings.max_depth;
        let mut bodies = self.objects.iter().filter(|object| object.is_body());
        let body = bodies.find(|_| deepest < FEWEST_SEGMENTS)?;
        Some(DepthBelowGlass.fault(
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
    ) -> Option<(f64, Fault)> {
        let depth = ready.settings().max_depth;
        let is_measured =
            ready.is_path_traced() && (FEWEST_SEGMENTS..MOST_SEGMENTS).contains(&depth);
        let glass = |object: Option<u32>| {
            object
                .map(|id| self.facts_index(id))
                .filter(|&object| self.is_glass(object))
        };
        let glass: Vec<Option<usize>> = picture.objects().into_iter().map(glass).collect();
        if !is_measured || picture.is_cut_short() || glass.iter().flatten().count() < PIXELS {
            return None;
        }
        let longer = (LONGER * depth).min(MOST_SEGMENTS);
        ready.set_max_depth(longer);
        let deep = SmallRender::render(ready, view, deadline);
        ready.set_max_depth(depth);
        // Each pixel counts equally, so that a few bright samples do not decide.
        let mut losses: BTreeMap<Option<usize>, (f64, usize)> = BTreeMap::new();
        let pixels = picture.picture.rgb.iter().zip(&deep.picture.rgb);
        for ((own, whole), object) in pixels.zip(&glass).filter(|_| !deep.is_cut_short()) {
            let [own, whole] = [own, whole].map(|rgb| f64::from(rgb.iter().sum::<f32>()));
            let share = (whole - own) / whole;
            if whole > 0.0 && share.is_finite() {
                let (sum, count) = losses.entry(*object).or_default();
                (*sum, *count) = (*sum + share.clamp(0.0, 1.0), *count + 1);
            }
        }
        let mean = |(sum, count): (f64, usize)| sum / count as f64;
        let elsewhere = losses.remove(&None).map_or(0.0, mean);
        let fewest = PIXELS.max((PIXEL_SHARE * glass.len() as f64) as usize);
        let objects = losses
            .into_iter()
            .filter(|(_, (_, count))| *count >= fewest);
        let objects = objects.filter_map(|(object, loss)| Some((object?, mean(loss), loss.1)));
        let lossy = objects.filter(|(_, loss, _)| *loss >= REFLECTIONS * elsewhere + LOSS);
        let (object, loss, pixels) = lossy.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let finding = DepthBelowGlass.fault(
            object,
            format!(
                "paths have at most {depth} segments, so that many end in glass or behind it: pixels that show this glass lack {:.0} % of their light",
                100.0 * loss
            ),
            format!(
                "raise `render.max_depth` to {longer}, or render with --max-depth {longer}; a path needs two segments for each pane or ball of glass, and two more if its light comes back through the same glass"
            ),
        );
        let (unit, predicate) = ("pixels of a small test picture", "show this glass");
        let finding = finding.with_count(pixels as u64, 0, unit, predicate);
        Some((loss, finding.with_place(self.objects[object].centre())))
    }

    fn is_glass(&self, object: usize) -> bool {
        let material = self.objects[object].material;
        material.is_some_and(|(_, material)| match &material.model {
            MaterialModel::Physical(m) => m.may_transmit() && m.alpha != AlphaMode::Blend,
            MaterialModel::Classic(_) => false,
        })
    }
}
