//! Status and reason of every effect, determined from facts about a scene and from the settings.

use self::EffectTreatment::{
    Conditional, LeftOut, Simulated, SimulatedByRays, UnsupportedExtensions,
};
use super::facts::EffectFacts;
use super::table::effects;
use super::{Effect, EffectAssessment, EffectStatus};
use crate::scene::Integrator;
use crate::settings::Settings;

/// How an integrator treats an effect that the scene needs. The texts are reasons and hints for
/// users.
#[derive(Clone, Copy)]
enum EffectTreatment {
    /// Simulated, with the reason.
    Simulated(&'static str),
    /// Simulated by additional ray segments, with the reason. With a maximum depth of 1, the effect
    /// is left out.
    SimulatedByRays(&'static str),
    /// Left out, with the reason and a hint how to simulate the effect.
    LeftOut(&'static str, &'static str),
    /// Left out, because the scene format cannot represent some properties of an imported file. The
    /// field is the hint; the reason lists these properties.
    UnsupportedExtensions(&'static str),
    /// Treatment that depends on facts of the scene and on settings.
    Conditional(fn(&EffectFacts, &Settings) -> EffectTreatment),
}

/// An integrator's treatment of an effect, and the reason given to users if the scene does not need
/// the effect.
struct IntegratorTreatment(EffectTreatment, &'static str);

/// Rule for one effect: what in a scene causes the effect, and how each integrator treats it.
struct EffectRule {
    effect: Effect,
    /// Function that returns the path, in the scene file, of the first object or setting that needs
    /// the effect. Its second argument is whether path tracing is used.
    source: fn(&EffectFacts, bool) -> Option<&String>,
    /// Treatments by Whitted ray tracing and by path tracing.
    treatments: [IntegratorTreatment; 2],
}

/// Returns the same treatment `how` for both integrators. `absent` is the reason given if the scene
/// does not need the effect.
const fn same_treatment_by_both_integrators(
    how: EffectTreatment,
    absent: &'static str,
) -> [IntegratorTreatment; 2] {
    treatment_by_each_integrator(how, how, absent)
}

/// Returns a treatment for each integrator. `absent` is the reason given if the scene does not need
/// the effect.
const fn treatment_by_each_integrator(
    whitted: EffectTreatment,
    paths: EffectTreatment,
    absent: &'static str,
) -> [IntegratorTreatment; 2] {
    treatments_with_reasons((whitted, absent), (paths, absent))
}

/// Returns a treatment for each integrator. The text beside each treatment is the reason that this
/// integrator gives if the scene does not need the effect.
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
/// out. `present` is the reason given if the scene needs the effect, `absent` if it does not.
const fn path_tracing_only_treatment(
    present: &'static str,
    absent: &'static str,
) -> [IntegratorTreatment; 2] {
    treatment_by_each_integrator(LeftOut(present, PATH), Simulated(present), absent)
}

/// Hint for effects that only path tracing simulates.
const PATH: &str = "--integrator path";
/// Hint for effects without a physical counterpart, which only Whitted ray tracing simulates.
const WHITTED: &str = "--integrator whitted";
/// Hint for effects that a fixed pattern of samples cannot simulate.
const SAMPLES: &str = "--spp 64, for example";

macro_rules! rows {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $role:ident, $source:expr, $treatments:expr;)*) => {
        /// Rules of all effects, in the order of [`Effect::ALL`].
        const ROWS: &[EffectRule] = &[$(EffectRule { effect: Effect::$variant, source: $source, treatments: $treatments }),*];
    };
}
effects!(rows);

/// Returns the integrator for a scene whose user chose none. It is Whitted ray tracing if that
/// simulates every effect of the scene that path tracing does, as for classic materials: its
/// pictures have no noise, and samples only smooth edges. Otherwise it is path tracing, because
/// physical materials illuminate each other.
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
