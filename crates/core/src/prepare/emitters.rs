//! The surfaces that light others: objects whose material gives off the same radiance everywhere.

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::{AnyShape, Placed};
use raywright_bvh::{Group, Precision, Side, Vec3Of, Vector, Visibility};

use super::geometry::{BLOCK, side_of, triangles};
use super::shape::any_shape;
use super::{PrepareError, go_on};
use crate::generate::all;
use crate::light::EmitterList;
use crate::lookup::Lookup;
use crate::observer::Observer;
use crate::scene::{Material, MeshData, Scene, Shape};

/// Finds them, in the order of the scene's objects.
///
/// # Errors
/// [`PrepareError::Cancelled`].
pub(super) fn emitters<P: Precision>(
    scene: &Scene,
    lookup: &Lookup<'_>,
    observer: &dyn Observer,
) -> Result<EmitterList<P>, PrepareError> {
    let mut list = EmitterList::default();
    // A generator's objects differ only in their places, which leave the area alone.
    let mut last: Option<(&Shape, DMat3, f64)> = None;
    for (index, shown) in all(scene).enumerate() {
        if index.is_multiple_of(BLOCK) {
            go_on(observer)?;
        }
        list.next_object();
        let object = shown.object;
        let material = lookup.material(&object.material).map(|(_, material)| material);
        let Some(radiance) = material.and_then(Material::even_emission) else { continue };
        let (radiance, side) = (Vector::from_f64(radiance.0.into()), side_of(object.side));
        let map = shown.map();
        if let Shape::Mesh(name) = &object.shape {
            if let Some(data) = lookup.mesh_data(name) {
                mesh(&mut list, index, data, map, (radiance, side), observer)?;
            }
            continue;
        }
        let known = last.filter(|(shape, turn, _)| **shape == object.shape && *turn == map.matrix3).map(|(.., area)| area);
        last =
            shape(&mut list, &object.shape, map, radiance, side, known).map(|area| (&object.shape, map.matrix3, area)).or(last);
    }
    Ok(list)
}

/// Adds a shape under a map, with numbers of its own where it is only moved, as the geometry has it, and returns its area.
fn shape<P: Precision>(
    list: &mut EmitterList<P>,
    shape: &Shape,
    map: DAffine3,
    radiance: Vec3Of<P>,
    side: Side,
    area: Option<f64>,
) -> Option<f64> {
    if map.matrix3 == DMat3::IDENTITY {
        return any_shape(shape, map.translation).map(|shape| list.plain(shape, radiance, side, area));
    }
    let placed = Placed::new(any_shape(shape, DVec3::ZERO)?, map)?;
    Some(list.placed(placed, radiance, side, area))
}

/// Adds the triangles of an object's mesh under a map.
fn mesh<P: Precision>(
    list: &mut EmitterList<P>,
    object: usize,
    data: &MeshData,
    map: DAffine3,
    (radiance, side): (Vec3Of<P>, Side),
    observer: &dyn Observer,
) -> Result<(), PrepareError> {
    let mut group = Group::<P>::default();
    let flipped = map.matrix3.determinant() < 0.0;
    triangles(&mut group, object, data, Some((map, flipped)), Visibility::default(), observer)?;
    for &triangle in group.triangles() {
        list.plain(AnyShape::Triangle(triangle), radiance, side, None);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
