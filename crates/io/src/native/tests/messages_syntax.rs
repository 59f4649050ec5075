//! Messages about texts that are no TOML, or no scene at all, each read from a newcomer's point of
//! view.

use super::expect_message;

/// Protects: the message for an empty file, word for word: place, cause and remedy.
#[test]
fn an_empty_file() {
    expect_message(
        "x.scene.toml",
        r#""#,
        r#"
error: x.scene.toml: the file is empty
help: the smallest scene is `format = 1`
"#,
    );
}

/// Protects: the message for no format, word for word: place, cause and remedy.
#[test]
fn message_for_no_format() {
    expect_message(
        "x.scene.toml",
        r#"title = "x"
"#,
        r#"
error: x.scene.toml: this is no scene file: the key `format` is missing
help: a scene begins with `format = 1`, in JSON with `"format": 1`
"#,
    );
}

/// Protects: the message for a later format, word for word: place, cause and remedy.
#[test]
fn a_later_format() {
    expect_message(
        "x.scene.toml",
        r#"format = 2
new_key = 1
"#,
        r#"
error: the key `format` must be 1, the only scene format that this program reads
 --> x.scene.toml:1:10
  |
1 | format = 2
  |          ^
"#,
    );
}

/// Protects: the message for a value without quotes, word for word: place, cause and remedy.
#[test]
fn a_value_without_quotes() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
title = hello
"#,
        r#"
error: not valid TOML: string values must be quoted, expected literal string
 --> x.scene.toml:2:9
  |
2 | title = hello
  |         ^^^^^
  |
  = help: write texts in quotes, but numbers, true and false without quotes
"#,
    );
}

/// Protects: the message for a number without a digit before its point, word for word: place, cause and
/// remedy.
#[test]
fn a_number_without_a_digit_before_its_point() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
title = [.5]
"#,
        r#"
error: not valid TOML: invalid mantissa, expected digits
 --> x.scene.toml:2:10
  |
2 | title = [.5]
  |          ^
  |
  = help: a number has digits before and after its point: 0.5 and 5.0, not .5 and 5.
"#,
    );
}

/// Protects: the message for text that is not closed, word for word: place, cause and remedy.
#[test]
fn text_that_is_not_closed() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
title = "hello
"#,
        r#"
error: not valid TOML: invalid basic string, expected `"`
 --> x.scene.toml:2:15
  |
2 | title = "hello
  |               ^
  |
  = help: a text must end on the line on which it starts, with the same quotation mark
"#,
    );
}

/// Protects: the message for a duplicate key, word for word: place, cause and remedy.
#[test]
fn a_duplicate_key() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
title = "a"
title = "b"
"#,
        r#"
error: not valid TOML: duplicate key
 --> x.scene.toml:3:1
  |
3 | title = "b"
  | ^^^^^
  |
  = help: a table may contain each key only once: remove or rename one of the two
"#,
    );
}

/// Protects: the message for JSON in a TOML file, word for word: place, cause and remedy.
#[test]
fn json_in_a_toml_file() {
    expect_message(
        "x.scene.toml",
        r#"{ "format": 1 }"#,
        r#"
error: not valid TOML: invalid key-value pair, expected key
 --> x.scene.toml:1:1
  |
1 | { "format": 1 }
  | ^
  |
  = help: this looks like JSON: name the file NAME.scene.json
"#,
    );
}

/// Protects: the message for a header that is not closed, word for word: place, cause and remedy.
#[test]
fn a_header_that_is_not_closed() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[render
size = [1, 1]
"#,
        r#"
error: not valid TOML: unclosed table, expected `]`
 --> x.scene.toml:2:8
  |
2 | [render
  |        ^
"#,
    );
}

/// Protects: the message for a date, word for word: place, cause and remedy.
#[test]
fn a_date() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
t = 2026-01-01
"#,
        r#"
error: `t` must be a number, or an expression in quotes, not a date
 --> x.scene.toml:2:5
  |
2 | t = 2026-01-01
  |     ^^^^^^^^^^
"#,
    );
}

/// Protects: the message for a number that is too large, word for word: place, cause and remedy.
#[test]
fn a_number_that_is_too_large() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[render]
seed = 123456789012345678901234567890
"#,
        r#"
error: this number is too large
 --> x.scene.toml:3:8
  |
3 | seed = 123456789012345678901234567890
  |        ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
  |
  = help: whole numbers go up to 18446744073709551615; numbers with a decimal point have no such limit
"#,
    );
}

/// Protects: the message for a comment in JSON, word for word: place, cause and remedy.
#[test]
fn a_comment_in_json() {
    expect_message(
        "x.scene.json",
        r#"{
  "format": 1, // one
  "t": 0
}"#,
        r#"
error: not valid JSON: comments are not allowed
 --> x.scene.json:2:16
  |
2 |   "format": 1, // one
  |                ^^^^^^
"#,
    );
}

/// Protects: the message for a last comma in JSON, word for word: place, cause and remedy.
#[test]
fn a_last_comma_in_json() {
    expect_message(
        "x.scene.json",
        r#"{ "format": 1, "t": 0, }"#,
        r#"
error: not valid JSON: trailing commas are not allowed
 --> x.scene.json:1:22
  |
1 | { "format": 1, "t": 0, }
  |                      ^
"#,
    );
}

/// Protects: the message for a duplicate key in JSON, word for word: place, cause and remedy.
#[test]
fn a_duplicate_key_in_json() {
    expect_message(
        "x.scene.json",
        r#"{ "format": 1, "t": 0, "t": 1 }"#,
        r#"
error: duplicate key `t`
 --> x.scene.json:1:24
  |
1 | { "format": 1, "t": 0, "t": 1 }
  |                        ^^^
"#,
    );
}

/// Protects: the message for half of a JSON file, word for word: place, cause and remedy.
#[test]
fn half_of_a_json_file() {
    expect_message(
        "x.scene.json",
        r#"{ "format": 1, "render": { "size": [640"#,
        r#"
error: not valid JSON: unterminated array
 --> x.scene.json:1:36
  |
1 | { "format": 1, "render": { "size": [640
  |                                    ^^^^
"#,
    );
}

/// Protects: the message for an array as a scene, word for word: place, cause and remedy.
#[test]
fn an_array_as_a_scene() {
    expect_message(
        "x.scene.json",
        r#"[1]"#,
        r#"
error: x.scene.json: this is no scene file: the key `format` is missing
help: a scene begins with `format = 1`, in JSON with `"format": 1`
"#,
    );
}

/// Protects: the message for a wrong number in JSON, word for word: place, cause and remedy.
#[test]
fn a_wrong_number_in_json() {
    expect_message(
        "x.scene.json",
        r#"{ "format": 1, "render": { "samples": 1.5, "size": [1, "t + 0.5"] } }"#,
        r#"
error: `samples` must be a whole number, not 1.5
 --> x.scene.json:1:39
  |
1 | { "format": 1, "render": { "samples": 1.5, "size": [1, "t + 0.5"] } }
  |                                       ^^^

error: `size[1]` must be a whole number, not 0.5
 --> x.scene.json:1:56
  |
1 | { "format": 1, "render": { "samples": 1.5, "size": [1, "t + 0.5"] } }
  |                                                        ^^^^^^^^^
"#,
    );
}
