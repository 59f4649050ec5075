//! That the cheapest split is found, against all of them.

use super::*;

/// Boxes at scattered places, all of one place on axes beyond the first so many.
fn items(count: usize, axes: usize) -> Vec<Item> {
    let place = |i: usize, stride: usize| (i * stride % 20_011) as f32 / 20_011.0;
    let centre = |i: usize| Vec3A::from_array(array::from_fn(|k| if k < axes { place(i, [3137, 6197, 8117][k]) } else { 0.5 }));
    let item = |i: usize| {
        let (centre, size) = (centre(i), 0.001 + 0.1 * place(i, 977) * place(i, 499));
        Item::new(&PaddedBox { min: (centre - size).into(), max: (centre + size).into() }, i as u32, LeafKind::Triangles)
    };
    (0..count).map(item).collect()
}

/// Expected cost of parting the items so, and how many each part has, one by one in f64.
fn cost(items: &[Item], left: impl Fn(&Item) -> bool, blocks: bool) -> Option<f64> {
    let part = |side: bool| {
        let own: Vec<PaddedBox> = items.iter().filter(|item| left(item) == side).map(Item::bounds).collect();
        let all = own.iter().fold(PaddedBox::NOTHING, |all, one| all.union(one));
        let e = (all.max - all.min).as_dvec3();
        let weight = if blocks { own.len().div_ceil(WIDTH) } else { own.len() };
        (!own.is_empty()).then_some((e.x * (e.y + e.z) + e.y * e.z) * weight as f64)
    };
    Some(part(true)? + part(false)?)
}

/// Protects: of all planes between bins of all axes the one that costs least is taken, for few items and many, counted in blocks and one by
/// one, spread along one axis, two and three; where all are in one place there is none.
#[test]
fn the_split_costs_least() {
    for (count, axes, blocks) in [
        (3, 3, false),
        (9, 1, true),
        (20, 2, true),
        (47, 3, true),
        (48, 3, false),
        (300, 2, false),
        (2000, 3, true),
        (100, 1, false),
    ] {
        let items = items(count, axes);
        let found = cheapest(|| items.iter(), count, blocks).expect("they are in several places");
        let bins = 0..BINS;
        let price = &|axis: usize, bin: usize| cost(&items, |item| found.scale.bins(item.centre())[axis] <= bin, blocks);
        let least = (0..3).flat_map(|axis| bins.clone().filter_map(move |bin| price(axis, bin))).fold(f64::INFINITY, f64::min);
        let own = price(found.axis, found.bin).expect("neither part is empty");
        assert!(own <= least * (1.0 + 1e-5), "{count} items along {axes} axes: {own} beside {least}");
    }
    let one = items(1, 3);
    assert!(cheapest(|| core::iter::repeat_n(&one[0], 50), 50, true).is_none());
}
