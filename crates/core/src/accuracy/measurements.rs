//! What was measured of each setting, tile by tile, and what that says of the whole picture.

use std::ops::Range;
use std::time::{Duration, Instant};

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::estimate::{Errors, Interval, TileErrors, TruthTile, light};
use super::renderer::{MARGIN, Renderer, TimedRender, Unfinished};
use super::report::{Measured, RungCost};
use super::setting::Setting;
use super::tiles::{Share, TileSample, ratio};
use crate::bench::Spread;
use crate::display::Display;
use crate::ladder::Ladder;
use crate::picture::Picture;
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Rounds in which a rung without error is timed, and tiles.
const PRICE_ROUNDS: u64 = 3;
const PRICE_TILES: usize = 4;
/// It may take this many times as long as the scene's own setting, or so long at least.
const PATIENCE: f64 = 20.0;
const LEAST_PATIENCE: Duration = Duration::from_secs(1);

/// One setting in one tile.
struct TileFigures {
    errors: TileErrors,
    /// Of the tile without its margin, for each round a part of their mean.
    seconds: Vec<f64>,
    rays: f64,
    /// Light before it was denoised.
    noisy_light: f64,
}

/// The renders of a part of the picture in all rounds: which tile of the sample it has, where it lies, and the share that the tile has of it.
type TileRenders<'r> = (usize, Crop, f64, Vec<&'r TimedRender>);

/// A part by rounds.
fn of_part(renders: &[Vec<TimedRender>], part: usize) -> Vec<&TimedRender> {
    renders.iter().map(|all| &all[part]).collect()
}

/// One setting: figures of the first tiles of the sample.
struct Figures {
    setting: Setting,
    rounds: u64,
    tiles: Vec<TileFigures>,
    /// Renders of each tile, where others are held beside them.
    pictures: Vec<Vec<Picture>>,
    /// The first render of the first tile, or of the whole picture.
    first: Option<Picture>,
}

/// Two settings in the tiles that both have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RelativeCost {
    /// Time of the one over that of the other.
    pub time: Interval,
    /// Its mean squared error over that of the other.
    pub error: Interval,
}

pub(super) struct Measurements<'a> {
    pub renderer: &'a Renderer<'a>,
    pub sample: &'a TileSample,
    display: Display,
    truths: Vec<TruthTile>,
    all: Vec<Figures>,
}

impl<'a> Measurements<'a> {
    pub fn new(renderer: &'a Renderer<'a>, sample: &'a TileSample, display: Display) -> Self {
        Self { renderer, sample, display, truths: Vec::new(), all: Vec::new() }
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
        self.all.iter().find(|of| of.setting == *setting && !of.tiles.is_empty())
    }

    /// All settings of which anything is known, in the order in which they were measured.
    pub fn settings(&self) -> Vec<Setting> {
        self.all.iter().filter(|of| !of.tiles.is_empty()).map(|of| of.setting.clone()).collect()
    }

    /// Tiles that a setting was measured on.
    pub fn tiles(&self, setting: &Setting) -> usize {
        self.of(setting).map_or(0, |of| of.tiles.len())
    }

    /// Measures a setting on the first tiles, in so many rounds each, unless that is there already. `beside` is a setting whose pictures were
    /// kept, `keep` says to keep these. False where time is out; what was finished by then stays.
    pub fn measure(
        &mut self,
        setting: &Setting,
        (count, rounds): (usize, u64),
        beside: Option<&Setting>,
        keep: bool,
        end: Instant,
    ) -> Result<bool, PrepareError> {
        let count = count.min(self.known());
        let place = self.all.iter().position(|of| of.setting == *setting).unwrap_or(self.all.len());
        if place == self.all.len() {
            self.all.push(Figures { setting: setting.clone(), rounds, tiles: Vec::new(), pictures: Vec::new(), first: None });
        }
        if self.all[place].rounds < rounds {
            let known = std::mem::replace(
                &mut self.all[place],
                Figures { setting: setting.clone(), rounds, tiles: Vec::new(), pictures: Vec::new(), first: None },
            );
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
        let Figures { setting, rounds, tiles, .. } = &self.all[place];
        let (setting, rounds, from) = (setting.clone(), 0..*rounds, tiles.len());
        if from >= count {
            return Ok(true);
        }
        let is_denoised = self.is_denoised(&setting);
        let grid = self.sample.grid;
        let area = |crop: Crop| f64::from(crop.width) * f64::from(crop.height);
        let whole = Crop { x: 0, y: 0, width: grid.size[0], height: grid.size[1] };
        let around = |at: usize| {
            let tile = self.sample.order[at].tile;
            if is_denoised { grid.around(tile, MARGIN) } else { grid.tile(tile) }
        };
        let of_parts: f64 = (from..count).map(|at| area(around(at))).sum();
        if self.sample.is_whole(count) || of_parts >= area(whole) {
            let Some(renders) = self.take(&setting, &[], rounds, end)? else { return Ok(false) };
            let looked: f64 = self.sample.order.iter().map(|look| look.seconds).sum();
            let looked = looked * grid.count() as f64 / self.sample.most() as f64;
            let first = self.sample.is_whole(count).then(|| renders[0][0].picture.clone());
            let of = &mut self.all[place];
            (of.tiles, of.pictures, of.first) = (Vec::new(), Vec::new(), first);
            let share = |at: usize| {
                let look = &self.sample.order[at];
                if looked > 0.0 { look.seconds / looked } else { grid.pixels(look.tile) / area(whole) }
            };
            self.judge(place, (0..count).map(|at| (at, whole, share(at), of_part(&renders, 0))).collect(), beside, keep);
            return Ok(true);
        }
        let parts: Vec<Crop> = (from..count).map(around).collect();
        let Some(renders) = self.take(&setting, &parts, rounds, end)? else { return Ok(false) };
        let share = |at: usize, part: Crop| grid.pixels(self.sample.order[at].tile) / area(part);
        let renders = parts.iter().enumerate().map(|(i, &part)| (from + i, part, share(from + i, part), of_part(&renders, i)));
        self.judge(place, renders.collect(), beside, keep);
        Ok(true)
    }

    fn is_denoised(&self, setting: &Setting) -> bool {
        setting.applied(self.renderer.scene, self.renderer.settings).1.denoise
    }

    /// Parts by rounds; none where time is out.
    fn take(
        &self,
        setting: &Setting,
        parts: &[Crop],
        rounds: Range<u64>,
        end: Instant,
    ) -> Result<Option<Vec<Vec<TimedRender>>>, PrepareError> {
        rounds.map(|round| Unfinished::allow(self.renderer.take(setting, parts, round, end))).collect()
    }

    /// Judges renders of parts of the picture in one tile each, of which that part's time has a share.
    fn judge(&mut self, place: usize, renders: Vec<TileRenders<'_>>, beside: Option<&Setting>, keep: bool) {
        let other = beside.and_then(|setting| self.of(setting));
        let judged: Vec<(TileFigures, Vec<Picture>)> = renders
            .into_par_iter()
            .map(|(at, part, share, renders)| {
                let tile = self.sample.grid.tile(self.sample.order[at].tile);
                let pictures: Vec<Picture> = renders.iter().map(|render| cut(&render.picture, part, tile)).collect();
                let by_chance = renders.iter().any(|render| render.by_chance);
                let other = other.and_then(|of| of.pictures.get(at)).map_or(&[][..], Vec::as_slice);
                let count = renders.len() as f64;
                let noisy = pictures.iter().zip(&renders).map(|(picture, render)| light(picture) / render.brightened);
                let figures = TileFigures {
                    errors: self.truths[at].judge(&pictures, by_chance, other, self.display),
                    seconds: renders.iter().map(|render| share * render.seconds / count).collect(),
                    rays: share * renders.iter().map(|render| render.rays as f64).sum::<f64>() / count,
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

    /// A ratio of totals of the whole picture, from the first tiles.
    fn total<'b>(&'b self, count: usize, doubtful: bool, of: impl Fn(usize) -> (&'b [f64], &'b [f64])) -> Interval {
        let chances = self.sample.chances(count);
        let share = |(at, chance): (usize, f64)| {
            let (above, below) = of(at);
            Share { chance, above, below, doubt: if doubtful { self.truths[at].doubt } else { 0.0 } }
        };
        ratio(&chances.into_iter().enumerate().map(share).collect::<Vec<_>>())
    }

    /// A mean over pixels of what tiles have in one number, or block by block.
    fn mean(&self, count: usize, doubtful: bool, of: impl Fn(usize) -> Vec<f64>) -> Interval {
        let sums: Vec<Vec<f64>> = (0..count).map(of).collect();
        let pixels = |at: usize| match sums[at].len() {
            1 => vec![self.sample.grid.pixels(self.sample.order[at].tile)],
            _ => self.truths[at].blocks(),
        };
        let pixels: Vec<Vec<f64>> = (0..count).map(pixels).collect();
        self.total(count, doubtful, |at| (&sums[at], &pixels[at]))
    }

    /// Time, error and the time over that of another setting; none where it was not measured.
    pub fn measured(&self, setting: &Setting, beside: &Setting) -> Option<Measured> {
        let of = self.of(setting)?;
        let count = of.tiles.len();
        let errors = |at: usize| &of.tiles[at].errors;
        let has_bias = (0..count).all(|at| !errors(at).bias.is_empty());
        let looked = self.sample.order.iter().map(|look| look.seconds).sum::<f64>() * self.sample.grid.count() as f64;
        // A look counts for each round alike, so that what rounds are apart is told.
        let rounds = of.tiles.first().map_or(1, |tile| tile.seconds.len());
        let looks: Vec<Vec<f64>> = self.sample.order.iter().map(|look| vec![look.seconds / rounds as f64; rounds]).collect();
        let looks = |at: usize| -> &[f64] { &looks[at] };
        let seconds = self.total(count, false, |at| (&of.tiles[at].seconds, looks(at)));
        let size = self.sample.grid.size.map(f64::from);
        let rays = self.mean(count, false, |at| vec![of.tiles[at].rays]).value * size[0] * size[1];
        Some(Measured {
            tiles: count,
            renders: of.rounds as usize,
            seconds: seconds.map(|ratio| ratio * looked / self.sample.most() as f64),
            ratio: self.relative(setting, beside).map_or(Interval::exact(f64::NAN), |cost| cost.time),
            rays: rays.round() as u64,
            errors: Errors {
                rmse: self.mean(count, true, |at| errors(at).squared.clone()).map(f64::sqrt),
                relmse: self.mean(count, true, |at| errors(at).relative.clone()),
                bias: has_bias.then(|| self.mean(count, true, |at| errors(at).bias.clone())),
                light: self.light(setting)?,
            },
            flip: self.mean(count, false, |at| vec![errors(at).flip]),
        })
    }

    /// Light over the reference's; over that of the noisy picture where denoising alone may have changed it.
    pub fn light(&self, setting: &Setting) -> Option<Interval> {
        let of = self.of(setting)?;
        let is_alone = self.is_denoised(setting) && setting.without(Ladder::Reconstruction).is_free_of_bias();
        let lights: Vec<[[f64; 1]; 2]> = (of.tiles.iter().zip(&self.truths))
            .map(|(tile, truth)| [[tile.errors.light], [if is_alone { tile.noisy_light } else { truth.light() }]])
            .collect();
        Some(self.total(of.tiles.len(), false, |at| (&lights[at][0], &lights[at][1])))
    }

    /// Time and error over those of another setting, from the tiles that both have; none where there are none.
    pub fn relative(&self, setting: &Setting, beside: &Setting) -> Option<RelativeCost> {
        let (of, other) = (self.of(setting)?, self.of(beside)?);
        if setting == beside {
            return Some(RelativeCost { time: Interval::exact(1.0), error: Interval::exact(1.0) });
        }
        let count = of.tiles.len().min(other.tiles.len());
        let rounds = of.rounds.min(other.rounds) as usize;
        let times = |figures: &Figures| -> Vec<Vec<f64>> {
            let factor = figures.rounds as f64 / rounds as f64;
            let of_tile = |tile: &TileFigures| tile.seconds.iter().take(rounds).map(|seconds| factor * seconds).collect();
            figures.tiles.iter().map(of_tile).collect()
        };
        let (own, others) = (times(of), times(other));
        let time = self.total(count, false, |at| (&own[at], &others[at]));
        let error = self.total(count, true, |at| (&of.tiles[at].errors.relative, &other.tiles[at].errors.relative));
        Some(RelativeCost { time, error })
    }

    /// What a choice alone changes: root of the mean squared difference to the pictures that it was held beside, and the mean squared
    /// relative difference.
    pub fn alone(&self, setting: &Setting) -> Option<[Interval; 2]> {
        let of = self.of(setting)?;
        let sum = |i: usize| self.mean(of.tiles.len(), false, |at| vec![of.tiles[at].errors.alone[i]]);
        Some([sum(0).map(f64::sqrt), sum(1)])
    }

    /// Standard error of the reference: root of the mean square.
    pub fn standard_error(&self) -> f64 {
        self.mean(self.known(), false, |at| vec![self.truths[at].variance()]).value.sqrt()
    }

    /// Pictures of a setting that were kept, with their chances.
    pub fn kept(&self, setting: &Setting) -> Vec<(f64, &Picture)> {
        let pictures = self.of(setting).map_or(&[][..], |of| &of.pictures);
        let chances = self.sample.chances(pictures.len());
        chances.into_iter().zip(pictures).filter_map(|(chance, all)| Some((chance, all.first()?))).collect()
    }

    /// Time and memory of a setting that gives the same picture as another one, beside that in the same rounds, on the first tiles; none where
    /// it takes too long.
    pub fn paid(&self, setting: &Setting, beside: &Setting, end: Instant) -> Result<Option<RungCost>, PrepareError> {
        let tiles = self.sample.order.iter().take(PRICE_TILES.min(self.tiles(beside)));
        let crops: Vec<Crop> = tiles.map(|look| self.sample.grid.tile(look.tile)).collect();
        let now = self.renderer.now;
        let own_seconds = self.measured(beside, beside).map_or(0.0, |of| of.seconds.value);
        let (mut preparing, mut ratios, mut geometry, mut same_bits) = (Vec::new(), Vec::new(), 0, true);
        for round in 0..PRICE_ROUNDS {
            let before = now();
            let Some(own) = Unfinished::allow(self.renderer.render_parts(beside, &crops, round, end))? else { break };
            let patience = (now() - before).mul_f64(PATIENCE).max(LEAST_PATIENCE);
            let end = end.min(now() + patience);
            let Some(others) = Unfinished::allow(self.renderer.render_parts(setting, &crops, round, end))? else { break };
            let seconds = |of: &[TimedRender]| of.iter().map(|render| render.seconds).sum::<f64>();
            preparing.extend(others.first().map(|render| render.preparing));
            ratios.push(seconds(&others) / seconds(&own).max(1e-9));
            geometry = others.first().map_or(0, |render| render.geometry);
            same_bits &= own.iter().zip(&others).all(|(own, other)| own.picture == other.picture);
        }
        let [preparing, ratio] = [preparing, ratios].map(|list| (!list.is_empty()).then(|| Spread::of(&list)));
        let paid = preparing.zip(ratio);
        Ok(paid.map(|(preparing, ratio)| RungCost { preparing, seconds: ratio.scaled(own_seconds), ratio, geometry, same_bits }))
    }

    /// The first render of the first tile by a setting, or of the whole picture where that was measured.
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
    let rows = picture.rgb.chunks_exact(picture.width as usize).skip(y).take(tile.height as usize);
    let rgb = rows.flat_map(|row| &row[x..x + tile.width as usize]).copied().collect();
    Picture { rgb, ..Picture::new(tile.width, tile.height) }
}
