//! Findings about meshes: single triangles, holes, orientation and stray vertices. The severity
//! depends on what the cameras see of a fault.

use super::storage::OUT_OF_VIEW;
use super::*;
use crate::topology::{HalfEdge, Topology, TriangularHole};

/// Share of the rays through an object above which a fault of the object shows in the picture.
const SEEN: f64 = 0.01;
/// Number of rays up to which a fault counts as unseen.
const FEW_RAYS: u64 = 2;

const HIDDEN: &str = ", so that the camera sees through them";
const SHOWN: &str = ", so that the camera sees them where their neighbours are hidden";
const BENT: &str = ", so that glass bends light the wrong way there";

/// A mesh with the objects that show it.
pub(super) struct UsedMesh<'a> {
    pub facts: &'a SceneFacts<'a>,
    pub survey: &'a RaySurvey,
    pub data: &'a MeshData,
    pub objects: Vec<&'a ObjectFacts<'a>>,
    topology: &'a Topology,
}

/// What a ray to an object meets, by the object's index, and the text that says so.
type SeenEffect = (fn(usize) -> RayEvent, &'static str);

impl SceneFacts<'_> {
    /// Returns the findings about the meshes of the scene.
    pub fn check_meshes(&self, survey: &RaySurvey) -> Vec<Fault> {
        let used = |(mesh, (data, objects))| UsedMesh {
            facts: self,
            survey,
            data,
            objects,
            topology: &self.topologies[&mesh],
        };
        let meshes: Vec<UsedMesh<'_>> = self.shown_meshes().into_iter().map(used).collect();
        let flat = meshes.iter().filter(|mesh| mesh.is_flat());
        let flat = flat.map(|mesh| mesh.objects.len()).sum::<usize>();
        let is_nothing_left = flat == self.objects.len();
        let of_mesh = |mesh: &UsedMesh<'_>| {
            [
                mesh.check_degenerate_triangles(is_nothing_left),
                mesh.check_normals(),
                mesh.check_duplicates(),
                mesh.check_open_edges(),
                mesh.check_non_manifold_edges(),
                mesh.check_flipped_triangles(),
                mesh.check_inside_out(),
                mesh.check_stray_vertices(),
                mesh.check_bubble_walls(),
                mesh.check_holes(),
                mesh.check_texture_coordinates(),
            ]
        };
        meshes.iter().flat_map(of_mesh).flatten().collect()
    }
}

impl UsedMesh<'_> {
    /// Returns the mean of some corners of an object, in world space.
    fn corner_centroid(&self, object: &ObjectFacts<'_>, corners: &[u32]) -> DVec3 {
        let positions = corners
            .iter()
            .map(|&corner| self.data.positions.position(corner as usize));
        let mean = positions.sum::<DVec3>() / corners.len() as f64;
        object.object_to_world.transform_point3(mean)
    }

    pub fn triangle_count(&self) -> u64 {
        self.data.indices.len() as u64
    }

    /// Returns whether no triangle has an area.
    fn is_flat(&self) -> bool {
        self.topology.faults.degenerate.count == self.triangle_count()
    }

    /// Marks the triangle of an object whose corners are nearest to a camera.
    pub fn mark_nearest<'b>(
        &self,
        fault: Fault,
        object: &ObjectFacts<'_>,
        items: impl Iterator<Item = (u32, &'b [u32])>,
    ) -> Fault {
        let places =
            items.map(|(triangle, corners)| (triangle, self.corner_centroid(object, corners)));
        match self.facts.nearest_to_camera(places) {
            Some((triangle, place)) => Fault {
                primitive: Some(triangle),
                ..fault.with_place(place)
            },
            None => fault,
        }
    }

    /// Counts the triangles of a fault, and marks that nearest to a camera.
    pub fn with_triangles(
        &self,
        fault: Fault,
        object: &ObjectFacts<'_>,
        (tally, predicate): (&CountAndFirst, &'static str),
    ) -> Fault {
        let fault = fault.with_count(tally.count, self.triangle_count(), "triangles", predicate);
        let corners = |&triangle: &u32| (triangle, &self.data.indices[triangle as usize][..]);
        self.mark_nearest(fault, object, tally.some.iter().map(corners))
    }

    /// Counts the edges of a fault, and marks the middle of that nearest to a camera.
    fn with_edges(
        &self,
        fault: Fault,
        object: &ObjectFacts<'_>,
        (tally, predicate): (&CountAndFirst<HalfEdge>, &'static str),
    ) -> Fault {
        let fault = fault.with_count(tally.count, self.topology.edges, "edges", predicate);
        let edges = tally
            .some
            .iter()
            .map(|edge| (edge.triangle, &edge.ends[..]));
        self.mark_nearest(fault, object, edges)
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
    /// interest, with whether the fault shows. `None` without a fault.
    fn pick_object(
        &self,
        count: u64,
        is_of_interest: impl Fn(&ObjectFacts<'_>) -> bool,
        is_seen: impl Fn(&ObjectFacts<'_>) -> bool,
    ) -> Option<(&ObjectFacts<'_>, bool)> {
        let of_interest = || self.objects.iter().filter(|object| is_of_interest(object));
        let seen = of_interest().find(|object| is_seen(object));
        let object = seen.or(of_interest().next()).filter(|_| count > 0)?;
        Some((object, seen.is_some()))
    }

    fn check_degenerate_triangles(&self, is_nothing_left: bool) -> Option<Fault> {
        let tally = &self.topology.faults.degenerate;
        let is_seen = self.is_flat() && is_nothing_left;
        let (object, _) = self.pick_object(tally.count, |_| true, |_| is_seen)?;
        let [reason, remedy] = match self.is_flat() {
            false => [
                "triangles have no area, so that no ray hits them: two corners coincide, or all three lie on a line",
                "nothing, or remove the triangles in the modelling program",
            ],
            true => [
                "none of its triangles has an area, so that it is invisible: a scale of 0 has flattened it, or the corners of each triangle coincide or lie on a line",
                "look for a scale of 0 in the object or its parent nodes, and replace it; if the object should be invisible, remove it",
            ],
        };
        let fault = DegenerateTriangles
            .fault(object.index, reason, remedy)
            .if_seen(is_seen);
        Some(self.with_triangles(fault, object, (tally, "had no area")))
    }

    fn check_normals(&self) -> Option<Fault> {
        let tally = &self.topology.faults.opposed_normals;
        let is_seen = |object: &ObjectFacts<'_>| self.is_seen_on(RayEvent::OpposedNormals, object);
        let (object, is_seen) = self.pick_object(tally.count, |_| true, is_seen)?;
        let fault = NormalsAgainstFaces.fault(
            object.index,
            "all three vertex normals of these triangles point to the back, so that the triangles are shaded as if turned away",
            "recompute the normals, or flip the triangles, in the modelling program",
        );
        Some(self.with_triangles(fault.if_seen(is_seen), object, (tally, "had such normals")))
    }

    fn check_duplicates(&self) -> Option<Fault> {
        let [same, turned] = &self.topology.duplicates;
        let tally = if same.count > 0 { same } else { turned };
        let is_blended = |object: &ObjectFacts<'_>| object.is_blended() && same.count > 0;
        let (object, is_blended) = self.pick_object(tally.count, |_| true, is_blended)?;
        let reason = match is_blended {
            true => "triangles are repeated in one place, and both dim the light that passes",
            false => "triangles are repeated in one place; of each two, only one is seen",
        };
        let remedy = "remove the repeated triangles in the modelling program";
        let fault = DuplicateTriangles
            .fault(object.index, reason, remedy)
            .if_seen(is_blended);
        Some(self.with_triangles(fault, object, (tally, "repeated another")))
    }

    /// Returns the glass body whose irregular edges rays pass, or else the first one.
    fn pick_body(&self, count: u64) -> Option<(&ObjectFacts<'_>, bool)> {
        // Through a seam pass a few rays without effect. Through a hole, a few rays are its pixels.
        let has_holes = self.topology.open_edges.count > 0 && self.topology.seam.is_none();
        let is_seen = |object: &ObjectFacts<'_>| {
            let unbalanced = self.survey.count(RayEvent::Unbalanced(object.index));
            self.is_seen_on(RayEvent::Unbalanced, object) || has_holes && unbalanced > FEW_RAYS
        };
        self.pick_object(count, |o| o.is_body(), is_seen)
    }

    /// Finds open edges of glass bodies, which have to be closed.
    fn check_open_edges(&self) -> Option<Fault> {
        let tally = &self.topology.open_edges;
        let (object, is_seen) = self.pick_body(tally.count)?;
        // The same for meshes that differ in rounding alone.
        let seam = self.topology.seam;
        let seam = seam.map(|apart| format_decimal(libm::pow(10.0, apart.log10().ceil())));
        let reason = match (&seam, is_seen) {
            (None, true) => "this glass body has holes: light that enters it does not leave it, or the reverse, and is bent and tinted wrongly".to_owned(),
            (None, false) => "this glass body has open edges, but no ray of the cameras passes through one".to_owned(),
            (Some(apart), _) => format!(
                "this glass body has open seams: corners that should coincide are up to {apart} apart, in the units of the mesh; {}",
                if is_seen { "rays pass through the seams" } else { "hardly any ray of the cameras passes through them" }
            ),
        };
        let remedy = match seam {
            None => "close the body; if it should be a pane without an inside, set `thin_walled` for its material".to_owned(),
            Some(apart) => format!("merge vertices by distance in the modelling program: a distance of {apart} is enough"),
        };
        let fault = OpenEdges
            .fault(object.index, reason, remedy)
            .if_seen(is_seen);
        Some(self.with_edges(fault, object, (tally, "had one triangle only")))
    }

    fn check_non_manifold_edges(&self) -> Option<Fault> {
        let tally = &self.topology.non_manifold_edges;
        let (object, is_seen) = self.pick_body(tally.count)?;
        let fault = NonManifoldEdges.fault(
            object.index,
            "more than two triangles meet at edges of this glass body, so that its inside and outside are undefined there",
            "split the body at these edges, or remove the walls inside the body",
        );
        Some(self.with_edges(
            fault.if_seen(is_seen),
            object,
            (tally, "had more than two triangles"),
        ))
    }

    fn check_flipped_triangles(&self) -> Option<Fault> {
        let effect = |object: &ObjectFacts<'_>| match object.is_body() {
            true => self.first_seen(object, &[(RayEvent::Unbalanced, BENT)]),
            false => self.first_seen(
                object,
                &[
                    (RayEvent::FlippedHidden, HIDDEN),
                    (RayEvent::FlippedShown, SHOWN),
                ],
            ),
        };
        let label = (&self.topology.flipped, "faced the other way than most");
        let what = "triangles are oriented differently from their neighbours";
        self.orientation_finding(FlippedTriangles, what, effect, label)
    }

    /// Finds closed parts that are oriented inwards.
    fn check_inside_out(&self) -> Option<Fault> {
        // Rays leave a body that is inside out before they enter it, but do so in pairs.
        let effect = |object: &ObjectFacts<'_>| match object.is_body() {
            true => self.first_seen(object, &[(RayEvent::Crossed, BENT)]),
            false => self.first_seen(object, &[(RayEvent::InsideOutHidden, HIDDEN)]),
        };
        let label = (&self.topology.inverted_parts(), "belong to these surfaces");
        self.orientation_finding(
            InsideOut,
            "closed surfaces are oriented inwards",
            effect,
            label,
        )
    }

    /// Returns the text of the first event that rays to an object see.
    fn first_seen(&self, object: &ObjectFacts<'_>, effects: &[SeenEffect]) -> Option<&'static str> {
        let mut effects = effects.iter();
        let (_, text) = effects.find(|(event, _)| self.is_seen_on(*event, object))?;
        Some(text)
    }

    fn orientation_finding(
        &self,
        kind: FaultKind,
        what: &str,
        effect: impl Fn(&ObjectFacts<'_>) -> Option<&'static str>,
        label: (&CountAndFirst, &'static str),
    ) -> Option<Fault> {
        let is_seen = |object: &ObjectFacts<'_>| effect(object).is_some();
        let (object, is_seen) = self.pick_object(label.0.count, |_| true, is_seen)?;
        let two_sided = |object: &&ObjectFacts<'_>| !object.is_body() && !object.hides_back_faces();
        let end = effect(object).unwrap_or(match self.objects.iter().all(two_sided) {
            true => "; both sides look alike, so that the fault is not visible",
            false => "; no camera sees an effect of it",
        });
        let remedy = "flip them in the modelling program (\"recalculate outside\")";
        let fault = kind
            .fault(object.index, format!("{what}{end}"), remedy)
            .if_seen(is_seen);
        Some(self.with_triangles(fault, object, label))
    }

    /// Returns a finding that names the first stray vertex. The picture is wrong if a camera has
    /// the other ends of its triangles in view.
    fn check_stray_vertices(&self) -> Option<Fault> {
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
        let [x, y, z] = position(vertex).to_array().map(format_decimal);
        let (named, what) = match strays.vertices.len() {
            1 => (format!("vertex {vertex} is"), "it"),
            more => (format!("vertex {vertex} and {} more are", more - 1), "them"),
        };
        let reason = format!(
            "{named} far out, at ({x}, {y}, {z}) metres, while nearly all others are within {} of the middle of the mesh: the triangles that reach to {what} are spikes, or too thin for any ray to hit",
            format_metres(strays.reach * scale)
        );
        let remedy = format!(
            "in the modelling program, move {what} to the rest of the mesh, or remove {what}: probably a coordinate has lost its decimal point, or was not set"
        );
        let (count, total) = (strays.triangles.len() as u64, self.triangle_count());
        let fault = StrayVertices
            .fault(object.index, reason, remedy)
            .if_seen_or(is_seen, OUT_OF_VIEW)
            .with_count(count, total, "triangles", "reach to such a vertex");
        Some(Fault {
            primitive: Some(triangle),
            ..fault.with_place(place)
        })
    }

    /// Returns a finding about bubbles in glass whose walls are oriented the wrong way.
    fn check_bubble_walls(&self) -> Option<Fault> {
        let tally = self.topology.outward_inner_parts();
        let is_layered = |object: &ObjectFacts<'_>| self.is_seen_on(RayEvent::Layered, object);
        let body = self.pick_object(tally.count, |o| o.is_body(), is_layered);
        let (object, _) = body.filter(|(_, is_layered)| *is_layered)?;
        let fault = InsideOut.fault(
            object.index,
            "closed surfaces inside this glass are oriented outwards like the surface around them: they are not bubbles but a second layer of glass",
            "in the modelling program, flip the inner surfaces if they are walls of bubbles, otherwise remove them",
        );
        Some(self.with_triangles(fault, object, (&tally, "belong to these surfaces")))
    }

    /// Returns a finding about triangular holes in an opaque, otherwise closed surface. The picture
    /// is wrong if a camera sees through a hole.
    fn check_holes(&self) -> Option<Fault> {
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
        let (object, is_seen) =
            self.pick_object(holes.count, |o| o.is_opaque(), is_seen_through)?;
        let end = match is_seen {
            true => "and a camera sees through the hole",
            false => "but no camera sees through the hole",
        };
        let places = holes.some.iter();
        let places = places.map(|hole| ((), self.corner_centroid(object, &hole.corners)));
        let place = self.facts.nearest_to_camera(places).map(|(_, place)| place);
        let reason = format!(
            "a triangle is missing in an otherwise closed surface, {end}: light enters through the hole, and the inside or the background can show"
        );
        let fault = OpenEdges.fault(
            object.index,
            reason,
            "fill the hole in the modelling program",
        );
        let fault = fault.with_count(holes.count, 0, "holes", "with three edges");
        Some(fault.if_seen(is_seen).with_place(place))
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
