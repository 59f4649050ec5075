//! Single values by hand: the radiance of one ray, or one number of a camera, a sampler or a layer,
//! against closed forms. Comparisons with the program's own pictures miss errors common to both;
//! these tests show which term is wrong.
//!
//! Only the public interface is used, so that the implementation may change under these tests.

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
mod scattering;
mod shadows;
mod shut_away;
mod skies;
mod sky_light;
mod stress;
mod support;
mod terminators;
mod textures;
mod watching;
