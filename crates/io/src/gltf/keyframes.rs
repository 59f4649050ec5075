//! Animation keys of translations, rotations, scales and weights, and their interpolation (glTF
//! 2.0, section 3.11 and appendix C).

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::rc::Rc;

use glam::{DQuat, DVec4};

use super::accessor::{Accessor, AccessorReader};
use super::entries::{AnimationSampler, Interpolation};
use crate::import::{FaultPlace, ImportResult, format_count};

/// Reads keyframes and interpolates between them. Opened accessors are kept, because opening a
/// sparse accessor takes time and memory.
pub(super) struct KeyframeReader<'a> {
    reader: &'a AccessorReader<'a>,
    open: HashMap<u32, Rc<Accessor<'a>>>,
}

/// Whether the values of a sampler include an in-tangent and an out-tangent for each keyframe.
fn is_cubic_spline(sampler: &AnimationSampler) -> bool {
    sampler.interpolation == Interpolation::CubicSpline
}

/// Position of a time among the keyframes of a sampler.
enum KeyframePosition {
    /// At the keyframe with this index; also for a time before the first keyframe, after the last
    /// keyframe, or with stepped interpolation.
    AtKey(usize),
    /// Between the keyframe with this index and the next: the fraction from 0 to 1, and the seconds
    /// between the two keyframes.
    BetweenKeys(usize, f64, f64),
}

impl KeyframePosition {
    /// Interpolates vectors component by component; `value` returns the vector of an element of the
    /// accessor.
    fn interpolate<const N: usize>(
        &self,
        is_cubic_spline: bool,
        value: impl Fn(usize) -> [f64; N],
    ) -> [f64; N] {
        match *self {
            Self::AtKey(key) if is_cubic_spline => value(3 * key + 1),
            Self::AtKey(key) => value(key),
            Self::BetweenKeys(key, share, duration) if is_cubic_spline => {
                hermite([1, 2, 3, 4].map(|i| value(3 * key + i)), share, duration)
            }
            Self::BetweenKeys(key, share, _) => {
                let (a, b) = (value(key), value(key + 1));
                core::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
            }
        }
    }
}

impl<'a> KeyframeReader<'a> {
    pub fn new(reader: &'a AccessorReader<'a>) -> Self {
        Self {
            reader,
            open: HashMap::new(),
        }
    }

    fn open_accessor(&mut self, index: u32) -> ImportResult<Rc<Accessor<'a>>> {
        Ok(Rc::clone(match self.open.entry(index) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => place.insert(Rc::new(self.reader.open(index as usize)?)),
        }))
    }

    /// Returns the time of a sampler's last keyframe in seconds; `None` if the time is not finite
    /// or does not exist.
    pub fn last_key_time(&mut self, sampler: &AnimationSampler) -> Option<f64> {
        let times = self.open_accessor(sampler.input).ok()?;
        times
            .count()
            .checked_sub(1)
            .map(|last| f64::from(times.read_vector::<1>(last)[0]))
            .filter(|seconds| seconds.is_finite())
    }

    /// Locates a time in seconds among a sampler's keyframes. Returns the accessor of the sampler's
    /// values, and the position of the time. `arity` is the expected number of components of each
    /// value.
    fn locate_time(
        &mut self,
        sampler: &AnimationSampler,
        time: f64,
        arity: usize,
    ) -> ImportResult<(Rc<Accessor<'a>>, KeyframePosition)> {
        let times = self.open_accessor(sampler.input).with_place("input")?;
        let values = self.open_accessor(sampler.output).with_place("output")?;
        let count = times.count();
        if count == 0 {
            return Err(fault!("has no keyframe times, but needs at least one"));
        }
        let requested = count.saturating_mul(if is_cubic_spline(sampler) { 3 } else { 1 });
        // A keyframe has as many weights as the mesh has targets.
        let fits = if arity == 1 {
            values.count() % requested == 0
        } else {
            values.count() == requested
        };
        if times.element_arity() != 1 || values.element_arity() != arity || !fits {
            return Err(fault!(
                "has values that do not match its keyframe times: {} and {} of {}, in place of {} of {}",
                format_count(count, "keyframe time"),
                format_count(values.count(), "value"),
                format_count(values.element_arity(), "number"),
                format_count(requested, "value"),
                format_count(arity, "number"),
            ));
        }
        let seconds = |key: usize| f64::from(times.read_vector::<1>(key)[0]);
        // The specification requires ascending times. For other times the binary search still ends,
        // at an arbitrary keyframe.
        let (mut after, mut end) = (0, count);
        while after < end {
            let middle = after + (end - after) / 2;
            if seconds(middle) <= time {
                after = middle + 1
            } else {
                end = middle
            }
        }
        let between = match after {
            0 => KeyframePosition::AtKey(0),
            n if n == count || sampler.interpolation == Interpolation::Step => {
                KeyframePosition::AtKey(n - 1)
            }
            n => {
                let duration = seconds(n) - seconds(n - 1);
                KeyframePosition::BetweenKeys(n - 1, (time - seconds(n - 1)) / duration, duration)
            }
        };
        Ok((values, between))
    }

    /// Interpolates a vector with `arity` components, at most `N`, at a time in seconds, component
    /// by component. Further components are 0.
    pub fn interpolate_vector<const N: usize>(
        &mut self,
        sampler: &AnimationSampler,
        time: f64,
        arity: usize,
    ) -> ImportResult<[f64; N]> {
        let (values, between) = self.locate_time(sampler, time, arity)?;
        Ok(between.interpolate(is_cubic_spline(sampler), |element| {
            values.read_vector::<N>(element).map(f64::from)
        }))
    }

    /// Interpolates the weights of all morph targets at a time in seconds.
    pub fn interpolate_weights(
        &mut self,
        sampler: &AnimationSampler,
        time: f64,
    ) -> ImportResult<Vec<f64>> {
        let parts = if is_cubic_spline(sampler) { 3 } else { 1 };
        let (values, between) = self.locate_time(sampler, time, 1)?;
        let targets = values.count() / (parts * self.open_accessor(sampler.input)?.count());
        let weight = |target: usize| {
            let [weight] = between.interpolate(is_cubic_spline(sampler), |element| {
                values
                    .read_vector(element * targets + target)
                    .map(f64::from)
            });
            weight
        };
        Ok((0..targets).map(weight).collect())
    }

    /// Interpolates a rotation, a unit quaternion, at a time in seconds, along the shorter arc at
    /// constant speed.
    pub fn interpolate_rotation(
        &mut self,
        sampler: &AnimationSampler,
        time: f64,
    ) -> ImportResult<[f64; 4]> {
        if is_cubic_spline(sampler) {
            // Appendix C.5: the normalised spline of the four components.
            let turn = DVec4::from_array(self.interpolate_vector::<4>(sampler, time, 4)?);
            return Ok(turn.try_normalize().unwrap_or(DVec4::W).to_array());
        }
        let (values, between) = self.locate_time(sampler, time, 4)?;
        let value =
            |element: usize| DQuat::from_array(values.read_vector::<4>(element).map(f64::from));
        Ok(match between {
            KeyframePosition::AtKey(key) => value(key),
            KeyframePosition::BetweenKeys(key, share, _) => {
                slerp(value(key), value(key + 1), share)
            }
        }
        .to_array())
    }
}

/// Cubic Hermite interpolation at the fraction `u`, in the file's order: first value, out-tangent
/// of the first value, in-tangent of the second value, second value. `duration` is the time between
/// the keyframes in seconds.
fn hermite<const N: usize>(
    [a, leaving, arriving, b]: [[f64; N]; 4],
    u: f64,
    duration: f64,
) -> [f64; N] {
    let (u2, u3) = (u * u, u * u * u);
    let weights = [
        2.0 * u3 - 3.0 * u2 + 1.0,
        duration * (u3 - 2.0 * u2 + u),
        duration * (u3 - u2),
        3.0 * u2 - 2.0 * u3,
    ];
    core::array::from_fn(|i| {
        a[i] * weights[0] + leaving[i] * weights[1] + arriving[i] * weights[2] + b[i] * weights[3]
    })
}

/// Spherical linear interpolation along the shorter arc (Shoemake, "Animating Rotation with
/// Quaternion Curves", 1985). The result is the same on every platform.
fn slerp(a: DQuat, b: DQuat, share: f64) -> DQuat {
    let cosine = a.dot(b);
    let b = if cosine < 0.0 { -b } else { b };
    let angle = libm::acos(cosine.abs().min(1.0));
    // For nearly equal rotations the error of linear interpolation is below rounding.
    if angle < 1e-6 {
        return a + (b - a) * share;
    }
    a * (libm::sin((1.0 - share) * angle) / libm::sin(angle))
        + b * (libm::sin(share * angle) / libm::sin(angle))
}
