//! A film as a header and numbers, for whoever keeps it in a file: what is written and what is read
//! go through one function, so that neither can know of a number that the other does not.

use serde::{Deserialize, Serialize};

use super::identity::Identity;
use super::sums::has_open;
use super::{Film, Plan, Rect, ReplicateBuffer};
use crate::counters::Counters;

/// What a film is of and how far it has come; its numbers come after it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmHeader {
    identity: Identity,
    plan: Plan,
    counters: Counters,
    /// Samples of each pixel that are there, tile by tile, replicate by replicate.
    drawn: Vec<u16>,
    /// How many there are to be, where they go where the error is or another film's went; else
    /// empty.
    goals: Vec<u16>,
    is_replayed: bool,
}

/// Why a header is none of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("its {0} makes no sense")]
pub struct HeaderError(&'static str);

/// Whoever takes a film's numbers, or gives them: both by changing what is handed over, or not.
pub trait Numbers {
    /// Why that failed.
    type Error;
    /// Numbers of double precision.
    fn doubles(&mut self, numbers: &mut [f64]) -> Result<(), Self::Error>;
    /// Numbers of single precision.
    fn singles(&mut self, numbers: &mut [f32]) -> Result<(), Self::Error>;
    /// Counts.
    fn counts(&mut self, counts: &mut [u16]) -> Result<(), Self::Error>;
    /// Larger whole numbers.
    fn wholes(&mut self, numbers: &mut [u32]) -> Result<(), Self::Error>;
}

impl FilmHeader {
    /// Bytes that the film and its picture will take, for a header that makes sense. Nothing else
    /// is done with one before.
    ///
    /// # Errors
    /// [`HeaderError`] names what can't be.
    pub fn bytes(&self) -> Result<u64, HeaderError> {
        self.plan.check().map_err(HeaderError)?;
        let tiles = u64::from(self.plan.tiles());
        if self.drawn.len() as u64 != tiles * u64::from(self.plan.replicates) {
            return Err(HeaderError("list of tiles"));
        }
        let has_goals = self.plan.adaptive || self.is_replayed;
        if self.goals.len() != if has_goals { self.drawn.len() } else { 0 } {
            return Err(HeaderError("map of samples"));
        }
        let all = |unit: usize| self.plan.samples_of((unit as u64 / tiles) as u32);
        let most = |unit: usize| {
            self.goals
                .get(unit)
                .map_or(all(unit), |&goal| u32::from(goal).min(all(unit)))
        };
        if self
            .drawn
            .iter()
            .enumerate()
            .any(|(unit, &drawn)| u32::from(drawn) > most(unit))
        {
            return Err(HeaderError("number of samples"));
        }
        Ok(self.plan.bytes())
    }
}

impl Film {
    /// What a file says of the film before its numbers.
    pub fn header(&self) -> FilmHeader {
        FilmHeader {
            identity: self.identity.clone(),
            plan: self.plan.clone(),
            counters: self.counters,
            drawn: self.drawn.clone(),
            goals: self.goals.clone(),
            is_replayed: self.is_replayed,
        }
    }

    /// A film whose numbers are all zero, to be filled by [`Self::pass`].
    ///
    /// # Errors
    /// See [`FilmHeader::bytes`].
    pub fn with_header(header: FilmHeader) -> Result<Self, HeaderError> {
        header.bytes()?;
        let FilmHeader {
            identity,
            plan,
            counters,
            drawn,
            goals,
            is_replayed,
        } = header;
        Ok(Self {
            counters,
            drawn,
            goals,
            is_replayed,
            ..Self::empty(identity, plan)
        })
    }

    /// Hands over all its numbers, tile by tile of each replicate and then what is there once a
    /// tile, in the order that files keep.
    ///
    /// # Errors
    /// The first of whoever takes them.
    pub fn pass<N: Numbers>(&mut self, numbers: &mut N) -> Result<(), N::Error> {
        let tiles = self.plan.tiles();
        for (replicate, tile) in
            (0..self.plan.replicates).flat_map(|r| (0..tiles).map(move |tile| (r, tile)))
        {
            if self.drawn(tile, replicate) > 0 {
                self.pass_unit(tile, replicate, numbers)?;
            }
        }
        for tile in 0..self.plan.tiles() {
            let (area, pixels) = (
                Rect::within(self.plan.tile(tile), self.plan.crop.width),
                self.plan.pixels(),
            );
            if self.plan.random
                && (0..self.plan.replicates).any(|replicate| self.drawn(tile, replicate) > 0)
            {
                self.spread.resize(pixels, [0.0; 3]);
                for row in area.rows() {
                    numbers.singles(self.spread[row].as_flattened_mut())?;
                }
            }
            if self.drawn(tile, 0) > 0 {
                self.centre
                    .resize_with(self.plan.layers.centre.len(), || vec![0.0; pixels]);
                for layer in &mut self.centre {
                    area.rows()
                        .try_for_each(|row| numbers.singles(&mut layer[row]))?;
                }
            }
        }
        Ok(())
    }

    /// One tile in one replicate.
    fn pass_unit<N: Numbers>(
        &mut self,
        tile: u32,
        replicate: u32,
        numbers: &mut N,
    ) -> Result<(), N::Error> {
        let size = self.plan.tile(tile);
        let (from, to) = (
            Rect::all(size.width, size.height),
            Rect::within(size, self.plan.crop.width),
        );
        let mut plane = self.planes[replicate as usize]
            .get_or_insert_with(|| ReplicateBuffer::zero(&self.plan))
            .cut(to);
        let open = if has_open(self.drawn(tile, replicate)) {
            plane.sums.len()
        } else {
            0
        };
        plane.open.resize(open, [0.0; 3]);
        numbers.doubles(plane.sums.as_flattened_mut())?;
        numbers.doubles(plane.open.as_flattened_mut())?;
        numbers.counts(&mut plane.samples)?;
        numbers.wholes(&mut plane.covered)?;
        numbers.wholes(&mut plane.shadowed)?;
        numbers.counts(&mut plane.first_hits)?;
        for layer in &mut plane.layers {
            numbers.doubles(layer.as_flattened_mut())?;
        }
        self.place(replicate, &plane, from, to);
        Ok(())
    }
}
