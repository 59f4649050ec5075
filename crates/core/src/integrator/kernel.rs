//! Named kernels: which parts of the integrator are compiled in. Few, never 2^N, and each bit-identical to the general one.

use crate::effects::{Effect, EffectSet};

/// What a kernel's scenes may contain. What is not in it is removed from the code; it never changes a number.
pub(crate) trait Kernel: Copy + Default + Send + Sync + 'static {
    /// Name in reports of Whitted ray tracing.
    const NAME: &'static str;
    /// The effects that it can simulate.
    const CONTAINS: EffectSet;
    /// Meshes with normals and texture coordinates.
    const MESHES: bool = Self::CONTAINS.has(Effect::TriangleMeshes);
    /// Physical materials.
    const PHYSICAL: bool = Self::CONTAINS.has(Effect::PhysicalMaterials);
}

/// Everything.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct General;

/// Shapes with classic materials: the documented scenes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Analytic;

impl Kernel for General {
    const NAME: &'static str = "general";
    const CONTAINS: EffectSet = EffectSet::ALL;
}

impl Kernel for Analytic {
    const NAME: &'static str = "analytic";
    const CONTAINS: EffectSet = EffectSet::ALL.without(EffectSet::of(&[Effect::TriangleMeshes, Effect::PhysicalMaterials]));
}
