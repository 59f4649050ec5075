//! The solid angle under which a triangle or a quad is seen, drawn evenly ("Stratified Sampling of Spherical Triangles", Arvo 1995).

use glam::DVec3;

/// Below so many steradians points are drawn by area: distances and slants differ too little to matter, and the angles of so
/// small a triangle keep too few digits.
const LEAST: f64 = 1e-3;

/// A polygon of one or two triangles as a point sees it.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    from: DVec3,
    parts: [Option<Part>; 2],
    solid_angle: f64,
}

/// One triangle.
#[derive(Clone, Copy, Debug)]
struct Part {
    /// Directions to the corners.
    corners: [DVec3; 3],
    solid_angle: f64,
    /// A corner's offset, and the normal of the plane, of any length.
    offset: DVec3,
    normal: DVec3,
}

impl Polygon {
    /// A triangle, or a quad with a fourth corner, as `from` sees it; none where it is small, and from its own plane.
    #[inline]
    pub fn new(corners: [DVec3; 3], fourth: Option<DVec3>, from: DVec3) -> Option<Self> {
        let [a, b, c] = corners.map(|corner| Corner::new(corner, from));
        let second = fourth.and_then(|d| Part::new([&a, &c, &Corner::new(d, from)]));
        let parts = [Part::new([&a, &b, &c]), second];
        let solid_angle = parts.iter().flatten().map(|part| part.solid_angle).sum();
        (solid_angle >= LEAST).then_some(Self { from, parts, solid_angle })
    }

    /// In steradians.
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// A point of it for two numbers in [0, 1).
    pub fn point(&self, [u, v]: [f64; 2]) -> Option<DVec3> {
        let at = u * self.solid_angle;
        let [first, second] = self.parts.each_ref().map(Option::as_ref);
        let (part, area) = match (first, second) {
            (Some(first), Some(second)) if at >= first.solid_angle => (second, at - first.solid_angle),
            _ => (first.or(second)?, at),
        };
        Some(self.from + part.offset_at([area, v])?)
    }
}

/// A corner: its place, its offset from the point that sees it, and the direction.
struct Corner {
    place: DVec3,
    offset: DVec3,
    direction: DVec3,
}

impl Corner {
    #[inline(always)]
    fn new(place: DVec3, from: DVec3) -> Self {
        let offset = place - from;
        Self { place, offset, direction: offset.normalize() }
    }
}

impl Part {
    #[inline(always)]
    fn new(corners: [&Corner; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|corner| corner.direction);
        let volume = a.dot(b.cross(c)).abs();
        // "The Solid Angle of a Plane Triangle" (Van Oosterom, Strackee 1983).
        let solid_angle = 2.0 * libm::atan2(volume, 1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        let [first, second, third] = corners.map(|corner| corner.place);
        let normal = (second - first).cross(third - first);
        // Also false for NaN, from a corner. In the plane the three directions are dependent.
        (volume > 1e-12).then_some(Self { corners: [a, b, c], solid_angle, offset: corners[0].offset, normal })
    }

    /// The way to the point that leaves `area` steradians on one side of the arc from it to the second corner, and a share `v` of what is left
    /// along that arc.
    fn offset_at(&self, [area, v]: [f64; 2]) -> Option<DVec3> {
        let [a, b, c] = self.corners;
        let (across_b, across_c) = (a.cross(b), a.cross(c));
        // Of the angle between both arcs only sine and cosine are asked, which take no angle.
        let (sine, cosine) = (across_b.cross(across_c).length(), across_b.dot(across_c));
        let both = (sine * sine + cosine * cosine).sqrt();
        let (sine, cosine) = (sine / both, cosine / both);
        let (of_area, beside) = libm::sincos(area);
        let (s, t) = (of_area * cosine - beside * sine, beside * cosine + of_area * sine);
        let (x, y) = (t - cosine, s + sine * a.dot(b));
        // Where the area is nothing this is nothing by nothing, and the arc the side itself.
        let q = ((y * t - x * s) * cosine - y) / ((y * s + x * t) * sine);
        let q = if q.is_nan() { 1.0 } else { q.clamp(-1.0, 1.0) };
        let on_side = a * q + (c - a * c.dot(a)).normalize_or_zero() * (1.0 - q * q).sqrt();
        let h = v * (1.0 - on_side.dot(b));
        let direction = b * (1.0 - h) + (on_side - b * on_side.dot(b)).normalize_or_zero() * (h * (2.0 - h)).max(0.0).sqrt();
        let distance = self.normal.dot(self.offset) / self.normal.dot(direction);
        (distance > 0.0 && distance.is_finite()).then(|| direction * distance)
    }
}
