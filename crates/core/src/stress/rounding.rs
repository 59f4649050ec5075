//! Visible effect of coarse coordinates on an object. The same rays are traced in the precision of
//! the settings and in double precision.

use std::collections::BTreeMap;

use glam::DVec3;
use raywright_bvh::{Aabb, Interval, Ray, Real, Vector};

use super::cameras::CameraView;
use super::facts::SceneFacts;
use crate::dispatch::{PreparedSceneTask, ReadyScene};
use crate::prepare::PreparedScene;

/// Number of rays along the width and the height of the rectangle that an object covers in the
/// picture.
const GRID: usize = 96;
/// `FOCUSED`: greatest number of objects with rays of their own. For more objects, all share the
/// rays of the whole picture: `SHARED_GRID` along its width and along its height.
const FOCUSED: usize = 32;
const SHARED_GRID: usize = 512;
/// Cosine of two degrees: normals with a smaller angle between them look alike.
const ALIKE: f64 = 0.9994;
/// A difference is not visible up to these limits. `SHARE`: share of the object's rays. `PIXELS`:
/// area in pixels.
const SHARE: f64 = 0.01;
const PIXELS: f64 = 1.0;

/// Difference between the rays to an object in two precisions, over all cameras.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RoundingEffect {
    /// `rays`: number of rays that hit the object in either precision. `changed`: number of these
    /// rays for which the hit object or its normal differs.
    pub rays: u64,
    pub changed: u64,
    /// Greatest differing area in the picture of a camera, in pixels.
    pub area: f64,
}

impl RoundingEffect {
    /// Returns the combined effect on two objects.
    pub fn plus(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            changed: self.changed + other.changed,
            area: self.area.max(other.area),
        }
    }

    /// Returns whether the effect is visible in a picture.
    pub fn is_visible(&self) -> bool {
        self.changed as f64 > SHARE * self.rays as f64 && self.area > PIXELS
    }
}

/// Compares the cameras' rays to each object in two precisions: that of the settings and double.
/// Many objects share the rays of the whole picture, so that the time does not grow with their
/// number.
pub(super) fn measure_rounding_effects(
    scene_facts: &SceneFacts<'_>,
    ready: [&ReadyScene; 2],
    views: &[CameraView],
    objects: &[usize],
) -> BTreeMap<usize, RoundingEffect> {
    let none = |&object: &usize| (object, RoundingEffect::default());
    let mut effects: BTreeMap<_, _> = objects.iter().map(none).collect();
    for view in views {
        if objects.len() > FOCUSED {
            let whole = [[0.0; 2], view.size.map(f64::from)];
            add_camera_differences(scene_facts, ready, (view, whole, SHARED_GRID), &mut effects);
            continue;
        }
        for &object in objects {
            let part = picture_rectangle_of_box(view, scene_facts.objects[object].bounds);
            let mut own = BTreeMap::from([none(&object)]);
            add_camera_differences(scene_facts, ready, (view, part, GRID), &mut own);
            for (object, effect) in own {
                let sum = effects.entry(object).or_default();
                *sum = sum.plus(effect);
            }
        }
    }
    effects
}

/// Traces a grid of rays through a rectangle of a camera's picture, and adds the differences to the
/// effects of the objects.
fn add_camera_differences(
    scene_facts: &SceneFacts<'_>,
    [robust, exact]: [&ReadyScene; 2],
    (view, [low, high], grid): (&CameraView, [[f64; 2]; 2], usize),
    effects: &mut BTreeMap<usize, RoundingEffect>,
) {
    let at = |index: usize| {
        let share = [index % grid, index / grid].map(|i| (i as f64 + 0.5) / grid as f64);
        view.ray_through_pixel(
            [0, 1].map(|axis| low[axis] + share[axis] * (high[axis] - low[axis])),
        )
    };
    let rays = FirstHitTask {
        scene_facts,
        rays: (0..grid * grid).map(at).collect(),
    };
    let pixels = (high[0] - low[0]) * (high[1] - low[1]) / (grid * grid) as f64;
    let mut areas: BTreeMap<usize, f64> = BTreeMap::new();
    let pairs = robust
        .run_task(&rays)
        .into_iter()
        .zip(exact.run_task(&rays));
    for (a, b) in pairs {
        let is_same = match (a, b) {
            (Some((object, normal)), Some((other, exact_normal))) => {
                object == other && normal.dot(exact_normal) >= ALIKE
            }
            _ => false,
        };
        let [first, second] = [a, b].map(|hit| hit.map(|(object, _)| object));
        for object in [first, second.filter(|_| first != second)]
            .into_iter()
            .flatten()
        {
            let Some(effect) = effects.get_mut(&object) else {
                continue;
            };
            effect.rays += 1;
            if !is_same {
                effect.changed += 1;
                *areas.entry(object).or_default() += pixels;
            }
        }
    }
    for (object, area) in areas {
        if let Some(effect) = effects.get_mut(&object) {
            effect.area = effect.area.max(area);
        }
    }
}

/// Returns the rectangle of the picture that a box covers, with a margin. Returns the whole picture
/// if a corner of the box is out of view.
fn picture_rectangle_of_box(view: &CameraView, bounds: Option<Aabb>) -> [[f64; 2]; 2] {
    let whole = [[0.0; 2], view.size.map(f64::from)];
    let Some(bounds) = bounds else {
        return whole;
    };
    let corner = |i: u32| {
        let high = glam::BVec3::new(i & 1 == 1, i & 2 == 2, i & 4 == 4);
        view.project_point(DVec3::select(high, bounds.max, bounds.min))
    };
    let Some(corners) = (0..8).map(corner).collect::<Option<Vec<[f64; 2]>>>() else {
        return whole;
    };
    let ends = corners
        .iter()
        .fold([[f64::INFINITY; 2], [0.0; 2]], |[low, high], corner| {
            [
                [low[0].min(corner[0]), low[1].min(corner[1])],
                [high[0].max(corner[0]), high[1].max(corner[1])],
            ]
        });
    // What is displaced may be beside its place.
    let margin = 1.0_f64.max(0.2 * (ends[1][0] - ends[0][0]).max(ends[1][1] - ends[0][1]));
    [0, 1].map(|end| {
        [0, 1].map(|axis| {
            let moved = ends[end][axis] + if end == 0 { -margin } else { margin };
            moved.clamp(0.0, whole[1][axis])
        })
    })
}

/// Task that finds the first hit of camera rays: the object and its normal. Rays are in world
/// space.
struct FirstHitTask<'a> {
    scene_facts: &'a SceneFacts<'a>,
    rays: Vec<Ray<f64>>,
}

impl PreparedSceneTask for FirstHitTask<'_> {
    type Output = Vec<Option<(usize, DVec3)>>;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> Self::Output {
        let first = |ray: &Ray<f64>| {
            let from = ray.origin - prepared.origin.origin;
            let [from, direction] = [from, ray.direction].map(R::Vec3::from_f64);
            let ray = Ray::new(from, direction).as_camera_ray();
            let hit = prepared
                .geometry
                .closest(&ray, Interval::positive(), &mut ())?;
            let normal = prepared.geometry.surface(&ray, &hit).normal.to_f64();
            Some((self.scene_facts.facts_index(hit.outermost_id()), normal))
        };
        self.rays.iter().map(first).collect()
    }
}
