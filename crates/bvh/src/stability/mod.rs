//! Hard cases of ray intersection, judged by oracles of higher accuracy. Tests check the library by
//! them, and programs tabulate the results. A case that textbook formulas fail takes the
//! intersection function as a parameter, so that textbook and library can be compared.

pub mod boxes;
pub mod closed;
pub mod contest;
pub mod judge;
pub mod many;
pub mod planes;
pub mod quadrics;
pub mod shapes;
pub mod sphere;
pub mod textbook;
pub mod torus;
pub mod triangles;

use crate::shapes::AnyShape;
use crate::{Geometry, Kernel, Ray, Real};

use self::judge::{Outcome, RayCount};

/// Intersection function under test: returns the distance of the closest hit of a ray with a shape,
/// in front of the origin and from either side.
pub type Intersect<R> = fn(&AnyShape<R>, &Ray<R>) -> Option<R>;

/// Returns the distance of the closest hit by the library.
pub fn intersect<R: Real>(shape: &AnyShape<R>, ray: &Ray<R>) -> Option<R> {
    judge::hit(shape, ray).map(|hit| hit.t)
}

/// Outcome of a case in one setting: a precision, and possibly a kernel.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// Name of the setting: the precision, and the kernel if several can traverse the tree, as in
    /// `robust, avx2`; for a part of a case, also the name of the part.
    pub setting: String,
    /// Outcome of the library's intersections.
    pub outcome: Outcome,
    /// Outcome of the textbook formulas on the same rays, if the case has such formulas.
    pub textbook: Option<Outcome>,
}

impl Measurement {
    /// Adds the name of a part of the case to the setting.
    #[must_use]
    pub fn of_part(self, part: &str) -> Self {
        Self {
            setting: format!("{}, {part}", self.setting),
            ..self
        }
    }
}

/// Returns the name of the precision that stores the scalar: `robust` for f32, `reference` for f64.
fn precision<R: Real>() -> &'static str {
    if R::IS_SINGLE { "robust" } else { "reference" }
}

/// Creates the measurement of a case in one precision, for shapes that are intersected without a
/// tree.
pub fn by_shapes<R: Real>(outcome: Outcome) -> Measurement {
    Measurement {
        setting: precision::<R>().to_owned(),
        outcome,
        textbook: None,
    }
}

/// Measures a case with each kernel that can traverse its trees. Trees of f64 have only one kernel.
/// `judged` returns the outcome for the trees, with the kernel selected.
pub fn by_each_kernel<R: Real>(
    mut trees: Vec<Geometry<R>>,
    judged: impl Fn(&[Geometry<R>]) -> Outcome,
) -> Vec<Measurement> {
    let kernels = if R::IS_SINGLE {
        Kernel::available()
    } else {
        vec![Kernel::Portable]
    };
    let by = |kernel: Kernel| {
        trees.iter_mut().for_each(|tree| tree.set_kernel(kernel));
        let of_kernel = if R::IS_SINGLE {
            format!(", {kernel:?}").to_lowercase()
        } else {
            String::new()
        };
        Measurement {
            setting: format!("{}{of_kernel}", precision::<R>()),
            outcome: judged(&trees),
            textbook: None,
        }
    };
    kernels.into_iter().map(by).collect()
}

/// Measures a case in both precisions and by every kernel of this processor; `None` for an unknown
/// case number.
pub fn measure(number: &str, rays: RayCount) -> Option<Vec<Measurement>> {
    /// Measures a case in both precisions.
    macro_rules! both {
        ($module:ident::$of:ident) => {
            [$module::$of::<f32>(rays), $module::$of::<f64>(rays)].concat()
        };
    }
    Some(match number {
        "P01" => shapes::far_spheres(rays),
        "P02" => shapes::drifts(rays),
        "P07" => both!(planes::grazing),
        "P08" => both!(planes::far_out),
        "P13" => shapes::vanishing_coefficients(rays),
        "P15" => shapes::extreme_ellipsoids(rays),
        "P17" => shapes::far_tori(rays),
        "P20" => both!(triangles::nearly_parallel),
        "P21" => shapes::shared_edges(rays),
        "P22" => shapes::turned_edges(rays),
        "T01" => both!(boxes::along_faces),
        "T02" => both!(boxes::signed_zeros),
        "T03" => both!(closed::lattices),
        "T04" => both!(boxes::tiny_components),
        "T05" => both!(boxes::any_length),
        "T06" => both!(closed::any_size),
        "T07" => both!(closed::far_away),
        "T08" => both!(boxes::mixed_scales),
        "T10" => both!(closed::inflation),
        "T12" => both!(many::nested),
        "T14" => both!(many::planes),
        "T15" => both!(many::few),
        "T16" => both!(boxes::from_faces),
        "T17" => both!(many::interval_ends),
        "T19" => both!(many::within_the_interval),
        "T20" => both!(many::tree_against_scan),
        _ => return None,
    })
}
