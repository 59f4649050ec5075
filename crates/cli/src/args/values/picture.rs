//! Parsers of the form of a picture: its size, crop, share, exposure and background, and the viewer that
//! shows it.

use raywright_core::Settings;
use raywright_core::display::curve::{encode_transfer, quantise_8_bit};
use raywright_core::scene::{AspectFit, TransferCurve};
use raywright_core::settings::Crop;
use raywright_io::parse_colour;

use super::super::pictures::{BackgroundChoice, ExposureChoice, PictureShare, TevAddress};
use super::numbers::{parse_list, parse_number, parse_triple};

/// Largest width or height of a picture, in pixels.
pub const MAX_EDGE: u32 = Settings::MOST_EDGE;

/// Parses the size of a picture, `WxH`, each from 1 to `MAX_EDGE`.
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

/// Parses the fit of a picture whose aspect ratio differs from the camera's: `contain` or `cover`.
pub fn parse_fit(text: &str) -> Result<AspectFit, String> {
    match text {
        "contain" => Ok(AspectFit::Contain),
        "cover" => Ok(AspectFit::Cover),
        _ => Err("expected `contain` or `cover`".to_owned()),
    }
}

/// Parses an exposure: stops, or `auto`.
pub fn parse_exposure(text: &str) -> Result<ExposureChoice, String> {
    if text == "auto" {
        return Ok(ExposureChoice::Auto);
    }
    parse_number(text)
        .map(ExposureChoice::Stops)
        .map_err(|_| "expected a number of stops, such as -1.5, or `auto`".to_owned())
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
        _ => Err("expected `env`, `transparent` or a colour: white, #e6b219, rgb(230,178,25), or linear red,green,blue from 0 to 1, such as 0.2,0.2,0.25".to_owned()),
    }
}

/// Parses the address of tev, an image viewer: `tev`, `tev:HOST` or `tev:HOST:PORT`. The default
/// host is this machine.
pub fn parse_tev_address(text: &str) -> Result<TevAddress, String> {
    const EXPECTED: &str =
        "expected tev, tev:HOST or tev:HOST:PORT, the address of the image viewer tev";
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
