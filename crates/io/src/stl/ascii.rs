//! ASCII STL: `solid`, then facets, each with a loop of corners, then `endsolid`. Keywords may have
//! any letter case and lines any line ends. A file may contain several solids in sequence. Words
//! that other programs add, and ends that they omit, are warnings.

use glam::DVec3;
use raywright_core::scene::MeshData;

use crate::import::{DecodeBudget, Fault, FaultPlace, ImportResult, Warnings, sanitise_text};
use crate::polygon::EarClipper;
use crate::text::{not_a_number_fault, parse_number_prefix, split_lines, strip_byte_order_mark};

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

/// Part of a facet that is being read.
#[derive(Default, PartialEq)]
enum FacetState {
    /// No facet has started.
    #[default]
    Outside,
    /// The loop of the facet is not complete.
    Open,
    /// The loop is complete; `endfacet` is missing.
    Complete,
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
    facet: FacetState,
    /// Number of the current line, from 1.
    line: usize,
    /// Line and text of the first word that is no keyword.
    unknown_word: Option<String>,
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
    for line in split_lines(bytes) {
        reader.line += 1;
        let line = String::from_utf8_lossy(strip_byte_order_mark(line));
        let read = reader.read_line(&line, budget, warnings);
        read.with_place(format_args!("line {}", reader.line))?;
    }
    if reader.facet == FacetState::Open {
        return Err(fault!("line {}: the file ends inside a facet", reader.line));
    }
    if let Some(word) = reader.unknown_word.take() {
        if reader.positions.is_empty() {
            return Err(Fault::invalid_input(word));
        }
        warn!(warnings, Format, "{word}; such words are ignored");
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
        let mut words = line.split_whitespace();
        while let Some(word) = words.next() {
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
            let mut keyword = word.to_ascii_lowercase();
            if keyword == "end" {
                self.record_unknown_word(word);
                keyword.extend(words.next().map(str::to_ascii_lowercase));
            }
            // The other words of the line are the name of the solid, or a comment.
            if matches!(keyword.as_str(), "solid" | "endsolid") || keyword.starts_with('#') {
                return Ok(());
            }
            self.read_keyword(&keyword, budget, warnings)?;
        }
        Ok(())
    }

    fn read_keyword(
        &mut self,
        keyword: &str,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<()> {
        match keyword {
            "facet" if self.facet == FacetState::Open && self.corners.is_empty() => {
                return Err(fault!("facet: the previous facet has no endfacet"));
            }
            "facet" => {
                if self.facet != FacetState::Outside {
                    self.complete_facet(budget, warnings)?;
                }
                self.facet = FacetState::Open;
            }
            "normal" => self.expected_token = ExpectedToken::Normal(3),
            "outer" | "loop" => {}
            "vertex" if self.facet == FacetState::Outside => {
                return Err(fault!(
                    "vertex: does not belong to a facet; a `facet` line is missing before it"
                ));
            }
            "vertex" => {
                self.facet = FacetState::Open;
                self.expected_token = ExpectedToken::Vertex(Vec::with_capacity(3));
            }
            "endloop" => {
                self.finish_corner_loop(budget, warnings)?;
                self.facet = FacetState::Complete;
            }
            "endfacet" if self.corners.is_empty() => self.facet = FacetState::Outside,
            "endfacet" => self.complete_facet(budget, warnings)?,
            other => self.record_unknown_word(other),
        }
        Ok(())
    }

    fn record_unknown_word(&mut self, word: &str) {
        let line = self.line;
        self.unknown_word.get_or_insert_with(|| {
            format!(
                "line {line}: `{}` is no keyword of STL",
                sanitise_text(word)
            )
        });
    }

    /// Ends a facet that lacks the end of its loop, or its own.
    fn complete_facet(
        &mut self,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<()> {
        if !self.corners.is_empty() {
            self.finish_corner_loop(budget, warnings)?;
        }
        self.facet = FacetState::Outside;
        warn!(
            warnings,
            Format, "facets without `endloop` or `endfacet` end where the next facet begins"
        );
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
            warn!(
                warnings,
                Geometry, "facets with fewer than three corners are ignored"
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
