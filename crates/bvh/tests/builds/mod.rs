//! Builds: that none takes much longer than another of as many primitives, that their trees are of
//! use, and that no tree, of whatever scene, changes an answer.

mod answers;
mod families;
mod rooms;
mod silhouettes;
mod terrains;
mod work;
