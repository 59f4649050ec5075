//! Compiled programs against the meaning of each operation, and the properties that programs
//! report.

use glam::DVec3;
use raywright_bvh::scalar::Real;

use super::{hit, names};
use crate::expr::program::MAX_OPERATIONS;
use crate::expr::run::{integer_power, underflow_limit_of_power};
use crate::expr::{
    Constant, ExprScope, ProgramTable, Variable, VariableValues, compile, compile_number,
};
use crate::hash::splitmix64;

/// Protects: every variable reads its own input, and exists only in its scopes.
#[test]
fn variables_belong_to_scopes() {
    for (source, scope, expected) in [
        (
            "p.x + 10*n.y + 100*d.x + r.y + o.z",
            ExprScope::Surface,
            1.5 + 10.0 + 60.0 + 0.8 + 2.0,
        ),
        ("u + v + distance", ExprScope::Surface, 6.0),
        ("l.z + shadow", ExprScope::Light, 1.5),
        ("1/occluder_distance", ExprScope::Light, 0.0),
        ("d.y + o.z", ExprScope::Sky, 1.2),
        ("t*size", ExprScope::Sky, 1.0),
    ] {
        let program =
            compile_number(source, &names(), scope).unwrap_or_else(|e| panic!("{source}: {e}"));
        assert!(
            (ProgramTable::from_program(&program).eval_scalar(0, &hit()) - expected).abs() < 1e-14,
            "{source}"
        );
    }
    for (source, scope) in [
        ("l.x", ExprScope::Surface),
        ("shadow", ExprScope::Surface),
        ("p.x", ExprScope::Sky),
        ("d.x", ExprScope::Load),
    ] {
        let error = compile(source, &names(), scope).expect_err(source);
        assert!(
            error.message.contains("does not exist"),
            "{source}: {error}"
        );
    }
    assert!(
        compile_number("p", &names(), ExprScope::Surface)
            .is_err_and(|e| e.message.contains("a weight must be a number"))
    );
}

/// Protects: the properties that preparation reads from a program: constant or not, its variables,
/// its type.
#[test]
fn programs_describe_themselves() {
    let surface = |source| compile(source, &names(), ExprScope::Surface).expect("compiles");
    assert_eq!(
        surface("size*[1, 2, t]").constant_value(),
        Some(Constant::Vector([0.5, 1.0, 1.0]))
    );
    assert_eq!(
        surface("t > 1 ? 3 : p.x").constant_value(),
        Some(Constant::Number(3.0))
    );
    let program = surface("mix([1, 0, 0], [0, 1, 0], n.y)");
    assert_eq!(program.constant_value(), None);
    assert!(
        program.is_vector()
            && program.uses_variable(Variable::Normal)
            && !program.uses_variable(Variable::Position)
    );
    assert_eq!(
        ProgramTable::from_program(&program).eval_vector(0, &hit()),
        DVec3::Y
    );
    assert_eq!(
        ProgramTable::from_program(&surface("u")).eval_vector(0, &hit()),
        DVec3::splat(0.25)
    );
}

/// Protects: programs in one table keep their own steps, constants, rows and variables, whatever
/// their sizes and order.
#[test]
fn programs_lie_side_by_side() {
    let sum = |count: usize| {
        (0..count)
            .map(|i| format!("({i}.25 + sin({i}*u))*p.y"))
            .collect::<Vec<_>>()
            .join(" + ")
    };
    let sources = [
        "u".to_owned(),
        sum(12),
        "mix([1, 0, 0], [0, 1, 0], n.y)".to_owned(),
        sum(100),
        "7".to_owned(),
        sum(3),
        "d".to_owned(),
    ];
    let compiled = sources.map(|source| {
        compile(&source, &names(), ExprScope::Surface).unwrap_or_else(|e| panic!("{source}: {e}"))
    });
    let mut together = ProgramTable::<f64>::default();
    let indices = compiled.each_ref().map(|program| together.add(program));
    assert_eq!(indices, [0, 1, 2, 3, 4, 5, 6]);
    for (index, program) in indices.into_iter().zip(&compiled) {
        let alone = ProgramTable::from_program(program);
        assert_eq!(
            together.eval_vector(index, &hit()),
            alone.eval_vector(0, &hit()),
            "program {index}"
        );
        assert_eq!(
            together.eval_scalar(index, &hit()),
            alone.eval_scalar(0, &hit()),
            "program {index}"
        );
        for variable in Variable::ALL {
            assert_eq!(
                together.uses_variable(index, variable),
                program.uses_variable(variable),
                "program {index}, {variable:?}"
            );
        }
    }
    assert_eq!(
        (
            together.eval_scalar(4, &hit()),
            together.eval_vector(2, &hit())
        ),
        (7.0, DVec3::Y)
    );
    assert!(
        together.uses_variable(6, Variable::Direction)
            && !together.uses_variable(6, Variable::U)
            && together.uses_variable(0, Variable::U)
    );
}

/// Protects: a program larger than the limit is an error, not a slow picture.
#[test]
fn oversized_programs_are_refused() {
    let terms: Vec<String> = (1..MAX_OPERATIONS).map(|i| format!("u*{i}")).collect();
    let error = compile(&terms.join("+"), &names(), ExprScope::Surface).expect_err("too large");
    assert!(
        error
            .message
            .contains(&format!("but at most {MAX_OPERATIONS} are allowed")),
        "{error}"
    );
}

/// Protects: a power that the limit declares zero equals the multiplied-out result to the bit.
#[test]
fn powers_vanish_where_their_squares_do() {
    for exponent in (0..600).chain([1023, 1024, 1025, 4095, 32_769, 65_535, 65_536]) {
        let limit = underflow_limit_of_power(exponent) as f32;
        let below = (0..200).map(|i| limit * (1.0 - 0.000_5 * i as f32)).chain([
            limit.next_down(),
            limit * 1e-3,
            0.0,
            f32::NAN,
        ]);
        for base in below
            .chain([limit, limit * 1.001, 0.999, 1.5])
            .flat_map(|x| [x, -x])
        {
            let (got, expected) = (
                integer_power(base, exponent, limit),
                Real::powi(base, exponent),
            );
            assert!(
                got.to_bits() == expected.to_bits() || expected.is_nan(),
                "{base}^{exponent} is {expected}, not {got}"
            );
        }
    }
    assert!(
        (0.5..1.0).contains(&underflow_limit_of_power(500))
            && underflow_limit_of_power(1) as f32 == 0.0,
        "a limit that never holds is of no use"
    );
}

/// Protects: bounds over a box hold the values at its points, for every operation of positions, in
/// boxes of any size; and they are the values' own range where each operation rises or falls.
#[test]
fn bounds_hold_every_value_in_a_box() {
    let mut state = 1;
    let mut number = || {
        state = splitmix64(state);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for source in [
        "exp(-4*dot(p, p))*(1 + 0.6*sin(7*p.x)*cos(6*p.y + 1)*sin(5*p.z + 2))",
        "max(0, noise(3*p) + 0.2)*exp(-p.y)",
        "fbm(p, 4) + turbulence(p, 3) + noise2(p.x, p.z) + fbm2(p.x, p.y, 2) + turbulence2(p.x, p.y, 2)",
        "length(p - [0.3, 0.2, 0.1]) < 0.6 ? 1 - p.y^2 : abs(p.z)^3",
        "smoothstep(0.1, 0.9, p.x)*mix(p.y, 2, p.z) + smoothstep(p.x, 1, p.y)",
        "floor(4*p.x) + ceil(p.y) + round(3*p.z) + fract(5*p.x) + sign(p.y) + step(0.2, p.z)",
        "checker(3*p.x, p.y) + (p.x > 0 && p.y < 0.2 || !p.z) + (p.x == p.y) + (p.x != 0)",
        "p.x/(2 + p.y) + 1/p.z + (p.x + 3)^p.y + (p % 0.4).x",
        "sqrt(p.x + 1.5) + ln(p.y + 2) + asin(0.9*p.x) + acos(p.z) + atan(p.y) + atan2(p.x, p.y) + tan(p.z)",
        "dot(normalize(p), cross(p, [1, 2, 3])) + length(p/2) + dot(p*[1, -2, 3], min(p, [p.z, p.x, p.y]) - max(p, 0.1))",
        "dot(p.x > 0.5 ? p : -p, mix(p, [1, 1, 1], 0.3)/(p + 4)) + 3^p.x + (-p.x)^2*p.y",
    ] {
        let program = compile_number(source, &names(), ExprScope::Medium)
            .unwrap_or_else(|e| panic!("{source}: {e}"));
        let programs = ProgramTable::<f64>::from_program(&program);
        for _ in 0..2000 {
            let least = DVec3::new(number(), number(), number()) * 2.0 - 1.0;
            let side = DVec3::new(number(), number(), number())
                * [2.0, 0.2, 0.01, 0.0][(number() * 4.0) as usize];
            let [low, high] = programs.bounds(0, [least, least + side]);
            for _ in 0..8 {
                let p = least + side * DVec3::new(number(), number(), number());
                let inputs = VariableValues {
                    p,
                    ..VariableValues::default()
                };
                let value = programs.eval_scalar(0, &inputs);
                let slack = 1e-12 * (1.0 + value.abs());
                assert!(
                    value.is_nan() || low <= value + slack && value - slack <= high,
                    "{source}: {value} at {p} outside of {low} to {high}, box {least} and {side}"
                );
            }
        }
    }
    for (source, expected) in [
        (
            "exp(-p.y) + 2*p.x",
            [libm::exp(-1.0) - 2.0, libm::exp(1.0) + 2.0],
        ),
        ("dot(p, p)", [0.0, 3.0]),
        ("p.x > 2 ? 5 : abs(p.z)", [0.0, 1.0]),
        ("length(p + 3)", [libm::sqrt(12.0), libm::sqrt(48.0)]),
        ("sin(0.1*p.x)", [-0.1, 0.1]),
        ("1/p.x", [f64::NEG_INFINITY, f64::INFINITY]),
    ] {
        let program = compile_number(source, &names(), ExprScope::Medium).expect("compiles");
        let found =
            ProgramTable::<f64>::from_program(&program).bounds(0, [DVec3::NEG_ONE, DVec3::ONE]);
        let is_same = |k: usize| found[k] == expected[k] || (found[k] - expected[k]).abs() < 1e-12;
        assert!(is_same(0) && is_same(1), "{source}: {found:?}");
    }
}
