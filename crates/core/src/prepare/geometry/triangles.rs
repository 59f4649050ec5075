//! Conversion of a mesh's triangles to coordinates as they are stored.

use glam::{DAffine3, DVec3};
use raywright_bvh::{PrimitiveSet, Real, Vector, Visibility};

use super::CANCEL_CHECK_INTERVAL;
use crate::observer::Observer;
use crate::prepare::collapsed_shapes::{round_to_scalar, shape_collapses};
use crate::prepare::error::{PrepareError, check_cancelled};
use crate::scene::{MeshData, Shape};

/// Whether all triangles of a transformed mesh collapse to zero area when stored. False if all of
/// them are degenerate already in the file. The test ends at the first triangle that survives.
pub(super) fn mesh_collapses<R: Real>(data: &MeshData, map: &DAffine3) -> bool {
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
