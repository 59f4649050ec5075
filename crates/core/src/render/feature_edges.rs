//! Feature edges: outlines, borders, steps and creases as lines over the picture, a pixel wide where
//! they are level or upright, and 0.7 pixels where they are oblique.
//!
//! They are found where neighbouring rays of a fine grid hit different surfaces, as in Choudhury and
//! Parker, "Ray Tracing NPR-Style Feature Lines" (2009), and not from the edges of meshes: so they
//! exist on every shape, on smooth outlines and where bodies meet, and take the same time however
//! dense a mesh is. The grid is finer than the samples of a pixel and independent of them, so that
//! lines have no noise and cost a pass over first hits alone.

use core::ops::Range;

use glam::DVec3;
use raywright_bvh::Real;

use super::tile_job::TileJob;
use crate::integrator::{FirstHit, LightTransport};
use crate::picture::needs_bright_lines;

/// Rays of the grid along each edge of a pixel.
const GRID: usize = 4;
/// Rays beyond each edge of a tile that decide about its lines: half a line and a neighbour.
const MARGIN: usize = 2;
/// Cosine of the least angle between the surfaces at a crease, 30°.
const CREASE: f64 = 0.866_025_403_784_438_6;
/// Cosine of the greatest angle between shading normals of neighbouring rays on a smooth surface.
const SMOOTH: f64 = 0.996;

impl<'t, R: Real, T: LightTransport<'t, R>> TileJob<'_, R, T> {
    /// Returns the share of each pixel of the tile that lines cover, negative for bright lines on
    /// dark surfaces. `None` if the observer stops the render.
    pub(super) fn trace_feature_edges(&self, tracer: &mut T) -> Option<Vec<f32>> {
        let cells = |pixels: &Range<u32>| GRID * pixels.len() + 2 * MARGIN;
        let (columns, rows) = (self.pixel_columns(), self.pixel_rows());
        let [width, height] = [cells(&columns), cells(&rows)];
        let cone = self.camera.ray_cone();
        let at = |start: u32, cell: usize| {
            let offset = (cell as f64 + 0.5 - MARGIN as f64) / GRID as f64;
            R::from_f64(f64::from(start) + offset)
        };
        let mut hits = Vec::with_capacity(width * height);
        for y in 0..height {
            if self.observer.is_cancelled() {
                return None;
            }
            hits.extend((0..width).map(|x| {
                let [x, y] = [at(columns.start, x), at(rows.start, y)];
                tracer.trace_first_hit(self.camera.generate_timed_ray(x, y, [0.5; 2], 0.0))
            }));
        }
        let pixel_width = |hit: &FirstHit| {
            let distance = hit.distance + self.camera.eye_to_origin_distance().to_f64();
            cone.width.to_f64() + cone.spread.to_f64() * distance
        };
        // Both cells beside an edge are marked, and then the cells beside those.
        let mut marks = vec![0_i8; hits.len()];
        for (i, hit) in hits.iter().enumerate() {
            for next in [(i % width + 1 < width).then_some(i + 1), Some(i + width)] {
                let Some((next, other)) = next.and_then(|next| Some((next, hits.get(next)?)))
                else {
                    continue;
                };
                if let Some(mark) = mark_between(hit, other, pixel_width) {
                    (marks[i], marks[next]) = (mark, mark);
                }
            }
        }
        let covers = |x: usize, y: usize| {
            let i = y * width + x;
            let near = [i, i - 1, i + 1, i - width, i + width].map(|i| marks[i]);
            near.into_iter().find(|mark| *mark != 0).unwrap_or(0)
        };
        let of_pixel = |x: usize, y: usize| {
            let cells = (0..GRID * GRID).map(|cell| {
                i32::from(covers(
                    MARGIN + GRID * x + cell % GRID,
                    MARGIN + GRID * y + cell / GRID,
                ))
            });
            cells.sum::<i32>() as f32 / (GRID * GRID) as f32
        };
        let pixels = (0..rows.len()).flat_map(|y| (0..columns.len()).map(move |x| (x, y)));
        Some(pixels.map(|(x, y)| of_pixel(x, y)).collect())
    }
}

/// Returns the mark of an edge between two neighbouring first hits: 1 for a dark line, −1 for a
/// bright line; `None` without an edge. `pixel_width` is the width of a pixel at a hit.
fn mark_between(
    a: &Option<FirstHit>,
    b: &Option<FirstHit>,
    pixel_width: impl Fn(&FirstHit) -> f64,
) -> Option<i8> {
    let near = match (a, b) {
        (None, None) => return None,
        (Some(one), None) | (None, Some(one)) => one,
        (Some(a), Some(b)) => {
            let [one, other] = [a, b].map(|hit| DVec3::from(hit.face));
            let near = if a.distance <= b.distance { a } else { b };
            let apart = DVec3::from(b.position) - DVec3::from(a.position);
            let step = apart.dot(one).abs().min(apart.dot(other).abs());
            // Normals that a mesh interpolates across an edge say that it is a curve.
            let is_smooth = DVec3::from(a.normal).dot(b.normal.into()) > SMOOTH;
            let is_crease = one.dot(other) < CREASE && !is_smooth;
            let is_edge = a.object != b.object || is_crease || step > pixel_width(near);
            if !is_edge {
                return None;
            }
            near
        }
    };
    Some(if needs_bright_lines(near.albedo) {
        -1
    } else {
        1
    })
}

#[cfg(test)]
mod tests;
