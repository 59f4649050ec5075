//! Whether a camera sees the place of a finding, or something opaque hides it.

use glam::DVec3;
use raywright_bvh::{Interval, Ray, Real, Vector};

use super::cameras::CameraPicture;
use super::facts::{SceneFacts, SurfaceMatter};
use super::finding::{FindingSubject, StressFinding};
use crate::dispatch::{PreparedWork, ReadyScene};
use crate::prepare::Prepared;

/// Surfaces on the way to a place that are looked through.
const HITS: usize = 64;
/// Share of the way within which a surface is at its end.
const NEAR: f64 = 1e-4;

/// The way from a camera to a place.
struct Sightline {
    finding: usize,
    camera: usize,
    pixel: [f64; 2],
    ray: Ray<f64>,
    distance: f64,
    /// The object that the finding is about, where any place of its surface does.
    own: Option<usize>,
}

struct Sightlines<'a> {
    scene_facts: &'a SceneFacts<'a>,
    list: Vec<Sightline>,
}

impl PreparedWork for Sightlines<'_> {
    type Output = Vec<bool>;

    fn run<R: Real>(&self, prepared: &Prepared<R>) -> Vec<bool> {
        self.list
            .iter()
            .map(|line| self.is_clear(prepared, line))
            .collect()
    }
}

impl Sightlines<'_> {
    fn is_clear<R: Real>(&self, prepared: &Prepared<R>, line: &Sightline) -> bool {
        let from = line.ray.origin - prepared.origin.origin;
        let [from, direction] = [from, line.ray.direction].map(R::Vec3::from_f64);
        let (ray, mut range) = (Ray::new(from, direction).culling(), Interval::positive());
        for _ in 0..HITS {
            let Some(hit) = prepared.geometry.closest(&ray, range, &mut ()) else {
                return true;
            };
            let object = self.scene_facts.index_of(hit.outermost());
            if hit.t.to_f64() >= line.distance * (1.0 - NEAR) || line.own == Some(object) {
                return true;
            }
            if self.scene_facts.objects[object].matter == SurfaceMatter::Opaque {
                return false;
            }
            range.min = hit.t;
        }
        false
    }
}

/// Gives findings the pixel of the first camera that sees their place.
pub(super) fn set_pixels(
    scene_facts: &SceneFacts<'_>,
    ready: &ReadyScene,
    views: &[CameraPicture],
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
            let Some(pixel) = view.pixel_of(place.into()) else {
                continue;
            };
            let ray = view.ray_to(pixel);
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
    let lines = Sightlines { scene_facts, list };
    let clear = ready.work(&lines);
    for (line, _) in lines.list.iter().zip(clear).filter(|(_, clear)| *clear) {
        let found_finding = &mut findings[line.finding];
        found_finding.pixel = found_finding.pixel.or(Some((line.pixel, line.camera)));
    }
}
