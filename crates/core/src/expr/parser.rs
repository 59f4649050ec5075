//! Parser of the language by recursive descent. It counts the nesting depth, because only here
//! nested source becomes nested calls.
//!
//! ```text
//! expression = or [ "?" expression ":" expression ]
//! or, and, comparison, sum, product: left-associative, binding tighter in this order; comparisons do not chain
//! prefix     = { "-" | "+" | "!" } power
//! power      = part [ "^" prefix ]                               right-associative: -x^2 is -(x^2)
//! part       = ( number | name | name "(" … ")" | "(" … ")" | "[" x "," y "," z "]" ) { "." component }
//! ```

use std::ops::Range;

use super::build::{Builder, Term};
use super::error::{ExprError, Result};
use super::lexer::{Lexeme, Token, tokens};
use super::operation::Operation;
use super::{MAX_DEPTH, MAX_SOURCE};

/// State of the parser: the tokens, the position among them, and the builder of the graph.
pub(super) struct Parser<'s, 'n> {
    source: &'s str,
    tokens: Vec<Token>,
    at: usize,
    depth: usize,
    builder: Builder<'n>,
}

/// Parses a complete expression. The span of an error is the place where parsing failed.
pub(super) fn parse<'n>(source: &str, builder: Builder<'n>) -> Result<(Builder<'n>, Term)> {
    if source.len() > MAX_SOURCE {
        let message = format!(
            "this expression has {} bytes; the limit is {MAX_SOURCE}",
            source.len()
        );
        return Err(ExprError::new(message, 0..source.len()));
    }
    let mut parser = Parser {
        source,
        tokens: tokens(source)?,
        at: 0,
        depth: 0,
        builder,
    };
    if parser.peek() == Lexeme::End {
        return Err(ExprError::new("this expression is empty", 0..source.len()));
    }
    let term = parser.expression()?;
    match parser.peek() {
        Lexeme::End => Ok((parser.builder, term)),
        _ => Err(parser.left_over()),
    }
}

/// Precedence of comparisons.
const COMPARISON: u8 = 2;

/// Returns the binary operator of a symbol, and its precedence.
fn binary_operator(lexeme: Lexeme) -> Option<(Operation, u8)> {
    let Lexeme::Symbol(symbol) = lexeme else {
        return None;
    };
    Some(match symbol {
        "||" => (Operation::Or, 0),
        "&&" => (Operation::And, 1),
        "<" => (Operation::Less, COMPARISON),
        "<=" => (Operation::LessOrEqual, COMPARISON),
        ">" => (Operation::Greater, COMPARISON),
        ">=" => (Operation::GreaterOrEqual, COMPARISON),
        "==" => (Operation::Equal, COMPARISON),
        "!=" => (Operation::NotEqual, COMPARISON),
        "+" => (Operation::Add, 3),
        "-" => (Operation::Subtract, 3),
        "*" => (Operation::Multiply, 4),
        "/" => (Operation::Divide, 4),
        "%" => (Operation::Modulo, 4),
        _ => return None,
    })
}

impl Parser<'_, '_> {
    fn token(&self) -> Token {
        let end = self.source.len();
        self.tokens.get(self.at).cloned().unwrap_or(Token {
            lexeme: Lexeme::End,
            span: end..end,
        })
    }

    fn peek(&self) -> Lexeme {
        self.token().lexeme
    }

    fn next(&mut self) -> Token {
        let token = self.token();
        self.at += 1;
        token
    }

    /// Consumes the next token if it is the given symbol; returns whether it was.
    fn take(&mut self, symbol: &str) -> bool {
        let found = matches!(self.peek(), Lexeme::Symbol(s) if s == symbol);
        self.at += usize::from(found);
        found
    }

    /// Consumes the closing `symbol` and returns its end. `open` is the span of the opening symbol,
    /// for the error.
    fn close(&mut self, symbol: &str, open: &Range<usize>) -> Result<usize> {
        let token = self.token();
        if self.take(symbol) {
            return Ok(token.span.end);
        }
        if token.lexeme == Lexeme::End {
            let opener = &self.source[open.clone()];
            return Err(
                ExprError::new(format!("`{opener}` is never closed"), open.clone())
                    .with_hint(format!("add `{symbol}`")),
            );
        }
        Err(self.left_over())
    }

    /// Returns the error for a token that cannot follow a complete value.
    fn left_over(&self) -> ExprError {
        let token = self.token();
        let text = &self.source[token.span.clone()];
        let touching = self.at > 0
            && self
                .tokens
                .get(self.at - 1)
                .is_some_and(|t| matches!(t.lexeme, Lexeme::Number(_)));
        match token.lexeme {
            Lexeme::Symbol(")" | "]") => {
                ExprError::new(format!("`{text}` closes nothing here"), token.span)
            }
            Lexeme::Symbol(",") => ExprError::new(
                "a comma belongs between the arguments of a function or the parts of a vector",
                token.span,
            ),
            Lexeme::Name if touching => ExprError::new(
                format!("an operator is missing before `{text}`"),
                token.span,
            )
            .with_hint("multiplication is written `*`"),
            _ => ExprError::new(
                format!("expected an operator or the end, found `{text}`"),
                token.span,
            ),
        }
    }

    /// Runs a parsing function one level deeper, and checks the nesting depth.
    fn nested<T>(&mut self, inner: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        if self.depth == MAX_DEPTH {
            let message = format!("this expression is nested more than {MAX_DEPTH} deep");
            return Err(ExprError::new(message, self.token().span));
        }
        self.depth += 1;
        let result = inner(self);
        self.depth -= 1;
        result
    }

    /// Parses a value or a condition `a ? b : c`.
    fn expression(&mut self) -> Result<Term> {
        let condition = self.operators(0)?;
        let mark = self.token().span;
        if !self.take("?") {
            return Ok(condition);
        }
        let then = self.nested(Self::expression)?;
        if !self.take(":") {
            let error = ExprError::new("`?` without `:`", mark);
            return Err(error.with_hint("a choice is written `condition ? a : b`"));
        }
        let other = self.nested(Self::expression)?;
        let id = self.builder.select(&condition, &then, &other)?;
        Ok(Term {
            id,
            span: condition.span.start..other.span.end,
        })
    }

    /// Parses values joined by binary operators of at least the precedence `level`.
    fn operators(&mut self, level: u8) -> Result<Term> {
        let mut left = self.prefix()?;
        let mut compared = false;
        while let Some((op, its_level)) = binary_operator(self.peek())
            && its_level >= level
        {
            if its_level == COMPARISON && compared {
                let error = ExprError::new("comparisons cannot be chained", self.token().span);
                return Err(error.with_hint("write `a < b && b < c`"));
            }
            compared = its_level == COMPARISON;
            self.at += 1;
            let right = self.operators(its_level + 1)?;
            let id = self.builder.binary(op, &left, &right)?;
            left = Term {
                id,
                span: left.span.start..right.span.end,
            };
        }
        Ok(left)
    }

    fn prefix(&mut self) -> Result<Term> {
        let token = self.token();
        let op = match token.lexeme {
            Lexeme::Symbol("-") => Some(Operation::Negate),
            Lexeme::Symbol("!") => Some(Operation::Not),
            Lexeme::Symbol("+") => None,
            _ => return self.power(),
        };
        self.at += 1;
        let operand = self.nested(Self::prefix)?;
        let id = match op {
            Some(op) => self.builder.unary(op, &operand)?,
            None => operand.id,
        };
        Ok(Term {
            id,
            span: token.span.start..operand.span.end,
        })
    }

    fn power(&mut self) -> Result<Term> {
        let base = self.part()?;
        if !self.take("^") {
            return Ok(base);
        }
        let exponent = self.nested(Self::prefix)?;
        let id = self.builder.binary(Operation::Power, &base, &exponent)?;
        Ok(Term {
            id,
            span: base.span.start..exponent.span.end,
        })
    }

    /// Parses a simple value and the components taken of it, as in `p.x`.
    fn part(&mut self) -> Result<Term> {
        let mut term = self.simple()?;
        while self.take(".") {
            let token = self.next();
            if token.lexeme != Lexeme::Name {
                return Err(ExprError::new(
                    "expected a component such as `.x` after the point",
                    token.span,
                ));
            }
            let (start, end) = (term.span.start, token.span.end);
            let id = self
                .builder
                .component(term, &self.source[token.span.clone()], token.span)?;
            term = Term {
                id,
                span: start..end,
            };
        }
        Ok(term)
    }

    /// Parses a number, a name, a call, or something in parentheses or brackets.
    fn simple(&mut self) -> Result<Term> {
        let token = self.next();
        let span = token.span.clone();
        match token.lexeme {
            Lexeme::Number(value) => Ok(Term {
                id: self.builder.graph.number(value),
                span,
            }),
            Lexeme::Name if matches!(self.peek(), Lexeme::Symbol("(")) => self.call(span),
            Lexeme::Name => Ok(Term {
                id: self
                    .builder
                    .name(&self.source[span.clone()], span.clone())?,
                span,
            }),
            Lexeme::Symbol("(") => {
                let inner = self.nested(Self::expression)?;
                let end = self.close(")", &span)?;
                Ok(Term {
                    id: inner.id,
                    span: span.start..end,
                })
            }
            Lexeme::Symbol("[") => {
                let (parts, end) = self.list("]", &span)?;
                let whole = span.start..end;
                if parts.len() != 3 {
                    let message = format!(
                        "a vector has three components, and this has {}",
                        parts.len()
                    );
                    return Err(ExprError::new(message, whole));
                }
                Ok(Term {
                    id: self.builder.compose(&parts)?,
                    span: whole,
                })
            }
            Lexeme::End => {
                let error = ExprError::new("the expression ends where a value is expected", span);
                Err(error.with_hint(
                    "a value is a number, a name, a function or something in parentheses",
                ))
            }
            Lexeme::Symbol(symbol) => Err(ExprError::new(
                format!("expected a value, found `{symbol}`"),
                span,
            )),
        }
    }

    fn call(&mut self, name: Range<usize>) -> Result<Term> {
        let open = self.next().span;
        let (arguments, end) = self.list(")", &open)?;
        let whole = name.start..end;
        let id = self
            .builder
            .call(&self.source[name.clone()], name, &arguments, whole.clone())?;
        Ok(Term { id, span: whole })
    }

    /// Parses expressions between commas up to a closing symbol. Returns them and the end of the
    /// symbol.
    fn list(&mut self, close: &str, open: &Range<usize>) -> Result<(Vec<Term>, usize)> {
        let end = self.token().span.end;
        if self.take(close) {
            return Ok((Vec::new(), end));
        }
        let mut terms = Vec::new();
        loop {
            terms.push(self.nested(Self::expression)?);
            if !self.take(",") {
                return Ok((terms, self.close(close, open)?));
            }
        }
    }
}
