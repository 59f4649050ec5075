//! A hundred thousand primitives of each kind: a tree that several threads build in parts finds the
//! hits of the scan.

use glam::{DAffine3, DVec3};
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use raywright_bvh::{
    AcceleratorKind, Geometry, Hit, Interval, PacketBackoff, PrimitiveSet, Ray, RayPacket, Real,
    Vector, Visibility,
};

use super::agreement::{SHAPES, is_unbounded, map, offered, shape};
use super::families::ArrangementRng;

/// Number of primitives of a crowd, enough for a build in parts.
const COUNT: usize = 100_000;
/// Half the edge of a crowd's cube: so dense that more than a quarter of all rays hit.
const HALF: f64 = 40.0;
/// Packets at a crowd, and rays of a packet. The scan takes most of the time.
const PACKETS: usize = 3;
const RAYS: usize = 6;

/// Kinds of a crowd's primitives: the shapes by number, and these.
const MAPPED: usize = SHAPES;
const INSTANCES: usize = SHAPES + 1;
const MOVING: usize = SHAPES + 2;
const MIXED: usize = SHAPES + 3;

/// Adds a primitive of a kind. `part` is a geometry of thirty shapes.
fn add<R: Real>(
    group: &mut PrimitiveSet<R>,
    rng: &mut ArrangementRng,
    kind: usize,
    (i, part): (usize, u32),
) {
    let bounded = (i / 4..)
        .map(|kind| kind % SHAPES)
        .find(|&kind| !is_unbounded(kind))
        .expect("most are");
    let place = |rng: &mut ArrangementRng| DAffine3::from_translation(rng.in_cube(HALF));
    let all = Visibility {
        occlusion: raywright_bvh::Occlusion::Filtered,
        ..Visibility::default()
    };
    let added = match kind {
        MAPPED => group.add_transformed_shape(shape(rng, bounded, 1.0), place(rng) * map(rng), all),
        INSTANCES => group.add_instance(part, place(rng) * map(rng), all),
        MOVING => {
            let (own, start) = (map(rng), place(rng));
            let end = DAffine3::from_translation(start.translation + rng.in_cube(5.0));
            group.add_moving_instance(part, [start * own, end * own], all)
        }
        MIXED => {
            return add(
                group,
                rng,
                [bounded, MAPPED, INSTANCES, MOVING][i % 4],
                (i, part),
            );
        }
        kind => group.add_shape(shape(rng, kind, HALF), all),
    };
    added.expect("a primitive in range");
}

fn crowd<R: Real>(kind: usize) -> PrimitiveSet<R> {
    let (rng, mut group) = (&mut ArrangementRng(kind as u64), PrimitiveSet::default());
    let mut inner = PrimitiveSet::default();
    for number in (0..3 * SHAPES).filter(|number| !is_unbounded(number % SHAPES)) {
        let shape = shape::<R>(rng, number % SHAPES, 2.0);
        inner
            .add_shape(shape, Visibility::default())
            .expect("in range");
    }
    let part = group
        .add_part(Geometry::new(inner, AcceleratorKind::default()))
        .expect("a part");
    (0..COUNT).for_each(|i| add(&mut group, rng, kind, (i, part)));
    group
}

/// Origin, directions and time of a packet: every other packet is a narrow one.
fn packet<R: Real>(rng: &mut ArrangementRng, i: usize) -> (R::Vec3, Vec<R::Vec3>, R) {
    let v = |p: DVec3| R::Vec3::from_f64(p);
    let (origin, middle) = (rng.in_cube(HALF), rng.in_cube(1.0).normalize_or(DVec3::X));
    let width = [1.0, 1e-3][i % 2];
    let directions = (0..RAYS)
        .map(|_| v((middle + rng.in_cube(width)).normalize_or(DVec3::X)))
        .collect();
    (v(origin), directions, R::from_f32(rng.unit()))
}

/// Every hit of the crowd by the scan is one of the tree: by rays alone and in packets, and passed
/// to an any-hit filter. Returns the number of hits.
fn count_hits<R: Real>(kind: usize) -> usize {
    let (group, range) = (crowd::<R>(kind), Interval::<R>::positive());
    let tree = Geometry::new(group.clone(), AcceleratorKind::default());
    let scan = Geometry::new(group, AcceleratorKind::Linear);
    let agree = |i: usize| {
        let rng = &mut ArrangementRng((kind * PACKETS + i) as u64 ^ 0x5eed);
        let (origin, directions, time) = packet::<R>(rng, i);
        let requested = RayPacket {
            origin,
            directions: &directions,
            time,
            culls: false,
            range,
        };
        let mut together = Vec::new();
        tree.closest_of_packet(&requested, &mut PacketBackoff::default(), &mut together);
        let ray = |&direction: &R::Vec3| Ray::new(origin, direction).with_time(time);
        let found: Vec<Option<Hit<R>>> = directions
            .iter()
            .map(|direction| scan.closest(&ray(direction), range, &mut ()))
            .collect();
        for (direction, expected) in directions.iter().zip(&found) {
            let hit = tree.closest(&ray(direction), range, &mut ());
            assert_eq!(hit, *expected, "kind {kind}, alone, {:?}", ray(direction));
        }
        assert_eq!(together, found, "kind {kind}, packet {i}: {requested:?}");
        let first = ray(&directions[0]);
        let all = offered(&scan, &first, range);
        assert_eq!(offered(&tree, &first, range), all, "kind {kind}, {first:?}");
        found.iter().flatten().count()
    };
    (0..PACKETS).into_par_iter().map(agree).sum()
}

/// Protects: a crowd of a hundred thousand primitives of one kind, or of all kinds in turn, is hit
/// as by the scan where seven threads build its tree in parts: each primitive keeps its number, in
/// single queries, packets and any-hit queries, at any time of a motion; the crowd of all kinds in
/// every precision.
#[test]
fn crowds_built_in_parts_keep_their_numbers() {
    let threads = ThreadPoolBuilder::new().num_threads(7);
    threads.build().expect("seven threads").install(|| {
        for kind in (0..=MIXED).filter(|&kind| !is_unbounded(kind)) {
            let hits = count_hits::<f32>(kind);
            assert!(4 * hits > PACKETS * RAYS, "kind {kind}: {hits} hits");
        }
        assert!(count_hits::<f64>(MIXED) > 0);
    });
}
