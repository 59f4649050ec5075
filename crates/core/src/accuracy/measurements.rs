//! Measurements of each setting, tile by tile, and the estimates for the whole picture.

mod estimates;
mod paid;
mod turns;

use std::ops::Range;
use std::time::Instant;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

pub(super) use estimates::RelativeCost;

use super::estimate::{TileErrors, TruthTile, light};
use super::pilot::{PilotPair, WholeErrors};
use super::renderer::{MARGIN, Renderer, TimedRender, Unfinished};
use super::setting::Setting;
use super::tiles::TileSample;
use crate::display::Display;
use crate::ladder::Ladder;
use crate::picture::Picture;
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Figures of a setting in a tile.
struct TileFigures {
    errors: TileErrors,
    /// Seconds for the tile without its margin; per round, a part of the mean.
    seconds: Vec<f64>,
    /// The tile's share, by pixels, of the time of the first round of its part.
    first_seconds: f64,
    rays: f64,
    /// Total light before denoising.
    noisy_light: f64,
}

/// Renders of a part of the picture in all rounds: index of its tile in the sample, position of the
/// part, and the tile's share of the part.
type TileRenders<'r> = (usize, Crop, f64, Vec<&'r TimedRender>);

/// Returns the renders of a part, by rounds.
fn of_part(renders: &[Vec<TimedRender>], part: usize) -> Vec<&TimedRender> {
    renders.iter().map(|all| &all[part]).collect()
}

/// Figures of a setting in the first tiles of the sample.
#[derive(Default)]
struct Figures {
    setting: Setting,
    rounds: u64,
    tiles: Vec<TileFigures>,
    /// Renders of each tile, kept for comparison with other settings.
    pictures: Vec<Vec<Picture>>,
    /// First render of the first tile, or of the whole picture.
    first: Option<Picture>,
    /// Renders of the whole picture, from which more tiles may be judged.
    whole: Vec<TimedRender>,
    /// Errors of the whole picture, estimated from the pilots.
    whole_errors: Option<WholeErrors>,
    /// Seconds of the first render of the whole picture, if any.
    whole_seconds: Option<f64>,
    /// Ratios of the times measured in turns to the first times.
    turns: Vec<f64>,
}

impl Figures {
    fn new(setting: &Setting, rounds: u64) -> Self {
        Self {
            setting: setting.clone(),
            rounds,
            ..Self::default()
        }
    }
}

pub(super) struct Measurements<'a> {
    pub renderer: &'a Renderer<'a>,
    pub sample: &'a TileSample,
    display: Display,
    truths: Vec<TruthTile>,
    all: Vec<Figures>,
    /// Noisy pictures of the whole.
    pub pilots: Option<PilotPair>,
    /// Most samples up to which denoised pictures are rendered whole.
    pub whole_samples: u32,
    /// Whether settings were meant to be timed in turns.
    has_turned: bool,
}

impl<'a> Measurements<'a> {
    pub fn new(renderer: &'a Renderer<'a>, sample: &'a TileSample, display: Display) -> Self {
        Self {
            renderer,
            sample,
            display,
            truths: Vec::new(),
            all: Vec::new(),
            pilots: None,
            whole_samples: 0,
            has_turned: false,
        }
    }

    /// Adds the reference data of the next tiles.
    pub fn learn(&mut self, tiles: impl Iterator<Item = TruthTile>) {
        self.truths.extend(tiles);
    }

    /// Returns the number of tiles with reference data.
    pub fn known(&self) -> usize {
        self.truths.len()
    }

    fn of(&self, setting: &Setting) -> Option<&Figures> {
        self.all
            .iter()
            .find(|of| of.setting == *setting && !of.tiles.is_empty())
    }

    /// Returns all measured settings, in the order of their measurement.
    pub fn settings(&self) -> Vec<Setting> {
        self.all
            .iter()
            .filter(|of| !of.tiles.is_empty())
            .map(|of| of.setting.clone())
            .collect()
    }

    /// Returns the number of tiles on which a setting was measured.
    pub fn tiles(&self, setting: &Setting) -> usize {
        self.of(setting).map_or(0, |of| of.tiles.len())
    }

    /// Measures a setting on the first tiles, in the given number of rounds, unless already
    /// measured. `beside` is a setting whose pictures were kept; `keep` keeps the pictures of this
    /// one. Returns false where time is out; finished renders count.
    pub fn measure(
        &mut self,
        setting: &Setting,
        (count, rounds): (usize, u64),
        beside: Option<&Setting>,
        keep: bool,
        end: Instant,
    ) -> Result<bool, PrepareError> {
        let count = count.min(self.known());
        let place = self
            .all
            .iter()
            .position(|of| of.setting == *setting)
            .unwrap_or(self.all.len());
        if place == self.all.len() {
            self.all.push(Figures::new(setting, rounds));
        }
        if self.all[place].rounds < rounds {
            let known = std::mem::replace(&mut self.all[place], Figures::new(setting, rounds));
            let is_done = self.add(place, count, beside, keep, end)?;
            if !is_done {
                self.all[place] = known;
            }
            return Ok(is_done);
        }
        self.add(place, count, beside, keep, end)
    }

    fn add(
        &mut self,
        place: usize,
        count: usize,
        beside: Option<&Setting>,
        keep: bool,
        end: Instant,
    ) -> Result<bool, PrepareError> {
        let Figures {
            setting,
            rounds,
            tiles,
            ..
        } = &self.all[place];
        let (setting, rounds, from) = (setting.clone(), 0..*rounds, tiles.len());
        if from >= count {
            return Ok(true);
        }
        let is_denoised = self.is_denoised(&setting);
        let grid = self.sample.grid;
        let area = |crop: Crop| f64::from(crop.width) * f64::from(crop.height);
        let whole = Crop {
            x: 0,
            y: 0,
            width: grid.size[0],
            height: grid.size[1],
        };
        let of_parts: f64 = (from..count).map(|at| area(self.part(&setting, at))).sum();
        let is_all = self.sample.is_whole(count);
        if is_all || of_parts >= area(whole) || is_denoised && self.is_whole_cheap(&setting) {
            let mut renders = std::mem::take(&mut self.all[place].whole);
            let is_new = renders.is_empty();
            if is_new {
                let Some(taken) = self.take(&setting, &[], rounds, end)? else {
                    return Ok(false);
                };
                renders = taken.into_iter().flatten().collect();
            }
            let looked: f64 = self.sample.order.iter().map(|look| look.seconds).sum();
            let looked = looked * grid.count() as f64 / self.sample.most() as f64;
            let first = is_all.then(|| renders[0].picture.clone());
            let of = &mut self.all[place];
            if is_new {
                (of.tiles, of.pictures, of.first) = (Vec::new(), Vec::new(), first);
                of.whole_seconds = Some(renders[0].seconds);
            }
            let from = self.all[place].tiles.len();
            let share = |at: usize| {
                let look = &self.sample.order[at];
                if looked > 0.0 {
                    look.seconds / looked
                } else {
                    grid.pixels(look.tile) / area(whole)
                }
            };
            let all = || renders.iter().collect::<Vec<_>>();
            self.judge(
                place,
                (from..count)
                    .map(|at| (at, whole, share(at), all()))
                    .collect(),
                beside,
                keep,
            );
            if is_denoised && !is_all {
                self.all[place].whole = renders;
                if is_new {
                    self.judge_whole();
                }
            }
            return Ok(true);
        }
        let parts: Vec<Crop> = (from..count).map(|at| self.part(&setting, at)).collect();
        let Some(renders) = self.take(&setting, &parts, rounds, end)? else {
            return Ok(false);
        };
        let renders = parts.iter().enumerate().map(|(i, &part)| {
            (
                from + i,
                part,
                self.share(from + i, part),
                of_part(&renders, i),
            )
        });
        self.judge(place, renders.collect(), beside, keep);
        Ok(true)
    }

    /// Judges all denoised pictures of the whole by the pilots, relative to the picture with the
    /// most samples.
    fn judge_whole(&mut self) {
        let samples = |of: &Figures| {
            of.setting
                .applied(self.renderer.scene, self.renderer.settings)
                .1
                .sampling
                .count()
        };
        let is_free = |of: &&Figures| of.setting.without(Ladder::Reconstruction).is_free_of_bias();
        let best = self
            .all
            .iter()
            .filter(|of| !of.whole.is_empty())
            .filter(is_free)
            .max_by_key(|of| samples(of));
        let Some((pilots, best)) = self
            .pilots
            .as_ref()
            .zip(best.map(|of| of.whole[0].picture.clone()))
        else {
            return;
        };
        for of in self.all.iter_mut().filter(|of| !of.whole.is_empty()) {
            of.whole_errors =
                Some(pilots.judge(of.whole.iter().map(|render| &render.picture), &best));
        }
    }

    /// Returns the part to render for a tile of the sample: with a margin for a denoised setting.
    fn part(&self, setting: &Setting, at: usize) -> Crop {
        let (tile, grid) = (self.sample.order[at].tile, self.sample.grid);
        if self.is_denoised(setting) {
            grid.around(tile, MARGIN)
        } else {
            grid.tile(tile)
        }
    }

    /// Returns the tile's share of the part, by pixels.
    fn share(&self, at: usize, part: Crop) -> f64 {
        self.sample.grid.pixels(self.sample.order[at].tile)
            / (f64::from(part.width) * f64::from(part.height))
    }

    /// Whether a denoised picture of the whole is cheap enough to replace tiles with margins.
    fn is_whole_cheap(&self, setting: &Setting) -> bool {
        let (_, settings) = setting.applied(self.renderer.scene, self.renderer.settings);
        settings.sampling.count() <= self.whole_samples
    }

    pub(super) fn is_denoised(&self, setting: &Setting) -> bool {
        setting
            .applied(self.renderer.scene, self.renderer.settings)
            .1
            .denoise
    }

    /// Renders parts by rounds; `None` where time is out.
    fn take(
        &self,
        setting: &Setting,
        parts: &[Crop],
        rounds: Range<u64>,
        end: Instant,
    ) -> Result<Option<Vec<Vec<TimedRender>>>, PrepareError> {
        rounds
            .map(|round| Unfinished::allow(self.renderer.take(setting, parts, round, end)))
            .collect()
    }

    /// Returns the tracing time of each tile for a denoised setting whose parts are tiles with
    /// margins, as measured without denoising. Tiles are drawn where noise is, and tracing takes
    /// longer there than in the margin. Empty for other settings.
    fn noisy_seconds(&self, place: usize) -> Vec<f64> {
        let of = &self.all[place];
        if !self.is_denoised(&of.setting) || of.whole_seconds.is_some() {
            return Vec::new();
        }
        let own = self
            .all
            .iter()
            .find(|other| self.is_noisy_twin(&other.setting, &of.setting));
        own.map_or(Vec::new(), |own| {
            own.tiles
                .iter()
                .map(|tile| tile.seconds.iter().sum())
                .collect()
        })
    }

    /// Whether the settings differ only in that the second is denoised.
    fn is_noisy_twin(&self, noisy: &Setting, denoised: &Setting) -> bool {
        let without = |setting: &Setting| setting.without(Ladder::Reconstruction);
        without(noisy) == without(denoised) && !self.is_denoised(noisy)
    }

    /// Judges renders of parts, each with one tile; the tile gets its share of the part's time.
    fn judge(
        &mut self,
        place: usize,
        renders: Vec<TileRenders<'_>>,
        beside: Option<&Setting>,
        keep: bool,
    ) {
        let other = beside.and_then(|setting| self.of(setting));
        let noisy_seconds = self.noisy_seconds(place);
        let seconds = |at: usize, share: f64, render: &TimedRender| match noisy_seconds.get(at) {
            Some(tracing) => tracing + share * render.denoising,
            None => share * render.seconds,
        };
        let judged: Vec<(TileFigures, Vec<Picture>)> = renders
            .into_par_iter()
            .map(|(at, part, share, renders)| {
                let tile = self.sample.grid.tile(self.sample.order[at].tile);
                let pictures: Vec<Picture> = renders
                    .iter()
                    .map(|render| cut(&render.picture, part, tile))
                    .collect();
                let by_chance = renders.iter().any(|render| render.by_chance);
                let other = other
                    .and_then(|of| of.pictures.get(at))
                    .map_or(&[][..], Vec::as_slice);
                let count = renders.len() as f64;
                let noisy = pictures
                    .iter()
                    .zip(&renders)
                    .map(|(picture, render)| light(picture) / render.brightened);
                let figures = TileFigures {
                    errors: self.truths[at].judge(&pictures, by_chance, other, self.display),
                    seconds: renders
                        .iter()
                        .map(|render| seconds(at, share, render) / count)
                        .collect(),
                    first_seconds: share * renders[0].seconds,
                    rays: share * renders.iter().map(|render| render.rays as f64).sum::<f64>()
                        / count,
                    noisy_light: noisy.sum::<f64>() / count,
                };
                (figures, pictures)
            })
            .collect();
        let of = &mut self.all[place];
        for (figures, pictures) in judged {
            of.tiles.push(figures);
            if of.first.is_none() {
                of.first = pictures.first().cloned();
            }
            if keep {
                of.pictures.push(pictures);
            }
        }
    }

    /// Returns the kept pictures of a setting, with the inclusion probabilities of their tiles.
    pub fn kept(&self, setting: &Setting) -> Vec<(f64, &Picture)> {
        let pictures = self.of(setting).map_or(&[][..], |of| &of.pictures);
        let chances = self.sample.chances(pictures.len());
        chances
            .into_iter()
            .zip(pictures)
            .filter_map(|(chance, all)| Some((chance, all.first()?)))
            .collect()
    }

    /// Returns the first render of the first tile by a setting, or of the whole picture where the
    /// whole was measured.
    pub fn first(&self, setting: &Setting) -> Option<&Picture> {
        self.of(setting)?.first.as_ref()
    }

    /// Returns the reference picture of the first tile.
    pub fn truth(&self) -> Option<&Picture> {
        self.truths.first().map(|tile| &tile.picture)
    }
}

/// Cuts a tile out of the picture of a part.
pub(super) fn cut(picture: &Picture, part: Crop, tile: Crop) -> Picture {
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
