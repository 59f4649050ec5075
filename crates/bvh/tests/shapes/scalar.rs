//! What a scalar does by itself.

use raywright_bvh::Real;

/// Protects: rounding down without the processor's instruction for it is rounding down, and never to −0.
#[test]
fn floors_are_those_of_the_standard_library() {
    let magnitudes = [0.0, 1e-40, 0.3, 0.5, 1.0, 1.5, 2.0, 8_388_606.5, 8_388_607.5, 8_388_608.0, 1e20, f32::INFINITY];
    for x in magnitudes.into_iter().flat_map(|x| [x, x.next_up(), x.next_down(), -x, -x.next_down()]) {
        assert_eq!(Real::floor(x).to_bits(), (x.floor() + 0.0).to_bits(), "{x}");
    }
    for x in [-0.0, 0.3, -0.3, -1.0, 4_503_599_627_370_495.5, -4_503_599_627_370_495.5, 1e300, f64::NEG_INFINITY] {
        assert_eq!(Real::floor(x).to_bits(), (x.floor() + 0.0).to_bits(), "{x}");
    }
    assert!(Real::floor(f32::NAN).is_nan());
}
