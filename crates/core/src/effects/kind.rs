//! The effects that the program knows, as a closed set: reports, preparation and kernels all mean the same thing by a name.

use serde::{Serialize, Serializer};

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

/// Effects of what lies over, under and in the metallic-roughness model: surfaces that have one are prepared as layered.
pub const LAYERS: EffectSet = EffectSet::of(&[
    Effect::ThinWalls,
    Effect::TintedReflection,
    Effect::Conductors,
    Effect::Clearcoat,
    Effect::Sheen,
    Effect::Anisotropy,
    Effect::Iridescence,
    Effect::Dispersion,
    Effect::DiffuseTransmission,
]);

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

/// A set of effects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct EffectSet(u64);

impl EffectSet {
    /// No effect.
    pub const EMPTY: Self = Self(0);
    /// Every effect.
    pub const ALL: Self = Self::of(Effect::ALL);

    /// These effects.
    pub const fn of(effects: &[Effect]) -> Self {
        let (mut bits, mut i) = (0, 0);
        while i < effects.len() {
            bits |= 1 << effects[i] as u8;
            i += 1;
        }
        Self(bits)
    }

    /// Whether it is in the set.
    pub const fn has(self, effect: Effect) -> bool {
        self.0 >> effect as u8 & 1 == 1
    }

    /// This set without those of another.
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// What either has.
    pub const fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// What both have.
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Whether another set has all of these.
    pub const fn is_within(self, other: Self) -> bool {
        self.without(other).0 == 0
    }

    /// Whether nothing is in it.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// What is in it, in the order of reports.
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::ALL.iter().copied().filter(move |&effect| self.has(effect))
    }
}

impl FromIterator<Effect> for EffectSet {
    fn from_iter<I: IntoIterator<Item = Effect>>(effects: I) -> Self {
        effects.into_iter().fold(Self::EMPTY, |set, effect| Self(set.0 | 1 << effect as u8))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: every name means one effect, sets hold what was put in and nothing else, and there is room for all.
    #[test]
    fn names_and_sets() {
        assert!(Effect::ALL.len() <= 64);
        for (place, &effect) in Effect::ALL.iter().enumerate() {
            assert_eq!((effect as usize, Effect::named(effect.name())), (place, Some(effect)));
            let (one, others) = (EffectSet::of(&[effect]), EffectSet::ALL.without(EffectSet::of(&[effect])));
            assert!(one.has(effect) && !others.has(effect) && one.and(others).is_empty());
            assert_eq!((one.iter().collect::<Vec<_>>(), others.iter().count()), (vec![effect], Effect::ALL.len() - 1));
            assert!(one.is_within(EffectSet::ALL) && !one.is_within(others) && EffectSet::EMPTY.is_within(one));
            assert_eq!([effect, effect].into_iter().collect::<EffectSet>(), one);
        }
        assert_eq!(Effect::named("magic"), None);
    }
}
