//! The real program, run as a user runs it. All tests are modules of one binary, so that it links
//! once.
#![expect(
    clippy::print_stderr,
    reason = "a test says what it measured, and what it skipped"
)]

mod bits;
mod circles;
mod cli;
mod docs;
mod effects;
mod emitters;
mod far;
mod gallery;
mod instances;
mod intervals;
mod kept;
mod lights;
mod links;
mod machine_code;
mod many;
mod memory;
mod models;
mod pairs;
mod reference;
mod reports;
mod room;
mod stability;
mod support;
mod symmetry;
mod uv_sets;
