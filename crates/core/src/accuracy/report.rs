//! What a measurement of a scene's ladders amounts to: plain data for tables, files and pages.

use serde::Serialize;

use super::effects::EffectCosts;
use super::estimate::Errors;
use super::outputs::OutputReport;
use crate::bench::Spread;
use crate::picture::Picture;

/// All that was measured on one scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Width and height of the renders, in pixels.
    pub size: [u32; 2],
    /// Width and height that the scene asks for; times at that size are longer by the ratio of pixels.
    pub full_size: [u32; 2],
    /// What everything is compared with.
    pub reference: Reference,
    /// What to ask for instead, in two lines.
    pub answer: Answer,
    /// The scene as it is asked for.
    pub own: Measured,
    /// What rungs other than numbers of samples were put on, where that is not the scene as it is asked for.
    pub base: Option<Base>,
    /// Ladders that the scene reaches and that pictures depend on.
    pub ladders: Vec<LadderReport>,
    /// Those that no picture depends on.
    pub prices: Vec<PriceReport>,
    /// What files keep of the scene's own picture.
    pub outputs: Vec<OutputReport>,
    /// Ladders that the scene does not call for.
    pub not_called_for: Vec<&'static str>,
    /// What each effect of the scene adds to time and picture; none where there was no time for it.
    pub costs: Option<EffectCosts>,
    /// Settings that none measured beats in both time and error, by ascending time; each measured again after it was chosen, where there was
    /// time for that.
    pub frontier: Vec<Candidate>,
    /// Seconds that it all took.
    pub seconds: f64,
    /// Whether time was out before everything wanted was measured.
    pub cut_short: bool,
    /// The reference, and the first render of each setting but those of the frontier.
    #[serde(skip)]
    pub pictures: Vec<Shown>,
}

impl Report {
    /// Pixels of the scene's own size over those that were measured: times there are longer by so much.
    pub fn enlargement(&self) -> f64 {
        let pixels = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
        pixels(self.full_size) / pixels(self.size)
    }
}

/// The settings that answer what most ask first; none where no measured one does.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Answer {
    /// The fastest with about half of the error, or less.
    pub half_the_error: Option<Advice>,
    /// The fastest with no larger error that clearly takes less time.
    pub same_error: Option<Advice>,
}

/// A setting beside the scene's own.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Advice {
    /// The flags that ask for it.
    pub flags: Vec<String>,
    /// Its time over that of the scene's own.
    pub time: f64,
    /// Its root relMSE over that of the scene's own.
    pub error: f64,
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

/// The picture that counts as the truth: f64, every ladder on the most exact rung that does not take too long.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reference {
    /// Samples a pixel.
    pub samples: u32,
    /// The flags that ask for its rungs.
    pub rungs: Vec<String>,
    /// Root of the mean square of its own standard errors, in linear radiance; what errors are lowered by, as squares.
    pub standard_error: f64,
    /// Seconds of all threads that it took.
    pub seconds: f64,
    /// Whether it is that of an earlier measurement.
    pub kept: bool,
}

/// Time and error of one setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// Times it was rendered, with different random numbers each.
    pub renders: usize,
    /// Seconds of all threads for a render, preparation apart.
    pub seconds: Spread,
    /// Its time over that of the setting it is compared with, round by round: the scene as it is, or for a rung that was put on fewer samples
    /// the scene with so many.
    pub ratio: Spread,
    /// Rays of a render.
    pub rays: u64,
    /// Errors against the reference.
    pub errors: Errors,
    /// Mean FLIP of the display pictures, the reference's noise included.
    pub flip: f64,
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

/// A rung that is farther from its ladder's most exact one by this factor is worth naming, if it takes at least this share of the time.
const FARTHER: f64 = 10.0;
const NO_FASTER: f64 = 0.95;

/// Times and errors that differ by a smaller share are the same.
const SAME_TIME: f64 = 0.03;
const SAME_ERROR: f64 = 0.04;

impl LadderReport {
    /// Whether a rung takes longer than the one in use and is farther from the reference.
    pub fn beats(&self, rung: &RungReport) -> bool {
        let measured = |rung: &RungReport| rung.measured.as_ref().map(|of| (of.ratio.median, of.errors.relmse.value));
        let own = self.rungs.iter().find(|rung| rung.in_use).and_then(measured);
        let (Some((own_time, own_error)), Some((time, error))) = (own, measured(rung)) else { return false };
        time > own_time * (1.0 + SAME_TIME) && error > own_error * (1.0 + SAME_ERROR)
    }

    /// Rungs before the one in use that take as long and alone are many times as wrong, as tables of total errors do not show where
    /// something else is wrong by more; each with its error alone and that of the one in use.
    pub fn in_vain(&self) -> impl Iterator<Item = (&RungReport, [f64; 2])> {
        let time = |rung: &RungReport| rung.measured.as_ref().map(|measured| measured.ratio.median);
        let own = self.rungs.iter().find(|rung| rung.in_use).and_then(|rung| Some((time(rung)?, rung.own_error?)));
        let faster = self.rungs.iter().take_while(|rung| !rung.in_use);
        own.into_iter().flat_map(move |(own_time, own_error)| {
            faster.clone().filter_map(move |rung| {
                let (time, error) = (time(rung)?, rung.own_error?);
                (time >= NO_FASTER * own_time && error > FARTHER * own_error).then_some((rung, [error, own_error]))
            })
        })
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
    /// Root of the mean squared difference to the same renders on the ladder's most exact rung, random numbers included: what this
    /// choice alone gets wrong. None where the random numbers can't be the same, and where one of both was not measured.
    pub own_error: Option<f64>,
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
    /// Seconds of all threads for a render.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::Errors;

    fn rung(name: &str, in_use: bool, time: f64, own_error: Option<f64>) -> RungReport {
        let (spread, errors) = (Spread::of(&[time]), Errors::default());
        let measured = Measured { renders: 1, seconds: spread, ratio: spread, rays: 1, errors, flip: 0.0 };
        RungReport { rung: name.to_owned(), about: "", in_use, flag: None, measured: Some(measured), own_error }
    }

    /// Protects: what is slower and worse than the rung in use is told from what is only one of both, and from what a clock or noise may have
    /// made so; times are longer by the ratio of pixels.
    #[test]
    fn the_slower_and_worse_are_known() {
        let with = |name: &str, time: f64, error: f64| {
            let mut rung = rung(name, name == "own", time, None);
            rung.measured.iter_mut().for_each(|of| of.errors.relmse.value = error);
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
        let rungs: Vec<RungReport> = all.map(|(name, time, error)| with(name, time, error)).into();
        let ladder = LadderReport { ladder: "sampler", in_use: "own".to_owned(), rungs };
        let beaten: Vec<&str> = ladder.rungs.iter().filter(|rung| ladder.beats(rung)).map(|rung| rung.rung.as_str()).collect();
        assert_eq!(beaten, ["both"]);
    }

    /// Protects: a rung below the one in use that is no faster and more than ten times as wrong alone is named, and neither one that is
    /// faster, nor one that is nearly as good, nor what is above.
    #[test]
    fn what_is_wrong_in_vain_is_named() {
        let rungs = vec![
            rung("torn", false, 0.96, Some(0.02)),
            rung("quick", false, 0.9, Some(0.02)),
            rung("near", false, 1.0, Some(0.009)),
            rung("own", true, 1.0, Some(0.001)),
            rung("slow", false, 2.0, Some(0.5)),
        ];
        let ladder = LadderReport { ladder: "precision", in_use: "own".to_owned(), rungs };
        let found: Vec<(&str, [f64; 2])> = ladder.in_vain().map(|(rung, errors)| (rung.rung.as_str(), errors)).collect();
        assert_eq!(found, [("torn", [0.02, 0.001])]);
        let unknown = LadderReport { rungs: vec![rung("torn", false, 1.0, Some(1.0)), rung("own", true, 1.0, None)], ..ladder };
        assert_eq!(unknown.in_vain().count(), 0);
    }
}
