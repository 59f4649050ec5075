//! Where a scene is, from its data alone: framing a camera needs no tree.

mod uses;

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::transform_bounds;
use raywright_bvh::shapes::{TransformedShape, Triangle};
use raywright_bvh::{Aabb, Real, Shape as _, Vector};

use crate::generate::all;
use crate::lookup::Lookup;
use crate::scene::{MeshData, Scene, Shape};
use crate::shape::any_shape;
pub(crate) use uses::Uses;

/// Where a scene is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// The box around everything that has an end; empty when there is nothing.
    pub bounds: Aabb,
    /// How many objects have no end.
    pub unbounded: usize,
}

/// The extent of a scene whose numbers are stored in a precision: to the bit that of the geometry that would be built. What can't
/// be built has no place.
pub(crate) fn extent<R: Real>(scene: &Scene, lookup: &Lookup<'_>) -> Extent {
    let uses = Uses::of(scene);
    let mut shared: HashMap<&str, Aabb> = HashMap::new();
    let mut whole = Extent { bounds: Aabb::EMPTY, unbounded: 0 };
    for shown in all(scene) {
        let (object, map, ends) = (shown.object, shown.map(), shown.ends());
        // A point on its way is between its ends.
        let instance = |own: Aabb| match ends {
            None => transform_bounds(&map, &own),
            Some([start, end]) => transform_bounds(&start, &own).union(transform_bounds(&end, &own)),
        };
        match &object.shape {
            Shape::Mesh(name) => {
                let Some(data) = lookup.mesh_data(name) else { continue };
                if uses.share(name, object.side) {
                    let own = shared.entry(name.as_str()).or_insert_with(|| around::<R>(data, None));
                    if !own.is_empty() {
                        whole.include(Some(instance(*own)));
                    }
                } else {
                    whole.include(Some(around::<R>(data, Some(map))));
                }
            }
            shape if ends.is_some() => {
                let Some(shape) = any_shape::<R>(shape, DVec3::ZERO) else { continue };
                whole.include(shape.bounds().map(instance));
            }
            shape if map.matrix3 == DMat3::IDENTITY => {
                whole.include(any_shape::<R>(shape, map.translation).and_then(|shape| shape.bounds()));
            }
            shape => {
                let placed = any_shape(shape, DVec3::ZERO).and_then(|shape| TransformedShape::<R>::new(shape, map));
                if let Some(placed) = placed {
                    whole.include(placed.bounds());
                }
            }
        }
    }
    whole
}

impl Extent {
    /// As a geometry takes in a primitive with this box: what no tree can hold counts as without end.
    fn include(&mut self, bounds: Option<Aabb>) {
        match bounds {
            Some(bounds) if bounds.is_empty() => {}
            Some(bounds) if bounds.padded().is_some() => self.bounds = self.bounds.union(bounds),
            _ => self.unbounded += 1,
        }
    }
}

/// The box around the triangles of a mesh, as they are stored, under a map or in their own space.
fn around<R: Real>(data: &MeshData, map: Option<DAffine3>) -> Aabb {
    let position = |i: u32| {
        let p = DVec3::from(data.positions[i as usize].map(f64::from));
        Vector::from_f64(map.map_or(p, |map| map.transform_point3(p)))
    };
    let boxes = data.indices.iter().filter_map(|corners| Triangle::<R>::new(corners.map(position)).bounds());
    boxes.fold(Aabb::EMPTY, Aabb::union)
}

#[cfg(test)]
mod tests;
