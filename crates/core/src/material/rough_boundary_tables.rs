//! Tabulated albedos of rough dielectric boundaries by their index of refraction. They are the
//! share of light that microfacets reflect by Fresnel's equations, and the share that single
//! scattering (reflection and refraction together) loses.
//!
//! The tables depend on no scene: they are constants in the file `boundary.table`. A test computes
//! the file anew and compares it byte by byte. The entries of one index and one roughness stand
//! side by side, by cosine. Their cosine-weighted hemispherical mean follows.

use super::albedo::table_position;
use super::fresnel::fresnel_dielectric_in_air;
use super::ggx::LEAST_ROUGHNESS;

/// Steps of index, roughness and cosine in the reflection table.
pub(super) const REFLECTION_STEPS: [usize; 3] = [33, 24, 32];
/// Steps of index, roughness and cosine in the loss tables.
pub(super) const LOSS_STEPS: [usize; 3] = [33, 20, 20];
/// Integer that stands for a share of 1.0 in the tables.
pub(super) const UNIT: f64 = 65_535.0;
/// Greatest index of refraction of the tables.
pub(super) const MOST_INDEX: f64 = 1e3;

/// Returns the number of entries of a table with the given steps. Each index and roughness has an
/// entry per cosine and one for the hemispherical mean.
const fn table_len([indices, roughnesses, cosines]: [usize; 3]) -> usize {
    indices * roughnesses * (cosines + 1)
}

/// The reflection table and the loss tables of rough dielectric boundaries, as shares in units of
/// 1/[`UNIT`].
pub(super) struct BoundaryTable {
    /// Share of light from the side of lower index that the microfacets reflect by Fresnel's
    /// equations.
    pub reflection: [u16; table_len(REFLECTION_STEPS)],
    /// Share of light that single scattering loses, in four tables of equal length:
    /// - light from the side of lower index: first for microfacets that reflect by Fresnel's
    ///   equations, then for microfacets that reflect only under total reflection;
    /// - light from the side of higher index: the same two tables.
    pub loss: [u16; 4 * table_len(LOSS_STEPS)],
}

pub(super) static TABLE: BoundaryTable =
    BoundaryTable::from_bytes(include_bytes!("boundary.table"));

impl BoundaryTable {
    /// Length of `boundary.table` in bytes.
    pub const BYTES: usize = 2 * (table_len(REFLECTION_STEPS) + 4 * table_len(LOSS_STEPS));

    /// Reads the tables from the bytes of `boundary.table`.
    pub const fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        Self {
            reflection: read_u16s(bytes, 0),
            loss: read_u16s(bytes, 2 * table_len(REFLECTION_STEPS)),
        }
    }
}

/// Reads `COUNT` little-endian `u16` from byte `from` on.
const fn read_u16s<const COUNT: usize>(bytes: &[u8], from: usize) -> [u16; COUNT] {
    let mut out = [0; COUNT];
    let mut k = 0;
    while k < COUNT {
        out[k] = u16::from_le_bytes([bytes[from + 2 * k], bytes[from + 2 * k + 1]]);
        k += 1;
    }
    out
}

/// Returns the table coordinate in [0, 1] of an index of refraction of at least 1. Steps are finer
/// at both ends: near index 1, where reflection begins, and near [`MOST_INDEX`], where reflection
/// is nearly total.
fn index_coordinate(index: f64) -> f64 {
    let value_of = |index: f64| {
        let root = (0.5 * (index - 1.0).max(0.0)).sqrt().sqrt();
        root / (1.0 + root)
    };
    value_of(index) / value_of(MOST_INDEX)
}

/// Interpolation cell of a table around an index, a roughness and a cosine.
struct TableCell {
    /// Position in the table of the cell's entry of least index, roughness and cosine.
    first: usize,
    /// Distance in entries between neighbouring roughnesses, then between neighbouring indices.
    strides: [usize; 2],
    /// Positions in [0, 1] within the cell: along the index, then along the roughness.
    fractions: [f64; 2],
    /// Position in [0, 1] within the cell along the cosine; `None` selects the hemispherical mean.
    cosine_fraction: Option<f64>,
}

impl TableCell {
    /// Returns the cell around the given values, in a table of the given steps. `cosine: None`
    /// selects the hemispherical mean.
    #[inline(always)]
    fn new(
        [indices, roughnesses, cosines]: [usize; 3],
        index: f64,
        roughness: f64,
        cosine: Option<f64>,
    ) -> Self {
        let minimum = LEAST_ROUGHNESS.sqrt();
        let (i, u) = table_position(index_coordinate(index), indices);
        let (j, v) = table_position((roughness.sqrt() - minimum) / (1.0 - minimum), roughnesses);
        let stride = cosines + 1;
        let (k, along) = cosine.map_or((cosines, None), |cosine| {
            let (k, w) = table_position(cosine.max(0.0).sqrt().sqrt(), cosines);
            (k, Some(w))
        });
        Self {
            first: (i * roughnesses + j) * stride + k,
            strides: [stride, roughnesses * stride],
            fractions: [u, v],
            cosine_fraction: along,
        }
    }

    /// Returns the value of a table, interpolated in the cell.
    #[inline(always)]
    fn interpolate(&self, table: &[u16]) -> f64 {
        let entry = |index: usize| f64::from(table[index]) / UNIT;
        let mix = |a: f64, b: f64, share: f64| a + (b - a) * share;
        let row = |index: usize| {
            self.cosine_fraction
                .map_or_else(|| entry(index), |w| mix(entry(index), entry(index + 1), w))
        };
        let ([u, v], [rougher, denser]) = (self.fractions, self.strides);
        let column = |index: usize| mix(row(index), row(index + rougher), v);
        mix(column(self.first), column(self.first + denser), u)
    }
}

/// Returns the share of light from the side of lower index that microfacets reflect by Fresnel's
/// equations. `index` is at least 1. `cosine: None` selects the hemispherical mean.
pub(super) fn fresnel_albedo(index: f64, roughness: f64, cosine: Option<f64>) -> f64 {
    if roughness <= LEAST_ROUGHNESS {
        return cosine.map_or_else(
            || smooth_mean_reflectance(index),
            |cosine| fresnel_dielectric_in_air(cosine, index),
        );
    }
    TableCell::new(REFLECTION_STEPS, index, roughness, cosine).interpolate(&TABLE.reflection)
}

/// Returns the share of light that single scattering loses: first for microfacets that reflect by
/// Fresnel's equations, then for microfacets that reflect only under total reflection.
///
/// `eta` is the index on the incident side over the index on the opposite side. `cosine: None`
/// selects the hemispherical mean.
pub(super) fn single_scattering_loss(eta: f64, roughness: f64, cosine: Option<f64>) -> [f64; 2] {
    let (side, index) = if eta > 1.0 { (1, eta) } else { (0, 1.0 / eta) };
    let cell = TableCell::new(LOSS_STEPS, index, roughness, cosine);
    let (tables, _) = TABLE.loss.as_chunks::<{ table_len(LOSS_STEPS) }>();
    [0, 1].map(|selected| cell.interpolate(&tables[2 * side + selected]))
}

/// Returns the cosine-weighted hemispherical mean of the reflectance of a smooth boundary, for
/// light from the side of lower index (Duntley 1942). `index` is at least 1.
pub(super) fn smooth_mean_reflectance(index: f64) -> f64 {
    // Closer to index 1 the formula's large numbers cancel, and only their rounding errors would
    // remain.
    if index < 1.0 + 1e-4 {
        return 0.0;
    }
    let (n, n2) = (index, index * index);
    let n4 = n2 * n2;
    0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0) * (n + 1.0))
        + n2 * (n2 - 1.0).powi(2) / (n2 + 1.0).powi(3) * libm::log((n - 1.0) / (n + 1.0))
        - 2.0 * n * n2 * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
        + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0).powi(2)) * libm::log(n)
}
