//! Framing: placement of a camera that shows a whole scene, for a scene without a camera.
//!
//! The silhouette is framed, not a box around it. A silhouette has the outline of the convex hull,
//! for which few points suffice. For each of some thousand directions from the middle of the scene,
//! the farthest point is kept. Directions are taken after scaling the bounding box to a cube, so
//! that needles and sheets are resolved as well as balls. Millions of vertices are visited once.
//! Each later view costs as much as a few thousand points.

mod outline;

use std::cell::Cell;

use glam::DVec3;
use outline::{FINE_CELLS, OutlinePoints, select_outermost_points};
use raywright_bvh::Aabb;

use crate::camera::direction_from_angles;
use crate::generate::all_objects;
use crate::lookup::SceneLookup;
use crate::scene::{Camera, MeshData, Pinhole, Pose, Projection, Scene, Shape};

/// Fraction of the picture's width or height that a framed silhouette fills, whichever limits its
/// size.
pub(crate) const FRAMED_SHARE: f64 = 0.78;

/// Default vertical field of view of a framed camera, in degrees.
pub const FIELD_OF_VIEW: f64 = 40.0;

/// Direction of a framed view: azimuth and elevation of the camera, as seen from its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewAngles {
    /// Degrees about +y: 0 is on the +z side, 90 on the +x side.
    pub azimuth: f64,
    /// Degrees above the horizon, -90 to 90.
    pub elevation: f64,
}

impl ViewAngles {
    /// The default view: slightly from above and from the side.
    pub const DEFAULT: Self = Self {
        azimuth: 30.0,
        elevation: 20.0,
    };

    /// Named views: the six sides and the view along a cube's diagonal.
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

    /// Returns the unit vectors right, up and back of a camera with this view.
    fn camera_axes(self) -> [DVec3; 3] {
        let back = direction_from_angles(self.azimuth.to_radians(), self.elevation.to_radians());
        let right = direction_from_angles((self.azimuth + 90.0).to_radians(), 0.0);
        [right, back.cross(right), back]
    }
}

/// Silhouette of a scene, from which views of the whole scene are computed. Its outermost points
/// determine the distance of a camera. The mean orientation of the scene's surfaces determines the
/// default view.
#[derive(Clone, Debug)]
pub struct Silhouette {
    /// Points whose convex hull approximates that of the scene.
    points: Vec<DVec3>,
    faces: AreaWeightedNormals,
    has_stray_parts: bool,
}

/// Area-weighted sums of surface normals, from which the default view is chosen.
#[derive(Clone, Copy, Debug, Default)]
struct AreaWeightedNormals {
    /// Total area of the examined triangles.
    area: f64,
    /// Sum of the triangles' normals, weighted by area.
    sum: DVec3,
    /// Area-weighted sum of the normals' components away from the scene's middle. It is negative
    /// for surfaces that face inwards.
    outward: f64,
    /// Number of the examined triangles, and of those that stand at more than 60° to the ground.
    triangles: usize,
    standing: usize,
}

/// Approximate number of examined triangles.
const EXAMINED_TRIANGLES: usize = 1 << 18;

impl Silhouette {
    /// Computes the silhouette of all bounded parts of a scene but stray ones.
    pub fn from_scene(scene: &Scene) -> Self {
        let lookup = SceneLookup::new(scene);
        let outlines = OutlinePoints::from_scene(scene, &lookup);
        let view = find_view_bounds(&outlines.object_patches(scene));
        let has_stray_parts = Cell::new(outlines.has_stray_parts);
        let visit_points = |visit: &mut dyn FnMut(DVec3)| {
            outlines.visit_points(scene, &mut |point| match view
                .is_some_and(|view| !contains(&view, point))
            {
                true => has_stray_parts.set(true),
                false => visit(point),
            });
        };
        let points = select_outermost_points(visit_points, FINE_CELLS);
        let middle = Aabb::from_points(points.iter().copied()).centre();
        let faces = AreaWeightedNormals::from_scene(
            scene,
            &lookup,
            middle,
            outlines.triangles / EXAMINED_TRIANGLES + 1,
        );
        Self {
            points,
            faces,
            has_stray_parts: has_stray_parts.get(),
        }
    }

    /// Whether the scene has stray parts, which lie outside the silhouette: at most a thousandth of
    /// the surface, farther away than 250 times the extent of the rest.
    pub fn has_stray_parts(&self) -> bool {
        self.has_stray_parts
    }

    /// Returns the silhouette of a box.
    pub fn from_box(bounds: &Aabb) -> Self {
        let points = if bounds.is_empty() {
            Vec::new()
        } else {
            bounds.corners().to_vec()
        };
        Self {
            points,
            faces: AreaWeightedNormals::default(),
            has_stray_parts: false,
        }
    }

    /// Returns the default view of a scene:
    ///
    /// - a flat object from its front;
    /// - a room through its open side;
    /// - any other scene slightly from above and from the side.
    pub fn default_view(&self) -> ViewAngles {
        let extent = Aabb::from_points(self.points.iter().copied()).extent();
        let AreaWeightedNormals {
            area,
            sum,
            outward,
            triangles,
            standing,
        } = self.faces;
        let across = |axis: usize| extent[(axis + 1) % 3].min(extent[(axis + 2) % 3]);
        let thin = |share: f64| (0..3).find(|&axis| extent[axis] < share * across(axis));
        let facing = |axis: usize| if sum[axis] < -0.05 * area { -1.0 } else { 1.0 };
        match thin(FLAT) {
            Some(0) => {
                return ViewAngles {
                    azimuth: 90.0 * facing(0),
                    elevation: 0.0,
                };
            }
            Some(2) => {
                return ViewAngles {
                    azimuth: 90.0 - 90.0 * facing(2),
                    elevation: 0.0,
                };
            }
            // A flat object that lies on its side is seen obliquely from above, and straight from
            // above only if it is a drawing: its edges are too thin to be visible, and hardly a
            // triangle stands on it, as palms do on an island.
            Some(_) if thin(SHEET).is_some() && 10 * standing <= triangles => {
                return ViewAngles {
                    azimuth: 0.0,
                    elevation: 90.0 * facing(1),
                };
            }
            Some(_) => {
                return ViewAngles {
                    elevation: 40.0,
                    ..ViewAngles::DEFAULT
                };
            }
            None => {}
        }
        // The normals of a closed surface cancel. An open surface that faces inwards is a room, and
        // its normals add up towards the open side; an open surface that faces mostly in one
        // direction is a relief.
        let open = if outward < 0.0 {
            sum.length() > ROOM * area
        } else {
            sum.length() > RELIEF * area
        };
        let level = sum.x.hypot(sum.z);
        match open {
            // Stairs face up as much as forward, and rounding must not decide which of the two is
            // greater.
            true if level > (1.0 + 1e-6) * sum.y.abs() => {
                let azimuth = libm::atan2(sum.x, sum.z).to_degrees();
                let straight = 90.0 * (azimuth / 90.0).round();
                ViewAngles {
                    azimuth: if (azimuth - straight).abs() < 20.0 {
                        straight
                    } else {
                        azimuth
                    },
                    elevation: 0.0,
                }
            }
            true if sum.y > 0.0 => ViewAngles {
                elevation: 40.0,
                ..ViewAngles::DEFAULT
            },
            _ => ViewAngles::DEFAULT,
        }
    }

    /// Returns the camera that shows the whole silhouette from a view. `vertical_fov` is in degrees;
    /// 0 stands for an orthographic camera. The silhouette is centred and fills `FRAMED_SHARE` of
    /// the picture's width or height, whichever limits its size, for every field of view and aspect
    /// ratio.
    pub fn frame_camera(&self, view: ViewAngles, vertical_fov: f64, aspect: f64) -> Camera {
        let corners = Aabb::from_centre(DVec3::ZERO, DVec3::ONE).corners();
        let points = if self.points.is_empty() {
            &corners[..]
        } else {
            &self.points[..]
        };
        let bounds = Aabb::from_points(points.iter().copied());
        let (centre, size) = (bounds.centre(), bounds.extent().max_element());
        let [right, up, back] = view.camera_axes();
        let half = libm::tan(vertical_fov.to_radians() * 0.5) * FRAMED_SHARE;
        let viewed = ViewedPoints {
            points: points
                .iter()
                .map(|&p| p - centre)
                .map(|p| DVec3::new(p.dot(right), p.dot(up), p.dot(back)))
                .collect(),
            slopes: [half * aspect, half],
        };
        // An object without an extent across the view is seen from a distance of a hundredth of its
        // depth, and a point from a metre.
        let room = if size > 0.0 {
            0.01 * size
        } else {
            centre.abs().max_element().max(1e6) * 1e-6
        };
        let is_parallel = vertical_fov == 0.0;
        let height = viewed.parallel_height(aspect) / FRAMED_SHARE;
        // The distance of an orthographic camera does not change its picture.
        let distance = match is_parallel {
            true => 2.0 * size + height.max(room),
            false => viewed.least_distance(room),
        };
        let [x, y] = viewed.silhouette_centre(distance);
        let target = centre + right * x + up * y;
        // The world's up direction, unless the view is nearly along that direction.
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
            projection: match is_parallel {
                true => Projection::Orthographic {
                    height: height.max(room),
                },
                false => Projection::Pinhole(Pinhole {
                    vertical_fov: Some(vertical_fov),
                    ..Pinhole::default()
                }),
            },
            aspect: None,
            fit: Default::default(),
            pose_end: None,
            shutter: None,
        }
    }
}

/// Greatest thickness of a flat object, as a multiple of its shorter side.
const FLAT: f64 = 0.15;
/// Greatest thickness of a sheet, as a multiple of its shorter side. The edges of a sheet are
/// hardly visible.
const SHEET: f64 = 0.02;

/// Least length of the summed normals of a room, as a fraction of its area. A room has an open
/// side, and its surfaces face inwards.
const ROOM: f64 = 0.1;
/// Least length of the summed normals of a relief, as a fraction of its area. Most surfaces of a
/// relief face in one direction.
const RELIEF: f64 = 0.5;

impl AreaWeightedNormals {
    /// Sums the normals of every `step`-th triangle of a scene; `middle` is the scene's middle.
    fn from_scene(scene: &Scene, lookup: &SceneLookup<'_>, middle: DVec3, step: usize) -> Self {
        let mut faces = Self::default();
        for placed_object in all_objects(scene) {
            let Shape::Mesh(name) = &placed_object.object.shape else {
                continue;
            };
            let Some(data) = lookup.mesh_data(name) else {
                continue;
            };
            let map = placed_object.object_to_world();
            let mirrored = map.matrix3.determinant() < 0.0;
            for corners in data.indices.iter().step_by(step) {
                let [a, b, c] =
                    corners.map(|i| map.transform_point3(mesh_vertex_position(data, i)));
                let normal = 0.5 * (b - a).cross(c - a) * if mirrored { -1.0 } else { 1.0 };
                if !normal.is_finite() {
                    continue;
                }
                faces.area += normal.length();
                faces.triangles += 1;
                faces.standing += usize::from(normal.y.abs() < 0.5 * normal.length());
                faces.sum += normal;
                faces.outward += normal.dot((a - middle).normalize_or_zero());
            }
        }
        faces
    }
}

/// Returns the position of a mesh's vertex, in the mesh's own space.
fn mesh_vertex_position(data: &MeshData, index: u32) -> DVec3 {
    data.positions.position(index as usize)
}

// Points in front of a camera that looks along an axis, and the distance from which all of them
// are in the picture.

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

// Stray parts of a scene: surfaces so small and so far away that a view of the whole scene would
// show nothing.

/// Greatest number of surfaces that are examined. Of more surfaces, every n-th is.
const EXAMINED: usize = 1 << 14;
/// Greatest part of the surface that is stray.
const SHARE: f64 = 1e-3;
/// Least distance of a stray part from the other surfaces, in multiples of their extent.
const DISTANCE: f64 = 250.0;

/// Bounds and area of a surface.
pub(super) type Patch = (Aabb, f64);

/// Returns every n-th of some patches, so that few are examined.
pub(super) fn examine(patches: impl Iterator<Item = Patch>, count: usize) -> Vec<Patch> {
    patches
        .step_by(count.div_ceil(EXAMINED).max(1))
        .filter(|(bounds, area)| bounds.extent().is_finite() && area.is_finite())
        .collect()
}

/// Returns the bounds outside of which surfaces are stray; `None` if a greater part of the surface
/// lies there. The other surfaces have their centres within the quantiles of area on each axis.
pub(super) fn find_view_bounds(patches: &[Patch]) -> Option<Aabb> {
    let total: f64 = patches.iter().map(|(_, area)| area).sum();
    let mut centres = Aabb::EMPTY;
    let mut order: Vec<&Patch> = patches.iter().collect();
    for axis in 0..3 {
        let at = |patch: &Patch| patch.0.centre()[axis];
        order.sort_by(|a, b| at(a).total_cmp(&at(b)));
        let mut area = 0.0;
        for patch in &order {
            let before = area;
            area += patch.1;
            if area > SHARE * total && before < (1.0 - SHARE) * total {
                centres.min[axis] = centres.min[axis].min(at(patch));
                centres.max[axis] = centres.max[axis].max(at(patch));
            }
        }
    }
    let body = patches
        .iter()
        .filter(|(bounds, _)| contains(&centres, bounds.centre()))
        .fold(Aabb::EMPTY, |body, (bounds, _)| body.union(*bounds));
    if body.is_empty() {
        return None;
    }
    let margin = DVec3::splat(DISTANCE * body.extent().max_element());
    let view = Aabb {
        min: body.min - margin,
        max: body.max + margin,
    };
    let stray: f64 = patches
        .iter()
        .filter(|(bounds, _)| !contains(&view, bounds.centre()))
        .map(|(_, area)| area)
        .sum();
    (stray <= SHARE * total).then_some(view)
}

/// Whether a box contains a point.
pub(super) fn contains(bounds: &Aabb, point: DVec3) -> bool {
    point.cmpge(bounds.min).all() && point.cmple(bounds.max).all()
}

#[cfg(test)]
mod tests;
