//! Points in front of a camera that looks along an axis, and the distance from which all of them
//! are in the picture.

use glam::DVec3;

/// Points in coordinates along right, up and back of a view, relative to the middle of the points.
/// The sides of the view are slanted, because its width grows with the distance.
pub(super) struct ViewedPoints {
    pub points: Vec<DVec3>,
    /// Half the width and half the height of the view, per unit of distance; 0 in a parallel view.
    pub slopes: [f64; 2],
}

impl ViewedPoints {
    /// Returns how far the points extend towards both sides of an axis, in coordinates slanted by
    /// `slope`. A camera at (x, y, d) has a point p between its sides where |p.x - x| <= slope * (d
    /// - p.z).
    fn slanted_extents(&self, axis: usize, slope: f64) -> [f64; 2] {
        let mut extents = [f64::NEG_INFINITY; 2];
        for point in &self.points {
            let (along, depth) = (point.to_array()[axis], slope * point.z);
            for (extent, value) in extents.iter_mut().zip([depth + along, depth - along]) {
                // Plain comparisons: `f64::max` also orders NaN, which takes three instructions more.
                if value > *extent {
                    *extent = value;
                }
            }
        }
        extents
    }

    /// Returns the least distance from the middle at which a camera has all points in its picture.
    /// The camera is at least `room` away from the nearest point.
    pub fn least_distance(&self, room: f64) -> f64 {
        let [across, upright] = [0, 1].map(|axis| {
            let slope = self.slopes[axis];
            self.slanted_extents(axis, slope).iter().sum::<f64>() / (2.0 * slope)
        });
        let nearest = self
            .points
            .iter()
            .map(|p| p.z)
            .fold(f64::NEG_INFINITY, f64::max);
        across.max(upright).max(nearest + room)
    }

    /// Returns the height of a parallel view, with this ratio of width to height, that has all points
    /// in its picture.
    pub fn parallel_height(&self, aspect: f64) -> f64 {
        let [across, upright] =
            [0, 1].map(|axis| self.slanted_extents(axis, 0.0).iter().sum::<f64>());
        upright.max(across / aspect)
    }

    /// Returns the position of the silhouette's centre along right and up, for a camera at this
    /// distance from the middle.
    pub fn silhouette_centre(&self, distance: f64) -> [f64; 2] {
        [0, 1].map(|axis| self.silhouette_centre_on_axis(axis, distance))
    }

    /// Returns the position of the silhouette's centre along an axis. Bisection finds the slope of
    /// the view's sides for which `distance` would be the least distance.
    fn silhouette_centre_on_axis(&self, axis: usize, distance: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.slopes[axis]);
        for _ in 0..48 {
            let slope = 0.5 * (low + high);
            let [one, other] = self.slanted_extents(axis, slope);
            if one + other > 2.0 * slope * distance {
                low = slope;
            } else {
                high = slope;
            }
        }
        let [one, other] = self.slanted_extents(axis, high);
        0.5 * (one - other)
    }
}
