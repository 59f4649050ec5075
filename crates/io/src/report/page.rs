//! HTML report of an accuracy measurement, in a single self-contained file. A measurement renders
//! the scene on the rungs (quality levels) of each ladder (a setting with ordered levels). The page
//! has the recommendation, the picture, its magnified part with the recommended settings, a plot and
//! tables. Nothing is downloaded, and only the slider between two pictures needs a script.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use raywright_core::accuracy::{AccuracyReport, DetailPicture, MeasuredSetting};
use raywright_core::display::Display;
use raywright_core::ladder::Ladder;
use raywright_core::picture::Picture;
use raywright_core::settings::Crop;

use super::numbers::{format_power, format_precise_duration, format_seconds, format_three_digits};
use super::plot::{Plot, PlotAxis, PlotLine, PlotPoint, ThemeColour, escape_xml};
use super::section::ReportSection;
use super::table::{format_uncertain, html_with_code};
use crate::output::{PictureMetadata, encode_png};

/// Contents of the HTML report of an accuracy measurement.
#[derive(Clone, Debug)]
pub struct AccuracyPage<'a> {
    /// Name of the scene.
    pub scene: &'a str,
    /// Conditions of the measurement, as a list of sentences.
    pub circumstances: Vec<String>,
    /// Command that generated the page.
    pub command: String,
    /// Measured times and errors.
    pub report: &'a AccuracyReport,
    /// Recommended settings, in sentences.
    pub recommendation: String,
    /// Command that renders the scene, to which the flags of a setting are appended.
    pub own_command: String,
    /// Display settings for the pictures in the report.
    pub display: Display,
}

/// Returns the point of a measured setting in the plot, time in seconds and error, with a short name;
/// `None` if the error is not known. An error that is indistinguishable from zero is drawn at the
/// upper end of its confidence interval.
fn to_plot_point(measured: &MeasuredSetting, name: String) -> Option<PlotPoint> {
    let above_zero = |value: f64| value.max(1e-6);
    let error = &measured.errors.root_relmse;
    if !error.is_known() {
        return None;
    }
    let is_bound = error.includes_zero();
    let y = if is_bound { error.high } else { error.value };
    Some(PlotPoint {
        x: measured.seconds.value.max(1e-9),
        y: above_zero(y),
        spread: [if is_bound { y } else { error.low }, error.high].map(above_zero),
        is_bound,
        label: Some(measured.name()),
        name,
    })
}

/// Largest number of screen pixels along the edge of a picture's pixel.
const MOST_SCALE: u32 = 16;
/// Largest width in pixels of the whole picture on the page.
const WIDEST: u32 = 960;

/// Formats a complete HTML page from title, body and script; the script may be empty.
pub fn html_document(title: &str, body: &str, script: &str) -> String {
    let (title, style) = (escape_xml(title), include_str!("page.css"));
    let script = if script.is_empty() {
        String::new()
    } else {
        format!("<script>\n{script}</script>\n")
    };
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<title>{title}</title>\n<style>\n{style}</style></head>\n\
         <body><main>\n<h1>{title}</h1>\n{body}</main>\n{script}</body></html>\n"
    )
}

impl AccuracyPage<'_> {
    /// Returns the plot of error against time for every rung (quality level of a setting), and for the
    /// frontier: the settings that no other setting beats in both time and error. These are numbered
    /// from 1, as in the table.
    fn plot(&self) -> Plot {
        let [width, height] = self.report.size;
        Plot {
            x: PlotAxis {
                label: format!("CPU time of a render of {width}x{height} pixels"),
                tick: Some(format_seconds),
            },
            y: PlotAxis {
                label: "error (root relMSE)".to_owned(),
                tick: Some(format_power),
            },
            lines: self.plot_lines(),
            is_falling: true,
            ..Plot::default()
        }
    }

    /// Returns the settings worth their time, the setting in use, the numbers of samples, and the rungs
    /// of all other ladders that the rung in use does not beat, each once.
    fn plot_lines(&self) -> Vec<PlotLine> {
        let report = self.report;
        let line = |name: &str, colour, points: Vec<Option<PlotPoint>>| PlotLine {
            name: name.to_owned(),
            colour,
            is_dashed: true,
            is_unjoined: true,
            points: points.into_iter().flatten().collect(),
        };
        let frontier = (1..).zip(&report.frontier).map(|(i, &row)| {
            let own = if row == 0 { " in use" } else { "" };
            to_plot_point(&report.settings[row], format!("({i}){own}"))
        });
        let others = report.settings.iter().enumerate().filter(|(row, of)| {
            !report.frontier.contains(row) && of.single_rung().is_some() && !of.is_dominated()
        });
        let (samples, rungs): (Vec<_>, Vec<_>) = others.map(|(_, of)| of).partition(|of| {
            let choice = of.single_rung();
            choice.is_some_and(|choice| choice.ladder() == Ladder::Samples)
        });
        // A pointer or the focus tells the names of these.
        let points = |of: Vec<&MeasuredSetting>| {
            of.into_iter()
                .map(|of| to_plot_point(of, String::new()))
                .collect()
        };
        let own = report.own().name();
        let own_point =
            (!report.frontier.contains(&0)).then(|| to_plot_point(report.own(), own.clone()));
        vec![
            PlotLine {
                is_dashed: false,
                is_unjoined: false,
                ..line(
                    "settings worth their time",
                    ThemeColour::First,
                    frontier.collect(),
                )
            },
            line(&own, ThemeColour::First, own_point.into_iter().collect()),
            line("numbers of samples", ThemeColour::Second, points(samples)),
            line("one rung changed", ThemeColour::Third, points(rungs)),
        ]
    }

    /// Formats the page.
    pub fn to_html(&self) -> String {
        let circumstances: String = self
            .circumstances
            .iter()
            .map(|line| format!("<p class=\"soft\">{}</p>\n", escape_xml(line)))
            .collect();
        let plot = self.plot();
        let (plot, lead) = match plot.lines.iter().all(|line| line.points.is_empty()) {
            true => (String::new(), "No error is known: nothing can be drawn."),
            false => (plot.to_svg(), "Less time is to the left, less error below."),
        };
        let recommendation = html_with_code(&self.recommendation);
        let title = format!("What accuracy costs in time: {}", self.scene);
        let sections = self.sections();
        let sections: Vec<String> = sections.iter().map(ReportSection::to_html).collect();
        let (frontier, others) = (&sections[0], sections[1..].concat());
        // The plot names the setting in use; a reason stands below it.
        let own = Some(self.describe_own()).filter(|own| own != "in use");
        let own = own.map(|own| format!("Setting {}. ", html_with_code(&own)));
        let own = own.unwrap_or_default();
        let body = format!(
            "<p class=\"answer\">{recommendation}</p>\n{}<h2>Error against time</h2>\n<figure><div class=\"plot\">{plot}</div>\n<figcaption>{lead} {own}<span id=\"told\" aria-live=\"polite\"></span></figcaption></figure>\n{frontier}<h2>How it was measured</h2>\n{circumstances}<p class=\"soft\">Command: <code>{}</code></p>\n{others}",
            self.pictures_html(),
            escape_xml(&self.command),
        );
        html_document(&title, &body, include_str!("page.js"))
    }

    /// Formats the whole picture with the measured regions, and its magnified part with each setting,
    /// two of them under a slider.
    fn pictures_html(&self) -> String {
        let pictures = &self.report.pictures;
        let (Some(detail), whole) = (pictures.detail, &pictures.whole) else {
            return String::new();
        };
        let frame = |class: &str,
                     Crop {
                         x,
                         y,
                         width,
                         height,
                     }: &Crop| {
            format!(
                "<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>"
            )
        };
        let is_whole = self.report.tiles.measured == self.report.tiles.all;
        let tiles = pictures.tiles.iter().filter(|_| !is_whole);
        let frames: String = tiles.map(|tile| frame("tile", tile)).collect();
        let measured = match is_whole {
            true => "Rungs were tried on the whole picture.",
            false => "Rungs were tried on the tiles with thin frames.",
        };
        let (mut options, mut figures) = (String::new(), String::new());
        for detail in &pictures.details {
            let name = escape_xml(&match detail.row {
                None => "reference".to_owned(),
                Some(row) => self.report.settings[row].name(),
            });
            let _ = write!(options, "<option>{name}</option>");
            let _ = writeln!(
                figures,
                "<figure><img data-name=\"{name}\" alt=\"{name}\" src=\"{}\"><figcaption><b>{name}</b><br>{}</figcaption></figure>",
                self.png_data_uri(&detail.picture),
                self.detail_caption(detail),
            );
        }
        let (
            Crop {
                x,
                y,
                width,
                height,
            },
            [columns, rows],
        ) = (detail, self.report.size);
        // Two pictures are compared; one alone shows nothing.
        let is_magnified = pictures.details.len() > 1;
        let whole = format!(
            "<figure class=\"whole\" style=\"max-width:{}px\"><div class=\"frames\"><img alt=\"the picture\" src=\"{}\"><svg viewBox=\"0 0 {columns} {rows}\" preserveAspectRatio=\"none\">{frames}{}</svg></div>\n<figcaption>The picture. {measured}{}</figcaption></figure>\n",
            WIDEST.min(MOST_SCALE * columns),
            self.png_data_uri(&shrink(whole)),
            if is_magnified {
                frame("detail", &detail)
            } else {
                String::new()
            },
            if is_magnified {
                " The part with the thick frame is magnified below."
            } else {
                ""
            },
        );
        if !is_magnified {
            return whole;
        }
        format!(
            "{whole}<h2>Where objects have the most noise</h2>\n<p class=\"soft\">{width}×{height} pixels, from column {x} and row {y} (counted from 0) on; each pixel is a square.</p>\n<div class=\"pair\">\n<label>left<select id=\"one\">{options}</select></label>\n<label>right<select id=\"other\">{options}</select></label>\n<label>border between left and right<input id=\"edge\" type=\"range\" min=\"0\" max=\"100\" value=\"50\"></label></div>\n<div class=\"stage\" style=\"width:{}px\"><img id=\"under\" alt=\"\"><img id=\"over\" class=\"over\" alt=\"\"></div>\n<div class=\"details\">\n{figures}</div>\n",
            MOST_SCALE * width,
        )
    }

    /// Describes the error and the time of a magnified picture's setting.
    fn detail_caption(&self, detail: &DetailPicture) -> String {
        let Some(row) = detail.row else {
            return "as exact as the time allowed".to_owned();
        };
        let measured = &self.report.settings[row];
        let error = format_uncertain(&measured.errors.root_relmse, format_three_digits);
        let time = format_uncertain(&measured.seconds, format_precise_duration);
        format!("error {error}<br>CPU time {time}")
    }

    fn png_data_uri(&self, picture: &Picture) -> String {
        // A picture that cannot be encoded becomes an empty image.
        let bytes = encode_png(picture, self.display, &PictureMetadata::default());
        format!(
            "data:image/png;base64,{}",
            STANDARD.encode(bytes.unwrap_or_default())
        )
    }
}

/// Returns the means of squares of pixels, as large as they need to be for the page's width.
fn shrink(picture: &Picture) -> Picture {
    let edge = picture.width.div_ceil(WIDEST).max(1);
    let [width, height] = [picture.width, picture.height].map(|pixels| pixels / edge);
    let mean = |x: u32, y: u32| {
        let mut sum = [0.0; 3];
        for pixel in 0..edge * edge {
            let colour = picture.pixel(x * edge + pixel % edge, y * edge + pixel / edge);
            let colour = colour.unwrap_or_default();
            (0..3).for_each(|i| sum[i] += colour[i] / (edge * edge) as f32);
        }
        sum
    };
    Picture {
        rgb: (0..height)
            .flat_map(|y| (0..width).map(move |x| mean(x, y)))
            .collect(),
        ..Picture::new(width, height)
    }
}
