//! Comparison of rendered tiles with the reference: errors, times and rays of a setting per tile.

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::Measurements;
use crate::accuracy::estimate::{ReferenceTile, TileErrors, total_radiance};
use crate::accuracy::renderer::TimedRender;
use crate::accuracy::setting::RungSetting;
use crate::display::Display;
use crate::ladder::Ladder;
use crate::picture::Picture;
use crate::settings::Crop;

/// Errors, times and rays of a setting in a tile.
pub(super) struct TileMeasurement {
    pub errors: TileErrors,
    /// Render time of the tile in seconds, without its margin, for each repetition (round). Each
    /// time is divided by the number of rounds, so that their sum is the mean.
    pub seconds: Vec<f64>,
    /// Seconds of the first repetition: the time of the rendered crop times the share of its pixels
    /// that lie in the tile.
    pub first_seconds: f64,
    pub rays: f64,
    /// Sum of the tile's radiance before denoising.
    pub noisy_light: f64,
}

/// Repeated renders of a crop that contains a tile of the sample.
pub(super) struct TileRenders<'r> {
    /// Position of the tile in the sample.
    pub position: usize,
    /// The rendered crop.
    pub crop: Crop,
    /// Share of the crop's render time, 0 to 1, that the tile gets.
    pub share: f64,
    pub renders: Vec<&'r TimedRender>,
}

impl TileRenders<'_> {
    /// Returns the measurement of the tile that the crop contains, and the pictures of this tile.
    /// `tracing_seconds` replaces
    /// the tile's share of the time of tracing. `other_pictures` holds the tile's pictures by the
    /// setting with which this one is compared; it is empty without such a setting.
    fn measure_tile(
        &self,
        tile_crop: Crop,
        (reference, display): (&ReferenceTile, Display),
        tracing_seconds: Option<f64>,
        other_pictures: &[Picture],
    ) -> (TileMeasurement, Vec<Picture>) {
        let (share, renders) = (self.share, &self.renders);
        let pictures: Vec<Picture> = renders
            .iter()
            .map(|render| crop_picture(&render.picture, self.crop, tile_crop))
            .collect();
        let is_random = renders.iter().any(|render| render.is_random);
        let seconds = |render: &TimedRender| match tracing_seconds {
            Some(tracing) => tracing + share * render.denoising_seconds,
            None => share * render.seconds,
        };
        let count = renders.len() as f64;
        let noisy_light = pictures
            .iter()
            .zip(renders)
            .map(|(picture, render)| total_radiance(picture) / render.light_ratio);
        let measurement = TileMeasurement {
            errors: reference.measure_tile_errors(&pictures, is_random, other_pictures, display),
            seconds: renders
                .iter()
                .map(|render| seconds(render) / count)
                .collect(),
            first_seconds: share * renders[0].seconds,
            rays: share * renders.iter().map(|render| render.rays as f64).sum::<f64>() / count,
            noisy_light: noisy_light.sum::<f64>() / count,
        };
        (measurement, pictures)
    }
}

impl Measurements<'_> {
    /// Returns the seconds that tracing takes per tile, without denoising, for a denoised setting
    /// that is rendered with margins. The times were measured for the same setting without
    /// denoising. The crop's time cannot be divided by pixels: tiles are drawn in noisy places,
    /// where tracing takes longer than in the margin. Empty for other settings.
    fn tracing_seconds_without_denoising(&self, index: usize) -> Vec<f64> {
        let figures = &self.setting_measurements[index];
        if !self.is_denoised(&figures.setting) || figures.whole_seconds.is_some() {
            return Vec::new();
        }
        let own_figures = self
            .setting_measurements
            .iter()
            .find(|other| self.differs_only_in_denoising(&other.setting, &figures.setting));
        own_figures.map_or(Vec::new(), |own_figures| {
            own_figures
                .tiles
                .iter()
                .map(|tile| tile.seconds.iter().sum())
                .collect()
        })
    }

    /// Whether `noisy` and `denoised` are the same setting except for denoising.
    fn differs_only_in_denoising(&self, noisy: &RungSetting, denoised: &RungSetting) -> bool {
        let without = |setting: &RungSetting| setting.without_ladder(Ladder::Reconstruction);
        without(noisy) == without(denoised) && !self.is_denoised(noisy)
    }

    /// Compares renders of crops with the reference, one tile per crop. The measurements of the
    /// tiles are appended to those of the setting at `index`. The pictures are also compared
    /// with the kept pictures of the setting `beside`. With `keep`, the pictures themselves are kept.
    pub(super) fn record_tile_errors(
        &mut self,
        index: usize,
        renders: Vec<TileRenders<'_>>,
        beside: Option<&RungSetting>,
        keep: bool,
    ) {
        let other = beside
            .and_then(|setting| self.find_setting_measurements(setting))
            .map_or(&[][..], |figures| figures.pictures.as_slice());
        let noisy_seconds = self.tracing_seconds_without_denoising(index);
        let measured: Vec<(TileMeasurement, Vec<Picture>)> = renders
            .into_par_iter()
            .map(|tile| {
                let position = tile.position;
                tile.measure_tile(
                    self.sample
                        .grid
                        .tile_crop(self.sample.passes[position].tile),
                    (&self.reference_tiles[position], self.display),
                    noisy_seconds.get(position).copied(),
                    other.get(position).map_or(&[][..], Vec::as_slice),
                )
            })
            .collect();
        let figures = &mut self.setting_measurements[index];
        for (measurement, pictures) in measured {
            figures.tiles.push(measurement);
            if figures.first_picture.is_none() {
                figures.first_picture = pictures.first().cloned();
            }
            if keep {
                figures.pictures.push(pictures);
            }
        }
    }
}

/// Cuts a tile out of the picture of a crop; both rectangles are in pixels of the whole picture.
pub(in crate::accuracy) fn crop_picture(picture: &Picture, part: Crop, tile: Crop) -> Picture {
    let (x, y) = ((tile.x - part.x) as usize, (tile.y - part.y) as usize);
    let rows = picture
        .rgb
        .chunks_exact(picture.width as usize)
        .skip(y)
        .take(tile.height as usize);
    let rgb = rows
        .flat_map(|row| &row[x..x + tile.width as usize])
        .copied()
        .collect();
    Picture {
        rgb,
        ..Picture::new(tile.width, tile.height)
    }
}
