//! Storage of a film in a file: a header, then numbers. Reading and writing share one function:
//! they cannot disagree on the order of the numbers.

use serde::{Deserialize, Serialize};

use super::identity::FilmIdentity;
use super::sums::has_partial_block;
use super::{Film, FilmPlan, Rect, ReplicateBuffer};
use crate::counters::Counters;

/// Header of a stored film: identity of the picture, plan of tiles and samples, and progress. The
/// film's sums and layers follow in the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmHeader {
    identity: FilmIdentity,
    plan: FilmPlan,
    counters: Counters,
    /// Samples per pixel so far, for each replicate and tile.
    drawn: Vec<u16>,
    /// Samples per pixel at the end of the current round. Empty unless the counts are adaptive or
    /// repeat those of another film.
    goals: Vec<u16>,
    is_replayed: bool,
}

/// Error: the header of a film is invalid. The message names the invalid part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the {0} in the header of the film is invalid: the file is damaged; restore it from a copy or render the film again"
)]
pub struct FilmHeaderError(&'static str);

/// Stream that reads or writes a film's numbers. Each method gets a slice of numbers. A reader
/// overwrites the slice with numbers from the stream. A writer copies the slice to the stream and
/// leaves the slice unchanged.
pub trait FilmDataStream {
    /// Error of the reader or writer.
    type Error;
    /// Reads or writes `f64` numbers.
    fn transfer_f64(&mut self, numbers: &mut [f64]) -> Result<(), Self::Error>;
    /// Reads or writes `f32` numbers.
    fn transfer_f32(&mut self, numbers: &mut [f32]) -> Result<(), Self::Error>;
    /// Reads or writes 16-bit counts.
    fn transfer_u16(&mut self, counts: &mut [u16]) -> Result<(), Self::Error>;
    /// Reads or writes 32-bit integers.
    fn transfer_u32(&mut self, numbers: &mut [u32]) -> Result<(), Self::Error>;
}

impl FilmHeader {
    /// Validates the header, and returns the bytes of memory of the film and its picture. A header
    /// must be validated before any other use.
    ///
    /// # Errors
    /// [`FilmHeaderError`] names the invalid part.
    pub fn bytes(&self) -> Result<u64, FilmHeaderError> {
        self.plan.validate().map_err(FilmHeaderError)?;
        let tiles = u64::from(self.plan.tile_count());
        if self.drawn.len() as u64 != tiles * u64::from(self.plan.replicates) {
            return Err(FilmHeaderError("list of tiles"));
        }
        let has_goals = self.plan.adaptive || self.is_replayed;
        if self.goals.len() != if has_goals { self.drawn.len() } else { 0 } {
            return Err(FilmHeaderError("list of sample counts"));
        }
        let all = |unit: usize| self.plan.replicate_samples((unit as u64 / tiles) as u32);
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
            return Err(FilmHeaderError("number of samples"));
        }
        Ok(self.plan.bytes())
    }
}

impl Film {
    /// Returns the header, to be written before the film's numbers.
    pub fn header(&self) -> FilmHeader {
        FilmHeader {
            identity: self.identity.clone(),
            plan: self.plan.clone(),
            counters: self.counters,
            drawn: self.samples_drawn.clone(),
            goals: self.sample_goals.clone(),
            is_replayed: self.is_replayed,
        }
    }

    /// Returns a film of zeros for a header. [`Self::transfer_data`] fills the film.
    ///
    /// # Errors
    /// See [`FilmHeader::bytes`].
    pub fn from_header(header: FilmHeader) -> Result<Self, FilmHeaderError> {
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
            samples_drawn: drawn,
            sample_goals: goals,
            is_replayed,
            ..Self::new_empty(identity, plan)
        })
    }

    /// Reads or writes all numbers of the film, in the order of the file. The sums of each
    /// replicate and tile come first. The data of each tile that exist only once follow.
    ///
    /// # Errors
    /// The first error of the reader or writer.
    pub fn transfer_data<N: FilmDataStream>(&mut self, numbers: &mut N) -> Result<(), N::Error> {
        let tiles = self.plan.tile_count();
        for (replicate, tile) in
            (0..self.plan.replicates).flat_map(|r| (0..tiles).map(move |tile| (r, tile)))
        {
            if self.samples_drawn(tile, replicate) > 0 {
                self.transfer_tile_sums(tile, replicate, numbers)?;
            }
        }
        for tile in 0..self.plan.tile_count() {
            let (area, pixels) = (
                Rect::for_film_tile(self.plan.tile_rect(tile), self.plan.crop.width),
                self.plan.pixel_count(),
            );
            if self.plan.random
                && (0..self.plan.replicates)
                    .any(|replicate| self.samples_drawn(tile, replicate) > 0)
            {
                self.spread.resize(pixels, [0.0; 3]);
                for row in area.row_ranges() {
                    numbers.transfer_f32(self.spread[row].as_flattened_mut())?;
                }
            }
            if self.samples_drawn(tile, 0) > 0 {
                self.centre_layers
                    .resize_with(self.plan.layers.centre.len(), || vec![0.0; pixels]);
                for layer in &mut self.centre_layers {
                    area.row_ranges()
                        .try_for_each(|row| numbers.transfer_f32(&mut layer[row]))?;
                }
            }
        }
        Ok(())
    }

    /// Reads or writes the sums of one tile in one replicate.
    fn transfer_tile_sums<N: FilmDataStream>(
        &mut self,
        tile: u32,
        replicate: u32,
        numbers: &mut N,
    ) -> Result<(), N::Error> {
        let size = self.plan.tile_rect(tile);
        let (from, to) = (
            Rect::for_whole_buffer(size.width, size.height),
            Rect::for_film_tile(size, self.plan.crop.width),
        );
        let mut buffer = self.buffers[replicate as usize]
            .get_or_insert_with(|| ReplicateBuffer::zeroed(&self.plan))
            .extract_rect(to);
        let open = if has_partial_block(self.samples_drawn(tile, replicate)) {
            buffer.sums.len()
        } else {
            0
        };
        buffer.partial_blocks.resize(open, [0.0; 3]);
        numbers.transfer_f64(buffer.sums.as_flattened_mut())?;
        numbers.transfer_f64(buffer.partial_blocks.as_flattened_mut())?;
        numbers.transfer_u16(&mut buffer.samples)?;
        numbers.transfer_u32(&mut buffer.covered)?;
        numbers.transfer_u32(&mut buffer.shadowed)?;
        numbers.transfer_u16(&mut buffer.first_hits)?;
        for layer in &mut buffer.layers {
            numbers.transfer_f64(layer.as_flattened_mut())?;
        }
        self.copy_buffer_into_film(replicate, &buffer, from, to);
        Ok(())
    }
}
