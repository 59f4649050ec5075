//! Properties of a PLY face: their meanings, and the values of a single face.

use super::header::{NumberType, PlyElement, PlyProperty};
use super::values::ValueStream;
use super::vertices::colour_channel;
use crate::import::{DecodeBudget, ImportResult};

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
pub(super) struct FaceLayout {
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
pub(super) struct FaceRecord {
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
