//! Heat map: numbers shown as colours from black through purple and orange to pale yellow.

use crate::display::curve;
use crate::picture::Picture;
use crate::scene::TransferCurve;

/// Colours of the scale as display values, at equal steps from 0 to 1. Their luminance increases,
/// so the map is readable in greyscale too.
const SCALE: [[f64; 3]; 8] = [
    [0.00, 0.00, 0.02],
    [0.14, 0.07, 0.32],
    [0.34, 0.09, 0.48],
    [0.58, 0.16, 0.47],
    [0.81, 0.27, 0.38],
    [0.95, 0.47, 0.29],
    [0.99, 0.72, 0.40],
    [0.99, 0.97, 0.76],
];

/// Returns a heat map of one number per pixel, row by row from the top. 0 is black; `full` and
/// greater numbers are pale yellow; NaN stays NaN. The picture is linear. It has the intended
/// colours under [`Display::PLAIN`](crate::display::Display::PLAIN).
pub fn heat_map(width: u32, height: u32, values: &[f32], full: f32) -> Picture {
    let colour = |value: &f32| {
        let rgb = heat_scale_colour(f64::from(value / full));
        rgb.map(|x| curve::decode_transfer(TransferCurve::Srgb, x) as f32)
    };
    let mut picture = Picture::new(width, height);
    for (rgb, value) in picture.rgb.iter_mut().zip(values) {
        *rgb = colour(value);
    }
    picture
}

fn heat_scale_colour(x: f64) -> [f64; 3] {
    let place = x.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let index = (place as usize).min(SCALE.len() - 2);
    let (low, high, share) = (SCALE[index], SCALE[index + 1], place - index as f64);
    [0, 1, 2].map(|c| low[c] + (high[c] - low[c]) * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::{Display, NAN_MARKER};

    /// Protects: a larger value always has a higher luminance, so that the map is readable without
    /// its legend and in grey.
    #[test]
    fn luminance_rises_with_the_value() {
        let values: Vec<f32> = (0..=1000).map(|i| i as f32 / 500.0).collect();
        let picture = heat_map(1001, 1, &values, 2.0);
        let luminance: Vec<f64> = picture
            .rgb
            .iter()
            .map(|rgb| curve::luminance(rgb.map(f64::from)))
            .collect();
        assert!(luminance.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(luminance[0] < 0.01 && luminance[1000] > 0.85);
    }

    /// Protects: values beyond the scale get its end colours, and NaN gets no colour of the scale.
    #[test]
    fn ends_and_nan_are_defined() {
        let map = |value| {
            Display::PLAIN
                .build_map()
                .display_values(heat_map(1, 1, &[value], 0.5).rgb[0])
        };
        assert_eq!(map(-1.0), map(0.0));
        assert_eq!(map(0.5), map(f32::INFINITY));
        assert_ne!(map(0.25), map(0.5));
        assert_eq!(map(f32::NAN), NAN_MARKER);
    }
}
