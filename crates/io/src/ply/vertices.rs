//! Vertices of a PLY file: all known properties, under any of their names and in any order.

use super::header::{NumberType, PlyElement, PlyProperty};
use super::values::ValueStream;
use crate::import::{DecodeBudget, Fault, ImportResult, Warnings};
use crate::mesh_tools::{decode_vertex_colour, vertex_colour_scale};

/// Number of values read for each vertex: three of position, three of normal, three of colour, and
/// two texture coordinates.
const VALUES_PER_VERTEX: usize = 11;
const NORMAL: usize = 3;
const COLOUR: usize = 6;
const UV: usize = 9;

/// Returns the index, among the 11 values of a vertex, at which a property is stored; `None` for an
/// unknown property.
fn property_index(name: &str) -> Option<usize> {
    Some(match name {
        "x" => 0,
        "y" => 1,
        "z" => 2,
        "nx" => NORMAL,
        "ny" => NORMAL + 1,
        "nz" => NORMAL + 2,
        "u" | "s" | "texture_u" | "texture_s" => UV,
        "v" | "t" | "texture_v" | "texture_t" => UV + 1,
        _ => return colour_channel(name).map(|channel| COLOUR + channel),
    })
}

/// Returns the colour channel (0 red, 1 green, 2 blue) that a property name stands for.
pub(super) fn colour_channel(name: &str) -> Option<usize> {
    const NAMES: [[&str; 3]; 3] = [
        ["red", "r", "diffuse_red"],
        ["green", "g", "diffuse_green"],
        ["blue", "b", "diffuse_blue"],
    ];
    NAMES.iter().position(|names| names.contains(&name))
}

/// Colours as stored in the file. Integer codes have a known scale. Floats may range to 1 or to
/// 255, as in OBJ files; their scale follows from all colours.
#[derive(Default)]
pub(super) struct VertexColours {
    stored_colours: Vec<[f32; 3]>,
    /// Factor from stored values to 0..1; `None` for floats, whose scale is not known yet.
    scale: Option<f32>,
}

impl VertexColours {
    /// Creates an empty list of colours of this number type.
    pub fn from_number_type(number: NumberType) -> Self {
        Self {
            stored_colours: Vec::new(),
            scale: number.unorm_max().map(|whole| 1.0 / whole),
        }
    }

    /// Extends the list with white to `count` colours, for vertices or faces without a colour.
    pub fn pad_with_white(&mut self, count: usize) {
        self.stored_colours.resize(count, [f32::NAN; 3]);
    }

    pub fn push(&mut self, colour: [f32; 3]) {
        self.stored_colours.push(colour);
    }

    /// Returns all colours as linear RGBA.
    pub fn into_linear(self, warnings: &mut Warnings) -> impl Iterator<Item = [f32; 4]> + use<> {
        let channels = self.stored_colours.as_flattened().iter().copied();
        let scale = self
            .scale
            .unwrap_or_else(|| vertex_colour_scale(channels, warnings));
        self.stored_colours
            .into_iter()
            .map(move |colour| decode_vertex_colour(colour.map(|channel| channel * scale)))
    }
}

/// Vertices of a PLY file. A list is empty if the file lacks the property.
#[derive(Default)]
pub(super) struct PlyVertices {
    pub positions: Vec<[f64; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub colours: Vec<[f32; 4]>,
}

impl PlyVertices {
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    pub fn has_uvs(&self) -> bool {
        !self.uvs.is_empty()
    }

    /// Reads all vertices.
    ///
    /// # Errors
    /// A fault of kind input for vertices without a position and for a truncated file, of kind
    /// limit beyond the limits.
    pub fn read(
        &mut self,
        element: &PlyElement,
        values: &mut ValueStream<'_>,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<()> {
        let slots: Vec<Option<usize>> = element
            .properties
            .iter()
            .map(|property| property_index(&property.name).filter(|_| property.count.is_none()))
            .collect();
        let has = |slot: usize, count: usize| {
            (slot..slot + count).all(|slot| slots.contains(&Some(slot)))
        };
        if !has(0, 3) && element.count > 0 {
            return Err(fault!("its vertices have no x, y and z"));
        }
        if u32::try_from(element.count).is_err() {
            return Err(Fault::over_limit(
                "has more than 4294967295 vertices; divide the file",
            ));
        }
        let [normals, colours, uvs] = [has(NORMAL, 3), has(COLOUR, 3), has(UV, 2)];
        // Bytes per vertex: positions first as doubles, then in single precision relative to an
        // origin.
        let each =
            36 + 12 * usize::from(normals) + 28 * usize::from(colours) + 8 * usize::from(uvs);
        budget.reserve_memory(element.count as usize, each)?;
        let number = |slot: usize| {
            let property = element
                .properties
                .iter()
                .zip(&slots)
                .find(|(_, of)| **of == Some(slot));
            property.map_or(NumberType::F32, |(property, _)| property.number)
        };
        let mut painted = VertexColours::from_number_type(number(COLOUR));
        self.positions.reserve_exact(element.count as usize);
        values.read_items(element, |values| {
            let (position, row) = read_vertex(&element.properties, &slots, values)?;
            let [_, _, _, nx, ny, nz, r, g, b, u, v] = row;
            self.positions.push(position);
            self.normals.extend(normals.then_some([nx, ny, nz]));
            self.uvs.extend(uvs.then_some(flip_v([u, v])));
            if colours {
                painted.push([r, g, b]);
            }
            Ok(())
        })?;
        self.colours = painted.into_linear(warnings).collect();
        Ok(())
    }
}

/// Reads the values of a vertex. Returns the position in double precision, and all 11 values in
/// single precision.
fn read_vertex(
    properties: &[PlyProperty],
    slots: &[Option<usize>],
    values: &mut ValueStream<'_>,
) -> ImportResult<([f64; 3], [f32; VALUES_PER_VERTEX])> {
    let mut row = [0.0; VALUES_PER_VERTEX];
    for (property, slot) in properties.iter().zip(slots) {
        match slot {
            Some(slot) => row[*slot] = values.read_number(property.number, &property.name)?,
            None => values.skip_property(property)?,
        }
    }
    let [x, y, z, ..] = row;
    Ok(([x, y, z], row.map(|value| value as f32)))
}

/// Converts texture coordinates to those of a scene: in the file, v counts upwards from the bottom
/// row of the image; in a scene, v counts downwards from the top row. Non-finite coordinates become
/// zero.
pub(super) fn flip_v([u, v]: [f32; 2]) -> [f32; 2] {
    if u.is_finite() && v.is_finite() {
        [u, 1.0 - v]
    } else {
        [0.0; 2]
    }
}

/// Returns the values of vertices with these indices, in their order; empty without values.
pub(super) fn gather<T: Copy>(vertices: &[u32], of: &[T]) -> Vec<T> {
    let values = vertices
        .iter()
        .filter_map(|&vertex| of.get(vertex as usize));
    values.copied().collect()
}
