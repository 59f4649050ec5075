//! Numerically hard cases F01, F02, F03. Cameras look along their up direction, have a field of
//! view of almost zero, or look straight at edges. Lenses have no aperture.

use raywright_bvh::stability::meshes::{create_lattice, rotated_axes, triangles};
use raywright_bvh::stability::prelude::*;

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

fn look_along(eye: DVec3, view: DVec3, up: [f64; 3]) -> Pose {
    Pose::LookAt {
        eye: eye.to_array(),
        target: (eye + view).to_array(),
        up,
    }
}

/// Generates the ray through a place of the picture, in pixels from its corner.
fn generate_ray<R: Real>(camera: &PreparedCamera<R>, place: [f64; 2], on_lens: [f32; 2]) -> Ray<R> {
    let [x, y] = place.map(R::from_f64);
    camera.generate_ray(x, y, on_lens)
}

/// Judges the length of a direction, which is 1 within four roundings.
fn judge_length<R: Real>(direction: R::Vec3) -> Verdict {
    let off = (direction.to_f64().length() - 1.0).abs();
    within(off, 4.0 * R::ROUNDOFF.to_f64(), || {
        format!("deviation from length 1 of {direction:?}")
    })
}

/// Draws a random camera, often with an extreme position, direction or field of view.
fn draw_camera(rng: &mut CaseRng) -> CameraData {
    let position = rng.sample_point_in_cube() * rng.choose(&[0.0, 1.0, 1e6]);
    let pose = match rng.next_bits() % 3 {
        // The view is along the up direction, or the target is the eye.
        0 => {
            let view = rng.choose(&[DVec3::Y, DVec3::NEG_Y, DVec3::ZERO]);
            look_along(
                position,
                view * rng.choose(&[1e-3, 1.0, 1e3]),
                [0.0, 1.0, 0.0],
            )
        }
        1 => Pose::Orbit {
            elevation: rng.next_sign() * (90.0 - rng.choose(&[1e-12, 1e-9, 1e-6, 1e-3])),
            target: position.to_array(),
            distance: rng.choose(&[1e-3, 1.0, 1e3]),
            azimuth: rng.next_uniform(-180.0, 180.0),
        },
        _ => {
            let view = rng.sample_direction() * rng.choose(&[1.0, 1e3]);
            look_along(position, view, [0.0, 1.0, 0.0])
        }
    };
    let angle = rng.choose(&[1e-3, 1.0, 40.0, 179.9]);
    camera_with_pose(pose, Projection::Pinhole(pinhole_of_angle(angle)))
}

/// Cases of cameras.
pub(super) fn cases<R: Real>() -> Vec<Case<R>> {
    vec![
        // Degenerate cameras. A camera passes the test if validation refuses it. Otherwise,
        // neighbouring pixels must have different rays with finite unit directions.
        ("F01", |trial| {
            trial.judge("", (501, 4000), LIBRARY, |rng, _| {
                let data = draw_camera(rng);
                let scene = Scene {
                    cameras: vec![data.clone()],
                    ..Scene::default()
                };
                if !validate(&scene).is_empty() {
                    return Verdict::Right(0.0);
                }
                let camera = PreparedCamera::<R>::new(&data, [SIZE; 2]);
                let [x, y] = [(); 2].map(|()| (rng.next_bits() % u64::from(SIZE - 1)) as f64 + 0.5);
                let [a, b, c] = [[x, y], [x + 1.0, y], [x, y + 1.0]]
                    .map(|place| generate_ray(&camera, place, [0.0; 2]).direction);
                let is_distinct = a != b && a != c && b != c;
                require(is_distinct, || {
                    format!("equal directions at {x}, {y} of {data:?}")
                }) & [a, b, c]
                    .map(judge_length::<R>)
                    .into_iter()
                    .fold(Verdict::Right(0.0), |a, b| a & b)
            });
        }),
        // Degenerate lenses. A lens without an aperture must equal a pinhole to the bit. A lens with
        // a tiny or huge focus distance must give rays with unit directions.
        ("F03", |trial| {
            trial.judge("", (502, 20_000), LIBRARY, |rng, _| {
                let eye = rng.sample_point_in_cube() * 10.0;
                let pose = look_along(eye, rng.sample_direction(), [0.1, 1.0, 0.2]);
                let pinhole = pinhole_of_angle(rng.choose(&[1.0, 40.0, 120.0]));
                let focus_distance = rng.choose(&[1e-6, 1.0, 1e7]);
                let place = rng.next_numbers().map(|u: f64| u * f64::from(SIZE));
                let on_lens = rng.next_numbers().map(|u: f64| (u as f32).min(1.0 - 6e-8));
                let ray = |projection| {
                    let data = camera_with_pose(pose.clone(), projection);
                    generate_ray(&PreparedCamera::<R>::new(&data, [SIZE; 2]), place, on_lens)
                };
                let lens = |aperture_radius| {
                    let pinhole = pinhole.clone();
                    ray(Projection::ThinLens {
                        pinhole,
                        aperture_radius,
                        focus_distance,
                    })
                };
                // Debug formatting tells the bits.
                let bits = |ray| format!("{ray:?}");
                let is_pinhole = bits(lens(0.0)) == bits(ray(Projection::Pinhole(pinhole.clone())));
                let label = || format!("a lens of radius 0 and focus {focus_distance:e}: {pose:?}");
                let open = lens(rng.choose(&[1e-6, 1e-2, 1.0]));
                require(is_pinhole, label) & judge_length::<R>(open.direction)
            });
        }),
        // A camera that looks straight at the middle of a lattice of triangles. Ray directions
        // contain positive and negative zeros, and rays lie in planes through edges. The picture has
        // an odd number of pixels, and the ray of each pixel must hit the lattice.
        ("F02", |trial| {
            const CELLS: u32 = 20;
            // Number of pixels along each side: one per half cell of the lattice, without the border.
            const ODD: u32 = 2 * CELLS - 1;
            const FAR: f64 = 10.0;
            let height = f64::from(ODD) * 0.5;
            let degrees = 2.0 * libm::atan(0.5 * height / FAR).to_degrees();
            let lattice = |axis| {
                let [_, x, y] = rotated_axes(axis);
                let corner = (x + y) * -0.5 * f64::from(CELLS);
                triangles(&create_lattice(corner, [x, y], CELLS as usize))
            };
            trial.build_scenes((0..3).map(lattice).collect());
            for view in 0..12 {
                let [back, right, up] = rotated_axes(view / 4);
                let side = if view % 2 == 0 { 1.0 } else { -1.0 };
                let [eye, right, up, back] =
                    [back * (side * FAR), right * side, up, back * side].map(|v| v.to_array());
                let projection = if view / 2 % 2 == 0 {
                    Projection::Orthographic { height }
                } else {
                    Projection::Pinhole(pinhole_of_angle(degrees))
                };
                let pose = Pose::Axes {
                    eye,
                    right,
                    up,
                    back,
                };
                let camera = camera_with_pose(pose, projection);
                let camera = PreparedCamera::<R>::new(&camera, [ODD; 2]);
                // The rays are so few that all are traced for any requested number.
                trial.judge_rays(&format!("view {view}"), (503, ODD * ODD), |rng, _| {
                    let index = rng.ray_index() as u32;
                    let place = [index % ODD, index / ODD].map(|pixel| f64::from(pixel) + 0.5);
                    let ray = to_precision(generate_ray(&camera, place, [0.0; 2]));
                    Ok([TestRay::with_any_hit(view / 4, ray)])
                });
            }
        }),
    ]
}
