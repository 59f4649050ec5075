//! Parsing of the native scene format: TOML or JSON text to a [`Scene`], with the position of every
//! problem.
mod colours;
mod de;
mod examples;
mod failure;
pub(crate) mod files;
mod json;
mod models;
mod node;
mod parameters;
mod toml;

use std::collections::{BTreeMap, HashSet};
use std::ops::Range;

use raywright_core::Scene;
use raywright_core::fault::Fault;
use raywright_core::scene::FORMAT;
use raywright_core::validate::validate;
use serde::Deserialize;

pub(crate) use node::ModelEntries;
pub use parameters::ParameterOverrides;

use self::de::{ReadContext, ValueReader};
use self::failure::{PathStep, ReadFailure};
use self::node::{TableEntry, TextValue, ValueNode};
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::error::Error;
use crate::error_kind::ErrorKind;
use crate::limits::format_bytes;
use crate::text::strip_byte_order_mark;

/// Largest number of passes over the syntax tree of a long text, and of a text of at most
/// [`SHORT_TEXT`] bytes. A failure ends its pass if no valid value can replace the wrong value; the
/// pass may then have missed later failures.
const MAX_PASSES: [usize; 2] = [20, 200];
/// Size in bytes up to which a text is short.
const SHORT_TEXT: usize = 1 << 16;

/// Language in which a native scene file is written: TOML or JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneNotation {
    /// TOML 1.1.
    Toml,
    /// JSON (RFC 8259).
    Json,
}

/// A parsed scene with its text and syntax tree. Problems that are found after parsing are located
/// in the text by the tree.
pub(crate) struct ParsedScene<'a> {
    pub scene: Scene,
    /// File name for messages.
    pub file: &'a str,
    text: &'a str,
    root: ValueNode,
    /// Positions, in the scene's lists, of the entries that come from model files.
    pub model_entries: Vec<ModelEntries>,
}

impl ParsedScene<'_> {
    /// Creates an error at the position of the value at a path such as `meshes[2].source.file`.
    pub fn error_at(&self, kind: ErrorKind, path: &str, message: impl Into<String>) -> Error {
        let span = node::value_span(&self.root, path);
        let problem = Diagnostic {
            message: message.into(),
            span,
            label: String::new(),
            hint: None,
        };
        Error::Scene(Diagnostics {
            kind,
            ..Diagnostics::new(self.file, self.text, vec![problem])
        })
    }

    /// Creates a warning for a problem that does not prevent a picture, with the line of the
    /// problem.
    pub fn warning_at(&self, problem: &Fault) -> Fault {
        let before = node::value_span(&self.root, &problem.path)
            .and_then(|span| self.text.get(..span.start))
            .unwrap_or_default();
        let line = before.matches('\n').count() + 1;
        problem.kind.in_file(
            self.file,
            format!("line {line}, {}: {}", problem.path, problem.message),
        )
    }
}

/// Parses and validates a scene; `file` is the name of the file in messages. Images and meshes in
/// other files are not read.
pub(crate) fn parse<'a>(
    file: &'a str,
    text: &'a str,
    notation: SceneNotation,
    overrides: &ParameterOverrides,
) -> Result<ParsedScene<'a>, Error> {
    let fail = |problems| Error::Scene(Diagnostics::new(file, text, problems));
    let mut root = parse_tree(text, notation).map_err(fail)?;
    let mut problems = check_format_version(&mut root).map_err(fail)?;
    let unnamed = problems.len();
    let names = parameters::evaluate_parameters(&mut root, text, overrides, &mut problems)?;
    colours::replace_colour_texts(&mut root, &names);
    let unread = UnreadParts::from_parameters(&problems[unnamed..], &names);
    let (scene, unread) = deserialize_scene(&mut root, text, &names, unread, &mut problems);
    let found: Vec<_> = (scene.iter().flat_map(validate))
        .map(|problem| node::diagnostic_from_problem(&root, text, problem))
        .filter(|problem| !unread.affects(problem, text))
        .collect();
    problems.extend(found);
    match scene {
        Some(scene) if problems.is_empty() => Ok(ParsedScene {
            scene,
            file,
            text,
            root,
            model_entries: Vec::new(),
        }),
        _ => Err(fail(problems)),
    }
}

/// Refuses a text whose `format` key does not have the supported value. This problem is reported
/// alone, because in another version of the format any line may be wrong. A text without the key
/// that has parts of a scene is read on; then the problem is returned.
fn check_format_version(root: &mut ValueNode) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
    let Some(entry) = root.entry("format") else {
        let hint =
            format!("a scene begins with `format = {FORMAT}`, in JSON with `\"format\": {FORMAT}`");
        let message = "this is no scene file: the key `format` is missing".to_owned();
        let problem = vec![Diagnostic {
            message,
            span: None,
            label: String::new(),
            hint: Some(hint),
        }];
        let is_part = |entry: &TableEntry| {
            matches!(
                entry.key.as_str(),
                "cameras" | "lights" | "materials" | "objects"
            )
        };
        return match &mut root.value {
            TextValue::Table(entries) if entries.iter().any(is_part) => {
                let node = ValueNode {
                    span: 0..0,
                    value: TextValue::Integer(i64::from(FORMAT)),
                };
                entries.push(TableEntry {
                    key: "format".to_owned(),
                    key_span: 0..0,
                    node,
                });
                Ok(problem)
            }
            _ => Err(problem),
        };
    };
    match entry.node.value {
        TextValue::Integer(format) if format == i64::from(FORMAT) => Ok(Vec::new()),
        _ => Err(vec![Diagnostic {
            message: format!(
                "the key `format` must be {FORMAT}, the only scene format that this program reads"
            ),
            span: Some(entry.node.span.clone()),
            label: String::new(),
            hint: None,
        }]),
    }
}

fn parse_tree(text: &str, notation: SceneNotation) -> Result<ValueNode, Vec<Diagnostic>> {
    if text.trim().is_empty() {
        let hint = Some("the smallest scene is `format = 1`".to_owned());
        let message = "the file is empty".to_owned();
        return Err(vec![Diagnostic {
            message,
            span: None,
            label: String::new(),
            hint,
        }]);
    }
    match notation {
        SceneNotation::Toml => toml::parse(text),
        SceneNotation::Json => json::parse(text),
    }
}

/// Deserializes the syntax tree as a scene, and adds the problems. If a failure ends a pass, the
/// tree is mended, and read again: a missing key gets its example, and otherwise the object,
/// material or section that contains the failure is removed. Later failures are found in this way,
/// too. Returns the scene of what could be read, and adds the rest to `unread`.
fn deserialize_scene(
    root: &mut ValueNode,
    text: &str,
    names: &BTreeMap<String, f64>,
    mut unread: UnreadParts,
    problems: &mut Vec<Diagnostic>,
) -> (Option<Scene>, UnreadParts) {
    // Each pass finds the failures of earlier passes again, and a text may have a hundred thousand
    // wrong keys: the set drops duplicates quickly.
    let mut known = HashSet::new();
    for _ in 0..MAX_PASSES[usize::from(text.len() <= SHORT_TEXT)] {
        let context = ReadContext {
            text,
            variables: names,
            failures: Default::default(),
        };
        let result = Scene::deserialize(ValueReader::from_root(root, &context));
        let noted = context.failures.into_inner().into_iter();
        for noted in noted.map(ReadFailure::into_diagnostic) {
            if known.insert(noted.clone()) {
                unread.spans.extend(noted.span.clone());
                problems.push(noted);
            }
        }
        let mut failure = match result {
            Ok(scene) => {
                let keys = unread.spans.iter().map(|span| span.start).collect();
                unread.add_texts_of_keys(root, &keys);
                return (Some(scene), unread);
            }
            Err(failure) => failure,
        };
        let span = failure.span.clone();
        let is_mended = if examples::add_example(root, text, &mut failure) {
            unread.examples.extend(span);
            true
        } else {
            unread.spans.extend(span);
            let gone = remove_at_path(root, &failure.path);
            gone.iter().for_each(|gone| unread.add_texts(gone));
            gone.is_some()
        };
        problems.push(failure.into_diagnostic());
        if !is_mended {
            break;
        }
    }
    (None, unread)
}

/// Parts of a text that could not be read, and the problems that may only follow from them.
#[derive(Default)]
struct UnreadParts {
    /// Byte ranges of the problems, but of missing keys.
    spans: Vec<Range<usize>>,
    /// Byte ranges of tables with examples of missing keys, which stand for the examples.
    examples: Vec<Range<usize>>,
    /// Texts of the parts, such as names of materials, and names of parameters without value.
    texts: HashSet<String>,
}

impl UnreadParts {
    /// Starts with the parameters, whose values are unknown after a problem of one of them.
    fn from_parameters(problems: &[Diagnostic], names: &BTreeMap<String, f64>) -> Self {
        let mut unread = Self::default();
        if !problems.is_empty() {
            unread.texts.extend(names.keys().cloned());
        }
        unread
    }

    /// Adds the texts of a value.
    fn add_texts(&mut self, node: &ValueNode) {
        match &node.value {
            TextValue::Text(text) => _ = self.texts.insert(text.clone()),
            TextValue::Array(items) => items.iter().for_each(|item| self.add_texts(item)),
            TextValue::Table(entries) => {
                entries.iter().for_each(|entry| self.add_texts(&entry.node));
            }
            _ => {}
        }
    }

    /// Adds the texts of all values whose keys begin at one of these places: values that were not
    /// read, since there is a problem of the key.
    fn add_texts_of_keys(&mut self, node: &ValueNode, keys: &HashSet<usize>) {
        match &node.value {
            TextValue::Array(items) => {
                (items.iter()).for_each(|item| self.add_texts_of_keys(item, keys));
            }
            TextValue::Table(entries) => {
                for entry in entries {
                    match keys.contains(&entry.key_span.start) {
                        true => self.add_texts(&entry.node),
                        false => self.add_texts_of_keys(&entry.node, keys),
                    }
                }
            }
            _ => {}
        }
    }

    /// Whether a problem may only follow from a part that was not read: it lies at one, or it or
    /// the value where it lies mentions a text of one.
    fn affects(&self, problem: &Diagnostic, text: &str) -> bool {
        let Some(place) = &problem.span else {
            return !(self.spans.is_empty() && self.examples.is_empty());
        };
        let is_near = |span: &Range<usize>| span.start < place.end && place.start < span.end;
        let value = text.get(place.clone()).unwrap_or_default();
        let is_part = |c: char| c.is_alphanumeric() || c == '_';
        let mut words = (problem.message.split('`')).chain(value.split(|c| !is_part(c)));
        self.spans.iter().any(is_near)
            || self.examples.contains(place)
            || words.any(|word| self.texts.contains(word))
    }
}

/// Removes from the tree the top-level value, or the element of a top-level array, that contains
/// the value at `path`. Returns what was removed.
fn remove_at_path(root: &mut ValueNode, path: &[PathStep]) -> Option<ValueNode> {
    let mut down = path.iter().rev();
    let (Some(PathStep::Key(key)), TextValue::Table(entries)) = (down.next(), &mut root.value)
    else {
        return None;
    };
    let position = entries.iter().position(|entry| entry.key == *key)?;
    Some(match (&mut entries[position].node.value, down.next()) {
        (TextValue::Array(items), Some(PathStep::Index(index))) if *index < items.len() => {
            items.remove(*index)
        }
        _ => entries.remove(position).node,
    })
}

/// Syntax tree of a valid text, from which the positions of values are found.
#[derive(Clone, Debug)]
pub(crate) struct SyntaxTree(ValueNode);

impl SyntaxTree {
    /// Parses a text; `None` for a syntax error.
    pub fn new(text: &str, notation: SceneNotation) -> Option<Self> {
        parse_tree(text, notation).ok().map(Self)
    }

    /// Returns the byte range of the deepest value on a path that exists in the text; `None` if
    /// only the root exists.
    pub fn span(&self, path: &str) -> Option<std::ops::Range<usize>> {
        node::value_span(&self.0, path)
    }
}

/// Decodes the bytes of a scene file as UTF-8, without a byte order mark.
pub(crate) fn decode_utf8(file: &str, mut bytes: Vec<u8>, limit: u64) -> Result<String, Error> {
    if bytes.len() as u64 > limit {
        let message = format!(
            "the scene is larger than the limit of {}",
            format_bytes(limit)
        );
        let hint = "put large meshes into OBJ, glTF or GLB files and name them in the scene";
        return Err(Error::over_limit(file, message).with_hint(hint));
    }
    bytes.drain(..bytes.len() - strip_byte_order_mark(&bytes).len());
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let lines = error.as_bytes()[..valid].split(|byte| *byte == b'\n');
        let (line, rest) = lines.enumerate().last().unwrap_or_default();
        let column = String::from_utf8_lossy(rest).chars().count() + 1;
        let message = format!("line {}, column {column}: this is not UTF-8 text", line + 1);
        Error::invalid_input(file, message).with_hint("save the file with the encoding UTF-8")
    })
}

/// Returns the title of a scene in TOML; empty for a scene without a title.
pub(crate) fn read_title(text: &str) -> String {
    let root = toml::parse(text).ok();
    match root
        .as_ref()
        .and_then(|root| root.get("title"))
        .map(|node| &node.value)
    {
        Some(TextValue::Text(title)) => title.clone(),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests;
