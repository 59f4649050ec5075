//! Warnings of pairs of objects that are closer together than rounding resolves.

use raywright_core::ReadyScene;
use raywright_core::prepare::{LampRef, LightLeak};
use raywright_core::settings::{PrecisionChoice, Settings};
use raywright_io::report::format_significant_digits;
use raywright_io::{LoadedScene, Warning, WarningCode};

use super::names::{light_name, object_name};
use crate::notes::Notes;

/// Warns of pairs of transparent bodies so close together that light passes from one body into the
/// other without crossing the gap, and of partly transparent surfaces in one place.
pub fn note_closed_gaps(
    loaded: &mut LoadedScene,
    ready: &ReadyScene,
    settings: &Settings,
    notes: &mut Notes,
) {
    let gaps = ready.find_unresolved_gaps();
    for is_coincident in [false, true] {
        let mut alike = gaps.iter().filter(|gap| gap.is_coincident == is_coincident);
        let Some(gap) = alike.next() else {
            continue;
        };
        let [first, second] = [gap.object, gap.other].map(|object| object_name(loaded, object));
        let others = format_other_pairs(alike.count());
        let message = if is_coincident {
            let pair = if gap.object == gap.other {
                first
            } else {
                format!("{first} and {second}")
            };
            format!(
                "surfaces of {pair}{others} lie in one place: light that passes the first, which is partly transparent, passes the second unseen; \
                 remove the second or leave {} metres or more between them",
                format_significant_digits(gap.resolved_width, 2)
            )
        } else {
            format!(
                "the gap between {first} and {second}{others} is closed: light passes from the first into the second without crossing the gap, since they touch or \
                 are so close that rounding errors exceed their distance; {}",
                advise_distance(gap.resolved_width, settings)
            )
        };
        warn_of_precision(message, loaded, notes);
    }
}

/// Warns of lights so close behind an opaque object that rounding lets their light leak through the
/// object.
pub fn note_light_leaks(
    loaded: &mut LoadedScene,
    ready: &ReadyScene,
    settings: &Settings,
    notes: &mut Notes,
) {
    let leaks = ready.find_light_leaks();
    let [first, others @ ..] = leaks.as_slice() else {
        return;
    };
    let LightLeak {
        lamp,
        cover,
        resolved_distance,
    } = *first;
    let lamp = match lamp {
        LampRef::Light(index) => light_name(loaded, index),
        LampRef::Object(index) => object_name(loaded, index),
    };
    let message = format!(
        "{lamp} shines through {}{}, which is opaque but so close to the light that rounding errors exceed the distance; {}",
        object_name(loaded, cover),
        format_other_pairs(others.len()),
        advise_distance(resolved_distance, settings)
    );
    warn_of_precision(message, loaded, notes);
}

/// Formats the number of other pairs with the same problem; empty for none.
fn format_other_pairs(count: usize) -> String {
    if count == 0 {
        String::new()
    } else {
        format!(" (and {count} more such pairs)")
    }
}

/// Advises the least distance in metres between two objects that rounding resolves, and the
/// reference precision unless the render uses it.
fn advise_distance(metres: f64, settings: &Settings) -> String {
    let or_precision = if settings.precision == PrecisionChoice::Reference {
        ""
    } else {
        ", or add --precision reference"
    };
    format!(
        "leave {} metres or more between them{or_precision}",
        format_significant_digits(metres, 2)
    )
}

/// Adds a warning about precision to the notes, and to the warnings of the statistics.
fn warn_of_precision(message: String, loaded: &mut LoadedScene, notes: &mut Notes) {
    notes.add_warning(&message);
    loaded.warnings.push(Warning {
        code: WarningCode::Precision,
        message,
    });
}
