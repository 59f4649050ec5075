//! Lexer: divides the text of an expression into tokens with byte spans.

use std::ops::Range;

use super::error::{ExprError, Result};

/// Kind of a token. The parser reads the text of a name through the token's span.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Lexeme {
    Number(f64),
    Name,
    Symbol(&'static str),
    End,
}

/// A token with its span in bytes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Token {
    pub lexeme: Lexeme,
    pub span: Range<usize>,
}

/// Symbols of the language, the longest first, so that `<=` is not read as `<` and `=`.
const SYMBOLS: [&str; 23] = [
    "<=", ">=", "==", "!=", "&&", "||", "+", "-", "*", "/", "%", "^", "<", ">", "!", "?", ":", "(",
    ")", "[", "]", ",", ".",
];

/// Returns all tokens of `source`; the last token is [`Lexeme::End`].
pub(super) fn tokenize(source: &str) -> Result<Vec<Token>> {
    let mut tokens = Vec::new();
    let mut position = 0;
    while let Some(rest) = source.get(position..) {
        let Some(first) = rest.chars().next() else {
            break;
        };
        if first.is_whitespace() {
            position += first.len_utf8();
            continue;
        }
        let (lexeme, length) =
            if first.is_ascii_digit() || (first == '.' && starts_with_digit(&rest[1..])) {
                read_number(rest, position)?
            } else if first.is_ascii_alphabetic() || first == '_' {
                (
                    Lexeme::Name,
                    rest.find(|c: char| !is_name_character(c))
                        .unwrap_or(rest.len()),
                )
            } else if rest.starts_with("**") {
                return Err(
                    ExprError::new("`**` is not an operator", position..position + 2)
                        .with_hint("a power is written `^`"),
                );
            } else if let Some(symbol) = SYMBOLS.into_iter().find(|s| rest.starts_with(s)) {
                (Lexeme::Symbol(symbol), symbol.len())
            } else {
                return Err(unexpected_character_error(first, position));
            };
        tokens.push(Token {
            lexeme,
            span: position..position + length,
        });
        position += length;
    }
    tokens.push(Token {
        lexeme: Lexeme::End,
        span: source.len()..source.len(),
    });
    Ok(tokens)
}

fn is_name_character(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

fn starts_with_digit(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_digit())
}

/// Reads a number such as `12`, `1.5`, `.5`, `2.` or `1e-3` and returns its length in bytes. An `e`
/// that no digits follow is not part of the number.
fn read_number(rest: &str, position: usize) -> Result<(Lexeme, usize)> {
    let digits = |from: usize| {
        rest[from..]
            .find(|c: char| !c.is_ascii_digit())
            .map_or(rest.len(), |n| from + n)
    };
    let mut end = digits(0);
    if rest[end..].starts_with('.') {
        end = digits(end + 1);
    }
    if rest[end..].starts_with(['e', 'E']) {
        let signed = end + 1 + usize::from(rest[end + 1..].starts_with(['+', '-']));
        if starts_with_digit(&rest[signed..]) {
            end = digits(signed);
        }
    }
    match rest[..end].parse::<f64>() {
        Ok(value) if value.is_finite() => Ok((Lexeme::Number(value), end)),
        _ => Err(ExprError::new(
            "this number is too large: the limit is about 1.8e308",
            position..position + end,
        )),
    }
}

/// Returns the error for a character that begins no token, with a hint.
fn unexpected_character_error(character: char, position: usize) -> ExprError {
    let error = ExprError::new(
        format!("unexpected character `{}`", character.escape_debug()),
        position..position + character.len_utf8(),
    );
    match character {
        '=' => error.with_hint("write `==` to compare; an expression cannot assign a value"),
        '&' => error.with_hint("write `&&` for \"and\""),
        '|' => error.with_hint("write `||` for \"or\""),
        ';' | '{' | '}' => error.with_hint("an expression is one formula, without statements"),
        '−' | '–' => error.with_hint("write the minus sign as `-`"),
        '×' | '·' => error.with_hint("write `*` to multiply"),
        _ => error,
    }
}
