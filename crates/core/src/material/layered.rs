//! Layered surfaces: the metallic-roughness model with what glTF's extensions lay over it, under it and into it.

use super::bsdf::Bsdf;
use super::energy::given_back;
use super::facets::Facets;
use super::film::Film;
use super::frame::Frame;
use super::fresnel::{FresnelRule, conductor};
use super::glass_layer::{Boundary, Sheet, Tinted};
use super::layer::{COAT, Coat, Cover, Layer, Way};
use super::lobe::LEAST_ROUGHNESS;
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
            rule: FresnelRule::Model,
            compensated: true,
        }
    }

    /// What its facets reflect, of which a share `dielectric` is not metal and no glass.
    fn reflectance(&self, dielectric: N) -> Reflectance<N> {
        let metallic = self.base.metallic;
        let normal = (self.specular_colour * self.base.dielectric).min(N::Vec3::ONE) * self.specular;
        let colour = self.conductor.map_or(self.base.base, |[n, k]| {
            N::Vec3::of_lanes(|lane| {
                let (n, k) = (n.lane(lane), k.lane(lane));
                glam::DVec3::new(conductor(1.0, [n.x, k.x]), conductor(1.0, [n.y, k.y]), conductor(1.0, [n.z, k.z]))
            })
        });
        Reflectance {
            dielectric: [normal * dielectric, N::Vec3::splat(self.specular * dielectric)],
            exact: (self.rule == FresnelRule::Exact).then_some(self.ior),
            metal: [colour * metallic, N::Vec3::splat(metallic)],
            conductor: self.conductor.filter(|_| self.rule != FresnelRule::Schlick).map(|index| (index, metallic)),
            film: self.film,
        }
    }

    /// Its lobes, seen along `wo`.
    pub fn transport(&self, normal: N::Vec3, wo: N::Vec3, outside: N::Mask) -> LayeredBsdf<N> {
        let mut bsdf = LayeredBsdf::of_kind(normal);
        self.add_to(&mut bsdf, wo, outside);
        bsdf
    }

    /// Adds its lobes, seen along `wo`, to a list of none: where it stays, since it is too large to be handed on.
    pub fn add_to(&self, bsdf: &mut LayeredBsdf<N>, wo: N::Vec3, outside: N::Mask) {
        let (through, normal) = (self.base.through(), bsdf.normal());
        let glassy = through.above(N::ZERO);
        let mut list = Builder { bsdf, normal, wo, cover: Cover::NONE };
        // From within a body, what lies over it is beyond the boundary.
        let over = outside.any() || self.base.glass.is_none() || self.thin;
        let coat = self.coat.filter(|_| over);
        if let Some(coat) = coat {
            let reflectance = Reflectance {
                dielectric: [N::Vec3::splat(coat.weight * N::from_f64(COAT)), N::Vec3::splat(coat.weight)],
                exact: None,
                metal: [N::Vec3::ZERO; 2],
                conductor: None,
                film: None,
            };
            list.facets(Facets::even(coat.normal, coat.roughness), reflectance, coat.roughness, N::Vec3::ONE);
        }
        list.cover.coat = coat;
        if let Some(sheen) = self.sheen.filter(|_| over) {
            list.push(Way::Sheen(sheen));
            list.cover.sheen = Some(sheen);
        }
        self.diffuse(&mut list);
        let reflectance = self.reflectance(N::select(glassy, N::ZERO, N::ONE - self.base.metallic));
        if reflectance.is_some() {
            let facets = match &self.combed {
                Some(combed) => Facets::combed(combed.frame, self.base.roughness, combed.strength),
                None => Facets::even(normal, self.base.roughness),
            };
            // Combed facets are as rough as the rougher way even where the other is smooth.
            let combed = self.combed.map_or(N::ZERO, |combed| combed.strength);
            let roughness = N::select(combed.above(N::ZERO), facets.roughness(), self.base.roughness);
            // What combed facets lose depends on the view's azimuth too, which the table does not know: seen along the fine way they lose
            // less than even ones as fine. So they are given nothing back, and white ones are darker than they should be.
            let even = N::select(combed.above(N::ZERO), N::ZERO, N::ONE);
            let back = |f0: N::Vec3| N::Vec3::ONE + (given_back(f0, self.base.roughness, normal.dot(wo)) - N::Vec3::ONE) * even;
            let gain = if self.compensated { back(reflectance.bare()) } else { N::Vec3::ONE };
            list.facets(facets, reflectance, roughness, gain);
        }
        if self.base.glass.is_some() && glassy.any() {
            self.glass(&mut list, through, outside);
        }
    }

    /// What is diffused, back and on.
    fn diffuse(&self, list: &mut Builder<'_, N>) {
        let whole = self.reflectance(N::ONE - self.base.metallic).at(N::ONE);
        let albedo = self.base.albedo();
        let (back, through) = match self.diffused {
            None => (albedo, N::Vec3::ZERO),
            Some(Diffused { share, colour }) => {
                let left = (N::ONE - self.base.metallic) * (N::ONE - self.passed());
                (albedo * (N::ONE - share), colour * (left * share))
            }
        };
        if back.max(through).max_element().above(N::ZERO).any() {
            let both = through.max_element().above(N::ZERO).any();
            let f90 = N::ONE - (N::ONE - self.specular) * (N::ONE - self.base.metallic);
            list.push(Way::Diffuse { back, through, f0: whole, f90, both });
        }
    }

    /// Share of the dielectric part's light that goes through glass.
    fn passed(&self) -> N {
        let tint = self.base.glass.map_or(N::ZERO, |glass| glass.transmitted.max_element().min(N::ONE));
        self.base.through() * tint
    }

    /// The boundary of glass in its share.
    fn glass(&self, list: &mut Builder<'_, N>, share: N, outside: N::Mask) {
        let Some(glass) = self.base.glass else { return };
        let reflected = self.specular_colour.min(N::Vec3::ONE) * self.specular;
        let tinted = Tinted { reflected, film: self.film, rule: self.rule, ior: glass.ior };
        let roughness = self.base.roughness;
        let rough = roughness.above(N::from_f64(LEAST_ROUGHNESS));
        let part = |of: N::Mask| N::select(of, share, N::ZERO);
        if self.thin {
            let facets = match &self.combed {
                Some(combed) => Facets::combed(combed.frame, roughness, combed.strength),
                None => Facets::even(list.normal, roughness),
            };
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
struct Builder<'a, N: Number> {
    bsdf: &'a mut LayeredBsdf<N>,
    normal: N::Vec3,
    wo: N::Vec3,
    cover: Cover<N>,
}

impl<N: Number> Builder<'_, N> {
    fn push(&mut self, way: Way<N>) {
        self.bsdf.add(Layer::new(way, self.cover, self.normal, self.wo));
    }

    /// Facets where they are rough, a mirror where they are not.
    fn facets(&mut self, facets: Facets<N>, reflectance: Reflectance<N>, roughness: N, gain: N::Vec3) {
        let rough = roughness.above(N::from_f64(LEAST_ROUGHNESS));
        let of = |mask: N::Mask| Reflectance {
            dielectric: reflectance.dielectric.map(|f| N::Vec3::select(mask, f, N::Vec3::ZERO)),
            metal: reflectance.metal.map(|f| N::Vec3::select(mask, f, N::Vec3::ZERO)),
            conductor: reflectance.conductor.map(|(index, share)| (index, N::select(mask, share, N::ZERO))),
            film: reflectance.film.map(|film| Film { share: N::select(mask, film.share, N::ZERO), ..film }),
            ..reflectance
        };
        if rough.any() {
            self.push(Way::Facets { facets, reflectance: of(rough), gain });
        }
        if (!rough).any() {
            self.push(Way::Mirror { normal: facets.normal(), reflectance: of(!rough) });
        }
    }
}
