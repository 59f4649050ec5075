//! Rendering: tiles over threads, samples over pixels. Nothing here allocates or locks per ray.

use core::marker::PhantomData;
use std::sync::Mutex;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use raywright_bvh::{Precision, Ray, Real, Vec3Of};

use crate::counters::Counters;
use crate::film::{Accumulator, Film, Pixel, Tile};
use crate::integrator::{Kernel, Tracer};
use crate::picture::Picture;
use crate::prepare::Prepared;
use crate::sampler::{Address, Purpose, pair};
use crate::scene::Pattern;
use crate::settings::{Aov, Background, Crop, Sampling, Settings};

/// Watches a render and may stop it. Called by the workers, a few hundred times a picture.
pub trait Observer: Sync {
    /// So many of all pixels are finished.
    fn progress(&self, done: u64, total: u64) {
        let _ = (done, total);
    }
    /// True to stop at the next tile.
    fn cancelled(&self) -> bool {
        false
    }
}

impl Observer for () {}

/// A picture with what it took.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture; black where it was not finished.
    pub picture: Picture,
    /// Rays and samples.
    pub counters: Counters,
    /// False when the observer stopped the render.
    pub finished: bool,
}

/// Renders the cropped picture on the current thread pool.
pub(crate) fn render<P: Precision, K: Kernel>(scene: &Prepared<P>, settings: &Settings, observer: &dyn Observer) -> Rendered {
    let crop = settings.crop.unwrap_or(Crop { x: 0, y: 0, width: settings.size[0], height: settings.size[1] });
    let layers = Layers::new(&settings.aovs);
    let alpha = settings.background == Background::Transparent;
    let film = Mutex::new((Film::new(crop.width, crop.height, &layers.names(), alpha), Counters::default(), 0_u64));
    let tiles = tiles(crop, settings.tile_size);
    let total = u64::from(crop.width) * u64::from(crop.height);
    tiles.into_par_iter().for_each(|area| {
        if observer.cancelled() {
            return;
        }
        let (tile, counters) = TileJob::<P, K> { scene, settings, crop, area, layers: &layers, kernel: PhantomData }.run();
        // One lock a tile.
        let mut film = film.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        film.0.put(&tile);
        film.1 += counters;
        film.2 += u64::from(tile.width) * u64::from(tile.height);
        observer.progress(film.2, total);
    });
    let (film, counters, done) = film.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    Rendered { picture: film.picture(), counters, finished: done == total }
}

/// The tiles of a crop, row by row, in film coordinates.
fn tiles(crop: Crop, size: u32) -> Vec<Crop> {
    let size = size.max(1);
    let starts = |n: u32| (0..n).step_by(size as usize);
    let tile = |x: u32, y: u32| Crop { x, y, width: size.min(crop.width - x), height: size.min(crop.height - y) };
    starts(crop.height).flat_map(|y| starts(crop.width).map(move |x| tile(x, y))).collect()
}

/// Which layers there are, by where their numbers come from, and their names in files.
struct Layers {
    /// From the first hits of all samples.
    mean: Vec<(Aov, [&'static str; 3])>,
    /// From the first hit of the pixel-centre ray.
    centre: Vec<(Aov, &'static str)>,
    /// From the pixel's sums.
    samples: bool,
    standard_error: bool,
}

impl Layers {
    fn new(aovs: &[Aov]) -> Self {
        let mut mean = Vec::new();
        let mut centre = Vec::new();
        for &aov in aovs {
            match aov {
                Aov::Albedo => mean.push((aov, ["albedo.R", "albedo.G", "albedo.B"])),
                Aov::Normal => mean.push((aov, ["normal.X", "normal.Y", "normal.Z"])),
                Aov::Position => mean.push((aov, ["position.X", "position.Y", "position.Z"])),
                Aov::Depth => centre.push((aov, "depth.Z")),
                Aov::Object => centre.push((aov, "object.id")),
                Aov::Material => centre.push((aov, "material.id")),
                Aov::Samples | Aov::StandardError => {}
            }
        }
        let has = |aov| aovs.contains(&aov);
        Self { mean, centre, samples: has(Aov::Samples), standard_error: has(Aov::StandardError) }
    }

    fn names(&self) -> Vec<String> {
        let mean = self.mean.iter().flat_map(|(_, names)| names.iter());
        let hits = mean.chain(self.centre.iter().map(|(_, name)| name));
        let sums = self.samples.then_some(&"samples.N").into_iter();
        let error = if self.standard_error { &["stderr.R", "stderr.G", "stderr.B"][..] } else { &[] };
        hits.chain(sums).chain(error).map(|&name| name.to_owned()).collect()
    }
}

/// One tile's work.
struct TileJob<'a, P: Precision, K: Kernel> {
    scene: &'a Prepared<P>,
    settings: &'a Settings,
    crop: Crop,
    /// In film coordinates, relative to the crop.
    area: Crop,
    layers: &'a Layers,
    kernel: PhantomData<K>,
}

impl<P: Precision, K: Kernel> TileJob<'_, P, K> {
    fn run(&self) -> (Tile, Counters) {
        let mut tracer = Tracer::<P, K>::new(self.scene, self.settings.max_depth);
        let count = self.area.width as usize * self.area.height as usize;
        let squares = self.layers.standard_error;
        let mut pixels = Vec::with_capacity(count);
        let mut dropped = 0;
        match self.settings.sampling {
            Sampling::Pattern(Pattern::Corners) => {
                let lattice = self.lattice(&mut tracer);
                let row = self.area.width as usize + 1;
                for y in 0..self.area.height as usize {
                    for x in 0..self.area.width as usize {
                        let mut pixel = Accumulator::<P::Real>::new();
                        let top = y * row + x;
                        for at in [top + row, top + row + 1, top, top + 1] {
                            let (radiance, hit) = lattice[at];
                            dropped += u64::from(!pixel.add(radiance, hit, squares));
                        }
                        pixels.push(pixel.finish());
                    }
                }
            }
            Sampling::Pattern(Pattern::Centre) | Sampling::General(_) => {
                for (x, y) in self.positions() {
                    let mut pixel = Accumulator::<P::Real>::new();
                    for sample in 0..self.settings.sampling.count() {
                        let brought = tracer.camera_ray(self.sample_ray(x, y, sample), self.address(x, y, sample));
                        dropped += u64::from(!pixel.add(brought.radiance, brought.hit, squares));
                    }
                    pixels.push(pixel.finish());
                }
            }
        }
        let mut counters = tracer.counters;
        counters.samples = pixels.iter().map(|p| u64::from(p.samples)).sum();
        counters.dropped = dropped;
        let mut layers = self.first_hits(&tracer);
        if self.layers.samples {
            layers.push(pixels.iter().map(|p| p.samples as f32).collect());
        }
        if squares {
            layers.extend((0..3).map(|i| pixels.iter().map(|p| p.standard_error()[i]).collect()));
        }
        let transparent = self.settings.background == Background::Transparent;
        let Crop { x, y, width, height } = self.area;
        let rgb = pixels.iter().map(Pixel::mean).collect();
        let alpha = if transparent { pixels.iter().map(Pixel::coverage).collect() } else { Vec::new() };
        (Tile { x, y, width, height, rgb, alpha, layers }, counters)
    }

    /// Whole-picture coordinates of the tile's pixels, row by row.
    fn positions(&self) -> impl Iterator<Item = (u32, u32)> + use<'_, P, K> {
        let (x0, y0) = (self.crop.x + self.area.x, self.crop.y + self.area.y);
        (0..self.area.height).flat_map(move |y| (0..self.area.width).map(move |x| (x0 + x, y0 + y)))
    }

    /// Radiance at the corners of the tile's pixels, each traced once for the up to four pixels that share it.
    fn lattice(&self, tracer: &mut Tracer<'_, P, K>) -> Vec<(Vec3Of<P>, bool)> {
        let (x0, y0) = (self.crop.x + self.area.x, self.crop.y + self.area.y);
        let (columns, rows) = (self.area.width + 1, self.area.height + 1);
        let mut corners = Vec::with_capacity(columns as usize * rows as usize);
        for y in 0..rows {
            for x in 0..columns {
                let at = |v: u32| P::Real::from_f64(f64::from(v));
                let ray = self.scene.camera.ray(at(x0 + x), at(y0 + y), [0.5; 2]);
                let brought = tracer.camera_ray(ray, self.address(x0 + x, y0 + y, 0));
                corners.push((brought.radiance, brought.hit));
            }
        }
        corners
    }

    fn address(&self, x: u32, y: u32, sample: u32) -> Address {
        Address { pixel: [x, y], sample, seed: self.settings.seed }
    }

    /// The camera ray of one sample of a pixel.
    #[inline]
    fn sample_ray(&self, x: u32, y: u32, sample: u32) -> Ray<P::Real> {
        let address = self.address(x, y, sample);
        let [u, v] = match self.settings.sampling {
            Sampling::Pattern(_) => [0.5; 2],
            Sampling::General(_) => pair(address, Purpose::Pixel),
        };
        let camera = &self.scene.camera;
        let lens = if camera.has_lens() { pair(address, Purpose::Lens) } else { [0.5; 2] };
        let at = |v: u32, offset: f32| P::Real::from_f64(f64::from(v)) + P::Real::from_f32(offset);
        camera.ray(at(x, u), at(y, v), lens)
    }

    /// The camera ray of one sample whatever the pattern.
    fn pattern_ray(&self, x: u32, y: u32, sample: u32) -> Ray<P::Real> {
        match self.settings.sampling {
            Sampling::Pattern(Pattern::Corners) => {
                let at = |v: u32| P::Real::from_f64(f64::from(v));
                self.scene.camera.ray(at(x + sample % 2), at(y + 1 - sample / 2), [0.5; 2])
            }
            _ => self.sample_ray(x, y, sample),
        }
    }

    /// The layers that show first hits. Traced apart from the picture, so that a picture without them pays nothing.
    fn first_hits(&self, tracer: &Tracer<'_, P, K>) -> Vec<Vec<f32>> {
        let (mean, centre) = (&self.layers.mean, &self.layers.centre);
        let mut buffers = vec![Vec::new(); mean.len() * 3 + centre.len()];
        if buffers.is_empty() {
            return buffers;
        }
        let samples = self.settings.sampling.count();
        for (x, y) in self.positions() {
            let mut sums = vec![[0.0_f64; 3]; mean.len()];
            let mut hits = 0;
            for sample in 0..if mean.is_empty() { 0 } else { samples } {
                let Some(first) = tracer.first_hit(self.pattern_ray(x, y, sample)) else { continue };
                hits += 1;
                for (sum, (aov, _)) in sums.iter_mut().zip(mean) {
                    let value = match aov {
                        Aov::Albedo => first.albedo,
                        Aov::Normal => first.normal,
                        _ => first.position,
                    };
                    *sum = core::array::from_fn(|i| sum[i] + value[i]);
                }
            }
            for (k, (sum, (aov, _))) in sums.iter().zip(mean).enumerate() {
                let n = f64::from(if *aov == Aov::Position { hits } else { samples }).max(1.0);
                sum.iter().enumerate().for_each(|(i, s)| buffers[3 * k + i].push((s / n) as f32));
            }
            let at = |v: u32| P::Real::from_f64(f64::from(v) + 0.5);
            let first = tracer.first_hit(self.scene.camera.ray(at(x), at(y), [0.5; 2]));
            for (k, (aov, _)) in centre.iter().enumerate() {
                let value = first.as_ref().map_or(-1.0, |f| match aov {
                    Aov::Depth => f.distance as f32,
                    Aov::Object => f.object as f32,
                    _ => f.material as f32,
                });
                buffers[3 * mean.len() + k].push(value);
            }
        }
        buffers
    }
}
