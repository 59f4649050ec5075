//! Seeded rays, judged in parallel, and the outcome.

use core::fmt::Write;

use glam::DVec3;
use rayon::prelude::*;

use crate::{Interval, PreparedRay, Ray, Real, Shape, ShapeHit, Side, Vector};

/// Unit roundoff of f32.
pub const U: f64 = 5.960_464_477_539_063e-8;

/// The spacing of f32 at `x`.
pub fn ulp(x: f64) -> f64 {
    let x = (x.abs() as f32).max(f32::MIN_POSITIVE);
    f64::from(x.next_up()) - f64::from(x)
}

/// A small generator (SplitMix64: Steele, Lea, Flood, "Fast Splittable Pseudorandom Number
/// Generators", 2014), seeded by case and ray, so that each ray can be repeated alone.
#[derive(Debug)]
pub struct CaseRng {
    state: u64,
    index: u64,
}

impl CaseRng {
    /// The generator of one ray of a case.
    pub fn new(seed: u64, index: u64) -> Self {
        let state =
            seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ index.wrapping_mul(0xd6e8_feb8_6659_fd93);
        let mut rng = Self { state, index };
        rng.bits();
        rng
    }
    /// Index of the ray in its case.
    pub fn index(&self) -> u64 {
        self.index
    }
    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = self.state;
        let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }
    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
    /// A random element.
    pub fn choose<T: Copy>(&mut self, from: &[T]) -> T {
        from[(self.bits() % from.len() as u64) as usize]
    }
    /// 1 or −1.
    pub fn sign(&mut self) -> f64 {
        if self.bits() & 1 == 0 { 1.0 } else { -1.0 }
    }
    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> DVec3 {
        let (z, a) = (
            self.uniform(-1.0, 1.0),
            self.unit() * core::f64::consts::TAU,
        );
        let ring = (1.0 - z * z).sqrt();
        DVec3::new(ring * a.cos(), ring * a.sin(), z)
    }
    /// Uniform in the cube [−1, 1]³.
    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(
            self.uniform(-1.0, 1.0),
            self.uniform(-1.0, 1.0),
            self.uniform(-1.0, 1.0),
        )
    }
    /// Uniform in the disc of the given radius, perpendicular to a direction.
    pub fn in_disc(&mut self, across: DVec3, radius: f64) -> DVec3 {
        let (a, b) = across.any_orthonormal_pair();
        let (r, angle) = (
            radius * self.unit().sqrt(),
            self.unit() * core::f64::consts::TAU,
        );
        a * (r * angle.cos()) + b * (r * angle.sin())
    }
}

/// A vector rounded to the stored scalar.
pub fn to_scalar<R: Real>(v: DVec3) -> R::Vec3 {
    R::Vec3::from_f64(v)
}

/// A vector rounded to f32, as f64: an exact input.
pub fn exact(v: DVec3) -> DVec3 {
    v.as_vec3().as_dvec3()
}

/// A ray from exact origin and direction, without normalisation.
pub fn ray<R: Real>(origin: DVec3, direction: DVec3) -> Ray<R> {
    Ray::new(to_scalar::<R>(origin), to_scalar::<R>(direction))
}

/// A ray towards a point, of unit length as far as f32 allows.
pub fn ray_towards<R: Real>(origin: DVec3, target: DVec3) -> Ray<R> {
    let origin = exact(origin);
    ray::<R>(origin, exact((target - origin).normalize()))
}

/// The nearest hit in front of the origin, from either side.
pub fn hit<R: Real>(shape: &impl Shape<R>, ray: &Ray<R>) -> Option<ShapeHit<R>> {
    shape.intersect(&PreparedRay::new(*ray), Interval::positive(), Side::Both)
}

/// Bit patterns of a ray in f32, for a message.
pub fn hex<R: Real>(ray: &Ray<R>) -> String {
    let mut text = String::new();
    for (name, v) in [
        ("origin", ray.origin.to_f32()),
        ("direction", ray.direction.to_f32()),
    ] {
        let _ = write!(
            text,
            " {name} {:08x} {:08x} {:08x}",
            v.x.to_bits(),
            v.y.to_bits(),
            v.z.to_bits()
        );
    }
    text
}

/// Judgement of one ray by an oracle.
#[derive(Debug)]
pub enum Verdict {
    /// Right, with the error relative to the bound.
    Right(f64),
    /// Undecidable, since the oracle's margin is smaller than the bound: counted, not judged.
    Band,
    /// Wrong, with a message.
    Wrong(String),
    /// The random construction has no valid question.
    Skip,
}

impl Verdict {
    /// Right if the error is within the bound; wrong for NaN.
    pub fn within_bound(error: f64, bound: f64, label: impl FnOnce() -> String) -> Self {
        if error <= bound {
            Self::Right(error / bound)
        } else {
            Self::Wrong(format!("{}: {error:e} > {bound:e}", label()))
        }
    }
    /// Right if the condition holds.
    pub fn holds(condition: bool, label: impl FnOnce() -> String) -> Self {
        if condition {
            Self::Right(0.0)
        } else {
            Self::Wrong(label())
        }
    }
    /// The first verdict that is not right, otherwise the greater error.
    pub fn and(self, other: impl FnOnce() -> Self) -> Self {
        match self {
            Self::Right(a) => match other() {
                Self::Right(b) => Self::Right(a.max(b)),
                verdict => verdict,
            },
            verdict => verdict,
        }
    }
}

/// How many rays of a case to shoot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RayCount {
    /// A quarter; of small cases all.
    #[default]
    Quarter,
    /// All, which takes minutes on one core.
    All,
}

impl RayCount {
    /// Number of rays out of `count`.
    pub fn of(self, count: u32) -> u32 {
        match self {
            Self::Quarter => (count / 4).max(10_000).min(count),
            Self::All => count,
        }
    }
}

/// Sum of many verdicts.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Name of the case.
    pub case: String,
    /// Number of rays of the case.
    pub rays: u64,
    /// Number of rays shot.
    pub shot: u64,
    /// Number of rays judged by an oracle.
    pub judged: u64,
    /// Number of rays too close for the oracle to decide.
    pub band: u64,
    /// Number of wrong rays.
    pub wrong: u64,
    /// Number of rays without a valid question.
    pub skipped: u64,
    /// Greatest error of a right ray, relative to its bound.
    pub worst: f64,
    /// Index and message of the first wrong ray.
    pub first: Option<(u64, String)>,
}

impl Outcome {
    /// Fraction of judged rays that are wrong.
    pub fn wrong_share(&self) -> f64 {
        self.wrong as f64 / (self.judged as f64).max(1.0)
    }
    /// Sum of both outcomes, under the first one's name.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        let first = match (self.first, other.first) {
            (Some(a), Some(b)) => Some(if a.0 <= b.0 { a } else { b }),
            (a, b) => a.or(b),
        };
        Self {
            case: self.case,
            rays: self.rays + other.rays,
            shot: self.shot + other.shot,
            judged: self.judged + other.judged,
            band: self.band + other.band,
            wrong: self.wrong + other.wrong,
            skipped: self.skipped + other.skipped,
            worst: self.worst.max(other.worst),
            first,
        }
    }
}

/// Judges the rays of a case of `count` rays in parallel, each with its own random numbers.
pub fn judge(
    case: &str,
    seed: u64,
    count: u32,
    rays: RayCount,
    f: impl Fn(&mut CaseRng) -> Verdict + Sync,
) -> Outcome {
    let empty = Outcome {
        case: case.to_owned(),
        rays: 0,
        shot: 0,
        judged: 0,
        band: 0,
        wrong: 0,
        skipped: 0,
        worst: 0.0,
        first: None,
    };
    let none = || empty.clone();
    let shot = rays.of(count);
    let outcome = (0..shot)
        .into_par_iter()
        .with_min_len(512)
        .fold(none, |mut sum, index| {
            match f(&mut CaseRng::new(seed, u64::from(index))) {
                Verdict::Right(share) => {
                    (sum.judged, sum.worst) = (sum.judged + 1, sum.worst.max(share))
                }
                Verdict::Band => sum.band += 1,
                Verdict::Skip => sum.skipped += 1,
                Verdict::Wrong(message) => {
                    sum.judged += 1;
                    sum.wrong += 1;
                    if sum
                        .first
                        .as_ref()
                        .is_none_or(|first| u64::from(index) < first.0)
                    {
                        sum.first = Some((index.into(), message));
                    }
                }
            }
            sum
        })
        .reduce(none, Outcome::plus);
    Outcome {
        rays: count.into(),
        shot: shot.into(),
        ..outcome
    }
}
