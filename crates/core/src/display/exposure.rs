//! Fraction of a picture's pixels that the display clips, see [`Clipping`], and the search for an
//! exposure that clips fewer. Both are methods of [`Display`].

use super::Display;
use crate::picture::Picture;

/// Fractions in 0..1 of a picture's pixels in which the display loses detail.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clipping {
    /// Fraction of pixels with a clipped channel: its code is 255, or so near to it that doubled
    /// radiance looks the same.
    pub clipped: f64,
    /// Fraction of pixels shown as black, though their radiance is not zero.
    pub black: f64,
    /// Fraction of pixels shown as black or nearly so, with any radiance.
    pub dark: f64,
}

/// Greatest tolerated fraction of clipped pixels, and of pixels shown as black though their
/// radiance is not zero.
pub const MOST_CLIPPED: f64 = 0.1;

/// Greatest number of pixels that are examined.
const LOOKED_AT: usize = 1 << 14;
/// Least 8-bit code of a channel that may count as clipped.
const BRIGHT: u8 = 240;
/// Largest change of the exposure, in stops.
const STOPS: i32 = 48;
/// Fraction of clipped pixels above which the objects of a file need another exposure.
const MOSTLY: f64 = 0.5;
/// Least number of stops by which objects are too dark to be discerned.
const DARK_STOPS: f64 = 6.0;
/// Greatest 8-bit code that looks black.
const DARK: u8 = 10;

impl Display {
    /// Returns the fractions of clipped and of black pixels, estimated from at most 16,384 pixels.
    /// Pixels without coverage are ignored.
    pub fn estimate_clipping(self, picture: &Picture) -> Clipping {
        self.clipping_of_colours(&sample_colours(picture, |_| true))
    }

    /// Returns a better exposure for the picture, in stops.
    /// - More than [`MOST_CLIPPED`] of the pixels are clipped: the exposure is lowered by the least
    ///   number of whole stops that clips no more than this fraction.
    /// - Otherwise, more than [`MOST_CLIPPED`] of the pixels are black though they have radiance:
    ///   the exposure is increased in the same manner.
    /// - Neither is so, or no exposure suffices: `None`.
    ///
    /// In a picture with the layer `object.id`, pixels of objects alone count.
    pub fn find_unclipped_exposure(self, picture: &Picture) -> Option<f64> {
        let objects = picture.layer("object.id");
        let has_object = |i: usize| objects.is_none_or(|layer| layer.samples[i] >= 0.0);
        self.unclipped_exposure_of(&sample_colours(picture, has_object))
    }

    /// Returns a better exposure for pixels of these colours, as
    /// [`Display::find_unclipped_exposure`] does.
    pub fn unclipped_exposure_of(self, colours: &[[f32; 3]]) -> Option<f64> {
        let share = |stops: f64| {
            Self {
                exposure_stops: stops,
                ..self
            }
            .clipping_of_colours(colours)
        };
        let own = share(self.exposure_stops);
        let (step, of): (f64, fn(Clipping) -> f64) = match own {
            Clipping { clipped, .. } if clipped > MOST_CLIPPED => (-1.0, |share| share.clipped),
            Clipping { black, .. } if black > MOST_CLIPPED => (1.0, |share| share.black),
            _ => return None,
        };
        (1..=STOPS)
            .map(|steps| self.exposure_stops + step * f64::from(steps))
            .find(|&stops| of(share(stops)) <= MOST_CLIPPED)
    }

    /// Returns the exposure in stops for objects whose file states no exposure, given the colours of
    /// their lit pixels: [`exposure_of_brightest_tenth`], if most of the pixels are clipped, or hardly
    /// any pixel is bright enough to be discerned. `None` if the exposure of the settings serves.
    pub fn find_exposure_of_objects(self, colours: &[[f32; 3]]) -> Option<f64> {
        let stops = exposure_of_brightest_tenth(colours)?;
        let is_off = self.clipping_of_colours(colours).clipped > MOSTLY
            || stops - self.exposure_stops >= DARK_STOPS;
        is_off.then_some(stops)
    }

    /// Returns the fractions of clipped and of black colours.
    fn clipping_of_colours(self, colours: &[[f32; 3]]) -> Clipping {
        let map = self.build_map();
        let (mut clipped, mut black, mut dark) = (0, 0, 0);
        for &colour in colours {
            let codes = map.codes(colour);
            // The doubled radiance is evaluated for bright pixels only.
            let bright = codes.iter().any(|&code| code >= BRIGHT);
            let spent = || is_saturated(codes, map.codes(colour.map(|channel| 2.0 * channel)));
            clipped += usize::from(bright && (codes.contains(&255) || spent()));
            black += usize::from(codes == [0; 3] && colour.iter().any(|&channel| channel > 0.0));
            dark += usize::from(codes.iter().all(|&code| code <= DARK));
        }
        let [clipped, black, dark] =
            [clipped, black, dark].map(|count| count as f64 / colours.len().max(1) as f64);
        Clipping {
            clipped,
            black,
            dark,
        }
    }
}

/// Returns the number of whole stops that shows the brightest tenth of the pixels from a radiance of
/// about 1 on, given the colours of the pixels; `None` without pixels or light.
pub fn exposure_of_brightest_tenth(colours: &[[f32; 3]]) -> Option<f64> {
    let brightest = |colour: &[f32; 3]| colour.iter().copied().fold(0.0, f32::max);
    let mut levels: Vec<f32> = colours.iter().map(brightest).collect();
    levels.sort_unstable_by(f32::total_cmp);
    let bright = *levels.get((levels.len() as f64 * (1.0 - MOST_CLIPPED)) as usize)?;
    Some(-libm::log2(f64::from(bright)).round()).filter(|stops| stops.is_finite())
}

/// Whether a bright channel hardly changes its code when its radiance is doubled; `doubled` holds
/// the codes at doubled radiance. Tone maps approach code 255 without reaching it.
fn is_saturated(codes: [u8; 3], doubled: [u8; 3]) -> bool {
    const SAME: u8 = 3;
    codes
        .iter()
        .zip(doubled)
        .any(|(&code, doubled)| code >= BRIGHT && code.abs_diff(doubled) < SAME)
}

/// Returns the colours of pixels spread evenly over the picture. Pixels without coverage and those
/// that do not count are omitted.
fn sample_colours(picture: &Picture, counts: impl Fn(usize) -> bool) -> Vec<[f32; 3]> {
    let step = picture.rgb.len() / LOOKED_AT + 1;
    let colour = |i: usize| picture.surface_colour(i);
    (0..picture.rgb.len())
        .step_by(step)
        .filter(|&i| counts(i))
        .filter_map(colour)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::PictureLayer;

    fn picture(rgb: Vec<[f32; 3]>, alpha: Option<Vec<f32>>) -> Picture {
        Picture {
            width: rgb.len() as u32,
            height: 1,
            rgb,
            alpha,
            ..Picture::default()
        }
    }

    /// Protects: a picture that is n stops too bright or too dark gets an exposure changed by n, a
    /// well exposed picture keeps its own, and a picture that no exposure corrects gets none.
    #[test]
    fn exposures_undo_what_is_too_much() {
        let display = Display::PLAIN;
        let at =
            |level: f32| display.find_unclipped_exposure(&picture(vec![[level; 3]; 100], None));
        assert_eq!(at(0.5), None);
        assert_eq!(at(3.9), Some(-2.0));
        assert_eq!(at(1e-4), Some(1.0));
        assert_eq!(
            Display {
                exposure_stops: 2.0,
                ..display
            }
            .find_unclipped_exposure(&picture(vec![[1.5; 3]; 9], None)),
            Some(-1.0)
        );
        assert_eq!(at(f32::INFINITY), None);
        assert_eq!(at(0.0), None);
        // Pixels without light are no loss.
        let unlit = display.estimate_clipping(&picture(vec![[0.0; 3], [0.5; 3]], None));
        assert_eq!((unlit.black, unlit.clipped), (0.0, 0.0));
        assert_eq!(
            display.find_unclipped_exposure(&picture(Vec::new(), None)),
            None
        );
    }

    /// Protects: a tone map that approaches white without reaching it counts as clipping, too;
    /// evenly lit white paper does not.
    #[test]
    fn nearly_white_is_clipped() {
        use crate::scene::ToneMap;
        for tone_map in [ToneMap::KhronosNeutral, ToneMap::Agx, ToneMap::AcesHill] {
            let share = |level: f32| {
                Display {
                    tone_map,
                    ..Display::PLAIN
                }
                .estimate_clipping(&picture(vec![[level; 3]; 9], None))
                .clipped
            };
            assert_eq!([share(0.8), share(100.0)], [0.0, 1.0], "{tone_map:?}");
        }
        // A single channel suffices, as at the greatest code.
        let tinted = picture(vec![[2.6, 2.2, 2.0]; 9], None);
        assert_eq!(
            Display {
                tone_map: ToneMap::KhronosNeutral,
                ..Display::PLAIN
            }
            .estimate_clipping(&tinted)
            .clipped,
            1.0
        );
    }

    /// Protects: objects lit by a sun of any strength are shown at a radiance of about 1, and dark
    /// objects too; a few clipped pixels, a dim picture and one without light keep their exposure.
    #[test]
    fn objects_get_the_exposure_of_their_brightest_tenth() {
        let display = Display {
            tone_map: crate::scene::ToneMap::KhronosNeutral,
            ..Display::PLAIN
        };
        let at = |level: f32| {
            let ramp = (0..100)
                .map(|i| [level * (i as f32 + 1.0) / 91.0; 3])
                .collect::<Vec<_>>();
            display.find_exposure_of_objects(&ramp)
        };
        for (level, stops) in [
            (2049.0, -11.0),
            (68_300.0, -16.0),
            (1e9, -30.0),
            (1e-3, 10.0),
        ] {
            assert_eq!(at(level), Some(stops), "{level}");
        }
        assert_eq!([1.0, 2.0, 0.1, 0.03, 0.0].map(at), [None; 5]);
        assert_eq!(at(f32::INFINITY), None);
        assert_eq!(display.find_exposure_of_objects(&[]), None);
        let lamps = [vec![[0.5; 3]; 60], vec![[1e4; 3]; 40]].concat();
        assert_eq!(display.find_exposure_of_objects(&lamps), None);
    }

    /// Protects: where a film holds the objects of its pixels, `merge` and `denoise` choose the
    /// exposure from objects, however bright or black the background.
    #[test]
    fn backgrounds_do_not_change_the_exposure() {
        for background in [0.0, 1e-5, 50.0] {
            let mut picture = picture(
                [vec![[background; 3]; 90], vec![[3.9; 3]; 10]].concat(),
                None,
            );
            let samples = [vec![-1.0; 90], vec![0.0; 10]].concat();
            picture.layers = vec![PictureLayer {
                name: "object.id".to_owned(),
                samples,
            }];
            let exposure = Display::PLAIN.find_unclipped_exposure(&picture);
            assert_eq!(exposure, Some(-2.0), "{background}");
        }
    }

    /// Protects: uncovered pixels are ignored, and a partly covered pixel counts with its own
    /// colour.
    #[test]
    fn empty_pixels_are_left_aside() {
        let rgb = vec![[0.0; 3], [0.0; 3], [0.4; 3], [0.9; 3]];
        let picture = picture(rgb, Some(vec![0.0, 0.0, 0.2, 1.0]));
        assert_eq!(
            Display::PLAIN.estimate_clipping(&picture),
            Clipping {
                clipped: 0.5,
                ..Clipping::default()
            }
        );
    }
}
