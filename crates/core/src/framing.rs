//! The view that shows a whole scene: from where, and how far away, for a scene that has no camera
//! of its own.
//!
//! What is framed is the silhouette, not a box around it. Its outline is that of the convex hull,
//! of which few points matter: for each of some thousand directions about the middle the farthest
//! point is kept, in a space in which the box around everything is a cube, so that needles and
//! sheets are as well known as balls. Millions of vertices are looked at once, and every view after
//! that costs as much as a few thousand points.

mod outline;

use glam::DVec3;
use raywright_bvh::Aabb;

use crate::generate::all;
use crate::lookup::Lookup;
use crate::scene::{Camera, MeshData, Pinhole, Pose, Projection, Scene, Shape};
use crate::studio::towards;
use outline::{FINE, Outlines, outermost};

/// Share of the picture's tighter side that a framed silhouette fills.
pub const FILL: f64 = 0.78;

/// Vertical field of view of a framed camera where none is asked for, in degrees.
pub const FIELD_OF_VIEW: f64 = 40.0;

/// Where a camera stands about what it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Degrees about +y: 0 stands on the +z side, 90 on the +x side.
    pub azimuth: f64,
    /// Degrees above the horizon, -90 to 90.
    pub elevation: f64,
}

impl View {
    /// From slightly above and to the side.
    pub const USUAL: Self = Self {
        azimuth: 30.0,
        elevation: 20.0,
    };

    /// Views with names: the six sides and the one along a cube's diagonal.
    pub const NAMED: [(&'static str, Self); 7] = [
        (
            "front",
            Self {
                azimuth: 0.0,
                elevation: 0.0,
            },
        ),
        (
            "back",
            Self {
                azimuth: 180.0,
                elevation: 0.0,
            },
        ),
        (
            "left",
            Self {
                azimuth: -90.0,
                elevation: 0.0,
            },
        ),
        (
            "right",
            Self {
                azimuth: 90.0,
                elevation: 0.0,
            },
        ),
        (
            "top",
            Self {
                azimuth: 0.0,
                elevation: 90.0,
            },
        ),
        (
            "bottom",
            Self {
                azimuth: 0.0,
                elevation: -90.0,
            },
        ),
        (
            "iso",
            Self {
                azimuth: 45.0,
                elevation: 35.264_389_682_754_654,
            },
        ),
    ];

    /// Unit vectors to the right, up and back of a camera that stands there.
    fn axes(self) -> [DVec3; 3] {
        let back = towards(self.azimuth.to_radians(), self.elevation.to_radians());
        let right = towards((self.azimuth + 90.0).to_radians(), 0.0);
        [right, back.cross(right), back]
    }
}

/// What framing asks of a scene.
#[derive(Clone, Debug)]
pub struct Silhouette {
    /// Points whose convex hull is nearly the scene's.
    points: Vec<DVec3>,
    faces: FacingAreas,
}

/// Which way surfaces face.
#[derive(Clone, Copy, Debug, Default)]
struct FacingAreas {
    /// Area of all triangles that were looked at.
    area: f64,
    /// Their normals by area.
    sum: DVec3,
    /// How far the same face away from the middle, by area.
    outward: f64,
}

/// Triangles that are asked which way they face, about.
const FACES: usize = 1 << 18;

impl Silhouette {
    /// Looks at everything of a scene that has an end.
    pub fn of(scene: &Scene) -> Self {
        let lookup = Lookup::new(scene);
        let outlines = Outlines::of(scene, &lookup);
        let points = outermost(|visit| outlines.visit(scene, visit), FINE);
        let middle = Aabb::from_points(points.iter().copied()).centre();
        let faces = FacingAreas::of(scene, &lookup, middle, outlines.triangles / FACES + 1);
        Self { points, faces }
    }

    /// That of a box.
    pub fn of_box(bounds: &Aabb) -> Self {
        let points = if bounds.is_empty() {
            Vec::new()
        } else {
            bounds.corners().to_vec()
        };
        Self {
            points,
            faces: FacingAreas::default(),
        }
    }

    /// The view in which a scene is seen where none is asked for: flat things from their front,
    /// rooms through the side that is open, and everything else from slightly above and to the
    /// side.
    pub fn front(&self) -> View {
        let extent = Aabb::from_points(self.points.iter().copied()).extent();
        let FacingAreas { area, sum, outward } = self.faces;
        let across = |axis: usize| extent[(axis + 1) % 3].min(extent[(axis + 2) % 3]);
        let thin = |share: f64| (0..3).find(|&axis| extent[axis] < share * across(axis));
        let facing = |axis: usize| if sum[axis] < -0.05 * area { -1.0 } else { 1.0 };
        match thin(FLAT) {
            Some(0) => {
                return View {
                    azimuth: 90.0 * facing(0),
                    elevation: 0.0,
                };
            }
            Some(2) => {
                return View {
                    azimuth: 90.0 - 90.0 * facing(2),
                    elevation: 0.0,
                };
            }
            // What lies is seen from above, and straight from there only where there is nothing
            // else to see.
            Some(_) if thin(SHEET).is_some() => {
                return View {
                    azimuth: 0.0,
                    elevation: 90.0 * facing(1),
                };
            }
            Some(_) => {
                return View {
                    elevation: 40.0,
                    ..View::USUAL
                };
            }
            None => {}
        }
        // Of a closed surface the normals cancel. What is open and faces inwards is a room, whose
        // open side they point to; what faces mostly one way is a relief.
        let open = if outward < 0.0 {
            sum.length() > ROOM * area
        } else {
            sum.length() > RELIEF * area
        };
        let level = sum.x.hypot(sum.z);
        match open {
            // Stairs face up as much as forward, and roundings must not decide which of the two
            // counts.
            true if level > (1.0 + 1e-6) * sum.y.abs() => {
                let azimuth = libm::atan2(sum.x, sum.z).to_degrees();
                let straight = 90.0 * (azimuth / 90.0).round();
                View {
                    azimuth: if (azimuth - straight).abs() < 20.0 {
                        straight
                    } else {
                        azimuth
                    },
                    elevation: 0.0,
                }
            }
            true if sum.y > 0.0 => View {
                elevation: 40.0,
                ..View::USUAL
            },
            _ => View::USUAL,
        }
    }

    /// The camera of a vertical field of view in degrees that stands there and shows everything:
    /// the silhouette is in the middle and fills [`FILL`] of the side of the picture that it comes
    /// nearest to, whatever the angle and the picture's aspect.
    pub fn frame(&self, view: View, vertical_fov: f64, aspect: f64) -> Camera {
        let corners = Aabb::around(DVec3::ZERO, DVec3::ONE).corners();
        let points = if self.points.is_empty() {
            &corners[..]
        } else {
            &self.points[..]
        };
        let bounds = Aabb::from_points(points.iter().copied());
        let (centre, size) = (bounds.centre(), bounds.extent().max_element());
        let [right, up, back] = view.axes();
        let half = libm::tan(vertical_fov.to_radians() * 0.5) * FILL;
        let local: Vec<DVec3> = points
            .iter()
            .map(|&p| p - centre)
            .map(|p| DVec3::new(p.dot(right), p.dot(up), p.dot(back)))
            .collect();
        // A camera at (x, y, d) has everything between its sides where |p.x - x| <= slope * (d -
        // p.z): how far the sides lean on both ends.
        let ends = |axis: usize, slope: f64| {
            let lean = |sign: f64| {
                local
                    .iter()
                    .map(|p| sign * p[axis] + slope * p.z)
                    .fold(f64::NEG_INFINITY, f64::max)
            };
            [lean(1.0), lean(-1.0)]
        };
        let slopes = [half * aspect, half];
        let least =
            [0, 1].map(|axis| ends(axis, slopes[axis]).iter().sum::<f64>() / (2.0 * slopes[axis]));
        let nearest = local.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
        // What has no size across the view is seen from as far as it is deep, and a point from a
        // metre.
        let room = if size > 0.0 {
            0.01 * size
        } else {
            centre.abs().max_element().max(1e6) * 1e-6
        };
        let distance = least[0].max(least[1]).max(nearest + room);
        // The slope at which this distance would be the least one: between such sides the
        // silhouette is in the middle.
        let middle = |axis: usize| {
            let (mut low, mut high) = (0.0, slopes[axis]);
            for _ in 0..48 {
                let slope = 0.5 * (low + high);
                let [one, other] = ends(axis, slope);
                if one + other > 2.0 * slope * distance {
                    low = slope
                } else {
                    high = slope
                }
            }
            let [one, other] = ends(axis, high);
            0.5 * (one - other)
        };
        let target = centre + right * middle(0) + up * middle(1);
        // The world's up where that is not along the view.
        let upright = if view.elevation.abs() > 80.0 {
            up
        } else {
            DVec3::Y
        };
        Camera {
            name: "framed".to_owned(),
            pose: Pose::LookAt {
                eye: (target + back * distance).to_array(),
                target: target.to_array(),
                up: upright.to_array(),
            },
            projection: Projection::Pinhole(Pinhole {
                vertical_fov: Some(vertical_fov),
                ..Pinhole::default()
            }),
            aspect: None,
            fit: Default::default(),
            pose_end: None,
            shutter: None,
        }
    }
}

/// Thickness over the shorter side across it up to which something is flat, and up to which it is a
/// sheet.
const FLAT: f64 = 0.15;
const SHEET: f64 = 0.02;

/// Share of the area that is not faced back, of a room with an open side and of a relief.
const ROOM: f64 = 0.1;
const RELIEF: f64 = 0.5;

impl FacingAreas {
    /// Of every so many triangles of a scene.
    fn of(scene: &Scene, lookup: &Lookup<'_>, middle: DVec3, step: usize) -> Self {
        let mut faces = Self::default();
        for shown in all(scene) {
            let Shape::Mesh(name) = &shown.object.shape else {
                continue;
            };
            let Some(data) = lookup.mesh_data(name) else {
                continue;
            };
            let map = shown.map();
            let mirrored = map.matrix3.determinant() < 0.0;
            for corners in data.indices.iter().step_by(step) {
                let [a, b, c] = corners.map(|i| map.transform_point3(position(data, i)));
                let normal = 0.5 * (b - a).cross(c - a) * if mirrored { -1.0 } else { 1.0 };
                if !normal.is_finite() {
                    continue;
                }
                faces.area += normal.length();
                faces.sum += normal;
                faces.outward += normal.dot((a - middle).normalize_or_zero());
            }
        }
        faces
    }
}

fn position(data: &MeshData, index: u32) -> DVec3 {
    data.positions.at(index as usize)
}

#[cfg(test)]
mod tests;
