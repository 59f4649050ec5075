//! Table from display-linear values to 8-bit display codes. It replaces the power function of the
//! transfer curve and gives the same codes.
//!
//! A transfer curve is monotonic. The values of the same code form an interval, and 255 thresholds
//! define all codes. Each threshold is found by bisection over the bit patterns of `f32`, near a
//! value of the inverse curve. A coarse table gives the code at which a search starts.

use super::curve::{decode_transfer, encode_transfer, quantise_8_bit};
use crate::scene::TransferCurve;

/// Number of low bits of an `f32` that the coarse table ignores. An entry of that table covers a
/// 128th of an octave.
const BUCKET_SHIFT: u32 = 16;

/// Table that converts display-linear values to 8-bit codes by one transfer curve.
/// [`DisplayMap`](super::DisplayMap) contains it.
#[derive(Clone, Debug)]
pub(crate) struct CodeTable {
    /// Thresholds: entry k is the least value whose code is greater than k. The last entry is
    /// infinite.
    next: [f32; 256],
    /// Coarse table: 8-bit code of the least value that each entry covers.
    first: Vec<u8>,
}

impl CodeTable {
    /// Builds the table of a transfer curve, by some thousand evaluations of the curve and its
    /// inverse.
    pub fn new(curve: TransferCurve) -> Self {
        let code = |bits: u32| code_by_transfer_curve(curve, f32::from_bits(bits));
        let one = 1.0_f32.to_bits();
        let mut next = [f32::INFINITY; 256];
        for (k, slot) in next.iter_mut().enumerate().take(255) {
            // The threshold is within four bit patterns of the inverse curve's value, as the test
            // `every_boundary_is_exact` confirms. Invariant: code(low) <= k < code(high).
            let near = (decode_transfer(curve, (k as f64 + 0.5) / 255.0) as f32).to_bits();
            let (mut low, mut high) = (near - 4, near + 4);
            while high - low > 1 {
                let middle = low + (high - low) / 2;
                if usize::from(code(middle)) > k {
                    high = middle
                } else {
                    low = middle
                }
            }
            *slot = f32::from_bits(high);
        }
        // Buckets and thresholds ascend, so one pass suffices.
        let mut code = 0_u8;
        let first = |bucket: u32| {
            while f32::from_bits(bucket << BUCKET_SHIFT) >= next[usize::from(code)] {
                code += 1;
            }
            code
        };
        Self {
            next,
            first: (0..=one >> BUCKET_SHIFT).map(first).collect(),
        }
    }

    /// Returns the 8-bit code of a display-linear value in [0, 1].
    #[inline]
    pub fn code(&self, value: f32) -> u8 {
        // -0.0 plus 0.0 is 0.0, whose bits are in the table.
        let bucket = ((value + 0.0).to_bits() >> BUCKET_SHIFT) as usize;
        let mut code = self.first.get(bucket).copied().unwrap_or(u8::MAX);
        while value >= self.next[usize::from(code)] {
            code += 1;
        }
        code
    }
}

/// Returns the 8-bit code of a display-linear value, computed by the transfer curve itself. The
/// table must give the same code.
fn code_by_transfer_curve(curve: TransferCurve, value: f32) -> u8 {
    quantise_8_bit(encode_transfer(curve, f64::from(value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [TransferCurve; 3] = [
        TransferCurve::Srgb,
        TransferCurve::Gamma22,
        TransferCurve::None,
    ];

    /// Protects: the table equals the definition at every code boundary, and at 32 neighbours on
    /// either side.
    #[test]
    fn every_boundary_is_exact() {
        for curve in CURVES {
            let table = CodeTable::new(curve);
            for code in 0..255_u8 {
                let boundary = table.next[usize::from(code)].to_bits();
                assert_eq!(
                    code_by_transfer_curve(curve, f32::from_bits(boundary - 1)),
                    code,
                    "{curve:?} below {boundary:#x}"
                );
                assert_eq!(
                    code_by_transfer_curve(curve, f32::from_bits(boundary)),
                    code + 1,
                    "{curve:?} at {boundary:#x}"
                );
                for bits in boundary - 32..=(boundary + 32).min(1.0_f32.to_bits()) {
                    let value = f32::from_bits(bits);
                    assert_eq!(
                        table.code(value),
                        code_by_transfer_curve(curve, value),
                        "{curve:?} {bits:#x}"
                    );
                }
            }
        }
    }

    /// Protects: the table equals the definition at bucket borders and at a million values of all
    /// sizes, zero and subnormal ones included.
    #[test]
    fn values_between_boundaries_are_exact() {
        let one = 1.0_f32.to_bits();
        let buckets = (0..=one >> BUCKET_SHIFT)
            .flat_map(|b| [b << BUCKET_SHIFT, (b << BUCKET_SHIFT).saturating_sub(1)]);
        let spread = (0..=one).step_by(1_021);
        let bits: Vec<u32> = buckets.chain(spread).chain([0, 1, one - 1, one]).collect();
        for curve in CURVES {
            let table = CodeTable::new(curve);
            for &bits in &bits {
                let value = f32::from_bits(bits);
                assert_eq!(
                    table.code(value),
                    code_by_transfer_curve(curve, value),
                    "{curve:?} {bits:#x}"
                );
            }
            assert_eq!(table.code(-0.0), 0);
        }
    }
}
