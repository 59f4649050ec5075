//! The metallic-roughness model: inputs, and the lobes that they yield.

use super::albedo::Albedo;
use super::bsdf::Bsdf;
use super::dielectric::Dielectric;
use super::energy::{EnergyComplement, interreflections};
use super::ggx::LEAST_ROUGHNESS;
use super::interreflected::Interreflected;
use super::lobe::Lobe;
use crate::number::{Mask, Number, Vector3};

/// Glass in a share of a surface.
///
/// A partly transmissive dielectric is a mixture by area: glass in its share, paint in the rest.
/// From outside this equals glTF's mixture of a diffuse and a transmissive base under one specular
/// reflection. From inside, light hits either glass, which reflects all of it beyond the critical
/// angle, or the back of the paint, which has no boundary before it. So no angle counts twice, and
/// the albedo is at most one from both sides, rough or smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass<N: Number> {
    /// Glass share of the dielectric part.
    pub share: N,
    /// Index of refraction of the inside over the outside.
    pub ior: N::Exact,
    /// Factor of the reflection.
    pub reflected: N::Vec3,
    /// Factor of the transmission.
    pub transmitted: N::Vec3,
}

impl<N: Number> Glass<N> {
    /// Index on the ray's side over the index beyond.
    #[inline(always)]
    pub fn eta(&self, outside: N::Mask) -> N::Exact {
        let ior = |lane| N::exact_lane(self.ior, lane);
        N::exact(|lane| {
            if outside.lane(lane) {
                1.0 / ior(lane)
            } else {
                ior(lane)
            }
        })
    }

    /// Whether the boundary refracts. Nearly equal indices refract next to nothing, however the
    /// microfacets lie.
    #[inline(always)]
    pub(super) fn bends(&self) -> N::Mask {
        N::of_lanes(|lane| (N::exact_lane(self.ior, lane) - 1.0).abs())
            .greater_than(N::from_f64(LEAST_BEND))
    }

    /// Multiple scattering among the microfacets of a rough boundary. `seen` is the boundary's
    /// share of the surface and the viewing cosine, `tint` the least and the greatest ratio to the
    /// Fresnel reflectance.
    #[inline(never)]
    pub(super) fn interreflected(
        &self,
        outside: N::Mask,
        roughness: N,
        seen: [N; 2],
        tint: [N::Vec3; 2],
    ) -> Interreflected<N> {
        let eta = self.eta(outside);
        let eta = N::of_lanes(|lane| N::exact_lane(eta, lane));
        Interreflected::of_boundary(eta, roughness, seen, tint, self.transmitted)
    }

    /// The boundary in this share of a surface, smooth or of a roughness.
    #[inline(always)]
    pub fn boundary(&self, outside: N::Mask, share: N, roughness: Option<N>) -> Dielectric<N> {
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
            facet_eta: N::of_lanes(|lane| N::exact_lane(eta, lane)),
            share,
            reflected,
            transmitted,
            roughness,
        }
    }
}

/// The inputs of the metallic-roughness model at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness<N: Number> {
    /// Base colour.
    pub base: N::Vec3,
    /// Metal share, from 0 (dielectric) to 1.
    pub metallic: N,
    /// Perceptual roughness.
    pub roughness: N,
    /// Reflectance of the dielectric part at normal incidence.
    pub dielectric: N,
    /// Reflectance of the dielectric part at grazing incidence: 1 unless a factor lowers it.
    pub grazing: N,
    /// The glass of the dielectric part, if it transmits.
    pub glass: Option<Glass<N>>,
}

/// Least difference of an index from one at which a rough boundary scatters; closer to one it
/// counts as smooth.
const LEAST_BEND: f64 = 5e-3;

impl<N: Number> MetallicRoughness<N> {
    /// Glass share of the surface.
    #[inline(always)]
    pub fn through(&self) -> N {
        self.glass
            .map_or(N::ZERO, |glass| glass.share * (N::ONE - self.metallic))
    }

    /// Opaque dielectric share of the surface.
    #[inline(always)]
    pub fn painted(&self) -> N {
        let dielectric = N::ONE - self.metallic;
        self.glass
            .map_or(dielectric, |glass| dielectric * (N::ONE - glass.share))
    }

    /// Diffuse albedo.
    #[inline(always)]
    pub fn albedo(&self) -> N::Vec3 {
        self.base * self.painted()
    }

    /// Reflectance at normal incidence.
    #[inline(always)]
    pub fn f0(&self) -> N::Vec3 {
        self.facet_reflectance(N::ONE - self.metallic).0
    }

    /// Reflectances at normal and at grazing incidence of microfacets with this dielectric share.
    #[inline(always)]
    fn facet_reflectance(&self, dielectric: N) -> (N::Vec3, N) {
        (
            N::Vec3::splat(self.dielectric) * dielectric + self.base * self.metallic,
            self.grazing * dielectric + self.metallic,
        )
    }

    /// The diffuse lobe, and the lanes where it is non-zero. `over` is one where dielectric
    /// microfacets cover the base. `compensated` adds the multiple scattering among all
    /// microfacets, of which the share `dielectric` is dielectric.
    ///
    /// The base belongs to the dielectric part and loses the albedo of that part's microfacets:
    /// metal beside the base takes no light from the base, as in glTF's mixture of a metal and a
    /// dielectric.
    #[inline(always)]
    fn diffuse(
        &self,
        [dielectric, over]: [N; 2],
        cosine: N,
        compensated: bool,
    ) -> (Lobe<N>, N::Mask) {
        let (albedo, zero) = (self.albedo(), N::Vec3::ZERO);
        let layer = [self.dielectric * over, self.grazing * over];
        let bare = EnergyComplement::new([layer[0], layer[1], N::ZERO], self.roughness);
        if !bare.is_covered() && !self.metallic.greater_than(N::ZERO).any() {
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
            (own, all) =
                interreflections::<N>(layer, self.base, [dielectric, self.metallic], mean.lost);
            scattered = N::Vec3::select(
                self.roughness.greater_than(N::from_f64(LEAST_ROUGHNESS)),
                all,
                zero,
            );
        }
        let energy_complement =
            EnergyComplement::new([layer[0], layer[1], own], self.roughness).seen_at(cosine, mean);
        (
            Lobe::Diffuse {
                albedo,
                interreflected: scattered,
                energy_complement,
            },
            albedo.max(scattered).max_element().greater_than(N::ZERO),
        )
    }

    /// The glossy lobe of a surface of nearly no roughness: a mirror.
    #[inline(always)]
    pub fn mirror(&self) -> Lobe<N> {
        let (f0, f90) = self.facet_reflectance(N::ONE - self.metallic);
        Lobe::Mirror {
            f0,
            f90: N::Vec3::splat(f90),
        }
    }

    /// The lobes of local lighting: diffuse and glossy. Their number is known at compile time, so
    /// the list is optimised away.
    #[inline(always)]
    pub fn local_bsdf(&self, normal: N::Vec3, wo: N::Vec3) -> Bsdf<N> {
        let f0 = self.f0();
        let (diffuse, _) = self.diffuse([N::ONE - self.metallic, N::ONE], normal.dot(wo), false);
        Bsdf::new(normal).with_lobe(diffuse).with_lobe(Lobe::Rough {
            f0,
            f90: N::Vec3::ONE,
            roughness: self.roughness,
        })
    }

    /// The lobes for light transport, viewed along `wo`. Unlike [`Self::local_bsdf`], nearly smooth
    /// surfaces are mirrors, rough surfaces include multiple scattering among microfacets (where
    /// `compensated`), and a glass boundary, smooth or rough, has its own lobes. The other lobes
    /// then cover paint and metal alone.
    #[inline(always)]
    pub fn transport(
        &self,
        normal: N::Vec3,
        wo: N::Vec3,
        outside: N::Mask,
        compensated: bool,
    ) -> Bsdf<N> {
        let zero = N::Vec3::ZERO;
        let through = self.through();
        let glassy = through.greater_than(N::ZERO);
        // From inside a body, the back of its paint has no boundary.
        let over = if self.glass.is_some() {
            N::select(outside, N::ONE, N::ZERO)
        } else {
            N::ONE
        };
        let painted = self.painted() * over;
        let (f0, f90) = self.facet_reflectance(painted);
        let (diffuse, some) = self.diffuse([painted, over], normal.dot(wo), compensated);
        let mut bsdf = if some.any() {
            Bsdf::new(normal).with_lobe(diffuse)
        } else {
            Bsdf::new(normal)
        };
        let f90 = N::Vec3::splat(f90);
        let rough = self.roughness.greater_than(N::from_f64(LEAST_ROUGHNESS));
        if f90.max_element().greater_than(N::ZERO).any() {
            if rough.any() {
                let [f0, f90] = [f0, f90].map(|f| N::Vec3::select(rough, f, zero));
                bsdf = bsdf.with_lobe(Lobe::Rough {
                    f0,
                    f90,
                    roughness: self.roughness,
                });
            }
            if (!rough).any() {
                let [f0, f90] = [f0, f90].map(|f| N::Vec3::select(rough, zero, f));
                bsdf = bsdf.with_lobe(Lobe::Mirror { f0, f90 });
            }
        }
        let Some(glass) = self.glass.filter(|_| glassy.any()) else {
            return bsdf;
        };
        let rough = rough & glass.bends();
        for (of, roughness) in [(!rough, None), (rough, Some(self.roughness))] {
            if of.any() {
                bsdf = bsdf.with_lobe(Lobe::Dielectric(glass.boundary(
                    outside,
                    N::select(of, through, N::ZERO),
                    roughness,
                )));
            }
        }
        if compensated && rough.any() {
            let (share, tint) = (N::select(rough, through, N::ZERO), [glass.reflected; 2]);
            bsdf.add(Lobe::Interreflected(glass.interreflected(
                outside,
                self.roughness,
                [share, normal.dot(wo)],
                tint,
            )));
        }
        bsdf
    }

    /// The BSDF of [`Self::transport`] for lanes that are all rough and do not transmit. Its two
    /// lobes have kinds known at compile time.
    #[inline(always)]
    pub fn rough(&self, normal: N::Vec3, wo: N::Vec3, compensated: bool) -> Bsdf<N, Lobe<N>, 2> {
        let dielectric = N::ONE - self.metallic;
        let (f0, f90) = self.facet_reflectance(dielectric);
        let (diffuse, _) = self.diffuse([dielectric, N::ONE], normal.dot(wo), compensated);
        Bsdf::new(normal).with_lobe(diffuse).with_lobe(Lobe::Rough {
            f0,
            f90: N::Vec3::splat(f90),
            roughness: self.roughness,
        })
    }

    /// Whether the surface has no specular reflection, so that the diffuse lobe is its whole BSDF.
    #[inline(always)]
    pub fn is_matte(&self) -> N::Mask {
        !(self.metallic.greater_than(N::ZERO)
            | self.dielectric.greater_than(N::ZERO)
            | self.grazing.greater_than(N::ZERO))
    }

    /// Whether [`Self::rough`] applies, by lane.
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
