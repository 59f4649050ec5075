//! Parsers of the cameras and times of a run: views, and the times of an animation.

use raywright_core::framing::ViewAngles;

use super::super::pictures::{FrameTimes, NamedViews};
use super::numbers::{parse_list, parse_number};

/// Parses a view by name, or by azimuth and elevation in degrees, `AZ,EL`.
pub fn parse_view(text: &str) -> Result<ViewAngles, String> {
    let named = ViewAngles::NAMED
        .iter()
        .find(|(name, _)| *name == text)
        .map(|(_, view)| *view);
    let listed =
        || parse_list::<f64, 2>(text).map(|[azimuth, elevation]| ViewAngles { azimuth, elevation });
    match named.or_else(listed) {
        Some(view) if view.azimuth.is_finite() && (-90.0..=90.0).contains(&view.elevation) => {
            Ok(view)
        }
        Some(_) => Err("expected an elevation from -90 to 90 degrees".to_owned()),
        None => {
            let names: Vec<&str> = ViewAngles::NAMED.iter().map(|(name, _)| *name).collect();
            Err(format!(
                "expected {} or azimuth and elevation in degrees, such as 30,20",
                names.join(", ")
            ))
        }
    }
}

/// Parses views separated by commas: names such as `front`, or pairs of degrees `AZ,EL`.
pub fn parse_views(text: &str) -> Result<NamedViews, String> {
    let mut parts = text.split(',');
    let mut views = Vec::new();
    while let Some(part) = parts.next() {
        let name = match part.trim().parse::<f64>() {
            Ok(_) => format!("{part},{}", parts.next().unwrap_or_default()),
            Err(_) => part.to_owned(),
        };
        views.push((
            name.clone(),
            parse_view(&name).map_err(|error| format!("{name}: {error}"))?,
        ));
    }
    Ok(NamedViews(views))
}

/// Parses the times of a film, `A..B:FPS` with at most 100,000 pictures, or `all:FPS`.
pub fn parse_frame_times(text: &str) -> Result<FrameTimes, String> {
    let expected = || {
        "expected A..B:FPS, such as 0..2:25 for the time from 0 s to 2 s at 25 pictures per second, or all:FPS for a model's whole animation, such as all:25"
            .to_owned()
    };
    let (span, rate) = text.rsplit_once(':').ok_or_else(expected)?;
    let (from, to) = match span.split_once("..") {
        Some((from, to)) => (parse_number(from)?, parse_number(to)?),
        None if span == "all" => (0.0, f64::INFINITY),
        None => return Err(expected()),
    };
    let frames = FrameTimes {
        from,
        to,
        rate: parse_number(rate)?,
    };
    match frames {
        FrameTimes {
            to: f64::INFINITY,
            rate,
            ..
        } if rate > 0.0 => Ok(frames),
        FrameTimes { from, to, rate }
            if rate > 0.0 && to > from && (to - from) * rate <= FrameTimes::MOST_TIMES =>
        {
            Ok(frames)
        }
        FrameTimes { from, to, rate } if rate > 0.0 && to > from => Err(format!(
            "{} pictures are too many; the largest number is 100000: shorten the time, or give fewer pictures per second",
            (to - from) * rate
        )),
        FrameTimes { from, to, rate } if rate > 0.0 => Err(format!(
            "the end, {to} s, has to be after the start, {from} s"
        )),
        _ => Err(expected()),
    }
}
