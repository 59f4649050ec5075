//! First pass over an OBJ file. It checks every number and index, and rewrites the text into a
//! subset of the format that the parser `tobj` reads correctly.
//!
//! `tobj` then parses numbers and merges equal vertices. From the original text, `tobj` would
//! reject numbers of other programs, lose smoothing groups and the names of unknown materials,
//! shift vertex colours when only some vertices have colours, take index 0 for "none", and compute
//! with indices before checking their range; its errors name no line. The rewritten text has all
//! vertices first. Then follows a group for each [`FaceGroup`], named by the run's index, with
//! valid absolute indices.

mod faces;

use std::collections::HashMap;

use super::lines::{Statement, split_statements};
use crate::import::{DecodeBudget, Fault, ImportResult, Warnings, sanitise_text};
use crate::text::{not_a_number_fault, parse_number_prefix};
use crate::warning::WarningCode;

/// Source of the normals for a run of faces (faces with the same properties, see [`FaceGroup`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum NormalSource {
    /// Flat facets.
    Flat,
    /// The file's own normals.
    FromFile,
    /// The mean, at each position, of the facet normals in the smoothing group with this number.
    Group(u32),
}

/// Properties that all faces of a run have in common. The faces of a run form a group of the
/// rewritten text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct FaceGroup {
    /// Index into [`RewrittenObj::materials`]; `None` before the first `usemtl`.
    pub material: Option<usize>,
    /// Source of the normals.
    pub normal_source: NormalSource,
    /// Whether all corners have texture coordinates.
    pub has_uvs: bool,
}

/// Result of the first pass.
#[derive(Debug, Default)]
pub(super) struct RewrittenObj {
    /// The rewritten text.
    pub text: String,
    /// Properties of the runs of faces, by index; the index is the name of the run's group in the
    /// rewritten text.
    pub runs: Vec<FaceGroup>,
    /// Names of materials in order of first use.
    pub materials: Vec<String>,
    /// Text after each `mtllib`.
    pub libraries: Vec<String>,
}

/// Number of positions, number of texture coordinates, number of normals.
type VertexCounts = [usize; 3];

/// State of the first pass.
struct ObjRewriter<'s, 'a> {
    survey: RewrittenObj,
    warnings: &'s mut Warnings,
    totals: VertexCounts,
    counts: VertexCounts,
    has_colours: bool,
    material: Option<usize>,
    smoothing: u32,
    material_numbers: HashMap<&'a str, usize>,
    run_numbers: HashMap<FaceGroup, usize>,
    /// Text of the faces of each run, in the rewritten form.
    faces: Vec<String>,
    /// References to texture coordinates that do not exist, and to normals that do not exist.
    dangling: [Option<DanglingReferences>; 2],
}

/// References of faces to texture coordinates or normals that do not exist.
struct DanglingReferences {
    /// Description of the first such reference: line, corner and cause.
    first: String,
    faces: usize,
}

/// Runs the first pass over the text of an OBJ file.
///
/// # Errors
/// A fault of kind input that names line and cause; of kind limit beyond any limit.
pub(super) fn check_and_rewrite_obj(
    text: &str,
    budget: &mut DecodeBudget,
    warnings: &mut Warnings,
) -> ImportResult<RewrittenObj> {
    let (totals, coloured, corners) = count_elements(text);
    // The budget covers a second copy of the text, the data of `tobj` for each vertex and corner,
    // and the resulting meshes.
    budget.reserve_memory(text.len(), 2)?;
    budget.reserve_memory(totals.iter().sum::<usize>(), 48)?;
    budget.reserve_memory(corners, 128)?;
    budget.reserve_triangles(corners)?;
    let mut walk = ObjRewriter {
        survey: RewrittenObj::default(),
        warnings,
        totals,
        counts: [0; 3],
        has_colours: coloured,
        material: None,
        smoothing: 0,
        material_numbers: HashMap::new(),
        run_numbers: HashMap::new(),
        faces: Vec::new(),
        dangling: [None, None],
    };
    for statement in split_statements(text) {
        walk.read_statement(&statement)
            .map_err(|fault| fault.with_place(format_args!("line {}", statement.line)))?;
    }
    let lost = walk
        .dangling
        .iter()
        .zip(["texture coordinates", "normals"])
        .filter_map(|(dangling, label)| {
            let DanglingReferences { first, faces } = dangling.as_ref()?;
            let whose = if *faces == 1 {
                "1 face refers".to_owned()
            } else {
                format!("{faces} faces refer")
            };
            Some(format!(
                "{first}; {whose} to {label} that the file does not have; these faces are shown without {label}"
            ))
        });
    let lost: Vec<String> = lost.collect();
    if !lost.is_empty() {
        walk.warnings.add(WarningCode::Geometry, lost.join("; "));
    }
    let ObjRewriter {
        mut survey, faces, ..
    } = walk;
    for (i, faces) in faces.iter().enumerate() {
        survey.text.push_str(&format!("g {i}\n"));
        survey.text.push_str(faces);
    }
    Ok(survey)
}

/// Returns the number of vertices of each kind, whether vertices have colours, and the total number
/// of corners of all faces.
fn count_elements(text: &str) -> (VertexCounts, bool, usize) {
    let (mut counts, mut coloured, mut corners) = ([0; 3], false, 0);
    for statement in split_statements(text) {
        match statement.keyword {
            "v" => {
                counts[0] += 1;
                coloured |= statement.rest.split_whitespace().count() >= 6;
            }
            "vt" => counts[1] += 1,
            "vn" => counts[2] += 1,
            "f" | "fo" => corners += statement.rest.split_whitespace().count(),
            _ => {}
        }
    }
    (counts, coloured, corners)
}

impl<'a> ObjRewriter<'_, 'a> {
    fn read_statement(&mut self, statement: &Statement<'a>) -> ImportResult<()> {
        match statement.keyword {
            "v" => self.read_position(statement.rest)?,
            "vt" => self.read_vertex_attribute(1, "vt", statement.rest, 1..=2)?,
            "vn" => self.read_vertex_attribute(2, "vn", statement.rest, 3..=3)?,
            "f" | "fo" => self.read_face(statement)?,
            "usemtl" => {
                let next = self.material_numbers.len();
                let number = *self.material_numbers.entry(statement.rest).or_insert(next);
                if number == next {
                    self.survey.materials.push(statement.rest.to_owned());
                }
                self.material = Some(number);
            }
            // The statement is `s off`, `s 0`, or `s` and the number of a smoothing group; any
            // other text names a group too.
            "s" => {
                self.smoothing = if matches!(statement.rest, "off" | "") {
                    0
                } else {
                    statement.rest.parse().unwrap_or(u32::MAX)
                }
            }
            "mtllib" => self.survey.libraries.push(statement.rest.to_owned()),
            "o" | "g" => {}
            "l" | "p" => self
                .warnings
                .add(WarningCode::PointsAndLines, "points and lines are ignored"),
            other => self.warnings.add(
                WarningCode::Unsupported,
                format!("statements `{}` are ignored", sanitise_text(other)),
            ),
        }
        Ok(())
    }

    /// Reads a vertex position: `v x y z`, with a weight that divides the coordinates (4 numbers),
    /// or with a colour (6 numbers, or 7 with an ignored alpha).
    fn read_position(&mut self, rest: &str) -> ImportResult<()> {
        let mut words = Vec::with_capacity(8);
        for word in rest.split_whitespace().take(8) {
            words.push(parse_number_prefix(word).ok_or_else(|| not_a_number_fault("v", word))?);
        }
        let weighted = words.len() == 4
            && words.last().is_some_and(|weight| weight.1 != 0.0)
            && !self.has_colours;
        let kept = match words.len() {
            4 if weighted => 4,
            3 | 4 => 3,
            6 | 7 => 6,
            n => {
                return Err(Fault::invalid_input(format!(
                    "v: has {n} numbers, but needs 3 coordinates, optionally followed by a weight or by a colour of 3 numbers"
                )));
            }
        };
        self.counts[0] += 1;
        self.survey.text.push('v');
        for (word, _) in words.iter().take(kept) {
            self.survey.text.push(' ');
            self.survey.text.push_str(word);
        }
        if self.has_colours && kept < 6 {
            // NaN stands for white. No scale of the other colours changes NaN.
            self.survey.text.push_str(" nan nan nan");
        }
        self.survey.text.push('\n');
        Ok(())
    }

    /// Reads a texture coordinate or a normal; optional numbers default to zero.
    fn read_vertex_attribute(
        &mut self,
        kind: usize,
        keyword: &str,
        rest: &str,
        numbers: std::ops::RangeInclusive<usize>,
    ) -> ImportResult<()> {
        self.survey.text.push_str(keyword);
        let mut found = 0;
        for word in rest.split_whitespace().take(*numbers.end()) {
            let (word, _) =
                parse_number_prefix(word).ok_or_else(|| not_a_number_fault(keyword, word))?;
            self.survey.text.push(' ');
            self.survey.text.push_str(word);
            found += 1;
        }
        if !numbers.contains(&found) {
            return Err(Fault::invalid_input(format!(
                "{keyword}: has {found} numbers, but needs {}",
                numbers.end()
            )));
        }
        self.survey
            .text
            .push_str(&" 0".repeat(numbers.end() - found));
        self.survey.text.push('\n');
        self.counts[kind] += 1;
        Ok(())
    }
}
