//! ASCII STL: `solid`, then facets, each with a loop of corners, then `endsolid`. Keywords may have
//! any letter case and lines any line ends. A file may contain several solids in sequence.

use glam::DVec3;
use raywright_core::scene::MeshData;

use crate::import::{DecodeBudget, Fault, ImportResult, Warnings, sanitise_text};
use crate::polygon::EarClipper;
use crate::text::{not_a_number_fault, parse_number_prefix, split_lines, strip_byte_order_mark};
use crate::warning::WarningCode;

/// What the reader expects next.
#[derive(Default)]
enum ExpectedToken {
    /// A keyword of the format.
    #[default]
    Word,
    /// The remaining numbers of a facet's normal, which are ignored. A keyword may follow at once,
    /// because some programs omit the numbers.
    Normal(usize),
    /// The coordinates of a corner; the list holds the coordinates that were read already.
    Vertex(Vec<f64>),
}

/// State of the reader of an ASCII file.
#[derive(Default)]
struct StlAsciiReader {
    expected_token: ExpectedToken,
    mesh: MeshData,
    /// Corners of the loop that is being read.
    corners: Vec<[f64; 3]>,
    /// Corners of all loops that are complete.
    positions: Vec<[f64; 3]>,
    /// Whether a facet has started and not ended.
    in_facet: bool,
    clipper: EarClipper,
    triangles: Vec<[usize; 3]>,
}

/// Reads the mesh of a text.
///
/// # Errors
/// A fault of kind input that names line and cause, of kind limit beyond the limits.
pub(super) fn read_ascii(
    bytes: &[u8],
    budget: &mut DecodeBudget,
    warnings: &mut Warnings,
) -> ImportResult<MeshData> {
    // A corner takes at least 13 characters of the file and 36 bytes of memory. A list that grows
    // may need three times the memory of its elements.
    budget.reserve_memory(bytes.len(), 9)?;
    let mut reader = StlAsciiReader::default();
    let mut last = 0;
    for (i, line) in split_lines(bytes).enumerate() {
        let line = String::from_utf8_lossy(strip_byte_order_mark(line));
        reader
            .read_line(&line, budget, warnings)
            .map_err(|fault| fault.with_place(format_args!("line {}", i + 1)))?;
        last = i + 1;
    }
    if reader.in_facet {
        return Err(Fault::invalid_input(format!(
            "line {last}: the file ends inside a facet"
        )));
    }
    Ok(MeshData {
        positions: reader.positions.into(),
        ..reader.mesh
    })
}

impl StlAsciiReader {
    /// Reads a line. A line may hold several keywords with their numbers, or only a part of these
    /// numbers.
    fn read_line(
        &mut self,
        line: &str,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<()> {
        for word in line.split_whitespace() {
            match &mut self.expected_token {
                ExpectedToken::Word => {}
                ExpectedToken::Normal(left) => {
                    let more = *left > 0 && parse_number_prefix(word).is_some();
                    if more {
                        *left -= 1;
                        continue;
                    }
                    self.expected_token = ExpectedToken::Word;
                }
                ExpectedToken::Vertex(numbers) => {
                    numbers.push(
                        parse_number_prefix(word)
                            .ok_or_else(|| not_a_number_fault("vertex", word))?
                            .1,
                    );
                    if let &[x, y, z] = numbers.as_slice() {
                        self.corners.push([x, y, z]);
                        self.expected_token = ExpectedToken::Word;
                    }
                    continue;
                }
            }
            match word.to_ascii_lowercase().as_str() {
                // The other words of the line are the name of the solid.
                "solid" | "endsolid" => return Ok(()),
                "facet" if self.in_facet => {
                    return Err(Fault::invalid_input(
                        "facet: the previous facet has no endfacet",
                    ));
                }
                "facet" => self.in_facet = true,
                "normal" => self.expected_token = ExpectedToken::Normal(3),
                "outer" | "loop" => {}
                "vertex" if !self.in_facet => {
                    return Err(Fault::invalid_input(
                        "vertex: does not belong to a facet; a `facet` line is missing before it",
                    ));
                }
                "vertex" => self.expected_token = ExpectedToken::Vertex(Vec::with_capacity(3)),
                "endloop" => self.finish_corner_loop(budget, warnings)?,
                "endfacet" => self.in_facet = false,
                other => {
                    return Err(Fault::invalid_input(format!(
                        "`{}` is no keyword of STL",
                        sanitise_text(other)
                    )));
                }
            }
        }
        Ok(())
    }

    /// Triangulates the current loop, and adds the triangles to the mesh.
    fn finish_corner_loop(
        &mut self,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<()> {
        let before = self.positions.len();
        if self.corners.len() < 3 {
            warnings.add(
                WarningCode::Geometry,
                "facets with fewer than three corners are ignored",
            );
        } else {
            self.clipper.reserve_memory(self.corners.len(), budget)?;
            budget.reserve_triangles(self.corners.len() - 2)?;
            let points: Vec<DVec3> = self.corners.iter().copied().map(DVec3::from).collect();
            self.triangles.clear();
            self.clipper.triangulate(&points, &mut self.triangles)?;
            if u32::try_from(before + points.len()).is_err() {
                return Err(Fault::over_limit(
                    "has more than 4294967295 corners of facets; divide the file",
                ));
            }
            self.mesh.indices.extend(
                self.triangles
                    .iter()
                    .map(|corners| corners.map(|corner| (before + corner) as u32)),
            );
            self.positions.append(&mut self.corners);
        }
        self.corners.clear();
        Ok(())
    }
}
