//! What the lists of a glTF file hold, as types: fields are what the specification and the
//! extensions that are read call them.

mod data;
mod graph;
mod material;

pub(super) use data::{
    Accessor, Buffer, Draco, Mesh, Meshopt, Primitive, Sparse, View, ViewExtensions,
};
pub(super) use graph::{
    Animation, AnimationSampler, Camera, Channel, Instancing, Interpolation, Light, Node,
    RootExtensions, SceneEntry, Skin, Spot,
};
pub(super) use material::{
    Image, Material, MaterialExtensions, Sampler, SpecularGlossiness, Texture, TextureTransform,
    TextureUse,
};

/// A type for the extensions of an entry: those that are read by their names, the others as they
/// come. A reader of its own and not `serde(flatten)`, which would lose the path of what is wrong
/// inside one.
macro_rules! extended {
    ($(#[$doc:meta])* $name:ident: $other:ty { $($field:ident: $type:ty = $key:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Default)]
        pub(in crate::gltf) struct $name {
            $(pub $field: $type,)*
            /// Those that are not read.
            pub others: std::collections::BTreeMap<String, $other>,
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct ByName;
                impl<'de> serde::de::Visitor<'de> for ByName {
                    type Value = $name;
                    fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                        f.write_str("extensions by their names")
                    }
                    fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<$name, A::Error> {
                        let mut out = $name::default();
                        while let Some(name) = map.next_key::<String>()? {
                            match name.as_str() {
                                $($key => out.$field = map.next_value()?,)*
                                _ => drop(out.others.insert(name, map.next_value()?)),
                            }
                        }
                        Ok(out)
                    }
                }
                deserializer.deserialize_map(ByName)
            }
        }
    };
}
use extended;
