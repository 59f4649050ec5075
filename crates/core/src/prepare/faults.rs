//! Faults that preparation and a render find, in words: what rounding loses, and what samples lack.
//! `render` tells them, and `stress` judges them by what the cameras see.

use raywright_bvh::Real;

use super::{LampRef, LightLeak, PreparedScene, UnresolvedGap};
use crate::counters::{Counters, MOST_PASSAGES};
use crate::fault::{Fault, FaultKind, Subject, format_decimal, format_metres, round_to_two_digits};
use crate::light::{LightId, LightUsage};
use crate::scene::Scene;
use crate::settings::PrecisionChoice;

impl PrecisionChoice {
    /// Returns the end of a remedy that double precision replaces; empty if it is chosen already.
    pub(crate) fn or_reference(self) -> &'static str {
        match self {
            Self::Robust => ", or render with --precision reference",
            Self::Reference => "",
        }
    }
}

impl LampRef {
    /// Returns the lamp as the subject of a fault.
    pub fn subject(self, scene: &Scene) -> Subject {
        match self {
            Self::Light(index) => Subject::Light(index),
            Self::Object(index) => Subject::from_object_index(scene, index),
        }
    }
}

impl UnresolvedGap {
    /// Returns the gap as a fault.
    pub(crate) fn fault(&self, scene: &Scene, precision: PrecisionChoice) -> Fault {
        let [own, other] =
            [self.object, self.other].map(|index| Subject::from_object_index(scene, index));
        let named = other.display_name(scene);
        let least = format_metres(round_to_two_digits(self.resolved_width));
        let [message, remedy] = match self.is_coincident {
            true => [
                format!(
                    "it lies in one place with {named}: light that passes the first, which is partly transparent, passes the second unseen"
                ),
                format!("remove the second, or leave {least} or more between them"),
            ],
            false => [
                format!(
                    "it touches {named}, or is less than {least} away from it, too close for the precision: light that leaves one of the two misses the surface of the other"
                ),
                format!(
                    "if the two should touch, let the glass reach into the other body, if only by a millimetre, and set a `priority` for the material of each body of glass; if there should be air between them, leave {least} or more{}",
                    precision.or_reference()
                ),
            ],
        };
        let fault = FaultKind::ClosedGap.fault(own, message, remedy);
        fault.with_place(self.place)
    }
}

impl LightLeak {
    /// Returns the leak as a fault.
    pub(crate) fn fault(&self, scene: &Scene, precision: PrecisionChoice) -> Fault {
        let message = format!(
            "it is so close to {}, which is opaque, that the precision does not tell which of the two is in front: its light passes through that object, or the lamp itself is not seen",
            Subject::from_object_index(scene, self.cover).display_name(scene)
        );
        let remedy = format!(
            "move it {} or more away from that object, to the side to which it should shine{}",
            format_metres(round_to_two_digits(self.resolved_distance)),
            precision.or_reference()
        );
        FaultKind::LightThroughCover.fault(self.lamp.subject(scene), message, remedy)
    }
}

impl LightRays {
    /// Returns the fault of a light that no ray finds.
    pub fn fault(&self, scene: &Scene) -> Fault {
        unreached_light(self.lamp.subject(scene), self.blocked)
    }
}

/// Returns the fault of a light of which all shadow rays were blocked.
pub(crate) fn unreached_light(light: Subject, rays: u64) -> Fault {
    let fault = FaultKind::UnreachedLight.fault(
        light,
        "this light reaches no visible surface: it is blocked, or turned away from all visible surfaces",
        "open or remove the object that blocks the light, or remove the light, which only adds noise",
    );
    fault.with_rays(rays, rays, "towards it were blocked")
}

/// Returns the fault of an object of which storage leaves nothing.
pub(crate) fn lost_object(subject: Subject, precision: PrecisionChoice) -> Fault {
    FaultKind::LostObject.fault(
        subject,
        "it is so far from the rest of the scene that rounding merges all corners of its triangles, so that nothing is left of it",
        format!("move the object nearer to the rest of the scene{}", precision.or_reference()),
    )
}

/// Returns the fault of an object whose shape storage does not resolve.
pub(crate) fn unresolved_object(subject: Subject, precision: PrecisionChoice) -> Fault {
    FaultKind::UnresolvedObject.fault(
        subject,
        "it is so far from the rest of the scene that the precision does not resolve a thousandth of its size",
        format!("move the object nearer to the rest of the scene{}", precision.or_reference()),
    )
}

impl Counters {
    /// Returns the losses of samples and rays that occurred in the render.
    pub fn faults(&self) -> impl Iterator<Item = Fault> + use<> {
        let not_finite = FaultKind::SamplesNotFinite.fault(
            Subject::Scene,
            "samples are not finite numbers and are dropped, so that their pixels are wrong",
            "look for numbers in materials, lights and sky that are too large or undefined, or render with --precision reference",
        );
        let cut_short = FaultKind::RaysCutShort.fault(
            Subject::Scene,
            format!("rays end after {MOST_PASSAGES} surfaces that are cut out or partly transparent, so that objects behind these surfaces are missing, or after a million scatterings in a medium"),
            "place fewer such surfaces behind each other, and make such media thinner",
        );
        let excess = &self.excess;
        let point = excess.point().map(format_decimal).join(", ");
        let (ratio, owner) = (excess.ratio(), excess.owner());
        let (density, remedy) = match () {
            () if ratio.is_nan() => ("not a number".to_owned(), "change the formula"),
            () if ratio.is_infinite() => ("infinite".to_owned(), "change the formula"),
            () if ratio < 0.0 => (
                "below zero".to_owned(),
                "write `max(0, ...)` around the formula",
            ),
            () => (
                format!("{} times its `max_density`", format_decimal(ratio)),
                "raise `max_density`",
            ),
        };
        let density_out_of_range = FaultKind::DensityOutOfRange.fault(
            Subject::Scene,
            format!("the density of `{owner}` is {density} at [{point}], so that the medium is wrong there"),
            remedy,
        );
        let all = self.samples + self.dropped;
        let faults = [
            not_finite.with_count(self.dropped, all, "samples", "had to be dropped"),
            cut_short.with_rays(self.cut_short, 0, "ended there"),
            density_out_of_range.with_count(excess.count, 0, "points", "have such densities"),
        ];
        faults.into_iter().filter(|fault| fault.count > 0)
    }
}

// Detection of lights that contributed nothing to a picture.

/// Least number of blocked shadow rays for which a light counts as unreached. If one ray in twenty
/// reached the light, all of a hundred rays would be blocked with a probability below 1 %.
const MIN_BLOCKED_RAYS: u64 = 100;

/// Shadow rays to a light or an emissive object in a picture, with the paths that hit it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightRays {
    /// The light or the object.
    pub lamp: LampRef,
    /// Number of rays that were blocked.
    pub blocked: u64,
    /// Number of rays by which light arrived.
    pub arrived: u64,
}

impl LightRays {
    /// Returns whether the light contributed nothing, although at least a hundred shadow rays were
    /// traced to it.
    pub fn is_unreached(&self) -> bool {
        self.arrived == 0 && self.blocked >= MIN_BLOCKED_RAYS
    }
}

impl<R: Real> PreparedScene<R> {
    /// Returns the numbers of rays to all delta lights and emissive objects. The rays to a mesh are
    /// those to all its triangles.
    pub(crate) fn light_rays(&self, usage: &LightUsage) -> Vec<LightRays> {
        let rays = |lamp, [blocked, arrived]: [u64; 2]| LightRays {
            lamp,
            blocked,
            arrived,
        };
        let lights = (0..self.lights.delta.len()).map(|index| {
            let counts = usage.ray_counts(LightId::Delta(index as u32));
            rays(LampRef::Light(index), counts)
        });
        let objects = self.lights.emitters.emitters_by_object();
        let objects = objects.map(|(object, emitters)| {
            let counts = emitters.map(|emitter| usage.ray_counts(LightId::Emitter(emitter)));
            let sum = counts.fold([0; 2], |[a, b], [c, d]| [a + c, b + d]);
            rays(LampRef::Object(object), sum)
        });
        lights.chain(objects).collect()
    }
}
