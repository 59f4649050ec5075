//! OBJ and MTL text as statements: continued lines joined, comments and byte order marks gone, line numbers kept.

use std::borrow::Cow;

use crate::import::{Fault, Outcome, shown};

/// A statement of an OBJ or MTL file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Statement<'a> {
    /// Line where it begins, from 1.
    pub line: usize,
    /// First word.
    pub keyword: &'a str,
    /// Everything behind it, without blanks at its ends.
    pub rest: &'a str,
}

/// The text of a file, with every line that ends in `\` joined to the next. Names in other encodings than UTF-8 become
/// unreadable, not the file: its numbers are ASCII.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    if !text.lines().any(|line| line.ends_with('\\')) {
        return text;
    }
    let mut out = String::with_capacity(text.len());
    let mut owed = 0;
    for line in text.lines() {
        match line.strip_suffix('\\') {
            Some(begun) => {
                out.push_str(begun);
                out.push(' ');
                owed += 1;
            }
            None => {
                out.push_str(line);
                // The lines that were joined are made up for, so that the numbers of the following ones stay.
                out.extend(std::iter::repeat_n('\n', owed + 1));
                owed = 0;
            }
        }
    }
    Cow::Owned(out)
}

/// Refuses what is no text of ASCII statements: a text of two bytes a character, or no text.
///
/// # Errors
/// A fault of kind input that names what the file is.
pub(super) fn refuse_foreign(bytes: &[u8]) -> Outcome<()> {
    let head = bytes.get(..bytes.len().min(4096)).unwrap_or_default();
    let paired = |odd: usize| head.len() > 3 && head.iter().skip(odd).step_by(2).all(|&byte| byte == 0);
    if head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff") || paired(0) || paired(1) {
        return Err(Fault::input("is UTF-16 text; OBJ files are read as ASCII or UTF-8, so convert it (iconv -t UTF-8)"));
    }
    if head.contains(&0) {
        return Err(Fault::input("is a binary file and no OBJ text; of models, .obj text, .gltf and .glb are read"));
    }
    Ok(())
}

/// The statements of a decoded text.
pub(super) fn statements(text: &str) -> impl Iterator<Item = Statement<'_>> {
    text.lines().enumerate().filter_map(|(i, line)| {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        (!keyword.is_empty()).then(|| Statement { line: i + 1, keyword, rest: rest.trim() })
    })
}

/// The part of a word that is a number, and its value, as C's `strtod` finds it: files have `1.0f` and `3.1+e2`. A number with a
/// decimal comma is none: `strtod` would lose its fraction.
pub(super) fn number(word: &str) -> Option<(&str, f32)> {
    if let Ok(value) = word.parse() {
        return Some((word, value));
    }
    if has_decimal_comma(word) {
        return None;
    }
    // Bounded: a hostile word must not cost its length squared.
    let ends: Vec<usize> = word.char_indices().map(|(i, c)| i + c.len_utf8()).take(64).collect();
    ends.into_iter().rev().find_map(|end| {
        let head = word.get(..end)?;
        Some((head, head.parse().ok()?))
    })
}

/// Whether a word has a comma before a digit, as programs write numbers that heed the settings of some countries.
pub(super) fn has_decimal_comma(word: &str) -> bool {
    word.as_bytes().windows(2).any(|pair| pair[0] == b',' && pair[1].is_ascii_digit())
}

/// The fault of a word where a number should be.
pub(super) fn no_number(keyword: &str, word: &str) -> Fault {
    let remedy =
        if has_decimal_comma(word) { "; decimals have a point, so export it again with points in place of commas" } else { "" };
    Fault::input(format!("{keyword}: `{}` is no number{remedy}", shown(word)))
}

/// A path as files from other systems write it, in the form that [`Folder::read`](crate::Folder::read) takes.
pub(super) fn relative(path: &str) -> String {
    path.trim().trim_matches('"').replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What follows a continued line is part of it; comments and blank lines are nothing; `\r\n` is a line's end.
    #[test]
    fn statements_are_joined_and_stripped() {
        let text = decode(b"\xef\xbb\xbf  # x\r\nf 1 2 \\\r\n 3 # y\r\n\r\nusemtl  a b \n s\toff");
        let found: Vec<_> = statements(&text).map(|s| (s.line, s.keyword, s.rest)).collect();
        assert_eq!(found, [(2, "f", "1 2   3"), (5, "usemtl", "a b"), (6, "s", "off")]);
    }

    /// Numbers that other programs write.
    #[test]
    fn numbers_are_read_as_c_reads_them() {
        for (word, value) in [("1", 1.0), (".8e-001", 0.08), ("-.7e+02", -70.0), ("2.", 2.0), ("1.5f", 1.5), ("3.1+e2", 3.1)] {
            assert_eq!(number(word).map(|n| n.1), Some(value), "{word}");
        }
        assert_eq!(number("1,").map(|n| n.1), Some(1.0), "the comma of a list");
        for word in ["1,0", "-0,25", "1,5e3", "1.000,5", ",5"] {
            assert_eq!(number(word), None, "{word}");
        }
        assert_eq!(number("x"), None);
        assert_eq!(number(""), None);
        assert_eq!(number("é1"), None);
    }
}
