//! Energy of rough facets, by their directional albedos: what lies below gets what facets leave and
//! no more, and what they send to each other comes back.
//!
//! With E(o) the share of light that is sent back towards o, and Ē its mean by the cosine, (1 −
//! E(o))·(1 − E(i))/(π·(1 − Ē)) sends back 1 − E(o) in all ("A Microfacet Based Coupled
//! Specular-Matte BRDF Model with Importance Sampling", Kelemen, Szirmay-Kalos 2001; "Revisiting
//! Physically Based Shading at Imageworks", Kulla, Conty 2017). It is the same both ways, and keeps
//! exactly what E leaves. Both uses of it here are one formula: the base below a layer, whose E is
//! the layer's, and the facets' own interreflection, whose E is that of white ones. Refused for the
//! base: glTF's 1 − F(h·l), by which white plastic sends back 1.89 times what it gets at 89.5°; 1 −
//! E(o) alone (Cycles, OpenPBR), which keeps as much but is not the same both ways; min(1 − E(o), 1
//! − E(i)), the rule of covers, which is never too much either but loses 5 % head-on.

use super::albedo::{Albedo, MEAN_GRAZING};
use crate::number::{Mask, Number, Vector3};

/// Share that facets send back whose reflectance goes by Schlick from `f0` at normal incidence to
/// one.
pub(super) fn directional_albedo(f0: f64, roughness: f64, cosine: f64) -> f64 {
    Albedo::<f64>::towards(cosine, roughness)
        .sent(f0, 1.0)
        .clamp(0.0, 1.0)
}

/// Factor of what white facets send to each other, of ones that reflect f0 at normal and f90 at
/// grazing incidence, and of which white ones lose a share in the mean: F̄²·Ē/(1 − F̄·(1 − Ē)) by
/// the mean reflectance F̄ (Kulla, Conty 2017).
#[inline(always)]
pub(super) fn interreflected_of<N: Number>(f0: N, f90: N, lost: N) -> N {
    let mean = f0 + (f90 - f0) * N::from_f64(MEAN_GRAZING);
    mean * mean * (N::ONE - lost) / (N::ONE - mean * lost)
}

/// The factor of dielectric facets that reflect so much at normal and at grazing incidence, and
/// that of all facets, of which shares are dielectric and metal.
#[inline(always)]
pub(super) fn interreflections<N: Number>(
    [f0, f90]: [N; 2],
    metal: N::Vec3,
    shares: [N; 2],
    lost: N,
) -> (N, N::Vec3) {
    let (dielectric, part) = (interreflected_of(f0, f90, lost), |f0: N| {
        interreflected_of(f0, N::ONE, lost)
    });
    let metal = N::Vec3::new(part(metal.x()), part(metal.y()), part(metal.z()));
    (
        dielectric,
        metal * shares[1] + N::Vec3::splat(dielectric * shares[0]),
    )
}

/// The mean over the hemisphere, by the cosine, of what is said of cosines: Gauss's rule by their
/// squares.
pub(super) fn mean_of<N: Number>(of: impl Fn(N) -> N) -> N {
    const RULE: [[f64; 2]; 4] = [
        [0.069_431_844_202_973_7, 0.173_927_422_568_726_9],
        [0.330_009_478_207_571_9, 0.326_072_577_431_273_1],
        [0.669_990_521_792_428_1, 0.326_072_577_431_273_1],
        [0.930_568_155_797_026_3, 0.173_927_422_568_726_9],
    ];
    RULE.iter().fold(N::ZERO, |sum, [square, weight]| {
        sum + of(N::from_f64(square.sqrt())) * N::from_f64(*weight)
    })
}

/// What a layer of facets leaves to a base below it, and what white ones leave to each other, seen
/// from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remainder<N: Number> {
    /// Reflectance of the layer at normal and at grazing incidence, and its factor of what white
    /// facets send to each other.
    layer: [N; 3],
    /// Perceptual roughness.
    pub(super) roughness: N,
    /// What is left towards the view, over what is in the mean: of the layer, and of white facets.
    pub(super) seen: [N; 2],
    /// What is left towards the view: what a white base sends there of even light, and white facets
    /// of what they send to each other. What the choice among lobes goes by.
    pub(super) shown: [N; 2],
}

/// Least mean that is told from none.
const LEAST_MEAN: f64 = 1e-6;

impl<N: Number> Remainder<N> {
    /// Of a layer of such reflectances, not yet seen from anywhere.
    #[inline(always)]
    pub(super) fn new(layer: [N; 3], roughness: N) -> Self {
        Self {
            layer,
            roughness,
            seen: [N::ONE; 2],
            shown: [N::ONE; 2],
        }
    }

    /// Seen from a direction with this left to it and that in the mean.
    #[inline(always)]
    pub(super) fn seen(self, left: [N; 2], mean: [N; 2]) -> Self {
        let over = |k: usize| left[k] / mean[k].max(N::from_f64(LEAST_MEAN));
        Self {
            seen: [over(0), over(1)],
            shown: left,
            ..self
        }
    }

    /// Seen at a cosine.
    #[inline(always)]
    pub(super) fn seen_at(self, cosine: N, mean: Albedo<N>) -> Self {
        self.seen(
            self.left(Albedo::towards(cosine, self.roughness)),
            self.left(mean),
        )
    }

    /// What is left of light: by the layer, and by white facets.
    #[inline(always)]
    pub(super) fn left(&self, albedo: Albedo<N>) -> [N; 2] {
        self.left_of(albedo.sent(self.layer[0], self.layer[1]), albedo.lost)
    }

    /// The same of a layer that sends back a share at once.
    #[inline(always)]
    pub(super) fn left_of(&self, sent: N, lost: N) -> [N; 2] {
        [(N::ONE - (sent + self.layer[2] * lost)).max(N::ZERO), lost]
    }

    /// Share that a layer sends back at once by Fresnel's equations, given what facets do and what
    /// they reflect at normal incidence: what a colour adds there falls as Schlick's way rises.
    pub(super) fn sent_exactly(&self, sent: N, normal: N, albedo: Albedo<N>) -> N {
        let falling = (N::ONE - albedo.lost - albedo.grazing).max(N::ZERO);
        (self.layer[1] * sent + (self.layer[0] - self.layer[1] * normal) * falling).max(N::ZERO)
    }

    /// Whether there is a layer.
    #[inline(always)]
    pub(super) fn is_covered(&self) -> bool {
        self.layer[0]
            .max(self.layer[1])
            .max(self.layer[2])
            .above(N::ZERO)
            .any()
    }

    /// Factors of 1/π for light from a direction: of what a white base sends back, and of what
    /// white facets send to each other.
    #[inline(always)]
    pub(super) fn towards(&self, cosine: N) -> [N; 2] {
        let left = self.left(Albedo::towards(cosine, self.roughness));
        [left[0] * self.seen[0], left[1] * self.seen[1]]
    }
}
