//! Contact sheet: many small pictures side by side, each with a line of text below.

use std::io;
use std::path::Path;

use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage, RgbaImage};
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use raywright_core::display::{Display, OutputFormat};
use raywright_core::picture::Picture;

use super::atomic::write_atomically;
use super::metadata::PictureMetadata;
use super::png::encode_codes;
use crate::error::Error;

/// Largest width of a picture in pixels, which a sheet of few pictures uses.
const MAX_PICTURE_WIDTH: u32 = 480;
/// Least width of a cell in pixels, which a sheet of many pictures uses.
const MIN_PICTURE_WIDTH: u32 = 160;
/// Total width of a sheet in pixels.
const SHEET_WIDTH: u32 = 2560;
/// Gap between and around pictures in pixels.
const GAP: u32 = 12;
/// Height of a text line with its margins in pixels.
const LINE_HEIGHT: u32 = 24;
/// Colour of the background, as 8-bit sRGB codes.
const BACKGROUND: [u8; 3] = [28; 3];
/// Colour of the text, as 8-bit sRGB codes.
const TEXT_COLOUR: [u8; 3] = [230; 3];

/// A contact sheet: a PNG with many small pictures in a grid, each with a line of text below.
/// Pictures are added one by one.
#[derive(Debug)]
pub struct ContactSheet {
    columns: u32,
    width: u32,
    cells: Vec<SheetCell>,
}

#[derive(Debug)]
struct SheetCell {
    picture: RgbImage,
    label: String,
}

impl ContactSheet {
    /// Creates an empty sheet that has room for `pictures` pictures.
    pub fn new(pictures: usize) -> Self {
        let pictures = u32::try_from(pictures).unwrap_or(u32::MAX).max(1);
        // A square grid of cells gives the sheet the aspect ratio of its pictures.
        let columns = f64::from(pictures).sqrt().ceil() as u32;
        let width = ((SHEET_WIDTH - GAP) / columns)
            .saturating_sub(GAP)
            .clamp(MIN_PICTURE_WIDTH, MAX_PICTURE_WIDTH);
        Self {
            columns,
            width,
            cells: Vec::new(),
        }
    }

    /// Adds a picture, converted for display, with its label.
    pub fn add_picture(&mut self, picture: &Picture, display: Display, label: impl Into<String>) {
        let image = composite_over_background(
            picture,
            Display {
                output: OutputFormat::Eight,
                ..display
            },
        );
        let [width, height] = [image.width(), image.height()];
        let factor = (f64::from(self.width) / f64::from(width))
            .min(f64::from(self.width) / f64::from(height))
            .min(1.0);
        let [small, low] =
            [width, height].map(|edge| ((f64::from(edge) * factor).round() as u32).max(1));
        let picture = if small < width {
            imageops::resize(&image, small, low, FilterType::Triangle)
        } else {
            image
        };
        self.cells.push(SheetCell {
            picture,
            label: label.into(),
        });
    }

    /// Whether the sheet is empty.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Writes the sheet as PNG, atomically.
    ///
    /// # Errors
    /// Of kind [`File`](crate::ErrorKind::File) if the file cannot be written.
    pub fn write(&self, path: &Path, metadata: &PictureMetadata) -> Result<(), Error> {
        let bytes = self
            .to_png(metadata)
            .map_err(|cause| Error::unwritable(path, &cause))?;
        write_atomically(path, &bytes)
    }

    /// Encodes the sheet as PNG.
    ///
    /// # Errors
    /// A sheet too large for the format.
    pub fn to_png(&self, metadata: &PictureMetadata) -> io::Result<Vec<u8>> {
        encode_image(&self.draw_rows(), Display::PLAIN, metadata)
    }

    /// Draws the rows of pictures from the top. A row is as high as its highest picture; its
    /// pictures are aligned at the bottom.
    fn draw_rows(&self) -> RgbImage {
        let columns = self.columns.min(self.cells.len().max(1) as u32);
        let cell = self
            .cells
            .iter()
            .map(|cell| cell.picture.width())
            .max()
            .unwrap_or(1)
            .max(MIN_PICTURE_WIDTH);
        let rows: Vec<&[SheetCell]> = self.cells.chunks(columns as usize).collect();
        let height_of = |row: &[SheetCell]| {
            row.iter()
                .map(|cell| cell.picture.height())
                .max()
                .unwrap_or(0)
        };
        let height = GAP
            + rows
                .iter()
                .map(|row| height_of(row) + LINE_HEIGHT + GAP)
                .sum::<u32>();
        let mut sheet = RgbImage::from_pixel(GAP + columns * (cell + GAP), height, Rgb(BACKGROUND));
        let mut top = GAP;
        for row in rows {
            let foot = top + height_of(row);
            for (column, SheetCell { picture, label }) in (0..).zip(row) {
                let left = GAP + column * (cell + GAP);
                let (x, y) = (left + (cell - picture.width()) / 2, foot - picture.height());
                imageops::replace(&mut sheet, picture, x.into(), y.into());
                draw_text_line(
                    &mut sheet,
                    [left, foot + (LINE_HEIGHT - FONT.val() as u32) / 2],
                    cell,
                    label,
                );
            }
            top = foot + LINE_HEIGHT + GAP;
        }
        sheet
    }
}

/// Composites a picture over the background of the sheet, and returns 8-bit codes.
fn composite_over_background(picture: &Picture, display: Display) -> RgbImage {
    let codes = display.to_codes(picture);
    let (width, height) = (picture.width, picture.height);
    let empty = || RgbImage::from_pixel(width, height, Rgb(BACKGROUND));
    if !display.has_alpha(picture) {
        return RgbImage::from_raw(width, height, codes).unwrap_or_else(empty);
    }
    let mut sheet = empty();
    for (under, over) in sheet.pixels_mut().zip(
        RgbaImage::from_raw(width, height, codes)
            .iter()
            .flat_map(RgbaImage::pixels),
    ) {
        let [red, green, blue, alpha] = over.0.map(u32::from);
        let mixed = |over: u32, under: u8| {
            ((over * alpha + u32::from(under) * (255 - alpha) + 127) / 255) as u8
        };
        under.0 = [
            mixed(red, under.0[0]),
            mixed(green, under.0[1]),
            mixed(blue, under.0[2]),
        ];
    }
    sheet
}

const FONT: RasterHeight = RasterHeight::Size16;

/// Draws a line of text, centred in `width` pixels. A text that is too long is shortened in the
/// middle, because names differ at their ends.
fn draw_text_line(sheet: &mut RgbImage, [left, top]: [u32; 2], width: u32, text: &str) {
    let line = shorten_text(text, (width / letter_width()) as usize);
    let start = left + width.saturating_sub(line.len() as u32 * letter_width()) / 2;
    draw_letters(sheet, [start, top], &line, TEXT_COLOUR);
}

/// Distance in pixels from the start of a letter to the start of the next letter.
fn letter_width() -> u32 {
    get_raster_width(FontWeight::Regular, FONT) as u32
}

/// Draws a line of letters whose top left corner is at the pixel `[start, top]`, clipped to the
/// image.
fn draw_letters(sheet: &mut RgbImage, [start, top]: [u32; 2], line: &[char], ink: [u8; 3]) {
    for (i, &letter) in (0..).zip(line) {
        let raster = get_raster(letter, FontWeight::Regular, FONT)
            .or_else(|| get_raster('?', FontWeight::Regular, FONT));
        for (y, row) in (top..).zip(raster.iter().flat_map(|letter| letter.raster())) {
            for (x, &share) in (start + i * letter_width()..).zip(row.iter()) {
                let Some(pixel) = sheet.get_pixel_mut_checked(x, y) else {
                    continue;
                };
                for (code, ink) in pixel.0.iter_mut().zip(ink) {
                    *code = (f32::from(*code)
                        + (f32::from(ink) - f32::from(*code)) * f32::from(share) / 255.0)
                        .round() as u8;
                }
            }
        }
    }
}

/// Shortens a text to `maximum` letters, with dots in place of the middle.
fn shorten_text(text: &str, maximum: usize) -> Vec<char> {
    const DOTS: &str = "...";
    let letters: Vec<char> = text.chars().collect();
    if letters.len() <= maximum {
        return letters;
    }
    let kept = maximum.saturating_sub(DOTS.len());
    let (head, tail) = (kept - kept / 2, kept / 2);
    let parts = [
        &letters[..head],
        &DOTS.chars().collect::<Vec<_>>(),
        &letters[letters.len() - tail..],
    ];
    parts.concat()
}

// Writing of a picture with rings and labels around given points.

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
    let bytes =
        encode_image(&image, display, metadata).map_err(|cause| Error::unwritable(path, &cause))?;
    write_atomically(path, &bytes)
}

fn encode_image(
    image: &RgbImage,
    display: Display,
    metadata: &PictureMetadata,
) -> io::Result<Vec<u8>> {
    let size = [image.width(), image.height()];
    encode_codes(image, size, false, display, metadata)
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
    use crate::output::read::decode_picture;

    fn plain(width: u32, height: u32, grey: f32) -> Picture {
        Picture {
            rgb: vec![[grey; 3]; width as usize * height as usize],
            ..Picture::new(width, height)
        }
    }

    /// Protects: pictures are laid out in rows in their order, reduced where larger than their cell
    /// and never enlarged, each above its own text; transparent ones show the sheet's background.
    #[test]
    fn pictures_lie_in_rows() {
        let mut sheet = ContactSheet::new(3);
        sheet.add_picture(&plain(960, 480, 1.0), Display::PLAIN, "first");
        sheet.add_picture(&plain(100, 50, 0.0), Display::PLAIN, "");
        sheet.add_picture(
            &Picture {
                alpha: Some(vec![0.0; 480 * 240]),
                ..plain(480, 240, 0.0)
            },
            Display::PLAIN,
            "third",
        );
        let image = sheet.draw_rows();
        assert_eq!(
            [image.width(), image.height()],
            [3 * GAP + 2 * 480, 3 * GAP + 2 * (240 + LINE_HEIGHT)]
        );
        let at = |x: u32, y: u32| image.get_pixel(x, y).0;
        assert_eq!([at(GAP, GAP), at(GAP + 479, GAP + 239)], [[255; 3]; 2]);
        assert_eq!(
            at(2 * GAP + 480 + 240, GAP + 239),
            [0; 3],
            "a small one stands at the foot of its place"
        );
        assert_eq!(at(2 * GAP + 480 + 240, GAP + 100), BACKGROUND);
        let edges = [189, 190, 289, 290].map(|x| at(2 * GAP + 480 + x, GAP + 239));
        assert_eq!(
            edges,
            [BACKGROUND, [0; 3], [0; 3], BACKGROUND],
            "it stands in the middle"
        );
        assert_eq!(
            at(GAP + 240, 2 * GAP + 240 + LINE_HEIGHT + 120),
            BACKGROUND,
            "nothing covers the third"
        );
        let ink = |left: u32, top: u32| {
            let line = image::imageops::crop_imm(&image, left, top, 480, LINE_HEIGHT).to_image();
            line.pixels().filter(|pixel| pixel.0[0] > 150).count()
        };
        assert!(
            ink(GAP, GAP + 240) > 40 && ink(2 * GAP + 480, GAP + 240) == 0,
            "{}",
            ink(GAP, GAP + 240)
        );
        let bytes = sheet.to_png(&PictureMetadata::default()).expect("a PNG");
        assert_eq!(
            decode_picture(Path::new("s"), &bytes, &Limits::default())
                .expect("a PNG")
                .picture
                .width,
            image.width()
        );
    }

    /// Protects: a picture higher than wide is at most as high as its cell is wide.
    #[test]
    fn high_pictures_fit_their_place() {
        let mut sheet = ContactSheet::new(4);
        sheet.add_picture(&plain(300, 1200, 1.0), Display::PLAIN, "high");
        let image = sheet.draw_rows();
        assert_eq!(
            [image.width(), image.height()],
            [2 * GAP + MIN_PICTURE_WIDTH, 2 * GAP + 480 + LINE_HEIGHT]
        );
        let edge = |x: u32| image.get_pixel(GAP + x, GAP + 200).0;
        assert_eq!(
            [19, 20, 139, 140].map(edge),
            [BACKGROUND, [255; 3], [255; 3], BACKGROUND]
        );
    }

    /// Protects: a long text keeps both ends and fits its cell.
    #[test]
    fn long_texts_lose_their_middle() {
        let short =
            |text: &str, maximum| shorten_text(text, maximum).into_iter().collect::<String>();
        assert_eq!(
            [
                short("abcdefghij", 10),
                short("abcdefghijk", 10),
                short("abc", 2)
            ],
            ["abcdefghij", "abcd...ijk", "..."]
        );
    }
}

#[cfg(test)]
mod marks_tests {
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
