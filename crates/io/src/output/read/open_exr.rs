//! Decoding of OpenEXR pictures with any channels, in one or several parts.

use std::collections::BTreeMap;
use std::io::Cursor;

use exr::block::chunk::{Chunk, CompressedBlock};
use exr::meta::attribute::IntegerBounds;
use exr::meta::header::Header;
use exr::prelude::{
    AttributeValue, Compression, FlatImage, FlatSamples, MetaData, ReadChannels, ReadLayers, Text,
    Vec2, read,
};
use raywright_core::picture::{DataWindow, Encoding, Picture, PictureLayer};

use super::{PictureFailure, StoredPicture, check_size};
use crate::image_file::primaries::{convert_colour, matrix_to_rec_709};
use crate::limits::Limits;

/// Decodes an OpenEXR file with all its parts and channels.
pub(super) fn decode_exr(bytes: &[u8], limits: &Limits) -> Result<StoredPicture, PictureFailure> {
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false)?.headers;
    let mut bytes_a_pixel = 0;
    for header in &headers {
        check_exr_part(header, &headers[0])?;
        let Vec2(width, height) = header.layer_size;
        bytes_a_pixel += 4 * header.channels.list.len() as u64;
        check_size(
            width as u64,
            height as u64,
            bytes_a_pixel,
            bytes.len(),
            limits,
        )?;
    }
    check_dwa_blocks(bytes, &headers)?;
    let image: FlatImage = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    assemble_exr_picture(image)
}

/// Refuses an OpenEXR part with unsupported features, and a part whose size or position differs
/// from the first part.
fn check_exr_part(header: &Header, first: &Header) -> Result<(), PictureFailure> {
    let refuse = |label: &str| {
        Err(PictureFailure::Wrong(format!(
            "the OpenEXR file has {label}"
        )))
    };
    if header.layer_size != first.layer_size {
        return refuse("parts of different sizes, which are not supported");
    }
    if header.own_attributes.layer_position != first.own_attributes.layer_position {
        return refuse("parts at different positions, which are not supported");
    }
    if header.deep
        || header
            .channels
            .list
            .iter()
            .any(|channel| channel.sampling != Vec2(1, 1))
    {
        return refuse("deep or subsampled channels, which are not supported");
    }
    Ok(())
}

/// Checks the sizes that blocks with DWA compression state: the decoder of exr 1.74 trusts them,
/// so that a damaged file could make it allocate petabytes and abort.
///
/// # Errors
/// A block that cannot be read, or that states more values than its pixels have.
pub(crate) fn check_dwa_blocks(bytes: &[u8], headers: &[Header]) -> exr::error::Result<()> {
    /// Indices of the counters of uncompressed values among the eleven that open a block.
    const UNCOMPRESSED: [usize; 5] = [1, 6, 7, 8, 9];
    let is_dwa = |header: &&Header| {
        matches!(
            header.compression,
            Compression::DWAA(_) | Compression::DWAB(_)
        )
    };
    if !headers.iter().any(|header| is_dwa(&header)) {
        return Ok(());
    }
    for chunk in exr::block::read(Cursor::new(bytes), false)?.all_chunks(false)? {
        let Chunk {
            layer_index,
            compressed_block: block,
        } = chunk?;
        let Some(header) = headers.get(layer_index).filter(is_dwa) else {
            continue;
        };
        let data = match &block {
            CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
            CompressedBlock::Tile(block) => &block.compressed_pixels_le,
            CompressedBlock::DeepScanLine(_) | CompressedBlock::DeepTile(_) => continue,
        };
        let place = header.get_block_data_indices(&block)?;
        let Vec2(width, height) = header.get_absolute_block_pixel_coordinates(place)?.size;
        // A block that would not become smaller holds its pixels as they are.
        if data.len() == width * height * header.channels.bytes_per_pixel {
            continue;
        }
        // Transforms take 8 by 8 samples of at most four bytes, and run lengths may double them.
        let samples = width.next_multiple_of(8) * height.next_multiple_of(8);
        let most = 8 * (samples * header.channels.list.len()) as u64;
        let counters = data
            .as_chunks()
            .0
            .iter()
            .map(|&bytes| u64::from_le_bytes(bytes));
        let is_too_large = |(i, n): (usize, u64)| UNCOMPRESSED.contains(&i) && n > most;
        if counters.take(11).enumerate().any(is_too_large) {
            return Err(exr::error::Error::Invalid(
                "a DWA block states more values than its pixels have".into(),
            ));
        }
    }
    Ok(())
}

/// Assembles the picture from the decoded parts of a file.
fn assemble_exr_picture(image: FlatImage) -> Result<StoredPicture, PictureFailure> {
    let several = image.layer_data.len() > 1;
    let first = image
        .layer_data
        .first()
        .ok_or_else(|| PictureFailure::Wrong("the OpenEXR file contains no picture".to_owned()))?;
    let size = first.size;
    let dimension = |x: usize| {
        u32::try_from(x).map_err(|_| {
            PictureFailure::TooLarge(
                "the OpenEXR file has more than 4294967295 pixels in a row or column".to_owned(),
            )
        })
    };
    let window = data_window(
        image.attributes.display_window,
        first.attributes.layer_position,
        size,
    );
    let mut picture = Picture {
        window,
        ..Picture::new(dimension(size.0)?, dimension(size.1)?)
    };
    let mut texts = BTreeMap::new();
    let mut note =
        |name: &str, value: &Text| texts.insert(name.to_owned(), to_utf8_lossy(value.as_slice()));
    for (name, value) in &image.attributes.other {
        if let AttributeValue::Text(value) = value {
            note(&to_utf8_lossy(name.as_slice()), value);
        }
    }
    for part in image.layer_data {
        for (name, value) in &part.attributes.other {
            if let AttributeValue::Text(value) = value {
                note(&to_utf8_lossy(name.as_slice()), value);
            }
        }
        if let Some(software) = &part.attributes.software_name {
            note("software", software);
        }
        let prefix = match &part.attributes.layer_name {
            Some(name) if several => format!("{}.", to_utf8_lossy(name.as_slice())),
            _ => String::new(),
        };
        for channel in part.channel_data.list {
            let name = prefix.clone() + &to_utf8_lossy(channel.name.as_slice());
            picture.layers.push(PictureLayer {
                name,
                samples: to_f32(channel.sample_data),
            });
        }
    }
    let has = |name: &&str| picture.layers.iter().any(|layer| layer.name == **name);
    let is_rgb = ["R", "G", "B"].iter().all(has);
    let has_colour = move_colour_out_of_layers(&mut picture);
    match matrix_to_rec_709(image.attributes.chromaticities.filter(|_| is_rgb)) {
        Ok(None) => {}
        Ok(Some(matrix)) => {
            let convert = |rgb: &mut [f32; 3]| *rgb = convert_colour(&matrix, *rgb);
            picture.rgb.iter_mut().for_each(convert);
        }
        Err(remark) => drop(texts.insert("colours".to_owned(), remark.to_owned())),
    }
    if !picture.is_consistent() {
        return Err(PictureFailure::Wrong(
            "the OpenEXR file cannot be read: a channel does not match its width and height"
                .to_owned(),
        ));
    }
    Ok(StoredPicture {
        format_name: "OpenEXR",
        picture,
        encoding: Encoding::Linear,
        has_colour,
        texts,
    })
}

/// Returns the data window, the area that has pixels, relative to the display window; `None` if the
/// pixels fill the display window.
fn data_window(display: IntegerBounds, place: Vec2<i32>, size: Vec2<usize>) -> Option<DataWindow> {
    let origin = [
        place.0.saturating_sub(display.position.0),
        place.1.saturating_sub(display.position.1),
    ];
    let full = [display.size.0, display.size.1].map(|edge| u32::try_from(edge).unwrap_or(u32::MAX));
    (origin != [0; 2] || display.size != size).then_some(DataWindow { origin, full })
}

fn to_f32(samples: FlatSamples) -> Vec<f32> {
    match samples {
        FlatSamples::F16(samples) => samples.into_iter().map(|x| x.to_f32()).collect(),
        FlatSamples::F32(samples) => samples,
        FlatSamples::U32(samples) => samples.into_iter().map(|x| x as f32).collect(),
    }
}

/// Moves the colour channels (`R`, `G`, `B`, or `Y` alone as grey) and the coverage `A` from the
/// layers to the picture's own buffers. Returns whether the file has colour.
fn move_colour_out_of_layers(picture: &mut Picture) -> bool {
    let mut take = |name: &str| {
        let index = picture.layers.iter().position(|layer| layer.name == name)?;
        Some(picture.layers.swap_remove(index).samples)
    };
    let (red, green, blue) = (take("R"), take("G"), take("B"));
    let grey = if red.is_none() && green.is_none() && blue.is_none() {
        take("Y")
    } else {
        None
    };
    let has_colour = grey.is_some() || red.is_some() || green.is_some() || blue.is_some();
    if has_colour {
        picture.alpha = take("A");
    }
    for (c, samples) in [red, green, blue].iter().enumerate() {
        for (rgb, &x) in picture
            .rgb
            .iter_mut()
            .zip(grey.as_ref().or(samples.as_ref()).into_iter().flatten())
        {
            rgb[c] = x;
        }
    }
    picture.layers.sort_by(|a, b| a.name.cmp(&b.name));
    has_colour
}

fn to_utf8_lossy(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
