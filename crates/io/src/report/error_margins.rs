//! Plot of error margins, with a row for each case of a numerical test. A margin is the error bound
//! of a case divided by its worst error. The scale is logarithmic; a case within its bound has a
//! margin of at least 1.

use std::fmt::Write;

use super::numbers::{format_number, format_power};
use super::plot::{STYLE, ThemeColour, escape_xml};
use super::scale::DecadeScale;

/// A plot of error margins, with a row for each hard case of `raywright stability`. An error margin
/// is the ratio of error bound to worst error.
#[derive(Clone, Debug, Default)]
pub struct ErrorMarginPlot {
    /// Title; empty for a plot inside a page with its own title.
    pub title: String,
    /// Conditions of the measurement, written in a line below the title.
    pub circumstances: String,
    /// Heading of the right column.
    pub right_heading: String,
    /// Meaning of each colour.
    pub legend: Vec<(ThemeColour, String)>,
    /// Rows of the plot, from top to bottom.
    pub rows: Vec<ErrorMarginRow>,
}

/// A row of an [`ErrorMarginPlot`]: a case with its margins, one for each measured variant.
#[derive(Clone, Debug, Default)]
pub struct ErrorMarginRow {
    /// Number of the case.
    pub name: String,
    /// Description in a sentence.
    pub description: String,
    /// Margins of the case: the ratio of error bound to worst error, in the colour of each measured
    /// variant.
    pub margins: Vec<(ThemeColour, f64)>,
    /// Text beside the margins, or in place of them.
    pub message: String,
    /// Whether the worst error exceeds the error bound.
    pub is_broken: bool,
    /// Text in the right column.
    pub right_text: String,
}

const WIDTH: f64 = 980.0;
const ROW: f64 = 21.0;
/// x coordinates in pixels of the SVG: number of the case, start and end of the scale, right text
/// column, right edge of that column. Numbers and scale come first, because a narrow window shows
/// only the left part.
const COLUMNS: [f64; 5] = [20.0, 56.0, 440.0, 464.0, 960.0];
/// y coordinate of the upper edge of the first row, in pixels of the SVG.
const TOP: f64 = 140.0;
/// Height in pixels of the SVG that is cut off above a plot without a title.
const BARE: f64 = 66.0;
/// Height below the last row, in pixels of the SVG.
const FOOT: f64 = 44.0;

impl ErrorMarginPlot {
    /// Formats the plot as an SVG file.
    pub fn to_svg(&self) -> String {
        let [_, left, right, _, edge] = COLUMNS;
        let margins = self
            .rows
            .iter()
            .flat_map(|row| &row.margins)
            .map(|(_, margin)| *margin);
        let scale = DecadeScale::new(margins.chain([1.0]), left + 12.0, right - 12.0);
        let bottom = TOP + ROW * self.rows.len() as f64;
        let (title, circumstances, aside) = (
            escape_xml(&self.title),
            escape_xml(&self.circumstances),
            escape_xml(&self.right_heading),
        );
        let top = if title.is_empty() { BARE } else { 0.0 };
        let height = bottom + FOOT - top;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 {top} {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
             role=\"group\" aria-label=\"{}\">\n<style>\n{STYLE}</style>\n<rect class=\"paper\" y=\"{top}\" width=\"{WIDTH}\" height=\"{height}\"/>\n",
            if title.is_empty() { "margins" } else { &title }
        );
        if !title.is_empty() {
            // Writing to a string cannot fail.
            let _ = writeln!(
                svg,
                "<text class=\"title\" x=\"20\" y=\"32\">{title}</text>\n<text class=\"soft\" x=\"20\" y=\"54\">{circumstances}</text>"
            );
        }
        let _ = writeln!(
            svg,
            "<text class=\"soft\" x=\"{edge}\" y=\"{}\" text-anchor=\"end\">{aside}</text>",
            TOP - 22.0
        );
        self.draw_legend(&mut svg);
        for exponent in scale.decades() {
            let x = scale.map_exponent(f64::from(exponent));
            let (class, word) = if exponent == 0 {
                ("axis", "bound".to_owned())
            } else {
                ("grid", format_power(exponent))
            };
            let _ = writeln!(
                svg,
                "<path class=\"{class}\" d=\"M{x:.1} {}V{bottom}\"/>",
                TOP - 12.0
            );
            // Labels are written at every n-th decade, as many as fit.
            if exponent % decades_between_labels(&scale) == 0 {
                for y in [TOP - 22.0, bottom + 20.0] {
                    let _ = writeln!(
                        svg,
                        "<text class=\"soft\" x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{word}</text>"
                    );
                }
            }
        }
        for (index, row) in self.rows.iter().enumerate() {
            row.draw_row(&mut svg, &scale, TOP + ROW * (index as f64 + 0.5));
        }
        svg.push_str("</svg>\n");
        svg
    }

    fn draw_legend(&self, svg: &mut String) {
        let [mut x, ..] = COLUMNS;
        for (colour, words) in &self.legend {
            let y = TOP - 46.0;
            let _ = writeln!(
                svg,
                "<circle class=\"dot {}\" cx=\"{}\" cy=\"{y}\" r=\"4\"/>",
                colour.css_class(),
                x + 4.0
            );
            let _ = writeln!(
                svg,
                "<text class=\"soft\" x=\"{}\" y=\"{}\">{}</text>",
                x + 14.0,
                y + 4.0,
                escape_xml(words)
            );
            x += 40.0 + 7.5 * words.chars().count() as f64;
        }
    }
}

impl ErrorMarginRow {
    fn draw_row(&self, svg: &mut String, scale: &DecadeScale, y: f64) {
        let [start, left, _, words, edge] = COLUMNS;
        let base = y + 4.5;
        let (class, broken) = if self.is_broken {
            ("first", " — not held")
        } else {
            ("", "")
        };
        let name = escape_xml(&self.name);
        let (sentence, message) = (escape_xml(&self.description), escape_xml(&self.message));
        let _ = writeln!(
            svg,
            "<text class=\"name {class}\" x=\"{start}\" y=\"{base:.1}\">{name}</text>"
        );
        let _ = writeln!(
            svg,
            "<text class=\"name\" x=\"{words}\" y=\"{base:.1}\">{sentence}{broken}</text>"
        );
        let _ = writeln!(
            svg,
            "<text class=\"soft name\" x=\"{edge}\" y=\"{base:.1}\" text-anchor=\"end\">{}</text>",
            escape_xml(&self.right_text)
        );
        let places: Vec<f64> = self
            .margins
            .iter()
            .map(|(_, margin)| scale.map_value(*margin))
            .collect();
        let (first, last) = places
            .iter()
            .fold((f64::INFINITY, left), |(first, last), &x| {
                (x.min(first), x.max(last))
            });
        if places.len() > 1 {
            let _ = writeln!(
                svg,
                "<path class=\"grid\" d=\"M{first:.1} {y:.1}H{last:.1}\"/>"
            );
        }
        for (x, (colour, margin)) in places.iter().zip(&self.margins) {
            // Dots of different colours have different heights, so that both stay visible.
            let y = if *colour == ThemeColour::First {
                y - 2.5
            } else {
                y + 2.5
            };
            let label = format!("{name}: {} times", format_number(*margin));
            let _ = writeln!(
                svg,
                "<circle class=\"dot {}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\"><title>{label}</title></circle>",
                colour.css_class()
            );
        }
        let at = if places.is_empty() {
            left + 22.0
        } else {
            last + 12.0
        };
        let _ = writeln!(
            svg,
            "<text class=\"soft name label\" x=\"{at:.1}\" y=\"{base:.1}\">{message}</text>"
        );
    }
}

/// Returns the number of decades from a labelled decade to the next labelled decade.
fn decades_between_labels(scale: &DecadeScale) -> i32 {
    let [first, last] = scale.decades;
    (last - first + 5) / 6
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: each case has its line, a dot for each margin on the right of the bound, and text
    /// without a margin; a broken bound is marked; colours follow the reader's theme, and text is
    /// escaped.
    #[test]
    fn cases_have_lines() {
        let row = |name: &str, margins: &[(ThemeColour, f64)], is_broken: bool| ErrorMarginRow {
            name: name.to_owned(),
            description: "Rays <that> miss.".to_owned(),
            margins: margins.to_vec(),
            message: "none of 5 wrong".to_owned(),
            is_broken,
            ..ErrorMarginRow::default()
        };
        let rows = vec![
            row(
                "P01",
                &[(ThemeColour::First, 4.0), (ThemeColour::Second, 1e6)],
                false,
            ),
            row("T01", &[], true),
        ];
        let svg = ErrorMarginPlot {
            rows,
            legend: vec![(ThemeColour::First, "robust".to_owned())],
            ..ErrorMarginPlot::default()
        }
        .to_svg();
        assert_eq!(svg.matches("<title>P01").count(), 2);
        assert_eq!(svg.matches("not held").count(), 1);
        assert_eq!(svg.matches("Rays &lt;that&gt; miss.").count(), 2);
        let dots: Vec<f64> = svg
            .lines()
            .filter(|line| line.contains("<title>"))
            .filter_map(place)
            .collect();
        let bound = svg
            .lines()
            .find(|line| line.contains("class=\"axis\""))
            .and_then(|line| line.split(['M', ' ']).nth(3)?.parse().ok());
        assert!(
            dots.iter().all(|&x| Some(x) > bound) && bound.is_some(),
            "{dots:?}, {bound:?}"
        );
        assert!(svg.contains("prefers-color-scheme:dark") && svg.contains(">bound<"));
    }

    /// Horizontal position of a dot.
    fn place(line: &str) -> Option<f64> {
        line.split("cx=\"").nth(1)?.split('"').next()?.parse().ok()
    }
}
