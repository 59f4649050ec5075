//! Lights: past everything, smaller than a pixel, there twice; and skies.

use core::f64::consts::PI;
use std::collections::HashMap;

use glam::DVec3;
use raywright_bvh::{Aabb, Shape as _};

use super::cameras::View;
use super::facts::{ObjectFacts, SceneFacts, place};
use super::finding::{Code, Finding, Severity, Subject};
use crate::display::curve::decode;
use crate::scene::{
    Colour, ColourSpace, ImageData, Light, LightKind, Model, Physical, Pixels, Shape, SideRule,
    Sky, TextureRef, TransferCurve,
};
use crate::shape::placed_shape;

/// What is wrong with the lights of a scene.
pub(super) fn check(facts: &SceneFacts<'_>, views: &[View]) -> Vec<Finding> {
    let (mut found, mut first) = (Vec::new(), HashMap::new());
    for (index, light) in facts.scene.lights.iter().enumerate() {
        let subject = Subject::Light(index);
        if let Some(why) = misses(light, &facts.bounds) {
            let remedy = "move it, turn it, or raise its `range`";
            found.push(Finding::new(
                Code::LightMissesScene,
                Severity::SlowOrNoisy,
                subject,
                why,
                remedy,
            ));
        }
        let twin = *first.entry(format!("{:?}", light.kind)).or_insert(index);
        if twin != index {
            let why = format!("{} is there again", Subject::Light(twin).words(facts.scene));
            found.push(Finding::new(
                Code::DuplicateLight,
                Severity::Harmless,
                subject,
                why,
                "make one of both, with the sum of their colours",
            ));
        }
    }
    let lamps = || {
        facts
            .objects
            .iter()
            .filter(|own| own.emits() && !matches!(own.object.shape, Shape::Mesh(_)))
    };
    found.extend(lamps().filter_map(|own| faces_away(facts, own)));
    found.extend(small_lamps(lamps(), views));
    found.extend(sky_spikes(facts));
    found
}

/// Why nothing of a light comes to where the scene is.
fn misses(light: &Light, bounds: &Aabb) -> Option<String> {
    if bounds.is_empty() {
        return None;
    }
    let (centre, radius) = (bounds.centre(), 0.5 * bounds.extent().length());
    let (position, range) = match light.kind {
        LightKind::Directional { .. } => return None,
        LightKind::Point {
            position, range, ..
        }
        | LightKind::Spot {
            position, range, ..
        } => (DVec3::from(position), range),
    };
    let nearest = position.clamp(bounds.min, bounds.max).distance(position);
    if let Some(range) = range.filter(|range| *range <= nearest) {
        return Some(format!(
            "its range of {range} ends before anything, so that it lights nothing: the nearest object is {nearest:.3} away"
        ));
    }
    let LightKind::Spot {
        direction,
        outer_angle,
        ..
    } = light.kind
    else {
        return None;
    };
    let way = centre - position;
    if way.length() <= radius {
        return None;
    }
    let off = way
        .normalize()
        .dot(DVec3::from(direction).normalize())
        .clamp(-1.0, 1.0)
        .acos();
    let reach = outer_angle.to_radians() + (radius / way.length()).min(1.0).asin();
    (off > reach).then(|| "its cone points past everything".to_owned())
}

/// A flat lamp with one side, behind which everything is.
fn faces_away(facts: &SceneFacts<'_>, own: &ObjectFacts<'_>) -> Option<Finding> {
    let shines_out = match own.object.side {
        SideRule::Both => return None,
        SideRule::Outside | SideRule::Culled => true,
        SideRule::Inside => false,
    };
    let map = own.map;
    let (point, normal) = match own.object.shape {
        Shape::Quad {
            corner,
            edge_u,
            edge_v,
        } => (corner.into(), DVec3::from(edge_u).cross(edge_v.into())),
        Shape::Disk { centre, normal, .. } => (centre.into(), normal.into()),
        Shape::Triangle {
            vertices: [a, b, c],
        } => (
            a.into(),
            (DVec3::from(b) - DVec3::from(a)).cross(DVec3::from(c) - DVec3::from(a)),
        ),
        _ => return None,
    };
    let point: DVec3 = map.transform_point3(point);
    let normal: DVec3 = map.matrix3.inverse().transpose() * normal;
    let normal = if shines_out { normal } else { -normal }.normalize();
    let Aabb { min, max } = facts.bounds;
    let farthest = DVec3::select(normal.cmpgt(DVec3::ZERO), max, min);
    let why = "it gives off light to one side, and everything is on its other side";
    let remedy = "turn it over, or give it `side = \"both\"`";
    let ahead = (farthest - point).dot(normal);
    (ahead <= 1e-9 * facts.diagonal()).then(|| {
        Finding::new(
            Code::LightMissesScene,
            Severity::SlowOrNoisy,
            own.subject,
            why,
            remedy,
        )
        .at(place(point))
    })
}

/// Lamps in view that are smaller than a pixel.
fn small_lamps<'a>(
    lamps: impl Iterator<Item = &'a ObjectFacts<'a>>,
    views: &[View],
) -> Option<Finding> {
    let (mut count, mut of) = (0, 0);
    let mut first: Option<(Subject, DVec3)> = None;
    for own in lamps {
        let Some(bounds) = bounds_of(own) else {
            continue;
        };
        let (centre, radius) = (bounds.centre(), 0.5 * bounds.extent().length());
        of += 1;
        if views
            .iter()
            .any(|view| view.sees_within_pixel(centre, radius))
        {
            count += 1;
            first = first.or(Some((own.subject, centre)));
        }
    }
    let (subject, centre) = first?;
    let why = "lamps that are in view are smaller than a pixel: samples meet one here and there, as bright specks";
    let remedy =
        "make them larger, hide them from the camera, or light by a `lights` entry in their place";
    Some(
        Finding::new(
            Code::LampBelowPixel,
            Severity::SlowOrNoisy,
            subject,
            why,
            remedy,
        )
        .counted(count, of, "lamps")
        .at(place(centre)),
    )
}

fn bounds_of(own: &ObjectFacts<'_>) -> Option<Aabb> {
    match placed_shape::<f64>(&own.object.shape, own.map)? {
        (shape, None) => shape.bounds(),
        (shape, Some(map)) => Some(raywright_bvh::shapes::transform_bounds(
            &map,
            &shape.bounds()?,
        )),
    }
}

/// Points of a sky picture that have most of its light.
fn sky_spikes(facts: &SceneFacts<'_>) -> Option<Finding> {
    /// How many times the mean a point is, and how small its share of the sky.
    const SPIKE: f64 = 1e4;
    const FEW: f64 = 1e-4;
    let Some(Sky::Map(map)) = &facts.scene.sky else {
        return None;
    };
    let data = facts.lookup.image(&map.image)?.data.as_deref()?;
    let Pixels::Linear(pixels) = &data.pixels else {
        return None;
    };
    let row = |index: usize| {
        (PI * (index as f64 / f64::from(data.width) + 0.5).floor() / f64::from(data.height))
            .sin()
            .max(1e-3)
    };
    let bright = |pixel: &[f32; 4]| f64::from(pixel[0].max(pixel[1]).max(pixel[2]));
    let finite = || {
        pixels
            .iter()
            .enumerate()
            .filter(|(_, pixel)| bright(pixel).is_finite())
    };
    let weight: f64 = finite().map(|(index, _)| row(index)).sum();
    let mut values: Vec<f64> = finite().map(|(_, pixel)| bright(pixel)).collect();
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let median = *values.select_nth_unstable_by(middle, f64::total_cmp).1;
    let spikes = || finite().filter(|(_, pixel)| bright(pixel) > SPIKE * median.max(1e-6));
    let share = spikes().map(|(index, _)| row(index)).sum::<f64>() / weight;
    let count = spikes().count() as u64;
    let why = format!(
        "points of it are over {SPIKE:.0} times as bright as most of it, and hardly any of it is so: what mirrors and glass show of them is noise"
    );
    let remedy =
        "take the sun out of the picture and add it as a directional light, or take more --spp";
    (count > 0 && share < FEW).then(|| {
        Finding::new(
            Code::SkySpikes,
            Severity::SlowOrNoisy,
            Subject::Sky,
            why,
            remedy,
        )
        .counted(count, pixels.len() as u64, "texels")
    })
}

/// The greatest radiance that anything in a scene gives off; none where that is not known, or where
/// radiance is no measure of its lights.
pub(super) fn brightest(facts: &SceneFacts<'_>) -> Option<f64> {
    let scene = facts.scene;
    if !scene.lights.is_empty() || scene.render.veil != Colour::BLACK {
        return None;
    }
    let mut brightest = match &scene.sky {
        None => 0.0,
        Some(Sky::Constant(colour)) => greatest(*colour),
        Some(Sky::Gradient { bottom, top, suns }) => {
            let sun = |sun: &crate::scene::Sun| sun.weight.max(0.0) * greatest(sun.colour);
            greatest(*bottom).max(greatest(*top)) + suns.iter().map(sun).sum::<f64>()
        }
        Some(Sky::Map(map)) => {
            map.strength * greatest_texel(facts.lookup.image(&map.image)?.data.as_deref()?, true)
        }
        Some(Sky::Expression(_) | Sky::Studio(_)) => return None,
    };
    for (_, material) in facts.used_materials() {
        let Model::Physical(m) = &material.model else {
            return None;
        };
        brightest = brightest.max(given_off(facts, m)?);
    }
    Some(brightest)
}

fn given_off(facts: &SceneFacts<'_>, m: &Physical) -> Option<f64> {
    let (input, texture) = match m.unlit {
        true => (&m.base_colour, &m.base_colour_texture),
        false => (&m.emission, &m.emission_texture),
    };
    let of_texture = |reference: &TextureRef| {
        let texture = facts.lookup.texture(&reference.name)?;
        let data = facts.lookup.image(&texture.image)?.data.as_deref();
        Some(
            greatest(reference.factor)
                * data.map_or(1.0, |data| {
                    greatest_texel(data, texture.colour_space == ColourSpace::Srgb)
                }),
        )
    };
    let factor = texture.as_ref().map_or(Some(1.0), of_texture)?;
    Some(greatest(input.constant()?) * factor)
}

fn greatest(colour: Colour) -> f64 {
    colour.0.into_iter().fold(0.0, f64::max)
}

fn greatest_texel(data: &ImageData, has_curve: bool) -> f64 {
    match &data.pixels {
        Pixels::Linear(pixels) => pixels
            .iter()
            .flat_map(|pixel| &pixel[..3])
            .fold(0.0, |most, &x| f64::from(x).max(most)),
        Pixels::Codes(pixels) => {
            let code = f64::from(
                pixels
                    .iter()
                    .flat_map(|pixel| &pixel[..3])
                    .max()
                    .copied()
                    .unwrap_or(0),
            ) / 255.0;
            if has_curve {
                decode(TransferCurve::Srgb, code)
            } else {
                code
            }
        }
    }
}
