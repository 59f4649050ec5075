//! 8-bit codes of display-linear values by table: exactly what the transfer curve gives, without
//! its power.
//!
//! A curve never falls, so the values of one code are an interval, and 255 thresholds say
//! everything about it. They are found by bisection over the bit patterns of f32 with the curve
//! itself, near where its inverse has them, and a coarse table tells where to start looking.

use super::curve::{decode, encode, quantise};
use crate::scene::TransferCurve;

/// Bits of an f32 below those that index the coarse table: buckets of a 128th of an octave.
const BUCKET_SHIFT: u32 = 16;

/// The codes of one transfer curve.
#[derive(Clone, Debug)]
pub struct CodeTable {
    /// Entry k: the least value whose code is above k; infinite for the last.
    next: [f32; 256],
    /// Code of the first value of each bucket.
    first: Vec<u8>,
}

impl CodeTable {
    /// The table of a curve; costs some thousand evaluations of it and of its inverse.
    pub fn new(curve: TransferCurve) -> Self {
        let code = |bits: u32| plain_code(curve, f32::from_bits(bits));
        let one = 1.0_f32.to_bits();
        let mut next = [f32::INFINITY; 256];
        for (k, slot) in next.iter_mut().enumerate().take(255) {
            // Where the inverse has it, but for its rounding: `every_boundary_is_exact` holds that
            // this is enough for all of them. Invariant: code(low) <= k < code(high).
            let near = (decode(curve, (k as f64 + 0.5) / 255.0) as f32).to_bits();
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
        // Both ascend, so that one goes along with the other.
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

    /// Code of a value in [0, 1].
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

/// The definition that the table reproduces.
fn plain_code(curve: TransferCurve, value: f32) -> u8 {
    quantise(encode(curve, f64::from(value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [TransferCurve; 3] = [
        TransferCurve::Srgb,
        TransferCurve::Gamma22,
        TransferCurve::None,
    ];

    /// Protects: the table is the definition at every place where a code begins, and at 32
    /// neighbours on either side.
    #[test]
    fn every_boundary_is_exact() {
        for curve in CURVES {
            let table = CodeTable::new(curve);
            for code in 0..255_u8 {
                let boundary = table.next[usize::from(code)].to_bits();
                assert_eq!(
                    plain_code(curve, f32::from_bits(boundary - 1)),
                    code,
                    "{curve:?} below {boundary:#x}"
                );
                assert_eq!(
                    plain_code(curve, f32::from_bits(boundary)),
                    code + 1,
                    "{curve:?} at {boundary:#x}"
                );
                for bits in boundary - 32..=(boundary + 32).min(1.0_f32.to_bits()) {
                    let value = f32::from_bits(bits);
                    assert_eq!(
                        table.code(value),
                        plain_code(curve, value),
                        "{curve:?} {bits:#x}"
                    );
                }
            }
        }
    }

    /// Protects: the table is the definition at bucket borders and at a million values of all
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
                    plain_code(curve, value),
                    "{curve:?} {bits:#x}"
                );
            }
            assert_eq!(table.code(-0.0), 0);
        }
    }
}
