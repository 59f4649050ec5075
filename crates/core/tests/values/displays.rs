//! Tone maps of colours, which reveal a wrong entry or a transposed matrix; greys do not.

use raywright_core::display::Display;
use raywright_core::scene::{ToneMap, TransferCurve};

fn shown(tone_map: ToneMap, curve: TransferCurve, rgb: [f32; 3]) -> [f32; 3] {
    Display {
        tone_map,
        curve,
        exposure_stops: 0.0,
        ..Display::PLAIN
    }
    .build_map()
    .display_values(rgb)
}

/// Protects: AgX maps three colours by its published matrices, range and sigmoid, against an
/// independent computation in double precision.
#[test]
fn agx_of_strong_colours() {
    for (rgb, expected) in [
        ([0.8, 0.2, 0.05], [0.581_168, 0.253_456, 0.127_290]),
        ([0.05, 0.4, 0.1], [0.138_547, 0.361_883, 0.151_993]),
        ([0.3, 0.1, 2.0], [0.334_230, 0.315_962, 0.850_528]),
    ] {
        let found = shown(ToneMap::Agx, TransferCurve::None, rgb);
        assert!(
            found
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 5e-6),
            "{rgb:?}: {found:?} instead of {expected:?}"
        );
    }
}

/// Protects: the transfer curves have their names' values: 0.25 is 0.537 099 in sRGB, 0.25^(1/2.2)
/// and itself.
#[test]
fn curves_by_name() {
    for (curve, expected) in [
        (TransferCurve::Srgb, 0.537_098_7),
        (TransferCurve::Gamma22, 0.532_520_5),
        (TransferCurve::None, 0.25),
    ] {
        let found = shown(ToneMap::None, curve, [0.25; 3]);
        assert!(
            found.iter().all(|v: &f32| (v - expected).abs() < 1e-6),
            "{curve:?}: {found:?}"
        );
    }
    assert_eq!(
        shown(ToneMap::None, TransferCurve::Srgb, [1.0 / 1024.0; 3]),
        [(12.92_f64 / 1024.0) as f32; 3]
    );
}
