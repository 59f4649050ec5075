//! Findings (status and reason) for every effect, from the facts about a scene and the settings.

use self::EffectTreatment::{
    Conditional, LeftOut, Simulated, SimulatedByRays, UnsupportedExtensions,
};
use super::facts::EffectFacts;
use super::table::effects;
use super::{Effect, EffectAssessment, EffectStatus};
use crate::scene::Integrator;
use crate::settings::Settings;

/// Treatment by an integrator of an effect that the scene needs, with the reason given to users.
#[derive(Clone, Copy)]
enum EffectTreatment {
    /// Simulated, with the reason.
    Simulated(&'static str),
    /// Simulated by additional ray segments, with the reason. A maximum depth of 1 leaves the
    /// effect out.
    SimulatedByRays(&'static str),
    /// Left out, with the reason and a hint how to simulate the effect.
    LeftOut(&'static str, &'static str),
    /// Left out, because the scene format cannot represent some properties of an imported file. The
    /// reason lists these properties; the field is the hint.
    UnsupportedExtensions(&'static str),
    /// Treatment that depends on facts of the scene and on settings.
    Conditional(fn(&EffectFacts, &Settings) -> EffectTreatment),
}

/// Treatment of an effect by an integrator, and the reason given to users if the scene does not
/// need the effect.
struct IntegratorTreatment(EffectTreatment, &'static str);

/// Rule for one effect: its cause in the scene, and its treatment by each integrator.
struct EffectRule {
    effect: Effect,
    /// Function that returns the path, in the scene file, of the first object or setting that needs
    /// the effect. The flag is whether path tracing is used.
    source: fn(&EffectFacts, bool) -> Option<&String>,
    /// Treatments by Whitted ray tracing and by path tracing.
    treatments: [IntegratorTreatment; 2],
}

/// Returns the same treatment for both integrators. `absent` is the reason given if the scene does
/// not need the effect.
const fn same_treatment_in_both(
    how: EffectTreatment,
    absent: &'static str,
) -> [IntegratorTreatment; 2] {
    treatment_in_each(how, how, absent)
}

/// Returns a treatment for each integrator. `absent` is the reason given if the scene does not need
/// the effect.
const fn treatment_in_each(
    whitted: EffectTreatment,
    paths: EffectTreatment,
    absent: &'static str,
) -> [IntegratorTreatment; 2] {
    treatments_with_reasons((whitted, absent), (paths, absent))
}

/// Returns a treatment for each integrator, each with its own reason for scenes that do not need
/// the effect.
const fn treatments_with_reasons(
    whitted: (EffectTreatment, &'static str),
    paths: (EffectTreatment, &'static str),
) -> [IntegratorTreatment; 2] {
    [
        IntegratorTreatment(whitted.0, whitted.1),
        IntegratorTreatment(paths.0, paths.1),
    ]
}

/// Returns the treatments of an effect that path tracing simulates and Whitted ray tracing leaves
/// out. `present` and `absent` are the reasons given if the scene needs the effect or not.
const fn path_tracing_only_treatment(
    present: &'static str,
    absent: &'static str,
) -> [IntegratorTreatment; 2] {
    treatment_in_each(LeftOut(present, PATH), Simulated(present), absent)
}

/// Hint for effects that only path tracing simulates.
const PATH: &str = "--integrator path";
/// Hint for effects without a physical counterpart, which only Whitted ray tracing simulates.
const WHITTED: &str = "--integrator whitted";
/// Hint for effects that a fixed pattern of samples cannot simulate.
const SAMPLES: &str = "--spp 64, for example";

macro_rules! rows {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $role:ident, $source:expr, $treatments:expr;)*) => {
        /// Rows of all effects, in the order of [`Effect::ALL`].
        const ROWS: &[EffectRule] = &[$(EffectRule { effect: Effect::$variant, source: $source, treatments: $treatments }),*];
    };
}
effects!(rows);

/// Returns the integrator that suits a scene, for users who chose none. Whitted ray tracing is used
/// if it simulates every effect that path tracing does, as for classic materials. Its pictures have
/// no noise, and samples only smooth edges. Physical materials illuminate each other and need path
/// tracing.
pub(super) fn choose_integrator(effect_facts: &EffectFacts) -> Integrator {
    let needs_paths = |row: &EffectRule| {
        matches!(row.treatments[0].0, LeftOut(_, PATH))
            && (row.source)(effect_facts, false).is_some()
    };
    if ROWS.iter().any(needs_paths) {
        Integrator::Path
    } else {
        Integrator::Whitted
    }
}

/// Returns the finding for every effect, in the order of [`Effect::ALL`]. `paths` is whether path
/// tracing is used.
pub(super) fn evaluate_effects(
    effect_facts: &EffectFacts,
    settings: &Settings,
    paths: bool,
) -> Vec<EffectAssessment> {
    ROWS.iter()
        .map(|row| row.evaluate_effect(effect_facts, settings, paths))
        .collect()
}

impl EffectRule {
    /// Returns the finding for this rule's effect. `paths` is whether path tracing is used.
    fn evaluate_effect(
        &self,
        effect_facts: &EffectFacts,
        settings: &Settings,
        paths: bool,
    ) -> EffectAssessment {
        let (source, IntegratorTreatment(how, absent)) = (
            (self.source)(effect_facts, paths).cloned(),
            &self.treatments[usize::from(paths)],
        );
        let how = if let Conditional(on) = how {
            on(effect_facts, settings)
        } else {
            *how
        };
        let (status, because, hint) = match how {
            _ if source.is_none() => (EffectStatus::Absent, *absent, None),
            SimulatedByRays(_) if settings.max_depth < 2 => (
                EffectStatus::LeftOut,
                "the maximum depth is 1, so every path ends at its first hit",
                Some("--max-depth 2 or more"),
            ),
            Simulated(because) | SimulatedByRays(because) => {
                (EffectStatus::Simulated, because, None)
            }
            LeftOut(because, hint) => (EffectStatus::LeftOut, because, Some(hint)),
            UnsupportedExtensions(hint) => (
                EffectStatus::LeftOut,
                effect_facts.unread_extensions.as_str(),
                Some(hint),
            ),
            Conditional(_) => (EffectStatus::Absent, *absent, None),
        };
        EffectAssessment {
            effect: self.effect,
            status,
            because: because.to_owned(),
            source,
            hint: hint.map(str::to_owned),
        }
    }
}
