//! Decoding of OpenEXR pictures: choice of the part and its channels, and placement of the data
//! window in the display window. Colours are converted to the primaries of Rec. 709.

use std::io::Cursor;

use exr::meta::header::Header;
use exr::prelude::{
    IntegerBounds, MetaData, ReadChannels, ReadLayers, ReadSpecificChannel, Text, Vec2, read,
};
use raywright_core::scene::{ImageData, PixelData};

use super::primaries::{convert_colour, matrix_to_rec_709};
use super::radiance::{GREATEST, InvalidRadianceCounts};
use super::{DecodedImage, check_size};
use crate::Limits;
use crate::import::{Fault, ImportResult, sanitise_text};

fn exr_fault(error: exr::error::Error) -> Fault {
    fault!("is a broken EXR picture ({error})")
}

/// Colour channels of a part: red, green and blue, or a single luminance.
#[derive(Clone, Debug)]
struct ColourChannels {
    /// Name of the layer with its final dot; empty without a layer.
    layer: String,
    /// Names of the red, green and blue channels, or of the luminance channel alone.
    names: Vec<Text>,
    alpha: Option<Text>,
}

/// Splits a channel name into the layer, with its final dot, and the name within the layer.
fn split_channel_name(channel: &str) -> (&str, &str) {
    channel
        .rfind('.')
        .map_or(("", channel), |dot| channel.split_at(dot + 1))
}

impl ColourChannels {
    /// Returns the pictures of a part and of its layers, in the order of the file.
    fn list_pictures(header: &Header) -> Vec<Self> {
        let names: Vec<(String, &Text)> = header
            .channels
            .list
            .iter()
            .map(|channel| (channel.name.to_string(), &channel.name))
            .collect();
        let mut layers: Vec<&str> = names
            .iter()
            .map(|(name, _)| split_channel_name(name).0)
            .collect();
        layers.dedup();
        let find = |layer: &str, requested: &str| {
            let fits = |name: &str| {
                split_channel_name(name).0 == layer
                    && split_channel_name(name).1.eq_ignore_ascii_case(requested)
            };
            names
                .iter()
                .find(|(name, _)| fits(name))
                .map(|&(_, text)| text.clone())
        };
        let picture = |layer: &str| {
            let colours: Vec<Text> = ["R", "G", "B"]
                .into_iter()
                .filter_map(|name| find(layer, name))
                .collect();
            let is_chroma = find(layer, "RY").is_some() || find(layer, "BY").is_some();
            let grey = find(layer, "Y").filter(|_| !is_chroma);
            let names = if colours.len() == 3 {
                colours
            } else {
                vec![grey?]
            };
            Some(Self {
                layer: layer.to_owned(),
                names,
                alpha: find(layer, "A"),
            })
        };
        layers.into_iter().filter_map(picture).collect()
    }
}

/// The picture that was chosen among the parts and layers of a file.
struct ChosenPicture<'m> {
    header: &'m Header,
    channels: ColourChannels,
    /// Remark about the choice, if the file has several pictures or if the chosen picture is in a
    /// layer.
    remark: Option<String>,
}

/// Chooses the first picture outside any layer; without such a picture, the picture of the first
/// layer.
fn choose_picture(meta: &MetaData) -> ImportResult<ChosenPicture<'_>> {
    let flat = || meta.headers.iter().filter(|header| !header.deep);
    let all: Vec<(&Header, ColourChannels)> = flat()
        .flat_map(|header| {
            ColourChannels::list_pictures(header)
                .into_iter()
                .map(move |channels| (header, channels))
        })
        .collect();
    let plain = all.iter().filter(|(_, channels)| channels.layer.is_empty());
    let Some((header, channels)) = plain.clone().next().or(all.first()) else {
        let names = flat()
            .flat_map(|header| &header.channels.list)
            .map(|channel| channel.name.to_string());
        let names = sanitise_text(&names.collect::<Vec<_>>().join(", "));
        let read = "supported are R, G and B, or Y alone, each with or without A, also in layers; Y with RY and BY is not supported";
        return Err(fault!(
            "is an EXR picture without supported colour channels ({names}); {read}"
        ));
    };
    let part = header
        .own_attributes
        .layer_name
        .as_ref()
        .map(|name| format!(" `{}`", sanitise_text(&name.to_string())))
        .unwrap_or_default();
    let layer = sanitise_text(channels.layer.trim_end_matches('.'));
    let remark = match (channels.layer.is_empty(), all.len(), plain.count()) {
        (true, _, 0 | 1) => None,
        (true, _, parts) => Some(format!(
            "has {parts} parts with pictures; the first{part} is used"
        )),
        (false, 1, _) => Some(format!(
            "has its colours in the layer `{layer}`, which is used"
        )),
        (false, layers, _) => Some(format!(
            "has {layers} layers with pictures; the first, `{layer}`, is used"
        )),
    };
    Ok(ChosenPicture {
        header,
        channels: channels.clone(),
        remark,
    })
}

/// Reads the headers of all parts, and checks their sizes and those of blocks with DWA
/// compression.
fn read_headers(bytes: &[u8], limits: &Limits) -> ImportResult<MetaData> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(exr_fault)?;
    for header in &meta.headers {
        for size in [
            header.layer_size,
            header.shared_attributes.display_window.size,
        ] {
            check_size(size.0 as u64, size.1 as u64, limits)?;
        }
    }
    crate::output::check_dwa_blocks(bytes, &meta.headers).map_err(exr_fault)?;
    Ok(meta)
}

/// Returns the width and height of the display window or of the data window, whichever is larger:
/// the decoder allocates this number of pixels.
///
/// # Errors
///
/// As [`decode`], for all faults that headers show.
pub(super) fn read_size(bytes: &[u8], limits: &Limits) -> ImportResult<[u32; 2]> {
    let meta = read_headers(bytes, limits)?;
    let header = choose_picture(&meta)?.header;
    let larger = [
        header.layer_size,
        header.shared_attributes.display_window.size,
    ]
    .into_iter()
    .max_by_key(|size| size.area());
    // The area is at most `image_pixels`, which also bounds each side.
    Ok(larger.map_or([0; 2], |size| [size.0 as u32, size.1 as u32]))
}

/// Decodes the picture in the display window: data outside the window is cropped, and pixels
/// without data are black and transparent.
///
/// # Errors
/// A fault of kind limit for an oversized picture, of kind input for a broken or unsupported one.
pub(super) fn decode(bytes: &[u8], limits: &Limits) -> ImportResult<DecodedImage> {
    let meta = read_headers(bytes, limits)?;
    let ChosenPicture {
        header,
        channels,
        remark,
    } = choose_picture(&meta)?;
    let window = header.shared_attributes.display_window;
    let data = IntegerBounds::new(header.own_attributes.layer_position, header.layer_size);
    let mut pixels = read_channels(bytes, &channels)?;
    if pixels.len() != data.size.area() {
        return Err(fault!("is a broken EXR picture (wrong number of pixels)"));
    }
    if data != window {
        pixels = crop_to_window(&pixels, data, window)?;
    }
    let mut unusable = InvalidRadianceCounts::default();
    pixels
        .as_flattened_mut()
        .iter_mut()
        .for_each(|value| *value = unusable.repair_channel_value(*value));
    let (width, height) = (window.size.0 as u32, window.size.1 as u32);
    let mut remarks: Vec<_> = remark.into_iter().chain(unusable.summary()).collect();
    if channels.names.len() == 3 {
        match matrix_to_rec_709(header.shared_attributes.chromaticities) {
            Ok(None) => {}
            Ok(Some(matrix)) => pixels.iter_mut().for_each(|[r, g, b, _]| {
                // Colours outside the gamut of Rec. 709 have negative channels.
                [*r, *g, *b] =
                    convert_colour(&matrix, [*r, *g, *b]).map(|value| value.clamp(0.0, GREATEST));
            }),
            Err(remark) => remarks.push(remark.to_owned()),
        }
    }
    Ok(DecodedImage {
        image: ImageData {
            width,
            height,
            pixels: PixelData::Linear(pixels),
        },
        remarks,
        repaired_count: unusable.repaired_count(),
    })
}

/// Crops or pads the pixels of the data window to the size of the display window; added pixels are
/// black and transparent.
fn crop_to_window(
    pixels: &[[f32; 4]],
    data: IntegerBounds,
    window: IntegerBounds,
) -> ImportResult<Vec<[f32; 4]>> {
    let offset = |axis: fn(Vec2<i32>) -> i32| {
        i64::from(axis(window.position)) - i64::from(axis(data.position))
    };
    let (left, top) = (offset(|at| at.0), offset(|at| at.1));
    // Columns `start..end` of the display window have data, which begins at column `first` of the
    // data window.
    let start = (-left).clamp(0, window.size.0 as i64) as usize;
    let end = (data.size.0 as i64 - left).clamp(start as i64, window.size.0 as i64) as usize;
    let first = (start as i64 + left).max(0) as usize;
    let mut out = vec![[0.0; 4]; window.size.area()];
    let mut is_seen = false;
    for (y, row) in out.chunks_exact_mut(window.size.0).enumerate() {
        let source = usize::try_from(y as i64 + top)
            .ok()
            .and_then(|y| pixels.chunks_exact(data.size.0).nth(y));
        if let Some(source) = source.filter(|_| end > start) {
            row[start..end].copy_from_slice(&source[first..first + (end - start)]);
            is_seen = true;
        }
    }
    if is_seen {
        Ok(out)
    } else {
        Err(fault!(
            "is an EXR picture whose data window lies outside the display window"
        ))
    }
}

/// Reads the colour and alpha channels of the first part that has these channels. Returns the
/// pixels as red, green, blue and alpha.
fn read_channels(bytes: &[u8], channels: &ColourChannels) -> ImportResult<Vec<[f32; 4]>> {
    type PixelBuffer = (usize, Vec<[f32; 4]>);
    fn allocate_pixels(size: Vec2<usize>) -> PixelBuffer {
        (size.0, vec![[0.0; 4]; size.area()])
    }
    fn store_pixel((width, pixels): &mut PixelBuffer, at: Vec2<usize>, pixel: [f32; 4]) {
        if let Some(slot) = pixels.get_mut(at.1 * *width + at.0) {
            *slot = pixel;
        }
    }
    // For a picture without alpha, `alpha` is the empty name, which no channel has.
    let alpha = channels
        .alpha
        .clone()
        .unwrap_or_else(|| Text::new_or_panic(""));
    let reader = read().no_deep_data().largest_resolution_level();
    let of_file = || Cursor::new(bytes);
    let stored = match channels.names.as_slice() {
        [grey] => reader
            .specific_channels()
            .required(grey.clone())
            .optional(alpha, 1.0_f32)
            .collect_pixels(
                |size, _| allocate_pixels(size),
                |stored: &mut PixelBuffer, at, (y, a): (f32, f32)| {
                    store_pixel(stored, at, [y, y, y, a])
                },
            )
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(of_file())
            .map(|image| image.layer_data.channel_data.pixels),
        [red, green, blue, ..] => reader
            .specific_channels()
            .required(red.clone())
            .required(green.clone())
            .required(blue.clone())
            .optional(alpha, 1.0_f32)
            .collect_pixels(
                |size, _| allocate_pixels(size),
                |stored: &mut PixelBuffer, at, (r, g, b, a): (f32, f32, f32, f32)| {
                    store_pixel(stored, at, [r, g, b, a])
                },
            )
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(of_file())
            .map(|image| image.layer_data.channel_data.pixels),
        _ => {
            return Err(fault!(
                "is a broken EXR picture (its colour channels cannot be read)"
            ));
        }
    };
    stored.map(|(_, pixels)| pixels).map_err(exr_fault)
}
