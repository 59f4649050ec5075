//! Lights that face away from the scene, appear smaller than a pixel or repeat another light; skies
//! with extremely bright points.

use core::f64::consts::PI;
use std::collections::HashMap;

use glam::DVec3;
use raywright_bvh::Aabb;

use super::cameras::{CameraView, item_nearest_to_camera};
use super::facts::{ObjectFacts, SceneFacts, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::light_reach;
use super::light_survey::LightSurvey;
use crate::display::curve::decode_transfer;
use crate::generate::generator_offsets;
use crate::scene::{
    Colour, ColourSpace, ImageData, MaterialModel, Physical, PixelData, Shape, SideRule, Sky,
    TextureRef, TransferCurve,
};

/// Returns the findings about lights. Without a survey, only those that need no rays.
pub(super) fn check_lights(
    scene_facts: &SceneFacts<'_>,
    views: &[CameraView],
    survey: Option<&LightSurvey>,
) -> Vec<StressFinding> {
    let (mut findings, mut first) = (Vec::new(), HashMap::new());
    for (index, light) in scene_facts.scene.lights.iter().enumerate() {
        let reach = survey.and_then(|survey| survey.lights.get(index));
        findings.extend(light_reach::check_light(scene_facts, index, reach));
        let twin = *first.entry(format!("{:?}", light.kind)).or_insert(index);
        if twin != index {
            findings.push(duplicate_light_finding(scene_facts, [twin, index]));
        }
    }
    let lamps = || {
        scene_facts.objects.iter().filter(|object_facts| {
            object_facts.emits_light() && !matches!(object_facts.object.shape, Shape::Mesh(_))
        })
    };
    findings.extend(
        lamps().filter_map(|object_facts| light_facing_away_finding(scene_facts, object_facts)),
    );
    findings.extend(lamp_below_pixel_finding(
        scene_facts,
        lamps(),
        views,
        survey,
    ));
    let sizeless = survey.iter().flat_map(|survey| &survey.lamps);
    findings
        .extend(sizeless.filter_map(|lamp| light_reach::sizeless_lamp_finding(scene_facts, lamp)));
    findings.extend(sky_spike_finding(scene_facts));
    findings
}

/// Returns the finding that a light repeats another light.
fn duplicate_light_finding(
    scene_facts: &SceneFacts<'_>,
    [twin, index]: [usize; 2],
) -> StressFinding {
    let [a, b] = [twin, index].map(|index| &scene_facts.scene.lights[index]);
    let other = FindingSubject::Light(twin).display_name(scene_facts.scene);
    let (severity, end) = if a.colour == b.colour {
        let end = "together they are twice as bright as one";
        (Severity::PictureWrong, end)
    } else {
        let end = "the two differ in colour, and the light of both is added";
        (Severity::Harmless, end)
    };
    StressFinding::new(
        FindingCode::DuplicateLight,
        severity,
        FindingSubject::Light(index),
        format!("it is in the same place as {other}: {end}"),
        "remove one of the two; if both are intended, keep one with the sum of their colours",
    )
    .with_place(light_reach::light_position(&b.kind))
}

/// Returns a finding if a flat, one-sided lamp has all objects behind it.
fn light_facing_away_finding(
    scene_facts: &SceneFacts<'_>,
    object_facts: &ObjectFacts<'_>,
) -> Option<StressFinding> {
    let shines_out = match object_facts.object.side {
        SideRule::Both => return None,
        SideRule::Outside | SideRule::Culled => true,
        SideRule::Inside => false,
    };
    let map = object_facts.object_to_world;
    let (point, normal) = match object_facts.object.shape {
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
    let Aabb { min, max } = scene_facts.bounds;
    let farthest = DVec3::select(normal.cmpgt(DVec3::ZERO), max, min);
    let reason = "this lamp emits from one side only, and all objects are on its other side";
    let remedy = "turn it over, or give it `side = \"both\"`";
    let ahead = (farthest - point).dot(normal);
    (ahead <= 1e-9 * scene_facts.bounds_diagonal()).then(|| {
        StressFinding::new(
            FindingCode::LightMissesScene,
            Severity::SlowOrNoisy,
            object_facts.subject,
            reason,
            remedy,
        )
        .with_place(finite_point(point))
    })
}

/// Returns a finding about lamps in view that are smaller than a pixel. Each copy of a generator
/// counts.
fn lamp_below_pixel_finding<'a>(
    scene_facts: &SceneFacts<'_>,
    lamps: impl Iterator<Item = &'a ObjectFacts<'a>>,
    views: &[CameraView],
    survey: Option<&LightSurvey>,
) -> Option<StressFinding> {
    let listed = scene_facts.scene.objects.len();
    let (mut total, mut count, mut nearest) = (0, 0, None);
    let mut is_in_glass = false;
    for object_facts in lamps {
        let Some(bounds) = object_facts.bounds else {
            continue;
        };
        let (centre, radius) = (bounds.centre(), 0.5 * bounds.extent().length());
        let generator = object_facts.subject.list_index().checked_sub(listed);
        let mut judge = |centre: DVec3| {
            total += 1;
            if views
                .iter()
                .any(|view| view.is_sphere_below_pixel(centre, radius))
            {
                count += 1;
                let index = object_facts.subject.list_index();
                is_in_glass |= survey.is_some_and(|s| s.enclosing_glass(index).is_some());
                let own = (object_facts.subject, centre);
                nearest = item_nearest_to_camera(views, nearest.into_iter().chain([own]));
            }
        };
        match generator {
            None => judge(centre),
            // Its bounds are those of its first copy.
            Some(generator) => {
                let kind = &scene_facts.scene.generators[generator].kind;
                let start = generator_offsets(kind).next().unwrap_or_default();
                generator_offsets(kind).for_each(|offset| judge(centre + offset - start));
            }
        }
    }
    let (subject, centre) = nearest?;
    let reason = "lamps in view are smaller than a pixel: the few samples that hit one show as bright specks";
    // No path hits an entry in `lights` through glass.
    let remedy = match is_in_glass {
        true => "make the lamps larger, or move them out of view",
        false => {
            "make the lamps larger, move them out of view, or replace them by entries in `lights`"
        }
    };
    Some(
        StressFinding::new(
            FindingCode::LampBelowPixel,
            Severity::SlowOrNoisy,
            subject,
            reason,
            remedy,
        )
        .with_count(count, total, "lamps", "are smaller than a pixel")
        .with_place(finite_point(centre)),
    )
}

/// Returns a finding about texels of a sky map that are far brighter than most of the sky.
fn sky_spike_finding(scene_facts: &SceneFacts<'_>) -> Option<StressFinding> {
    /// Least brightness of a bright point, in multiples of the median. Greatest share of the sky
    /// that bright points may cover, for a finding.
    const SPIKE: f64 = 1e4;
    const FEW: f64 = 1e-4;
    let Some(Sky::Map(map)) = &scene_facts.scene.sky else {
        return None;
    };
    let data = scene_facts.lookup.image(&map.image)?.data.as_deref()?;
    let PixelData::Linear(pixels) = &data.pixels else {
        return None;
    };
    let texel_weight = |index: usize| {
        let row_centre = (index / data.width as usize) as f64 + 0.5;
        (PI * row_centre / f64::from(data.height)).sin()
    };
    let bright = |pixel: &[f32; 4]| f64::from(pixel[0].max(pixel[1]).max(pixel[2]));
    let finite = || {
        pixels
            .iter()
            .enumerate()
            .filter(|(_, pixel)| bright(pixel).is_finite())
    };
    let weight: f64 = finite().map(|(index, _)| texel_weight(index)).sum();
    let mut values: Vec<f64> = finite().map(|(_, pixel)| bright(pixel)).collect();
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let median = *values.select_nth_unstable_by(middle, f64::total_cmp).1;
    let spikes = || finite().filter(|(_, pixel)| bright(pixel) > SPIKE * median.max(1e-6));
    let share = spikes().map(|(index, _)| texel_weight(index)).sum::<f64>() / weight;
    let count = spikes().count() as u64;
    let reason = format!(
        "a few points of the sky are over {SPIKE:.0} times as bright as most of it: their light by way of mirrors and glass is noisy"
    );
    let remedy = "remove the sun from the sky image and add a directional light in its place, or render with more --spp";
    (count > 0 && share < FEW).then(|| {
        StressFinding::new(
            FindingCode::SkySpikes,
            Severity::SlowOrNoisy,
            FindingSubject::Sky,
            reason,
            remedy,
        )
        .with_count(count, pixels.len() as u64, "texels", "are that bright")
    })
}

/// Returns the greatest radiance that a surface or the sky emits. Returns `None` if it is unknown,
/// or if the scene has delta lights, a veil or classic materials.
pub(super) fn max_emitted_radiance(scene_facts: &SceneFacts<'_>) -> Option<f64> {
    let scene = scene_facts.scene;
    if !scene.lights.is_empty() || scene.render.veil != Colour::BLACK {
        return None;
    }
    let mut brightest = match &scene.sky {
        None => 0.0,
        Some(Sky::Constant(colour)) => max_channel(*colour),
        Some(Sky::Gradient { bottom, top, suns }) => {
            let sun = |sun: &crate::scene::Sun| sun.weight.max(0.0) * max_channel(sun.colour);
            max_channel(*bottom).max(max_channel(*top)) + suns.iter().map(sun).sum::<f64>()
        }
        Some(Sky::Map(map)) => {
            map.strength * max_texel(scene_facts.lookup.image(&map.image)?.data.as_deref()?, true)
        }
        Some(Sky::Expression(_) | Sky::Studio(_)) => return None,
    };
    for (_, material) in scene_facts.used_materials() {
        let MaterialModel::Physical(m) = &material.model else {
            return None;
        };
        brightest = brightest.max(emitted_radiance(scene_facts, m)?);
    }
    Some(brightest)
}

fn emitted_radiance(scene_facts: &SceneFacts<'_>, m: &Physical) -> Option<f64> {
    let (input, texture) = match m.unlit {
        true => (&m.base_colour, &m.base_colour_texture),
        false => (&m.emission, &m.emission_texture),
    };
    let of_texture = |reference: &TextureRef| {
        let texture = scene_facts.lookup.texture(&reference.name)?;
        let data = scene_facts.lookup.image(&texture.image)?.data.as_deref();
        Some(
            max_channel(reference.factor)
                * data.map_or(1.0, |data| {
                    max_texel(data, texture.colour_space == ColourSpace::Srgb)
                }),
        )
    };
    let factor = texture.as_ref().map_or(Some(1.0), of_texture)?;
    Some(max_channel(input.constant()?) * factor)
}

fn max_channel(colour: Colour) -> f64 {
    colour.0.into_iter().fold(0.0, f64::max)
}

fn max_texel(data: &ImageData, has_curve: bool) -> f64 {
    match &data.pixels {
        PixelData::Linear(pixels) => pixels
            .iter()
            .flat_map(|pixel| &pixel[..3])
            .fold(0.0, |maximum, &x| f64::from(x).max(maximum)),
        PixelData::Codes(pixels) => {
            let code = f64::from(
                pixels
                    .iter()
                    .flat_map(|pixel| &pixel[..3])
                    .max()
                    .copied()
                    .unwrap_or(0),
            ) / 255.0;
            if has_curve {
                decode_transfer(TransferCurve::Srgb, code)
            } else {
                code
            }
        }
    }
}
