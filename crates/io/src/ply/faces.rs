//! Faces of a PLY file: polygons and triangle strips, with the properties of faces.

use glam::DVec3;
use raywright_core::scene::MeshData;

use super::header::{PlyElement, PlyProperty};
use super::values::ValueStream;
use super::vertices::{PlyVertices, VertexColours, colour_channel, flip_v};
use crate::import::{DecodeBudget, Fault, ImportResult, Warnings};
use crate::polygon::EarClipper;
use crate::warning::WarningCode;

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

/// Values read for a single face. The lists are emptied and reused for the next face.
#[derive(Default)]
struct FaceRecord {
    corners: Vec<i64>,
    coordinates: Vec<f32>,
    colour: [f32; 3],
    texture: i64,
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
        let strips = element.name == "tristrips";
        let coloured =
            !strips && (0..3).all(|channel| roles.contains(&FacePropertyRole::Channel(channel)));
        let mapped = !strips && roles.contains(&FacePropertyRole::Coordinates);
        let red = element
            .properties
            .iter()
            .zip(&roles)
            .find(|(_, role)| **role == FacePropertyRole::Channel(0));
        if let Some((red, _)) = red.filter(|_| coloured) {
            (self.has_colours, self.colours) = (true, VertexColours::from_number_type(red.number));
        }
        self.fill_missing_attributes(mapped);
        let numbered = !strips && roles.contains(&FacePropertyRole::Texture);
        if numbered {
            self.image_numbers.resize(self.arities.len(), NO_TEXTURE);
        }
        let each = 8 + 28 * usize::from(coloured) + 8 * usize::from(numbered);
        budget.reserve_memory(
            if element.properties.is_empty() {
                0
            } else {
                element.count as usize
            },
            each,
        )?;
        let mut row = FaceRecord::default();
        for index in 0..if element.properties.is_empty() {
            0
        } else {
            element.count
        } {
            let place = |fault: Fault, values: &ValueStream<'_>| {
                fault.with_place(values.describe_position(element, index))
            };
            row.read(&element.properties, &roles, values, budget)
                .map_err(|fault| place(fault, values))?;
            let vertex = |&index: &i64| {
                u32::try_from(index).map_err(|_| {
                    Fault::invalid_input(format!("the vertex index {index} is out of range"))
                })
            };
            if strips {
                self.add_triangle_strip(&row.corners, budget)
                    .map_err(|fault| place(fault, values))?;
                continue;
            }
            for corner in &row.corners {
                self.corners
                    .push(vertex(corner).map_err(|fault| place(fault, values))?);
            }
            self.arities.push(row.corners.len() as u32);
            if coloured {
                self.colours.push(row.colour);
            }
            if numbered {
                self.image_numbers.push(row.texture);
            }
            if mapped {
                let pairs = row.coordinates.as_chunks::<2>().0;
                let fits = row.coordinates.len() == 2 * row.corners.len();
                self.uvs.extend(
                    (0..row.corners.len()).map(|i| if fits { flip_v(pairs[i]) } else { [0.0; 2] }),
                );
            }
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
                        self.corners.push(u32::try_from(corner).map_err(|_| {
                            Fault::invalid_input(format!(
                                "the vertex index {corner} is out of range"
                            ))
                        })?);
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
        let count = vertices.positions.len();
        if let Some(vertex) = self
            .corners
            .iter()
            .find(|&&corner| corner as usize >= count)
        {
            return Err(Fault::invalid_input(format!(
                "a face refers to vertex {vertex}, but the file has {count} vertices, counted from 0"
            )));
        }
        let apart = self.has_colours || self.has_uvs();
        let mut clipper = EarClipper::default();
        let (mut points, mut triangles, mut indices) = (Vec::new(), Vec::new(), Vec::new());
        let (mut start, mut numbers) = (0, Vec::new());
        for (face, &arity) in self.arities.iter().enumerate() {
            let corners = self
                .corners
                .get(start..start + arity as usize)
                .unwrap_or_default();
            if corners.len() < 3 {
                warnings.add(
                    WarningCode::Geometry,
                    "faces with fewer than three corners are ignored",
                );
            }
            clipper.reserve_memory(corners.len(), budget)?;
            budget.reserve_triangles(corners.len().saturating_sub(2))?;
            points.clear();
            points.extend(
                corners
                    .iter()
                    .map(|&corner| corner_position(&vertices, corner)),
            );
            triangles.clear();
            clipper.triangulate(&points, &mut triangles)?;
            let vertex = |corner: usize| {
                if apart {
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
        if !apart {
            let PlyVertices {
                positions,
                normals,
                uvs,
                colours,
            } = vertices;
            let uvs = if uvs.is_empty() {
                Vec::new()
            } else {
                vec![uvs]
            };
            let positions = positions.into();
            return Ok((
                MeshData {
                    positions,
                    normals,
                    uvs,
                    colours,
                    indices,
                    ..MeshData::default()
                },
                numbers,
            ));
        }
        Ok((
            self.into_unshared_mesh(&vertices, indices, budget)?,
            numbers,
        ))
    }

    /// Returns a mesh in which every corner of every polygon is a vertex of its own.
    fn into_unshared_mesh(
        self,
        vertices: &PlyVertices,
        indices: Vec<[u32; 3]>,
        budget: &mut DecodeBudget,
    ) -> ImportResult<MeshData> {
        if u32::try_from(self.corners.len()).is_err() {
            return Err(Fault::over_limit("has more than 4294967295 corners"));
        }
        budget.reserve_memory(
            self.corners.len(),
            2 * size_of::<[f32; 3]>()
                + size_of::<[f64; 3]>()
                + size_of::<[f32; 2]>()
                + size_of::<[f32; 4]>(),
        )?;
        fn gather_by_corner<T: Copy>(corners: &[u32], of: &[T]) -> Vec<T> {
            // An empty list stays empty; any other list has a value for each vertex.
            corners
                .iter()
                .filter_map(|&corner| of.get(corner as usize))
                .copied()
                .collect()
        }
        let Self {
            corners,
            arities,
            uvs,
            colours,
            has_colours: coloured,
            ..
        } = self;
        let uvs = if uvs.is_empty() {
            gather_by_corner(&corners, &vertices.uvs)
        } else {
            uvs
        };
        let own = colours
            .into_linear()
            .zip(&arities)
            .flat_map(|(colour, &arity)| std::iter::repeat_n(colour, arity as usize));
        Ok(MeshData {
            positions: gather_by_corner(&corners, &vertices.positions).into(),
            normals: gather_by_corner(&corners, &vertices.normals),
            colours: if coloured {
                own.collect()
            } else {
                gather_by_corner(&corners, &vertices.colours)
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

fn corner_position(vertices: &PlyVertices, corner: u32) -> DVec3 {
    vertices
        .positions
        .get(corner as usize)
        .map_or(DVec3::ZERO, |&p| p.into())
}

impl FaceRecord {
    fn read(
        &mut self,
        properties: &[PlyProperty],
        roles: &[FacePropertyRole],
        values: &mut ValueStream<'_>,
        budget: &mut DecodeBudget,
    ) -> ImportResult<()> {
        self.corners.clear();
        self.coordinates.clear();
        for (property, role) in properties.iter().zip(roles) {
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
                                return Err(Fault::invalid_input(format!(
                                    "{name}: the vertex index {value} is no whole number"
                                )));
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
