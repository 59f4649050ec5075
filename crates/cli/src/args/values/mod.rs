//! Parsers of flags whose values are more than a number or a word: sizes, vectors, rectangles,
//! assignments, amounts of memory.
//!
//! The error of each parser names the expected form; clap adds the flag and its value.

mod numbers;
mod picture;
mod scene;
mod views;

pub use numbers::{
    parse_assignment, parse_bytes, parse_duration, parse_field_of_view, parse_max_error,
    parse_non_negative, parse_number, parse_samples, parse_significance_level, parse_triple,
    parse_zoom,
};
pub use picture::{
    parse_background, parse_crop, parse_exposure, parse_fit, parse_share, parse_size,
    parse_tev_address,
};
pub use scene::{
    BackdropChoice, MaterialChoice, UpDirection, environment_parser, list_switchable_effects,
    parse_backdrop, parse_effect, parse_ground, parse_material, parse_section, parse_up_direction,
    parse_warning_code,
};
pub use views::{parse_frame_times, parse_view, parse_views};

#[cfg(test)]
mod tests;
