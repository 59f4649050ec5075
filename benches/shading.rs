//! Cost of shading per lane: value, density and sampling of the lobes that light sampling
//! evaluates, for single paths and for 8 and 16 paths in lanes. The contestants do the same work on
//! the same paths in turns; `benches/README.md` quotes the table.
//!
//! If the compiler stops vectorising the loops over lanes, the ratio here is close to one.
#![expect(clippy::print_stdout, reason = "the tables are this program's result")]

#[path = "support/turns.rs"]
mod turns;

use std::cell::RefCell;
use std::hint::black_box;

use glam::DVec3;
use raywright::core::material::{BsdfSample, MetallicRoughness, ShadingFrame};
use raywright::core::number::{Lanes, Number, Vector3};

use turns::{Contestant, interleaved, measuring};

const ROUNDS: usize = 31;
/// As many as fit into the second-level cache with their results.
const PATHS: usize = 4096;
/// Passes over the paths per round.
const TIMES: usize = 40;

/// Surface data of paths, in lanes.
struct PathHits<N: Number> {
    wo: N::Vec3,
    wi: N::Vec3,
    frame: ShadingFrame<N>,
    model: MetallicRoughness<N>,
    drawn: [N; 3],
}

/// A uniform number in [0, 1) for each index (SplitMix64).
fn even(place: usize) -> f64 {
    let mut z = (place as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A direction in the upper hemisphere around z.
fn above(place: usize) -> DVec3 {
    let (height, turn) = (
        0.02 + 0.98 * even(place),
        core::f64::consts::TAU * even(place + 1),
    );
    let across = (1.0 - height * height).sqrt();
    DVec3::new(across * turn.cos(), across * turn.sin(), height)
}

fn make_path_hits<N: Number>() -> Vec<PathHits<N>> {
    let group = |first: usize| {
        let place = |lane: usize, what: usize| 16 * (first + lane) + what;
        let number = |what: usize| N::from_lanes(|lane| even(place(lane, what)));
        let direction =
            |what: usize| <N::Vec3 as Vector3<N>>::from_lanes(|lane| above(place(lane, what)));
        PathHits {
            wo: direction(0),
            wi: direction(2),
            frame: ShadingFrame::from_normal(<N::Vec3 as Vector3<N>>::from_lanes(|_| DVec3::Z)),
            model: MetallicRoughness {
                base: N::Vec3::new(number(4), number(5), number(6)),
                metallic: number(7),
                roughness: number(8),
                dielectric: N::from_f64(0.04),
                grazing: N::ONE,
                glass: None,
            },
            drawn: [number(9), number(10), number(11)],
        }
    };
    (0..PATHS).step_by(N::LANES).map(group).collect()
}

fn eval<N: Number>(path_hits: &PathHits<N>) -> N::Vec3 {
    path_hits
        .model
        .local_bsdf(path_hits.frame.normal, path_hits.wo)
        .eval(path_hits.wo, path_hits.wi)
}

fn pdf<N: Number>(path_hits: &PathHits<N>) -> N {
    path_hits
        .model
        .local_bsdf(path_hits.frame.normal, path_hits.wo)
        .pdf(path_hits.wo, path_hits.wi)
}

fn sample<N: Number>(path_hits: &PathHits<N>) -> BsdfSample<N> {
    path_hits
        .model
        .local_bsdf(path_hits.frame.normal, path_hits.wo)
        .sample(&path_hits.frame, path_hits.wo, path_hits.drawn)
}

/// Work that applies a function to all paths and stores the results.
fn over_paths<N: Number, T>(of: impl Fn(&PathHits<N>) -> T) -> impl Fn() {
    let path_hits = make_path_hits::<N>();
    let out = RefCell::new(path_hits.iter().map(&of).collect::<Vec<T>>());
    move || {
        for _ in 0..TIMES {
            let mut out = out.borrow_mut();
            out.iter_mut()
                .zip(black_box(&path_hits))
                .for_each(|(slot, path_hits)| *slot = of(path_hits));
            black_box(&*out);
        }
    }
}

fn compare(name: &str, [one, eight, sixteen]: [&dyn Fn(); 3]) {
    let contestants = [
        Contestant {
            name: "1 lane",
            work: one,
        },
        Contestant {
            name: "8 lanes",
            work: eight,
        },
        Contestant {
            name: "16 lanes",
            work: sixteen,
        },
    ];
    print!(
        "{}",
        interleaved(
            &format!("{name} of {PATHS} paths, {TIMES} times"),
            ROUNDS,
            &contestants
        )
    );
}

fn main() {
    if !measuring() {
        return;
    }
    compare(
        "eval",
        [
            &over_paths(eval::<f32>),
            &over_paths(eval::<Lanes<8>>),
            &over_paths(eval::<Lanes<16>>),
        ],
    );
    compare(
        "pdf",
        [
            &over_paths(pdf::<f32>),
            &over_paths(pdf::<Lanes<8>>),
            &over_paths(pdf::<Lanes<16>>),
        ],
    );
    compare(
        "sample",
        [
            &over_paths(sample::<f32>),
            &over_paths(sample::<Lanes<8>>),
            &over_paths(sample::<Lanes<16>>),
        ],
    );
}
