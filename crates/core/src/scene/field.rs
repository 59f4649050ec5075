//! Structs whose fields are listed once, by a macro: what the struct, its defaults, validation,
//! switches and textures follow from.

use super::input::{Checker, CheckerInput, Colour, Input, TextureRef, Value};

/// What a field's value may be where it is the same everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bounds {
    /// Anything that can be written.
    Any,
    /// From the first number to the second one, in each channel.
    Within(f64, f64),
    /// Zero, which has a meaning of its own, or from the first number to the second one.
    ZeroOrWithin(f64, f64),
    /// Any number that can be worked with.
    Finite,
    /// A length above zero.
    Length,
    /// A colour without negative parts.
    Light,
}

/// A value that is the same everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConstantValue {
    /// A number.
    Number(f64),
    /// A colour.
    Colour(Colour),
}

/// A field of a material.
#[derive(Clone, Copy)]
pub struct Field<'a> {
    /// The layer that has it; none: the model itself.
    pub layer: Option<&'static str>,
    /// Its key there.
    pub key: &'static str,
    /// Its value.
    pub value: &'a dyn FieldValue,
    /// Bounds of a constant.
    pub bounds: Bounds,
}

impl core::fmt::Display for Field<'_> {
    /// The path from the model.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.layer.map_or(Ok(()), |layer| write!(f, "{layer}."))?;
        f.write_str(self.key)
    }
}

/// What may be asked of any field's value.
pub trait FieldValue {
    /// The use of a texture, and the key under which it is; empty where it is the field itself.
    fn texture(&self) -> Option<(&'static str, &TextureRef)> {
        None
    }
    /// The use of a texture, to be changed.
    fn texture_mut(&mut self) -> Option<&mut TextureRef> {
        None
    }
    /// The text of an expression, and whether it must be a number.
    fn expression(&self) -> Option<(&str, bool)> {
        None
    }
    /// The checkerboard.
    fn checker(&self) -> Option<&Checker> {
        None
    }
    /// The value, where it is the same everywhere.
    fn constant_value(&self) -> Option<ConstantValue> {
        None
    }
    /// Turns an image into its factor, a checkerboard into the mean of its colours.
    fn flatten(&mut self, _images: bool, _checkers: bool) {}
    /// The fields of a layer.
    fn parts(&self) -> Vec<Field<'_>> {
        Vec::new()
    }
    /// Has their values changed.
    fn change_parts(&mut self, _change: &mut dyn FnMut(&mut dyn FieldValue)) {}
}

impl FieldValue for bool {}
impl FieldValue for u32 {}

impl FieldValue for f64 {
    fn constant_value(&self) -> Option<ConstantValue> {
        Some(ConstantValue::Number(*self))
    }
}

impl FieldValue for Option<f64> {
    fn constant_value(&self) -> Option<ConstantValue> {
        self.map(ConstantValue::Number)
    }
}

impl<T: Value> FieldValue for Input<T> {
    fn texture(&self) -> Option<(&'static str, &TextureRef)> {
        if let Self::Texture(input) = self {
            Some(("texture", &input.texture))
        } else {
            None
        }
    }
    fn texture_mut(&mut self) -> Option<&mut TextureRef> {
        if let Self::Texture(input) = self {
            Some(&mut input.texture)
        } else {
            None
        }
    }
    fn expression(&self) -> Option<(&str, bool)> {
        if let Self::Expression(text) = self {
            Some((text, T::of_colour(Colour::BLACK).is_none()))
        } else {
            None
        }
    }
    fn checker(&self) -> Option<&Checker> {
        if let Self::Checker(input) = self {
            Some(&input.checker)
        } else {
            None
        }
    }
    fn flatten(&mut self, images: bool, checkers: bool) {
        let colour = match self {
            Self::Texture(input) if images => input.texture.factor,
            Self::Checker(CheckerInput { checker }) if checkers => {
                Colour(core::array::from_fn(|i| {
                    0.5 * (checker.even.0[i] + checker.odd.0[i])
                }))
            }
            _ => return,
        };
        *self = Self::Constant(T::of_colour(colour).unwrap_or_else(|| T::of_number(colour.0[0])));
    }
    fn constant_value(&self) -> Option<ConstantValue> {
        let is_number = T::of_colour(Colour::BLACK).is_none();
        let value = self.constant()?.colour();
        Some(if is_number {
            ConstantValue::Number(value.0[0])
        } else {
            ConstantValue::Colour(value)
        })
    }
}

impl FieldValue for Option<TextureRef> {
    fn texture(&self) -> Option<(&'static str, &TextureRef)> {
        self.as_ref().map(|texture| ("", texture))
    }
    fn texture_mut(&mut self) -> Option<&mut TextureRef> {
        self.as_mut()
    }
    fn flatten(&mut self, images: bool, _: bool) {
        if images {
            *self = None;
        }
    }
}

impl FieldValue for Colour {
    fn constant_value(&self) -> Option<ConstantValue> {
        Some(ConstantValue::Colour(*self))
    }
}

/// A struct whose fields a macro lists.
pub trait Fields {
    /// Its fields, and those of its layers.
    fn fields(&self) -> Vec<Field<'_>>;
    /// Has their values changed.
    fn change(&mut self, change: &mut dyn FnMut(&mut dyn FieldValue));
}

impl<L: Fields> FieldValue for Option<L> {
    fn parts(&self) -> Vec<Field<'_>> {
        self.as_ref().map_or_else(Vec::new, Fields::fields)
    }
    fn change_parts(&mut self, change: &mut dyn FnMut(&mut dyn FieldValue)) {
        if let Some(layer) = self {
            layer.change(change);
        }
    }
}

/// Lists the fields of a struct: `key: BOUNDS;`.
macro_rules! fields {
    ($Name:ident $($key:ident: $bounds:expr;)*) => {
        impl Fields for $Name {
            fn fields(&self) -> Vec<Field<'_>> {
                let mut list = Vec::new();
                $(
                    list.push(Field { layer: None, key: stringify!($key), value: &self.$key, bounds: $bounds });
                    let parts = self.$key.parts().into_iter();
                    list.extend(parts.map(|part| Field { layer: Some(stringify!($key)), ..part }));
                )*
                list
            }

            fn change(&mut self, change: &mut dyn FnMut(&mut dyn FieldValue)) {
                $(
                    change(&mut self.$key);
                    self.$key.change_parts(change);
                )*
            }
        }
    };
}

/// Makes a struct of a list of fields: `key: Type = DEFAULT, BOUNDS;`, and after the bounds the
/// effect, if any, without which the field has its default.
macro_rules! file_struct {
    (
        $(#[$meta:meta])* $Name:ident
        $($(#[$of:meta])* $key:ident: $Type:ty = $default:expr, $bounds:expr $(, $effect:ident)?;)*
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        #[serde(default, deny_unknown_fields)]
        pub struct $Name {
            $($(#[$of])* pub $key: $Type,)*
        }

        impl Default for $Name {
            fn default() -> Self {
                Self { $($key: $default,)* }
            }
        }

        fields!($Name $($key: $bounds;)*);
    };
}

pub(super) use {fields, file_struct};
