//! Skies by formula, as equirectangular pictures that need no file: a photographer's studio, whose
//! soft boxes metals reflect, and a landscape under the sun.

use core::f64::consts::{PI, TAU};
use std::sync::{Arc, LazyLock};

use glam::DVec3;

use crate::camera::direction_from_angles;
use crate::noise::fbm2;
use crate::scene::{ImageData, PixelData};

/// A sky by formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SkyPicture {
    /// A room with dark walls, a lighter floor and ceiling, and soft boxes: key light to the left
    /// of the camera, fill light to the right, and rim lights behind the model. The camera stands
    /// at +z. This is the light of the default studio.
    Studio,
    /// A blue sky with thin clouds, a sun of 2.5° at 42° above the horizon, hills and a bare ground.
    Outdoor,
}

impl SkyPicture {
    /// Returns the picture. It is computed once in a process.
    pub fn image(self) -> Arc<ImageData> {
        static STUDIO: LazyLock<Arc<ImageData>> = LazyLock::new(|| {
            let boxes = SOFT_BOXES.each_ref().map(SoftBoxFrame::new);
            draw_sky(SkyPicture::Studio.size(), |d| {
                DVec3::splat(studio_radiance(&boxes, d))
            })
        });
        static OUTDOOR: LazyLock<Arc<ImageData>> =
            LazyLock::new(|| draw_sky(SkyPicture::Outdoor.size(), outdoor_radiance));
        Arc::clone(match self {
            Self::Studio => &STUDIO,
            Self::Outdoor => &OUTDOOR,
        })
    }

    /// Returns the width and height in pixels. The edge of a soft box is eight pixels wide.
    pub(crate) const fn size(self) -> [u32; 2] {
        match self {
            Self::Studio => [512, 256],
            Self::Outdoor => [1024, 512],
        }
    }
}

/// Draws a sky by its radiance along unit directions. Colours are rounded to RGBE, which the
/// renderer reads in a quarter of the bytes.
fn draw_sky([width, height]: [u32; 2], radiance: impl Fn(DVec3) -> DVec3) -> Arc<ImageData> {
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for row in 0..height {
        let polar = PI * (f64::from(row) + 0.5) / f64::from(height);
        let (ring, y) = (libm::sin(polar), libm::cos(polar));
        for column in 0..width {
            let azimuth = TAU * ((f64::from(column) + 0.5) / f64::from(width) - 0.5);
            let d = DVec3::new(ring * libm::cos(azimuth), y, ring * libm::sin(azimuth));
            let [r, g, b] = round_to_rgbe(radiance(d).to_array().map(|channel| channel as f32));
            pixels.push([r, g, b, 1.0]);
        }
    }
    Arc::new(ImageData {
        width,
        height,
        pixels: PixelData::Linear(pixels),
    })
}

/// Rounds a colour above zero to mantissas of eight bits with a common exponent.
fn round_to_rgbe(colour: [f32; 3]) -> [f32; 3] {
    let largest = colour.into_iter().fold(0.0, f32::max);
    let unit = f32::from_bits((largest.to_bits() >> 23).saturating_sub(7) << 23);
    colour.map(|channel| (channel / unit).round().min(255.0) * unit)
}

/// Returns 0 up to `low`, 1 from `high` on, and a smooth cubic in between.
fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A soft box of the studio: a rectangle of light far away.
struct SoftBox {
    /// Azimuth in degrees, to the right of the camera as seen from the model.
    azimuth: f64,
    /// Elevation above the horizon in degrees.
    elevation: f64,
    /// Half of its width and of its height in degrees, as seen from the model.
    half_size: [f64; 2],
    /// Mean radiance.
    radiance: f64,
}

/// Key light, fill light and two rim lights. Smaller and brighter boxes make sharper highlights and
/// more noise. Room and boxes light white surfaces as three soft lobes over a gradient did, within
/// an eighth for any normal.
const SOFT_BOXES: [SoftBox; 4] = [
    SoftBox {
        azimuth: -42.0,
        elevation: 42.0,
        half_size: [24.0, 28.0],
        radiance: 2.3,
    },
    SoftBox {
        azimuth: 60.0,
        elevation: 18.0,
        half_size: [22.0, 36.0],
        radiance: 0.75,
    },
    SoftBox {
        azimuth: 155.0,
        elevation: 36.0,
        half_size: [14.0, 30.0],
        radiance: 2.5,
    },
    SoftBox {
        azimuth: -115.0,
        elevation: 20.0,
        half_size: [8.0, 34.0],
        radiance: 0.8,
    },
];

/// Radiance of the studio's walls.
const WALL: f64 = 0.13;
/// Radiance of the studio's ceiling at the zenith.
const CEILING: f64 = 0.45;
/// Radiance of the studio's floor at the nadir.
const FLOOR: f64 = 0.25;

/// A soft box with its axes in the world.
struct SoftBoxFrame {
    front: DVec3,
    right: DVec3,
    up: DVec3,
    light: &'static SoftBox,
}

impl SoftBoxFrame {
    fn new(light: &'static SoftBox) -> Self {
        let azimuth = light.azimuth.to_radians();
        let front = direction_from_angles(azimuth, light.elevation.to_radians());
        let right = direction_from_angles(azimuth + 0.5 * PI, 0.0);
        Self {
            front,
            right,
            up: front.cross(right),
            light,
        }
    }

    /// Returns the radiance along a unit direction: a fifth brighter in the middle than in the
    /// corners, with soft edges.
    fn radiance(&self, d: DVec3) -> f64 {
        /// Half the width of an edge in degrees.
        const EDGE: f64 = 3.0;
        let ahead = d.dot(self.front);
        if ahead <= 0.0 {
            return 0.0;
        }
        let [x, y] = [(self.right, 0), (self.up, 1)].map(|(axis, side)| {
            let half = self.light.half_size[side];
            let edge = EDGE / half;
            let place = (d.dot(axis) / ahead).abs() / libm::tan(half.to_radians());
            (place, 1.0 - smoothstep(1.0 - edge, 1.0 + edge, place))
        });
        let falloff = 1.1 - 0.1 * (x.0 * x.0 + y.0 * y.0).min(2.0);
        self.light.radiance * falloff * x.1 * y.1
    }
}

fn studio_radiance(boxes: &[SoftBoxFrame], d: DVec3) -> f64 {
    let room = WALL
        + (CEILING - WALL) * smoothstep(0.05, 0.9, d.y)
        + (FLOOR - WALL) * smoothstep(0.05, 0.75, -d.y);
    room + boxes.iter().map(|light| light.radiance(d)).sum::<f64>()
}

/// Radiance of the landscape. The numbers are chosen by eye, so that a white surface that faces the
/// sun is just below white at exposure 0.
fn outdoor_radiance(d: DVec3) -> DVec3 {
    let sun = direction_from_angles(f64::to_radians(-25.0), f64::to_radians(42.0));
    let haze = DVec3::new(0.72, 0.82, 0.94);
    let height = d.y.max(0.0);
    let zenith = DVec3::new(0.13, 0.27, 0.62);
    let blue = zenith.lerp(haze, libm::pow(1.0 - height, 5.0));
    let cosine = d.dot(sun).max(0.0);
    let glow = 0.35 * libm::pow(cosine, 64.0) + 0.12 * libm::pow(cosine, 8.0);
    let disc = smoothstep(
        libm::cos(f64::to_radians(1.5)),
        libm::cos(f64::to_radians(1.0)),
        cosine,
    );
    let sunlight = DVec3::new(1.0, 0.94, 0.84);
    // Clouds lie in a plane overhead.
    let [across, along] = [d.x, d.z].map(|side| 1.6 * side / (height + 0.15));
    let thickness = smoothstep(-0.05, 0.7, fbm2(across, along, 5)) * smoothstep(0.03, 0.25, height);
    let cloud = DVec3::splat(0.9) + sunlight * (0.6 * glow);
    let sky = (blue + sunlight * glow).lerp(cloud, 0.8 * thickness)
        + sunlight * (1500.0 * disc * (1.0 - 0.5 * thickness));
    let ring = (1.0 - d.y * d.y).max(1e-18).sqrt();
    let ridge = 0.045 + 0.04 * fbm2(3.0 * d.x / ring, 3.0 * d.z / ring, 5);
    let hills = DVec3::new(0.11, 0.15, 0.12);
    let ground = DVec3::new(0.21, 0.19, 0.16).lerp(
        DVec3::new(0.3, 0.31, 0.27),
        libm::pow(1.0 - (-d.y).clamp(0.0, 1.0), 12.0),
    );
    let land = ground.lerp(hills, smoothstep(-0.01, 0.01, d.y));
    land.lerp(sky, smoothstep(-0.012, 0.012, d.y - ridge))
}

#[cfg(test)]
mod tests;
