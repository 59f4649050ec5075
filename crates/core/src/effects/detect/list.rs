//! A list of findings: the ways in which what a scene has becomes a status, a reason and a hint.

use super::super::facts::SceneFacts;
use super::super::{Effect, Finding, Status};
use crate::settings::{Sampling, Settings};

/// Why there is no motion.
const NOTHING_MOVES: &str = "nothing moves while the shutter is open";

/// Findings in the order in which they are made.
#[derive(Default)]
pub(super) struct FindingList(pub Vec<Finding>);

impl FindingList {
    fn push(&mut self, effect: Effect, status: Status, because: &str, source: Option<String>, hint: Option<String>) {
        self.0.push(Finding { effect, status, because: because.to_owned(), source, hint });
    }

    /// Simulated wherever it is present.
    pub fn plain(&mut self, effect: Effect, source: &Option<String>, present: &str, absent: &str) {
        match source {
            Some(_) => self.push(effect, Status::Simulated, present, source.clone(), None),
            None => self.push(effect, Status::Absent, absent, None, None),
        }
    }

    /// Needs a second segment.
    pub fn traced(&mut self, effect: Effect, source: &Option<String>, settings: &Settings, present: &str, absent: &str) {
        match source {
            Some(_) if settings.max_depth < 2 => {
                let because = "every path ends at its first hit (maximum depth 1)";
                self.push(effect, Status::LeftOut, because, source.clone(), Some("--max-depth 2 or more".to_owned()));
            }
            _ => self.plain(effect, source, present, absent),
        }
    }

    /// A lens needs samples on it.
    pub fn lens(&mut self, source: &Option<String>, settings: &Settings) {
        match (source, settings.sampling) {
            (Some(_), Sampling::Pattern(_)) => {
                let because = "a fixed pattern sends every ray through the middle of the lens";
                self.push(Effect::DepthOfField, Status::LeftOut, because, source.clone(), Some("--spp 64, say".to_owned()));
            }
            _ => self.plain(Effect::DepthOfField, source, "the camera has an aperture", "the camera is a pinhole"),
        }
    }

    /// Motion needs samples at different times.
    pub fn motion(&mut self, f: &SceneFacts, settings: &Settings) {
        let (because, hint) = match settings.sampling {
            _ if f.motion.is_none() || f.instant => return self.plain(Effect::Motion, &None, "", NOTHING_MOVES),
            _ if f.exposure.is_none() => {
                ("the camera has no shutter, so everything is seen at time 0", "give it `shutter = [0, 1]`")
            }
            Sampling::Pattern(_) => ("a fixed pattern asks at one time, when the shutter opens", "--spp 64, say"),
            Sampling::General(_) => {
                return self.plain(Effect::Motion, &f.motion, "something moves while the shutter is open", NOTHING_MOVES);
            }
        };
        self.push(Effect::Motion, Status::LeftOut, because, f.motion.clone(), Some(hint.to_owned()));
    }

    /// Never simulated by this integrator.
    pub fn missing(&mut self, effect: Effect, source: &Option<String>, present: &str, absent: &str, hint: &str) {
        match source {
            Some(_) => self.push(effect, Status::LeftOut, present, source.clone(), Some(hint.to_owned())),
            None => self.push(effect, Status::Absent, absent, None, None),
        }
    }
}
