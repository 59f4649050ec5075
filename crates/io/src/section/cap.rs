//! Triangulation of the area inside a planar outline. A horizontal line sweeps upwards from vertex
//! to vertex and builds trapezoids between edges. A point is inside if its winding number is not
//! zero; therefore overlapping bodies are joined, and an inner wall bounds a hole.

use std::collections::{BTreeMap, BTreeSet};

/// Outline of a cap: directed edges that form closed loops. Each entry has the indices of an edge's
/// two vertices, and the two-dimensional positions of these vertices in the plane.
pub(super) struct SectionOutline {
    pub edges: Vec<([u32; 2], [[f64; 2]; 2])>,
}

/// A corner of a cap: a point on an edge of the outline, at a fraction of the distance from the
/// edge's first vertex to its second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CapCorner {
    pub vertices: [u32; 2],
    pub fraction: f64,
    position: [f64; 2],
}

/// An edge of the outline, directed towards greater height (the second coordinate in the plane).
struct AscendingEdge {
    vertices: [u32; 2],
    from: [f64; 2],
    to: [f64; 2],
    /// 1 if the direction of the edge in the outline is upwards, -1 if it is downwards.
    winding: i32,
}

impl AscendingEdge {
    fn fraction_at(&self, height: f64) -> f64 {
        (height - self.from[1]) / (self.to[1] - self.from[1])
    }

    fn x_at(&self, height: f64) -> f64 {
        self.from[0] + self.fraction_at(height) * (self.to[0] - self.from[0])
    }

    fn corner_at(&self, height: f64) -> CapCorner {
        let place = match height {
            at if at == self.from[1] => self.from,
            at if at == self.to[1] => self.to,
            at => [self.x_at(at), at],
        };
        CapCorner {
            vertices: self.vertices,
            fraction: self.fraction_at(height),
            position: place,
        }
    }
}

/// Trapezoids that fill an outline. Each entry has the indices of the trapezoid's left and right
/// edge, and the trapezoid's lower and upper height.
pub(super) struct CapTrapezoids {
    edges: Vec<AscendingEdge>,
    trapezoids: Vec<([usize; 2], [f64; 2])>,
}

impl CapTrapezoids {
    /// Divides the inside of an outline into trapezoids.
    pub fn from_outline(outline: &SectionOutline) -> Self {
        let rising = |&(vertices, [a, b]): &([u32; 2], [[f64; 2]; 2])| {
            let [v, w] = vertices;
            match a[1].total_cmp(&b[1]) {
                _ if a[1] == b[1] => None,
                core::cmp::Ordering::Less => Some(AscendingEdge {
                    vertices,
                    from: a,
                    to: b,
                    winding: 1,
                }),
                _ => Some(AscendingEdge {
                    vertices: [w, v],
                    from: b,
                    to: a,
                    winding: -1,
                }),
            }
        };
        let mut edges: Vec<AscendingEdge> = outline.edges.iter().filter_map(rising).collect();
        edges.sort_by(|a, b| a.from[1].total_cmp(&b.from[1]));
        let mut heights: Vec<f64> = edges
            .iter()
            .flat_map(|edge| [edge.from[1], edge.to[1]])
            .collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup();
        let mut cap = Self {
            edges,
            trapezoids: Vec::new(),
        };
        cap.sweep_edges(&heights);
        cap
    }

    /// Sweeps a horizontal line upwards over the given heights. A trapezoid continues as long as
    /// its two edges bound the same inside span. The time is proportional to the number of edges
    /// times the number of edges that cross the line. Of n edges, about the square root of n cross
    /// the line for a typical body, and all n for the teeth of a comb.
    fn sweep_edges(&mut self, heights: &[f64]) {
        let (mut next, mut active) = (0, Vec::new());
        let mut open_trapezoids: BTreeMap<[usize; 2], f64> = BTreeMap::new();
        for pair in heights.windows(2) {
            let [low, high] = [pair[0], pair[1]];
            while next < self.edges.len() && self.edges[next].from[1] <= low {
                active.push(next);
                next += 1;
            }
            active.retain(|&edge| self.edges[edge].to[1] > low);
            let middle = f64::midpoint(low, high);
            active.sort_by(|&a, &b| {
                self.edges[a]
                    .x_at(middle)
                    .total_cmp(&self.edges[b].x_at(middle))
            });
            let spans = self.inside_spans(&active);
            let ended: Vec<_> = open_trapezoids
                .iter()
                .filter(|(edges, _)| !spans.contains(*edges))
                .map(|(edges, from)| (*edges, *from))
                .collect();
            for (edges, from) in ended {
                open_trapezoids.remove(&edges);
                self.trapezoids.push((edges, [from, low]));
            }
            spans
                .into_iter()
                .for_each(|edges| _ = open_trapezoids.entry(edges).or_insert(low));
        }
        let end = heights.last().copied().unwrap_or(0.0);
        self.trapezoids.extend(
            open_trapezoids
                .into_iter()
                .map(|(edges, from)| (edges, [from, end])),
        );
    }

    /// Returns the spans of the sweep line that lie inside the outline, from left to right. Each
    /// span is the pair of edges at its left and right end. `active` lists the edges that cross the
    /// line, from left to right.
    fn inside_spans(&self, active: &[usize]) -> BTreeSet<[usize; 2]> {
        let (mut winding, mut left, mut spans) = (0, 0, BTreeSet::new());
        for &edge in active {
            if winding == 0 {
                left = edge;
            }
            winding += self.edges[edge].winding;
            if winding == 0 {
                spans.insert([left, edge]);
            }
        }
        spans
    }

    /// Divides the trapezoids into counter-clockwise triangles; triangles without area are omitted.
    pub fn triangles(&self) -> impl Iterator<Item = [CapCorner; 3]> + '_ {
        let two = |&([left, right], [low, high]): &([usize; 2], [f64; 2])| {
            let [left, right] = [left, right].map(|edge| &self.edges[edge]);
            let [a, b, c, d] = [
                left.corner_at(low),
                right.corner_at(low),
                right.corner_at(high),
                left.corner_at(high),
            ];
            [[a, b, c], [a, c, d]]
        };
        let has_area = |corners: &[CapCorner; 3]| {
            (0..3).all(|i| corners[i].position != corners[(i + 1) % 3].position)
        };
        self.trapezoids.iter().flat_map(two).filter(has_area)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the area of the cap for an outline of closed rings.
    fn area(rings: &[&[[f64; 2]]]) -> f64 {
        let edges = rings
            .iter()
            .flat_map(|ring| {
                (0..ring.len()).map(|i| ([0, 1], [ring[i], ring[(i + 1) % ring.len()]]))
            })
            .collect();
        let cap = CapTrapezoids::from_outline(&SectionOutline { edges });
        let area = |[a, b, c]: [CapCorner; 3]| {
            let [p, q] = [b, c].map(|corner| {
                [
                    corner.position[0] - a.position[0],
                    corner.position[1] - a.position[1],
                ]
            });
            let area = 0.5 * (p[0] * q[1] - p[1] * q[0]);
            assert!(area >= 0.0, "it turns the right way: {area}");
            area
        };
        cap.triangles().map(area).sum()
    }

    /// Protects: areas of convex and concave outlines, with a hole, with overlap and with contact,
    /// in both orientations; an empty outline has no area.
    #[test]
    fn areas_are_those_of_their_outlines() {
        let square: &[[f64; 2]] = &[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let hole: &[[f64; 2]] = &[[0.5, 0.5], [0.5, 1.5], [1.5, 1.5], [1.5, 0.5]];
        let arrow: &[[f64; 2]] = &[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 1.0], [0.0, 3.0]];
        let beside: &[[f64; 2]] = &[[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]];
        let reversed: Vec<[f64; 2]> = square.iter().rev().copied().collect();
        let star: Vec<[f64; 2]> = (0..10)
            .map(|i| (f64::from(i) * 0.2 * core::f64::consts::PI).sin_cos())
            .zip([1.0, 0.4].into_iter().cycle())
            .map(|((s, c), r)| [r * c, r * s])
            .collect();
        let exact = 5.0 * 0.4 * (0.2 * core::f64::consts::PI).sin();
        for (rings, expected) in [
            (&[square][..], 4.0),
            (&[&reversed], 4.0),
            (&[square, hole], 3.0),
            (&[arrow], 8.0),
            (&[square, beside], 7.0),
            (&[square, square], 4.0),
            (&[&star], exact),
            (&[], 0.0),
            (&[&[[0.0, 0.0], [1.0, 1.0]]], 0.0),
        ] {
            assert!(
                (area(rings) - expected).abs() < 1e-12,
                "{rings:?}: {} instead of {expected}",
                area(rings)
            );
        }
    }
}
