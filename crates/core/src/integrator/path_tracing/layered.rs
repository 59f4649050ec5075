//! Vertices on layered surfaces. Not inlined, so that surfaces without layers only pay for a check.

use raywright_bvh::{Hit, Real, Vector};

use super::super::PathSegment;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::material::{Frame, Glass, Hero, LayeredBsdf, MetallicRoughness, ReadAt, index_at};
use crate::prepare::{
    Boundary, Directions, InputStage, LayeredInputs, PhysicalInputs, Prepared, Thickness,
};
use crate::sampler::{Address, Purpose, pair};
use crate::texture::{Bump, Input, Product, ShadingContext};

impl<R: Real> PathTracer<'_, R> {
    /// Builds the lobes of a layered surface at a hit, and returns its refractive glass, if any.
    #[inline(never)]
    pub(super) fn layers_at(
        &self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        (m, layered): (&PhysicalInputs<R>, &LayeredInputs<R>),
        bsdf: &mut LayeredBsdf<R>,
    ) -> Option<Glass<R>> {
        let here = self.scene.sources.at(at);
        let (mut base, mut boundary) = (m.model_at(&here), m.boundary_at(&here));
        let mut ior = boundary.ior;
        if self.nests() && !m.thin {
            boundary = Boundary::new(self.relative_index(path, at, &here));
            ior = boundary.ior;
        } else if base.glass.is_some() && layered.ior > 0.0 {
            ior = index_at(ior, layered.ior, wavelength::<R>(path));
        }
        if let Some(glass) = &mut base.glass {
            glass.ior = ior;
        }
        let two_sided = base.glass.is_some() || layered.diffused.is_some();
        let normal = if two_sided {
            at.facing_normal()
        } else {
            at.normal
        };
        let base = MetallicRoughness {
            dielectric: boundary.f0,
            ..base
        };
        let bumpy = m.bump.is_some();
        let model = layered.at(
            &PointReader {
                scene: self.scene,
                leg: &path.leg,
                hit,
                at,
                here,
                normal,
                bumpy,
            },
            base,
            ior,
        );
        bsdf.renew(normal);
        model.add_to(bsdf, -at.direction, at.outside);
        model.base.glass.filter(|_| !m.thin)
    }
}

/// Evaluates the inputs of layers at a hit.
struct PointReader<'a, R: Real> {
    scene: &'a Prepared<R>,
    leg: &'a PathSegment<R>,
    hit: &'a Hit<R>,
    at: &'a Interaction<R>,
    here: ShadingContext<'a, R>,
    /// The normal of the lobes.
    normal: R::Vec3,
    /// Whether the surface has a normal map.
    bumpy: bool,
}

impl<R: Real> ReadAt<InputStage<R>, R> for PointReader<'_, R> {
    fn share(&self, input: &Product<R>) -> R {
        Real::clamp(input.number(&self.here).max(R::ZERO), R::ZERO, R::ONE)
    }

    fn tint(&self, input: &Product<R>) -> R::Vec3 {
        self.colour(input).min(Vector::ONE)
    }

    fn colour(&self, input: &Product<R>) -> R::Vec3 {
        input.tint(&self.here, Vector::ONE).max(Vector::ZERO)
    }

    fn thickness(&self, input: &Thickness<R>) -> R {
        let thickest = input.thickest.number(&self.here).max(R::ZERO);
        let between = |image: &Input<R>| {
            input.thinnest + (thickest - input.thinnest) * image.number(&self.here)
        };
        input.image.as_ref().map_or(thickest, between)
    }

    fn constant(&self, input: &f64) -> f64 {
        *input
    }

    fn spectrum(&self, input: &R::Vec3) -> R::Vec3 {
        *input
    }

    /// The unperturbed shading normal, or perturbed by the layer's own normal map.
    fn normal(&self, input: &Option<Bump<R>>) -> R::Vec3 {
        let (at, normal) = (self.at, self.normal);
        let own = if self.bumpy || input.is_some() {
            let smooth = Interaction::smooth(self.scene, self.leg, self.hit);
            input.as_ref().map_or(smooth.normal, |bump| {
                smooth
                    .normal_map(bump, self.scene, self.leg, self.hit)
                    .perturbed_normal()
            })
        } else {
            at.normal
        };
        // On the side of the surface's normal.
        if normal == at.normal { own } else { -own }
    }

    fn frame(&self, input: &Directions<R>) -> Frame<R> {
        let frame = self.at.frame(self.scene, self.leg, self.hit);
        let [cos, sin] = input.turn;
        let (x, y) = input.image.as_ref().map_or((R::ONE, R::ZERO), |image| {
            let code = image.colour(&self.here);
            (code.x() + code.x() - R::ONE, code.y() + code.y() - R::ONE)
        });
        let along = frame.tangent * (x * cos - y * sin) + frame.bitangent * (x * sin + y * cos);
        Frame::along(self.normal, along, false)
    }
}

/// The path's wavelength; a white path samples one here.
pub(super) fn wavelength<R: Real>(path: &mut PathState<R>) -> f64 {
    *path.wavelength.get_or_insert_with(|| {
        let [u, _] = pair(
            Address {
                bounce: 0,
                ..path.address
            },
            Purpose::Wavelength,
        );
        let hero = Hero::drawn(f64::from(u));
        path.throughput *= R::Vec3::from_f64(hero.weight.into());
        hero.nanometres
    })
}
