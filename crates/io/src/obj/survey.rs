//! First pass over an OBJ file: the faces' properties, and what `tobj` cannot read.
//!
//! A file that `tobj` reads correctly goes to it as it is, because every index was checked before.
//! Otherwise a second pass writes the text again in a form that it reads. From the original text,
//! `tobj` would reject numbers of other programs, shift vertex colours when only some vertices have
//! colours, take long lines for faces, and merge faces with different properties to a mesh. It
//! forgets smoothing groups and the names of materials, and its errors name no line.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Write as _;

use crate::import::{DecodeBudget, Fault, FaultPlace, ImportResult, Warnings, sanitise_text};
use crate::text::{
    is_inside_number, not_a_number_fault, parse_number_prefix, split_lines, strip_byte_order_mark,
};

/// Source of the normals for a run of faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NormalSource {
    /// Flat facets.
    Flat,
    /// The file's own normals.
    FromFile,
    /// The mean, at each position, of the facet normals in the smoothing group with this number.
    Group(u32),
}

/// Properties that all faces of a run have in common. `tobj` returns a model for each run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FaceGroup {
    /// Index into [`ObjSurvey::materials`]; `None` before the first `usemtl`.
    pub material: Option<usize>,
    /// Source of the normals.
    pub normal_source: NormalSource,
    /// Whether all corners have texture coordinates.
    pub has_uvs: bool,
}

/// References of faces to texture coordinates or normals that do not exist.
struct MissingReferences {
    /// Description of the first such reference.
    first: String,
    faces: usize,
    last_line: usize,
}

/// Result of a pass, and its state.
#[derive(Default)]
pub(super) struct ObjSurvey<'a> {
    pub runs: Vec<FaceGroup>,
    /// Names of materials in order of first use.
    pub materials: Vec<String>,
    /// Text after each `mtllib`.
    pub libraries: Vec<&'a str>,
    /// Whether `tobj` reads the original text correctly.
    pub is_healthy: bool,
    /// Lines of the vertices and of the faces in the form that `tobj` reads. Empty in the first
    /// pass.
    pub mended: [String; 2],
    is_mending: bool,
    /// Number of positions, of texture coordinates and of normals in the file.
    totals: [usize; 3],
    /// The same up to the current line.
    counts: [usize; 3],
    corners: usize,
    groups: usize,
    has_colours: bool,
    material: Option<usize>,
    material_numbers: HashMap<&'a str, usize>,
    smoothing: u32,
    /// Whether `tobj` starts a new model at the next face.
    run_has_ended: bool,
    /// References to missing texture coordinates, and to missing normals.
    missing: [Option<MissingReferences>; 2],
}

/// Names of the three kinds of vertex data, for messages.
const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

impl<'a> ObjSurvey<'a> {
    /// Runs the first pass over the text of an OBJ file, or the second pass, which mends it.
    ///
    /// # Errors
    /// A fault of kind input that names line and cause; of kind limit beyond any limit.
    pub fn read(
        text: &'a str,
        is_mending: bool,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<Self> {
        let mut survey = Self {
            is_mending,
            is_healthy: true,
            ..Self::default()
        };
        split_statements(text).for_each(|statement| survey.count_elements(&statement));
        if is_mending {
            budget.reserve_memory(text.len(), 2)?;
        } else {
            // The data of `tobj` for each vertex, corner and model, and the resulting meshes.
            budget.reserve_memory(survey.totals.iter().sum::<usize>(), 48)?;
            budget.reserve_memory(survey.corners, 128)?;
            budget.reserve_memory(survey.groups, 512)?;
            budget.reserve_triangles(survey.corners)?;
        }
        for statement in split_statements(text) {
            survey
                .read_statement(&statement, warnings)
                .with_place(format_args!("line {}", statement.line))?;
        }
        let lost = survey.missing.iter().zip(KINDS.iter().skip(1));
        let lost: Vec<String> = lost
            .filter_map(|(missing, kind)| missing.as_ref().map(|missing| missing.describe(kind)))
            .collect();
        if !lost.is_empty() {
            warn!(warnings, Geometry, "{}", lost.join("; "));
        }
        Ok(survey)
    }

    fn count_elements(&mut self, statement: &Statement<'_>) {
        let words = || statement.rest.split_whitespace().count();
        match statement.keyword {
            "v" => {
                self.totals[0] += 1;
                self.has_colours |= words() >= 6;
            }
            "vt" => self.totals[1] += 1,
            "vn" => self.totals[2] += 1,
            "f" | "fo" => self.corners += words(),
            "g" | "o" => self.groups += 1,
            _ => {}
        }
    }

    fn read_statement(
        &mut self,
        statement: &Statement<'a>,
        warnings: &mut Warnings,
    ) -> ImportResult<()> {
        let rest = statement.rest;
        match statement.keyword {
            "v" => self.read_vertex(0, statement)?,
            "vt" => self.read_vertex(1, statement)?,
            "vn" => self.read_vertex(2, statement)?,
            "f" | "fo" => self.read_face(statement, warnings)?,
            "usemtl" => {
                let next = self.materials.len();
                let number = *self.material_numbers.entry(rest).or_insert(next);
                if number == next {
                    self.materials.push(rest.to_owned());
                }
                self.material = Some(number);
            }
            // The statement is `s off`, `s 0`, or `s` and the number of a smoothing group; any
            // other text names a group too.
            "s" if matches!(rest, "off" | "") => self.smoothing = 0,
            "s" => self.smoothing = rest.parse().unwrap_or(u32::MAX),
            "mtllib" => self.libraries.push(rest),
            "o" | "g" => self.run_has_ended = !self.is_mending,
            "l" | "p" => {
                self.is_healthy = false;
                warn!(warnings, PointsAndLines, "points and lines are ignored");
            }
            other => warn!(
                warnings,
                Unsupported,
                "statements `{}` are ignored",
                sanitise_text(other)
            ),
        }
        Ok(())
    }

    /// Reads a position, a texture coordinate or a normal. A position may have a weight that
    /// divides its coordinates (4 numbers), or a colour (6 numbers, or 7 with an ignored alpha). The
    /// second texture coordinate may be missing.
    fn read_vertex(&mut self, kind: usize, statement: &Statement<'a>) -> ImportResult<()> {
        let Statement { keyword, rest, .. } = *statement;
        let most = [8, 2, 3][kind];
        let (mut words, mut weight) = (Vec::with_capacity(8), 0.0);
        for word in rest.split_whitespace().take(most) {
            let number = parse_number_prefix(word);
            let (number, value) = number.ok_or_else(|| not_a_number_fault(keyword, word))?;
            self.is_healthy &= number == word;
            words.push(number);
            weight = value;
        }
        let found = words.len();
        match (kind, found) {
            (0, 4) if weight != 0.0 && !self.has_colours => {}
            (0, 3 | 4) => words.truncate(3),
            (0, 6 | 7) => words.truncate(6),
            (1, 1 | 2) => words.resize(2, "0"),
            (2, 3) => {}
            _ => {
                let needs = [
                    "3 coordinates, optionally followed by a weight or by a colour of 3 numbers",
                    "2",
                    "3",
                ];
                return Err(fault!(
                    "{keyword}: has {found} numbers, but needs {}",
                    needs[kind]
                ));
            }
        }
        if kind == 0 && self.has_colours && words.len() == 3 {
            // NaN stands for white. No scale of the other colours changes NaN.
            words.resize(6, "nan");
        }
        self.counts[kind] += 1;
        // From a comment behind a weight, tobj takes channels of a colour.
        self.is_healthy &= words.len() == found && !statement.has_comment;
        if self.is_mending {
            self.write(0, format_args!("{keyword} {}\n", words.join(" ")));
        }
        Ok(())
    }

    /// Writes to the mended text, in the second pass.
    fn write(&mut self, part: usize, text: core::fmt::Arguments<'_>) {
        if self.is_mending {
            // Writing to a string cannot fail.
            let _ = self.mended[part].write_fmt(text);
        }
    }

    /// Reads a face, and starts a run if the face's properties are not those of the face before.
    fn read_face(
        &mut self,
        statement: &Statement<'a>,
        warnings: &mut Warnings,
    ) -> ImportResult<()> {
        let mut corners = Vec::with_capacity(4);
        for word in statement.rest.split_whitespace() {
            let place =
                |fault: Fault| fault.with_place(format_args!("f: `{}`", sanitise_text(word)));
            corners.push(self.read_corner(word, statement.line).map_err(place)?);
        }
        self.is_healthy &= statement.keyword == "f" && corners.len() >= 3;
        if corners.len() < 3 {
            warn!(
                warnings,
                Geometry, "faces with fewer than three corners are ignored"
            );
            return Ok(());
        }
        let [has_uvs, has_normals] = [1, 2].map(|kind| {
            let is_given = |corner: &[usize; 3]| corner[kind] > 0;
            let all = corners.iter().all(is_given);
            self.is_healthy &= all || !corners.iter().any(is_given);
            all
        });
        let run = FaceGroup {
            material: self.material,
            normal_source: match self.smoothing {
                _ if has_normals => NormalSource::FromFile,
                0 => NormalSource::Flat,
                group => NormalSource::Group(group),
            },
            has_uvs,
        };
        if self.run_has_ended || self.runs.last() != Some(&run) {
            self.is_healthy &= self.run_has_ended || self.runs.is_empty();
            self.run_has_ended = false;
            self.runs.push(run);
            self.write(1, format_args!("g\n"));
        }
        self.write(1, format_args!("f"));
        for [position, uv, normal] in corners {
            match (has_uvs, has_normals) {
                (true, true) => self.write(1, format_args!(" {position}/{uv}/{normal}")),
                (true, false) => self.write(1, format_args!(" {position}/{uv}")),
                (false, true) => self.write(1, format_args!(" {position}//{normal}")),
                (false, false) => self.write(1, format_args!(" {position}")),
            }
        }
        self.write(1, format_args!("\n"));
        Ok(())
    }

    /// Reads the indices of a corner, absolute from 1; a negative index counts backwards from the
    /// latest vertex. A missing texture coordinate or normal is 0: some programs write 0, or indices
    /// of lines that they omit, and only detail is lost.
    fn read_corner(&mut self, word: &str, line: usize) -> ImportResult<[usize; 3]> {
        let mut corner = [0; 3];
        for (kind, part) in word.split('/').enumerate() {
            if kind > 2 {
                return Err(fault!(
                    "has more than three indices (position/texture coordinate/normal)"
                ));
            }
            if kind > 0 && part.is_empty() {
                continue;
            }
            let index: i64 = part
                .parse()
                .map_err(|_| fault!("`{}` is no whole number", sanitise_text(part)))?;
            let (count, total) = (self.counts[kind], self.totals[kind]);
            let absolute = match usize::try_from(index) {
                Ok(index) => index,
                Err(_) => (count + 1).saturating_sub(index.unsigned_abs() as usize),
            };
            self.is_healthy &= (1..=count).contains(&absolute);
            if (1..=total).contains(&absolute) {
                corner[kind] = absolute;
                continue;
            }
            if (kind, index) == (0, 0) {
                return Err(fault!("index 0 is not allowed: indices start at 1"));
            }
            let reason = format!(
                "refers to {} {index}, but the file has {total}",
                KINDS[kind]
            );
            if kind == 0 {
                return Err(Fault::invalid_input(reason));
            }
            let missing = self.missing[kind - 1].get_or_insert_with(|| MissingReferences {
                first: format!("line {line}: f: `{}`: {reason}", sanitise_text(word)),
                faces: 0,
                last_line: 0,
            });
            missing.faces += usize::from(missing.last_line != line);
            missing.last_line = line;
        }
        Ok(corner)
    }
}

impl MissingReferences {
    fn describe(&self, kind: &str) -> String {
        let faces = match self.faces {
            1 => "1 face refers".to_owned(),
            faces => format!("{faces} faces refer"),
        };
        format!(
            "{}; {faces} to {kind}s that the file does not have; these faces are shown without {kind}s",
            self.first
        )
    }
}

// Statements of OBJ and MTL files: continued lines are joined, comments and byte order marks
// removed, line numbers kept.

/// A statement of an OBJ or MTL file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Statement<'a> {
    /// Number of the first line of the statement, from 1.
    pub line: usize,
    /// First word.
    pub keyword: &'a str,
    /// Text after the first word, trimmed.
    pub rest: &'a str,
    /// Whether the line has a comment, or a number with `#`.
    pub has_comment: bool,
}

/// Decodes the bytes of a file as text. A line that ends in `\` is joined to the next line, and
/// carriage returns become line feeds. Bytes that are not UTF-8 make only names unreadable, because
/// numbers are ASCII.
pub(super) fn decode_text(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = strip_byte_order_mark(bytes);
    if !bytes.iter().any(|byte| matches!(byte, b'\\' | b'\r')) {
        return String::from_utf8_lossy(bytes);
    }
    let (mut out, mut owed) = (String::with_capacity(bytes.len()), 1);
    for line in split_lines(bytes) {
        let line = String::from_utf8_lossy(line);
        match line.strip_suffix('\\') {
            Some(begun) if !begun.trim_start().starts_with('#') => {
                out.push_str(begun);
                out.push(' ');
                owed += 1;
            }
            _ => {
                out.push_str(&line);
                // After joined lines, empty lines are added, so that the numbers of later lines
                // stay correct.
                out.extend(std::iter::repeat_n('\n', owed));
                owed = 1;
            }
        }
    }
    Cow::Owned(out)
}

/// Splits a decoded text into statements.
pub(super) fn split_statements(text: &str) -> impl Iterator<Item = Statement<'_>> {
    text.lines().enumerate().filter_map(|(i, line)| {
        let (keyword, rest) = split_first_word(line);
        let has_comment = rest.contains('#') && !takes_name(keyword);
        let rest = if has_comment {
            strip_comment(rest)
        } else {
            rest
        };
        (!keyword.is_empty() && !keyword.starts_with('#')).then(|| Statement {
            line: i + 1,
            keyword,
            rest: rest.trim_end(),
            has_comment,
        })
    })
}

/// Splits off the first word.
fn split_first_word(text: &str) -> (&str, &str) {
    let text = text.trim_start();
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}

/// Whether the text after a keyword is a name or names a file. Such a name is the rest of its line
/// and may contain `#`: programs name materials `Material #25`.
pub(super) fn takes_name(keyword: &str) -> bool {
    const KEYWORDS: [&str; 8] = [
        "newmtl", "usemtl", "mtllib", "bump", "disp", "decal", "refl", "norm",
    ];
    KEYWORDS.iter().any(|key| key.eq_ignore_ascii_case(keyword))
        || keyword
            .get(..4)
            .is_some_and(|start| start.eq_ignore_ascii_case("map_"))
}

/// Returns a text without the comment at its end.
fn strip_comment(text: &str) -> &str {
    let is_comment = |at: &usize| !is_inside_number(&text[..*at], &text[at + 1..]);
    let start = text.match_indices('#').map(|(at, _)| at).find(is_comment);
    start.map_or(text, |at| &text[..at])
}

/// Returns a name without a comment behind the name, for a name that is not known with it.
pub(super) fn strip_name_comment(name: &str) -> &str {
    name.rsplit_once(" #").map_or(name, |(name, _)| name.trim())
}

/// Converts a path in the file to the form that [`Folder::read`](crate::Folder::read) accepts:
/// relative, with `/` as separator.
pub(super) fn normalise_path(path: &str) -> String {
    path.trim().trim_matches('"').replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::super::{mesh, parse_obj};
    use super::*;
    use crate::Limits;

    fn survey(text: &str, is_mending: bool) -> ObjSurvey<'_> {
        let mut budget = DecodeBudget::new(&Limits::default());
        ObjSurvey::read(text, is_mending, &mut budget, &mut Warnings::default()).expect(text)
    }

    const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 1\nvn 0 0 1\n";

    /// Protects: a file that `tobj` reads correctly goes to it as it is, and the mended text has the
    /// same faces.
    #[test]
    fn healthy_texts_are_not_written_again() {
        for faces in [
            "f 1 2 3\nf 1 2 3 4\n",
            "# a comment\no x\ns 1\nf 1/1/1 2/2/1 3/1/1\n",
            "usemtl Material #1\nf 1//1 2//1 3//1\ng a\nusemtl b\nf -4 -3 -2\ng\ng c\nf 1 2 3\n",
            "s off\nf 1/1 2/2 3/2\no b # c\ns 3\nf 2 3 4\nvp 1\n",
        ] {
            let text = format!("{CORNERS}{faces}");
            let (healthy, mended) = (survey(&text, false), survey(&text, true));
            assert!(healthy.is_healthy, "{faces}");
            let meshes = |runs: Vec<FaceGroup>, text: &str| {
                let models = parse_obj(text).expect(text);
                let meshes = mesh::build_meshes(runs, models, &mut Warnings::default());
                let corners = |(material, data): super::super::MaterialMesh| {
                    let corner = |&i: &u32| {
                        let i = i as usize;
                        let uv = data.uvs.first().map(|set| set[i]);
                        (
                            data.positions.offsets()[i],
                            uv,
                            data.normals.get(i).copied(),
                        )
                    };
                    let indices = data.indices.as_flattened();
                    (material, indices.iter().map(corner).collect::<Vec<_>>())
                };
                meshes
                    .expect(text)
                    .into_iter()
                    .map(corners)
                    .collect::<Vec<_>>()
            };
            let expected = meshes(healthy.runs, &text);
            assert!(
                !expected.is_empty() && expected.iter().all(|(_, corners)| !corners.is_empty())
            );
            assert_eq!(
                meshes(mended.runs, &mended.mended.concat()),
                expected,
                "{faces}"
            );
        }
    }

    /// Protects: whatever `tobj` would misread in silence is mended: mixed corners, faces of two
    /// materials or smoothing groups in one group, lines, colours of some vertices, missing and
    /// later vertices.
    #[test]
    fn texts_that_tobj_misreads_are_mended() {
        for rest in [
            "f 1/1 2 3\n",
            "f 1//1 2//1 3//1\nf 1 2 3\n",
            "usemtl a\nf 1 2 3\nusemtl b\nf 2 3 4\n",
            "s 1\nf 1 2 3\ns 2\nf 2 3 4\n",
            "l 1 2 3\nf 1 2 3\n",
            "f 1 2\nf 1 2 3\n",
            "fo 1 2 3\n",
            "f 1/0 2/1 3/1\n",
            "f 1/3 2/1 3/1\n",
            "f 1 2 5\nv 1 1 1\n",
            "v 1 1 1 0.5 0.5 0.5\nf 1 2 3\n",
            "v 1 1 1 2 # w\nf 1 2 5\n",
            "v 1f 1 1\nf 1 2 5\n",
            "vt 0.5\nf 1 2 3\n",
        ] {
            let text = format!("{CORNERS}{rest}");
            assert!(!survey(&text, false).is_healthy, "{rest}");
            let mended = survey(&text, true);
            let models = parse_obj(&mended.mended.concat()).expect(rest);
            assert_eq!(models.len(), mended.runs.len(), "{rest}");
        }
    }
}

#[cfg(test)]
mod lines_tests {
    use super::*;

    /// Protects: carriage returns alone end lines, even mixed with line feeds, and line numbers are
    /// right.
    #[test]
    fn carriage_returns_end_lines() {
        let text = decode_text(b"# a\rv 1\\\r2\rmtllib m\nf 1\r\n\r\ng x\r");
        let found: Vec<_> = split_statements(&text)
            .map(|s| (s.line, s.keyword, s.rest))
            .collect();
        assert_eq!(
            found,
            [
                (2, "v", "1 2"),
                (4, "mtllib", "m"),
                (5, "f", "1"),
                (7, "g", "x")
            ]
        );
    }

    /// Protects: a continued line is joined to the next; comments and blank lines are skipped;
    /// `\r\n` ends a line.
    #[test]
    fn statements_are_joined_and_stripped() {
        let text =
            decode_text(b"\xef\xbb\xbf  # x\r\nf 1 2 \\\r\n 3 # y\r\n\r\nusemtl  a b \n s\toff");
        let found: Vec<_> = split_statements(&text)
            .map(|s| (s.line, s.keyword, s.rest))
            .collect();
        assert_eq!(
            found,
            [(2, "f", "1 2   3"), (5, "usemtl", "a b"), (6, "s", "off")]
        );
    }

    /// Protects: `#` is part of names and of numbers of old C libraries, and begins comments behind
    /// other numbers; a comment that ends in `\` continues no line.
    #[test]
    fn comments_end_no_names() {
        let text = decode_text(
            b"# c:\\maps\\\nusemtl Material #25 \nmap_kd a#1.png\nv 1 2 3# x\nvn -1.#IND00 1.#J 0 # y\nf 1 2 #3\n#f\n",
        );
        let found: Vec<_> = split_statements(&text)
            .map(|s| (s.line, s.keyword, s.rest))
            .collect();
        assert_eq!(
            found,
            [
                (2, "usemtl", "Material #25"),
                (3, "map_kd", "a#1.png"),
                (4, "v", "1 2 3"),
                (5, "vn", "-1.#IND00 1.#J 0"),
                (6, "f", "1 2")
            ]
        );
    }
}
