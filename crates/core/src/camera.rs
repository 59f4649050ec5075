//! Prepared cameras, which turn film positions into camera rays.

use glam::{DMat3, DVec3};
use raywright_bvh::{Aabb, Ray, Real, Vector};

use crate::motion::{camera_at, camera_moves, pose_at, shutter_interval, shutter_opening};
use crate::scene::{AspectFit, Camera as CameraData, Pinhole, Pose, Projection};

/// Generator of camera rays from film positions, for a picture of a fixed size in pixels.
#[derive(Clone, Debug)]
pub struct PreparedCamera<R: Real> {
    eye: R::Vec3,
    right: R::Vec3,
    up: R::Vec3,
    forward: R::Vec3,
    /// Width and height of a pixel in film units; the film is one unit high.
    pixel_size: [R; 2],
    /// Half the picture's size in pixels.
    half_size: [R; 2],
    kind: CameraKind<R>,
    /// Ray generation of a distant camera.
    distant: Option<Box<DistantCamera>>,
    /// Shutter of a camera with rays at different times.
    shutter: Option<Box<Shutter>>,
}

/// Ray cone of a camera (Amanatides, "Ray Tracing with Cones", 1984): the width of one pixel at a
/// distance, for texture footprints and wireframe lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RayCone<R> {
    /// Width at the origin, in world units.
    pub width: R,
    /// Increase of the width per unit of distance.
    pub spread: R,
}

/// Exposure interval of a camera, and the scene's data of a moving camera. A moving camera is
/// prepared anew for each ray, in `f64` from the scene's numbers: moving cameras are rare, and
/// their rays are as exact as those of a static camera. Rays of a moving camera start at the eye,
/// even far from the scene.
#[derive(Clone, Debug)]
struct Shutter {
    open: f64,
    duration: f64,
    moving: Option<(CameraData, [u32; 2])>,
    /// Edge of a pixel of this camera, in pixels of the moving camera's picture: above 1 for a
    /// preview.
    coarseness: u32,
}

/// Ray generation of a camera so distant that coordinates near the eye, rounded to the precision,
/// do not resolve neighbouring pixels. Rays are computed in `f64`, and their origins are moved
/// forward to the scene before rounding, so the eye's distance has no effect.
#[derive(Clone, Debug)]
struct DistantCamera {
    camera: PreparedCamera<f64>,
    skipped_distance: f64,
}

impl DistantCamera {
    /// Generates a ray that starts close to the scene. Not inlined, so that ray loops of ordinary
    /// cameras do not contain this code.
    #[inline(never)]
    fn generate_ray<R: Real>(&self, x: f64, y: f64, lens: [f32; 2]) -> Ray<R> {
        let ray = self.camera.generate_ray_from_eye(x, y, lens);
        Ray::new(
            R::Vec3::from_f64(ray.at(self.skipped_distance)),
            R::Vec3::from_f64(ray.direction),
        )
        .as_camera_ray()
    }
}

/// Rounding error of ray origins, as a share of the scene's radius, above which a camera counts as
/// distant. The error stays below a tenth of a pixel.
const DISTANT_ROUNDING: f64 = 1.0 / 65536.0;

/// Projection of a camera.
#[derive(Clone, Debug)]
enum CameraKind<R: Real> {
    /// A pinhole camera. The length of `forward` is the focal length.
    Pinhole,
    /// An orthographic camera. The length of `right` and of `up` is the height of the view.
    Orthographic,
    /// A pinhole camera with rays that start on a lens and meet at the focus distance.
    ThinLens { radius: R, focus: R },
}

/// Returns a copy of a ray, component by component. The result of a call that is not inlined lies
/// in memory; without this copy the compiler would keep every ray of the caller in memory.
#[inline(always)]
fn copy_ray_by_component<R: Real>(ray: Ray<R>) -> Ray<R> {
    let vector = |v: R::Vec3| R::Vec3::new(v.x(), v.y(), v.z());
    Ray {
        origin: vector(ray.origin),
        direction: vector(ray.direction),
        time: ray.time,
        is_camera_ray: ray.is_camera_ray,
    }
}

impl<R: Real> PreparedCamera<R> {
    /// Prepares a camera for a picture of `size` pixels.
    pub fn new(data: &CameraData, size: [u32; 2]) -> Self {
        let [width, height] = size.map(f64::from);
        let shutter = shutter_interval(data).map(|[open, close]| {
            let moving = camera_moves(data).then(|| (data.clone(), size));
            Box::new(Shutter {
                open,
                duration: close - open,
                moving,
                coarseness: 1,
            })
        });
        let (eye, frame) = eye_and_axes(&pose_at(data, shutter_opening(data)));
        let film_width = data.aspect.unwrap_or(width / height);
        let (mut right, mut up, mut forward) = (frame.x_axis, frame.y_axis, -frame.z_axis);
        let kind = match &data.projection {
            Projection::Pinhole(pinhole) => {
                forward *= focal_length(pinhole, film_width);
                CameraKind::Pinhole
            }
            Projection::Orthographic { height } => {
                right *= *height;
                up *= *height;
                CameraKind::Orthographic
            }
            Projection::ThinLens {
                pinhole,
                aperture_radius,
                focus_distance,
            } => {
                forward *= focal_length(pinhole, film_width);
                if *aperture_radius == 0.0 {
                    CameraKind::Pinhole
                } else {
                    CameraKind::ThinLens {
                        radius: R::from_f64(*aperture_radius),
                        focus: R::from_f64(*focus_distance),
                    }
                }
            }
        };
        // For a film of the picture's aspect ratio, both directions use exactly the same unit.
        let by_width = film_width * height / width;
        let pixel = match (data.aspect, data.fit) {
            (None, _) => [1.0 / height; 2],
            (Some(_), AspectFit::Stretch) => [film_width / width, 1.0 / height],
            (Some(_), AspectFit::Contain) => [by_width.max(1.0) / height; 2],
            (Some(_), AspectFit::Cover) => [by_width.min(1.0) / height; 2],
        };
        let v = R::Vec3::from_f64;
        Self {
            eye: v(eye),
            right: v(right),
            up: v(up),
            forward: v(forward),
            pixel_size: pixel.map(R::from_f64),
            half_size: [R::from_f64(width * 0.5), R::from_f64(height * 0.5)],
            kind,
            distant: None,
            shutter,
        }
    }

    /// Prepares a camera as [`Self::new`], for a scene whose bounded part lies within `bounds`.
    /// Rays of a distant camera start at a distance of [`PreparedCamera::eye_to_origin_distance`] from
    /// the eye, in front of the sphere around `bounds`.
    pub fn for_scene_bounds(data: &CameraData, size: [u32; 2], bounds: &Aabb) -> Self {
        let camera = Self::new(data, size);
        let radius = bounds.extent().length() * 0.5;
        let (eye, frame) = eye_and_axes(&pose_at(data, shutter_opening(data)));
        let direction = bounds.centre() - eye;
        let (distance, reach) = match &data.projection {
            Projection::Orthographic { .. } => (-direction.dot(frame.z_axis), radius),
            Projection::Pinhole(_) => (direction.length(), radius),
            Projection::ThinLens {
                aperture_radius, ..
            } => (direction.length(), radius + aperture_radius),
        };
        // Rounded to the precision, so that every use adds the same distance between eye and ray
        // origin.
        let ahead = R::from_f64(distance - 2.0 * reach).to_f64();
        let moves = camera
            .shutter
            .as_ref()
            .is_some_and(|shutter| shutter.moving.is_some());
        let far = !moves
            && !bounds.is_empty()
            && ahead * R::ROUNDOFF.to_f64() > DISTANT_ROUNDING * reach
            && ahead.is_finite();
        Self {
            distant: far.then(|| {
                Box::new(DistantCamera {
                    camera: PreparedCamera::new(data, size),
                    skipped_distance: ahead,
                })
            }),
            ..camera
        }
    }

    /// Returns the camera of a preview, whose pixels are `factor` times as wide and high as the
    /// pixels of the picture. The first large pixel lies in the top left corner of the picture.
    #[must_use]
    pub fn with_preview_pixels(&self, factor: u32) -> Self {
        let mut camera = self.clone();
        camera.pixel_size = self
            .pixel_size
            .map(|edge| edge * R::from_f64(f64::from(factor)));
        camera.half_size = self
            .half_size
            .map(|half| half * R::from_f64(1.0 / f64::from(factor)));
        if let Some(far) = &mut camera.distant {
            far.camera = far.camera.with_preview_pixels(factor);
        }
        if let Some(shutter) = &mut camera.shutter {
            shutter.coarseness *= factor;
        }
        camera
    }

    /// Returns the distance from the eye to the origins of the rays, in world units; for an
    /// orthographic camera, the distance from the plane of the eye. Zero unless the camera
    /// is so far from the scene that its rays start nearer to the scene than the eye.
    #[inline]
    pub fn eye_to_origin_distance(&self) -> R {
        self.distant
            .as_ref()
            .map_or(R::ZERO, |far| R::from_f64(far.skipped_distance))
    }

    /// Returns the ray cone of a pixel in the middle of the picture, where pixels are widest. The
    /// aperture of a lens is ignored; a moving camera counts in its pose at the opening of the
    /// shutter.
    pub(crate) fn ray_cone(&self) -> RayCone<R> {
        let pixel =
            (self.right.length() * self.pixel_size[0]).max(self.up.length() * self.pixel_size[1]);
        match self.kind {
            CameraKind::Orthographic => RayCone {
                width: pixel,
                spread: R::ZERO,
            },
            CameraKind::Pinhole | CameraKind::ThinLens { .. } => RayCone {
                width: R::ZERO,
                spread: pixel * (R::ONE / self.forward.length()),
            },
        }
    }

    /// Projects a point of the world into the picture: returns its position in pixels from the top
    /// left corner, also outside the picture; `None` behind the eye. Approximate for a camera with
    /// a lens; a moving camera counts in its pose at the opening of the shutter.
    pub fn project_to_pixel(&self, point: DVec3) -> Option<[f64; 2]> {
        let [eye, right, up, forward] =
            [self.eye, self.right, self.up, self.forward].map(Vector::to_f64);
        let direction = point - eye;
        let depth = direction.dot(forward) / forward.length_squared();
        let scale = if matches!(self.kind, CameraKind::Orthographic) {
            1.0
        } else {
            depth
        };
        let on_film = |axis: DVec3| direction.dot(axis) / (scale * axis.length_squared());
        let [width, height] = self.pixel_size.map(Real::to_f64);
        let pixel = [
            self.half_size[0].to_f64() + on_film(right) / width,
            self.half_size[1].to_f64() - on_film(up) / height,
        ];
        (depth > 0.0 && pixel.iter().all(|x| x.is_finite())).then_some(pixel)
    }

    /// Whether rays need a point on a lens.
    pub fn has_lens(&self) -> bool {
        matches!(self.kind, CameraKind::ThinLens { .. })
    }

    /// Whether rays need a time within the exposure interval.
    pub fn has_shutter(&self) -> bool {
        self.shutter.is_some()
    }

    /// Generates a ray as [`PreparedCamera::generate_ray`], at the time given by a share, 0 to 1,
    /// of the exposure interval. The share is ignored without a shutter.
    #[inline]
    pub fn generate_timed_ray(&self, x: R, y: R, lens: [f32; 2], share: f32) -> Ray<R> {
        match &self.shutter {
            None => self.generate_ray(x, y, lens),
            Some(shutter) => {
                copy_ray_by_component(self.generate_shutter_ray(shutter, [x, y], lens, share))
            }
        }
    }

    /// Generates a ray of a camera with a shutter, at the time given by a share of the exposure
    /// interval.
    #[inline(never)]
    fn generate_shutter_ray(
        &self,
        shutter: &Shutter,
        [x, y]: [R; 2],
        lens: [f32; 2],
        share: f32,
    ) -> Ray<R> {
        let time = R::from_f64(shutter.open + shutter.duration * f64::from(share));
        let ray = match &shutter.moving {
            None => self.generate_ray(x, y, lens),
            Some((data, size)) => Self::new(&camera_at(data, time.to_f64()), *size)
                .with_preview_pixels(shutter.coarseness)
                .generate_ray(x, y, lens),
        };
        ray.with_time(time)
    }

    /// Generates the ray through a film position, given in pixels from the top left corner of the
    /// picture. The ray starts at a distance of [`PreparedCamera::eye_to_origin_distance`] from the eye.
    /// `lens` holds two uniform numbers in [0, 1), which are read only if
    /// [`PreparedCamera::has_lens`].
    #[inline(always)]
    pub fn generate_ray(&self, x: R, y: R, lens: [f32; 2]) -> Ray<R> {
        match &self.distant {
            None => self.generate_ray_from_eye(x, y, lens),
            Some(far) => copy_ray_by_component(far.generate_ray(x.to_f64(), y.to_f64(), lens)),
        }
    }

    /// Generates the ray through a film position. The ray starts at the eye, on the lens, or on the
    /// plane of the eye.
    #[inline(always)]
    fn generate_ray_from_eye(&self, x: R, y: R, lens: [f32; 2]) -> Ray<R> {
        let u = (x - self.half_size[0]) * self.pixel_size[0];
        let v = (self.half_size[1] - y) * self.pixel_size[1];
        let across = self.right * u + self.up * v;
        match self.kind {
            CameraKind::Pinhole => {
                Ray::new(self.eye, (self.forward + across).normalize()).as_camera_ray()
            }
            CameraKind::Orthographic => Ray::new(self.eye + across, self.forward).as_camera_ray(),
            CameraKind::ThinLens { radius, focus } => {
                let direction = self.forward + across;
                // The plane of focus is perpendicular to the view.
                let sharp = direction * (focus / self.forward.length());
                let (s, r) = (
                    R::from_f32(lens[0]).sqrt() * radius,
                    R::from_f64(core::f64::consts::TAU) * R::from_f32(lens[1]),
                );
                let origin = self.right * (s * r.cos()) + self.up * (s * r.sin());
                Ray::new(self.eye + origin, (sharp - origin).normalize()).as_camera_ray()
            }
        }
    }
}

// Eye, axes and focal length of a camera as the scene file gives them.

impl Pose {
    /// Returns the position of the eye in world coordinates.
    pub fn eye(&self) -> DVec3 {
        match *self {
            Self::LookAt { eye, .. } | Self::Axes { eye, .. } => eye.into(),
            Self::Orbit {
                target,
                distance,
                azimuth,
                elevation,
            } => {
                let back = direction_from_angles(azimuth.to_radians(), elevation.to_radians());
                DVec3::from(target) + back * distance
            }
        }
    }
}

/// Returns the unit direction of an azimuth and an elevation in radians. Azimuth 0 is +z, and a
/// quarter turn is +x.
pub(crate) fn direction_from_angles(azimuth: f64, elevation: f64) -> DVec3 {
    let (sin, cos) = libm::sincos(azimuth);
    let (height, level) = libm::sincos(elevation);
    DVec3::new(level * sin, height, level * cos)
}

/// Returns the position of the eye, and the orthonormal axes right, up and back of a pose.
pub(crate) fn eye_and_axes(pose: &Pose) -> (DVec3, DMat3) {
    match *pose {
        // Validation rejects a view along `up`.
        Pose::LookAt { eye, target, up } => (
            eye.into(),
            look_at(eye.into(), target.into(), up.into(), DVec3::X),
        ),
        Pose::Orbit {
            target, azimuth, ..
        } => {
            let a = azimuth.to_radians();
            let level = DVec3::new(libm::cos(a), 0.0, -libm::sin(a));
            (
                pose.eye(),
                look_at(pose.eye(), target.into(), DVec3::Y, level),
            )
        }
        Pose::Axes {
            eye,
            right,
            up,
            back,
        } => (
            eye.into(),
            DMat3::from_cols(right.into(), up.into(), back.into()),
        ),
    }
}

/// Returns the axes right, up and back of a view from `eye` to `target`. `level` replaces the right
/// axis if the view is along `up`. Rounding may cause this for an eye close to a target far from
/// the origin.
fn look_at(eye: DVec3, target: DVec3, up: DVec3, level: DVec3) -> DMat3 {
    let forward = (target - eye).normalize();
    let right = forward.cross(up).try_normalize().unwrap_or(level);
    DMat3::from_cols(right, right.cross(forward), -forward)
}

/// Returns the focal length for a film one unit high and `aspect` units wide.
pub(super) fn focal_length(pinhole: &Pinhole, aspect: f64) -> f64 {
    let from_degrees = |fov: f64| 0.5 / libm::tan(fov.to_radians() * 0.5);
    match *pinhole {
        Pinhole {
            vertical_fov: Some(fov),
            ..
        } => from_degrees(fov),
        Pinhole {
            horizontal_fov: Some(fov),
            ..
        } => from_degrees(fov) * aspect,
        Pinhole {
            focal_length: Some(length),
            ..
        } => length,
        // Validation requires one of the three.
        _ => from_degrees(45.0),
    }
}

#[cfg(test)]
mod tests;
