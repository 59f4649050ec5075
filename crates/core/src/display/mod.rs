//! From linear radiance to what a screen shows: exposure, tone map, transfer curve, 8-bit codes.
//!
//! Every number has a defined picture: negative radiance is black, infinite radiance is as bright as can be, and a pixel
//! with a NaN is [`NAN_MARKER`], which no scene shows by itself. The steps are computed in f64 with our own choice of
//! elementary functions, rounded once to f32 before the curve, and give the same bits on every machine.

mod agx;
mod codes;
pub mod curve;
mod matrix;
mod tone;

use rayon::prelude::*;
use raywright_bvh::scalar::Real;
use serde::{Deserialize, Serialize};

use crate::picture::Picture;
use crate::scene::{Render, ToneMap, TransferCurve};
pub use codes::CodeTable;
use tone::Operator;

/// Display values of a pixel that holds a NaN: pure magenta.
pub const NAN_MARKER: [f32; 3] = [1.0, 0.0, 1.0];

/// How linear radiance becomes display values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Display {
    /// How radiance becomes display-linear values in 0..1.
    pub tone_map: ToneMap,
    /// Curve from display-linear to stored values.
    pub curve: TransferCurve,
    /// Stops: radiance is multiplied by 2 to this power first.
    pub exposure_stops: f64,
}

impl Display {
    /// No exposure, no tone map, the sRGB curve: for pictures whose values are display-linear already.
    pub const PLAIN: Self = Self { tone_map: ToneMap::None, curve: TransferCurve::Srgb, exposure_stops: 0.0 };

    /// What a scene asks for.
    pub fn of(render: &Render) -> Self {
        Self { tone_map: render.tone_map, curve: render.gamma, exposure_stops: render.exposure }
    }

    /// The mapping of single pixels, with its tables made.
    pub fn prepare(self) -> DisplayMap {
        DisplayMap {
            tone: Operator::new(self.tone_map),
            curve: self.curve,
            factor: Real::powf(2.0_f64, self.exposure_stops),
            codes: CodeTable::new(self.curve),
        }
    }

    /// 8-bit codes of a picture, row after row from the top: three a pixel, or four where the picture has a coverage.
    ///
    /// A coverage is stored straight, as PNG wants it: colours are divided by it before they are mapped.
    pub fn to_codes(self, picture: &Picture) -> Vec<u8> {
        let map = self.prepare();
        let width = picture.width.max(1) as usize;
        if let Some(alpha) = &picture.alpha {
            let mut codes = vec![[0_u8; 4]; picture.rgb.len()];
            let rows = picture.rgb.par_chunks(width).zip(alpha.par_chunks(width));
            codes.par_chunks_mut(width).zip(rows).for_each(|(out, (rgb, alpha))| {
                for (out, (&rgb, &alpha)) in out.iter_mut().zip(rgb.iter().zip(alpha)) {
                    let [r, g, b] = map.codes(straight(rgb, alpha));
                    *out = [r, g, b, curve::quantise(f64::from(alpha).clamp(0.0, 1.0))];
                }
            });
            codes.into_flattened()
        } else {
            let mut codes = vec![[0_u8; 3]; picture.rgb.len()];
            codes.par_chunks_mut(width).zip(picture.rgb.par_chunks(width)).for_each(|(out, rgb)| {
                for (out, &rgb) in out.iter_mut().zip(rgb) {
                    *out = map.codes(rgb);
                }
            });
            codes.into_flattened()
        }
    }

    /// The picture in display values 0..1, before they become codes; coverage and layers are left behind.
    pub fn to_values(self, picture: &Picture) -> Picture {
        let map = self.prepare();
        let rgb = picture.rgb.par_iter().map(|&rgb| map.values(rgb)).collect();
        Picture { width: picture.width, height: picture.height, rgb, alpha: None, layers: Vec::new() }
    }
}

/// Colour without the coverage that multiplies it; black where nothing is covered.
fn straight(rgb: [f32; 3], alpha: f32) -> [f32; 3] {
    if alpha > 0.0 { rgb.map(|x| x / alpha) } else { [0.0; 3] }
}

/// A [`Display`] that is ready for pixels.
#[derive(Clone, Debug)]
pub struct DisplayMap {
    tone: Operator,
    curve: TransferCurve,
    factor: f64,
    codes: CodeTable,
}

impl DisplayMap {
    /// Display values in 0..1 of linear radiance; [`NAN_MARKER`] where a channel is NaN.
    pub fn values(&self, rgb: [f32; 3]) -> [f32; 3] {
        match self.display_linear(rgb) {
            Some(linear) => linear.map(|y| curve::encode(self.curve, f64::from(y)) as f32),
            None => NAN_MARKER,
        }
    }

    /// 8-bit codes of linear radiance: floor(255 v + ½) of the display value v in f64.
    #[inline]
    pub fn codes(&self, rgb: [f32; 3]) -> [u8; 3] {
        match self.display_linear(rgb) {
            Some(linear) => linear.map(|y| self.codes.code(y)),
            None => NAN_MARKER.map(|v| curve::quantise(f64::from(v))),
        }
    }

    /// Exposed, tone-mapped and clipped to 0..1; none where a channel is NaN.
    #[inline]
    fn display_linear(&self, rgb: [f32; 3]) -> Option<[f32; 3]> {
        let exposed = rgb.map(|x| f64::from(x) * self.factor);
        if exposed.iter().any(|x| x.is_nan()) {
            return None;
        }
        // Below zero there is no light; the upper bound keeps the tone maps' fractions finite.
        let clamped = exposed.map(|x| x.clamp(0.0, f64::from(f32::MAX)));
        Some(self.tone.apply(clamped).map(|y| y.clamp(0.0, 1.0) as f32))
    }
}

#[cfg(test)]
mod tests;
