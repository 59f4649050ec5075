//! Conversion of pictures and layers to 8-bit colours for the viewer: directions as red, green and
//! blue, objects by hue, errors on a heat scale from black to white.

use raywright_core::display::{Display, OutputFormat};
use raywright_core::film::Film;
use raywright_core::picture::{Picture, PictureLayer};
use raywright_core::settings::Aov;

/// Converts a picture to 8-bit codes of red, green, blue and coverage for each pixel.
pub fn encode_colours(picture: &Picture, display: Display) -> Vec<u8> {
    let output = if matches!(display.output, OutputFormat::Dithered) {
        OutputFormat::Dithered
    } else {
        OutputFormat::Eight
    };
    let codes = Display { output, ..display }.to_codes(picture);
    if display.has_alpha(picture) {
        codes
    } else {
        codes
            .chunks_exact(3)
            .flat_map(|rgb| [rgb[0], rgb[1], rgb[2], 255])
            .collect()
    }
}

/// Returns the layer of first-hit data with this name, such as `normal`; `None` for the layers
/// `samples` and `stderr` and for unknown names.
pub fn first_hit_layer(name: &str) -> Option<Aov> {
    let layer = Aov::ALL.into_iter().find(|(known, _)| *known == name)?.1;
    (!matches!(layer, Aov::Edges | Aov::Samples | Aov::StandardError)).then_some(layer)
}

/// Converts a first-hit layer of a picture to 8-bit codes of red, green, blue and coverage for each
/// pixel; empty if the picture lacks the layer.
pub fn encode_layer(picture: &Picture, layer: Aov) -> Vec<u8> {
    let layer_samples = |name: &str| {
        picture
            .layer(name)
            .map(|layer: &PictureLayer| layer.samples.as_slice())
            .unwrap_or_default()
    };
    let three = |names: [&str; 3]| {
        let [a, b, c] = names.map(layer_samples);
        a.iter()
            .zip(b)
            .zip(c)
            .map(|((&a, &b), &c)| [a, b, c])
            .collect::<Vec<_>>()
    };
    let plain = |rgb: Vec<[f32; 3]>| {
        encode_colours(
            &Picture {
                rgb,
                ..Picture::new(picture.width, picture.height)
            },
            Display::PLAIN,
        )
    };
    match layer {
        Aov::Albedo => plain(three(["albedo.R", "albedo.G", "albedo.B"])),
        Aov::Emission => plain(three(["emission.R", "emission.G", "emission.B"])),
        Aov::Normal => encode_pixels(
            three(["normal.X", "normal.Y", "normal.Z"])
                .into_iter()
                .map(|n| n.map(|x| 0.5 + 0.5 * x)),
        ),
        Aov::Position => {
            let places = three(["position.X", "position.Y", "position.Z"]);
            let ranges = [0, 1, 2].map(|axis| finite_range(places.iter().map(|place| place[axis])));
            encode_pixels(places.iter().map(|place| {
                std::array::from_fn(|axis| normalise_to_range(place[axis], ranges[axis]))
            }))
        }
        Aov::Depth => {
            let depth = layer_samples("depth.Z");
            let seen = finite_range(depth.iter().copied().filter(|&distance| distance >= 0.0));
            let near = |&distance: &f32| {
                if distance < 0.0 {
                    0.0
                } else {
                    1.0 - 0.9 * normalise_to_range(distance, seen)
                }
            };
            encode_pixels(depth.iter().map(|distance| [near(distance); 3]))
        }
        Aov::Object => encode_pixels(
            layer_samples("object.id")
                .iter()
                .map(|&id| identifier_colour(id)),
        ),
        Aov::Material => encode_pixels(
            layer_samples("material.id")
                .iter()
                .map(|&id| identifier_colour(id)),
        ),
        Aov::Edges | Aov::Samples | Aov::StandardError => Vec::new(),
    }
}

/// Converts the standard errors of a film's pixels to heat colours, as 8-bit codes of red, green,
/// blue and coverage. White stands for a standard error of a fifth of the pixel's luminance plus
/// 0.1: (luminance + 0.1) / 5. Grey stands for an unknown error.
pub fn encode_errors(film: &Film, picture: &Picture) -> Vec<u8> {
    let Some((errors, _)) = film.standard_errors() else {
        return encode_pixels(picture.rgb.iter().map(|_| [0.3; 3]));
    };
    let luminance = |rgb: &[f32; 3]| 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    encode_pixels(
        errors
            .iter()
            .zip(&picture.rgb)
            .map(|(error, rgb)| match luminance(error) {
                error if error < 0.0 => [0.3; 3],
                error => heat_colour(5.0 * error / (luminance(rgb).max(0.0) + 0.1)),
            }),
    )
}

/// Maps a value from 0 to 1 to a heat scale, and returns the display colour: from black over red
/// and yellow to white.
fn heat_colour(share: f32) -> [f32; 3] {
    let share = share.clamp(0.0, 1.0);
    [
        (3.0 * share).min(1.0),
        (3.0 * share - 1.0).clamp(0.0, 1.0),
        (3.0 * share - 2.0).clamp(0.0, 1.0),
    ]
}

fn encode_pixels(pixels: impl Iterator<Item = [f32; 3]>) -> Vec<u8> {
    pixels
        .flat_map(|[r, g, b]| {
            [
                quantise_to_8_bits(r),
                quantise_to_8_bits(g),
                quantise_to_8_bits(b),
                255,
            ]
        })
        .collect()
}

fn quantise_to_8_bits(value: f32) -> u8 {
    (255.0 * value.clamp(0.0, 1.0) + 0.5) as u8
}

/// Returns the least and the greatest of the finite numbers; infinity and minus infinity if all
/// numbers are non-finite.
fn finite_range(numbers: impl Iterator<Item = f32>) -> [f32; 2] {
    let finite = numbers.filter(|number| number.is_finite());
    finite.fold(
        [f32::INFINITY, f32::NEG_INFINITY],
        |[minimum, maximum], number| [minimum.min(number), maximum.max(number)],
    )
}

fn normalise_to_range(number: f32, [minimum, maximum]: [f32; 2]) -> f32 {
    if maximum > minimum {
        (number - minimum) / (maximum - minimum)
    } else {
        0.0
    }
}

/// Returns the colour of an object's or material's identifier, distinct from the colours of the
/// identifiers before and after it; black for a negative identifier.
fn identifier_colour(id: f32) -> [f32; 3] {
    if id < 0.0 {
        return [0.0; 3];
    }
    // Hues at multiples of the golden ratio have the widest gaps between them.
    let turn = (id * 0.618_034).fract();
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|offset| {
        let distance = ((turn + offset).fract() - 0.5).abs() * 2.0;
        0.25 + 0.7 * (1.5 * distance).clamp(0.0, 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: each layer has four bytes per pixel, neighbouring objects differ, pixels without a
    /// hit are black, and nearer surfaces are brighter.
    #[test]
    fn layers_have_colours() {
        let layer = |name: &str, samples: [f32; 3]| PictureLayer {
            name: name.to_owned(),
            samples: samples.to_vec(),
        };
        let layers = vec![
            layer("object.id", [-1.0, 0.0, 1.0]),
            layer("depth.Z", [-1.0, 2.0, 5.0]),
        ];
        let picture = Picture {
            layers,
            ..Picture::new(3, 1)
        };
        let objects = encode_layer(&picture, Aov::Object);
        assert_eq!((objects.len(), &objects[..4]), (12, &[0, 0, 0, 255][..]));
        let apart = |a: usize, b: usize| {
            (0..3)
                .map(|i| objects[a + i].abs_diff(objects[b + i]))
                .max()
        };
        assert!(apart(4, 8) > Some(60), "{objects:?}");
        let depth = encode_layer(&picture, Aov::Depth);
        assert!(
            depth[0] == 0 && depth[4] > depth[8] && depth[8] > 0,
            "{depth:?}"
        );
        assert_eq!(first_hit_layer("stderr"), None);
        assert_eq!(first_hit_layer("normal"), Some(Aov::Normal));
        assert_eq!(encode_colours(&picture, Display::PLAIN).len(), 12);
        assert!(heat_colour(0.1) < heat_colour(0.5) && heat_colour(0.5) < heat_colour(0.9));
    }
}
