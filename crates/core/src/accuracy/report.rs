//! Report of a measurement of accuracy against time, as plain data. Tables, JSON files and HTML
//! pages are made from it.

use serde::Serialize;

use super::effects::EffectCosts;
use super::estimate::{ConfidenceInterval, SettingErrors};
use super::outputs::OutputFormatReport;
use crate::bench::SampleQuantiles;
use crate::picture::Picture;

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
    #[serde(rename = "answer")]
    pub recommendations: Recommendations,
    /// Time and error of the scene's own setting.
    pub own: MeasuredSetting,
    /// Measurements of the ladders (quality settings) that change the picture, each rung by rung
    /// (level by level).
    pub ladders: Vec<LadderReport>,
    /// Measured settings in which several rungs (quality levels) are changed.
    pub combinations: Vec<MeasuredSettingWithFlags>,
    /// Time and memory of the ladders (quality settings) that do not change the picture.
    pub prices: Vec<LadderCostReport>,
    /// Error that each output format adds to the picture of the scene's own setting.
    pub outputs: Vec<OutputFormatReport>,
    /// Names of the ladders (quality settings) that have no effect on this scene.
    pub not_called_for: Vec<&'static str>,
    /// Cost of each effect: the time that it adds, and the change of the picture without it. `None`
    /// if the time did not suffice.
    pub costs: Option<EffectCosts>,
    /// Settings on the Pareto front of time and error, by ascending time. Settings whose summed
    /// radiance is wrong or whose bias is large are excluded.
    pub frontier: Vec<MeasuredSettingWithFlags>,
    /// Time budget in seconds that would probably make every error known; `None` if all are known, or
    /// if no budget would suffice.
    pub needs: Option<f64>,
    /// Wall-clock seconds of the measurement.
    pub seconds: f64,
    /// Whether the time ran out before the planned measurements were finished.
    pub cut_short: bool,
    /// Pictures for comparison: the reference, the setting in use, and each setting that differs
    /// from it in one choice. They show the part of the picture with the greatest noise.
    #[serde(skip)]
    pub pictures: Vec<ReportPicture>,
}

/// Measured tiles of the picture: their size and number, and the place of the tile that the report
/// shows. All tiles are measured if the time suffices, else a random selection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TileReport {
    /// Edge of a tile in pixels.
    pub edge: u32,
    /// Number of tiles on which the rungs were tried.
    pub measured: usize,
    /// Number of tiles of the picture.
    pub all: usize,
    /// Column and row of the upper left pixel of the part shown in `pictures`.
    pub shown: [u32; 2],
}

/// Recommended settings, all of which are rows of the report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Recommendations {
    /// Fastest setting with about half of the root error or less; `None` if no setting has it.
    pub half_the_error: Option<Recommendation>,
    /// Fastest setting with about the same root error or less, in clearly less time; `None` if no
    /// setting has it.
    pub same_error: Option<Recommendation>,
    /// Fastest setting with the same error that is faster than `same_error` but may not replace the
    /// setting in use, because it changes the light or has bias; `None` if there is none.
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
    /// Time and error of the setting.
    pub measured: MeasuredSetting,
}

/// Picture with its name, to be compared by eye on the HTML page.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportPicture {
    /// Name: `reference`, `as it is` for the scene's own setting, or the changed quality level,
    /// such as `samples=16`.
    pub name: String,
    /// Linear radiance.
    pub picture: Picture,
}

/// The reference picture, which counts as exact. It is computed in f64 with the most exact rung
/// (quality level) of each ladder, unless that rung takes too long.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReferenceReport {
    /// Samples per pixel.
    pub samples: u32,
    /// Command-line flags of the rungs (quality levels) of the reference.
    pub rungs: Vec<String>,
    /// Number of tiles on which the reference was rendered.
    pub tiles: usize,
    /// Root mean square, over all pixels, of the reference's standard error in linear radiance. Its
    /// square is subtracted from squared errors.
    pub standard_error: f64,
    /// Render time of the reference in this measurement, in seconds summed over all threads.
    pub seconds: f64,
    /// Whether the reference comes from an earlier measurement.
    pub kept: bool,
}

/// Measured time and errors of a setting. A setting is a set of rungs (quality levels), see
/// [`RungSetting`](super::RungSetting).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredSetting {
    /// Number of tiles on which its rungs were tried.
    pub tiles: usize,
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

/// Measurements of a ladder (quality setting) that changes the picture, rung by rung (level by
/// level).
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

/// Largest relative difference of two times that counts as equal; below, the same for two errors.
const SAME_TIME: f64 = 0.03;
const SAME_ERROR: f64 = 0.04;

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
        time > own_time * (1.0 + SAME_TIME) && error > own_error * (1.0 + SAME_ERROR)
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
}

/// Costs of the rungs (quality levels) of a ladder that changes time and memory but not the
/// picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LadderCostReport {
    /// Name of the ladder.
    pub ladder: &'static str,
    /// Name of the rung (quality level) in the scene's own setting.
    pub in_use: String,
    /// Costs of the ladder's rungs (quality levels).
    pub rungs: Vec<RungCostReport>,
}

/// Row of a [`LadderCostReport`]: name, description and cost of one rung, a quality level that does
/// not change the picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RungCostReport {
    /// Name of the rung (quality level).
    pub rung: String,
    /// Description of the rung (quality level) for users.
    pub about: &'static str,
    /// Whether the scene's own setting has this rung (quality level).
    pub in_use: bool,
    /// Time and memory; `None` if a render takes too long.
    #[serde(rename = "paid")]
    pub rung_cost: Option<RungCost>,
}

/// Measured time and memory of a scene with one changed rung, a quality level that does not change
/// the picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RungCost {
    /// Preparation time of the scene in seconds summed over all threads. It includes building the
    /// BVH.
    pub preparing: SampleQuantiles,
    /// Render time of the whole picture, in seconds summed over all threads.
    pub seconds: SampleQuantiles,
    /// Render time with this rung divided by the time of the scene's own setting, over the
    /// repetitions.
    pub ratio: SampleQuantiles,
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
            tiles: 1,
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
