//! How a surface answers to light at a point: a few [lobes](Lobe) on the stack, to be evaluated, sampled and weighed.
//!
//! Directions are unit and point away from the surface; the normal is on the side of `wo`, the way back to the viewer. Everything
//! is written over the scalar, so that it holds for f32 and f64 alike.
//!
//! ```
//! use glam::DVec3;
//! use raywright_core::material::MetallicRoughness;
//!
//! let paint = MetallicRoughness::<f64> { base: DVec3::new(0.8, 0.2, 0.1), metallic: 0.0, roughness: 0.5, dielectric: 0.04, glass: None };
//! let bsdf = paint.bsdf(DVec3::Y, true);
//! let (wo, wi) = (DVec3::Y, DVec3::new(0.6, 0.8, 0.0));
//! assert!(bsdf.eval(wo, wi).x > bsdf.eval(wo, wi).y && bsdf.pdf(wo, wi) > 0.0);
//! ```

mod fresnel;
mod interface;
mod lobe;
#[cfg(test)]
mod tests;

use raywright_bvh::{Real, Vector};

pub use fresnel::{dielectric, schlick, towards_grazing};
pub(crate) use interface::Interface;
pub use lobe::Lobe;
use lobe::Pair;

/// Lobes that a surface may have.
pub const MOST_LOBES: usize = 4;

/// The answer to light of a surface at a point.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<R: Real> {
    normal: R::Vec3,
    lobes: [Lobe<R>; MOST_LOBES],
    count: usize,
}

/// A direction in which light may have come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampled<R: Real> {
    /// Unit, away from the surface.
    pub direction: R::Vec3,
    /// What light from there counts: value · |cosine| over the density, in the mean the share that is sent back.
    pub weight: R::Vec3,
    /// Density by solid angle; zero for a delta lobe, which has none.
    pub density: R,
    /// Whether a delta lobe gave it, so that no light would be met in any other way.
    pub delta: bool,
}

impl<R: Real> Bsdf<R> {
    /// A surface without lobes, which is black.
    #[inline(always)]
    pub fn new(normal: R::Vec3) -> Self {
        let nothing = Lobe::Mirror { f0: R::Vec3::ZERO, f90: R::Vec3::ZERO };
        Self { normal, lobes: [nothing; MOST_LOBES], count: 0 }
    }

    /// Adds a lobe; beyond [`MOST_LOBES`] none is taken.
    #[inline(always)]
    #[must_use]
    pub fn with(mut self, lobe: Lobe<R>) -> Self {
        if let Some(slot) = self.lobes.get_mut(self.count) {
            *slot = lobe;
            self.count += 1;
        }
        self
    }

    /// Its lobes.
    #[inline(always)]
    pub fn lobes(&self) -> &[Lobe<R>] {
        &self.lobes[..self.count]
    }

    #[inline(always)]
    fn sum(&self, wo: R::Vec3, wi: R::Vec3, counts: impl Fn(&Lobe<R>) -> bool) -> R::Vec3 {
        let pair = Pair::new(self.normal, wo, wi);
        let mut sum = R::Vec3::ZERO;
        for lobe in self.lobes() {
            if counts(lobe) {
                sum += lobe.value(&pair);
            }
        }
        sum
    }

    /// Bidirectional reflectance from `wi`, which is above the surface, to `wo`; of delta lobes nothing.
    #[inline(always)]
    pub fn eval(&self, wo: R::Vec3, wi: R::Vec3) -> R::Vec3 {
        self.sum(wo, wi, |_| true)
    }

    /// [`Self::eval`] of the diffuse lobes alone, for a light that makes no highlights.
    #[inline(always)]
    pub fn diffuse(&self, wo: R::Vec3, wi: R::Vec3) -> R::Vec3 {
        self.sum(wo, wi, |lobe| matches!(lobe, Lobe::Diffuse { .. }))
    }

    /// Sum of what the choice among lobes goes by.
    fn importance(&self, cosine: R) -> R {
        self.lobes().iter().fold(R::ZERO, |sum, lobe| sum + lobe.importance(cosine))
    }

    /// Density by solid angle with which [`Self::sample`] gives `wi`; delta lobes, which have none, take their share of it away.
    pub fn pdf(&self, wo: R::Vec3, wi: R::Vec3) -> R {
        let (cosine, total) = (self.normal.dot(wo), self.importance(self.normal.dot(wo)));
        if cosine <= R::ZERO || self.normal.dot(wi) <= R::ZERO || total <= R::ZERO {
            return R::ZERO;
        }
        let pair = Pair::new(self.normal, wo, wi);
        let sum = self.lobes().iter().fold(R::ZERO, |sum, lobe| sum + lobe.importance(cosine) * lobe.density(&pair));
        sum / total
    }

    /// A direction for three numbers in [0, 1), of which the first chooses the lobe; none where what was drawn sends nothing.
    pub fn sample(&self, wo: R::Vec3, [choice, u, v]: [R; 3]) -> Option<Sampled<R>> {
        let cosine = self.normal.dot(wo);
        let total = self.importance(cosine);
        if cosine <= R::ZERO || total <= R::ZERO {
            return None;
        }
        let mut left = choice * total;
        let within = |lobe: &&Lobe<R>| {
            left -= lobe.importance(cosine);
            left < R::ZERO
        };
        // Rounding may leave a rest behind the last one.
        let lobe = self.lobes().iter().find(within).or(self.lobes().last())?;
        let probability = lobe.importance(cosine) / total;
        if lobe.is_delta() {
            return self.sample_delta(lobe, wo, u).map(|(direction, weight)| Sampled {
                direction,
                weight: weight / probability,
                density: R::ZERO,
                delta: true,
            });
        }
        let [x, y] = tangents::<R>(self.normal);
        let drawn = lobe.drawn(R::Vec3::new(x.dot(wo), y.dot(wo), cosine), [u, v]);
        let direction = x * drawn.x() + y * drawn.y() + self.normal * drawn.z();
        let (density, facing) = (self.pdf(wo, direction), self.normal.dot(direction));
        // Also false for NaN.
        (density > R::ZERO && facing > R::ZERO).then(|| Sampled {
            direction,
            weight: self.eval(wo, direction) * (facing / density),
            density,
            delta: false,
        })
    }

    /// Direction and weight of a delta lobe; a dielectric divides its light by a number in [0, 1).
    fn sample_delta(&self, lobe: &Lobe<R>, wo: R::Vec3, u: R) -> Option<(R::Vec3, R::Vec3)> {
        let Lobe::Dielectric { eta, share, reflected, transmitted } = *lobe else {
            let cosine = self.normal.dot(wo);
            return Some((self.normal * (R::from_f64(2.0) * cosine) - wo, lobe.reflectance(cosine)));
        };
        let interface = Interface::new(-wo.to_f64(), self.normal.to_f64(), eta);
        // Chosen by the share itself, so the weight is the tint.
        match interface.refracted {
            Some(direction) if u.to_f64() >= interface.fresnel() => Some((R::Vec3::from_f64(direction), transmitted * share)),
            _ => Some((R::Vec3::from_f64(interface.reflected), reflected * share)),
        }
    }
}

/// Two unit directions across a unit normal and each other ("Building an Orthonormal Basis, Revisited", Duff et al. 2017).
fn tangents<R: Real>(n: R::Vec3) -> [R::Vec3; 2] {
    let sign = R::ONE.copysign(n.z());
    let a = -R::ONE / (sign + n.z());
    let b = n.x() * n.y() * a;
    [
        R::Vec3::new(R::ONE + sign * n.x() * n.x() * a, sign * b, -(sign * n.x())),
        R::Vec3::new(b, sign + n.y() * n.y() * a, -n.y()),
    ]
}

/// What makes a boundary of glass of a share of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass<R: Real> {
    /// Index of refraction of the inside over the outside.
    pub ior: f64,
    /// Factor of what is reflected.
    pub reflected: R::Vec3,
    /// Factor of what is let through.
    pub transmitted: R::Vec3,
}

impl<R: Real> Glass<R> {
    /// Index on the side that a ray comes from over the one beyond.
    #[inline(always)]
    pub fn eta(&self, outside: bool) -> f64 {
        if outside { 1.0 / self.ior } else { self.ior }
    }
}

/// The inputs of the metallic-roughness model at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness<R: Real> {
    /// Base colour.
    pub base: R::Vec3,
    /// 0 dielectric to 1 metal.
    pub metallic: R,
    /// Perceptual roughness.
    pub roughness: R,
    /// Reflectance of the dielectric part at normal incidence.
    pub dielectric: R,
    /// The boundary of the dielectric part, where it lets light through.
    pub glass: Option<Glass<R>>,
}

impl<R: Real> MetallicRoughness<R> {
    /// Share of the surface that is a boundary of glass.
    #[inline(always)]
    pub fn through(&self) -> R {
        if self.glass.is_some() { R::ONE - self.metallic } else { R::ZERO }
    }

    /// Colour that is diffused: what neither a metal nor the way through takes away.
    #[inline(always)]
    pub fn albedo(&self) -> R::Vec3 {
        let tint = self.glass.map_or(R::ZERO, |glass| glass.transmitted.max_element().min(R::ONE));
        self.base * ((R::ONE - self.metallic) * (R::ONE - self.through() * tint))
    }

    /// Reflectance at normal incidence.
    #[inline(always)]
    pub fn f0(&self) -> R::Vec3 {
        R::Vec3::splat(self.dielectric) * (R::ONE - self.metallic) + self.base * self.metallic
    }

    /// The mirror that its glossy lobe is where the roughness is next to none.
    #[inline(always)]
    pub fn mirror(&self) -> Lobe<R> {
        Lobe::Mirror { f0: self.f0(), f90: R::Vec3::ONE }
    }

    /// The lobes that answer to a light: diffuse and glossy. How many is known when this is compiled, so nothing is left of
    /// the list.
    #[inline(always)]
    pub fn answer(&self, normal: R::Vec3) -> Bsdf<R> {
        let f0 = self.f0();
        let diffuse = Lobe::Diffuse { albedo: self.albedo(), f0 };
        Bsdf::new(normal).with(diffuse).with(Lobe::Glossy { f0, roughness: self.roughness })
    }

    /// All its lobes: those of [`Self::answer`], and the boundary of glass.
    #[inline(always)]
    pub fn bsdf(&self, normal: R::Vec3, outside: bool) -> Bsdf<R> {
        let bsdf = self.answer(normal);
        let (share, Some(glass)) = (self.through(), self.glass) else { return bsdf };
        let (eta, reflected, transmitted) = (glass.eta(outside), glass.reflected, glass.transmitted);
        if share > R::ZERO { bsdf.with(Lobe::Dielectric { eta, share, reflected, transmitted }) } else { bsdf }
    }
}
