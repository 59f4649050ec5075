//! What the rays of the cameras meet: a list of events, each with the number of its rays and the
//! nearest position. Sums of events do not depend on the order of the rays.

use super::*;

/// Share of the rays that leave a body without entering it from which on the camera is inside it.
const NEARLY_ALL: f64 = 0.9;

/// What a ray finds. Objects are indices in `SceneFacts::objects`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum RayEvent {
    /// The ray crosses an object, also behind other surfaces.
    Crossed(usize),
    /// The ray hits an object first, or first hits the inside of one.
    FirstHit(usize),
    FirstHitInside(usize),
    /// The ray leaves a body that it did not enter, as the camera is inside the body.
    AroundCamera(usize),
    /// The ray enters a body without leaving it, or leaves it without entering it.
    Unbalanced(usize),
    /// The ray enters a body within another body: the outer and the inner one.
    Nested([usize; 2]),
    /// The ray hits glass in place of an opaque object that it touches: the glass, and the object.
    ContactLost([usize; 2]),
    /// The ray enters a body that it is in already, through an inner surface turned outwards.
    Layered(usize),
    /// The first surface lies in the place of one of another object and material: the object that is
    /// hit, and the other one. The value is their separation in metres.
    InPlace([usize; 2]),
    /// The first surface is a back that is hidden from the camera.
    HiddenBack(usize),
    /// The first surface is a triangle of a one-sided object with the wrong orientation: flipped and
    /// hidden from the camera, flipped and visible, or of a part that is inside out and hidden.
    FlippedHidden(usize),
    FlippedShown(usize),
    InsideOutHidden(usize),
    /// The ray hits a triangle whose vertex normals point to its opposite side.
    OpposedNormals(usize),
    /// A ray that starts at a surface hits it again, hits a parallel one less than the rounding
    /// errors away, or starts behind another surface.
    SelfHit(usize),
    TwinShadow([usize; 2]),
    StartBehindSurface(usize),
    /// A value of a material is not finite: the index of the material, and the name of the value in
    /// the scene file.
    NotNumber(usize, &'static str),
    /// The base colour of a material is above 1. The value is its greatest channel.
    ColourAboveOne(usize),
}

/// The rays of an event: their number, the position of the nearest one, and the greatest value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sighting {
    pub count: u64,
    pub position: DVec3,
    pub value: f64,
    pub ray: u64,
    /// Distance from the ray's origin, in metres.
    pub distance: f64,
}

/// Results of the rays of a camera, or of several cameras.
#[derive(Clone, Debug, Default)]
pub(super) struct RaySurvey {
    pub rays: u64,
    pub planned: u64,
    /// Number of rays that hit an object.
    pub hits: u64,
    pub spawned_rays: u64,
    pub events: BTreeMap<RayEvent, Sighting>,
}

impl RaySurvey {
    /// Adds the results of other rays.
    #[must_use]
    pub fn combine(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.planned += other.planned;
        self.hits += other.hits;
        self.spawned_rays += other.spawned_rays;
        for (event, sighting) in other.events {
            self.add(event, sighting);
        }
        self
    }

    pub fn add(&mut self, event: RayEvent, other: Sighting) {
        let Some(own) = self.events.get_mut(&event) else {
            self.events.insert(event, other);
            return;
        };
        let (count, value) = (own.count + other.count, own.value.max(other.value));
        if (other.distance, other.ray) < (own.distance, own.ray) {
            *own = other;
        }
        (own.count, own.value) = (count, value);
    }

    /// Returns the number of rays of an event.
    pub fn count(&self, event: RayEvent) -> u64 {
        self.events.get(&event).map_or(0, |sighting| sighting.count)
    }

    /// Returns the events of a kind: of each its key and its rays.
    pub fn of<T>(&self, key: impl Fn(RayEvent) -> Option<T>) -> Vec<(T, Sighting)> {
        let events = self.events.iter();
        events
            .filter_map(|(&event, &sighting)| Some((key(event)?, sighting)))
            .collect()
    }

    /// Returns the objects that rays hit first.
    pub fn first_hits(&self) -> Vec<(usize, Sighting)> {
        self.of(|event| match event {
            RayEvent::FirstHit(object) => Some(object),
            _ => None,
        })
    }

    /// Decides for each body around the camera whether the camera is inside it: nearly all rays
    /// leave such a body. The rays of the other bodies are unbalanced.
    pub fn separate_bodies_around_camera(&mut self) {
        let most = NEARLY_ALL * self.rays as f64;
        for (event, sighting) in core::mem::take(&mut self.events) {
            let event = match event {
                RayEvent::AroundCamera(object) if sighting.count as f64 <= most => {
                    RayEvent::Unbalanced(object)
                }
                event => event,
            };
            self.add(event, sighting);
        }
    }
}
