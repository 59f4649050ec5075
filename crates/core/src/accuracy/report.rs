//! What a measurement of a scene's ladders amounts to: plain data for tables, files and pages.

use serde::Serialize;

use super::effects::EffectCosts;
use super::estimate::{Errors, Interval};
use super::outputs::OutputReport;
use crate::bench::Spread;
use crate::picture::Picture;

/// All that was measured on one scene. Every number is of the whole picture at the size that is
/// rendered.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// The parts of it that were measured.
    pub tiles: Tiles,
    /// What everything is compared with.
    pub reference: Reference,
    /// What to ask for instead, in two lines.
    pub answer: Answer,
    /// The scene as it is asked for.
    pub own: Measured,
    /// What rungs other than numbers of samples were put on, where that is not the scene as it is
    /// asked for.
    pub base: Option<Base>,
    /// Ladders that the scene reaches and that pictures depend on.
    pub ladders: Vec<LadderReport>,
    /// Settings of several rungs that were measured.
    pub combinations: Vec<Candidate>,
    /// Those that no picture depends on.
    pub prices: Vec<PriceReport>,
    /// What files keep of the scene's own picture.
    pub outputs: Vec<OutputReport>,
    /// Ladders that the scene does not call for.
    pub not_called_for: Vec<&'static str>,
    /// What each effect of the scene adds to time and picture; none where there was no time for it.
    pub costs: Option<EffectCosts>,
    /// Settings that none measured beats in both time and error, by ascending time, but for those
    /// that lose light or have much error that more samples leave.
    pub frontier: Vec<Candidate>,
    /// Seconds that it all took.
    pub seconds: f64,
    /// Whether time was out before everything wanted was measured.
    pub cut_short: bool,
    /// A tile, or the whole picture: the reference, and the first render of settings whose pictures
    /// were kept.
    #[serde(skip)]
    pub pictures: Vec<Shown>,
}

/// Which parts of the picture were measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tiles {
    /// Edge of a tile in pixels.
    pub edge: u32,
    /// Tiles that the setting in use was measured on, and the reference.
    pub measured: usize,
    /// All that the picture has.
    pub all: usize,
    /// Column and row of the tile that is shown.
    pub shown: [u32; 2],
}

/// The settings that answer what most ask first; none where no measured one does for certain.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Answer {
    /// The fastest with about half of the error, or less.
    pub half_the_error: Option<Advice>,
    /// Seconds of a budget that would probably tell, where a setting seems to have half of it.
    pub half_needs: Option<f64>,
    /// The fastest with no larger error that clearly takes less time.
    pub same_error: Option<Advice>,
    /// The same of one that seems to have it.
    pub same_needs: Option<f64>,
}

/// A setting beside the scene's own.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Advice {
    /// The flags that ask for it.
    pub flags: Vec<String>,
    /// Its time over that of the scene's own.
    pub time: Interval,
    /// Its root relMSE over that of the scene's own.
    pub error: Interval,
    /// Time and error, as everywhere in the report.
    pub measured: Measured,
}

/// The scene with fewer samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Base {
    /// How many.
    pub samples: u32,
    /// Time and error with them.
    pub measured: Measured,
}

/// A picture with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// `reference`, `as it is`, or a rung as it is asked for, such as `samples=16`.
    pub name: String,
    /// Linear radiance.
    pub picture: Picture,
}

/// The picture that counts as the truth: f64, every ladder on the most exact rung that does not
/// take too long.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reference {
    /// Samples a pixel.
    pub samples: u32,
    /// The flags that ask for its rungs.
    pub rungs: Vec<String>,
    /// Tiles that it has.
    pub tiles: usize,
    /// Root of the mean square of its own standard errors, in linear radiance; what errors are
    /// lowered by, as squares.
    pub standard_error: f64,
    /// Seconds of all threads that it took.
    pub seconds: f64,
    /// Whether it is that of an earlier measurement.
    pub kept: bool,
}

/// Time and error of one setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// Tiles that it was measured on.
    pub tiles: usize,
    /// Times each was rendered, with different random numbers each.
    pub renders: usize,
    /// Seconds of all threads for a render, preparation apart.
    pub seconds: Interval,
    /// Its time over that of the setting it is compared with: the scene as it is, or for a rung
    /// that was put on fewer samples the scene with so many. Not a number where that is not known.
    pub ratio: Interval,
    /// Rays of a render.
    pub rays: u64,
    /// Errors against the reference.
    pub errors: Errors,
    /// Mean FLIP of the display pictures, the reference's noise included.
    pub flip: Interval,
}

/// One ladder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LadderReport {
    /// Its name.
    pub ladder: &'static str,
    /// Its rung in use, which for numbers need not be one of those measured.
    pub in_use: String,
    /// From fast to exact.
    pub rungs: Vec<RungReport>,
}

/// Times and errors that differ by a smaller share are the same.
const SAME_TIME: f64 = 0.03;
const SAME_ERROR: f64 = 0.04;

impl LadderReport {
    /// Whether a rung takes longer than the one in use and is farther from the reference.
    pub fn beats(&self, rung: &RungReport) -> bool {
        let measured = |rung: &RungReport| {
            rung.measured
                .as_ref()
                .map(|of| (of.ratio.value, of.errors.relmse.value))
        };
        let own = self
            .rungs
            .iter()
            .find(|rung| rung.in_use)
            .and_then(measured);
        let (Some((own_time, own_error)), Some((time, error))) = (own, measured(rung)) else {
            return false;
        };
        time > own_time * (1.0 + SAME_TIME) && error > own_error * (1.0 + SAME_ERROR)
    }
}

/// One rung, all other ladders as the scene has them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RungReport {
    /// Its name.
    pub rung: String,
    /// What it is.
    pub about: &'static str,
    /// Whether it is the one in use.
    pub in_use: bool,
    /// The flag that asks for it; none for the one in use.
    pub flag: Option<String>,
    /// None where it takes too long, or time was out.
    pub measured: Option<Measured>,
    /// Root of the mean squared difference to the same renders on the ladder's most exact rung,
    /// random numbers included: what this choice alone gets wrong. None where the random numbers
    /// can't be the same, and where one of both was not measured.
    pub own_error: Option<Interval>,
}

/// A ladder that is paid in time and memory alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PriceReport {
    /// Its name.
    pub ladder: &'static str,
    /// Its rung in use.
    pub in_use: String,
    /// Its rungs.
    pub rungs: Vec<Price>,
}

/// What a rung without error costs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Price {
    /// Its name.
    pub rung: String,
    /// What it is.
    pub about: &'static str,
    /// Whether it is the one in use.
    pub in_use: bool,
    /// None where it would have taken too long.
    pub paid: Option<RungCost>,
}

/// Time and memory.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RungCost {
    /// Seconds of all threads for preparing the scene, its tree included.
    pub preparing: Spread,
    /// Seconds of all threads for a render of the whole picture.
    pub seconds: Spread,
    /// That over the time of the scene's own setting, round by round.
    pub ratio: Spread,
    /// Bytes of geometry and accelerator.
    pub geometry: u64,
    /// Whether the pictures had the bits of the scene's own setting, as they must.
    pub same_bits: bool,
}

/// A setting on the frontier.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Candidate {
    /// The flags that ask for it; none for the scene's own setting.
    pub flags: Vec<String>,
    /// Time and error.
    pub measured: Measured,
}

impl Candidate {
    /// Its rungs, as they are asked for.
    pub fn name(&self) -> String {
        let rungs: Vec<&str> = self
            .flags
            .iter()
            .map(|flag| flag.trim_start_matches("--rung "))
            .collect();
        if rungs.is_empty() {
            "as it is".to_owned()
        } else {
            rungs.join(" ")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::Errors;

    fn rung(name: &str, in_use: bool, time: f64) -> RungReport {
        let (time, errors) = (Interval::exact(time), Errors::default());
        let measured = Measured {
            tiles: 1,
            renders: 1,
            seconds: time,
            ratio: time,
            rays: 1,
            errors,
            flip: time,
        };
        RungReport {
            rung: name.to_owned(),
            about: "",
            in_use,
            flag: None,
            measured: Some(measured),
            own_error: None,
        }
    }

    /// Protects: what is slower and worse than the rung in use is told from what is only one of
    /// both, and from what a clock or noise may have made so.
    #[test]
    fn the_slower_and_worse_are_known() {
        let with = |name: &str, time: f64, error: f64| {
            let mut rung = rung(name, name == "own", time);
            rung.measured
                .iter_mut()
                .for_each(|of| of.errors.relmse.value = error);
            rung
        };
        let all = [
            ("own", 1.0, 0.1),
            ("both", 1.2, 0.2),
            ("slower", 1.2, 0.1),
            ("worse", 1.0, 0.2),
            ("hardly", 1.02, 0.2),
            ("as good", 1.2, 0.103),
        ];
        let rungs: Vec<RungReport> = all
            .map(|(name, time, error)| with(name, time, error))
            .into();
        let ladder = LadderReport {
            ladder: "sampler",
            in_use: "own".to_owned(),
            rungs,
        };
        let beaten: Vec<&str> = ladder
            .rungs
            .iter()
            .filter(|rung| ladder.beats(rung))
            .map(|rung| rung.rung.as_str())
            .collect();
        assert_eq!(beaten, ["both"]);
    }
}
