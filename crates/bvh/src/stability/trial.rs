//! Trial of a hard case: the loops over its rays, the kernels of its trees, and the textbook's
//! formulas, which every case shares.

use glam::DVec3;
use rayon::prelude::*;

use super::textbook;
use super::verdicts::*;
use crate::shapes::AnyShape;
use crate::{
    AcceleratorKind, BuildQuality, Geometry, Hit, Interval, Kernel, PreparedRay, PrimitiveSet, Ray,
    Real, Shape, Vector, Visibility,
};

/// Name of the setting of textbook formulas among the outcomes of a case.
pub const TEXTBOOK: &str = "textbook";

/// Builds a geometry of shapes.
///
/// # Panics
/// For a shape that is not finite.
pub fn build_geometry<R: Real>(shapes: &[AnyShape<R>], kind: AcceleratorKind) -> Geometry<R> {
    let mut set = PrimitiveSet::default();
    for &shape in shapes {
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
    /// Closest hit that the ray must find; `None` if any hit will do.
    pub expected: Option<Option<Hit<R>>>,
}

impl<R: Real> TestRay<R> {
    /// Creates a ray that must hit something.
    pub fn with_any_hit(scene: usize, ray: Ray<f64>) -> Self {
        let (ray, range) = (to_precision(ray), Interval::positive());
        Self {
            scene,
            ray,
            range,
            expected: None,
        }
    }

    /// Returns the closest hit that the ray must find.
    pub fn hit(&self) -> Option<Hit<R>> {
        self.expected.flatten()
    }

    /// Judges both queries of a geometry: the closest hit, and whether there is any.
    fn judge_geometry(&self, geometry: &Geometry<R>) -> Verdict {
        let Self { ray, range, .. } = self;
        let hit = geometry.closest(ray, *range, &mut ());
        let is_any = geometry.occluded(ray, *range, &mut |_| true, &mut ());
        let is_right = match self.expected {
            None => is_any,
            Some(expected) => hit == expected && hit.is_none_or(|hit| range.contains(hit.t)),
        };
        require(is_right && is_any == hit.is_some(), || {
            format!("the closest hit is {hit:?}, the any-hit query returns {is_any}, for {self:?}")
        })
    }
}

/// Linear scans of the scenes of a trial.
pub struct Scans<R: Real>(Vec<Geometry<R>>);

impl<R: Real> Scans<R> {
    /// Number of scenes.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Creates a ray that must find the hit of the linear scan.
    pub fn test_ray(&self, scene: usize, ray: Ray<f64>, range: Interval<R>) -> TestRay<R> {
        let ray = to_precision(ray);
        let expected = Some(self.0[scene].closest(&ray, range, &mut ()));
        TestRay {
            scene,
            ray,
            range,
            expected,
        }
    }
}

/// Hit of a shape as a formula finds it, in f64.
#[derive(Clone, Copy, Debug)]
pub struct FormulaHit {
    /// Distance along the ray, in units of the direction's length.
    pub t: f64,
    /// Point of the ray at this distance.
    pub on_ray: DVec3,
    /// Surface point.
    pub point: DVec3,
    /// Normal of the surface; without meaning for a textbook formula.
    pub normal: DVec3,
    /// Error bound that the formula states; infinite for a textbook formula.
    pub error: f64,
}

/// Formulas that a part of a case judges: for each, whether it is the textbook's.
pub type Formulas = &'static [bool];

/// The library's formula alone.
pub const LIBRARY: Formulas = &[false];

/// The library's formula, and beside it the textbook's.
pub const BOTH: Formulas = &[false, true];

/// The textbook's formula alone, on the rays that the library's trees are judged by.
pub const BESIDE_TREES: Formulas = &[true];

/// The formula that is judged, and what it was last asked, for messages.
#[derive(Debug)]
pub struct Formula<R: Real> {
    /// Whether it is the textbook's, in f32, and not the library's.
    pub is_textbook: bool,
    asked: Option<(AnyShape<R>, Ray<R>)>,
}

impl<R: Real> Formula<R> {
    /// Finds the hit of a shape.
    pub fn intersect(
        &mut self,
        shape: impl Into<AnyShape<R>>,
        ray: Ray<f64>,
    ) -> Option<FormulaHit> {
        let (shape, exact, ray) = (shape.into(), ray, to_precision(ray));
        self.asked = Some((shape, ray));
        if self.is_textbook {
            let t = textbook::intersect(&shape, &ray)?;
            return Some(FormulaHit {
                t: t.into(),
                on_ray: exact.at(t.into()),
                point: (ray.origin.to_f32() + ray.direction.to_f32() * t).as_dvec3(),
                normal: DVec3::ONE,
                error: f64::INFINITY,
            });
        }
        let hit = nearest_hit(&shape, &ray)?;
        let surface = shape.surface(&PreparedRay::new(ray), hit);
        Some(FormulaHit {
            t: hit.t.to_f64(),
            on_ray: exact.at(hit.t.to_f64()),
            point: surface.point.to_f64(),
            normal: surface.normal.to_f64(),
            error: surface.error.to_f64(),
        })
    }
}

/// A case: its number, and the function that builds its scenes, and draws and judges its rays.
pub type Case<R> = (&'static str, fn(&mut Trial<R>));

/// Trial of a case in one precision. The same random numbers make a ray in each setting.
pub struct Trial<R: Real> {
    number: &'static str,
    rays: RayCount,
    scans: Scans<R>,
    /// Trees of the scenes in each setting.
    trees: Vec<(String, Vec<Geometry<R>>)>,
    outcomes: Vec<CaseOutcome>,
}

impl<R: Real> Trial<R> {
    /// Name of the precision.
    const PRECISION: &'static str = if R::IS_SINGLE { "robust" } else { "reference" };

    /// Builds the scans and trees of scenes: trees of the default quality for the first, and of
    /// every quality in turns. The case is then judged by each kernel (instruction set) that can
    /// traverse the trees: for f64 a single one.
    pub fn build_scenes(&mut self, scenes: Vec<Vec<AnyShape<R>>>) {
        let scan = |shapes: &Vec<_>| build_geometry(shapes, AcceleratorKind::Linear);
        self.scans = Scans(scenes.iter().map(scan).collect());
        let tree = |(shapes, &quality): (&Vec<_>, _)| {
            build_geometry(shapes, AcceleratorKind::Tree(quality))
        };
        let qualities = BuildQuality::ALL.iter().cycle().skip(1);
        let trees: Vec<_> = scenes.iter().zip(qualities).map(tree).collect();
        let by_kernel = |kernel: Kernel| {
            let mut trees = trees.clone();
            trees.iter_mut().for_each(|tree| tree.set_kernel(kernel));
            (format!("robust, {kernel:?}").to_lowercase(), trees)
        };
        self.trees = if R::IS_SINGLE {
            Kernel::available().into_iter().map(by_kernel).collect()
        } else {
            vec![(Self::PRECISION.to_owned(), trees)]
        };
    }

    /// Adds the outcome of a part in a setting; `judge` returns the verdict about the ray with an
    /// index.
    fn add_outcome(
        &mut self,
        setting: &str,
        part: &str,
        count: u32,
        judge: impl Fn(u64) -> Verdict + Sync,
    ) {
        let case = format!("{} {part}", self.number);
        let outcome = judge_indices(case.trim_end(), count, self.rays, judge);
        self.outcomes.push(CaseOutcome {
            setting: setting.to_owned(),
            ..outcome
        });
    }

    /// Judges a part of the case without trees. `rays` holds the seed of the random numbers and the
    /// number of rays, here and below. The function `f` returns the verdict about each of the
    /// formulas; those of the textbook compute in f32, so only the trial in `robust` judges them.
    pub fn judge(
        &mut self,
        part: &str,
        (seed, count): (u64, u32),
        formulas: Formulas,
        f: impl Fn(&mut CaseRng, &mut Formula<R>) -> Verdict + Sync,
    ) {
        for &is_textbook in formulas
            .iter()
            .filter(|&&is_textbook| R::IS_SINGLE || !is_textbook)
        {
            let setting = if is_textbook {
                TEXTBOOK
            } else {
                Self::PRECISION
            };
            self.add_outcome(setting, part, count, |index| {
                let mut formula = Formula {
                    is_textbook,
                    asked: None,
                };
                match (
                    f(&mut CaseRng::new(seed, index), &mut formula),
                    formula.asked,
                ) {
                    (Verdict::Wrong(label), Some(asked)) => {
                        Verdict::Wrong(format!("{label}, for {asked:?}"))
                    }
                    (verdict, _) => verdict,
                }
            });
        }
    }

    /// Judges rays through the scenes. The function `draw` returns the rays of a draw, with the
    /// hits that each tree must find. It has the linear scans.
    pub fn judge_rays<T: AsRef<[TestRay<R>]> + Send + Sync>(
        &mut self,
        part: &str,
        (seed, count): (u64, u32),
        draw: impl Fn(&mut CaseRng, &Scans<R>) -> Result<T, Verdict> + Sync,
    ) {
        let draw = |index: u32| draw(&mut CaseRng::new(seed, index.into()), &self.scans);
        let draws = (0..self.rays.limit_ray_count(count)).into_par_iter();
        let draws: Vec<_> = draws.map(draw).collect();
        let settings = core::mem::take(&mut self.trees);
        for (setting, trees) in &settings {
            self.add_outcome(setting, part, count, |index| match &draws[index as usize] {
                Err(verdict) => verdict.clone(),
                Ok(rays) => {
                    let judge = |ray: &TestRay<R>| ray.judge_geometry(&trees[ray.scene]);
                    rays.as_ref()
                        .iter()
                        .map(judge)
                        .reduce(|a, b| a & b)
                        .unwrap_or(Verdict::Skipped)
                }
            });
        }
        self.trees = settings;
    }
}

/// Measures the case with this number in both precisions, each with its table of cases. Returns an
/// outcome for each part and setting; `None` for an unknown number.
pub fn measure_precisions(
    number: &str,
    rays: RayCount,
    robust: &[Case<f32>],
    reference: &[Case<f64>],
) -> Option<Vec<CaseOutcome>> {
    fn measure<R: Real>(
        number: &str,
        rays: RayCount,
        cases: &[Case<R>],
    ) -> Option<Vec<CaseOutcome>> {
        let (number, case) = cases.iter().find(|case| case.0 == number)?;
        let mut trial = Trial {
            number,
            rays,
            scans: Scans(vec![]),
            trees: vec![],
            outcomes: vec![],
        };
        case(&mut trial);
        Some(trial.outcomes)
    }
    Some(
        [
            measure(number, rays, robust)?,
            measure(number, rays, reference)?,
        ]
        .concat(),
    )
}
