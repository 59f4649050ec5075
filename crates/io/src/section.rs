//! Sections through models: the geometry on one side of a plane is removed. Closed meshes get a cap
//! in the plane, and therefore look solid.
//!
//! Each mesh is cut in the world space of each object, after the up axis is applied. A vertex whose
//! distance from the plane is within rounding error counts as in the plane, so that a plane through
//! a face leaves no sliver of the mesh.

mod cap;
mod clip;

use core::fmt;
use core::str::FromStr;
use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use raywright_core::affine_from_steps;
use raywright_core::scene::{
    Material, MaterialModel, Mesh, MeshData, MeshSource, Object, Scene, Shape, SideRule,
};

use crate::clay;
use crate::warning::{Warning, WarningCode};
use clip::{CutMesh, MeshCutResult, MeshCutter};

/// A plane perpendicular to an axis, and its kept side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPlane {
    /// 0 for x, 1 for y, 2 for z.
    axis: usize,
    /// Whether the side of greater coordinates is kept.
    keeps_above: bool,
    position: PlanePosition,
}

/// Position of a plane on its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PlanePosition {
    /// In units of the model.
    Coordinate(f64),
    /// As a fraction of the bounding box of all meshes, from its least coordinate.
    Fraction(f64),
}

impl FromStr for SectionPlane {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || {
            "expected an axis and where it is cut, such as x=0.3 in units of the model, or x=30%; -x keeps the other side"
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
    /// 1 where the side of lesser coordinates is kept, -1 otherwise.
    fn side_sign(&self) -> f64 {
        if self.keeps_above { -1.0 } else { 1.0 }
    }
}

/// Tolerance for a vertex in the plane, relative to the largest coordinate: four units in the last
/// place, in f32, of half that coordinate.
const COORDINATE_TOLERANCE: f64 = 2.5e-7;

/// Cuts all meshes of a scene by a plane, and adds caps to closed meshes. Returns the warnings,
/// which call the scene `name`.
pub(crate) fn cut_scene(scene: &mut Scene, section: &SectionPlane, name: &str) -> Vec<Warning> {
    let meshes = meshes_to_cut(scene);
    let mut warnings: Vec<Warning> = uncut_warning(scene, &meshes, name).into_iter().collect();
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
        match MeshCutter::new(&data, &heights, map, section).cut() {
            MeshCutResult::Unchanged => {}
            MeshCutResult::Removed => continue,
            MeshCutResult::Partial(cut) => {
                let CutMesh { mesh, cap, is_open } = *cut;
                if is_open {
                    // The inside is visible now.
                    object.side = SideRule::Both;
                    open += 1;
                }
                if !cap.indices.is_empty() {
                    let (shape, material) = (
                        replace_mesh(scene, &object, cap),
                        materials.add_cap_material(scene, &object.material),
                    );
                    kept.push(Object {
                        shape,
                        material,
                        ..object.clone()
                    });
                }
                object.shape = replace_mesh(scene, &object, mesh);
            }
        }
        kept.push(object);
    }
    scene.objects = kept;
    if open > 0 {
        let message = format!(
            "{open} of the meshes that the section cuts are not closed there, so that their cuts have no caps, or not all"
        );
        warnings.push(Warning::new(WarningCode::Section, name, message));
    }
    if scene.objects.is_empty() {
        let [least, most] = [minimum, maximum].map(|x| format!("{x:.6}"));
        let axis = ["x", "y", "z"][section.axis];
        let message = format!(
            "the section leaves nothing of it: it lies between {least} and {most} along {axis}"
        );
        warnings.push(Warning::new(WarningCode::Section, name, message));
    }
    warnings
}

/// Adds a cut mesh to the scene, under a name derived from the object's mesh, and returns the shape
/// of the new mesh.
fn replace_mesh(scene: &mut Scene, object: &Object, data: MeshData) -> Shape {
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

/// Materials of caps: the body's own material, or grey clay if that material uses images or vertex
/// colours, for which a cap has no data.
struct CapMaterials {
    /// Whether each material uses images or vertex colours, by name.
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

    /// Returns the name of a cap's material. A new material is added to the scene.
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

/// Mesh of each object that is cut; `None` for moving objects and other shapes.
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

/// Least and greatest world coordinate of all cut meshes on an axis; `None` without such a mesh.
fn coordinate_range(
    scene: &Scene,
    meshes: &[Option<Arc<MeshData>>],
    axis: usize,
) -> Option<[f64; 2]> {
    let along = |(object, data): (&Object, &Option<Arc<MeshData>>)| {
        let (data, map) = (data.as_ref()?, affine_from_steps(&object.transform));
        let coordinates = data
            .positions
            .iter()
            .map(|point| map.transform_point3(point)[axis]);
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

/// Returns the warning about objects that are not cut, if any.
fn uncut_warning(scene: &Scene, meshes: &[Option<Arc<MeshData>>], name: &str) -> Option<Warning> {
    let count = meshes.iter().filter(|mesh| mesh.is_none()).count() + scene.generators.len();
    let message = format!(
        "{count} objects are not cut by the section: only triangle meshes are that stand still"
    );
    (count > 0).then(|| Warning::new(WarningCode::Section, name, message))
}

#[cfg(test)]
mod tests;
