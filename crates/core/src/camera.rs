//! Prepared cameras, which turn film positions into camera rays.

use glam::{DMat3, DVec3};
use raywright_bvh::{Aabb, Ray, Real, Vector};

use crate::motion::{camera_at, camera_moves, exposure, opening, pose_at};
use crate::scene::{Camera as CameraData, Fit, Pinhole, Pose, Projection};

/// A camera prepared for a picture of a fixed size in pixels: generates camera rays from film
/// positions.
#[derive(Clone, Debug)]
pub struct PreparedCamera<R: Real> {
    eye: R::Vec3,
    right: R::Vec3,
    up: R::Vec3,
    forward: R::Vec3,
    /// Width and height of a pixel in film units; the film is one unit high.
    pixel: [R; 2],
    /// Half the picture's size in pixels.
    half: [R; 2],
    kind: CameraKind<R>,
    /// Ray generation of a distant camera.
    far: Option<Box<DistantCamera>>,
    /// Shutter of a camera with rays at different times.
    shutter: Option<Box<Shutter>>,
}

/// Ray cone of a camera (Amanatides, "Ray Tracing with Cones", 1984): the width of one pixel at a
/// distance, for texture footprints and wireframe lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone<R> {
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
    ahead: f64,
}

impl DistantCamera {
    /// Generates a ray that starts close to the scene. Not inlined, so that ray loops of ordinary
    /// cameras do not contain this code.
    #[inline(never)]
    fn generate_ray<R: Real>(&self, x: f64, y: f64, lens: [f32; 2]) -> Ray<R> {
        let ray = self.camera.near_ray(x, y, lens);
        Ray::new(
            R::Vec3::from_f64(ray.at(self.ahead)),
            R::Vec3::from_f64(ray.direction),
        )
        .culling()
    }
}

/// Rounding error of ray origins, as a share of the scene's radius, above which a camera counts as
/// distant. The error stays below a tenth of a pixel.
const FAR: f64 = 1.0 / 65536.0;

#[derive(Clone, Debug)]
enum CameraKind<R: Real> {
    /// `forward` has the length of the focal length.
    Pinhole,
    /// `right` and `up` have the length of the view's height.
    Orthographic,
    /// A pinhole camera with rays that start on a lens and meet at the focus distance.
    ThinLens { radius: R, focus: R },
}

/// Returns the position of the eye, and the orthonormal axes right, up and back of a pose.
pub(crate) fn axes(pose: &Pose) -> (DVec3, DMat3) {
    match *pose {
        // Validation rejects a view along `up`.
        Pose::LookAt { eye, target, up } => (
            eye.into(),
            look_at(eye.into(), target.into(), up.into(), DVec3::X),
        ),
        Pose::Orbit {
            target,
            distance,
            azimuth,
            elevation,
        } => {
            let (a, e) = (azimuth.to_radians(), elevation.to_radians());
            let offset = DVec3::new(
                libm::cos(e) * libm::sin(a),
                libm::sin(e),
                libm::cos(e) * libm::cos(a),
            );
            let target = DVec3::from(target);
            let eye = target + offset * distance;
            (
                eye,
                look_at(
                    eye,
                    target,
                    DVec3::Y,
                    DVec3::new(libm::cos(a), 0.0, -libm::sin(a)),
                ),
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
/// axis if the view is along `up`, as rounding may cause for an eye close to a target far from the
/// origin.
fn look_at(eye: DVec3, target: DVec3, up: DVec3, level: DVec3) -> DMat3 {
    let forward = (target - eye).normalize();
    let right = forward.cross(up).try_normalize().unwrap_or(level);
    DMat3::from_cols(right, right.cross(forward), -forward)
}

/// Returns the focal length for a film one unit high and `aspect` units wide.
fn focal_length(pinhole: &Pinhole, aspect: f64) -> f64 {
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

/// Returns a copy of a ray, component by component. The result of a call that is not inlined lies
/// in memory; without this copy the compiler would keep every ray of the caller in memory.
#[inline(always)]
fn taken_apart<R: Real>(ray: Ray<R>) -> Ray<R> {
    let vector = |v: R::Vec3| R::Vec3::new(v.x(), v.y(), v.z());
    Ray {
        origin: vector(ray.origin),
        direction: vector(ray.direction),
        time: ray.time,
        culls: ray.culls,
    }
}

impl<R: Real> PreparedCamera<R> {
    /// Prepares a camera for a picture of `size` pixels.
    pub fn new(data: &CameraData, size: [u32; 2]) -> Self {
        let [width, height] = size.map(f64::from);
        let shutter = exposure(data).map(|[open, close]| {
            let moving = camera_moves(data).then(|| (data.clone(), size));
            Box::new(Shutter {
                open,
                duration: close - open,
                moving,
                coarseness: 1,
            })
        });
        let (eye, frame) = axes(&pose_at(data, opening(data)));
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
            (Some(_), Fit::Stretch) => [film_width / width, 1.0 / height],
            (Some(_), Fit::Contain) => [by_width.max(1.0) / height; 2],
            (Some(_), Fit::Cover) => [by_width.min(1.0) / height; 2],
        };
        let v = R::Vec3::from_f64;
        Self {
            eye: v(eye),
            right: v(right),
            up: v(up),
            forward: v(forward),
            pixel: pixel.map(R::from_f64),
            half: [R::from_f64(width * 0.5), R::from_f64(height * 0.5)],
            kind,
            far: None,
            shutter,
        }
    }

    /// Prepares a camera as [`Self::new`], for a scene whose bounded part lies within `bounds`.
    /// Rays of a distant camera start at a distance of [`PreparedCamera::ahead`] from the eye, in
    /// front of the sphere around `bounds`.
    pub fn towards(data: &CameraData, size: [u32; 2], bounds: &Aabb) -> Self {
        let camera = Self::new(data, size);
        let radius = bounds.extent().length() * 0.5;
        let (eye, frame) = axes(&pose_at(data, opening(data)));
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
            && ahead * R::ROUNDOFF.to_f64() > FAR * reach
            && ahead.is_finite();
        Self {
            far: far.then(|| {
                Box::new(DistantCamera {
                    camera: PreparedCamera::new(data, size),
                    ahead,
                })
            }),
            ..camera
        }
    }

    /// Returns the camera of a preview with pixels `factor` times as wide and high, counted from
    /// the top left corner of the picture.
    #[must_use]
    pub fn with_larger_pixels(&self, factor: u32) -> Self {
        let mut camera = self.clone();
        camera.pixel = self.pixel.map(|edge| edge * R::from_f64(f64::from(factor)));
        camera.half = self
            .half
            .map(|half| half * R::from_f64(1.0 / f64::from(factor)));
        if let Some(far) = &mut camera.far {
            far.camera = far.camera.with_larger_pixels(factor);
        }
        if let Some(shutter) = &mut camera.shutter {
            shutter.coarseness *= factor;
        }
        camera
    }

    /// Returns the distance from the eye to the origins of the rays, in world units; for an
    /// orthographic camera, the distance from the plane of the eye. Zero unless the camera is
    /// distant.
    #[inline]
    pub fn ahead(&self) -> R {
        self.far
            .as_ref()
            .map_or(R::ZERO, |far| R::from_f64(far.ahead))
    }

    /// Returns the ray cone of a pixel in the middle of the picture, where pixels are widest. The
    /// aperture of a lens is ignored; a moving camera counts in its pose at the opening of the
    /// shutter.
    pub fn cone(&self) -> Cone<R> {
        let pixel = (self.right.length() * self.pixel[0]).max(self.up.length() * self.pixel[1]);
        match self.kind {
            CameraKind::Orthographic => Cone {
                width: pixel,
                spread: R::ZERO,
            },
            CameraKind::Pinhole | CameraKind::ThinLens { .. } => Cone {
                width: R::ZERO,
                spread: pixel * (R::ONE / self.forward.length()),
            },
        }
    }

    /// Projects a point of the world into the picture: returns its position in pixels from the top
    /// left corner, also outside the picture; `None` behind the eye. Approximate for a camera with
    /// a lens; a moving camera counts in its pose at the opening of the shutter.
    pub fn pixel_of(&self, point: DVec3) -> Option<[f64; 2]> {
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
        let [width, height] = self.pixel.map(Real::to_f64);
        let pixel = [
            self.half[0].to_f64() + on_film(right) / width,
            self.half[1].to_f64() - on_film(up) / height,
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
    pub fn ray_during(&self, x: R, y: R, lens: [f32; 2], share: f32) -> Ray<R> {
        match &self.shutter {
            None => self.generate_ray(x, y, lens),
            Some(shutter) => taken_apart(self.timed_ray(shutter, [x, y], lens, share)),
        }
    }

    #[inline(never)]
    fn timed_ray(&self, shutter: &Shutter, [x, y]: [R; 2], lens: [f32; 2], share: f32) -> Ray<R> {
        let time = R::from_f64(shutter.open + shutter.duration * f64::from(share));
        let ray = match &shutter.moving {
            None => self.generate_ray(x, y, lens),
            Some((data, size)) => Self::new(&camera_at(data, time.to_f64()), *size)
                .with_larger_pixels(shutter.coarseness)
                .generate_ray(x, y, lens),
        };
        ray.at_time(time)
    }

    /// Generates the ray through a film position, given in pixels from the top left corner of the
    /// picture. The ray starts at a distance of [`PreparedCamera::ahead`] from the eye. `lens`
    /// holds two uniform numbers in [0, 1), which are read only if [`PreparedCamera::has_lens`].
    #[inline(always)]
    pub fn generate_ray(&self, x: R, y: R, lens: [f32; 2]) -> Ray<R> {
        match &self.far {
            None => self.near_ray(x, y, lens),
            Some(far) => taken_apart(far.generate_ray(x.to_f64(), y.to_f64(), lens)),
        }
    }

    #[inline(always)]
    fn near_ray(&self, x: R, y: R, lens: [f32; 2]) -> Ray<R> {
        let u = (x - self.half[0]) * self.pixel[0];
        let v = (self.half[1] - y) * self.pixel[1];
        let across = self.right * u + self.up * v;
        match self.kind {
            CameraKind::Pinhole => {
                Ray::new(self.eye, (self.forward + across).normalize()).culling()
            }
            CameraKind::Orthographic => Ray::new(self.eye + across, self.forward).culling(),
            CameraKind::ThinLens { radius, focus } => {
                let direction = self.forward + across;
                // The plane of focus is perpendicular to the view.
                let sharp = direction * (focus / self.forward.length());
                let (s, r) = (
                    R::from_f32(lens[0]).sqrt() * radius,
                    R::from_f64(core::f64::consts::TAU) * R::from_f32(lens[1]),
                );
                let origin = self.right * (s * r.cos()) + self.up * (s * r.sin());
                Ray::new(self.eye + origin, (sharp - origin).normalize()).culling()
            }
        }
    }
}

#[cfg(test)]
mod tests;
