//! Single values by hand: what one ray sees, one number of a camera, a sampler or a layer, against
//! closed forms. Pictures that are compared with the program's own pictures stay silent where both
//! are wrong; these say which term is.
//!
//! Only the public interface is used, so that the inside can be rebuilt under these tests.

mod accuracy;
mod alpha;
mod cameras;
mod classic;
mod counts;
mod displays;
mod effects;
mod emitters;
mod expressions;
mod films;
mod furnaces;
mod generators;
mod glass;
mod highlights;
mod inputs;
mod interfaces;
mod lamps;
mod layers;
mod lights;
mod media;
mod meshes;
mod mip_maps;
mod motion;
mod nested;
mod normal_maps;
mod offsets;
mod paths;
mod physical;
mod random_scenes;
mod reflections;
mod rungs;
mod sampler;
mod shadows;
mod shut_away;
mod skies;
mod sky_light;
mod stress;
mod support;
mod terminators;
mod textures;
mod watching;
