//! Builder of an expression's graph, called by the parser. It resolves names, checks types, and
//! converts every construct of the language to operations.

use std::collections::BTreeMap;
use std::ops::Range;

use super::function::{CONSTANTS, Operation, find_constant, find_function};
use super::graph::{ExprGraph, NodeId};
use super::run::underflow_limit_of_power;
use super::scope::{ExprError, ExprScope, Result, Variable};
use crate::suggest::{find_synonym, most_similar_word};

/// A parsed part of the source: its node in the graph and its span in the text.
#[derive(Clone, Debug)]
pub(super) struct SourceTerm {
    pub id: NodeId,
    pub span: Range<usize>,
}

/// Greatest magnitude of a whole exponent for which a power is computed by multiplications. Larger
/// exponents use the power function.
const LARGEST_WHOLE_POWER: f64 = 65536.0;

/// Builder of an expression's graph.
pub(super) struct GraphBuilder<'a> {
    pub graph: ExprGraph,
    pub constants: &'a BTreeMap<String, f64>,
    scope: ExprScope,
}

impl<'a> GraphBuilder<'a> {
    pub fn new(names: &'a BTreeMap<String, f64>, scope: ExprScope) -> Self {
        Self {
            graph: ExprGraph::default(),
            constants: names,
            scope,
        }
    }

    pub fn is_vector(&self, term: &SourceTerm) -> bool {
        self.graph.is_vector(term.id)
    }

    /// Resolves a name to a parameter, a variable of the scope or a named constant.
    pub fn resolve_name(&mut self, name: &str, span: Range<usize>) -> Result<NodeId> {
        let parameter = self.constants.get(name).copied();
        let variable = self
            .scope
            .variables()
            .iter()
            .copied()
            .find(|variable| variable.name() == name);
        let constant = find_constant(name);
        match (parameter, variable, constant) {
            (Some(value), None, None) | (None, None, Some(value)) => {
                Ok(self.graph.add_number(value))
            }
            (None, Some(variable), _) => Ok(self.graph.add_variable(variable)),
            (Some(_), _, _) => {
                let other = if variable.is_some() {
                    "a variable of the hit"
                } else {
                    "a constant"
                };
                let message =
                    format!("the parameter `{name}` of the scene has the same name as {other}");
                Err(ExprError::new(message, span).with_hint("give the parameter another name"))
            }
            (None, None, None) => Err(self.unknown_name_error(name, span)),
        }
    }

    /// Returns the error for a name that does not exist in this scope, with a hint.
    fn unknown_name_error(&self, name: &str, span: Range<usize>) -> ExprError {
        if let Some(variable) = Variable::ALL
            .into_iter()
            .find(|variable| variable.name() == name)
        {
            let message = format!(
                "`{}` does not exist {}",
                variable.name(),
                self.scope.description()
            );
            return ExprError::new(message, span).with_hint(self.list_allowed_names());
        }
        if find_function(name).is_some() {
            return ExprError::new(format!("`{name}` is a function"), span)
                .with_hint(format!("write `{name}(…)`"));
        }
        let known = self.constants.keys().map(String::as_str);
        let known = known
            .chain(self.scope.variables().iter().map(|v| v.name()))
            .chain(CONSTANTS.iter().map(|(name, _)| *name));
        let mut known: Vec<&str> = known.collect();
        let synonym = find_synonym(name, |word| known.contains(&word));
        let hint = match synonym.or_else(|| most_similar_word(name, known.drain(..))) {
            Some(similar) => format!("did you mean `{similar}`? {}", self.list_allowed_names()),
            None => self.list_allowed_names(),
        };
        ExprError::new(format!("unknown name `{name}`"), span).with_hint(hint)
    }

    /// Returns a sentence that lists the names of this scope, as a hint in a message.
    fn list_allowed_names(&self) -> String {
        const SHOWN: usize = 12;
        let mut names: Vec<&str> = self.scope.variables().iter().map(|v| v.name()).collect();
        names.extend(CONSTANTS.iter().map(|(name, _)| *name));
        names.extend(self.constants.keys().map(String::as_str).take(SHOWN));
        let more = if self.constants.len() > SHOWN {
            ", …"
        } else {
            ""
        };
        format!(
            "names that this expression may read: {}{more}",
            names.join(", ")
        )
    }

    /// Adds the component `name` of a vector, such as `x` or `r`.
    pub fn add_vector_component(
        &mut self,
        of: SourceTerm,
        name: &str,
        span: Range<usize>,
    ) -> Result<NodeId> {
        let axis = match name {
            "x" | "r" => 0,
            "y" | "g" => 1,
            "z" | "b" => 2,
            _ => {
                let hint = "the components of a vector are .x .y .z, or .r .g .b";
                return Err(
                    ExprError::new(format!("unknown component `.{name}`"), span).with_hint(hint)
                );
            }
        };
        if !self.is_vector(&of) {
            return Err(ExprError::new(
                format!("a number has no component `.{name}`"),
                of.span.start..span.end,
            ));
        }
        Ok(self.graph.add_component(of.id, axis))
    }

    /// Adds a vector of three numbers.
    pub fn compose_vector(&mut self, parts: &[SourceTerm]) -> Result<NodeId> {
        let mut components = [self.graph.add_number(0.0); 3];
        for (slot, part) in components.iter_mut().zip(parts) {
            *slot = self.expect_number(part, "a component of a vector")?;
        }
        Ok(self.graph.add_operation(Operation::Compose, components))
    }

    /// Applies an operation to a number, or to every component of a vector.
    pub fn apply_unary(&mut self, operation: Operation, a: &SourceTerm) -> Result<NodeId> {
        if !self.is_vector(a) {
            return Ok(self.graph.add_operation(operation, [a.id]));
        }
        match operation {
            Operation::Negate => {
                let minus_one = self.graph.add_number(-1.0);
                Ok(self
                    .graph
                    .add_operation(Operation::Scale, [a.id, minus_one]))
            }
            Operation::Not => Err(ExprError::new(
                "`!` needs a number, but its operand is a vector",
                a.span.clone(),
            )),
            _ => Ok(self.apply_to_components([a.id; 3], |graph, [a, ..]| {
                graph.add_operation(operation, [a])
            })),
        }
    }

    /// Applies an operation to two numbers or, componentwise, to a vector and another value.
    pub fn apply_binary(
        &mut self,
        operation: Operation,
        a: &SourceTerm,
        b: &SourceTerm,
    ) -> Result<NodeId> {
        let vectors = (self.is_vector(a), self.is_vector(b));
        if vectors == (false, false) {
            return Ok(apply_to_numbers(&mut self.graph, operation, a.id, b.id));
        }
        if operation.requires_numbers() {
            let vector = if vectors.0 { a } else { b };
            let hint = "take a component such as `.y`, or `length(…)` or `dot(…)`";
            return Err(ExprError::new(
                "this operation needs numbers, but an operand is a vector",
                vector.span.clone(),
            )
            .with_hint(hint));
        }
        Ok(match (operation, vectors) {
            (Operation::Multiply, (true, false)) => {
                self.graph.add_operation(Operation::Scale, [a.id, b.id])
            }
            (Operation::Multiply, (false, true)) => {
                self.graph.add_operation(Operation::Scale, [b.id, a.id])
            }
            (Operation::Divide, (true, false)) => self
                .graph
                .add_operation(Operation::DivideByNumber, [a.id, b.id]),
            _ => match operation.vector_operation() {
                Some(operation) => {
                    let operands = [self.widen_to_vector(a.id), self.widen_to_vector(b.id)];
                    self.graph.add_operation(operation, operands)
                }
                None => self.apply_to_components([a.id, b.id, b.id], |graph, [a, b, _]| {
                    apply_to_numbers(graph, operation, a, b)
                }),
            },
        })
    }

    /// Converts a number to a vector with three equal components; returns a vector unchanged.
    pub fn widen_to_vector(&mut self, id: NodeId) -> NodeId {
        if self.graph.is_vector(id) {
            id
        } else {
            self.graph.add_operation(Operation::Compose, [id; 3])
        }
    }

    /// Calls `make` for the operands' components x, y and z, and composes a vector of the three
    /// results. An operand that is a number is used for each component.
    pub fn apply_to_components(
        &mut self,
        operands: [NodeId; 3],
        make: impl Fn(&mut ExprGraph, [NodeId; 3]) -> NodeId,
    ) -> NodeId {
        let components = [0, 1, 2].map(|axis| {
            let parts = operands.map(|id| match self.graph.is_vector(id) {
                true => self.graph.add_component(id, axis),
                false => id,
            });
            make(&mut self.graph, parts)
        });
        self.graph.add_operation(Operation::Compose, components)
    }

    /// Adds the node of `condition ? a : b`.
    pub fn add_select(
        &mut self,
        condition: &SourceTerm,
        a: &SourceTerm,
        b: &SourceTerm,
    ) -> Result<NodeId> {
        let c = self.expect_number(condition, "a condition")?;
        Ok(if self.is_vector(a) || self.is_vector(b) {
            let operands = [c, self.widen_to_vector(a.id), self.widen_to_vector(b.id)];
            self.graph.add_operation(Operation::SelectVectors, operands)
        } else {
            self.graph.add_operation(Operation::Select, [c, a.id, b.id])
        })
    }

    /// Returns the node of a term that must be a number. If it is a vector, the message of the
    /// error begins with `label`.
    pub fn expect_number(&self, term: &SourceTerm, label: &str) -> Result<NodeId> {
        if self.is_vector(term) {
            return Err(ExprError::new(
                format!("{label} must be a number, not a vector"),
                term.span.clone(),
            ));
        }
        Ok(term.id)
    }

    /// Returns the node of a term that must be a vector. If it is a number, the message of the
    /// error begins with `label`.
    pub fn expect_vector(&self, term: &SourceTerm, label: &str) -> Result<NodeId> {
        if !self.is_vector(term) {
            let error = ExprError::new(
                format!("{label} must be a vector, not a number"),
                term.span.clone(),
            );
            return Err(error.with_hint("a vector is written `[x, y, z]` or `vec3(x, y, z)`"));
        }
        Ok(term.id)
    }
}

/// Adds an operation on two numbers. A power whose exponent is a constant whole number becomes
/// multiplications.
fn apply_to_numbers(graph: &mut ExprGraph, operation: Operation, a: NodeId, b: NodeId) -> NodeId {
    if operation == Operation::Power
        && let Some(exponent) = graph.constant_number_value(b)
        && exponent.fract() == 0.0
        && exponent.abs() <= LARGEST_WHOLE_POWER
    {
        let whole = exponent.abs() as u32;
        let limit = graph.add_number(underflow_limit_of_power(whole));
        let power = match whole {
            2 => graph.add_operation(Operation::Multiply, [a, a]),
            _ => graph.add_operation(Operation::WholePower(whole), [a, limit]),
        };
        return if exponent < 0.0 {
            let one = graph.add_number(1.0);
            graph.add_operation(Operation::Divide, [one, power])
        } else {
            power
        };
    }
    graph.add_operation(operation, [a, b])
}
