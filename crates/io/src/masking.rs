//! Masking of untrusted text: names in files can contain characters that control a terminal or a
//! page. All messages, tables, reports and plots use this module.

use std::borrow::Cow;

/// Replaces each control character by the replacement character U+FFFD.
pub fn mask_control_characters(text: &str) -> Cow<'_, str> {
    replace_control_characters(text, |_, out| out.push(char::REPLACEMENT_CHARACTER))
}

/// Replaces control characters, line breaks and tabs by U+FFFD, for one-line messages.
pub fn mask_to_one_line(text: &str) -> String {
    mask_control_characters(&text.replace(['\n', '\t'], "\u{fffd}")).into_owned()
}

/// Replaces control characters in JSON by `\u` escapes, so that a parser of the JSON gets the
/// original texts. Only strings are affected, because JSON outside strings is ASCII.
pub fn escape_controls_in_json(json: &str) -> Cow<'_, str> {
    replace_control_characters(json, |c, out| {
        c.encode_utf16(&mut [0; 2])
            .iter()
            .for_each(|unit| *out += &format!("\\u{unit:04x}"))
    })
}

/// Calls `put` for each control character; `put` appends the replacement to the new text.
fn replace_control_characters(text: &str, put: impl Fn(char, &mut String)) -> Cow<'_, str> {
    if !text.chars().any(is_terminal_control) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    text.chars().for_each(|c| {
        if is_terminal_control(c) {
            put(c, &mut out)
        } else {
            out.push(c)
        }
    });
    Cow::Owned(out)
}

/// Whether a character controls the display. Such characters are:
/// - control characters except line breaks and tabs;
/// - line and paragraph separators;
/// - Unicode's format characters, which reverse or hide text.
///
/// Exceptions are the joiners (U+200C, U+200D), required by some scripts, and visible signs (such
/// as U+0600, the Arabic number sign).
fn is_terminal_control(c: char) -> bool {
    match c {
        '\n' | '\t' => false,
        '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}' | '\u{200e}' | '\u{200f}' | '\u{feff}' => {
            true
        }
        '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{fff9}'..='\u{fffb}' => true,
        '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}' | '\u{e0000}'..='\u{e007f}' => true,
        c => c.is_control(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: no control character of a name is displayed, and every other character is.
    #[test]
    fn what_steers_is_masked() {
        let name = "\u{1b}[31mré\u{9b}2J\u{7f}\u{7}\r\u{202e}d\u{2066}\n\t世";
        assert_eq!(
            mask_control_characters(name),
            "�[31mré�2J���\u{fffd}d�\n\t世"
        );
        assert_eq!(mask_to_one_line("a\nb\u{1b}"), "a�b�");
        for c in "\0\u{85}\u{ad}\u{61c}\u{180e}\u{200b}\u{200e}\u{2028}\u{2029}\u{202a}\u{2060}\u{2064}\u{2069}\u{206a}\u{feff}\u{fffa}\u{1d173}\u{e0041}".chars() {
            assert_eq!(mask_control_characters(&format!("a{c}b")), "a\u{fffd}b", "{:x}", u32::from(c));
        }
        for shown in ["plain, été\n", "می\u{200c}شود", "👩\u{200d}🚀", "\u{600}١"] {
            assert!(
                matches!(mask_control_characters(shown), Cow::Borrowed(_)),
                "{shown}"
            );
        }
    }

    /// Protects: JSON keeps names unchanged, with control characters as escapes, beyond 16 bits as
    /// surrogate pairs.
    #[test]
    fn json_has_codes() {
        let name = "\u{1b}[31m\u{9b}2J\u{7f}\r\n\u{202e}é\u{2028}\u{e0041}";
        let text = serde_json::to_string(name).unwrap();
        let text = escape_controls_in_json(&text);
        assert_eq!(mask_control_characters(&text), text);
        assert_eq!(serde_json::from_str::<String>(&text).unwrap(), name);
    }
}
