//! The metallic-roughness model: the inputs that its lobes are made of.

use super::bsdf::Bsdf;
use super::energy::given_back;
use super::lobe::{LEAST_ROUGHNESS, Lobe};
use super::rough_glass::RoughGlass;
use crate::number::{Mask, Number, Vector3};

/// What makes a boundary of glass of a share of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass<N: Number> {
    /// Index of refraction of the inside over the outside.
    pub ior: N::Exact,
    /// Factor of what is reflected.
    pub reflected: N::Vec3,
    /// Factor of what is let through.
    pub transmitted: N::Vec3,
}

impl<N: Number> Glass<N> {
    /// Index on the side that a ray comes from over the one beyond.
    #[inline(always)]
    pub fn eta(&self, outside: N::Mask) -> N::Exact {
        let ior = |lane| N::exact_lane(self.ior, lane);
        N::exact(|lane| if outside.lane(lane) { 1.0 / ior(lane) } else { ior(lane) })
    }
}

/// The inputs of the metallic-roughness model at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness<N: Number> {
    /// Base colour.
    pub base: N::Vec3,
    /// 0 dielectric to 1 metal.
    pub metallic: N,
    /// Perceptual roughness.
    pub roughness: N,
    /// Reflectance of the dielectric part at normal incidence.
    pub dielectric: N,
    /// The same at grazing incidence: 1, but where a factor says less.
    pub grazing: N,
    /// The boundary of the dielectric part, where it lets light through.
    pub glass: Option<Glass<N>>,
}

/// Least difference of an index from one at which a rough boundary scatters; below, it is smooth.
pub(super) const LEAST_BEND: f64 = 5e-3;

impl<N: Number> MetallicRoughness<N> {
    /// Share of the surface that is a boundary of glass.
    #[inline(always)]
    pub fn through(&self) -> N {
        if self.glass.is_some() { N::ONE - self.metallic } else { N::ZERO }
    }

    /// Colour that is diffused: what neither a metal nor the way through takes away.
    #[inline(always)]
    pub fn albedo(&self) -> N::Vec3 {
        let tint = self.glass.map_or(N::ZERO, |glass| glass.transmitted.max_element().min(N::ONE));
        self.base * ((N::ONE - self.metallic) * (N::ONE - self.through() * tint))
    }

    /// Reflectance at normal incidence.
    #[inline(always)]
    pub fn f0(&self) -> N::Vec3 {
        N::Vec3::splat(self.dielectric) * (N::ONE - self.metallic) + self.base * self.metallic
    }

    /// Reflectance at grazing incidence: all, but for what the dielectric part lacks of it.
    #[inline(always)]
    pub fn f90(&self) -> N {
        N::ONE - (N::ONE - self.grazing) * (N::ONE - self.metallic)
    }

    /// The mirror that its glossy lobe is where the roughness is next to none.
    #[inline(always)]
    pub fn mirror(&self) -> Lobe<N> {
        Lobe::Mirror { f0: self.f0(), f90: N::Vec3::splat(self.f90()) }
    }

    /// The lobes that answer to a light: diffuse and glossy. How many is known when this is compiled, so nothing is left of
    /// the list.
    #[inline(always)]
    pub fn answer(&self, normal: N::Vec3) -> Bsdf<N> {
        let f0 = self.f0();
        let diffuse = Lobe::Diffuse { albedo: self.albedo(), f0, f90: self.f90() };
        Bsdf::new(normal).with(diffuse).with(Lobe::Glossy { f0, roughness: self.roughness })
    }

    /// Its lobes for light that goes any way, seen from `wo`: as [`Self::bsdf`], but next to smooth surfaces are mirrors, rough ones
    /// give back what their facets send to each other (where `compensated`), and a boundary of glass, smooth or rough, reflects by itself, so that of the
    /// rest only what is metal does.
    #[inline(always)]
    pub fn transport(&self, normal: N::Vec3, wo: N::Vec3, outside: N::Mask, compensated: bool) -> Bsdf<N> {
        let zero = N::Vec3::ZERO;
        let (through, whole) = (self.through(), self.f0());
        let glassy = through.above(N::ZERO);
        let f0 = N::Vec3::select(glassy, self.base * self.metallic, whole);
        let f90 = N::Vec3::splat(N::select(glassy, self.metallic, self.f90()));
        let mut bsdf = Bsdf::new(normal);
        let albedo = self.albedo();
        if albedo.max_element().above(N::ZERO).any() {
            bsdf = bsdf.with(Lobe::Diffuse { albedo, f0: whole, f90: self.f90() });
        }
        let rough = self.roughness.above(N::from_f64(LEAST_ROUGHNESS));
        if f90.max_element().above(N::ZERO).any() {
            if rough.any() {
                let gain = if compensated { given_back(f0, self.roughness, normal.dot(wo)) } else { N::Vec3::ONE };
                let [f0, f90] = [f0, f90].map(|f| N::Vec3::select(rough, f * gain, zero));
                bsdf = bsdf.with(Lobe::Rough { f0, f90, roughness: self.roughness });
            }
            if (!rough).any() {
                let [f0, f90] = [f0, f90].map(|f| N::Vec3::select(rough, zero, f));
                bsdf = bsdf.with(Lobe::Mirror { f0, f90 });
            }
        }
        let Some(glass) = self.glass.filter(|_| glassy.any()) else { return bsdf };
        let share = |of| N::select(of, through, N::ZERO);
        // Indices that are nearly the same bend next to nothing, however the facets lie.
        let bends = N::of_lanes(|lane| (N::exact_lane(glass.ior, lane) - 1.0).abs()).above(N::from_f64(LEAST_BEND));
        let rough = rough & bends;
        let (eta, reflected, transmitted) = (glass.eta(outside), glass.reflected, glass.transmitted);
        if (!rough).any() {
            bsdf = bsdf.with(Lobe::Dielectric { eta, share: share(!rough), reflected, transmitted });
        }
        if rough.any() {
            let (share, eta) = (share(rough), N::of_lanes(|lane| N::exact_lane(eta, lane)));
            bsdf = bsdf.with(Lobe::RoughGlass(RoughGlass { eta, share, reflected, transmitted, roughness: self.roughness }));
        }
        bsdf
    }

    /// [`Self::transport`] where no lane is next to smooth and none lets light through: the same numbers from two lobes, whose kinds and
    /// count are known when this is compiled.
    #[inline(always)]
    pub fn rough(&self, normal: N::Vec3, wo: N::Vec3, compensated: bool) -> Bsdf<N, Lobe<N>, 2> {
        let f0 = self.f0();
        let gain = if compensated { given_back(f0, self.roughness, normal.dot(wo)) } else { N::Vec3::ONE };
        Bsdf::of_kind(normal).with(Lobe::Diffuse { albedo: self.albedo(), f0, f90: self.f90() }).with(Lobe::Rough {
            f0: f0 * gain,
            f90: N::Vec3::splat(self.f90()) * gain,
            roughness: self.roughness,
        })
    }

    /// Whether that is what it is, lane by lane.
    #[inline(always)]
    pub fn is_rough(&self) -> N::Mask {
        let rough = self.roughness.above(N::from_f64(LEAST_ROUGHNESS));
        if self.glass.is_some() { N::Mask::default() } else { rough }
    }

    /// All its lobes: those of [`Self::answer`], and the boundary of glass where some lane has a share of it.
    #[inline(always)]
    pub fn bsdf(&self, normal: N::Vec3, outside: N::Mask) -> Bsdf<N> {
        let bsdf = self.answer(normal);
        let (share, Some(glass)) = (self.through(), self.glass) else { return bsdf };
        let (eta, reflected, transmitted) = (glass.eta(outside), glass.reflected, glass.transmitted);
        let some = share.above(N::ZERO).any();
        if some { bsdf.with(Lobe::Dielectric { eta, share, reflected, transmitted }) } else { bsdf }
    }
}
