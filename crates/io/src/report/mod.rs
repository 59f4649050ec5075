//! What was measured, for people to look at: plots as SVG, and pages that need nothing but a browser.

mod labels;
mod page;
mod plot;
mod scale;
mod table;
mod tables;

pub use page::{Page, accuracy_plot};
pub use plot::{Axis, Colour, Line, Mark, Plot, Point};
pub use table::{Align, Table, TableRow, uncertain, wrapped};
pub use tables::light_change;
