//! Report of a measurement of a scene's ladders: plain data for tables, files and pages.

use serde::Serialize;

use super::effects::EffectCosts;
use super::estimate::{ConfidenceInterval, SettingErrors};
use super::outputs::OutputReport;
use crate::bench::Spread;
use crate::picture::Picture;

/// Results of a measurement on one scene. Every number is an estimate for the whole picture at its
/// full size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AccuracyReport {
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// Measured parts of the picture.
    pub tiles: Tiles,
    /// The reference of all comparisons.
    pub reference: Reference,
    /// Advice in two lines.
    #[serde(rename = "answer")]
    pub recommendations: Recommendations,
    /// The scene with its own settings.
    pub own: MeasuredSetting,
    /// Setting on which rungs other than sample counts were measured, where it is not the scene's
    /// own.
    pub base: Option<BaselineReport>,
    /// Ladders that affect the scene's picture.
    pub ladders: Vec<LadderReport>,
    /// Measured settings of several rungs.
    pub combinations: Vec<FrontierCandidate>,
    /// Ladders that do not change pictures, with their costs.
    pub prices: Vec<PriceReport>,
    /// Errors of output formats on the scene's own picture.
    pub outputs: Vec<OutputReport>,
    /// Ladders that do not affect the scene.
    pub not_called_for: Vec<&'static str>,
    /// Cost of each effect in time and picture; `None` without time for it.
    pub costs: Option<EffectCosts>,
    /// Settings on the Pareto front of time and error, by ascending time, without those that change
    /// the light or have a large bias.
    pub frontier: Vec<FrontierCandidate>,
    /// Seconds of the measurement.
    pub seconds: f64,
    /// Whether time was out before the planned measurements were finished.
    pub cut_short: bool,
    /// Pictures of a tile, or of the whole: the reference, and the first render of settings whose
    /// pictures were kept.
    #[serde(skip)]
    pub pictures: Vec<ReportPicture>,
}

/// Measured parts of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tiles {
    /// Edge of a tile in pixels.
    pub edge: u32,
    /// Tiles on which the setting in use and the reference were measured.
    pub measured: usize,
    /// Tiles of the picture.
    pub all: usize,
    /// Column and row of the shown tile.
    pub shown: [u32; 2],
}

/// Settings for the two most common wishes; `None` where no measured setting fulfils a wish with
/// certainty.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Recommendations {
    /// Fastest setting with at most about half of the error.
    pub half_the_error: Option<Advice>,
    /// Budget in seconds that would probably suffice, where a setting seems to have half of the
    /// error.
    pub half_needs: Option<f64>,
    /// Fastest setting without a larger error that clearly takes less time.
    pub same_error: Option<Advice>,
    /// Budget in seconds that would probably suffice, where a setting seems to have the same error
    /// in less time.
    pub same_needs: Option<f64>,
}

/// An advised setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Advice {
    /// Flags of the setting.
    pub flags: Vec<String>,
    /// Ratio of its time to that of the scene's own setting.
    pub time: ConfidenceInterval,
    /// Ratio of its root relMSE to that of the scene's own setting.
    pub error: ConfidenceInterval,
    /// Time and error, as everywhere in the report.
    pub measured: MeasuredSetting,
}

/// The scene with fewer samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaselineReport {
    /// Samples per pixel.
    pub samples: u32,
    /// Time and error with this number of samples.
    pub measured: MeasuredSetting,
}

/// A picture with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportPicture {
    /// `reference`, `as it is`, or the flag value of a rung, for example `samples=16`.
    pub name: String,
    /// Linear radiance.
    pub picture: Picture,
}

/// Reference, which counts as the truth: f64, with every ladder on the most exact rung that does
/// not take too long.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reference {
    /// Samples per pixel.
    pub samples: u32,
    /// Flags of its rungs.
    pub rungs: Vec<String>,
    /// Number of rendered tiles.
    pub tiles: usize,
    /// Root mean square of the reference's standard errors, in linear radiance; its square is
    /// subtracted from squared errors.
    pub standard_error: f64,
    /// Seconds of all threads.
    pub seconds: f64,
    /// Whether the reference comes from an earlier measurement.
    pub kept: bool,
}

/// Time and error of a setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredSetting {
    /// Number of tiles of the measurement.
    pub tiles: usize,
    /// Number of renders of each tile, each with different random numbers.
    pub renders: usize,
    /// Seconds of all threads per render, without preparation.
    pub seconds: ConfidenceInterval,
    /// Ratio of its time to that of the compared setting: the scene's own or, for a rung measured
    /// on fewer samples, the scene with that number. NaN where unknown.
    pub ratio: ConfidenceInterval,
    /// Rays per render.
    pub rays: u64,
    /// Errors against the reference.
    pub errors: SettingErrors,
    /// Mean FLIP difference of the display pictures, the reference's noise included.
    pub flip: ConfidenceInterval,
}

/// Report of a ladder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LadderReport {
    /// Name of the ladder.
    pub ladder: &'static str,
    /// Rung in use; a sample count need not be a measured rung.
    pub in_use: String,
    /// Rungs, from fast to exact.
    pub rungs: Vec<RungReport>,
}

/// Relative differences of times and errors that count as equal.
const SAME_TIME: f64 = 0.03;
const SAME_ERROR: f64 = 0.04;

impl LadderReport {
    /// Whether the rung in use beats this one: the rung takes longer and has a larger error.
    pub fn beats(&self, rung: &RungReport) -> bool {
        let measured = |rung: &RungReport| {
            rung.measured
                .as_ref()
                .map(|each_measured| (each_measured.ratio.value, each_measured.errors.relmse.value))
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

/// Report of a rung; all other ladders are as in the scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RungReport {
    /// Name of the rung.
    pub rung: String,
    /// Description.
    pub about: &'static str,
    /// Whether the rung is the one in use.
    pub in_use: bool,
    /// Flag of the rung; `None` for the rung in use.
    pub flag: Option<String>,
    /// Time and error; `None` where the rung takes too long, or time was out.
    pub measured: Option<MeasuredSetting>,
    /// Error of this choice alone: root mean squared difference to the same renders on the ladder's
    /// most exact rung, with the same random numbers. `None` where the random numbers cannot be the
    /// same, or one of the two was not measured.
    pub own_error: Option<ConfidenceInterval>,
}

/// Report of a ladder that changes time and memory alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PriceReport {
    /// Name of the ladder.
    pub ladder: &'static str,
    /// Rung in use.
    pub in_use: String,
    /// Its rungs.
    pub rungs: Vec<RungPrice>,
}

/// Cost of a rung without error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RungPrice {
    /// Name of the rung.
    pub rung: String,
    /// Description.
    pub about: &'static str,
    /// Whether the rung is the one in use.
    pub in_use: bool,
    /// Cost; `None` where the rung would have taken too long.
    #[serde(rename = "paid")]
    pub rung_cost: Option<RungCost>,
}

/// Time and memory.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RungCost {
    /// Seconds of all threads for preparing the scene, its tree included.
    pub preparing: Spread,
    /// Seconds of all threads for a render of the whole picture.
    pub seconds: Spread,
    /// Ratio of its time to that of the scene's own setting, per round.
    pub ratio: Spread,
    /// Bytes of geometry and accelerator.
    pub geometry: u64,
    /// Whether the pictures equal those of the scene's own setting to the bit, as they must.
    pub same_bits: bool,
}

/// A setting on the frontier.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrontierCandidate {
    /// Flags of the setting; empty for the scene's own.
    pub flags: Vec<String>,
    /// Time and error.
    pub measured: MeasuredSetting,
}

impl FrontierCandidate {
    /// Returns the setting's rungs in their flag form.
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
    use crate::accuracy::SettingErrors;

    fn rung(name: &str, in_use: bool, time: f64) -> RungReport {
        let (time, errors) = (ConfidenceInterval::exact(time), SettingErrors::default());
        let measured = MeasuredSetting {
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

    /// Protects: a rung that is both slower and worse than the one in use is recognised. A rung
    /// that is only one of the two, or within the resolution of clock or noise, is not.
    #[test]
    fn the_slower_and_worse_are_known() {
        let with = |name: &str, time: f64, error: f64| {
            let mut rung = rung(name, name == "own", time);
            rung.measured
                .iter_mut()
                .for_each(|measured| measured.errors.relmse.value = error);
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
