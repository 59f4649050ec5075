//! Light that is lost behind glass, as paths end at their depth limit. The small picture is rendered
//! again with longer paths. Both pictures have the same samples, so that their difference is the
//! light of the longer paths.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use raywright_bvh::{Interval, Real};

use super::RayDeadline;
use super::facts::{SceneFacts, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::small_render::SmallRender;
use crate::dispatch::{PreparedSceneTask, ReadyScene};
use crate::prepare::PreparedScene;
use crate::scene::{AlphaMode, MaterialModel};

/// Least number of segments for which the loss is measured. With fewer, no path passes through
/// glass.
pub(super) const FEWEST_SEGMENTS: u32 = 3;
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

/// Light that is lost in the pixels of a glass object.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthLoss {
    object: usize,
    position: DVec3,
    /// Mean over the pixels of the lost share of the light.
    loss: f64,
    pixels: usize,
    /// Segments of the scene's paths, and segments with which hardly any light is lost.
    depth: u32,
    enough: u32,
}

/// Measures the loss behind the glass object that loses the greatest share of its light. `picture`
/// is the small picture of the scene's own depth.
pub(super) fn measure_depth_loss(
    scene_facts: &SceneFacts<'_>,
    ready: &mut ReadyScene,
    picture: &SmallRender,
    deadline: &RayDeadline<'_>,
) -> Option<DepthLoss> {
    let settings = ready.settings();
    let (depth, size) = (settings.max_depth, settings.size);
    let is_measured = ready.is_path_traced() && (FEWEST_SEGMENTS..MOST_SEGMENTS).contains(&depth);
    if !is_measured || picture.run.is_cut_short() {
        return None;
    }
    let task = GlassPixelTask { scene_facts, size };
    let pixels = ready.run_task(&task);
    if pixels.iter().flatten().count() < PIXELS {
        return None;
    }
    let mut render_at = |depth: u32| {
        ready.set_max_depth(depth);
        let picture = SmallRender::render_small_picture(ready, picture.camera, deadline);
        (!picture.run.is_cut_short()).then_some(picture)
    };
    let longer = (LONGER * depth).min(MOST_SEGMENTS);
    let deep = render_at(longer);
    let found = deep.and_then(|deep| {
        let (object, pixels_of_object, loss) = greatest_loss(&pixels, picture, &deep)?;
        let between = (2 * depth).min(MOST_SEGMENTS);
        let is_enough = render_at(between).is_some_and(|picture| {
            let left = mean_loss(&pixels, Some(object), &picture, &deep);
            left.is_some_and(|(loss, _)| loss < REST)
        });
        let seen = pixels.iter().flatten().find(|(other, _)| *other == object);
        Some(DepthLoss {
            object,
            position: seen?.1,
            loss,
            pixels: pixels_of_object,
            depth,
            enough: if is_enough { between } else { longer },
        })
    });
    ready.set_max_depth(depth);
    found
}

/// Returns the object with the greatest loss, the number of its pixels, and the loss. `None` if the
/// loss is not worth a finding.
fn greatest_loss(
    pixels: &[Option<(usize, DVec3)>],
    picture: &SmallRender,
    deep: &SmallRender,
) -> Option<(usize, usize, f64)> {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    for (object, _) in pixels.iter().flatten() {
        *counts.entry(*object).or_insert(0) += 1;
    }
    let elsewhere = mean_loss(pixels, None, picture, deep).map_or(0.0, |(loss, _)| loss);
    let fewest = PIXELS.max((PIXEL_SHARE * pixels.len() as f64) as usize);
    let objects = counts.into_iter().filter(|(_, count)| *count >= fewest);
    let losses = objects.filter_map(|(object, _)| {
        let (loss, count) = mean_loss(pixels, Some(object), picture, deep)?;
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
    pixels: &[Option<(usize, DVec3)>],
    object: Option<usize>,
    picture: &SmallRender,
    deep: &SmallRender,
) -> Option<(f64, usize)> {
    let sum = |pixel: [f32; 3]| f64::from(pixel.iter().sum::<f32>());
    let lost = |index: usize| {
        let [own, whole] = [picture, deep].map(|of| sum(of.picture.rgb[index]));
        let share = (whole - own) / whole;
        (whole > 0.0 && share.is_finite()).then(|| share.clamp(0.0, 1.0))
    };
    let of_object = pixels.iter().enumerate();
    let of_object = of_object.filter(|(_, seen)| seen.map(|(seen, _)| seen) == object);
    let (total, count) = of_object
        .filter_map(|(index, _)| lost(index))
        .fold((0.0, 0), |(total, count), share| (total + share, count + 1));
    (count > 0).then(|| (total / count as f64, count))
}

/// Returns the finding about the camera with the greatest loss.
pub(super) fn depth_loss_finding(
    scene_facts: &SceneFacts<'_>,
    losses: &[DepthLoss],
) -> Option<StressFinding> {
    let worst = losses.iter().max_by(|a, b| a.loss.total_cmp(&b.loss))?;
    let &DepthLoss { depth, enough, .. } = worst;
    let reason = format!(
        "paths have at most {depth} segments, so that many end in glass or behind it: pixels that show this glass lack {:.0} % of their light",
        100.0 * worst.loss
    );
    let remedy = format!(
        "raise `render.max_depth` to {enough}, or render with --max-depth {enough}; a path needs two segments for each pane or ball of glass, and two more if its light comes back through the same glass"
    );
    let (code, severity) = (FindingCode::DepthBelowGlass, Severity::PictureWrong);
    let subject = scene_facts.objects[worst.object].subject;
    let finding = StressFinding::new(code, severity, subject, reason, remedy)
        .with_count(
            worst.pixels as u64,
            0,
            "pixels of a small test picture",
            "show this glass",
        )
        .with_place(finite_point(worst.position));
    Some(finding)
}

/// Finds the glass object that each pixel of the small picture shows, with the position of its
/// surface. `None` for a pixel that shows something else.
struct GlassPixelTask<'a> {
    scene_facts: &'a SceneFacts<'a>,
    size: [u32; 2],
}

impl PreparedSceneTask for GlassPixelTask<'_> {
    type Output = Vec<Option<(usize, DVec3)>>;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> Self::Output {
        let [width, height] = self.size.map(|edge| edge as usize);
        let is_glass = |object: usize| {
            let material = self.scene_facts.objects[object].material;
            material.is_some_and(|(_, material)| match &material.model {
                MaterialModel::Physical(m) => m.may_transmit() && m.alpha != AlphaMode::Blend,
                MaterialModel::Classic(_) => false,
            })
        };
        let pixel = |index: usize| {
            let at = |cell: usize| R::from_f64(cell as f64 + 0.5);
            let (x, y) = (at(index % width), at(index / width));
            let ray = prepared.camera.generate_ray(x, y, [0.5; 2]);
            let range = Interval::positive();
            let hit = prepared.geometry.closest(&ray, range, &mut ())?;
            let object = self.scene_facts.facts_index(hit.outermost_id());
            let position = || prepared.to_world(prepared.geometry.surface(&ray, &hit).point);
            is_glass(object).then(|| (object, position()))
        };
        (0..width * height).into_par_iter().map(pixel).collect()
    }
}
