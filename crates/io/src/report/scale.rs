//! Logarithmic scales of a plot. A scale starts and ends at a power of ten.

/// Scales of the horizontal and the vertical axis.
pub(super) struct PlotScales {
    pub x: DecadeScale,
    pub y: DecadeScale,
}

/// Maps a value on a logarithmic axis to its coordinate in the plot.
pub(super) struct DecadeScale {
    /// Decimal exponents at the start and at the end of the scale.
    pub decades: [i32; 2],
    /// Coordinates of the start and of the end of the scale, in pixels of the SVG.
    ends: [f64; 2],
}

impl DecadeScale {
    pub fn new(values: impl Iterator<Item = f64>, start: f64, end: f64) -> Self {
        let (low, high) = values
            .filter(|v| *v > 0.0 && v.is_finite())
            .fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        let (first, last) = if low <= high {
            (low.log10().floor() as i32, high.log10().ceil() as i32)
        } else {
            (0, 1)
        };
        Self {
            decades: [first, last.max(first + 1)],
            ends: [start, end],
        }
    }

    pub fn decades(&self) -> impl Iterator<Item = i32> + use<> {
        self.decades[0]..=self.decades[1]
    }

    pub fn map_value(&self, value: f64) -> f64 {
        self.map_exponent(value.log10())
    }

    pub fn map_exponent(&self, exponent: f64) -> f64 {
        let [first, last] = self.decades.map(f64::from);
        self.ends[0] + (self.ends[1] - self.ends[0]) * (exponent - first) / (last - first)
    }
}
