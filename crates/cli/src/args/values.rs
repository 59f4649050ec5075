//! Parsers of flags whose values are more than a number or a word: sizes, vectors, rectangles,
//! assignments, amounts of memory.
//!
//! The error of each parser names the expected form; clap adds the flag and its value.

use std::path::{Path, PathBuf};

use clap::builder::{OsStringValueParser, TypedValueParser};
use raywright_io::{
    EnvironmentSource, GroundRule, SectionPlane, UpAxis, WarningCode, parse_colour,
};
use std::str::FromStr;
use std::time::Duration;

use raywright_core::Settings;
use raywright_core::display::curve::{encode_transfer, quantise_8_bit};
use raywright_core::effects::{Effect, SWITCHABLE};
use raywright_core::framing::ViewAngles;
use raywright_core::scene::{AspectFit, Studio, TransferCurve};
use raywright_core::settings::Crop;
use raywright_core::suggest::closest_word;

use super::{
    BackgroundChoice, ExposureChoice, FrameTimes, MOST_SAMPLES, NamedViews, PictureShare,
    TevAddress,
};

/// Largest width or height of a picture, in pixels.
pub const MAX_EDGE: u32 = Settings::MOST_EDGE;

/// Parses a time from 1 second to 24 hours, as numbers with the units `s`, `min` or `h`, such as
/// `1h30min`; a number alone is in seconds.
pub fn parse_duration(text: &str) -> Result<Duration, String> {
    const EXPECTED: &str = "expected a time from 1s to 24h, such as 90s, 5min or 1h30min";
    let (mut rest, mut seconds, mut unit_before) = (text.trim(), 0.0, f64::INFINITY);
    while !rest.is_empty() {
        let (amount, tail) = rest.split_at(
            rest.find(|c: char| c.is_ascii_alphabetic())
                .unwrap_or(rest.len()),
        );
        let (unit, tail) = tail.split_at(
            tail.find(|c: char| !c.is_ascii_alphabetic())
                .unwrap_or(tail.len()),
        );
        let unit = match unit {
            // After hours, a number without a unit could mean minutes or seconds.
            "" if unit_before < f64::INFINITY => return Err(EXPECTED.to_owned()),
            "" | "s" => 1.0,
            "min" | "m" => 60.0,
            "h" => 3600.0,
            _ => return Err(EXPECTED.to_owned()),
        };
        match parse_number(amount) {
            Ok(amount) if amount >= 0.0 && unit < unit_before => seconds += amount * unit,
            _ => return Err(EXPECTED.to_owned()),
        }
        (rest, unit_before) = (tail.trim_start(), unit);
    }
    if (1.0..=86_400.0).contains(&seconds) {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err(EXPECTED.to_owned())
    }
}

/// Parses the fit of a picture whose aspect ratio differs from the camera's: `contain` or `cover`.
pub fn parse_fit(text: &str) -> Result<AspectFit, String> {
    match text {
        "contain" => Ok(AspectFit::Contain),
        "cover" => Ok(AspectFit::Cover),
        _ => Err("expected contain or cover".to_owned()),
    }
}

/// Parses an exposure: stops, or `auto`.
pub fn parse_exposure(text: &str) -> Result<ExposureChoice, String> {
    if text == "auto" {
        return Ok(ExposureChoice::Auto);
    }
    parse_number(text)
        .map(ExposureChoice::Stops)
        .map_err(|_| "expected a number of stops, or auto".to_owned())
}

/// Parses the code of a warning, such as `nothing-to-see`.
pub fn parse_warning_code(text: &str) -> Result<WarningCode, String> {
    let names = WarningCode::ALL.map(WarningCode::name);
    WarningCode::from_name(text).ok_or_else(|| match closest_word(text, names) {
        Some(name) => format!("no warning has this code; did you mean `{name}`?"),
        None => format!("no warning has this code; the codes: {}", names.join(", ")),
    })
}

/// Parses a share of a picture, `K/N` with 1 ≤ K ≤ N: share number K of N shares.
pub fn parse_share(text: &str) -> Result<PictureShare, String> {
    let parts = text
        .split_once('/')
        .and_then(|(number, of)| Some((number.trim().parse().ok()?, of.trim().parse().ok()?)));
    match parts {
        Some((number, total)) if 1 <= number && number <= total => {
            Ok(PictureShare { number, of: total })
        }
        Some((_, total)) if total > 0 => Err(format!(
            "the first of {total} shares is 1/{total}, the last is {total}/{total}"
        )),
        _ => Err("expected K/N, such as 2/8 for the second of eight shares".to_owned()),
    }
}

/// Parses the size of a picture, `WxH`, each from 1 to [`MAX_EDGE`].
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    const EXPECTED: &str = "expected WIDTHxHEIGHT in pixels, such as 1280x720";
    let (width, height) = text.split_once(['x', 'X']).ok_or(EXPECTED)?;
    let edge = |part: &str| match part.parse::<u32>() {
        Ok(1..=MAX_EDGE) => Ok(part.parse().unwrap_or(MAX_EDGE)),
        Ok(_) => Err(format!(
            "width and height must be between 1 and {MAX_EDGE} pixels"
        )),
        Err(_) => Err(EXPECTED.to_owned()),
    };
    Ok([edge(width)?, edge(height)?])
}

/// Parses a finite number.
pub fn parse_number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err("expected a finite number".to_owned()),
        Err(_) => Err("expected a number".to_owned()),
    }
}

/// Parses a target for the root relMSE, from 1e-6 to 1, as a number or in percent.
pub fn parse_max_error(text: &str) -> Result<f64, String> {
    let percent = text.trim().strip_suffix('%');
    let value = percent.map_or_else(
        || parse_number(text),
        |percent| Ok(parse_number(percent)? / 100.0),
    )?;
    match (1e-6..=1.0).contains(&value) {
        true => Ok(value),
        false => Err("expected a root relMSE from 0.000001 to 1, such as 0.05 or 5%".to_owned()),
    }
}

/// Parses a finite number of at least zero.
pub fn parse_non_negative(text: &str) -> Result<f64, String> {
    match parse_number(text)? {
        value if value >= 0.0 => Ok(value),
        _ => Err("expected a number of at least 0".to_owned()),
    }
}

/// Parses the probability of a false alarm, from 1e-9 to 0.5.
pub fn parse_significance_level(text: &str) -> Result<f64, String> {
    match parse_number(text)? {
        value if (1e-9..=0.5).contains(&value) => Ok(value),
        _ => Err("expected a probability from 1e-9 to 0.5, such as 0.01".to_owned()),
    }
}

/// Parses a field of view in degrees, above 0 and below 180.
pub fn parse_field_of_view(text: &str) -> Result<f64, String> {
    match parse_number(text)? {
        value if value > 0.0 && value < 180.0 => Ok(value),
        _ => Err("expected degrees above 0 and below 180".to_owned()),
    }
}

/// Parses the address of tev, an image viewer: `tev`, `tev:HOST` or `tev:HOST:PORT`. The default
/// host is this machine.
pub fn parse_tev_address(text: &str) -> Result<TevAddress, String> {
    const EXPECTED: &str = "expected tev, tev:HOST or tev:HOST:PORT";
    let rest = match text.strip_prefix("tev") {
        Some("") => {
            return Ok(TevAddress {
                host: "127.0.0.1".to_owned(),
                port: TevAddress::PORT,
            });
        }
        Some(rest) => rest.strip_prefix(':').ok_or(EXPECTED)?,
        None => return Err(EXPECTED.to_owned()),
    };
    // An IPv6 address contains colons and is written in brackets.
    let (host, port) = match rest.rsplit_once(':') {
        Some((host, port)) if !port.ends_with(']') => (host, port.parse().map_err(|_| EXPECTED)?),
        _ => (rest, TevAddress::PORT),
    };
    let host = host.trim_start_matches('[').trim_end_matches(']');
    if host.is_empty() {
        Err(EXPECTED.to_owned())
    } else {
        Ok(TevAddress {
            host: host.to_owned(),
            port,
        })
    }
}

/// Parses exactly `N` values separated by commas; returns `None` for any other text.
fn parse_list<T: FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let parts: Vec<T> = text
        .split(',')
        .map(|part| part.trim().parse().ok())
        .collect::<Option<_>>()?;
    parts.try_into().ok()
}

/// Parses a point or direction, `x,y,z`, of finite numbers.
pub fn parse_triple(text: &str) -> Result<[f64; 3], String> {
    match parse_list::<f64, 3>(text) {
        Some(triple) if triple.iter().all(|v| v.is_finite()) => Ok(triple),
        _ => Err("expected three numbers x,y,z without spaces, such as 0,1.5,-2".to_owned()),
    }
}

/// Up direction: an axis of a model or a direction of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum UpDirection {
    /// The axis of a model that is turned to +y.
    Axis(UpAxis),
    /// The up vector of the camera.
    Direction([f64; 3]),
}

/// Parses an up direction: an axis of a model, such as `-z`, or three numbers.
pub fn parse_up_direction(text: &str) -> Result<UpDirection, String> {
    match (text.parse::<UpAxis>(), parse_triple(text)) {
        (Ok(axis), _) => Ok(UpDirection::Axis(axis)),
        (_, Ok(direction)) => Ok(UpDirection::Direction(direction)),
        _ => Err("expected an axis of the model (y, z, x, -y, -z, -x) or a direction x,y,z, such as 0,0,1".to_owned()),
    }
}

/// Parses a rectangle of pixels, `x,y,width,height`, with at least one pixel.
pub fn parse_crop(text: &str) -> Result<Crop, String> {
    match parse_list::<u32, 4>(text) {
        Some([x, y, width, height]) if width > 0 && height > 0 => Ok(Crop {
            x,
            y,
            width,
            height,
        }),
        Some(_) => Err("width and height of the crop must be at least 1 pixel".to_owned()),
        None => Err(
            "expected four whole numbers x,y,width,height in pixels, such as 100,50,320,200"
                .to_owned(),
        ),
    }
}

/// Parses a value of a scene parameter, `NAME=VALUE`.
pub fn parse_assignment(text: &str) -> Result<(String, f64), String> {
    const EXPECTED: &str = "expected NAME=VALUE with a number, such as roughness=0.3";
    let (name, value) = text.split_once('=').ok_or(EXPECTED)?;
    match (name.trim(), parse_number(value)) {
        ("", _) | (_, Err(_)) => Err(EXPECTED.to_owned()),
        (name, Ok(value)) => Ok((name.to_owned(), value)),
    }
}

/// Parses an amount of memory in bytes, with an optional suffix K, M, G or T (powers of 1024).
pub fn parse_bytes(text: &str) -> Result<u64, String> {
    const EXPECTED: &str = "expected bytes, such as 800000000, 512M or 2G";
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let power = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "" | "B" => 0,
        "K" | "KB" | "KIB" => 1,
        "M" | "MB" | "MIB" => 2,
        "G" | "GB" | "GIB" => 3,
        "T" | "TB" | "TIB" => 4,
        _ => return Err(EXPECTED.to_owned()),
    };
    let amount: u64 = digits.parse().map_err(|_| EXPECTED)?;
    match amount.checked_mul(1 << (10 * power)) {
        Some(0) | None => Err(EXPECTED.to_owned()),
        Some(bytes) => Ok(bytes),
    }
}

/// Parses a background: `env`, `transparent` or a colour. A colour written as 8-bit codes is shown
/// with exactly those codes.
pub fn parse_background(text: &str) -> Result<BackgroundChoice, String> {
    // A linear 1 becomes exactly 1; the sRGB curve would round it to a value slightly below 1.
    let encoded = |linear: [f64; 3]| {
        linear.map(|value| {
            if value == 1.0 {
                1.0
            } else {
                encode_transfer(TransferCurve::Srgb, value)
            }
        })
    };
    let nearest = |value: f64| f64::from(quantise_8_bit(value)) / 255.0;
    if let Some(colour) = parse_colour(text) {
        return Ok(BackgroundChoice::Colour(encoded(colour).map(nearest)));
    }
    match (text, parse_triple(text)) {
        ("env", _) => Ok(BackgroundChoice::Environment),
        ("transparent", _) => Ok(BackgroundChoice::Transparent),
        (_, Ok(colour)) if colour.iter().all(|v| (0.0..=1.0).contains(v)) => Ok(BackgroundChoice::Colour(encoded(colour))),
        _ => Err("expected env, transparent or a colour: white, #e6b219, rgb(230,178,25), or linear R,G,B of numbers from 0 to 1, such as 0.2,0.2,0.25".to_owned()),
    }
}

/// Returns a clap parser of environments: `none`, `default`, or a file with any other name.
pub fn environment_parser() -> impl TypedValueParser<Value = EnvironmentSource> {
    OsStringValueParser::new().try_map(|text| match text.to_str() {
        Some("none") => Ok(EnvironmentSource::None),
        Some("default") => Ok(EnvironmentSource::Default),
        Some("studio") if !Path::new(&text).exists() => {
            Err("the studio is no environment; use --studio")
        }
        // A word without dot and slash that is no existing file is probably a misspelled name.
        Some(word) if !word.contains(['.', '/']) && !Path::new(&text).exists() => {
            Err("expected none, default or an equirectangular picture (.hdr, .exr, .png, .jpg)")
        }
        _ => Ok(EnvironmentSource::File(PathBuf::from(text))),
    })
}

/// Parses the number of samples per pixel, from 1 to [`MOST_SAMPLES`].
pub fn parse_samples(text: &str) -> Result<u32, String> {
    let number = text
        .trim()
        .parse()
        .ok()
        .filter(|number| (1..=MOST_SAMPLES).contains(number));
    number.ok_or_else(|| {
        format!("expected a whole number of samples from 1 to {MOST_SAMPLES}, such as 64")
    })
}

/// Parses the ground of a studio, `auto` or `none`.
pub fn parse_ground(text: &str) -> Result<GroundRule, String> {
    match text {
        "auto" => Ok(GroundRule::Auto),
        "none" => Ok(GroundRule::None),
        _ => Err("expected auto or none".to_owned()),
    }
}

/// Material that replaces the material of every surface, from `--material`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialChoice {
    /// A matte neutral grey.
    Clay,
}

/// Parses the name of a material, `clay`.
pub fn parse_material(text: &str) -> Result<MaterialChoice, String> {
    if text == "clay" {
        Ok(MaterialChoice::Clay)
    } else {
        Err("expected clay".to_owned())
    }
}

/// Parses a cut across an axis, such as `x=0.3` or `-x=30%`.
pub fn parse_section(text: &str) -> Result<SectionPlane, String> {
    text.parse()
}

/// Backdrop of a studio, from `--backdrop`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackdropChoice {
    /// Dark behind a bright first model of the run, light behind a dark first model, unless the
    /// file sets the backdrop.
    Auto,
    /// The dark backdrop, which suits bright models.
    Dark,
    /// The light backdrop, which suits dark models.
    Light,
}

impl BackdropChoice {
    /// All backdrops with their names.
    const NAMED: [(&'static str, Self); 3] = [
        ("auto", Self::Auto),
        ("dark", Self::Dark),
        ("light", Self::Light),
    ];

    /// Returns the backdrop's name on the command line.
    pub fn name(self) -> &'static str {
        Self::NAMED
            .iter()
            .find(|(_, backdrop)| *backdrop == self)
            .map_or("auto", |(name, _)| name)
    }

    /// Returns the radiance of the backdrop; `None` for `auto`.
    pub fn radiance(self) -> Option<f64> {
        match self {
            Self::Auto => None,
            Self::Dark => Some(Studio::DARK_BACKDROP),
            Self::Light => Some(Studio::LIGHT_BACKDROP),
        }
    }
}

/// Parses the name of a backdrop, `auto`, `dark` or `light`.
pub fn parse_backdrop(text: &str) -> Result<BackdropChoice, String> {
    let found = BackdropChoice::NAMED.iter().find(|(name, _)| *name == text);
    found
        .map(|(_, backdrop)| *backdrop)
        .ok_or_else(|| "expected auto, dark or light".to_owned())
}

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
        "expected A..B:FPS, such as 0..2:25 for two seconds of 25 pictures each, or all:25 for all of a model's animation"
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
            "{} pictures are too many; the largest number is 100000",
            (to - from) * rate
        )),
        FrameTimes { from, to, rate } if rate > 0.0 => Err(format!(
            "the end, {to} s, has to be after the start, {from} s"
        )),
        _ => Err(expected()),
    }
}

/// Parses a zoom factor from 0.001 to 1000.
pub fn parse_zoom(text: &str) -> Result<f64, String> {
    match parse_number(text)? {
        value if (1e-3..=1e3).contains(&value) => Ok(value),
        _ => Err("expected a factor from 0.001 to 1000, such as 2".to_owned()),
    }
}

/// Parses the name of an effect that can be switched off, with hyphens in place of blanks.
pub fn parse_effect(text: &str) -> Result<Effect, String> {
    if let Some(effect) = Effect::from_name(&text.replace('-', " ")) {
        return if SWITCHABLE.has(effect) {
            Ok(effect)
        } else {
            Err("this effect is part of the scene itself and cannot be switched off".to_owned())
        };
    }
    let known = list_switchable_effects();
    Err(match closest_word(text, known.split(", ")) {
        Some(word) => format!("no effect has this name; did you mean `{word}`?"),
        None => format!("no effect has this name; effects that can be switched off: {known}"),
    })
}

/// Returns the names of all effects that can be switched off, as on the command line: separated by
/// commas, with hyphens in place of blanks.
pub fn list_switchable_effects() -> String {
    SWITCHABLE
        .iter()
        .map(|effect| effect.name().replace(' ', "-"))
        .collect::<Vec<_>>()
        .join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: times are parsed in their units, and anything else, too short or too long is
    /// refused.
    #[test]
    fn times_have_units() {
        for (text, seconds) in [
            ("90", 90.0),
            ("90s", 90.0),
            ("1.5min", 90.0),
            ("2h", 7200.0),
            ("24h", 86_400.0),
            ("1", 1.0),
            ("1h30m", 5400.0),
            ("1h 5min 2.5s", 3902.5),
        ] {
            assert_eq!(
                parse_duration(text),
                Ok(Duration::from_secs_f64(seconds)),
                "{text}"
            );
        }
        for text in [
            "", "s", "0.5", "25h", "-3s", "1h30", "30m1h", "1h-5m", "1e9", "NaN", "inf", "1 min x",
        ] {
            assert!(parse_duration(text).is_err(), "{text}");
        }
    }

    /// Protects: shares are numbered from one, and the error for a malformed share explains the
    /// numbering.
    #[test]
    fn shares_are_counted_from_one() {
        assert_eq!(parse_share("1/1"), Ok(PictureShare { number: 1, of: 1 }));
        assert_eq!(parse_share("3/8"), Ok(PictureShare { number: 3, of: 8 }));
        assert_eq!(
            parse_share("0/8").unwrap_err(),
            "the first of 8 shares is 1/8, the last is 8/8"
        );
        assert_eq!(
            parse_share("9/8").unwrap_err(),
            "the first of 8 shares is 1/8, the last is 8/8"
        );
        for text in [
            "",
            "/",
            "1",
            "1/",
            "-1/2",
            "1/0",
            "0/0",
            "a/b",
            "1/2/3",
            "1/5000000000",
        ] {
            assert_eq!(
                parse_share(text).unwrap_err(),
                "expected K/N, such as 2/8 for the second of eight shares",
                "{text}"
            );
        }
    }

    /// Protects: the forms in the help texts are parsed with their documented meaning.
    #[test]
    fn documented_forms_are_read() {
        assert_eq!(parse_size("1280x720"), Ok([1280, 720]));
        assert_eq!(parse_size("1X65536"), Ok([1, 65536]));
        assert_eq!(parse_triple("0,1.5,-2"), Ok([0.0, 1.5, -2.0]));
        assert_eq!(
            parse_crop("100,50,320,200"),
            Ok(Crop {
                x: 100,
                y: 50,
                width: 320,
                height: 200
            })
        );
        assert_eq!(
            parse_assignment("roughness=0.3"),
            Ok(("roughness".to_owned(), 0.3))
        );
        assert_eq!(parse_bytes("512M"), Ok(512 << 20));
        assert_eq!(parse_bytes("2GiB"), Ok(2 << 30));
        assert_eq!(parse_bytes("800000000"), Ok(800_000_000));
        assert_eq!(parse_background("env"), Ok(BackgroundChoice::Environment));
        assert_eq!(
            parse_background("transparent"),
            Ok(BackgroundChoice::Transparent)
        );
        let codes = [230, 178, 25].map(|code| f64::from(code) / 255.0);
        assert_eq!(
            [
                parse_background("#e6b219"),
                parse_background("rgb(230,178,25)")
            ],
            [(); 2].map(|()| Ok(BackgroundChoice::Colour(codes)))
        );
        assert_eq!(
            parse_background("1,0,1"),
            Ok(BackgroundChoice::Colour([1.0, 0.0, 1.0]))
        );
        assert_eq!(parse_field_of_view("45"), Ok(45.0));
    }

    /// Protects: an address of tev may leave out the port, or host and port, and may have an IPv6
    /// host.
    #[test]
    fn viewers_have_places() {
        let at = |text: &str| parse_tev_address(text).map(|place| (place.host, place.port));
        let place = |host: &str, port| Ok((host.to_owned(), port));
        assert_eq!(at("tev"), place("127.0.0.1", 14158));
        assert_eq!(at("tev:far"), place("far", 14158));
        assert_eq!(at("tev:far:99"), place("far", 99));
        assert_eq!(at("tev:[::1]"), place("::1", 14158));
        assert_eq!(at("tev:[::1]:99"), place("::1", 99));
        for wrong in [
            "",
            "tv",
            "tev:",
            "tev::9",
            "tevfar",
            "tev:far:",
            "tev:far:99999",
        ] {
            assert!(at(wrong).is_err(), "{wrong}");
        }
    }

    /// Protects: effects are found by name, and only those that can be switched off.
    #[test]
    fn effects_are_named() {
        assert_eq!(
            parse_effect("mirror-reflection"),
            Ok(Effect::MirrorReflection)
        );
        assert!(parse_effect("instances").is_err_and(|e| e.contains("cannot be switched off")));
        assert!(
            parse_effect("higlights").is_err_and(|e| e.ends_with("did you mean `highlights`?"))
        );
        assert!(
            parse_effect("magic")
                .is_err_and(|e| e.contains("can be switched off: ambient-light, direct-light"))
        );
    }

    /// Protects: nearly correct values are refused, not corrected by a guess.
    #[test]
    fn malformed_values_are_refused() {
        for text in [
            "",
            "640",
            "640x",
            "x480",
            "0x480",
            "640x65537",
            "640*480",
            "-1x5",
            "99999999999x1",
        ] {
            assert!(parse_size(text).is_err(), "{text}");
        }
        for text in ["", "1,2", "1,2,3,4", "1;2;3", "1,NaN,3", "1,inf,3", "1,,3"] {
            assert!(parse_triple(text).is_err(), "{text}");
        }
        for text in ["1,2,3", "1,2,0,4", "1,2,3,0", "-1,2,3,4", "1,2,3,4.5"] {
            assert!(parse_crop(text).is_err(), "{text}");
        }
        for text in ["", "=", "=1", "a", "a=", "a=b", "a=NaN"] {
            assert!(parse_assignment(text).is_err(), "{text}");
        }
        for text in ["", "G", "-1", "1.5G", "0", "12Q", "99999999T"] {
            assert!(parse_bytes(text).is_err(), "{text}");
        }
        for text in ["", "sky", "1,2", "-1,0,0"] {
            assert!(parse_background(text).is_err(), "{text}");
        }
        for text in ["0", "180", "-10", "wide", "NaN"] {
            assert!(parse_field_of_view(text).is_err(), "{text}");
        }
    }

    /// Protects: the error names the wrong value in a list, and says what is wrong with the times
    /// of a film.
    #[test]
    fn what_is_wrong_is_named() {
        assert!(
            parse_views("front,fronnt")
                .is_err_and(|error| error.starts_with("fronnt: expected front, back"))
        );
        assert!(
            parse_views("front,10,91")
                .is_err_and(|error| error.starts_with("10,91: expected an elevation"))
        );
        assert!(
            parse_frame_times("2..0:5")
                .is_err_and(|error| error == "the end, 0 s, has to be after the start, 2 s")
        );
        assert!(parse_frame_times("0..1e9:25").is_err_and(|error| {
            error.ends_with("pictures are too many; the largest number is 100000")
        }));
        assert!(
            parse_frame_times("0..2:-5").is_err_and(|error| error.starts_with("expected A..B:FPS"))
        );
    }
}
