//! Types of the entries in a glTF file. Fields are named as in the specification and in the
//! supported extensions.

/// Declares structs of optional JSON keys with their types. A key that is missing has the stated
/// value or the default of its type.
macro_rules! entries {
    ($($(#[$meta:meta])* $name:ident {
        $($(#[$of:meta])* $key:ident: $type:ty $(= $default:expr)?),* $(,)?
    })*) => {$(
        $(#[$meta])*
        #[derive(Debug, Deserialize)]
        #[serde(default, rename_all = "camelCase")]
        pub(in crate::gltf) struct $name {
            $($(#[$of])* pub $key: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($key: default_value!($($default)?),)* }
            }
        }
    )*};
}

/// Declares structs of JSON keys with their types. A key is required unless its type is an `Option`
/// or it has the attribute `serde(default)`.
macro_rules! required_entries {
    ($($(#[$meta:meta])* $name:ident {
        $($(#[$of:meta])* $key:ident: $type:ty),* $(,)?
    })*) => {$(
        $(#[$meta])*
        #[derive(Debug, Deserialize)]
        #[serde(rename_all = "camelCase")]
        pub(in crate::gltf) struct $name {
            $($(#[$of])* pub $key: $type,)*
        }
    )*};
}

macro_rules! default_value {
    () => {
        Default::default()
    };
    ($value:expr) => {
        $value
    };
}

/// Declares a struct for the extensions of a glTF entry, with a typed field for each supported
/// extension and a map of the unsupported extensions. The deserializer is written by hand, because
/// `serde(flatten)` would lose the path of a fault inside an extension.
macro_rules! extended {
    ($(#[$doc:meta])* $name:ident: $other:ty { $($field:ident: $type:ty = $key:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Default)]
        pub(in crate::gltf) struct $name {
            $(pub $field: $type,)*
            /// Data of unsupported extensions, by name.
            pub others: std::collections::BTreeMap<String, $other>,
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct ByName;
                impl<'de> serde::de::Visitor<'de> for ByName {
                    type Value = $name;
                    fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                        f.write_str("an object with the data of each extension by the extension's name")
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

mod data;
mod graph;
mod material;

pub(super) use data::{
    AccessorEntry, BufferEntry, BufferViewEntry, DracoEntry, MeshEntry, MeshoptEntry,
    PrimitiveEntry, SparseEntry, ViewExtensions,
};
pub(super) use graph::{
    AnimationChannel, AnimationEntry, AnimationSampler, CameraEntry, Interpolation, LightEntry,
    MeshInstancing, NodeEntry, ProjectionEntry, RootExtensions, SceneEntry, SkinEntry, SpotCone,
};
pub(super) use material::{
    ImageEntry, MaterialEntry, TextureEntry, TextureInfo, TextureSampler, TextureTransform,
};
