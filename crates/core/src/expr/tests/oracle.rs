//! Compiled programs against a direct evaluation of random trees, which defines the meaning of an
//! expression as briefly as possible.

use glam::DVec3;
use raywright_bvh::scalar::{Real, Vector};

use super::{hit, names, narrow};
use crate::expr::run::modulo_with_sign_of_divisor;
use crate::expr::{ExprScope, ProgramTable, VariableValues, compile};
use crate::noise;

/// An expression: a number, a variable, or an operator or function of others.
#[derive(Clone, Debug, PartialEq)]
enum ExprTree {
    Number(f64),
    Name(&'static str),
    Of(&'static str, Vec<ExprTree>),
}

use ExprTree::{Name, Number, Of};

/// A number in all components, or a vector.
type OracleValue<R> = (bool, [R; 3]);

const COMPARISONS: [&str; 8] = ["<", "<=", ">", ">=", "==", "!=", "&&", "||"];

impl ExprTree {
    /// Returns the source text, in parentheses throughout.
    fn source(&self) -> String {
        let Of(name, parts) = self else {
            return match self {
                Number(x) => format!("{x}"),
                Name(name) | Of(name, _) => (*name).to_owned(),
            };
        };
        let parts: Vec<String> = parts.iter().map(Self::source).collect();
        match (*name, parts.as_slice()) {
            ("[]", _) => format!("[{}]", parts.join(", ")),
            ("?", [c, a, b]) => format!("({c} ? {a} : {b})"),
            (".x" | ".y" | ".z", [v]) => format!("({v}){name}"),
            ("-" | "!", [a]) => format!("({name}{a})"),
            (name, [a, b]) if !name.starts_with(char::is_alphabetic) => format!("({a} {name} {b})"),
            _ => format!("{name}({})", parts.join(", ")),
        }
    }

    /// Returns the part of the tree that gives its value: the branch of a choice that is always
    /// taken, or either of two equal branches.
    fn settled(&self) -> &Self {
        match self {
            Of("?", parts) if parts[1] == parts[2] => parts[1].settled(),
            Of("mix", parts) if parts[0] == parts[1] && parts[2].chooses() => parts[0].settled(),
            Of("?", parts) if parts[0].is_constant() => {
                match parts[0].value(&VariableValues::<f64>::default()).1[0] {
                    c if c.abs() > 0.0 => parts[1].settled(),
                    _ => parts[2].settled(),
                }
            }
            _ => self,
        }
    }

    fn is_constant(&self) -> bool {
        match self.settled() {
            Number(_) => true,
            Name(name) => *name == "t",
            Of(_, parts) => parts.iter().all(Self::is_constant),
        }
    }

    /// Whether the value is 0 or 1 but not constant, so that an interpolation by it is a choice.
    fn chooses(&self) -> bool {
        let settled = self.settled();
        matches!(settled, Of(name, _) if COMPARISONS.contains(name) || ["!", "step", "checker"].contains(name))
            && !settled.is_constant()
    }

    fn value<R: Real>(&self, hit: &VariableValues<R>) -> OracleValue<R> {
        let vector = |v: R::Vec3| (true, [v.x(), v.y(), v.z()]);
        let (name, parts) = match self {
            Number(x) => return (false, [R::from_f64(*x); 3]),
            Name("t") => return (false, [R::from_f64(2.0); 3]),
            Name("p") => return vector(hit.p),
            Name("n") => return vector(hit.n),
            Name("d") => return vector(hit.d),
            Name("o") => return vector(hit.o),
            Name("u") => return (false, [hit.u; 3]),
            Name("v") => return (false, [hit.v; 3]),
            Name(name) => {
                return (
                    false,
                    [if *name == "shadow" {
                        hit.shadow
                    } else {
                        hit.occluder_distance
                    }; 3],
                );
            }
            Of(name, parts) => (*name, parts),
        };
        let values: Vec<OracleValue<R>> = parts.iter().map(|part| part.value(hit)).collect();
        let number = |i: usize| values[i].1[0];
        let point = |i: usize| R::Vec3::new(values[i].1[0], values[i].1[1], values[i].1[2]);
        let truth = |value: bool| if value { R::ONE } else { R::ZERO };
        match name {
            "[]" => (true, [number(0), number(1), number(2)]),
            ".x" | ".y" | ".z" => (
                false,
                [values[0].1[(name.as_bytes()[1] - b'x') as usize]; 3],
            ),
            "?" => (
                values[1].0 || values[2].0,
                if number(0).abs() > R::ZERO {
                    values[1].1
                } else {
                    values[2].1
                },
            ),
            "mix" if parts[2].chooses() => (
                values[0].0 || values[1].0,
                if number(2) == R::ONE {
                    values[1].1
                } else {
                    values[0].1
                },
            ),
            "dot" => (false, [point(0).dot(point(1)); 3]),
            "length" => (false, [point(0).dot(point(0)).sqrt(); 3]),
            "normalize" => vector(point(0) * (R::ONE / point(0).dot(point(0)).sqrt())),
            "cross" => vector(point(0).cross(point(1))),
            "reflect" => vector(point(0) - point(1) * (point(0).dot(point(1)) * R::from_f32(2.0))),
            "noise" if values[0].0 => (false, [noise::noise3(point(0)); 3]),
            "noise" => (false, [noise::noise2(number(0), number(1)); 3]),
            "fbm" => (false, [noise::fbm3(point(0), 3); 3]),
            "turbulence" => (false, [noise::turbulence2(number(0), number(1), 2); 3]),
            _ => {
                let component = |axis: usize| {
                    let x: Vec<R> = values.iter().map(|value| value.1[axis]).collect();
                    match (name, x.as_slice()) {
                        ("-", &[a]) => -a,
                        ("!", &[a]) => truth(a == R::ZERO || a.is_nan()),
                        ("abs", &[a]) => a.abs(),
                        ("sqrt", &[a]) => a.sqrt(),
                        ("sin", &[a]) => a.sin(),
                        ("floor", &[a]) => a.floor() + R::ZERO,
                        ("fract", &[a]) => {
                            let (below_one, fraction) =
                                (R::ONE - R::ROUNDOFF, a - (a.floor() + R::ZERO));
                            if fraction > below_one {
                                below_one
                            } else {
                                fraction
                            }
                        }
                        ("+", &[a, b]) => a + b,
                        ("-", &[a, b]) => a - b,
                        ("*", &[a, b]) => a * b,
                        ("/", &[a, b]) => a / b,
                        ("%", &[a, b]) => modulo_with_sign_of_divisor(a, b),
                        ("^", &[a, b]) if b == R::from_f32(0.5) => a.powf(b),
                        ("^", &[a, b]) if b < R::ZERO => R::ONE / a.powi((-b).to_f32() as u32),
                        ("^", &[a, b]) => a.powi(b.to_f32() as u32),
                        ("min", &[a, b]) => {
                            if b < a || a.is_nan() {
                                b
                            } else {
                                a
                            }
                        }
                        ("max", &[a, b]) => {
                            if b > a || a.is_nan() {
                                b
                            } else {
                                a
                            }
                        }
                        ("step", &[a, b]) => R::ONE - truth(b < a),
                        ("atan2", &[a, b]) => a.atan2(b),
                        ("checker", &[a, b]) => {
                            let half = (a.floor() + b.floor()) * R::from_f32(0.5);
                            truth(half - half.floor() > R::ZERO)
                        }
                        ("<", &[a, b]) => truth(a < b),
                        ("<=", &[a, b]) => truth(a <= b),
                        (">", &[a, b]) => truth(a > b),
                        (">=", &[a, b]) => truth(a >= b),
                        ("==", &[a, b]) => truth(a == b),
                        ("!=", &[a, b]) => truth(a != b),
                        ("&&", &[a, b]) => truth(a.abs() > R::ZERO && b.abs() > R::ZERO),
                        ("||", &[a, b]) => truth(a.abs() > R::ZERO || b.abs() > R::ZERO),
                        ("mix", &[a, b, t]) => a * (R::ONE - t) + b * t,
                        ("clamp", &[a, low, high]) => {
                            let raised = if low > a || a.is_nan() { low } else { a };
                            if high < raised || raised.is_nan() {
                                high
                            } else {
                                raised
                            }
                        }
                        ("smoothstep", &[low, high, a]) => {
                            let t = (a - low) / (high - low);
                            let t = if t <= R::ZERO || t.is_nan() {
                                R::ZERO
                            } else if t > R::ONE {
                                R::ONE
                            } else {
                                t
                            };
                            t * t * (R::from_f32(3.0) - R::from_f32(2.0) * t)
                        }
                        (name, x) => panic!("{name} of {x:?}"),
                    }
                };
                (
                    values.iter().any(|value| value.0),
                    [component(0), component(1), component(2)],
                )
            }
        }
    }
}

/// Generates trees of at most a given depth.
struct ExprRng {
    state: u64,
    /// Whether trees contain constants, which are folded in f64 whatever the renderer's scalar.
    constants: bool,
}

impl ExprRng {
    fn below(&mut self, n: usize) -> usize {
        self.state = self
            .state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.state >> 33) as usize % n
    }

    fn one_of(&mut self, choices: &[&'static str]) -> &'static str {
        choices[self.below(choices.len())]
    }

    fn numbers(&mut self, depth: usize, count: usize) -> Vec<ExprTree> {
        (0..count).map(|_| self.number(depth)).collect()
    }

    fn number(&mut self, depth: usize) -> ExprTree {
        if depth == 0 {
            let constants = [0.0, 0.1, 0.5, 1.0, 2.0, 3.7];
            return match self.below(if self.constants { 4 } else { 2 }) {
                0 => Name(self.one_of(&["u", "v", "shadow", "occluder_distance"])),
                1 => Of(
                    self.one_of(&[".x", ".y", ".z"]),
                    vec![Name(self.one_of(&["p", "n", "d", "o"]))],
                ),
                2 => Name("t"),
                _ => Number(constants[self.below(constants.len())]),
            };
        }
        let depth = self.below(depth);
        match self.below(13) {
            0..5 => Of(
                self.one_of(&["+", "-", "*", "/", "%"]),
                self.numbers(depth, 2),
            ),
            5 => Of(
                self.one_of(&["-", "!", "abs", "sqrt", "sin", "floor", "fract"]),
                self.numbers(depth, 1),
            ),
            6 => {
                let exponents = [0.0, 1.0, 2.0, 3.0, 50.0, 500.0, 0.5, -1.0, -4.0];
                let exponent = Number(exponents[self.below(exponents.len())]);
                Of("^", vec![self.number(depth), exponent])
            }
            7 => Of(
                self.one_of(&["mix", "clamp", "smoothstep", "?"]),
                self.numbers(depth, 3),
            ),
            8 => Of(
                self.one_of(&["min", "max", "step", "checker", "atan2", "noise"]),
                self.numbers(depth, 2),
            ),
            9 => Of("dot", vec![self.vector(depth), self.vector(depth)]),
            10 => Of(
                self.one_of(&[".x", ".y", ".z", "length", "noise"]),
                vec![self.vector(depth)],
            ),
            11 => Of(
                "mix",
                vec![
                    self.number(depth),
                    self.number(depth),
                    self.comparison(depth),
                ],
            ),
            _ => Of(
                "?",
                vec![
                    self.comparison(depth),
                    self.number(depth),
                    self.number(depth),
                ],
            ),
        }
    }

    fn comparison(&mut self, depth: usize) -> ExprTree {
        Of(self.one_of(&COMPARISONS), self.numbers(depth, 2))
    }

    fn vector(&mut self, depth: usize) -> ExprTree {
        if depth == 0 {
            return Name(self.one_of(&["p", "n", "d", "o"]));
        }
        let depth = self.below(depth);
        match self.below(10) {
            0..3 => {
                let operator = self.one_of(&["+", "-", "*", "/", "%", "min", "max"]);
                Of(operator, vec![self.vector(depth), self.vector(depth)])
            }
            3 => Of(
                self.one_of(&["+", "-", "*", "/", "%", "min"]),
                vec![self.vector(depth), self.number(depth)],
            ),
            4 => Of(
                self.one_of(&["+", "-", "*", "/", "%", "max"]),
                vec![self.number(depth), self.vector(depth)],
            ),
            5 => Of(
                "mix",
                vec![
                    self.vector(depth),
                    self.number(depth),
                    self.comparison(depth),
                ],
            ),
            6 => Of(
                self.one_of(&["mix", "smoothstep"]),
                vec![self.vector(depth), self.vector(depth), self.number(depth)],
            ),
            7 => Of(
                "?",
                vec![
                    self.comparison(depth),
                    self.vector(depth),
                    self.number(depth),
                ],
            ),
            8 => Of("[]", self.numbers(depth, 3)),
            _ => {
                let function = self.one_of(&["-", "normalize", "abs", "floor", "cross", "reflect"]);
                let count = if ["cross", "reflect"].contains(&function) {
                    2
                } else {
                    1
                };
                Of(function, (0..count).map(|_| self.vector(depth)).collect())
            }
        }
    }
}

/// Whether two values are equal to the bit; any two NaN count as equal.
fn same<R: Real>(program: R::Vec3, walk: [R; 3]) -> bool {
    (0..3).all(|axis| {
        let (a, b) = (program.component(axis).to_f64(), walk[axis].to_f64());
        a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
    })
}

fn check<R: Real>(tree: &ExprTree, hits: &[VariableValues<R>]) {
    let source = tree.source();
    let program =
        compile(&source, &names(), ExprScope::Light).unwrap_or_else(|e| panic!("{source}: {e}"));
    let programs = ProgramTable::from_program(&program);
    for hit in hits {
        let (is_vector, walk) = tree.value(hit);
        let (vector, scalar) = (programs.eval_vector(0, hit), programs.eval_scalar(0, hit));
        assert!(
            same::<R>(vector, walk),
            "{source}\n{vector:?} is not {walk:?}\n{program:?}"
        );
        assert_eq!(
            (program.is_vector(), scalar.to_f64().to_bits()),
            (is_vector, vector.x().to_f64().to_bits()),
            "{source}"
        );
    }
}

/// Hits with all kinds of numbers: whole, negative, zero of both signs, infinite.
fn hits() -> Vec<VariableValues<f64>> {
    let v = DVec3::new;
    let zeros = VariableValues {
        p: v(0.0, -0.0, 1.0),
        n: v(-0.0, 0.0, -1.0),
        d: v(1.0, 0.0, 0.0),
        u: -0.0,
        ..VariableValues::default()
    };
    vec![
        hit(),
        zeros,
        VariableValues {
            p: v(-7.25, 0.3, 1e-3),
            o: v(2.0, -2.0, 0.1),
            u: -1.5,
            v: 3.0,
            occluder_distance: 0.7,
            ..hit()
        },
    ]
}

/// Protects: constant folding, sharing, fused steps and register reuse change no bit of a value,
/// not even the sign of a zero.
#[test]
fn programs_mean_what_their_trees_mean() {
    let hits = hits();
    let mut rng = ExprRng {
        state: 7,
        constants: true,
    };
    for i in 0..20_000 {
        let depth = 1 + i % 7;
        let tree = if i % 2 == 0 {
            rng.number(depth)
        } else {
            rng.vector(depth)
        };
        check::<f64>(&tree, &hits);
    }
}

/// Protects: the same holds in f32, without constants, which are folded in f64.
#[test]
fn programs_mean_what_their_trees_mean_in_single_precision() {
    let hits: Vec<VariableValues<f32>> = hits().iter().map(narrow).collect();
    let mut rng = ExprRng {
        state: 11,
        constants: false,
    };
    for i in 0..20_000 {
        let depth = 1 + i % 7;
        let tree = if i % 2 == 0 {
            rng.number(depth)
        } else {
            rng.vector(depth)
        };
        check::<f32>(&tree, &hits);
    }
}
