//! Colour spaces of FLIP. Pictures are converted from sRGB to YCxCz, a space of opponent colours
//! that is linear in light, for filtering. Then they are converted to L*a*b* with a Hunt
//! adjustment.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::OpponentImage;
use super::filters::ScalarImage;
use crate::display::{NAN_MARKER, curve};
use crate::picture::Picture;
use crate::scene::TransferCurve;

/// Matrix from linear sRGB to CIE XYZ, column by column. It is computed from the primaries and
/// white point of Rec. 709 as rational numbers.
const RGB_TO_XYZ: DMat3 = DMat3::from_cols(
    DVec3::new(
        10_135_552.0 / 24_577_794.0,
        2_613_072.0 / 12_288_897.0,
        1_425_312.0 / 73_733_382.0,
    ),
    DVec3::new(
        8_788_810.0 / 24_577_794.0,
        8_788_810.0 / 12_288_897.0,
        8_788_810.0 / 73_733_382.0,
    ),
    DVec3::new(
        4_435_075.0 / 24_577_794.0,
        887_015.0 / 12_288_897.0,
        70_074_185.0 / 73_733_382.0,
    ),
);

/// Returns white in CIE XYZ, to which the opponent colours are relative.
fn white_xyz() -> DVec3 {
    RGB_TO_XYZ * DVec3::ONE
}

/// Converts a picture to the opponent colour space YCxCz, with one plane per channel (section 3.1
/// of the FLIP paper). The channels resemble L*, a*, b*, but are linear in light, so filters may
/// average them.
pub(super) fn srgb_to_ycxcz(picture: &Picture) -> OpponentImage {
    let white = white_xyz();
    let convert = |rgb: &[f32; 3]| {
        let shown = if rgb.iter().any(|x| x.is_nan()) {
            NAN_MARKER
        } else {
            *rgb
        };
        let linear = shown
            .map(|x| curve::decode_transfer(TransferCurve::Srgb, f64::from(x).clamp(0.0, 1.0)));
        let xyz = RGB_TO_XYZ * DVec3::from(linear) / white;
        [
            116.0 * xyz.y - 16.0,
            500.0 * (xyz.x - xyz.y),
            200.0 * (xyz.y - xyz.z),
        ]
        .map(|x| x as f32)
    };
    let pixels: Vec<[f32; 3]> = picture.rgb.par_iter().map(convert).collect();
    [0, 1, 2].map(|c| ScalarImage {
        width: picture.width as usize,
        values: pixels.iter().map(|pixel| pixel[c]).collect(),
    })
}

/// Converts filtered pixels to L*, a*, b*, clipped to the gamut of sRGB (section 4.1.2 of the FLIP
/// paper). a* and b* are multiplied by lightness for the Hunt effect: bright colours look more
/// saturated.
pub(super) fn to_hunt_lab(planes: &OpponentImage) -> Vec<[f32; 3]> {
    let (white, to_rgb) = (white_xyz(), RGB_TO_XYZ.inverse());
    let convert = |((y, cx), cz): ((&f32, &f32), &f32)| {
        let y = (f64::from(*y) + 16.0) / 116.0;
        let xyz = DVec3::new(y + f64::from(*cx) / 500.0, y, y - f64::from(*cz) / 200.0) * white;
        let rgb = (to_rgb * xyz).clamp(DVec3::ZERO, DVec3::ONE);
        let relative = RGB_TO_XYZ * rgb / white;
        let [x, y, z] = relative.to_array().map(lab_lightness_function);
        let lightness = 116.0 * y - 16.0;
        let hunt = 0.01 * lightness;
        [lightness, 500.0 * (x - y) * hunt, 200.0 * (y - z) * hunt].map(|x| x as f32)
    };
    planes[0]
        .values
        .par_iter()
        .zip(&planes[1].values)
        .zip(&planes[2].values)
        .map(convert)
        .collect()
}

/// Lightness function of L*a*b*: a cube root, and linear near black (CIE 15:2004).
fn lab_lightness_function(t: f64) -> f64 {
    const DELTA: f64 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA {
        libm::cbrt(t)
    } else {
        t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
    }
}

/// Returns the HyAB distance of two L*a*b* colours: the difference of lightness plus the Euclidean
/// distance of a* and b* (Abasi, Tehran, Fairchild, "Distance Metrics for Very Large Color
/// Differences", 2020).
pub(super) fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [l, ca, cb] = [0, 1, 2].map(|c| a[c] - b[c]);
    l.abs() + (ca * ca + cb * cb).sqrt()
}
