//! Named kernels: which parts of the integrator are compiled in. Few, never 2^N, and each bit-identical to the general one.

/// What a kernel's scenes may contain. A constant that is false removes code; it never changes a number.
pub(crate) trait Kernel: Copy + Default + Send + Sync + 'static {
    /// Name in reports.
    const NAME: &'static str;
    /// Meshes with normals and texture coordinates.
    const MESHES: bool;
    /// Physical materials.
    const PHYSICAL: bool;
}

/// Everything.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct General;

/// Shapes with classic materials: the documented scenes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Analytic;

impl Kernel for General {
    const NAME: &'static str = "general";
    const MESHES: bool = true;
    const PHYSICAL: bool = true;
}

impl Kernel for Analytic {
    const NAME: &'static str = "analytic";
    const MESHES: bool = false;
    const PHYSICAL: bool = false;
}
