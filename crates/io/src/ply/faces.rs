//! Faces of a PLY file: polygons and triangle strips, triangulated to a mesh.

use glam::DVec3;
use raywright_core::scene::MeshData;

use super::header::{NumberType, PlyElement, PlyProperty};
use super::values::ValueStream;
use super::vertices::{PlyVertices, VertexColours, colour_channel, flip_v, gather};
use crate::import::{DecodeBudget, Fault, ImportResult, Warnings};
use crate::polygon::EarClipper;

/// Value of the property `texnumber` for a face without an image. Used also for all faces if the
/// file has no such property.
const NO_TEXTURE: i64 = -1;

/// Polygons of a PLY file, stored in sequence.
#[derive(Default)]
pub(super) struct PlyFaces {
    /// Vertex indices of all polygons.
    corners: Vec<u32>,
    /// Number of corners of each polygon.
    arities: Vec<u32>,
    /// Texture coordinates of each corner; empty if no face has texture coordinates.
    uvs: Vec<[f32; 2]>,
    /// Colour of each polygon; empty if no face has a colour.
    colours: VertexColours,
    has_colours: bool,
    /// Image number of each polygon; empty if no face has an image number.
    image_numbers: Vec<i64>,
}

impl PlyFaces {
    pub fn is_empty(&self) -> bool {
        self.arities.is_empty()
    }

    pub fn has_uvs(&self) -> bool {
        !self.uvs.is_empty()
    }

    /// Whether faces have image numbers.
    pub fn has_textures(&self) -> bool {
        !self.image_numbers.is_empty()
    }

    /// Reads the faces or the strips of a file.
    ///
    /// # Errors
    /// A fault of kind input for a truncated file, of kind limit beyond the limits.
    pub fn read(
        &mut self,
        element: &PlyElement,
        values: &mut ValueStream<'_>,
        budget: &mut DecodeBudget,
    ) -> ImportResult<()> {
        let layout = FaceLayout::from_element(element);
        if let Some(number) = layout.colour_type {
            (self.has_colours, self.colours) = (true, VertexColours::from_number_type(number));
        }
        self.fill_missing_attributes(layout.has_uvs);
        if layout.has_image_numbers {
            self.image_numbers.resize(self.arities.len(), NO_TEXTURE);
        }
        let bytes = 8
            + 28 * usize::from(layout.colour_type.is_some())
            + 8 * usize::from(layout.has_image_numbers);
        budget.reserve_memory(element.item_count() as usize, bytes)?;
        let mut record = FaceRecord::default();
        let earlier_line = values.surplus_line.take();
        values.read_items(element, |values| {
            record.read(&element.properties, &layout, values, budget)?;
            match layout.is_strips {
                true => self.add_triangle_strip(&record.corners, budget),
                false => self.add_polygon(&record, &layout),
            }
        })?;
        // Some programs write a list of nine numbers where the header names four bytes: what was
        // read as a colour is none.
        self.has_colours &= values.surplus_line.is_none();
        values.surplus_line = earlier_line.or(values.surplus_line);
        Ok(())
    }

    /// Adds a polygon with the properties that its element has.
    fn add_polygon(&mut self, record: &FaceRecord, layout: &FaceLayout) -> ImportResult<()> {
        for &corner in &record.corners {
            self.corners.push(vertex_index(corner)?);
        }
        self.arities.push(record.corners.len() as u32);
        if layout.colour_type.is_some() {
            self.colours.push(record.colour);
        }
        if layout.has_image_numbers {
            self.image_numbers.push(record.texture);
        }
        if layout.has_uvs {
            let pairs = record.coordinates.as_chunks::<2>().0;
            let fits = record.coordinates.len() == 2 * record.corners.len();
            self.uvs.extend(
                (0..record.corners.len()).map(|i| if fits { flip_v(pairs[i]) } else { [0.0; 2] }),
            );
        }
        Ok(())
    }

    /// Fills up the lists of colours and texture coordinates with defaults, for polygons that have
    /// no value of their own. Colours are filled if any face has a colour, texture coordinates if
    /// `mapped` is set.
    fn fill_missing_attributes(&mut self, mapped: bool) {
        if self.has_colours {
            self.colours.pad_with_white(self.arities.len());
        }
        if mapped {
            self.uvs.resize(self.corners.len(), [0.0; 2]);
        }
    }

    /// Adds the triangles of a strip; the index −1 starts a new strip. Every second triangle of a
    /// strip is reversed, so that all triangles have the same orientation.
    fn add_triangle_strip(
        &mut self,
        corners: &[i64],
        budget: &mut DecodeBudget,
    ) -> ImportResult<()> {
        budget.reserve_memory(corners.len(), 32)?;
        for run in corners.split(|&corner| corner == -1) {
            for (i, window) in run.windows(3).enumerate() {
                let [a, b, c] = [window[i % 2], window[1 - i % 2], window[2]];
                // Degenerate triangles join the parts of a strip.
                if a != b && b != c && c != a {
                    for corner in [a, b, c] {
                        self.corners.push(vertex_index(corner)?);
                    }
                    self.arities.push(3);
                }
            }
        }
        Ok(())
    }

    /// Triangulates all faces. Returns the mesh, and the image number of each triangle if faces
    /// have image numbers. If faces have colours or texture coordinates, each corner becomes a
    /// vertex; otherwise the mesh has the vertices of the file.
    ///
    /// # Errors
    /// A fault of kind input for a vertex index out of range, of kind limit beyond the limits.
    pub fn into_mesh(
        mut self,
        vertices: PlyVertices,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<(MeshData, Vec<i64>)> {
        self.fill_missing_attributes(self.has_uvs());
        self.check_vertex_indices(vertices.positions.len())?;
        let (triangles, image_numbers) = self.triangulate(&vertices, budget, warnings)?;
        let mesh = if self.has_corner_attributes() {
            self.into_unshared_mesh(&vertices, triangles, budget, warnings)?
        } else {
            shared_mesh(vertices, triangles)
        };
        Ok((mesh, image_numbers))
    }

    /// Whether corners of different faces cannot share a vertex, because faces have colours or
    /// texture coordinates.
    fn has_corner_attributes(&self) -> bool {
        self.has_colours || self.has_uvs()
    }

    /// Refuses a corner whose vertex is not among the `count` vertices of the file.
    fn check_vertex_indices(&self, count: usize) -> ImportResult<()> {
        let beyond = self
            .corners
            .iter()
            .find(|&&corner| corner as usize >= count);
        match beyond {
            Some(vertex) => Err(fault!(
                "a face refers to vertex {vertex}, but the file has {count} vertices, counted from 0"
            )),
            None => Ok(()),
        }
    }

    /// Triangulates all polygons. Returns the vertex indices of each triangle, and its image number
    /// if faces have image numbers. Of faces with corner attributes, the indices are those of the
    /// corners.
    fn triangulate(
        &self,
        vertices: &PlyVertices,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<(Vec<[u32; 3]>, Vec<i64>)> {
        let is_unshared = self.has_corner_attributes();
        let mut clipper = EarClipper::default();
        let (mut points, mut triangles, mut indices) = (Vec::new(), Vec::new(), Vec::new());
        let (mut start, mut numbers) = (0, Vec::new());
        for (face, &arity) in self.arities.iter().enumerate() {
            let corners = self
                .corners
                .get(start..start + arity as usize)
                .unwrap_or_default();
            if corners.len() < 3 {
                warn!(
                    warnings,
                    Geometry, "faces with fewer than three corners are ignored"
                );
            }
            clipper.reserve_memory(corners.len(), budget)?;
            budget.reserve_triangles(corners.len().saturating_sub(2))?;
            points.clear();
            points.extend(
                corners
                    .iter()
                    .map(|&corner| corner_position(vertices, corner)),
            );
            triangles.clear();
            clipper.triangulate(&points, &mut triangles)?;
            let vertex = |corner: usize| {
                if is_unshared {
                    (start + corner) as u32
                } else {
                    corners[corner]
                }
            };
            indices.extend(triangles.iter().map(|triangle| triangle.map(vertex)));
            if self.has_textures() {
                numbers.resize(
                    indices.len(),
                    self.image_numbers.get(face).copied().unwrap_or(NO_TEXTURE),
                );
            }
            start += arity as usize;
        }
        Ok((indices, numbers))
    }

    /// Returns a mesh in which every corner of every polygon is a vertex of its own.
    fn into_unshared_mesh(
        self,
        vertices: &PlyVertices,
        indices: Vec<[u32; 3]>,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<MeshData> {
        if u32::try_from(self.corners.len()).is_err() {
            return Err(Fault::over_limit(
                "has more than 4294967295 corners of faces; divide the file",
            ));
        }
        budget.reserve_memory(
            self.corners.len(),
            2 * size_of::<[f32; 3]>()
                + size_of::<[f64; 3]>()
                + size_of::<[f32; 2]>()
                + size_of::<[f32; 4]>(),
        )?;
        let Self {
            corners,
            arities,
            uvs,
            colours,
            has_colours: coloured,
            ..
        } = self;
        let uvs = if uvs.is_empty() {
            gather(&corners, &vertices.uvs)
        } else {
            uvs
        };
        let own = colours
            .into_linear(warnings)
            .zip(&arities)
            .flat_map(|(colour, &arity)| std::iter::repeat_n(colour, arity as usize));
        Ok(MeshData {
            positions: gather(&corners, &vertices.positions).into(),
            normals: gather(&corners, &vertices.normals),
            colours: if coloured {
                own.collect()
            } else {
                gather(&corners, &vertices.colours)
            },
            uvs: if uvs.is_empty() {
                Vec::new()
            } else {
                vec![uvs]
            },
            indices,
            ..MeshData::default()
        })
    }
}

/// Converts the vertex index of a corner. A negative index, and an index beyond 32 bits, is refused.
fn vertex_index(corner: i64) -> ImportResult<u32> {
    u32::try_from(corner)
        .map_err(|_| fault!("the vertex index {corner} is negative or above 4294967295"))
}

/// Returns a mesh of these triangles with the vertices of the file.
fn shared_mesh(vertices: PlyVertices, indices: Vec<[u32; 3]>) -> MeshData {
    let PlyVertices {
        positions,
        normals,
        uvs,
        colours,
    } = vertices;
    MeshData {
        positions: positions.into(),
        normals,
        uvs: if uvs.is_empty() {
            Vec::new()
        } else {
            vec![uvs]
        },
        colours,
        indices,
        ..MeshData::default()
    }
}

fn corner_position(vertices: &PlyVertices, corner: u32) -> DVec3 {
    vertices
        .positions
        .get(corner as usize)
        .map_or(DVec3::ZERO, |&p| p.into())
}

// Properties of a PLY face: their meanings, and the values of a single face.

/// Meaning of a property of faces, by the name of the property.
#[derive(Clone, Copy, Debug, PartialEq)]
enum FacePropertyRole {
    Corners,
    Coordinates,
    Channel(usize),
    Texture,
    Other,
}

impl FacePropertyRole {
    fn from_property(property: &PlyProperty) -> Self {
        match (
            property.name.as_str(),
            property.count,
            colour_channel(&property.name),
        ) {
            ("vertex_indices" | "vertex_index", Some(_), _) => Self::Corners,
            ("texcoord", Some(_), _) => Self::Coordinates,
            ("texnumber", None, _) => Self::Texture,
            (_, None, Some(channel)) => Self::Channel(channel),
            _ => Self::Other,
        }
    }
}

/// Properties of an element of faces or of strips that the importer uses.
struct FaceLayout {
    /// Meaning of each property of the element.
    roles: Vec<FacePropertyRole>,
    /// Whether the element consists of triangle strips. Strips have no further properties.
    pub is_strips: bool,
    /// Number type of the colour channels; `None` if faces have no colour.
    pub colour_type: Option<NumberType>,
    /// Whether the corners of faces have texture coordinates.
    pub has_uvs: bool,
    /// Whether faces have image numbers.
    pub has_image_numbers: bool,
}

impl FaceLayout {
    pub fn from_element(element: &PlyElement) -> Self {
        let mut roles: Vec<FacePropertyRole> = element
            .properties
            .iter()
            .map(FacePropertyRole::from_property)
            .collect();
        // Of several properties with the same meaning, the first applies.
        for i in 1..roles.len() {
            if roles[..i].contains(&roles[i]) {
                roles[i] = FacePropertyRole::Other;
            }
        }
        let is_strips = element.name == "tristrips";
        let has = |role| !is_strips && roles.contains(&role);
        let is_coloured = (0..3).all(|channel| has(FacePropertyRole::Channel(channel)));
        let red = element
            .properties
            .iter()
            .zip(&roles)
            .find(|(_, role)| is_coloured && **role == FacePropertyRole::Channel(0));
        Self {
            is_strips,
            colour_type: red.map(|(red, _)| red.number),
            has_uvs: has(FacePropertyRole::Coordinates),
            has_image_numbers: has(FacePropertyRole::Texture),
            roles,
        }
    }
}

/// Values read for a single face. The lists are emptied and reused for the next face.
#[derive(Default)]
struct FaceRecord {
    /// Vertex indices of the corners.
    pub corners: Vec<i64>,
    /// Texture coordinates of the corners, two numbers each.
    pub coordinates: Vec<f32>,
    pub colour: [f32; 3],
    /// Image number.
    pub texture: i64,
}

impl FaceRecord {
    /// Reads the values of the next face, or the vertex indices of the next strip.
    pub fn read(
        &mut self,
        properties: &[PlyProperty],
        layout: &FaceLayout,
        values: &mut ValueStream<'_>,
        budget: &mut DecodeBudget,
    ) -> ImportResult<()> {
        self.corners.clear();
        self.coordinates.clear();
        for (property, role) in properties.iter().zip(&layout.roles) {
            let PlyProperty {
                name,
                count,
                number,
            } = property;
            match (*role, *count) {
                (FacePropertyRole::Texture, _) => {
                    self.texture = values.read_number(*number, name)? as i64
                }
                (FacePropertyRole::Channel(channel), _) => {
                    self.colour[channel] = values.read_number(*number, name)? as f32
                }
                (
                    role @ (FacePropertyRole::Corners | FacePropertyRole::Coordinates),
                    Some(count),
                ) => {
                    let count = values.read_list_length(count, *number, name)?;
                    // Bytes per corner: its index here, and in the list of all corners, whose
                    // capacity may be twice its length.
                    budget.reserve_memory(count, 32)?;
                    for _ in 0..count {
                        let value = values.read_number(*number, name)?;
                        match role {
                            FacePropertyRole::Corners if value.fract() == 0.0 => {
                                self.corners.push(value as i64)
                            }
                            FacePropertyRole::Corners => {
                                return Err(fault!(
                                    "{name}: the vertex index {value} is no whole number"
                                ));
                            }
                            _ => self.coordinates.push(value as f32),
                        }
                    }
                }
                _ => values.skip_property(property)?,
            }
        }
        Ok(())
    }
}
