//! The metallic-roughness model: its inputs at a point, and the lobes of its BSDF.

use super::albedo::Albedo;
use super::bsdf::Bsdf;
use super::dielectric::Dielectric;
use super::energy::{EnergyComplement, multiple_scattering_factors};
use super::ggx::LEAST_ROUGHNESS;
use super::lobe::Lobe;
use super::multiple_scattering::MultipleScattering;
use crate::number::{Mask, Number, Vector3};

/// Glass that covers a share of a surface's area.
///
/// A partly transmissive dielectric is a mixture by area: glass, and paint (an opaque dielectric)
/// elsewhere. From outside, this equals glTF's mixture of a diffuse and a transmissive base under a
/// common specular reflection.
///
/// From inside, light hits either glass or the back of the paint. Glass reflects totally beyond the
/// critical angle. The back of the paint has no microfacets. No reflection counts twice, and the
/// albedo is at most 1 from both sides, rough or smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass<N: Number> {
    /// Share of glass in the area of the dielectric, 0 to 1.
    pub share: N,
    /// Index of refraction inside over the index outside.
    pub ior: N::Exact,
    /// Factor on the reflection by channel.
    pub reflected: N::Vec3,
    /// Factor on the transmission by channel.
    pub transmitted: N::Vec3,
}

impl<N: Number> Glass<N> {
    /// Returns the index on the ray's side over the index on the far side. `outside` is the mask of
    /// the SIMD lanes whose ray comes from outside.
    #[inline(always)]
    pub fn eta(&self, outside: N::Mask) -> N::Exact {
        let ior = |lane| N::f64_lane(self.ior, lane);
        N::f64_from_lanes(|lane| {
            if outside.lane(lane) {
                1.0 / ior(lane)
            } else {
                ior(lane)
            }
        })
    }

    /// Mask of the SIMD lanes whose boundary refracts noticeably. Between nearly equal indices,
    /// rough microfacets refract by negligible angles.
    #[inline(always)]
    pub(super) fn is_refractive(&self) -> N::Mask {
        N::from_lanes(|lane| (N::f64_lane(self.ior, lane) - 1.0).abs())
            .greater_than(N::from_f64(LEAST_BEND))
    }

    /// Returns the lobe of multiple scattering among the microfacets of a rough boundary. `seen`
    /// holds the boundary's share of the surface and the cosine of the view. `tint` holds the least
    /// and the greatest tint of the boundary's reflectance, from 0 to 2.
    #[inline(never)]
    pub(super) fn multiple_scattering(
        &self,
        outside: N::Mask,
        roughness: N,
        seen: [N; 2],
        tint: [N::Vec3; 2],
    ) -> MultipleScattering<N> {
        let eta = self.eta(outside);
        let eta = N::from_lanes(|lane| N::f64_lane(eta, lane));
        MultipleScattering::for_boundary(eta, roughness, seen, tint, self.transmitted)
    }

    /// Returns the lobe of the boundary. It covers the given share of the surface; without a
    /// roughness it is smooth.
    #[inline(always)]
    pub fn dielectric_lobe(
        &self,
        outside: N::Mask,
        share: N,
        roughness: Option<N>,
    ) -> Dielectric<N> {
        let (
            eta,
            Self {
                reflected,
                transmitted,
                ..
            },
        ) = (self.eta(outside), *self);
        Dielectric {
            eta,
            facet_eta: N::from_lanes(|lane| N::f64_lane(eta, lane)),
            share,
            reflected,
            transmitted,
            roughness,
        }
    }
}

/// Parameters of the metallic-roughness model of glTF at a point, evaluated from inputs such as
/// textures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness<N: Number> {
    /// Base colour.
    pub base: N::Vec3,
    /// Share of metal in the surface's area, from 0 (dielectric) to 1 (metal).
    pub metallic: N,
    /// Perceptual roughness, from 0 (mirror) to 1; the microfacet α is its square.
    pub roughness: N,
    /// Reflectance of the dielectric part at normal incidence.
    pub dielectric: N,
    /// Reflectance of the dielectric part at grazing incidence: 1, or less by the factor of
    /// KHR_materials_specular.
    pub grazing: N,
    /// Glass in the dielectric part; `None` for an opaque material.
    pub glass: Option<Glass<N>>,
}

/// Least difference from 1 of a relative index of refraction at which a boundary may be rough.
/// Closer to 1, the boundary counts as smooth.
const LEAST_BEND: f64 = 5e-3;

impl<N: Number> MetallicRoughness<N> {
    /// Returns the share of the surface that is glass.
    #[inline(always)]
    pub fn glass_share(&self) -> N {
        self.glass
            .map_or(N::ZERO, |glass| glass.share * (N::ONE - self.metallic))
    }

    /// Returns the share of the surface that is an opaque dielectric: neither glass nor metal.
    #[inline(always)]
    pub fn opaque_dielectric_share(&self) -> N {
        let dielectric = N::ONE - self.metallic;
        self.glass
            .map_or(dielectric, |glass| dielectric * (N::ONE - glass.share))
    }

    /// Returns the diffuse albedo in red, green and blue, before the microfacets above take their
    /// share of the light.
    #[inline(always)]
    pub fn albedo(&self) -> N::Vec3 {
        self.base * self.opaque_dielectric_share()
    }

    /// Returns the reflectance at normal incidence of the mixture of dielectric and metal.
    #[inline(always)]
    pub fn f0(&self) -> N::Vec3 {
        self.microfacet_reflectances(N::ONE - self.metallic).0
    }

    /// Returns the reflectances of the microfacets at normal and at grazing incidence. `dielectric`
    /// is the share of the surface with dielectric microfacets.
    #[inline(always)]
    fn microfacet_reflectances(&self, dielectric: N) -> (N::Vec3, N) {
        (
            N::Vec3::splat(self.dielectric) * dielectric + self.base * self.metallic,
            self.grazing * dielectric + self.metallic,
        )
    }

    /// Returns the diffuse lobe, and the mask of the SIMD lanes in which it is not zero.
    ///
    /// - `dielectric`: share of the microfacets that are dielectric.
    /// - `over`: 1 in lanes where dielectric microfacets cover the base, else 0.
    /// - `cosine`: cosine of the view to the normal.
    /// - `compensated`: whether the lobe includes multiple scattering among the microfacets.
    ///
    /// The base is part of the dielectric and loses only the light that the dielectric's
    /// microfacets reflect. Metal lies beside the base and takes no light from it, as in glTF's
    /// mixture of metal and dielectric.
    #[inline(always)]
    fn diffuse_lobe(
        &self,
        [dielectric, over]: [N; 2],
        cosine: N,
        compensated: bool,
    ) -> (Lobe<N>, N::Mask) {
        let (albedo, zero) = (self.albedo(), N::Vec3::ZERO);
        let layer = [self.dielectric * over, self.grazing * over];
        let bare = EnergyComplement::new([layer[0], layer[1], N::ZERO], self.roughness);
        if !bare.has_reflective_layer() && !self.metallic.greater_than(N::ZERO).any_lane() {
            return (
                Lobe::Diffuse {
                    albedo,
                    interreflected: zero,
                    energy_complement: bare,
                },
                albedo.max_element().greater_than(N::ZERO),
            );
        }
        let mean = Albedo::mean(self.roughness);
        let (mut scattered, mut own) = (zero, N::ZERO);
        if compensated {
            let all;
            (own, all) = multiple_scattering_factors::<N>(
                layer,
                self.base,
                [dielectric, self.metallic],
                mean.multiple_scattering_loss,
            );
            scattered = N::Vec3::select(
                self.roughness.greater_than(N::from_f64(LEAST_ROUGHNESS)),
                all,
                zero,
            );
        }
        let energy_complement = EnergyComplement::new([layer[0], layer[1], own], self.roughness)
            .with_view_cosine(cosine, mean);
        (
            Lobe::Diffuse {
                albedo,
                interreflected: scattered,
                energy_complement,
            },
            albedo.max(scattered).max_element().greater_than(N::ZERO),
        )
    }

    /// Returns the specular lobe of a nearly smooth surface, a mirror.
    #[inline(always)]
    pub fn mirror_lobe(&self) -> Lobe<N> {
        let (f0, f90) = self.microfacet_reflectances(N::ONE - self.metallic);
        Lobe::Mirror {
            f0,
            f90: N::Vec3::splat(f90),
        }
    }

    /// Returns the only lobe of a surface that is a smooth mirror or smooth glass in all SIMD lanes;
    /// `None` for any other surface. It is the only lobe of [`Self::transport_bsdf`] too.
    #[inline(always)]
    pub fn smooth_lobe(&self, outside: N::Mask) -> Option<Lobe<N>> {
        if self
            .roughness
            .greater_than(N::from_f64(LEAST_ROUGHNESS))
            .any_lane()
        {
            return None;
        }
        let Some(glass) = self.glass else {
            let is_diffuse = self.albedo().max_element().greater_than(N::ZERO);
            return (!is_diffuse.any_lane()).then(|| self.mirror_lobe());
        };
        let share = self.glass_share();
        let is_partial = N::ONE.greater_than(share);
        (!is_partial.any_lane())
            .then(|| Lobe::Dielectric(glass.dielectric_lobe(outside, share, None)))
    }

    /// Returns the BSDF of local lighting: a diffuse and a rough specular lobe. Their number is
    /// known at compile time, and the compiler removes the list.
    #[inline(always)]
    pub fn local_bsdf(&self, normal: N::Vec3, wo: N::Vec3) -> Bsdf<N> {
        let f0 = self.f0();
        let (diffuse, _) =
            self.diffuse_lobe([N::ONE - self.metallic, N::ONE], normal.dot(wo), false);
        Bsdf::new(normal).with_lobe(diffuse).with_lobe(Lobe::Rough {
            f0,
            f90: N::Vec3::ONE,
            roughness: self.roughness,
        })
    }

    /// Returns the BSDF for light transport, viewed along `wo`. `outside` is the mask of the SIMD
    /// lanes whose ray comes from outside.
    ///
    /// This BSDF differs from [`Self::local_bsdf`] in three points:
    /// - Nearly smooth surfaces are mirrors.
    /// - Rough surfaces include multiple scattering among microfacets if `compensated`.
    /// - Glass has lobes of its own, and all other lobes cover paint and metal alone.
    #[inline(always)]
    pub fn transport_bsdf(
        &self,
        normal: N::Vec3,
        wo: N::Vec3,
        outside: N::Mask,
        compensated: bool,
    ) -> Bsdf<N> {
        let mut bsdf = Bsdf::new(normal);
        self.add_lobes_to(&mut bsdf, wo, outside, compensated);
        bsdf
    }

    /// Adds the lobes of [`Self::transport_bsdf`] to a BSDF without lobes.
    #[inline(always)]
    pub fn add_lobes_to(
        &self,
        bsdf: &mut Bsdf<N>,
        wo: N::Vec3,
        outside: N::Mask,
        compensated: bool,
    ) {
        let (zero, normal) = (N::Vec3::ZERO, bsdf.normal());
        let through = self.glass_share();
        let glassy = through.greater_than(N::ZERO);
        // For a ray inside a body, the back of the paint has no microfacets.
        let over = if self.glass.is_some() {
            N::select(outside, N::ONE, N::ZERO)
        } else {
            N::ONE
        };
        let painted = self.opaque_dielectric_share() * over;
        let (f0, f90) = self.microfacet_reflectances(painted);
        let (diffuse, some) = self.diffuse_lobe([painted, over], normal.dot(wo), compensated);
        if some.any_lane() {
            bsdf.add_lobe(diffuse);
        }
        let f90 = N::Vec3::splat(f90);
        let rough = self.roughness.greater_than(N::from_f64(LEAST_ROUGHNESS));
        if f90.max_element().greater_than(N::ZERO).any_lane() {
            if rough.any_lane() {
                let [f0, f90] = [f0, f90].map(|f| N::Vec3::select(rough, f, zero));
                bsdf.add_lobe(Lobe::Rough {
                    f0,
                    f90,
                    roughness: self.roughness,
                });
            }
            if (!rough).any_lane() {
                let [f0, f90] = [f0, f90].map(|f| N::Vec3::select(rough, zero, f));
                bsdf.add_lobe(Lobe::Mirror { f0, f90 });
            }
        }
        let Some(glass) = self.glass.filter(|_| glassy.any_lane()) else {
            return;
        };
        let rough = rough & glass.is_refractive();
        for (of, roughness) in [(!rough, None), (rough, Some(self.roughness))] {
            if of.any_lane() {
                bsdf.add_lobe(Lobe::Dielectric(glass.dielectric_lobe(
                    outside,
                    N::select(of, through, N::ZERO),
                    roughness,
                )));
            }
        }
        if compensated && rough.any_lane() {
            let (share, tint) = (N::select(rough, through, N::ZERO), [glass.reflected; 2]);
            bsdf.add_lobe(Lobe::MultipleScattering(glass.multiple_scattering(
                outside,
                self.roughness,
                [share, normal.dot(wo)],
                tint,
            )));
        }
    }

    /// Returns the BSDF of [`Self::transport_bsdf`] for lanes that are all rough and opaque (see
    /// [`Self::is_rough`]). The types of its two lobes are known at compile time.
    #[inline(always)]
    pub fn rough_bsdf(
        &self,
        normal: N::Vec3,
        wo: N::Vec3,
        compensated: bool,
    ) -> Bsdf<N, Lobe<N>, 2> {
        let dielectric = N::ONE - self.metallic;
        let (f0, f90) = self.microfacet_reflectances(dielectric);
        let (diffuse, _) = self.diffuse_lobe([dielectric, N::ONE], normal.dot(wo), compensated);
        Bsdf::new(normal).with_lobe(diffuse).with_lobe(Lobe::Rough {
            f0,
            f90: N::Vec3::splat(f90),
            roughness: self.roughness,
        })
    }

    /// Mask of the SIMD lanes whose surface has no specular reflection; the diffuse lobe is then
    /// the only lobe.
    #[inline(always)]
    pub fn is_matte(&self) -> N::Mask {
        !(self.metallic.greater_than(N::ZERO)
            | self.dielectric.greater_than(N::ZERO)
            | self.grazing.greater_than(N::ZERO))
    }

    /// Mask of the SIMD lanes whose surface is rough and opaque, as [`Self::rough_bsdf`] requires.
    #[inline(always)]
    pub fn is_rough(&self) -> N::Mask {
        let rough = self.roughness.greater_than(N::from_f64(LEAST_ROUGHNESS));
        if self.glass.is_some() {
            N::Mask::default()
        } else {
            rough
        }
    }
}
