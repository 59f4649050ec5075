//! Lookup of a scene's items by name, and the objects of a scene with their paths. A lookup is built
//! once, so that no list is searched for each object.

use core::fmt;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::scene::{Image, Material, Mesh, MeshData, MeshSource, Object, Scene, Shape, Texture};

/// Index of a scene's images, textures, materials and meshes by name. If two items have the same
/// name, which validation refuses, the first is returned.
#[derive(Clone, Debug)]
pub struct SceneLookup<'a> {
    scene: &'a Scene,
    pub(crate) images: NameToIndexMap<'a>,
    pub(crate) textures: NameToIndexMap<'a>,
    pub(crate) materials: NameToIndexMap<'a>,
    pub(crate) meshes: NameToIndexMap<'a>,
}

/// Map from the names of a list to indices, in alphabetical order. The order is the same in every
/// run. So a message always suggests the same one of several equally similar names.
#[derive(Clone, Debug)]
pub(crate) struct NameToIndexMap<'a>(BTreeMap<&'a str, usize>);

impl<'a> NameToIndexMap<'a> {
    fn new<T>(things: &'a [T], name: impl Fn(&'a T) -> &'a String) -> Self {
        // In reverse order, an earlier item replaces a later item of the same name.
        Self(
            things
                .iter()
                .enumerate()
                .rev()
                .map(|(index, thing)| (name(thing).as_str(), index))
                .collect(),
        )
    }

    /// Returns the index of a name in the scene's list.
    pub fn index_of(&self, name: &str) -> Option<usize> {
        self.0.get(name).copied()
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Iterates over the names in alphabetical order.
    pub fn iter(&self) -> impl Iterator<Item = &'a str> {
        self.0.keys().copied()
    }
}

/// Path of an object in the scene file, formatted on demand: `objects[3]`, or `generators[0].object`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectPath {
    /// Whether a generator repeats the object.
    is_generated: bool,
    /// Index in the list of objects or of generators.
    index: usize,
}

impl fmt::Display for ObjectPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.is_generated {
            false => write!(f, "objects[{}]", self.index),
            true => write!(f, "generators[{}].object", self.index),
        }
    }
}

/// Returns the listed objects of a scene, then the object of each generator, with their paths.
pub(crate) fn objects_with_paths(scene: &Scene) -> impl Iterator<Item = (ObjectPath, &Object)> {
    let generated = scene.generators.iter().map(|generator| &generator.object);
    let with_paths = |is_generated: bool| {
        move |(index, object)| {
            let path = ObjectPath {
                is_generated,
                index,
            };
            (path, object)
        }
    };
    let listed = scene.objects.iter().enumerate().map(with_paths(false));
    listed.chain(generated.enumerate().map(with_paths(true)))
}

impl<'a> SceneLookup<'a> {
    /// Builds the lookup by a scan of each list.
    pub fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            images: NameToIndexMap::new(&scene.images, |image| &image.name),
            textures: NameToIndexMap::new(&scene.textures, |texture| &texture.name),
            materials: NameToIndexMap::new(&scene.materials, |material| &material.name),
            meshes: NameToIndexMap::new(&scene.meshes, |mesh| &mesh.name),
        }
    }

    /// Returns the image with this name.
    pub fn image(&self, name: &str) -> Option<&'a Image> {
        self.images
            .index_of(name)
            .map(|index| &self.scene.images[index])
    }

    /// Returns the index of a shape's mesh; `None` for another shape.
    pub(crate) fn mesh_index(&self, shape: &Shape) -> Option<usize> {
        match shape {
            Shape::Mesh(name) => self.meshes.index_of(name),
            _ => None,
        }
    }

    /// Returns the texture with this name.
    pub fn texture(&self, name: &str) -> Option<&'a Texture> {
        self.textures
            .index_of(name)
            .map(|index| &self.scene.textures[index])
    }

    /// Returns the material with this name and its index in the scene's list of materials.
    pub fn material(&self, name: &str) -> Option<(usize, &'a Material)> {
        self.materials
            .index_of(name)
            .map(|index| (index, &self.scene.materials[index]))
    }

    /// Returns the mesh with this name.
    pub fn mesh(&self, name: &str) -> Option<&'a Mesh> {
        self.meshes
            .index_of(name)
            .map(|index| &self.scene.meshes[index])
    }

    /// Returns the arrays of the mesh with this name. `None` if the mesh does not exist or its file
    /// is not loaded.
    pub fn mesh_data(&self, name: &str) -> Option<&'a Arc<MeshData>> {
        match &self.mesh(name)?.source {
            MeshSource::Inline(data) => Some(data),
            MeshSource::File(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a name returns the first item with this name, from its own list alone.
    #[test]
    fn names_lead_to_the_first_that_has_them() {
        let material = |name: &str| Material {
            name: name.to_owned(),
            model: crate::scene::MaterialModel::Physical(Box::default()),
        };
        let mesh = |name: &str, source| Mesh {
            name: name.to_owned(),
            source,
            model: None,
        };
        let scene = Scene {
            materials: ["a", "b", "a"].map(material).into(),
            meshes: vec![
                mesh("a", MeshSource::File("x.obj".to_owned())),
                mesh("c", MeshSource::Inline(Arc::default())),
            ],
            ..Scene::default()
        };
        let lookup = SceneLookup::new(&scene);
        assert_eq!(
            ["a", "b", "c"].map(|name| lookup.material(name).map(|(index, _)| index)),
            [Some(0), Some(1), None]
        );
        assert!(
            lookup.mesh("a").is_some() && lookup.mesh("b").is_none() && lookup.image("a").is_none()
        );
        assert!(
            lookup.mesh_data("a").is_none()
                && lookup.mesh_data("c").is_some()
                && lookup.texture("a").is_none()
        );
        assert_eq!(
            (lookup.materials.len(), lookup.meshes.iter().count()),
            (2, 2)
        );
    }
}
