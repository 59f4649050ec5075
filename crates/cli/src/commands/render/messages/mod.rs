//! Messages of `render` about a scene and its picture: effects left out, objects lost, lights that
//! no path reaches, the error, and with `-v` times and counts.

mod error;
mod names;
mod picture;
mod precision;
mod scene;

pub use error::{describe_shortfall, note_denoising, report_error};
pub use picture::{
    format_details, note_chosen_exposure, note_exposure, note_headlight, note_lost_samples,
    note_stray_parts, note_unreached_lights,
};
pub use precision::{note_closed_gaps, note_light_leaks};
pub use scene::{
    note_clamp_bias, note_effects, note_lost_objects, note_missing_edges, note_unresolved_objects,
};
