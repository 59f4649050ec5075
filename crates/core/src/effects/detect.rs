//! Findings for every effect, from the scene's facts and the settings.

use self::EffectHandling::{Depends, Does, Lacks, Traces, Unread};
use super::facts::EffectFacts;
use super::table::effects;
use super::{Effect, EffectFinding, EffectStatus};
use crate::scene::Integrator;
use crate::settings::Settings;

/// Treatment of a present effect by an integrator, with its reason.
#[derive(Clone, Copy)]
enum EffectHandling {
    /// Simulated.
    Does(&'static str),
    /// Simulated by additional ray segments.
    Traces(&'static str),
    /// Left out; with a hint.
    Lacks(&'static str, &'static str),
    /// Left out, because the scene format cannot represent these properties of an imported file;
    /// with a hint.
    Unread(&'static str),
    /// Depends on further facts and settings.
    Depends(fn(&EffectFacts, &Settings) -> EffectHandling),
}

/// Treatment of an effect by an integrator, and the reason for its absence.
struct EffectReading(EffectHandling, &'static str);

/// A row of the table of effects.
struct EffectRow {
    effect: Effect,
    /// Path of the scene's part that needs the effect, under path tracing or not.
    source: fn(&EffectFacts, bool) -> Option<&String>,
    /// Readings by Whitted ray tracing and by path tracing.
    readings: [EffectReading; 2],
}

/// Both integrators treat the effect alike.
const fn both(how: EffectHandling, absent: &'static str) -> [EffectReading; 2] {
    each(how, how, absent)
}

/// The integrators treat the effect differently.
const fn each(
    whitted: EffectHandling,
    paths: EffectHandling,
    absent: &'static str,
) -> [EffectReading; 2] {
    apart((whitted, absent), (paths, absent))
}

/// The integrators treat the effect differently, with different reasons for its absence.
const fn apart(
    whitted: (EffectHandling, &'static str),
    paths: (EffectHandling, &'static str),
) -> [EffectReading; 2] {
    [
        EffectReading(whitted.0, whitted.1),
        EffectReading(paths.0, paths.1),
    ]
}

/// Whitted ray tracing leaves the effect out.
const fn for_paths(present: &'static str, absent: &'static str) -> [EffectReading; 2] {
    each(Lacks(present, PATH), Does(present), absent)
}

/// Hint for effects that only path tracing simulates.
const PATH: &str = "--integrator path";
/// Hint for effects that are a look without a physical counterpart.
const WHITTED: &str = "--integrator whitted";
/// Hint for effects that samples at fixed places miss.
const SAMPLES: &str = "--spp 64, say";

macro_rules! rows {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $role:ident, $source:expr, $readings:expr;)*) => {
        /// All effects, in the order of [`Effect::ALL`].
        const ROWS: &[EffectRow] = &[$(EffectRow { effect: Effect::$variant, source: $source, readings: $readings }),*];
    };
}
effects!(rows);

/// Returns the integrator that a scene needs where the user chose none. Whitted ray tracing is used
/// where it leaves out nothing that path tracing simulates, as for classic materials: its pictures
/// have no noise and need only enough samples for edges. Physical materials light each other and
/// need path tracing.
pub(super) fn called_for(effect_facts: &EffectFacts) -> Integrator {
    let needs_paths = |row: &EffectRow| {
        matches!(row.readings[0].0, Lacks(_, PATH)) && (row.source)(effect_facts, false).is_some()
    };
    if ROWS.iter().any(needs_paths) {
        Integrator::Path
    } else {
        Integrator::Whitted
    }
}

/// Returns the findings for a scene, in the order of [`Effect::ALL`].
pub(super) fn found(
    effect_facts: &EffectFacts,
    settings: &Settings,
    paths: bool,
) -> Vec<EffectFinding> {
    ROWS.iter()
        .map(|row| row.found(effect_facts, settings, paths))
        .collect()
}

impl EffectRow {
    fn found(&self, effect_facts: &EffectFacts, settings: &Settings, paths: bool) -> EffectFinding {
        let (source, EffectReading(how, absent)) = (
            (self.source)(effect_facts, paths).cloned(),
            &self.readings[usize::from(paths)],
        );
        let how = if let Depends(on) = how {
            on(effect_facts, settings)
        } else {
            *how
        };
        let (status, because, hint) = match how {
            _ if source.is_none() => (EffectStatus::Absent, *absent, None),
            Traces(_) if settings.max_depth < 2 => (
                EffectStatus::LeftOut,
                "every path ends at its first hit (maximum depth 1)",
                Some("--max-depth 2 or more"),
            ),
            Does(because) | Traces(because) => (EffectStatus::Simulated, because, None),
            Lacks(because, hint) => (EffectStatus::LeftOut, because, Some(hint)),
            Unread(hint) => (
                EffectStatus::LeftOut,
                effect_facts.unread_parts.as_str(),
                Some(hint),
            ),
            Depends(_) => (EffectStatus::Absent, *absent, None),
        };
        EffectFinding {
            effect: self.effect,
            status,
            because: because.to_owned(),
            source,
            hint: hint.map(str::to_owned),
        }
    }
}
