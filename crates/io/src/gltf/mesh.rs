//! Primitives of glTF meshes as triangle meshes.

use glam::DVec3;
use raywright_core::scene::MeshData;

use super::GltfImport;
use super::accessor::Accessor;
use super::deform::{DeformingMesh, MeshDeformation, offset_values, read_dvec3_list};
use super::document::Document;
use super::entries::PrimitiveEntry;
use super::material::ConvertedMaterial;
use super::texture::MOST_UV_SETS;
use super::vertices::{VertexSelection, map_in_parallel, select_used_vertices};
use crate::import::{FaultPlace, ImportResult};
use crate::mesh_tools;

impl<'a> GltfImport<'a> {
    /// Converts a primitive to a triangle mesh; `None` for a primitive without triangles.
    pub(super) fn convert_primitive(
        &mut self,
        primitive: &PrimitiveEntry,
        material: &ConvertedMaterial,
        pose: &MeshDeformation,
        (mesh, part): (usize, usize),
    ) -> ImportResult<Option<MeshData>> {
        let place = format!("meshes[{mesh}].primitives[{part}]");
        let Some(topology) = TriangleTopology::from_mode(primitive.mode)? else {
            self.point_and_line_count += 1;
            return Ok(None);
        };
        let Some(positions) = self.open_attribute(primitive, "POSITION", &[3])? else {
            warn!(
                self.warnings,
                Geometry, "{place}: was left out, because it has no POSITION attribute"
            );
            return Ok(None);
        };
        let corners = self.read_triangles(primitive, topology, positions.count())?;
        self.work
            .report_done(declared_counts(self.document, primitive)[1]);
        let (vertices, indices) = select_used_vertices(corners, positions.count());
        self.budget.reserve_memory(
            vertices.len(),
            size_of::<[f32; 3]>() * 2 + size_of::<[f32; 4]>(),
        )?;
        let mut data = MeshData {
            indices,
            ..MeshData::default()
        };
        if pose.is_identity() {
            self.read_undeformed_vertices(primitive, &positions, &vertices, &mut data)?;
        } else {
            self.read_deformed_vertices(primitive, pose, &positions, &vertices, &mut data)?;
        }
        // Tangents are read only for an undeformed mesh with normals. Any other mesh that needs
        // tangents gets them during preparation of the scene.
        if material.needs_tangents && pose.is_identity() && !data.normals.is_empty() {
            data.tangents = self.read_tangents(primitive, &positions, &vertices)?;
        }
        data.uvs = self
            .read_texture_coordinates(primitive, pose, material, &positions, &vertices, &place)?;
        if let Some(colours) = self.read_vertex_colours(primitive, pose, &positions, &vertices)? {
            data.colours = colours;
            self.enable_vertex_colours(material);
        }
        let dropped = mesh_tools::drop_non_finite_triangles(&mut data);
        self.warnings.add_dropped(&format!("{place}: "), dropped);
        mesh_tools::repair_normals(&mut data);
        Ok((!data.indices.is_empty()).then_some(data))
    }

    /// Reads positions and normals as the file states them. Without normals in the file, the
    /// normals stay empty.
    fn read_undeformed_vertices(
        &mut self,
        primitive: &PrimitiveEntry,
        positions: &Accessor,
        vertices: &VertexSelection,
        data: &mut MeshData,
    ) -> ImportResult<()> {
        data.positions = vertices
            .map_selected_vertices(|v| positions.read_vector::<3>(v))
            .into();
        if let Some(normals) = self.open_vertex_attribute(primitive, "NORMAL", &[3], positions)? {
            data.normals = vertices.map_selected_vertices(|v| normals.read_vector(v));
        }
        Ok(())
    }

    /// Reads positions and normals, and moves both by morph targets and joints. A mirroring pose
    /// also reverses the triangles.
    fn read_deformed_vertices(
        &mut self,
        primitive: &PrimitiveEntry,
        pose: &MeshDeformation,
        positions: &Accessor,
        vertices: &VertexSelection,
        data: &mut MeshData,
    ) -> ImportResult<()> {
        let mut moving = DeformingMesh::default();
        if let Some(normals) = self.open_vertex_attribute(primitive, "NORMAL", &[3], positions)? {
            moving.normals = read_dvec3_list(&normals, vertices);
        }
        self.budget
            .reserve_memory(vertices.len(), 2 * size_of::<DVec3>())?;
        moving.positions = read_dvec3_list(positions, vertices);
        self.deform_vertices(primitive, pose, vertices, positions.count(), &mut moving)?;
        let single = |list: Vec<DVec3>| list.into_iter().map(|v| v.as_vec3().to_array()).collect();
        (data.positions, data.normals) = (moving.positions.into(), single(moving.normals));
        if pose.mirrored {
            data.indices
                .iter_mut()
                .for_each(|[_, b, c]| core::mem::swap(b, c));
            data.normals
                .as_flattened_mut()
                .iter_mut()
                .for_each(|c| *c = -*c);
        }
        Ok(())
    }

    /// Reads the primitive's vertex colours, changed by morph targets; `None` if the primitive has no
    /// vertex colours.
    fn read_vertex_colours(
        &mut self,
        primitive: &PrimitiveEntry,
        pose: &MeshDeformation,
        positions: &Accessor,
        vertices: &VertexSelection,
    ) -> ImportResult<Option<Vec<[f32; 4]>>> {
        let attribute: (&str, &[usize]) = ("COLOR_0", &[3, 4]);
        let colours = self.open_vertex_attribute(primitive, attribute.0, attribute.1, positions)?;
        let Some(mut colours) = colours else {
            return Ok(None);
        };
        colours.mark_as_normalised();
        let opaque = colours.element_arity() == 3;
        let mut values = vertices.map_selected_vertices(|v| colours.read_vector::<4>(v));
        let count = positions.count();
        let add = offset_values(&mut values);
        self.add_morph_offsets(primitive, pose, attribute, vertices, count, add)?;
        let clamp = |value: &mut [f32; 4]| *value = clamp_colour(*value, opaque);
        values.iter_mut().for_each(clamp);
        Ok(Some(values))
    }

    /// Reads the primitive's tangents. The list is empty if the primitive has no tangents or if any
    /// tangent is invalid.
    fn read_tangents(
        &mut self,
        primitive: &PrimitiveEntry,
        positions: &Accessor,
        vertices: &VertexSelection,
    ) -> ImportResult<Vec<[f32; 4]>> {
        let Some(tangents) = self.open_vertex_attribute(primitive, "TANGENT", &[4], positions)?
        else {
            return Ok(Vec::new());
        };
        self.budget
            .reserve_memory(vertices.len(), size_of::<[f32; 4]>())?;
        let tangent = |v: usize| {
            let [x, y, z, w] = tangents.read_vector(v);
            let length = DVec3::from([x, y, z].map(f64::from)).length();
            (length > 0.0 && length.is_finite() && w.is_finite()).then_some([
                x,
                y,
                z,
                1.0_f32.copysign(w),
            ])
        };
        Ok(vertices
            .iter()
            .map(tangent)
            .collect::<Option<_>>()
            .unwrap_or_default())
    }

    /// Opens the accessor of an attribute; `None` if the primitive lacks the attribute.
    pub(super) fn open_attribute(
        &self,
        primitive: &PrimitiveEntry,
        name: &str,
        arities: &[usize],
    ) -> ImportResult<Option<Accessor<'a>>> {
        let Some(&index) = primitive.attributes.get(name) else {
            return Ok(None);
        };
        let accessor = self.reader.open(index as usize).with_place(name)?;
        if !arities.contains(&accessor.element_arity()) {
            return Err(fault!(
                "{name}: has elements of {} components, which glTF does not allow for this attribute",
                accessor.element_arity()
            ));
        }
        Ok(Some(accessor))
    }

    /// Opens the accessor of an attribute, whose count must equal the count of positions.
    fn open_vertex_attribute(
        &self,
        primitive: &PrimitiveEntry,
        name: &str,
        arities: &[usize],
        positions: &Accessor,
    ) -> ImportResult<Option<Accessor<'a>>> {
        match self.open_attribute(primitive, name, arities)? {
            Some(accessor) if accessor.count() != positions.count() => Err(fault!(
                "{name}: has {} elements, but POSITION has {}",
                accessor.count(),
                positions.count()
            )),
            other => Ok(other),
        }
    }

    /// Returns all sets of texture coordinates that the primitive has or its material uses, changed
    /// by morph targets. A missing set consists of zeros, with a warning if the material uses the
    /// set.
    fn read_texture_coordinates(
        &mut self,
        primitive: &PrimitiveEntry,
        pose: &MeshDeformation,
        material: &ConvertedMaterial,
        positions: &Accessor,
        vertices: &VertexSelection,
        place: &str,
    ) -> ImportResult<Vec<Vec<[f32; 2]>>> {
        let mut sets = Vec::new();
        let mut missing = Vec::new();
        let present = |set: &u32| primitive.attributes.contains_key(&uv_attribute_name(*set));
        let own = (0..MOST_UV_SETS).take_while(present).count() as u32;
        let requested = material.uv_sets.iter().max().map_or(0, |most| most + 1);
        self.budget.reserve_memory(
            vertices.len(),
            size_of::<[f32; 2]>() * own.max(requested) as usize,
        )?;
        for set in 0..own.max(requested) {
            let name = uv_attribute_name(set);
            match self.open_vertex_attribute(primitive, &name, &[2], positions)? {
                Some(uv) => {
                    let mut values = vertices.map_selected_vertices(|v| uv.read_vector::<2>(v));
                    let (attribute, count) = ((name.as_str(), &[2][..]), positions.count());
                    let add = offset_values(&mut values);
                    self.add_morph_offsets(primitive, pose, attribute, vertices, count, add)?;
                    let numbers = values.as_flattened_mut().iter_mut();
                    numbers.for_each(|value| *value = finite_or_zero(*value));
                    sets.push(values);
                }
                None => {
                    sets.push(vec![[0.0; 2]; vertices.len()]);
                    missing.push(set);
                }
            }
        }
        for set in missing
            .into_iter()
            .filter(|set| material.uv_sets.contains(set))
        {
            warn!(
                self.warnings,
                NoTextureCoordinates,
                "{place}: its material uses TEXCOORD_{set}, which the primitive lacks; (0, 0) is used"
            );
        }
        Ok(sets)
    }

    /// Returns three vertex indices per triangle, for any topology.
    fn read_triangles(
        &mut self,
        primitive: &PrimitiveEntry,
        mode: TriangleTopology,
        count: usize,
    ) -> ImportResult<Vec<[u32; 3]>> {
        let accessor = match primitive.indices {
            Some(index) => Some(self.reader.open(index as usize).with_place("indices")?),
            None => None,
        };
        if accessor
            .as_ref()
            .is_some_and(|a| a.element_arity() != 1 || !a.is_unsigned())
        {
            return Err(fault!(
                "indices: the accessor must have the type SCALAR and an unsigned integer component type"
            ));
        }
        let length = accessor.as_ref().map_or(count, Accessor::count);
        let triangles = match mode {
            TriangleTopology::Strip | TriangleTopology::Fan => length.saturating_sub(2),
            _ => length / 3,
        };
        self.budget.reserve_triangles(triangles)?;
        let vertex = |i: usize| accessor.as_ref().map_or(i as u32, |a| a.read_index(i));
        let triangle = |i: usize| {
            // glTF 2.0, section 3.7.2.1: the order that gives all triangles of a strip the same
            // orientation.
            let places = match mode {
                TriangleTopology::Strip => [i, i + 1 + i % 2, i + 2 - i % 2],
                TriangleTopology::Fan => [i + 1, i + 2, 0],
                _ => [3 * i, 3 * i + 1, 3 * i + 2],
            };
            places.map(vertex)
        };
        let mut out = map_in_parallel(triangles, triangle);
        if let Some(index) = out
            .as_flattened()
            .iter()
            .find(|&&index| index as usize >= count)
        {
            return Err(fault!(
                "indices: vertex {index} does not exist, the primitive has {count} vertices"
            ));
        }
        // Degenerate triangles, which join the parts of a strip, are dropped.
        out.retain(|[a, b, c]| a != b && b != c && c != a);
        if !matches!(mode, TriangleTopology::Strip | TriangleTopology::Fan) && length % 3 != 0 {
            warn!(
                self.warnings,
                Geometry,
                "{} indices after the last complete triangle were ignored",
                length % 3
            );
        }
        Ok(out)
    }
}

/// Topology of triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TriangleTopology {
    List,
    Strip,
    Fan,
}

impl TriangleTopology {
    /// Returns the topology for the mode of a primitive; `None` for points and lines.
    fn from_mode(mode: Option<u32>) -> ImportResult<Option<Self>> {
        match mode {
            None | Some(4) => Ok(Some(Self::List)),
            Some(5) => Ok(Some(Self::Strip)),
            Some(6) => Ok(Some(Self::Fan)),
            // Points, and three kinds of lines.
            Some(0..=3) => Ok(None),
            Some(mode) => Err(fault!("has the unknown primitive mode {mode}")),
        }
    }
}

/// Returns the attribute name of a texture coordinate set, such as `TEXCOORD_0`.
fn uv_attribute_name(set: u32) -> String {
    format!("TEXCOORD_{set}")
}

/// Returns the number of vertices and the number of indices that a primitive declares.
pub(super) fn declared_counts(document: &Document, primitive: &PrimitiveEntry) -> [u64; 2] {
    let count = |index: u32| {
        document
            .accessors
            .get(index as usize)
            .map_or(0, |accessor| accessor.count)
    };
    [
        primitive.attributes.get("POSITION").copied(),
        primitive.indices,
    ]
    .map(|index| index.map_or(0, count))
}

/// Clamps the channels of a vertex colour to 0..1; a NaN channel becomes 1. `opaque` sets alpha to
/// 1.
fn clamp_colour(value: [f32; 4], opaque: bool) -> [f32; 4] {
    let [r, g, b, a] = value.map(|c| if c.is_nan() { 1.0 } else { c.clamp(0.0, 1.0) });
    [r, g, b, if opaque { 1.0 } else { a }]
}

fn finite_or_zero(value: f32) -> f32 {
    if value.is_finite() { value } else { 0.0 }
}
