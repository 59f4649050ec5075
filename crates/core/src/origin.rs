//! The origin from which coordinates are stored. f32 has seven digits, and a model far from zero
//! spends them on where it is; counted from an origin near the model, they are left for its shape.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::transform_bounds;
use raywright_bvh::{Aabb, Real, Shape as _};

use crate::affine::affine;
use crate::generate::all;
use crate::lookup::Lookup;
use crate::motion::ends;
use crate::nearby::{FAR, near};
use crate::scene::{Camera, Light, LightKind, Object, Pose, Scene, Shape, Triple};
use crate::shape::any_shape;

/// Share of an object's size that stored coordinates have to tell apart.
const RESOLVED: f64 = 1e-3;

/// Where a scene's coordinates are counted from in a precision.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StorageOrigin {
    /// The origin; zero for a scene that is not far.
    pub origin: DVec3,
    /// The first object of which the precision can't tell points a thousandth of its size apart
    /// even so; by index of the scene's objects, generated ones last.
    pub unresolved: Option<u32>,
}

impl StorageOrigin {
    /// Of a scene: near everything where all of it is far from zero; else near what is far, where
    /// more is seen from there.
    pub fn of<R: Real>(scene: &Scene, lookup: &Lookup<'_>) -> Self {
        let from_zero = Survey::from::<R>(DVec3::ZERO, scene, lookup);
        let near_all = near(&from_zero.bounds, FAR);
        let found = match near_all == DVec3::ZERO {
            false => Survey::from::<R>(near_all, scene, lookup),
            true if from_zero.unresolved == 0 => from_zero,
            true => {
                let near_far = Survey::from::<R>(near(&from_zero.lost, FAR), scene, lookup);
                if near_far.unresolved < from_zero.unresolved {
                    near_far
                } else {
                    from_zero
                }
            }
        };
        Self {
            origin: found.origin,
            unresolved: found.first,
        }
    }
}

/// What of a scene stored coordinates resolve that are counted from an origin.
#[derive(Clone, Copy)]
struct Survey {
    origin: DVec3,
    /// Around everything that has an end.
    bounds: Aabb,
    /// Around what is not resolved.
    lost: Aabb,
    /// How many triangles and shapes are not resolved.
    unresolved: u64,
    /// The first object that is not.
    first: Option<u32>,
}

impl Survey {
    fn from<R: Real>(origin: DVec3, scene: &Scene, lookup: &Lookup<'_>) -> Self {
        let mut found = Self {
            origin,
            bounds: Aabb::EMPTY,
            lost: Aabb::EMPTY,
            unresolved: 0,
            first: None,
        };
        let mut meshes: HashMap<&str, Aabb> = HashMap::new();
        // What a generator makes differs in its places alone.
        let mut last: Option<(&Object, Option<OwnBox>)> = None;
        for (index, shown) in all(scene).enumerate() {
            let own = match last {
                Some((object, own)) if core::ptr::eq(object, shown.object) => own,
                _ => OwnBox::of(shown.object, lookup, &mut meshes),
            };
            last = Some((shown.object, own));
            let Some(OwnBox {
                bounds,
                size,
                parts,
            }) = own
            else {
                continue;
            };
            let place = shown.place.unwrap_or_default();
            let bounds = Aabb {
                min: bounds.min + place,
                max: bounds.max + place,
            };
            found.bounds = found.bounds.union(bounds);
            let farthest = (bounds.min - origin)
                .abs()
                .max((bounds.max - origin).abs())
                .max_element();
            // The step of the stored scalar there.
            if 2.0 * R::ROUNDOFF.to_f64() * farthest > RESOLVED * size && size > 0.0 {
                found.lost = found.lost.union(bounds);
                found.unresolved = found.unresolved.saturating_add(parts);
                found.first = found.first.or(u32::try_from(index).ok());
            }
        }
        found
    }
}

/// The box around an object where no generator moves it, at any time.
#[derive(Clone, Copy)]
struct OwnBox {
    bounds: Aabb,
    /// Its longest edge at one time.
    size: f64,
    /// Triangles, or one.
    parts: u64,
}

impl OwnBox {
    /// None of what has no end, and of nothing.
    fn of<'a>(
        object: &'a Object,
        lookup: &Lookup<'_>,
        meshes: &mut HashMap<&'a str, Aabb>,
    ) -> Option<Self> {
        let (own, parts) = match &object.shape {
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
            Some(transform_bounds(&map, &own)).filter(|bounds| bounds.padded().is_some())
        };
        let (start, end) = (at(start).filter(|_| !own.is_empty())?, at(end)?);
        Some(Self {
            bounds: start.union(end),
            size: start.extent().max_element(),
            parts,
        })
    }
}

fn less(point: Triple, origin: DVec3) -> Triple {
    (DVec3::from(point) - origin).into()
}

/// A light as it stands about an origin.
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

/// A camera as it stands about an origin.
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
