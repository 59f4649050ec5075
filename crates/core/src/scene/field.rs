//! Macros for material structs. From a list of fields they define the struct, its defaults, the
//! bounds that validation checks, and access to all values and textures.

use super::input::{Checker, CheckerInput, Colour, Input, InputValue, TextureRef};

/// Range of valid values of a material's field, checked if the value is constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldBounds {
    /// Every value.
    Any,
    /// From the first number to the second number, in each channel of a colour.
    Range(f64, f64),
    /// Zero, which has a special meaning, or a number from the first to the second bound.
    ZeroOrWithin(f64, f64),
    /// Any number within the supported range.
    Finite,
    /// A length above zero.
    Length,
    /// A colour without negative channels.
    Light,
}

/// Constant value of a material's field: a number or a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConstantValue {
    /// A number.
    Number(f64),
    /// A colour.
    Colour(Colour),
}

/// A field of a material, with its key, value and bounds, for code that visits all fields.
#[derive(Clone, Copy)]
pub struct MaterialField<'a> {
    /// Key of the layer that the field belongs to; `None` for a field of the model itself.
    pub layer: Option<&'static str>,
    /// Key of the field in the file.
    pub key: &'static str,
    /// Value of the field.
    pub value: &'a dyn FieldValue,
    /// Bounds of a constant value.
    pub bounds: FieldBounds,
}

impl core::fmt::Display for MaterialField<'_> {
    /// Writes the path of the field from the model, such as `clearcoat.factor`.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.layer.map_or(Ok(()), |layer| write!(f, "{layer}."))?;
        f.write_str(self.key)
    }
}

/// Value of a material's field, whatever its type. Code that visits all fields finds textures,
/// expressions and constants by this trait. The default methods suit a value without texture,
/// expression or layer.
pub trait FieldValue {
    /// Returns the texture use and its key within the field; the key is empty if the field itself
    /// is the texture use.
    fn texture(&self) -> Option<(&'static str, &TextureRef)> {
        None
    }
    /// Returns the texture use for modification.
    fn texture_mut(&mut self) -> Option<&mut TextureRef> {
        None
    }
    /// Returns the text of an expression, and whether the expression must be a number.
    fn expression(&self) -> Option<(&str, bool)> {
        None
    }
    /// Returns the checkerboard.
    fn checker(&self) -> Option<&Checker> {
        None
    }
    /// Returns the value of a constant.
    fn constant_value(&self) -> Option<ConstantValue> {
        None
    }
    /// Replaces an image by its factor if `_images` is true, and a checkerboard by the mean of its
    /// two colours if `_checkers` is true. Other values stay unchanged.
    fn make_constant(&mut self, _images: bool, _checkers: bool) {}
    /// Returns the fields of this value if the value is a layer; empty for any other value.
    fn layer_fields(&self) -> Vec<MaterialField<'_>> {
        Vec::new()
    }
    /// Applies a change to each field of this value if the value is a layer.
    fn change_layer_fields(&mut self, _change: &mut dyn FnMut(&mut dyn FieldValue)) {}
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

impl<T: InputValue> FieldValue for Input<T> {
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
            Some((text, T::from_colour(Colour::BLACK).is_none()))
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
    fn make_constant(&mut self, images: bool, checkers: bool) {
        let colour = match self {
            Self::Texture(input) if images => input.texture.factor,
            Self::Checker(CheckerInput { checker }) if checkers => {
                Colour(core::array::from_fn(|i| {
                    0.5 * (checker.even.0[i] + checker.odd.0[i])
                }))
            }
            _ => return,
        };
        *self =
            Self::Constant(T::from_colour(colour).unwrap_or_else(|| T::from_number(colour.0[0])));
    }
    fn constant_value(&self) -> Option<ConstantValue> {
        let is_number = T::from_colour(Colour::BLACK).is_none();
        let value = self.constant()?.to_colour();
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
    fn make_constant(&mut self, images: bool, _: bool) {
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

/// A material or layer whose fields can be visited. The macro `fields!` implements it.
pub trait MaterialFields {
    /// Returns the fields of the struct and of its layers.
    fn fields(&self) -> Vec<MaterialField<'_>>;
    /// Applies a change to the value of each field of the struct and of its layers.
    fn change_values(&mut self, change: &mut dyn FnMut(&mut dyn FieldValue));
}

impl<L: MaterialFields> FieldValue for Option<L> {
    fn layer_fields(&self) -> Vec<MaterialField<'_>> {
        self.as_ref().map_or_else(Vec::new, MaterialFields::fields)
    }
    fn change_layer_fields(&mut self, change: &mut dyn FnMut(&mut dyn FieldValue)) {
        if let Some(layer) = self {
            layer.change_values(change);
        }
    }
}

/// Implements [`MaterialFields`] for a struct, from its list of fields: `key: BOUNDS;`.
macro_rules! fields {
    ($Name:ident $($key:ident: $bounds:expr;)*) => {
        impl MaterialFields for $Name {
            fn fields(&self) -> Vec<MaterialField<'_>> {
                let mut list = Vec::new();
                $(
                    list.push(MaterialField { layer: None, key: stringify!($key), value: &self.$key, bounds: $bounds });
                    let layer_fields = self.$key.layer_fields().into_iter();
                    list.extend(layer_fields.map(|part| MaterialField { layer: Some(stringify!($key)), ..part }));
                )*
                list
            }

            fn change_values(&mut self, change: &mut dyn FnMut(&mut dyn FieldValue)) {
                $(
                    change(&mut self.$key);
                    self.$key.change_layer_fields(change);
                )*
            }
        }
    };
}

/// Defines a struct by a list of fields: `key: Type = DEFAULT, BOUNDS;`. After the bounds, an
/// effect may follow. Switching this effect off resets the field to its default.
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
