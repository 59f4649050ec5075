//! Vertices on layered surfaces. Out of line, with all that only they ask: surfaces without layers have one question more.

use raywright_bvh::{Hit, Real, Vector};

use super::super::General;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::material::{
    Coat, Combed, Diffused, Film, Frame, Glass, Hero, Layered as Layers, LayeredBsdf, MetallicRoughness, Sheen, index_at,
};
use crate::prepare::{Boundary, Here, Input, Layered, Physical};
use crate::sampler::{Address, Purpose, pair};

impl<R: Real> PathTracer<'_, R> {
    /// Sends a path on from a layered surface; whether it goes on.
    #[inline(never)]
    pub(super) fn layered(
        &mut self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        (m, layered): (&Physical<R>, &Layered<R>),
    ) -> bool {
        let mut bsdf = LayeredBsdf::of_kind(Vector::ZERO);
        let bent = self.layers_at(path, hit, at, (m, layered), &mut bsdf);
        self.shade(path, hit, at, &bsdf, (bent.as_ref(), R::ONE))
    }

    /// Makes the lobes of a layered surface where a path meets it, and returns the boundary that bends it.
    pub(super) fn layers_at(
        &self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        (m, layered): (&Physical<R>, &Layered<R>),
        bsdf: &mut LayeredBsdf<R>,
    ) -> Option<Glass<R>> {
        let here = self.scene.sources.at(at);
        let (mut base, mut boundary) = (m.model_at(&here), m.boundary_at(&here));
        let mut ior = boundary.ior;
        if self.nests() && !m.thin {
            boundary = Boundary::new(self.relative_index(path, at, &here));
            ior = boundary.ior;
        } else if base.glass.is_some() && layered.dispersion > 0.0 {
            ior = index_at(ior, layered.dispersion, wavelength::<R>(path));
        }
        if let Some(glass) = &mut base.glass {
            glass.ior = ior;
        }
        let two_sided = base.glass.is_some() || layered.diffused.is_some();
        let normal = if two_sided { at.towards() } else { at.normal };
        let unit = |x: R| Real::clamp(x.max(R::ZERO), R::ZERO, R::ONE);
        let tint = |c: R::Vec3| c.max(Vector::ZERO).min(Vector::ONE);
        let one = R::Vec3::ONE;
        let film = layered.film.as_ref().map(|film| {
            let thickest = film.thickness.number(&here).max(R::ZERO);
            let between = |image: &Input<R>| film.thinnest + (thickest - film.thinnest) * image.number(&here);
            let thickness = film.image.as_ref().map_or(thickest, between);
            Film { share: unit(film.factor.number(&here)), ior: film.ior, thickness }
        });
        let model = Layers {
            specular: unit(layered.specular.number(&here)),
            specular_colour: layered.specular_colour.tint(&here, one).max(Vector::ZERO),
            conductor: layered.conductor,
            thin: m.thin,
            diffused: layered
                .diffused
                .as_ref()
                .map(|[share, colour]| Diffused { share: unit(share.number(&here)), colour: tint(colour.tint(&here, one)) }),
            combed: self.combed(path, hit, at, (layered, &here, normal)),
            film,
            sheen: layered.sheen.as_ref().map(|[colour, roughness]| Sheen {
                colour: tint(colour.tint(&here, one)),
                roughness: unit(roughness.number(&here)),
            }),
            coat: self.coat(path, hit, at, (layered, &here, normal), m.bump.is_some()),
            rule: layered.rule,
            compensated: self.scene.compensates,
            ..Layers::of(MetallicRoughness { dielectric: boundary.f0, ..base }, ior)
        };
        bsdf.renew(normal);
        model.add_to(bsdf, -at.direction, at.outside);
        model.base.glass.filter(|_| !m.thin)
    }

    /// The frame along which facets are combed.
    fn combed(
        &self,
        path: &PathState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        (layered, here, normal): (&Layered<R>, &Here<'_, R>, R::Vec3),
    ) -> Option<Combed<R>> {
        let combed = layered.combed.as_ref()?;
        let frame = at.frame(self.scene, &path.leg, hit);
        let [cos, sin] = combed.turn;
        let (x, y) = match &combed.image {
            None => (R::ONE, R::ZERO),
            Some(image) => {
                let code = image.colour(here);
                let one = R::ONE;
                (code.x() + code.x() - one, code.y() + code.y() - one)
            }
        };
        let along = frame.tangent * (x * cos - y * sin) + frame.bitangent * (x * sin + y * cos);
        let strength = Real::clamp(combed.strength.number(here).max(R::ZERO), R::ZERO, R::ONE);
        Some(Combed { strength, frame: Frame::along(normal, along, false) })
    }

    /// The coat at a point, whose normal is the surface's own before anything bends it, bent by the coat's image. `bumpy`: whether an
    /// image bends the surface's.
    fn coat(
        &self,
        path: &PathState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        (layered, here, normal): (&Layered<R>, &Here<'_, R>, R::Vec3),
        bumpy: bool,
    ) -> Option<Coat<R>> {
        let coat = layered.coat.as_ref()?;
        let unit = |x: R| Real::clamp(x.max(R::ZERO), R::ZERO, R::ONE);
        let weight = unit(coat.factor.number(here));
        let own = if bumpy || coat.bump.is_some() {
            let smooth = Interaction::smooth::<General>(self.scene, &path.leg, hit);
            let bent = coat.bump.as_ref().map(|bump| smooth.bent(bump, self.scene, &path.leg, hit));
            Interaction { normal: bent.unwrap_or(smooth.normal), ..smooth }
        } else {
            *at
        };
        // On the side of the surface's normal.
        let own = if normal == at.normal { own.normal } else { -own.normal };
        Some(Coat { weight, roughness: unit(coat.roughness.number(here)), normal: own })
    }
}

/// The path's one wavelength; white ones become one here.
pub(super) fn wavelength<R: Real>(path: &mut PathState<R>) -> f64 {
    *path.wavelength.get_or_insert_with(|| {
        let [u, _] = pair(Address { bounce: 0, ..path.address }, Purpose::Wavelength);
        let hero = Hero::drawn(f64::from(u));
        path.throughput *= R::Vec3::from_f64(hero.weight.into());
        hero.nanometres
    })
}
