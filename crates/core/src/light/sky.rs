//! The sky: radiance by direction.

mod gradient;
mod map;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::shapes::equirectangular_coordinates;
use raywright_bvh::{Real, Vector};

use crate::expr::{ExprScope, ProgramTable, VariableValues, compile};
use crate::lookup::SceneLookup;
use crate::prepare::PrepareError;
use crate::scene::{ColourInput, ImageData, PixelData, Sky as SkyData};

/// Radiance of a prepared sky by direction, for rays that hit nothing.
#[derive(Clone, Debug)]
pub struct SkyRadiance<R: Real> {
    pub(super) kind: SkyKind<R>,
}

pub(super) use gradient::{GradientSky, SunLobe};
pub(super) use map::EquirectMap;

/// Number of directions evaluated side by side.
const LANES: usize = 16;

/// Components of a batch of directions.
type DirectionBatch<R> = [[R; LANES]; 3];

/// Radiance of the sky along one ray, with the coordinates of the ray's direction in the sky's
/// image.
#[derive(Clone, Copy, Debug)]
pub struct SkySample<R: Real> {
    /// Coordinates of the ray's direction in the sky's image, each in [0, 1], see
    /// [`SkyRadiance::image_coordinates`].
    pub image_coordinates: [R; 2],
    /// Radiance.
    pub radiance: R::Vec3,
}

#[derive(Clone, Debug)]
pub(super) enum SkyKind<R: Real> {
    /// No sky: black.
    Black,
    Constant(R::Vec3),
    Gradient(GradientSky<R>),
    /// The program of an expression, and the origin of storage coordinates in the scene's
    /// coordinates.
    Expression(ProgramTable<R>, R::Vec3),
    Map(EquirectMap<R>),
}

/// Prepares the sky of a scene; black if the scene has no sky. `seen_from` is the storage origin,
/// to which the origins of rays are relative.
pub(crate) fn prepare_sky_radiance<R: Real>(
    (sky, seen_from): (Option<&SkyData>, DVec3),
    lookup: &SceneLookup<'_>,
    names: &BTreeMap<String, f64>,
) -> Result<SkyRadiance<R>, PrepareError> {
    let v = |c: crate::scene::Colour| R::Vec3::from_f64(c.0.into());
    let kind = match sky {
        None => SkyKind::Black,
        Some(SkyData::Constant(c)) => SkyKind::Constant(v(*c)),
        Some(SkyData::Gradient { bottom, top, suns }) => {
            let suns = suns.iter().map(|s| SunLobe {
                direction: R::Vec3::from_f64(DVec3::from(s.direction).normalize()),
                colour: R::Vec3::from_f64(DVec3::from(s.colour.0) * s.weight),
                exponent: s.exponent,
            });
            SkyKind::Gradient(GradientSky {
                bottom: v(*bottom),
                top: v(*top),
                suns: suns.collect(),
            })
        }
        Some(SkyData::Expression(ColourInput::Expression(text))) => {
            let failed = |source| PrepareError::Expression {
                path: "sky.expression".to_owned(),
                source,
            };
            let programs =
                ProgramTable::from_program(&compile(text, names, ExprScope::Sky).map_err(failed)?);
            SkyKind::Expression(programs, R::Vec3::from_f64(seen_from))
        }
        Some(SkyData::Expression(ColourInput::Constant(c))) => SkyKind::Constant(v(*c)),
        Some(SkyData::Expression(ColourInput::Texture(_) | ColourInput::Checker(_))) => {
            return Err(PrepareError::NoSurface {
                path: "sky.expression".to_owned(),
            });
        }
        // Studio lights stand around a camera: preparation replaces them by a picture.
        Some(SkyData::Studio(_)) => SkyKind::Black,
        Some(SkyData::Map(map)) => {
            let image = lookup.image(&map.image);
            let missing = || PrepareError::Missing {
                path: "sky.map.image".to_owned(),
                kind: "image",
                name: map.image.clone(),
            };
            match &image.ok_or_else(missing)?.data {
                Some(image) => {
                    let turn = map.rotation / 360.0;
                    return Ok(SkyRadiance::from_picture(
                        Arc::clone(image),
                        turn,
                        map.strength,
                    ));
                }
                None => SkyKind::Black,
            }
        }
    };
    Ok(SkyRadiance { kind })
}

impl<R: Real> SkyRadiance<R> {
    /// A sky without light.
    pub(crate) const BLACK: Self = Self {
        kind: SkyKind::Black,
    };

    /// Creates the sky of an equirectangular picture. `turn` is its rotation about +y in
    /// revolutions, `strength` a factor on its radiance.
    pub(crate) fn from_picture(image: Arc<ImageData>, turn: f64, strength: f64) -> Self {
        let map = EquirectMap::new(image, R::from_f64(turn), R::from_f64(strength));
        Self {
            kind: SkyKind::Map(map),
        }
    }

    /// Whether the sky is black.
    pub fn is_black(&self) -> bool {
        matches!(self.kind, SkyKind::Black)
    }

    /// Returns the image of the sky, if any.
    pub(crate) fn image(&self) -> Option<&Arc<ImageData>> {
        if let SkyKind::Map(map) = &self.kind {
            Some(&map.image)
        } else {
            None
        }
    }

    /// Bytes of the tables besides the image.
    pub(crate) fn bytes(&self) -> u64 {
        if let SkyKind::Map(map) = &self.kind {
            size_of_val(map.packed_texels.as_slice()) as u64
        } else {
            0
        }
    }

    /// Returns the coordinates of a unit direction in the sky's image, each in [0, 1]; zero without
    /// an image. Radiance and density of the same direction reuse these coordinates.
    #[inline(always)]
    pub fn image_coordinates(&self, d: R::Vec3) -> [R; 2] {
        if let SkyKind::Map(_) = &self.kind {
            equirectangular_coordinates::<R>(d)
        } else {
            [R::ZERO; 2]
        }
    }

    /// Returns the radiance along the unit direction `d` from an origin.
    #[inline(always)]
    pub fn radiance(&self, origin: R::Vec3, d: R::Vec3) -> R::Vec3 {
        self.radiance_at(origin, d, self.image_coordinates(d))
    }

    /// Appends the radiance and image coordinates of many rays in order. Each ray is an origin and
    /// a unit direction. Faster than single calls.
    pub fn eval_rays(
        &self,
        rays: impl Iterator<Item = (R::Vec3, R::Vec3)>,
        out: &mut Vec<SkySample<R>>,
    ) {
        match &self.kind {
            SkyKind::Map(map) => map.eval_directions(rays.map(|(_, d)| d), out),
            SkyKind::Gradient(gradient) if R::IS_SINGLE => {
                gradient.eval_directions(rays.map(|(_, d)| d), out)
            }
            _ => out.extend(rays.map(|(origin, d)| SkySample {
                image_coordinates: [R::ZERO; 2],
                radiance: self.radiance(origin, d),
            })),
        }
    }

    /// Returns the radiance of [`Self::radiance`]. `place` holds the image coordinates of the
    /// direction `d`.
    #[inline(always)]
    pub fn radiance_at(&self, origin: R::Vec3, d: R::Vec3, place: [R; 2]) -> R::Vec3 {
        match &self.kind {
            SkyKind::Black => R::Vec3::ZERO,
            SkyKind::Constant(c) => *c,
            SkyKind::Gradient(gradient) => gradient.radiance::<R>(d),
            SkyKind::Expression(programs, zero) => programs.eval_vector(
                0,
                &VariableValues::<R> {
                    d,
                    o: origin + *zero,
                    ..VariableValues::default()
                },
            ),
            SkyKind::Map(map) => map.radiance(place),
        }
    }
}

/// Calls `look` with each batch of directions and the number of directions in it. The other lanes
/// of the last batch are meaningless.
fn for_each_direction_batch<R: Real>(
    directions: impl Iterator<Item = R::Vec3>,
    mut look: impl FnMut(&DirectionBatch<R>, usize),
) {
    let mut directions = directions.fuse();
    loop {
        let mut batch = [[R::ZERO; LANES]; 3];
        let mut count = 0;
        for (i, d) in (0..LANES).zip(&mut directions) {
            [batch[0][i], batch[1][i], batch[2][i]] = [d.x(), d.y(), d.z()];
            count += 1;
        }
        if count == 0 {
            return;
        }
        look(&batch, count);
    }
}

/// Returns the greatest number of bytes of a sky's tables, besides the image itself.
pub(crate) fn max_sky_table_bytes(image: &Arc<ImageData>) -> u64 {
    if let PixelData::Linear(pixels) = &image.pixels {
        (pixels.len() * size_of::<u32>()) as u64
    } else {
        0
    }
}

#[cfg(test)]
mod tests;
