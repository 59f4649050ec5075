//! Storage origin of a scene: the point to which stored coordinates are relative. An `f32` has
//! seven digits. Far from zero, most of them describe the position of a model. Relative to an
//! origin near the model, all digits describe its shape.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::transform_bounds;
use raywright_bvh::{Aabb, Real, Shape as _};

use crate::affine::affine_from_steps;
use crate::generate::all_objects;
use crate::lookup::SceneLookup;
use crate::motion::object_transforms_at_ends;
use crate::origin_grid::{SCENE_DISTANCE_LIMIT, storage_origin_near};
use crate::scene::{Camera, Light, LightKind, Object, Pose, Scene, Shape, Triple};
use crate::shape::{convert_moved_shape, mesh_bounds};

/// Distance that stored coordinates must resolve, as a fraction of an object's size.
const RESOLVED: f64 = 1e-3;

/// Storage origin of a scene for coordinates of a scalar type.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StorageOrigin {
    /// The origin; zero for a scene near zero.
    pub origin: DVec3,
    /// Index of the first unresolved object, where generated objects come last. In an unresolved
    /// object, stored coordinates do not distinguish points that are a thousandth of the object's
    /// size apart. `None` if all objects are resolved.
    pub unresolved: Option<u32>,
}

impl StorageOrigin {
    /// Chooses the origin of a scene. If the whole scene is far from zero, the origin is near all
    /// objects. If only some objects are far and unresolved, the origin is near these objects,
    /// provided that it resolves more triangles and shapes.
    pub fn from_scene<R: Real>(scene: &Scene, lookup: &SceneLookup<'_>) -> Self {
        let from_zero = ResolutionSurvey::survey_objects::<R>(DVec3::ZERO, scene, lookup);
        let near_all = storage_origin_near(&from_zero.bounds, SCENE_DISTANCE_LIMIT);
        let origin_survey = match near_all == DVec3::ZERO {
            false => ResolutionSurvey::survey_objects::<R>(near_all, scene, lookup),
            true if from_zero.unresolved == 0 => from_zero,
            true => {
                let near_far = ResolutionSurvey::survey_objects::<R>(
                    storage_origin_near(&from_zero.unresolved_bounds, SCENE_DISTANCE_LIMIT),
                    scene,
                    lookup,
                );
                if near_far.unresolved < from_zero.unresolved {
                    near_far
                } else {
                    from_zero
                }
            }
        };
        Self {
            origin: origin_survey.origin,
            unresolved: origin_survey.first_unresolved,
        }
    }
}

/// Returns the spacing of stored numbers at the farthest coordinate of a box from the origin.
pub(crate) fn coordinate_spacing_in_box<R: Real>(bounds: &Aabb, origin: DVec3) -> f64 {
    let farthest = (bounds.min - origin).abs().max((bounds.max - origin).abs());
    2.0 * R::ROUNDOFF.to_f64() * farthest.max_element()
}

/// Whether stored coordinates distinguish points of an object that are a thousandth of its size
/// apart. True for an object of size zero.
pub(crate) fn resolves_object_shape<R: Real>(bounds: &Aabb, size: f64, origin: DVec3) -> bool {
    coordinate_spacing_in_box::<R>(bounds, origin) <= RESOLVED * size || size <= 0.0
}

/// Result of a survey: the objects whose shape coordinates relative to an origin resolve or do not.
#[derive(Clone, Copy)]
struct ResolutionSurvey {
    origin: DVec3,
    /// Box around all bounded objects, in scene coordinates.
    bounds: Aabb,
    /// Box around the unresolved objects, in scene coordinates.
    unresolved_bounds: Aabb,
    /// Number of unresolved triangles and shapes.
    unresolved: u64,
    /// Index of the first unresolved object.
    first_unresolved: Option<u32>,
}

impl ResolutionSurvey {
    /// Surveys all objects of a scene for the scalar `R`.
    fn survey_objects<R: Real>(origin: DVec3, scene: &Scene, lookup: &SceneLookup<'_>) -> Self {
        let mut origin_survey = Self {
            origin,
            bounds: Aabb::EMPTY,
            unresolved_bounds: Aabb::EMPTY,
            unresolved: 0,
            first_unresolved: None,
        };
        let mut meshes: HashMap<&str, Aabb> = HashMap::new();
        // The objects of a generator differ only in their offset, so the last box is reused.
        let mut last: Option<(&Object, Option<ObjectBox>)> = None;
        for (index, placed_object) in all_objects(scene).enumerate() {
            let own = match last {
                Some((object, own)) if core::ptr::eq(object, placed_object.object) => own,
                _ => ObjectBox::from_object(placed_object.object, lookup, &mut meshes),
            };
            last = Some((placed_object.object, own));
            let Some(ObjectBox {
                bounds,
                size,
                primitives: parts,
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
            if !resolves_object_shape::<R>(&bounds, size, origin) {
                origin_survey.unresolved_bounds = origin_survey.unresolved_bounds.union(bounds);
                origin_survey.unresolved = origin_survey.unresolved.saturating_add(parts);
                origin_survey.first_unresolved =
                    origin_survey.first_unresolved.or(u32::try_from(index).ok());
            }
        }
        origin_survey
    }
}

/// Box around an object over its whole motion. A generator's offset is not included.
#[derive(Clone, Copy)]
struct ObjectBox {
    bounds: Aabb,
    /// Longest edge of the box at time 0.
    size: f64,
    /// Number of triangles; one for a shape.
    primitives: u64,
}

impl ObjectBox {
    /// Computes the box of an object; `None` for an unbounded object and for one without area. `meshes` caches the
    /// boxes of meshes.
    fn from_object<'a>(
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
                        .or_insert_with(|| mesh_bounds::<f64>(data, Some(DAffine3::IDENTITY))),
                    data.indices.len() as u64,
                )
            }
            shape => (convert_moved_shape::<f64>(shape, DVec3::ZERO)?.bounds()?, 1),
        };
        let [start, end] = object_transforms_at_ends(object)
            .unwrap_or_else(|| [affine_from_steps(&object.transform); 2]);
        let at = |map: DAffine3| {
            let bounds = transform_bounds(&map, &own_bounds);
            (bounds.has_area() && bounds.to_padded().is_some()).then_some(bounds)
        };
        let (start, end) = (at(start).filter(|_| !own_bounds.is_empty())?, at(end)?);
        Some(Self {
            bounds: start.union(end),
            size: start.extent().max_element(),
            primitives: parts,
        })
    }
}

/// Returns the coordinates of a point of the scene, relative to an origin.
fn subtract_origin(point: Triple, origin: DVec3) -> Triple {
    (DVec3::from(point) - origin).into()
}

/// Returns a light with its position relative to an origin.
pub(crate) fn light_relative_to(origin: DVec3, light: &Light) -> Light {
    let mut light = light.clone();
    match &mut light.kind {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
            *position = subtract_origin(*position, origin)
        }
        LightKind::Directional { .. } => {}
    }
    light
}

/// Returns a camera with its poses relative to an origin.
pub(crate) fn camera_relative_to(origin: DVec3, camera: &Camera) -> Camera {
    let about = |pose: &mut Pose| match pose {
        Pose::LookAt { eye, target, .. } => {
            (*eye, *target) = (
                subtract_origin(*eye, origin),
                subtract_origin(*target, origin),
            )
        }
        Pose::Orbit { target, .. } => *target = subtract_origin(*target, origin),
        Pose::Axes { eye, .. } => *eye = subtract_origin(*eye, origin),
    };
    let mut camera = camera.clone();
    about(&mut camera.pose);
    camera.pose_end.iter_mut().for_each(about);
    camera
}

#[cfg(test)]
mod tests;
