//! Glass boundaries with a tinted reflection or a thin film. The boundaries of solid bodies
//! refract; thin walls do not.

use glam::DVec3;

use super::dielectric::{Dielectric, fresnel as facet_fresnel};
use super::fresnel::{self, FresnelRule, SmoothInterface, schlick_weight};
use super::ggx::Ggx;
use super::lobe_traits::{Directions, ScatteringLobe, normalize_if_drifted};
use super::multiple_scattering::{MultipleScattering, mean_reflectance};
use super::shading_frame::ShadingFrame;
use super::thin_film::ThinFilm;
use crate::number::{Mask, Number, Vector3};

/// Reflectance of a glass boundary by Fresnel's equations or Schlick's formula, with a tint and an
/// optional thin film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TintedFresnel<N: Number> {
    /// Factor on the reflectance by channel. Light that is not reflected is transmitted.
    pub reflected: N::Vec3,
    /// Thin film on the boundary; `None` for a boundary without a film.
    pub film: Option<ThinFilm<N>>,
    /// Formula of the reflectance.
    pub rule: FresnelRule,
    /// Index of refraction inside over the index outside.
    pub ior: N::Exact,
}

impl<N: Number> TintedFresnel<N> {
    /// Returns the reflectance of a SIMD lane by channel. `cosines` are the cosines to the normal
    /// outside and inside; `None` means total reflection.
    fn reflectance(&self, lane: usize, cosines: Option<[f64; 2]>) -> [f64; 3] {
        let Some([outside, inside]) = cosines else {
            return [1.0; 3];
        };
        let ior = N::f64_lane(self.ior, lane);
        let f0 = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let share = match self.rule {
            // Schlick's formula needs the angle on the side of lower index.
            FresnelRule::Schlick => {
                f0 + (1.0 - f0) * schlick_weight(if ior < 1.0 { inside } else { outside })
            }
            _ => fresnel::fresnel_dielectric(outside, Some(inside), 1.0 / ior),
        };
        let bare = self.reflected.lane(lane) * share;
        let Some(film) = self.film else {
            return bare.to_array();
        };
        let at_normal = (self.reflected.lane(lane) * f0).to_array();
        let filmed = super::thin_film::thin_film_reflectance(
            outside,
            N::f64_lane(film.ior, lane),
            film.thickness.lane(lane),
            at_normal,
        );
        let share = film.share.lane(lane);
        bare.lerp(filmed.into(), share).to_array()
    }
}

/// Cosines at which [`TintedFresnel::tint_bounds`] compares reflectances, on the side of lower
/// index.
const COMPARED_COSINES: [f64; 5] = [1.0, 0.8, 0.5, 0.25, 0.1];

impl<N: Number> TintedFresnel<N> {
    /// Returns the least and the greatest tint, by channel, that makes Fresnel's reflectance this
    /// reflectance, from 0 to 2 as in [`MultipleScattering`]. The angles are those of
    /// [`COMPARED_COSINES`].
    pub(super) fn tint_bounds(&self) -> [N::Vec3; 2] {
        if self.film.is_none() && self.rule != FresnelRule::Schlick {
            return [self.reflected; 2];
        }
        let tint = |lane: usize, own: f64| {
            let ior = N::f64_lane(self.ior, lane);
            let beyond = (1.0 - (1.0 - own * own) / ior.max(1.0 / ior).powi(2)).sqrt();
            let [outside, inside] = if ior < 1.0 {
                [beyond, own]
            } else {
                [own, beyond]
            };
            let exact = fresnel::fresnel_dielectric(outside, Some(inside), 1.0 / ior);
            DVec3::from(self.reflectance(lane, Some([outside, inside]))).map(|found| {
                if found > exact {
                    1.0 + (found - exact) / (1.0 - exact)
                } else {
                    found / exact.max(f64::MIN_POSITIVE)
                }
            })
        };
        let fold = |of: fn(DVec3, DVec3) -> DVec3| {
            let lane = |lane: usize| {
                COMPARED_COSINES
                    .iter()
                    .fold(DVec3::ONE, |all, &cosine| of(all, tint(lane, cosine)))
            };
            <N::Vec3 as Vector3<N>>::from_lanes(lane)
        };
        [fold(DVec3::min), fold(DVec3::max)]
    }
}

/// The boundary of a solid body with a tinted reflection or a thin film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TintedDielectric<N: Number> {
    pub(super) tinted_fresnel: TintedFresnel<N>,
    /// The boundary without tint and film.
    pub(super) boundary: Dielectric<N>,
    /// Mask of the SIMD lanes whose ray comes from outside the body.
    pub(super) outside: N::Mask,
}

impl<N: Number> TintedDielectric<N> {
    /// Returns two reflectances of a microfacet in a SIMD lane at a cosine of incidence: by channel
    /// with tint and film, then the Fresnel reflectance without tint and film.
    fn tinted_fresnel_pair(&self, lane: usize, cosine: f64) -> (DVec3, f64) {
        let (exact, beyond) = facet_fresnel(cosine, N::f64_lane(self.boundary.eta, lane));
        let own = cosine.clamp(0.0, 1.0);
        let cosines = (beyond > 0.0).then_some(if self.outside.lane(lane) {
            [own, beyond]
        } else {
            [beyond, own]
        });
        (self.tinted_fresnel.reflectance(lane, cosines).into(), exact)
    }

    /// Scales a BSDF value of the untinted boundary. `of` computes the factor from two reflectances at
    /// the same cosine of incidence: with tint and film, and without them. Returns the scaled value
    /// and the unchanged density.
    fn apply_tint(
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
        let factor = <N::Vec3 as Vector3<N>>::from_lanes(|lane| {
            let (found, exact) = self.tinted_fresnel_pair(lane, cosine.lane(lane));
            found.map(|found| of(found, exact))
        });
        (own * factor, density)
    }
}

impl<N: Number> ScatteringLobe<N> for TintedDielectric<N> {
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
        self.apply_tint(
            self.boundary.eval_and_pdf(directions),
            directions.cos_half,
            factor,
        )
    }

    fn eval_transmission_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let factor = |found: f64, exact: f64| {
            if exact < 1.0 {
                (1.0 - found) / (1.0 - exact)
            } else {
                0.0
            }
        };
        self.apply_tint(
            self.boundary.eval_transmission_and_pdf(directions),
            self.boundary.refraction_half_vector(directions).1[0],
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

    /// Samples the smooth boundary: reflects if `u` is below the greatest reflectance of the three
    /// channels, else refracts.
    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, u: N) -> (N::Vec3, N::Vec3) {
        let drawn = |lane: usize| {
            let interface = SmoothInterface::new(
                -wo.lane(lane),
                normal.lane(lane),
                N::f64_lane(self.boundary.eta, lane),
            );
            let (found, _) = self.tinted_fresnel_pair(lane, interface.cos_incident);
            // The greatest reflectance of the channels is the probability of reflection, so that no
            // weight exceeds one.
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
            N::Vec3::from_lanes(|lane| drawn(lane).0),
            <N::Vec3 as Vector3<N>>::from_lanes(|lane| drawn(lane).1) * self.boundary.share,
        )
    }
}

/// A thin wall that does not refract: two parallel boundaries with all reflections between them.
///
/// If each boundary has the reflectance R, the wall reflects 2R/(1 + R) and transmits (1 − R)/(1 +
/// R). A smooth wall transmits straight on. A rough wall transmits in the direction of its
/// microfacet reflection, flipped to the far side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric<N: Number> {
    pub(super) tinted_fresnel: TintedFresnel<N>,
    /// Share of the surface's area that is a thin wall, 0 to 1.
    pub(super) share: N,
    /// Factor on the transmission by channel.
    pub(super) transmitted: N::Vec3,
    /// Distribution of microfacets; `None` for a smooth wall.
    pub(super) ggx: Option<Ggx<N>>,
}

impl<N: Number> ThinDielectric<N> {
    /// Returns the wall's reflectance 2R/(1 + R) by channel in a SIMD lane, at a cosine of
    /// incidence. R is the reflectance of one boundary.
    fn lane_reflectance(&self, lane: usize, cosine: f64) -> [f64; 3] {
        let (ior, c) = (
            N::f64_lane(self.tinted_fresnel.ior, lane),
            cosine.clamp(0.0, 1.0),
        );
        let inside = (1.0 - (1.0 - c * c) / (ior * ior)).max(0.0).sqrt();
        self.tinted_fresnel
            .reflectance(lane, Some([c, inside]))
            .map(|r| 2.0 * r / (1.0 + r))
    }

    /// Returns the reflectance of the wall in all lanes.
    fn reflectance(&self, cosine: N) -> N::Vec3 {
        <N::Vec3 as Vector3<N>>::from_lanes(|lane| {
            self.lane_reflectance(lane, cosine.lane(lane)).into()
        })
    }

    /// Returns the lobe of multiple scattering among the wall's microfacets. `seen` holds the
    /// viewing direction and the surface normal.
    pub(super) fn multiple_scattering(
        &self,
        roughness: N,
        anisotropic: Option<(N::Mask, Ggx<N>)>,
        seen: [N::Vec3; 2],
    ) -> MultipleScattering<N> {
        let mean = mean_reflectance(|cosine| self.reflectance(cosine));
        MultipleScattering::for_wall(
            roughness,
            anisotropic,
            self.share,
            seen,
            [mean, self.transmitted],
        )
    }

    /// Returns the transmittance of a smooth wall at a cosine of incidence; zero for a rough wall,
    /// which deflects light.
    pub(super) fn straight_transmittance(&self, cosine: N) -> N::Vec3 {
        if self.ggx.is_some() {
            return N::Vec3::ZERO;
        }
        self.transmitted * (N::Vec3::ONE - self.reflectance(cosine)) * self.share
    }
}

impl<N: Number> ScatteringLobe<N> for ThinDielectric<N> {
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
        let found = self.reflectance(directions.cos_half);
        let (value, density) = ggx.eval_reflection_and_pdf(directions, found * self.share);
        (value, found.max_element() * density)
    }

    /// Evaluates the transmission: the microfacet reflection of [`Self::eval_and_pdf`] for `wi`
    /// mirrored to the viewer's side, with transmittance in place of reflectance.
    fn eval_transmission_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let Some(ggx) = &self.ggx else {
            return (N::Vec3::ZERO, N::ZERO);
        };
        let folded = directions.with_wi_above();
        let found = self.reflectance(folded.cos_half);
        let (value, density) = ggx.eval_reflection_and_pdf(
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
        let (wm, up) = ggx.sample_reflection(frame.normal, wo, point);
        let down = up - frame.normal * (N::from_f64(2.0) * frame.normal.dot(up));
        let chance = self.reflectance(wm.dot(wo)).max_element();
        N::Vec3::select(chance.greater_than(choice), up, down)
    }

    fn sample_delta(&self, normal: N::Vec3, wo: N::Vec3, u: N) -> (N::Vec3, N::Vec3) {
        let cosine = normal.dot(wo);
        let found = self.reflectance(cosine);
        let chance = found.max_element();
        let mirror = normalize_if_drifted::<N>(normal * (N::from_f64(2.0) * cosine) - wo);
        let on = self.transmitted * (N::Vec3::ONE - found) / (N::ONE - chance);
        let reflects = chance.greater_than(u);
        let weight = N::Vec3::select(reflects, found / chance, on);
        (N::Vec3::select(reflects, mirror, -wo), weight * self.share)
    }
}
