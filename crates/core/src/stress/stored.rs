//! What stored coordinates make of a scene, and how large it is.

use glam::DVec3;
use raywright_bvh::{Aabb, Real};

use super::cameras::{View, is_in_view};
use super::facts::{SceneFacts, place};
use super::finding::{Code, Finding, Severity, Subject, decimal};
use super::ray_survey::RaySurvey;
use crate::dispatch::Ready;
use crate::extent::Uses;
use crate::prepare::rounded;
use crate::scene::{MeshData, Scene, Shape};
use crate::settings::PrecisionChoice;
use crate::validate::{Problem, no_area};

/// Sizes in metres between which scenes usually are.
const USUAL: [f64; 2] = [1e-3, 1e6];
/// Share of a scene's size below which an object is hardly a part of it.
const TINY: f64 = 1e-6;

/// Share of an object's reach below which that of the others makes it an outlier.
const FAR: f64 = 1e-5;

/// Shapes of which storing leaves nothing, by the problems for which preparing them is refused.
pub(super) fn lost_shapes(scene: &Scene, problems: &[Problem]) -> Vec<Finding> {
    let finding = |problem: &Problem| {
        let index = |path: &str, list: &str| {
            path.strip_prefix(list)?
                .split(']')
                .next()?
                .parse::<usize>()
                .ok()
        };
        let object = index(&problem.path, "objects[")
            .or_else(|| Some(scene.objects.len() + index(&problem.path, "generators[")?))
            .map_or(Subject::Scene, Subject::Object);
        let remedy = problem
            .hint
            .clone()
            .unwrap_or_else(|| "make it larger".to_owned());
        Finding::new(
            Code::LostShape,
            Severity::PictureWrong,
            object,
            problem.message.clone(),
            remedy,
        )
    };
    problems.iter().map(finding).collect()
}

/// What storing takes from the objects of a prepared scene: the picture is wrong where a camera
/// has that in view.
pub(super) fn check(
    facts: &SceneFacts<'_>,
    ready: &Ready,
    seen: &RaySurvey,
    views: &[View],
) -> Vec<Finding> {
    let finding = |code, object: u32, why: &str, remedy: String| {
        let index = facts.index_of(object);
        let own = &facts.objects[index];
        let is_seen = RaySurvey::count(&seen.met, &index) > 0
            || own.bounds.is_none_or(|bounds| is_in_view(views, &bounds));
        let at = own.bounds.and_then(|bounds| place(bounds.centre()));
        let (severity, end) = match is_seen {
            true => (Severity::PictureWrong, ""),
            false => (Severity::Harmless, "; no camera has it in view"),
        };
        Finding::new(code, severity, own.subject, format!("{why}{end}"), remedy).at(at)
    };
    let exact = match ready.settings().precision {
        PrecisionChoice::Reference => "",
        PrecisionChoice::Robust => ", or add --precision reference",
    };
    let lost = ready.lost();
    let mut found: Vec<Finding> = lost
        .iter()
        .map(|&object| {
            let why = "so far from the rest of the scene, all corners of its triangles are stored as one, so that nothing is left of it";
            let remedy = format!("move it nearer to the rest of the scene{exact}");
            finding(Code::LostObject, object, why, remedy)
        })
        .collect();
    if let Some(object) = ready.unresolved().filter(|object| !lost.contains(object)) {
        let why = "so far from the rest of the scene, points a thousandth of its size apart are stored as one: its shape is shattered";
        let remedy = format!("move it nearer to the rest of the scene{exact}");
        found.push(finding(Code::UnresolvedObject, object, why, remedy));
    }
    found.extend(match ready.settings().precision {
        PrecisionChoice::Robust => lost_triangles::<f32>(facts, lost, seen),
        PrecisionChoice::Reference => lost_triangles::<f64>(facts, lost, seen),
    });
    found.extend(scale(facts));
    found
}

/// Triangles with an area that storing makes flat, of objects of which others stay.
fn lost_triangles<R: Real>(facts: &SceneFacts<'_>, lost: &[u32], seen: &RaySurvey) -> Vec<Finding> {
    let origin = crate::origin::StorageOrigin::of::<R>(facts.scene, &facts.lookup).origin;
    // What instances share is stored in its own space.
    let uses = Uses::of(facts.scene);
    let mut found = Vec::new();
    for own in facts
        .objects
        .iter()
        .filter(|own| !lost.contains(&(own.subject.index() as u32)))
    {
        let (Some((_, data)), Shape::Mesh(name)) = (facts.mesh(own.object), &own.object.shape)
        else {
            continue;
        };
        if uses.share(name, own.object.side) {
            continue;
        }
        let map = own.map;
        let is_flat = |corners: [DVec3; 3]| {
            let [a, b, c] = corners;
            a == b || b == c || c == a || no_area(b - a, c - a)
        };
        let stored = |p: DVec3| {
            DVec3::from(
                (map.transform_point3(p) - origin)
                    .to_array()
                    .map(rounded::<R>),
            )
        };
        let is_lost = |corners: &[u32; 3]| {
            let corners = corners.map(|corner| data.positions.at(corner as usize));
            is_flat(corners.map(stored)) && !is_flat(corners)
        };
        if is_safe::<R>(data, map.translation - origin, map.matrix3.x_axis.length()) {
            continue;
        }
        let (mut count, mut first) = (0, None);
        for (index, _) in data
            .indices
            .iter()
            .enumerate()
            .filter(|(_, corners)| is_lost(corners))
        {
            count += 1;
            first = first.or(Some(index as u32));
        }
        let Some(first) = first else { continue };
        let of = data.indices.len() as u64;
        let is_seen = RaySurvey::count(&seen.met, &own.subject.index()) > 0;
        let severity = if count * 100 >= of && is_seen {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        };
        let why = "corners of triangles are stored as one, or on a line, since they are so small and so far from the rest of the scene";
        let finding = Finding::new(
            Code::LostTriangles,
            severity,
            own.subject,
            why,
            "move the mesh nearer to the rest of the scene, or add --precision reference",
        );
        let corner = data.indices[first as usize][0];
        let at = place(map.transform_point3(data.positions.at(corner as usize)));
        found.push(
            finding
                .counted(count, of, "triangles", "lost their area")
                .of_primitive(first)
                .at(at),
        );
    }
    found
}

/// Whether a mesh is stored where its own digits are kept: no farther away than its own numbers are
/// great.
fn is_safe<R: Real>(data: &MeshData, away: DVec3, scale: f64) -> bool {
    let greatest = data
        .positions
        .iter()
        .fold(0.0_f64, |greatest, p| greatest.max(p.abs().max_element()));
    !R::IS_SINGLE
        || data.positions.origin() == DVec3::ZERO && away.abs().max_element() <= greatest * scale
}

/// Sizes that are probably in other units.
fn scale(facts: &SceneFacts<'_>) -> Vec<Finding> {
    let far = outliers(facts);
    let mut found: Vec<Finding> = far.iter().map(|outlier| outlier.finding(facts)).collect();
    let rest = facts
        .objects
        .iter()
        .enumerate()
        .filter(|(index, _)| !far.iter().any(|outlier| outlier.object == *index))
        .filter_map(|(_, own)| own.bounds);
    let size = match far.is_empty() {
        true => facts.diagonal(),
        false => diagonal(rest),
    };
    if size > 0.0 && !(USUAL[0]..=USUAL[1]).contains(&size) {
        let why = format!(
            "all of it is {} metres across: it is probably in other units, and lights and glass are in metres",
            decimal(size)
        );
        found.push(Finding::new(
            Code::ExtremeScale,
            Severity::Harmless,
            Subject::Scene,
            why,
            "scale it to metres",
        ));
    }
    for own in &facts.objects {
        let radius = match own.object.shape {
            Shape::Sphere { radius, .. } | Shape::Disk { radius, .. } => radius,
            _ => continue,
        };
        let size_of = radius * own.map.matrix3.determinant().abs().cbrt();
        if size_of < TINY * size {
            let why = format!(
                "its radius is {} metres, {} of the scene's size",
                decimal(size_of),
                decimal(size_of / size)
            );
            let finding = Finding::new(
                Code::ExtremeScale,
                Severity::Harmless,
                own.subject,
                why,
                "look whether it is in other units than the rest",
            );
            found.push(finding.at(own.bounds.and_then(|bounds| place(bounds.centre()))));
        }
    }
    found
}

fn diagonal(bounds: impl Iterator<Item = Aabb>) -> f64 {
    let all = bounds.fold(Aabb::EMPTY, |all, bounds| all.union(bounds));
    if all.is_empty() {
        0.0
    } else {
        all.extent().length()
    }
}

/// An object that reaches far beyond most others.
struct Outlier {
    object: usize,
    /// How far it reaches from the middle of the others, and how far they do, in metres.
    reach: f64,
    others: f64,
}

impl Outlier {
    fn finding(&self, facts: &SceneFacts<'_>) -> Finding {
        let own = &facts.objects[self.object];
        let why = format!(
            "it reaches {} metres far, and most other objects no more than {} metres",
            decimal(self.reach),
            decimal(self.others)
        );
        Finding::new(
            Code::ExtremeScale,
            Severity::Harmless,
            own.subject,
            why,
            "look whether it is in other units than the rest, or out of its place",
        )
        .at(own.bounds.and_then(|bounds| place(bounds.centre())))
    }
}

/// Objects without which the scene is a small share of its size, of less than half of them.
fn outliers(facts: &SceneFacts<'_>) -> Vec<Outlier> {
    const FEWEST: usize = 3;
    let bounded: Vec<(usize, Aabb)> = facts
        .objects
        .iter()
        .enumerate()
        .filter_map(|(index, own)| Some((index, own.bounds?)))
        .collect();
    if bounded.len() < FEWEST {
        return Vec::new();
    }
    let median = |axis: usize| {
        let mut centres: Vec<f64> = bounded.iter().map(|(_, own)| own.centre()[axis]).collect();
        let middle = centres.len() / 2;
        *centres.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let middle = DVec3::from([0, 1, 2].map(median));
    let reach = |bounds: &Aabb| {
        let farthest = (bounds.min - middle).abs().max((bounds.max - middle).abs());
        farthest.length()
    };
    let mut reaches: Vec<(f64, usize)> = bounded
        .iter()
        .map(|(index, bounds)| (reach(bounds), *index))
        .collect();
    reaches.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let half = reaches.len() / 2 + 1;
    let jump = (half..reaches.len())
        .find(|&at| reaches[at - 1].0 < FAR * reaches[at].0 && reaches[at - 1].0 > 0.0);
    let Some(first) = jump else {
        return Vec::new();
    };
    let others = reaches[first - 1].0;
    reaches[first..]
        .iter()
        .map(|&(reach, object)| Outlier {
            object,
            reach,
            others,
        })
        .collect()
}
