//! Clusters of scattered boxes.

use glam::Vec3;

use super::*;
use crate::build::curve;

/// Creates boxes at scattered positions, a fiftieth of them at a single position.
fn boxes(count: usize) -> Vec<PaddedBox> {
    let at = |i: usize| if i.is_multiple_of(50) { 7 } else { i };
    let place = |i: usize, stride: usize| (at(i) * stride % 20_011) as f32 / 20_011.0;
    let centre = |i: usize| Vec3::new(place(i, 3137), place(i, 6197), place(i, 8117));
    (0..count)
        .map(|i| PaddedBox {
            min: centre(i) - 0.01,
            max: centre(i) + 0.01 + place(i, 977) * 0.05,
        })
        .collect()
}

/// The order of boxes and the nodes of a tree, in a form that can be compared.
type TreeSignature = (Vec<(u32, u32)>, Vec<u32>, u64);

fn run(
    boxes: &[PaddedBox],
    quality: BuildQuality,
    shared: usize,
    maximum: usize,
    threads: usize,
) -> TreeSignature {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| {
        let (mut order, _) = curve::order_along_morton_curve(boxes);
        let clusters = Clustering {
            max_piece: maximum,
            ..Clustering::new(boxes, quality, shared, &|| false)
        }
        .build_tree(&mut order)
        .unwrap();
        (
            clusters
                .to_binary_nodes()
                .iter()
                .map(|node| (node.first, node.count))
                .collect(),
            order,
            clusters.boxes_visited,
        )
    })
}

/// Protects: the tree is the same for any number of threads, built from one piece or from many.
/// Each box is in one leaf, and leaves other than piles respect their size limit.
#[test]
fn trees_are_the_same_for_any_number_of_threads() {
    let boxes = boxes(30_000);
    for (quality, shared, maximum) in [
        (BuildQuality::High, 4, MAX_PIECE),
        (BuildQuality::Medium, 1, 4096),
        (BuildQuality::Fast, 8, 500),
    ] {
        let one = run(&boxes, quality, shared, maximum, 1);
        assert!(
            one == run(&boxes, quality, shared, maximum, 4),
            "{quality:?}"
        );
        let (nodes, order, _) = one;
        let (mut hit_primitives, mut waiting) = (Vec::new(), vec![0]);
        while let Some(index) = waiting.pop() {
            let (first, count) = nodes[index as usize];
            if count == 0 {
                waiting.extend([first, first + 1]);
                continue;
            }
            let own = &order[first as usize..(first + count) as usize];
            assert!(
                own.len() <= shared || own.len() >= 16,
                "{quality:?}: {own:?}"
            );
            hit_primitives.extend_from_slice(own);
        }
        hit_primitives.sort_unstable();
        assert!(
            hit_primitives.into_iter().eq(0..boxes.len() as u32),
            "{quality:?}"
        );
    }
}

/// Protects: a tree joined from many pieces costs rays hardly more than a tree of a single
/// piece, measured by the surface areas of its nodes.
#[test]
fn pieces_are_joined_well() {
    let boxes: Vec<_> = boxes(20_000)
        .into_iter()
        .enumerate()
        .filter(|(i, _)| !i.is_multiple_of(50))
        .map(|(_, own)| own)
        .collect();
    let cost = |maximum: usize| {
        let (mut order, _) = curve::order_along_morton_curve(&boxes);
        let clustering = Clustering {
            max_piece: maximum,
            ..Clustering::new(&boxes, BuildQuality::Medium, 1, &|| false)
        };
        let tree = clustering.build_tree(&mut order).unwrap().tree;
        let (mut cost, mut waiting) = (0.0, vec![0]);
        while let Some(node) = waiting.pop().map(|index: u32| tree.nodes[index as usize]) {
            cost +=
                f64::from(node.aabb().half_area()) / f64::from(tree.nodes[0].aabb().half_area());
            waiting.extend(
                (!node.is_leaf())
                    .then_some([node.first_index, node.first_index + 1])
                    .into_iter()
                    .flatten(),
            );
        }
        cost
    };
    let [whole, pieces] = [cost(MAX_PIECE), cost(2000)];
    assert!(pieces < 1.03 * whole, "{pieces} against {whole}");
}
