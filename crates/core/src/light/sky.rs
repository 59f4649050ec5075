//! The sky: radiance by direction.

mod gradient;
mod map;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::shapes::equirectangular;
use raywright_bvh::{Real, Vector};

use crate::expr::{Inputs, Programs, Scope, compile};
use crate::lookup::Lookup;
use crate::prepare::PrepareError;
use crate::scene::{ColourInput, ImageData, Pixels, Sky as SkyData};

/// What a ray sees that hits nothing.
#[derive(Clone, Debug)]
pub struct SkyRadiance<R: Real> {
    pub(super) kind: SkyKind<R>,
}

pub(super) use gradient::{Gradient, SunLobe};
pub(super) use map::Map;

/// Directions that are looked along side by side.
const LANES: usize = 16;

/// Their components.
type Directions<R> = [[R; LANES]; 3];

/// What a ray sees of the sky.
#[derive(Clone, Copy, Debug)]
pub struct SkySample<R: Real> {
    /// Where that lies in its picture: see [`SkyRadiance::place`].
    pub place: [R; 2],
    /// Radiance.
    pub radiance: R::Vec3,
}

#[derive(Clone, Debug)]
pub(super) enum SkyKind<R: Real> {
    /// No sky: black.
    None,
    Constant(R::Vec3),
    Gradient(Gradient<R>),
    /// Of one program, and what origins of rays are counted from.
    Expression(Programs<R>, R::Vec3),
    Map(Map<R>),
}

/// The sky of a scene whose coordinates are counted from an origin, black where it has none.
pub(crate) fn prepare<R: Real>(
    (sky, seen_from): (Option<&SkyData>, DVec3),
    lookup: &Lookup<'_>,
    names: &BTreeMap<String, f64>,
) -> Result<SkyRadiance<R>, PrepareError> {
    let v = |c: crate::scene::Colour| R::Vec3::from_f64(c.0.into());
    let kind = match sky {
        None => SkyKind::None,
        Some(SkyData::Constant(c)) => SkyKind::Constant(v(*c)),
        Some(SkyData::Gradient { bottom, top, suns }) => {
            let suns = suns.iter().map(|s| SunLobe {
                direction: R::Vec3::from_f64(DVec3::from(s.direction).normalize()),
                colour: R::Vec3::from_f64(DVec3::from(s.colour.0) * s.weight),
                exponent: s.exponent,
            });
            SkyKind::Gradient(Gradient {
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
            let programs = Programs::of(&compile(text, names, Scope::Sky).map_err(failed)?);
            SkyKind::Expression(programs, R::Vec3::from_f64(seen_from))
        }
        Some(SkyData::Expression(ColourInput::Constant(c))) => SkyKind::Constant(v(*c)),
        Some(SkyData::Expression(ColourInput::Texture(_) | ColourInput::Checker(_))) => {
            return Err(PrepareError::NoSurface {
                path: "sky.expression".to_owned(),
            });
        }
        // Its lights stand about a camera: preparation puts them in its place.
        Some(SkyData::Studio(_)) => SkyKind::None,
        Some(SkyData::Map(map)) => {
            let image = lookup.image(&map.image);
            let missing = || PrepareError::Missing {
                path: "sky.map.image".to_owned(),
                kind: "image",
                name: map.image.clone(),
            };
            match &image.ok_or_else(missing)?.data {
                Some(image) => SkyKind::Map(Map::new(
                    Arc::clone(image),
                    R::from_f64(map.rotation / 360.0),
                    R::from_f64(map.strength),
                )),
                None => SkyKind::None,
            }
        }
    };
    Ok(SkyRadiance { kind })
}

impl<R: Real> SkyRadiance<R> {
    /// Whether it gives no light at all.
    pub fn is_black(&self) -> bool {
        matches!(self.kind, SkyKind::None)
    }

    /// The picture that it shows, if it is one.
    pub(crate) fn image(&self) -> Option<&Arc<ImageData>> {
        if let SkyKind::Map(map) = &self.kind {
            Some(&map.image)
        } else {
            None
        }
    }

    /// Bytes of what is kept besides the picture.
    pub(crate) fn bytes(&self) -> u64 {
        if let SkyKind::Map(map) = &self.kind {
            size_of_val(map.packed.as_slice()) as u64
        } else {
            0
        }
    }

    /// Where a direction lies in the sky's picture, from 0 to 1 each way; nothing of use where it
    /// is none. Told once to whoever asks there for radiance and density.
    #[inline(always)]
    pub fn place(&self, d: R::Vec3) -> [R; 2] {
        if let SkyKind::Map(_) = &self.kind {
            equirectangular::<R>(d)
        } else {
            [R::ZERO; 2]
        }
    }

    /// Radiance along a unit direction, seen from an origin.
    #[inline(always)]
    pub fn radiance(&self, origin: R::Vec3, d: R::Vec3) -> R::Vec3 {
        self.radiance_at(origin, d, self.place(d))
    }

    /// What many rays see, one after the other, with the [`Self::place`] of each: in less time than
    /// one by one.
    pub fn look(
        &self,
        rays: impl Iterator<Item = (R::Vec3, R::Vec3)>,
        out: &mut Vec<SkySample<R>>,
    ) {
        match &self.kind {
            SkyKind::Map(map) => map.look(rays.map(|(_, d)| d), out),
            SkyKind::Gradient(gradient) if R::IS_SINGLE => gradient.look(rays.map(|(_, d)| d), out),
            _ => out.extend(rays.map(|(origin, d)| SkySample {
                place: [R::ZERO; 2],
                radiance: self.radiance(origin, d),
            })),
        }
    }

    /// The same of a direction that has this [`Self::place`].
    #[inline(always)]
    pub fn radiance_at(&self, origin: R::Vec3, d: R::Vec3, place: [R; 2]) -> R::Vec3 {
        match &self.kind {
            SkyKind::None => R::Vec3::ZERO,
            SkyKind::Constant(c) => *c,
            SkyKind::Gradient(gradient) => gradient.radiance::<R>(d),
            SkyKind::Expression(programs, zero) => programs.vector(
                0,
                &Inputs::<R> {
                    d,
                    o: origin + *zero,
                    ..Inputs::default()
                },
            ),
            SkyKind::Map(map) => map.radiance(place),
        }
    }
}

/// Goes through directions as many at a time as are looked along side by side, and says how many of
/// these there are: what stands where none is left does not matter.
fn side_by_side<R: Real>(
    directions: impl Iterator<Item = R::Vec3>,
    mut look: impl FnMut(&Directions<R>, usize),
) {
    let mut directions = directions.fuse();
    loop {
        let mut these = [[R::ZERO; LANES]; 3];
        let mut count = 0;
        for (i, d) in (0..LANES).zip(&mut directions) {
            [these[0][i], these[1][i], these[2][i]] = [d.x(), d.y(), d.z()];
            count += 1;
        }
        if count == 0 {
            return;
        }
        look(&these, count);
    }
}

/// Most bytes that a sky keeps besides its picture.
pub(crate) fn packed_bytes(image: &Arc<ImageData>) -> u64 {
    if let Pixels::Linear(pixels) = &image.pixels {
        (pixels.len() * size_of::<u32>()) as u64
    } else {
        0
    }
}

#[cfg(test)]
mod tests;
