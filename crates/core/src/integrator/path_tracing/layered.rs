//! BSDFs of vertices on layered surfaces. The functions are not inlined: surfaces without layers
//! cost a check alone.

use raywright_bvh::{Hit, Real, Vector};

use super::super::PathSegment;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::material::{
    Glass, HeroWavelength, LayerFieldEvaluator, LayeredBsdf, MetallicRoughness, ShadingFrame,
    ior_at_wavelength,
};
use crate::prepare::{
    AnisotropyFrame, ConstantIor, FilmThickness, InputFieldTypes, LayeredInputs, PhysicalInputs,
    PreparedMaterial, PreparedScene,
};
use crate::sampler::{SampleAddress, SamplePurpose, sample_2d};
use crate::texture::{InputProduct, NormalMapInput, PreparedInput, ShadingContext};

impl<R: Real> PathTracer<'_, R> {
    /// Builds the BSDF of a layered surface at a hit in `bsdf`. Returns the glass if the surface
    /// refracts; `None` for opaque surfaces and thin walls.
    #[inline(never)]
    pub(super) fn build_layered_bsdf(
        &self,
        path: &mut PathState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
        (m, layered): (&PhysicalInputs<R>, &LayeredInputs<R>),
        bsdf: &mut LayeredBsdf<R>,
    ) -> Option<Glass<R>> {
        let context = self.scene.texture_tables.shading_context(interaction);
        let (mut base, mut boundary) = (
            m.metallic_roughness_at(&context),
            m.dielectric_boundary_at(&context),
        );
        let mut ior = boundary.ior;
        if self.has_nested_dielectrics() && !m.thin {
            boundary = ConstantIor::new(self.relative_ior(path, interaction, &context));
            ior = boundary.ior;
        } else if base.glass.is_some() && layered.ior > 0.0 {
            ior = ior_at_wavelength(ior, layered.ior, get_or_sample_wavelength::<R>(path));
        }
        if let Some(glass) = &mut base.glass {
            glass.ior = ior;
        }
        let two_sided = base.glass.is_some() || layered.diffuse_transmission.is_some();
        let normal = if two_sided {
            interaction.facing_normal()
        } else {
            interaction.normal
        };
        let base = MetallicRoughness {
            dielectric: boundary.f0,
            ..base
        };
        let reader = self.layer_reader(&path.segment, hit, (m, interaction), normal);
        let model = layered.eval_at(&reader, base, ior);
        bsdf.reset(normal);
        model.add_lobes_to(bsdf, -interaction.direction, interaction.outside);
        model.base.glass.filter(|_| !m.thin)
    }

    /// Returns the reader of a surface's layers at a hit. `normal` is that of the base's lobes.
    fn layer_reader<'b>(
        &'b self,
        segment: &'b PathSegment<R>,
        hit: &'b Hit<R>,
        (m, interaction): (&PhysicalInputs<R>, &'b Interaction<R>),
        normal: R::Vec3,
    ) -> LayerInputReader<'b, R> {
        LayerInputReader {
            scene: self.scene,
            segment,
            hit,
            interaction,
            context: self.scene.texture_tables.shading_context(interaction),
            normal,
            bumpy: m.normal_map.is_some(),
        }
    }

    /// Returns the radiance that a surface emits along the path: of its emission, the coat above
    /// takes the share that it reflects. Sheen takes nothing, as in KHR_materials_sheen.
    pub(super) fn emission_at_hit(
        &self,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
    ) -> R::Vec3 {
        let scene = self.scene;
        let material = &scene.materials[interaction.material as usize];
        let emission = material.emission_at(&scene.texture_tables.shading_context(interaction));
        // For a ray inside a body, the coat lies beyond the boundary.
        if let PreparedMaterial::Physical(m) = material
            && let Some(index) = m.layers
            && let Some(coat) = &scene.layers[index as usize].coat
            && (interaction.outside || m.thin || m.transmission.is_none())
        {
            let reader = self.layer_reader(segment, hit, (m, interaction), interaction.normal);
            let rule = scene.layers[index as usize].rule;
            return emission
                * coat
                    .at(&reader)
                    .emission_transmittance(interaction.direction, rule);
        }
        emission
    }
}

/// Reads the material inputs of layers at a hit.
struct LayerInputReader<'a, R: Real> {
    scene: &'a PreparedScene<R>,
    segment: &'a PathSegment<R>,
    hit: &'a Hit<R>,
    interaction: &'a Interaction<R>,
    context: ShadingContext<'a, R>,
    /// Normal of the base's lobes.
    normal: R::Vec3,
    /// Whether the base has a normal map.
    bumpy: bool,
}

impl<R: Real> LayerFieldEvaluator<InputFieldTypes<R>, R> for LayerInputReader<'_, R> {
    fn eval_unit_number(&self, input: &InputProduct<R>) -> R {
        Real::clamp(
            input.eval_number(&self.context).max(R::ZERO),
            R::ZERO,
            R::ONE,
        )
    }

    fn eval_tint(&self, input: &InputProduct<R>) -> R::Vec3 {
        self.eval_colour(input).min(Vector::ONE)
    }

    fn eval_colour(&self, input: &InputProduct<R>) -> R::Vec3 {
        input
            .multiply_colour(&self.context, Vector::ONE)
            .max(Vector::ZERO)
    }

    fn eval_thickness(&self, input: &FilmThickness<R>) -> R {
        let thickest = input.thickest.eval_number(&self.context).max(R::ZERO);
        let between = |image: &PreparedInput<R>| {
            input.thinnest + (thickest - input.thinnest) * image.eval_number(&self.context)
        };
        input.image.as_ref().map_or(thickest, between)
    }

    fn eval_constant(&self, input: &f64) -> f64 {
        *input
    }

    fn eval_spectrum(&self, input: &R::Vec3) -> R::Vec3 {
        *input
    }

    /// Returns the normal of a layer. The layer's own normal map, if any, replaces the normal map
    /// of the base.
    fn eval_normal(&self, input: &Option<NormalMapInput<R>>) -> R::Vec3 {
        let (interaction, normal) = (self.interaction, self.normal);
        let own = if self.bumpy || input.is_some() {
            let smooth =
                Interaction::from_hit_without_normal_map(self.scene, self.segment, self.hit);
            input.as_ref().map_or(smooth.normal, |bump| {
                smooth
                    .eval_normal_map(bump, self.scene, self.segment, self.hit)
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

    fn eval_frame(&self, input: &AnisotropyFrame<R>) -> ShadingFrame<R> {
        let frame = self
            .interaction
            .shading_frame(self.scene, self.segment, self.hit);
        let [cos, sin] = input.rotation;
        let (x, y) = input.image.as_ref().map_or((R::ONE, R::ZERO), |image| {
            let code = image.eval_colour(&self.context);
            (code.x() + code.x() - R::ONE, code.y() + code.y() - R::ONE)
        });
        let along = frame.tangent * (x * cos - y * sin) + frame.bitangent * (x * sin + y * cos);
        ShadingFrame::from_tangent(self.normal, along, false)
    }
}

/// Returns the path's wavelength in nanometres. A path that still carries all wavelengths samples
/// one here; its throughput is multiplied by the weight of that wavelength.
pub(super) fn get_or_sample_wavelength<R: Real>(path: &mut PathState<R>) -> f64 {
    *path.wavelength.get_or_insert_with(|| {
        let [u, _] = sample_2d(
            SampleAddress {
                bounce: 0,
                ..path.address
            },
            SamplePurpose::Wavelength,
        );
        let hero = HeroWavelength::sample(f64::from(u));
        path.throughput *= R::Vec3::from_f64(hero.weight.into());
        hero.nanometres
    })
}
