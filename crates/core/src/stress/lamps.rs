//! Lights: past everything, smaller than a pixel, there twice; and skies.

use core::f64::consts::PI;
use std::collections::HashMap;

use glam::DVec3;
use raywright_bvh::Aabb;

use super::cameras::{View, nearest};
use super::facts::{Matter, ObjectFacts, SceneFacts, place};
use super::finding::{Code, Finding, Severity, Subject, decimal};
use crate::display::curve::decode;
use crate::scene::{
    Colour, ColourSpace, ImageData, Light, LightKind, Model, Physical, Pixels, Shape, SideRule,
    Sky, TextureRef, TransferCurve,
};

/// What is wrong with the lights of a scene.
pub(super) fn check(facts: &SceneFacts<'_>, views: &[View]) -> Vec<Finding> {
    let (mut found, mut first) = (Vec::new(), HashMap::new());
    for (index, light) in facts.scene.lights.iter().enumerate() {
        let subject = Subject::Light(index);
        found.extend(misses(subject, light, &facts.bounds));
        let twin = *first.entry(format!("{:?}", light.kind)).or_insert(index);
        if twin != index {
            found.push(twins(facts, [twin, index]));
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

/// A light that is in the place of another one.
fn twins(facts: &SceneFacts<'_>, [twin, index]: [usize; 2]) -> Finding {
    let [a, b] = [twin, index].map(|index| &facts.scene.lights[index]);
    let other = Subject::Light(twin).words(facts.scene);
    let (severity, end) = if a.colour == b.colour {
        let end = "it lights twice as much as one does";
        (Severity::PictureWrong, end)
    } else {
        let end = "of another colour, and both are added";
        (Severity::Harmless, end)
    };
    let at = match b.kind {
        LightKind::Directional { .. } => None,
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some(position),
    };
    Finding::new(
        Code::DuplicateLight,
        severity,
        Subject::Light(index),
        format!("it is in one place with {other}: {end}"),
        "remove one of them; if both are meant, make one with the sum of their colours",
    )
    .at(at)
}

/// A light of which nothing comes to where the scene is.
fn misses(subject: Subject, light: &Light, bounds: &Aabb) -> Option<Finding> {
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
    let finding = |why: String, remedy: String| {
        let severity = Severity::SlowOrNoisy;
        Finding::new(Code::LightMissesScene, severity, subject, why, remedy).at(place(position))
    };
    let nearest = position.clamp(bounds.min, bounds.max).distance(position);
    if let Some(range) = range.filter(|range| *range <= nearest) {
        let why = format!(
            "its `range` of {range} metres ends before anything, so that it lights nothing: the nearest object is {} metres away",
            decimal(nearest)
        );
        let remedy = format!(
            "move it nearer, or raise its `range` above {} metres, or leave that away",
            decimal(nearest)
        );
        return Some(finding(why, remedy));
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
    let why = format!(
        "its cone points past everything: the scene is {:.0} degrees from its `direction`, and its `outer_angle` is {outer_angle} degrees",
        off.to_degrees()
    );
    let remedy = "turn its `direction` to the scene, or widen its `outer_angle`";
    (off > reach).then(|| finding(why, remedy.to_owned()))
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
    let (mut of, mut small) = (0, Vec::new());
    for own in lamps {
        let Some(bounds) = own.bounds else {
            continue;
        };
        let (centre, radius) = (bounds.centre(), 0.5 * bounds.extent().length());
        of += 1;
        if views
            .iter()
            .any(|view| view.sees_within_pixel(centre, radius))
        {
            small.push((own.subject, centre));
        }
    }
    let count = small.len() as u64;
    let (subject, centre) = nearest(views, small.into_iter())?;
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
        .counted(count, of, "lamps", "came out smaller than a pixel")
        .at(place(centre)),
    )
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
        .counted(count, pixels.len() as u64, "texels", "had that much light")
    })
}

/// The body of glass that an object is within.
pub(super) fn glass_around(facts: &SceneFacts<'_>, object: usize) -> Option<Subject> {
    const MOST: usize = 1000;
    let own = facts.objects[object].bounds?;
    let holds = |outer: &Aabb| outer.min.cmplt(own.min).all() && outer.max.cmpgt(own.max).all();
    facts
        .objects
        .iter()
        .filter(|other| other.matter == Matter::Body)
        .take(MOST)
        .find(|other| other.bounds.is_some_and(|outer| holds(&outer)))
        .map(|other| other.subject)
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
