//! Conversion of OpenEXR colours to the primaries of Rec. 709 with the white point D65, by the
//! chromaticities that the file states.

use exr::meta::attribute::Chromaticities;
use exr::prelude::Vec2;
use glam::{DMat3, DVec3};

/// Primaries and white point of Rec. 709.
pub(crate) const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Differences of chromaticities up to this bound are rounding, and colours are not converted.
const ROUNDING: f32 = 1e-3;

/// Bradford's matrix from XYZ to the responses of sharpened cones.
const BRADFORD: DMat3 = DMat3::from_cols_array(&[
    0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296,
]);

/// Remark about chromaticities that define no colour space.
const UNUSABLE: &str =
    "has chromaticities that define no colour space; its colours are read as Rec. 709";

/// Returns the matrix from a file's linear RGB to that of Rec. 709, with the file's white mapped to
/// D65 by Bradford's adaptation; `None` for colours that are those of Rec. 709 already.
///
/// # Errors
/// [`UNUSABLE`] for primaries on a line, and for a white point outside their triangle.
pub(crate) fn matrix_to_rec_709(
    stated: Option<Chromaticities>,
) -> Result<Option<DMat3>, &'static str> {
    let points = |c: Chromaticities| [c.red, c.green, c.blue, c.white];
    let is_near = |(Vec2(x, y), Vec2(u, v)): (Vec2<f32>, Vec2<f32>)| {
        (x - u).abs() <= ROUNDING && (y - v).abs() <= ROUNDING
    };
    let Some(stated) =
        stated.filter(|&stated| !points(stated).into_iter().zip(points(REC_709)).all(is_near))
    else {
        return Ok(None);
    };
    let (file, rec_709) = (rgb_to_cones(stated), rgb_to_cones(REC_709));
    file.zip(rec_709)
        .map(|((file, white), (rec_709, d65))| {
            rec_709.inverse() * DMat3::from_diagonal(d65 / white) * file
        })
        .filter(|matrix| matrix.is_finite())
        .map(Some)
        .ok_or(UNUSABLE)
}

/// Returns the matrix from a colour space to Bradford's cones, and the cones of the white point;
/// `None` for chromaticities that define no colour space.
fn rgb_to_cones(space: Chromaticities) -> Option<(DMat3, DVec3)> {
    let xyz = |Vec2(x, y): Vec2<f32>| {
        let [x, y] = [x, y].map(f64::from);
        DVec3::new(x, y, 1.0 - x - y)
    };
    let primaries = DMat3::from_cols(xyz(space.red), xyz(space.green), xyz(space.blue));
    let white = xyz(space.white) / f64::from(space.white.1);
    let shares = primaries.inverse() * white;
    let cones = BRADFORD * white;
    let is_usable =
        primaries.determinant().abs() > 1e-6 && white.y > 0.0 && shares.min_element() > 0.0;
    (is_usable && cones.min_element() > 0.0)
        .then(|| (BRADFORD * primaries * DMat3::from_diagonal(shares), cones))
}

/// Converts a colour. A colour that is not finite stays unchanged.
pub(crate) fn convert_colour(matrix: &DMat3, rgb: [f32; 3]) -> [f32; 3] {
    let colour = DVec3::from(rgb.map(f64::from));
    match colour.is_finite() {
        true => (*matrix * colour).as_vec3().to_array(),
        false => rgb,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn space(points: [[f32; 2]; 4]) -> Chromaticities {
        let [red, green, blue, white] = points.map(|[x, y]| Vec2(x, y));
        Chromaticities {
            red,
            green,
            blue,
            white,
        }
    }

    /// Protects: the matrices of Rec. 2020 (ITU-R BT.2087), of Display P3, whose primaries are near,
    /// and of ACES2065-1 (Bradford, from its white near D60) agree with the published ones; white
    /// stays white.
    #[test]
    fn published_matrices_are_met() {
        let rec_2020 = space([
            [0.708, 0.292],
            [0.170, 0.797],
            [0.131, 0.046],
            [0.3127, 0.3290],
        ]);
        let display_p3 = space([
            [0.680, 0.320],
            [0.265, 0.690],
            [0.150, 0.060],
            [0.3127, 0.3290],
        ]);
        let aces = space([
            [0.7347, 0.2653],
            [0.0, 1.0],
            [0.0001, -0.077],
            [0.32168, 0.33767],
        ]);
        for (stated, rows) in [
            (
                rec_2020,
                [
                    [1.6605, -0.5876, -0.0728],
                    [-0.1246, 1.1329, -0.0083],
                    [-0.0182, -0.1006, 1.1187],
                ],
            ),
            (
                display_p3,
                [
                    [1.2249, -0.2249, 0.0],
                    [-0.0421, 1.0421, 0.0],
                    [-0.0196, -0.0786, 1.0983],
                ],
            ),
            (
                aces,
                [
                    [2.5217, -1.1341, -0.3876],
                    [-0.2765, 1.3727, -0.0962],
                    [-0.0154, -0.1530, 1.1684],
                ],
            ),
        ] {
            let matrix = matrix_to_rec_709(Some(stated))
                .expect("a colour space")
                .expect("a matrix");
            for (i, row) in rows.into_iter().enumerate() {
                let apart = (matrix.row(i) - DVec3::from(row)).abs().max_element();
                assert!(apart < 2e-4, "{i}: {matrix:?}");
            }
            let white = convert_colour(&matrix, [1.0; 3]);
            assert!(
                white.iter().all(|value| (value - 1.0).abs() < 1e-6),
                "{white:?}"
            );
        }
    }

    /// Protects: no matrix where none is needed, and a word where none exists: equal or collinear
    /// points, a white outside the triangle, zeros, infinities and NaN.
    #[test]
    fn other_chromaticities_are_told() {
        let own = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];
        let rounded = own.map(|[x, y]| [x + 0.0004, y - 0.0004]);
        for stated in [None, Some(space(own)), Some(space(rounded))] {
            assert_eq!(matrix_to_rec_709(stated), Ok(None));
        }
        let [r, g, b, w] = own;
        for points in [
            [[0.0; 2]; 4],
            [r, r, b, w],
            [r, g, [0.47, 0.465], w],
            [r, g, b, [0.9, 0.1]],
            [r, g, b, [0.3, 0.0]],
            [[f32::NAN; 2], g, b, w],
            [r, g, b, [f32::INFINITY; 2]],
        ] {
            assert_eq!(
                matrix_to_rec_709(Some(space(points))),
                Err(UNUSABLE),
                "{points:?}"
            );
        }
    }
}
