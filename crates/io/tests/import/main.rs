//! Models of other programs, loaded through the public API: known contents, whole collections, and
//! hostile files.

mod attributes;
mod built;
mod collections;
mod compressed;
mod containers;
mod deformed;
mod glossy;
mod gltf;
mod hostile;
mod keyed;
mod keys;
mod large;
mod limits;
mod malformed;
mod obj;
mod placed;
mod played;
mod ply;
mod pointed;
mod samplers;
mod shared;
mod stl;
mod twins;
mod written;
