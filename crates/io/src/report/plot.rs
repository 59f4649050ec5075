//! Double-logarithmic plots as SVG: lines with vertical error bars, and a legend. Colours
//! follow the reader's light or dark theme; a filled background keeps an embedded plot readable.

mod line;

use std::fmt::Write;

use super::scale::{DecadeScale, PlotScales};

use crate::masking::mask_control_characters;

use line::down_arrow_path;

/// A plot with two logarithmic axes, as an SVG picture.
#[derive(Clone, Debug, Default)]
pub struct Plot {
    /// Title; empty for a plot inside a page with its own title.
    pub title: String,
    /// Subject of the comparison, written in a line below the title.
    pub subtitle: String,
    /// Conditions of the measurement, written in a further line below the title.
    pub circumstances: String,
    /// Horizontal axis.
    pub x: PlotAxis,
    /// Vertical axis.
    pub y: PlotAxis,
    /// The plotted lines.
    pub lines: Vec<PlotLine>,
    /// Whether the lines fall from left to right. Then the legend is placed on the right, otherwise
    /// on the left.
    pub is_falling: bool,
}

/// A logarithmic axis, which spans whole decades around the values.
#[derive(Clone, Debug, Default)]
pub struct PlotAxis {
    /// Quantity with its unit.
    pub label: String,
    /// Function that formats the label of a power of ten from its exponent.
    pub tick: Option<fn(i32) -> String>,
}

/// A series of points in a [`Plot`], in ascending order of x, usually joined by lines.
#[derive(Clone, Debug, Default)]
pub struct PlotLine {
    /// Name in the legend.
    pub name: String,
    /// Colour; related lines share a colour.
    pub colour: ThemeColour,
    /// Whether the line is dashed with square markers, to distinguish lines of the same colour.
    pub is_dashed: bool,
    /// Whether the points are drawn without lines between them.
    pub is_unjoined: bool,
    /// Points with coordinates above zero.
    pub points: Vec<PlotPoint>,
}

/// A point of a [`PlotLine`], with an error bar and labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlotPoint {
    /// Horizontal coordinate.
    pub x: f64,
    /// Vertical coordinate.
    pub y: f64,
    /// Lower and upper end of the point's vertical error bar.
    pub spread: [f64; 2],
    /// Description, shown while a pointer is over the point; `None` if the name of the line
    /// suffices.
    pub label: Option<String>,
    /// Short name, written beside the point; empty for none.
    pub name: String,
    /// Whether the vertical coordinate is only an upper bound; drawn as an arrow downwards.
    pub is_bound: bool,
}

/// Colour of a line in a plot, with a light and a dark variant for the reader's theme.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ThemeColour {
    /// Orange.
    #[default]
    First,
    /// Blue.
    Second,
    /// Green.
    Third,
}

/// Area of the plot: left, top, right, bottom, in pixels of the SVG.
const AREA: [f64; 4] = [84.0, 96.0, 816.0, 510.0];

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 578.0;

/// y coordinate of the upper edge of a plot without a title, in pixels of the SVG.
const BARE_TOP: f64 = 80.0;

pub(super) const STYLE: &str = include_str!("plot.css");

impl Plot {
    /// Formats the plot as an SVG file. Lines without points are omitted; a plot without any point
    /// shows only its texts.
    pub fn to_svg(&self) -> String {
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let frame = PlotScales {
            x: DecadeScale::new(points().map(|p| p.x), AREA[0], AREA[2]),
            y: DecadeScale::new(
                points().flat_map(|p| [p.y, p.spread[0], p.spread[1]]),
                AREA[3],
                AREA[1],
            ),
        };
        let mut svg = String::new();
        self.draw_title(&mut svg);
        self.draw_grid(&mut svg, &frame);
        // The first line and its names lie on top.
        for line in self.lines.iter().rev() {
            line.draw_line(&mut svg, &frame);
        }
        self.draw_legend(&mut svg);
        svg.push_str("</svg>\n");
        svg
    }

    fn draw_title(&self, svg: &mut String) {
        let [title, subtitle, circumstances] =
            [&self.title, &self.subtitle, &self.circumstances].map(|text| escape_xml(text));
        let top = if title.is_empty() { BARE_TOP } else { 0.0 };
        let height = HEIGHT - top;
        let name = if title.is_empty() {
            escape_xml(&self.y.label)
        } else {
            title.clone()
        };
        // Writing to a string cannot fail.
        let _ = write!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 {top} {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
             role=\"group\" aria-label=\"{name}\">\n<desc>{subtitle}</desc>\n<style>\n{STYLE}</style>\n\
             <rect class=\"paper\" y=\"{top}\" width=\"{WIDTH}\" height=\"{height}\"/>\n"
        );
        if !title.is_empty() {
            let _ = write!(
                svg,
                "<text class=\"title\" x=\"24\" y=\"34\">{title}</text>\n<text class=\"soft\" x=\"24\" y=\"56\">{subtitle}</text>\n\
                 <text class=\"soft\" x=\"24\" y=\"75\">{circumstances}</text>\n"
            );
        }
    }

    /// Draws grid lines at powers of ten with their labels, and the names of the axes.
    fn draw_grid(&self, svg: &mut String, frame: &PlotScales) {
        let [left, top, right, bottom] = AREA;
        let words = |axis: &PlotAxis, e: i32| {
            axis.tick
                .map(|tick| escape_xml(&tick(e)))
                .unwrap_or_default()
        };
        for e in frame.x.decades() {
            let (x, word) = (frame.x.map_exponent(f64::from(e)), words(&self.x, e));
            let _ = writeln!(svg, "<path class=\"grid\" d=\"M{x:.1} {top}V{bottom}\"/>");
            let _ = writeln!(
                svg,
                "<text class=\"soft\" x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{word}</text>",
                bottom + 21.0
            );
        }
        for e in frame.y.decades() {
            let (y, word) = (frame.y.map_exponent(f64::from(e)), words(&self.y, e));
            let _ = writeln!(svg, "<path class=\"grid\" d=\"M{left} {y:.1}H{right}\"/>");
            let _ = writeln!(
                svg,
                "<text class=\"soft\" x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{word}</text>",
                left - 9.0,
                y + 5.0
            );
        }
        let (middle, centre) = ((left + right) / 2.0, (top + bottom) / 2.0);
        let (x, y) = (escape_xml(&self.x.label), escape_xml(&self.y.label));
        let _ = writeln!(
            svg,
            "<path class=\"axis\" d=\"M{left} {top}V{bottom}H{right}\"/>"
        );
        let _ = writeln!(
            svg,
            "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{x}</text>",
            bottom + 48.0
        );
        let _ = writeln!(
            svg,
            "<text transform=\"translate(20 {centre}) rotate(-90)\" text-anchor=\"middle\">{y}</text>"
        );
    }

    fn nonempty_lines(&self) -> impl Iterator<Item = &PlotLine> {
        self.lines.iter().filter(|line| !line.points.is_empty())
    }

    fn has_upper_bounds(&self) -> bool {
        self.lines
            .iter()
            .flat_map(|line| &line.points)
            .any(|point| point.is_bound)
    }

    /// Returns the box of the legend: left, top, right and bottom, in pixels of the SVG.
    fn legend_box(&self) -> [f64; 4] {
        let left = if self.is_falling {
            AREA[2] - 300.0
        } else {
            AREA[0] + 18.0
        };
        let rows = self.nonempty_lines().count() + usize::from(self.has_upper_bounds());
        [
            left,
            AREA[1] + 6.0,
            left + 300.0,
            AREA[1] + 10.0 + 23.0 * rows as f64,
        ]
    }

    /// Draws the legend, in the upper corner that the lines do not reach.
    fn draw_legend(&self, svg: &mut String) {
        let [left, ..] = self.legend_box();
        let row = |i: usize| AREA[1] + 20.0 + 23.0 * i as f64;
        if self.has_upper_bounds() {
            let (x, y) = (left, row(self.nonempty_lines().count()));
            let _ = writeln!(
                svg,
                "<path class=\"spread mark\" d=\"{}\"/>",
                down_arrow_path(x + 20.0, y - 8.0)
            );
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{}\">an upper bound, within noise</text>",
                x + 50.0,
                y + 5.0
            );
        }
        for (i, line) in self.nonempty_lines().enumerate() {
            let (x, y) = (left, row(i));
            if !line.is_unjoined {
                line.draw_stroke(svg, &format!("M{x} {y}h40"));
            }
            line.draw_marker(svg, x + 20.0, y);
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{}\">{}</text>",
                x + 50.0,
                y + 5.0,
                escape_xml(&line.name)
            );
        }
    }
}

impl ThemeColour {
    /// Returns the name of the colour's class in the style sheet.
    pub(super) fn css_class(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Second => "second",
            Self::Third => "third",
        }
    }
}

/// Escapes text for HTML and SVG, and replaces control characters.
pub fn escape_xml(text: &str) -> String {
    mask_control_characters(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests;
