//! Placement of labels beside the points of a plot. Labels overlap neither points nor other labels
//! nor the legend.

/// Area of the plot: left, top, right, bottom, in pixels of the SVG.
pub(super) const AREA: [f64; 4] = [84.0, 96.0, 816.0, 510.0];

/// Average width of a character in the small font, in pixels of the SVG.
const CHARACTER: f64 = 6.6;
/// Height of a line in the small font, in pixels of the SVG.
const HEIGHT: f64 = 13.0;
/// Distance from the centre of a point to its label, in pixels of the SVG.
const GAP: f64 = 7.0;
/// Half the edge of a point's square marker, in pixels of the SVG.
const MARKER: f64 = 4.5;

/// Boxes in a plot that points, labels or the legend occupy: left, top, right and bottom of each,
/// in pixels of the SVG.
pub(super) struct OccupiedBoxes {
    boxes: Vec<[f64; 4]>,
}

impl OccupiedBoxes {
    pub(super) fn new(points: &[(f64, f64)], legend: [f64; 4]) -> Self {
        let marker = |&(x, y): &(f64, f64)| [x - MARKER, y - MARKER, x + MARKER, y + MARKER];
        Self {
            boxes: points.iter().map(marker).chain([legend]).collect(),
        }
    }

    /// Returns the start of the base line for a label beside a point, and marks the label's box as
    /// occupied; `None` if all eight positions around the point are occupied.
    pub(super) fn place_label(&mut self, words: &str, x: f64, y: f64) -> Option<(f64, f64)> {
        let width = CHARACTER * words.chars().count() as f64;
        let (right, left, middle) = (x + GAP, x - GAP - width, x - width / 2.0);
        let (above, below, beside) = (y - GAP - HEIGHT, y + GAP, y - HEIGHT / 2.0);
        let places = [
            (right, beside),
            (left, beside),
            (middle, above),
            (middle, below),
            (right, above),
            (left, below),
            (left, above),
            (right, below),
        ];
        let boxes = places.map(|(x, y)| [x, y, x + width, y + HEIGHT]);
        let found = boxes.into_iter().find(|of| {
            is_box_inside(of, &AREA) && !self.boxes.iter().any(|other| boxes_overlap(of, other))
        })?;
        self.boxes.push(found);
        Some((found[0], found[3] - 3.0))
    }
}

fn is_box_inside(of: &[f64; 4], area: &[f64; 4]) -> bool {
    of[0] >= area[0] && of[1] >= area[1] && of[2] <= area[2] && of[3] <= area[3]
}

fn boxes_overlap(a: &[f64; 4], b: &[f64; 4]) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a label is placed to the right of its point, elsewhere if that is occupied, and
    /// nowhere without room; labels stay inside the plot.
    #[test]
    fn words_cover_nothing() {
        let legend = [600.0, 100.0, 800.0, 160.0];
        let mut labels = OccupiedBoxes::new(&[(300.0, 300.0), (320.0, 300.0)], legend);
        let (x, _) = labels.place_label("abc", 320.0, 300.0).expect("free");
        assert!(x > 320.0);
        let (x, _) = labels
            .place_label("abc", 300.0, 300.0)
            .expect("the left is free");
        assert!(x < 300.0 - 3.0 * CHARACTER);
        let (x, y) = labels
            .place_label("a long name", AREA[2] - 2.0, 400.0)
            .expect("on the left");
        assert!(x + 11.0 * CHARACTER <= AREA[2] && y < 410.0);
        assert_eq!(labels.place_label("within the legend", 700.0, 130.0), None);
        let places: Vec<_> = (0..9)
            .map(|_| labels.place_label("x", 200.0, 200.0))
            .collect();
        assert!(
            places[..8].iter().all(Option::is_some) && places[8].is_none(),
            "{places:?}"
        );
    }
}
