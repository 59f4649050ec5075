//! Extreme values through every tone map and curve (numerics F05, F06), coverage, and the code
//! table against the definition.

pub(super) mod primaries;

use super::*;

const MAPS: [ToneMap; 5] = [
    ToneMap::None,
    ToneMap::Aces,
    ToneMap::AcesHill,
    ToneMap::Agx,
    ToneMap::KhronosNeutral,
];
const CURVES: [TransferCurve; 3] = [
    TransferCurve::Srgb,
    TransferCurve::Gamma22,
    TransferCurve::None,
];

fn every_display() -> impl Iterator<Item = Display> {
    MAPS.into_iter().flat_map(|tone_map| {
        let exposures = [-1.0, 0.0, 2.5];
        CURVES.into_iter().flat_map(move |curve| {
            exposures.map(|exposure_stops| Display {
                tone_map,
                curve,
                exposure_stops,
                ..Display::PLAIN
            })
        })
    })
}

/// Non-negative f32 in ascending order: the special ones and some two thousand of all sizes.
fn ascending() -> Vec<f32> {
    let special = [
        0.0,
        f32::from_bits(1),
        1e-40,
        1e-8,
        0.003_130_8,
        0.003_130_8_f32.next_up(),
        0.003_130_8_f32.next_down(),
    ];
    let large = [
        1.0,
        1.0_f32.next_up(),
        1e4,
        65504.0,
        f32::MAX,
        f32::INFINITY,
    ];
    let mut values: Vec<f32> = (0..f32::INFINITY.to_bits())
        .step_by(1_000_003)
        .map(f32::from_bits)
        .collect();
    values.extend(special.into_iter().chain(large));
    values.sort_by(f32::total_cmp);
    values
}

/// Protects: F06: grey values of every size map to non-decreasing values in 0..1, from 0 at 0 to 1
/// at infinity.
#[test]
fn f06_greys_rise_from_zero_to_one() {
    for display in every_display() {
        let map = display.build_map();
        let mut last = 0.0;
        for x in ascending() {
            let [r, g, b] = map.display_values([x; 3]);
            assert!(
                [r, g, b].iter().all(|v| (0.0..=1.0).contains(v)),
                "{display:?} {x}: {r} {g} {b}"
            );
            assert!(g >= last, "{display:?} {x}: {g} after {last}");
            last = g;
        }
        assert_eq!(map.codes([0.0; 3]), [0; 3], "{display:?}");
        assert_eq!(map.codes([-0.0; 3]), [0; 3], "{display:?}");
        assert_eq!(map.codes([f32::INFINITY; 3]), [255; 3], "{display:?}");
        assert!(last > 0.9999, "{display:?} {last}");
    }
}

/// Protects: F06: a single infinite channel is as bright as the map allows and never becomes NaN.
#[test]
fn f06_one_infinite_channel_stays_in_range() {
    for display in every_display() {
        let map = display.build_map();
        let values = map.display_values([f32::INFINITY, 0.0, 0.5]);
        assert!(
            values.iter().all(|v| (0.0..=1.0).contains(v)),
            "{display:?} {values:?}"
        );
        assert_eq!(map.codes([f32::INFINITY, 0.0, 0.5])[0], 255, "{display:?}");
    }
}

/// Protects: F05: negative channels, finite or not, become black before the tone map, so that no
/// power of a negative number is taken.
#[test]
fn f05_negative_channels_are_black() {
    for display in every_display() {
        let map = display.build_map();
        for x in [-1e-40, -0.012, -1.0, -1e30, f32::NEG_INFINITY] {
            assert_eq!(
                map.display_values([x, 0.25, 0.5]),
                map.display_values([0.0, 0.25, 0.5]),
                "{display:?} {x}"
            );
        }
    }
}

/// Protects: F06: a NaN in any channel shows as the documented marker, for all settings.
#[test]
fn f06_nan_is_marked() {
    for display in every_display() {
        let map = display.build_map();
        for channel in 0..3 {
            let mut rgb = [0.5, f32::INFINITY, -1.0];
            rgb[channel] = f32::NAN;
            assert_eq!(map.display_values(rgb), NAN_MARKER, "{display:?}");
            assert_eq!(map.codes(rgb), [255, 0, 255], "{display:?}");
        }
    }
}

/// Protects: the codes are floor(255 v + ½) of the curve on the clipped display-linear value, for
/// colours of all sizes.
#[test]
fn codes_equal_the_plain_definition() {
    let values: Vec<f32> = ascending().into_iter().step_by(7).collect();
    for display in every_display() {
        let map = display.build_map();
        for (i, &r) in values.iter().enumerate() {
            let rgb = [r, values[(i * 31) % values.len()], 0.3];
            let linear = map.display_linear(rgb).unwrap();
            let plain = linear.map(|y| {
                (255.0 * curve::encode_transfer(display.curve, f64::from(y)) + 0.5).floor() as u8
            });
            assert_eq!(map.codes(rgb), plain, "{display:?} {rgb:?}");
        }
    }
}

/// Protects: exposure is in stops, before the tone map: a stop doubles the radiance exactly.
#[test]
fn exposure_doubles_by_the_stop() {
    for tone_map in MAPS {
        let base = Display {
            tone_map,
            ..Display::PLAIN
        };
        let brighter = Display {
            exposure_stops: 1.0,
            ..base
        };
        for rgb in [[0.1, 0.2, 0.05], [3.0, 0.0, 0.7]] {
            assert_eq!(
                brighter.build_map().display_values(rgb),
                base.build_map().display_values(rgb.map(|x| 2.0 * x)),
                "{tone_map:?}"
            );
        }
    }
}

/// Protects: colours are divided by the coverage before the mapping, and the coverage is stored
/// beside them; where it is zero the pixel is transparent black.
#[test]
fn coverage_is_stored_straight() {
    let picture = Picture {
        alpha: Some(vec![0.5, 0.0, 1.0, f32::NAN]),
        rgb: vec![[0.25, 0.0, 0.5], [0.3; 3], [0.25; 3], [0.5; 3]],
        ..Picture::new(2, 2)
    };
    let linear = Display {
        curve: TransferCurve::None,
        ..Display::PLAIN
    };
    let codes = linear.to_codes(&picture);
    assert_eq!(
        codes,
        [128, 0, 255, 128, 0, 0, 0, 0, 64, 64, 64, 255, 0, 0, 0, 0]
    );
}

/// Protects: a coverage is a share of the pixel, not a colour: no curve, tone map or exposure
/// changes its code.
#[test]
fn coverage_is_stored_as_it_is() {
    let alpha: Vec<f32> = (0..=255).map(|code| code as f32 / 255.0).collect();
    let picture = Picture {
        alpha: Some(alpha),
        ..Picture::new(256, 1)
    };
    for display in every_display() {
        let codes = Display {
            exposure_stops: 1.0,
            ..display
        }
        .to_codes(&picture);
        assert!(
            codes
                .chunks(4)
                .zip(0..=255)
                .all(|(pixel, code)| pixel[3] == code),
            "{display:?}"
        );
    }
}

/// Protects: rows and columns keep their places, and the values of a picture agree with its codes.
#[test]
fn a_picture_keeps_its_places() {
    let mut picture = Picture::new(3, 2);
    for (i, rgb) in picture.rgb.iter_mut().enumerate() {
        *rgb = [i as f32 / 5.0, 0.0, 1.0];
    }
    let codes = Display::PLAIN.to_codes(&picture);
    let values = Display::PLAIN.to_display_values(&picture);
    assert_eq!(codes.len(), 18);
    for (i, code) in codes.chunks(3).enumerate() {
        let expected = values.rgb[i].map(|v| curve::quantise_8_bit(f64::from(v)));
        assert_eq!(code, expected);
    }
    assert!(codes[0] < codes[3] && codes[12] < codes[15]);
}

/// Protects: a scene sets its own display, each of the three settings, for every map and curve.
#[test]
fn a_scene_says_how_it_is_shown() {
    for display in every_display() {
        let Display {
            tone_map,
            curve,
            exposure_stops,
            ..
        } = display;
        assert_eq!(
            Display::from_render(&RenderSettings {
                tone_map,
                gamma: curve,
                exposure: exposure_stops,
                ..RenderSettings::default()
            }),
            display
        );
    }
}

/// Protects: 16-bit codes are two bytes per channel, the high byte first, coverage included, in the
/// order of the picture. Dithered codes are one of the two nearest, by position; a value exactly at
/// a code keeps it.
#[test]
fn codes_of_every_kind() {
    let picture = Picture {
        width: 2,
        height: 1,
        rgb: vec![[0.25, 0.5, 1.0], [0.0, 0.1, 7.0]],
        alpha: Some(vec![1.0, 0.5]),
        ..Picture::default()
    };
    let linear = Display {
        curve: TransferCurve::None,
        output: OutputFormat::Sixteen,
        ..Display::PLAIN
    };
    // 65535/4 + ½ = 16384.25, 65535/2 + ½ = 32768, and of the second pixel, whose colours are
    // divided by its coverage, 0.2: 13107.5.
    let halves = [16384_u16, 32768, 65535, 65535, 0, 13107, 65535, 32768];
    assert_eq!(
        linear.to_codes(&picture),
        halves
            .iter()
            .flat_map(|code| code.to_be_bytes())
            .collect::<Vec<u8>>()
    );
    let opaque = Picture {
        alpha: None,
        ..picture.clone()
    };
    let halves = [16384_u16, 32768, 65535, 0, 6554, 65535];
    assert_eq!(
        linear.to_codes(&opaque),
        halves
            .iter()
            .flat_map(|code| code.to_be_bytes())
            .collect::<Vec<u8>>()
    );

    let flat = |rgb| Picture {
        rgb: vec![rgb; 64 * 64],
        ..Picture::new(64, 64)
    };
    let dithered = Display {
        output: OutputFormat::Dithered,
        ..linear
    };
    let codes = dithered.to_codes(&flat([0.3, 0.7, 1.0]));
    let mean = |channel: usize| {
        codes
            .iter()
            .skip(channel)
            .step_by(3)
            .map(|&code| f64::from(code))
            .sum::<f64>()
            / 4096.0
    };
    assert!(
        (mean(0) - 76.5).abs() < 0.02 && (mean(1) - 178.5).abs() < 0.02 && mean(2) == 255.0,
        "{} {} {}",
        mean(0),
        mean(1),
        mean(2)
    );
    assert!(
        codes
            .chunks_exact(3)
            .all(|c| (76..=77).contains(&c[0]) && (178..=179).contains(&c[1]))
    );
    let neighbours = codes
        .chunks_exact(3)
        .zip(codes.chunks_exact(3).skip(1))
        .filter(|(a, b)| a[0] != b[0])
        .count();
    assert!(
        neighbours > 1500,
        "neighbours differ mostly: {neighbours} of 4096"
    );
    assert_eq!(dithered.to_codes(&opaque).len(), 6);
}

/// A picture of one pixel with given coverages by surfaces and by a shadow.
fn pixel_of(colour: [f32; 3], [surfaces, shadow]: [f32; 2]) -> Picture {
    let (rgb, alpha) = (
        vec![colour.map(|channel| channel * surfaces)],
        Some(vec![surfaces + shadow]),
    );
    Picture {
        rgb,
        alpha,
        shadow: Some(vec![shadow]),
        ..Picture::new(1, 1)
    }
}

/// Protects: a background keeps exactly its codes where it is not covered, for every tone map,
/// curve, exposure and output; a fully covered pixel shows nothing of it; a NaN is marked.
#[test]
fn backgrounds_have_exactly_their_codes() {
    for display in every_display() {
        for codes in [
            [255, 255, 255],
            [0, 0, 0],
            [230, 178, 25],
            [255, 0, 0],
            [1, 128, 254],
        ] {
            let background = Some(codes.map(|code| f64::from(code) / 255.0));
            let display = Display {
                background,
                ..display
            };
            let [empty, full, nan] = [
                ([7.0; 3], 0.0),
                ([0.2, 0.5, 0.1], 1.0),
                ([f32::NAN; 3], 1.0),
            ]
            .map(|(colour, surfaces)| pixel_of(colour, [surfaces, 0.0]));
            assert!(
                !display.has_alpha(&empty)
                    && Display {
                        background: None,
                        ..display
                    }
                    .has_alpha(&empty)
            );
            assert_eq!(display.to_codes(&empty), codes, "{display:?}");
            assert_eq!(
                Display {
                    output: OutputFormat::Dithered,
                    ..display
                }
                .to_codes(&empty),
                codes,
                "{display:?}"
            );
            let wide: Vec<u8> = codes.iter().flat_map(|&code| [code; 2]).collect();
            assert_eq!(
                Display {
                    output: OutputFormat::Sixteen,
                    ..display
                }
                .to_codes(&empty),
                wide,
                "{display:?}"
            );
            let alone = Picture {
                alpha: None,
                shadow: None,
                ..full.clone()
            };
            assert_eq!(
                display.to_codes(&full),
                Display {
                    background: None,
                    ..display
                }
                .to_codes(&alone),
                "{display:?}"
            );
            assert_eq!(display.to_codes(&nan), [255, 0, 255]);
        }
    }
}

/// Protects: a transparent picture composited over a page's colour, code by code, equals the
/// picture with that background within two codes, for surfaces, shadows and both in a pixel. A
/// shadow alone dims the background's light within one code for white and for a power curve, within
/// eight codes of sRGB for greys.
#[test]
fn pages_show_what_a_background_shows() {
    for display in every_display() {
        for page in [[255, 255, 255], [128, 128, 128], [230, 25, 60], [0, 0, 0]] {
            let direct = Display {
                background: Some(page.map(|code| f64::from(code) / 255.0)),
                ..display
            };
            for (surfaces, shadow) in (0..=8)
                .flat_map(|i| (0..=8).map(move |k| (i, k)))
                .map(|(i, k)| (i as f32 / 8.0, k as f32 / 8.0))
            {
                let shadow = shadow * (1.0 - surfaces);
                for colour in [[0.0; 3], [0.9, 0.4, 0.05], [8.0; 3]] {
                    let picture = pixel_of(colour, [surfaces, shadow]);
                    let (over, expected) = (display.to_codes(&picture), direct.to_codes(&picture));
                    let alpha = f64::from(over[3]) / 255.0;
                    for i in 0..3 {
                        let laid = alpha * f64::from(over[i]) + (1.0 - alpha) * f64::from(page[i]);
                        let apart = (laid.round() - f64::from(expected[i])).abs();
                        assert!(
                            apart <= 2.0,
                            "{display:?} {page:?} {surfaces} {shadow}: {over:?} {expected:?}"
                        );
                    }
                }
                if surfaces == 0.0 {
                    let light = page.map(|code| {
                        (1.0 - f64::from(shadow))
                            * curve::decode_transfer(display.curve, f64::from(code) / 255.0)
                    });
                    let lit = light.map(|light| {
                        curve::quantise_8_bit(curve::encode_transfer(display.curve, light))
                    });
                    let apart = lit
                        .iter()
                        .zip(direct.to_codes(&pixel_of([0.0; 3], [0.0, shadow])))
                        .map(|(&a, b)| a.abs_diff(b))
                        .max();
                    let most = if display.curve == TransferCurve::Srgb && page != [255; 3] {
                        8
                    } else {
                        1
                    };
                    assert!(
                        apart <= Some(most),
                        "{display:?} {page:?} {shadow}: {apart:?}"
                    );
                }
            }
        }
    }
}

/// Protects: in a pixel of surfaces and shadow, the shadow dims only the background's light behind
/// the shadow, by the share of the uncovered pixel that it covers.
#[test]
fn a_shadow_beside_surfaces_dims_its_share() {
    for display in every_display() {
        let on_white = Display {
            background: Some([1.0; 3]),
            ..display
        };
        for [surfaces, shadow] in [[0.5, 0.25], [0.25, 0.75], [0.75, 0.125]] {
            let [surface, codes] = [[1.0, 0.0], [surfaces, shadow]]
                .map(|coverage| on_white.to_codes(&pixel_of([0.9, 0.4, 0.05], coverage)));
            let clear = 1.0 - f64::from(surfaces);
            let left = curve::encode_transfer(display.curve, (clear - f64::from(shadow)) / clear);
            for i in 0..3 {
                let expected = f64::from(surfaces) * f64::from(surface[i]) + clear * left * 255.0;
                assert!(
                    (expected - f64::from(codes[i])).abs() <= 1.0,
                    "{display:?} {surfaces} {shadow}, channel {i}: {} for {expected}",
                    codes[i]
                );
            }
        }
    }
}
