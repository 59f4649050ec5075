//! Lights of a glTF file (KHR_lights_punctual), placed by the nodes that carry them.

use raywright_core::scene::{Colour, Falloff, Light, LightKind};

use super::entries::{Light as Source, Spot};
use super::nodes::Placed;
use crate::import::Warnings;

/// A light as the scene wants it, or none with a warning when its numbers make none.
pub(super) fn convert(light: &Source, index: usize, name: String, placed: &Placed, warnings: &mut Warnings) -> Option<Light> {
    let mut skip = |why: &str| {
        warnings.add(format!("KHR_lights_punctual.lights[{index}]: {why}; the light was left out"));
        None
    };
    let intensity = f64::from(light.intensity);
    let colour = light.color.map(|c| f64::from(c) * intensity);
    if !colour.iter().all(|c| c.is_finite() && *c >= 0.0) {
        return skip("its colour or intensity is negative or not finite");
    }
    // Lights shine along their node's -z.
    let Some(back) = placed.world.matrix3.z_axis.try_normalize() else { return skip("its node squeezes it flat") };
    let position = placed.world.translation.into();
    let range = light.range.map(f64::from).filter(|r| *r > 0.0 && r.is_finite());
    let kind = match light.kind.as_str() {
        "directional" => LightKind::Directional { to_light: back.into() },
        "point" => LightKind::Point { position, falloff: Falloff::InverseSquare, range },
        "spot" => {
            let spot = light.spot.as_ref().map_or_else(Spot::default, Spot::clone);
            let (inner, outer) = (f64::from(spot.inner_cone_angle).to_degrees(), f64::from(spot.outer_cone_angle).to_degrees());
            // pi/2 in single precision is a little more than 90 degrees.
            let outer = if (outer - 90.0).abs() < 1e-4 { 90.0 } else { outer };
            if !(inner >= 0.0 && inner < outer && outer <= 90.0) {
                return skip(&format!("its cone of {inner:.1} to {outer:.1} degrees makes no sense"));
            }
            LightKind::Spot {
                position,
                direction: (-back).into(),
                inner_angle: inner,
                outer_angle: outer,
                falloff: Falloff::InverseSquare,
                range,
            }
        }
        _ => return skip("its type is unknown"),
    };
    Some(Light { name, kind, colour: Colour(colour), shadows: true, specular: true })
}
