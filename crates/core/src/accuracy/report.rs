//! Report of a measurement of accuracy against time, as plain data. Tables, JSON files and HTML
//! pages are made from it.

use serde::Serialize;

use super::estimate::{ConfidenceInterval, RESOLUTION, SettingErrors};
use super::setting::RungSetting;
use crate::film::EstimateDoubt;
use crate::ladder::RungChoice;
use crate::picture::Picture;
use crate::settings::Crop;

/// Report of a measurement of accuracy against time on a scene. Every number is an estimate for the
/// whole picture at its full size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AccuracyReport {
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// Number, size and place of the measured tiles.
    pub tiles: TileReport,
    /// Reference with which all settings are compared.
    pub reference: ReferenceReport,
    /// The measured settings: first the one in use, then those that change one rung (quality level) of
    /// a ladder (quality setting), and those that change several.
    pub settings: Vec<MeasuredSetting>,
    /// Rows of `settings` on the Pareto front of time and error, by ascending time. Settings whose
    /// summed radiance is wrong or whose bias is large are excluded.
    pub frontier: Vec<usize>,
    /// Recommended settings: one with half the error, and one with the same error in less time.
    pub recommendations: Recommendations,
    /// Reason why the error of the scene's own setting is not known; `None` if it is known.
    pub doubt: Option<EstimateDoubt>,
    /// Ladders (quality settings) that change the picture, in the order of the report.
    pub ladders: Vec<LadderInUse>,
    /// Flags of rungs that were not measured for lack of time.
    pub unmeasured: Vec<String>,
    /// Time budget in seconds that would probably make every error known; `None` if all are known, or
    /// if no budget would suffice.
    pub sufficient_budget: Option<f64>,
    /// Wall-clock seconds of the measurement.
    pub seconds: f64,
    /// Whether the time ran out before the planned measurements were finished.
    pub cut_short: bool,
    /// Pictures of the page.
    #[serde(skip)]
    pub pictures: ReportPictures,
}

impl AccuracyReport {
    /// Returns time and error of the scene's own setting.
    pub fn own(&self) -> &MeasuredSetting {
        &self.settings[0]
    }

    /// Returns the row of the front that beats the setting in use, and its time and error over those in
    /// use; `None` if the setting in use is on the front.
    pub fn better_row(&self) -> Option<(usize, [f64; 2])> {
        let point = |of: &MeasuredSetting| [of.seconds.value, of.errors.root_relmse.value];
        let own = point(self.own());
        let ratios = self.frontier.iter().map(|&row| {
            let of = point(&self.settings[row]);
            (row, [of[0] / own[0], of[1] / own[1]])
        });
        let best = ratios.min_by(|a, b| a.1[0].max(a.1[1]).total_cmp(&b.1[0].max(b.1[1])));
        best.filter(|_| !self.frontier.contains(&0))
    }
}

/// Ladder (quality setting) with its rung (quality level) in use.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LadderInUse {
    /// Name of the ladder.
    pub ladder: &'static str,
    /// Name of the rung in use. A number of samples need not be a rung.
    pub in_use: String,
}

/// Pictures of a report, in linear radiance: the whole picture, and a part of it with different
/// settings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportPictures {
    /// The whole picture with the setting in use, or with fewer samples.
    pub whole: Picture,
    /// Tiles on which rungs (quality levels) were tried.
    pub tiles: Vec<Crop>,
    /// Place of the magnified part: where objects have the most noise. `None` without a picture.
    pub detail: Option<Crop>,
    /// The magnified part with the setting in use, with the recommended settings, and exact.
    pub details: Vec<DetailPicture>,
}

/// Magnified part of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct DetailPicture {
    /// Row of the setting in [`AccuracyReport::settings`]; `None` for the exact picture.
    pub row: Option<usize>,
    /// The part of the picture.
    pub picture: Picture,
}

/// Measured tiles of the picture: their size and number. All tiles are measured if the time suffices,
/// else an even selection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TileReport {
    /// Edge of a tile in pixels.
    pub edge: u32,
    /// Number of tiles on which the rungs were tried.
    pub measured: usize,
    /// Number of tiles of the picture.
    pub all: usize,
}

/// Recommended settings.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Recommendations {
    /// Fastest setting with about half of the root error or less; `None` if no setting has it.
    pub half_the_error: Option<Recommendation>,
    /// Fastest setting with about the same root error or less, in clearly less time; `None` if no
    /// setting has it.
    pub same_error: Option<Recommendation>,
    /// Fastest setting with the same error that is faster than `same_error`, or else with half of it
    /// faster than `half_the_error`, that may not replace the setting in use, because it changes the
    /// light or has bias; `None` if there is none.
    pub biased: Option<Recommendation>,
}

/// Recommended setting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Recommendation {
    /// Row of the setting in [`AccuracyReport::settings`].
    pub row: usize,
    /// Whether the upper end of its `error_ratio` is within what the recommendation states, too.
    pub certain: bool,
}

/// The reference picture, which counts as exact. It is computed in f64 with the most exact rung
/// (quality level) of each ladder, unless that rung takes too long.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReferenceReport {
    /// Samples per pixel.
    pub samples: u32,
    /// Rungs (quality levels) of the reference.
    pub rungs: RungSetting,
    /// The reference's own error of noise, as root relMSE. Its square is subtracted from squared
    /// errors.
    pub error: f64,
    /// Render time of the reference, in seconds summed over all threads.
    pub seconds: f64,
}

/// Measured time and errors of a setting: a set of rungs (quality levels) that replace the scene's
/// own.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MeasuredSetting {
    /// The changed rungs; none for the setting in use.
    #[serde(skip)]
    pub setting: RungSetting,
    /// Flags of `render` for the setting.
    pub flags: Vec<String>,
    /// Time of a render of the whole picture, in seconds summed over all threads, without
    /// preparation.
    pub seconds: ConfidenceInterval,
    /// Time of the setting divided by the time of the setting in use.
    pub ratio: ConfidenceInterval,
    /// Errors of the setting against the reference.
    pub errors: SettingErrors,
    /// Root error of the setting divided by that of the setting in use.
    pub error_ratio: ConfidenceInterval,
}

impl MeasuredSetting {
    /// Returns the name of the setting: its flags, or `in use`.
    pub fn name(&self) -> String {
        match self.setting.choices() {
            [] => self.setting.to_string(),
            _ => self.flags.join(" "),
        }
    }

    /// Returns the changed rung (quality level) of a setting that changes one.
    pub fn single_rung(&self) -> Option<RungChoice> {
        match self.setting.choices() {
            [choice] => Some(*choice),
            _ => None,
        }
    }

    /// Whether a single rung (quality level) is worse than the rung in use in both respects: it takes
    /// longer, and its error is larger.
    pub fn is_dominated(&self) -> bool {
        let ratios = [self.ratio, self.error_ratio];
        let is_more = |of: ConfidenceInterval| of.is_known() && of.value > 1.0 + RESOLUTION;
        self.single_rung().is_some() && ratios.into_iter().all(is_more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a rung that is both slower and worse than the one in use is recognised. A rung
    /// that is only one of the two, or within the resolution of clock or noise, is not.
    #[test]
    fn the_slower_and_worse_are_known() {
        let is_beaten = |time: f64, error_ratio: ConfidenceInterval| {
            let rung = RungChoice::parse("clamp=1").expect("a rung");
            let measured = MeasuredSetting {
                setting: RungSetting::from_rung(rung),
                ratio: ConfidenceInterval::from_exact(time),
                error_ratio,
                ..MeasuredSetting::default()
            };
            measured.is_dominated()
        };
        let is_dominated = |time, error| is_beaten(time, ConfidenceInterval::from_exact(error));
        let unknown = ConfidenceInterval {
            value: 1.4,
            ..ConfidenceInterval::UNKNOWN
        };
        assert!(!is_beaten(1.2, unknown));
        assert!(is_dominated(1.2, 1.4));
        for (time, error) in [(1.2, 1.0), (1.0, 1.4), (1.02, 1.4), (1.2, 1.02)] {
            assert!(!is_dominated(time, error), "{time}, {error}");
        }
    }
}
