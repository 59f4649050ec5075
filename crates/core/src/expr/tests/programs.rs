//! Compiled programs against the meaning of each operation, and what they say about themselves.

use glam::DVec3;
use raywright_bvh::scalar::{Real, Vector};

use super::names;
use crate::expr::build::Builder;
use crate::expr::graph::Value;
use crate::expr::semantics::{floor, power, vanishing};
use crate::expr::{Constant, Inputs, MAX_OPERATIONS, Scope, Variable, compile, compile_number, parser};

fn hit() -> Inputs<f64> {
    Inputs {
        p: DVec3::new(1.5, 2.5, -3.5),
        n: DVec3::Y,
        d: DVec3::new(0.6, -0.8, 0.0),
        r: DVec3::new(0.6, 0.8, 0.0),
        l: DVec3::Z,
        o: DVec3::new(0.0, 1.0, 2.0),
        u: 0.25,
        v: 0.75,
        distance: 5.0,
        occluder_distance: f64::INFINITY,
        shadow: 0.5,
    }
}

/// Every variable reads its own input, and only in the scopes that have it.
#[test]
fn variables_belong_to_scopes() {
    for (source, scope, expected) in [
        ("p.x + 10*n.y + 100*d.x + r.y + o.z", Scope::Surface, 1.5 + 10.0 + 60.0 + 0.8 + 2.0),
        ("u + v + distance", Scope::Surface, 6.0),
        ("l.z + shadow", Scope::Light, 1.5),
        ("1/occluder_distance", Scope::Light, 0.0),
        ("d.y + o.z", Scope::Sky, 1.2),
        ("t*size", Scope::Sky, 1.0),
    ] {
        let program = compile_number(source, &names(), scope).unwrap_or_else(|e| panic!("{source}: {e}"));
        assert!((program.scalar(&hit()) - expected).abs() < 1e-14, "{source}");
    }
    for (source, scope) in [("l.x", Scope::Surface), ("shadow", Scope::Surface), ("p.x", Scope::Sky), ("d.x", Scope::Load)] {
        let error = compile(source, &names(), scope).expect_err(source);
        assert!(error.message.contains("does not exist"), "{source}: {error}");
    }
    assert!(compile_number("p", &names(), Scope::Surface).is_err_and(|e| e.message.contains("a weight must be a number")));
}

/// What the preparation asks a program: constant or not, which variables, which kind.
#[test]
fn programs_describe_themselves() {
    let surface = |source| compile(source, &names(), Scope::Surface).expect("compiles");
    assert_eq!(surface("size*[1, 2, t]").is_constant(), Some(Constant::Vector([0.5, 1.0, 1.0])));
    assert_eq!(surface("t > 1 ? 3 : p.x").is_constant(), Some(Constant::Number(3.0)));
    let program = surface("mix([1, 0, 0], [0, 1, 0], n.y)");
    assert_eq!(program.is_constant(), None);
    assert!(program.is_vector() && program.uses(Variable::Normal) && !program.uses(Variable::Position));
    assert_eq!(program.vector(&hit()), DVec3::Y);
    assert_eq!(surface("u").vector(&hit()), DVec3::splat(0.25));
}

/// A program larger than the limit is an error, not a slow picture.
#[test]
fn oversized_programs_are_refused() {
    let terms: Vec<String> = (1..MAX_OPERATIONS).map(|i| format!("u*{i}")).collect();
    let error = compile(&terms.join("+"), &names(), Scope::Surface).expect_err("too large");
    assert!(error.message.contains("the limit is"), "{error}");
}

/// The same hit in single precision.
fn narrow(hit: &Inputs<f64>) -> Inputs<f32> {
    let v = |v: DVec3| v.as_vec3();
    Inputs {
        p: v(hit.p),
        n: v(hit.n),
        d: v(hit.d),
        r: v(hit.r),
        l: v(hit.l),
        o: v(hit.o),
        u: hit.u as f32,
        v: hit.v as f32,
        distance: hit.distance as f32,
        occluder_distance: hit.occluder_distance as f32,
        shadow: hit.shadow as f32,
    }
}

/// The value by one operation after the other, without a program.
fn meaning<R: Real>(source: &str, inputs: &Inputs<R>) -> R::Vec3 {
    let names = names();
    let (builder, term) = parser::parse(source, Builder::new(&names, Scope::Light)).expect("parses");
    let mut values: Vec<Value<R>> = Vec::new();
    for operation in builder.graph.reachable(term.id) {
        let value = operation.apply(inputs, |id| values[id.index()]);
        values.push(value);
    }
    values.last().expect("an expression has a value").vector()
}

/// Equal bit for bit, but that one NaN is as good as another.
fn same<R: Real>(a: R::Vec3, b: R::Vec3) -> bool {
    (0..3).all(|axis| {
        let (a, b) = (a.axis(axis).to_f64(), b.axis(axis).to_f64());
        a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
    })
}

fn check(source: &str) {
    let program = compile(source, &names(), Scope::Light).unwrap_or_else(|e| panic!("{source}: {e}"));
    let (double, single) = (hit(), narrow(&hit()));
    let (got, wanted) = (program.vector(&double), meaning(source, &double));
    assert!(same::<f64>(got, wanted), "f64 {source}\n{got} is not {wanted}\n{program:?}");
    let (got, wanted) = (program.vector(&single), meaning(source, &single));
    assert!(same::<f32>(got, wanted), "f32 {source}\n{got} is not {wanted}\n{program:?}");
    assert_eq!(program.scalar(&single).to_bits(), got.x.to_bits(), "{source}");
}

/// Every step that takes several operations together, with its operands in every order.
#[test]
fn fused_steps_mean_what_their_parts_mean() {
    for source in [
        "u*v + distance",
        "distance + u*v",
        "u*v - distance",
        "distance - u*v",
        "(u + v)*distance - u",
        "u - (u + v)*distance",
        "u - distance*(u + v)",
        "0.5 - 0.5*dot(n, -d)",
        "dot(-n, d)*u + v",
        "u*dot(n, d) - v",
        "max(u, 0.2)^7",
        "max(0.2, u)^7",
        "u^2 + v^3 + shadow^-4 + distance^0",
        "clamp(u, v, 0.5)",
        "min(max(u, 0.1), v)",
        "-(-u) + -v",
        "3 - u*4",
        "u*v*distance + shadow",
        "shadow - u*v*distance",
        "shadow - dot(p, d)",
        "shadow + dot(p, d)*(u + v)",
        "distance*(u*v)^2 + v^2",
        "(u + v)*(u - v) - (u + v)",
        "-(u*v)*distance",
        "-(u - u) + -(p.x*0) + 0*-n.x",
        "-p*0 - n*0",
        "(p - d)*u - (p + d)*v",
        "length(p - o) + length(p - d)*0.5",
        "p + d*u",
        "d*u + p",
        "p + u*v",
        "p - u*[1, 2, 3]",
        "[1, 2, 3] + 0.7*max(0, d.x)^5",
        "0.7*max(0, d.x)^5 + p",
        "mix(p, d, u)",
        "mix([1, 2, 3], [3, 2, 1], checker(p.x, p.z))",
        "mix(p, d, checker(p.x*2, -p.z))",
        "mix(p/0, d, u < v) + mix(1/(u - 0.25), 2, step(v, u) == 0)",
        "u < v ? 1 : 2",
        "u > v ? p : d",
        "u <= v ? p : 0",
        "u && v ? p : d",
        "smoothstep(0.1, 0.9, u)*mix(u, v, shadow)",
        "normalize(p)*length(d)/distance",
        "cross(p, d).y + reflect(d, n).x",
        "noise(p) + fbm(p, 3) + turbulence(p*2, 2) + noise(u, v) + fbm2(u, v, 3) + turbulence2(u, v, 3)",
        "vec3(u)*vec3(u, v, 0) + [p.x, p.y, p.z]",
        "max(p, d) + min(p, 0) % 2 + floor(p) + fract(d)",
        "1/occluder_distance + 1/(u - 0.25)",
    ] {
        check(source);
    }
}

/// Rounding down without the processor's instruction for it is rounding down, and never to −0.
#[test]
fn floors_are_those_of_the_standard_library() {
    let magnitudes = [0.0, 1e-40, 0.3, 0.5, 1.0, 1.5, 2.0, 8_388_606.5, 8_388_607.5, 8_388_608.0, 1e20, f32::INFINITY];
    for x in magnitudes.into_iter().flat_map(|x| [x, x.next_up(), x.next_down(), -x, -x.next_down()]) {
        assert_eq!(floor(x).to_bits(), (x.floor() + 0.0).to_bits(), "{x}");
    }
    for x in [-0.0, 0.3, -0.3, -1.0, 4_503_599_627_370_495.5, -4_503_599_627_370_495.5, 1e300, f64::NEG_INFINITY] {
        assert_eq!(floor(x).to_bits(), (x.floor() + 0.0).to_bits(), "{x}");
    }
    assert!(floor(f32::NAN).is_nan());
}

/// A power that is known to be zero before it is multiplied out is what multiplying out gives, bit for bit.
#[test]
fn powers_vanish_where_their_squares_do() {
    for exponent in (0..600).chain([1023, 1024, 1025, 4095, 32_769, 65_535, 65_536]) {
        let limit = vanishing(exponent);
        let below = (0..200).map(|i| limit * (1.0 - 0.000_5 * i as f32)).chain([limit.next_down(), limit * 1e-3, 0.0, f32::NAN]);
        for base in below.chain([limit, limit * 1.001, 0.999, 1.5]).flat_map(|x| [x, -x]) {
            let (got, wanted) = (power(base, exponent, limit), Real::powi(base, exponent));
            assert!(got.to_bits() == wanted.to_bits() || wanted.is_nan(), "{base}^{exponent} is {wanted}, not {got}");
        }
    }
    assert!((0.5..1.0).contains(&vanishing(500)) && vanishing(1) == 0.0, "a limit that never holds is of no use");
}

/// Random expressions: programs and meaning agree bit for bit, in both precisions.
#[test]
fn programs_mean_what_the_operations_mean() {
    let mut random = Random(7);
    for _ in 0..3000 {
        let source = if random.below(2) == 0 { random.number(5) } else { random.vector(5) };
        check(&source);
    }
}

/// Writes expressions of a given depth.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n
    }

    fn one_of(&mut self, choices: &[&'static str]) -> &'static str {
        choices[self.below(choices.len())]
    }

    fn number(&mut self, depth: usize) -> String {
        if depth == 0 {
            return self.one_of(&["u", "v", "distance", "shadow", "p.x", "n.y", "d.z", "t", "0.5", "2", "1", "0"]).to_owned();
        }
        let depth = depth - 1;
        match self.below(12) {
            0..5 => format!("({} {} {})", self.number(depth), self.one_of(&["+", "-", "*", "/", "%"]), self.number(depth)),
            5 => format!("{}({})", self.one_of(&["-", "abs", "sqrt", "floor", "fract", "sin", "sign", "!"]), self.number(depth)),
            6 => format!("({})^{}", self.number(depth), self.one_of(&["2", "3", "-1", "0.5", "10"])),
            7 => {
                let name = self.one_of(&["mix", "clamp", "smoothstep", "if"]);
                format!("{name}({}, {}, {})", self.number(depth), self.number(depth), self.number(depth))
            }
            8 => {
                let name = self.one_of(&["min", "max", "step", "checker", "atan2", "noise"]);
                format!("{name}({}, {})", self.number(depth), self.number(depth))
            }
            9 => format!("dot({}, {})", self.vector(depth), self.vector(depth)),
            10 => format!("({}).{}", self.vector(depth), self.one_of(&["x", "y", "z"])),
            _ => {
                let comparison = self.one_of(&["<", "<=", ">", ">=", "==", "!=", "&&", "||"]);
                format!("({} {comparison} {} ? {} : 3)", self.number(0), self.number(depth), self.number(depth))
            }
        }
    }

    fn vector(&mut self, depth: usize) -> String {
        if depth == 0 {
            return self.one_of(&["p", "n", "d", "r", "l", "o", "[1, 2, 3]", "[0, u, v]"]).to_owned();
        }
        let depth = depth - 1;
        match self.below(9) {
            0..3 => format!("({} {} {})", self.vector(depth), self.one_of(&["+", "-", "*", "/"]), self.vector(depth)),
            3 => format!("({} {} {})", self.vector(depth), self.one_of(&["+", "-", "*", "/"]), self.number(depth)),
            4 => format!("({} {} {})", self.number(depth), self.one_of(&["+", "-", "*", "%"]), self.vector(depth)),
            5 => format!("mix({}, {}, {})", self.vector(depth), self.vector(depth), self.number(depth)),
            6 => format!("({} > {} ? {} : {})", self.number(0), self.number(depth), self.vector(depth), self.vector(depth)),
            7 => format!("[{}, {}, {}]", self.number(depth), self.number(depth), self.number(depth)),
            _ => format!("{}({})", self.one_of(&["-", "normalize", "abs"]), self.vector(depth)),
        }
    }
}
