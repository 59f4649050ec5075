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
use super::error::{ExprError, Result};
use super::lexer::{Lexeme, Token, tokenize};
use super::operation::Operation;
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
