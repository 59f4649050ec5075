//! The expression language of scene files: formulas of numbers and vectors, without assignments or
//! loops.
//!
//! The language has two uses. While a scene is loaded, [`evaluate`] computes numbers that are
//! expressions of the time `t` and the scene's parameters. For textures, weights and sky colours,
//! [`compile`] makes a program once, and [`ProgramTable`] evaluates the program at each hit, whose
//! properties it may read.
//!
//! * **Values** are numbers and vectors of three numbers, `[x, y, z]` or `vec3(x, y, z)`, with the
//!   components `.x .y .z` (or `.r .g .b`). A number combined with a vector applies to every
//!   component.
//! * **Operators**, loosest first: `a ? b : c`, `||`, `&&`, comparisons, `+ -`, `* / %`, prefix
//!   `- !`, `^`. A truth value is the number 1 or 0; every number but 0 and NaN is true. `%` takes
//!   the sign of the divisor.
//! * **Names**: `t`, the parameters, `pi`, `tau`, `e`, and the [variables](Variable) of the
//!   [`ExprScope`].
//! * **Functions** of numbers apply to every component of a vector: `abs sign floor ceil round
//!   fract mod min max clamp mix step smoothstep sqrt pow exp ln sin cos tan asin acos atan atan2
//!   degrees radians`. `if(c, a, b)` is `c ? a : b`: only the taken branch matters. Functions of
//!   vectors: `dot cross length normalize reflect`.
//! * **Patterns**: `checker(x, y)` is 0 or 1; `noise(p)` (a vector, or two or three numbers),
//!   `fbm(p, octaves)` and `turbulence(p, octaves)` are [gradient noise](crate::noise) and its
//!   sums; `noise2`, `fbm2`, `turbulence2` in the plane.
//!
//! Constant parts are computed once in `f64`; the rest runs in the renderer's scalar. The length
//! and the nesting depth of an expression and the size of a program are bounded. An expression
//! beyond a bound is an error.

mod bounds;
mod build;
mod call;
mod function;
mod graph;
mod parser;
mod program;
mod run;
mod scope;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

pub use function::{constant_names, function_names};
pub use graph::Constant;
pub use program::{Program, ProgramTable};
pub use scope::{ExprError, ExprScope, Variable, VariableValues};

/// Greatest length of an expression in bytes.
const MAX_SOURCE_BYTES: usize = 16 * 1024;

/// Greatest nesting depth of parentheses, calls, conditions, prefixes and powers.
pub const MAX_DEPTH: usize = 64;

/// Returns the value of an expression of constants, computed in `f64`. `names` holds the values of
/// these constants: the time `t` and the parameters.
///
/// # Errors
/// An invalid expression, and a value that is a vector or not finite.
pub fn evaluate(source: &str, names: &BTreeMap<String, f64>) -> Result<f64, ExprError> {
    let (builder, term) = parser::parse(source, build::GraphBuilder::new(names, ExprScope::Load))?;
    let id = builder.expect_number(&term, "the value")?;
    match builder.graph.constant_number_value(id) {
        Some(value) if value.is_finite() => Ok(value),
        value => {
            let value = value.unwrap_or(f64::NAN);
            let error = ExprError::new(
                format!("the value of this expression is {value}, not a finite number"),
                term.span,
            );
            Err(error.with_hint("every number of a scene must be finite"))
        }
    }
}

/// Compiles an expression that is evaluated at each hit. `names` holds the values of the constants
/// that it may read: the time `t` and the parameters. `scope` determines the variables that it may
/// read.
///
/// # Errors
/// Invalid text, names that are undefined in the scope, values of the wrong type, and a program
/// that is too large.
pub fn compile(
    source: &str,
    names: &BTreeMap<String, f64>,
    scope: ExprScope,
) -> Result<Program, ExprError> {
    let (builder, term) = parser::parse(source, build::GraphBuilder::new(names, scope))?;
    Program::new(&builder.graph, term.id, term.span)
}

/// Compiles an expression whose value must be a number, such as a weight. See [`compile`].
///
/// # Errors
/// Those of [`compile`], and a vector value.
pub fn compile_number(
    source: &str,
    names: &BTreeMap<String, f64>,
    scope: ExprScope,
) -> Result<Program, ExprError> {
    let (builder, term) = parser::parse(source, build::GraphBuilder::new(names, scope))?;
    builder.expect_number(&term, "a weight")?;
    Program::new(&builder.graph, term.id, term.span)
}

/// Returns the reason why `name` cannot be the name of a parameter; `None` for a valid name. A
/// valid name consists of letters, digits and `_`, does not begin with a digit, and is neither `t`
/// nor a constant.
pub fn find_parameter_name_problem(name: &str) -> Option<String> {
    let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        || !name.chars().all(letters)
    {
        return Some(
            "the name of a parameter consists of letters, digits and `_`, and does not start with a digit"
                .to_owned(),
        );
    }
    if name == "t" {
        return Some(
            "`t` already stands for the time of the scene; choose another name".to_owned(),
        );
    }
    function::find_constant(name).map(|value| {
        format!("`{name}` already stands for the constant {value}; choose another name")
    })
}
