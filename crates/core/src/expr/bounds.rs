//! Bounds of a program's value over a box of positions, by interval arithmetic (Moore, "Interval
//! Analysis", 1966). The density of a medium is thereby known to lie below its greatest value in
//! most places, where it need not be evaluated so often.

use core::array::from_fn;
use core::f64::consts::PI;

use glam::DVec3;
use raywright_bvh::Real;

use super::function::Operation;
use super::program::{ProgramTable, table_slice};
use super::run::run_operation;

/// Magnitude that gradient noise never reaches. Over all gradients at the corners of a lattice cell,
/// the greatest sum of their terms is 1.41 in space and 0.98 in the plane.
const NOISE: f64 = 1.5;

/// Least and greatest value of each of four registers.
type RowBounds = [[f64; 2]; 4];

const UNKNOWN: RowBounds = [[f64::NEG_INFINITY, f64::INFINITY]; 4];

impl<R: Real> ProgramTable<R> {
    /// Returns two numbers between which the value of a program lies at all positions in a box,
    /// within rounding; infinite where nothing is known. The program reads the position alone.
    pub(crate) fn bounds(&self, program: u32, [least, greatest]: [DVec3; 2]) -> [f64; 2] {
        let head = &self.headers[program as usize];
        let constants = table_slice(&self.registers, head.registers).as_flattened();
        let mut file: Vec<_> = constants
            .iter()
            .map(|number| [number.to_f64(); 2])
            .collect();
        if head.variable_rows != 0 {
            (0..3).for_each(|axis| file[axis] = [least[axis], greatest[axis]]);
        }
        for step in table_slice(&self.steps, head.steps) {
            let register = |index: usize| file.get(index).copied().unwrap_or_default();
            let operands = step
                .sources
                .map(|source| from_fn(|k| register(usize::from(source) + k)));
            let is_square = step.sources[0] == step.sources[1];
            let result = bound_operation(step.operation, operands, is_square);
            let (first, count) = (
                usize::from(step.destination),
                component_count(step.operation),
            );
            file[first..first + count].copy_from_slice(&result[..count]);
        }
        file[usize::from(head.result)]
    }
}

fn component_count(operation: Operation) -> usize {
    if operation.is_vector() { 3 } else { 1 }
}

/// Returns the bounds of an operation's result. `is_square`: whether the first two operands are the
/// same register.
fn bound_operation(operation: Operation, operands: [RowBounds; 4], is_square: bool) -> RowBounds {
    use Operation::*;
    let [a, b, c, _] = operands;
    let spans_zero = |[least, greatest]: [f64; 2]| !(least > 0.0 || greatest < 0.0);
    match operation {
        Sin | Cos => {
            // No slope is greater than one.
            let [middle, half] = [1.0, -1.0].map(|sign| 0.5 * (a[0][1] + sign * a[0][0]));
            let value = run_operation(operation, [[middle; 4]; 4])[0];
            [[(value - half).max(-1.0), (value + half).min(1.0)]; 4]
        }
        Noise | PlaneNoise => [[-NOISE, NOISE]; 4],
        Sum(_) | PlaneSum(_) => [[-2.0 * NOISE, 2.0 * NOISE]; 4],
        Turbulence(_) | PlaneTurbulence(_) => [[0.0, 2.0 * NOISE]; 4],
        Fract | Not | Equal | NotEqual | And | Or | Checker => [[0.0, 1.0]; 4],
        Smoothstep if a[0][0] != a[0][1] || b[0][0] != b[0][1] => [[0.0, 1.0]; 4],
        Atan2 => [[-PI, PI]; 4],
        Normalize => [[-1.0, 1.0]; 4],
        Dot => sum_products(a, b, is_square),
        Length => sum_products(a, a, true).map(|bounds| bounds.map(f64::sqrt)),
        Select | SelectVectors if !spans_zero(a[0]) => b,
        Select | SelectVectors if a[0] == [0.0; 2] => c,
        Select | SelectVectors => from_fn(|k| [b[k][0].min(c[k][0]), b[k][1].max(c[k][1])]),
        Tan | Modulo | Cross => UNKNOWN,
        Divide | DivideByNumber if spans_zero(b[0]) => UNKNOWN,
        DivideVectors if b[..3].iter().any(|&bounds| spans_zero(bounds)) => UNKNOWN,
        Power if a[0][0].is_nan() || a[0][0] <= 0.0 => UNKNOWN,
        Abs | WholePower(_) if spans_zero(a[0]) => {
            bound_at_ends(operation, operands).map(|[least, greatest]| [least.min(0.0), greatest])
        }
        _ => bound_at_ends(operation, operands),
    }
}

/// Returns the bounds of an operation that rises or falls with each operand: those of its results at
/// the operands' ends.
fn bound_at_ends(operation: Operation, operands: [RowBounds; 4]) -> RowBounds {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 4];
    for choice in 0..16_usize {
        let end = |k: usize| choice >> k & 1;
        if (0..4).any(|k| end(k) == 1 && operands[k].iter().all(|[least, most]| least == most)) {
            continue;
        }
        let row = run_operation(operation, from_fn(|k| operands[k].map(|ends| ends[end(k)])));
        for ([least, greatest], x) in bounds.iter_mut().zip(row).take(component_count(operation)) {
            if x.is_nan() {
                return UNKNOWN;
            }
            (*least, *greatest) = (least.min(x), greatest.max(x));
        }
    }
    bounds
}

/// Returns the bounds of the dot product of two vectors. `is_square`: whether they are the same.
fn sum_products(a: RowBounds, b: RowBounds, is_square: bool) -> RowBounds {
    let products = if is_square {
        a.map(|[least, greatest]| {
            let [nearest, farthest] = [least.max(-greatest).max(0.0), greatest.max(-least)];
            [nearest * nearest, farthest * farthest]
        })
    } else {
        bound_at_ends(
            Operation::MultiplyVectors,
            [a, b, [[0.0; 2]; 4], [[0.0; 2]; 4]],
        )
    };
    [[0, 1].map(|end| (0..3).map(|axis| products[axis][end]).sum()); 4]
}
