//! Builds: none takes much longer than another of as many primitives, every tree culls, and no tree
//! changes a hit.

mod agreement;
mod families;
mod many;
mod rooms;
mod silhouettes;
mod terrains;
mod work;
