//! Images: of one colour, of numbers that light can't have, and such that are read as what they are
//! not.

use super::facts::SceneFacts;
use super::finding::{Code, Finding, Severity, Subject};
use crate::scene::{ColourSpace, ImageData, Model, Pixels, Sky, TextureRef};

/// What is wrong with the images that shown materials and the sky read.
pub(super) fn check(facts: &SceneFacts<'_>) -> Vec<Finding> {
    let mut images: Vec<usize> = Vec::new();
    let mut found = Vec::new();
    for (index, material) in facts.used_materials() {
        for reference in material.textures() {
            images.extend(image_of(facts, reference));
        }
        let Model::Physical(m) = &material.model else {
            continue;
        };
        let coat = m.clearcoat.as_ref();
        let normals = [
            ("normal_texture", m.normal_texture.as_ref()),
            (
                "clearcoat.normal_texture",
                coat.and_then(|coat| coat.normal_texture.as_ref()),
            ),
        ];
        let directions = m.anisotropy.as_ref();
        let numbers = [
            (
                "metallic_roughness_texture",
                m.metallic_roughness_texture.as_ref(),
            ),
            ("transmission_texture", m.transmission_texture.as_ref()),
            (
                "anisotropy.texture",
                directions.and_then(|layer| layer.texture.as_ref()),
            ),
        ];
        for (slot, reference) in normals.into_iter().chain(numbers) {
            let subject = Subject::Material(index);
            found.extend(reference.and_then(|r| read_as_colour(facts, r, subject, slot)));
        }
        for reference in normals.into_iter().filter_map(|(_, reference)| reference) {
            found.extend(no_normals(facts, reference));
        }
    }
    if let Some(Sky::Map(map)) = &facts.scene.sky {
        images.extend(facts.lookup.images.get(&map.image));
    }
    images.sort_unstable();
    images.dedup();
    found.extend(images.into_iter().flat_map(|index| judge(facts, index)));
    found
}

fn image_of(facts: &SceneFacts<'_>, reference: &TextureRef) -> Option<usize> {
    facts
        .lookup
        .images
        .get(&facts.lookup.texture(&reference.name)?.image)
}

fn data_of<'a>(facts: &SceneFacts<'a>, reference: &TextureRef) -> Option<&'a ImageData> {
    facts.scene.images[image_of(facts, reference)?]
        .data
        .as_deref()
}

fn read_as_colour(
    facts: &SceneFacts<'_>,
    reference: &TextureRef,
    subject: Subject,
    slot: &str,
) -> Option<Finding> {
    let is_colour = facts.lookup.texture(&reference.name)?.colour_space == ColourSpace::Srgb;
    let has_codes = matches!(data_of(facts, reference)?.pixels, Pixels::Codes(_));
    let why = format!(
        "its `{slot}` holds directions or numbers, and the texture there, `{}`, is read as sRGB colours",
        reference.name
    );
    let remedy = format!(
        "give the texture `{}` the line `colour_space = \"linear\"`",
        reference.name
    );
    (is_colour && has_codes).then(|| {
        Finding::new(
            Code::DataReadAsColour,
            Severity::PictureWrong,
            subject,
            why,
            remedy,
        )
    })
}

/// An image of directions about the normal has much blue everywhere.
fn no_normals(facts: &SceneFacts<'_>, reference: &TextureRef) -> Option<Finding> {
    let (image, data) = (image_of(facts, reference)?, data_of(facts, reference)?);
    let Pixels::Codes(pixels) = &data.pixels else {
        return None;
    };
    let inwards = pixels.iter().filter(|pixel| pixel[2] < 128).count();
    let why = "it is used as a normal map, and most of its directions point into the surface: it holds heights or colours";
    let remedy = "use a map of normals, whose colour is mostly light blue";
    let finding = Finding::new(
        Code::NotANormalMap,
        Severity::PictureWrong,
        Subject::Image(image),
        why,
        remedy,
    );
    (2 * inwards > pixels.len()).then(|| {
        let of = pixels.len() as u64;
        finding.counted(inwards as u64, of, "texels", "pointed inwards")
    })
}

fn judge(facts: &SceneFacts<'_>, index: usize) -> Vec<Finding> {
    let subject = Subject::Image(index);
    let Some(data) = facts.scene.images[index].data.as_deref() else {
        let why = "it could not be read, and the factor alone counts";
        let finding = Finding::new(
            Code::MissingImage,
            Severity::PictureWrong,
            subject,
            why,
            "put the file where the scene names it",
        );
        return vec![finding];
    };
    let texels = u64::from(data.width) * u64::from(data.height);
    let mut found = Vec::new();
    let remedy = "write the image anew, with finite numbers of zero or more";
    let mended = facts.scene.images[index].mended;
    if mended > 0 {
        let why =
            "channels of its texels are infinite or no numbers; 65504 and 0 are shown for them";
        let finding = Finding::new(
            Code::ImageNotLight,
            Severity::PictureWrong,
            subject,
            why,
            remedy,
        );
        found.push(finding.counted(mended, 3 * texels, "channels", "had such numbers"));
    }
    let is_uniform = match &data.pixels {
        Pixels::Codes(pixels) => pixels.iter().all(|pixel| *pixel == pixels[0]),
        Pixels::Linear(pixels) => {
            let is_wrong = |pixel: &&[f32; 4]| {
                pixel
                    .iter()
                    .any(|channel| !channel.is_finite() || *channel < 0.0)
            };
            let wrong = pixels.iter().filter(is_wrong).count() as u64;
            if wrong > 0 {
                let why = "it has texels that are negative, infinite or no numbers";
                let finding = Finding::new(
                    Code::ImageNotLight,
                    Severity::PictureWrong,
                    subject,
                    why,
                    remedy,
                );
                found.push(finding.counted(wrong, texels, "texels", "had such numbers"));
            }
            pixels.iter().all(|pixel| *pixel == pixels[0])
        }
    };
    if is_uniform {
        let why = "all its texels are the same";
        let finding = Finding::new(
            Code::UniformImage,
            Severity::Harmless,
            subject,
            why,
            "write the value as a factor: it takes no memory and no time",
        );
        found.push(finding.counted(texels, 0, "texels", "in all"));
    }
    found
}
