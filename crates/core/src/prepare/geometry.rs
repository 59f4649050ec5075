//! Conversion of objects to primitives of the scene's geometry. A shape becomes a primitive. A mesh
//! that is used once becomes triangles of the top level; a mesh that is used more often becomes
//! instances of a shared geometry. A generator becomes its objects.

mod builder;
mod triangles;

use std::sync::Arc;

use raywright_bvh::{AcceleratorKind, Geometry, Occlusion, Real, Side};

use super::collapsed_shapes::collapsed_relative_to;
use super::error::{PrepareError, check_cancelled};
use crate::generate::{PlacedObject, all_objects, objects_relative_to};
use crate::lookup::SceneLookup;
use crate::observer::Observer;
use crate::scene::{MeshData, Scene, SideRule};
use crate::storage_origin::StorageOrigin;

use builder::GeometryBuilder;
pub(super) use triangles::add_triangles;

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

#[cfg(test)]
pub(super) mod tests;
