//! Lights of a glTF file (KHR_lights_punctual), posed by their nodes.

use raywright_core::scene::{Colour, Falloff, Light, LightKind};
use raywright_core::validate::{MAX_COORDINATE, MAX_LIGHT_INTENSITY, MAX_MAGNITUDE, MIN_LENGTH};

use super::entries::{LightEntry as Source, SpotCone};
use super::nodes::NodeInstance;
use crate::import::{Warnings, format_number};

/// Converts a light; returns `None`, and adds a warning, for invalid numbers.
pub(super) fn convert_light(
    light: &Source,
    index: usize,
    name: String,
    instance: &NodeInstance,
    warnings: &mut Warnings,
) -> Option<Light> {
    let label = format!("KHR_lights_punctual.lights[{index}]");
    let skip = |warnings: &mut Warnings, reason: &str| {
        warn!(
            warnings,
            CameraOrLight, "{label}: {reason}; the light was left out"
        );
        None
    };
    let maximum = if light.kind == "directional" {
        MAX_MAGNITUDE
    } else {
        MAX_LIGHT_INTENSITY
    };
    let intensity =
        warnings.clamp_with_warning(light.intensity.into(), [0.0, maximum], &label, "intensity");
    let colour = light
        .color
        .map(|c| warnings.clamp_with_warning(c.into(), [0.0, maximum], &label, "color"));
    let colour = colour.map(|c| (c * intensity).min(maximum));
    // Lights shine along their node's -z.
    let Some(back) = instance.world.matrix3.z_axis.try_normalize() else {
        return skip(
            warnings,
            "the transform of its node has no inverse: a scale is zero",
        );
    };
    let position = instance.world.translation.into();
    let range = light_range(light, &label, warnings);
    let kind = match light.kind.as_str() {
        "directional" => LightKind::Directional {
            to_light: back.into(),
        },
        "point" => LightKind::Point {
            position,
            falloff: Falloff::InverseSquare,
            range,
        },
        "spot" => {
            let Some([inner, outer]) = spot_angles(light.spot.as_ref(), &label, warnings) else {
                return skip(warnings, "its outer cone angle is not above 0");
            };
            LightKind::Spot {
                position,
                direction: (-back).into(),
                inner_angle: inner,
                outer_angle: outer,
                falloff: Falloff::InverseSquare,
                range,
            }
        }
        _ => return skip(warnings, "its type is unknown"),
    };
    Some(Light {
        name,
        kind,
        colour: Colour(colour),
        shadows: true,
        specular: true,
    })
}

/// Returns the range of a light in metres; `None` for an unbounded range. A range of zero or less,
/// or beyond the largest supported coordinate, counts as unbounded.
fn light_range(light: &Source, label: &str, warnings: &mut Warnings) -> Option<f64> {
    let range = light
        .range
        .map(f64::from)
        .filter(|range| *range <= MAX_COORDINATE)?;
    if range <= 0.0 {
        warn!(
            warnings,
            Range,
            "{label}: the range {} is not above 0; the light has no range limit",
            format_number(range)
        );
        return None;
    }
    Some(warnings.clamp_with_warning(range, [MIN_LENGTH, MAX_COORDINATE], label, "range"))
}

/// Returns the inner and the outer angle of a spotlight, in degrees from the axis; `None` for an
/// empty cone. The light has a hard edge if the inner angle is not smaller than the outer angle.
fn spot_angles(spot: Option<&SpotCone>, label: &str, warnings: &mut Warnings) -> Option<[f64; 2]> {
    let spot = spot.map_or_else(SpotCone::default, SpotCone::clone);
    let [inner, outer] =
        [spot.inner_cone_angle, spot.outer_cone_angle].map(|angle| f64::from(angle).to_degrees());
    // π/2 in single precision is slightly more than 90 degrees.
    let outer = if (outer - 90.0).abs() < 1e-4 {
        90.0
    } else {
        outer
    };
    if outer <= 0.0 {
        return None;
    }
    let outer = warnings.clamp_with_warning(outer, [0.0, 90.0], label, "outerConeAngle in degrees");
    Some([
        warnings.clamp_with_warning(inner, [0.0, outer], label, "innerConeAngle in degrees"),
        outer,
    ])
}
