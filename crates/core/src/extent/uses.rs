//! Use counts of meshes: a mesh shown more than once, or in motion, becomes instances. Needed
//! before geometry is built and while it is built.

use std::collections::HashMap;

use crate::generate::counted;
use crate::motion::ends;
use crate::scene::{Scene, Shape, SideRule};

/// Number of uses of each mesh.
pub(crate) struct MeshUses<'a>(HashMap<(&'a str, SideRule), u64>);

impl<'a> MeshUses<'a> {
    pub fn of(scene: &'a Scene) -> Self {
        let mut uses = HashMap::new();
        for (object, count) in counted(scene) {
            if let Shape::Mesh(name) = &object.shape {
                let uses = uses.entry((name.as_str(), object.side)).or_insert(0_u64);
                // A moving object is an instance, however rarely its mesh is shown.
                *uses = uses.saturating_add(if ends(object).is_some() {
                    count.max(2)
                } else {
                    count
                });
            }
        }
        Self(uses)
    }

    /// Whether the objects that show this side of a mesh are instances of one geometry: several
    /// objects, or a moving one. Each triangle stores which side can be hit, so only objects with
    /// the same sides rule share triangles.
    pub fn share(&self, mesh: &'a str, side: SideRule) -> bool {
        self.0.get(&(mesh, side)).is_some_and(|&n| n > 1)
    }
}
