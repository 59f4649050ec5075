//! Nested and coinciding closed surfaces, and holes in them.

use super::strays::ball_scene;
use super::*;

/// Protects: two coinciding shells of opposite orientation are reported as repeated triangles, not
/// as inside out too.
#[test]
fn two_shells_in_one_place_are_one_cause() {
    let shells = ball_scene("paint", |_, indices| {
        indices.extend(indices.clone().iter().map(|&[a, b, c]| [a, c, b]));
    });
    alone(&shells, FaultKind::DuplicateTriangles, Harmless);
}

/// Protects: glass whose triangles are parted by slits that hardly any ray passes is not said to
/// make the picture wrong. The remedy is to merge the corners.
#[test]
fn narrow_slits_in_glass() {
    let cracked = ball_scene("glass", |positions, indices| {
        let old = core::mem::take(positions);
        for (i, triangle) in indices.iter_mut().enumerate() {
            for (k, corner) in triangle.iter_mut().enumerate() {
                let shift = 2e-5 * ((3 * i + k) % 5) as f64 / 4.0;
                let [x, y, z] = old[*corner as usize];
                *corner = positions.len() as u32;
                positions.push([x + shift, y - shift, z]);
            }
        }
    });
    let finding = alone(&cracked, FaultKind::OpenEdges, Harmless);
    assert!(finding.remedy.starts_with("merge vertices"), "{finding:?}");
}

/// Protects: the wall of a bubble in glass makes the picture wrong if it is oriented outwards, and
/// is right if oriented inwards. A closed part outside the other, but inside its bounding box, is
/// no bubble.
#[test]
fn bubbles_are_turned_inwards() {
    let with_inner = |scale: f64, away: f64, turned: bool| {
        ball_scene("glass", |positions, indices| {
            let (more, count) = (positions.clone(), positions.len() as u32);
            positions.extend(more.iter().map(|p| p.map(|x| scale * x + away)));
            let inner = |&[a, b, c]: &[u32; 3]| match turned {
                true => [a + count, c + count, b + count],
                false => [a + count, b + count, c + count],
            };
            indices.extend(indices.clone().iter().map(inner));
        })
    };
    assert_eq!(
        listed(&summarise_findings(&with_inner(0.6, 0.0, true)).findings),
        []
    );
    let finding = alone(
        &with_inner(0.6, 0.0, false),
        FaultKind::InsideOut,
        PictureWrong,
    );
    assert_eq!((finding.count, finding.of), (528, 1056));
    assert!(finding.message.contains("bubbles"), "{finding:?}");
    // In the corner of the box.
    assert_eq!(
        listed(&summarise_findings(&with_inner(0.1, 0.8, false)).findings),
        []
    );
}

/// Protects: a missing triangle of an opaque ball makes the picture wrong if a camera sees through
/// the hole. On the far side it is harmless. A bowl, loose triangles, a triangle beside a ball and
/// a tent have no such hole.
#[test]
fn a_hole_in_what_is_closed_otherwise() {
    let without = |near: bool| {
        ball_scene("paint", |positions, indices| {
            let depth = |t: &[u32; 3]| t.iter().map(|&c| positions[c as usize][2]).sum::<f64>();
            let by_depth =
                |a: &usize, b: &usize| depth(&indices[*a]).total_cmp(&depth(&indices[*b]));
            let all = 0..indices.len();
            let hole = if near {
                all.max_by(by_depth)
            } else {
                all.min_by(by_depth)
            };
            indices.remove(hole.expect("a triangle"));
        })
    };
    let finding = alone(&without(true), FaultKind::OpenEdges, PictureWrong);
    assert_eq!(
        finding.count_text().as_deref(),
        Some("1 hole with three edges")
    );
    assert!(finding.pixel.is_some(), "{finding:?}");
    alone(&without(false), FaultKind::OpenEdges, Harmless);
    for (near, severity) in [(true, PictureWrong), (false, Harmless)] {
        let mut one_sided = without(near);
        one_sided.objects[0].side = raywright_core::scene::SideRule::Outside;
        alone(&one_sided, FaultKind::OpenEdges, severity);
    }
    let bowl = ball_scene("paint", |positions, indices| {
        indices.retain(|t| t.iter().all(|&corner| positions[corner as usize][1] < 0.3));
    });
    assert_eq!(listed(&summarise_findings(&bowl).findings), []);
    let heap = ball_scene("paint", |positions, indices| {
        *positions = indices
            .iter()
            .flatten()
            .enumerate()
            .map(|(i, &corner)| {
                positions[corner as usize].map(|x| x * (1.0 + 1e-3 * (i / 3) as f64))
            })
            .collect();
        *indices = (0..indices.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
    });
    assert_eq!(listed(&summarise_findings(&heap).findings), []);
    // A triangle by itself beside the ball, and a tent without a floor.
    let beside = ball_scene("paint", |positions, indices| {
        let first = positions.len() as u32;
        positions.extend([[1.5, 0.0, 0.0], [2.0, 0.0, 0.0], [1.5, 0.5, 0.0]]);
        indices.push([first, first + 1, first + 2]);
    });
    assert_eq!(listed(&summarise_findings(&beside).findings), []);
    let tent = ball_scene("paint", |positions, indices| {
        *positions = vec![
            [0.0, 1.0, 0.0],
            [-1.0, -0.5, 0.5],
            [1.0, -0.5, 0.5],
            [0.0, -0.5, -1.0],
        ];
        *indices = vec![[0, 1, 2], [0, 2, 3], [0, 3, 1]];
    });
    assert_eq!(listed(&summarise_findings(&tent).findings), []);
}

/// Protects: a copy of a generator that coincides with a listed object is found, with the severity
/// of two listed objects.
#[test]
fn a_copy_over_a_listed_object() {
    let of = |material: &str, y: f64| {
        scene(&json!({
            "objects": [object("listed", ball([0.0, 0.0, 0.0], 0.7), "paint")],
            "generators": [{
                "kind": { "grid": { "counts": [3, 1, 1], "origin": [-1.6, y, 0], "step": [1.6, 0, 0] } },
                "object": object("copy", ball([0.0; 3], 0.7), material),
            }],
        }))
    };
    assert_eq!(listed(&summarise_findings(&of("other", 0.2)).findings), []);
    for (material, severity) in [("other", PictureWrong), ("paint", Harmless)] {
        let finding = alone(&of(material, 0.0), FaultKind::DuplicateObject, severity);
        assert_eq!((finding.count, finding.of), (1, 3));
        assert!(
            finding
                .message
                .starts_with("a copy of it is in the same place as object `listed`")
                && finding.place.is_some_and(|[x, ..]| x.abs() < 1e-9),
            "{finding:?}"
        );
    }
}
