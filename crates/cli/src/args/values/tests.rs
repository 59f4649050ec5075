//! Values of flags: the documented forms are parsed, and others are refused with their reason.

use std::time::Duration;

use raywright_core::effects::Effect;
use raywright_core::settings::Crop;

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
    assert!(parse_effect("higlights").is_err_and(|e| e.ends_with("did you mean `highlights`?")));
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
        error.ends_with("pictures are too many; the largest number is 100000: shorten the time, or give fewer pictures per second")
    }));
    assert!(
        parse_frame_times("0..2:-5").is_err_and(|error| error.starts_with("expected A..B:FPS"))
    );
}
