//! Origin of a scene: name, format and text, from which the positions of its parts are found.

use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use raywright_core::fault::Fault;

use crate::diagnostic::{Diagnostic, Diagnostics, TextPosition};
use crate::error::Error;
use crate::native::{self, ModelEntries, SceneNotation};
use crate::text::{split_lines, strip_byte_order_mark};
use crate::{ply, stl};

/// File format of a scene or model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneFormat {
    /// A native scene.
    Native(SceneNotation),
    /// glTF 2.0 as text, with its buffers in files or embedded.
    Gltf,
    /// glTF 2.0 as a single binary file.
    Glb,
    /// Wavefront OBJ.
    Obj,
    /// STL, binary or text.
    Stl,
    /// PLY, ASCII or binary.
    Ply,
}

/// Returns the name of the format that the path's extension stands for, and advice on the
/// conversion of the file. Only well-known unsupported formats are listed.
pub(crate) fn unsupported_format(path: &Path) -> Option<(&'static str, &'static str)> {
    const BLENDER: &str =
        "import the file into Blender and export glTF: File, Export, glTF 2.0 (.glb)";
    const FOREIGN: [(&[&str], &str, &str); 12] = [
        (&["usd", "usda", "usdc", "usdz"], "USD", BLENDER),
        (
            &["fbx"],
            "FBX",
            "convert the file to .glb with Blender or FBX2glTF",
        ),
        (
            &["blend"],
            "a Blender file",
            "export the scene from Blender: File, Export, glTF 2.0 (.glb)",
        ),
        (
            &["dae"],
            "COLLADA",
            "convert the file to glTF with Blender or COLLADA2GLTF",
        ),
        (&["abc"], "Alembic", BLENDER),
        (&["3ds", "x3d", "wrl", "x", "bvh"], "this format", BLENDER),
        (
            &["step", "stp", "iges", "igs", "brep"],
            "a CAD model",
            "open the file in FreeCAD and export .glb or .stl",
        ),
        (
            &["3mf", "amf"],
            "a format of 3D printers",
            "export .stl from a slicing program",
        ),
        (
            &["max", "ma", "mb", "c4d", "skp", "hip", "3dm"],
            "a file of a modelling program",
            "export glTF (.glb) or OBJ from that program",
        ),
        (
            &["pbrt", "xml", "pov"],
            "a scene of another renderer",
            "export its meshes as .ply or .obj, and write the rest as in docs/scene-format.md",
        ),
        (
            &["gz", "zip", "7z", "xz", "zst", "bz2", "tar", "tgz", "rar"],
            "an archive",
            "unpack the archive first",
        ),
        (
            &["png", "jpg", "jpeg", "webp", "gif", "hdr", "exr"],
            "a picture",
            "`raywright info` shows its properties, and --env uses the picture as the environment",
        ),
    ];
    let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
    FOREIGN
        .iter()
        .find(|(endings, ..)| endings.contains(&ending.as_str()))
        .map(|&(_, format, remedy)| (format, remedy))
}

impl SceneFormat {
    /// Returns the format of a model file by the extension of its name.
    pub(crate) fn from_model_path(file: &Path) -> Option<Self> {
        let ending = file.extension()?.to_string_lossy().to_ascii_lowercase();
        match ending.as_str() {
            "gltf" => Some(Self::Gltf),
            "glb" => Some(Self::Glb),
            "obj" => Some(Self::Obj),
            "stl" => Some(Self::Stl),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }

    /// Whether files of the format are models, without settings of a picture.
    pub fn is_model(self) -> bool {
        !matches!(self, Self::Native(_))
    }

    /// Whether files of the format can contain several scenes, variants and animations to choose
    /// from.
    pub(crate) fn has_model_choices(self) -> bool {
        matches!(self, Self::Gltf | Self::Glb)
    }

    /// Returns a description of a file in this format, such as for the message that a file is
    /// broken.
    pub(crate) fn file_description(self) -> &'static str {
        match self {
            Self::Native(_) => "a scene file",
            Self::Gltf | Self::Glb => "a glTF file",
            Self::Obj => "an OBJ file",
            Self::Stl => "an STL file",
            Self::Ply => "a PLY file",
        }
    }

    /// Returns the format of an input, by its extension or otherwise by its content; `None` for an
    /// unknown format.
    pub(crate) fn detect_scene_format(file: &Path, bytes: &[u8]) -> Option<Self> {
        let ending = file
            .extension()
            .map(|ending| ending.to_string_lossy().to_ascii_lowercase())
            .unwrap_or_default();
        match ending.as_str() {
            _ if bytes.starts_with(b"glTF") => Some(Self::Glb),
            "toml" => Some(Self::Native(SceneNotation::Toml)),
            "json" => Some(Self::Native(SceneNotation::Json)),
            _ => Self::from_model_path(file).or_else(|| Self::detect_format_in_content(bytes)),
        }
    }

    fn detect_format_in_content(bytes: &[u8]) -> Option<Self> {
        let start = strip_byte_order_mark(bytes).trim_ascii_start();
        if ply::is_ply(bytes) {
            return Some(Self::Ply);
        }
        if stl::is_stl(bytes) {
            return Some(Self::Stl);
        }
        if start.starts_with(b"{") {
            let is_gltf = start.windows(7).any(|window| window == b"\"asset\"");
            return Some(if is_gltf {
                Self::Gltf
            } else {
                Self::Native(SceneNotation::Json)
            });
        }
        // The first line that is no comment distinguishes the two text formats: a key with a value
        // in TOML, or a keyword in OBJ.
        let mut statements = split_lines(start)
            .map(|line| line.trim_ascii())
            .filter(|line| !line.is_empty() && !line.starts_with(b"#"));
        let first = statements.next().unwrap_or_default();
        let keyword = first
            .split(|byte| byte.is_ascii_whitespace())
            .next()
            .unwrap_or_default();
        const KEYWORDS: [&[u8]; 11] = [
            b"v", b"vt", b"vn", b"vp", b"f", b"g", b"o", b"s", b"l", b"mtllib", b"usemtl",
        ];
        if KEYWORDS.contains(&keyword) {
            return Some(Self::Obj);
        }
        let is_toml =
            first.starts_with(b"format") || first.starts_with(b"[") || start.starts_with(b"#");
        is_toml.then_some(Self::Native(SceneNotation::Toml))
    }
}

/// Returns the names of the scene and model files in a folder, in alphabetical order. The list is
/// empty if the folder is unreadable. At most 10,000 files are examined.
pub fn list_scenes_and_models(folder: &Path) -> Vec<String> {
    /// Largest number of files in a folder that are examined; the remaining files of a larger
    /// folder are left out.
    const MOST: usize = 10_000;
    let folder = if folder == Path::new("") {
        Path::new(".")
    } else {
        folder
    };
    let entries = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .take(MOST)
        .flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> = names
        .filter(|name| is_scene_or_model(Path::new(name)))
        .collect();
    names.sort();
    names
}

/// Whether a file name has the extension of a scene or a model.
pub fn is_scene_or_model(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    name.ends_with(".scene.toml")
        || name.ends_with(".scene.json")
        || SceneFormat::from_model_path(file).is_some()
}

/// Origin of a loaded scene: name, file format and, for a native scene, its text.
#[derive(Clone, Debug)]
pub struct SourceInfo {
    /// Name given by the user: a path, or `preset:NAME`.
    pub name: String,
    /// File name without folders and extensions, from which names of pictures are formed.
    pub stem: String,
    /// Format of the scene.
    pub format: SceneFormat,
    /// Text of a native scene; `None` for a model.
    pub text: Option<Arc<str>>,
    /// Positions, in the scene's lists, of the entries that come from model files.
    pub(crate) model_entries: Vec<ModelEntries>,
    /// Syntax tree of the text, built on first use.
    tree: OnceLock<Option<native::SyntaxTree>>,
}

impl SourceInfo {
    pub(crate) fn new(
        name: impl Into<String>,
        stem: impl Into<String>,
        format: SceneFormat,
        text: Option<Arc<str>>,
    ) -> Self {
        Self {
            name: name.into(),
            stem: stem.into(),
            format,
            text,
            model_entries: Vec::new(),
            tree: OnceLock::new(),
        }
    }

    /// Creates the error for problems of the scene. Each problem has its position in the text or,
    /// for a model, its path in the scene.
    pub fn error_at_problems(&self, problems: Vec<Fault>) -> Error {
        let message = |problem: &Fault| format!("{}: {}", problem.path, problem.message);
        if let (Some(text), SceneFormat::Native(_)) = (&self.text, self.format) {
            let at = |problem: Fault| Diagnostic {
                span: self.find_text_span(&problem.path),
                message: problem.message,
                label: String::new(),
                hint: Some(problem.remedy).filter(|remedy| !remedy.is_empty()),
            };
            return Error::Scene(Diagnostics::new(
                &self.name,
                Arc::clone(text),
                problems.into_iter().map(at).collect(),
            ));
        }
        let mut hints = problems.iter().map(|problem| &problem.remedy);
        let hint = hints.find(|hint| !hint.is_empty()).cloned();
        let error = Error::invalid_input(
            &self.name,
            problems.iter().map(message).collect::<Vec<_>>().join("; "),
        );
        hint.into_iter().fold(error, Error::with_hint)
    }

    /// Returns the syntax tree of the text; `None` for a scene without a text.
    fn syntax_tree(&self) -> Option<&native::SyntaxTree> {
        let (Some(text), SceneFormat::Native(notation)) = (&self.text, self.format) else {
            return None;
        };
        self.tree
            .get_or_init(|| native::SyntaxTree::new(text, notation))
            .as_ref()
    }

    /// Returns the byte range of a part of the scene in the text. A part that comes from a model
    /// file has the range of the text's entry for this model.
    fn find_text_span(&self, path: &str) -> Option<Range<usize>> {
        let tree = self.syntax_tree()?;
        let (list, rest) = path.split_once('[').unwrap_or((path, ""));
        let index = rest.split(']').next().and_then(|index| index.parse().ok());
        let holds = |entries: &&ModelEntries| {
            entries.list == list && index.is_some_and(|index| entries.range.contains(&index))
        };
        match self.model_entries.iter().find(holds) {
            Some(entries) => tree.span(&format!("models[{}]", entries.model)),
            None => tree.span(path),
        }
    }

    /// Formats the position of a value in the scene: file, line and column, such as
    /// `x.scene.toml:12:5`. For a model, which has no text, file and path are given, such as
    /// `duck.glb: materials[2]`. The path starts at the root: `objects[3].material`. A value that
    /// the text omits has the position of the enclosing value.
    pub fn format_value_position(&self, path: &str) -> String {
        let (Some(text), SceneFormat::Native(_)) = (&self.text, self.format) else {
            return format!("{}: {path}", self.name);
        };
        match self.find_text_span(path) {
            Some(span) => {
                let place = TextPosition::from_span(text, &span);
                format!("{}:{}:{}", self.name, place.line, place.column)
            }
            None => self.name.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: positions are line and column in a text, the path alone in a model, and the file
    /// where neither is known.
    #[test]
    fn places_are_told_as_well_as_they_can_be() {
        let text = "format = 1\n[render]\n  samples = 4\n";
        let native = |text| {
            SourceInfo::new(
                "a.toml",
                "a",
                SceneFormat::Native(SceneNotation::Toml),
                text,
            )
        };
        assert_eq!(
            native(Some(text.into())).format_value_position("render.samples"),
            "a.toml:3:13"
        );
        assert_eq!(
            native(Some(text.into())).format_value_position("sky"),
            "a.toml"
        );
        assert_eq!(
            native(None).format_value_position("render.samples"),
            "a.toml: render.samples"
        );
        assert_eq!(
            SourceInfo::new("a.obj", "a", SceneFormat::Obj, None)
                .format_value_position("lights[0]"),
            "a.obj: lights[0]"
        );
    }
}
