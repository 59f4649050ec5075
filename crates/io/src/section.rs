//! Sections through models: a plane cuts all meshes, and the geometry on one side is removed. A
//! closed mesh gets a cap, a surface in the plane that closes the opening, so that the body looks
//! solid.
//!
//! Each mesh is cut in the world space of each of its objects, after the model was rotated to its
//! up axis. A vertex whose distance from the plane is within rounding error counts as in the plane.
//! Thus a plane through a face of a body leaves no thin remainder.

mod cap;
mod clip;

use core::fmt;
use core::str::FromStr;
use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use raywright_core::affine_from_steps;
use raywright_core::extent::{flattens_surfaces, surface_triangles};
use raywright_core::fault::{Fault, FaultKind};
use raywright_core::scene::{
    Material, MaterialModel, Mesh, MeshData, MeshSource, Object, Scene, Shape, SideRule,
};

use crate::clay;
use clip::{CutMesh, MeshCutResult, MeshCutter};

/// Plane that cuts a scene's meshes open, perpendicular to a coordinate axis. The geometry on one
/// side of the plane is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPlane {
    /// Axis perpendicular to the plane: 0 for x, 1 for y, 2 for z.
    axis: usize,
    /// Whether the side of greater coordinates is kept, not the side of lesser coordinates.
    keeps_above: bool,
    position: PlanePosition,
}

/// Position of a section plane on its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PlanePosition {
    /// Coordinate in units of the model.
    Coordinate(f64),
    /// Fraction of the bounding box of all meshes, from 0 at its least coordinate to 1 at its
    /// greatest.
    Fraction(f64),
}

impl FromStr for SectionPlane {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || {
            "expected an axis and a position, such as x=0.3 in units of the model, or x=30% of the extent of all meshes; -x=0.3 keeps the opposite side"
                .to_owned()
        };
        let (name, place) = text.split_once('=').ok_or_else(expected)?;
        let (keeps_above, name) = name
            .trim()
            .strip_prefix('-')
            .map_or((false, name.trim()), |name| (true, name));
        let axis = ["x", "y", "z"]
            .iter()
            .position(|axis| name.eq_ignore_ascii_case(axis))
            .ok_or_else(expected)?;
        let number = |text: &str| {
            text.trim()
                .parse()
                .ok()
                .filter(|x: &f64| x.is_finite())
                .ok_or_else(expected)
        };
        let position = match place.trim().strip_suffix('%') {
            Some(share) => PlanePosition::Fraction(number(share)? / 100.0),
            None => PlanePosition::Coordinate(number(place)?),
        };
        Ok(Self {
            axis,
            keeps_above,
            position,
        })
    }
}

impl fmt::Display for SectionPlane {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (side, axis) = (
            if self.keeps_above { "-" } else { "" },
            ["x", "y", "z"][self.axis],
        );
        match self.position {
            PlanePosition::Coordinate(at) => write!(f, "{side}{axis}={at}"),
            PlanePosition::Fraction(share) => write!(f, "{side}{axis}={}%", 100.0 * share),
        }
    }
}

impl SectionPlane {
    /// Returns 1 if the side of lesser coordinates is kept, -1 otherwise.
    fn side_sign(&self) -> f64 {
        if self.keeps_above { -1.0 } else { 1.0 }
    }
}

/// Largest distance from the plane at which a vertex counts as in the plane, relative to the
/// largest coordinate. It is four units in the last place (f32) of half that coordinate.
const COORDINATE_TOLERANCE: f64 = 2.5e-7;

/// Cuts all meshes of a scene by a plane, and adds caps to closed meshes. Returns the warnings, in
/// which the scene is called `name`.
pub(crate) fn cut_scene(scene: &mut Scene, section: &SectionPlane, name: &str) -> Vec<Fault> {
    let meshes = meshes_to_cut(scene);
    let mut warnings: Vec<Fault> = uncut_warning(scene, &meshes, name).into_iter().collect();
    let Some([minimum, maximum]) = coordinate_range(scene, &meshes, section.axis) else {
        return warnings;
    };
    let plane = match section.position {
        PlanePosition::Coordinate(at) => at,
        PlanePosition::Fraction(share) => minimum + share * (maximum - minimum),
    };
    let tolerance = COORDINATE_TOLERANCE * minimum.abs().max(maximum.abs());
    let height = |point: DVec3| {
        let height = section.side_sign() * (point[section.axis] - plane);
        if height.abs() <= tolerance {
            0.0
        } else {
            height
        }
    };
    let (mut kept, mut open, mut materials) = (Vec::new(), 0, CapMaterials::from_scene(scene));
    for (mut object, data) in core::mem::take(&mut scene.objects).into_iter().zip(meshes) {
        let Some(data) = data else {
            kept.push(object);
            continue;
        };
        let map = affine_from_steps(&object.transform);
        let heights: Vec<f64> = data
            .positions
            .iter()
            .map(|point| height(map.transform_point3(point)))
            .collect();
        match MeshCutter::new(&data, &heights, map, section).clip_mesh() {
            MeshCutResult::Unchanged => {}
            MeshCutResult::Removed => continue,
            MeshCutResult::Partial(cut) => {
                let CutMesh { mesh, cap, is_open } = *cut;
                if is_open {
                    // Without a complete cap, the inside of the body is visible, so that both sides
                    // are rendered.
                    object.side = SideRule::Both;
                    open += 1;
                }
                if !cap.indices.is_empty() {
                    let (shape, material) = (
                        add_cut_mesh(scene, &object, cap),
                        materials.add_cap_material(scene, &object.material),
                    );
                    kept.push(Object {
                        shape,
                        material,
                        ..object.clone()
                    });
                }
                object.shape = add_cut_mesh(scene, &object, mesh);
            }
        }
        kept.push(object);
    }
    scene.objects = kept;
    warnings.extend(open_meshes_warning(open, name));
    warnings.extend(nothing_left_warning(
        scene,
        section.axis,
        [minimum, maximum],
        name,
    ));
    warnings
}

/// Returns the warning about `count` cut meshes that are not closed; `None` if all are closed.
fn open_meshes_warning(count: usize, name: &str) -> Option<Fault> {
    let message = format!(
        "{count} of the cut meshes are not closed, so that the section leaves openings in them; close the holes of these meshes for a solid section"
    );
    (count > 0).then(|| FaultKind::Section.in_file(name, message))
}

/// Returns the warning about a section that removed all objects of a scene; `None` if an object is
/// left. The model had coordinates between `least` and `most` on the axis.
fn nothing_left_warning(
    scene: &Scene,
    axis: usize,
    [least, most]: [f64; 2],
    name: &str,
) -> Option<Fault> {
    let [least, most] = [least, most].map(|x| format!("{x:.6}"));
    let axis = ["x", "y", "z"][axis];
    let message = format!(
        "the section removes the whole model, which lies between {least} and {most} along {axis}"
    );
    let is_empty = scene.objects.is_empty();
    is_empty.then(|| FaultKind::Section.in_file(name, message))
}

/// Adds a cut mesh to the scene, under a name derived from the name of the object's mesh. Returns
/// the shape that refers to the new mesh.
fn add_cut_mesh(scene: &mut Scene, object: &Object, data: MeshData) -> Shape {
    let own = if let Shape::Mesh(own) = &object.shape {
        own
    } else {
        ""
    };
    let name = format!("{own} (section {})", scene.meshes.len());
    scene.meshes.push(Mesh {
        name: name.clone(),
        source: MeshSource::Inline(Arc::new(data)),
        model: None,
    });
    Shape::Mesh(name)
}

/// Chooses the materials of caps. A cap has the material of its body. If that material uses images
/// or vertex colours, for which a cap has no data, the cap is grey clay instead.
struct CapMaterials {
    /// For each material by name: whether it uses images or vertex colours.
    varies: HashMap<String, bool>,
}

impl CapMaterials {
    fn from_scene(scene: &Scene) -> Self {
        let varies = |material: &Material| {
            let is_coloured =
                matches!(&material.model, MaterialModel::Physical(model) if model.vertex_colours);
            (
                material.name.clone(),
                is_coloured || material.textures().next().is_some(),
            )
        };
        Self {
            varies: scene.materials.iter().map(varies).collect(),
        }
    }

    /// Returns the name of the material for a cap of a body with the material `body`. If the cap
    /// needs grey clay, the clay is added to the scene.
    fn add_cap_material(&mut self, scene: &mut Scene, body: &str) -> String {
        if self.varies.get(body) != Some(&true) {
            return body.to_owned();
        }
        let grey = format!("{body} (cap)");
        if self.varies.insert(grey.clone(), false).is_none() {
            scene.materials.push(Material {
                name: grey.clone(),
                model: clay::clay_model(),
            });
        }
        grey
    }
}

/// Returns the mesh of each object that the section cuts; `None` for a moving object, and for an
/// object of another shape.
fn meshes_to_cut(scene: &Scene) -> Vec<Option<Arc<MeshData>>> {
    let inline = |mesh: &Mesh| {
        if let MeshSource::Inline(data) = &mesh.source {
            Some(Arc::clone(data))
        } else {
            None
        }
    };
    // Of several meshes with the same name, the first applies.
    let by_name: HashMap<&str, &Mesh> = scene
        .meshes
        .iter()
        .rev()
        .map(|mesh| (mesh.name.as_str(), mesh))
        .collect();
    let value_of = |object: &Object| {
        let Shape::Mesh(name) = &object.shape else {
            return None;
        };
        by_name
            .get(name.as_str())
            .filter(|_| object.transform_end.is_none())
            .and_then(|mesh| inline(mesh))
    };
    scene.objects.iter().map(value_of).collect()
}

/// Returns the least and the greatest world coordinate, on an axis, of all meshes to be cut; `None`
/// if no mesh is to be cut.
fn coordinate_range(
    scene: &Scene,
    meshes: &[Option<Arc<MeshData>>],
    axis: usize,
) -> Option<[f64; 2]> {
    let along = |(object, data): (&Object, &Option<Arc<MeshData>>)| {
        let (data, map) = (data.as_ref()?, affine_from_steps(&object.transform));
        let coordinates = surface_triangles(data)
            .flatten()
            .filter(|_| !flattens_surfaces(&map))
            .map(|i| map.transform_point3(data.positions.position(i as usize))[axis]);
        coordinates.fold(None, |range, x| {
            Some(range.map_or([x; 2], |[minimum, maximum]: [f64; 2]| {
                [minimum.min(x), maximum.max(x)]
            }))
        })
    };
    scene
        .objects
        .iter()
        .zip(meshes)
        .filter_map(along)
        .reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
}

/// Returns the warning about objects that the section does not cut; `None` if all objects are cut.
fn uncut_warning(scene: &Scene, meshes: &[Option<Arc<MeshData>>], name: &str) -> Option<Fault> {
    let count = meshes.iter().filter(|mesh| mesh.is_none()).count() + scene.generators.len();
    let message = format!(
        "{count} objects are not cut by the section, which cuts only triangle meshes without motion"
    );
    (count > 0).then(|| FaultKind::Section.in_file(name, message))
}

#[cfg(test)]
mod tests;
