//! The lobes of layered surfaces: lobes of glTF's extensions, and metallic-roughness lobes under a
//! coat or sheen. These lobes are rarer and costlier than [`Lobe`](super::Lobe)s; a separate type
//! keeps their code out of common materials.
//!
//! Lobes under a coat or sheen are scaled by min(1 − E(wo), 1 − E(wi)), where E is the directional
//! albedo of the coat or sheen. This factor is reciprocal, and exact for mirrors. The scaled lobes
//! and the coat or sheen together gain no energy.

use super::diffuse_base::DiffuseBase;
use super::energy::directional_albedo;
use super::fresnel::FresnelRule;
use super::ggx::{Ggx, reflect};
use super::glass_layer::{ThinDielectric, TintedDielectric};
use super::layer_fields::layer;
use super::lobe_traits::{BsdfLobe, Directions, ScatteringLobe};
use super::microfacet_reflectance::MicrofacetReflectance;
use super::multiple_scattering::MultipleScattering;
use super::rough_boundary_tables::fresnel_albedo;
use super::shading_frame::ShadingFrame;
use super::sheen::Sheen;
use crate::number::{Number, Vector3};

/// Index of refraction of a coat.
const COAT_IOR: f64 = 1.5;
/// Reflectance of a coat at normal incidence.
const COAT_F0: f64 = 0.04;

layer! {
    /// A clear coat over all other layers of a surface.
    Coat
    /// Share of the surface under the coat, 0 to 1.
    weight: Share by eval_unit_number;
    /// Perceptual roughness.
    roughness: Share by eval_unit_number;
    /// Unit normal of the coat, which may have its own normal map.
    normal: Normal by eval_normal;
}

impl<N: Number> Coat<N> {
    /// Returns the reflectance of the coat's microfacets, weighted by its share of the surface.
    pub(super) fn reflectance(&self, rule: FresnelRule) -> MicrofacetReflectance<N> {
        MicrofacetReflectance {
            shares: [self.weight, N::ZERO],
            dielectric: [N::Vec3::splat(N::from_f64(COAT_F0)), N::Vec3::ONE],
            exact: (rule == FresnelRule::Exact).then(|| N::f64_from_lanes(|_| COAT_IOR)),
            metal: N::Vec3::ZERO,
            conductor: None,
            film: None,
        }
    }

    /// Returns the share of the light emitted below the coat that crosses the coat along a
    /// direction, on either side of the surface. As in KHR_materials_clearcoat, the coat's
    /// roughness has no effect.
    pub(crate) fn emission_transmittance(&self, direction: N::Vec3, rule: FresnelRule) -> N {
        let cosine = self.normal.dot(direction);
        N::ONE - self.reflectance(rule).eval(cosine.max(-cosine)).x()
    }

    /// Returns the directional albedo of the coat for a direction, 0 to 1, weighted by its share of
    /// the surface.
    fn directional_albedo(&self, direction: N::Vec3, rule: FresnelRule) -> N {
        let cosine = self.normal.dot(direction).max(N::ZERO);
        self.weight
            * N::from_lanes(|lane| {
                let (roughness, cosine) = (self.roughness.lane(lane), cosine.lane(lane));
                if rule == FresnelRule::Exact {
                    fresnel_albedo(COAT_IOR, roughness, Some(cosine))
                } else {
                    directional_albedo(COAT_F0, roughness, cosine)
                }
            })
    }
}

/// The coat and the sheen over a lobe; `None` means that this layer is absent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coating<N: Number> {
    pub(super) coat: Option<Coat<N>>,
    pub(super) sheen: Option<Sheen<N>>,
    /// Formula of the coat's reflectance.
    pub(super) rule: FresnelRule,
}

impl<N: Number> Coating<N> {
    /// Neither coat nor sheen.
    pub(super) const NONE: Self = Self {
        coat: None,
        sheen: None,
        rule: FresnelRule::Conserving,
    };

    /// Whether there is neither coat nor sheen.
    fn is_absent(&self) -> bool {
        self.coat.is_none() && self.sheen.is_none()
    }

    /// Returns the share of light that crosses coat and sheen once, inwards or outwards, along a
    /// direction above the surface.
    pub(super) fn one_way_transmittance(&self, normal: N::Vec3, direction: N::Vec3) -> N {
        let coat = self.coat.map_or(N::ONE, |coat| {
            N::ONE - coat.directional_albedo(direction, self.rule)
        });
        self.sheen.map_or(coat, |sheen| {
            coat * (N::ONE - sheen.directional_albedo(normal.dot(direction).max(N::ZERO)))
        })
    }

    /// Returns the factor by which coat and sheen reduce the lobe below. Reflected light crosses
    /// both layers twice, transmitted light once.
    fn two_way_transmittance(&self, directions: &Directions<N>) -> N {
        let out = self.one_way_transmittance(directions.normal, directions.wo);
        N::select(
            directions.cos_wi.greater_than(N::ZERO),
            out.min(self.one_way_transmittance(directions.normal, directions.wi)),
            out,
        )
    }
}

/// Lobe of rough microfacets or of a smooth mirror, with a normal of its own: a coat's normal may
/// differ from the surface's normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GgxLobe<N: Number> {
    pub(super) ggx: Ggx<N>,
    /// Whether the lobe is a smooth mirror, and so a delta lobe.
    pub(super) smooth: bool,
    pub(super) reflectance: MicrofacetReflectance<N>,
}

impl<N: Number> ScatteringLobe<N> for GgxLobe<N> {
    fn importance(&self, cosine: N) -> N {
        self.reflectance.eval(cosine).max_element()
    }

    fn is_delta(&self) -> bool {
        self.smooth
    }

    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        if self.smooth {
            return (N::Vec3::ZERO, N::ZERO);
        }
        // The BSDF multiplies by the cosine to the surface's normal, so the value is corrected for
        // the lobe's normal.
        let own_directions = directions.with_normal(self.ggx.normal);
        let (scattered, density) = self
            .ggx
            .eval_reflection_and_pdf(&own_directions, self.reflectance.eval(directions.cos_half));
        let (out, into) = (
            own_directions.cos_wo.greater_than(N::ZERO),
            own_directions.cos_wi.greater_than(N::ZERO),
        );
        (
            N::Vec3::select(
                into,
                scattered * (own_directions.cos_wi / directions.cos_wi),
                N::Vec3::ZERO,
            ),
            N::select(out & into, density, N::ZERO),
        )
    }

    fn sample(
        &self,
        frame: &ShadingFrame<N>,
        wo: N::Vec3,
        _: N::Vec3,
        _: N,
        point: [N; 2],
    ) -> N::Vec3 {
        self.ggx.sample_reflection(frame.normal, wo, point).1
    }

    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, _: N) -> (N::Vec3, N::Vec3) {
        let own = self.ggx.normal;
        let direction = reflect::<N>(wo, own);
        // A coat's normal may mirror the direction into the surface. This light counts as lost.
        let above = normal.dot(direction).greater_than(N::ZERO);
        (
            direction,
            N::Vec3::select(above, self.reflectance.eval(own.dot(wo)), N::Vec3::ZERO),
        )
    }
}

/// A lobe of a layered surface, without the layers over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LayerLobe<N: Number> {
    /// The diffuse lobe below the microfacets.
    Diffuse(DiffuseBase<N>),
    /// The fibres of sheen.
    Sheen(Sheen<N>),
    /// Rough microfacets, or a smooth mirror.
    Ggx(GgxLobe<N>),
    /// The boundary of a solid body.
    Dielectric(TintedDielectric<N>),
    /// A thin wall, without refraction.
    ThinDielectric(ThinDielectric<N>),
    /// Multiple scattering among the microfacets of a boundary or a thin wall.
    MultipleScattering(MultipleScattering<N>),
}

/// Evaluates an expression for the variant of a [`LayerLobe`].
macro_rules! ask {
    ($lobe:expr, $of:ident => $question:expr) => {
        match &$lobe {
            LayerLobe::Diffuse($of) => $question,
            LayerLobe::Sheen($of) => $question,
            LayerLobe::Ggx($of) => $question,
            LayerLobe::Dielectric($of) => $question,
            LayerLobe::ThinDielectric($of) => $question,
            LayerLobe::MultipleScattering($of) => $question,
        }
    };
}

/// Lobe of a layered surface, scaled by the transmittance of the coat and the sheen over it. Either
/// of these may be absent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoatedLobe<N: Number> {
    lobe: LayerLobe<N>,
    coating: Coating<N>,
    /// Sampling weight of the lobe for the viewing direction.
    importance: N,
}

impl<N: Number> CoatedLobe<N> {
    /// Creates a lobe under a coating for the viewing direction `wo`. `normal` is the surface's
    /// normal.
    pub(super) fn new(
        lobe: LayerLobe<N>,
        coating: Coating<N>,
        normal: N::Vec3,
        wo: N::Vec3,
    ) -> Self {
        let cosine = match lobe {
            LayerLobe::Ggx(ggx) => ggx.ggx.normal.dot(wo),
            _ => normal.dot(wo).max(N::ZERO),
        };
        let own = ask!(lobe, lobe => lobe.importance(cosine));
        Self {
            lobe,
            coating,
            importance: own * coating.one_way_transmittance(normal, wo),
        }
    }

    /// Scales a lobe's value by the transmittance of its coating. Returns the scaled value and the
    /// unchanged density. A zero value stays zero even if `wo` and `wi` are opposite and have no
    /// half vector.
    fn apply_coating(
        &self,
        directions: &Directions<N>,
        (own, density): (N::Vec3, N),
    ) -> (N::Vec3, N) {
        let (some, none) = (self.importance.greater_than(N::ZERO), N::Vec3::ZERO);
        let scattered = if own == none {
            own
        } else if self.coating.is_absent() {
            N::Vec3::select(some, own, none)
        } else {
            N::Vec3::select(
                some,
                own * self.coating.two_way_transmittance(directions),
                none,
            )
        };
        (scattered, density)
    }

    /// Returns the transmittance for undeflected light, from −`wo` to `wo`. Zero except for smooth
    /// thin walls.
    pub(super) fn straight_transmittance(&self, normal: N::Vec3, wo: N::Vec3) -> N::Vec3 {
        let LayerLobe::ThinDielectric(wall) = &self.lobe else {
            return N::Vec3::ZERO;
        };
        let own = wall.straight_transmittance(normal.dot(wo));
        if self.coating.is_absent() {
            return own;
        }
        own * self
            .coating
            .two_way_transmittance(&Directions::new(normal, wo, -wo))
    }
}

impl<N: Number> BsdfLobe<N> for CoatedLobe<N> {
    const NOTHING: Self = Self {
        lobe: LayerLobe::Sheen(Sheen {
            colour: <N::Vec3 as Vector3<N>>::ZERO,
            roughness: N::ONE,
        }),
        coating: Coating::NONE,
        importance: N::ZERO,
    };
    const COATED: bool = true;
}

impl<N: Number> ScatteringLobe<N> for CoatedLobe<N> {
    fn importance(&self, _: N) -> N {
        self.importance
    }

    fn is_delta(&self) -> bool {
        ask!(self.lobe, lobe => lobe.is_delta())
    }

    fn is_transmissive(&self) -> bool {
        ask!(self.lobe, lobe => lobe.is_transmissive())
    }

    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        self.apply_coating(
            directions,
            ask!(self.lobe, lobe => lobe.eval_and_pdf(directions)),
        )
    }

    fn eval_diffuse(&self, directions: &Directions<N>) -> N::Vec3 {
        self.apply_coating(
            directions,
            (
                ask!(self.lobe, lobe => lobe.eval_diffuse(directions)),
                N::ZERO,
            ),
        )
        .0
    }

    fn eval_transmission_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        self.apply_coating(
            directions,
            ask!(self.lobe, lobe => lobe.eval_transmission_and_pdf(directions)),
        )
    }

    fn sample(
        &self,
        frame: &ShadingFrame<N>,
        wo: N::Vec3,
        local: N::Vec3,
        choice: N,
        point: [N; 2],
    ) -> N::Vec3 {
        ask!(self.lobe, lobe => lobe.sample(frame, wo, local, choice, point))
    }

    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, u: N) -> (N::Vec3, N::Vec3) {
        let (direction, weight) = ask!(self.lobe, lobe => lobe.sample_delta(normal, wo, u));
        if self.coating.is_absent() {
            return (direction, weight);
        }
        (
            direction,
            weight
                * self
                    .coating
                    .two_way_transmittance(&Directions::new(normal, wo, direction)),
        )
    }
}
