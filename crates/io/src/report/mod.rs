//! Measurement reports: sections with tables as text, Markdown and HTML, plots as SVG, and
//! self-contained HTML pages.

mod error_margins;
mod numbers;
mod page;
mod plot;
mod scale;
mod section;
mod table;
mod tables;

pub use error_margins::{ErrorMarginPlot, ErrorMarginRow};
pub use numbers::{
    format_budget, format_change, format_count, format_duration, format_estimate,
    format_four_digits, format_median, format_memory_parts, format_percent, format_power,
    format_precise_duration, format_rough_estimate, format_seconds, format_significant_digits,
    format_three_digits, format_whole_seconds,
};
pub use page::{AccuracyPage, html_document};
pub use plot::{Plot, PlotAxis, PlotLine, PlotPoint, ThemeColour, escape_xml};
pub use section::ReportSection;
pub use table::{ColumnAlignment, Table, TableRow, format_uncertain, wrap_text};
