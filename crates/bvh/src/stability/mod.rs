//! Hard cases, judged by oracles that are better than what they judge: tests hold the library to
//! them, and programs make tables of them. Those that the textbook's formulas fail take any
//! arithmetic, so that both can be told apart.

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

use self::judge::{Outcome, Rays};

/// The distance at which an arithmetic has a ray meet a shape first, in front of its origin and
/// from either side.
pub type Intersect<R> = fn(&AnyShape<R>, &Ray<R>) -> Option<R>;

/// That of the library.
pub fn intersect<R: Real>(shape: &AnyShape<R>, ray: &Ray<R>) -> Option<R> {
    judge::hit(shape, ray).map(|hit| hit.t)
}

/// What came out of a case in one setting.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// The precision, and the kernel where several may walk the tree: `robust, avx2`; or the part
    /// of a case that has several bounds.
    pub setting: String,
    /// Of the library.
    pub outcome: Outcome,
    /// Of the textbook's formulas on the same rays, where the case has them.
    pub textbook: Option<Outcome>,
}

impl Measurement {
    /// Of one part of a case, which is said after the precision.
    #[must_use]
    pub fn of_part(self, part: &str) -> Self {
        Self {
            setting: format!("{}, {part}", self.setting),
            ..self
        }
    }
}

/// The name of a precision.
fn precision<R: Real>() -> &'static str {
    if R::IS_SINGLE { "robust" } else { "reference" }
}

/// A case in one precision, where no tree is walked by kernels.
pub fn by_shapes<R: Real>(outcome: Outcome) -> Measurement {
    Measurement {
        setting: precision::<R>().to_owned(),
        outcome,
        textbook: None,
    }
}

/// A case by each kernel that may walk its trees, which is one where what is stored is f64.
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

/// Measures a case in both precisions and by every kernel that this processor has; none where the
/// library has no case of that number.
pub fn measure(number: &str, rays: Rays) -> Option<Vec<Measurement>> {
    /// A case of both precisions.
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
