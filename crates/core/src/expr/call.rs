//! Function calls: checks the number and the types of the arguments, and adds the operations.

use std::ops::Range;

use super::build::{GraphBuilder, SourceTerm};
use super::function::{FUNCTIONS, Function, NoiseKind, Operation, find_constant, find_function};
use super::graph::NodeId;
use super::scope::{ExprError, Result, Variable};
use crate::noise::MAX_OCTAVES;
use crate::suggest::{find_synonym, most_similar_word};

impl GraphBuilder<'_> {
    /// Adds the operations of a function call. `span` is the place of the whole call in the text,
    /// `name_span` the place of the function's name.
    pub fn call_function(
        &mut self,
        name: &str,
        name_span: Range<usize>,
        arguments: &[SourceTerm],
        span: Range<usize>,
    ) -> Result<NodeId> {
        let Some(function) = find_function(name) else {
            return Err(self.unknown_function_error(name, name_span));
        };
        match (function, arguments) {
            (Function::Unary(op), [a]) => self.apply_unary(op, a),
            (Function::MultiplyBy(factor), [a]) => {
                let factor = SourceTerm {
                    id: self.graph.add_number(factor),
                    span: name_span,
                };
                self.apply_binary(Operation::Multiply, a, &factor)
            }
            (Function::Binary(op), [a, b]) => self.apply_binary(op, a, b),
            (Function::Atan, [a]) => self.apply_unary(Operation::Atan, a),
            (Function::Atan, [a, b]) => self.apply_binary(Operation::Atan2, a, b),
            (Function::Extremum(op), [first, rest @ ..]) if !rest.is_empty() => {
                let start = first.clone();
                let folded = rest
                    .iter()
                    .try_fold(start, |so_far, next| -> Result<SourceTerm> {
                        Ok(SourceTerm {
                            id: self.apply_binary(op, &so_far, next)?,
                            span: span.clone(),
                        })
                    })?;
                Ok(folded.id)
            }
            (Function::Clamp, [x, low, high]) => {
                let raised = SourceTerm {
                    id: self.apply_binary(Operation::Max, x, low)?,
                    span,
                };
                self.apply_binary(Operation::Min, &raised, high)
            }
            (Function::Mix, [a, b, t]) => Ok(self.add_mix(a.id, b.id, t.id)),
            (Function::Smoothstep, [low, high, x]) => {
                Ok(self.add_smoothstep([low.id, high.id, x.id]))
            }
            (Function::If, [c, a, b]) => self.add_select(c, a, b),
            (Function::Vector, [_, _, _]) => self.compose_vector(arguments),
            (Function::Vector, [x]) => Ok(self.widen_to_vector(x.id)),
            (Function::Checker, [x, y]) => self.apply_binary(Operation::Checker, x, y),
            (Function::Checker, [x, y, z]) => self.add_checker_3d(x, y, z),
            (Function::Noise(octaves) | Function::PlaneNoise(octaves), _) => {
                let (point, count) =
                    self.split_off_octave_count(octaves, name, arguments, &span)?;
                self.add_noise(function, octaves, name, point, count, span)
            }
            _ => self.call_vector_function(function, name, arguments, span),
        }
    }

    /// Adds the call of a function whose arguments are all vectors.
    fn call_vector_function(
        &mut self,
        function: Function,
        name: &str,
        arguments: &[SourceTerm],
        span: Range<usize>,
    ) -> Result<NodeId> {
        let label = format!("an argument of `{name}`");
        let requested = match function {
            Function::Length | Function::Normalize => 1,
            Function::Dot | Function::Cross | Function::Reflect => 2,
            _ => usize::MAX,
        };
        if arguments.len() != requested {
            return Err(argument_count_error(function, name, arguments.len(), span));
        }
        let ids = arguments
            .iter()
            .map(|a| self.expect_vector(a, &label))
            .collect::<Result<Vec<NodeId>>>()?;
        let graph = &mut self.graph;
        Ok(match (function, ids.as_slice()) {
            (Function::Length, &[v]) => graph.add_operation(Operation::Length, [v]),
            (Function::Normalize, &[v]) => graph.add_operation(Operation::Normalize, [v]),
            (Function::Dot, &[a, b]) => graph.add_operation(Operation::Dot, [a, b]),
            (Function::Cross, &[a, b]) => graph.add_operation(Operation::Cross, [a, b]),
            (Function::Reflect, &[d, n]) => {
                let along = graph.add_operation(Operation::Dot, [d, n]);
                let two = graph.add_number(2.0);
                let twice = graph.add_operation(Operation::Multiply, [along, two]);
                let across = graph.add_operation(Operation::Scale, [n, twice]);
                graph.add_operation(Operation::SubtractVectors, [d, across])
            }
            _ => return Err(argument_count_error(function, name, arguments.len(), span)),
        })
    }

    fn add_mix(&mut self, a: NodeId, b: NodeId, t: NodeId) -> NodeId {
        if self.graph.is_vector(t) {
            return self.apply_to_components([a, b, t], |graph, all| {
                graph.add_operation(Operation::Mix, all)
            });
        }
        if self.graph.is_vector(a) || self.graph.is_vector(b) {
            let operands = [self.widen_to_vector(a), self.widen_to_vector(b), t];
            return self.graph.add_operation(Operation::MixVectors, operands);
        }
        self.graph.add_operation(Operation::Mix, [a, b, t])
    }

    fn add_smoothstep(&mut self, all: [NodeId; 3]) -> NodeId {
        if all.iter().any(|id| self.graph.is_vector(*id)) {
            return self.apply_to_components(all, |graph, all| {
                graph.add_operation(Operation::Smoothstep, all)
            });
        }
        self.graph.add_operation(Operation::Smoothstep, all)
    }

    /// Splits the arguments of a noise function into the coordinates of the point and the number of
    /// octaves. The number is 1 if the function has no such argument.
    fn split_off_octave_count<'t>(
        &self,
        octaves: NoiseKind,
        name: &str,
        all: &'t [SourceTerm],
        span: &Range<usize>,
    ) -> Result<(&'t [SourceTerm], u32)> {
        let (NoiseKind::Sum | NoiseKind::Turbulence, [point @ .., last]) = (octaves, all) else {
            return Ok((all, 1));
        };
        let count = self.graph.constant_number_value(last.id);
        match count
            .filter(|count| count.fract() == 0.0 && (1.0..=f64::from(MAX_OCTAVES)).contains(count))
        {
            Some(count) => Ok((point, count as u32)),
            None => {
                let message = format!(
                    "the number of octaves of `{name}` must be a constant whole number from 1 to {MAX_OCTAVES}"
                );
                let place = if all.len() > 1 {
                    last.span.clone()
                } else {
                    span.clone()
                };
                Err(ExprError::new(message, place).with_hint(
                    "write a number such as 4 as the last argument, which is the number of octaves",
                ))
            }
        }
    }

    fn add_noise(
        &mut self,
        function: Function,
        octaves: NoiseKind,
        name: &str,
        point: &[SourceTerm],
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
                self.graph
                    .add_operation(octaves.noise_operation_2d(count), operands)
            }
            (Function::Noise(_), [p]) => {
                let p = self.expect_vector(p, "the point of a noise function")?;
                self.graph
                    .add_operation(octaves.noise_operation_3d(count), [p])
            }
            (Function::Noise(_), [_, _, _]) => {
                let p = self.compose_vector(point)?;
                self.graph
                    .add_operation(octaves.noise_operation_3d(count), [p])
            }
            _ => {
                return Err(argument_count_error(
                    function,
                    name,
                    point.len() + usize::from(octaves != NoiseKind::One),
                    span,
                ));
            }
        })
    }

    fn add_checker_3d(&mut self, x: &SourceTerm, y: &SourceTerm, z: &SourceTerm) -> Result<NodeId> {
        let mut sum = self.graph.add_number(0.0);
        for term in [x, y, z] {
            let id = self.expect_number(term, "an argument of `checker`")?;
            let cell = self.graph.add_operation(Operation::Floor, [id]);
            sum = self.graph.add_operation(Operation::Add, [sum, cell]);
        }
        let two = self.graph.add_number(2.0);
        Ok(self.graph.add_operation(Operation::Modulo, [sum, two]))
    }

    /// Returns the error for an undefined function, with a hint.
    fn unknown_function_error(&self, name: &str, span: Range<usize>) -> ExprError {
        let error = ExprError::new(format!("unknown function `{name}`"), span);
        if self.constants.contains_key(name)
            || Variable::ALL.iter().any(|v| v.name() == name)
            || find_constant(name).is_some()
        {
            return error.with_hint(format!("to multiply, write `{name} * (…)`"));
        }
        let synonym = find_synonym(name, |word| find_function(word).is_some());
        let similar = || most_similar_word(name, FUNCTIONS.iter().map(|(name, _)| *name));
        match synonym.or_else(similar) {
            Some(similar) => error.with_hint(format!("did you mean `{similar}`?")),
            None => {
                let names: Vec<&str> = FUNCTIONS.iter().map(|(name, _)| *name).collect();
                error.with_hint(format!("the functions are: {}", names.join(", ")))
            }
        }
    }
}

/// Returns the error for a call with a wrong number of arguments. Its hint lists the right usages.
fn argument_count_error(
    function: Function,
    name: &str,
    count: usize,
    span: Range<usize>,
) -> ExprError {
    use Function::*;
    let usages: &[&str] = match function {
        Unary(_) | MultiplyBy(_) => &["(x)"],
        Binary(Operation::Atan2) => &["(y, x)"],
        Binary(Operation::Step) => &["(edge, x)"],
        Binary(Operation::Power) => &["(base, exponent)"],
        Binary(_) => &["(x, y)"],
        Atan => &["(x)", "(y, x)"],
        Extremum(_) => &["(a, b, …)"],
        Clamp => &["(x, low, high)"],
        Mix => &["(a, b, t)"],
        Smoothstep => &["(low, high, x)"],
        If => &["(condition, then, else)"],
        Vector => &["(x, y, z)"],
        Dot | Cross => &["(a, b)"],
        Length | Normalize => &["(v)"],
        Reflect => &["(d, n)"],
        Checker => &["(x, y)", "(x, y, z)"],
        Noise(NoiseKind::One) => &["(p)", "(x, y)", "(x, y, z)"],
        Noise(_) => &["(p, octaves)", "(x, y, octaves)", "(x, y, z, octaves)"],
        PlaneNoise(NoiseKind::One) => &["(x, y)"],
        PlaneNoise(_) => &["(x, y, octaves)"],
    };
    let usages: Vec<String> = usages
        .iter()
        .map(|usage| format!("`{name}{usage}`"))
        .collect();
    let plural = if count == 1 { "" } else { "s" };
    ExprError::new(
        format!("the function `{name}` cannot have {count} argument{plural}"),
        span,
    )
    .with_hint(format!("write {}", usages.join(" or ")))
}
