//! Division of a picture into square tiles, numbered row by row as in a film.

use crate::hash::splitmix64;
use crate::picture::Picture;
use crate::settings::Crop;

/// Least number of tiles, unless the picture has fewer: Student's factor is then 1.12 times the
/// normal one.
pub(super) const FEWEST_TILES: usize = 12;

/// Returns the edge in pixels of the tiles of a picture: a multiple of 8, at most 32. A picture has
/// four times the fewest tiles that are measured, unless their edge would be less than eight pixels.
pub(super) fn tile_edge(size: [u32; 2]) -> u32 {
    let [width, height] = size.map(f64::from);
    let edge = (width * height / (4 * FEWEST_TILES) as f64).sqrt() / 8.0;
    8 * (edge as u32).clamp(1, 4)
}

/// Returns the number of tiles of a picture.
pub(super) fn tile_count(size: [u32; 2]) -> usize {
    let edge = tile_edge(size);
    size.map(|pixels| pixels.div_ceil(edge) as usize)
        .iter()
        .product()
}

/// Returns the rectangle of a tile of a picture.
pub(super) fn tile_crop(size: [u32; 2], tile: u32) -> Crop {
    let edge = tile_edge(size);
    let columns = size[0].div_ceil(edge);
    let (x, y) = (tile % columns * edge, tile / columns * edge);
    Crop {
        x,
        y,
        width: edge.min(size[0] - x),
        height: edge.min(size[1] - y),
    }
}

/// Returns the numbers of the tiles that a rectangle of a picture touches, in ascending order.
pub(super) fn tiles_of_crop(size: [u32; 2], crop: Crop) -> Vec<u32> {
    let touches = |&tile: &u32| {
        let of = tile_crop(size, tile);
        of.x < crop.x + crop.width
            && crop.x < of.x + of.width
            && of.y < crop.y + crop.height
            && crop.y < of.y + of.height
    };
    (0..tile_count(size) as u32).filter(touches).collect()
}

/// Returns the numbers of all tiles of a picture. For every n, the first n tiles are spread evenly
/// over the picture: their keys are multiples of the golden ratio along rows in alternating
/// direction.
pub(super) fn evenly_spread_tiles(size: [u32; 2], seed: u64) -> Vec<u32> {
    const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;
    let edge = tile_edge(size);
    let [columns, rows] = size.map(|pixels| pixels.div_ceil(edge));
    let start = splitmix64(seed) as f64 / 2_f64.powi(64);
    let key = |&tile: &u32| {
        let (x, y) = (tile % columns, tile / columns);
        let place = y * columns + if y % 2 == 0 { x } else { columns - 1 - x };
        (start + f64::from(place) * GOLDEN_RATIO).fract()
    };
    let mut tiles: Vec<u32> = (0..columns * rows).collect();
    tiles.sort_by(|a, b| key(a).total_cmp(&key(b)));
    tiles
}

/// Cuts a rectangle out of a picture.
pub(super) fn crop_picture(picture: &Picture, crop: Crop) -> Picture {
    let rows = picture
        .rgb
        .chunks_exact(picture.width as usize)
        .skip(crop.y as usize)
        .take(crop.height as usize);
    let (start, end) = (crop.x as usize, (crop.x + crop.width) as usize);
    Picture {
        rgb: rows.flat_map(|row| &row[start..end]).copied().collect(),
        ..Picture::new(crop.width, crop.height)
    }
}
