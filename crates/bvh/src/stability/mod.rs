//! Hard cases, judged by oracles of higher accuracy: tests check the library by them, and programs
//! tabulate them. Cases that textbook formulas fail take the arithmetic as a parameter, so that
//! both can be compared.

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

/// The distance of the closest hit of a ray with a shape by some arithmetic, in front of the origin
/// and from either side.
pub type Intersect<R> = fn(&AnyShape<R>, &Ray<R>) -> Option<R>;

/// The library's closest hit.
pub fn intersect<R: Real>(shape: &AnyShape<R>, ray: &Ray<R>) -> Option<R> {
    judge::hit(shape, ray).map(|hit| hit.t)
}

/// Outcome of a case in one setting.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// The precision, and the kernel if several can traverse the tree, as in `robust, avx2`; or the
    /// part of a case with several bounds.
    pub setting: String,
    /// Outcome of the library.
    pub outcome: Outcome,
    /// Outcome of the textbook formulas on the same rays, if the case has them.
    pub textbook: Option<Outcome>,
}

impl Measurement {
    /// The measurement of one part of a case, whose name follows the precision.
    #[must_use]
    pub fn of_part(self, part: &str) -> Self {
        Self {
            setting: format!("{}, {part}", self.setting),
            ..self
        }
    }
}

/// Name of a precision.
fn precision<R: Real>() -> &'static str {
    if R::IS_SINGLE { "robust" } else { "reference" }
}

/// A case in one precision, without kernels.
pub fn by_shapes<R: Real>(outcome: Outcome) -> Measurement {
    Measurement {
        setting: precision::<R>().to_owned(),
        outcome,
        textbook: None,
    }
}

/// A case by each kernel that can traverse its trees: one kernel for trees of f64.
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
    /// A case in both precisions.
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
