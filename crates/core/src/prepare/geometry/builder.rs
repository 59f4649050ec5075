//! Builder of a scene's geometry, object by object.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use raywright_bvh::{AcceleratorKind, Geometry, PrimitiveSet, Real, Vector, Visibility};

use super::triangles::{add_triangles, mesh_collapses};
use super::{GeometryNeeds, ObjectMesh, ObjectRecord, side_from_rule};
use crate::extent::MeshUseCounts;
use crate::generate::PlacedObject;
use crate::lookup::SceneLookup;
use crate::observer::Observer;
use crate::prepare::error::PrepareError;
use crate::scene::{MeshData, Object, Scene, Shape, SideRule};
use crate::shape::{convert_shape, convert_shape_in_own_space, transform_relative_to};

/// Builder of a scene's geometry. It takes the objects in order.
pub(super) struct GeometryBuilder<'a, R: Real> {
    kind: AcceleratorKind,
    lookup: &'a SceneLookup<'a>,
    uses: MeshUseCounts<'a>,
    /// Primitives of the top level so far.
    pub primitives: PrimitiveSet<R>,
    /// Index of the shared geometry of each mesh and side rule.
    shared: HashMap<(&'a str, SideRule), u32>,
    /// The meshes so far, without duplicates.
    pub meshes: Vec<Arc<MeshData>>,
    /// Index of each named mesh in [`Self::meshes`].
    mesh_indices: HashMap<&'a str, u32>,
    /// Data for shading of the objects so far.
    pub records: Vec<ObjectRecord<R>>,
    /// Indices, ascending, of the objects so far whose mesh collapses when stored.
    pub collapsed_meshes: Vec<u32>,
    /// The last moving object whose shape is no mesh, with the index of its shared geometry and the
    /// origin of that geometry's coordinates.
    last_moving_shape: Option<(&'a Object, u32, DVec3)>,
    observer: &'a dyn Observer,
}

impl<'a, R: Real> GeometryBuilder<'a, R> {
    /// Creates a builder without objects.
    pub fn new(
        scene: &'a Scene,
        lookup: &'a SceneLookup<'a>,
        kind: AcceleratorKind,
        observer: &'a dyn Observer,
    ) -> Self {
        Self {
            kind,
            lookup,
            uses: MeshUseCounts::from_scene(scene),
            primitives: PrimitiveSet::default(),
            shared: HashMap::new(),
            meshes: Vec::new(),
            mesh_indices: HashMap::new(),
            records: Vec::new(),
            collapsed_meshes: Vec::new(),
            last_moving_shape: None,
            observer,
        }
    }

    /// Adds the primitives of an object and its record for shading.
    ///
    /// # Errors
    /// A shape that the geometry rejects, an undefined mesh, and cancellation.
    pub fn add_object(
        &mut self,
        index: usize,
        placed_object: &PlacedObject<'a>,
        material: u32,
        geometry_needs: &GeometryNeeds,
    ) -> Result<(), PrepareError> {
        let visibility = object_visibility(placed_object.object, geometry_needs);
        let mesh = match &placed_object.object.shape {
            Shape::Mesh(name) => {
                Some(self.add_mesh(index, placed_object, name, visibility, geometry_needs)?)
            }
            shape => {
                match placed_object.object_to_world_at_ends() {
                    Some(ends) => {
                        self.add_moving_shape(index, shape, placed_object.object, ends, visibility)?
                    }
                    None => self.add_shape(index, shape, placed_object, visibility)?,
                }
                None
            }
        };
        let Object {
            face_viewer,
            casts_shadow,
            side,
            ..
        } = *placed_object.object;
        self.records.push(ObjectRecord {
            material,
            face_viewer,
            is_culled: side == SideRule::Culled,
            casts_shadow,
            needs_uv: mesh.is_none() && geometry_needs.needs_uv,
            needs_tangents: geometry_needs.needs_tangents,
            uniform: None,
            mesh,
        });
        Ok(())
    }

    /// Adds a mesh, as triangles of the top level or as an instance of a shared geometry. Returns
    /// the mesh's record for shading.
    ///
    /// # Errors
    /// A mesh that the scene does not define or that the geometry rejects, and cancellation.
    fn add_mesh(
        &mut self,
        index: usize,
        placed_object: &PlacedObject<'a>,
        name: &'a str,
        visibility: Visibility,
        geometry_needs: &GeometryNeeds,
    ) -> Result<ObjectMesh<R>, PrepareError> {
        let missing = || PrepareError::Missing {
            path: format!("objects[{index}].shape.mesh"),
            kind: "mesh",
            name: name.to_owned(),
        };
        let data = self.lookup.mesh_data(name).ok_or_else(missing)?;
        let mesh = *self.mesh_indices.entry(name).or_insert_with(|| {
            self.meshes.push(Arc::clone(data));
            self.meshes.len() as u32 - 1
        });
        let object_to_world = placed_object.object_to_world();
        let flipped = if self.uses.is_shared(name, placed_object.object.side) {
            self.add_mesh_instance(index, placed_object, (name, data), visibility)?;
            false
        } else {
            self.add_top_level_mesh(index, data, object_to_world, visibility)?
        };
        let inverse_transpose = object_to_world.matrix3.inverse().transpose();
        let columns = [
            inverse_transpose.x_axis,
            inverse_transpose.y_axis,
            inverse_transpose.z_axis,
        ];
        Ok(ObjectMesh {
            mesh,
            normals: columns.map(Vector::from_f64),
            keeps_normals: columns == DVec3::AXES && !columns.iter().any(has_minus_zero),
            rotates: placed_object
                .object_to_world_at_ends()
                .is_some_and(|[start, end]| start.matrix3 != end.matrix3),
            flipped,
            uv_sets: geometry_needs.uv_sets,
            tangents: None,
        })
    }

    /// Adds an instance of the geometry that the mesh's objects share.
    ///
    /// # Errors
    /// A mesh or a transform that the geometry rejects, and cancellation.
    fn add_mesh_instance(
        &mut self,
        index: usize,
        placed_object: &PlacedObject<'a>,
        (name, data): (&'a str, &MeshData),
        visibility: Visibility,
    ) -> Result<(), PrepareError> {
        let key = (name, placed_object.object.side);
        let part = self.shared_mesh_geometry(index, key, data, visibility)?;
        let local = data.positions.origin();
        let added = match placed_object.object_to_world_at_ends() {
            Some(ends) => self.primitives.add_moving_instance(
                part,
                ends.map(|end| transform_relative_to(end, local)),
                visibility,
            ),
            None => self.primitives.add_instance(
                part,
                transform_relative_to(placed_object.object_to_world(), local),
                visibility,
            ),
        };
        added.map(drop).map_err(|source| PrepareError::Geometry {
            object: index,
            source,
        })
    }

    /// Returns the index of the geometry that all objects of a mesh and a side rule share. The
    /// first of these objects builds the geometry.
    ///
    /// # Errors
    /// Triangles that the geometry rejects, and cancellation.
    fn shared_mesh_geometry(
        &mut self,
        index: usize,
        key: (&'a str, SideRule),
        data: &MeshData,
        visibility: Visibility,
    ) -> Result<u32, PrepareError> {
        let vacant = match self.shared.entry(key) {
            Entry::Occupied(shared) => return Ok(*shared.get()),
            Entry::Vacant(vacant) => vacant,
        };
        let mut triangles = PrimitiveSet::default();
        add_triangles(&mut triangles, index, data, None, visibility, self.observer)?;
        let geometry =
            Geometry::build_cancellable(triangles, self.kind, &|| self.observer.is_cancelled())
                .ok_or(PrepareError::Cancelled)?;
        let part = self
            .primitives
            .add_part(geometry)
            .map_err(|source| PrepareError::Geometry {
                object: index,
                source,
            })?;
        Ok(*vacant.insert(part))
    }

    /// Adds a mesh as triangles of the top level. Returns whether its transform mirrors. The
    /// orientation of mirrored triangles is reversed, so that their outside stays outside.
    ///
    /// # Errors
    /// Triangles that the geometry rejects, and cancellation.
    fn add_top_level_mesh(
        &mut self,
        index: usize,
        data: &MeshData,
        object_to_world: DAffine3,
        visibility: Visibility,
    ) -> Result<bool, PrepareError> {
        let flipped = object_to_world.matrix3.determinant() < 0.0;
        add_triangles(
            &mut self.primitives,
            index,
            data,
            Some((object_to_world, flipped)),
            visibility,
            self.observer,
        )?;
        if mesh_collapses::<R>(data, &object_to_world) {
            self.collapsed_meshes.push(index as u32);
        }
        Ok(flipped)
    }

    /// Adds a shape. If its transform is a translation that is exact in `f64`, the shape's
    /// coordinates are translated. So a generator's objects need no transforms.
    ///
    /// # Errors
    /// A shape that the geometry rejects.
    fn add_shape(
        &mut self,
        index: usize,
        shape: &Shape,
        placed_object: &PlacedObject<'_>,
        visibility: Visibility,
    ) -> Result<(), PrepareError> {
        let added = match convert_shape(shape, placed_object.object_to_world()) {
            Some((shape, None)) => self.primitives.add_shape(shape, visibility),
            Some((shape, Some(map))) => self
                .primitives
                .add_transformed_shape(shape, map, visibility),
            None => return Ok(()),
        };
        added.map(drop).map_err(|source| PrepareError::Geometry {
            object: index,
            source,
        })
    }

    /// Adds a moving shape as an instance of a geometry that contains only this shape. All objects
    /// of a generator share the geometry.
    ///
    /// # Errors
    /// A shape that the geometry rejects.
    fn add_moving_shape(
        &mut self,
        index: usize,
        shape: &Shape,
        object: &'a Object,
        ends: [DAffine3; 2],
        visibility: Visibility,
    ) -> Result<(), PrepareError> {
        let refused = |source| PrepareError::Geometry {
            object: index,
            source,
        };
        let (part, local) = match self.last_moving_shape {
            Some((last, part, local)) if core::ptr::eq(last, object) => (part, local),
            _ => {
                let Some((shape, local)) = convert_shape_in_own_space(shape) else {
                    return Ok(());
                };
                let mut alone = PrimitiveSet::default();
                alone.add_shape(shape, visibility).map_err(refused)?;
                let part = self
                    .primitives
                    .add_part(Geometry::new(alone, self.kind))
                    .map_err(refused)?;
                self.last_moving_shape = Some((object, part, local));
                (part, local)
            }
        };
        self.primitives
            .add_moving_instance(
                part,
                ends.map(|end| transform_relative_to(end, local)),
                visibility,
            )
            .map(drop)
            .map_err(refused)
    }
}

/// Whether a component of a vector is minus zero. A product with it may differ from a product with
/// zero by its sign.
fn has_minus_zero(v: &DVec3) -> bool {
    v.to_array()
        .iter()
        .any(|&x| x == 0.0 && x.is_sign_negative())
}

/// Returns the sides of an object that rays hit, and its effect on shadow rays.
fn object_visibility(object: &Object, geometry_needs: &GeometryNeeds) -> Visibility {
    let occlusion = if object.casts_shadow {
        geometry_needs.occlusion
    } else {
        geometry_needs.without_shadow
    };
    Visibility {
        side: side_from_rule(object.side),
        occlusion,
    }
}
