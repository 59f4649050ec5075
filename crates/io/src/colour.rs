//! Parser of colours in CSS notation: `#e6b219`, `white`, `rgb(230, 178, 25)`. CSS states sRGB
//! codes from 0 to 255, which are converted to linear values.

use css_color::Srgb;
use raywright_core::display::curve::decode_transfer;
use raywright_core::scene::TransferCurve;

/// Parses an opaque CSS colour, such as `#e6b219` or `white`, to linear red, green and blue from 0
/// to 1. `None` for any other text. Digits without `#` are read as a number, so they give `None`
/// too.
pub fn parse_colour(text: &str) -> Option<[f64; 3]> {
    let text = text.trim();
    let is_name = || {
        text.len() > 2
            && text.bytes().all(|b| b.is_ascii_alphabetic())
            && !text.bytes().all(|b| b.is_ascii_hexdigit())
    };
    if !(text.starts_with('#') || text.starts_with("rgb") || is_name()) {
        return None;
    }
    let colour: Srgb = text
        .parse()
        .ok()
        .filter(|colour: &Srgb| colour.alpha >= 1.0)?;
    // The parser returns code/255 in single precision. All three notations state whole codes, so
    // that rounding restores the exact code.
    Some([colour.red, colour.green, colour.blue].map(|share| {
        let code = (f64::from(share) * 255.0).round();
        decode_transfer(TransferCurve::Srgb, code / 255.0)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the three notations give the same linear colour, by the definition of sRGB (IEC
    /// 61966-2-1), and numbers and expressions are no colours.
    #[test]
    fn notations_of_one_colour_agree() {
        let linear = |code: f64| ((code / 255.0 + 0.055) / 1.055_f64).powf(2.4);
        let expected = [230.0, 178.0, 25.0].map(linear);
        for text in [
            "#e6b219",
            "#E6B219",
            "rgb(230, 178, 25)",
            " rgb(230 178 25) ",
        ] {
            let found = parse_colour(text).expect(text);
            assert!(
                found
                    .iter()
                    .zip(expected)
                    .all(|(a, b)| (a - b).abs() < 1e-9),
                "{text}: {found:?}"
            );
        }
        assert_eq!(parse_colour("white"), Some([1.0; 3]));
        assert_eq!(parse_colour("#fff"), Some([1.0; 3]));
        for text in [
            "",
            "0.5",
            "123456",
            "facade",
            "sin(t)",
            "t",
            "p.x",
            "#12",
            "rgb(1)",
            "transparent",
            "#11223344",
            "wihte",
        ] {
            assert_eq!(parse_colour(text), None, "{text}");
        }
    }
}
