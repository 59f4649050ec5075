//! Triangulation of polygons with any number of corners, convex or not ("Triangulation by Ear
//! Clipping", Eberly 2002).

use glam::{DVec2, DVec3};

use crate::import::{DecodeBudget, Fault, ImportResult};

/// Largest number of vertex comparisons for all concave polygons of a file together: about a second
/// of work.
const MOST_WORK: u64 = 300_000_000;

/// Triangulates the polygons of a file by ear clipping, with a limit on the total work.
pub(crate) struct EarClipper {
    work_left: u64,
    /// Number of corners of the largest polygon for which memory was reserved so far.
    reserved_corners: usize,
}

/// Memory per corner during triangulation, in bytes: a 3D point, its 2D projection, an index of the
/// outline and a triangle, in lists whose capacity may be twice their length.
const BYTES_A_CORNER: usize = 160;

impl Default for EarClipper {
    /// Creates a clipper that may do the full amount of work.
    fn default() -> Self {
        Self {
            work_left: MOST_WORK,
            reserved_corners: 0,
        }
    }
}

impl EarClipper {
    /// Reserves the memory to triangulate a polygon of `corners` corners. Only the largest polygon
    /// so far needs memory; a smaller polygon uses the same memory.
    ///
    /// # Errors
    ///
    /// A fault of kind limit when the budget is exceeded.
    pub fn reserve_memory(
        &mut self,
        corners: usize,
        budget: &mut DecodeBudget,
    ) -> ImportResult<()> {
        budget.reserve_memory(
            corners.saturating_sub(self.reserved_corners),
            BYTES_A_CORNER,
        )?;
        self.reserved_corners = self.reserved_corners.max(corners);
        Ok(())
    }

    /// Triangulates a polygon. Adds the triangles to `out` as indices into `points`, with the
    /// orientation of the polygon.
    ///
    /// # Errors
    /// A fault of kind limit when the concave polygons of the file take too much work.
    pub fn triangulate(&mut self, points: &[DVec3], out: &mut Vec<[usize; 3]>) -> ImportResult<()> {
        if points.len() <= 3 {
            out.extend((points.len() == 3).then_some([0, 1, 2]));
            return Ok(());
        }
        let normal = newell_normal(points);
        let flat: Vec<DVec2> = points
            .iter()
            .map(|p| project_to_plane(*p, normal))
            .collect();
        if is_convex(&flat) || !normal.is_finite() {
            out.extend((2..points.len()).map(|i| [0, i - 1, i]));
            return Ok(());
        }
        self.clip_ears(&flat, out)
    }

    fn clip_ears(&mut self, points: &[DVec2], out: &mut Vec<[usize; 3]>) -> ImportResult<()> {
        let mut left: Vec<usize> = (0..points.len()).collect();
        let (mut position, mut failed) = (0, 0);
        while left.len() > 3 {
            let n = left.len();
            let tip = (position + 1) % n;
            let ear = [left[position], left[tip], left[(position + 2) % n]];
            self.work_left = self
                .work_left
                .checked_sub(n as u64)
                .ok_or_else(|| Fault::over_limit("its concave polygons have too many corners to triangulate; export the model as triangles"))?;
            // A self-intersecting polygon may have no ear left. Then any corner is cut off, so that
            // the loop ends.
            if failed > n || is_ear(points, &left, ear) {
                out.push(ear);
                left.remove(tip);
                // The corner before the ear has a new neighbour and is examined again.
                position = if tip == 0 { n - 2 } else { position }.saturating_sub(1);
                failed = 0;
            } else {
                position = tip;
                failed += 1;
            }
        }
        out.push([left[0], left[1], left[2]]);
        Ok(())
    }
}

/// Returns a vector along the polygon's normal, whose length is twice the polygon's area (Newell's
/// method; Sutherland, Sproull, Schumacker 1974).
pub(crate) fn newell_normal(points: &[DVec3]) -> DVec3 {
    let Some(&first) = points.first() else {
        return DVec3::ZERO;
    };
    points
        .windows(2)
        .map(|edge| (edge[0] - first).cross(edge[1] - first))
        .sum()
}

/// Projects a point along the coordinate axis closest to the polygon's normal. The projected
/// polygon is counter-clockwise.
fn project_to_plane(p: DVec3, normal: DVec3) -> DVec2 {
    let size = normal.abs();
    let (a, b, along) = if size.x >= size.y && size.x >= size.z {
        (p.y, p.z, normal.x)
    } else if size.y >= size.z {
        (p.z, p.x, normal.y)
    } else {
        (p.x, p.y, normal.z)
    };
    if along < 0.0 {
        DVec2::new(b, a)
    } else {
        DVec2::new(a, b)
    }
}

/// Whether a counter-clockwise polygon is convex: it only turns left, and winds around once.
fn is_convex(points: &[DVec2]) -> bool {
    let n = points.len();
    let edge = |i: usize| points[(i + 1) % n] - points[i % n];
    let turns_left = (0..n).all(|i| edge(i).perp_dot(edge(i + 1)) >= 0.0);
    // A star also turns left at every corner, but winds more than once. With a single winding, the
    // edges change only once from pointing left to pointing right.
    let rounds = (0..n)
        .filter(|&i| edge(i).x < 0.0 && edge(i + 1).x >= 0.0)
        .count();
    turns_left && rounds <= 1
}

/// Whether a corner can be cut off as an ear: the polygon turns left at the corner, and no other
/// corner lies in the triangle of the corner and its two neighbours.
fn is_ear(points: &[DVec2], left: &[usize], ear: [usize; 3]) -> bool {
    let [a, b, c] = ear.map(|i| points[i]);
    if orient2d(a, b, c) <= 0.0 {
        return false;
    }
    left.iter().all(|&i| {
        let p = points[i];
        // A polygon with a hole, joined to the outline by a cut, has some positions twice. A copy
        // of the ear's own corner does not block the ear.
        p == a
            || p == b
            || p == c
            || orient2d(a, b, p) < 0.0
            || orient2d(b, c, p) < 0.0
            || orient2d(c, a, p) < 0.0
    })
}

/// Returns twice the signed area of a triangle, positive if p lies left of the line from a to b.
fn orient2d(a: DVec2, b: DVec2, p: DVec2) -> f64 {
    (b - a).perp_dot(p - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn triangulated(points: &[DVec3]) -> Vec<[usize; 3]> {
        let mut out = Vec::new();
        EarClipper::default().triangulate(points, &mut out).unwrap();
        out
    }

    fn area(points: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        triangles
            .iter()
            .map(|t| newell_normal(&t.map(|i| points[i])).length() / 2.0)
            .sum()
    }

    /// Protects: a concave polygon is covered exactly; a fan would cover its outside too, as the
    /// sum of areas shows.
    #[test]
    fn concave_polygons_are_covered_exactly() {
        let corners = [
            (0.0, 0.0),
            (2.0, 0.0),
            (2.0, 1.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (0.0, 2.0),
        ];
        for start in 0..6 {
            for mirrored in [false, true] {
                let mut points: Vec<_> = (0..6)
                    .map(|i| corners[(i + start) % 6])
                    .map(|(x, z)| DVec3::new(x, 5.0, z))
                    .collect();
                if mirrored {
                    points.reverse();
                }
                let triangles = triangulated(&points);
                assert_eq!(triangles.len(), 4);
                assert!(
                    (area(&points, &triangles) - 3.0).abs() < 1e-12,
                    "{start} {mirrored} {triangles:?}"
                );
                let facing = newell_normal(&points);
                assert!(
                    triangles
                        .iter()
                        .all(|t| newell_normal(&t.map(|i| points[i])).dot(facing) > 0.0),
                    "{triangles:?}"
                );
            }
        }
    }

    /// Protects: a polygon that turns left everywhere is convex only with a single winding, from
    /// any first corner: a pentagon is convex, a pentagram winds twice. A dented polygon is not
    /// convex.
    #[test]
    fn stars_are_not_convex() {
        let corner = |i: usize| DVec2::from_angle(0.3 + std::f64::consts::TAU * i as f64 / 5.0);
        for start in 0..5 {
            let pentagon: Vec<_> = (0..5).map(|i| corner(i + start)).collect();
            let pentagram: Vec<_> = (0..5).map(|i| corner(2 * (i + start))).collect();
            assert!(
                is_convex(&pentagon) && !is_convex(&pentagram),
                "from corner {start}"
            );
            let dented: Vec<_> = pentagon
                .iter()
                .enumerate()
                .map(|(i, &p)| if i == start { p * 0.1 } else { p })
                .collect();
            assert!(!is_convex(&dented), "corner {start}");
        }
    }

    /// Protects: degenerate input still gives the right number of triangles.
    #[test]
    fn degenerate_polygons_end() {
        let same = vec![DVec3::ONE; 50];
        assert_eq!(triangulated(&same).len(), 48);
        let square =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let often: Vec<_> = square.iter().copied().cycle().take(200).collect();
        assert_eq!(triangulated(&often).len(), 198);
        assert!(triangulated(&square[..2]).is_empty());
    }

    /// Protects: the work is bounded, whatever the polygon.
    #[test]
    fn huge_concave_polygons_are_refused() {
        let tooth = |i: i32| {
            DVec3::new(
                f64::from(i),
                f64::from(i % 2) * (1.0 + f64::from(i % 7)),
                0.0,
            )
        };
        let points: Vec<_> = (0..200_000).map(tooth).collect();
        let mut out = Vec::new();
        assert!(
            EarClipper::default()
                .triangulate(&points, &mut out)
                .is_err()
        );
    }

    proptest! {
        /// Protects: a star-shaped polygon is covered exactly: its area is the sum of its
        /// triangles' areas.
        #[test]
        fn star_shaped_polygons_keep_their_area(radii in prop::collection::vec(0.1_f64..1.0, 3..40)) {
            let n = radii.len() as f64;
            let point = |(i, r): (usize, &f64)| {
                let angle = std::f64::consts::TAU * i as f64 / n;
                DVec3::new(r * angle.cos(), r * angle.sin(), 0.25 * r * angle.cos())
            };
            let points: Vec<_> = radii.iter().enumerate().map(point).collect();
            let triangles = triangulated(&points);
            prop_assert_eq!(triangles.len(), points.len() - 2);
            let whole = newell_normal(&points).length() / 2.0;
            prop_assert!((area(&points, &triangles) - whole).abs() < 1e-9 * whole);
        }
    }
}
