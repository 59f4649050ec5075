//! Shared parts of the text formats for models: lines, words and numbers.

use crate::import::{Fault, ImportResult, MODELS, sanitise_text};

/// Refuses input other than ASCII-based text: UTF-16 or binary data.
///
/// # Errors
/// A fault of kind input that names the detected content.
pub(crate) fn refuse_non_text(bytes: &[u8]) -> ImportResult<()> {
    let head = bytes.get(..bytes.len().min(4096)).unwrap_or_default();
    let paired =
        |odd: usize| head.len() > 3 && head.iter().skip(odd).step_by(2).all(|&byte| byte == 0);
    if head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff") || paired(0) || paired(1) {
        return Err(fault!(
            "is UTF-16 text; models are read as ASCII or UTF-8, so convert the file (iconv -f UTF-16 -t UTF-8)"
        ));
    }
    if head.contains(&0) {
        return Err(fault!(
            "is a binary file, not OBJ text; models are read from {MODELS} files"
        ));
    }
    Ok(())
}

/// Removes the UTF-8 byte order mark that some editors write.
pub(crate) fn strip_byte_order_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Splits a text into lines, which may end in a line feed, a carriage return or both.
pub(crate) fn split_lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = Some(bytes);
    std::iter::from_fn(move || {
        let text = rest?;
        let Some(length) = text.iter().position(|byte| matches!(byte, b'\r' | b'\n')) else {
            return rest.take();
        };
        let (line, end) = text.split_at(length);
        rest = end.strip_prefix(b"\r\n").or_else(|| end.get(1..));
        Some(line)
    })
}

/// Parses the longest prefix of a word that is a number, as C's `strtod` does, because files
/// contain `1.0f` and `3.1+e2`. Returns the prefix and its value. A number with a decimal comma is
/// refused, because its fraction would be lost. `-1.#IND`, `1.#QNAN` and `1.#INF`, by which old C
/// libraries write numbers that are not finite, are NaN.
pub(crate) fn parse_number_prefix(word: &str) -> Option<(&str, f64)> {
    if let Ok(value) = word.parse() {
        return Some((word, value));
    }
    if let Some((head, tail)) = word.split_once('#')
        && is_inside_number(head, tail)
    {
        return Some(("nan", f64::NAN));
    }
    if has_decimal_comma(word) {
        return None;
    }
    // The length of the prefix is bounded, so that the time is not quadratic in the length of a
    // malicious word.
    let ends: Vec<usize> = word
        .char_indices()
        .map(|(i, c)| i + c.len_utf8())
        .take(64)
        .collect();
    ends.into_iter().rev().find_map(|end| {
        let head = word.get(..end)?;
        Some((head, head.parse().ok()?))
    })
}

/// Whether a `#` between two texts belongs to a number of an old C library, such as `1.#QNAN`.
pub(crate) fn is_inside_number(head: &str, tail: &str) -> bool {
    head.ends_with("1.") && tail.starts_with(|c: char| c.is_ascii_uppercase())
}

/// Whether a word has a comma before a digit, as programs write numbers under some locales.
pub(crate) fn has_decimal_comma(word: &str) -> bool {
    word.as_bytes()
        .windows(2)
        .any(|pair| pair[0] == b',' && pair[1].is_ascii_digit())
}

/// Creates the fault for a word that stands in place of a number.
pub(crate) fn not_a_number_fault(keyword: &str, word: &str) -> Fault {
    let remedy = if has_decimal_comma(word) {
        "; export the file again with decimal points in place of decimal commas"
    } else {
        ""
    };
    fault!("{keyword}: `{}` is no number{remedy}", sanitise_text(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: each of the three line ends separates lines, also in a mixture, and a pair counts
    /// once.
    #[test]
    fn lines_end_in_three_ways() {
        let found: Vec<&[u8]> = split_lines(b"a\rb\nc\r\n\r\nd\n\re").collect();
        assert_eq!(found, [b"a".as_slice(), b"b", b"c", b"", b"d", b"", b"e"]);
        assert_eq!(split_lines(b"").collect::<Vec<_>>(), [b""]);
        assert_eq!(
            split_lines(b"a\r").collect::<Vec<_>>(),
            [b"a".as_slice(), b""]
        );
    }

    /// Protects: numbers are parsed in the forms that other programs write.
    #[test]
    fn numbers_are_read_as_c_reads_them() {
        for (word, value) in [
            ("1", 1.0),
            (".8e-001", 0.08),
            ("-.7e+02", -70.0),
            ("2.", 2.0),
            ("1.5f", 1.5),
            ("3.1+e2", 3.1),
        ] {
            assert_eq!(
                parse_number_prefix(word).map(|n| n.1),
                Some(value),
                "{word}"
            );
        }
        assert_eq!(
            parse_number_prefix("1,").map(|n| n.1),
            Some(1.0),
            "the comma of a list"
        );
        for word in ["1,0", "-0,25", "1,5e3", "1.000,5", ",5"] {
            assert_eq!(parse_number_prefix(word), None, "{word}");
        }
        for word in ["-1.#IND00", "1.#QNAN0", "1.#INF", "-1.#J"] {
            let (text, value) = parse_number_prefix(word).expect(word);
            assert!(
                value.is_nan() && text.parse().is_ok_and(f64::is_nan),
                "{word}"
            );
        }
        assert_eq!(parse_number_prefix("2#x"), Some(("2", 2.0)));
        assert_eq!(parse_number_prefix("x"), None);
        assert_eq!(parse_number_prefix(""), None);
        assert_eq!(parse_number_prefix("é1"), None);
    }
}
