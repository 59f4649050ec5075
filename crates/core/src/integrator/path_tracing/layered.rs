//! Vertices on layered surfaces. Their functions are not inlined, so that surfaces without layers
//! pay for a check alone.

use raywright_bvh::{Hit, Real, Vector};

use super::super::PathSegment;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::material::{
    Glass, HeroWavelength, LayeredBsdf, MetallicRoughness, ReadAt, ShadingFrame, index_at,
};
use crate::prepare::{
    DielectricBoundary, InputStage, LayeredInputs, PhysicalInputs, Prepared, SurfaceDirections,
    Thickness,
};
use crate::sampler::{Purpose, SampleAddress, pair};
use crate::texture::{Bump, InputProduct, PreparedInput, ShadingContext};

impl<R: Real> PathTracer<'_, R> {
    /// Builds the BSDF of a layered surface at a hit in `bsdf`, and returns the surface's
    /// refractive glass; `None` without refraction.
    #[inline(never)]
    pub(super) fn layers_at(
        &self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
        (m, layered): (&PhysicalInputs<R>, &LayeredInputs<R>),
        bsdf: &mut LayeredBsdf<R>,
    ) -> Option<Glass<R>> {
        let context = self.scene.texture_tables.shading_context(interaction);
        let (mut base, mut boundary) = (m.model_at(&context), m.boundary_at(&context));
        let mut ior = boundary.ior;
        if self.nests() && !m.thin {
            boundary = DielectricBoundary::new(self.relative_index(path, interaction, &context));
            ior = boundary.ior;
        } else if base.glass.is_some() && layered.ior > 0.0 {
            ior = index_at(ior, layered.ior, wavelength::<R>(path));
        }
        if let Some(glass) = &mut base.glass {
            glass.ior = ior;
        }
        let two_sided = base.glass.is_some() || layered.diffused.is_some();
        let normal = if two_sided {
            interaction.facing_normal()
        } else {
            interaction.normal
        };
        let base = MetallicRoughness {
            dielectric: boundary.f0,
            ..base
        };
        let bumpy = m.bump.is_some();
        let model = layered.at(
            &PointReader {
                scene: self.scene,
                segment: &path.segment,
                hit,
                interaction,
                context,
                normal,
                bumpy,
            },
            base,
            ior,
        );
        bsdf.renew(normal);
        model.add_to(bsdf, -interaction.direction, interaction.outside);
        model.base.glass.filter(|_| !m.thin)
    }
}

/// Evaluates the material inputs of layers at a hit.
struct PointReader<'a, R: Real> {
    scene: &'a Prepared<R>,
    segment: &'a PathSegment<R>,
    hit: &'a Hit<R>,
    interaction: &'a Interaction<R>,
    context: ShadingContext<'a, R>,
    /// The normal of the lobes.
    normal: R::Vec3,
    /// Whether the surface has a normal map.
    bumpy: bool,
}

impl<R: Real> ReadAt<InputStage<R>, R> for PointReader<'_, R> {
    fn share(&self, input: &InputProduct<R>) -> R {
        Real::clamp(input.number(&self.context).max(R::ZERO), R::ZERO, R::ONE)
    }

    fn tint(&self, input: &InputProduct<R>) -> R::Vec3 {
        self.colour(input).min(Vector::ONE)
    }

    fn colour(&self, input: &InputProduct<R>) -> R::Vec3 {
        input.tint(&self.context, Vector::ONE).max(Vector::ZERO)
    }

    fn thickness(&self, input: &Thickness<R>) -> R {
        let thickest = input.thickest.number(&self.context).max(R::ZERO);
        let between = |image: &PreparedInput<R>| {
            input.thinnest + (thickest - input.thinnest) * image.number(&self.context)
        };
        input.image.as_ref().map_or(thickest, between)
    }

    fn constant(&self, input: &f64) -> f64 {
        *input
    }

    fn spectrum(&self, input: &R::Vec3) -> R::Vec3 {
        *input
    }

    /// The shading normal without the base's normal map, perturbed by the layer's own normal map if
    /// it has one.
    fn normal(&self, input: &Option<Bump<R>>) -> R::Vec3 {
        let (interaction, normal) = (self.interaction, self.normal);
        let own = if self.bumpy || input.is_some() {
            let smooth = Interaction::smooth(self.scene, self.segment, self.hit);
            input.as_ref().map_or(smooth.normal, |bump| {
                smooth
                    .normal_map(bump, self.scene, self.segment, self.hit)
                    .perturbed_normal()
            })
        } else {
            interaction.normal
        };
        // On the same side as the normal of the lobes.
        if normal == interaction.normal {
            own
        } else {
            -own
        }
    }

    fn frame(&self, input: &SurfaceDirections<R>) -> ShadingFrame<R> {
        let frame = self.interaction.frame(self.scene, self.segment, self.hit);
        let [cos, sin] = input.turn;
        let (x, y) = input.image.as_ref().map_or((R::ONE, R::ZERO), |image| {
            let code = image.colour(&self.context);
            (code.x() + code.x() - R::ONE, code.y() + code.y() - R::ONE)
        });
        let along = frame.tangent * (x * cos - y * sin) + frame.bitangent * (x * sin + y * cos);
        ShadingFrame::from_tangent(self.normal, along, false)
    }
}

/// Returns the path's wavelength in nanometres. A white path samples its wavelength here, and its
/// throughput is tinted by the wavelength's weight.
pub(super) fn wavelength<R: Real>(path: &mut PathState<R>) -> f64 {
    *path.wavelength.get_or_insert_with(|| {
        let [u, _] = pair(
            SampleAddress {
                bounce: 0,
                ..path.address
            },
            Purpose::Wavelength,
        );
        let hero = HeroWavelength::drawn(f64::from(u));
        path.throughput *= R::Vec3::from_f64(hero.weight.into());
        hero.nanometres
    })
}
