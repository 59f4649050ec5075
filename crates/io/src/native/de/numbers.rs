//! Evaluation of numbers, which a scene may write as expressions.

use raywright_core::expr;

use super::super::failure::ReadFailure;
use super::super::node::TextValue;
use super::ValueReader;

impl ValueReader<'_> {
    /// Evaluates the value as a number. If this fails, the failure is recorded, and 1 is returned.
    pub(super) fn evaluate_number(&self) -> f64 {
        match &self.node.value {
            TextValue::Integer(value) => *value as f64,
            TextValue::Unsigned(value) => *value as f64,
            TextValue::Float(value) => *value,
            TextValue::Text(source) => expr::evaluate(source, self.context.variables)
                .unwrap_or_else(|error| {
                    self.context.record_failure(self.expression_failure(error));
                    1.0
                }),
            _ => {
                self.context
                    .record_failure(self.type_failure("a number, or an expression in quotes"));
                1.0
            }
        }
    }

    /// Creates the failure for an error in the value's expression, at the position of the error.
    fn expression_failure(&self, error: expr::ExprError) -> ReadFailure {
        let span = self.node.span_of_text_part(self.context.text, &error.span);
        let message = format!("in the expression of {self}: {}", error.message);
        let mut failure = ReadFailure::new(message).with_span(span);
        failure.hint = error.hint;
        failure
    }

    /// Evaluates the value as a whole number from `least` to `greatest`. If this fails, the failure
    /// is recorded, and 1 is returned.
    pub(super) fn evaluate_integer(&self, least: i128, greatest: i128) -> i128 {
        let value = match &self.node.value {
            TextValue::Integer(value) => i128::from(*value),
            TextValue::Unsigned(value) => i128::from(*value),
            _ => {
                let value = self.evaluate_number();
                // A cast of a float to an integer saturates. A number out of range therefore stays
                // out of range, and is refused below.
                if value.fract() != 0.0 || !value.is_finite() {
                    let message = format!("{self} must be a whole number, not {value}");
                    self.context.record_failure(
                        ReadFailure::new(message).with_span(self.node.span.clone()),
                    );
                    return 1;
                }
                value as i128
            }
        };
        if (least..=greatest).contains(&value) {
            return value;
        }
        let message =
            format!("{self} must be a whole number from {least} to {greatest}, not {value}");
        self.context
            .record_failure(ReadFailure::new(message).with_span(self.node.span.clone()));
        1
    }
}
