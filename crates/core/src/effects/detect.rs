//! Findings for every effect, from the scene's facts and the settings.

use self::EffectHandling::{Depends, Does, Lacks, Traces, Unread};
use super::facts::EffectFacts;
use super::table::effects;
use super::{Effect, EffectFinding, EffectStatus};
use crate::scene::Integrator;
use crate::settings::Settings;

/// Treatment by an integrator of an effect that the scene needs, with the reason.
#[derive(Clone, Copy)]
enum EffectHandling {
    /// Simulated, with the reason.
    Does(&'static str),
    /// Simulated by additional ray segments, so left out with a maximum depth of 1.
    Traces(&'static str),
    /// Left out; with a reason and a hint.
    Lacks(&'static str, &'static str),
    /// Left out, because the scene format cannot represent these properties of an imported file.
    /// The reason lists the properties; the hint is given.
    Unread(&'static str),
    /// Treatment that depends on facts of the scene and on settings.
    Depends(fn(&EffectFacts, &Settings) -> EffectHandling),
}

/// Treatment of an effect by an integrator, and the reason to report if the scene does not need the
/// effect.
struct EffectReading(EffectHandling, &'static str);

/// Row of the table of effects: cause in the scene, and treatment by each integrator.
struct EffectRow {
    effect: Effect,
    /// Function that returns the path, in the scene file, of the part that needs the effect. The
    /// flag is whether path tracing is used.
    source: fn(&EffectFacts, bool) -> Option<&String>,
    /// Treatments by Whitted ray tracing and by path tracing.
    readings: [EffectReading; 2],
}

/// Returns the same treatment for both integrators.
const fn both(how: EffectHandling, absent: &'static str) -> [EffectReading; 2] {
    each(how, how, absent)
}

/// Returns a treatment for each integrator, with a common reason for absence.
const fn each(
    whitted: EffectHandling,
    paths: EffectHandling,
    absent: &'static str,
) -> [EffectReading; 2] {
    apart((whitted, absent), (paths, absent))
}

/// Returns a treatment for each integrator, each with its own reason for absence.
const fn apart(
    whitted: (EffectHandling, &'static str),
    paths: (EffectHandling, &'static str),
) -> [EffectReading; 2] {
    [
        EffectReading(whitted.0, whitted.1),
        EffectReading(paths.0, paths.1),
    ]
}

/// Returns the treatments of an effect that path tracing simulates and Whitted ray tracing leaves
/// out.
const fn for_paths(present: &'static str, absent: &'static str) -> [EffectReading; 2] {
    each(Lacks(present, PATH), Does(present), absent)
}

/// Hint for effects that only path tracing simulates.
const PATH: &str = "--integrator path";
/// Hint for effects without a physical counterpart, which only Whitted ray tracing simulates.
const WHITTED: &str = "--integrator whitted";
/// Hint for effects that a fixed pattern of samples cannot simulate.
const SAMPLES: &str = "--spp 64, say";

macro_rules! rows {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $role:ident, $source:expr, $readings:expr;)*) => {
        /// Rows of all effects, in the order of [`Effect::ALL`].
        const ROWS: &[EffectRow] = &[$(EffectRow { effect: Effect::$variant, source: $source, readings: $readings }),*];
    };
}
effects!(rows);

/// Returns the integrator that suits a scene, for users who chose none. Whitted ray tracing is used
/// if it simulates every effect that path tracing does, as for classic materials: its pictures have
/// no noise, and samples only smooth edges. Physical materials light each other and need path
/// tracing.
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

/// Returns the finding for every effect, in the order of [`Effect::ALL`]. `paths` is whether path
/// tracing is used.
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
