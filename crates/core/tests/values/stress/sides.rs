//! Objects that are hidden from one side, and cameras inside a body.

use super::light::with_lamp;
use super::meshes::plain;
use super::*;

type Positions = Vec<[f64; 3]>;
type Triangles = Vec<[u32; 3]>;

/// Flips triangles of a cube: all of them, those of the front, or those of the back.
fn flip(range: core::ops::Range<usize>) -> impl Fn(&mut Positions, &mut Triangles) + Copy {
    let (start, end) = (range.start, range.end);
    move |_, triangles| triangles[start..end].iter_mut().for_each(|t| t.swap(1, 2))
}

fn with_pose(mut scene: Scene, eye: [f64; 3], target: [f64; 3]) -> Scene {
    let pose = json!({ "look_at": { "eye": eye, "target": target } });
    scene.cameras[0].pose = serde_json::from_value(pose).expect("a pose");
    scene
}

/// Protects: flipped triangles of a one-sided mesh make the picture wrong if a camera looks through
/// them, or sees them where their neighbours are hidden. Elsewhere they are harmless, and the
/// reason does not say that both sides look alike.
#[test]
fn flipped_triangles_of_one_sided_meshes() {
    let (front, back) = (flip(10..12), flip(8..10));
    let code = FaultKind::FlippedTriangles;
    for (change, side, severity, words) in [
        (
            front,
            "outside",
            PictureWrong,
            "the camera sees through them",
        ),
        (
            front,
            "culled",
            PictureWrong,
            "the camera sees through them",
        ),
        (
            front,
            "inside",
            PictureWrong,
            "where their neighbours are hidden",
        ),
    ] {
        let finding = alone(&plain(change, "paint", side), code, severity);
        assert!(finding.message.contains(words), "{side}: {finding:?}");
    }
    for side in ["outside", "culled"] {
        let finding = alone(&plain(back, "paint", side), code, Harmless);
        assert!(!finding.message.contains("both sides"), "{finding:?}");
    }
}

/// Protects: an inverted cube makes the picture wrong if its visible sides are turned away from the
/// camera, and is harmless if they face the camera. `side` decides which sides are visible.
#[test]
fn inverted_one_sided_meshes() {
    let code = FaultKind::InsideOut;
    let of = |side: &str| plain(flip(0..12), "paint", side);
    for side in ["outside", "culled"] {
        let finding = alone(&of(side), code, PictureWrong);
        assert!(finding.message.contains("sees through"), "{finding:?}");
    }
    let finding = alone(&of("inside"), code, Harmless);
    assert!(!finding.message.contains("both sides"), "{finding:?}");
    let within = |side: &str| with_pose(of(side), [0.0, 0.0, 0.3], [2.5, 0.0, -1.0]);
    expect_finding(&within("inside"), code, PictureWrong, &[]);
    let all = summarise_findings(&within("outside")).findings;
    let found = all.iter().find(|finding| finding.kind == code);
    assert_eq!(found.map(|finding| finding.severity), Some(Harmless));
}

/// Protects: a camera that sees nothing, as it looks at the hidden side of an object, is told so.
/// Turning the camera would not help.
#[test]
fn a_camera_behind_one_sided_walls() {
    for side in ["outside", "culled"] {
        let mut cube = with_pose(
            plain(|_, _| {}, "paint", side),
            [0.0, 0.0, 0.3],
            [0.0, 0.0, -1.0],
        );
        let finding = expect_finding(&cube, FaultKind::NothingSeen, PictureWrong, &[]);
        assert!(
            finding.message.contains("object `cube`")
                && finding.remedy.starts_with("set `side = \"both\"`"),
            "{finding:?}"
        );
        cube.objects[0].side = raywright_core::scene::SideRule::Both;
        let all = summarise_findings(&cube).findings;
        let is_nothing = |finding: &Fault| finding.kind == FaultKind::NothingSeen;
        assert!(!all.iter().any(is_nothing), "{all:?}");
    }
}

/// Protects: a camera in a ball on an endless ground is inside a body, and its black picture is not
/// reported beside that. A luminous dome over an endless ground is the sky of its scene.
#[test]
fn a_camera_in_a_ball_on_a_plane() {
    let of = |radius: f64, material: &str| {
        let floor = json!({ "plane": { "point": [0, -1, 0], "normal": [0, 1, 0] } });
        let of = scene(&json!({
            "materials": with_lamp(1.0),
            "objects": [object("floor", floor, "paint"), object("shell", ball([0.0; 3], radius), material)],
        }));
        with_pose(of, [0.0, 0.2, 0.0], [0.0, 1.5, -3.0])
    };
    let finding = alone(&of(1.0, "paint"), FaultKind::CameraInBody, PictureWrong);
    assert!(finding.message.contains("object `shell`"), "{finding:?}");
    assert_eq!(listed(&summarise_findings(&of(50.0, "lamp")).findings), []);
}

/// Protects: two one-sided faces back to back in one plane, as the leaf of a plant, are no fault,
/// also for a camera on either side: no ray can hit both. Without `side` they compete, as do two
/// one-sided faces that face the same way.
#[test]
fn one_sided_faces_back_to_back() {
    let of = |sides: [&str; 2], turned: bool| {
        let mut front = object(
            "front",
            quad([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
            "paint",
        );
        let edge = if turned { 1.0 } else { -1.0 };
        let mut back = object(
            "back",
            quad([edge, -1.0, 0.0], [-2.0 * edge, 0.0, 0.0], [0.0, 1.9, 0.0]),
            "other",
        );
        (front["side"], back["side"]) = (json!(sides[0]), json!(sides[1]));
        let mut leaf = scene(&json!({ "objects": [front, back] }));
        let mut behind = leaf.cameras[0].clone();
        let pose = json!({ "look_at": { "eye": [0.5, 1.5, -6], "target": [0, 0, 0] } });
        behind.pose = serde_json::from_value(pose).expect("a pose");
        leaf.cameras.push(behind);
        summarise_findings(&leaf).findings
    };
    for sides in [["outside"; 2], ["culled"; 2], ["inside"; 2]] {
        assert_eq!(listed(&of(sides, true)), [], "{sides:?}");
    }
    for (sides, turned) in [(["both"; 2], true), (["outside"; 2], false)] {
        let found = of(sides, turned);
        let competes = |finding: &Fault| finding.kind == FaultKind::CoplanarSurfaces;
        assert!(
            found.iter().any(competes),
            "{sides:?}: {:?}",
            listed(&found)
        );
    }
}

/// Protects: a camera below an opaque floor that sees no other object is reported, whether the
/// floor is a plane or a slab. Below a floor that leaves an object in view it is not.
#[test]
fn a_camera_below_the_floor() {
    let of = |floor: Value, objects: Vec<Value>| {
        let mut all = vec![object("floor", floor, "other")];
        all.extend(objects);
        let of = scene(&json!({ "objects": all }));
        with_pose(of, [0.0, -3.0, 5.0], [0.0, 0.5, 0.0])
    };
    let plane = json!({ "plane": { "point": [0, -1, 0], "normal": [0, 1, 0] } });
    let slab = json!({ "box": { "min": [-9, -1.2, -9], "max": [9, -1, 9] } });
    let above = || object("above", ball([0.0; 3], 1.0), "paint");
    let below = || object("below", ball([0.0, -2.0, 1.0], 0.5), "paint");
    let finding = alone(
        &of(plane.clone(), vec![above()]),
        FaultKind::CameraInBody,
        PictureWrong,
    );
    assert!(
        finding.message.contains("behind object `floor`"),
        "{finding:?}"
    );
    let finding = alone(
        &of(slab.clone(), vec![above()]),
        FaultKind::NothingSeen,
        PictureWrong,
    );
    assert!(finding.message.contains("hides all other"), "{finding:?}");
    for floor in [plane, slab] {
        let clean = of(floor, vec![above(), below()]);
        assert_eq!(listed(&summarise_findings(&clean).findings), []);
    }
}

/// Protects: a lens that reaches into an opaque block beside it is reported. A small one is not.
#[test]
fn a_lens_in_a_wall() {
    let of = |aperture: f64| {
        let wall = json!({ "box": { "min": [0.1, -1, 5], "max": [3, 3, 6.5] } });
        let mut of = scene(&json!({
            "objects": [object("ball", ball([0.0; 3], 1.0), "paint"), object("wall", wall, "other")],
        }));
        let lens = json!({ "thin_lens": { "pinhole": { "vertical_fov": 40 }, "aperture_radius": aperture, "focus_distance": 6 } });
        of.cameras[0].projection = serde_json::from_value(lens).expect("a lens");
        with_pose(of, [0.0, 1.5, 6.0], [0.0, 0.0, 0.0])
    };
    let finding = alone(&of(0.3), FaultKind::CameraInBody, PictureWrong);
    assert!(finding.message.contains("its lens"), "{finding:?}");
    assert_eq!(listed(&summarise_findings(&of(0.05)).findings), []);
}

/// Protects: a camera below an endless floor is told so too if it sees the horizon, below which its
/// rays hit nothing.
#[test]
fn a_camera_below_the_floor_that_sees_the_horizon() {
    let floor = json!({ "plane": { "point": [0, -1, 0], "normal": [0, 1, 0] } });
    let of = scene(&json!({
        "objects": [object("floor", floor, "other"), object("above", ball([0.0; 3], 1.0), "paint")],
    }));
    let level = with_pose(of, [0.0, -3.0, 5.0], [0.0, -3.0, 0.0]);
    let finding = alone(&level, FaultKind::CameraInBody, PictureWrong);
    assert!(
        finding.message.contains("behind object `floor`"),
        "{finding:?}"
    );
    assert!(2 * finding.count <= finding.of, "{finding:?}");
}

/// Protects: an opaque cell around a camera is a single finding. The camera's lens does not reach
/// into the cell from outside, and glass around the cell is not seen.
#[test]
fn a_camera_in_an_opaque_cell() {
    let in_cell = |other: Value| {
        let cell = object("cell", ball([0.0, 0.0, 6.0], 0.5), "paint");
        let of = scene(&json!({ "objects": [other, cell] }));
        with_pose(of, [0.0, 0.0, 6.0], [0.0; 3])
    };
    let glass = in_cell(object("pond", ball([0.0; 3], 9.0), "glass"));
    let mut lens = in_cell(object("ball", ball([0.0; 3], 1.0), "paint"));
    let thin = json!({ "thin_lens": { "pinhole": { "vertical_fov": 40 }, "aperture_radius": 0.01, "focus_distance": 6 } });
    lens.cameras[0].projection = serde_json::from_value(thin).expect("a lens");
    for of in [glass, lens] {
        let finding = alone(&of, FaultKind::CameraInBody, PictureWrong);
        assert!(
            finding.message.contains("inside object `cell`"),
            "{finding:?}"
        );
    }
}

/// Protects: a rug in the plane of a floor that is hidden from the camera's side competes with the
/// floor for no ray: nothing is said. If its visible side faces the camera, it is lost.
#[test]
fn a_rug_that_faces_away_is_not_lost() {
    let sheet = |r: f64| quad([-r, -1.0, r], [2.0 * r, 0.0, 0.0], [0.0, 0.0, -2.0 * r]);
    let of = |side: &str| {
        let mut rug = object("rug", sheet(1.0), "other");
        rug["side"] = json!(side);
        scene(&json!({ "objects": [object("floor", sheet(4.0), "paint"), rug] }))
    };
    assert_eq!(listed(&summarise_findings(&of("inside")).findings), []);
    alone(&of("outside"), FaultKind::CoplanarSurfaces, PictureWrong);
}
