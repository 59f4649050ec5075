//! Counted cost of builds: no arrangement of primitives makes a build slow or its tree too deep.

use core::sync::atomic::{AtomicUsize, Ordering};

use raywright_bvh::{
    AcceleratorKind, BuildQuality, BuildWork, Geometry, Interval, Ray, TraversalStats,
};

use super::families::{ArrangementRng, FAMILIES, Item, group, random, uneven};

fn work(items: &[Item], quality: BuildQuality) -> BuildWork {
    let geometry = Geometry::new(group(items), AcceleratorKind::Tree(quality));
    geometry.build_work().unwrap()
}

/// Protects: for every arrangement and quality a build visits at most three times the boxes of a
/// build over random primitives, of one size or of mixed sizes, whichever visits more; and the tree
/// fits the traversal stack.
#[test]
fn t11_no_family_is_slow() {
    let each = |quality: BuildQuality, count: usize| {
        let base = work(&random(count), quality)
            .boxes_visited
            .max(work(&uneven(count), quality).boxes_visited);
        for (name, family) in FAMILIES {
            let BuildWork {
                boxes_visited: looks,
                depth,
                ..
            } = work(&family(count), quality);
            assert!(
                looks <= 3 * base,
                "{name}, {count}, {quality:?}: {looks} against {base}"
            );
            assert!(
                (1..=64).contains(&depth),
                "{name}, {count}, {quality:?}: depth {depth}"
            );
        }
    };
    BuildQuality::ALL
        .into_iter()
        .for_each(|quality| each(quality, 5000));
    each(BuildQuality::default(), 100_000);
}

/// Protects: the work grows with the number of primitives times its logarithm at most, not with its
/// square.
#[test]
fn work_grows_with_the_number() {
    for (name, family) in FAMILIES
        .into_iter()
        .chain([("random", random as fn(usize) -> Vec<Item>)])
    {
        let looks = |count: usize| {
            work(&family(count), BuildQuality::default()).boxes_visited as f64 / count as f64
        };
        let (few, many) = (looks(1000), looks(32_000));
        assert!(
            many <= 2.0 * few.max(40.0),
            "{name}: {few} for each of 1000, {many} of 32 000"
        );
    }
}

/// Protects: a cancelled build returns `None` at whichever poll it was cancelled, and a build polls
/// before each of its passes; an uncancelled build returns the usual tree.
#[test]
fn builds_can_be_given_up() {
    let family = |expected: &str| {
        FAMILIES
            .into_iter()
            .find(|(name, _)| *name == expected)
            .expect("a family")
            .1
    };
    let cases = [
        // Number of polls: three per piece, two if there are several pieces, one for each pile of
        // at least 4096 boxes, and one at the end.
        (
            "random",
            random as fn(usize) -> Vec<Item>,
            BuildQuality::Fast,
            40_000,
            4,
        ),
        ("uneven", uneven, BuildQuality::High, 20_000, 4),
        (
            "random in two pieces",
            random,
            BuildQuality::Fast,
            270_000,
            9,
        ),
        (
            "all in one place",
            family("all in one place"),
            BuildQuality::Medium,
            40_000,
            15,
        ),
    ];
    for (name, items, quality, count, minimum) in cases {
        let items = items(count);
        let given_up_after = |maximum: usize| {
            let requested = AtomicUsize::new(0);
            let stop = || requested.fetch_add(1, Ordering::Relaxed) >= maximum;
            let geometry =
                Geometry::build_cancellable(group(&items), AcceleratorKind::Tree(quality), &stop);
            (
                geometry.and_then(|geometry| geometry.build_work()),
                requested.into_inner(),
            )
        };
        let (whole, requested) = given_up_after(usize::MAX);
        assert_eq!(whole, Some(work(&items, quality)), "{name}");

        assert!(
            requested >= minimum,
            "{name}: {whole:?}, {requested} questions"
        );
        for maximum in 0..requested {
            assert_eq!(
                given_up_after(maximum).0,
                None,
                "{name}: {maximum} of {requested}"
            );
        }
    }
}

/// Protects: each build quality visits more boxes than the one before.
#[test]
fn better_trees_are_worked_on_more() {
    for items in [random(3000), uneven(3000)] {
        let looks = BuildQuality::ALL.map(|quality| work(&items, quality).boxes_visited);
        assert!(looks[0] < looks[1] && looks[1] < looks[2], "{looks:?}");
    }
}

/// Protects: trees of hard arrangements cull: in families of disjoint boxes a ray visits at most
/// four times the nodes that it visits among random primitives.
#[test]
fn trees_of_odd_families_cull() {
    const COUNT: usize = 20_000;
    let visits = |items: &[Item]| {
        let geometry = Geometry::new(group(items), AcceleratorKind::default());
        let (rng, mut stats) = (&mut ArrangementRng(9), TraversalStats::default());
        for i in 0..400 {
            let Item::Ball(centre, radius) = items[i * 7919 % COUNT] else {
                panic!("balls")
            };
            let target = centre + rng.point() * 0.5 * radius;
            let origin = target + rng.point() * 4.0 * radius;
            let ray = Ray::new(origin, (target - origin).as_dvec3().normalize().as_vec3());
            geometry.closest(&ray, Interval::positive(), &mut stats);
        }
        stats.nodes
    };
    let base = visits(&random(COUNT));
    let apart = [
        "on a line",
        "on a line, touching",
        "two clusters far apart",
        "two clusters very far apart",
        "random, huge",
    ];
    for (name, family) in FAMILIES
        .into_iter()
        .filter(|(name, _)| apart.contains(name))
    {
        let visited = visits(&family(COUNT));
        assert!(
            visited <= 4 * base,
            "{name}: {visited} nodes against {base}"
        );
    }
}

/// Protects: the statistics of a scan count every primitive and no node.
#[test]
fn scans_are_counted() {
    for count in [1, 4, 5, 64] {
        let items = random(count);
        let Item::Ball(centre, radius) = items[0] else {
            panic!("balls")
        };
        let away = Ray::new(
            centre + glam::Vec3::X * 1e6 * radius.max(1.0),
            glam::Vec3::X,
        );
        let mut stats = TraversalStats::default();
        Geometry::new(group(&items), AcceleratorKind::Linear).closest(
            &away,
            Interval::positive(),
            &mut stats,
        );
        assert_eq!((stats.nodes, stats.primitives), (0, count as u64));
    }
}
