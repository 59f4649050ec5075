//! Measurement reports: plots as SVG, and self-contained HTML pages.

mod effect_table;
mod error_margins;
mod labels;
mod page;
mod plot;
mod scale;
mod table;
mod tables;

pub use error_margins::{ErrorMarginPlot, ErrorMarginRow};
pub use page::{AccuracyPage, html_document, plot_accuracy};
pub use plot::{Plot, PlotAxis, PlotLine, PlotMark, PlotPoint, ThemeColour, escape_xml};
pub use table::{ColumnAlignment, Table, TableRow, format_uncertain, wrap_text};
pub use tables::format_light_change;
