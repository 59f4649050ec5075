//! Findings about meshes: single triangles, holes, orientation and stray vertices. The severity
//! depends on what the cameras see of a fault.

use super::topology::{HalfEdge, Topology, TriangularHole};
use super::*;

/// Share of the rays through an object above which a fault of the object shows in the picture.
const SEEN: f64 = 0.01;
/// Number of rays up to which a fault counts as unseen.
const FEW_RAYS: u64 = 2;

/// A mesh with the objects that show it.
pub(super) struct UsedMesh<'a> {
    pub facts: &'a SceneFacts<'a>,
    pub survey: &'a RaySurvey,
    pub data: &'a MeshData,
    pub objects: Vec<&'a ObjectFacts<'a>>,
    topology: &'a Topology,
}

impl SceneFacts<'_> {
    /// Returns the connectivity of each mesh in use.
    pub fn find_topologies(&self) -> BTreeMap<usize, Topology> {
        let shown = self.shown_meshes().into_iter();
        shown
            .map(|(mesh, (data, _))| (mesh, Topology::from_mesh(data)))
            .collect()
    }

    /// Returns the findings about the meshes of the scene.
    pub fn check_meshes(&self, survey: &RaySurvey) -> Vec<StressFinding> {
        let used = |(mesh, (data, objects))| UsedMesh {
            facts: self,
            survey,
            data,
            objects,
            topology: &self.topologies[&mesh],
        };
        let meshes: Vec<UsedMesh<'_>> = self.shown_meshes().into_iter().map(used).collect();
        let flat = meshes.iter().filter(|mesh| mesh.is_flat());
        let is_nothing_left =
            flat.map(|mesh| mesh.objects.len()).sum::<usize>() == self.objects.len();
        let mut findings = Vec::new();
        for mesh in &meshes {
            findings.extend(mesh.check_degenerate_triangles(is_nothing_left));
            findings.extend(mesh.check_normals());
            findings.extend(mesh.check_duplicates());
            findings.extend(mesh.check_edges());
            findings.extend(mesh.check_orientation());
            findings.extend(mesh.check_stray_vertices());
            findings.extend(mesh.check_bubble_walls());
            findings.extend(mesh.check_holes());
            findings.extend(mesh.check_texture_coordinates());
        }
        findings
    }
}

impl UsedMesh<'_> {
    /// Returns the mean of some corners of an object, in world space.
    pub fn corner_centroid(&self, object: &ObjectFacts<'_>, corners: &[u32]) -> DVec3 {
        let positions = corners
            .iter()
            .map(|&corner| self.data.positions.position(corner as usize));
        let mean = positions.sum::<DVec3>() / corners.len() as f64;
        object.object_to_world.transform_point3(mean)
    }

    pub fn triangle_centre(&self, object: &ObjectFacts<'_>, triangle: u32) -> DVec3 {
        self.corner_centroid(object, &self.data.indices[triangle as usize])
    }

    pub fn triangle_count(&self) -> u64 {
        self.data.indices.len() as u64
    }

    /// Returns whether no triangle has an area.
    fn is_flat(&self) -> bool {
        self.topology.faults.degenerate.count == self.triangle_count()
    }

    /// Counts the triangles of a finding, and marks that nearest to a camera.
    pub fn with_triangles(
        &self,
        finding: StressFinding,
        object: &ObjectFacts<'_>,
        (tally, predicate): (&CountAndFirst, &'static str),
    ) -> StressFinding {
        let finding =
            finding.with_count(tally.count, self.triangle_count(), "triangles", predicate);
        let corners = |&triangle: &u32| (triangle, &self.data.indices[triangle as usize][..]);
        self.with_nearest(finding, object, tally.some.iter().map(corners))
    }

    /// Counts the edges of a finding, and marks the middle of that nearest to a camera.
    fn with_edges(
        &self,
        finding: StressFinding,
        object: &ObjectFacts<'_>,
        (tally, predicate): (&CountAndFirst<HalfEdge>, &'static str),
    ) -> StressFinding {
        let finding = finding.with_count(tally.count, self.topology.edges, "edges", predicate);
        let edges = tally.some.iter();
        self.with_nearest(
            finding,
            object,
            edges.map(|edge| (edge.triangle, &edge.ends[..])),
        )
    }

    /// Marks the triangle whose corners are nearest to a camera.
    fn with_nearest<'b>(
        &self,
        finding: StressFinding,
        object: &ObjectFacts<'_>,
        items: impl Iterator<Item = (u32, &'b [u32])>,
    ) -> StressFinding {
        let places =
            items.map(|(triangle, corners)| (triangle, self.corner_centroid(object, corners)));
        match self.facts.nearest_to_camera(places) {
            Some((triangle, place)) => finding.with_primitive(triangle).with_place(place),
            None => finding,
        }
    }

    /// Returns whether a fault of an object is visible. `event` is the event of the rays that hit the
    /// fault. More than two rays must hit it, and more than a hundredth of the rays through the
    /// object.
    fn is_seen_on(&self, event: fn(usize) -> RayEvent, object: &ObjectFacts<'_>) -> bool {
        let [rays, all] =
            [event, RayEvent::Crossed].map(|event| self.survey.count(event(object.index)));
        rays > FEW_RAYS && rays as f64 > SEEN * all as f64
    }

    /// Returns the first object that is of interest and shows a fault, or else the first one of
    /// interest, with whether the fault shows.
    fn pick_object(
        &self,
        is_of_interest: impl Fn(&ObjectFacts<'_>) -> bool,
        is_seen: impl Fn(&ObjectFacts<'_>) -> bool,
    ) -> Option<(&ObjectFacts<'_>, bool)> {
        let of_interest = || self.objects.iter().filter(|object| is_of_interest(object));
        let seen = of_interest().find(|object| is_seen(object));
        let object = seen.or(of_interest().next())?;
        Some((object, seen.is_some()))
    }

    fn check_degenerate_triangles(&self, is_nothing_left: bool) -> Option<StressFinding> {
        let (object, tally) = (self.objects.first()?, &self.topology.faults.degenerate);
        let severity = Severity::if_seen(self.is_flat() && is_nothing_left);
        let (reason, remedy) = match self.is_flat() {
            false => (
                "triangles have no area, so that no ray hits them: two corners coincide, or all three lie on a line",
                "nothing, or remove the triangles in the modelling program",
            ),
            true => (
                "none of its triangles has an area, so that it is invisible: a scale of 0 has flattened it, or the corners of each triangle coincide or lie on a line",
                "look for a scale of 0 in the object or its parent nodes, and replace it; if the object should be invisible, remove it",
            ),
        };
        let code = FindingCode::DegenerateTriangles;
        let finding = code.finding(severity, object.subject(), reason, remedy);
        (tally.count > 0).then(|| self.with_triangles(finding, object, (tally, "had no area")))
    }

    fn check_normals(&self) -> Option<StressFinding> {
        let tally = &self.topology.faults.opposed_normals;
        let (object, is_seen) = self.pick_object(
            |_| tally.count > 0,
            |object| self.is_seen_on(RayEvent::OpposedNormals, object),
        )?;
        let finding = FindingCode::NormalsAgainstFaces.finding(
            Severity::if_seen(is_seen),
            object.subject(),
            "all three vertex normals of these triangles point to the back, so that the triangles are shaded as if turned away",
            "recompute the normals, or flip the triangles, in the modelling program",
        );
        Some(self.with_triangles(finding, object, (tally, "had such normals")))
    }

    fn check_duplicates(&self) -> Option<StressFinding> {
        let [same, turned] = &self.topology.duplicates;
        let tally = if same.count > 0 { same } else { turned };
        let (object, is_blended) = self.pick_object(
            |_| tally.count > 0,
            |object| object.is_blended() && same.count > 0,
        )?;
        let reason = match is_blended {
            true => "triangles are repeated in one place, and both dim the light that passes",
            false => "triangles are repeated in one place; of each two, only one is seen",
        };
        let finding = FindingCode::DuplicateTriangles.finding(
            Severity::if_seen(is_blended),
            object.subject(),
            reason,
            "remove the repeated triangles in the modelling program",
        );
        Some(self.with_triangles(finding, object, (tally, "repeated another")))
    }

    /// Finds irregular edges of glass bodies, which have to be closed.
    fn check_edges(&self) -> Vec<StressFinding> {
        let topology = self.topology;
        // Through a seam pass a few rays without effect. Through a hole, a few rays are its pixels.
        let has_holes = topology.open_edges.count > 0 && topology.seam.is_none();
        let seen = self.pick_object(
            |o| o.is_body(),
            |object| {
                let unbalanced = self.survey.count(RayEvent::Unbalanced(object.index));
                self.is_seen_on(RayEvent::Unbalanced, object) || has_holes && unbalanced > FEW_RAYS
            },
        );
        let Some((object, is_seen)) = seen else {
            return Vec::new();
        };
        let (severity, subject) = (Severity::if_seen(is_seen), object.subject());
        let mut findings = Vec::new();
        if topology.open_edges.count > 0 {
            let (reason, remedy) = open_edge_texts(topology.seam, is_seen);
            let finding = FindingCode::OpenEdges.finding(severity, subject, reason, remedy);
            let label = (&topology.open_edges, "had one triangle only");
            findings.push(self.with_edges(finding, object, label));
        }
        if topology.non_manifold_edges.count > 0 {
            let finding = FindingCode::NonManifoldEdges.finding(
                severity,
                subject,
                "more than two triangles meet at edges of this glass body, so that its inside and outside are undefined there",
                "split the body at these edges, or remove the walls inside the body",
            );
            let label = (&topology.non_manifold_edges, "had more than two triangles");
            findings.push(self.with_edges(finding, object, label));
        }
        findings
    }

    /// Finds triangles and closed parts with the wrong orientation.
    fn check_orientation(&self) -> Vec<StressFinding> {
        let inside_out = self.topology.inverted_parts();
        let flipped = (&self.topology.flipped, "faced the other way than most");
        let findings = [
            self.orientation_finding(FindingCode::FlippedTriangles, flipped),
            self.orientation_finding(
                FindingCode::InsideOut,
                (&inside_out, "belong to these surfaces"),
            ),
        ];
        findings.into_iter().flatten().collect()
    }

    fn orientation_finding(
        &self,
        code: FindingCode,
        label: (&CountAndFirst, &'static str),
    ) -> Option<StressFinding> {
        let is_flipped = code == FindingCode::FlippedTriangles;
        let effect = |object: &ObjectFacts<'_>| self.orientation_effect(is_flipped, object);
        let (object, is_seen) =
            self.pick_object(|_| label.0.count > 0, |object| effect(object).is_some())?;
        let what = match is_flipped {
            true => "triangles are oriented differently from their neighbours",
            false => "closed surfaces are oriented inwards",
        };
        let two_sided = |object: &&ObjectFacts<'_>| !object.is_body() && !object.hides_back_faces();
        let end = effect(object).unwrap_or(match self.objects.iter().all(two_sided) {
            true => "; both sides look alike, so that the fault is not visible",
            false => "; no camera sees an effect of it",
        });
        let finding = code.finding(
            Severity::if_seen(is_seen),
            object.subject(),
            format!("{what}{end}"),
            "flip them in the modelling program (\"recalculate outside\")",
        );
        Some(self.with_triangles(finding, object, label))
    }

    /// Returns what the cameras see of a wrong orientation on an object, or `None`.
    fn orientation_effect(
        &self,
        is_flipped: bool,
        object: &ObjectFacts<'_>,
    ) -> Option<&'static str> {
        type Effect = (fn(usize) -> RayEvent, &'static str);
        let effects: &[Effect] = match (object.is_body(), is_flipped) {
            // Rays leave a body that is inside out before they enter it, but do so in pairs.
            (true, false) => &[(
                RayEvent::Crossed,
                ", so that glass bends light the wrong way there",
            )],
            (true, true) => &[(
                RayEvent::Unbalanced,
                ", so that glass bends light the wrong way there",
            )],
            (false, false) => &[(
                RayEvent::InsideOutHidden,
                ", so that the camera sees through them",
            )],
            (false, true) => &[
                (
                    RayEvent::FlippedHidden,
                    ", so that the camera sees through them",
                ),
                (
                    RayEvent::FlippedShown,
                    ", so that the camera sees them where their neighbours are hidden",
                ),
            ],
        };
        let seen = effects
            .iter()
            .find(|(event, _)| self.is_seen_on(*event, object));
        seen.map(|(_, text)| *text)
    }

    /// Returns a finding that names the first stray vertex. The picture is wrong if a camera has
    /// the other ends of its triangles in view.
    fn check_stray_vertices(&self) -> Option<StressFinding> {
        let strays = &self.topology.faults.strays;
        let (&vertex, &object) = (strays.vertices.first()?, self.objects.first()?);
        let position = |vertex: u32| self.corner_centroid(object, &[vertex]);
        let scale = object.object_to_world.matrix3.determinant().abs().cbrt();
        // Points at a distance from the near ends of the spikes, towards their stray vertices.
        let at = |distance: f64| {
            let is_stray = |corner: &u32| strays.vertices.binary_search(corner).is_ok();
            let points = strays.triangles.iter().flat_map(|&triangle| {
                let corners = self.data.indices[triangle as usize];
                let tip = corners.into_iter().find(is_stray).map(position);
                let near = corners.into_iter().filter(move |corner| !is_stray(corner));
                near.map(move |corner| {
                    let start = position(corner);
                    let way = (tip.unwrap_or(start) - start).normalize_or_zero();
                    (triangle, start + way * distance)
                })
            });
            self.facts.nearest_to_camera(points)
        };
        // The mesh hides many of the near ends, and hardly any point far out on a spike.
        let far_out = [1.0, 2.0, 0.5].into_iter().find_map(|reaches| {
            at(reaches * strays.reach * scale).filter(|(_, place)| self.facts.is_in_view(*place))
        });
        let (triangle, place) = far_out.or_else(|| at(0.0))?;
        let is_seen = self.facts.is_in_view(place);
        let end = if is_seen {
            ""
        } else {
            "; no camera has it in view"
        };
        let [x, y, z] = position(vertex).to_array().map(format_decimal);
        let (named, what) = match strays.vertices.len() {
            1 => (format!("vertex {vertex} is"), "it"),
            more => (format!("vertex {vertex} and {} more are", more - 1), "them"),
        };
        let reason = format!(
            "{named} far out, at ({x}, {y}, {z}) metres, while nearly all others are within {} of the middle of the mesh: the triangles that reach to {what} are spikes, or too thin for any ray to hit{end}",
            format_metres(strays.reach * scale)
        );
        let remedy = format!(
            "in the modelling program, move {what} to the rest of the mesh, or remove {what}: probably a coordinate has lost its decimal point, or was not set"
        );
        let (count, total) = (strays.triangles.len() as u64, self.triangle_count());
        let finding = FindingCode::StrayVertices
            .finding(Severity::if_seen(is_seen), object.subject(), reason, remedy)
            .with_count(count, total, "triangles", "reach to such a vertex");
        Some(finding.with_primitive(triangle).with_place(place))
    }

    /// Returns a finding about bubbles in glass whose walls are oriented the wrong way.
    fn check_bubble_walls(&self) -> Option<StressFinding> {
        let (object, is_seen) = self.pick_object(
            |o| o.is_body(),
            |object| self.is_seen_on(RayEvent::Crossed, object),
        )?;
        let tally = self.topology.outward_inner_parts(self.data);
        let finding = FindingCode::InsideOut.finding(
            Severity::if_seen(is_seen),
            object.subject(),
            "closed surfaces inside this glass are oriented outwards like the surface around them: they are not bubbles but a second layer of glass",
            "in the modelling program, flip the inner surfaces if they are walls of bubbles, otherwise remove them",
        );
        let label = (&tally, "belong to these surfaces");
        (tally.count > 0).then(|| self.with_triangles(finding, object, label))
    }

    /// Returns a finding about triangular holes in an opaque, otherwise closed surface. The picture
    /// is wrong if a camera sees through a hole.
    fn check_holes(&self) -> Option<StressFinding> {
        let holes = &self.topology.holes;
        let is_seen_through = |object: &ObjectFacts<'_>| match object.object.side {
            // Rays that come through it meet the inside.
            SideRule::Both => self.survey.count(RayEvent::FirstHitInside(object.index)) > 0,
            // The inside is not there, so that they meet what is behind.
            side => {
                let faces = |hole| self.faces_camera(object, hole) == (side != SideRule::Inside);
                self.is_seen_on(RayEvent::Crossed, object) && holes.some.iter().any(faces)
            }
        };
        let (object, is_seen) = self.pick_object(
            |object| object.is_opaque() && holes.count > 0,
            is_seen_through,
        )?;
        let end = match is_seen {
            true => "and a camera sees through the hole",
            false => "but no camera sees through the hole",
        };
        let places = holes.some.iter();
        let places = places.map(|hole| ((), self.corner_centroid(object, &hole.corners)));
        let (_, place) = self.facts.nearest_to_camera(places)?;
        let reason = format!(
            "a triangle is missing in an otherwise closed surface, {end}: light enters through the hole, and the inside or the background can show"
        );
        let finding = FindingCode::OpenEdges.finding(
            Severity::if_seen(is_seen),
            object.subject(),
            reason,
            "fill the hole in the modelling program",
        );
        let finding = finding.with_count(holes.count, 0, "holes", "with three edges");
        Some(finding.with_place(place))
    }

    /// Returns whether a hole is in view of a camera on the outer side of the triangle that borders
    /// it.
    fn faces_camera(&self, object: &ObjectFacts<'_>, hole: &TriangularHole) -> bool {
        let corners = self.data.indices[hole.beside as usize];
        let [a, b, c] = corners.map(|corner| self.corner_centroid(object, &[corner]));
        let turn = object.object_to_world.matrix3.determinant().signum();
        let normal = (b - a).cross(c - a) * turn;
        let centre = self.corner_centroid(object, &hole.corners);
        self.facts.views.iter().any(|view| {
            view.project_point(centre).is_some() && normal.dot(view.eye() - centre) > 0.0
        })
    }
}

/// Returns the reason and the remedy for open edges of glass. `seam` is the width of the seam, if
/// rounding alone has opened it.
fn open_edge_texts(seam: Option<f64>, is_seen: bool) -> (String, String) {
    if let Some(apart) = seam {
        let seen = match is_seen {
            true => "rays pass through the seams",
            false => "hardly any ray of the cameras passes through them",
        };
        // The same for meshes that differ in rounding alone.
        let apart = format_decimal(libm::pow(10.0, apart.log10().ceil()));
        return (
            format!(
                "this glass body has open seams: corners that should coincide are up to {apart} apart, in the units of the mesh; {seen}"
            ),
            format!(
                "merge vertices by distance in the modelling program: a distance of {apart} is enough"
            ),
        );
    }
    let reason = match is_seen {
        true => {
            "this glass body has holes: light that enters it does not leave it, or the reverse, and is bent and tinted wrongly"
        }
        false => "this glass body has open edges, but no ray of the cameras passes through one",
    };
    let remedy = "close the body; if it should be a pane without an inside, set `thin_walled` for its material";
    (reason.to_owned(), remedy.to_owned())
}
