//! Display settings in `compare`, which convert linear pictures to display values for FLIP. The
//! settings come from flags, otherwise from the files of the pictures.

use raywright_core::display::Display;
use raywright_core::picture::Encoding;
use serde::Serialize;

use super::noise::ComparisonPicture;
use crate::origin;

/// The display settings for linear pictures, and their source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChosenDisplay {
    /// The display settings: tone map, transfer curve and exposure.
    pub display: Display,
    /// Source of the settings that no flag gives.
    pub source: DisplaySource,
}

/// Source of the display settings that no flag gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DisplaySource {
    /// No source: flags give all settings.
    Flags,
    /// Metadata of the first picture's file.
    Picture,
    /// Metadata of the second picture's file.
    Reference,
    /// The default display, because neither file records a display.
    Default,
}

/// A [`ChosenDisplay`] in the JSON report.
#[derive(Serialize)]
pub struct DisplayReport {
    tone_map: String,
    gamma: String,
    exposure: f64,
    from: DisplaySource,
}

impl ChosenDisplay {
    /// Chooses the display for two pictures; `None` if both hold display values already. If only
    /// one picture holds display values, the display recorded in its file takes precedence over the
    /// display in the other file. `with_flags` applies the flags to a display; `all_given` states
    /// whether flags give all settings of a display.
    pub fn choose_display(
        (with_flags, all_given): (impl FnOnce(Display) -> Display, bool),
        picture: &ComparisonPicture,
        reference: &ComparisonPicture,
    ) -> Option<Self> {
        let sides = [
            (reference, DisplaySource::Reference),
            (picture, DisplaySource::Picture),
        ];
        let is_linear =
            |judged: &ComparisonPicture| judged.stored_picture.encoding == Encoding::Linear;
        if !sides.iter().any(|(judged, _)| is_linear(judged)) {
            return None;
        }
        let (linear, shown): (Vec<_>, Vec<_>) =
            sides.into_iter().partition(|(judged, _)| is_linear(judged));
        let own = shown
            .into_iter()
            .chain(linear)
            .find_map(|(judged, source)| Some((judged.display?, source)));
        let (own_display, source) = own.unwrap_or((Display::default(), DisplaySource::Default));
        let Display {
            tone_map,
            curve,
            exposure_stops,
            ..
        } = with_flags(own_display);
        let display = Display {
            tone_map,
            curve,
            exposure_stops,
            ..Display::default()
        };
        Some(Self {
            display,
            source: if all_given {
                DisplaySource::Flags
            } else {
                source
            },
        })
    }

    /// Formats the display as text for the table, with the name of its source.
    pub fn format_display_row(&self, [picture, reference]: [&str; 2]) -> String {
        let DisplayReport {
            tone_map,
            gamma,
            exposure,
            from,
        } = self.to_report();
        let from = match from {
            DisplaySource::Flags => String::new(),
            DisplaySource::Picture => format!(", from the file {picture}"),
            DisplaySource::Reference => format!(", from the file {reference}"),
            DisplaySource::Default => {
                ", the default, because neither file records a display".to_owned()
            }
        };
        format!("tone map {tone_map}, gamma {gamma}, exposure {exposure}{from}")
    }

    /// Converts the display to the form of the JSON report.
    pub fn to_report(self) -> DisplayReport {
        let Display {
            tone_map,
            curve,
            exposure_stops,
            ..
        } = self.display;
        let [tone_map, gamma] = [
            origin::variant_name(&tone_map),
            origin::variant_name(&curve),
        ];
        DisplayReport {
            tone_map,
            gamma,
            exposure: exposure_stops,
            from: self.source,
        }
    }
}
