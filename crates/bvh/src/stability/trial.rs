//! Trial of a hard case: the loops over its rays, the kernels of its trees, and the textbook's
//! formulas, which every case shares.

use glam::DVec3;

use super::textbook;
use super::verdicts::*;
use crate::shapes::AnyShape;
use crate::{
    AcceleratorKind, BuildQuality, Geometry, Hit, Interval, Kernel, PreparedRay, PrimitiveSet, Ray,
    Real, Shape, Vector, Visibility,
};

/// Outcome of a case for one setting: a precision and, for trees, a kernel (instruction set).
#[derive(Clone, Debug)]
pub struct Measurement {
    /// Name of the setting: the precision and, if several kernels can traverse the tree, the
    /// kernel, as in `robust, avx2`.
    pub setting: String,
    /// Outcomes of the parts of the case for the library.
    pub parts: Vec<CaseOutcome>,
    /// Outcomes of the parts for textbook formulas in f32 on the same rays; empty if the case has
    /// no textbook formulas.
    pub textbook: Vec<CaseOutcome>,
}

impl Measurement {
    fn new(setting: String) -> Self {
        Self {
            setting,
            parts: vec![],
            textbook: vec![],
        }
    }

    /// Returns the outcome of all parts together.
    pub fn outcome(&self) -> CaseOutcome {
        merge_parts(&self.parts).unwrap_or_default()
    }

    /// Returns the fraction of judged rays that textbook formulas get wrong, in all parts together.
    pub fn textbook_wrong(&self) -> Option<f64> {
        merge_parts(&self.textbook).map(|outcome| outcome.wrong_fraction())
    }
}

fn merge_parts(parts: &[CaseOutcome]) -> Option<CaseOutcome> {
    parts.iter().cloned().reduce(CaseOutcome::merge)
}

/// Builds a geometry of shapes.
///
/// # Panics
/// For a shape that is not finite.
pub fn build_geometry<R: Real>(
    shapes: impl IntoIterator<Item = AnyShape<R>>,
    kind: AcceleratorKind,
) -> Geometry<R> {
    let mut set = PrimitiveSet::default();
    for shape in shapes {
        set.add_shape(shape, Visibility::default())
            .expect("finite shapes");
    }
    Geometry::new(set, kind)
}

/// A ray through a scene of a trial, and the hit that it must find.
#[derive(Clone, Copy, Debug)]
pub struct TestRay<R: Real> {
    /// Index of the scene.
    pub scene: usize,
    /// The ray.
    pub ray: Ray<R>,
    /// Range of distances.
    pub range: Interval<R>,
    /// Closest hit that the ray must find.
    pub expected: Option<Hit<R>>,
    /// Whether any hit will do.
    pub is_any: bool,
}

impl<R: Real> TestRay<R> {
    /// Creates a ray that must hit something.
    pub fn with_any_hit(scene: usize, ray: Ray<R>) -> Self {
        Self {
            scene,
            ray,
            range: Interval::positive(),
            expected: None,
            is_any: true,
        }
    }

    /// Creates a ray that must find the hit of the linear scan.
    pub fn with_hit_of_scan(
        scans: &[Geometry<R>],
        scene: usize,
        ray: Ray<R>,
        range: Interval<R>,
    ) -> Self {
        Self {
            scene,
            ray,
            range,
            expected: scans[scene].closest(&ray, range, &mut ()),
            is_any: false,
        }
    }

    /// Judges both queries of a geometry: the closest hit, and whether there is any.
    fn judge_geometry(&self, geometry: &Geometry<R>) -> Verdict {
        let Self { ray, range, .. } = self;
        let hit = geometry.closest(ray, *range, &mut ());
        let is_any = geometry.occluded(ray, *range, &mut |_| true, &mut ());
        let is_right = if self.is_any {
            is_any
        } else {
            hit == self.expected && hit.is_none_or(|hit| range.contains(hit.t))
        };
        Verdict::from_condition(is_right && is_any == hit.is_some(), || {
            let bits = format_ray_bits(ray);
            format!(
                "the closest hit is {hit:?}, the any-hit query returns {is_any}, for {self:?}{bits}"
            )
        })
    }
}

/// Hit of a shape as a formula finds it, in f64.
#[derive(Clone, Copy, Debug)]
pub struct FormulaHit {
    /// Distance along the ray, in units of the direction's length.
    pub t: f64,
    /// Surface point.
    pub point: DVec3,
    /// Normal of the surface; without meaning for a textbook formula.
    pub normal: DVec3,
    /// Error bound that the formula states; infinite for a textbook formula.
    pub error: f64,
}

impl FormulaHit {
    /// Whether the hit is that of a textbook formula.
    pub fn is_textbook(&self) -> bool {
        self.error == f64::INFINITY
    }

    fn by_library<R: Real>(shape: &AnyShape<R>, ray: &Ray<R>) -> Option<Self> {
        let hit = nearest_hit(shape, ray)?;
        let surface = shape.surface(&PreparedRay::new(*ray), hit);
        Some(Self {
            t: hit.t.to_f64(),
            point: surface.point.to_f64(),
            normal: surface.normal.to_f64(),
            error: surface.error.to_f64(),
        })
    }

    fn by_textbook<R: Real>(shape: &AnyShape<R>, ray: &Ray<R>) -> Option<Self> {
        let t = textbook::intersect(shape, ray)?;
        Some(Self {
            t: t.into(),
            point: (ray.origin.to_f32() + ray.direction.to_f32() * t).as_dvec3(),
            normal: DVec3::ONE,
            error: f64::INFINITY,
        })
    }
}

/// Trial of a case in one precision: the settings in which it is judged, and the outcomes of its
/// parts so far. The same random numbers make a ray in each setting.
pub struct Trial<R: Real> {
    number: String,
    rays: RayCount,
    /// Linear scans of the scenes.
    scans: Vec<Geometry<R>>,
    /// Trees of the scenes in each setting.
    trees: Vec<Vec<Geometry<R>>>,
    measured: Vec<Measurement>,
    textbook: Vec<CaseOutcome>,
}

impl<R: Real> Trial<R> {
    /// Builds the scans and trees of scenes. The case is then judged by each kernel (instruction
    /// set) that can traverse the trees.
    pub fn build_scenes(&mut self, scenes: &[Vec<AnyShape<R>>]) {
        self.build_scenes_for(scenes, &[BuildQuality::default()], &Kernel::available());
    }

    /// Builds scans and trees as [`Self::build_scenes`]: trees of these qualities in turns, to be
    /// traversed by these kernels. Trees of f64 have a single kernel.
    pub fn build_scenes_for(
        &mut self,
        scenes: &[Vec<AnyShape<R>>],
        qualities: &[BuildQuality],
        kernels: &[Kernel],
    ) {
        let build = |kind: &dyn Fn(usize) -> AcceleratorKind| -> Vec<_> {
            let scenes = scenes.iter().enumerate();
            scenes
                .map(|(scene, shapes)| build_geometry(shapes.iter().copied(), kind(scene)))
                .collect()
        };
        self.scans = build(&|_| AcceleratorKind::Linear);
        let trees = build(&|scene| AcceleratorKind::Tree(qualities[scene % qualities.len()]));
        if !R::IS_SINGLE {
            self.trees = vec![trees];
            return;
        }
        self.trees = vec![trees; kernels.len()];
        self.measured.clear();
        for (trees, &kernel) in self.trees.iter_mut().zip(kernels) {
            trees.iter_mut().for_each(|tree| tree.set_kernel(kernel));
            let setting = format!("robust, {kernel:?}").to_lowercase();
            self.measured.push(Measurement::new(setting));
        }
    }

    /// Judges a part of the case. `rays` holds the seed of the random numbers and the number of
    /// rays, here and below. The function `f` returns the verdict of each setting, and possibly that
    /// of the textbook.
    fn judge_settings(
        &mut self,
        part: &str,
        rays: (u64, u32),
        f: impl Fn(&mut CaseRng) -> Vec<Verdict> + Sync,
    ) {
        let case = format!("{} {part}", self.number);
        let settings = self.measured.len() + 1;
        let mut outcomes = judge_settings(case.trim_end(), rays, self.rays, settings, f);
        let textbook = outcomes.pop().filter(|outcome| outcome.judged > 0);
        self.textbook.extend(textbook);
        for (measurement, outcome) in self.measured.iter_mut().zip(outcomes) {
            measurement.parts.push(outcome);
        }
    }

    /// Judges a part of a case without trees. The function `f` returns the verdict about the
    /// library, and about the textbook if the case has its formula.
    pub fn judge<const N: usize>(
        &mut self,
        part: &str,
        rays: (u64, u32),
        f: impl Fn(&mut CaseRng) -> [Verdict; N] + Sync,
    ) {
        self.judge_settings(part, rays, |rng| f(rng).into());
    }

    /// Judges textbook formulas alone, on rays that `f` draws from the random numbers of the same
    /// part. They compute in f32, so only the trial in `robust` measures them.
    pub fn judge_textbook(
        &mut self,
        part: &str,
        (seed, count): (u64, u32),
        f: impl Fn(&mut CaseRng) -> Verdict + Sync,
    ) {
        if R::IS_SINGLE {
            self.textbook
                .push(judge_rays(part, seed, count, self.rays, f));
        }
    }

    /// Judges a figure of the trees, such as their depth, by its greatest value.
    pub fn judge_figure(
        &mut self,
        name: &str,
        most: f64,
        figure: impl Fn(&[Geometry<R>]) -> f64 + Sync,
    ) {
        let trees = core::mem::take(&mut self.trees);
        self.judge_settings(name, (0, 1), |_| {
            let judge = |trees: &Vec<_>| Verdict::from_error(figure(trees), most, || name);
            trees.iter().map(judge).collect()
        });
        self.trees = trees;
    }

    /// Judges rays through the scenes. The function `draw` returns the rays of a draw, with the
    /// hits that each tree must find. It has the linear scans.
    pub fn judge_rays<T: AsRef<[TestRay<R>]>>(
        &mut self,
        part: &str,
        rays: (u64, u32),
        draw: impl Fn(&mut CaseRng, &[Geometry<R>]) -> Result<T, Verdict> + Sync,
    ) {
        let (scans, trees) = (
            core::mem::take(&mut self.scans),
            core::mem::take(&mut self.trees),
        );
        self.judge_settings(part, rays, |rng| match draw(rng, &scans) {
            Err(verdict) => vec![verdict; trees.len()],
            Ok(test_rays) => {
                let judge = |trees: &Vec<Geometry<R>>| {
                    let test_rays = test_rays.as_ref().iter();
                    test_rays.fold(Verdict::Right(0.0), |verdict, test_ray| {
                        verdict.and_then(|| test_ray.judge_geometry(&trees[test_ray.scene]))
                    })
                };
                trees.iter().map(judge).collect()
            }
        });
        (self.scans, self.trees) = (scans, trees);
    }

    /// Judges hits of single shapes. The function `draw` returns a shape, a ray, and a function
    /// that judges what the library finds, and what the textbook finds if `has_textbook`.
    pub fn judge_shapes<J: Fn(Option<FormulaHit>) -> Verdict>(
        &mut self,
        part: &str,
        rays: (u64, u32),
        has_textbook: bool,
        draw: impl Fn(&mut CaseRng) -> Result<(AnyShape<R>, Ray<R>, J), Verdict> + Sync,
    ) {
        let has_textbook = has_textbook && R::IS_SINGLE;
        self.judge_settings(part, rays, |rng| match draw(rng) {
            Err(verdict) => vec![verdict; 1 + usize::from(has_textbook)],
            Ok((shape, ray, judge)) => {
                let judge =
                    |hit| judge(hit).with_detail(|| format!("{} {shape:?}", format_ray_bits(&ray)));
                let mut verdicts = vec![judge(FormulaHit::by_library(&shape, &ray))];
                if has_textbook {
                    verdicts.push(judge(FormulaHit::by_textbook(&shape, &ray)));
                }
                verdicts
            }
        });
    }

    /// Returns the measurements of a case in this precision, and the textbook's outcomes.
    fn measure(
        number: &str,
        rays: RayCount,
        case: fn(&mut Self),
    ) -> (Vec<Measurement>, Vec<CaseOutcome>) {
        let precision = if R::IS_SINGLE { "robust" } else { "reference" };
        let mut trial = Self {
            number: number.to_owned(),
            rays,
            scans: vec![],
            trees: vec![],
            measured: vec![Measurement::new(precision.to_owned())],
            textbook: vec![],
        };
        case(&mut trial);
        (trial.measured, trial.textbook)
    }
}

/// Measures a case, given by its function in both precisions. Textbook formulas, which compute in
/// f32, are measured on the rays of `robust`.
pub fn measure_precisions(
    number: &str,
    rays: RayCount,
    robust: fn(&mut Trial<f32>),
    reference: fn(&mut Trial<f64>),
) -> Vec<Measurement> {
    let (mut measured, textbook) = Trial::measure(number, rays, robust);
    measured.extend(Trial::measure(number, rays, reference).0);
    for measurement in &mut measured {
        measurement.textbook.clone_from(&textbook);
    }
    measured
}
