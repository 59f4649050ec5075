//! Numerically hard cases of ray intersection: rays for which textbook formulas lose digits or
//! hits.
//!
//! Each case has a number, such as P01 or T03. It also has an oracle of higher accuracy, which
//! judges the library's results. A case is a function that builds its scenes, and draws and judges
//! its rays; a [`trial::Trial`] has the loops over rays, kernels and textbook formulas. Tests run
//! the cases, and `raywright stability` prints their outcomes.

mod boxes;
pub mod closed_meshes;
pub mod cost_comparison;
mod planes;
pub mod quadrics;
pub mod sphere;
pub mod textbook;
mod torus;
pub mod tree_and_scan;
pub mod trial;
pub mod triangles;
pub mod verdicts;

/// What the functions of cases use.
pub mod prelude {
    pub use glam::{DVec3, Vec3};

    pub use super::trial::*;
    pub use super::verdicts::*;
    pub use crate::shapes::*;
    pub use crate::*;
}

use self::prelude::*;

/// Defines a function that measures a case in both precisions and by every kernel of this
/// processor, from a table of the cases' numbers and functions.
macro_rules! cases {
    ($($number:literal => $module:ident::$case:ident,)*) => {
        /// Measures a case in both precisions and by every kernel of this processor; `None` for an
        /// unknown case number.
        pub fn measure_case(number: &str, rays: RayCount) -> Option<Vec<Measurement>> {
            Some(match number {
                $($number => measure_precisions($number, rays, $module::$case, $module::$case),)*
                _ => return None,
            })
        }
    };
}

cases! {
    "P01" => sphere::far_spheres,
    "P02" => sphere::surface_points,
    "P07" => planes::grazing_planes,
    "P08" => planes::distant_checkerboard,
    "P13" => quadrics::vanishing_coefficients,
    "P15" => quadrics::extreme_ellipsoids,
    "P17" => torus::far_tori,
    "P20" => triangles::nearly_parallel_rays,
    "P21" => triangles::shared_edges,
    "P22" => triangles::flipped_faces,
    "T01" => boxes::rays_along_faces,
    "T02" => boxes::rays_with_signed_zeros,
    "T03" => closed_meshes::lattices,
    "T04" => boxes::rays_with_tiny_components,
    "T05" => boxes::unnormalised_rays,
    "T06" => closed_meshes::mesh_sizes,
    "T07" => closed_meshes::distant_meshes,
    "T08" => boxes::boxes_of_mixed_sizes,
    "T10" => closed_meshes::box_inflation,
    "T12" => tree_and_scan::nested_boxes,
    "T14" => tree_and_scan::plane_beside_tree,
    "T15" => tree_and_scan::tiny_scenes,
    "T16" => boxes::rays_from_faces,
    "T17" => tree_and_scan::ranges_that_end_at_hits,
    "T19" => tree_and_scan::distances_in_interval,
    "T20" => tree_and_scan::tree_against_scan,
}
