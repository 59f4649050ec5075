//! Values of flags that are more than a number or a word, and their parsers: sizes, vectors,
//! rectangles, assignments, amounts of memory.
//!
//! The error of each parser names the expected form; clap adds the flag and its value.

use std::fmt::{self, Display};
use std::ops::{RangeBounds, RangeInclusive};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use clap::builder::{OsStringValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};
use raywright_core::Settings;
use raywright_core::display::curve::{encode_transfer, quantise_8_bit};
use raywright_core::effects::{Effect, SWITCHABLE_EFFECTS};
use raywright_core::fault::FaultKind;
use raywright_core::framing::ViewAngles;
use raywright_core::scene::{Studio, TransferCurve};
use raywright_core::settings::{Aov, Crop, PrecisionChoice};
use raywright_core::sky_picture::SkyPicture;
use raywright_core::suggest::most_similar_word;
use raywright_io::{EnvironmentSource, UpAxis, parse_colour};
use serde::de::{DeserializeOwned, IntoDeserializer};

/// Largest number of samples per pixel.
pub const MOST_SAMPLES: u32 = Settings::MOST_SAMPLES;

/// Exposure, the scale of radiance before display, from `--exposure`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExposureChoice {
    /// A number of stops: 1 doubles the radiance.
    Stops(f64),
    /// Automatic: a whole number of stops, chosen from the rendered picture.
    Auto,
}

/// Value of pixels whose rays hit nothing, from `--background`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BackgroundChoice {
    /// The radiance of the sky, or of a studio's backdrop.
    Environment,
    /// None: the pixels keep their coverage as alpha.
    Transparent,
    /// A colour, given by sRGB-encoded red, green and blue, each from 0 to 1: its 8-bit code
    /// divided by 255.
    Colour([f64; 3]),
}

/// Views of `--views` with their names, in the order of the flag.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedViews(pub Vec<(String, ViewAngles)>);

/// Times of the pictures of `--frames`, in seconds: from `from` up to, but not at, `to`. An
/// infinite `to` stands for the end of the animation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTimes {
    /// First time, in seconds.
    pub from: f64,
    /// End of the times in seconds; no picture has this time itself.
    pub to: f64,
    /// Pictures per second.
    pub rate: f64,
}

impl FrameTimes {
    /// Largest number of times, and therefore of pictures, that `--frames` may request.
    pub const MOST_TIMES: f64 = 1e5;

    /// Returns the times of all pictures in seconds, in ascending order; at least one time.
    pub fn picture_times(self) -> impl Iterator<Item = f64> {
        let count = ((self.to - self.from) * self.rate - 1e-9).ceil().max(1.0) as u32;
        (0..count).map(move |i| self.from + f64::from(i) / self.rate)
    }
}

/// Network address of tev, an image viewer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TevAddress {
    /// Host name or IP address.
    pub host: String,
    /// TCP port.
    pub port: u16,
}

impl TevAddress {
    /// Default TCP port of tev.
    pub const PORT: u16 = 14158;
}

/// A share of a picture, from `--part K/N`: the samples that one of several runs renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureShare {
    /// Number of this share of the picture, counted from one.
    pub number: u32,
    /// Number of shares of the picture.
    pub of: u32,
}

/// Returns the value, or an error with the expected form.
fn expect<T>(value: Option<T>, form: &str) -> Result<T, String> {
    value.ok_or_else(|| format!("expected {form}"))
}

/// Returns a clap parser of several words, each with its value.
pub fn one_of<T: Copy + Send + Sync + 'static>(
    words: &'static [(&'static str, T)],
) -> impl TypedValueParser<Value = T> {
    move |text: &str| {
        let found = words.iter().find(|(word, _)| *word == text);
        let names: Vec<String> = words.iter().map(|(word, _)| format!("`{word}`")).collect();
        expect(found.map(|(_, value)| *value), &join_alternatives(&names))
    }
}

/// Names of values, each with its description in the help.
pub type NamedValues<T> = &'static [(&'static str, &'static str, T)];

/// Returns a clap parser of named values.
pub fn named<T: Copy + Send + Sync + 'static>(
    values: NamedValues<T>,
) -> impl TypedValueParser<Value = T> {
    let names = values
        .iter()
        .map(|(name, help, _)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(names).try_map(|name| {
        let found = values.iter().find(|value| value.0 == name);
        found.map(|value| value.2).ok_or(name)
    })
}

/// Precisions of rays and surfaces: the rungs (quality levels) of the ladder `precision`.
pub const PRECISIONS: NamedValues<PrecisionChoice> = &[
    (
        "robust",
        "Single precision in memory, double precision where hits are decided",
        PrecisionChoice::Robust,
    ),
    (
        "reference",
        "Double precision throughout",
        PrecisionChoice::Reference,
    ),
];

/// Joins names as alternatives: `a, b or c`.
pub fn join_alternatives(names: &[String]) -> String {
    match names {
        [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => names.concat(),
    }
}

/// Parses a finite number.
pub fn parse_number(text: &str) -> Result<f64, String> {
    let value = expect(text.trim().parse::<f64>().ok(), "a number")?;
    expect(
        Some(value).filter(|value| value.is_finite()),
        "a finite number",
    )
}

/// Parses a finite number within limits.
pub fn parse_limited(text: &str, limits: impl RangeBounds<f64>, form: &str) -> Result<f64, String> {
    let value = parse_number(text)?;
    expect(Some(value).filter(|value| limits.contains(value)), form)
}

/// Returns a clap parser of finite numbers within limits.
pub fn limited(
    limits: impl RangeBounds<f64> + Clone + Send + Sync + 'static,
    form: &'static str,
) -> impl TypedValueParser<Value = f64> {
    move |text: &str| parse_limited(text, limits.clone(), form)
}

/// Parses a finite number of at least zero.
pub fn parse_non_negative(text: &str) -> Result<f64, String> {
    parse_limited(text, 0.0.., "a number of at least 0")
}

/// Parses a target for the root relMSE, from 1e-6 to 1, as a number or in percent.
pub fn parse_max_error(text: &str) -> Result<f64, String> {
    let (number, unit) = match text.trim().strip_suffix('%') {
        Some(percent) => (percent, 100.0),
        None => (text, 1.0),
    };
    let form = "a relative error (root relMSE) from 0.000001 to 1, such as 0.05 or 5%";
    let value = parse_limited(number, 1e-6 * unit..=unit, form)?;
    Ok(value / unit)
}

/// Parses a field of view in degrees, above 0 and below 180.
pub fn parse_field_of_view(text: &str) -> Result<f64, String> {
    let form = "an angle in degrees, above 0 and below 180, such as 40";
    parse_limited(text, f64::MIN_POSITIVE..180.0, form)
}

/// Returns a parser of whole numbers within limits.
pub fn whole_number<T: FromStr + PartialOrd + Display>(
    limits: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone
where
    RangeInclusive<T>: Clone,
{
    move |text| {
        let number = text.trim().parse().ok();
        let form = format!("a whole number from {} to {}", limits.start(), limits.end());
        expect(number.filter(|number| limits.contains(number)), &form)
    }
}

/// Parses the seed of the random numbers.
pub fn parse_seed(text: &str) -> Result<u64, String> {
    expect(
        text.trim().parse().ok(),
        "a whole number of at least 0, such as 7",
    )
}

/// Parses the number of samples per pixel, from 1 to [`MOST_SAMPLES`].
pub fn parse_samples(text: &str) -> Result<u32, String> {
    let number = text.trim().parse().ok();
    let form = format!("a whole number of samples from 1 to {MOST_SAMPLES}, such as 64");
    expect(
        number.filter(|number| (1..=MOST_SAMPLES).contains(number)),
        &form,
    )
}

/// Parses the largest number of ray segments in a path, or `unlimited`.
pub fn parse_max_depth(text: &str) -> Result<u32, String> {
    const MOST: u32 = Settings::MOST_SEGMENTS;
    let form = format!("a whole number from 1 to {MOST}, or `unlimited`");
    match text.parse() {
        _ if text == "unlimited" => Ok(Settings::UNLIMITED),
        Ok(number @ 1..=MOST) => Ok(number),
        Ok(number) => Err(format!(
            "{number} is not from 1 to {MOST}; for no limit, write `unlimited`"
        )),
        Err(_) => expect(None, &form),
    }
}

/// Parses exactly `N` values separated by commas; returns `None` for any other text.
pub fn parse_list<T: FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let parts = text.split(',').map(|part| part.trim().parse().ok());
    parts.collect::<Option<Vec<T>>>()?.try_into().ok()
}

/// Parses a point or direction, `x,y,z`, of finite numbers.
pub fn parse_triple(text: &str) -> Result<[f64; 3], String> {
    let triple = parse_list::<f64, 3>(text).filter(|list| list.iter().all(|v| v.is_finite()));
    expect(
        triple,
        "three numbers x,y,z without spaces, such as 0,1.5,-2",
    )
}

/// Parses a value of a scene parameter, `NAME=VALUE`.
pub fn parse_assignment(text: &str) -> Result<(String, f64), String> {
    let parts = text.split_once('=').and_then(|(name, value)| {
        Some((name.trim().to_owned(), parse_number(value).ok()?))
            .filter(|(name, _)| !name.is_empty())
    });
    expect(parts, "NAME=VALUE with a number, such as roughness=0.3")
}

/// Parses a time from 1 second to 24 hours, as numbers with the units `s`, `min` or `h`, such as
/// `1h30min`; a number alone is in seconds.
pub fn parse_duration(text: &str) -> Result<Duration, String> {
    let seconds = parse_units(text).filter(|seconds| (1.0..=86_400.0).contains(seconds));
    let form = "a time from 1s to 24h, such as 90s, 5min or 1h30min";
    expect(seconds.map(Duration::from_secs_f64), form)
}

/// Returns the seconds of numbers with falling units of time.
fn parse_units(text: &str) -> Option<f64> {
    let (mut rest, mut seconds, mut unit_before) = (text.trim(), 0.0, f64::INFINITY);
    while !rest.is_empty() {
        let is_letter = |c: char| c.is_ascii_alphabetic();
        let (amount, tail) = rest.split_at(rest.find(is_letter).unwrap_or(rest.len()));
        let end = tail.find(|c| !is_letter(c)).unwrap_or(tail.len());
        let unit = match &tail[..end] {
            // After hours, a number without a unit could mean minutes or seconds.
            "" if unit_before < f64::INFINITY => return None,
            "" | "s" => 1.0,
            "min" | "m" => 60.0,
            "h" => 3600.0,
            _ => return None,
        };
        let amount = parse_non_negative(amount)
            .ok()
            .filter(|_| unit < unit_before)?;
        seconds += amount * unit;
        (rest, unit_before) = (tail[end..].trim_start(), unit);
    }
    Some(seconds)
}

/// Parses an amount of memory in bytes, with an optional suffix K, M, G or T (powers of 1024).
pub fn parse_bytes(text: &str) -> Result<u64, String> {
    const UNITS: [[&str; 3]; 5] = [
        ["", "B", "B"],
        ["K", "KB", "KIB"],
        ["M", "MB", "MIB"],
        ["G", "GB", "GIB"],
        ["T", "TB", "TIB"],
    ];
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = text[digits.len()..].to_ascii_uppercase();
    let power = UNITS
        .iter()
        .position(|names| names.contains(&unit.as_str()));
    let amount = digits.parse::<u64>().ok().zip(power);
    let bytes = amount.and_then(|(amount, power)| amount.checked_mul(1 << (10 * power)));
    let form = "a number of bytes, such as 800000000, 512M or 2G";
    expect(bytes.filter(|&bytes| bytes > 0), form)
}

/// Largest width or height of a picture, in pixels.
pub const MAX_EDGE: u32 = Settings::MOST_EDGE;

/// Parses the size of a picture, `WxH`, each from 1 to `MAX_EDGE`.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let edges = text.split_once(['x', 'X']);
    let edges = edges.and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let form = match text.strip_suffix(['p', 'P']).map(str::parse::<u32>) {
        Some(Ok(lines)) => format!(
            "WIDTHxHEIGHT in pixels: {text} is {}x{lines}",
            u64::from(lines) * 16 / 9
        ),
        _ => "WIDTHxHEIGHT in pixels, such as 1280x720".to_owned(),
    };
    match expect(edges, &form)? {
        [1..=MAX_EDGE, 1..=MAX_EDGE] => expect(edges, ""),
        _ => Err(format!(
            "width and height must be between 1 and {MAX_EDGE} pixels"
        )),
    }
}

/// Parses a rectangle of pixels, `x,y,width,height`, with at least one pixel.
pub fn parse_crop(text: &str) -> Result<Crop, String> {
    let form = "four whole numbers x,y,width,height in pixels, such as 100,50,320,200";
    let [x, y, width, height] = expect(parse_list::<u32, 4>(text), form)?;
    if width == 0 || height == 0 {
        return Err("width and height of the crop must be at least 1 pixel".to_owned());
    }
    Ok(Crop {
        x,
        y,
        width,
        height,
    })
}

/// Parses a share of a picture, `K/N` with 1 ≤ K ≤ N: share number K of N shares.
pub fn parse_share(text: &str) -> Result<PictureShare, String> {
    let parts = text
        .split_once('/')
        .and_then(|(number, of)| Some((number.trim().parse().ok()?, of.trim().parse().ok()?)));
    let form = "K/N, such as 2/8 for the second of eight shares";
    match expect(parts.filter(|&(_, of)| of > 0), form)? {
        (number, of) if 1 <= number && number <= of => Ok(PictureShare { number, of }),
        (_, of) => Err(format!(
            "the first of {of} shares is 1/{of}, the last is {of}/{of}"
        )),
    }
}

/// Parses an exposure: stops, or `auto`.
pub fn parse_exposure(text: &str) -> Result<ExposureChoice, String> {
    let auto = Some(ExposureChoice::Auto).filter(|_| text == "auto");
    let stops = || parse_number(text).ok().map(ExposureChoice::Stops);
    expect(
        auto.or_else(stops),
        "a number of stops, such as -1.5, or `auto`",
    )
}

/// Parses a background: `env`, `transparent` or a colour. A colour written as 8-bit codes is shown
/// with exactly those codes.
pub fn parse_background(text: &str) -> Result<BackgroundChoice, String> {
    // A linear 1 becomes exactly 1; the sRGB curve would round it to a value slightly below 1.
    let encode = |value: f64| match value {
        1.0 => 1.0,
        value => encode_transfer(TransferCurve::Srgb, value),
    };
    let nearest = |value: f64| f64::from(quantise_8_bit(encode(value))) / 255.0;
    let linear = || {
        let colour = parse_triple(text).ok()?;
        let is_colour = colour.iter().all(|v| (0.0..=1.0).contains(v));
        is_colour.then(|| BackgroundChoice::Colour(colour.map(encode)))
    };
    let choice = match (text, parse_colour(text)) {
        (_, Some(colour)) => Some(BackgroundChoice::Colour(colour.map(nearest))),
        ("env", _) => Some(BackgroundChoice::Environment),
        ("transparent", _) => Some(BackgroundChoice::Transparent),
        _ => linear(),
    };
    expect(
        choice,
        "`env`, `transparent` or a colour: white, #e6b219, rgb(230,178,25), or linear red,green,blue from 0 to 1, such as 0.2,0.2,0.25",
    )
}

/// Parses the address of tev, an image viewer: `tev`, `tev:HOST` or `tev:HOST:PORT`. The default
/// host is this machine.
pub fn parse_tev_address(text: &str) -> Result<TevAddress, String> {
    let form = "tev, tev:HOST or tev:HOST:PORT, the address of the image viewer tev";
    let rest = match text {
        "tev" => Some("127.0.0.1"),
        _ => text.strip_prefix("tev:"),
    };
    // An IPv6 address contains colons and is written in brackets.
    let address = rest.and_then(|rest| match rest.rsplit_once(':') {
        Some((host, port)) if !port.ends_with(']') => Some((host, port.parse().ok()?)),
        _ => Some((rest, TevAddress::PORT)),
    });
    let (host, port) = expect(address, form)?;
    let host = host
        .trim_start_matches('[')
        .trim_end_matches(']')
        .to_owned();
    expect(
        Some(TevAddress { host, port }).filter(|address| !address.host.is_empty()),
        form,
    )
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
    let axis = text.parse().ok().map(UpDirection::Axis);
    let direction = || parse_triple(text).ok().map(UpDirection::Direction);
    let form = "an axis of the model (y, z, x, -y, -z, -x) or a direction x,y,z, such as 0,0,1";
    expect(axis.or_else(direction), form)
}

/// Returns a clap parser of environments: a word, or a file with any other name.
pub fn environment_parser() -> impl TypedValueParser<Value = EnvironmentSource> {
    OsStringValueParser::new().try_map(|text| match text.to_str() {
        Some("none") => Ok(EnvironmentSource::None),
        Some("default") => Ok(EnvironmentSource::Default),
        Some("studio") => Ok(EnvironmentSource::Picture(SkyPicture::Studio)),
        Some("outdoor") => Ok(EnvironmentSource::Picture(SkyPicture::Outdoor)),
        // A word without dot and slash that is no existing file is probably a misspelled name.
        Some(word) if !word.contains(['.', '/']) && !Path::new(&text).exists() => {
            Err("expected `none`, `default`, `studio`, `outdoor` or the file of an equirectangular picture (.hdr, .exr, .png, .jpg)")
        }
        _ => Ok(EnvironmentSource::File(PathBuf::from(text))),
    })
}

/// Material that replaces the material of every surface, from `--material`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialChoice {
    /// A matte neutral grey.
    Clay,
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
    pub const NAMED: [(&'static str, Self); 3] = [
        ("auto", Self::Auto),
        ("dark", Self::Dark),
        ("light", Self::Light),
    ];

    /// Returns the radiance of the backdrop; `None` for `auto`.
    pub fn radiance(self) -> Option<f64> {
        match self {
            Self::Auto => None,
            Self::Dark => Some(Studio::DARK_BACKDROP),
            Self::Light => Some(Studio::LIGHT_BACKDROP),
        }
    }
}

/// Parses the name of an effect that can be switched off, with hyphens in place of blanks.
pub fn parse_effect(text: &str) -> Result<Effect, String> {
    if let Some(effect) = Effect::from_name(&text.replace('-', " ")) {
        return if SWITCHABLE_EFFECTS.has(effect) {
            Ok(effect)
        } else {
            Err("this effect is part of the scene itself and cannot be switched off; change the scene instead".to_owned())
        };
    }
    let known = list_switchable_effects();
    Err(match most_similar_word(text, known.split(", ")) {
        Some(word) => format!("no effect has this name; did you mean `{word}`?"),
        None => format!("no effect has this name; effects that can be switched off: {known}"),
    })
}

/// Returns the names of all effects that can be switched off, as on the command line: separated by
/// commas, with hyphens in place of blanks.
pub fn list_switchable_effects() -> String {
    SWITCHABLE_EFFECTS
        .iter()
        .map(|effect| effect.name().replace(' ', "-"))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Parses the code of a warning, such as `nothing-seen`.
pub fn parse_warning_code(text: &str) -> Result<FaultKind, String> {
    let names = FaultKind::ALL.iter().map(|kind| kind.name());
    FaultKind::from_name(text).ok_or_else(|| match most_similar_word(text, names) {
        Some(name) => format!("no warning has this code; did you mean `{name}`?"),
        None => "no warning has this code; docs/stress.md lists them".to_owned(),
    })
}

/// Parses a view by name, or by azimuth and elevation in degrees, `AZ,EL`.
pub fn parse_view(text: &str) -> Result<ViewAngles, String> {
    let named = ViewAngles::NAMED.iter().find(|(name, _)| *name == text);
    let listed = || parse_list(text).map(|[azimuth, elevation]| ViewAngles { azimuth, elevation });
    let names = ViewAngles::NAMED.map(|(name, _)| name).join(", ");
    let form = format!("{names} or azimuth and elevation in degrees, such as 30,20");
    let view = named.map(|(_, view)| *view).or_else(listed);
    let view = expect(view.filter(|view| !view.azimuth.is_nan()), &form)?;
    let is_upright = view.azimuth.is_finite() && (-90.0..=90.0).contains(&view.elevation);
    expect(
        Some(view).filter(|_| is_upright),
        "an elevation from -90 to 90 degrees",
    )
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
        let view = parse_view(&name).map_err(|error| match name.as_str() {
            "" => format!("a view is missing beside a comma: {error}"),
            name => format!("{name}: {error}"),
        })?;
        views.push((name, view));
    }
    Ok(NamedViews(views))
}

/// Parses the times of a film, `A..B:FPS` with at most 100,000 pictures, or `all:FPS`.
pub fn parse_frame_times(text: &str) -> Result<FrameTimes, String> {
    let form = "A..B:FPS, such as 0..2:25 for the time from 0 s to 2 s at 25 pictures per second, or all:FPS for a model's whole animation, such as all:25";
    let (span, rate) = expect(text.rsplit_once(':'), form)?;
    let (from, to) = match span.split_once("..") {
        Some((from, to)) => (parse_number(from)?, parse_number(to)?),
        None => expect((span == "all").then_some((0.0, f64::INFINITY)), form)?,
    };
    let rate = expect(Some(parse_number(rate)?).filter(|rate| *rate > 0.0), form)?;
    let count = (to - from) * rate;
    if to <= from {
        return Err(format!(
            "the end, {to} s, has to be after the start, {from} s"
        ));
    }
    if count.is_finite() && count > FrameTimes::MOST_TIMES {
        return Err(format!(
            "{count} pictures are too many; the largest number is 100000: shorten the time, or give fewer pictures per second"
        ));
    }
    Ok(FrameTimes { from, to, rate })
}

// Parsers of flags whose values are the variants of an enum. The accepted names are the enum's
// serde names, which scene files use too; no second table is kept by hand.

/// Returns a clap parser that accepts the serde names of the unit variants of `T`. Clap lists the
/// names in the help and suggests the nearest name for a misspelled word.
pub fn variant_parser<T: DeserializeOwned + Clone + Send + Sync + 'static>()
-> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(variant_names::<T>())
        .try_map(|name| parse_variant::<T>(&name).map_err(|_| name))
}

/// Returns a clap parser for the names of layers of an EXR picture.
pub fn aov_parser() -> impl TypedValueParser<Value = Aov> {
    let find = |name: String| {
        let found = Aov::ALL.into_iter().find(|(known, _)| *known == name);
        found.map(|(_, aov)| aov).ok_or(name)
    };
    PossibleValuesParser::new(Aov::ALL.map(|(name, _)| name)).try_map(find)
}

/// Error for a name that is no variant of an enum. The field holds the names of all variants.
#[derive(Debug)]
pub(crate) struct RefusedVariant(&'static [&'static str]);

impl fmt::Display for RefusedVariant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected one of {}", self.0.join(", "))
    }
}

impl std::error::Error for RefusedVariant {}

impl serde::de::Error for RefusedVariant {
    fn custom<M: fmt::Display>(_: M) -> Self {
        Self(&[])
    }
    fn unknown_variant(_: &str, expected: &'static [&'static str]) -> Self {
        Self(expected)
    }
}

/// Parses a variant of `T` by its serde name.
pub(crate) fn parse_variant<T: DeserializeOwned>(name: &str) -> Result<T, RefusedVariant> {
    T::deserialize(IntoDeserializer::<RefusedVariant>::into_deserializer(name))
}

/// Returns the serde names of all variants of `T`, in the order of their declaration.
fn variant_names<T: DeserializeOwned>() -> &'static [&'static str] {
    parse_variant::<T>("")
        .err()
        .map_or(&[], |RefusedVariant(names)| names)
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod names_tests {
    use raywright_core::scene::{ToneMap, TransferCurve};

    use super::*;

    /// Protects: the flags accept exactly what a scene file accepts.
    #[test]
    fn names_are_those_of_the_scene_format() {
        assert_eq!(
            variant_names::<ToneMap>(),
            ["none", "aces", "aces-hill", "agx", "khronos-neutral"]
        );
        assert_eq!(variant_names::<TransferCurve>(), ["srgb", "2.2", "none"]);
        assert_eq!(
            parse_variant::<ToneMap>("aces-hill").ok(),
            Some(ToneMap::AcesHill)
        );
        assert!(parse_variant::<ToneMap>("filmic").is_err());
    }
}
