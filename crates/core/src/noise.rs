//! Gradient noise in two and three dimensions, and sums of its octaves.
//!
//! The construction is Ken Perlin's ("An Image Synthesizer", 1985), with the quintic weights of his
//! "Improving Noise", 2002. The permutation polynomial (34 x² + x) mod 289 hashes the lattice
//! points. Gradients are normalised to first order (Ian McEwan, David Sheets, Mark Richardson,
//! Stefan Gustavson, "Efficient computational noise in GLSL", 2012). Values lie within about ±1,
//! are zero at lattice points, and repeat every 289 units.

use raywright_bvh::scalar::{Real, Vector};

/// Greatest number of octaves in a sum. The last octave has 2²³ cycles per unit, the resolution of
/// an `f32`.
pub(crate) const MAX_OCTAVES: u32 = 24;

/// Period of the lattice in lattice points, and number of hash values.
const PERIOD: usize = 289;

/// Permutation table: (34 x² + x) mod 289 for every x up to the greatest sum of two hash values.
/// The length is a power of two: a masked index needs no bounds check. The remaining entries are
/// never read.
static PERMUTATION: [u16; 1024] = permutation_table();

/// Length-corrected gradient of each hash value, in space and in the plane, each in `f32` and in
/// `f64`. The length of the tables is a power of two, as in [`PERMUTATION`].
static GRADIENTS_F32: [[f32; 3]; 512] = narrow_to_f32(space_gradient_table());
static GRADIENTS_F64: [[f64; 3]; 512] = space_gradient_table();
static PLANE_GRADIENTS_F32: [[f32; 2]; 512] = narrow_to_f32(plane_gradient_table());
static PLANE_GRADIENTS_F64: [[f64; 2]; 512] = plane_gradient_table();

const fn permutation_table() -> [u16; 1024] {
    let mut table = [0; 1024];
    let mut x = 0;
    while x < 2 * PERIOD {
        table[x] = ((34 * x * x + x) % PERIOD) as u16;
        x += 1;
    }
    table
}

/// Returns the gradient of a hash value before the correction of its length. The gradient is a
/// point of an octahedron over a grid of 7 × 7 points.
///
/// For 42 of the 289 hash values the point lies exactly on the octahedron's fold (c = 0 in real
/// arithmetic), and rounding decides its side. The reference pictures were made in `f32`, with the
/// division by 7 written as a product with the rounded 1/7. That arithmetic defines the gradients
/// in every precision. Each operation in this function is therefore one correctly rounded `f32`
/// operation, and their order matters.
const fn octahedron_point(hash: usize) -> [f32; 3] {
    const SEVENTH: f32 = 1.0 / 7.0;
    let scaled = hash as f32 * SEVENTH;
    let row = scaled as u32 as f32;
    let row_scaled = row * SEVENTH;
    let mut a = scaled - row;
    let mut b = row_scaled - row_scaled as u32 as f32 - 0.5;
    let c = 0.5 - a.abs() - b.abs();
    if c <= 0.0 {
        a -= if a >= 0.0 { 0.5 } else { -0.5 };
        b -= if b >= 0.0 { 0.5 } else { -0.5 };
    }
    [a, b, c]
}

/// Returns the factor that normalises a gradient of squared length `squared` to first order. The
/// factor is the tangent of 1/√x at the mean squared length.
const fn length_correction(squared: f64) -> f64 {
    1.792_842_914_001_59 - 0.853_734_720_953_14 * squared
}

const fn space_gradient_table() -> [[f64; 3]; 512] {
    let mut table = [[0.0; 3]; 512];
    let mut hash = 0;
    while hash < PERIOD {
        let [x, y, z] = octahedron_point(hash);
        let (x, y, z) = (x as f64, y as f64, z as f64);
        let factor = length_correction(x * x + y * y + z * z);
        table[hash] = [x * factor, y * factor, z * factor];
        hash += 1;
    }
    table
}

/// Returns the length-corrected gradients for noise in the plane: 41 points of a square. No
/// gradient depends on rounding.
const fn plane_gradient_table() -> [[f64; 2]; 512] {
    let mut table = [[0.0; 2]; 512];
    let mut hash = 0;
    while hash < PERIOD {
        let a = (hash % 41) as f64 * (2.0 / 41.0) - 1.0;
        let (x, y) = (a - (a + 0.5).floor(), a.abs() - 0.5);
        let factor = length_correction(x * x + y * y);
        table[hash] = [x * factor, y * factor];
        hash += 1;
    }
    table
}

const fn narrow_to_f32<const N: usize>(table: [[f64; N]; 512]) -> [[f32; N]; 512] {
    let mut narrowed = [[0.0; N]; 512];
    let mut hash = 0;
    while hash < PERIOD {
        let mut axis = 0;
        while axis < N {
            narrowed[hash][axis] = table[hash][axis] as f32;
            axis += 1;
        }
        hash += 1;
    }
    narrowed
}

/// Whether the scalar type is `f32`. The size of the type is a constant: the compiler removes the
/// unused branch.
#[inline(always)]
const fn is_f32<R: Real>() -> bool {
    size_of::<R>() == size_of::<f32>()
}

/// Returns the lattice coordinates below and above `x`, modulo 289, and the distance in [0, 1) of
/// `x` from the lower lattice point.
///
/// From 2³¹ on (`f64`: 2⁶³), every value is an integer. Then the distance is zero and the lattice
/// cell arbitrary.
#[inline(always)]
fn lattice_cell<R: Real>(x: R) -> ([usize; 2], R) {
    let (whole, below) = if is_f32::<R>() {
        let truncated = x.to_f32() as i32;
        let lower = i32::from(R::from_f32(truncated as f32) > x);
        let whole = truncated.wrapping_sub(lower);
        (
            whole.rem_euclid(PERIOD as i32) as usize,
            R::from_f32(whole as f32),
        )
    } else {
        let truncated = x.to_f64() as i64;
        let lower = i64::from(R::from_f64(truncated as f64) > x);
        let whole = truncated.wrapping_sub(lower);
        (
            whole.rem_euclid(PERIOD as i64) as usize,
            R::from_f64(whole as f64),
        )
    };
    let past = x - below;
    let past = if past < R::ZERO || past > R::ONE {
        R::ZERO
    } else {
        past
    };
    (
        [whole, if whole == PERIOD - 1 { 0 } else { whole + 1 }],
        past,
    )
}

#[inline(always)]
fn permute_hash(x: usize) -> usize {
    usize::from(PERMUTATION[x & 1023])
}

/// Returns Perlin's interpolation weight 6 t⁵ − 15 t⁴ + 10 t³.
#[inline(always)]
fn quintic<R: Real>(t: R) -> R {
    t * t * t * (t * (t * R::from_f32(6.0) - R::from_f32(15.0)) + R::from_f32(10.0))
}

#[inline(always)]
fn lerp<R: Real>(a: R, b: R, t: R) -> R {
    a + (b - a) * t
}

/// Returns gradient noise at the point `p` in space, within about ±1.
#[inline]
pub(crate) fn noise3<R: Real>(p: R::Vec3) -> R {
    let ([x0, x1], x) = lattice_cell(p.x());
    let ([y0, y1], y) = lattice_cell(p.y());
    let ([z0, z1], z) = lattice_cell(p.z());
    let corner = |hash: usize, x: R, y: R, z: R| {
        if is_f32::<R>() {
            let g = GRADIENTS_F32[hash & 511].map(R::from_f32);
            g[0] * x + g[1] * y + g[2] * z
        } else {
            let g = GRADIENTS_F64[hash & 511].map(R::from_f64);
            g[0] * x + g[1] * y + g[2] * z
        }
    };
    let (u, v, w) = (x - R::ONE, y - R::ONE, z - R::ONE);
    let (fade_x, fade_y, fade_z) = (quintic(x), quintic(y), quintic(z));
    // Interpolates along z, for the hash of a corner's x and y.
    let row = |hash: usize, x: R, y: R| {
        lerp(
            corner(permute_hash(hash + z0), x, y, z),
            corner(permute_hash(hash + z1), x, y, w),
            fade_z,
        )
    };
    let (hash0, hash1) = (permute_hash(x0), permute_hash(x1));
    let (hash00, hash01) = (permute_hash(hash0 + y0), permute_hash(hash0 + y1));
    let (hash10, hash11) = (permute_hash(hash1 + y0), permute_hash(hash1 + y1));
    let face0 = lerp(row(hash00, x, y), row(hash01, x, v), fade_y);
    let face1 = lerp(row(hash10, u, y), row(hash11, u, v), fade_y);
    R::from_f64(2.2) * lerp(face0, face1, fade_x)
}

/// Returns gradient noise at the point (`x`, `y`) of a plane, within about ±1.
#[inline]
pub(crate) fn noise2<R: Real>(x: R, y: R) -> R {
    let ([x0, x1], x) = lattice_cell(x);
    let ([y0, y1], y) = lattice_cell(y);
    let corner = |hash: usize, x: R, y: R| {
        if is_f32::<R>() {
            let g = PLANE_GRADIENTS_F32[hash & 511].map(R::from_f32);
            g[0] * x + g[1] * y
        } else {
            let g = PLANE_GRADIENTS_F64[hash & 511].map(R::from_f64);
            g[0] * x + g[1] * y
        }
    };
    let (u, v) = (x - R::ONE, y - R::ONE);
    let (fade_x, fade_y) = (quintic(x), quintic(y));
    let (hash0, hash1) = (permute_hash(x0), permute_hash(x1));
    let side0 = lerp(
        corner(permute_hash(hash0 + y0), x, y),
        corner(permute_hash(hash0 + y1), x, v),
        fade_y,
    );
    let side1 = lerp(
        corner(permute_hash(hash1 + y0), u, y),
        corner(permute_hash(hash1 + y1), u, v),
        fade_y,
    );
    R::from_f64(2.3) * lerp(side0, side1, fade_x)
}

/// Returns the octave sum Σ n(2ⁱ) / 2ⁱ over i from 0 to `octaves` − 1. `noise` returns n, the noise
/// at a given frequency.
#[inline(always)]
fn sum_octaves<R: Real>(octaves: u32, mut noise: impl FnMut(R) -> R) -> R {
    let (mut total, mut frequency, mut amplitude) = (R::ZERO, R::ONE, R::ONE);
    let half = R::from_f32(0.5);
    for _ in 0..octaves.min(MAX_OCTAVES) {
        total += noise(frequency) * amplitude;
        frequency += frequency;
        amplitude *= half;
    }
    total
}

/// Returns fractional Brownian motion at the point `p` in space: Σ n(2ⁱ p) / 2ⁱ over i from 0 to
/// `octaves` − 1, with gradient noise n.
pub fn fbm3<R: Real>(p: R::Vec3, octaves: u32) -> R {
    sum_octaves(octaves, |frequency| noise3::<R>(p * frequency))
}

/// Returns turbulence at the point `p` in space: Σ |n(2ⁱ p)| / 2ⁱ over i from 0 to `octaves` − 1,
/// with gradient noise n.
pub fn turbulence3<R: Real>(p: R::Vec3, octaves: u32) -> R {
    sum_octaves(octaves, |frequency| noise3::<R>(p * frequency).abs())
}

/// Returns fractional Brownian motion at a point in a plane, defined as for [`fbm3`].
pub(crate) fn fbm2<R: Real>(x: R, y: R, octaves: u32) -> R {
    sum_octaves(octaves, |frequency| noise2(x * frequency, y * frequency))
}

/// Returns turbulence at a point in a plane, defined as for [`turbulence3`].
pub fn turbulence2<R: Real>(x: R, y: R, octaves: u32) -> R {
    sum_octaves(octaves, |frequency| {
        noise2(x * frequency, y * frequency).abs()
    })
}

#[cfg(test)]
#[path = "noise_tests.rs"]
mod tests;
