//! Tests whether a camera sees the position of a finding, or an opaque object hides it.

use glam::DVec3;
use raywright_bvh::{Interval, Ray, Real, Vector};

use super::cameras::CameraView;
use super::facts::{SceneFacts, SurfaceKind};
use super::finding::{FindingSubject, StressFinding};
use super::ray_hits::{HITS, hits_along_ray};
use crate::dispatch::{PreparedSceneTask, ReadyScene};
use crate::prepare::PreparedScene;

/// Share of a ray's length before its end within which a surface counts as the end.
const NEAR: f64 = 1e-4;

/// A ray from a camera to the position of a finding.
struct Sightline {
    finding: usize,
    camera: usize,
    pixel: [f64; 2],
    ray: Ray<f64>,
    distance: f64,
    /// Object of the finding, if the finding has no primitive. A hit anywhere on this object then
    /// counts as visible.
    own: Option<usize>,
}

struct SightlineTask<'a> {
    scene_facts: &'a SceneFacts<'a>,
    list: Vec<Sightline>,
}

impl PreparedSceneTask for SightlineTask<'_> {
    type Output = Vec<bool>;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> Vec<bool> {
        self.list
            .iter()
            .map(|line| self.is_unoccluded(prepared, line))
            .collect()
    }
}

impl SightlineTask<'_> {
    fn is_unoccluded<R: Real>(&self, prepared: &PreparedScene<R>, line: &Sightline) -> bool {
        let from = line.ray.origin - prepared.origin.origin;
        let [from, direction] = [from, line.ray.direction].map(R::Vec3::from_f64);
        let ray = Ray::new(from, direction).as_camera_ray();
        let hits = hits_along_ray(&prepared.geometry, &ray, Interval::positive());
        let mut ends = hits.take(HITS).filter_map(|hit| {
            let object = self.scene_facts.facts_index(hit.outermost_id());
            let is_end = hit.t.to_f64() >= line.distance * (1.0 - NEAR) || line.own == Some(object);
            let is_opaque = self.scene_facts.objects[object].surface_kind == SurfaceKind::Opaque;
            (is_end || is_opaque).then_some(is_end)
        });
        ends.next().unwrap_or(true)
    }
}

/// Sets the pixel of each finding: that of the first camera that sees its position.
pub(super) fn assign_pixels(
    scene_facts: &SceneFacts<'_>,
    ready: &ReadyScene,
    views: &[CameraView],
    findings: &mut [StressFinding],
) {
    let mut list = Vec::new();
    for (finding, found_finding) in findings.iter().enumerate() {
        let Some(place) = found_finding
            .place
            .filter(|_| found_finding.pixel.is_none())
        else {
            continue;
        };
        let own = match (found_finding.subject, found_finding.primitive) {
            (FindingSubject::Object(index), None) => Some(index),
            _ => None,
        };
        for view in views {
            let Some(pixel) = view.project_point(place.into()) else {
                continue;
            };
            let ray = view.ray_through_pixel(pixel);
            let distance = (DVec3::from(place) - ray.origin).dot(ray.direction);
            list.push(Sightline {
                finding,
                camera: view.index,
                pixel,
                ray,
                distance,
                own,
            });
        }
    }
    let lines = SightlineTask { scene_facts, list };
    let clear = ready.run_task(&lines);
    for (line, _) in lines.list.iter().zip(clear).filter(|(_, clear)| *clear) {
        let found_finding = &mut findings[line.finding];
        found_finding.pixel = found_finding.pixel.or(Some((line.pixel, line.camera)));
    }
}
