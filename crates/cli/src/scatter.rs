//! Scatter plot for a terminal: logarithmic on both axes, in plain characters, at most sixty
//! columns wide.

use raywright_io::report::format_significant_digits;

const WIDTH: usize = 44;
const HEIGHT: usize = 10;

/// Draws points (x, y), each with its mark, in a plot, with the axes named `horizontal` and `vertical`. Values at or
/// below zero lie on the edge. Returns the lines of the plot; empty unless the points differ in x
/// and in y.
pub fn draw_scatter_plot(points: &[(f64, f64, char)], vertical: &str, horizontal: &str) -> String {
    let ends = |of: fn(&(f64, f64, char)) -> f64| {
        let known = points.iter().map(of).filter(|v| *v > 0.0 && v.is_finite());
        known.fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
            (low.min(v), high.max(v))
        })
    };
    let (x, y) = (ends(|p| p.0), ends(|p| p.1));
    if x.0 >= x.1 || y.0 >= y.1 {
        return String::new();
    }
    let place = |value: f64, (low, high): (f64, f64), cells: usize| {
        let share = (value.clamp(low, high) / low).ln() / (high / low).ln();
        (share * (cells - 1) as f64).round() as usize
    };
    let mut cells = vec![[' '; WIDTH]; HEIGHT];
    for point in points {
        cells[HEIGHT - 1 - place(point.1, y, HEIGHT)][place(point.0, x, WIDTH)] = point.2;
    }
    let [top, bottom] = [y.1, y.0].map(|v| format_significant_digits(v, 2));
    let margin = [&top, &bottom]
        .map(|label| label.chars().count())
        .into_iter()
        .max()
        .unwrap_or(0);
    let mut text = format!("{:margin$}  {vertical}\n", "");
    for (i, row) in cells.iter().enumerate() {
        let label = if i == 0 {
            &top[..]
        } else if i + 1 == HEIGHT {
            &bottom
        } else {
            ""
        };
        text += format!("{label:>margin$} |{}", row.iter().collect::<String>()).trim_end();
        text.push('\n');
    }
    let [left, right] = [x.0, x.1].map(|v| format_significant_digits(v, 2) + " s");
    let gap = WIDTH
        .saturating_sub(left.chars().count() + right.chars().count() + horizontal.chars().count())
        / 2;
    text += &format!("{:margin$} +{}\n", "", "-".repeat(WIDTH));
    text + &format!(
        "{:margin$}  {left}{:gap$}{horizontal}{:gap$}{right}\n",
        "", "", ""
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: less time lies to the left and less error below, all decades have the same width,
    /// and lines fit a small terminal.
    #[test]
    fn corners_are_where_they_belong() {
        let plot = draw_scatter_plot(
            &[(0.01, 1.0, 'o'), (0.1, 0.1, 'o'), (1.0, 0.01, 'o')],
            "error",
            "time",
        );
        let lines: Vec<&str> = plot.lines().collect();
        assert_eq!(lines.len(), HEIGHT + 3);
        let column = |line: &str| {
            line.find('o')
                .map(|position| position - line.find('|').expect("the axis") - 1)
        };
        assert_eq!(
            (column(lines[1]), column(lines[HEIGHT])),
            (Some(0), Some(WIDTH - 1))
        );
        let middle = lines[2..HEIGHT]
            .iter()
            .find_map(|line| column(line))
            .expect("the middle point");
        assert!(middle.abs_diff(WIDTH / 2) <= 1, "{plot}");
        assert!(
            lines
                .iter()
                .all(|line| line.chars().count() <= 60 && !line.ends_with(' ')),
            "{plot}"
        );
        assert!(
            lines[1].starts_with("   1 |") && lines[HEIGHT + 2].contains("0.01 s"),
            "{plot}"
        );
    }

    /// Protects: an empty input gives no plot, and points at zero are drawn.
    #[test]
    fn few_points_are_no_plot() {
        assert_eq!(draw_scatter_plot(&[], "y", "x"), "");
        assert_eq!(draw_scatter_plot(&[(1.0, 1.0, 'o')], "y", "x"), "");
        assert!(
            draw_scatter_plot(
                &[(1.0, 0.0, 'o'), (2.0, 1.0, 'x'), (3.0, 2.0, 'o')],
                "y",
                "x"
            )
            .contains('x')
        );
    }
}
