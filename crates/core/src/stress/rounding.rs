//! How much of an object is seen otherwise for the rounding of its coordinates: rays of the cameras
//! that meet it in the precision of the settings and in doubles.

use glam::DVec3;
use raywright_bvh::{Aabb, Interval, Ray, Real, Vector};

use super::cameras::CameraView;
use super::facts::SceneFacts;
use crate::dispatch::{PreparedSceneTask, ReadyScene};
use crate::prepare::PreparedScene;

/// Rays along the width and the height of the part of a picture in which an object is.
const GRID: usize = 96;
/// Cosine of the angle between two normals that look alike: two degrees.
const ALIKE: f64 = 0.9994;
/// Share of its rays, and area in pixels, up to which what is seen otherwise is not seen.
const SHARE: f64 = 0.01;
const PIXELS: f64 = 1.0;

/// What rays of all cameras saw of an object in two precisions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RoundingEffect {
    /// Rays that meet the object in either precision, and those of which the object or its normal
    /// differs.
    pub rays: u64,
    pub changed: u64,
    /// The greatest area of a picture that differs, in pixels.
    pub area: f64,
}

impl RoundingEffect {
    /// The effect on two objects.
    pub fn plus(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            changed: self.changed + other.changed,
            area: self.area.max(other.area),
        }
    }

    /// Whether a picture shows it.
    pub fn is_seen(&self) -> bool {
        self.changed as f64 > SHARE * self.rays as f64 && self.area > PIXELS
    }
}

/// Compares what the cameras see of an object.
pub(super) fn effect(
    scene_facts: &SceneFacts<'_>,
    [robust, exact]: [&ReadyScene; 2],
    views: &[CameraView],
    object: usize,
) -> RoundingEffect {
    let mut effect = RoundingEffect::default();
    for view in views {
        let [low, high] = rectangle(view, scene_facts.objects[object].bounds);
        let at = |index: usize| {
            let share = [index % GRID, index / GRID].map(|i| (i as f64 + 0.5) / GRID as f64);
            view.ray_through_pixel(
                [0, 1].map(|axis| low[axis] + share[axis] * (high[axis] - low[axis])),
            )
        };
        let rays = PrimaryRays {
            scene_facts,
            rays: (0..GRID * GRID).map(at).collect(),
        };
        let pairs = robust
            .run_task(&rays)
            .into_iter()
            .zip(exact.run_task(&rays));
        let (mut met, mut changed) = (0_u64, 0_u64);
        for (a, b) in pairs {
            let meets = |hit: &Option<(usize, DVec3)>| hit.is_some_and(|(of, _)| of == object);
            if !meets(&a) && !meets(&b) {
                continue;
            }
            met += 1;
            let is_same = match (a, b) {
                (Some((of, normal)), Some((other, exact_normal))) => {
                    of == other && normal.dot(exact_normal) >= ALIKE
                }
                _ => false,
            };
            changed += u64::from(!is_same);
        }
        let pixels = (high[0] - low[0]) * (high[1] - low[1]);
        effect.rays += met;
        effect.changed += changed;
        effect.area = effect
            .area
            .max(pixels * changed as f64 / (GRID * GRID) as f64);
    }
    effect
}

/// The part of a picture in which a box is, all of it where a corner is out of view.
fn rectangle(view: &CameraView, bounds: Option<Aabb>) -> [[f64; 2]; 2] {
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

/// What rays in the world meet first, with its normal.
struct PrimaryRays<'a> {
    scene_facts: &'a SceneFacts<'a>,
    rays: Vec<Ray<f64>>,
}

impl PreparedSceneTask for PrimaryRays<'_> {
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
