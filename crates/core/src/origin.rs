//! Storage origin of a scene's coordinates. An `f32` has seven digits, and the coordinates of a
//! model far from zero use them for its position. Relative to an origin near the model, all digits
//! describe its shape.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::transform_bounds;
use raywright_bvh::{Aabb, Real, Shape as _};

use crate::affine::affine;
use crate::generate::all;
use crate::lookup::SceneLookup;
use crate::motion::ends;
use crate::nearby::{FAR, near};
use crate::scene::{Camera, Light, LightKind, Object, Pose, Scene, Shape, Triple};
use crate::shape::any_shape;

/// Fraction of an object's size that stored coordinates must resolve.
const RESOLVED: f64 = 1e-3;

/// Storage origin of a scene for a scalar type.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StorageOrigin {
    /// The origin; zero for a scene near zero.
    pub origin: DVec3,
    /// Index of the first object that is not resolved, generated objects last: relative to the
    /// origin, the scalar does not distinguish points a thousandth of the object's size apart.
    /// `None` if all objects are resolved.
    pub unresolved: Option<u32>,
}

impl StorageOrigin {
    /// Chooses the origin of a scene. If the whole scene is far from zero, the origin is near all
    /// objects. If only some objects are far and unresolved, the origin is near these, provided
    /// that more is resolved then.
    pub fn from_scene<R: Real>(scene: &Scene, lookup: &SceneLookup<'_>) -> Self {
        let from_zero = OriginSurvey::from::<R>(DVec3::ZERO, scene, lookup);
        let near_all = near(&from_zero.bounds, FAR);
        let origin_survey = match near_all == DVec3::ZERO {
            false => OriginSurvey::from::<R>(near_all, scene, lookup),
            true if from_zero.unresolved == 0 => from_zero,
            true => {
                let near_far = OriginSurvey::from::<R>(near(&from_zero.lost, FAR), scene, lookup);
                if near_far.unresolved < from_zero.unresolved {
                    near_far
                } else {
                    from_zero
                }
            }
        };
        Self {
            origin: origin_survey.origin,
            unresolved: origin_survey.first,
        }
    }
}

/// Survey of the objects that coordinates relative to an origin resolve.
#[derive(Clone, Copy)]
struct OriginSurvey {
    origin: DVec3,
    /// Box around all bounded objects, in scene coordinates.
    bounds: Aabb,
    /// Box around the unresolved objects, in scene coordinates.
    lost: Aabb,
    /// Number of unresolved triangles and shapes.
    unresolved: u64,
    /// Index of the first unresolved object.
    first: Option<u32>,
}

impl OriginSurvey {
    /// Surveys all objects of a scene for the scalar `R`.
    fn from<R: Real>(origin: DVec3, scene: &Scene, lookup: &SceneLookup<'_>) -> Self {
        let mut origin_survey = Self {
            origin,
            bounds: Aabb::EMPTY,
            lost: Aabb::EMPTY,
            unresolved: 0,
            first: None,
        };
        let mut meshes: HashMap<&str, Aabb> = HashMap::new();
        // The objects of a generator differ only in their offset, so the last box is reused.
        let mut last: Option<(&Object, Option<OwnBox>)> = None;
        for (index, placed_object) in all(scene).enumerate() {
            let own = match last {
                Some((object, own)) if core::ptr::eq(object, placed_object.object) => own,
                _ => OwnBox::of(placed_object.object, lookup, &mut meshes),
            };
            last = Some((placed_object.object, own));
            let Some(OwnBox {
                bounds,
                size,
                parts,
            }) = own
            else {
                continue;
            };
            let position = placed_object.position.unwrap_or_default();
            let bounds = Aabb {
                min: bounds.min + position,
                max: bounds.max + position,
            };
            origin_survey.bounds = origin_survey.bounds.union(bounds);
            let farthest = (bounds.min - origin)
                .abs()
                .max((bounds.max - origin).abs())
                .max_element();
            // The left side is the spacing of the scalar at the farthest coordinate.
            if 2.0 * R::ROUNDOFF.to_f64() * farthest > RESOLVED * size && size > 0.0 {
                origin_survey.lost = origin_survey.lost.union(bounds);
                origin_survey.unresolved = origin_survey.unresolved.saturating_add(parts);
                origin_survey.first = origin_survey.first.or(u32::try_from(index).ok());
            }
        }
        origin_survey
    }
}

/// Box around an object over its whole motion, without the offset of a generator.
#[derive(Clone, Copy)]
struct OwnBox {
    bounds: Aabb,
    /// Longest edge of the box at time 0.
    size: f64,
    /// Number of triangles; one for a shape.
    parts: u64,
}

impl OwnBox {
    /// Computes the box of an object; `None` for an unbounded or empty object. `meshes` caches the
    /// boxes of meshes.
    fn of<'a>(
        object: &'a Object,
        lookup: &SceneLookup<'_>,
        meshes: &mut HashMap<&'a str, Aabb>,
    ) -> Option<Self> {
        let (own_bounds, parts) = match &object.shape {
            Shape::Mesh(name) => {
                let data = lookup.mesh_data(name)?;
                (
                    *meshes
                        .entry(name)
                        .or_insert_with(|| Aabb::from_points(data.positions.iter())),
                    data.indices.len() as u64,
                )
            }
            shape => (any_shape::<f64>(shape, DVec3::ZERO)?.bounds()?, 1),
        };
        let [start, end] = ends(object).unwrap_or_else(|| [affine(&object.transform); 2]);
        let at = |map: DAffine3| {
            Some(transform_bounds(&map, &own_bounds)).filter(|bounds| bounds.padded().is_some())
        };
        let (start, end) = (at(start).filter(|_| !own_bounds.is_empty())?, at(end)?);
        Some(Self {
            bounds: start.union(end),
            size: start.extent().max_element(),
            parts,
        })
    }
}

/// Returns a point relative to an origin.
fn less(point: Triple, origin: DVec3) -> Triple {
    (DVec3::from(point) - origin).into()
}

/// Returns a light with its position relative to an origin.
pub(crate) fn light_about(origin: DVec3, light: &Light) -> Light {
    let mut light = light.clone();
    match &mut light.kind {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
            *position = less(*position, origin)
        }
        LightKind::Directional { .. } => {}
    }
    light
}

/// Returns a camera with its poses relative to an origin.
pub(crate) fn camera_about(origin: DVec3, camera: &Camera) -> Camera {
    let about = |pose: &mut Pose| match pose {
        Pose::LookAt { eye, target, .. } => {
            (*eye, *target) = (less(*eye, origin), less(*target, origin))
        }
        Pose::Orbit { target, .. } => *target = less(*target, origin),
        Pose::Axes { eye, .. } => *eye = less(*eye, origin),
    };
    let mut camera = camera.clone();
    about(&mut camera.pose);
    camera.pose_end.iter_mut().for_each(about);
    camera
}

#[cfg(test)]
mod tests;
