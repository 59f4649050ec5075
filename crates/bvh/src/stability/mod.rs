//! Numerically hard cases of ray intersection: rays for which textbook formulas lose digits or
//! hits.
//!
//! Each case has a number, such as P01 or T03. It also has an oracle of higher accuracy, which
//! judges the library's results. Tests run the cases, and `raywright stability` prints a table of
//! their outcomes. Some cases also measure textbook formulas, which fail. Their functions have the
//! intersection function as a parameter.

mod boxes;
mod closed_meshes;
pub mod cost_comparison;
mod planes;
pub mod quadrics;
pub mod shapes;
pub mod sphere;
pub mod textbook;
pub mod torus;
mod tree_and_scan;
pub mod triangles;
pub mod verdicts;

use crate::shapes::AnyShape;
use crate::{Geometry, Kernel, Ray, Real};

use self::verdicts::{CaseOutcome, RayCount};

/// Intersection function under test. It returns the distance of the closest hit of a ray with a
/// shape, from either side. Only hits in front of the ray's origin count.
pub type IntersectFunction<R> = fn(&AnyShape<R>, &Ray<R>) -> Option<R>;

/// Returns the distance of the closest hit by the library's intersection test; `None` for a miss.
/// Cases compare this [`IntersectFunction`] with [`textbook::intersect`].
pub fn intersect_by_library<R: Real>(shape: &AnyShape<R>, ray: &Ray<R>) -> Option<R> {
    verdicts::nearest_hit(shape, ray).map(|hit| hit.t)
}

/// Outcome of a case for one setting: a precision and, for trees, a kernel (instruction set).
#[derive(Clone, Debug)]
pub struct Measurement {
    /// Name of the setting: the precision and, if several kernels can traverse the tree, the
    /// kernel, as in `robust, avx2`. The name of a part of the case may follow.
    pub setting: String,
    /// Outcome of the case for the library's intersection tests.
    pub outcome: CaseOutcome,
    /// Outcome of the case for textbook formulas on the same rays; `None` if the case has no
    /// textbook formulas.
    pub textbook: Option<CaseOutcome>,
}

impl Measurement {
    /// Appends the name of a part of the case to the name of the setting.
    #[must_use]
    pub fn with_part_name(self, part: &str) -> Self {
        Self {
            setting: format!("{}, {part}", self.setting),
            ..self
        }
    }
}

/// Returns the name of the precision in which primitives are stored as `R`: `robust` for f32,
/// `reference` for f64.
fn precision_name<R: Real>() -> &'static str {
    if R::IS_SINGLE { "robust" } else { "reference" }
}

/// Creates the measurement of a case that tests shapes without a tree. The name of its setting is
/// the precision alone: `robust` for `R` = f32, `reference` for f64.
pub fn create_treeless_measurement<R: Real>(outcome: CaseOutcome) -> Measurement {
    Measurement {
        setting: precision_name::<R>().to_owned(),
        outcome,
        textbook: None,
    }
}

/// Measures a case with each kernel (instruction set) that can traverse its trees. Trees of f64
/// have only one kernel. The function selects a kernel for all trees, and then calls `judged` for
/// the outcome of the case.
pub fn measure_by_each_kernel<R: Real>(
    mut trees: Vec<Geometry<R>>,
    judged: impl Fn(&[Geometry<R>]) -> CaseOutcome,
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
            setting: format!("{}{of_kernel}", precision_name::<R>()),
            outcome: judged(&trees),
            textbook: None,
        }
    };
    kernels.into_iter().map(by).collect()
}

/// Measures a case in both precisions and by every kernel of this processor; `None` for an unknown
/// case number.
pub fn measure_case(number: &str, rays: RayCount) -> Option<Vec<Measurement>> {
    /// Measures a case in both precisions, f32 and f64.
    macro_rules! both {
        ($module:ident::$of:ident) => {
            [$module::$of::<f32>(rays), $module::$of::<f64>(rays)].concat()
        };
    }
    Some(match number {
        "P01" => shapes::measure_far_spheres(rays),
        "P02" => shapes::measure_surface_points(rays),
        "P07" => both!(planes::measure_grazing_planes),
        "P08" => both!(planes::measure_distant_checkerboard),
        "P13" => shapes::measure_vanishing_coefficients(rays),
        "P15" => shapes::measure_extreme_ellipsoids(rays),
        "P17" => shapes::measure_far_tori(rays),
        "P20" => both!(triangles::measure_nearly_parallel_rays),
        "P21" => shapes::measure_shared_edges(rays),
        "P22" => shapes::measure_flipped_faces(rays),
        "T01" => both!(boxes::measure_rays_along_faces),
        "T02" => both!(boxes::measure_rays_with_signed_zeros),
        "T03" => both!(closed_meshes::measure_lattices),
        "T04" => both!(boxes::measure_rays_with_tiny_components),
        "T05" => both!(boxes::measure_unnormalised_rays),
        "T06" => both!(closed_meshes::measure_mesh_sizes),
        "T07" => both!(closed_meshes::measure_distant_meshes),
        "T08" => both!(boxes::measure_boxes_of_mixed_sizes),
        "T10" => both!(closed_meshes::measure_box_inflation),
        "T12" => both!(tree_and_scan::measure_nested_boxes),
        "T14" => both!(tree_and_scan::measure_plane_beside_tree),
        "T15" => both!(tree_and_scan::measure_tiny_scenes),
        "T16" => both!(boxes::measure_rays_from_faces),
        "T17" => both!(tree_and_scan::measure_ranges_that_end_at_hits),
        "T19" => both!(tree_and_scan::measure_distances_in_interval),
        "T20" => both!(tree_and_scan::measure_tree_against_scan),
        _ => return None,
    })
}
