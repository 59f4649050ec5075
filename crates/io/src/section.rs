//! Sections through models: a plane cuts all meshes, and the geometry on one side is removed. A
//! closed mesh gets a cap, a hatched surface in the plane that closes the opening, so that the body
//! looks solid.
//!
//! Each mesh is cut in the world space of each of its objects, after the model was rotated to its
//! up axis; the plane is stated in the axes of the file. A vertex whose distance from the plane is within rounding error counts as in the plane.
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
    ColourInput, Material, MaterialModel, Mesh, MeshData, MeshSource, Object, Physical, Scene,
    Shape, SideRule,
};

use crate::up_axis::UpAxis;
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

    /// Returns the same plane once the model is turned so that its axis `up` is y, and 1 if
    /// coordinates grow along the turned axis as along the file's, -1 otherwise.
    fn turned(&self, up: UpAxis) -> (Self, f64) {
        let (axis, sign) = up.turned_axis(self.axis);
        if sign > 0.0 {
            return (Self { axis, ..*self }, sign);
        }
        let position = match self.position {
            PlanePosition::Coordinate(at) => PlanePosition::Coordinate(-at),
            PlanePosition::Fraction(share) => PlanePosition::Fraction(1.0 - share),
        };
        let turned = Self {
            axis,
            keeps_above: !self.keeps_above,
            position,
        };
        (turned, sign)
    }
}

/// Largest distance from the plane at which a vertex counts as in the plane, relative to the
/// largest coordinate. It is four units in the last place (f32) of half that coordinate.
const COORDINATE_TOLERANCE: f64 = 2.5e-7;
/// The same relative to the model's extent, which limits it: a model far from the origin may have
/// coordinates in double precision.
const EXTENT_TOLERANCE: f64 = 1e-5;

/// Cuts all meshes of a scene by a plane, and adds caps to closed meshes. The plane is that of the
/// file, whose axis `up` has been turned to y. Returns the warnings, in which the scene is called
/// `name`.
pub(crate) fn cut_scene(
    scene: &mut Scene,
    file_section: &SectionPlane,
    up: UpAxis,
    name: &str,
) -> Vec<Fault> {
    let (section, sign) = file_section.turned(up);
    let meshes = meshes_to_cut(scene);
    let mut warnings: Vec<Fault> = uncut_warning(scene, &meshes, name).into_iter().collect();
    let Some([minimum, maximum]) = coordinate_range(scene, &meshes, section.axis) else {
        return warnings;
    };
    let plane = match section.position {
        PlanePosition::Coordinate(at) => at,
        PlanePosition::Fraction(share) => minimum + share * (maximum - minimum),
    };
    let tolerance = (COORDINATE_TOLERANCE * minimum.abs().max(maximum.abs()))
        .min(EXTENT_TOLERANCE * (maximum - minimum));
    let height = |point: DVec3| {
        let height = section.side_sign() * (point[section.axis] - plane);
        if height.abs() <= tolerance {
            0.0
        } else {
            height
        }
    };
    let mut materials = CapMaterials::new(scene, &meshes, section.axis);
    let (mut kept, mut open, mut is_cut) = (Vec::new(), 0, false);
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
        match MeshCutter::new(&data, &heights, map, &section).clip_mesh() {
            MeshCutResult::Unchanged => {}
            MeshCutResult::Removed => {
                is_cut = true;
                continue;
            }
            MeshCutResult::Partial(cut) => {
                is_cut = true;
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
    let range = if sign > 0.0 {
        [minimum, maximum]
    } else {
        [-maximum, -minimum]
    };
    let is_beyond = plane < minimum - tolerance || plane > maximum + tolerance;
    let result = match (scene.objects.is_empty(), is_cut) {
        (true, _) => Some("removes the whole model, which lies"),
        (false, false) if is_beyond => Some("cuts nothing: the model lies"),
        _ => None,
    };
    warnings.extend(result.map(|result| {
        let [least, most] = range.map(|x| format!("{x:.6}"));
        let axis = ["x", "y", "z"][file_section.axis];
        let message =
            format!("the section {file_section} {result} between {least} and {most} along {axis}");
        FaultKind::Section.in_file(name, message)
    }));
    warnings
}

/// Returns the warning about `count` cut meshes that are not closed; `None` if all are closed.
fn open_meshes_warning(count: usize, name: &str) -> Option<Fault> {
    let message = format!(
        "{count} of the cut meshes are not closed, so that the section leaves openings in them; close the holes of these meshes for a solid section"
    );
    (count > 0).then(|| FaultKind::Section.in_file(name, message))
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

/// Materials of caps: a colour of their own with hatching, so that a cap is no face of the body.
/// Bodies of one material are hatched alike, and neighbours in turn to the left and to the right.
struct CapMaterials {
    /// Number of each material of a body, in the order of their first caps.
    bodies: HashMap<String, usize>,
    /// Sums of the two coordinates in the plane, with each sign of the second, in lines of hatching.
    lines: [String; 2],
}

impl CapMaterials {
    /// Prepares the hatching of a section across an axis, 30 lines across a scene of meshes.
    fn new(scene: &Scene, meshes: &[Option<Arc<MeshData>>], axis: usize) -> Self {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let [from, to] = [u, v]
            .map(|side| coordinate_range(scene, meshes, side))
            .map(|range| range.unwrap_or([0.0, 1.0]));
        let step = ((from[1] - from[0]).max(to[1] - to[0]) / 30.0).max(f64::MIN_POSITIVE);
        let line = |sign: &str| {
            let [u, v] = [u, v].map(|side| ["x", "y", "z"][side]);
            format!(
                "((p.{u} - {:e}) {sign} (p.{v} - {:e})) / {step:e}",
                from[0], to[0]
            )
        };
        Self {
            bodies: HashMap::new(),
            lines: ["+", "-"].map(line),
        }
    }

    /// Returns the name of the material for a cap of a body with the material `body`, which is
    /// added to the scene if it is new.
    fn add_cap_material(&mut self, scene: &mut Scene, body: &str) -> String {
        let count = self.bodies.len();
        let number = *self.bodies.entry(body.to_owned()).or_insert(count);
        let name = format!("(section cap {})", number % 2 + 1);
        if number == count && number < 2 {
            let colour = format!(
                "mix([0.75, 0.24, 0.07], [0.2, 0.05, 0.02], step(0.75, fract({})))",
                self.lines[number]
            );
            scene.materials.push(Material {
                name: name.clone(),
                model: MaterialModel::Physical(Box::new(Physical {
                    base_colour: ColourInput::Expression(colour),
                    specular: 0.0.into(),
                    ..Physical::default()
                })),
            });
        }
        name
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
