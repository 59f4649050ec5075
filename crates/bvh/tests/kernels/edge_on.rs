//! Faces that a ray sees edge-on, or would but for the last digit, with others that it meets along the way.

use glam::{Vec3, Vec3Swizzles};
use raywright_bvh::{AcceleratorKind, BuildQuality, FromOnePoint, Geometry, Group, Interval, Kernel, Ray, Robust, Visibility};

use super::bits;
use super::meshes::Random;

const GROUPS: usize = 1500;
const RAYS: usize = 40;

/// One of a few numbers that f32 holds in few digits, or in all of them.
fn step(random: &mut Random) -> f32 {
    let whole = [1.0, 2.0, 3.0, 5.0, 7.0, -2.0, -3.0][random.below(7)];
    if random.below(2) == 0 { whole } else { whole * (1.0 + random.unit()) }
}

/// Moves some coordinates by a unit in the last place, or not.
fn nudged(random: &mut Random, v: Vec3) -> Vec3 {
    let mut one = |x: f32| match random.below(4) {
        0 => x.next_up(),
        1 => x.next_down(),
        _ => x,
    };
    Vec3::new(one(v.x), one(v.y), one(v.z))
}

/// Asks every kernel, alone and from one point, what the scan says, before the origin too. Returns how many rays hit.
fn compared(random: &mut Random, origin: Vec3, direction: Vec3, triangles: &[[Vec3; 3]], kind: AcceleratorKind) -> usize {
    let built = |kind: AcceleratorKind| {
        let mut group = Group::<Robust>::default();
        group.mesh(triangles.iter().copied(), Visibility::default()).unwrap();
        Geometry::new(group, kind)
    };
    let (scan, mut tree) = (built(AcceleratorKind::Linear), built(kind));
    assert!(tree.build_work().is_some_and(|work| work.depth > 0));
    let directions: Vec<Vec3> = (0..RAYS).map(|_| nudged(random, direction)).collect();
    let mut hits = 0;
    for min in [0.0, f32::NEG_INFINITY] {
        let range = Interval { min, max: f32::INFINITY };
        let expected: Vec<_> = directions.iter().map(|&d| bits(scan.closest(&Ray::new(origin, d), range, &mut ()))).collect();
        hits += expected.iter().flatten().count();
        for kernel in Kernel::available() {
            tree.set_kernel(kernel);
            let alone: Vec<_> = directions.iter().map(|&d| bits(tree.closest(&Ray::new(origin, d), range, &mut ()))).collect();
            assert_eq!(alone, expected, "{kernel:?}, {kind:?}, from {origin:?} along {direction:?}: {triangles:?}");
            let mut together = vec![];
            tree.closest_from(&FromOnePoint { origin, directions: &directions, time: 0.0, range }, &mut together);
            let together: Vec<_> = together.into_iter().map(bits).collect();
            assert_eq!(together, expected, "{kernel:?}, {kind:?}, from {origin:?} along {direction:?}: {triangles:?}");
        }
    }
    hits
}

/// Protects: traversal order never decides. Triangles that lie along a ray, from before other faces to behind them, are hit at the same
/// distance by scan and tree.
#[test]
fn order_does_not_decide() {
    let (random, mut hits) = (&mut Random(41), 0);
    for _ in 0..GROUPS {
        let origin = random.point() * [0.0, 1.0, 1e3][random.below(3)];
        let direction = Vec3::new(step(random), step(random), step(random)) * [1.0, 1e-3][random.below(2)];
        let mut triangles = vec![];
        for _ in 0..8 {
            let along = |random: &mut Random| origin + direction * (1 << random.below(11)) as f32;
            let corners = [along(random), along(random), along(random)];
            triangles.push(corners.map(|corner| nudged(random, corner)));
            let (at, size) = (along(random), direction.length() * (0.1 + random.unit()));
            triangles.push([at + random.point() * size, at + random.point() * size, at + random.point() * size]);
        }
        // So many that there is a tree.
        for _ in 0..80 {
            let at = origin + random.point() * (direction.length() * 2000.0);
            triangles.push([at, at + random.point() * direction.length(), at + random.point() * direction.length()]);
        }
        hits += compared(random, origin, direction, &triangles, AcceleratorKind::default());
    }
    assert!(hits > GROUPS * RAYS / 4, "{hits} hits");
}

/// Protects: nor does it where such a triangle has parts with boxes of their own, some of which lie behind the faces before which rounding
/// puts it. And that there are parts: the tree takes more room than one without.
#[test]
fn order_does_not_decide_among_parts() {
    let (random, mut hits) = (&mut Random(43), 0);
    for _ in 0..GROUPS / 3 {
        let origin = random.point() * [0.0, 1.0, 1e3][random.below(3)];
        let direction = Vec3::new(step(random), step(random), step(random)) * [1.0, 1e-3][random.below(2)];
        let mut triangles = vec![];
        for _ in 0..120 {
            // They reach far along the ray, most to both of its sides too, so that it passes a few of their parts alone.
            let side = direction.yzx() * [0.0, 10.0, 100.0][random.below(3)];
            let ends = [random.unit(), 1000.0 * random.unit(), 900.0 + 100.0 * random.unit()];
            let corners = ends.map(|end| origin + direction * end + side * (random.unit() - 0.5));
            triangles.push(corners.map(|corner| nudged(random, corner)));
        }
        for _ in 0..16 {
            let at = origin + direction * (1000.0 * random.unit());
            let size = direction.length() * (0.1 + random.unit());
            triangles.push([at + random.point() * size, at + random.point() * size, at + random.point() * size]);
        }
        let bytes = |quality: BuildQuality| {
            let mut group = Group::<Robust>::default();
            group.mesh(triangles.iter().copied(), Visibility::default()).unwrap();
            Geometry::new(group, AcceleratorKind::Tree(quality)).bytes()
        };
        let [medium, high] = [BuildQuality::Medium, BuildQuality::High].map(bytes);
        assert!(high > medium + medium / 2, "{medium} and {high} bytes");
        hits += compared(random, origin, direction, &triangles, AcceleratorKind::Tree(BuildQuality::High));
    }
    assert!(hits > GROUPS * RAYS / 8, "{hits} hits");
}
