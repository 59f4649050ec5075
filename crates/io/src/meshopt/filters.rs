//! Filters of meshoptimizer, applied in place to decoded elements.

use super::{PacketFault, WRONG_STRIDE};

/// Applies `change` to each element, which consists of four integers. An element of `stride` bytes
/// has integers of one byte (stride 4) or of two bytes (stride 8).
fn for_each_element(
    stride: usize,
    bytes: &mut [u8],
    mut change: impl FnMut([i32; 4]) -> Option<[i32; 4]>,
) -> Result<(), PacketFault> {
    let undefined = "a compressed element is no valid direction or colour";
    match stride {
        4 => {
            for element in bytes.as_chunks_mut::<4>().0 {
                let found = change(element.map(|byte| i32::from(byte as i8))).ok_or(undefined)?;
                *element = found.map(|number| number as u8);
            }
            Ok(())
        }
        8 => {
            for element in bytes.as_chunks_mut::<8>().0 {
                let numbers = core::array::from_fn(|i| {
                    i32::from(i16::from_le_bytes([element[2 * i], element[2 * i + 1]]))
                });
                let found = change(numbers).ok_or(undefined)?;
                for (bytes, number) in element.as_chunks_mut::<2>().0.iter_mut().zip(found) {
                    *bytes = (number as i16).to_le_bytes();
                }
            }
            Ok(())
        }
        _ => Err(WRONG_STRIDE),
    }
}

/// Multiplies a number by a scale and rounds the product to the nearest integer. For a positive
/// scale, halves are rounded away from 0.
fn scale_and_round(x: f32, scale: f32) -> i32 {
    (x * scale + 0.5_f32.copysign(x)) as i32
}

/// Decodes unit vectors from the octahedral map. The four integers of an element are:
/// - two coordinates in the map;
/// - the integer that stands for the value 1;
/// - an integer that stays unchanged.
pub(crate) fn decode_octahedral(stride: usize, bytes: &mut [u8]) -> Result<(), PacketFault> {
    let maximum = if stride == 4 { 127.0 } else { 32767.0 };
    for_each_element(stride, bytes, |[x, y, one, fourth]| {
        let [mut x, mut y, one] = [x, y, one].map(|number| number as f32);
        let z = one - x.abs() - y.abs();
        // The lower half of the octahedron is folded over the edges.
        let fold = z.min(0.0);
        x += if x >= 0.0 { fold } else { -fold };
        y += if y >= 0.0 { fold } else { -fold };
        let length = (x * x + y * y + z * z).sqrt();
        let [x, y, z] = [x, y, z].map(|number| scale_and_round(number, maximum / length));
        (length > 0.0).then_some([x, y, z, fourth])
    })
}

/// Decodes unit quaternions. The four integers of an element are:
/// - three components of the quaternion, without the largest component;
/// - an integer with the index of the largest component in its two lowest bits. With both bits set,
///   this integer is the code of 1/√2, the greatest value of the three components.
pub(crate) fn decode_quaternions(stride: usize, bytes: &mut [u8]) -> Result<(), PacketFault> {
    if stride != 8 {
        return Err(WRONG_STRIDE);
    }
    for_each_element(stride, bytes, |[x, y, z, code]| {
        let one = (code | 3) as f32;
        let scale = 32767.0 / 2.0_f32.sqrt() / one;
        let [x, y, z] = [x, y, z].map(|number| number as f32);
        let largest = (one * one * 2.0 - x * x - y * y - z * z).max(0.0).sqrt();
        let mut found = [
            scale_and_round(x, scale),
            scale_and_round(y, scale),
            scale_and_round(z, scale),
            scale_and_round(largest, scale),
        ];
        found.rotate_right(((code & 3) as usize + 1) % 4);
        Some(found)
    })
}

/// Decodes floats from an 8-bit exponent and a 24-bit mantissa each.
pub(crate) fn decode_exponential(stride: usize, bytes: &mut [u8]) -> Result<(), PacketFault> {
    if !stride.is_multiple_of(4) {
        return Err(WRONG_STRIDE);
    }
    for word in bytes.as_chunks_mut::<4>().0 {
        let code = i32::from_le_bytes(*word);
        let power = f32::from_bits((((code >> 24) + 127) as u32) << 23);
        *word = (power * (code << 8 >> 8) as f32).to_le_bytes();
    }
    Ok(())
}

/// Decodes colours from luma and two chroma differences. The bit depth of a colour follows from the
/// highest set bit of its alpha.
pub(crate) fn decode_colours(stride: usize, bytes: &mut [u8]) -> Result<(), PacketFault> {
    let most = if stride == 4 { 255 } else { 65535 };
    for_each_element(stride, bytes, |[y, orange, green, alpha]| {
        let (y, alpha) = (y & most, alpha & most);
        let bits = alpha.checked_ilog2()? + 1;
        let all = (1 << bits) - 1;
        // Alpha has one bit less than the other channels.
        let alpha = alpha << 1 & all | alpha & 1;
        let scale = most as f32 / all as f32;
        let found = [y + orange - green, y + green, y - orange - green, alpha]
            .map(|number| number as f32 * scale + 0.5);
        found
            .iter()
            .all(|number| number.abs() < 2.0_f32.powi(31))
            .then(|| found.map(|number| number as i32))
    })
}
