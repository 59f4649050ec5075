//! Faces of an OBJ file: the indices of their corners, checked and made absolute.

use std::fmt::Write as _;

use super::super::lines::Statement;
use super::{DanglingReferences, FaceGroup, NormalSource, ObjRewriter};
use crate::import::{Fault, ImportResult, sanitise_text};
use crate::warning::WarningCode;

impl<'a> ObjRewriter<'_, 'a> {
    /// Reads a face, and adds it to the run of faces with the same properties.
    pub(super) fn read_face(&mut self, statement: &Statement<'a>) -> ImportResult<()> {
        let mut corners = Vec::with_capacity(4);
        let mut dangling = [None, None];
        for word in statement.rest.split_whitespace() {
            let place =
                |fault: Fault| fault.with_place(format_args!("f: `{}`", sanitise_text(word)));
            corners.push(self.read_corner(word, &mut dangling).map_err(place)?);
        }
        for (all, one) in self.dangling.iter_mut().zip(dangling) {
            let Some(label) = one else { continue };
            let first = || DanglingReferences {
                first: format!("line {}: f: {label}", statement.line),
                faces: 0,
            };
            all.get_or_insert_with(first).faces += 1;
        }
        if corners.len() < 3 {
            self.warnings.add(
                WarningCode::Geometry,
                "faces with fewer than three corners are ignored",
            );
            return Ok(());
        }
        let textured = corners.iter().all(|corner| corner.texture.is_some());
        let given = corners.iter().all(|corner| corner.normal.is_some());
        let shading = match self.smoothing {
            _ if given => NormalSource::FromFile,
            0 => NormalSource::Flat,
            group => NormalSource::Group(group),
        };
        let run = FaceGroup {
            material: self.material,
            normal_source: shading,
            has_uvs: textured,
        };
        let next = self.faces.len();
        let index = *self.run_numbers.entry(run).or_insert(next);
        if index == next {
            self.faces.push(String::new());
            self.survey.runs.push(run);
        }
        let Some(out) = self.faces.get_mut(index) else {
            return Ok(());
        };
        out.push('f');
        for corner in corners {
            let CornerIndices {
                position,
                texture,
                normal,
            } = corner;
            // Writing to a string cannot fail.
            let _ = match (texture.filter(|_| textured), normal.filter(|_| given)) {
                (Some(vt), Some(vn)) => write!(out, " {position}/{vt}/{vn}"),
                (Some(vt), None) => write!(out, " {position}/{vt}"),
                (None, Some(vn)) => write!(out, " {position}//{vn}"),
                (None, None) => write!(out, " {position}"),
            };
        }
        out.push('\n');
        Ok(())
    }

    /// Reads the indices of a corner and checks that each vertex exists. A reference to a missing
    /// texture coordinate or normal is dropped, because some programs write indices of lines that
    /// they omit, and only detail is lost. The first missing reference of a face is recorded in
    /// `dangling`.
    fn read_corner(
        &self,
        word: &str,
        dangling: &mut [Option<String>; 2],
    ) -> ImportResult<CornerIndices> {
        let mut parts = word.split('/');
        let [v, vt, vn] = [
            parts.next().unwrap_or_default(),
            parts.next().unwrap_or_default(),
            parts.next().unwrap_or_default(),
        ];
        if parts.next().is_some() {
            return Err(Fault::invalid_input(
                "has more than three indices (position/texture coordinate/normal)",
            ));
        }
        let missing = |part: &str, kind: usize, label: &str| {
            format!(
                "refers to {label} {}, but the file has {}",
                sanitise_text(part),
                self.totals[kind]
            )
        };
        let mut optional = |part: &str, kind: usize, label: &str| -> ImportResult<Option<usize>> {
            if part.is_empty() {
                return Ok(None);
            }
            let index = self.resolve_index(part, kind)?;
            if index.is_none() {
                dangling[kind - 1].get_or_insert_with(|| {
                    format!("`{}`: {}", sanitise_text(word), missing(part, kind, label))
                });
            }
            Ok(index)
        };
        let (texture, normal) = (
            optional(vt, 1, "texture coordinate")?,
            optional(vn, 2, "normal")?,
        );
        let position = self
            .resolve_index(v, 0)?
            .ok_or_else(|| Fault::invalid_input(missing(v, 0, "vertex")))?;
        Ok(CornerIndices {
            position,
            texture,
            normal,
        })
    }

    /// Converts an index to an absolute index from 1; `None` if out of range. A negative index
    /// counts backwards from the latest vertex.
    fn resolve_index(&self, part: &str, kind: usize) -> ImportResult<Option<usize>> {
        let index: i64 = part.parse().map_err(|_| {
            Fault::invalid_input(format!("`{}` is no whole number", sanitise_text(part)))
        })?;
        let absolute = match index {
            0 if kind == 0 => {
                return Err(Fault::invalid_input(
                    "index 0 is not allowed: indices start at 1",
                ));
            }
            // Some programs write 0 for a corner without a texture coordinate or normal.
            0 => None,
            i if i > 0 => usize::try_from(i).ok(),
            i => usize::try_from(i.unsigned_abs())
                .ok()
                .and_then(|back| (self.counts[kind] + 1).checked_sub(back)),
        };
        Ok(absolute.filter(|i| (1..=self.totals[kind]).contains(i)))
    }
}

/// Absolute indices of a corner, from 1.
struct CornerIndices {
    position: usize,
    texture: Option<usize>,
    normal: Option<usize>,
}
