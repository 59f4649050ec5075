//! Directional albedos of rough boundaries of dielectrics, by their index: what facets reflect by
//! Fresnel's equations, and what facets lose that meet light once, reflected and refracted
//! together.
//!
//! The tables depend on nothing, so they are constants: `boundary.table`, which a test computes
//! anew and compares byte by byte. Each row ends with its mean over the hemisphere, by the cosine.

use super::albedo::between;
use super::fresnel::dielectric_in_air;
use super::ggx::LEAST_ROUGHNESS;

/// Steps of the index, of the roughness and of the cosine in the table of what is reflected, and in
/// that of what is lost.
pub(super) const REFLECTED: [usize; 3] = [33, 24, 32];
pub(super) const LOST: [usize; 3] = [33, 20, 20];
/// What a share of one is stored as.
pub(super) const UNIT: f64 = 65_535.0;
/// Greatest index of the tables.
pub(super) const MOST_INDEX: f64 = 1e3;

const fn places([indices, roughnesses, cosines]: [usize; 3]) -> usize {
    indices * roughnesses * (cosines + 1)
}

/// All that is tabulated.
pub(super) struct BoundaryTable {
    /// Share that is reflected of light that comes from the thin side.
    pub reflected: [u16; places(REFLECTED)],
    /// Shares that are lost of light that comes from the thin side, then of such from the dense
    /// one: where facets reflect by Fresnel's equations, and where they let through all that they
    /// can.
    pub lost: [u16; 4 * places(LOST)],
}

pub(super) static TABLE: BoundaryTable = BoundaryTable::read(include_bytes!("boundary.table"));

impl BoundaryTable {
    /// Bytes of all of it.
    pub const BYTES: usize = 2 * (places(REFLECTED) + 4 * places(LOST));

    pub const fn read(bytes: &[u8; Self::BYTES]) -> Self {
        Self {
            reflected: shares(bytes, 0),
            lost: shares(bytes, 2 * places(REFLECTED)),
        }
    }
}

/// Shares that stand in bytes from a place on, the lesser byte first.
const fn shares<const COUNT: usize>(bytes: &[u8], from: usize) -> [u16; COUNT] {
    let mut out = [0; COUNT];
    let mut k = 0;
    while k < COUNT {
        out[k] = u16::from_le_bytes([bytes[from + 2 * k], bytes[from + 2 * k + 1]]);
        k += 1;
    }
    out
}

/// Where an index, at least one, lies among steps: finer towards one, where reflection begins, and
/// towards the greatest, where it is all.
fn place_of(index: f64) -> f64 {
    let of = |index: f64| {
        let root = (0.5 * (index - 1.0).max(0.0)).sqrt().sqrt();
        root / (1.0 + root)
    };
    of(index) / of(MOST_INDEX)
}

/// Cell of a table around an index, a roughness and a cosine.
struct Cell {
    /// Entry of the least index, roughness and cosine of it.
    first: usize,
    /// From an entry to that of the next roughness, and to that of the next index.
    strides: [usize; 2],
    /// How far along the cell the index, the roughness and the cosine are; no cosine in the mean
    /// over all.
    shares: [f64; 2],
    along: Option<f64>,
}

impl Cell {
    /// Of a table of such steps; without a cosine of its means.
    #[inline(always)]
    fn new(
        [indices, roughnesses, cosines]: [usize; 3],
        index: f64,
        roughness: f64,
        cosine: Option<f64>,
    ) -> Self {
        let least = LEAST_ROUGHNESS.sqrt();
        let (i, u) = between(place_of(index), indices);
        let (j, v) = between((roughness.sqrt() - least) / (1.0 - least), roughnesses);
        let stride = cosines + 1;
        let (k, along) = cosine.map_or((cosines, None), |cosine| {
            let (k, w) = between(cosine.max(0.0).sqrt().sqrt(), cosines);
            (k, Some(w))
        });
        Self {
            first: (i * roughnesses + j) * stride + k,
            strides: [stride, roughnesses * stride],
            shares: [u, v],
            along,
        }
    }

    /// Value of a table in it.
    #[inline(always)]
    fn value(&self, table: &[u16]) -> f64 {
        let entry = |place: usize| f64::from(table[place]) / UNIT;
        let mix = |a: f64, b: f64, share: f64| a + (b - a) * share;
        let row = |place: usize| {
            self.along
                .map_or_else(|| entry(place), |w| mix(entry(place), entry(place + 1), w))
        };
        let ([u, v], [rougher, denser]) = (self.shares, self.strides);
        let column = |place: usize| mix(row(place), row(place + rougher), v);
        mix(column(self.first), column(self.first + denser), u)
    }
}

/// Share that facets of an index, at least one, reflect of light from the thin side, by Fresnel's
/// equations; in the mean where no cosine is given.
pub(super) fn reflected(index: f64, roughness: f64, cosine: Option<f64>) -> f64 {
    if roughness <= LEAST_ROUGHNESS {
        return cosine.map_or_else(
            || mean_reflectance(index),
            |cosine| dielectric_in_air(cosine, index),
        );
    }
    Cell::new(REFLECTED, index, roughness, cosine).value(&TABLE.reflected)
}

/// Shares that facets lose: by Fresnel's equations, and where they let through all that they can.
/// `eta` is the index on the side that light comes from over the other.
pub(super) fn lost(eta: f64, roughness: f64, cosine: Option<f64>) -> [f64; 2] {
    let (side, index) = if eta > 1.0 { (1, eta) } else { (0, 1.0 / eta) };
    let cell = Cell::new(LOST, index, roughness, cosine);
    let (tables, _) = TABLE.lost.as_chunks::<{ places(LOST) }>();
    [0, 1].map(|which| cell.value(&tables[2 * side + which]))
}

/// Reflectance of a smooth boundary of an index, at least one, in the mean over the hemisphere on
/// its thin side, by the cosine (Duntley 1942).
pub(super) fn mean_reflectance(index: f64) -> f64 {
    // Below, the difference of large numbers is all that is left.
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
