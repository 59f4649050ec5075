//! Conversion of pictures and layers to 8-bit colours for the viewer: directions as red, green and
//! blue, objects by hue, errors as heat.

use raywright_core::display::{Display, Output};
use raywright_core::film::Film;
use raywright_core::picture::{Layer, Picture};
use raywright_core::settings::Aov;

/// Converts a picture to 8-bit codes of red, green, blue and coverage for each pixel.
pub fn colours(picture: &Picture, display: Display) -> Vec<u8> {
    let output = if matches!(display.output, Output::Dithered) {
        Output::Dithered
    } else {
        Output::Eight
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
pub fn of_hits(name: &str) -> Option<Aov> {
    let layer = Aov::ALL.into_iter().find(|(known, _)| *known == name)?.1;
    (!matches!(layer, Aov::Samples | Aov::StandardError)).then_some(layer)
}

/// Converts a first-hit layer of a picture to 8-bit codes of red, green, blue and coverage for each
/// pixel; empty if the picture lacks the layer.
pub fn hits(picture: &Picture, layer: Aov) -> Vec<u8> {
    let value_of = |name: &str| {
        picture
            .layer(name)
            .map(|layer: &Layer| layer.samples.as_slice())
            .unwrap_or_default()
    };
    let three = |names: [&str; 3]| {
        let [a, b, c] = names.map(value_of);
        a.iter()
            .zip(b)
            .zip(c)
            .map(|((&a, &b), &c)| [a, b, c])
            .collect::<Vec<_>>()
    };
    let plain = |rgb: Vec<[f32; 3]>| {
        colours(
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
        Aov::Normal => codes(
            three(["normal.X", "normal.Y", "normal.Z"])
                .into_iter()
                .map(|n| n.map(|x| 0.5 + 0.5 * x)),
        ),
        Aov::Position => {
            let places = three(["position.X", "position.Y", "position.Z"]);
            let ranges = [0, 1, 2].map(|axis| range(places.iter().map(|place| place[axis])));
            codes(
                places
                    .iter()
                    .map(|place| std::array::from_fn(|axis| share(place[axis], ranges[axis]))),
            )
        }
        Aov::Depth => {
            let depth = value_of("depth.Z");
            let seen = range(depth.iter().copied().filter(|&distance| distance >= 0.0));
            let near = |&distance: &f32| {
                if distance < 0.0 {
                    0.0
                } else {
                    1.0 - 0.9 * share(distance, seen)
                }
            };
            codes(depth.iter().map(|distance| [near(distance); 3]))
        }
        Aov::Object => codes(value_of("object.id").iter().map(|&id| hue(id))),
        Aov::Material => codes(value_of("material.id").iter().map(|&id| hue(id))),
        Aov::Samples | Aov::StandardError => Vec::new(),
    }
}

/// Converts the standard errors of a film's pixels to heat colours, as 8-bit codes of red, green,
/// blue and coverage. White is a standard error of a fifth of the pixel's value; grey is an unknown
/// error.
pub fn errors(film: &Film, picture: &Picture) -> Vec<u8> {
    let Some((errors, _)) = film.standard_errors() else {
        return codes(picture.rgb.iter().map(|_| [0.3; 3]));
    };
    let luminance = |rgb: &[f32; 3]| 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    codes(
        errors
            .iter()
            .zip(&picture.rgb)
            .map(|(error, rgb)| match luminance(error) {
                error if error < 0.0 => [0.3; 3],
                error => heat(5.0 * error / (luminance(rgb).max(0.0) + 0.1)),
            }),
    )
}

/// Returns the colour of a share, 0 to 1, on a scale from black over red and yellow to white.
fn heat(share: f32) -> [f32; 3] {
    let share = share.clamp(0.0, 1.0);
    [
        (3.0 * share).min(1.0),
        (3.0 * share - 1.0).clamp(0.0, 1.0),
        (3.0 * share - 2.0).clamp(0.0, 1.0),
    ]
}

fn codes(pixels: impl Iterator<Item = [f32; 3]>) -> Vec<u8> {
    pixels
        .flat_map(|[r, g, b]| [code(r), code(g), code(b), 255])
        .collect()
}

fn code(value: f32) -> u8 {
    (255.0 * value.clamp(0.0, 1.0) + 0.5) as u8
}

/// Returns the least and the greatest of the finite numbers; infinities in reverse order without
/// finite numbers.
fn range(numbers: impl Iterator<Item = f32>) -> [f32; 2] {
    let finite = numbers.filter(|number| number.is_finite());
    finite.fold(
        [f32::INFINITY, f32::NEG_INFINITY],
        |[minimum, maximum], number| [minimum.min(number), maximum.max(number)],
    )
}

fn share(number: f32, [minimum, maximum]: [f32; 2]) -> f32 {
    if maximum > minimum {
        (number - minimum) / (maximum - minimum)
    } else {
        0.0
    }
}

/// Returns the colour of an object's or material's identifier, distinct from the colours of the
/// identifiers before and after it; black for a negative identifier.
fn hue(id: f32) -> [f32; 3] {
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
        let layer = |name: &str, samples: [f32; 3]| Layer {
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
        let objects = hits(&picture, Aov::Object);
        assert_eq!((objects.len(), &objects[..4]), (12, &[0, 0, 0, 255][..]));
        let apart = |a: usize, b: usize| {
            (0..3)
                .map(|i| objects[a + i].abs_diff(objects[b + i]))
                .max()
        };
        assert!(apart(4, 8) > Some(60), "{objects:?}");
        let depth = hits(&picture, Aov::Depth);
        assert!(
            depth[0] == 0 && depth[4] > depth[8] && depth[8] > 0,
            "{depth:?}"
        );
        assert_eq!(of_hits("stderr"), None);
        assert_eq!(of_hits("normal"), Some(Aov::Normal));
        assert_eq!(colours(&picture, Display::PLAIN).len(), 12);
        assert!(heat(0.1) < heat(0.5) && heat(0.5) < heat(0.9));
    }
}
