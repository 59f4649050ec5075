//! Conversion of polygons to triangle meshes, one for each material and kind of shading (flat or
//! smooth). Vertices of the input are shared between polygons.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use raywright_core::scene::{MeshData, VertexPositions, choose_storage_origin};

use super::MaterialMesh;
use super::survey::{FaceGroup, NormalSource};
use crate::import::{Fault, ImportResult, Warnings};
use crate::mesh_tools::{decode_vertex_colour, vertex_colour_scale};
use crate::polygon::{self, EarClipper};

/// The polygons of a run of faces.
struct Polygons {
    group: FaceGroup,
    mesh: tobj::Mesh,
    /// Positions of the vertices, as stored in the scene.
    offsets: Vec<[f32; 3]>,
}

/// Sums of the polygons' normals, weighted by area, by smoothing group and bits of the position.
/// Vertices that differ only in texture coordinates have equal keys, and therefore equal normals.
type SmoothNormals = HashMap<(u32, [u32; 3]), DVec3>;

/// Builds a mesh for each material and kind of shading, from the models of the runs of faces.
///
/// # Errors
///
/// A fault of kind limit for too many vertices or oversized concave polygons.
pub(super) fn build_meshes(
    runs: Vec<FaceGroup>,
    models: Vec<tobj::Model>,
    warnings: &mut Warnings,
) -> ImportResult<Vec<MaterialMesh>> {
    let coordinates = models
        .iter()
        .flat_map(|model| chunks(&model.mesh.positions));
    let origin = choose_storage_origin(coordinates.map(|&p| p.into()));
    let channels = models.iter().flat_map(|model| &model.mesh.vertex_color);
    let scale = vertex_colour_scale(channels.map(|&channel| channel as f32), warnings);
    let offset = |p: &[f64; 3]| (DVec3::from(*p) - origin).as_vec3().to_array();
    let runs = runs.into_iter().zip(models).map(|(group, model)| Polygons {
        group,
        offsets: chunks(&model.mesh.positions).iter().map(offset).collect(),
        mesh: model.mesh,
    });
    let runs: Vec<Polygons> = runs.collect();
    let normals = sum_smooth_normals(&runs);
    let mut clipper = EarClipper::default();
    let mut parts: Vec<MaterialMesh> = Vec::new();
    let mut numbers = HashMap::new();
    for run in &runs {
        let FaceGroup {
            material,
            normal_source,
            ..
        } = run.group;
        let next = parts.len();
        let number = *numbers
            .entry((material, normal_source == NormalSource::Flat))
            .or_insert(next);
        if number == next {
            let data = MeshData {
                positions: VertexPositions::with_origin(origin),
                ..MeshData::default()
            };
            parts.push((material, data));
        }
        run.append_to(&mut parts[number].1, &normals, scale, &mut clipper)?;
    }
    Ok(parts)
}

/// Splits a list of numbers into vectors.
fn chunks<const N: usize>(numbers: &[f64]) -> &[[f64; N]] {
    numbers.as_chunks().0
}

fn position_key(group: u32, p: [f32; 3]) -> (u32, [u32; 3]) {
    // Adding 0 maps −0 to 0.
    (group, p.map(|c| (c + 0.0).to_bits()))
}

/// Sums the normals of the polygons in smoothing groups.
fn sum_smooth_normals(runs: &[Polygons]) -> SmoothNormals {
    let mut sums = SmoothNormals::new();
    let mut points = Vec::new();
    for run in runs {
        let NormalSource::Group(group) = run.group.normal_source else {
            continue;
        };
        for face in run.faces() {
            run.corners(face, &mut points);
            let normal = polygon::newell_normal(&points);
            if normal.is_finite() {
                for &vertex in face {
                    let key = position_key(group, run.offsets[vertex as usize]);
                    *sums.entry(key).or_insert(DVec3::ZERO) += normal;
                }
            }
        }
    }
    sums
}

impl Polygons {
    /// Returns the corners of each polygon, as a slice of the mesh's indices.
    fn faces(&self) -> impl Iterator<Item = &[u32]> {
        let mut rest = self.mesh.indices.as_slice();
        let mut arities = self.mesh.face_arities.iter();
        std::iter::from_fn(move || {
            // tobj omits the arities if all faces are triangles.
            let arity = arities.next().map_or(3, |&arity| arity as usize);
            let (face, after) = rest.split_at_checked(arity)?;
            rest = after;
            Some(face)
        })
    }

    /// Replaces `points` by the corners of a polygon.
    fn corners(&self, face: &[u32], points: &mut Vec<DVec3>) {
        points.clear();
        let corner = |&vertex: &u32| Vec3::from(self.offsets[vertex as usize]).as_dvec3();
        points.extend(face.iter().map(corner));
    }

    /// Appends vertices and triangles to a mesh.
    fn append_to(
        &self,
        out: &mut MeshData,
        normals: &SmoothNormals,
        scale: f32,
        clipper: &mut EarClipper,
    ) -> ImportResult<()> {
        let before = out.positions.len();
        let Ok(first) = u32::try_from(before + self.offsets.len()).map(|_| before as u32) else {
            return Err(Fault::over_limit(
                "has more than 4294967295 vertices; divide the file",
            ));
        };
        out.positions.extend_offsets(self.offsets.iter().copied());
        let to_f32 = |vector: &[f64; 3]| vector.map(|c| c as f32);
        match self.group.normal_source {
            NormalSource::Flat => {}
            NormalSource::FromFile => {
                let normals = chunks(&self.mesh.normals);
                out.normals.extend(normals.iter().map(to_f32));
            }
            NormalSource::Group(group) => out.normals.extend(self.offsets.iter().map(|&p| {
                let sum = normals.get(&position_key(group, p)).copied();
                let normal = sum.unwrap_or_default().normalize_or_zero();
                normal.as_vec3().to_array()
            })),
        }
        self.append_uvs(out, before);
        let colours = chunks(&self.mesh.vertex_color).iter().map(to_f32);
        out.colours
            .extend(colours.map(|rgb| decode_vertex_colour(rgb.map(|c| c * scale))));
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        for face in self.faces() {
            self.corners(face, &mut points);
            triangles.clear();
            clipper.triangulate(&points, &mut triangles)?;
            let triangles = triangles.iter();
            out.indices
                .extend(triangles.map(|triangle| triangle.map(|corner| first + face[corner])));
        }
        Ok(())
    }

    /// Appends the texture coordinates to a mesh that had `before` vertices. If only some runs of
    /// the mesh have texture coordinates, the vertices of all other runs get zeros.
    fn append_uvs(&self, out: &mut MeshData, before: usize) {
        if self.group.has_uvs && out.uvs.is_empty() {
            out.uvs.push(vec![[0.0; 2]; before]);
        }
        let Some(set) = out.uvs.first_mut() else {
            return;
        };
        if self.group.has_uvs {
            // In the file, v counts upwards from the bottom row of the image; in a scene, v counts
            // downwards from the top row.
            let uv = |&[u, v]: &[f64; 2]| match u.is_finite() && v.is_finite() {
                true => [u as f32, 1.0 - v as f32],
                false => [0.0; 2],
            };
            set.extend(chunks(&self.mesh.texcoords).iter().map(uv));
        } else {
            set.resize(out.positions.len(), [0.0; 2]);
        }
    }
}
