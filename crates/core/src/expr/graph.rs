//! An expression as a graph of typed operations. Equal subexpressions share a node. Operations on
//! constants are evaluated in `f64` as soon as they are added.
//!
//! In the list of nodes, operands precede the operation that uses them. So every pass over the
//! graph is a loop, and a deeply nested source cannot overflow the stack.

use std::collections::HashMap;

use super::function::Operation;
use super::run;
use super::scope::Variable;

/// Constant value of an expression that reads no variable: a number or a vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constant {
    /// A number.
    Number(f64),
    /// A vector, or linear red, green and blue.
    Vector([f64; 3]),
}

/// Index of a node in its graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct NodeId(u32);

impl NodeId {
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A node of the graph: a number or a vector. Constants are stored as bits, so that nodes can be
/// compared and hashed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum ExprNode {
    /// Bits of a constant number.
    Number(u64),
    /// Bits of a constant vector.
    Vector([u64; 3]),
    /// A variable of the hit.
    Input(Variable),
    /// Component 0, 1 or 2 of a vector.
    Component(NodeId, u8),
    /// An operation on one to four operands. The last operand is repeated to fill the array.
    Operation(Operation, [NodeId; 4]),
}

impl ExprNode {
    /// Whether the node is a vector; `false` for a number.
    pub const fn is_vector(self) -> bool {
        match self {
            Self::Number(_) | Self::Component(..) => false,
            Self::Vector(_) => true,
            Self::Input(variable) => variable.is_vector(),
            Self::Operation(operation, _) => operation.is_vector(),
        }
    }

    /// Returns the operands; an operand may occur twice.
    pub fn operands(&self) -> &[NodeId] {
        match self {
            Self::Number(_) | Self::Vector(_) | Self::Input(_) => &[],
            Self::Component(of, _) => core::slice::from_ref(of),
            Self::Operation(_, operands) => operands,
        }
    }

    /// Returns the variable of an input node.
    pub const fn variable(self) -> Option<Variable> {
        match self {
            Self::Input(variable) => Some(variable),
            _ => None,
        }
    }
}

/// The nodes of an expression under construction.
#[derive(Debug, Default)]
pub(super) struct ExprGraph {
    nodes: Vec<ExprNode>,
    /// Index of each node of the graph, to find an equal node.
    node_ids: HashMap<ExprNode, NodeId>,
}

impl ExprGraph {
    /// Returns the nodes up to and including `root`. They contain all operands of `root`.
    pub fn nodes_up_to(&self, root: NodeId) -> &[ExprNode] {
        &self.nodes[..=root.index()]
    }

    pub fn node(&self, id: NodeId) -> ExprNode {
        self.nodes[id.index()]
    }

    pub fn is_vector(&self, id: NodeId) -> bool {
        self.node(id).is_vector()
    }

    /// Returns the value of a node that is a constant number; `None` for any other node.
    pub fn constant_number_value(&self, id: NodeId) -> Option<f64> {
        match self.node(id) {
            ExprNode::Number(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// Returns the value of a node that is a constant number or vector; `None` for any other node.
    pub fn constant_node_value(&self, id: NodeId) -> Option<Constant> {
        match self.node(id) {
            ExprNode::Number(x) => Some(Constant::Number(f64::from_bits(x))),
            ExprNode::Vector(v) => Some(Constant::Vector(v.map(f64::from_bits))),
            _ => None,
        }
    }

    /// Adds a constant number.
    pub fn add_number(&mut self, value: f64) -> NodeId {
        self.intern_node(ExprNode::Number(value.to_bits()))
    }

    /// Adds a variable.
    pub fn add_variable(&mut self, variable: Variable) -> NodeId {
        self.intern_node(ExprNode::Input(variable))
    }

    /// Adds component 0, 1 or 2 of a vector.
    pub fn add_component(&mut self, of: NodeId, axis: u8) -> NodeId {
        match self.node(of) {
            ExprNode::Vector(components) => {
                self.intern_node(ExprNode::Number(components[usize::from(axis)]))
            }
            ExprNode::Operation(Operation::Compose, parts) => parts[usize::from(axis)],
            _ => self.intern_node(ExprNode::Component(of, axis)),
        }
    }

    /// Adds an operation on one to four operands, or returns an equivalent node. Constants are
    /// folded, and some operations are simplified without changing a bit of the result.
    pub fn add_operation<const N: usize>(
        &mut self,
        operation: Operation,
        operands: [NodeId; N],
    ) -> NodeId {
        let operands @ [a, b, c, _] = core::array::from_fn(|i| operands[i.min(N - 1)]);
        if let Some(constant) = self.fold_constants(operation, operands) {
            return self.intern_node(constant);
        }
        match operation {
            // If the condition is constant, only the taken branch remains.
            Operation::Select | Operation::SelectVectors if b == c => return b,
            Operation::Select | Operation::SelectVectors => {
                if let Some(condition) = self.constant_number_value(a) {
                    return if run::is_true(condition) { b } else { c };
                }
            }
            // A sum with a product becomes a single operation. Missing factors are 1, so that no
            // bit of the result changes.
            Operation::Add => {
                for (term, product) in [(a, b), (b, a)] {
                    if let Some([x, y]) = self.product_factors(product) {
                        let one = self.add_number(1.0);
                        let [x, y, z] = match (self.product_factors(x), self.product_factors(y)) {
                            (Some([u, v]), _) => [u, v, y],
                            (None, Some([u, v])) => [u, v, x],
                            (None, None) => [x, one, y],
                        };
                        return self.add_operation(Operation::ProductSum, [x, y, z, term]);
                    }
                }
            }
            Operation::Subtract => {
                if let Some([x, y]) = self.product_factors(b) {
                    let minus_one = self.add_number(-1.0);
                    return self.add_operation(Operation::ProductSum, [x, minus_one, y, a]);
                }
            }
            // A weight that is always 0 or 1 selects an end of the interpolation. The end that is
            // not selected is ignored, even if it is not finite.
            Operation::Mix if self.is_truth_value(c) => {
                return self.add_operation(Operation::Select, [c, b, a]);
            }
            Operation::MixVectors if self.is_truth_value(c) => {
                return self.add_operation(Operation::SelectVectors, [c, b, a]);
            }
            _ => {}
        }
        self.intern_node(ExprNode::Operation(operation, operands))
    }

    /// Returns the two factors of a node that is a product of numbers; `None` for any other node.
    fn product_factors(&self, id: NodeId) -> Option<[NodeId; 2]> {
        match self.node(id) {
            ExprNode::Operation(Operation::Multiply, [x, y, ..]) => Some([x, y]),
            _ => None,
        }
    }

    /// Evaluates an operation whose operands are all constant; `None` otherwise. The result has the
    /// same bits as if a program evaluated the operation.
    fn fold_constants(&self, operation: Operation, operands: [NodeId; 4]) -> Option<ExprNode> {
        let row = |id: NodeId| match self.constant_node_value(id)? {
            Constant::Number(x) => Some([x; 4]),
            Constant::Vector([x, y, z]) => Some([x, y, z, 0.0]),
        };
        let [a, b, c, d] = operands.map(row);
        let [x, y, z, _] = run::run_operation(operation, [a?, b?, c?, d?]).map(f64::to_bits);
        Some(if operation.is_vector() {
            ExprNode::Vector([x, y, z])
        } else {
            ExprNode::Number(x)
        })
    }

    /// Whether the value of a node is 0 or 1 at every hit.
    fn is_truth_value(&self, id: NodeId) -> bool {
        matches!(self.node(id), ExprNode::Operation(operation, _) if operation.yields_truth_value())
    }

    /// Adds a node, or returns the identifier of an equal node.
    fn intern_node(&mut self, node: ExprNode) -> NodeId {
        // The length of the source bounds the number of nodes far below 2³².
        let next = NodeId(self.nodes.len() as u32);
        let id = *self.node_ids.entry(node).or_insert(next);
        if id == next {
            self.nodes.push(node);
        }
        id
    }
}
