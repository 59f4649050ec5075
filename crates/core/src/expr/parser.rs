//! Parser of the language by recursive descent. Nested source becomes nested calls here and nowhere
//! else, so the parser limits the nesting depth.
//!
//! ```text
//! expression = or [ "?" expression ":" expression ]
//! or, and, comparison, sum, product: left-associative, binding tighter in this order; comparisons do not chain
//! prefix     = { "-" | "+" | "!" } power
//! power      = postfix [ "^" prefix ]                               right-associative: -x^2 is -(x^2)
//! postfix    = primary { "." component }
//! primary    = number | name | name "(" … ")" | "(" … ")" | "[" x "," y "," z "]"
//! ```

use std::ops::Range;

use super::build::{GraphBuilder, SourceTerm};
use super::function::Operation;
use super::scope::{ExprError, Result};
use super::{MAX_DEPTH, MAX_SOURCE_BYTES};

/// State of the parser: the tokens, the position among them, and the builder of the graph.
pub(super) struct Parser<'s, 'n> {
    source: &'s str,
    tokens: Vec<Token>,
    position: usize,
    depth: usize,
    builder: GraphBuilder<'n>,
}

/// Parses a complete expression. The span of an error is the place where parsing failed.
pub(super) fn parse<'n>(
    source: &str,
    builder: GraphBuilder<'n>,
) -> Result<(GraphBuilder<'n>, SourceTerm)> {
    if source.len() > MAX_SOURCE_BYTES {
        let message = format!(
            "this expression has {} bytes, but at most {MAX_SOURCE_BYTES} are allowed; shorten the expression",
            source.len()
        );
        return Err(ExprError::new(message, 0..source.len()));
    }
    let mut parser = Parser {
        source,
        tokens: tokenize(source)?,
        position: 0,
        depth: 0,
        builder,
    };
    if parser.peek() == Lexeme::End {
        return Err(ExprError::new("this expression is empty", 0..source.len()));
    }
    let term = parser.parse_expression()?;
    match parser.peek() {
        Lexeme::End => Ok((parser.builder, term)),
        _ => Err(parser.unexpected_token_error()),
    }
}

/// Precedence of comparisons.
const COMPARISON: u8 = 2;

/// Returns the binary operator of a symbol, and its precedence.
fn binary_operator(lexeme: Lexeme) -> Option<(Operation, u8)> {
    use Operation::*;
    let Lexeme::Symbol(symbol) = lexeme else {
        return None;
    };
    Some(match symbol {
        "||" => (Or, 0),
        "&&" => (And, 1),
        "<" => (Less, COMPARISON),
        "<=" => (LessOrEqual, COMPARISON),
        ">" => (Greater, COMPARISON),
        ">=" => (GreaterOrEqual, COMPARISON),
        "==" => (Equal, COMPARISON),
        "!=" => (NotEqual, COMPARISON),
        "+" => (Add, 3),
        "-" => (Subtract, 3),
        "*" => (Multiply, 4),
        "/" => (Divide, 4),
        "%" => (Modulo, 4),
        _ => return None,
    })
}

impl Parser<'_, '_> {
    fn current_token(&self) -> Token {
        let end = self.source.len();
        self.tokens.get(self.position).cloned().unwrap_or(Token {
            lexeme: Lexeme::End,
            span: end..end,
        })
    }

    fn peek(&self) -> Lexeme {
        self.current_token().lexeme
    }

    fn next_token(&mut self) -> Token {
        let token = self.current_token();
        self.position += 1;
        token
    }

    /// Consumes the next token if it is the given symbol; returns whether it was.
    fn take_symbol(&mut self, symbol: &str) -> bool {
        let found = matches!(self.peek(), Lexeme::Symbol(s) if s == symbol);
        self.position += usize::from(found);
        found
    }

    /// Consumes the closing `symbol` and returns the byte position of its end. `open` is the place
    /// of the opening symbol, for the error message.
    fn expect_closing(&mut self, symbol: &str, open: &Range<usize>) -> Result<usize> {
        let token = self.current_token();
        if self.take_symbol(symbol) {
            return Ok(token.span.end);
        }
        if token.lexeme == Lexeme::End {
            let opener = &self.source[open.clone()];
            return Err(ExprError::new(
                format!("`{opener}` has no matching closing bracket"),
                open.clone(),
            )
            .with_hint(format!("add `{symbol}`")));
        }
        Err(self.unexpected_token_error())
    }

    /// Returns the error for a token that cannot follow a complete value.
    fn unexpected_token_error(&self) -> ExprError {
        let token = self.current_token();
        let text = &self.source[token.span.clone()];
        let touching = self.position > 0
            && self
                .tokens
                .get(self.position - 1)
                .is_some_and(|t| matches!(t.lexeme, Lexeme::Number(_)));
        match token.lexeme {
            Lexeme::Symbol(")" | "]") => ExprError::new(
                format!("`{text}` has no matching opening bracket"),
                token.span,
            ),
            Lexeme::Symbol(",") => ExprError::new(
                "a comma may only separate arguments of a function or components of a vector",
                token.span,
            ),
            Lexeme::Name if touching => ExprError::new(
                format!("an operator is missing before `{text}`"),
                token.span,
            )
            .with_hint("multiplication is written `*`"),
            _ => ExprError::new(
                format!("expected an operator or the end of the expression, found `{text}`"),
                token.span,
            ),
        }
    }

    /// Runs a parsing function one level deeper, and checks the nesting depth.
    fn parse_nested<T>(&mut self, inner: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        if self.depth == MAX_DEPTH {
            let message = format!(
                "this expression is nested more than {MAX_DEPTH} levels deep; remove parentheses or divide it"
            );
            return Err(ExprError::new(message, self.current_token().span));
        }
        self.depth += 1;
        let result = inner(self);
        self.depth -= 1;
        result
    }

    /// Parses a value or a condition `a ? b : c`.
    fn parse_expression(&mut self) -> Result<SourceTerm> {
        let condition = self.parse_operators(0)?;
        let mark = self.current_token().span;
        if !self.take_symbol("?") {
            return Ok(condition);
        }
        let then = self.parse_nested(Self::parse_expression)?;
        if !self.take_symbol(":") {
            let error = ExprError::new("`?` has no matching `:`", mark);
            return Err(error.with_hint("a choice is written `condition ? a : b`"));
        }
        let other = self.parse_nested(Self::parse_expression)?;
        let id = self.builder.add_select(&condition, &then, &other)?;
        Ok(SourceTerm {
            id,
            span: condition.span.start..other.span.end,
        })
    }

    /// Parses values joined by binary operators whose precedence is at least `level`.
    fn parse_operators(&mut self, level: u8) -> Result<SourceTerm> {
        let mut left = self.parse_prefix()?;
        let mut compared = false;
        while let Some((op, its_level)) = binary_operator(self.peek())
            && its_level >= level
        {
            if its_level == COMPARISON && compared {
                let error =
                    ExprError::new("comparisons cannot be chained", self.current_token().span);
                return Err(error.with_hint("write `a < b && b < c`"));
            }
            compared = its_level == COMPARISON;
            self.position += 1;
            let right = self.parse_operators(its_level + 1)?;
            let id = self.builder.apply_binary(op, &left, &right)?;
            left = SourceTerm {
                id,
                span: left.span.start..right.span.end,
            };
        }
        Ok(left)
    }

    fn parse_prefix(&mut self) -> Result<SourceTerm> {
        let token = self.current_token();
        let op = match token.lexeme {
            Lexeme::Symbol("-") => Some(Operation::Negate),
            Lexeme::Symbol("!") => Some(Operation::Not),
            Lexeme::Symbol("+") => None,
            _ => return self.parse_power(),
        };
        self.position += 1;
        let operand = self.parse_nested(Self::parse_prefix)?;
        let id = match op {
            Some(op) => self.builder.apply_unary(op, &operand)?,
            None => operand.id,
        };
        Ok(SourceTerm {
            id,
            span: token.span.start..operand.span.end,
        })
    }

    fn parse_power(&mut self) -> Result<SourceTerm> {
        let base = self.parse_postfix()?;
        if !self.take_symbol("^") {
            return Ok(base);
        }
        let exponent = self.parse_nested(Self::parse_prefix)?;
        let id = self
            .builder
            .apply_binary(Operation::Power, &base, &exponent)?;
        Ok(SourceTerm {
            id,
            span: base.span.start..exponent.span.end,
        })
    }

    /// Parses a simple value and the components taken of it, as in `p.x`.
    fn parse_postfix(&mut self) -> Result<SourceTerm> {
        let mut term = self.parse_primary()?;
        while self.take_symbol(".") {
            let token = self.next_token();
            if token.lexeme != Lexeme::Name {
                return Err(ExprError::new(
                    "expected a component such as `x` after `.`",
                    token.span,
                ));
            }
            let (start, end) = (term.span.start, token.span.end);
            let id = self.builder.add_vector_component(
                term,
                &self.source[token.span.clone()],
                token.span,
            )?;
            term = SourceTerm {
                id,
                span: start..end,
            };
        }
        Ok(term)
    }

    /// Parses a number, a name, a call, an expression in parentheses, or a vector in brackets.
    fn parse_primary(&mut self) -> Result<SourceTerm> {
        let token = self.next_token();
        let span = token.span.clone();
        match token.lexeme {
            Lexeme::Number(value) => Ok(SourceTerm {
                id: self.builder.graph.add_number(value),
                span,
            }),
            Lexeme::Name if matches!(self.peek(), Lexeme::Symbol("(")) => self.parse_call(span),
            Lexeme::Name => Ok(SourceTerm {
                id: self
                    .builder
                    .resolve_name(&self.source[span.clone()], span.clone())?,
                span,
            }),
            Lexeme::Symbol("(") => {
                let inner = self.parse_nested(Self::parse_expression)?;
                let end = self.expect_closing(")", &span)?;
                Ok(SourceTerm {
                    id: inner.id,
                    span: span.start..end,
                })
            }
            Lexeme::Symbol("[") => {
                let (parts, end) = self.parse_list("]", &span)?;
                let whole = span.start..end;
                if parts.len() != 3 {
                    let message = format!("a vector has three components, not {}", parts.len());
                    return Err(ExprError::new(message, whole));
                }
                Ok(SourceTerm {
                    id: self.builder.compose_vector(&parts)?,
                    span: whole,
                })
            }
            Lexeme::End => {
                let error = ExprError::new("the expression ends where a value is expected", span);
                Err(error.with_hint(
                    "a value is a number, a name, a function call, an expression in parentheses or a vector in brackets",
                ))
            }
            Lexeme::Symbol(symbol) => Err(ExprError::new(
                format!("expected a value, found `{symbol}`"),
                span,
            )),
        }
    }

    fn parse_call(&mut self, name: Range<usize>) -> Result<SourceTerm> {
        let open = self.next_token().span;
        let (arguments, end) = self.parse_list(")", &open)?;
        let whole = name.start..end;
        let id = self.builder.call_function(
            &self.source[name.clone()],
            name,
            &arguments,
            whole.clone(),
        )?;
        Ok(SourceTerm { id, span: whole })
    }

    /// Parses expressions separated by commas, up to the closing symbol. Returns the expressions
    /// and the byte position of the symbol's end.
    fn parse_list(&mut self, close: &str, open: &Range<usize>) -> Result<(Vec<SourceTerm>, usize)> {
        let end = self.current_token().span.end;
        if self.take_symbol(close) {
            return Ok((Vec::new(), end));
        }
        let mut terms = Vec::new();
        loop {
            terms.push(self.parse_nested(Self::parse_expression)?);
            if !self.take_symbol(",") {
                return Ok((terms, self.expect_closing(close, open)?));
            }
        }
    }
}

// Lexer: divides the text of an expression into tokens with byte spans.

/// Kind of a token. The parser reads the text of a name through the token's span.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Lexeme {
    Number(f64),
    Name,
    Symbol(&'static str),
    End,
}

/// A token with its span in bytes.
#[derive(Clone, Debug, PartialEq)]
struct Token {
    pub lexeme: Lexeme,
    pub span: Range<usize>,
}

/// Symbols of the language, the longest first, so that `<=` is not read as `<` and `=`.
const SYMBOLS: [&str; 23] = [
    "<=", ">=", "==", "!=", "&&", "||", "+", "-", "*", "/", "%", "^", "<", ">", "!", "?", ":", "(",
    ")", "[", "]", ",", ".",
];

/// Returns all tokens of `source`; the last token is [`Lexeme::End`].
fn tokenize(source: &str) -> Result<Vec<Token>> {
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
