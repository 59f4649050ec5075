//! Compiled expressions compared with handwritten closures for the same formula.
//!
//! Each formula is timed three times, in turns, on the same hits: the compiled program; a boxed
//! closure, as a renderer would store it with a material; and a closure that the compiler may
//! inline into the loop, which no renderer of scene files can have, as the lower bound. Two tables:
//! for few hits, which the branch predictor learns, and for more than it can learn, as in a
//! picture. `cargo bench --bench expressions` prints both.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::Instant;

use glam::Vec3;
use raywright_core::expr::{ExprScope, ProgramTable, VariableValues, compile};
use raywright_core::noise::{turbulence2, turbulence3};

type Closure = Box<dyn Fn(&VariableValues<f32>) -> Vec3 + Send + Sync>;

/// A closure over many hits.
type Inlined = Box<dyn Fn(&[VariableValues<f32>]) -> Vec3>;

/// One formula in three forms, as vectors; a number is a vector of equal components.
struct Case {
    name: &'static str,
    /// One program.
    program: ProgramTable<f32>,
    boxed: Closure,
    /// Sum over many hits by the inlined closure.
    inlined: Inlined,
}

macro_rules! case {
    ($name:literal, $scope:expr, $source:expr, |$i:ident| $body:expr) => {{
        let names = BTreeMap::from([("t".to_owned(), 6.0)]);
        let program = ProgramTable::from_program(
            &compile($source, &names, $scope).unwrap_or_else(|e| panic!("{}: {e}", $name)),
        );
        let formula = |$i: &VariableValues<f32>| -> Vec3 { $body };
        let inlined = move |hits: &[VariableValues<f32>]| {
            hits.iter().map(|hit| formula(black_box(hit))).sum()
        };
        Case {
            name: $name,
            program,
            boxed: black_box(Box::new(formula)),
            inlined: Box::new(inlined),
        }
    }};
}

/// At most sixteen squarings, as the language computes integer powers.
fn power(x: f32, exponent: u32) -> f32 {
    raywright_core::bvh::scalar::Real::powi(x, exponent)
}

fn mix(a: Vec3, b: Vec3, t: f32) -> Vec3 {
    a * (1.0 - t) + b * t
}

fn cases() -> Vec<Case> {
    vec![
        case!("weight", ExprScope::Surface, "0.5 - 0.5*dot(n, -d)", |i| Vec3::splat(0.5 - 0.5 * i.n.dot(-i.d))),
        case!("checker", ExprScope::Surface, "mix([0.9, 0.9, 0.8], [0.1, 0.2, 0.1], checker(p.x, p.z))", |i| {
            let parity = (i.p.x.floor() + i.p.z.floor()) * 0.5;
            if parity == parity.floor() { Vec3::new(0.9, 0.9, 0.8) } else { Vec3::new(0.1, 0.2, 0.1) }
        }),
        case!(
            "sky",
            ExprScope::Sky,
            "mix([0.23, 0.14, 0.34], [0.06, 0.28, 0.73], 1 - (1 - max(d.y, 0.1))^10)
             + 0.7*max(0, dot(d, [0.36, 0.48, 0.8]))^50 + 0.4*max(0.001, dot(d, [0.36, 0.48, 0.8]))^500",
            |i| {
                let g = i.d.dot(Vec3::new(0.36, 0.48, 0.8));
                mix(Vec3::new(0.23, 0.14, 0.34), Vec3::new(0.06, 0.28, 0.73), 1.0 - power(1.0 - i.d.y.max(0.1), 10))
                    + 0.7 * power(g.max(0.0), 50)
                    + 0.4 * power(g.max(0.001), 500)
            }
        ),
        case!("ball", ExprScope::Surface, BALL, |i| {
            let v = i.p - Vec3::new(0.0, 2.0, 5.0);
            let scale = 1.0 / (2.0 * (-1000.0 / 999.9) * (1.0 + 0.5 * v.x + 0.5 * v.y + v.z));
            let a3 = turbulence3::<f32>(v + 6.0 * Vec3::new(0.1, 0.1, 0.5), 8);
            let a2 = turbulence2(20.0 * v.x * scale + 0.6, 20.0 * v.y * scale + 3.0, 8);
            Vec3::new(0.8, 0.2, 0.1) * (1.1 * (0.5 + 0.5 * a3) + 0.4 * (0.5 + 0.5 * libm::sinf(i.p.x * i.p.y + a2)))
        }),
        case!("rim", ExprScope::Surface, "0.6*(1 - dot(n, d)^2)^2", |i| {
            let k = i.n.dot(i.d);
            let rim = 1.0 - k * k;
            Vec3::splat(0.6 * (rim * rim))
        }),
        case!(
            "stripes",
            ExprScope::Surface,
            "fract(4*u + 0.5*sin(6*v)) < 0.5 ? [1, 1, 1] : mix([0.2, 0, 0], [1, 0, 0], smoothstep(0, 5, length(p - o)))",
            |i| {
                let s = 4.0 * i.u + 0.5 * libm::sinf(6.0 * i.v);
                if s - s.floor() < 0.5 {
                    Vec3::ONE
                } else {
                    let t = ((i.p - i.o).length() / 5.0).clamp(0.0, 1.0);
                    mix(Vec3::new(0.2, 0.0, 0.0), Vec3::X, t * t * (3.0 - 2.0 * t))
                }
            }
        ),
        case!("polynomial", ExprScope::Surface, "0.3*u*u + 0.2*v*v + 1.5*u*v - u + 2*v + p.x*p.y*p.z", |i| Vec3::splat(
            0.3 * i.u * i.u + 0.2 * i.v * i.v + 1.5 * i.u * i.v - i.u + 2.0 * i.v + i.p.x * i.p.y * i.p.z
        )),
    ]
}

const BALL: &str =
    "[0.8, 0.2, 0.1] * (1.1*(0.5 + 0.5*turbulence(p - [0, 2, 5] + t*[0.1, 0.1, 0.5], 8))
    + 0.4*(0.5 + 0.5*sin(p.x*p.y + turbulence2(
        20*p.x/(2*-1000/999.9*(1 + 0.5*p.x + 0.5*(p.y - 2) + p.z - 5)) + 0.1*t,
        20*(p.y - 2)/(2*-1000/999.9*(1 + 0.5*p.x + 0.5*(p.y - 2) + p.z - 5)) + 0.5*t, 8))))";

/// Hits as in a picture: unlike each other, in no order.
fn hits(count: usize) -> Vec<VariableValues<f32>> {
    let mut state = 1_u32;
    let mut rng = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    };
    let mut vector = || Vec3::new(rng(), rng(), rng());
    let hit = |_| VariableValues {
        p: vector() * 1.2 + Vec3::new(0.0, 2.0, 4.0),
        n: vector().normalize(),
        d: vector().normalize(),
        o: vector(),
        u: vector().x,
        v: vector().x,
        ..VariableValues::default()
    };
    (0..count).map(hit).collect()
}

/// Nanoseconds per evaluation in one pass over the hits. Passes are short, so that few are
/// interrupted on a busy machine.
fn pass(hits: &[VariableValues<f32>], sum: &dyn Fn(&[VariableValues<f32>]) -> Vec3) -> f64 {
    let start = Instant::now();
    black_box(sum(black_box(hits)));
    start.elapsed().as_secs_f64() * 1e9 / hits.len() as f64
}

fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q).round() as usize]
}

/// Times the three forms in turns and prints medians, and the ratios with their quartiles.
fn table(cases: &[Case], hits: &[VariableValues<f32>], rounds: usize) {
    println!("{} hits, {rounds} rounds", hits.len());
    println!(
        "{:<12}{:>10}{:>10}{:>10}   {:<24}program / inlined",
        "ns", "program", "boxed", "inlined", "program / boxed"
    );
    for case in cases {
        let program = |hits: &[VariableValues<f32>]| -> Vec3 {
            hits.iter()
                .map(|hit| case.program.eval_vector(0, black_box(hit)))
                .sum()
        };
        let boxed = |hits: &[VariableValues<f32>]| -> Vec3 {
            hits.iter().map(|hit| (case.boxed)(black_box(hit))).sum()
        };
        let difference = (program(hits) - (case.inlined)(hits)).abs().max_element();
        assert!(
            difference <= 2e-3 * (case.inlined)(hits).abs().max_element(),
            "{}: forms differ by {difference}",
            case.name
        );
        let mut times = [const { Vec::new() }; 3];
        for _ in 0..rounds {
            times[0].push(pass(hits, &program));
            times[1].push(pass(hits, &boxed));
            times[2].push(pass(hits, &case.inlined));
        }
        let ratio = |with: usize| {
            let mut ratios: Vec<f64> = times[0]
                .iter()
                .zip(&times[with])
                .map(|(a, b)| a / b)
                .collect();
            let [low, middle, high] = [0.25, 0.5, 0.75].map(|q| quantile(&mut ratios, q));
            format!("{middle:5.2} ({low:.2} to {high:.2})")
        };
        let (to_boxed, to_inlined) = (ratio(1), ratio(2));
        let [a, b, c] = times.each_mut().map(|values| quantile(values, 0.5));
        println!(
            "{:<12}{a:>10.2}{b:>10.2}{c:>10.2}   {to_boxed:<24}{to_inlined}",
            case.name
        );
    }
}

fn main() {
    let cases = cases();
    table(&cases, &hits(256), 1001);
    table(&cases, &hits(4096), 201);
}
