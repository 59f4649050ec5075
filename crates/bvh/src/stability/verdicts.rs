//! Judgement of a case's random rays: the verdicts of an oracle (a computation of higher accuracy),
//! and the outcome that counts them. Rays are judged in parallel.

use core::fmt;
use core::ops::BitAnd;

use glam::DVec3;
use rayon::prelude::*;

use crate::{Interval, PreparedRay, Ray, Real, Shape, ShapeHit, Side, Vector};

/// Unit roundoff of f32, 2⁻²⁴: the greatest relative error of rounding a number to f32.
pub const UNIT_ROUNDOFF: f64 = 5.960_464_477_539_063e-8;

/// Returns the distance from `x`, rounded to f32, to the next greater f32.
pub fn ulp(x: f64) -> f64 {
    let x = (x.abs() as f32).max(f32::MIN_POSITIVE);
    f64::from(x.next_up()) - f64::from(x)
}

/// A random number generator (SplitMix64: Steele, Lea, Flood, "Fast Splittable Pseudorandom Number
/// Generators", 2014). Each ray of a case has a generator of its own, so it can be repeated alone.
#[derive(Debug)]
pub struct CaseRng {
    state: u64,
    index: u64,
}

impl CaseRng {
    /// Creates the generator of one ray of a case. `seed` is that of the case, and `index` that of
    /// the ray.
    pub fn new(seed: u64, index: u64) -> Self {
        let state =
            seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ index.wrapping_mul(0xd6e8_feb8_6659_fd93);
        let mut rng = Self { state, index };
        rng.next_bits();
        rng
    }
    /// Index of the ray in its case.
    pub fn ray_index(&self) -> u64 {
        self.index
    }
    /// Returns 64 random bits.
    pub fn next_bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = self.state;
        let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }
    /// Samples a number, uniform in [0, 1).
    pub fn next_in_unit_interval(&mut self) -> f64 {
        (self.next_bits() >> 11) as f64 / (1_u64 << 53) as f64
    }
    /// Samples numbers, each uniform in [0, 1).
    pub fn next_numbers<const N: usize>(&mut self) -> [f64; N] {
        [(); N].map(|()| self.next_in_unit_interval())
    }
    /// Samples a number, uniform in [low, high).
    pub fn next_uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next_in_unit_interval()
    }
    /// Returns a random element of a list.
    pub fn choose<T: Copy>(&mut self, from: &[T]) -> T {
        from[(self.next_bits() % from.len() as u64) as usize]
    }
    /// Returns 1 or −1 with equal probability.
    pub fn next_sign(&mut self) -> f64 {
        if self.next_bits() & 1 == 0 { 1.0 } else { -1.0 }
    }
    /// Samples a unit vector, uniform on the sphere.
    pub fn sample_direction(&mut self) -> DVec3 {
        let z = self.next_uniform(-1.0, 1.0);
        let (sin, cos) = (self.next_in_unit_interval() * core::f64::consts::TAU).sin_cos();
        let ring = (1.0 - z * z).sqrt();
        DVec3::new(ring * cos, ring * sin, z)
    }
    /// Samples a point, uniform in the cube [−1, 1]³.
    pub fn sample_point_in_cube(&mut self) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| self.next_uniform(-1.0, 1.0)))
    }
    /// Samples an offset, uniform in the disc of the given radius perpendicular to `across`.
    pub fn sample_offset_in_disc(&mut self, across: DVec3, radius: f64) -> DVec3 {
        let (a, b) = across.any_orthonormal_pair();
        let r = radius * self.next_in_unit_interval().sqrt();
        let (sin, cos) = (self.next_in_unit_interval() * core::f64::consts::TAU).sin_cos();
        a * (r * cos) + b * (r * sin)
    }
}

/// Rounds a vector to the precision `R` of the stored geometry.
pub fn to_scalar<R: Real>(v: DVec3) -> R::Vec3 {
    R::Vec3::from_f64(v)
}

/// Rounds a vector to f32 and converts it back, so that both precisions store it exactly.
pub fn round_to_f32(v: DVec3) -> DVec3 {
    v.as_vec3().as_dvec3()
}

/// Converts a ray to the precision `R`, which holds its numbers exactly.
pub fn to_precision<R: Real>(ray: Ray<impl Real>) -> Ray<R> {
    Ray::new(
        to_scalar::<R>(ray.origin.to_f64()),
        to_scalar::<R>(ray.direction.to_f64()),
    )
}

/// Creates a ray whose direction is not normalised.
pub fn create_unnormalised_ray<R: Real>(origin: DVec3, direction: DVec3) -> Ray<R> {
    Ray::new(to_scalar::<R>(origin), to_scalar::<R>(direction))
}

/// Creates a ray from `origin` towards `target`. The direction has unit length up to the rounding
/// to f32.
pub fn create_ray_towards<R: Real>(origin: DVec3, target: DVec3) -> Ray<R> {
    let origin = round_to_f32(origin);
    create_unnormalised_ray::<R>(origin, round_to_f32((target - origin).normalize()))
}

/// Returns the nearest hit of a ray with a shape by the library's intersection test, in front of
/// the ray's origin and from either side.
pub fn nearest_hit<R: Real>(shape: &impl Shape<R>, ray: &Ray<R>) -> Option<ShapeHit<R>> {
    shape.intersect(&PreparedRay::new(*ray), Interval::positive(), Side::Both)
}

/// Verdict about one ray of a case, from a comparison with an oracle (the exact result).
#[derive(Clone, Debug)]
pub enum Verdict {
    /// Right. The number is the error as a fraction of its bound, in 0..=1.
    Right(f64),
    /// Undecidable: the ray is so close to a boundary case that the oracle itself may err. The ray
    /// is counted, but not judged.
    Undecidable,
    /// Wrong, with a message about the ray.
    Wrong(String),
    /// Skipped: the randomly created ray tests nothing.
    Skipped,
}

/// Returns the verdict about an error. It is right if the error is at most `bound`. Otherwise, and
/// for NaN, it is wrong. `label` returns the message of a wrong verdict.
pub fn within<L: fmt::Display>(error: f64, bound: f64, label: impl FnOnce() -> L) -> Verdict {
    if error <= bound {
        return Verdict::Right(error / bound);
    }
    let label = label();
    Verdict::Wrong(format!("{label}: {error:e}, at most {bound:e} is allowed"))
}

/// Returns a bound of f32's rounding errors for the precision `R`: a millionth of it for f64.
pub fn bound_in<R: Real>(bound: f64) -> f64 {
    if R::IS_SINGLE { bound } else { bound * 1e-6 }
}

/// Returns the verdict about a condition, which is right if the condition holds. `label` returns
/// the message of a wrong verdict.
pub fn require<L: fmt::Display>(condition: bool, label: impl FnOnce() -> L) -> Verdict {
    if condition {
        return Verdict::Right(0.0);
    }
    Verdict::Wrong(label().to_string())
}

/// Combines verdicts. If both are right, the result is right with the greater error. Otherwise it
/// is the first of the two that is not right.
impl BitAnd for Verdict {
    type Output = Self;

    fn bitand(self, other: Self) -> Self {
        match (self, other) {
            (Self::Right(a), Self::Right(b)) => Self::Right(a.max(b)),
            (Self::Right(_), verdict) | (verdict, _) => verdict,
        }
    }
}

/// Fraction of a case's rays that are traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RayCount {
    /// A quarter of the rays, but at least 10,000. A case with fewer rays traces all of them.
    #[default]
    Quarter,
    /// All rays, which takes minutes on one core.
    All,
}

impl RayCount {
    /// Returns the number of rays to trace for a case of `count` rays.
    pub fn limit_ray_count(self, count: u32) -> u32 {
        match self {
            Self::Quarter => (count / 4).max(10_000).min(count),
            Self::All => count,
        }
    }
}

/// Outcome of a part of a case in a setting: how many of its rays were judged right, wrong, or not
/// at all.
#[derive(Clone, Debug, Default)]
pub struct CaseOutcome {
    /// Number of the case and name of the part.
    pub case: String,
    /// Name of the setting: the precision and, if several kernels can traverse the tree, the
    /// kernel, as in `robust, avx2`; or `textbook`, for the textbook's formulas in f32.
    pub setting: String,
    /// Number of rays that the whole case has.
    pub rays: u64,
    /// Number of rays that were traced, which may be less than `rays`.
    pub shot: u64,
    /// Number of rays whose verdict is right or wrong.
    pub judged: u64,
    /// Number of rays whose verdict is undecidable.
    pub undecidable: u64,
    /// Number of rays whose verdict is wrong.
    pub wrong: u64,
    /// Number of skipped rays.
    pub skipped: u64,
    /// Greatest error among right verdicts, as a fraction of its bound.
    pub worst: f64,
    /// Index of the first ray with a wrong verdict, and the message of that verdict.
    pub first_wrong: Option<(u64, String)>,
}

impl CaseOutcome {
    /// Fraction of the judged rays that are wrong.
    pub fn wrong_fraction(&self) -> f64 {
        self.wrong as f64 / (self.judged as f64).max(1.0)
    }
    /// Returns the outcome of a single ray with this index.
    fn of_ray(index: u64, verdict: Verdict) -> Self {
        let one = Self {
            judged: 1,
            ..Self::default()
        };
        match verdict {
            Verdict::Right(worst) => Self { worst, ..one },
            Verdict::Wrong(label) => Self {
                wrong: 1,
                first_wrong: Some((index, label)),
                ..one
            },
            Verdict::Undecidable => Self {
                judged: 0,
                undecidable: 1,
                ..one
            },
            Verdict::Skipped => Self {
                judged: 0,
                skipped: 1,
                ..one
            },
        }
    }
    /// Merges two outcomes: counts are added, and the greater error and the first wrong ray are
    /// kept. The names are those of `self`.
    #[must_use]
    pub fn merge(self, other: Self) -> Self {
        let wrong = self.first_wrong.into_iter().chain(other.first_wrong);
        Self {
            rays: self.rays + other.rays,
            shot: self.shot + other.shot,
            judged: self.judged + other.judged,
            undecidable: self.undecidable + other.undecidable,
            wrong: self.wrong + other.wrong,
            skipped: self.skipped + other.skipped,
            worst: self.worst.max(other.worst),
            first_wrong: wrong.min_by_key(|first| first.0),
            ..self
        }
    }
}

/// Judges the rays of a case in parallel. The case has `count` rays, of which `rays` selects all or
/// a part. The function `f` returns the verdict about the ray with an index.
pub fn judge_indices(
    case: &str,
    count: u32,
    rays: RayCount,
    f: impl Fn(u64) -> Verdict + Sync,
) -> CaseOutcome {
    let shot = rays.limit_ray_count(count);
    let judge = |index: u32| CaseOutcome::of_ray(index.into(), f(index.into()));
    let outcomes = (0..shot).into_par_iter().with_min_len(8).map(judge);
    CaseOutcome {
        case: case.to_owned(),
        rays: count.into(),
        shot: shot.into(),
        ..outcomes.reduce(CaseOutcome::default, CaseOutcome::merge)
    }
}
