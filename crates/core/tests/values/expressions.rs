//! Expressions at infinities, zeros and NaN, where a wrong simplification would show.

use std::collections::BTreeMap;

use raywright_core::expr::{ExprScope, ProgramTable, VariableValues, compile_number};

/// Value of an expression for given u and v.
fn value(source: &str, u: f64, v: f64) -> f64 {
    let program = compile_number(source, &BTreeMap::new(), ExprScope::Surface)
        .unwrap_or_else(|e| panic!("{source}: {e}"));
    ProgramTable::from_program(&program).eval_scalar(
        0,
        &VariableValues {
            u,
            v,
            ..VariableValues::default()
        },
    )
}

/// Protects: only simplifications that hold for every number are applied. Infinity times zero is
/// NaN, and so is infinity minus itself.
#[test]
fn simplifications_hold_for_every_number() {
    let inf = f64::INFINITY;
    for source in [
        "u*0",
        "0*u",
        "u - u",
        "u/u",
        "0/v",
        "u % 1 - u % 1",
        "u*v",
        "(u - u)*0",
        "u + -u",
        "-u + u",
    ] {
        assert!(value(source, inf, 0.0).is_nan(), "{source}");
    }
    for (source, expected) in [
        ("u*1", inf),
        ("u + 0", inf),
        ("u^0", 1.0),
        ("1/u", 0.0),
        ("u > 3 ? 1 : u*0", 1.0),
        ("mix(2, u, v)", f64::NAN),
        ("mix(2, u, v > 0)", 2.0),
        ("mix(u, 2, v == 0)", 2.0),
        ("min(u, 7)", 7.0),
        ("max(-u, 7)", 7.0),
        ("--u", inf),
        ("0 - u", -inf),
        ("!u", 0.0),
        ("u == u", 1.0),
        ("v*0 == 0", 1.0),
    ] {
        let found = value(source, inf, 0.0);
        assert!(
            found == expected || (found.is_nan() && expected.is_nan()),
            "{source}: {found} instead of {expected}"
        );
    }
}

/// Protects: signs and factors stay right when an expression is simplified.
#[test]
fn rearranged_sums_keep_their_value() {
    for (source, expected) in [
        ("3 - 2*u", -7.0),
        ("v - u*2", -3.0),
        ("-u*3", -15.0),
        ("-u - -v", 2.0),
        ("v + -u", 2.0),
        ("-u + v", 2.0),
        ("-(u*v)", -35.0),
        ("2 - (3 - u)", 4.0),
        ("(u - v)*-1", 2.0),
        ("u/v*v", 5.0),
        ("10/u", 2.0),
        ("u - 1/2", 4.5),
        ("dot(-[u, v, 1], [1, 2, 3])", -22.0),
        ("dot([u, v, 1], -[1, 2, 3])", -22.0),
        ("dot(-[u, v, 1], -[1, 2, 3])", 22.0),
        ("([u, v, 1]*-1).y", -7.0),
        ("[v, u, 1].x", 7.0),
        ("u^2 - v^2", -24.0),
        ("u % 3 + v % -3", 0.0),
        ("max(u, v) - min(u, v)", 2.0),
        ("(u < v) - (u > v)", 1.0),
        ("u*u*u - 5*u*u", 0.0),
        ("atan2(0, -u) - 3.141592653589793", 0.0),
        ("step(u, v) - step(v, u)", 1.0),
        ("checker(u, v) + checker(u, v + 1)", 1.0),
    ] {
        assert!(
            (value(source, 5.0, 7.0) - expected).abs() < 1e-12,
            "{source}: {} instead of {expected}",
            value(source, 5.0, 7.0)
        );
    }
}
