//! The real program, run as a user runs it. One binary with modules, so that it links once.

mod bits;
mod cli;
mod effects;
mod emitters;
mod gallery;
mod instances;
mod reference;
mod support;
