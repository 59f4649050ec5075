//! Cases T03, T06, T07 and T10: flat lattices of cells, and closed meshes of any size and position.
//! No ray may pass through them.

use super::prelude::*;
use super::triangles::{ClosedMesh, RayTarget, create_icosphere};

/// Number of cells along each side of a lattice.
const CELLS: usize = 20;

/// Returns a flat lattice of square cells with two triangles per cell. It begins at `corner`, and
/// `x` and `y` are the sides of a cell.
pub fn triangle_lattice<R: Real>(
    corner: DVec3,
    [x, y]: [DVec3; 2],
    cells: usize,
) -> Vec<AnyShape<R>> {
    let cell = |cell: usize| {
        let a = corner + x * (cell % cells) as f64 + y * (cell / cells) as f64;
        [[a, a + x, a + x + y], [a, a + x + y, a + y]]
            .map(|face| Triangle::new(face.map(to_scalar::<R>)).into())
    };
    (0..cells * cells).flat_map(cell).collect()
}

/// Judges case T03: rays perpendicular to a flat lattice of square cells, through each corner and
/// each middle of an edge or cell. The cells are pairs of triangles of either winding, or solid
/// cubes. The zero components of the ray directions have either sign.
pub(super) fn lattices<R: Real>(trial: &mut Trial<R>) {
    let axes = |axis: usize| [0, 1, 2].map(|next| DVec3::AXES[(axis + next) % 3]);
    let scenes: Vec<Vec<AnyShape<R>>> = (0..3)
        .flat_map(|axis| {
            let [along, x, y] = axes(axis);
            let cube = |cell: usize| {
                let min = x * (cell % CELLS) as f64 + y * (cell / CELLS) as f64 - along;
                Cuboid::new(min, min + 1.0).into()
            };
            [
                triangle_lattice(DVec3::ZERO, [x, y], CELLS),
                triangle_lattice(DVec3::ZERO, [y, x], CELLS),
                (0..CELLS * CELLS).map(cube).collect(),
            ]
        })
        .collect();
    trial.build_scenes(&scenes);
    let places = 2 * CELLS as u64 - 1;
    for scene in 0..scenes.len() {
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
}

/// A closed mesh: a subdivided icosahedron, and the ball inside it from which rays start.
struct Globe {
    mesh: ClosedMesh,
    ball: (DVec3, f64),
}

impl Globe {
    fn new(levels: u32, radius: f64, position: DVec3) -> Self {
        let (mut mesh, centre) = (create_icosphere(levels), round_to_f32(position));
        for corner in &mut mesh.corners {
            *corner = (corner.as_dvec3() * radius + centre).as_vec3();
        }
        Self {
            mesh,
            ball: (centre, 0.6 * radius),
        }
    }
}

/// Judges rays from inside closed meshes, and builds the trees of these and of further shapes.
fn judge_globes<R: Real>(
    trial: &mut Trial<R>,
    rays: (u64, u32),
    globes: &[Globe],
    further: Vec<AnyShape<R>>,
) {
    let mut scenes: Vec<_> = globes.iter().map(|globe| globe.mesh.triangles()).collect();
    scenes.push(further);
    trial.build_scenes(&scenes);
    trial.judge_rays("meshes", rays, |rng, _| {
        let scene = rng.ray_index() as usize % globes.len();
        let target = rng.choose(&[RayTarget::Corner, RayTarget::Edge, RayTarget::Anywhere]);
        let Globe { mesh, ball } = &globes[scene];
        Ok([TestRay::with_any_hit(
            scene,
            mesh.draw_inner_ray(rng, *ball, target).1,
        )])
    });
}

/// Judges case T06: rays from inside closed meshes of every size from 1e-12 to 1e12.
pub(super) fn mesh_sizes<R: Real>(trial: &mut Trial<R>) {
    let globe = |k| Globe::new(3, 10_f64.powi(k), DVec3::ZERO);
    judge_globes(
        trial,
        (226, 1_000_000),
        &(-12..=12).map(globe).collect::<Vec<_>>(),
        vec![],
    );
}

/// A corner far from the origin.
const DISTANT: DVec3 = DVec3::new(148_376.0, 1234.0, -223_423.0);

/// Creates three closed meshes far from the origin.
fn build_distant_globes() -> [Globe; 3] {
    let diagonal = DVec3::new(0.8, -0.36, 0.48);
    [
        Globe::new(4, 2.0, DISTANT),
        Globe::new(3, 1.0, diagonal * 1e5),
        Globe::new(2, 1.0, diagonal * 1e6),
    ]
}

/// Judges case T07: rays inside closed meshes far from the origin, and rays towards a distant flat
/// ground of square cells.
pub(super) fn distant_meshes<R: Real>(trial: &mut Trial<R>) {
    const SIDE: u64 = 12;
    let sides = [DVec3::X * 2.0, DVec3::Z * 2.0];
    let (globes, ground) = (
        build_distant_globes(),
        triangle_lattice(DISTANT, sides, SIDE as usize),
    );
    judge_globes(trial, (227, 1_000_000), &globes, ground);
    trial.judge_rays("ground", (228, 400_000), |rng, _| {
        // The ray is aimed at a corner inside the ground, or at an edge that ends at this corner.
        // The rounding of the direction moves the target by a tiny fraction of a cell.
        let mut inner = || (1 + rng.next_bits() % (SIDE - 1)) as f64;
        let corner = DISTANT + sides[0] * inner() + sides[1] * inner();
        let edge = sides[0] * rng.choose(&[0.0, -0.99]) + sides[1] * rng.choose(&[0.0, -0.99]);
        let target = corner + edge * rng.next_in_unit_interval();
        let up = rng.sample_point_in_cube() + DVec3::Y * 1.5;
        let origin = target + up * rng.next_uniform(1.0, 20.0);
        Ok([TestRay::with_any_hit(
            globes.len(),
            create_ray_towards(origin, target),
        )])
    });
}

/// Judges case T10: the padding of boxes. Rays from inside the meshes of case T07, and from inside a
/// mesh at the origin, must hit. Padding increases the surface area of boxes, and so the number of
/// rays that enter them. For the mesh at the origin the area must increase by less than 30 percent.
pub(super) fn box_inflation<R: Real>(trial: &mut Trial<R>) {
    let [a, b, c] = build_distant_globes();
    let near = Globe::new(4, 1.0, DVec3::ZERO);
    let half_area = |e: DVec3| e.x * e.y + e.y * e.z + e.z * e.x;
    let (mut tight, mut padded) = (0.0, 0.0);
    for face in &near.mesh.faces {
        let bounds = Aabb::from_points(face.map(|i| near.mesh.corners[i].as_dvec3()));
        let grown = bounds.to_padded().expect("finite corners");
        tight += half_area(bounds.extent());
        padded += half_area((grown.max - grown.min).as_dvec3());
    }
    judge_globes(trial, (230, 400_000), &[a, b, c, near], vec![]);
    trial.judge_figure(
        "surface area of boxes over that without padding",
        1.3,
        |_| padded / tight,
    );
}
