//! From what a scene has and the settings to what is found of every effect.

use self::How::{Depends, Does, Lacks, Traces, Unread};
use super::facts::SceneFacts;
use super::table::effects;
use super::{Effect, Finding, Status};
use crate::scene::Integrator;
use crate::settings::Settings;

/// How an integrator deals with an effect that a scene has, and why.
#[derive(Clone, Copy)]
enum How {
    /// It simulates it.
    Does(&'static str),
    /// It simulates it by a second segment.
    Traces(&'static str),
    /// It leaves it out; what to do about it.
    Lacks(&'static str, &'static str),
    /// It leaves out what imported files say that scenes have no words for; what to do about it.
    Unread(&'static str),
    /// That depends on more.
    Depends(fn(&SceneFacts, &Settings) -> How),
}

/// What an integrator makes of an effect, and why there is none where nothing calls for it.
struct Reading(How, &'static str);

/// What is known of an effect.
struct EffectRow {
    effect: Effect,
    /// Path of what calls for it, where paths are followed or not.
    source: fn(&SceneFacts, bool) -> Option<&String>,
    /// By Whitted ray tracing and by paths.
    readings: [Reading; 2],
}

/// Both integrators read it alike.
const fn both(how: How, absent: &'static str) -> [Reading; 2] {
    each(how, how, absent)
}

/// Each integrator has a way of its own.
const fn each(whitted: How, paths: How, absent: &'static str) -> [Reading; 2] {
    apart((whitted, absent), (paths, absent))
}

/// Each integrator means something else by it.
const fn apart(whitted: (How, &'static str), paths: (How, &'static str)) -> [Reading; 2] {
    [Reading(whitted.0, whitted.1), Reading(paths.0, paths.1)]
}

/// Whitted's rules have no reading of it.
const fn for_paths(present: &'static str, absent: &'static str) -> [Reading; 2] {
    each(Lacks(present, PATH), Does(present), absent)
}

/// What to do about what paths find alone.
const PATH: &str = "--integrator path";
/// What to do about what is a look and no light.
const WHITTED: &str = "--integrator whitted";
/// What to do about what samples at fixed places don't meet.
const SAMPLES: &str = "--spp 64, say";

macro_rules! rows {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $role:ident, $source:expr, $readings:expr;)*) => {
        /// All effects, in the order of [`Effect::ALL`].
        const ROWS: &[EffectRow] = &[$(EffectRow { effect: Effect::$variant, source: $source, readings: $readings }),*];
    };
}
effects!(rows);

/// The integrator that a scene calls for. One that says nothing has Whitted's, whose pictures take
/// no chance and so no more samples than edges need, where it leaves nothing out that paths find:
/// of classic materials. Physical ones light each other.
pub(super) fn called_for(facts: &SceneFacts) -> Integrator {
    let needs_paths = |row: &EffectRow| {
        matches!(row.readings[0].0, Lacks(_, PATH)) && (row.source)(facts, false).is_some()
    };
    if ROWS.iter().any(needs_paths) {
        Integrator::Path
    } else {
        Integrator::Whitted
    }
}

/// What a scene calls for, in the order of [`Effect::ALL`].
pub(super) fn found(facts: &SceneFacts, settings: &Settings, paths: bool) -> Vec<Finding> {
    ROWS.iter()
        .map(|row| row.found(facts, settings, paths))
        .collect()
}

impl EffectRow {
    fn found(&self, facts: &SceneFacts, settings: &Settings, paths: bool) -> Finding {
        let (source, Reading(how, absent)) = (
            (self.source)(facts, paths).cloned(),
            &self.readings[usize::from(paths)],
        );
        let how = if let Depends(on) = how {
            on(facts, settings)
        } else {
            *how
        };
        let (status, because, hint) = match how {
            _ if source.is_none() => (Status::Absent, *absent, None),
            Traces(_) if settings.max_depth < 2 => (
                Status::LeftOut,
                "every path ends at its first hit (maximum depth 1)",
                Some("--max-depth 2 or more"),
            ),
            Does(because) | Traces(because) => (Status::Simulated, because, None),
            Lacks(because, hint) => (Status::LeftOut, because, Some(hint)),
            Unread(hint) => (Status::LeftOut, facts.unread_parts.as_str(), Some(hint)),
            Depends(_) => (Status::Absent, *absent, None),
        };
        Finding {
            effect: self.effect,
            status,
            because: because.to_owned(),
            source,
            hint: hint.map(str::to_owned),
        }
    }
}
