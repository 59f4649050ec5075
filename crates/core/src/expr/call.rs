//! Function calls: checks the number and the types of the arguments, and adds the operations.

use std::ops::Range;

use super::build::{Builder, Term};
use super::error::{ExprError, Result};
use super::function::{FUNCTIONS, Function, Octaves, constant, function};
use super::graph::NodeId;
use super::operation::Operation;
use super::scope::Variable;
use crate::noise::MAX_OCTAVES;
use crate::suggest::closest;

impl Builder<'_> {
    /// Adds the operations of a function call. `span` is the span of the whole call, `name_span`
    /// that of the name.
    pub fn call(
        &mut self,
        name: &str,
        name_span: Range<usize>,
        arguments: &[Term],
        span: Range<usize>,
    ) -> Result<NodeId> {
        let Some(function) = function(name) else {
            return Err(self.unknown_function(name, name_span));
        };
        match (function, arguments) {
            (Function::Unary(op), [a]) => self.unary(op, a),
            (Function::Times(factor), [a]) => {
                let factor = Term {
                    id: self.graph.number(factor),
                    span: name_span,
                };
                self.binary(Operation::Multiply, a, &factor)
            }
            (Function::Binary(op), [a, b]) => self.binary(op, a, b),
            (Function::Atan, [a]) => self.unary(Operation::Atan, a),
            (Function::Atan, [a, b]) => self.binary(Operation::Atan2, a, b),
            (Function::Extremum(op), [first, rest @ ..]) if !rest.is_empty() => {
                let start = first.clone();
                let folded = rest
                    .iter()
                    .try_fold(start, |so_far, next| -> Result<Term> {
                        Ok(Term {
                            id: self.binary(op, &so_far, next)?,
                            span: span.clone(),
                        })
                    })?;
                Ok(folded.id)
            }
            (Function::Clamp, [x, low, high]) => {
                let raised = Term {
                    id: self.binary(Operation::Max, x, low)?,
                    span,
                };
                self.binary(Operation::Min, &raised, high)
            }
            (Function::Mix, [a, b, t]) => Ok(self.mix(a.id, b.id, t.id)),
            (Function::Smoothstep, [low, high, x]) => Ok(self.smoothstep([low.id, high.id, x.id])),
            (Function::If, [c, a, b]) => self.select(c, a, b),
            (Function::Vector, [_, _, _]) => self.compose(arguments),
            (Function::Vector, [x]) => Ok(self.widen(x.id)),
            (Function::Checker, [x, y]) => self.binary(Operation::Checker, x, y),
            (Function::Checker, [x, y, z]) => self.checker_in_space(x, y, z),
            (Function::Noise(octaves) | Function::PlaneNoise(octaves), _) => {
                let (point, count) = self.octaves(octaves, name, arguments, &span)?;
                self.noise(function, octaves, name, point, count, span)
            }
            _ => self.call_on_vectors(function, name, arguments, span),
        }
    }

    /// Adds the call of a function whose arguments are all vectors.
    fn call_on_vectors(
        &mut self,
        function: Function,
        name: &str,
        arguments: &[Term],
        span: Range<usize>,
    ) -> Result<NodeId> {
        let label = format!("an argument of `{name}`");
        let requested = match function {
            Function::Length | Function::Normalize => 1,
            Function::Dot | Function::Cross | Function::Reflect => 2,
            _ => usize::MAX,
        };
        if arguments.len() != requested {
            return Err(wrong_count(function, name, arguments.len(), span));
        }
        let ids = arguments
            .iter()
            .map(|a| self.expect_vector(a, &label))
            .collect::<Result<Vec<NodeId>>>()?;
        let graph = &mut self.graph;
        Ok(match (function, ids.as_slice()) {
            (Function::Length, &[v]) => graph.add(Operation::Length, [v]),
            (Function::Normalize, &[v]) => graph.add(Operation::Normalize, [v]),
            (Function::Dot, &[a, b]) => graph.add(Operation::Dot, [a, b]),
            (Function::Cross, &[a, b]) => graph.add(Operation::Cross, [a, b]),
            (Function::Reflect, &[d, n]) => {
                let along = graph.add(Operation::Dot, [d, n]);
                let two = graph.number(2.0);
                let twice = graph.add(Operation::Multiply, [along, two]);
                let across = graph.add(Operation::Scale, [n, twice]);
                graph.add(Operation::SubtractVectors, [d, across])
            }
            _ => return Err(wrong_count(function, name, arguments.len(), span)),
        })
    }

    fn mix(&mut self, a: NodeId, b: NodeId, t: NodeId) -> NodeId {
        if self.graph.is_vector(t) {
            return self.each([a, b, t], |graph, all| graph.add(Operation::Mix, all));
        }
        if self.graph.is_vector(a) || self.graph.is_vector(b) {
            let operands = [self.widen(a), self.widen(b), t];
            return self.graph.add(Operation::MixVectors, operands);
        }
        self.graph.add(Operation::Mix, [a, b, t])
    }

    fn smoothstep(&mut self, all: [NodeId; 3]) -> NodeId {
        if all.iter().any(|id| self.graph.is_vector(*id)) {
            return self.each(all, |graph, all| graph.add(Operation::Smoothstep, all));
        }
        self.graph.add(Operation::Smoothstep, all)
    }

    /// Splits the arguments of a noise function into the coordinates of the point and the number of
    /// octaves, which is 1 for a function without this argument.
    fn octaves<'t>(
        &self,
        octaves: Octaves,
        name: &str,
        all: &'t [Term],
        span: &Range<usize>,
    ) -> Result<(&'t [Term], u32)> {
        let (Octaves::Sum | Octaves::Turbulence, [point @ .., last]) = (octaves, all) else {
            return Ok((all, 1));
        };
        let count = self.graph.as_number(last.id);
        match count
            .filter(|count| count.fract() == 0.0 && (1.0..=f64::from(MAX_OCTAVES)).contains(count))
        {
            Some(count) => Ok((point, count as u32)),
            None => {
                let message = format!(
                    "the octaves of `{name}` must be a constant whole number from 1 to {MAX_OCTAVES}"
                );
                let place = if all.len() > 1 {
                    last.span.clone()
                } else {
                    span.clone()
                };
                Err(ExprError::new(message, place).with_hint("they are the last argument"))
            }
        }
    }

    fn noise(
        &mut self,
        function: Function,
        octaves: Octaves,
        name: &str,
        point: &[Term],
        count: u32,
        span: Range<usize>,
    ) -> Result<NodeId> {
        let label = format!("a coordinate of `{name}`");
        Ok(match (function, point) {
            (_, [x, y]) => {
                let operands = [
                    self.expect_number(x, &label)?,
                    self.expect_number(y, &label)?,
                ];
                self.graph.add(octaves.in_plane(count), operands)
            }
            (Function::Noise(_), [p]) => {
                let p = self.expect_vector(p, "a point of noise")?;
                self.graph.add(octaves.in_space(count), [p])
            }
            (Function::Noise(_), [_, _, _]) => {
                let p = self.compose(point)?;
                self.graph.add(octaves.in_space(count), [p])
            }
            _ => {
                return Err(wrong_count(
                    function,
                    name,
                    point.len() + usize::from(octaves != Octaves::One),
                    span,
                ));
            }
        })
    }

    fn checker_in_space(&mut self, x: &Term, y: &Term, z: &Term) -> Result<NodeId> {
        let mut sum = self.graph.number(0.0);
        for term in [x, y, z] {
            let id = self.expect_number(term, "an argument of `checker`")?;
            let cell = self.graph.add(Operation::Floor, [id]);
            sum = self.graph.add(Operation::Add, [sum, cell]);
        }
        let two = self.graph.number(2.0);
        Ok(self.graph.add(Operation::Modulo, [sum, two]))
    }

    /// Returns the error for an undefined function, with a hint.
    fn unknown_function(&self, name: &str, span: Range<usize>) -> ExprError {
        let error = ExprError::new(format!("unknown function `{name}`"), span);
        if self.names.contains_key(name)
            || Variable::ALL.iter().any(|v| v.name() == name)
            || constant(name).is_some()
        {
            return error.with_hint(format!("to multiply, write `{name} * (…)`"));
        }
        match closest(name, FUNCTIONS.iter().map(|(name, _)| *name)) {
            Some(similar) => error.with_hint(format!("did you mean `{similar}`?")),
            None => {
                let names: Vec<&str> = FUNCTIONS.iter().map(|(name, _)| *name).collect();
                error.with_hint(format!("functions: {}", names.join(", ")))
            }
        }
    }
}

/// Returns the error for a call with a wrong number of arguments, with the right usage as a hint.
fn wrong_count(function: Function, name: &str, count: usize, span: Range<usize>) -> ExprError {
    let usage = match function {
        Function::Unary(_) | Function::Times(_) => "(x)",
        Function::Binary(Operation::Atan2) => "(y, x)",
        Function::Binary(Operation::Step) => "(edge, x)",
        Function::Binary(Operation::Power) => "(base, exponent)",
        Function::Binary(_) => "(x, y)",
        Function::Atan => "(x)` or `atan(y, x)",
        Function::Extremum(_) => "(a, b, …)",
        Function::Clamp => "(x, low, high)",
        Function::Mix => "(a, b, t)",
        Function::Smoothstep => "(low, high, x)",
        Function::If => "(condition, then, else)",
        Function::Vector => "(x, y, z)",
        Function::Dot | Function::Cross => "(a, b)",
        Function::Length | Function::Normalize => "(v)",
        Function::Reflect => "(d, n)",
        Function::Checker => "(x, y)` or `checker(x, y, z)",
        Function::Noise(Octaves::One) => "(p)`, `noise(x, y)` or `noise(x, y, z)",
        Function::Noise(_) => "(p, octaves)`, with two or three numbers for a point `p",
        Function::PlaneNoise(Octaves::One) => "(x, y)",
        Function::PlaneNoise(_) => "(x, y, octaves)",
    };
    let plural = if count == 1 { "" } else { "s" };
    ExprError::new(
        format!("`{name}` does not take {count} argument{plural}"),
        span,
    )
    .with_hint(format!("write `{name}{usage}`"))
}
