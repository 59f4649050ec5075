//! Layered surfaces: the metallic-roughness model with what glTF's extensions lay over it, under it and into it.

use super::albedo::Albedo;
use super::base::{Base, Top};
use super::bsdf::Bsdf;
use super::energy::{Remainder, interreflected, interreflected_of};
use super::film::Film;
use super::frame::Frame;
use super::fresnel::{FresnelRule, conductor};
use super::ggx::{Ggx, LEAST_ROUGHNESS};
use super::glass_layer::{Boundary, Sheet, Tinted};
use super::layer::{COAT, Coat, Cover, Layer, Way};
use super::metallic_roughness::{LEAST_BEND, MetallicRoughness};
use super::reflectance::Reflectance;
use super::rough_glass::RoughGlass;
use super::sheen::Sheen;
use crate::number::{Mask, Number, Vector3};

/// Lobes that a layered surface may have.
pub const MOST_LAYERS: usize = 9;

/// The answer to light of a layered surface at a point.
pub type LayeredBsdf<N> = Bsdf<N, Layer<N>, MOST_LAYERS>;

/// Facets that are combed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Combed<N: Number> {
    /// From 0, as rough either way, to 1.
    pub strength: N,
    /// The frame along whose tangent the surface is rougher.
    pub frame: Frame<N>,
}

/// What a surface diffuses to its other side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffused<N: Number> {
    /// Share of what would be diffused back.
    pub share: N,
    /// Its colour.
    pub colour: N::Vec3,
}

/// The inputs of a layered surface at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layered<N: Number> {
    /// What is at its bottom.
    pub base: MetallicRoughness<N>,
    /// Index of refraction of the dielectric part.
    pub ior: N::Exact,
    /// Factor of the dielectric part's reflectance, and its colour at normal incidence (KHR_materials_specular).
    pub specular: N,
    /// The colour.
    pub specular_colour: N::Vec3,
    /// Complex index of the metal, n and k, in place of its colour.
    pub conductor: Option<[N::Vec3; 2]>,
    /// Whether the glass is a thin wall.
    pub thin: bool,
    /// What is diffused to the other side.
    pub diffused: Option<Diffused<N>>,
    /// How facets are combed.
    pub combed: Option<Combed<N>>,
    /// A thin film on the facets.
    pub film: Option<Film<N>>,
    /// Fibres over all that.
    pub sheen: Option<Sheen<N>>,
    /// A clear coat over everything.
    pub coat: Option<Coat<N>>,
    /// By which formulas surfaces reflect.
    pub rule: FresnelRule,
    /// Whether facets give back what they send to each other.
    pub compensated: bool,
}

impl<N: Number> LayeredBsdf<N> {
    /// What it lets straight through of light that comes along the way back.
    pub fn straight(&self, wo: N::Vec3) -> N::Vec3 {
        self.lobes().iter().fold(N::Vec3::ZERO, |sum, lobe| sum + lobe.straight(self.normal(), wo))
    }
}

impl<N: Number> Layered<N> {
    /// A surface without any layers.
    pub fn of(base: MetallicRoughness<N>, ior: N::Exact) -> Self {
        Self {
            base,
            ior,
            specular: N::ONE,
            specular_colour: N::Vec3::ONE,
            conductor: None,
            thin: false,
            diffused: None,
            combed: None,
            film: None,
            sheen: None,
            coat: None,
            rule: FresnelRule::default(),
            compensated: true,
        }
    }

    /// What its facets reflect, of which a share `dielectric` is not metal and no glass.
    fn reflectance(&self, dielectric: N) -> Reflectance<N> {
        let normal = (self.specular_colour * self.base.dielectric).min(N::Vec3::ONE) * self.specular;
        let colour = self.conductor.map_or(self.base.base, |[n, k]| {
            N::Vec3::of_lanes(|lane| {
                let (n, k) = (n.lane(lane), k.lane(lane));
                glam::DVec3::new(conductor(1.0, [n.x, k.x]), conductor(1.0, [n.y, k.y]), conductor(1.0, [n.z, k.z]))
            })
        });
        Reflectance {
            shares: [dielectric, self.base.metallic],
            dielectric: [normal, N::Vec3::splat(self.specular)],
            exact: (self.rule == FresnelRule::Exact).then_some(self.ior),
            metal: colour,
            conductor: self.conductor.filter(|_| self.rule != FresnelRule::Schlick),
            film: self.film,
        }
    }

    /// Its lobes, seen along `wo`.
    pub fn transport(&self, normal: N::Vec3, wo: N::Vec3, outside: N::Mask) -> LayeredBsdf<N> {
        let mut bsdf = LayeredBsdf::of_kind(normal);
        self.add_to(&mut bsdf, wo, outside);
        bsdf
    }

    /// Where facets are combed.
    fn is_combed(&self) -> N::Mask {
        self.combed.map_or(N::Mask::default(), |combed| combed.strength.above(N::ZERO))
    }

    /// The facets, where some are combed.
    fn anisotropic(&self) -> Option<Ggx<N>> {
        self.combed
            .filter(|_| self.is_combed().any())
            .map(|combed| Ggx::anisotropic(combed.frame, self.base.roughness, combed.strength))
    }

    /// The facets about a normal.
    fn facets(&self, normal: N::Vec3) -> Ggx<N> {
        self.anisotropic().unwrap_or_else(|| Ggx::isotropic(normal, self.base.roughness))
    }

    /// Adds its lobes, seen along `wo`, to a list of none: where it stays, since it is too large to be handed on.
    pub fn add_to(&self, bsdf: &mut LayeredBsdf<N>, wo: N::Vec3, outside: N::Mask) {
        let (through, normal) = (self.base.through(), bsdf.normal());
        let glassy = through.above(N::ZERO);
        let mut list = LayeredBuilder { bsdf, normal, wo, cover: Cover::NONE };
        // From within a body, what lies over it is beyond the boundary, the facets of its paint too.
        let over = if self.base.glass.is_none() || self.thin { N::ONE } else { N::select(outside, N::ONE, N::ZERO) };
        let is_over = over.above(N::ZERO).any();
        let coat = self.coat.filter(|_| is_over);
        if let Some(coat) = coat {
            let reflectance = Reflectance {
                shares: [coat.weight, N::ZERO],
                dielectric: [N::Vec3::splat(N::from_f64(COAT)), N::Vec3::ONE],
                exact: None,
                metal: N::Vec3::ZERO,
                conductor: None,
                film: None,
            };
            list.facets(Ggx::isotropic(coat.normal, coat.roughness), reflectance, coat.roughness);
        }
        list.cover.coat = coat;
        if let Some(sheen) = self.sheen.filter(|_| is_over) {
            list.push(Way::Sheen(sheen));
            list.cover.sheen = Some(sheen);
        }
        let reflectance = self.reflectance(self.base.painted() * over);
        self.diffuse(&mut list, &reflectance, over);
        if reflectance.is_some() {
            let facets = self.facets(normal);
            let roughness = N::select(self.is_combed(), facets.roughness(), self.base.roughness);
            list.facets(facets, reflectance, roughness);
        }
        if self.base.glass.is_some() && glassy.any() {
            self.glass(&mut list, through, outside);
        }
    }

    /// What is diffused, back and on, below facets, and what these send to each other.
    fn diffuse(&self, list: &mut LayeredBuilder<'_, N>, facets: &Reflectance<N>, over: N) {
        let (albedo, zero) = (self.base.albedo(), N::Vec3::ZERO);
        let (back, through) = self.diffused.map_or((albedo, zero), |Diffused { share, colour }| {
            (albedo * (N::ONE - share), colour * (self.base.painted() * share))
        });
        let roughness = self.base.roughness;
        // Combed facets are as rough as the rougher way even where the other is smooth.
        let (combed, anisotropic) = (self.is_combed(), self.anisotropic());
        let rough = combed | roughness.above(N::from_f64(LEAST_ROUGHNESS));
        let mut mean = Albedo::mean(roughness);
        if let Some(facets) = &anisotropic {
            mean = Albedo::select(combed, Albedo::anisotropic_mean(facets), mean);
        }
        let (mut sent, mut own) = (zero, N::ZERO);
        let layer = [facets.dielectric[0].max_element() * over, facets.dielectric[1].max_element() * over];
        if self.compensated && rough.any() {
            own = N::select(rough, interreflected_of(layer[0], layer[1], mean.lost), N::ZERO);
            let metal = interreflected::<N>(facets.metal, N::ONE, mean.lost) * facets.shares[1];
            sent = N::Vec3::select(rough, metal + N::Vec3::splat(own * facets.shares[0]), zero);
        }
        if back.max(through).max(sent).max_element().above(N::ZERO).any() {
            let both = through.max_element().above(N::ZERO).any();
            let top = self.top(list, facets, (Remainder::new([layer[0], layer[1], own], roughness), over));
            list.push(Way::Base(Base { back, through, interreflected: sent, both, top }));
        }
    }

    /// The dielectric facets over the base, in the share `over`: metal beside it takes none of the base's light.
    fn top(&self, list: &LayeredBuilder<'_, N>, facets: &Reflectance<N>, (remainder, over): (Remainder<N>, N)) -> Top<N> {
        let alone = Reflectance { shares: [over, N::ZERO], ..*facets };
        let literal = (self.rule == FresnelRule::Model).then(|| {
            let mixed = Reflectance { shares: [N::ONE - self.base.metallic, self.base.metallic], ..*facets };
            [N::ONE, N::ZERO].map(|cosine| mixed.at(cosine).max_element() * over)
        });
        let mut top = Top::new(remainder, literal);
        if let Some(facets) = self.anisotropic() {
            top = top.anisotropic(self.is_combed(), facets);
        }
        let filmed = facets.film.map_or(N::Mask::default(), |film| film.share.above(N::ZERO));
        let curved = if facets.exact.is_some() { !N::Mask::default() } else { filmed };
        top.curved(curved, alone).seen(list.wo, list.normal.dot(list.wo))
    }

    /// The boundary of glass in its share.
    fn glass(&self, list: &mut LayeredBuilder<'_, N>, share: N, outside: N::Mask) {
        let Some(glass) = self.base.glass else { return };
        let reflected = self.specular_colour.min(N::Vec3::ONE) * self.specular;
        let tinted = Tinted { reflected, film: self.film, rule: self.rule, ior: glass.ior };
        let roughness = self.base.roughness;
        let rough = roughness.above(N::from_f64(LEAST_ROUGHNESS));
        let part = |of: N::Mask| N::select(of, share, N::ZERO);
        if self.thin {
            let facets = self.facets(list.normal);
            for (of, facets) in [(rough, Some(facets)), (!rough, None)] {
                if of.any() {
                    list.push(Way::Sheet(Sheet { tinted, share: part(of), transmitted: glass.transmitted, facets }));
                }
            }
            return;
        }
        // Indices that are nearly the same bend next to nothing, however the facets lie.
        let bends = N::of_lanes(|lane| (N::exact_lane(glass.ior, lane) - 1.0).abs()).above(N::from_f64(LEAST_BEND));
        let (rough, eta) = (rough & bends, glass.eta(outside));
        for (of, smooth) in [(rough, false), (!rough, true)] {
            if of.any() {
                let surface = RoughGlass {
                    eta: N::of_lanes(|lane| N::exact_lane(eta, lane)),
                    share: part(of),
                    reflected: N::Vec3::ONE,
                    transmitted: glass.transmitted,
                    roughness,
                };
                list.push(Way::Boundary(Boundary { tinted, eta, rough: surface, smooth, outside }));
            }
        }
    }
}

/// A list of lobes in the making.
struct LayeredBuilder<'a, N: Number> {
    bsdf: &'a mut LayeredBsdf<N>,
    normal: N::Vec3,
    wo: N::Vec3,
    cover: Cover<N>,
}

impl<N: Number> LayeredBuilder<'_, N> {
    fn push(&mut self, way: Way<N>) {
        self.bsdf.add(Layer::new(way, self.cover, self.normal, self.wo));
    }

    /// Facets where they are rough, a mirror where they are not.
    fn facets(&mut self, facets: Ggx<N>, reflectance: Reflectance<N>, roughness: N) {
        let rough = roughness.above(N::from_f64(LEAST_ROUGHNESS));
        if rough.any() {
            self.push(Way::Facets { facets, reflectance: reflectance.masked(rough) });
        }
        if (!rough).any() {
            self.push(Way::Mirror { normal: facets.normal(), reflectance: reflectance.masked(!rough) });
        }
    }
}
