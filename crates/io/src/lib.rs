//! Native scene files, models, textures, image and report output: everything between a path and a scene or a picture.
//!
//! Nothing in a file can make this crate panic, hang, read outside the scene's folder or take memory unasked.
#![forbid(unsafe_code)]

mod diagnostic;
mod error;
mod folder;
mod gltf;
mod image_file;
mod import;
mod limits;
mod load;
mod mesh_file;
mod mesh_tools;
mod native;
mod obj;
pub mod output;
pub mod presets;
mod source;
mod uri;

pub use diagnostic::{Diagnostic, Diagnostics, Place};
pub use error::{Error, ErrorKind, Warning};
pub use folder::{Folder, ReadError};
pub use limits::{Limits, human_bytes};
pub use load::{Input, LoadOptions, Loaded, load};
pub use native::{Notation, Overrides};
pub use source::{Format, SourceInfo};
