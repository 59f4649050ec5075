//! Surfaces that light others: emissive objects whose points can be drawn.

use raywright_bvh::shapes::{AnyShape, Placed};
use raywright_bvh::{Precision, Real, Side, Surface, Vec3Of, Vector};

/// All emitters of a scene, drawn in proportion to their power.
#[derive(Clone, Debug)]
pub(crate) struct AreaLights<P: Precision> {
    emitters: Vec<Emitter<P>>,
    /// Running sum of the probabilities; the last entry is exactly 1.
    cumulative: Vec<f64>,
}

/// One emissive shape or triangle.
#[derive(Clone, Debug)]
pub(crate) struct Emitter<P: Precision> {
    pub form: Form<P>,
    pub radiance: Vec3Of<P>,
    /// Which sides give off light: those that can be seen.
    pub side: Side,
    /// Area of the surface in the world.
    pub area: f64,
}

/// Geometry of an emitter in the world.
#[derive(Clone, Debug)]
pub(crate) enum Form<P: Precision> {
    Plain(AnyShape<P::Real>),
    Placed(Box<Placed<P>>),
}

/// A drawn point of an emitter, as another point sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn<R: Real> {
    pub surface: Surface<R>,
    /// Unit direction to it.
    pub direction: R::Vec3,
    /// Irradiance on a surface that faces it, if nothing is in between, over the probability of having drawn it.
    pub irradiance: R::Vec3,
}

impl<P: Precision> Form<P> {
    /// Area of the surface; zero where it has none that points could be drawn from.
    pub fn area(&self) -> f64 {
        let area = match self {
            Form::Plain(shape) => shape.area(),
            Form::Placed(placed) => placed.area(),
        };
        area.filter(|a| a.is_finite()).unwrap_or(0.0)
    }
}

impl<P: Precision> Emitter<P> {
    /// Sum of what it gives off in all directions, up to a factor that all emitters share.
    fn power(&self) -> f64 {
        let radiance = self.radiance.to_f64();
        (radiance.x + radiance.y + radiance.z) * self.area * if self.side == Side::Both { 2.0 } else { 1.0 }
    }
}

impl<P: Precision> AreaLights<P> {
    /// None when nothing of it gives off light.
    pub fn new(mut emitters: Vec<Emitter<P>>) -> Option<Self> {
        emitters.retain(|e| e.power() > 0.0);
        let total: f64 = emitters.iter().map(Emitter::power).sum();
        let mut sum = 0.0;
        let running = |e: &Emitter<P>| {
            sum += e.power() / total;
            sum
        };
        let mut cumulative: Vec<f64> = emitters.iter().map(running).collect();
        *cumulative.last_mut()? = 1.0;
        Some(Self { emitters, cumulative })
    }

    /// How many shapes and triangles.
    pub fn len(&self) -> usize {
        self.emitters.len()
    }

    /// The emitter for a pair of numbers in [0, 1), and the probability of drawing it. Both numbers, because one of f32 has
    /// steps of 2⁻²³: of a million emitters the faint ones would be drawn always or never.
    fn choose(&self, [coarse, fine]: [f32; 2]) -> (&Emitter<P>, f64) {
        const STEP: f64 = 1.0 / (1 << 23) as f64;
        let pick = (f64::from(coarse) + f64::from(fine) * STEP).min(1.0_f64.next_down());
        let index = self.cumulative.partition_point(|&c| c <= pick);
        let before = if index == 0 { 0.0 } else { self.cumulative[index - 1] };
        (&self.emitters[index], self.cumulative[index] - before)
    }

    /// Draws a point for two pairs of numbers in [0, 1) and shows it to `from`; none where it sends nothing there.
    pub fn draw(&self, from: Vec3Of<P>, pick: [f32; 2], position: [f32; 2]) -> Option<Drawn<P::Real>> {
        let (emitter, probability) = self.choose(pick);
        let [u, v] = position.map(P::Real::from_f32);
        let (located, density) = match &emitter.form {
            Form::Plain(shape) => shape.sample_area::<P>(u, v)?,
            Form::Placed(placed) => placed.sample_area(u, v)?,
        };
        let surface = located.stored::<P>();
        let offset = surface.point.to_f64() - from.to_f64();
        let squared = offset.length_squared();
        let direction = offset / squared.sqrt();
        let outwards = -direction.dot(surface.normal.to_f64());
        let cosine = match emitter.side {
            Side::Outside => outwards,
            Side::Inside => -outwards,
            Side::Both => outwards.abs(),
        };
        // Solid-angle measure: cos/d² over the density by area. Also false for NaN, where the points coincide.
        let weight = cosine / (squared * density.to_f64() * probability);
        (weight > 0.0 && weight.is_finite()).then(|| Drawn {
            surface,
            direction: Vector::from_f64(direction),
            irradiance: emitter.radiance * P::Real::from_f64(weight),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use raywright_bvh::Robust;
    use raywright_bvh::shapes::Sphere;

    /// Balls of area one whose power is as given.
    fn lights(powers: &[f64]) -> Option<AreaLights<Robust>> {
        let ball = Sphere { centre: Vec3::ZERO, radius: 1.0 };
        let emitter = |power: &f64| Emitter {
            form: Form::Plain(ball.into()),
            radiance: Vec3::new(*power as f32, 0.0, 0.0),
            side: Side::Outside,
            area: 1.0,
        };
        AreaLights::new(powers.iter().map(emitter).collect())
    }

    /// How often each of so many evenly spread picks from the first `share` of [0, 1) draws the emitter of a power.
    fn drawn(lights: &AreaLights<Robust>, power: f32, share: f64, picks: u32) -> u32 {
        let pick = |i: u32| {
            let cells = share * f64::from(i) / f64::from(picks) * f64::from(1 << 23);
            [(cells.floor() / f64::from(1 << 23)) as f32, cells.fract() as f32]
        };
        (0..picks).filter(|&i| lights.choose(pick(i)).0.radiance.x == power).count() as u32
    }

    /// Protects (M10): what has no power is never drawn, what has next to none does not upset the others, and where nothing
    /// has power there is no emitter rather than a NaN.
    #[test]
    fn powers_of_any_size_are_drawn_in_their_share() {
        assert!(lights(&[]).is_none() && lights(&[0.0, 0.0]).is_none());
        let all = [0.0, 1e-30, 1.0, 1e30];
        for turn in 0..4 {
            let mut powers = all;
            powers.rotate_left(turn);
            let lights = lights(&powers).expect("three give off light");
            assert_eq!(lights.len(), 3);
            assert_eq!(drawn(&lights, 0.0, 1.0, 10_000), 0);
            assert!(drawn(&lights, 1e30, 1.0, 10_000) >= 9_999);
            let pick = [[0.0; 2], [0.5; 2], [1.0_f32.next_down(); 2]].map(|pick| lights.choose(pick).1);
            assert!(pick.iter().all(|p| *p > 0.0 && *p <= 1.0), "{pick:?}");
        }
    }

    /// Protects: an emitter is drawn as often as its probability says, also where that is less than a step of an f32.
    #[test]
    fn faint_emitters_are_drawn_as_often_as_they_should() {
        let lights = lights(&[f64::from(2.0_f32.powi(-30)), 1.0]).expect("both give off light");
        let (_, probability) = lights.choose([0.0; 2]);
        let share = 2.0_f64.powi(-30) / (1.0 + 2.0_f64.powi(-30));
        assert!((probability / share - 1.0).abs() < 1e-9, "{probability} instead of {share}");
        // One of 128 picks within the first step.
        let found = drawn(&lights, 2.0_f32.powi(-30), 1.0 / f64::from(1 << 23), 12_800);
        assert!((99..=101).contains(&found), "{found} instead of 100");
    }
}
