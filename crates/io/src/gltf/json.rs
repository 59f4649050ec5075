//! Rewriting of JSON that is valid glTF but does not fit typed data. Four things are rewritten:
//! - integers with a decimal point or an exponent (glTF 2.0, section 2.7);
//! - lists with too many numbers, of which the first apply;
//! - repeated names in an object, of which the last applies;
//! - numbers beyond f64, which some programs write for infinity.
//!
//! Only a text that failed to parse is rewritten; other files cost no time. A rewritten number or
//! name keeps its length unless the new text is longer. Therefore lines and columns in messages
//! match the file.

use std::collections::HashMap;
use std::ops::Range;

use super::extensions::find_property;
use crate::import::sanitise_text;

/// Largest magnitude up to which f64 represents every integer: 2⁵³.
const MOST_WHOLE: f64 = 9_007_199_254_740_992.0;

/// Largest nesting depth of accepted JSON.
const MOST_DEPTH: usize = 128;

/// Returns the length of the list of numbers that glTF and its supported extensions store under a
/// key. `object` is the key of the object that contains the list; elements of a list, such as nodes
/// and materials, have no key.
pub(super) fn list_length(key: &str, object: Option<&str>) -> Option<usize> {
    match (key, object) {
        ("offset" | "scale", Some("KHR_texture_transform")) => Some(2),
        ("color" | "scale" | "translation", None) => Some(3),
        ("rotation", None) => Some(4),
        ("matrix", None) => Some(16),
        _ => find_property(object.unwrap_or_default(), key)
            .map(|(_, property)| property.length())
            .filter(|length| *length > 1),
    }
}

/// Repairs of one kind: their number, and a description of the first.
#[derive(Debug, Default)]
struct Repairs {
    count: usize,
    first: Option<String>,
}

impl Repairs {
    fn add(&mut self, describe: impl FnOnce() -> String) {
        self.count += 1;
        self.first.get_or_insert_with(describe);
    }

    /// Returns the warning about the repairs; `None` without repairs.
    fn warning(&self, noun: &str, outcome: &str) -> Option<String> {
        let first = self.first.as_ref()?;
        let many = match self.count {
            1 => String::new(),
            count => format!(" (one of {count} {noun})"),
        };
        Some(format!("{first}{many}: {outcome}"))
    }
}

/// A rewritten JSON text, which typed data can be parsed from.
#[derive(Debug, Default)]
pub(super) struct RewrittenJson {
    pub text: Vec<u8>,
    /// Members that were dropped, because a later member of the same object has the same name.
    repeated_names: Repairs,
    /// Lists from which numbers were dropped.
    long_lists: Repairs,
    is_changed: bool,
}

impl RewrittenJson {
    /// Returns the warnings about repeated names and long lists.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let names = self
            .repeated_names
            .warning("repeated keys", "the last value is used");
        let lists = self
            .long_lists
            .warning("such lists", "the first numbers are used");
        names.into_iter().chain(lists)
    }
}

/// An object or array whose closing bracket is not read yet.
#[derive(Default)]
struct OpenBracket {
    is_object: bool,
    /// Byte ranges of an object's members in the rewritten text, by name. A range extends from the
    /// name to the comma inclusive.
    members: HashMap<String, [usize; 2]>,
    /// Name of the current member; `None` before the name is read.
    name: Option<String>,
    /// Number of commas so far, which is the index of an array's current element.
    commas: usize,
    /// Number of elements that an array may have; `None`: any number.
    length: Option<usize>,
    /// Position of the comma after the last permitted element.
    surplus: Option<usize>,
}

impl OpenBracket {
    /// Starts the array that is the value of the current member of the innermost open bracket.
    fn start_array(open: &[Self]) -> Self {
        let name = |depth: usize| open.iter().rev().nth(depth)?.name.as_deref();
        Self {
            length: name(0).and_then(|key| list_length(key, name(1))),
            ..Self::default()
        }
    }
}

/// Rewrites a JSON text. Returns `None` if nothing changes, or beyond the nesting limit.
pub(super) fn rewrite_json(text: &[u8]) -> Option<RewrittenJson> {
    let (out, _) = scan_json(text)?;
    out.is_changed.then_some(out)
}

/// Rewrites a JSON text or its beginning, and returns the brackets that are open at its end. `None`
/// beyond the nesting limit.
fn scan_json(text: &[u8]) -> Option<(RewrittenJson, Vec<OpenBracket>)> {
    let (mut out, mut open) = (
        RewrittenJson {
            text: Vec::with_capacity(text.len()),
            ..RewrittenJson::default()
        },
        Vec::<OpenBracket>::new(),
    );
    let (mut position, mut line) = (0, 1);
    while let Some(&byte) = text.get(position) {
        let length = match byte {
            b'"' => string_length(&text[position..]),
            b'-' | b'0'..=b'9' => text[position..]
                .iter()
                .take_while(|byte| is_number_byte(**byte))
                .count(),
            _ => 1,
        };
        let token = &text[position..position + length];
        match byte {
            b'"' => {
                // A string in an object is a member's name if the current member has no name yet.
                if let Some(holder) = open
                    .last_mut()
                    .filter(|holder| holder.is_object && holder.name.is_none())
                {
                    out.record_member_name(holder, token, line);
                }
                out.text.extend_from_slice(token);
            }
            b'-' | b'0'..=b'9' => out.rewrite_number(token),
            _ => {
                line += usize::from(byte == b'\n');
                out.text.push(byte);
                match byte {
                    b'{' | b'[' if open.len() == MOST_DEPTH => return None,
                    b'{' => open.push(OpenBracket {
                        is_object: true,
                        ..OpenBracket::default()
                    }),
                    b'[' => open.push(OpenBracket::start_array(&open)),
                    b'}' | b']' => {
                        if let Some(start) = open.pop().and_then(|ended| ended.surplus) {
                            out.drop_surplus(start, &open);
                        }
                    }
                    b',' => out.end_member(open.last_mut()),
                    _ => {}
                }
            }
        }
        position += length;
    }
    Some((out, open))
}

impl RewrittenJson {
    /// Records the name of a member, and overwrites an earlier member of the same name with spaces.
    fn record_member_name(&mut self, holder: &mut OpenBracket, token: &[u8], line: usize) {
        let name = decode_string(token);
        let start = self.text.len();
        if let Some([from, to]) = holder.members.insert(name.clone(), [start; 2]) {
            self.overwrite(from..to);
            self.repeated_names.add(|| {
                let name = sanitise_text(&name);
                format!("the key `{name}` is repeated in an object, in line {line}")
            });
        }
        holder.name = Some(name);
    }

    /// Overwrites a range of the text with spaces.
    fn overwrite(&mut self, range: Range<usize>) {
        self.text[range]
            .iter_mut()
            .filter(|byte| !byte.is_ascii_whitespace())
            .for_each(|byte| *byte = b' ');
        self.is_changed = true;
    }

    /// Drops the elements of a long list, whose closing bracket was read last. `start` is the
    /// position of the comma before these elements. Data of applications are left unchanged.
    fn drop_surplus(&mut self, start: usize, open: &[OpenBracket]) {
        let end = self.text.len() - 1;
        let has_elements = !self.text[start + 1..end].trim_ascii().is_empty();
        let holders = || open.iter().filter_map(|holder| holder.name.as_deref());
        if has_elements && holders().all(|name| name != "extras") {
            self.overwrite(start..end);
            self.long_lists.add(|| {
                let path = sanitise_text(&format_path(open));
                format!("{path}: has more numbers than glTF defines")
            });
        }
    }

    /// Ends the current member of an object or element of an array, at the comma after it.
    fn end_member(&mut self, holder: Option<&mut OpenBracket>) {
        let Some(holder) = holder else { return };
        holder.commas += 1;
        if holder.length == Some(holder.commas) {
            holder.surplus = Some(self.text.len() - 1);
        }
        let member = holder
            .name
            .take()
            .and_then(|name| holder.members.get_mut(&name));
        if let Some([_, end]) = member {
            *end = self.text.len();
        }
    }

    fn rewrite_number(&mut self, token: &[u8]) {
        let value = std::str::from_utf8(token)
            .ok()
            .and_then(|text| text.parse::<f64>().ok());
        let written = match value {
            Some(value) if value.is_infinite() => {
                Some(if value > 0.0 { "1e308" } else { "-1e308" }.to_owned())
            }
            Some(value) if token.iter().any(|byte| matches!(byte, b'.' | b'e' | b'E')) => {
                let whole = value.fract() == 0.0
                    && value.abs() <= MOST_WHOLE
                    && (value != 0.0 || value.is_sign_positive());
                whole.then(|| format!("{value:.0}"))
            }
            _ => None,
        };
        let start = self.text.len();
        self.text
            .extend_from_slice(written.as_ref().map_or(token, String::as_bytes));
        self.is_changed |= written.is_some();
        self.text
            .resize(self.text.len().max(start + token.len()), b' ');
    }
}

fn is_number_byte(byte: u8) -> bool {
    byte.is_ascii_digit() || matches!(byte, b'-' | b'+' | b'.' | b'e' | b'E')
}

/// Returns the length in bytes of the quoted string at the start of a text. A string without a
/// closing quote extends to the end of the text.
fn string_length(text: &[u8]) -> usize {
    let mut position = 1;
    while let Some(skip) = text
        .get(position..)
        .and_then(|rest| rest.iter().position(|byte| matches!(byte, b'"' | b'\\')))
    {
        position += skip;
        if text[position] == b'"' {
            return position + 1;
        }
        position += 2;
    }
    text.len()
}

/// Returns the path, such as `meshes[2].name`, of the JSON value at which a parser stopped: the
/// value parsed last, or the next value. `line` and `column` count from 1; columns are in bytes.
///
/// The path is computed only after a failure, so that parsing need not track paths.
pub(super) fn json_path_at(text: &[u8], line: usize, column: usize) -> String {
    let lines: usize = text
        .split_inclusive(|byte| *byte == b'\n')
        .take(line.saturating_sub(1))
        .map(<[u8]>::len)
        .sum();
    let text = &text[..text.len().min(lines + column)];
    scan_json(text).map_or(String::new(), |(_, open)| format_path(&open))
}

/// Formats the path of the current entry of the innermost open bracket.
fn format_path(open: &[OpenBracket]) -> String {
    let mut path = String::new();
    for entry in open {
        match &entry.name {
            Some(name) if path.is_empty() => path.clone_from(name),
            Some(name) => path.extend([".", name]),
            None if entry.is_object => {}
            None => path.push_str(&format!("[{}]", entry.commas)),
        }
    }
    path
}

/// Decodes a quoted JSON string.
fn decode_string(token: &[u8]) -> String {
    serde_json::from_slice(token).unwrap_or_else(|_| String::from_utf8_lossy(token).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Option<String> {
        rewrite_json(text.as_bytes()).map(|out| String::from_utf8(out.text).expect("UTF-8"))
    }

    /// Protects: integers are written without point or exponent, at the same length where they fit;
    /// other numbers, and strings, stay unchanged.
    #[test]
    fn whole_numbers_lose_their_points() {
        for (from, to) in [
            ("[4.0, 4e0,51.26E+2]", "[4  , 4  ,5126    ]"),
            ("[-1.0,1e3,0.0]", "[-1  ,1000,0  ]"),
            ("[1e400,-1e999]", "[1e308,-1e308]"),
            (
                r#"{"4.0":"4.0 \" 4.0","a":4.0}"#,
                r#"{"4.0":"4.0 \" 4.0","a":4  }"#,
            ),
        ] {
            assert_eq!(text(from).as_deref(), Some(to), "{from}");
        }
        for same in [
            "[4, 1.5, -0.0, 1e300, 1e-3]",
            "[1.2.3, --1, 4",
            r#"{"a":"4.0"#,
            "",
            "{}]]}",
        ] {
            assert_eq!(text(same), None, "{same}");
        }
    }

    /// Protects: the last of repeated members in an object is kept, however its name is escaped, at
    /// any depth; lines stay in place, and equal names in other objects are no repetitions.
    #[test]
    fn the_later_of_two_values_counts() {
        for (from, to) in [
            (r#"{"a":1,"b":2,"a":3}"#, r#"{      "b":2,"a":3}"#),
            (
                r#"{"a":{"c":[1,{}]},"a":"x,"}"#,
                r#"{                 "a":"x,"}"#,
            ),
            (
                r#"{"a":{"b":1,"b":2},"c":{"b":1}}"#,
                r#"{"a":{      "b":2},"c":{"b":1}}"#,
            ),
            ("{\"a\":\n1,\"\\u0061\":2}", "{    \n  \"\\u0061\":2}"),
            (r#"{"a":1,"a":2,"a":3}"#, r#"{            "a":3}"#),
        ] {
            assert_eq!(text(from).as_deref(), Some(to), "{from}");
        }
        assert_eq!(text(r#"[{"a":1},{"a":1},{"a":{"a":"a"}}]"#), None);
        let warned = rewrite_json(b"{\n\"a\":1,\n\"a\":2,\"a\":3}")
            .and_then(|out| out.warnings().next())
            .expect("a warning");
        assert!(
            warned.contains("`a`")
                && warned.contains("line 3")
                && warned.contains("2 repeated keys"),
            "{warned}"
        );
    }

    /// Protects: wherever a parser stops, the path is that of the value before, or of the one after
    /// a colon, bracket or comma.
    #[test]
    fn a_stop_is_told_by_its_path() {
        let text = "{\"a\": [1,\n {\"b,\\\"\": 2, \"c\": [[], 3]}], \"d\": {}}";
        for (before, expected) in [
            ("{", ""),
            ("{\"a\":", "a"),
            ("{\"a\": [", "a[0]"),
            ("{\"a\": [1", "a[0]"),
            (" {\"b,\\\"\":", "a[1].b,\""),
            (" {\"b,\\\"\": 2", "a[1].b,\""),
            ("\"c\": [", "a[1].c[0]"),
            ("\"c\": [[]", "a[1].c[0]"),
            ("\"c\": [[], 3", "a[1].c[1]"),
            ("\"c\": [[], 3]", "a[1].c"),
            ("\"c\": [[], 3]}", "a[1]"),
            ("\"c\": [[], 3]}]", "a"),
            ("\"d\": {}", "d"),
            ("\"d\": {}}", ""),
        ] {
            let end = text.find(before).expect(before) + before.len();
            let start = text[..end].rfind('\n').map_or(0, |position| position + 1);
            assert_eq!(
                json_path_at(text.as_bytes(), 1 + usize::from(start > 0), end - start),
                expected,
                "{before}"
            );
        }
        assert_eq!(json_path_at(b"[1]", 7, 900), "");
    }

    /// Protects: rewriting takes time and memory proportional to any text: endless brackets,
    /// endless names.
    #[test]
    fn hostile_texts_end() {
        let many: String = (0..200_000).map(|i| format!("\"k{i}\":1.0,")).collect();
        assert!(rewrite_json(format!("{{{many}\"k0\":2}}").as_bytes()).is_some());
        assert!(rewrite_json(&[b"{\"a\":".repeat(200_000), b"1.0".to_vec()].concat()).is_none());
        assert!(
            rewrite_json(&[b"{\"a\":".repeat(100), b"1,\"a\":1}".repeat(100)].concat()).is_some()
        );
    }
}
