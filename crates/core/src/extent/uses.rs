//! Numbers of objects that show each mesh. A mesh becomes instances if several objects or a moving
//! object show it. The extent, the memory estimate and the geometry read these numbers.

use std::collections::HashMap;

use crate::generate::objects_with_counts;
use crate::motion::object_transforms_at_ends;
use crate::scene::{Scene, Shape, SideRule};

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
