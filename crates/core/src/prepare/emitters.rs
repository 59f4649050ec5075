//! The surfaces that light others: objects whose material gives off the same radiance everywhere.

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::{AnyShape, Placed};
use raywright_bvh::{Group, Precision, Side, Vec3Of, Vector, Visibility};

use super::geometry::{any_shape, side_of, triangles};
use crate::generate::all;
use crate::light::EmitterList;
use crate::lookup::Lookup;
use crate::scene::{Material, MeshData, Scene, Shape};

/// Finds them, in the order of the scene's objects.
pub(super) fn emitters<P: Precision>(scene: &Scene, lookup: &Lookup<'_>) -> EmitterList<P> {
    let mut list = EmitterList::default();
    // A generator's objects differ only in their places, which leave the area alone.
    let mut last: Option<(&Shape, DMat3, f64)> = None;
    for shown in all(scene) {
        list.next_object();
        let object = shown.object;
        let material = lookup.material(&object.material).map(|(_, material)| material);
        let Some(radiance) = material.and_then(Material::even_emission) else { continue };
        let (radiance, side) = (Vector::from_f64(radiance.0.into()), side_of(object.side));
        let map = shown.map();
        if let Shape::Mesh(name) = &object.shape {
            if let Some((_, data)) = lookup.mesh_data(name) {
                mesh(&mut list, data, map, radiance, side);
            }
            continue;
        }
        let known = last.filter(|(shape, turn, _)| **shape == object.shape && *turn == map.matrix3).map(|(.., area)| area);
        last =
            shape(&mut list, &object.shape, map, radiance, side, known).map(|area| (&object.shape, map.matrix3, area)).or(last);
    }
    list
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

/// Adds the triangles of a mesh under a map.
fn mesh<P: Precision>(list: &mut EmitterList<P>, data: &MeshData, map: DAffine3, radiance: Vec3Of<P>, side: Side) {
    let mut group = Group::<P>::default();
    let flipped = map.matrix3.determinant() < 0.0;
    if triangles(&mut group, data, Some((map, flipped)), Visibility::default()).is_ok() {
        for &triangle in group.triangles() {
            list.plain(AnyShape::Triangle(triangle), radiance, side, None);
        }
    }
}

#[cfg(test)]
mod tests;
