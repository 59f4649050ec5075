//! The lobes of layered surfaces: those that the metallic-roughness model alone has no use for, and its own where something lies over
//! them. They are rarer and dearer than [`Lobe`](super::Lobe)s, and compiled apart from them.
//!
//! What lies below a coat or a fleece gets the light that those leave: min(1 − E(out), 1 − E(in)) of what would come, by the share E that the
//! cover sends back to a direction. That is the same both ways, exact for mirrors, and with the cover's own lobe never more than all.

use core::f64::consts::PI;

use super::base::Base;
use super::energy::sent_back;
use super::frame::Frame;
use super::fresnel::towards_grazing;
use super::ggx::{Ggx, LEAST_ROUGHNESS, mirrored};
use super::glass_layer::{Boundary, Sheet};
use super::lobe::{Lobe, Pair, Scatters, on_disk};
use super::reflectance::Reflectance;
use super::sheen::Sheen;
use crate::number::{Mask, Number, Vector3};

/// Reflectance of a coat at normal incidence: its index is 1.5.
pub(super) const COAT: f64 = 0.04;

/// A clear coat over a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat<N: Number> {
    /// Share of the surface that it covers.
    pub weight: N,
    /// Perceptual roughness.
    pub roughness: N,
    /// Its normal, which a map may bend as it does not bend what is below.
    pub normal: N::Vec3,
}

impl<N: Number> Coat<N> {
    /// Share that it sends back to a direction.
    fn sent(&self, towards: N::Vec3) -> N {
        let cosine = self.normal.dot(towards).max(N::ZERO);
        let share = N::of_lanes(|lane| {
            let (cosine, roughness) = (cosine.lane(lane), self.roughness.lane(lane));
            if roughness > LEAST_ROUGHNESS {
                sent_back(COAT, roughness, cosine)
            } else {
                COAT + (1.0 - COAT) * towards_grazing(cosine)
            }
        });
        self.weight * share
    }
}

/// What lies over a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cover<N: Number> {
    pub(super) coat: Option<Coat<N>>,
    pub(super) sheen: Option<Sheen<N>>,
}

impl<N: Number> Cover<N> {
    /// Nothing.
    pub(super) const NONE: Self = Self { coat: None, sheen: None };

    /// Share of light that gets past it on its way in or out, in a direction above the surface.
    pub(super) fn once(&self, normal: N::Vec3, towards: N::Vec3) -> N {
        let coat = self.coat.map_or(N::ONE, |coat| N::ONE - coat.sent(towards));
        self.sheen.map_or(coat, |sheen| coat * (N::ONE - sheen.sent(normal.dot(towards).max(N::ZERO))))
    }

    /// Share of what a lobe sends from one direction to the other. What goes through the surface passes once.
    fn passes(&self, pair: &Pair<N>) -> N {
        if self.coat.is_none() && self.sheen.is_none() {
            return N::ONE;
        }
        let out = self.once(pair.normal, pair.wo);
        N::select(pair.into.above(N::ZERO), out.min(self.once(pair.normal, pair.wi)), out)
    }
}

/// One way in which a layered surface sends light back or on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way<N: Number> {
    /// What lies below what reflects.
    Base(Base<N>),
    /// Fibres.
    Sheen(Sheen<N>),
    /// Rough facets.
    Facets { facets: Ggx<N>, reflectance: Reflectance<N> },
    /// A smooth mirror about a normal.
    Mirror { normal: N::Vec3, reflectance: Reflectance<N> },
    /// A boundary of a body that light enters.
    Boundary(Boundary<N>),
    /// A wall too thin to bend anything.
    Sheet(Sheet<N>),
}

/// A lobe with what lies over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer<N: Number> {
    pub(super) way: Way<N>,
    pub(super) cover: Cover<N>,
    /// What the choice among lobes goes by, for the direction that the surface is seen from.
    pub(super) importance: N,
}

impl<N: Number> Layer<N> {
    /// The lobe of a way under a cover, seen along `wo` about a normal.
    pub(super) fn new(way: Way<N>, cover: Cover<N>, normal: N::Vec3, wo: N::Vec3) -> Self {
        let cosine = normal.dot(wo).max(N::ZERO);
        let own = match way {
            Way::Base(base) => base.importance(),
            Way::Sheen(sheen) => sheen.sent(cosine),
            Way::Facets { facets, reflectance } => reflectance.at(facets.normal().dot(wo)).max_element(),
            Way::Mirror { normal, reflectance } => reflectance.at(normal.dot(wo)).max_element(),
            Way::Boundary(boundary) => boundary.importance(),
            Way::Sheet(sheet) => sheet.importance(),
        };
        Self { way, cover, importance: own * cover.once(normal, wo) }
    }

    /// A part of what it sends, under its cover; none where it sends nothing, also where directions have no half.
    fn covered(&self, pair: &Pair<N>, own: N::Vec3) -> N::Vec3 {
        N::Vec3::select(self.importance.above(N::ZERO), own * self.cover.passes(pair), N::Vec3::ZERO)
    }
}

impl<N: Number> Scatters<N> for Layer<N> {
    const NOTHING: Self = Self {
        way: Way::Sheen(Sheen { colour: <N::Vec3 as Vector3<N>>::ZERO, roughness: N::ONE }),
        cover: Cover::NONE,
        importance: N::ZERO,
    };
    const COATED: bool = true;

    fn is_delta(&self) -> bool {
        match &self.way {
            Way::Mirror { .. } => true,
            Way::Boundary(boundary) => boundary.is_smooth(),
            Way::Sheet(sheet) => sheet.is_smooth(),
            _ => false,
        }
    }

    fn lets_through(&self) -> bool {
        match &self.way {
            Way::Base(base) => base.both,
            Way::Boundary(boundary) => !boundary.is_smooth(),
            Way::Sheet(sheet) => !sheet.is_smooth(),
            _ => false,
        }
    }

    fn value(&self, pair: &Pair<N>) -> N::Vec3 {
        if !self.importance.above(N::ZERO).any() {
            return N::Vec3::ZERO;
        }
        let own = match &self.way {
            Way::Base(base) => base.value(pair),
            Way::Sheen(sheen) => sheen.value_of(pair),
            Way::Facets { facets, reflectance } => {
                // A coat may have a normal of its own, whose cosine is not the surface's.
                let own = pair.about(facets.normal());
                let sent = own.reflected(reflectance.at(pair.tilt), facets).0 * (own.into / pair.into);
                N::Vec3::select(own.into.above(N::ZERO), sent, N::Vec3::ZERO)
            }
            Way::Boundary(boundary) => boundary.value(pair),
            Way::Sheet(sheet) => sheet.value(pair),
            Way::Mirror { .. } => return N::Vec3::ZERO,
        };
        self.covered(pair, own)
    }

    fn diffused(&self, pair: &Pair<N>) -> N::Vec3 {
        match &self.way {
            Way::Base(base) => self.covered(pair, base.diffused(pair)),
            Way::Sheen(sheen) => self.covered(pair, sheen.value_of(pair)),
            _ => N::Vec3::ZERO,
        }
    }

    fn value_through(&self, pair: &Pair<N>) -> N::Vec3 {
        let own = match &self.way {
            Way::Base(base) => base.value_through(pair),
            Way::Boundary(boundary) => boundary.value_through(pair),
            Way::Sheet(sheet) => sheet.value_through(&pair.folded()),
            _ => return N::Vec3::ZERO,
        };
        self.covered(pair, own)
    }

    fn density(&self, pair: &Pair<N>) -> N {
        match &self.way {
            Way::Base(base) => base.back_share() * pair.into / N::from_f64(PI),
            Way::Sheen(_) => N::from_f64(0.5 / PI),
            Way::Facets { facets, .. } => {
                let own = pair.about(facets.normal());
                N::select(own.out.above(N::ZERO) & own.into.above(N::ZERO), facets.eval_and_pdf(&own).1, N::ZERO)
            }
            Way::Boundary(boundary) => boundary.density(pair),
            Way::Sheet(sheet) => sheet.density(pair),
            Way::Mirror { .. } => N::ZERO,
        }
    }

    fn density_through(&self, pair: &Pair<N>) -> N {
        match &self.way {
            Way::Base(base) => (N::ONE - base.back_share()) * -pair.into / N::from_f64(PI),
            Way::Boundary(boundary) => boundary.density_through(pair),
            Way::Sheet(sheet) => sheet.density_through(&pair.folded()),
            _ => N::ZERO,
        }
    }

    fn drawn_world(&self, frame: &Frame<N>, wo: N::Vec3, local: N::Vec3, choice: N, point: [N; 2]) -> N::Vec3 {
        match &self.way {
            Way::Base(base) => {
                let up = Lobe::<N>::cosine(point);
                let down = N::Vec3::new(up.x(), up.y(), -up.z());
                frame.to_world(N::Vec3::select(base.back_share().above(choice), up, down))
            }
            Way::Sheen(_) => {
                // Evenly over the hemisphere: equal heights have equal areas (Archimedes).
                let [x, y] = on_disk([N::ONE, point[1]]);
                let height = N::ONE - point[0];
                let across = (N::ONE - height * height).max(N::ZERO).sqrt();
                frame.to_world(N::Vec3::new(x * across, y * across, height))
            }
            Way::Facets { facets, .. } => {
                // What a facet sends below the surface is lost: no other lobe may take it for light that goes through.
                let direction = mirrored::<N>(wo, facets.sample_wm(wo, point));
                N::Vec3::select(frame.normal.dot(direction).above(N::ZERO), direction, N::Vec3::ZERO)
            }
            Way::Boundary(boundary) => frame.to_world(boundary.drawn(local, choice, point)),
            Way::Sheet(sheet) => sheet.drawn(frame, wo, choice, point),
            Way::Mirror { normal, .. } => mirrored::<N>(wo, *normal),
        }
    }

    fn drawn_delta(&self, normal: N::Vec3, wo: N::Vec3, u: N) -> (N::Vec3, N::Vec3) {
        let (direction, weight) = match &self.way {
            Way::Boundary(boundary) => boundary.drawn_smooth(normal, wo, u),
            Way::Sheet(sheet) => sheet.drawn_smooth(normal, wo, u),
            Way::Mirror { normal: own, reflectance } => {
                let direction = mirrored::<N>(wo, *own);
                // A coat's normal may send it into the surface, where it is lost.
                let above = normal.dot(direction).above(N::ZERO);
                (direction, N::Vec3::select(above, reflectance.at(own.dot(wo)), N::Vec3::ZERO))
            }
            _ => return (normal, N::Vec3::ZERO),
        };
        (direction, weight * self.cover.passes(&Pair::new(normal, wo, direction)))
    }

    fn importance(&self, _: N) -> N {
        self.importance
    }
}

impl<N: Number> Layer<N> {
    /// What it sends straight on of light that comes along the way back: of smooth walls alone something.
    pub(super) fn straight(&self, normal: N::Vec3, wo: N::Vec3) -> N::Vec3 {
        let Way::Sheet(sheet) = &self.way else { return N::Vec3::ZERO };
        sheet.straight(normal.dot(wo)) * self.cover.passes(&Pair::new(normal, wo, -wo))
    }
}
