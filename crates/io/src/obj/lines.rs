//! Statements of OBJ and MTL files: continued lines are joined, comments and byte order marks
//! removed, line numbers kept.

use std::borrow::Cow;

use crate::text::{is_inside_number, split_lines, strip_byte_order_mark};

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
pub(super) fn split_first_word(text: &str) -> (&str, &str) {
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
