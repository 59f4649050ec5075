//! Colours from one set of primaries to another, for every tone map that goes by such.

/// Row · column of a 3×3 matrix and a colour.
pub(super) fn transform(rows: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}
