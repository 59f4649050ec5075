//! Conversion of objects to primitives of the scene's geometry. A shape becomes a primitive. A mesh
//! that is used once becomes triangles of the top level; a mesh that is used more often becomes
//! instances of a shared geometry. A generator becomes its objects.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use raywright_bvh::{
    AcceleratorKind, Geometry, Occlusion, PrimitiveSet, Real, Side, Vector, Visibility,
};

use super::collapsed_shapes::{collapsed_relative_to, round_to_scalar, shape_collapses};
use super::error::{PrepareError, check_cancelled};
use crate::extent::MeshUseCounts;
use crate::generate::{PlacedObject, all_objects, objects_relative_to};
use crate::lookup::SceneLookup;
use crate::observer::Observer;
use crate::scene::{MeshData, Object, Scene, Shape, SideRule};
use crate::shape::{convert_shape, convert_shape_in_own_space, transform_relative_to};
use crate::storage_origin::StorageOrigin;

/// Data of an object that shading reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectRecord<R: Real> {
    /// Index of the material.
    pub material: u32,
    /// Whether the normal is turned to the viewer's side for shading.
    pub face_viewer: bool,
    /// Whether only the outside emits.
    pub is_culled: bool,
    /// Whether the object blocks delta lights; read by integrators that filter each shadow-ray hit.
    pub casts_shadow: bool,
    /// Whether the material needs a shape's texture coordinates.
    pub needs_uv: bool,
    /// Whether the material needs tangents, for a normal map or anisotropy.
    pub needs_tangents: bool,
    /// Kind of the surface of a mesh whose material has a [uniform
    /// model](super::PreparedMaterial::uniform_model); `None` for any other object. Hits outside
    /// instances then need no interaction.
    pub uniform: Option<UniformSurface>,
    /// Whether the surface is a [smooth mirror or smooth glass](super::PreparedMaterial::is_smooth).
    pub is_smooth: bool,
    /// The mesh; `None` for another shape.
    pub mesh: Option<ObjectMesh<R>>,
}

/// Kind of a rough opaque surface that is the same everywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum UniformSurface {
    /// Without specular reflection.
    Matte,
    Glossy,
}

/// The mesh of an object, with the object's transform of normals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectMesh<R: Real> {
    /// Index in the table of meshes.
    pub mesh: u32,
    /// Columns of the inverse transpose of the object's transform, which maps normals to world
    /// space without normalising.
    pub normals: [R::Vec3; 3],
    /// Whether the object moves other than by translation. Then [`Self::normals`] holds for time 0,
    /// and the geometry transforms normals at other times.
    pub rotates: bool,
    /// Whether [`Self::normals`] changes no normal.
    pub keeps_normals: bool,
    /// Whether the triangles' orientation is reversed, because the transform mirrors.
    pub flipped: bool,
    /// Bit mask of the sets of texture coordinates that the material reads.
    pub uv_sets: u8,
    /// Index in the table of generated tangents; `None` if the mesh file has tangents or none are
    /// needed.
    pub tangents: Option<u32>,
}

/// The built geometry of a scene, with the tables that its objects refer to.
pub(crate) struct BuiltGeometry<R: Real> {
    pub geometry: Geometry<R>,
    /// The meshes in use without duplicates, shared with the scene, so that arrays are not copied.
    pub meshes: Vec<Arc<MeshData>>,
    /// Data for shading, by index of the scene's objects.
    pub objects: Vec<ObjectRecord<R>>,
    /// Indices, ascending, of the objects whose mesh collapses when stored.
    pub collapsed_meshes: Vec<u32>,
}

/// Properties of a material that geometry needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GeometryNeeds {
    /// Effect on shadow rays of objects that cast shadows.
    pub occlusion: Occlusion,
    /// Effect on shadow rays of objects that cast no shadow.
    pub without_shadow: Occlusion,
    /// Whether the material needs a shape's texture coordinates.
    pub needs_uv: bool,
    /// Bit mask of a mesh's sets of texture coordinates that the material reads.
    pub uv_sets: u8,
    /// Whether the material needs tangents, for a normal map or anisotropy.
    pub needs_tangents: bool,
}

/// Returns the side rule of the geometry for a side rule of the scene.
pub(super) fn side_from_rule(rule: SideRule) -> Side {
    match rule {
        SideRule::Both => Side::Both,
        SideRule::Outside => Side::Outside,
        SideRule::Inside => Side::Inside,
        SideRule::Culled => Side::Culled,
    }
}

/// Number of objects, or of groups of 64 triangles, between two checks for cancellation. They take
/// milliseconds.
pub(super) const CANCEL_CHECK_INTERVAL: usize = 1 << 10;

/// Returns the index of each object's material.
///
/// # Errors
/// [`PrepareError::Missing`] for an undefined material.
pub(super) fn object_materials(
    scene: &Scene,
    lookup: &SceneLookup<'_>,
) -> Result<Vec<u32>, PrepareError> {
    let material = |(index, placed_object): (usize, PlacedObject<'_>)| match lookup
        .material(&placed_object.object.material)
    {
        Some((material, _)) => Ok(material as u32),
        None => Err(PrepareError::Missing {
            path: format!("objects[{index}].material"),
            kind: "material",
            name: placed_object.object.material.clone(),
        }),
    };
    all_objects(scene).enumerate().map(material).collect()
}

/// Builds the geometry of a scene for callers that need no materials.
///
/// # Errors
/// Those of [`build_geometry_with_materials`], and an undefined material.
pub(crate) fn build_geometry<R: Real>(
    scene: &Scene,
    lookup: &SceneLookup<'_>,
    kind: AcceleratorKind,
    observer: &dyn Observer,
) -> Result<BuiltGeometry<R>, PrepareError> {
    let geometry_needs = GeometryNeeds {
        occlusion: Occlusion::Opaque,
        without_shadow: Occlusion::None,
        needs_uv: false,
        uv_sets: 0,
        needs_tangents: false,
    };
    let origin = StorageOrigin::from_scene::<R>(scene, lookup);
    build_geometry_with_materials(
        (scene, origin),
        lookup,
        kind,
        (
            &object_materials(scene, lookup)?,
            &vec![geometry_needs; scene.materials.len()],
        ),
        observer,
    )
}

/// Builds the geometry of a scene in coordinates relative to an origin. `materials` is the material
/// of each object, `geometry_needs` the properties of each material.
///
/// # Errors
/// Shapes that collapse or that the geometry rejects, an undefined mesh, and cancellation.
pub(super) fn build_geometry_with_materials<R: Real>(
    (scene, origin): (&Scene, StorageOrigin),
    lookup: &SceneLookup<'_>,
    kind: AcceleratorKind,
    (materials, geometry_needs): (&[u32], &[GeometryNeeds]),
    observer: &dyn Observer,
) -> Result<BuiltGeometry<R>, PrepareError> {
    let problems = collapsed_relative_to::<R>(scene, origin.origin);
    if !problems.is_empty() {
        return Err(PrepareError::Collapsed { problems });
    }
    let mut builder = GeometryBuilder::<R>::new(scene, lookup, kind, observer);
    for (index, (placed_object, &material)) in objects_relative_to(scene, origin.origin)
        .zip(materials)
        .enumerate()
    {
        if index.is_multiple_of(CANCEL_CHECK_INTERVAL) {
            check_cancelled(observer)?;
        }
        builder.add_object(
            index,
            &placed_object,
            material,
            &geometry_needs[material as usize],
        )?;
    }
    let geometry =
        Geometry::build_cancellable(builder.primitives, kind, &|| observer.is_cancelled())
            .ok_or(PrepareError::Cancelled)?;
    Ok(BuiltGeometry {
        geometry,
        meshes: builder.meshes,
        objects: builder.records,
        collapsed_meshes: builder.collapsed_meshes,
    })
}

// Conversion of a mesh's triangles to coordinates as they are stored.

/// Whether all triangles of a transformed mesh collapse to zero area when stored. False if all of
/// them are degenerate already in the file. The test ends at the first triangle that survives.
fn mesh_collapses<R: Real>(data: &MeshData, map: &DAffine3) -> bool {
    let corner = |i: u32| {
        map.transform_point3(data.positions.position(i as usize))
            .to_array()
    };
    let nothing = |round: fn(f64) -> f64| {
        let mut triangles = data.indices.iter().map(|corners| Shape::Triangle {
            vertices: corners.map(corner),
        });
        triangles.all(|triangle| shape_collapses(&triangle, DVec3::ZERO, round))
    };
    nothing(round_to_scalar::<R>) && !nothing(|x| x)
}

/// Adds the triangles of a mesh as a single object. `map` is the mesh's transform and whether it
/// mirrors. Triangles of a mirrored mesh are reversed, so that their outside stays outside. Without
/// `map`, the triangles are relative to the mesh's own origin.
///
/// # Errors
/// Triangles that the geometry rejects, and [`PrepareError::Cancelled`].
pub(in crate::prepare) fn add_triangles<R: Real>(
    group: &mut PrimitiveSet<R>,
    object: usize,
    data: &MeshData,
    map: Option<(DAffine3, bool)>,
    visibility: Visibility,
    observer: &dyn Observer,
) -> Result<(), PrepareError> {
    let stays = map.is_some_and(|(map, _)| map == DAffine3::IDENTITY);
    let position = |i: u32| -> R::Vec3 {
        Vector::from_f64(match map {
            // Adding zero is the identity map, which changes only −0 into 0.
            Some(_) if stays => data.positions.position(i as usize) + DVec3::ZERO,
            Some((map, _)) => map.transform_point3(data.positions.position(i as usize)),
            None => DVec3::from(data.positions.offsets()[i as usize].map(f64::from)),
        })
    };
    let flipped = map.is_some_and(|(_, flipped)| flipped);
    let corners = |&[a, b, c]: &[u32; 3]| if flipped { [a, c, b] } else { [a, b, c] }.map(position);
    // Cancellation ends the iteration early, and the check below returns the error.
    let blocks = data
        .indices
        .chunks(64 * CANCEL_CHECK_INTERVAL)
        .take_while(|_| !observer.is_cancelled());
    group.reserve_triangles(data.indices.len());
    group
        .add_mesh(blocks.flatten().map(corners), visibility)
        .map_err(|source| PrepareError::Geometry { object, source })?;
    check_cancelled(observer)
}

// Builder of a scene's geometry, object by object.

/// Builder of a scene's geometry. It takes the objects in order.
struct GeometryBuilder<'a, R: Real> {
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
            is_smooth: false,
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

#[cfg(test)]
pub(super) mod tests;
