//! The command line: what each command prints, which exit code it ends with, what it says about mistakes.

mod accuracy;
mod beginnings;
mod bench;
mod choices;
mod compare;
mod denoise;
mod environment;
mod film_limits;
mod films;
mod help;
mod losses;
mod machines;
mod manners;
mod masks;
mod mistakes;
mod models;
mod overwriting;
mod own_error;
mod page;
mod render;
mod reports;
mod scenes;
mod series;
mod stability;
mod stress;
mod thumbs;
