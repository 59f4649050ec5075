//! Report of a measurement of accuracy against time, as plain data. Tables, JSON files and HTML
//! pages are made from it.

use serde::Serialize;

use super::effects::EffectCosts;
use super::estimate::{ConfidenceInterval, RESOLUTION, SettingErrors};
use super::outputs::OutputFormatReport;
use crate::film::EstimateDoubt;
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
    /// Recommended settings: one with half the error, and one with the same error in less time.
    pub recommendations: Recommendations,
    /// Time and error of the scene's own setting.
    pub own: MeasuredSetting,
    /// Reason why the error of the scene's own setting is not known; `None` if it is known.
    pub doubt: Option<EstimateDoubt>,
    /// Measurements of the ladders (quality settings), each rung by rung (level by level). Those that
    /// change time and memory alone come last.
    pub ladders: Vec<LadderReport>,
    /// Measured settings in which several rungs (quality levels) are changed.
    pub combinations: Vec<MeasuredSettingWithFlags>,
    /// Error that each output format adds to the picture of the scene's own setting.
    pub outputs: Vec<OutputFormatReport>,
    /// Names of the ladders (quality settings) that have no effect on this scene.
    pub inapplicable: Vec<&'static str>,
    /// Cost of each effect: the time that it adds, and the change of the picture without it. `None`
    /// if the time did not suffice.
    pub costs: Option<EffectCosts>,
    /// Settings on the Pareto front of time and error, by ascending time. Settings whose summed
    /// radiance is wrong or whose bias is large are excluded.
    pub frontier: Vec<MeasuredSettingWithFlags>,
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
    /// Command-line flags of the setting; empty for the one in use.
    pub flags: Vec<String>,
    /// Time and error of the setting; `None` for the exact picture.
    pub measured: Option<MeasuredSetting>,
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

/// Recommended settings, all of which are rows of the report.
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

/// Recommended setting: its command-line flags, and its time and error relative to the scene's own
/// setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recommendation {
    /// Command-line flags of the setting.
    pub flags: Vec<String>,
    /// Ratio of the setting's time to the time of the scene's own setting.
    pub time: ConfidenceInterval,
    /// Ratio of the setting's root error to that of the scene's own setting. The root error is the
    /// square root of relMSE.
    pub error: ConfidenceInterval,
    /// Whether the upper end of `error` is within what the recommendation states, too.
    pub certain: bool,
    /// Time and error of the setting.
    pub measured: MeasuredSetting,
}

/// The reference picture, which counts as exact. It is computed in f64 with the most exact rung
/// (quality level) of each ladder, unless that rung takes too long.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReferenceReport {
    /// Samples per pixel.
    pub samples: u32,
    /// Command-line flags of the rungs (quality levels) of the reference.
    pub rungs: Vec<String>,
    /// Root mean square, over all pixels, of the reference's standard error in linear radiance. Its
    /// square is subtracted from squared errors.
    pub standard_error: f64,
    /// Render time of the reference in this measurement, in seconds summed over all threads.
    pub seconds: f64,
    /// Whether the reference comes from an earlier measurement.
    pub reused: bool,
}

/// Measured time and errors of a setting. A setting is a set of rungs (quality levels), see
/// [`RungSetting`](super::RungSetting).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredSetting {
    /// Number of trials of the setting.
    pub renders: usize,
    /// Time of a render of the whole picture, in seconds summed over all threads, without
    /// preparation.
    pub seconds: ConfidenceInterval,
    /// Time of the setting divided by the time of the setting in use.
    pub ratio: ConfidenceInterval,
    /// Number of rays of a render of the whole picture.
    pub rays: u64,
    /// Errors of the setting against the reference.
    pub errors: SettingErrors,
}

/// Measurements of a ladder (quality setting), rung by rung (level by level).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LadderReport {
    /// Name of the ladder.
    pub ladder: &'static str,
    /// Name of the rung (level) in the scene's own setting. A number of samples need not be among
    /// the measured rungs.
    pub in_use: String,
    /// Measurements of the rungs (levels), from fast to exact.
    pub rungs: Vec<RungReport>,
}

impl LadderReport {
    /// Whether a rung (quality level) is worse than the rung in use in both respects: it takes
    /// longer, and its error is larger.
    pub fn is_dominated(&self, rung: &RungReport) -> bool {
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
        [time / own_time, error / own_error]
            .into_iter()
            .all(|ratio| ratio > 1.0 + RESOLUTION)
    }
}

/// Time and error of one rung of a [`LadderReport`]. A rung is a quality level. All other ladders
/// keep the scene's values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RungReport {
    /// Name of the rung (quality level).
    pub rung: String,
    /// Description of the rung (quality level) for users.
    pub about: &'static str,
    /// Whether the scene's own setting has this rung (quality level).
    pub in_use: bool,
    /// Command-line flag of the rung (quality level); `None` for the rung in use.
    pub flag: Option<String>,
    /// Time and error; `None` if a render takes too long, or the time ran out.
    pub measured: Option<MeasuredSetting>,
    /// Preparation and memory of a rung that changes no picture; `None` for other rungs, and if it was
    /// not measured.
    pub cost: Option<RungCost>,
}

/// Preparation and memory of a scene with one changed rung, a quality level that does not change the
/// picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RungCost {
    /// Preparation time of the scene in seconds summed over all threads. It includes building the
    /// BVH.
    pub preparing: f64,
    /// Memory of geometry and acceleration structure in bytes.
    pub geometry: u64,
    /// Whether the pictures equal those of the scene's own setting to the bit. False indicates an
    /// error in the program.
    pub same_bits: bool,
}

/// A [`MeasuredSetting`] with the command-line flags that select it. The report lists such settings
/// on the Pareto front, and as combinations of several changed rungs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredSettingWithFlags {
    /// Command-line flags of the setting; empty for the scene's own.
    pub flags: Vec<String>,
    /// Time and error of the setting.
    pub measured: MeasuredSetting,
}

impl MeasuredSettingWithFlags {
    /// Returns the setting's changed quality levels, as `LADDER=RUNG` separated by spaces. For the
    /// scene's own setting, it is `as it is`.
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
        let (time, errors) = (
            ConfidenceInterval::from_exact(time),
            SettingErrors::default(),
        );
        let measured = MeasuredSetting {
            renders: 1,
            seconds: time,
            ratio: time,
            rays: 1,
            errors,
        };
        RungReport {
            rung: name.to_owned(),
            about: "",
            in_use,
            flag: None,
            measured: Some(measured),
            cost: None,
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
            .filter(|rung| ladder.is_dominated(rung))
            .map(|rung| rung.rung.as_str())
            .collect();
        assert_eq!(beaten, ["both"]);
    }
}
