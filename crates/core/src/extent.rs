//! Extent of a scene: the box of its objects, computed from the scene's data alone. A camera can
//! then be framed without an acceleration structure.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{TransformedShape, Triangle, transform_bounds};
use raywright_bvh::{Aabb, Real, Shape as _};

use crate::generate::{objects_relative_to, objects_with_counts};
use crate::lookup::SceneLookup;
use crate::motion::object_transforms_at_ends;
use crate::scene::{MeshData, Scene, Shape, SideRule};
use crate::shape::{convert_shape, convert_shape_in_own_space, mesh_bounds, transform_relative_to};
use crate::storage_origin::StorageOrigin;

/// Extent of a scene in world units: the box of its bounded objects, and the number of its
/// unbounded objects, such as planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneExtent {
    /// Box around all bounded objects; empty without objects.
    pub bounds: Aabb,
    /// Number of unbounded objects.
    pub unbounded: usize,
}

/// Returns the extent of a scene whose coordinates are stored as `R`. To the bit, it equals the
/// extent of the built geometry. Objects that cannot be built do not count.
pub(crate) fn scene_extent<R: Real>(scene: &Scene, lookup: &SceneLookup<'_>) -> SceneExtent {
    let origin = StorageOrigin::from_scene::<R>(scene, lookup).origin;
    let mut extent = SceneExtent {
        bounds: Aabb::EMPTY,
        unbounded: 0,
    };
    visit_object_boxes::<R>(
        (scene, lookup, origin),
        |_| true,
        |_, bounds| extent.include_box(bounds),
    );
    let Aabb { min, max } = extent.bounds;
    SceneExtent {
        bounds: Aabb {
            min: min + origin,
            max: max + origin,
        },
        ..extent
    }
}

/// Calls `visit` with the index of each wanted object and its box relative to `origin`, `None` if it
/// is unbounded. Objects that cannot be built are left out.
pub(crate) fn visit_object_boxes<R: Real>(
    (scene, lookup, origin): (&Scene, &SceneLookup<'_>, DVec3),
    is_wanted: impl Fn(usize) -> bool,
    mut visit: impl FnMut(usize, Option<Aabb>),
) {
    let uses = MeshUseCounts::from_scene(scene);
    let mut shared: HashMap<&str, Aabb> = HashMap::new();
    for (index, placed_object) in objects_relative_to(scene, origin).enumerate() {
        if !is_wanted(index) {
            continue;
        }
        let (object, map, ends) = (
            placed_object.object,
            placed_object.object_to_world(),
            placed_object.object_to_world_at_ends(),
        );
        // A moving point stays on the segment between its ends, so the union of the boxes at both
        // ends contains it.
        let instance = |own_bounds: Aabb, origin: DVec3| match ends
            .map(|ends| ends.map(|end| transform_relative_to(end, origin)))
        {
            None => transform_bounds(&transform_relative_to(map, origin), &own_bounds),
            Some([start, end]) => {
                transform_bounds(&start, &own_bounds).union(transform_bounds(&end, &own_bounds))
            }
        };
        match &object.shape {
            Shape::Mesh(name) => {
                let Some(data) = lookup.mesh_data(name) else {
                    continue;
                };
                if uses.is_shared(name, object.side) {
                    let own_bounds = shared
                        .entry(name.as_str())
                        .or_insert_with(|| mesh_bounds::<R>(data, None));
                    if !own_bounds.is_empty() {
                        visit(index, Some(instance(*own_bounds, data.positions.origin())));
                    }
                } else {
                    visit(index, Some(mesh_bounds::<R>(data, Some(map))));
                }
            }
            shape if ends.is_some() => {
                let Some((shape, origin)) = convert_shape_in_own_space::<R>(shape) else {
                    continue;
                };
                visit(index, shape.bounds().map(|bounds| instance(bounds, origin)));
            }
            shape => match convert_shape::<R>(shape, map) {
                Some((shape, None)) => visit(index, shape.bounds()),
                Some((shape, Some(map))) => {
                    if let Some(transformed_shape) = TransformedShape::<R>::new(shape, map) {
                        visit(index, transformed_shape.bounds());
                    }
                }
                None => {}
            },
        }
    }
}

impl SceneExtent {
    /// Adds the box of a primitive, as the construction of a geometry does. A primitive counts as
    /// unbounded if it has no box, or if its box is too large for a tree.
    fn include_box(&mut self, bounds: Option<Aabb>) {
        match bounds {
            Some(bounds) if bounds.is_empty() => {}
            Some(bounds) if bounds.to_padded().is_some() => {
                // No ray hits a primitive without area.
                if bounds.has_area() {
                    self.bounds = self.bounds.union(bounds);
                }
            }
            _ => self.unbounded += 1,
        }
    }
}

/// Iterates over the triangles of a mesh that have an area in f64, so that a ray may hit them.
pub fn surface_triangles(data: &MeshData) -> impl Iterator<Item = [u32; 3]> {
    let corners = |i: u32| data.positions.position(i as usize);
    let bounds = move |indices: [u32; 3]| Triangle::<f64>::new(indices.map(corners)).bounds();
    let has_area = move |indices: &[u32; 3]| bounds(*indices).is_none_or(|own| own.has_area());
    data.indices.iter().copied().filter(has_area)
}

/// Whether a map reduces every surface to a line or a point.
pub fn flattens_surfaces(map: &DAffine3) -> bool {
    let [x, y, z] = [map.x_axis, map.y_axis, map.z_axis];
    [x.cross(y), y.cross(z), z.cross(x)] == [DVec3::ZERO; 3]
}

// Numbers of objects that show each mesh. A mesh becomes instances if several objects or a moving
// object show it. The extent, the memory estimate and the geometry read these numbers.

/// Number of objects that show each mesh with each side rule. A moving object counts as at least
/// two.
pub(crate) struct MeshUseCounts<'a>(HashMap<(&'a str, SideRule), u64>);

impl<'a> MeshUseCounts<'a> {
    /// Counts the objects of a scene that show meshes.
    pub fn from_scene(scene: &'a Scene) -> Self {
        let mut uses = HashMap::new();
        for (object, count) in objects_with_counts(scene) {
            if let Shape::Mesh(name) = &object.shape {
                let uses = uses.entry((name.as_str(), object.side)).or_insert(0_u64);
                // A moving object is always an instance, so it counts as at least two uses.
                *uses = uses.saturating_add(if object_transforms_at_ends(object).is_some() {
                    count.max(2)
                } else {
                    count
                });
            }
        }
        Self(uses)
    }

    /// Whether the objects that show a mesh with a side rule are instances of a shared geometry.
    /// This is so if several objects or a moving object show the mesh. Each triangle stores its
    /// side rule, so only objects with the same rule share triangles.
    pub fn is_shared(&self, mesh: &'a str, side: SideRule) -> bool {
        self.0.get(&(mesh, side)).is_some_and(|&n| n > 1)
    }
}

#[cfg(test)]
mod tests;
