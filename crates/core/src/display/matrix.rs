//! Product of matrix and colour, for the tone maps that convert colours between primaries.

/// Returns the product of a 3×3 matrix, given by its rows, and a colour.
pub(super) fn multiply_matrix(rows: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}
