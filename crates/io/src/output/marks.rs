//! Writing of a picture with rings and labels around given points.

use std::io;
use std::path::Path;

use image::{Rgb, RgbImage};
use raywright_core::display::{Display, OutputFormat};
use raywright_core::picture::Picture;

use super::atomic::write_atomically;
use super::metadata::PictureMetadata;
use super::png::create_encoder;
use super::sheet::{composite_over_background, draw_letters, letter_width};
use crate::error::Error;

/// A mark drawn over a picture: a ring around a point, with a label.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureMark {
    /// Position in pixels from the top left corner.
    pub pixel: [f64; 2],
    /// Text beside the ring.
    pub label: String,
    /// Colour of the ring, as 8-bit sRGB codes.
    pub colour: [u8; 3],
}

/// Radius of the ring in a large picture, in pixels.
const RADIUS: f64 = 11.0;
/// Half the width of the ring, dark outline included, in pixels.
const RING_HALF_WIDTH: f64 = 1.5;
/// Largest radius of the ring in a small picture, as a fraction of the picture's shorter edge.
const MAX_RADIUS_SHARE: f64 = 0.08;
/// Height of a letter in pixels.
const LETTER_HEIGHT: u32 = 16;
/// Colour of the note, as 8-bit sRGB codes.
const NOTE_COLOUR: [u8; 3] = [255; 3];

/// Writes a picture atomically as PNG, converted for display. Marks are drawn over the pixels. A
/// note is written in the lower left corner and cut to the width of the picture.
///
/// # Errors
/// Of kind [`File`](crate::ErrorKind::File) if the file cannot be written.
pub fn write_marked_picture(
    path: &Path,
    picture: &Picture,
    display: Display,
    marks: &[PictureMark],
    note: &str,
    metadata: &PictureMetadata,
) -> Result<(), Error> {
    let display = Display {
        output: OutputFormat::Eight,
        ..display
    };
    let mut image = composite_over_background(picture, display);
    marks.iter().for_each(|mark| draw_mark(&mut image, mark));
    let room = (image.width() / letter_width()) as usize;
    let letters: Vec<char> = note.chars().take(room).collect();
    let top = image.height().saturating_sub(LETTER_HEIGHT + 1);
    draw_outlined_text(&mut image, [1, top], &letters, NOTE_COLOUR);
    let bytes = encode_marked_png(&image, display, metadata)
        .map_err(|cause| Error::unwritable(path, &cause))?;
    write_atomically(path, &bytes)
}

fn encode_marked_png(
    image: &RgbImage,
    display: Display,
    metadata: &PictureMetadata,
) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut writer = create_encoder(
        &mut bytes,
        [image.width(), image.height()],
        false,
        display,
        metadata,
    )?
    .write_header()?;
    writer.write_image_data(image)?;
    writer.finish()?;
    Ok(bytes)
}

/// Returns the radius of the rings of marks, in pixels, for a picture of this width and height.
pub fn mark_radius([width, height]: [u32; 2]) -> f64 {
    RADIUS
        .min(MAX_RADIUS_SHARE * f64::from(width.min(height)))
        .max(2.0)
}

fn draw_mark(image: &mut RgbImage, mark: &PictureMark) {
    let [width, height] = [image.width(), image.height()];
    let radius = mark_radius([width, height]);
    let reach = radius + 2.0 * RING_HALF_WIDTH;
    let range = |axis: usize, edge: u32| {
        let [first, last] = [mark.pixel[axis] - reach, mark.pixel[axis] + reach + 1.0];
        (first.max(0.0) as u32)..(last.clamp(0.0, f64::from(edge)) as u32)
    };
    for (y, x) in range(1, height).flat_map(|y| range(0, width).map(move |x| (y, x))) {
        let away = (f64::from(x) + 0.5 - mark.pixel[0]).hypot(f64::from(y) + 0.5 - mark.pixel[1]);
        let off = (away - radius).abs();
        if off <= RING_HALF_WIDTH {
            image.put_pixel(
                x,
                y,
                Rgb(if off <= 0.6 * RING_HALF_WIDTH {
                    mark.colour
                } else {
                    [0; 3]
                }),
            );
        }
    }
    let letters: Vec<char> = mark.label.chars().collect();
    let room = width.saturating_sub(letters.len() as u32 * letter_width());
    let left = ((mark.pixel[0] + reach).max(0.0) as u32).min(room);
    let top = (mark.pixel[1] - 8.0).max(0.0) as u32;
    let top = top.min(height.saturating_sub(LETTER_HEIGHT));
    draw_outlined_text(image, [left, top], &letters, mark.colour);
}

fn draw_outlined_text(
    image: &mut RgbImage,
    [left, top]: [u32; 2],
    letters: &[char],
    colour: [u8; 3],
) {
    // A dark outline keeps the bright letters readable on any background.
    for [x, y] in [[0, 1], [2, 1], [1, 0], [1, 2]] {
        draw_letters(
            image,
            [(left + x).saturating_sub(1), (top + y).saturating_sub(1)],
            letters,
            [0; 3],
        );
    }
    draw_letters(image, [left, top], letters, colour);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::Limits;
    use crate::output::read_picture;

    /// Protects: a mark is a ring of its colour about its point, with its label beside it, and a
    /// note stands in the lower left corner; the rest of the picture is unchanged, and marks at or
    /// beyond the edge are clipped.
    #[test]
    fn marks_lie_over_the_picture() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("marked.png");
        let grey = Picture {
            rgb: vec![[0.5; 3]; 200 * 120],
            ..Picture::new(200, 120)
        };
        let mark = |x: f64, y: f64| PictureMark {
            pixel: [x, y],
            label: "7".to_owned(),
            colour: [255, 0, 0],
        };
        let marks = [mark(60.5, 60.5), mark(0.0, 119.0), mark(500.0, -40.0)];
        let note = "no mark: 4";
        write_marked_picture(
            &path,
            &grey,
            Display::PLAIN,
            &marks,
            note,
            &PictureMetadata::default(),
        )
        .expect("a file");
        let shown = read_picture(&path, &Limits::default())
            .expect("a picture")
            .picture;
        let radius = (MAX_RADIUS_SHARE * 120.0) as u32;
        assert_eq!(shown.pixel(60 + radius, 60), Some([1.0, 0.0, 0.0]));
        let plain = shown.pixel(150, 100).expect("a pixel");
        assert_eq!(
            (shown.pixel(60, 60), shown.pixel(60, 30)),
            (Some(plain), Some(plain))
        );
        let is_red = |x: u32, y: u32| {
            shown
                .pixel(x, y)
                .is_some_and(|pixel| pixel[0] > 0.8 && pixel[1] < 0.2)
        };
        let beside = (74..84)
            .flat_map(|x| (52..68).map(move |y| (x, y)))
            .filter(|&(x, y)| is_red(x, y))
            .count();
        assert!(beside > 5, "{beside}");
        let is_white = |&(x, y): &(u32, u32)| {
            let pixel = shown.pixel(x, y);
            pixel.is_some_and(|pixel| pixel.iter().all(|&channel| channel > 0.8))
        };
        let below = (0..100).flat_map(|x| (103..120).map(move |y| (x, y)));
        assert!(below.filter(is_white).count() > 20);
    }
}
