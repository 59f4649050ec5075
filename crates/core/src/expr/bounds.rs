//! Bounds of a program's value over a box of positions, by interval arithmetic (Moore, "Interval
//! Analysis", 1966). The density of a medium is thereby known to lie below its greatest value in
//! most places, where it need not be evaluated so often.

use core::array::from_fn;
use core::f64::consts::PI;

use glam::DVec3;
use raywright_bvh::Real;

use super::function::Operation;
use super::program::{ProgramTable, table_slice};
use super::run::{RegisterRow, run_operation};

/// Magnitude that gradient noise never reaches. Over all gradients at the corners of a lattice cell,
/// the greatest sum of their terms is 1.41 in space and 0.98 in the plane.
const NOISE: f64 = 1.5;

/// Least and greatest values of four registers.
type RowBounds = [RegisterRow<f64>; 2];

const UNKNOWN: RowBounds = [[f64::NEG_INFINITY; 4], [f64::INFINITY; 4]];

impl<R: Real> ProgramTable<R> {
    /// Returns two numbers between which the value of a program lies at all positions in a box,
    /// within rounding; infinite where nothing is known. The program reads the position alone.
    pub(crate) fn bounds(&self, program: u32, corners: [DVec3; 2]) -> [f64; 2] {
        let head = &self.headers[program as usize];
        let mut files: [Vec<RegisterRow<f64>>; 2] = corners.map(|corner| {
            let constants = table_slice(&self.registers, head.registers).iter();
            let mut rows: Vec<_> = constants.map(|row| row.map(R::to_f64)).collect();
            if head.variable_rows != 0 {
                rows[0] = corner.extend(0.0).to_array();
            }
            rows
        });
        for step in table_slice(&self.steps, head.steps) {
            let operands = step.sources.map(|source| {
                [0, 1].map(|end: usize| {
                    let flat = files[end].as_flattened();
                    from_fn(|k| flat.get(usize::from(source) + k).copied().unwrap_or(0.0))
                })
            });
            let is_square = step.sources[0] == step.sources[1];
            let result = bound_operation(step.operation, operands, is_square);
            let count = if step.operation.is_vector() { 3 } else { 1 };
            for (file, row) in files.iter_mut().zip(result) {
                let first = usize::from(step.destination);
                file.as_flattened_mut()[first..first + count].copy_from_slice(&row[..count]);
            }
        }
        files.map(|file| file.as_flattened()[usize::from(head.result)])
    }
}

/// Returns the bounds of an operation's result. `is_square`: whether the first two operands are the
/// same register.
fn bound_operation(operation: Operation, operands: [RowBounds; 4], is_square: bool) -> RowBounds {
    use Operation::*;
    let [a, b, c, _] = operands;
    let between = |least: f64, greatest: f64| [[least; 4], [greatest; 4]];
    let spans_zero =
        |[least, greatest]: RowBounds, k: usize| !(least[k] > 0.0 || greatest[k] < 0.0);
    match operation {
        Sin | Cos => {
            // No slope is greater than one.
            let [middle, half] = [1.0, -1.0].map(|sign| 0.5 * (a[1][0] + sign * a[0][0]));
            let value = run_operation(operation, [[middle; 4]; 4])[0];
            between((value - half).max(-1.0), (value + half).min(1.0))
        }
        Noise | PlaneNoise => between(-NOISE, NOISE),
        Sum(_) | PlaneSum(_) => between(-2.0 * NOISE, 2.0 * NOISE),
        Turbulence(_) | PlaneTurbulence(_) => between(0.0, 2.0 * NOISE),
        Fract | Not | Equal | NotEqual | And | Or | Checker => between(0.0, 1.0),
        Smoothstep if a[0][0] != a[1][0] || b[0][0] != b[1][0] => between(0.0, 1.0),
        Atan2 => between(-PI, PI),
        Normalize => between(-1.0, 1.0),
        Dot => sum_products(a, b, is_square),
        Length => sum_products(a, a, true).map(|row| row.map(f64::sqrt)),
        Select | SelectVectors if !spans_zero(a, 0) => b,
        Select | SelectVectors if (a[0][0], a[1][0]) == (0.0, 0.0) => c,
        Select | SelectVectors => [
            from_fn(|k| b[0][k].min(c[0][k])),
            from_fn(|k| b[1][k].max(c[1][k])),
        ],
        Tan | Modulo | Cross => UNKNOWN,
        Divide | DivideByNumber if spans_zero(b, 0) => UNKNOWN,
        DivideVectors if (0..3).any(|k| spans_zero(b, k)) => UNKNOWN,
        Power if a[0][0].is_nan() || a[0][0] <= 0.0 => UNKNOWN,
        Abs | WholePower(_) if spans_zero(a, 0) => {
            let [least, greatest] = bound_at_ends(operation, operands);
            [least.map(|x| x.min(0.0)), greatest]
        }
        _ => bound_at_ends(operation, operands),
    }
}

/// Returns the bounds of an operation that rises or falls with each operand: those of its results at
/// the operands' ends.
fn bound_at_ends(operation: Operation, operands: [RowBounds; 4]) -> RowBounds {
    let count = if operation.is_vector() { 3 } else { 1 };
    let [mut least, mut greatest] = [[f64::INFINITY; 4], [f64::NEG_INFINITY; 4]];
    for choice in 0..16_usize {
        let ends: [usize; 4] = from_fn(|k| choice >> k & 1);
        if (0..4).any(|k| ends[k] == 1 && operands[k][0] == operands[k][1]) {
            continue;
        }
        let row = run_operation(operation, from_fn(|k| operands[k][ends[k]]));
        for k in 0..count {
            if row[k].is_nan() {
                return UNKNOWN;
            }
            (least[k], greatest[k]) = (least[k].min(row[k]), greatest[k].max(row[k]));
        }
    }
    [least, greatest]
}

/// Returns the bounds of the dot product of two vectors. `is_square`: whether they are the same.
fn sum_products(a: RowBounds, b: RowBounds, is_square: bool) -> RowBounds {
    let mut sum = [0.0; 2];
    for k in 0..3 {
        let ends = [a[0][k] * b[0][k], a[1][k] * b[1][k]];
        let cross = [a[0][k] * b[1][k], a[1][k] * b[0][k]];
        let spans_zero = a[0][k] <= 0.0 && a[1][k] >= 0.0;
        let others = match (is_square, spans_zero) {
            (true, true) => [0.0; 2],
            (true, false) => ends,
            (false, _) => cross,
        };
        let all = [ends, others].concat();
        // NaN, of zero times infinity, is unknown too.
        if all.iter().any(|x| x.is_nan()) {
            return UNKNOWN;
        }
        sum[0] += all.iter().copied().fold(f64::INFINITY, f64::min);
        sum[1] += all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    }
    sum.map(|x| [x; 4])
}
