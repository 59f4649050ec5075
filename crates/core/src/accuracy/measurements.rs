//! What was measured of each setting, tile by tile, and what that says of the whole picture.

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

/// One setting in one tile.
struct TileFigures {
    errors: TileErrors,
    /// Of the tile without its margin, for each round a part of their mean.
    seconds: Vec<f64>,
    /// The tile's share, by pixels, of what the first round of its part took.
    first_seconds: f64,
    rays: f64,
    /// Light before it was denoised.
    noisy_light: f64,
}

/// The renders of a part of the picture in all rounds: which tile of the sample it has, where it
/// lies, and the share that the tile has of it.
type TileRenders<'r> = (usize, Crop, f64, Vec<&'r TimedRender>);

/// A part by rounds.
fn of_part(renders: &[Vec<TimedRender>], part: usize) -> Vec<&TimedRender> {
    renders.iter().map(|all| &all[part]).collect()
}

/// One setting: figures of the first tiles of the sample.
#[derive(Default)]
struct Figures {
    setting: Setting,
    rounds: u64,
    tiles: Vec<TileFigures>,
    /// Renders of each tile, where others are held beside them.
    pictures: Vec<Vec<Picture>>,
    /// The first render of the first tile, or of the whole picture.
    first: Option<Picture>,
    /// Renders of the whole picture, of which more tiles may be judged.
    whole: Vec<TimedRender>,
    /// What pilots say of them.
    whole_errors: Option<WholeErrors>,
    /// Seconds of the first render of the whole picture, where that was rendered.
    whole_seconds: Option<f64>,
    /// Time when it was taken in turns with others, over what it had been.
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
    /// Denoised pictures of so many samples are rendered whole.
    pub whole_samples: u32,
    /// Whether settings were to be timed in turns.
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

    /// Takes what the reference has of the next tiles.
    pub fn learn(&mut self, tiles: impl Iterator<Item = TruthTile>) {
        self.truths.extend(tiles);
    }

    /// Tiles of which the truth is known.
    pub fn known(&self) -> usize {
        self.truths.len()
    }

    fn of(&self, setting: &Setting) -> Option<&Figures> {
        self.all
            .iter()
            .find(|of| of.setting == *setting && !of.tiles.is_empty())
    }

    /// All settings of which anything is known, in the order in which they were measured.
    pub fn settings(&self) -> Vec<Setting> {
        self.all
            .iter()
            .filter(|of| !of.tiles.is_empty())
            .map(|of| of.setting.clone())
            .collect()
    }

    /// Tiles that a setting was measured on.
    pub fn tiles(&self, setting: &Setting) -> usize {
        self.of(setting).map_or(0, |of| of.tiles.len())
    }

    /// Measures a setting on the first tiles, in so many rounds each, unless that is there already.
    /// `beside` is a setting whose pictures were kept, `keep` says to keep these. False where time
    /// is out; what was finished by then stays.
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

    /// Judges all denoised pictures of the whole by the pilots, relative to the one of most
    /// samples.
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

    /// What is rendered for a tile of the sample: what is around it too where it is denoised.
    fn part(&self, setting: &Setting, at: usize) -> Crop {
        let (tile, grid) = (self.sample.order[at].tile, self.sample.grid);
        if self.is_denoised(setting) {
            grid.around(tile, MARGIN)
        } else {
            grid.tile(tile)
        }
    }

    /// The tile's share of such a part.
    fn share(&self, at: usize, part: Crop) -> f64 {
        self.sample.grid.pixels(self.sample.order[at].tile)
            / (f64::from(part.width) * f64::from(part.height))
    }

    /// Whether a denoised picture of the whole takes so little that tiles with their margins are
    /// not worth it.
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

    /// Parts by rounds; none where time is out.
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

    /// What tracing takes in each tile, of a denoised setting whose parts are tiles with what is
    /// around them: as the same setting took that is not denoised. Tiles are drawn where noise is,
    /// which takes longer than what is around it. Nothing of other settings.
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

    /// Whether settings differ in that the second one is denoised.
    fn is_noisy_twin(&self, noisy: &Setting, denoised: &Setting) -> bool {
        let without = |setting: &Setting| setting.without(Ladder::Reconstruction);
        without(noisy) == without(denoised) && !self.is_denoised(noisy)
    }

    /// Judges renders of parts of the picture in one tile each, of which that part's time has a
    /// share.
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

    /// Pictures of a setting that were kept, with their chances.
    pub fn kept(&self, setting: &Setting) -> Vec<(f64, &Picture)> {
        let pictures = self.of(setting).map_or(&[][..], |of| &of.pictures);
        let chances = self.sample.chances(pictures.len());
        chances
            .into_iter()
            .zip(pictures)
            .filter_map(|(chance, all)| Some((chance, all.first()?)))
            .collect()
    }

    /// The first render of the first tile by a setting, or of the whole picture where that was
    /// measured.
    pub fn first(&self, setting: &Setting) -> Option<&Picture> {
        self.of(setting)?.first.as_ref()
    }

    /// The first tile as it is.
    pub fn truth(&self) -> Option<&Picture> {
        self.truths.first().map(|tile| &tile.picture)
    }
}

/// The part of a part of a picture.
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
