//! What accuracy costs, and what is wrong without it: the table in docs/accuracy.md of the textbook's formulas in f32, of `robust` and of `reference`. The
//! textbook's are no part of the program; they are the comparator of its tests.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "support/mesh.rs"]
mod mesh;
#[path = "support/scenes.rs"]
mod scenes;
#[path = "support/threads.rs"]
mod threads;

use std::hint::black_box;

use glam::DVec3;
use raywright::bvh::shapes::{AnyShape, Cone, Ellipsoid, Sphere, Torus, Triangle};
use raywright::bvh::{Interval, PreparedRay, Ray, Real, Shape, Side};
use raywright::core::Scene;
use raywright::core::bench::Spread;
use raywright::core::bench::clock::process_seconds;
use raywright::core::settings::{PrecisionChoice, Sampling};

use mesh::mesh;
use raywright::bvh::stability::judge::{Outcome, Random, Rays, stored};
use raywright::bvh::stability::quadrics::{extreme_distance, near_root};
use raywright::bvh::stability::sphere::{drift, far_sphere, surface};
use raywright::bvh::stability::torus::far_torus;
use raywright::bvh::stability::triangles::{Aim, Mesh, cube, icosphere, leaks, leaks_of_library};
use raywright::bvh::stability::{intersect, textbook};
use scenes::{preset, ready};
use threads::threads;

const ROUNDS: usize = 15;

fn main() {
    // Not where benches are only listed or checked.
    if std::env::args().any(|argument| ["--test", "--list"].contains(&argument.as_str())) {
        return;
    }
    println!("| | the textbook's formulas | `robust`, the default | `reference` |\n|---|---|---|---|");
    tests();
    pictures();
    cases();
}

/// Work done by each of several, in turns: CPU time over that of `robust`.
fn row(name: &str, works: [Option<&dyn Fn()>; 3]) {
    let mut ratios = [(); 3].map(|()| Vec::with_capacity(ROUNDS));
    for round in 0..=ROUNDS {
        let mut seconds = [f64::NAN; 3];
        for place in 0..works.len() {
            let turn = (place + round) % works.len();
            let Some(work) = works[turn] else { continue };
            let start = process_seconds();
            work();
            seconds[turn] = process_seconds() - start;
        }
        if round > 0 {
            ratios.iter_mut().zip(seconds).for_each(|(ratios, own)| ratios.push(own / seconds[1]));
        }
    }
    let cell = |which: usize| match works[which] {
        None => "—".to_owned(),
        Some(_) if which == 1 => "1".to_owned(),
        Some(_) => {
            let spread = Spread::of(&ratios[which]);
            format!("{:.2} ± {:.1} %", spread.median, spread.relative() * 100.0)
        }
    };
    println!("| **time**: {name} | {} | {} | {} |", cell(0), cell(1), cell(2));
}

/// Rays from around a shape of about unit size at points near it, so that about half of them hit.
fn rays<R: Real>() -> Vec<Ray<R>> {
    let ray = |i: u64| {
        let random = &mut Random::new(1, i);
        let origin = random.direction() * 5.0;
        Ray::new(stored::<R>(origin), stored::<R>((random.cube() * 1.2 - origin).normalize()))
    };
    (0..4096).map(ray).collect()
}

/// One shape in both scalars.
type Pair = (AnyShape<f32>, AnyShape<f64>);

/// The tests of single shapes. The library's rays are prepared, as they are once a query.
fn tests() {
    const TURNS: usize = 400;
    let (zero, axis) = (DVec3::ZERO, DVec3::new(0.3, 1.0, -0.2));
    let corners = [DVec3::new(-1.0, -1.0, 0.2), DVec3::new(1.0, -0.8, 0.2), DVec3::new(-0.9, 1.0, 0.5)];
    let sphere: Pair =
        (Sphere { centre: stored::<f32>(zero), radius: 1.0 }.into(), Sphere { centre: stored::<f64>(zero), radius: 1.0 }.into());
    let triangle: Pair = (Triangle::new(corners.map(stored::<f32>)).into(), Triangle::new(corners.map(stored::<f64>)).into());
    let semi = DVec3::new(1.0, 0.6, 0.8);
    let ellipsoid: Pair = (Ellipsoid::new(zero, semi).into(), Ellipsoid::new(zero, semi).into());
    let cone: Pair = (Cone::new(-axis, axis, 1.0, 0.0, 2.0).into(), Cone::new(-axis, axis, 1.0, 0.0, 2.0).into());
    let torus: Pair = (Torus::new(zero, axis, 0.8, 0.3).into(), Torus::new(zero, axis, 0.8, 0.3).into());
    let (single, double) = (rays::<f32>(), rays::<f64>());
    let prepared =
        [single.iter().map(|&ray| PreparedRay::new(ray)).collect(), double.iter().map(|&ray| PreparedRay::new(ray)).collect()];
    fn all<R: Real>(shape: &AnyShape<R>, rays: &Vec<PreparedRay>) {
        for _ in 0..TURNS {
            for ray in rays {
                black_box(black_box(shape).intersect(ray, Interval::positive(), Side::Both));
            }
        }
    }
    for (name, (f32s, f64s)) in
        [("sphere", sphere), ("triangle", triangle), ("ellipsoid", ellipsoid), ("cone", cone), ("torus", torus)]
    {
        let by_textbook = || {
            for _ in 0..TURNS {
                for ray in &single {
                    black_box(textbook::intersect(black_box(&f32s), ray));
                }
            }
        };
        let [robust, reference] = &prepared;
        row(
            &format!("a test of one {name}"),
            [Some(&by_textbook), Some(&|| all(&f32s, robust)), Some(&|| all(&f64s, reference))],
        );
    }
}

/// Whole pictures, which the textbook's formulas are not part of any more.
fn pictures() {
    let picture = |name: &str, scene: Option<Scene>, size: [u32; 2]| {
        let Some(scene) = scene else { return };
        let alone = threads(1);
        let [robust, reference] = [PrecisionChoice::Robust, PrecisionChoice::Reference].map(|precision| {
            ready(&scene, size, |settings| {
                settings.precision = precision;
                if scene.render.pattern.is_none() {
                    settings.sampling = Sampling::resolve(&scene, Some(4));
                }
            })
        });
        let render = |ready: &raywright::core::Ready| drop(alone.install(|| ready.render(&())));
        row(name, [None, Some(&|| render(&robust)), Some(&|| render(&reference))]);
    };
    picture("the preset", preset("whitted"), [640, 360]);
    picture("a mesh of 65 536 triangles", Some(mesh()), [640, 360]);
    picture("the preset `shapes`", preset("shapes"), [320, 180]);
    picture("the preset `product`, path-traced", preset("product"), [320, 180]);
}

/// What is wrong in the hard cases.
fn cases() {
    let shot = if std::env::var("RAYS").is_ok_and(|rays| rays == "all") { Rays::All } else { Rays::Quarter };
    let wrong = |name: &str, outcomes: [Outcome; 3]| {
        let cell = |outcome: &Outcome| match outcome.wrong {
            0 => "0".to_owned(),
            _ => format!("{:.2} %", 100.0 * outcome.wrong_share()),
        };
        let [textbook, robust, reference] = outcomes.each_ref().map(cell);
        println!("| **wrong**: {name} | {textbook} | {robust} | {reference} |");
    };
    wrong(
        "hits of a sphere 10 000 radii away (P01)",
        [
            far_sphere(1e4, 8.0, shot, textbook::intersect),
            far_sphere::<f32>(1e4, 8.0, shot, intersect),
            far_sphere::<f64>(1e4, 8.0, shot, intersect),
        ],
    );
    wrong(
        "where the surface is at such a hit (P02)",
        [
            drift(0.0, 1e4, shot, textbook::sphere_surface),
            drift::<f32>(0.0, 1e4, shot, surface),
            drift::<f64>(0.0, 1e4, shot, surface),
        ],
    );
    for (name, case) in [("a hyperboloid's asymptote", "hyperboloid"), ("a cone's side", "cone")] {
        let of = [
            near_root(case, 1e-7, 1e-5, shot, textbook::intersect),
            near_root::<f32>(case, 1e-7, 1e-5, shot, intersect),
            near_root::<f64>(case, 1e-7, 1e-5, shot, intersect),
        ];
        wrong(&format!("rays along {name}, but for 10⁻⁷ (P13)"), of);
    }
    wrong(
        "distance of an ellipsoid a thousand times as wide as high (P15)",
        [
            extreme_distance(1e-3, 1e-2, shot, textbook::intersect),
            extreme_distance::<f32>(1e-3, 1e-2, shot, intersect),
            extreme_distance::<f64>(1e-3, 1e-2, shot, intersect),
        ],
    );
    wrong(
        "hits of a torus a hundred radii away (P17)",
        [
            far_torus(0.1, 100.0, 20_000, shot, textbook::intersect),
            far_torus::<f32>(0.1, 100.0, 20_000, shot, intersect),
            far_torus::<f64>(0.1, 100.0, 20_000, shot, intersect),
        ],
    );
    let both = |leaks: &dyn Fn(&str, &Mesh) -> Outcome| leaks("cube", &cube(16)).plus(leaks("icosphere", &icosphere(5)));
    wrong(
        "rays at the corners of closed meshes that get through (P21)",
        [
            both(&|name, mesh| {
                let triangles = mesh.triangles();
                leaks::<f32>(name, mesh, Aim::Corner, 100_000, shot, |ray| textbook::hits_any(&triangles, ray))
            }),
            both(&|name, mesh| leaks_of_library::<f32>(name, mesh, Aim::Corner, 100_000, shot)),
            both(&|name, mesh| leaks_of_library::<f64>(name, mesh, Aim::Corner, 100_000, shot)),
        ],
    );
}
