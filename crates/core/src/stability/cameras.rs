//! Numerically hard cases F01, F02, F03. Cameras look along their up direction, have a field of
//! view of almost zero, or look straight at edges. Lenses have no aperture.

use glam::DVec3;
use raywright_bvh::stability::verdicts::{
    CaseOutcome, CaseRng, RayCount, Verdict, format_ray_bits, judge_rays, to_scalar,
};
use raywright_bvh::stability::{Measurement, create_treeless_measurement, measure_by_each_kernel};
use raywright_bvh::{
    AcceleratorKind, Geometry, Interval, PrimitiveSet, Ray, Real, Vector, Visibility,
};

use crate::camera::PreparedCamera;
use crate::scene::{Camera as CameraData, Pinhole, Pose, Projection, Scene};
use crate::validate::validate;

/// Width and height of a tested picture in pixels.
const SIZE: u32 = 64;

fn camera_with_pose(pose: Pose, projection: Projection) -> CameraData {
    CameraData {
        name: String::new(),
        pose,
        projection,
        aspect: None,
        fit: Default::default(),
        pose_end: None,
        shutter: None,
    }
}

fn pinhole_of_angle(degrees: f64) -> Pinhole {
    Pinhole {
        vertical_fov: Some(degrees),
        ..Pinhole::default()
    }
}

/// Draws a random camera, often with an extreme position, direction or field of view.
fn draw_camera(rng: &mut CaseRng) -> CameraData {
    let position = rng.sample_point_in_cube() * rng.choose(&[0.0, 1.0, 1e6]);
    let pose = match rng.next_bits() % 3 {
        // The view is along the up direction, or the target is the eye.
        0 => {
            let view =
                rng.choose(&[DVec3::Y, DVec3::NEG_Y, DVec3::ZERO]) * rng.choose(&[1e-3, 1.0, 1e3]);
            Pose::LookAt {
                eye: position.to_array(),
                target: (position + view).to_array(),
                up: [0.0, 1.0, 0.0],
            }
        }
        1 => {
            let elevation = rng.next_sign() * (90.0 - rng.choose(&[1e-12, 1e-9, 1e-6, 1e-3]));
            let (distance, azimuth) = (
                rng.choose(&[1e-3, 1.0, 1e3]),
                rng.next_uniform(-180.0, 180.0),
            );
            Pose::Orbit {
                target: position.to_array(),
                distance,
                azimuth,
                elevation,
            }
        }
        _ => {
            let target = position + rng.sample_direction() * rng.choose(&[1.0, 1e3]);
            Pose::LookAt {
                eye: position.to_array(),
                target: target.to_array(),
                up: [0.0, 1.0, 0.0],
            }
        }
    };
    camera_with_pose(
        pose,
        Projection::Pinhole(pinhole_of_angle(rng.choose(&[1e-3, 1.0, 40.0, 179.9]))),
    )
}

/// Measures case F01: degenerate cameras. A camera passes the test if validation refuses it.
/// Otherwise, neighbouring pixels must have different rays with finite unit directions.
pub fn measure_degenerate_views<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let outcome = judge_rays("F01", 501, 4000, rays, |rng| {
        let data = draw_camera(rng);
        let scene = Scene {
            cameras: vec![data.clone()],
            ..Scene::default()
        };
        if !validate(&scene).is_empty() {
            return Verdict::Right(0.0);
        }
        let camera = PreparedCamera::<R>::new(&data, [SIZE; 2]);
        let at = |x: u32, y: u32| {
            camera.generate_ray(
                R::from_f64(f64::from(x) + 0.5),
                R::from_f64(f64::from(y) + 0.5),
                [0.0; 2],
            )
        };
        let (x, y) = (
            rng.next_bits() as u32 % (SIZE - 1),
            rng.next_bits() as u32 % (SIZE - 1),
        );
        let all = [at(x, y), at(x + 1, y), at(x, y + 1)].map(|ray| ray.direction);
        let off = all
            .map(|d| (d.to_f64().length() - 1.0).abs())
            .into_iter()
            .fold(0.0, f64::max);
        let is_number = all.iter().all(|d| d.is_finite());
        let is_distinct = all[0] != all[1] && all[0] != all[2] && all[1] != all[2];
        Verdict::from_condition(is_number && is_distinct, || {
            format!("neighbouring pixels need finite and different ray directions, but {data:?} gives {all:?} at pixel {x}, {y}")
        })
        .and_then(|| {
            Verdict::from_error(off, 4.0 * R::ROUNDOFF.to_f64(), || {
                format!("deviation from length 1 of the ray directions {all:?} at pixel {x}, {y} of {data:?}")
            })
        })
    });
    vec![create_treeless_measurement::<R>(outcome)]
}

/// Measures case F03: degenerate lenses. A lens without an aperture must equal a pinhole to the
/// bit. A lens with a tiny or huge focus distance must give rays with unit directions.
pub fn measure_degenerate_lenses<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let outcome = judge_rays("F03", 502, 20_000, rays, |rng| {
        let eye = rng.sample_point_in_cube() * 10.0;
        let pose = Pose::LookAt {
            eye: eye.to_array(),
            target: (eye + rng.sample_direction()).to_array(),
            up: [0.1, 1.0, 0.2],
        };
        let (pinhole, focus_distance) = (
            pinhole_of_angle(rng.choose(&[1.0, 40.0, 120.0])),
            rng.choose(&[1e-6, 1.0, 1e7]),
        );
        let lens = |aperture_radius| {
            let pinhole = pinhole.clone();
            PreparedCamera::<R>::new(
                &camera_with_pose(
                    pose.clone(),
                    Projection::ThinLens {
                        pinhole,
                        aperture_radius,
                        focus_distance,
                    },
                ),
                [SIZE; 2],
            )
        };
        let [x, y] = [rng.next_in_unit_interval(), rng.next_in_unit_interval()]
            .map(|u| R::from_f64(u * f64::from(SIZE)));
        let on_lens = [
            rng.next_in_unit_interval() as f32,
            rng.next_in_unit_interval() as f32,
        ]
        .map(|u| u.min(1.0 - 6e-8));
        let (without, plain) = (
            lens(0.0).generate_ray(x, y, on_lens),
            PreparedCamera::<R>::new(
                &camera_with_pose(pose.clone(), Projection::Pinhole(pinhole.clone())),
                [SIZE; 2],
            )
            .generate_ray(x, y, on_lens),
        );
        let bits = |ray: &Ray<R>| {
            [ray.origin, ray.direction].map(|v| v.to_f64().to_array().map(f64::to_bits))
        };
        let open = lens(rng.choose(&[1e-6, 1e-2, 1.0])).generate_ray(x, y, on_lens);
        let off = (open.direction.to_f64().length() - 1.0).abs();
        Verdict::from_condition(bits(&without) == bits(&plain), || {
            format!("a lens of radius 0 gives {without:?} instead of the pinhole's {plain:?}")
        })
        .and_then(|| {
            Verdict::from_error(off, 4.0 * R::ROUNDOFF.to_f64(), || {
                format!("deviation from length 1 of the direction of {open:?}, for a lens focused at {focus_distance:e}")
            })
        })
    });
    vec![create_treeless_measurement::<R>(outcome)]
}

/// Returns a square lattice of two triangles a cell, in the plane across an axis, with its middle
/// at the origin. It has `cells` cells of edge 1 along each side.
fn triangle_lattice<R: Real>(axis: usize, cells: i32) -> Geometry<R> {
    let (x, y) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
    let mut group = PrimitiveSet::<R>::default();
    for cell in 0..cells * cells {
        let corner =
            x * f64::from(cell % cells - cells / 2) + y * f64::from(cell / cells - cells / 2);
        for face in [
            [corner, corner + x, corner + x + y],
            [corner, corner + x + y, corner + y],
        ] {
            group
                .add_triangle(face.map(|p| to_scalar::<R>(p)), Visibility::default())
                .expect("finite corners");
        }
    }
    Geometry::new(group, AcceleratorKind::default())
}

/// Measures case F02: a camera that looks straight at the middle of a lattice of triangles. Ray
/// directions contain positive and negative zeros, and rays lie in planes through edges. The
/// picture has an odd number of pixels, and the ray of each pixel must hit the lattice.
pub fn measure_symmetric_views<R: Real>(rays: RayCount) -> Vec<Measurement> {
    const CELLS: i32 = 20;
    /// Number of pixels along each side: one per half cell of the lattice, without the border.
    const ODD: u32 = 2 * CELLS as u32 - 1;
    const FAR: f64 = 10.0;
    let height = f64::from(ODD) * 0.5;
    let degrees = 2.0 * libm::atan(0.5 * height / FAR).to_degrees();
    measure_by_each_kernel(
        (0..3).map(|axis| triangle_lattice(axis, CELLS)).collect(),
        |trees| {
            let view = |view: usize| {
                let (axis, side) = (view / 4, [1.0, -1.0][view % 2]);
                let (right, up, back) = (
                    DVec3::AXES[(axis + 1) % 3] * side,
                    DVec3::AXES[(axis + 2) % 3],
                    DVec3::AXES[axis] * side,
                );
                let [eye, right, up, back] = [back * FAR, right, up, back].map(|v| v.to_array());
                let projection = if (view / 2).is_multiple_of(2) {
                    Projection::Orthographic { height }
                } else {
                    Projection::Pinhole(pinhole_of_angle(degrees))
                };
                let camera = PreparedCamera::<R>::new(
                    &camera_with_pose(
                        Pose::Axes {
                            eye,
                            right,
                            up,
                            back,
                        },
                        projection,
                    ),
                    [ODD; 2],
                );
                // The rays are so few that all are traced for any requested number.
                judge_rays("F02", 503, ODD * ODD, rays, |rng| {
                    let [x, y] = [rng.ray_index() as u32 % ODD, rng.ray_index() as u32 / ODD];
                    let ray = camera.generate_ray(
                        R::from_f64(f64::from(x) + 0.5),
                        R::from_f64(f64::from(y) + 0.5),
                        [0.0; 2],
                    );
                    let is_seen = trees[axis]
                        .closest(&ray, Interval::positive(), &mut ())
                        .is_some();
                    Verdict::from_condition(is_seen, || {
                        format!(
                            "the ray misses the lattice that fills the picture, in view {view}, pixel {x}, {y}{}",
                            format_ray_bits(&ray)
                        )
                    })
                })
            };
            (0..12).map(view).reduce(CaseOutcome::merge).expect("views")
        },
    )
}
