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

/// Begins an SVG picture, which `to_svg` of a plot ends. Texts are the title, and the name of a picture
/// without one; lines stand below the title. A picture without a title begins at `bare`.
pub(super) fn begin_svg(
    texts: [&str; 2],
    lines: [&str; 2],
    [width, bare, bottom]: [f64; 3],
) -> String {
    let ([title, name], [above, below]) = (texts.map(escape_xml), lines.map(escape_xml));
    let heading = format!(
        "<text class=\"title\" x=\"24\" y=\"34\">{title}</text>\n<text class=\"soft\" x=\"24\" y=\"56\">{above}</text>\n<text class=\"soft\" x=\"24\" y=\"75\">{below}</text>\n"
    );
    let (top, name, heading) = match title.is_empty() {
        true => (bare, name, String::new()),
        false => (0.0, title, heading),
    };
    let (height, style) = (bottom - top, include_str!("plot.css"));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 {top} {width} {height}\" width=\"{width}\" height=\"{height}\" \
         role=\"group\" aria-label=\"{name}\">\n<style>\n{style}</style>\n<rect class=\"paper\" y=\"{top}\" width=\"{width}\" height=\"{height}\"/>\n{heading}"
    )
}

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
        let mut svg = begin_svg(
            [&self.title, &self.y.label],
            [&self.subtitle, &self.circumstances],
            [WIDTH, BARE_TOP, HEIGHT],
        );
        self.draw_grid(&mut svg, &frame);
        // The first line and its names lie on top.
        for line in self.lines.iter().rev() {
            line.draw_line(&mut svg, &frame);
        }
        self.draw_legend(&mut svg);
        svg.push_str("</svg>\n");
        svg
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

    /// Draws the legend, in the upper corner that the lines do not reach.
    fn draw_legend(&self, svg: &mut String) {
        let x = match self.is_falling {
            true => AREA[2] - 300.0,
            false => AREA[0] + 18.0,
        };
        let mut y = AREA[1] + 20.0;
        let label = |y: f64, name: &str| {
            let (x, y, name) = (x + 50.0, y + 5.0, escape_xml(name));
            format!("<text x=\"{x}\" y=\"{y}\">{name}</text>\n")
        };
        for line in self.lines.iter().filter(|line| !line.points.is_empty()) {
            if !line.is_unjoined {
                line.draw_stroke(svg, &format!("M{x} {y}h40"));
            }
            line.draw_marker(svg, x + 20.0, y);
            *svg += &label(y, &line.name);
            y += 23.0;
        }
        let mut points = self.lines.iter().flat_map(|line| &line.points);
        if points.any(|point| point.is_bound) {
            let arrow = down_arrow_path(x + 20.0, y - 8.0);
            *svg += &format!("<path class=\"spread mark\" d=\"{arrow}\"/>\n");
            *svg += &label(y, "an upper bound, within noise");
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
