//! Meaning of the language, and the sources that it refuses.

use std::collections::BTreeMap;

use glam::DVec3;

use super::names;
use crate::expr::{
    ExprScope, MAX_DEPTH, MAX_SOURCE_BYTES, compile, evaluate, find_parameter_name_problem,
};

fn value(source: &str) -> f64 {
    evaluate(source, &names()).unwrap_or_else(|e| panic!("{source}: {e} at {:?}", e.span))
}

/// Returns the message, the text that it points to, and the hint.
fn refused(source: &str) -> (String, String, String) {
    match evaluate(source, &names()) {
        Ok(value) => panic!("{source} is {value}"),
        Err(e) => (
            e.message,
            source[e.span].to_owned(),
            e.hint.unwrap_or_default(),
        ),
    }
}

/// Protects: arithmetic follows the usual precedence: power over sign over product over sum over
/// comparison over choice.
#[test]
fn precedence() {
    for (source, expected) in [
        ("1 + 2*3", 7.0),
        ("(1 + 2)*3", 9.0),
        ("-2^2", -4.0),
        ("2^-1", 0.5),
        ("2^3^2", 512.0),
        ("8/4/2", 1.0),
        ("7 - 2 - 1", 4.0),
        ("-7 % 3", 2.0),
        ("7 % -3", -2.0),
        ("1 + 1 == 2 && 3 > 2", 1.0),
        ("0 || 2 < 1", 0.0),
        ("!0 + !3", 1.0),
        ("1 > 2 ? 3 : 0 ? 4 : 5", 5.0),
        ("- -3", 3.0),
        (".5 + 2. + 1e-1 + 1.5E+1", 17.6),
    ] {
        assert_eq!(value(source), expected, "{source}");
    }
}

/// Protects: names are the time, the parameters and the constants.
#[test]
fn named_numbers() {
    assert_eq!(value("1 + 0.15*sin(0.8*t)"), 1.0 + 0.15 * libm::sin(1.6));
    assert_eq!(value("size*long_name"), 3.5);
    assert_eq!(value("tau - 2*pi"), 0.0);
    assert_eq!(value("ln(e)"), 1.0);
}

/// Protects: every function agrees with its definition.
#[test]
fn functions() {
    for (source, expected) in [
        ("min(3, 1, 2)", 1.0),
        ("max(3, 1, 2)", 3.0),
        ("clamp(5, 0, 1)", 1.0),
        ("mix(2, 4, 0.25)", 2.5),
        ("step(1, 0.5)", 0.0),
        ("step(1, 1)", 1.0),
        ("smoothstep(0, 2, 1)", 0.5),
        ("smoothstep(1, 1, 1)", 0.0),
        ("floor(-1.5)", -2.0),
        ("ceil(-1.5)", -1.0),
        ("round(2.5)", 3.0),
        ("round(-2.5)", -2.0),
        ("round(-2.6)", -3.0),
        ("fract(-1.25)", 0.75),
        ("mod(-1, 4)", 3.0),
        ("sign(-3) + sign(0)", -1.0),
        ("abs(-3)", 3.0),
        ("sqrt(9)", 3.0),
        ("pow(2, 10)", 1024.0),
        ("pow(4, 0.5)", 2.0),
        ("pow(-2, 3)", -8.0),
        ("2^-2", 0.25),
        ("0^0", 1.0),
        ("atan(1, -1) - atan2(1, -1)", 0.0),
        ("degrees(pi)", 180.0),
        ("radians(180) - pi", 0.0),
        ("exp(0) + log(1)", 1.0),
        ("if(t > 1, 10, 20)", 10.0),
        ("checker(0.5, 1.5)", 1.0),
        ("checker(-0.5, 1.5)", 0.0),
        ("checker(-0.5, 1.5, 3)", 1.0),
        ("asin(1) - pi/2", 0.0),
        ("acos(1) + atan(0) + tan(0)", 0.0),
        ("cos(0)", 1.0),
    ] {
        assert_eq!(value(source), expected, "{source}");
    }
}

/// Protects: vectors combine componentwise with vectors and with numbers, and geometric functions
/// apply to whole vectors.
#[test]
fn vectors() {
    for (source, expected) in [
        ("[1, 2, 3].y", 2.0),
        ("vec3(1, 2, 3).b", 3.0),
        ("vec3(4).z", 4.0),
        ("([1, 2, 3] + 1).x", 2.0),
        ("(1 - [1, 2, 3]).z", -2.0),
        ("([2, 4, 6] / 2).y", 2.0),
        ("(12 / [2, 4, 6]).z", 2.0),
        ("(2 * [1, 2, 3] * [1, 2, 3]).z", 18.0),
        ("(-[1, 2, 3]).x", -1.0),
        ("dot([1, 2, 3], [4, 5, 6])", 32.0),
        ("cross([1, 0, 0], [0, 1, 0]).z", 1.0),
        ("length([3, 0, 4])", 5.0),
        ("normalize([0, 3, 0]).y", 1.0),
        ("reflect([1, -1, 0], [0, 1, 0]).y", 1.0),
        ("mix([0, 0, 0], 4, 0.5).y", 2.0),
        ("mix([0, 0, 0], 4, [0, 0.5, 1]).z", 4.0),
        ("max([1, 5, 2], 3).y", 5.0),
        ("clamp([-1, 0.5, 2], 0, 1).x", 0.0),
        ("abs([-1, 2, 3]).x", 1.0),
        ("([2, 3, 4]^2).z", 16.0),
        ("([5, 3, 4] % 2).x", 1.0),
        ("(t > 1 ? [1, 2, 3] : 0).z", 3.0),
        ("smoothstep(0, [1, 2, 4], 1).y", 0.5),
    ] {
        assert_eq!(value(source), expected, "{source}");
    }
}

/// Protects: interpolation is exact at its ends, whatever the rounding in between.
#[test]
fn mix_is_exact_at_the_ends() {
    for (a, b) in [(0.1, 0.7), (-3.3, 1e10), (1e-10, 5.0)] {
        assert_eq!(value(&format!("mix({a}, {b}, 0)")), a);
        assert_eq!(value(&format!("mix({a}, {b}, 1)")), b);
    }
}

/// Protects: the value of the branch not taken does not matter.
#[test]
fn only_the_taken_branch_matters() {
    assert_eq!(value("0 > 1 ? 1/0 : 2"), 2.0);
    assert_eq!(value("if(t == 2, 1, sqrt(-1))"), 1.0);
    assert_eq!(value("sqrt(-1) ? 1 : 2"), 2.0);
}

/// Protects: a number of the scene must be finite; intermediate arithmetic is IEEE.
#[test]
fn values_must_be_finite() {
    assert_eq!(value("1/(1/0)"), 0.0);
    assert_eq!(
        refused("1/(t - 2)").0,
        "the value of this expression is inf, not a finite number"
    );
    assert_eq!(
        refused("0/0").0,
        "the value of this expression is NaN, not a finite number"
    );
    assert_eq!(
        refused("[1, 2, 3]").0,
        "the value must be a number, not a vector"
    );
}

/// Protects: errors point to the place and give a hint.
#[test]
fn errors_point_at_the_place() {
    for (source, message, place, hint) in [
        (
            "1 + sise",
            "unknown name `sise`",
            "sise",
            "did you mean `size`? names that this expression may read: e, pi, tau, long_name, size, t",
        ),
        (
            "1 + sine(2)",
            "unknown function `sine`",
            "sine",
            "did you mean `sin`?",
        ),
        (
            "1 + p.x",
            "`p` does not exist in a number of the scene, which is evaluated once while loading",
            "p",
            "names that",
        ),
        (
            "size(2)",
            "unknown function `size`",
            "size",
            "to multiply, write `size * (…)`",
        ),
        (
            "2 sin",
            "an operator is missing before `sin`",
            "sin",
            "multiplication is written `*`",
        ),
        ("sin", "`sin` is a function", "sin", "write `sin(…)`"),
        (
            "sin()",
            "the function `sin` cannot have 0 arguments",
            "sin()",
            "write `sin(x)`",
        ),
        (
            "atan(1, 2, 3)",
            "the function `atan` cannot have 3 arguments",
            "atan(1, 2, 3)",
            "write `atan(x)` or `atan(y, x)`",
        ),
        (
            "min(1)",
            "the function `min` cannot have 1 argument",
            "min(1)",
            "write `min(a, b, …)`",
        ),
        (
            "dot(1, [1, 2, 3])",
            "an argument of `dot` must be a vector, not a number",
            "1",
            "a vector is written",
        ),
        (
            "[1, 2, [1, 2, 3]].x",
            "a component of a vector must be a number, not a vector",
            "[1, 2, 3]",
            "",
        ),
        (
            "[1, 2]",
            "a vector has three components, not 2",
            "[1, 2]",
            "",
        ),
        (
            "1 < [1, 2, 3]",
            "this operation needs numbers, but an operand is a vector",
            "[1, 2, 3]",
            "take a component",
        ),
        (
            "1 < 2 < 3",
            "comparisons cannot be chained",
            "<",
            "write `a < b && b < c`",
        ),
        (
            "(1 + 2",
            "`(` has no matching closing bracket",
            "(",
            "add `)`",
        ),
        ("1 + 2)", "`)` has no matching opening bracket", ")", ""),
        (
            "1, 5",
            "a comma may only separate arguments of a function or components of a vector",
            ",",
            "",
        ),
        (
            "1 +",
            "the expression ends where a value is expected",
            "",
            "a value is",
        ),
        ("1 + * 2", "expected a value, found `*`", "*", ""),
        (
            "t ? 1",
            "`?` has no matching `:`",
            "?",
            "a choice is written",
        ),
        (
            "[1, 2, 3].w",
            "unknown component `.w`",
            "w",
            "the components of a vector are",
        ),
        ("(1).x", "a number has no component `.x`", "(1).x", ""),
        (
            "2**3",
            "`**` is not an operator",
            "**",
            "a power is written `^`",
        ),
        (
            "t = 3",
            "unexpected character `=`",
            "=",
            "write `==` to compare",
        ),
        (
            "1 − 2",
            "unexpected character `−`",
            "−",
            "write the minus sign as `-`",
        ),
        (
            "1e999",
            "this number is too large: the limit is about 1.8e308",
            "1e999",
            "",
        ),
        ("  ", "this expression is empty", "  ", ""),
    ] {
        let (got, text, help) = refused(source);
        assert_eq!((got.as_str(), text.as_str()), (message, place), "{source}");
        assert!(
            help.starts_with(hint) && hint.is_empty() == help.is_empty(),
            "{source}: hint {help:?}"
        );
    }
}

/// Protects: a parameter with the name of a constant or variable is an error where it is used.
#[test]
fn an_ambiguous_name_is_refused() {
    let names = BTreeMap::from([("pi".to_owned(), 3.0)]);
    assert!(
        evaluate("2*pi", &names)
            .is_err_and(|e| e.message.contains("has the same name as a constant"))
    );
    assert_eq!(evaluate("2", &names), Ok(2.0));
}

/// Protects: hostile sources are refused in bounded time and stack, however deep or long.
#[test]
fn hostile_sources_are_refused() {
    for (open, close) in [
        ("(", ")"),
        ("-", ""),
        ("sin(", ")"),
        ("2^", ""),
        ("1 ? ", ": 0"),
        ("[0, 0, ", "].x"),
        ("1+(", ")"),
    ] {
        let deep = format!(
            "{}1{}",
            open.repeat(MAX_DEPTH + 1),
            close.repeat(MAX_DEPTH + 1)
        );
        assert!(refused(&deep).0.contains("nested more than"), "{open}");
        let endless = open.repeat(100_000);
        assert!(refused(&endless).0.contains("but at most"), "{open}");
    }
    assert_eq!(
        value(&format!(
            "{}1{}",
            "(".repeat(MAX_DEPTH),
            ")".repeat(MAX_DEPTH)
        )),
        1.0
    );
    let long_sum = vec!["1"; MAX_SOURCE_BYTES / 2].join("+");
    assert_eq!(value(&long_sum), (MAX_SOURCE_BYTES / 2) as f64);
    assert!(
        refused(&"1+".repeat(MAX_SOURCE_BYTES / 2))
            .0
            .contains("ends where a value is expected")
    );
}

/// Protects: no text makes the parser panic, and every span lies on character boundaries.
#[test]
fn any_text_is_survived() {
    let pieces = [
        "1", "t", "sin", "(", ")", "[", "]", ",", ".", "x", "+", "-", "^", "?", ":", "é", "∞",
        "1e", "&&", "&", " ",
    ];
    let mut state = 1_u64;
    for _ in 0..20_000 {
        let mut source = String::new();
        for _ in 0..12 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            source.push_str(pieces[(state >> 33) as usize % pieces.len()]);
        }
        if let Err(error) = evaluate(&source, &names()) {
            assert!(
                source.get(error.span.clone()).is_some(),
                "{source}: {error:?}"
            );
        }
    }
}

/// Protects: a parameter's name must be readable in an expression.
#[test]
fn parameter_names() {
    assert_eq!(find_parameter_name_problem("wave_2"), None);
    assert!(find_parameter_name_problem("2nd").is_some());
    assert!(find_parameter_name_problem("a-b").is_some());
    assert!(find_parameter_name_problem("pi").is_some());
    assert!(find_parameter_name_problem("t").is_some());
}

/// Protects: noise functions equal those of [`crate::noise`], in space for a vector or three
/// numbers, in the plane for two.
#[test]
fn noise_functions() {
    use crate::noise::{fbm2, fbm3, noise2, noise3, turbulence2, turbulence3};
    let p = DVec3::new(0.3, 1.7, -2.9);
    for (source, expected) in [
        ("noise([0.3, 1.7, -2.9])", noise3::<f64>(p)),
        ("noise(0.3, 1.7, -2.9)", noise3::<f64>(p)),
        ("noise(0.3, 1.7)", noise2(0.3, 1.7)),
        ("noise2(0.3, 1.7)", noise2(0.3, 1.7)),
        ("fbm([0.3, 1.7, -2.9], 8)", fbm3::<f64>(p, 8)),
        ("fbm(0.3, 1.7, 5)", fbm2(0.3, 1.7, 5)),
        ("fbm2(0.3, 1.7, 5)", fbm2(0.3, 1.7, 5)),
        ("turbulence(0.3, 1.7, -2.9, t)", turbulence3::<f64>(p, 2)),
        ("turbulence2(0.3, 1.7, 8)", turbulence2(0.3, 1.7, 8)),
    ] {
        assert_eq!(value(source), expected, "{source}");
    }
    assert_eq!(
        refused("fbm([1, 2, 3], 0.5)").0,
        "the number of octaves of `fbm` must be a constant whole number from 1 to 24"
    );
    assert_eq!(refused("fbm([1, 2, 3], 25)").1, "25");
    assert_eq!(refused("fbm([1, 2, 3], 0)").1, "0");
    assert_eq!(
        refused("noise(1)").0,
        "the point of a noise function must be a vector, not a number"
    );
    assert_eq!(
        refused("noise2([1, 2, 3])").0,
        "the function `noise2` cannot have 1 argument"
    );
    assert_eq!(
        refused("fbm2(1, 2, 3, 4)").0,
        "the function `fbm2` cannot have 4 arguments"
    );
    let error = compile("fbm(p, 1 + u)", &names(), ExprScope::Surface).expect_err("octaves vary");
    assert_eq!(error.span, 7..12);
}
