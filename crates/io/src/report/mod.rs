//! Measurement reports: plots as SVG, and self-contained HTML pages.

mod labels;
mod margins;
mod page;
mod plot;
mod scale;
mod table;
mod tables;

pub use margins::{MarginRow, Margins};
pub use page::{Page, accuracy_plot, document};
pub use plot::{Axis, Plot, PlotLine, PlotMark, PlotPoint, ThemeColour, escape_xml};
pub use table::{Align, Table, TableRow, format_uncertain, wrapped};
pub use tables::light_change;
