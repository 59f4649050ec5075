//! Which meshes are shown by instances, because more than once or on the move: what is asked before
//! geometry is built, and while it is.

use std::collections::HashMap;

use crate::generate::counted;
use crate::motion::ends;
use crate::scene::{Scene, Shape, SideRule};

/// How often meshes are shown.
pub(crate) struct Uses<'a>(HashMap<(&'a str, SideRule), u64>);

impl<'a> Uses<'a> {
    pub fn of(scene: &'a Scene) -> Self {
        let mut uses = HashMap::new();
        for (object, count) in counted(scene) {
            if let Shape::Mesh(name) = &object.shape {
                let uses = uses.entry((name.as_str(), object.side)).or_insert(0_u64);
                // One that moves is an instance of its own, however rarely it is shown.
                *uses = uses.saturating_add(if ends(object).is_some() {
                    count.max(2)
                } else {
                    count
                });
            }
        }
        Self(uses)
    }

    /// Whether the objects that show this side of a mesh are instances of one geometry, as where
    /// there are several or one moves. Which side can be hit is told by each triangle, so only
    /// those that show the same one share them.
    pub fn share(&self, mesh: &'a str, side: SideRule) -> bool {
        self.0.get(&(mesh, side)).is_some_and(|&n| n > 1)
    }
}
