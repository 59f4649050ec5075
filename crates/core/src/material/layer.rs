//! The lobes of layered surfaces: those that the metallic-roughness model alone has no use for, and
//! its own where something lies over them. They are rarer and dearer than [`Lobe`](super::Lobe)s,
//! and compiled apart from them.
//!
//! What lies below a coat or a fleece gets the light that those leave: min(1 − E(out), 1 − E(in))
//! of what would come, by the share E that the cover sends back to a direction. That is the same
//! both ways, exact for mirrors, and with the cover's own lobe never more than all.

use super::base::DiffuseBase;
use super::energy::directional_albedo;
use super::frame::Frame;
use super::ggx::{Ggx, mirrored};
use super::glass_layer::{LayeredDielectric, ThinDielectric};
use super::interreflected::Interreflected;
use super::lobe_kind::{LobeFamily, LobeKind, Pair};
use super::reflectance::Reflectance;
use super::sheen::Sheen;
use super::stage::layer;
use crate::number::{Number, Vector3};

/// Reflectance of a coat at normal incidence: its index is 1.5.
pub(super) const COAT: f64 = 0.04;

layer! {
    /// A clear coat over a surface.
    Coat
    /// Share of the surface that it covers.
    weight: Share by share;
    /// Perceptual roughness.
    roughness: Share by share;
    /// Its normal, which a map may bend as it does not bend what is below.
    normal: Normal by normal;
}

impl<N: Number> Coat<N> {
    /// Share that it sends back to a direction.
    fn sent(&self, towards: N::Vec3) -> N {
        let cosine = self.normal.dot(towards).max(N::ZERO);
        self.weight
            * N::of_lanes(|lane| {
                directional_albedo(COAT, self.roughness.lane(lane), cosine.lane(lane))
            })
    }
}

/// What lies over a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coating<N: Number> {
    pub(super) coat: Option<Coat<N>>,
    pub(super) sheen: Option<Sheen<N>>,
}

impl<N: Number> Coating<N> {
    /// Nothing.
    pub(super) const NONE: Self = Self {
        coat: None,
        sheen: None,
    };

    /// Share of light that gets past it on its way in or out, in a direction above the surface.
    pub(super) fn once(&self, normal: N::Vec3, towards: N::Vec3) -> N {
        let coat = self.coat.map_or(N::ONE, |coat| N::ONE - coat.sent(towards));
        self.sheen.map_or(coat, |sheen| {
            coat * (N::ONE - sheen.sent(normal.dot(towards).max(N::ZERO)))
        })
    }

    /// Share of what a lobe sends from one direction to the other. What goes through the surface
    /// passes once.
    fn passes(&self, pair: &Pair<N>) -> N {
        let out = self.once(pair.normal, pair.wo);
        N::select(
            pair.into.above(N::ZERO),
            out.min(self.once(pair.normal, pair.wi)),
            out,
        )
    }
}

/// Facets about a normal, which a coat may have of its own: rough, or as smooth as a mirror.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GgxLobe<N: Number> {
    pub(super) facets: Ggx<N>,
    pub(super) smooth: bool,
    pub(super) reflectance: Reflectance<N>,
}

impl<N: Number> LobeKind<N> for GgxLobe<N> {
    fn importance(&self, cosine: N) -> N {
        self.reflectance.at(cosine).max_element()
    }

    fn is_delta(&self) -> bool {
        self.smooth
    }

    fn eval_and_pdf(&self, pair: &Pair<N>) -> (N::Vec3, N) {
        if self.smooth {
            return (N::Vec3::ZERO, N::ZERO);
        }
        // Its cosine is not the surface's.
        let own = pair.about(self.facets.normal);
        let (sent, density) = self.facets.reflected(&own, self.reflectance.at(pair.tilt));
        let (out, into) = (own.out.above(N::ZERO), own.into.above(N::ZERO));
        (
            N::Vec3::select(into, sent * (own.into / pair.into), N::Vec3::ZERO),
            N::select(out & into, density, N::ZERO),
        )
    }

    fn sample(&self, frame: &Frame<N>, wo: N::Vec3, _: N::Vec3, _: N, point: [N; 2]) -> N::Vec3 {
        self.facets.sample_mirrored(frame.normal, wo, point).1
    }

    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, _: N) -> (N::Vec3, N::Vec3) {
        let own = self.facets.normal;
        let direction = mirrored::<N>(wo, own);
        // A coat's normal may send it into the surface, where it is lost.
        let above = normal.dot(direction).above(N::ZERO);
        (
            direction,
            N::Vec3::select(above, self.reflectance.at(own.dot(wo)), N::Vec3::ZERO),
        )
    }
}

/// The lobes of layered surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LayerLobe<N: Number> {
    /// What lies below what reflects.
    Diffuse(DiffuseBase<N>),
    /// Fibres.
    Sheen(Sheen<N>),
    /// Rough facets, or a smooth mirror.
    Ggx(GgxLobe<N>),
    /// A boundary of a body that light enters.
    Dielectric(LayeredDielectric<N>),
    /// A wall too thin to bend anything.
    ThinDielectric(ThinDielectric<N>),
    /// What the facets of either send to each other.
    Interreflected(Interreflected<N>),
}

/// Asks a lobe of whatever kind.
macro_rules! ask {
    ($lobe:expr, $of:ident => $question:expr) => {
        match &$lobe {
            LayerLobe::Diffuse($of) => $question,
            LayerLobe::Sheen($of) => $question,
            LayerLobe::Ggx($of) => $question,
            LayerLobe::Dielectric($of) => $question,
            LayerLobe::ThinDielectric($of) => $question,
            LayerLobe::Interreflected($of) => $question,
        }
    };
}

/// A lobe with what lies over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoatedLobe<N: Number> {
    lobe: LayerLobe<N>,
    coating: Coating<N>,
    /// What the choice among lobes goes by, for the direction that the surface is seen from.
    importance: N,
}

impl<N: Number> CoatedLobe<N> {
    /// A lobe under a coating, seen along `wo` about a normal.
    pub(super) fn new(
        lobe: LayerLobe<N>,
        coating: Coating<N>,
        normal: N::Vec3,
        wo: N::Vec3,
    ) -> Self {
        let cosine = match lobe {
            LayerLobe::Ggx(ggx) => ggx.facets.normal.dot(wo),
            _ => normal.dot(wo).max(N::ZERO),
        };
        let own = ask!(lobe, lobe => lobe.importance(cosine));
        Self {
            lobe,
            coating,
            importance: own * coating.once(normal, wo),
        }
    }

    /// What the lobe would send bare, under its coating; none where it sends nothing, also where
    /// directions have no half.
    fn coated(&self, pair: &Pair<N>, (own, density): (N::Vec3, N)) -> (N::Vec3, N) {
        let (some, none) = (self.importance.above(N::ZERO), N::Vec3::ZERO);
        let sent = if own == none {
            own
        } else {
            N::Vec3::select(some, own * self.coating.passes(pair), none)
        };
        (sent, density)
    }

    /// What it sends straight on of light that comes along the way back: of smooth walls alone
    /// something.
    pub(super) fn straight(&self, normal: N::Vec3, wo: N::Vec3) -> N::Vec3 {
        let LayerLobe::ThinDielectric(wall) = &self.lobe else {
            return N::Vec3::ZERO;
        };
        wall.straight(normal.dot(wo)) * self.coating.passes(&Pair::new(normal, wo, -wo))
    }
}

impl<N: Number> LobeFamily<N> for CoatedLobe<N> {
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

impl<N: Number> LobeKind<N> for CoatedLobe<N> {
    fn importance(&self, _: N) -> N {
        self.importance
    }

    fn is_delta(&self) -> bool {
        ask!(self.lobe, lobe => lobe.is_delta())
    }

    fn lets_through(&self) -> bool {
        ask!(self.lobe, lobe => lobe.lets_through())
    }

    fn eval_and_pdf(&self, pair: &Pair<N>) -> (N::Vec3, N) {
        self.coated(pair, ask!(self.lobe, lobe => lobe.eval_and_pdf(pair)))
    }

    fn eval_diffuse(&self, pair: &Pair<N>) -> N::Vec3 {
        self.coated(
            pair,
            (ask!(self.lobe, lobe => lobe.eval_diffuse(pair)), N::ZERO),
        )
        .0
    }

    fn eval_and_pdf_through(&self, pair: &Pair<N>) -> (N::Vec3, N) {
        self.coated(
            pair,
            ask!(self.lobe, lobe => lobe.eval_and_pdf_through(pair)),
        )
    }

    fn sample(
        &self,
        frame: &Frame<N>,
        wo: N::Vec3,
        local: N::Vec3,
        choice: N,
        point: [N; 2],
    ) -> N::Vec3 {
        ask!(self.lobe, lobe => lobe.sample(frame, wo, local, choice, point))
    }

    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, u: N) -> (N::Vec3, N::Vec3) {
        let (direction, weight) = ask!(self.lobe, lobe => lobe.sample_delta(normal, wo, u));
        (
            direction,
            weight * self.coating.passes(&Pair::new(normal, wo, direction)),
        )
    }
}
