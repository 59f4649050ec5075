//! Findings about images: invalid texels, and images used for the wrong purpose.

use super::facts::SceneFacts;
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use crate::scene::{
    Channel, ColourSpace, ImageData, MaterialField, MaterialFields, MaterialModel, PixelData, Sky,
    TextureRef,
};

/// Returns the findings about the images that materials in use and the sky read.
pub(super) fn check_textures(scene_facts: &SceneFacts<'_>) -> Vec<StressFinding> {
    let mut images: Vec<usize> = Vec::new();
    let mut findings = Vec::new();
    for (index, material) in scene_facts.used_materials() {
        for reference in material.textures() {
            images.extend(image_index(scene_facts, reference));
            findings.extend(zero_transform_finding(scene_facts, reference, index));
        }
        let MaterialModel::Physical(m) = &material.model else {
            continue;
        };
        for field in m
            .fields()
            .into_iter()
            .filter(|field| !is_colour_field(field))
        {
            let subject = FindingSubject::Material(index);
            let texture = field.value.texture().map(|(_, texture)| texture);
            let slot = field.to_string();
            findings.extend(
                texture.and_then(|r| colour_space_findings(scene_facts, r, subject, &slot)),
            );
        }
        let coat = m.clearcoat.as_ref();
        let normals = [
            m.normal_texture.as_ref(),
            coat.and_then(|coat| coat.normal_texture.as_ref()),
        ];
        for reference in normals.into_iter().flatten() {
            findings.extend(normal_map_finding(scene_facts, reference));
        }
    }
    if let Some(Sky::Map(map)) = &scene_facts.scene.sky {
        images.extend(scene_facts.lookup.images.index_of(&map.image));
    }
    images.sort_unstable();
    images.dedup();
    findings.extend(
        images
            .into_iter()
            .flat_map(|index| check_image(scene_facts, index)),
    );
    findings
}

fn image_index(scene_facts: &SceneFacts<'_>, reference: &TextureRef) -> Option<usize> {
    scene_facts
        .lookup
        .images
        .index_of(&scene_facts.lookup.texture(&reference.name)?.image)
}

fn image_data<'a>(scene_facts: &SceneFacts<'a>, reference: &TextureRef) -> Option<&'a ImageData> {
    scene_facts.scene.images[image_index(scene_facts, reference)?]
        .data
        .as_deref()
}

/// Returns whether all texels of an image are equal.
fn is_uniform_image(data: &ImageData) -> bool {
    match &data.pixels {
        PixelData::Codes(pixels) => pixels.iter().all(|pixel| *pixel == pixels[0]),
        PixelData::Linear(pixels) => pixels.iter().all(|pixel| *pixel == pixels[0]),
    }
}

/// Returns whether a texture reads an image of one colour, which needs no texture coordinates.
pub(super) fn is_uniform_texture(scene_facts: &SceneFacts<'_>, reference: &TextureRef) -> bool {
    image_data(scene_facts, reference).is_some_and(is_uniform_image)
}

/// Returns a finding if a texture's `uv_transform` maps all coordinates to one point of an image of
/// several colours.
fn zero_transform_finding(
    scene_facts: &SceneFacts<'_>,
    reference: &TextureRef,
    material: usize,
) -> Option<StressFinding> {
    let rows = reference.uv_transform?;
    let is_zero = rows.iter().all(|row| row[..2] == [0.0; 2]);
    if !is_zero || is_uniform_image(image_data(scene_facts, reference)?) {
        return None;
    }
    let reason = format!(
        "the `uv_transform` of its texture `{}` multiplies all texture coordinates by zero, so that a single texel covers every surface",
        reference.name
    );
    Some(StressFinding::new(
        FindingCode::NoTextureCoordinates,
        Severity::PictureWrong,
        FindingSubject::Material(material),
        reason,
        "set the scale in the first two columns of `uv_transform`, or remove `uv_transform`",
    ))
}

/// Returns whether a material's field holds colours. All other fields hold directions or numbers.
fn is_colour_field(field: &MaterialField<'_>) -> bool {
    field.key.contains("colour") || field.key.starts_with("emission")
}

fn colour_space_findings(
    scene_facts: &SceneFacts<'_>,
    reference: &TextureRef,
    subject: FindingSubject,
    slot: &str,
) -> Option<StressFinding> {
    // Alpha is a number in any colour space.
    let is_colour = scene_facts.lookup.texture(&reference.name)?.colour_space == ColourSpace::Srgb
        && reference.channel != Some(Channel::Alpha);
    let has_codes = matches!(
        image_data(scene_facts, reference)?.pixels,
        PixelData::Codes(_)
    );
    let reason = format!(
        "its `{slot}` needs directions or numbers, but the texture `{}` is read as sRGB colours",
        reference.name
    );
    let remedy = format!(
        "set `colour_space = \"linear\"` for the texture `{}`",
        reference.name
    );
    (is_colour && has_codes).then(|| {
        StressFinding::new(
            FindingCode::DataReadAsColour,
            Severity::PictureWrong,
            subject,
            reason,
            remedy,
        )
    })
}

/// Returns a finding if an image used as a normal map holds no normals. In a normal map, blue is
/// above one half in most texels.
fn normal_map_finding(
    scene_facts: &SceneFacts<'_>,
    reference: &TextureRef,
) -> Option<StressFinding> {
    let (image, data) = (
        image_index(scene_facts, reference)?,
        image_data(scene_facts, reference)?,
    );
    let PixelData::Codes(pixels) = &data.pixels else {
        return None;
    };
    let inwards = pixels.iter().filter(|pixel| pixel[2] < 128).count();
    let reason = "it is used as a normal map, but most of its directions point into the surface: it probably holds heights or colours";
    let remedy = "use a map of normals, whose colour is mostly light blue";
    let finding = StressFinding::new(
        FindingCode::NotANormalMap,
        Severity::PictureWrong,
        FindingSubject::Image(image),
        reason,
        remedy,
    );
    (2 * inwards > pixels.len()).then(|| {
        let total = pixels.len() as u64;
        finding.with_count(inwards as u64, total, "texels", "pointed inwards")
    })
}

fn check_image(scene_facts: &SceneFacts<'_>, index: usize) -> Vec<StressFinding> {
    let subject = FindingSubject::Image(index);
    let Some(data) = scene_facts.scene.images[index].data.as_deref() else {
        return Vec::new();
    };
    let texels = u64::from(data.width) * u64::from(data.height);
    let mut findings = Vec::new();
    let remedy = "export the image again, with finite numbers of 0 or more";
    let repaired = scene_facts.scene.images[index].mended;
    if repaired > 0 {
        let reason = "channels of its texels are infinite or NaN; 65504 and 0 are used instead";
        let finding = StressFinding::new(
            FindingCode::ImageNotLight,
            Severity::PictureWrong,
            subject,
            reason,
            remedy,
        );
        findings.push(finding.with_count(repaired, 3 * texels, "channels", "had such numbers"));
    }
    if let PixelData::Linear(pixels) = &data.pixels {
        let is_wrong = |pixel: &&[f32; 4]| {
            pixel
                .iter()
                .any(|channel| !channel.is_finite() || *channel < 0.0)
        };
        let wrong = pixels.iter().filter(is_wrong).count() as u64;
        if wrong > 0 {
            let reason = "it has texels that are negative, infinite or NaN";
            let finding = StressFinding::new(
                FindingCode::ImageNotLight,
                Severity::PictureWrong,
                subject,
                reason,
                remedy,
            );
            findings.push(finding.with_count(wrong, texels, "texels", "had such numbers"));
        }
    }
    findings
}
