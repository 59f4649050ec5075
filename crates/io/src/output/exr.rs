//! OpenEXR output: linear 32-bit floating point, in a single part, with all layers.

use std::io::{self, Cursor};

use exr::meta::attribute::IntegerBounds;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image,
    Layer, LayerAttributes, LineOrder, SmallVec, Text, Vec2, WritableImage,
};
use raywright_core::picture::{DataWindow, Picture};

use super::metadata::{PictureMetadata, SOFTWARE};
use crate::image_file::primaries::REC_709;

/// Encodes the picture as OpenEXR: one part, scan lines, ZIP compression.
///
/// - The channels are `R`, `G` and `B`, `A` for coverage (associated alpha), and a channel for each
///   layer under the layer's name.
/// - The metadata are text attributes.
/// - The display window is the whole picture, and the data window its rendered part.
/// - Every finite number is stored exactly. An infinite colour is stored as the largest finite
///   number of its sign, because infinities spoil every later filter. A NaN stays NaN, because no
///   number could replace it. Layers are stored unchanged.
/// - The same picture gives the same bytes.
///
/// # Errors
///
/// A picture with inconsistent buffers.
pub(crate) fn encode_exr(picture: &Picture, metadata: &PictureMetadata) -> io::Result<Vec<u8>> {
    super::check_buffer_sizes(picture)?;
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = (picture.width as usize, picture.height as usize);
    let whole = DataWindow {
        origin: [0; 2],
        full: [picture.width, picture.height],
    };
    let DataWindow {
        origin: [x, y],
        full: [width, height],
    } = picture.window.unwrap_or(whole);
    let place = LayerAttributes {
        layer_position: Vec2(x, y),
        ..LayerAttributes::default()
    };
    let layer = Layer::new(
        size,
        place,
        encoding,
        AnyChannels::sort(build_channels(picture)),
    );
    let mut image = Image::from_layer(layer);
    let text = |text: &str| Text::from_slice_unchecked(text.as_bytes());
    image.attributes.display_window = IntegerBounds::new((0, 0), (width as usize, height as usize));
    image.attributes.chromaticities = Some(REC_709);
    for (_, name, value) in metadata.entries() {
        if name == SOFTWARE {
            image.layer_data.attributes.software_name = Some(text(&value));
        } else {
            image
                .attributes
                .other
                .insert(text(name), AttributeValue::Text(text(&value)));
        }
    }
    let mut bytes = Vec::new();
    image
        .write()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(io::Error::other)?;
    sort_attributes(&mut bytes)?;
    Ok(bytes)
}

fn build_channels(picture: &Picture) -> SmallVec<[AnyChannel<FlatSamples>; 4]> {
    let channel = |name: &str, samples: Vec<f32>, is_colour: bool| AnyChannel {
        name: Text::from_slice_unchecked(name.as_bytes()),
        sample_data: FlatSamples::F32(samples),
        quantize_linearly: !is_colour,
        sampling: Vec2(1, 1),
    };
    let finite = |x: f32| {
        if x.is_infinite() {
            f32::MAX.copysign(x)
        } else {
            x
        }
    };
    let colour = |c: usize| picture.rgb.iter().map(|rgb| finite(rgb[c])).collect();
    let mut channels: SmallVec<[_; 4]> = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(|(c, name)| channel(name, colour(c), true))
        .collect();
    channels.extend(
        picture
            .alpha
            .iter()
            .map(|alpha| channel("A", alpha.clone(), false)),
    );
    channels.extend(
        picture
            .layers
            .iter()
            .map(|layer| channel(&layer.name, layer.samples.clone(), false)),
    );
    channels
}

/// Sorts the attributes in an OpenEXR header by name. The encoder keeps some attributes in a hash
/// table, whose order differs from run to run. Sorting keeps the length of the header, so that
/// every offset in the file stays valid.
fn sort_attributes(bytes: &mut [u8]) -> io::Result<()> {
    /// Length in bytes of the magic number and the version, which precede the header.
    const START: usize = 8;
    let mut attributes: Vec<Vec<u8>> = Vec::new();
    let mut position = START;
    loop {
        let rest = bytes.get(position..).ok_or(io::ErrorKind::UnexpectedEof)?;
        let length = attribute_length(rest).ok_or(io::ErrorKind::UnexpectedEof)?;
        if length == 0 {
            break;
        }
        attributes.push(rest[..length].to_vec());
        position += length;
    }
    // Each attribute begins with its unique name and a NUL.
    attributes.sort();
    bytes[START..position].copy_from_slice(&attributes.concat());
    Ok(())
}

/// Returns the length in bytes of the attribute at the start of `header` (name, NUL, type, NUL,
/// four bytes of size, value); 0 at the end of the header.
fn attribute_length(header: &[u8]) -> Option<usize> {
    let name = header.iter().position(|&b| b == 0)?;
    if name == 0 {
        return Some(0);
    }
    let kind = header.get(name + 1..)?.iter().position(|&b| b == 0)?;
    let size_at = name + 1 + kind + 1;
    let size = u32::from_le_bytes(header.get(size_at..size_at + 4)?.try_into().ok()?);
    let length = size_at + 4 + size as usize;
    (length <= header.len()).then_some(length)
}
