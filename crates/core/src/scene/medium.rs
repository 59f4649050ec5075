//! Media that scatter and absorb light: the inside of bodies, and the air.

use serde::{Deserialize, Serialize};

use super::field::FieldBounds::{Any, Length, Range};
use super::field::{FieldBounds, FieldValue, MaterialField, MaterialFields, fields, file_struct};
use super::input::{Colour, ScalarFactor};

file_struct! {
    /// A medium: the inside of a body (`interior` of a physical material), or the air between the
    /// bodies (`air` of the scene). Either `absorption` and `scattering` or `colour` and `distance`
    /// describe it.
    Medium
    /// Absorption coefficient per metre at a density of 1.
    absorption: Colour = Colour::BLACK, FieldBounds::Light;
    /// Scattering coefficient per metre at a density of 1.
    scattering: Colour = Colour::BLACK, FieldBounds::Light;
    /// Mean cosine of the scattering angle, −0.999 (backwards) to 0.999 (forwards); 0 scatters
    /// evenly (Henyey, Greenstein, "Diffuse Radiation in the Galaxy", 1941).
    anisotropy: f64 = 0.0, Range(-0.999, 0.999);
    /// Colour that a thick layer of the medium shows under white light, 0 to 1, in place of
    /// `absorption` and `scattering`.
    colour: Option<Colour> = None, Range(0.0, 1.0);
    /// Mean distance in metres that light travels before it meets the medium. Given with `colour`.
    distance: Option<Colour> = None, Range(1e-15, 1e15);
    /// Density: a factor on both coefficients, which may be an expression of the position `p` and
    /// of `t`.
    density: ScalarFactor = ScalarFactor::default(), Any;
    /// Greatest value of an expression for the density.
    max_density: f64 = 1.0, Range(0.0, 1e15);
    /// Radius in metres of the air, a ball about the centre of the bounded objects. None: four times
    /// the radius of these objects, and twice the distance of the farthest camera of the file. The
    /// inside of a body has no radius.
    radius: Option<f64> = None, Length;
}

impl FieldValue for ScalarFactor {}

impl FieldValue for Option<Colour> {
    fn constant_value(&self) -> Option<super::ConstantValue> {
        self.map(super::ConstantValue::Colour)
    }
}

impl Medium {
    /// Returns the coefficients of absorption and of scattering per metre, at a density of 1.
    pub fn coefficients(&self) -> [[f64; 3]; 2] {
        let (Some(colour), Some(distance)) = (self.colour, self.distance) else {
            return [self.absorption.0, self.scattering.0];
        };
        let albedo = colour
            .0
            .map(|c| single_scattering_albedo(c, self.anisotropy));
        [
            core::array::from_fn(|k| (1.0 - albedo[k]) / distance.0[k]),
            core::array::from_fn(|k| albedo[k] / distance.0[k]),
        ]
    }

    /// Returns the absorption coefficient of a medium that absorbs evenly and scatters nothing.
    pub fn even_absorption(&self) -> Option<[f64; 3]> {
        let [absorption, scattering] = self.coefficients();
        match self.density {
            ScalarFactor::Number(density) if scattering == [0.0; 3] || density == 0.0 => {
                Some(absorption.map(|a| a * density))
            }
            _ => None,
        }
    }
}

/// Returns the albedo of a single scattering in a medium that shows the colour `c` when thick
/// ("Revisiting Physically Based Shading at Imageworks", Kulla, Conty 2017).
pub fn single_scattering_albedo(c: f64, anisotropy: f64) -> f64 {
    let root = (9.59217 + 41.6808 * c + 17.7126 * c * c).sqrt();
    let s = (4.09712 + 4.20863 * c - root).clamp(0.0, 1.0);
    (1.0 - s * s) / (1.0 - anisotropy * s * s)
}
