//! Conversion of polygons to triangle meshes, one for each material and kind of shading (flat or
//! smooth). Vertices of the input are shared between polygons.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use raywright_core::scene::{MeshData, VertexPositions, choose_storage_origin};

use super::survey::{FaceGroup, NormalSource};
use crate::import::{Fault, ImportResult, Warnings};
use crate::mesh_tools::{decode_vertex_colour, vertex_colour_scale};
use crate::polygon::{self, EarClipper};

/// Triangle mesh of the faces that have the same material and are all flat or all smooth.
#[derive(Debug)]
pub(super) struct MaterialMesh {
    /// Index into the survey's list of materials; `None` for faces without a material.
    pub material: Option<usize>,
    pub data: MeshData,
}

/// Key of a vertex normal in smooth shading: smoothing group, and bits of the position. Vertices
/// that differ only in texture coordinates have equal keys, and therefore equal normals.
type PositionKey = (u32, [u32; 3]);

/// Builds a mesh for each material and kind of shading. `models` are the parsed polygons. The name
/// of a model is an index into `runs`, the properties that the model's faces have in common.
///
/// # Errors
///
/// A fault of kind limit for too many vertices or oversized concave polygons.
pub(super) fn build_meshes(
    runs: &[FaceGroup],
    models: Vec<tobj::Model>,
    warnings: &mut Warnings,
) -> ImportResult<Vec<MaterialMesh>> {
    let models: Vec<(FaceGroup, tobj::Mesh)> = models
        .into_iter()
        .filter_map(|model| Some((*runs.get(model.name.parse::<usize>().ok()?)?, model.mesh)))
        .collect();
    let coordinates = models
        .iter()
        .flat_map(|(_, mesh)| mesh.positions.as_chunks::<3>().0);
    let origin = choose_storage_origin(coordinates.map(|&p| p.into()));
    let normals = sum_smooth_normals(&models, origin);
    let channels = models.iter().flat_map(|(_, mesh)| &mesh.vertex_color);
    let scale = vertex_colour_scale(channels.map(|&channel| channel as f32), warnings);
    let mut clipper = EarClipper::default();
    let mut parts: Vec<MaterialMesh> = Vec::new();
    let mut numbers: HashMap<(Option<usize>, bool), usize> = HashMap::new();
    for (run, mesh) in &models {
        let next = parts.len();
        let number = *numbers
            .entry((run.material, run.normal_source == NormalSource::Flat))
            .or_insert(next);
        if number == next {
            parts.push(MaterialMesh {
                material: run.material,
                data: MeshData {
                    positions: VertexPositions::with_origin(origin),
                    ..MeshData::default()
                },
            });
        }
        if let Some(part) = parts.get_mut(number) {
            append_vertices(&mut part.data, run, (mesh, origin), &normals, scale)?;
            append_triangles(&mut part.data, (mesh, origin), &mut clipper)?;
        }
    }
    Ok(parts)
}

/// Returns the corners of each polygon, as a slice of `mesh.indices`.
fn split_polygons(mesh: &tobj::Mesh) -> impl Iterator<Item = &[u32]> {
    // tobj omits the arities if all faces are triangles.
    let count = if mesh.face_arities.is_empty() {
        mesh.indices.len() / 3
    } else {
        mesh.face_arities.len()
    };
    let mut rest = mesh.indices.as_slice();
    (0..count).map_while(move |i| {
        let arity = mesh.face_arities.get(i).map_or(3, |&arity| arity as usize);
        let (face, after) = rest.split_at_checked(arity)?;
        rest = after;
        Some(face)
    })
}

fn vertex_position(mesh: &tobj::Mesh, origin: DVec3, vertex: u32) -> [f32; 3] {
    (DVec3::from(read_three_numbers(&mesh.positions, vertex as usize)) - origin)
        .as_vec3()
        .to_array()
}

fn read_three_numbers(values: &[f64], i: usize) -> [f64; 3] {
    values
        .get(3 * i..)
        .and_then(|rest| rest.first_chunk())
        .copied()
        .unwrap_or_default()
}

/// Rounds to single precision.
fn to_f32(values: [f64; 3]) -> [f32; 3] {
    values.map(|value| value as f32)
}

fn to_dvec3(p: [f32; 3]) -> DVec3 {
    Vec3::from_array(p).as_dvec3()
}

fn position_key(group: u32, p: [f32; 3]) -> PositionKey {
    // Adding 0 maps −0 to 0.
    (group, p.map(|c| (c + 0.0).to_bits()))
}

/// Returns the sum of the polygons' normals, weighted by area, for each smoothing group and
/// position.
fn sum_smooth_normals(
    models: &[(FaceGroup, tobj::Mesh)],
    origin: DVec3,
) -> HashMap<PositionKey, DVec3> {
    let mut sums = HashMap::new();
    let mut points = Vec::new();
    for (run, mesh) in models {
        let NormalSource::Group(group) = run.normal_source else {
            continue;
        };
        for face in split_polygons(mesh) {
            points.clear();
            points.extend(
                face.iter()
                    .map(|&vertex| to_dvec3(vertex_position(mesh, origin, vertex))),
            );
            let normal = polygon::newell_normal(&points);
            if normal.is_finite() {
                for &vertex in face {
                    *sums
                        .entry(position_key(group, vertex_position(mesh, origin, vertex)))
                        .or_insert(DVec3::ZERO) += normal;
                }
            }
        }
    }
    sums
}

/// Appends the vertices of a run of faces to a mesh. A run is a sequence of faces with the same
/// material and kind of normals.
fn append_vertices(
    out: &mut MeshData,
    run: &FaceGroup,
    (mesh, origin): (&tobj::Mesh, DVec3),
    normals: &HashMap<PositionKey, DVec3>,
    scale: f32,
) -> ImportResult<()> {
    let before = out.positions.len();
    let count = mesh.positions.len() / 3;
    if u32::try_from(before + count).is_err() {
        return Err(Fault::over_limit(
            "has more than 4294967295 vertices; divide the file",
        ));
    }
    let vertices = || (0..count as u32).map(|vertex| vertex_position(mesh, origin, vertex));
    out.positions.extend_offsets(vertices());
    match run.normal_source {
        NormalSource::Flat => {}
        NormalSource::FromFile => out
            .normals
            .extend((0..count).map(|i| to_f32(read_three_numbers(&mesh.normals, i)))),
        NormalSource::Group(group) => out.normals.extend(vertices().map(|p| {
            let sum = normals
                .get(&position_key(group, p))
                .copied()
                .unwrap_or_default();
            sum.normalize_or_zero().as_vec3().to_array()
        })),
    }
    append_uvs(out, run, mesh, before, count);
    if !mesh.vertex_color.is_empty() {
        out.colours.extend((0..count).map(|i| {
            decode_vertex_colour(
                to_f32(read_three_numbers(&mesh.vertex_color, i)).map(|c| c * scale),
            )
        }));
    }
    Ok(())
}

/// Appends the triangles of a run of faces (see [`FaceGroup`]) to a mesh. The vertices of the run
/// must have been appended immediately before.
fn append_triangles(
    out: &mut MeshData,
    (mesh, origin): (&tobj::Mesh, DVec3),
    clipper: &mut EarClipper,
) -> ImportResult<()> {
    // The number of vertices was checked when they were appended, so that it fits u32.
    let offset = (out.positions.len() - mesh.positions.len() / 3) as u32;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for face in split_polygons(mesh) {
        points.clear();
        points.extend(
            face.iter()
                .map(|&vertex| to_dvec3(vertex_position(mesh, origin, vertex))),
        );
        triangles.clear();
        clipper.triangulate(&points, &mut triangles)?;
        let vertex = |corner: usize| face.get(corner).map_or(offset, |&vertex| vertex + offset);
        out.indices
            .extend(triangles.iter().map(|triangle| triangle.map(vertex)));
    }
    Ok(())
}

/// Appends the texture coordinates of a run of faces (see [`FaceGroup`]) to a mesh. If only some
/// runs of the mesh have texture coordinates, the vertices of all other runs get zeros.
fn append_uvs(out: &mut MeshData, run: &FaceGroup, mesh: &tobj::Mesh, before: usize, count: usize) {
    if run.has_uvs && out.uvs.is_empty() {
        out.uvs.push(vec![[0.0; 2]; before]);
    }
    let Some(set) = out.uvs.first_mut() else {
        return;
    };
    let uv = |i: usize| match mesh
        .texcoords
        .get(2 * i..)
        .and_then(|rest| rest.first_chunk())
    {
        // In the file, v counts upwards from the bottom row of the image; in a scene, v counts
        // downwards from the top row.
        Some(&[u, v]) if run.has_uvs && u.is_finite() && v.is_finite() => {
            [u as f32, 1.0 - v as f32]
        }
        _ => [0.0; 2],
    };
    set.extend((0..count).map(uv));
}
