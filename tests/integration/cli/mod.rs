//! The command line: what each command prints, which exit code it ends with, what it says about mistakes.

mod help;
mod mistakes;
mod render;
mod scenes;
