//! Contents of glTF nodes: the mesh, the camera and the light of a node, added to the scene.

use std::collections::HashSet;

use glam::DAffine3;
use raywright_core::validate::MAX_COORDINATE;

use super::buffers::find_entry;
use super::entries::NodeEntry;
use super::nodes::NodeInstance;
use super::{GltfImport, camera, light, mesh};
use crate::import::ImportResult;

impl GltfImport<'_> {
    /// Total number of vertices and indices in the meshes of visible nodes, each mesh counted once.
    pub(super) fn count_elements(&self, instances: &[NodeInstance]) -> u64 {
        let node = |instance: &NodeInstance| self.document.nodes.get(instance.node)?.mesh;
        let meshes: HashSet<u32> = instances
            .iter()
            .filter(|instance| instance.visible)
            .filter_map(node)
            .collect();
        let primitives = meshes
            .iter()
            .filter_map(|&mesh| self.document.meshes.get(mesh as usize))
            .flat_map(|mesh| &mesh.primitives);
        primitives
            .flat_map(|primitive| mesh::declared_counts(self.document, primitive))
            .fold(0, u64::saturating_add)
    }

    /// Whether all numbers of a transform are within the supported range of coordinates; if not, a
    /// warning is added.
    pub(super) fn check_coordinate_range(
        &mut self,
        world: &DAffine3,
        place: impl Fn() -> String,
    ) -> bool {
        let within = world
            .to_cols_array()
            .iter()
            .all(|x| x.abs() <= MAX_COORDINATE);
        if !within {
            warn!(
                self.warnings,
                Geometry,
                "{}: its transform has numbers beyond ±1e15, the largest coordinate; the contents of the node were left out",
                place()
            );
        }
        within
    }

    /// Adds the mesh, the camera and the light of a node to the scene.
    pub(super) fn add_node(&mut self, instance: &NodeInstance) -> ImportResult<()> {
        let Some(node) = self.document.nodes.get(instance.node) else {
            return Ok(());
        };
        let carries =
            node.mesh.is_some() || node.camera.is_some() || node.extensions.light.light.is_some();
        if carries
            && !self.check_coordinate_range(&instance.world, || format!("nodes[{}]", instance.node))
        {
            return Ok(());
        }
        if let Some(index) = node.mesh.filter(|_| instance.visible) {
            self.add_node_mesh(index as usize, node, instance)?;
        }
        if let Some(index) = node.camera {
            self.add_camera(index as usize, node, instance)?;
        }
        if let Some(index) = node.extensions.light.light.filter(|_| instance.visible) {
            self.add_light(index as usize, node, instance)?;
        }
        Ok(())
    }

    /// Adds the camera with this index to the scene, under the transform of its node.
    fn add_camera(
        &mut self,
        index: usize,
        node: &NodeEntry,
        instance: &NodeInstance,
    ) -> ImportResult<()> {
        let camera = find_entry(&self.document.cameras, "cameras", index)?;
        let name = own_or_node_name(camera.name.as_deref(), node);
        let camera = camera::convert_camera(camera, index, name, instance, &mut self.warnings);
        self.camera_sources
            .extend(camera.is_some().then_some(index));
        self.scene.cameras.extend(camera);
        Ok(())
    }

    /// Adds the light with this index to the scene, under the transform of its node.
    fn add_light(
        &mut self,
        index: usize,
        node: &NodeEntry,
        instance: &NodeInstance,
    ) -> ImportResult<()> {
        let light = find_entry(
            &self.document.extensions.lights.lights,
            "KHR_lights_punctual.lights",
            index,
        )?;
        let name = own_or_node_name(light.name.as_deref(), node);
        self.scene.lights.extend(light::convert_light(
            light,
            index,
            name,
            instance,
            &mut self.warnings,
        ));
        Ok(())
    }
}

/// Returns the name of a camera or light or, if that name is missing or empty, the name of its
/// node.
fn own_or_node_name(own: Option<&str>, node: &NodeEntry) -> String {
    own.filter(|name| !name.is_empty())
        .or(node.name.as_deref())
        .unwrap_or_default()
        .to_owned()
}
