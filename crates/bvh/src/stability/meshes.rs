//! Cases P21, P22, T03, T06, T07 and T10: flat lattices of cells, and closed meshes of any size and
//! position. No ray may pass through them.

use glam::Vec3Swizzles;

use super::prelude::*;
use super::textbook;

/// Corners of triangles, exact in f32, counter-clockwise as seen from outside. A corner that faces
/// share has the same bits in each.
pub type Mesh = Vec<[DVec3; 3]>;

/// Creates an icosahedron on the unit sphere, with each face subdivided into four, `levels` times.
pub fn create_icosphere(levels: u32) -> Mesh {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let corners = [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)].map(|(a, b)| {
        let corner = DVec3::new(a, b, 0.0);
        [corner, corner.zxy(), corner.yzx()]
    });
    let corners = corners.as_flattened();
    let is_edge = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
    let mut faces = vec![];
    for (i, &a) in corners.iter().enumerate() {
        for (&b, &c) in corners[i..]
            .iter()
            .flat_map(|b| corners[i..].iter().map(move |c| (b, c)))
        {
            let is_outward = (b - a).cross(c - a).dot(a) > 0.0;
            if is_edge(a, b) && is_edge(b, c) && is_edge(c, a) && is_outward {
                faces.push([a, b, c].map(DVec3::normalize));
            }
        }
    }
    for _ in 0..levels {
        let refine = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(refine).collect();
    }
    faces
        .into_iter()
        .map(|face| face.map(round_to_f32))
        .collect()
}

/// Returns the axis with this index, and the two after it.
pub fn rotated_axes(axis: usize) -> [DVec3; 3] {
    [0, 1, 2].map(|next| DVec3::AXES[(axis + next) % 3])
}

/// Creates a flat lattice of square cells with two triangles per cell, with `cells` cells along each
/// side. It begins at `corner`, and `x` and `y` are the sides of a cell.
pub fn create_lattice(corner: DVec3, [x, y]: [DVec3; 2], cells: usize) -> Mesh {
    let cell = |cell: usize| {
        let a = corner + x * (cell % cells) as f64 + y * (cell / cells) as f64;
        [[a, a + x, a + x + y], [a, a + x + y, a + y]]
    };
    (0..cells * cells).flat_map(cell).collect()
}

/// Creates the cube [−1, 1]³ with `n` × `n` cells per face; n is a power of two.
fn create_cube_mesh(n: usize) -> Mesh {
    let face = |face: usize| {
        let [z, x, y] = rotated_axes(face / 2);
        let [x, y, z] = if face.is_multiple_of(2) {
            [x, y, z]
        } else {
            [y, x, -z]
        };
        create_lattice(z - x - y, [x, y].map(|side| side * (2.0 / n as f64)), n)
    };
    (0..6).flat_map(face).collect()
}

/// Returns the triangles of a mesh.
pub fn triangles<R: Real>(mesh: &Mesh) -> Vec<AnyShape<R>> {
    let triangle = |face: &[DVec3; 3]| Triangle::new(face.map(to_scalar::<R>)).into();
    mesh.iter().map(triangle).collect()
}

/// Point of a random face of a mesh at which a ray is aimed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RayTarget {
    Corner,
    Edge,
    /// A corner or a point on an edge, by rays from the exact centre of the mesh.
    FromCentre,
    Anywhere,
}

use RayTarget::{Anywhere, Corner, Edge, FromCentre};

const TARGETS: [RayTarget; 4] = [Corner, Edge, FromCentre, Anywhere];

/// Draws a ray from a ball inside a mesh, of which centre and radius are given, towards a target of
/// a random face.
fn draw_inner_ray(
    mesh: &Mesh,
    rng: &mut CaseRng,
    (centre, radius): (DVec3, f64),
    target: RayTarget,
) -> Ray<f64> {
    let ([a, b, c], [u, v, depth]) = (rng.choose(mesh), rng.next_numbers());
    let edge = a + (b - a) * u;
    let point = match target {
        Corner => a,
        Edge => edge,
        FromCentre => rng.choose(&[a, edge]),
        Anywhere => edge + (c - a) * (v * (1.0 - u)),
    };
    // From the centre the unnormalised direction *is* the target, so the ray passes exactly through
    // a corner.
    if target == FromCentre {
        return create_unnormalised_ray(centre, point - centre);
    }
    create_ray_towards(centre + rng.sample_direction() * (radius * depth), point)
}

/// Creates an icosphere and a cube. The faces are turned over for which `is_turned` of the indices of
/// mesh and face is true.
fn create_turned_globes(is_turned: fn([usize; 2]) -> bool) -> [Globe; 2] {
    let meshes = [create_icosphere(5), create_cube_mesh(16)];
    [0, 1].map(|index| {
        let mut mesh = meshes[index].clone();
        for (face, corners) in mesh.iter_mut().enumerate() {
            if is_turned([index, face]) {
                corners.swap(1, 2);
            }
        }
        Globe {
            mesh,
            ball: (DVec3::ZERO, 0.9),
        }
    })
}

/// A closed mesh: a subdivided icosahedron, and the ball inside it from which rays start.
struct Globe {
    mesh: Mesh,
    ball: (DVec3, f64),
}

impl Globe {
    fn new(levels: u32, radius: f64, position: DVec3) -> Self {
        let (mut mesh, centre) = (create_icosphere(levels), round_to_f32(position));
        for corner in mesh.as_flattened_mut() {
            *corner = round_to_f32(*corner * radius + centre);
        }
        Self {
            mesh,
            ball: (centre, 0.6 * radius),
        }
    }
}

/// Judges rays from inside closed meshes, and builds the trees of these and of a further mesh.
fn judge_globes<R: Real>(trial: &mut Trial<R>, rays: (u64, u32), globes: &[Globe], further: &Mesh) {
    let meshes = globes.iter().map(|globe| &globe.mesh).chain([further]);
    trial.build_scenes(meshes.map(triangles).collect());
    trial.judge_rays("meshes", rays, |rng, _| {
        let scene = rng.ray_index() as usize % globes.len();
        let target = rng.choose(&TARGETS);
        let Globe { mesh, ball } = &globes[scene];
        Ok([TestRay::with_any_hit(
            scene,
            draw_inner_ray(mesh, rng, *ball, target),
        )])
    });
}

/// A corner far from the origin.
const DISTANT: DVec3 = DVec3::new(148_376.0, 1234.0, -223_423.0);

/// Judges rays beside an edge that two triangles share, past which they pass so closely that the
/// products in the edge's test are rounded to the same number. Exactly one triangle must be hit, by
/// the sign that the test has in exact arithmetic.
fn judge_sides<R: Real>(trial: &mut Trial<R>) {
    trial.judge("sides", (64, 20_000), LIBRARY, |rng, formula| {
        let scale = 2_f64.powi(12);
        let end = (rng.sample_point_in_cube() * DVec3::new(1.0, 1.0, 0.0) * 16_777_215.0).round();
        let origin = (end * rng.next_uniform(-1.0, 1.0)).round() / 65_536.0;
        let side = (end * origin.yxz()).dot(DVec3::new(1.0, -1.0, 0.0));
        if side == 0.0 {
            return Verdict::Skipped;
        }
        let ray = create_unnormalised_ray(origin - DVec3::Z, DVec3::Z);
        let mut is_hit = |turn: f64| {
            let apex = DVec3::new(-end.y, end.x, 0.0) * turn;
            let corners = [end, -end, apex].map(|corner| to_scalar::<R>(corner * scale));
            formula.intersect(Triangle::new(corners), ray).is_some()
        };
        let hits = [1.0, -1.0].map(&mut is_hit);
        require(hits == [side > 0.0, side < 0.0], || {
            format!("hits {hits:?} on either side, at {side} of the edge to {end}")
        })
    });
}

/// Cases of meshes.
pub(super) fn cases<R: Real>() -> Vec<Case<R>> {
    vec![
        // Rays at common edges and corners of closed meshes, with all faces outward; the textbook's
        // formula tries all faces of small ones.
        ("P21", |trial| {
            judge_globes(
                trial,
                (60, 480_000),
                &create_turned_globes(|_| false),
                &vec![],
            );
            judge_sides(trial);
            for mesh in [create_icosphere(1), create_cube_mesh(2)] {
                let faces = triangles::<f32>(&mesh);
                for target in TARGETS {
                    let rays = (60 + target as u64, 100_000);
                    trial.judge(&format!("{target:?}"), rays, BESIDE_TREES, |rng, _| {
                        let ray =
                            to_precision(draw_inner_ray(&mesh, rng, (DVec3::ZERO, 0.9), target));
                        let is_hit = |face| textbook::intersect(face, &ray).is_some();
                        require(faces.iter().any(is_hit), || "the textbook finds no hit")
                    });
                }
            }
        }),
        // The same with every face of the icosphere and every second face of the cube turned over.
        ("P22", |trial| {
            let globes = create_turned_globes(|[mesh, face]| mesh == 0 || face % 2 == 0);
            judge_globes(trial, (60, 480_000), &globes, &vec![]);
        }),
        // Rays perpendicular to a flat lattice of square cells, through each corner and each middle
        // of an edge or cell. The cells are pairs of triangles of either winding, or solid cubes.
        // The zero components of the ray directions have either sign.
        ("T03", |trial| {
            const CELLS: usize = 20;
            let scene = |axis: usize| {
                let [along, x, y] = rotated_axes(axis);
                let lattice = |sides| triangles(&create_lattice(DVec3::ZERO, sides, CELLS));
                let cube = |cell: usize| {
                    let min = x * (cell % CELLS) as f64 + y * (cell / CELLS) as f64 - along;
                    Cuboid::new(min, min + 1.0).into()
                };
                [
                    lattice([x, y]),
                    lattice([y, x]),
                    (0..CELLS * CELLS).map(cube).collect(),
                ]
            };
            trial.build_scenes((0..3).flat_map(scene).collect());
            let places = 2 * CELLS as u64 - 1;
            for scene in 0..9 {
                let [axis, x, y] = [0, 1, 2].map(|next| (scene / 3 + next) % 3);
                // The number of rays is so small that either ray count traces all of them.
                let rays = (203, (places * places * 4) as u32);
                trial.judge_rays(&format!("lattice {scene}"), rays, |rng, _| {
                    let (place, signs) = (rng.ray_index() / 4, rng.ray_index() % 4);
                    let zero = |bit: u64| if signs >> bit & 1 == 0 { 0.0 } else { -0.0 };
                    let towards = if place % 2 == 0 { -1.0 } else { 1.0 };
                    let [mut origin, mut d] = [DVec3::ZERO; 2];
                    (d[axis], d[x], d[y]) = (towards, zero(0), zero(1));
                    let at = [place % places, place / places].map(|i| (i + 1) as f64 * 0.5);
                    (origin[axis], origin[x], origin[y]) = (-5.0 * towards, at[0], at[1]);
                    Ok([TestRay::with_any_hit(
                        scene,
                        create_unnormalised_ray(origin, d),
                    )])
                });
            }
        }),
        // Rays from inside closed meshes of every size from 1e-12 to 1e12.
        ("T06", |trial| {
            let globes = (-12..=12).map(|k| Globe::new(3, 10_f64.powi(k), DVec3::ZERO));
            judge_globes(trial, (226, 200_000), &globes.collect::<Vec<_>>(), &vec![]);
        }),
        // Rays inside closed meshes far from the origin, and rays towards a distant flat ground of
        // square cells.
        ("T07", |trial| {
            const SIDE: u64 = 12;
            let sides = [DVec3::X * 2.0, DVec3::Z * 2.0];
            let ground = create_lattice(DISTANT, sides, SIDE as usize);
            let diagonal = DVec3::new(0.8, -0.36, 0.48);
            let globes = [
                Globe::new(4, 2.0, DISTANT),
                Globe::new(3, 1.0, diagonal * 1e5),
                Globe::new(2, 1.0, diagonal * 1e6),
            ];
            judge_globes(trial, (227, 400_000), &globes, &ground);
            trial.judge_rays("ground", (228, 200_000), |rng, _| {
                // The ray is aimed at a corner inside the ground, or at an edge that ends at this
                // corner. The rounding of the direction moves the target by a tiny fraction of a
                // cell.
                let mut inner = || (1 + rng.next_bits() % (SIDE - 1)) as f64;
                let corner = DISTANT + sides[0] * inner() + sides[1] * inner();
                let [a, b] = sides.map(|side| side * rng.choose(&[0.0, -0.99]));
                let target = corner + (a + b) * rng.next_in_unit_interval();
                let up = rng.sample_point_in_cube() + DVec3::Y * 1.5;
                let ray = create_ray_towards(target + up * rng.next_uniform(1.0, 20.0), target);
                Ok([TestRay::with_any_hit(3, ray)])
            });
        }),
        // The padding of the boxes of a mesh's triangles. Each side must be padded by as much as
        // edge-on triangles need (`shapes::edges`). Padding increases the surface area of boxes, and
        // so the number of rays that enter them: by less than 30 percent.
        ("T10", |trial| {
            let half_area = |e: DVec3| e.dot(e.yzx());
            let (mut tight, mut padded, mut least) = (0.0, 0.0, f64::INFINITY);
            for face in create_icosphere(4) {
                let bounds = Aabb::from_points(face);
                let grown = bounds.to_padded().expect("finite corners");
                let [min, max] = [grown.min, grown.max].map(|corner| corner.as_dvec3());
                tight += half_area(bounds.extent());
                padded += half_area(max - min);
                let padding = (bounds.min - min).min(max - bounds.max).min_element();
                least = least.min(padding / bounds.extent().max_element());
            }
            trial.judge("", (0, 1), LIBRARY, |_, _| {
                within(
                    padded / tight,
                    1.3,
                    || "area of boxes over that without padding",
                ) & within(
                    f64::from(f32::EPSILON) / least,
                    1.0,
                    || "too little padding",
                )
            });
        }),
    ]
}
