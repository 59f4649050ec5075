//! Glass boundaries with a tinted reflection or a thin film: of solid bodies, which refract, and of
//! thin walls, which do not.

use glam::DVec3;

use super::dielectric::{Dielectric, fresnel as facet_fresnel};
use super::film::ThinFilm;
use super::frame::ShadingFrame;
use super::fresnel::{self, FresnelRule, schlick_weight};
use super::ggx::Ggx;
use super::interface::Interface;
use super::interreflected::{Interreflected, mean_reflectance};
use super::lobe_kind::{Directions, LobeKind, kept_unit};
use crate::number::{Mask, Number, Vector3};

/// Changes to the Fresnel reflectance of a boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TintedFresnel<N: Number> {
    /// Factor of the reflectance; the rest is transmitted.
    pub reflected: N::Vec3,
    /// Thin film on the boundary.
    pub film: Option<ThinFilm<N>>,
    /// Reflectance formula.
    pub rule: FresnelRule,
    /// Index of the inside over the outside.
    pub ior: N::Exact,
}

impl<N: Number> TintedFresnel<N> {
    /// Reflectance of a lane by the cosines outside and inside; `None` under total reflection.
    fn reflectance(&self, lane: usize, cosines: Option<[f64; 2]>) -> [f64; 3] {
        let Some([outside, inside]) = cosines else {
            return [1.0; 3];
        };
        let ior = N::exact_lane(self.ior, lane);
        let f0 = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let share = match self.rule {
            // Schlick's formula needs the angle on the thin side.
            FresnelRule::Schlick => {
                f0 + (1.0 - f0) * schlick_weight(if ior < 1.0 { inside } else { outside })
            }
            _ => fresnel::dielectric(outside, Some(inside), 1.0 / ior),
        };
        let bare = self.reflected.lane(lane) * share;
        let Some(film) = self.film else {
            return bare.to_array();
        };
        let at_normal = (self.reflected.lane(lane) * f0).to_array();
        let filmed = super::film::reflectance(
            outside,
            N::exact_lane(film.ior, lane),
            film.thickness.lane(lane),
            at_normal,
        );
        let share = film.share.lane(lane);
        bare.lerp(filmed.into(), share).to_array()
    }
}

/// Cosines on the thin side at which a filmed boundary is compared with a bare boundary.
const COMPARED: [f64; 5] = [1.0, 0.8, 0.5, 0.25, 0.1];

impl<N: Number> TintedFresnel<N> {
    /// Least and greatest ratio of the reflectance to the Fresnel reflectance over the angles.
    pub(super) fn of_fresnel(&self) -> [N::Vec3; 2] {
        if self.film.is_none() && self.rule != FresnelRule::Schlick {
            return [self.reflected; 2];
        }
        let over = |lane: usize, own: f64| {
            let ior = N::exact_lane(self.ior, lane);
            let beyond = (1.0 - (1.0 - own * own) / ior.max(1.0 / ior).powi(2)).sqrt();
            let [outside, inside] = if ior < 1.0 {
                [beyond, own]
            } else {
                [own, beyond]
            };
            let exact = fresnel::dielectric(outside, Some(inside), 1.0 / ior).max(1e-6);
            DVec3::from(self.reflectance(lane, Some([outside, inside]))) / exact
        };
        let fold = |of: fn(DVec3, DVec3) -> DVec3| {
            let lane = |lane: usize| {
                COMPARED
                    .iter()
                    .fold(DVec3::ONE, |all, &cosine| of(all, over(lane, cosine)))
            };
            <N::Vec3 as Vector3<N>>::of_lanes(lane)
        };
        [fold(DVec3::min), fold(DVec3::max)]
    }
}

/// The boundary of a solid body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayeredDielectric<N: Number> {
    pub(super) tinted_fresnel: TintedFresnel<N>,
    /// The untinted boundary.
    pub(super) boundary: Dielectric<N>,
    /// Lanes with a ray from outside.
    pub(super) outside: N::Mask,
}

impl<N: Number> LayeredDielectric<N> {
    /// Reflectance of a lane's microfacet, and its Fresnel reflectance.
    fn at(&self, lane: usize, cosine: f64) -> (DVec3, f64) {
        let (exact, beyond) = facet_fresnel(cosine, N::exact_lane(self.boundary.eta, lane));
        let own = cosine.clamp(0.0, 1.0);
        let cosines = (beyond > 0.0).then_some(if self.outside.lane(lane) {
            [own, beyond]
        } else {
            [beyond, own]
        });
        (self.tinted_fresnel.reflectance(lane, cosines).into(), exact)
    }

    /// Scales a value of the untinted boundary by `of` its tinted and its Fresnel reflectance.
    fn tint(
        &self,
        (own, density): (N::Vec3, N),
        cosine: N,
        of: fn(f64, f64) -> f64,
    ) -> (N::Vec3, N) {
        let TintedFresnel {
            reflected,
            film,
            rule,
            ..
        } = self.tinted_fresnel;
        if film.is_none() && reflected == N::Vec3::ONE && rule != FresnelRule::Schlick {
            return (own, density);
        }
        let factor = <N::Vec3 as Vector3<N>>::of_lanes(|lane| {
            let (found, exact) = self.at(lane, cosine.lane(lane));
            found.map(|found| of(found, exact))
        });
        (own * factor, density)
    }
}

impl<N: Number> LobeKind<N> for LayeredDielectric<N> {
    fn importance(&self, _: N) -> N {
        self.boundary.share
            * self
                .tinted_fresnel
                .reflected
                .max(self.boundary.transmitted)
                .max_element()
    }

    fn is_delta(&self) -> bool {
        self.boundary.is_delta()
    }

    fn is_transmissive(&self) -> bool {
        self.boundary.is_transmissive()
    }

    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let factor = |found: f64, exact: f64| if exact > 0.0 { found / exact } else { 0.0 };
        self.tint(
            self.boundary.eval_and_pdf(directions),
            directions.tilt,
            factor,
        )
    }

    fn eval_and_pdf_through(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let factor = |found: f64, exact: f64| {
            if exact < 1.0 {
                (1.0 - found) / (1.0 - exact)
            } else {
                0.0
            }
        };
        self.tint(
            self.boundary.eval_and_pdf_through(directions),
            self.boundary.refracting_half(directions).1[0],
            factor,
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
        self.boundary.sample(frame, wo, local, choice, point)
    }

    /// A smooth boundary reflects or refracts by chance.
    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, u: N) -> (N::Vec3, N::Vec3) {
        let drawn = |lane: usize| {
            let interface = Interface::new(
                -wo.lane(lane),
                normal.lane(lane),
                N::exact_lane(self.boundary.eta, lane),
            );
            let (found, _) = self.at(lane, interface.cos_incident);
            // The strongest channel gives the probability, so that no weight exceeds one.
            let chance = found.max_element();
            match interface.refracted {
                Some(direction) if u.lane(lane) >= chance => (
                    direction,
                    self.boundary.transmitted.lane(lane) * (DVec3::ONE - found) / (1.0 - chance),
                ),
                _ => (
                    interface.reflected,
                    if chance > 0.0 {
                        found / chance
                    } else {
                        DVec3::ZERO
                    },
                ),
            }
        };
        (
            N::Vec3::of_lanes(|lane| drawn(lane).0),
            <N::Vec3 as Vector3<N>>::of_lanes(|lane| drawn(lane).1) * self.boundary.share,
        )
    }
}

/// A thin wall that does not refract: two parallel boundaries with all reflections between them.
/// The wall reflects 2R/(1 + R) of a boundary's R and transmits (1 − R)/(1 + R): straight on where
/// it is smooth, along the microfacets' mirror direction flipped below where it is rough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric<N: Number> {
    pub(super) tinted_fresnel: TintedFresnel<N>,
    /// Share of the surface that is a thin wall.
    pub(super) share: N,
    /// Factor of the transmission.
    pub(super) transmitted: N::Vec3,
    /// The microfacets; `None` for a smooth wall.
    pub(super) ggx: Option<Ggx<N>>,
}

impl<N: Number> ThinDielectric<N> {
    /// Reflectance of the wall in a lane at a cosine of incidence, in each channel.
    fn at(&self, lane: usize, cosine: f64) -> [f64; 3] {
        let (ior, c) = (
            N::exact_lane(self.tinted_fresnel.ior, lane),
            cosine.clamp(0.0, 1.0),
        );
        let inside = (1.0 - (1.0 - c * c) / (ior * ior)).max(0.0).sqrt();
        self.tinted_fresnel
            .reflectance(lane, Some([c, inside]))
            .map(|r| 2.0 * r / (1.0 + r))
    }

    fn reflectance(&self, cosine: N) -> N::Vec3 {
        <N::Vec3 as Vector3<N>>::of_lanes(|lane| self.at(lane, cosine.lane(lane)).into())
    }

    /// Multiple scattering among the wall's microfacets, for a viewing direction and the normal.
    pub(super) fn interreflected(
        &self,
        roughness: N,
        anisotropic: Option<(N::Mask, Ggx<N>)>,
        seen: [N::Vec3; 2],
    ) -> Interreflected<N> {
        let mean = mean_reflectance(|cosine| self.reflectance(cosine));
        Interreflected::of_wall(
            roughness,
            anisotropic,
            self.share,
            seen,
            [mean, self.transmitted],
        )
    }

    /// Straight transmission of a smooth wall, by the cosine of incidence.
    pub(super) fn straight(&self, cosine: N) -> N::Vec3 {
        if self.ggx.is_some() {
            return N::Vec3::ZERO;
        }
        self.transmitted * (N::Vec3::ONE - self.reflectance(cosine)) * self.share
    }
}

impl<N: Number> LobeKind<N> for ThinDielectric<N> {
    fn importance(&self, _: N) -> N {
        self.share
            * self
                .tinted_fresnel
                .reflected
                .max(self.transmitted)
                .max_element()
    }

    fn is_delta(&self) -> bool {
        self.ggx.is_none()
    }

    fn is_transmissive(&self) -> bool {
        self.ggx.is_some()
    }

    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let Some(ggx) = &self.ggx else {
            return (N::Vec3::ZERO, N::ZERO);
        };
        let found = self.reflectance(directions.tilt);
        let (value, density) = ggx.reflected(directions, found * self.share);
        (value, found.max_element() * density)
    }

    /// As [`Self::eval_and_pdf`] for the light mirrored above the surface.
    fn eval_and_pdf_through(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let Some(ggx) = &self.ggx else {
            return (N::Vec3::ZERO, N::ZERO);
        };
        let folded = directions.folded();
        let found = self.reflectance(folded.tilt);
        let (value, density) = ggx.reflected(
            &folded,
            self.transmitted * (N::Vec3::ONE - found) * self.share,
        );
        (value, (N::ONE - found.max_element()) * density)
    }

    fn sample(
        &self,
        frame: &ShadingFrame<N>,
        wo: N::Vec3,
        _: N::Vec3,
        choice: N,
        point: [N; 2],
    ) -> N::Vec3 {
        let Some(ggx) = &self.ggx else {
            return N::Vec3::ZERO;
        };
        let (facet, up) = ggx.sample_mirrored(frame.normal, wo, point);
        let down = up - frame.normal * (N::from_f64(2.0) * frame.normal.dot(up));
        let chance = self.reflectance(facet.dot(wo)).max_element();
        N::Vec3::select(chance.greater_than(choice), up, down)
    }

    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, u: N) -> (N::Vec3, N::Vec3) {
        let cosine = normal.dot(wo);
        let found = self.reflectance(cosine);
        let chance = found.max_element();
        let mirror = kept_unit::<N>(normal * (N::from_f64(2.0) * cosine) - wo);
        let on = self.transmitted * (N::Vec3::ONE - found) / (N::ONE - chance);
        let reflects = chance.greater_than(u);
        let weight = N::Vec3::select(reflects, found / chance, on);
        (N::Vec3::select(reflects, mirror, -wo), weight * self.share)
    }
}
