//! The effects that the program knows, as a closed set: reports, preparation and kernels all mean the same thing by a name.

use serde::{Serialize, Serializer};

use crate::scene::Physical;

macro_rules! effects {
    ($($(#[doc = $doc:literal])* $variant:ident = $name:literal,)*) => {
        /// One thing that a scene may call for.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Effect {
            $($(#[doc = $doc])* $variant,)*
        }

        impl Effect {
            /// Every effect, in the order of reports.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// Name in reports and on the command line.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

effects! {
    /// A constant light that reaches every surface.
    AmbientLight = "ambient light",
    /// Lights shine on surfaces that answer to them.
    DirectLight = "direct light",
    /// Something stands between a light and a surface.
    Shadows = "shadows",
    /// Lights are seen in glossy surfaces.
    Highlights = "highlights",
    /// Light at grazing angles.
    RimLight = "rim light",
    /// Surfaces that give off light are seen to.
    Emission = "emission",
    /// Surfaces that show their colour as it is.
    UnlitSurfaces = "unlit surfaces",
    /// Smooth surfaces reflect.
    MirrorReflection = "mirror reflection",
    /// A reflection that a fixed pattern disturbs.
    FuzzyReflection = "fuzzy reflection",
    /// Light passes through a surface and bends.
    Refraction = "refraction",
    /// Materials with an alpha.
    Transparency = "transparency",
    /// Surfaces that follow the metallic-roughness model.
    PhysicalMaterials = "physical materials",
    /// Materials read images.
    ImageTextures = "image textures",
    /// Images are read in smaller sizes where a pixel covers many texels.
    MipMaps = "mip maps",
    /// Expressions that are evaluated per hit.
    ProceduralTextures = "procedural textures",
    /// Two colours in turns.
    Checkerboard = "checkerboard",
    /// Meshes carry colours.
    VertexColours = "vertex colours",
    /// Meshes carry normals.
    SmoothShading = "smooth shading",
    /// Images bend the normals of surfaces.
    NormalMaps = "normal maps",
    /// Meshes of triangles.
    TriangleMeshes = "triangle meshes",
    /// A mesh that is shown more than once, and stored once.
    Instances = "instances",
    /// Shapes without bounds, kept beside the tree.
    UnboundedShapes = "unbounded shapes",
    /// What rays see that hit nothing.
    Sky = "sky",
    /// A sky that is a picture.
    EnvironmentMap = "environment map",
    /// A ground that nothing but shadows shows.
    GroundShadow = "ground shadow",
    /// Physical materials receive the sky's cosine-weighted average.
    SkyLight = "sky light",
    /// A camera with an aperture.
    DepthOfField = "depth of field",
    /// Something moves, or the camera does, while the shutter is open.
    Motion = "motion",
    /// Emissive surfaces light others.
    SoftShadows = "soft shadows",
    /// Surfaces whose emission varies light others.
    TexturedEmitters = "textured emitters",
    /// Surfaces light each other.
    IndirectLight = "indirect light",
    /// Rough surfaces blur what they reflect.
    GlossyReflection = "glossy reflection",
    /// Rough surfaces blur what they transmit.
    RoughRefraction = "rough refraction",
    /// Surfaces that send each ray one of several ways by chance.
    MixedScattering = "mixed scattering",
    /// What light passes through takes some of it.
    Absorption = "absorption",
    /// Where bodies overlap, light is in the one of the greatest priority.
    NestedMedia = "nested media",
    /// Walls too thin to bend the light that they let through.
    ThinWalls = "thin walls",
    /// A dielectric reflects more, less or another colour than its index says.
    TintedReflection = "tinted reflection",
    /// Metals by their complex index.
    Conductors = "conductors",
    /// A clear coat over a surface.
    Clearcoat = "clearcoat",
    /// Fibres that catch light at grazing angles.
    Sheen = "sheen",
    /// Facets that are rougher one way.
    Anisotropy = "anisotropy",
    /// Films as thin as light's waves.
    Iridescence = "iridescence",
    /// Short waves bend more than long ones.
    Dispersion = "dispersion",
    /// Light is diffused to the other side of a surface.
    DiffuseTransmission = "diffuse transmission",
    /// What a model's file says of its materials beyond what scenes have.
    MaterialExtensions = "material extensions",
    /// Light reaches matte surfaces over mirrors or through glass.
    Caustics = "caustics",
}

impl Effect {
    /// The effect of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|effect| effect.name() == name)
    }
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// An effect of what lies over, under and in the metallic-roughness model.
pub(super) struct LayerEffect {
    pub effect: Effect,
    /// The key that calls for it.
    pub key: &'static str,
    /// Whether a material has it, of which some may be no metal, and some of that clear.
    pub has: fn(&Physical, [bool; 2]) -> bool,
    /// Why it is simulated, and why it is absent.
    pub present: &'static str,
    pub absent: &'static str,
    /// Why Whitted ray tracing simulates it; none: that leaves it out.
    pub whitted: Option<&'static str>,
}

/// Makes the table of rows `key: Effect, WHETHER A MATERIAL HAS IT, PRESENT, ABSENT, WHITTED`.
macro_rules! layer_effects {
    ($($key:ident: $effect:ident, $has:expr, $present:literal, $absent:literal, $whitted:expr;)*) => {
        /// All of them, in the order of [`Effect::ALL`].
        pub(super) const LAYER_EFFECTS: &[LayerEffect] = &[$(LayerEffect {
            effect: Effect::$effect,
            key: stringify!($key),
            has: $has,
            present: $present,
            absent: $absent,
            whitted: $whitted,
        }),*];
    };
}

layer_effects! {
    thin_walled: ThinWalls, |m, [_, clear]| m.thin_walled && clear,
        "walls let light through that they do not bend", "no wall is thin and clear",
        Some("light goes straight through walls, which reflect none");
    specular: TintedReflection, |m, [plain, _]| m.tints_reflections() && plain,
        "a surface reflects more or less than its index says", "what reflects goes by its index", None;
    conductor: Conductors, |m, _| m.metal().is_some(),
        "a metal reflects by its complex index", "no metal has a complex index", None;
    clearcoat: Clearcoat, |m, _| m.coat().is_some(),
        "a clear coat lies over a surface", "no surface has a clear coat", None;
    sheen: Sheen, |m, _| m.fibres().is_some(),
        "fibres catch light at grazing angles", "no surface has fibres", None;
    anisotropy: Anisotropy, |m, _| m.combed().is_some(),
        "facets are rougher one way", "facets are as rough along every direction", None;
    iridescence: Iridescence, |m, _| m.film().is_some(),
        "light interferes in a thin film", "no surface has a thin film", None;
    dispersion: Dispersion, |m, [_, clear]| m.dispersion > 0.0 && clear && !m.thin_walled,
        "short waves bend more than long ones: paths take one each", "glass bends all light alike", None;
    diffuse_transmission: DiffuseTransmission, |m, [plain, _]| m.may_diffuse_through() && plain,
        "light is diffused to the other side", "nothing diffuses light to its other side", None;
}
