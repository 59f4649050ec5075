//! STL as text: `solid`, facets, each with a loop of corners, `endsolid`; in any case of letters,
//! with any line ends, perhaps several solids one after the other.

use glam::DVec3;
use raywright_core::scene::MeshData;

use crate::import::{Budget, Fault, Outcome, Warnings, shown};
use crate::polygon::Clipper;
use crate::text::{lines, no_number, number, without_mark};
use crate::warning::WarningCode;

/// What comes next.
#[derive(Default)]
enum Wanted {
    /// A word of the format.
    #[default]
    Word,
    /// So many numbers of a normal, which mean nothing here, or a word where a writer has left them
    /// out.
    Normal(usize),
    /// The numbers of a corner, of which these are known.
    Vertex(Vec<f64>),
}

/// What is being read.
#[derive(Default)]
struct AsciiReader {
    wanted: Wanted,
    mesh: MeshData,
    /// Corners of the loop at hand.
    corners: Vec<[f64; 3]>,
    /// Corners of all loops before it.
    positions: Vec<[f64; 3]>,
    /// Whether a facet has begun.
    open: bool,
    clipper: Clipper,
    triangles: Vec<[usize; 3]>,
}

/// The mesh of a text.
///
/// # Errors
/// A fault of kind input naming line and cause, of kind limit for more than is allowed.
pub(super) fn read(
    bytes: &[u8],
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Outcome<MeshData> {
    // A corner takes at least 13 characters, and 36 bytes in memory, of which a list that grows
    // needs three times as many.
    budget.memory(bytes.len(), 9)?;
    let mut reader = AsciiReader::default();
    let mut last = 0;
    for (i, line) in lines(bytes).enumerate() {
        let line = String::from_utf8_lossy(without_mark(line));
        reader
            .line(&line, budget, warnings)
            .map_err(|fault| fault.at(format_args!("line {}", i + 1)))?;
        last = i + 1;
    }
    if reader.open {
        return Err(Fault::input(format!(
            "line {last}: the file ends inside a facet"
        )));
    }
    Ok(MeshData {
        positions: reader.positions.into(),
        ..reader.mesh
    })
}

impl AsciiReader {
    /// Reads one line, which may hold several of the format's words, or a part of what belongs
    /// together.
    fn line(&mut self, line: &str, budget: &mut Budget, warnings: &mut Warnings) -> Outcome<()> {
        for word in line.split_whitespace() {
            match &mut self.wanted {
                Wanted::Word => {}
                Wanted::Normal(left) => {
                    let more = *left > 0 && number(word).is_some();
                    if more {
                        *left -= 1;
                        continue;
                    }
                    self.wanted = Wanted::Word;
                }
                Wanted::Vertex(numbers) => {
                    numbers.push(number(word).ok_or_else(|| no_number("vertex", word))?.1);
                    if let &[x, y, z] = numbers.as_slice() {
                        self.corners.push([x, y, z]);
                        self.wanted = Wanted::Word;
                    }
                    continue;
                }
            }
            match word.to_ascii_lowercase().as_str() {
                // What follows is a name.
                "solid" | "endsolid" => return Ok(()),
                "facet" if self.open => {
                    return Err(Fault::input("facet: the one before has no endfacet"));
                }
                "facet" => self.open = true,
                "normal" => self.wanted = Wanted::Normal(3),
                "outer" | "loop" => {}
                "vertex" if !self.open => return Err(Fault::input("vertex: is in no facet")),
                "vertex" => self.wanted = Wanted::Vertex(Vec::with_capacity(3)),
                "endloop" => self.end_loop(budget, warnings)?,
                "endfacet" => self.open = false,
                other => {
                    return Err(Fault::input(format!(
                        "`{}` is no word of STL",
                        shown(other)
                    )));
                }
            }
        }
        Ok(())
    }

    /// Makes triangles of the loop's corners.
    fn end_loop(&mut self, budget: &mut Budget, warnings: &mut Warnings) -> Outcome<()> {
        let before = self.positions.len();
        if self.corners.len() < 3 {
            warnings.add(
                WarningCode::Geometry,
                "facets with fewer than three corners are ignored",
            );
        } else {
            self.clipper.claim(self.corners.len(), budget)?;
            budget.triangles(self.corners.len() - 2)?;
            let points: Vec<DVec3> = self.corners.iter().copied().map(DVec3::from).collect();
            self.triangles.clear();
            self.clipper.triangulate(&points, &mut self.triangles)?;
            if u32::try_from(before + points.len()).is_err() {
                return Err(Fault::limit("has more than 4294967295 corners"));
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
