//! The lobes that a surface's answer to light is made of: plain data, each with its value, its density and its weight.

use core::f64::consts::PI;

use super::dielectric::Dielectric;
use super::energy::Remainder;
use super::frame::Frame;
use super::fresnel::schlick_weight;
use super::ggx::{Ggx, alpha, mirrored, sample_wm};
use super::interreflected::Interreflected;
use crate::number::{Mask, Number, Vector3};

/// One way in which a surface sends light back or on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe<N: Number> {
    /// Lambert's below facets that reflect by Schlick, and what the facets send to each other.
    Diffuse {
        /// Share that is diffused of what the facets leave.
        albedo: N::Vec3,
        /// Factor of what white facets send to each other.
        interreflected: N::Vec3,
        /// What they leave of it.
        remainder: Remainder<N>,
    },
    /// Lambert's: the same radiance in every direction.
    Lambert {
        /// Share that is diffused.
        albedo: N::Vec3,
    },
    /// Microfacets by the GGX distribution, whose reflectance goes from the one to the other by Schlick.
    Rough {
        /// Reflectance of a facet at normal incidence.
        f0: N::Vec3,
        /// Reflectance of a facet at grazing incidence.
        f90: N::Vec3,
        /// Perceptual roughness; the microfacet α is its square.
        roughness: N,
    },
    /// A smooth mirror, whose reflectance goes from the one to the other by Schlick.
    Mirror {
        /// Reflectance at normal incidence.
        f0: N::Vec3,
        /// Reflectance at grazing incidence.
        f90: N::Vec3,
    },
    /// A boundary of a dielectric, smooth or rough.
    Dielectric(Dielectric<N>),
    /// What the facets of a rough one send to each other.
    Interreflected(Interreflected<N>),
}

/// Two unit directions away from a surface and what the lobes ask of them.
#[derive(Clone, Copy, Debug)]
pub struct Pair<N: Number> {
    pub(super) normal: N::Vec3,
    pub(super) wo: N::Vec3,
    pub(super) wi: N::Vec3,
    /// Unit, halfway between them.
    pub(super) half: N::Vec3,
    /// Cosines to the normal: of the way back, and of the light.
    pub(super) out: N,
    pub(super) into: N,
    /// Cosine between the light and `half`.
    pub(super) tilt: N,
}

impl<N: Number> Pair<N> {
    #[inline(always)]
    pub(super) fn new(normal: N::Vec3, wo: N::Vec3, wi: N::Vec3) -> Self {
        let half = (wi + wo).normalize();
        Self { normal, wo, wi, half, out: normal.dot(wo), into: normal.dot(wi), tilt: half.dot(wi).max(N::ZERO) }
    }

    /// The pair with the light above the surface, mirrored there if it was below.
    pub(super) fn folded(&self) -> Self {
        let up = self.wi - self.normal * (N::from_f64(2.0) * self.into);
        Self::new(self.normal, self.wo, N::Vec3::select(self.into.above(N::ZERO), self.wi, up))
    }

    /// The pair about another normal.
    pub(super) fn about(&self, normal: N::Vec3) -> Self {
        Self { normal, out: normal.dot(self.wo), into: normal.dot(self.wi), ..*self }
    }

    /// What facets of such a reflectance send back, and their density.
    #[inline(always)]
    pub(super) fn reflected(&self, reflectance: N::Vec3, facets: &Ggx<N>) -> (N::Vec3, N) {
        let (value, density) = facets.eval_and_pdf(self);
        (N::Vec3::select(self.out.above(N::ZERO), reflectance * value, N::Vec3::ZERO), density)
    }
}

/// A lobe that a [`Bsdf`](super::Bsdf) holds.
pub trait LobeFamily<N: Number>: LobeKind<N> + Copy + core::fmt::Debug {
    /// A lobe that sends nothing.
    const NOTHING: Self;
    /// Whether there are mirrors about other normals than the surface's.
    const COATED: bool = false;
}

/// What a lobe does with light: nothing, where it does not say otherwise.
pub trait LobeKind<N: Number> {
    /// How much it may send back to a direction with this cosine to the normal: what choosing among lobes goes by.
    fn importance(&self, cosine: N) -> N;
    /// Whether it answers in single directions only, so that it has neither a value nor a density.
    fn is_delta(&self) -> bool {
        false
    }
    /// Whether it lets light through that could have been drawn.
    fn lets_through(&self) -> bool {
        false
    }
    /// Its bidirectional reflectance for a light above the surface, and the density by solid angle with which [`Self::sample`] gives
    /// the light's direction.
    fn eval_and_pdf(&self, pair: &Pair<N>) -> (N::Vec3, N);
    /// The part of it that is diffused, with which it answers to lights that make no highlights.
    fn eval_diffuse(&self, _pair: &Pair<N>) -> N::Vec3 {
        N::Vec3::ZERO
    }
    /// What it lets through of a light below the surface, over the cosine there, and the density of that light's direction.
    fn eval_and_pdf_through(&self, _pair: &Pair<N>) -> (N::Vec3, N) {
        (N::Vec3::ZERO, N::ZERO)
    }
    /// A direction for the way back, in the world and in the frame about the surface's normal, and three numbers in [0, 1). Of a
    /// lobe that is not delta.
    fn sample(&self, _frame: &Frame<N>, _wo: N::Vec3, _local: N::Vec3, _choice: N, _point: [N; 2]) -> N::Vec3 {
        N::Vec3::ZERO
    }
    /// Direction and weight of a delta lobe; one that divides its light does so by a number in [0, 1).
    fn sample_delta(&self, normal: N::Vec3, _wo: N::Vec3, _u: N) -> (N::Vec3, N::Vec3) {
        (normal, N::Vec3::ZERO)
    }
}

impl<N: Number> LobeFamily<N> for Lobe<N> {
    const NOTHING: Self = Self::Mirror { f0: <N::Vec3 as Vector3<N>>::ZERO, f90: <N::Vec3 as Vector3<N>>::ZERO };
}

impl<N: Number> LobeKind<N> for Lobe<N> {
    #[inline(always)]
    fn is_delta(&self) -> bool {
        matches!(self, Self::Mirror { .. } | Self::Dielectric(Dielectric { roughness: None, .. }))
    }

    #[inline(always)]
    fn lets_through(&self) -> bool {
        matches!(self, Self::Dielectric(Dielectric { roughness: Some(_), .. }) | Self::Interreflected(_))
    }

    #[inline(always)]
    fn eval_and_pdf(&self, pair: &Pair<N>) -> (N::Vec3, N) {
        let by_cosine = |diffused: N::Vec3| (diffused / N::from_f64(PI), pair.into / N::from_f64(PI));
        match *self {
            Self::Diffuse { albedo, interreflected, remainder } => {
                // Matte surfaces of the classic kind have no layer, and look nothing up.
                if !remainder.is_covered() && !interreflected.max_element().above(N::ZERO).any() {
                    return by_cosine(albedo);
                }
                let [base, lost] = remainder.towards(pair.into);
                by_cosine(albedo * base + interreflected * lost)
            }
            Self::Lambert { albedo } => by_cosine(albedo),
            Self::Rough { f0, f90, roughness } => {
                let reflectance = f0 + (f90 - f0) * schlick_weight(pair.tilt);
                let (value, density) = pair.reflected(reflectance, &Ggx::isotropic(pair.normal, roughness));
                // Also where directions are opposite, which have no half.
                let some = f0.max(f90).max_element().above(N::ZERO);
                (N::Vec3::select(some, value, N::Vec3::ZERO), density)
            }
            Self::Dielectric(boundary) => boundary.eval_and_pdf(pair),
            Self::Interreflected(facets) => facets.eval_and_pdf(pair),
            Self::Mirror { .. } => (N::Vec3::ZERO, N::ZERO),
        }
    }

    #[inline(always)]
    fn eval_diffuse(&self, pair: &Pair<N>) -> N::Vec3 {
        match *self {
            Self::Diffuse { albedo, remainder, .. } => {
                let base = if remainder.is_covered() { remainder.towards(pair.into)[0] } else { N::ONE };
                albedo * base / N::from_f64(PI)
            }
            Self::Lambert { albedo } => albedo / N::from_f64(PI),
            _ => N::Vec3::ZERO,
        }
    }

    #[inline(always)]
    fn eval_and_pdf_through(&self, pair: &Pair<N>) -> (N::Vec3, N) {
        match self {
            Self::Dielectric(boundary) => boundary.eval_and_pdf_through(pair),
            Self::Interreflected(facets) => facets.eval_and_pdf_through(pair),
            _ => (N::Vec3::ZERO, N::ZERO),
        }
    }

    #[inline(always)]
    fn sample(&self, frame: &Frame<N>, wo: N::Vec3, local: N::Vec3, choice: N, [u, v]: [N; 2]) -> N::Vec3 {
        frame.to_world(match *self {
            Self::Dielectric(boundary) => return boundary.sample(frame, wo, local, choice, [u, v]),
            Self::Interreflected(facets) => return facets.sample(frame, wo, local, choice, [u, v]),
            Self::Rough { roughness, .. } => {
                let facet = sample_wm::<N>(local, [alpha(roughness); 2], on_disk([u, v]));
                let mirrored = mirrored::<N>(local, facet);
                // What a facet sends below meets another one, and is lost: no other lobe may take it for light that goes through.
                N::Vec3::select(mirrored.z().above(N::ZERO), mirrored, N::Vec3::ZERO)
            }
            _ => Self::cosine([u, v]),
        })
    }

    #[inline(always)]
    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, u: N) -> (N::Vec3, N::Vec3) {
        if let Self::Dielectric(boundary) = self {
            return boundary.sample_delta(normal, wo, u);
        }
        let cosine = normal.dot(wo);
        (normal * (N::from_f64(2.0) * cosine) - wo, self.reflectance(cosine))
    }

    #[inline(always)]
    fn importance(&self, cosine: N) -> N {
        match *self {
            Self::Diffuse { albedo, interreflected, remainder } => {
                (albedo * remainder.shown[0] + interreflected * remainder.shown[1]).max_element()
            }
            Self::Lambert { albedo } => albedo.max_element(),
            Self::Rough { .. } | Self::Mirror { .. } => self.reflectance(cosine).max_element(),
            Self::Dielectric(boundary) => boundary.importance(cosine),
            Self::Interreflected(facets) => facets.importance(cosine),
        }
    }
}

impl<N: Number> Lobe<N> {
    /// A direction about the third axis, drawn by the cosine for two numbers in [0, 1): a point of the disk, raised to the
    /// hemisphere (Malley).
    #[inline(always)]
    pub(crate) fn cosine([u, v]: [N; 2]) -> N::Vec3 {
        let [x, y] = on_disk([u, v]);
        N::Vec3::new(x, y, (N::ONE - u).max(N::ZERO).sqrt())
    }

    /// Such a direction in a frame, on its side where a mask is set and beyond elsewhere.
    pub(super) fn cosine_either(frame: &Frame<N>, above: N::Mask, point: [N; 2]) -> N::Vec3 {
        let up = Self::cosine(point);
        let down = N::Vec3::new(up.x(), up.y(), -up.z());
        frame.to_world(N::Vec3::select(above, up, down))
    }

    /// Share that a mirror or facets reflect at this cosine to their normal; of other lobes nothing.
    #[inline(always)]
    pub fn reflectance(&self, cosine: N) -> N::Vec3 {
        let (Self::Rough { f0, f90, .. } | Self::Mirror { f0, f90 }) = *self else { return N::Vec3::ZERO };
        f0 + (f90 - f0) * schlick_weight(cosine.max(N::ZERO))
    }
}

/// An even point of the unit disk for two numbers in [0, 1).
#[inline(always)]
pub(super) fn on_disk<N: Number>([u, v]: [N; 2]) -> [N; 2] {
    let [cos, sin] = v.turned();
    [u.sqrt() * cos, u.sqrt() * sin]
}
