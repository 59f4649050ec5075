//! Objects of glTF nodes: an object for each primitive of a mesh, at the node's transform or at
//! each instance of EXT_mesh_gpu_instancing.

use std::collections::HashSet;

use glam::{DAffine3, DQuat, DVec3};
use raywright_core::scene::{Mesh, MeshSource, Object, Shape, SideRule};
use raywright_core::validate::MAX_COORDINATE;

use super::accessor::{Accessor, find_entry};
use super::deform::MeshDeformation;
use super::entries::{MeshEntry, MeshInstancing, NodeEntry, PrimitiveEntry};
use super::material::ConvertedMaterial;
use super::nodes::NodeInstance;
use super::{ConvertedMesh, GltfImport, camera, mesh};
use crate::import::{Fault, FaultPlace, ImportResult};
use crate::mesh_tools;

/// Opened accessors of the instance transforms of a node's mesh (EXT_mesh_gpu_instancing). The
/// transforms are relative to the node.
struct InstanceTransforms<'a> {
    count: usize,
    translation: Option<Accessor<'a>>,
    rotation: Option<Accessor<'a>>,
    scale: Option<Accessor<'a>>,
}

impl InstanceTransforms<'_> {
    fn transform(&self, index: usize) -> DAffine3 {
        let vector = |list: &Accessor<'_>| DVec3::from(list.read_vector::<3>(index).map(f64::from));
        let turn = |list: &Accessor<'_>| {
            DQuat::from_array(list.read_vector::<4>(index).map(f64::from)).normalize()
        };
        DAffine3::from_scale_rotation_translation(
            self.scale.as_ref().map_or(DVec3::ONE, vector),
            self.rotation
                .as_ref()
                .map(turn)
                .filter(|turn| turn.is_finite())
                .unwrap_or(DQuat::IDENTITY),
            self.translation.as_ref().map_or(DVec3::ZERO, vector),
        )
    }
}

impl<'a> GltfImport<'a> {
    /// Opens the instance transforms of a node's mesh.
    fn open_instances(&self, instancing: &MeshInstancing) -> ImportResult<InstanceTransforms<'a>> {
        let list = |name: &str, arity: usize| -> ImportResult<Option<Accessor<'a>>> {
            let Some(&index) = instancing.attributes.get(name) else {
                return Ok(None);
            };
            let list = self.reader.open(index as usize).with_place(name)?;
            match list.element_arity() == arity {
                true => Ok(Some(list)),
                false => Err(fault!(
                    "{name}: has {} components, not {arity}",
                    list.element_arity()
                )),
            }
        };
        let lists = [
            list("TRANSLATION", 3)?,
            list("ROTATION", 4)?,
            list("SCALE", 3)?,
        ];
        let counts: Vec<usize> = lists.iter().flatten().map(Accessor::count).collect();
        if counts.iter().any(|count| Some(count) != counts.first()) {
            return Err(fault!(
                "has different numbers of translations, rotations and scales: {counts:?}"
            ));
        }
        // Without any of these attributes, the node has a single instance.
        let count = counts.first().copied().unwrap_or(1);
        let [translation, rotation, scale] = lists;
        Ok(InstanceTransforms {
            count,
            translation,
            rotation,
            scale,
        })
    }

    /// Returns the world transforms of a mesh's instances, each transform once. Repeated
    /// transforms, and transforms beyond the range of coordinates, are dropped with a warning.
    fn distinct_instance_transforms(
        &mut self,
        places: &InstanceTransforms<'_>,
        world: &DAffine3,
        node: usize,
    ) -> ImportResult<Vec<DAffine3>> {
        self.budget
            .reserve_memory(places.count, 3 * size_of::<DAffine3>())?;
        let mut visited = HashSet::with_capacity(places.count);
        let mut distinct = Vec::with_capacity(places.count);
        for index in 0..places.count {
            let place = *world * places.transform(index);
            let is_new = visited.insert(place.to_cols_array().map(f64::to_bits));
            if is_new
                && self
                    .check_coordinate_range(&place, || format!("nodes[{node}], instance {index}"))
            {
                distinct.push(place);
            }
        }
        if visited.len() < places.count {
            let again = places.count - visited.len();
            warn!(
                self.warnings,
                Format,
                "nodes[{node}]: {again} instances repeat the transform of another instance and were left out"
            );
        }
        Ok(distinct)
    }

    /// Adds an object for each primitive of a node's mesh, at each instance.
    fn add_node_mesh(
        &mut self,
        index: usize,
        node: &NodeEntry,
        instance: &NodeInstance,
    ) -> ImportResult<()> {
        let pose = self.node_deformation(instance, node)?;
        // The joints of a skin determine the position of its meshes; the transform of the mesh's
        // node has no effect.
        let world = pose.skin.as_ref().map_or(instance.world, |skin| {
            DAffine3::from_translation(skin.origin)
        });
        let instancing = node.extensions.instancing.as_ref();
        let places = instancing
            .filter(|_| pose.skin.is_none())
            .map(|instancing| self.open_instances(instancing))
            .transpose()
            .with_place("EXT_mesh_gpu_instancing")?;
        let shape = find_entry(&self.document.meshes, "meshes", index)?;
        let worlds = match places {
            Some(places) => self.distinct_instance_transforms(&places, &world, instance.node)?,
            None => vec![world],
        };
        let names = [&node.name, &shape.name].into_iter().flatten();
        let name = names
            .map(String::as_str)
            .find(|name| !name.is_empty())
            .unwrap_or_default();
        for (i, primitive) in shape.primitives.iter().enumerate() {
            let place =
                |fault: Fault| fault.with_place(format_args!("meshes[{index}].primitives[{i}]"));
            let material = self
                .convert_material(self.variant_material(primitive))
                .map_err(place)?;
            let mesh = self
                .primitive_mesh(shape, (index, i), &material, &pose)
                .map_err(place)?;
            let Some(mesh) = mesh else { continue };
            for world in &worlds {
                self.add_object(name, &mesh, &material, world)?;
            }
        }
        Ok(())
    }

    /// Returns the mesh of a primitive in a pose, converted and added to the scene on first use;
    /// `None` for a primitive without triangles. The indices are those of the glTF mesh and of its
    /// primitive.
    fn primitive_mesh(
        &mut self,
        shape: &MeshEntry,
        (index, part): (usize, usize),
        material: &ConvertedMaterial,
        pose: &MeshDeformation,
    ) -> ImportResult<Option<ConvertedMesh>> {
        let key = (index, part, pose.deformation_key());
        if let Some(known) = self.meshes.get(&key) {
            return Ok(known.clone());
        }
        let primitive = &shape.primitives[part];
        let data = self.convert_primitive(primitive, material, pose, (index, part))?;
        let wish = shape
            .name
            .as_deref()
            .filter(|name| !name.is_empty())
            .unwrap_or("mesh");
        let used = data.map(|data| {
            let used = ConvertedMesh {
                name: self.names.meshes.make_unique(wish),
                index: self.scene.meshes.len(),
            };
            self.scene.meshes.push(Mesh {
                name: used.name.clone(),
                source: MeshSource::Inline(data.into()),
                model: None,
            });
            used
        });
        self.work
            .report_done(mesh::declared_counts(self.document, primitive)[0]);
        self.meshes.insert(key, used.clone());
        Ok(used)
    }

    /// Returns the material of a primitive in the chosen variant; `None`: the default material.
    fn variant_material(&self, primitive: &PrimitiveEntry) -> Option<usize> {
        let mappings = &primitive.extensions.variants.mappings;
        let mapped = self.variant.and_then(|variant| {
            mappings
                .iter()
                .find(|mapping| mapping.variants.contains(&variant))
        });
        mapped
            .map(|mapping| mapping.material)
            .or(primitive.material)
            .map(|material| material as usize)
    }

    /// Adds an object to the scene: a converted mesh under the world transform of a node.
    fn add_object(
        &mut self,
        name: &str,
        mesh: &ConvertedMesh,
        material: &ConvertedMaterial,
        world: &DAffine3,
    ) -> ImportResult<()> {
        self.budget.reserve_object()?;
        let (mesh, transform) = match mesh_tools::is_invertible(world) {
            true => (mesh.name.clone(), mesh_tools::transform_steps(world)),
            false => match self.copy_mesh_to_world_space(mesh, world)? {
                Some(mesh) => (mesh, Vec::new()),
                None => return Ok(()),
            },
        };
        self.scene.objects.push(Object {
            name: name.to_owned(),
            shape: Shape::Mesh(mesh),
            material: material.name.clone(),
            side: if material.two_sided {
                SideRule::Both
            } else {
                SideRule::Culled
            },
            face_viewer: true,
            casts_shadow: true,
            transform,
            transform_end: None,
        });
        Ok(())
    }

    /// Copies a mesh to world space, for a node whose transform is singular. The copy is needed
    /// because rays cannot be transformed to the space of that node. Returns the name of the copy,
    /// or `None` if no triangle is within the range of coordinates.
    fn copy_mesh_to_world_space(
        &mut self,
        mesh: &ConvertedMesh,
        world: &DAffine3,
    ) -> ImportResult<Option<String>> {
        let source = self
            .scene
            .meshes
            .get(mesh.index)
            .map(|mesh| mesh.source.clone());
        let Some(MeshSource::Inline(data)) = source else {
            return Ok(None);
        };
        self.budget.reserve_memory(data.byte_size(), 1)?;
        let mut data = mesh_tools::apply_singular_transform(&data, world);
        let dropped = mesh_tools::drop_non_finite_triangles(&mut data);
        let place = format!(
            "mesh `{}`, flattened by the transform of its node: ",
            mesh.name
        );
        self.warnings.add_dropped(&place, dropped);
        if data.indices.is_empty() {
            return Ok(None);
        }
        let name = self.names.meshes.make_unique(&mesh.name);
        self.scene.meshes.push(Mesh {
            name: name.clone(),
            source: MeshSource::Inline(data.into()),
            model: None,
        });
        Ok(Some(name))
    }
}

// Contents of glTF nodes: the mesh, the camera and the light of a node, added to the scene.

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
    fn check_coordinate_range(&mut self, world: &DAffine3, place: impl Fn() -> String) -> bool {
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
        self.scene.lights.extend(camera::convert_light(
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
