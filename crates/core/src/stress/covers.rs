//! Objects between the lights and the visible surfaces, as the cause of a black picture.

use std::collections::BTreeMap;

use glam::DVec3;
use raywright_bvh::{Interval, Ray, Real, Vector};

use super::facts::{SceneFacts, SurfaceKind, unit_random};
use super::finding::FindingSubject;
use super::ray_hits::{HITS, hits_along_ray};
use crate::dispatch::PreparedSceneTask;
use crate::prepare::PreparedScene;
use crate::scene::{Colour, LightKind, Sky};

/// Limits on the search:
/// - `LIGHTS`: greatest number of delta lights, and of emissive objects.
/// - `PLACES`: greatest number of visible points.
/// - `DIRECTIONS`: number of sky directions for each visible point.
const LIGHTS: usize = 16;
const PLACES: usize = 32;
const DIRECTIONS: u64 = 32;
/// A light is covered if at most this percentage of its rays is unblocked.
const FREE: u64 = 10;
/// Share of a ray's length before its end point within which a surface does not block it.
const NEAR: f64 = 1e-4;

/// An opaque object that blocks most rays between a light and the visible surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LightBlocker {
    pub object: usize,
    /// The light whose rays it blocks.
    pub light: FindingSubject,
}

/// Search for an object that blocks the rays from lights to visible points.
pub(super) struct LightBlockerTask<'a> {
    pub scene_facts: &'a SceneFacts<'a>,
    /// Visible points, slightly in front of their surfaces, in metres.
    pub seen: Vec<DVec3>,
}

/// A straight path from a light to a visible point. `own` is the index of the light if it is an
/// emissive object: it does not block its own light.
struct LightPath {
    light: FindingSubject,
    from: DVec3,
    to: DVec3,
    own: Option<usize>,
}

impl PreparedSceneTask for LightBlockerTask<'_> {
    type Output = Option<LightBlocker>;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> Option<LightBlocker> {
        let mut counts: BTreeMap<FindingSubject, BTreeMap<Option<usize>, u64>> = BTreeMap::new();
        for path in self.light_paths() {
            let object = self.find_blocker(prepared, &path);
            let of_light = counts.entry(path.light).or_default();
            *of_light.entry(object).or_insert(0) += 1;
        }
        counts.into_iter().find_map(|(light, of_light)| {
            let total: u64 = of_light.values().sum();
            let free = of_light.get(&None).copied().unwrap_or(0);
            let most = of_light
                .into_iter()
                .max_by_key(|(object, count)| (object.is_some(), *count))?;
            let object = most.0.filter(|_| free <= FREE * total / 100)?;
            Some(LightBlocker { object, light })
        })
    }
}

impl LightBlockerTask<'_> {
    fn light_paths(&self) -> Vec<LightPath> {
        let scene = self.scene_facts.scene;
        let far = 2.0 * self.scene_facts.bounds_diagonal() + 1.0;
        let seen = || self.seen.iter().take(PLACES).copied();
        let mut paths = Vec::new();
        for (index, light) in scene.lights.iter().enumerate().take(LIGHTS) {
            let from = |to: DVec3| match light.kind {
                LightKind::Directional { to_light } => {
                    to + DVec3::from(to_light).normalize_or_zero() * far
                }
                LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
                    position.into()
                }
            };
            paths.extend(seen().map(|to| LightPath {
                light: FindingSubject::Light(index),
                from: from(to),
                to,
                own: None,
            }));
        }
        let objects = self.scene_facts.objects.iter().enumerate();
        for (index, object_facts) in objects.filter(|(_, o)| o.emits_light()).take(LIGHTS) {
            let Some(bounds) = object_facts.bounds else {
                continue;
            };
            paths.extend(seen().map(|to| LightPath {
                light: object_facts.subject,
                from: bounds.centre(),
                to,
                own: Some(index),
            }));
        }
        let is_dark = matches!(scene.sky, None | Some(Sky::Constant(Colour::BLACK)));
        if paths.is_empty() && !is_dark {
            for (index, to) in seen().enumerate() {
                paths.extend((0..DIRECTIONS).filter_map(|i| {
                    let number = |axis| 2.0 * unit_random(index as u64, i, axis) - 1.0;
                    let direction = DVec3::from([0, 1, 2].map(number)).try_normalize()?;
                    Some(LightPath {
                        light: FindingSubject::Sky,
                        from: to + direction * far,
                        to,
                        own: None,
                    })
                }));
            }
        }
        paths
    }

    /// Returns the first opaque object on a path, or `None` if the path is unblocked.
    fn find_blocker<R: Real>(
        &self,
        prepared: &PreparedScene<R>,
        path: &LightPath,
    ) -> Option<usize> {
        let distance = path.from.distance(path.to);
        let direction = (path.to - path.from).try_normalize()?;
        let from = path.from - prepared.origin.origin;
        let [start, direction] = [from, direction].map(R::Vec3::from_f64);
        let ray = Ray::new(start, direction);
        let hits = hits_along_ray(&prepared.geometry, &ray, Interval::positive());
        let objects = hits.take(HITS).map(|hit| {
            let object = self.scene_facts.facts_index(hit.outermost_id());
            (object, hit.t.to_f64() < distance * (1.0 - NEAR))
        });
        let is_opaque = |object: usize| {
            path.own != Some(object)
                && self.scene_facts.objects[object].surface_kind == SurfaceKind::Opaque
        };
        let mut opaque = objects.filter(|(object, _)| is_opaque(*object));
        opaque
            .next()
            .and_then(|(object, is_before)| is_before.then_some(object))
    }
}
