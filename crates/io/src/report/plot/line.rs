//! Drawing of a plot's lines, points and error bars as SVG.

use std::fmt::Write;

use super::super::scale::PlotScales;
use super::{PlotLine, escape_xml};

impl PlotLine {
    fn css_class(&self) -> &'static str {
        self.colour.css_class()
    }

    /// Draws a path in the colour and dashes of the line.
    pub(super) fn draw_stroke(&self, svg: &mut String, path: &str) {
        let dashes = if self.is_dashed {
            " stroke-dasharray=\"7 5\""
        } else {
            ""
        };
        let _ = writeln!(
            svg,
            "<path class=\"line {}\"{dashes} d=\"{path}\"/>",
            self.css_class()
        );
    }

    /// Draws the marker of a point, centred at (x, y) in pixels of the SVG.
    pub(super) fn draw_marker(&self, svg: &mut String, x: f64, y: f64) {
        let class = self.css_class();
        let _ = if self.is_dashed {
            let (x, y) = (x - 3.5, y - 3.5);
            writeln!(
                svg,
                "<rect class=\"open {class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"7\" height=\"7\"/>"
            )
        } else {
            writeln!(
                svg,
                "<circle class=\"dot {class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\"/>"
            )
        };
    }

    /// Draws the line with its points and their error bars.
    pub(super) fn draw_line(&self, svg: &mut String, frame: &PlotScales) {
        let mut path = String::new();
        for (i, point) in self.points.iter().enumerate() {
            let _ = write!(
                path,
                "{}{:.1} {:.1}",
                if i == 0 { 'M' } else { 'L' },
                frame.x.map_value(point.x),
                frame.y.map_value(point.y)
            );
        }
        if path.is_empty() {
            return;
        }
        if !self.is_unjoined {
            self.draw_stroke(svg, &path);
        }
        for point in &self.points {
            let (x, [low, high]) = (
                frame.x.map_value(point.x),
                point.spread.map(|y| frame.y.map_value(y)),
            );
            let y = frame.y.map_value(point.y);
            let spread = if point.is_bound {
                down_arrow_path(x, y)
            } else {
                format!("M{x:.1} {low:.1}V{high:.1}")
            };
            let _ = writeln!(
                svg,
                "<path class=\"spread {}\" fill=\"none\" d=\"{spread}\"/>",
                self.css_class()
            );
            if !point.name.is_empty() {
                // Where lines fall, the upper right of a point is free.
                let _ = writeln!(
                    svg,
                    "<text class=\"name label\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                    x + 6.0,
                    y - 6.0,
                    escape_xml(&point.name)
                );
            }
            match &point.label {
                None => self.draw_marker(svg, x, y),
                Some(label) => {
                    let label = escape_xml(label);
                    let _ = write!(
                        svg,
                        "<g tabindex=\"0\" role=\"img\" aria-label=\"{label}\"><title>{label}</title>"
                    );
                    self.draw_marker(svg, x, y);
                    svg.push_str("</g>\n");
                }
            }
        }
    }
}

/// Returns the SVG path of a downward arrow from a point; the arrow marks an upper bound.
pub(super) fn down_arrow_path(x: f64, y: f64) -> String {
    format!("M{x:.1} {y:.1}v18m-4 -6l4 6l4 -6")
}
