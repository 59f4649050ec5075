//! Plot of error margins, with a row for each case of a numerical test. A margin is the error bound
//! of a case divided by its worst error. The scale is logarithmic; a case within its bound has a
//! margin of at least 1.

use std::fmt::Write;

use super::numbers::{format_power, format_significant_digits};
use super::plot::{ThemeColour, begin_svg, escape_xml};
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
        let [start, left, right, _, edge] = COLUMNS;
        let margins = self.rows.iter().flat_map(|row| &row.margins);
        let margins = margins.map(|(_, margin)| *margin).chain([1.0]);
        let scale = DecadeScale::new(margins, left + 12.0, right - 12.0);
        let bottom = TOP + ROW * self.rows.len() as f64;
        let mut svg = begin_svg(
            [&self.title, "margins"],
            [&self.circumstances, ""],
            [WIDTH, BARE, bottom + FOOT],
        );
        let legend = self.legend.iter().map(|(colour, words)| {
            let (class, words) = (colour.css_class(), escape_xml(words));
            format!("<tspan class=\"dot {class}\">●</tspan> {words} \u{a0} ")
        });
        let (legend, aside) = (legend.collect::<String>(), escape_xml(&self.right_heading));
        let [key, above] = [42.0, 22.0].map(|height| TOP - height);
        // Writing to a string cannot fail.
        let _ = writeln!(
            svg,
            "<text class=\"soft\" x=\"{start}\" y=\"{key}\">{legend}</text>\n<text class=\"soft\" x=\"{edge}\" y=\"{above}\" text-anchor=\"end\">{aside}</text>"
        );
        for exponent in scale.decades() {
            let x = scale.map_exponent(f64::from(exponent));
            let (class, word) = match exponent {
                0 => ("axis", "bound".to_owned()),
                _ => ("grid", format_power(exponent)),
            };
            let _ = writeln!(
                svg,
                "<path class=\"{class}\" d=\"M{x:.1} {}V{bottom}\"/>",
                TOP - 12.0
            );
            // Labels are written at every n-th decade, as many as fit.
            if exponent % decades_between_labels(&scale) == 0 {
                for y in [above, bottom + 20.0] {
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
        svg + "</svg>\n"
    }
}

impl ErrorMarginRow {
    fn draw_row(&self, svg: &mut String, scale: &DecadeScale, y: f64) {
        let [start, left, _, words, edge] = COLUMNS;
        let base = y + 4.5;
        let (class, broken) = match self.is_broken {
            true => ("first", " — not held"),
            false => ("", ""),
        };
        let texts = [
            &self.name,
            &self.description,
            &self.message,
            &self.right_text,
        ];
        let [name, sentence, message, aside] = texts.map(|text| escape_xml(text));
        let places = self
            .margins
            .iter()
            .map(|(_, margin)| scale.map_value(*margin));
        let first = places.clone().fold(f64::INFINITY, f64::min);
        let last = places.fold(left + 10.0, f64::max);
        let _ = writeln!(
            svg,
            "<text class=\"name {class}\" x=\"{start}\" y=\"{base:.1}\">{name}</text>\n<text class=\"name\" x=\"{words}\" y=\"{base:.1}\">{sentence}{broken}</text>\n\
             <text class=\"soft name\" x=\"{edge}\" y=\"{base:.1}\" text-anchor=\"end\">{aside}</text>\n<text class=\"soft name label\" x=\"{:.1}\" y=\"{base:.1}\">{message}</text>",
            last + 12.0
        );
        if self.margins.len() > 1 {
            let _ = writeln!(
                svg,
                "<path class=\"grid\" d=\"M{first:.1} {y:.1}H{last:.1}\"/>"
            );
        }
        for (colour, margin) in &self.margins {
            // Dots of different colours have different heights, so that both stay visible.
            let up = if *colour == ThemeColour::First {
                -2.5
            } else {
                2.5
            };
            let (x, y, class) = (scale.map_value(*margin), y + up, colour.css_class());
            let margin = format_significant_digits(*margin, 3);
            let _ = writeln!(
                svg,
                "<circle class=\"dot {class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\"><title>{name}: {margin} times</title></circle>"
            );
        }
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
