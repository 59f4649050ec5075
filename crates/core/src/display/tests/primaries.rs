//! Colour matrices from their definition: the chromaticities of primaries and whites, and the
//! adaptation of whites.

use glam::{DMat3, DVec3};

use super::*;

/// CIE xy of red, green, blue and white.
pub(in crate::display) type Primaries = [[f64; 2]; 4];

/// Rec. 709 and sRGB (ITU-R BT.709-6).
pub(in crate::display) const REC709: Primaries = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], D65];
/// Rec. 2020 (ITU-R BT.2020-2).
pub(in crate::display) const REC2020: Primaries =
    [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], D65];
/// The working space of ACES (Academy S-2014-004).
const AP1: Primaries = [
    [0.713, 0.293],
    [0.165, 0.830],
    [0.128, 0.044],
    [0.32168, 0.33767],
];
const D65: [f64; 2] = [0.3127, 0.3290];

fn xyz([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// Returns the matrix from linear values to CIE XYZ, with the primaries scaled so that their sum is
/// the white.
fn to_xyz([r, g, b, white]: Primaries) -> DMat3 {
    let primaries = DMat3::from_cols(xyz(r), xyz(g), xyz(b));
    primaries * DMat3::from_diagonal(primaries.inverse() * xyz(white))
}

/// Returns Bradford's adaptation of one white to another.
fn adapted(from: [f64; 2], to: [f64; 2]) -> DMat3 {
    let rows = [
        [0.8951, 0.2664, -0.1614],
        [-0.7502, 1.7135, 0.0367],
        [0.0389, -0.0685, 1.0296],
    ];
    let cones = DMat3::from_cols_array_2d(&rows).transpose();
    cones.inverse() * DMat3::from_diagonal((cones * xyz(to)) / (cones * xyz(from))) * cones
}

/// Returns the matrix from linear values of one space to those of another.
pub(in crate::display) fn between(from: Primaries, to: Primaries) -> DMat3 {
    to_xyz(to).inverse() * adapted(from[3], to[3]) * to_xyz(from)
}

/// Mixes colours of a space with their own luminance; `share` of the saturation remains.
fn desaturated(space: Primaries, share: f64) -> DMat3 {
    let luminance = to_xyz(space).row(1);
    DMat3::from_cols_array_2d(&[luminance.to_array(); 3]).transpose() * (1.0 - share)
        + DMat3::IDENTITY * share
}

/// Protects: every entry of both matrices of Hill's fit: the conversion to the working space of
/// ACES with the 96 % saturation of its reference rendering, and the conversion back to sRGB with
/// the 93 % of its output for a dim surround.
#[test]
fn hills_matrices_are_those_of_aces() {
    let into = desaturated(AP1, 0.96) * between(REC709, AP1);
    let out = between(AP1, REC709) * desaturated(AP1, 0.93);
    let curve = |v: f64| {
        (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951_0) + 0.238_081)
    };
    let operator = ToneOperator::new(ToneMap::AcesHill);
    for primary in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.2, 3.0, 0.7)] {
        let shaped = (into * primary).to_array().map(curve);
        let (found, expected) = (
            DVec3::from(operator.apply((primary * 0.6).to_array())),
            out * DVec3::from(shaped),
        );
        assert!(
            (found - expected).abs().max_element() < 4e-5,
            "{primary}: {found} {expected}"
        );
    }
}
